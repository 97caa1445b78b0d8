import json

from case import PACK, WORK, CliTest, run


class Validate(CliTest):
    def test_a_valid_pack_has_no_findings(self):
        self.assertIn("valid", self.ok("validate", PACK).stdout)
        report = self.json_of("validate", PACK, "--json")
        self.assertEqual((report["valid"], report["findings"]), (True, []))

    def test_a_changed_byte_is_a_numbered_finding(self):
        data = bytearray(PACK.read_bytes())
        data[len(data) * 2 // 3] ^= 0x10
        broken = WORK / "broken.tray"
        broken.write_bytes(data)
        done = run("validate", broken)
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stdout, r"broken\.tray: .+ \[F\d+\]")
        done = run("validate", broken, "--json")
        self.assertEqual(done.returncode, 3)
        report = json.loads(done.stdout)
        self.assertFalse(report["valid"])
        for finding in report["findings"]:
            self.assertEqual(set(finding), {"number", "section", "detail"})
            self.assertGreater(finding["number"], 0)
