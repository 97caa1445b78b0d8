"""Installs the build into an empty folder and uses it as a stranger would: the programs from there, and a program of
one's own against the CMake package. usage: install_test.py --build FOLDER --cmake PROGRAM"""

import argparse
import configparser
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from xml.etree import ElementTree

TESTS = Path(__file__).resolve().parent
EXAMPLE = TESTS.parent / "examples" / "trace_one_ray"
SPHERE = TESTS / "models" / "revolved_sphere.step"  # one full sphere: a ray down its axis hits its pole


def run(*command, env=None):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, env=env, check=False)
    if done.returncode != 0:
        sys.exit(f"{command} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def expect(holds, what):
    if not holds:
        sys.exit(f"failed: {what}")


def check_desktop(prefix, pack, folder, environment):
    """A file manager knows a pack by its name and by its first bytes, and has its thumbnail made as it says."""
    share = prefix / "share"
    expect("model/x-trimray:*.tray" in (share / "mime" / "globs2").read_text(encoding="utf-8"), "packs have a type")
    types = ElementTree.parse(share / "mime" / "model" / "x-trimray.xml").getroot()
    icon = types.find("{*}icon").attrib["name"]
    expect((share / "icons/hicolor/scalable/mimetypes" / f"{icon}.svg").exists(), "the type's icon is there")
    magic = (share / "mime" / "magic").read_bytes()
    section = magic[magic.index(b"[80:model/x-trimray]\n"):]
    start = section.index(b">0=") + 3 # then two bytes of length, and the value
    value = section[start + 2:start + 2 + int.from_bytes(section[start:start + 2], "big")]
    expect(len(value) == 12 and pack.read_bytes().startswith(value), f"a pack begins as the type says: {value}")

    application = configparser.ConfigParser(interpolation=None)
    application.optionxform = str
    application.read(share / "applications" / "trimray.desktop")
    words = shlex.split(application["Desktop Entry"]["Exec"])
    expect(words == ["trimray", "view", "%F"], "files are opened by the viewer")
    expect("model/x-trimray" in application["Desktop Entry"]["MimeType"].split(";"), "the viewer opens packs")
    run(prefix / "bin" / words[0], words[1], "--help", env=environment)

    entry = configparser.ConfigParser(interpolation=None)
    entry.read(share / "thumbnailers" / "trimray.thumbnailer")
    entry = entry["Thumbnailer Entry"]
    expect(entry["MimeType"] == "model/x-trimray;", "thumbnails are made of packs")
    picture = Path(folder) / "thumbnail.png"
    told = {"%s": "128", "%i": str(pack), "%o": str(picture)}
    with_programs = {**environment, "PATH": f"{prefix / 'bin'}:{environment['PATH']}"}
    run("sh", "-c", '"$@"', "sh", *[told.get(word, word) for word in shlex.split(entry["Exec"])], env=with_programs)
    header = picture.read_bytes()[:24]
    expect(header.startswith(b"\x89PNG") and header[16:24] == bytes([0, 0, 0, 128] * 2), "the thumbnail is 128 pixels wide")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=Path, required=True)
    parser.add_argument("--cmake", required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="trimray-install-") as folder:
        prefix, example, pack = Path(folder) / "prefix", Path(folder) / "example", Path(folder) / "sphere.tray"
        run(options.cmake, "--install", options.build, "--prefix", prefix)
        # nothing of the build tree is needed: the programs find each other and the picture module by themselves
        clean = {"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8", "TMPDIR": os.environ.get("TMPDIR", "/tmp")}
        trimray = prefix / "bin" / "trimray"
        run(trimray, "pack", SPHERE, "-o", pack, env=clean)
        run(trimray, "render", pack, "-o", Path(folder) / "a.png", "--size", "32x32", "--device", "cpu", env=clean)
        expect((Path(folder) / "a.png").read_bytes().startswith(b"\x89PNG"), "the installed program writes a picture")

        if shutil.which("update-mime-database"):
            check_desktop(prefix, pack, folder, clean)
        else:
            print("no update-mime-database: what file managers read is not tested")

        headers = sorted(path.name for path in (prefix / "include" / "trimray" / "runtime").iterdir())
        expect(headers == ["camera.h", "image_io.h", "scene_look.h", "tracer.h"], f"public headers, found {headers}")
        run(options.cmake, "-S", EXAMPLE, "-B", example, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}",
            "-DCMAKE_BUILD_TYPE=Release")
        run(options.cmake, "--build", example)
        said = run(example / "trace_one_ray", pack, env=clean)
        found = re.fullmatch(r"face 0 of instance 0 at z = (\S+) mm, uv .*, normal \((\S+), (\S+), (\S+)\)\n", said)
        expect(found, said)
        z_mm, *normal = map(float, found.groups())
        # the middle of the bounds is the sphere's within 0.05 mm, and the sphere's radius is 5 mm
        expect(4.999 < z_mm <= 5.0001 and normal[2] > 0.9999, said)
        print(said.strip())


if __name__ == "__main__":
    main()
