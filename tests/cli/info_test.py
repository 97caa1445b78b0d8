from case import MODEL, OPTIONS, PACK, WORK, CliTest, run


class Info(CliTest):
    KEYS = ["version", "source", "units", "faces", "faces_by_kind", "instances", "patches", "leaves", "parts",
            "bounds_mm", "bytes_by_section", "effects", "dropped"]

    def test_json_has_the_agreed_keys(self):
        info = self.json_of("info", PACK, "--json")
        self.assertEqual(list(info)[: len(self.KEYS)], self.KEYS)
        self.assertRegex(info["version"], r"^\d+\.\d+$")
        self.assertEqual(sum(info["faces_by_kind"].values()), info["faces"])
        self.assertLessEqual(sum(info["bytes_by_section"].values()), PACK.stat().st_size)
        low, high = info["bounds_mm"]
        for axis in range(3):
            self.assertLess(low[axis], high[axis])
        for item in info["effects"]:
            self.assertEqual(set(item), {"name", "why"})
            self.assertTrue(item["name"] and item["why"])

    def test_steeper_rays_are_proved_for_more_leaves(self):
        leaves = self.json_of("info", PACK, "--json")["bezier_leaves"]
        proved = [leaves["proved_above_deg"][degrees] for degrees in ["5", "10", "20", "45"]]
        self.assertEqual(proved, sorted(proved))
        self.assertLessEqual(proved[-1] + leaves["flagged"], leaves["count"])

    def test_json_says_what_is_in_the_model(self):
        if not OPTIONS.has_pack:
            self.skipTest("no converter in this build")
        info = self.json_of("info", PACK, "--json")
        self.assertEqual(info["source"], MODEL.name)
        self.assertEqual(info["units"].upper(), "MM")
        self.assertEqual(info["faces"], 29)
        self.assertEqual(info["faces_by_kind"]["plane"], 5)
        self.assertEqual(info["faces_by_kind"]["cylinder"], 22)
        self.assertEqual(info["faces_by_kind"]["torus"], 2)
        self.assertEqual(info["dropped"], [])
        names = [item["name"] for item in info["effects"]]
        self.assertTrue({"plane", "cylinder", "torus", "trim-exact"} <= set(names), names)
        self.assertNotIn("sphere", names)

    def test_text_says_the_same(self):
        text = self.ok("info", PACK).stdout
        info = self.json_of("info", PACK, "--json")
        self.assertIn(info["source"], text)
        self.assertRegex(text, rf"(?m)^faces +{info['faces']}\b")
        for section, stored in info["bytes_by_section"].items():
            self.assertRegex(text, rf"(?m)^{section} .* {stored} ")
        for item in info["effects"]:
            self.assertIn(item["why"], text)

    def test_missing_files_and_files_that_are_no_packs(self):
        no_pack = WORK / "no_pack.tray"
        no_pack.write_text("solid of words\n" * 100, encoding="ascii")
        empty = WORK / "empty.tray"
        empty.write_bytes(b"")
        cut = WORK / "cut.tray"
        cut.write_bytes(PACK.read_bytes()[: PACK.stat().st_size // 2])
        for command, rest in [("info", []), ("validate", []), ("render", ["-o", WORK / "x.png"]),
                              ("thumbnail", [WORK / "x.png"]), ("preview", ["-o", WORK / "x"])]:
            self.fails(2, command, WORK / "missing.tray", *rest, says=["missing.tray"])
            self.fails(2, command, WORK, *rest, says=[str(WORK)])  # a folder
            for file in [no_pack, empty, cut]:
                done = run(command, file, *rest)
                self.assertEqual(done.returncode, 3, f"{command} {file}: {done.stderr}")
                self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
                self.assertIn(file.name, done.stderr)
        self.assertFalse((WORK / "x.png").exists())
