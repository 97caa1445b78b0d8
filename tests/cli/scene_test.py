import json

from case import MODEL, OPTIONS, PACK, TESTS, WORK, CliTest, run
from pictures import alphas, read_png


class Scene(CliTest):
    """Scene files, the options that say the same, and pictures from several cameras."""

    needs_pack = True
    SMALL = ("--size", "40x30", "--device", "cpu")

    def scene(self, text, name="scene.json"):
        path = WORK / name
        path.write_text(text if isinstance(text, str) else json.dumps(text))
        return path

    def picture(self, name, *arguments):
        self.ok("render", PACK, "-o", WORK / name, *self.SMALL, *arguments)
        return (WORK / name).read_bytes()

    def plan(self, *arguments):
        """The names of what a picture calls for beyond the pack and its shading."""
        names = [item["name"] for item in self.json_of("render", PACK, "--explain", "--json", "--device", "cpu",
                                                       *arguments)["plan"]]
        plain = [item["name"] for item in self.json_of("render", PACK, "--explain", "--json", "--device", "cpu")["plan"]]
        return [name for name in names if name not in plain]

    def test_a_scene_file_and_the_options_make_the_same_picture(self):
        for key, options in [
                ({"cameras": [{"view": "front"}]}, ["--view", "front"]),
                ({"cameras": [{"eye": [90, -100, 80], "target": [0, 0, 0], "up": [0, 1, 0], "fov_deg": 50}]},
                 ["--eye", "90,-100,80", "--target", "0,0,0", "--up", "0,1,0", "--fov", "50"]),
                ({"background": "#204060"}, ["--background", "#204060"]),
                ({"effects": {"edges": {"lines": "all", "width_px": 3, "color": "#ff0000"}, "silhouettes": True}},
                 ["--edges", "all", "--edge-width", "3", "--edge-color", "#ff0000", "--silhouettes"]),
                ({"effects": {"style": "edges-only"}}, ["--style", "edges-only"]),
                ({"effects": {"antialias": {"samples": 3, "trims": True}}}, ["--samples", "3", "--antialias", "trims"])]:
            plain = self.picture("plain.png")
            made = self.picture("scene.png", "--scene", self.scene(key))
            self.assertEqual(made, self.picture("options.png", *options), key)
            self.assertNotEqual(made, plain, key)

    def test_options_win_over_the_file(self):
        path = self.scene({"cameras": [{"name": "a", "view": "front"}, {"name": "b", "view": "top"}],
                           "background": "white", "effects": {"edges": {"lines": "sharp"}}})
        self.assertEqual(self.picture("a.png", "--scene", path, "--edges", "none", "--background", "transparent"),
                         self.picture("b.png", "--view", "front"))
        self.assertEqual(self.picture("a.png", "--scene", path, "--camera", "b"),
                         self.picture("b.png", "--scene", path, "--view", "top"))
        self.fails(1, "render", PACK, "-o", WORK / "c.png", "--scene", path, "--camera", "c", says=["--camera", "'c'"])
        self.fails(1, "render", PACK, "-o", WORK / "c.png", "--camera", "c", says=["--camera", "no scene file"])

    def test_each_option_is_a_key_of_the_file(self):
        for options, key, effects in [
                (["--light", "direction=1,0,-1,strength=0.5"], {"lights": [{"direction": [1, 0, -1], "strength": 0.5}]},
                 ["lights"]),
                (["--shadows", "hard"], {"effects": {"shadows": {"kind": "hard"}}}, ["lights", "shadows"]),
                (["--shadows", "soft", "--light-samples", "4"], {"effects": {"shadows": {"kind": "soft", "samples": 4}}},
                 ["lights", "shadows", "soft-shadows"]),
                (["--light", "position=0,0,9,radius_mm=2,shadows=true"],
                 {"lights": [{"position": [0, 0, 9], "radius_mm": 2, "shadows": True}]},
                 ["lights", "shadows", "soft-shadows"]),
                (["--occlusion", "8,2.5"], {"effects": {"occlusion": {"samples": 8, "reach_mm": 2.5}}}, ["occlusion"]),
                (["--section", "0,0,1:0,0,1", "--section", "-1,0,0:1,0,0", "--caps", "none"],
                 {"effects": {"section": {"planes": [{"point": [0, 0, 1], "normal": [0, 0, 1]},
                                                     {"point": [-1, 0, 0], "normal": [1, 0, 0]}], "caps": "none"}}},
                 ["section"]),
                (["--material", "color=#aabbcc"], {"materials": [{"color": "#aabbcc"}]}, ["materials"]),
                (["--material", "faces=0+1,mirror=0.5", "--mirror-depth", "3"],
                 {"materials": [{"faces": [0, 1], "mirror": 0.5}], "effects": {"mirror_depth": 3}}, ["mirrors"]),
                (["--xray", "0.25"], {"effects": {"xray": 0.25}}, ["transparency"]),
                (["--map", "curvature-mean", "--map-range", "-1,1"],
                 {"effects": {"map": {"kind": "curvature-mean", "range": [-1, 1]}}}, ["curvature-mean"]),
                (["--map", "zebra", "--map-direction", "1,0,0", "--stripes", "4"],
                 {"effects": {"map": {"kind": "zebra", "direction": [1, 0, 0], "stripes": 4}}}, ["zebra"]),
                (["--map", "draft", "--draft", "5"], {"effects": {"map": {"kind": "draft", "draft_deg": 5}}},
                 ["draft"]),
                (["--ortho", "20"], {"cameras": [{"height_mm": 20}]}, ["orthographic"]),
                (["--ortho", "fit"], {"cameras": [{"parallel": True}]}, ["orthographic"])]:
            self.assertEqual(self.plan(*options), effects, options)
            whys = [self.json_of("render", PACK, "--explain", "--json", "--device", "cpu", *arguments)["plan"]
                    for arguments in (options, ("--scene", self.scene(key)))]
            self.assertEqual(*whys)

    def test_faults_of_the_file_are_named_by_line_and_key(self):
        for text, says in [
                ('{\n "lights": [\n  {"direction": "up"}]}', ["scene.json:3:", "lights[0].direction", '"up"']),
                ('{"efects": {}}', ["scene.json:1:", "efects", "did you mean 'effects'?"]),
                ('{"effects": {\n"xray": 2}}', ["scene.json:2:", "effects.xray", "[0, 1]", "found 2"]),
                ('{"background": "white",\n"background": "black"}', ["scene.json:2:", "twice"]),
                ('{"cameras": [\n', ["scene.json:", "syntax error"]), ("[" * 100000, ["scene.json:1:", "deep"])]:
            self.fails(3, "render", PACK, "-o", WORK / "no.png", "--scene", self.scene(text), says=says)
        self.fails(2, "render", PACK, "-o", WORK / "no.png", "--scene", WORK / "none.json", says=["none.json"])
        self.fails(2, "render", PACK, "-o", WORK / "no.png", "--scene", self.scene({"environment": "sky.hdr"}),
                   says=[str(WORK / "sky.hdr")])
        (WORK / "sky.hdr").write_bytes(b"#?RADIANCE\nnothing")
        self.fails(3, "render", PACK, "-o", WORK / "no.png", "--environment", WORK / "sky.hdr", says=["sky.hdr"])
        self.fails(4, "render", PACK, "-o", WORK / "no.png", "--environment", WORK / "sky.png", says=[".hdr", ".exr"])
        self.assertFalse((WORK / "no.png").exists())

    def test_the_schema_has_the_keys_that_are_read(self):
        schema = json.loads((TESTS.parent / "examples" / "scene.schema.json").read_text())

        def resolved(node):
            return schema["$defs"][node["$ref"].split("/")[-1]] if "$ref" in node else node

        def check(node, around):
            """around(text): a scene file with `text` in the node's place."""
            done = run("render", PACK, "--explain", "--scene", self.scene(around('{"?": 1}')))
            self.assertEqual(done.returncode, 3)
            known = done.stderr.split("there are ")[1].split(" [E")[0].split(", ")
            self.assertEqual(known, list(node["properties"]))
            for key, value in node["properties"].items():
                inner = resolved(value)
                if inner.get("type") == "object":
                    check(inner, lambda text, key=key: around(f'{{"{key}": {text}}}'))
                elif inner.get("type") == "array" and resolved(inner["items"]).get("type") == "object":
                    check(resolved(inner["items"]), lambda text, key=key: around(f'{{"{key}": [{text}]}}'))

        check(schema, lambda text: text)

    def test_wrong_options_are_usage_errors(self):
        for option, value, said in [
                ("--light", "up", "key=value"), ("--light", "direction=0,0,0", "no length"),
                ("--light", "direction=1,2,3,colour=white", "'color'"), ("--light", "direction=1,2,nan", "three numbers"),
                ("--shadows", "sharp", "hard"), ("--light-samples", "0", "4096"), ("--occlusion", "4,0", "reach"),
                ("--occlusion", "-1", "4096"), ("--section", "1,2,3", "x,y,z:nx,ny,nz"),
                ("--section", "1,2,3:0,0,0", "no length"), ("--caps", "full", "filled"), ("--xray", "2", "[0, 1]"),
                ("--material", "part=a", "gives nothing"), ("--material", "opacity=2", "[0, 1]"),
                ("--map", "zebras", "'zebra'"), ("--map-range", "2,1", "below"), ("--stripes", "0", "10000"),
                ("--draft", "90", "90)"), ("--ortho", "0", "number"), ("--ortho", "whole", "number")]:
            says = [option, said] if said != "reach" else [option]
            self.fails(1, "render", PACK, "-o", WORK / "no.png", option, value, says=says)
        self.fails(1, "render", PACK, "-o", WORK / "no.png", "--eye", "1,2,3", "--ortho", "fit", says=["--ortho"])
        self.fails(1, "render", PACK, "-o", WORK / "no.png", "--fov", "30", "--ortho", "3", says=["exclude"])
        self.assertFalse((WORK / "no.png").exists())

    def test_rules_that_match_nothing_are_told(self):
        done = self.ok("render", PACK, "--explain", "--device", "cpu", "--scene",
                       self.scene('{"materials": [{"opacity": 0.5},\n{"part": "No such part", "opacity": 0.5}]}'))
        self.assertEqual(done.stderr, f"trimray: {WORK / 'scene.json'}:2: materials[1]: matches no face of the pack\n")

    def test_explain_says_why_and_makes_a_picture_only_where_one_is_named(self):
        done = self.ok("render", PACK, "--explain", "--device", "cpu", "--edges", "sharp")
        self.assertRegex(done.stdout, r"(?m)^effect +why\n")
        self.assertRegex(done.stdout, r"(?m)^edges +asked for: ")
        report = self.json_of("render", PACK, "-o", WORK / "e.png", *self.SMALL, "--explain", "--json")
        self.assertEqual([item["name"] for item in report["plan"]], report["effects"])
        self.assertTrue((WORK / "e.png").exists())
        self.fails(1, "render", PACK, says=["-o"])

    def test_a_turntable_starts_at_the_camera_and_goes_round(self):
        report = self.json_of("render", PACK, "-o", WORK / "turn_%03d.png", *self.SMALL, "--turntable", 4, "--eye",
                              "90,-100,80", "--target", "0,0,0", "--json")
        files = [WORK / f"turn_{i:03}.png" for i in range(1, 5)]
        self.assertEqual([picture["file"] for picture in report["pictures"]], [str(file) for file in files])
        self.assertEqual(list(report["pictures"][0]),
                         ["file", "camera", "ms_per_frame", "rays_per_second", "uncertified_pixels", "work"])
        self.assertEqual(list(report), ["device", "width", "height", "frames", "trim", "closest", "bytes", "effects",
                                        "pictures"])
        pictures = [file.read_bytes() for file in files]
        self.assertEqual(pictures[0], self.picture("one.png", "--eye", "90,-100,80", "--target", "0,0,0"))
        self.assertEqual(len(set(pictures)), 4)
        self.ok("render", PACK, "-o", WORK / "whole.png", *self.SMALL, "--turntable", 10)
        for i in range(1, 11):
            _, _, rows = read_png(WORK / f"whole_{i:02}.png")
            border = rows[0] + rows[-1] + b"".join(row[:4] + row[-4:] for row in rows)
            self.assertEqual(max(border[3::4]), 0, "framed whole at every step")
            self.assertGreater(alphas(rows).count(255), 0)

    def test_cameras_of_a_file_make_a_picture_each(self):
        cameras = [{"name": "a", "view": "front"}, {"view": "top", "fov_deg": 20}]
        for name, text in [("list.json", cameras), ("scene.json", {"cameras": cameras})]:
            report = self.json_of("render", PACK, "-o", WORK / "from.png", *self.SMALL, "--frames-from",
                                  self.scene(text, name), "--json")
            self.assertEqual([(p["file"], p["camera"]) for p in report["pictures"]],
                             [(str(WORK / "from_1.png"), "a"), (str(WORK / "from_2.png"), "")])
            self.assertEqual((WORK / "from_2.png").read_bytes(), self.picture("b.png", "--view", "top", "--fov", "20"))
        wrong = self.scene([{"view": "front"}, {"view": "frnt"}], "wrong.json")
        self.fails(3, "render", PACK, "-o", WORK / "wrong.png", *self.SMALL, "--frames-from", wrong,
                   says=["wrong.json:1", "cameras[1].view", "'front'"])
        self.fails(3, "render", PACK, "-o", WORK / "wrong.png", *self.SMALL, "--frames-from", self.scene("{}"),
                   says=["no cameras"])
        self.assertEqual(list(WORK.glob("wrong*.png")), [], "a fault in one camera is found before the first picture")
        for pattern in ["a%s.png", "a%d%d.png", "a%.png", "a%03.png"]:
            self.fails(1, "render", PACK, "-o", WORK / pattern, *self.SMALL, "--turntable", 2, says=["-o", "%0Nd"])

    def test_parts_are_hidden_alone_or_moved_apart(self):
        if not OPTIONS.has_pack:
            self.skipTest("no converter in this build")
        pack = WORK / "two.tray"
        self.ok("pack", MODEL.parent / "red_cube_blue_cylinder.step", "-o", pack)

        def picture(*options):
            done = self.ok("render", pack, "-o", WORK / "two.png", "--size", "96x72", "--device", "cpu", *options)
            return (WORK / "two.png").read_bytes(), done.stderr

        whole, _ = picture()
        one, _ = picture("--hide", "#1")
        other, _ = picture("--hide", "#0")
        self.assertEqual(len({whole, one, other}), 3)
        self.assertEqual(picture("--only", "#0")[0], one)
        self.assertEqual(picture("--hide", "@1")[0], one)
        self.assertNotEqual(picture("--explode", "1")[0], whole)
        self.assertEqual(picture("--explode", "0")[0], whole)
        same, told = picture("--hide", "no such part")
        self.assertEqual(same, whole)
        self.assertIn("no such part", told)
        scene = WORK / "placements.json"
        scene.write_text('{"placements": {"hide": ["#1"]}}')
        self.assertEqual(picture("--scene", scene)[0], one)
        for wrong, code in [(("--hide", "#9"), 3), (("--explode=-1",), 1)]:
            self.assertEqual(run("render", pack, "-o", WORK / "no.png", *wrong).returncode, code, wrong)
        self.assertFalse((WORK / "no.png").exists())
