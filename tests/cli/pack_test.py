import gzip
import zipfile

from case import MODEL, PACK, WORK, CliTest, run


class Pack(CliTest):
    needs_pack = True

    def test_json_has_the_agreed_keys(self):
        report = self.json_of("pack", MODEL, "-o", WORK / "again.tray", "--json")
        for key in ["faces", "converted", "dropped", "seconds", "bytes"]:
            self.assertIn(key, report)
        self.assertEqual((report["faces"], report["converted"], report["dropped"]), (29, 29, []))
        self.assertTrue({"read", "transfer", "convert", "trims", "bvh", "write"} <= set(report["seconds"]))
        trims = report["trims"]
        self.assertLess(trims["largest_pcurve_deviation_mm"], 1)
        self.assertLessEqual(len(trims["edges_above_tolerance"]), trims["pcurves_above_tolerance"])
        self.assertEqual(sum(trims["findings"].values()), len(report["trim_findings"]))
        self.assertEqual(trims["findings"]["loop is not grown"], 0)

    def test_says_what_is_doubtful_about_trims(self):
        text = self.ok("pack", MODEL, "-o", WORK / "again.tray").stdout
        self.assertRegex(text, r"\ntrims +pcurves within \S+ mm of their edges, \d+ beyond an edge's tolerance, \d+ rebuilt")

    def test_patches_have_no_more_leaves_than_they_may(self):
        leaves = {}
        for budget in ["1", "1024"]:
            out = WORK / "leaves.tray"
            self.ok("pack", MODEL, "-o", out, "--surfaces", "bezier", "--leaf-budget", budget, "--no-previews")
            info = self.json_of("info", out, "--json")
            leaves[budget] = info["leaves"]
            if budget == "1":
                self.assertEqual(info["leaves"], info["patches"])
        self.assertGreater(leaves["1024"], leaves["1"])
        for budget in ["0", "4097", "one"]:
            self.fails(1, "pack", MODEL, "-o", WORK / "x.tray", "--leaf-budget", budget, says=["--leaf-budget"])

    def test_the_same_model_gives_the_same_bytes(self):
        self.ok("pack", MODEL, "-o", WORK / "same.tray")
        self.assertEqual(PACK.read_bytes(), (WORK / "same.tray").read_bytes())

    def test_a_compressed_or_archived_model_gives_the_same_bytes(self):
        content, archive, out = MODEL.read_bytes(), WORK / "parts.zip", WORK / "packed.tray"
        compressed = WORK / (MODEL.name + ".gz")
        compressed.write_bytes(gzip.compress(content))
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as members:
            members.writestr("notes.txt", "beside the models")
            members.writestr(f"cars/{MODEL.name}", content)
        for model in [compressed, archive, f"{archive}!/cars/{MODEL.name}"]:
            report = self.json_of("pack", model, "-o", out, "--json")
            self.assertEqual((report["source"], report["source_bytes"]), (MODEL.name, len(content)))
            self.assertEqual(out.read_bytes(), PACK.read_bytes(), model)
        source = self.json_of("info", out, "--json")["provenance"]
        self.assertRegex(source["hash"], "^xxh3-128:[0-9a-f]{32}$")
        with zipfile.ZipFile(archive, "a") as members:
            members.writestr("bolt.step", "another")
        self.fails(1, "pack", archive, "-o", out, says=["holds 2 CAD files", f"{archive}!/bolt.step"])
        self.fails(2, "pack", f"{archive}!/nut.step", "-o", out, says=["nut.step", "no such member"])
        self.fails(1, "pack", f"{archive}!/bolt.step", "-o", archive, says=["is the model itself"])

    def test_writes_a_mesh_in_a_packs_place(self):
        out = WORK / "model.trimesh"
        sizes = {}
        for deflection in ["1e-2", "1e-4"]:
            report = self.json_of("pack", MODEL, "--mesh", deflection, "-o", out, "--json")
            self.assertEqual((report["faces"], report["dropped"], report["without_triangles"]), (29, [], []))
            self.assertEqual(set(report["seconds"]), {"read", "transfer", "mesh", "write"})
            self.assertEqual(report["bytes"], out.stat().st_size)
            sizes[deflection] = report
        coarse, fine = sizes["1e-2"], sizes["1e-4"]
        self.assertGreater(fine["triangles"], 2 * coarse["triangles"])
        self.assertAlmostEqual(coarse["deflection_mm"] / fine["deflection_mm"], 100)
        self.assertRegex(self.ok("pack", MODEL, "--mesh", "1e-2", "-o", out).stdout, r"\ntriangles +\d+ with \d+ vertices")

    def test_a_mesh_takes_no_options_of_packs(self):
        out = WORK / "none.trimesh"
        for options in [["--compact"], ["--trim-memory", "50%"], ["--leaf-budget", "1"], ["--no-previews"]]:
            self.fails(1, "pack", MODEL, "--mesh", "1e-3", "-o", out, *options, says=["--mesh", options[0]])
        for deflection in ["0", "-1e-3", "0.2", "nan", "fine"]:
            self.fails(1, "pack", MODEL, f"--mesh={deflection}", "-o", out, says=["--mesh"])
        self.fails(3, "pack", MODEL, "--mesh", "1e-12", "-o", out, says=["no triangles"]) # finer than the kernel goes
        self.assertFalse(out.exists())

    def test_errors_have_their_exit_codes(self):
        self.assertEqual(run("pack").returncode, 1)
        self.assertEqual(run("pack", MODEL, "-o", WORK / "x.tray", "--frob").returncode, 1)
        self.assertEqual(run("pack", WORK / "missing.step", "-o", WORK / "x.tray").returncode, 2)
        junk = WORK / "junk.step"
        junk.write_text("not a model\n", encoding="ascii")
        self.assertEqual(run("pack", junk, "-o", WORK / "x.tray").returncode, 3)
        self.assertEqual(run("pack", MODEL, "-o", WORK / "no_folder" / "x.tray").returncode, 2)
        self.assertFalse((WORK / "x.tray").exists())
