import json
import struct

from case import PACK, WORK, CliTest


def read_glb(path):
    """The JSON chunk of a binary glTF file, and the size of its binary chunk."""
    data = path.read_bytes()
    magic, version, size, json_size, json_kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, size, json_kind) == (b"glTF", 2, len(data), b"JSON"), f"{path} is no glTF"
    binary_size, binary_kind = struct.unpack_from("<I4s", data, 20 + json_size)
    assert (binary_kind, 28 + json_size + binary_size) == (b"BIN\0", size), f"{path}: binary chunk"
    return json.loads(data[20 : 20 + json_size]), binary_size


def placed_corners(gltf, index=0, parents=()):
    """The corners of every placed primitive's bounds, in the scene's metres."""
    node = gltf["nodes"][index]
    chain = (*parents, node["matrix"]) if "matrix" in node else parents
    for primitive in gltf["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
        bounds = gltf["accessors"][primitive["attributes"]["POSITION"]]
        for corner in range(8):
            point = [bounds["max" if corner >> axis & 1 else "min"][axis] for axis in range(3)]
            for m in reversed(chain):
                point = [sum(m[4 * k + row] * point[k] for k in range(3)) + m[12 + row] for row in range(3)]
            yield point
    for child in node.get("children", []):
        yield from placed_corners(gltf, child, chain)


class Export(CliTest):
    needs_pack = True

    def test_the_model_stands_upright_in_metres_and_is_whole(self):
        info = self.json_of("info", PACK, "--json")
        low, high = info["bounds_mm"]
        # z up to y up, mm to metres: (x, y, z) -> (x, z, -y) / 1000
        expected_lo = [low[0] / 1000, low[2] / 1000, -high[1] / 1000]
        expected_hi = [high[0] / 1000, high[2] / 1000, -low[1] / 1000]
        slack = 0.05 * max(b - a for a, b in zip(expected_lo, expected_hi))  # the triangles are coarse
        sizes = {}
        for draco in [[], ["--draco"]]:
            report = self.json_of("export", PACK, "-o", WORK / "model.glb", "--json", *draco)
            gltf, sizes[bool(draco)] = read_glb(WORK / "model.glb")
            self.assertEqual((report["nodes"], report["meshes"]), (len(gltf["nodes"]), len(gltf["meshes"])))
            self.assertGreater(report["triangles"], info["faces"])
            corners = list(placed_corners(gltf))
            for axis in range(3):
                lo, hi = min(c[axis] for c in corners), max(c[axis] for c in corners)
                self.assertGreater(lo, expected_lo[axis] - slack)
                self.assertLess(hi, expected_hi[axis] + slack)
                # the pack's bounds are those of its boxes, which are larger than what is in them
                self.assertGreater(hi - lo, 0.7 * (expected_hi[axis] - expected_lo[axis]))
        self.assertLess(sizes[True], sizes[False] / 2)

    def test_errors_have_their_exit_codes(self):
        self.fails(1, "export", PACK, "-o", WORK / "model.obj", says=[".glb"])
        self.fails(2, "export", WORK / "missing.tray", "-o", WORK / "x.glb", says=["missing.tray"])
        self.fails(2, "export", PACK, "-o", WORK / "no_folder" / "x.glb", says=["no_folder", "No such file"])
        self.assertFalse((WORK / "x.glb").exists())
