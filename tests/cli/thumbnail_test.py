from case import PACK, WORK, CliTest
from pictures import alphas, read_png


class Thumbnail(CliTest):
    needs_pack = True

    def test_previews_are_square_and_scaled(self):
        self.ok("preview", PACK, "-o", WORK / "p")
        self.assertEqual(read_png(WORK / "p-256.png")[:2], (256, 256))
        self.assertEqual(read_png(WORK / "p-512.png")[:2], (512, 512))
        for size in [16, 256, 512]:
            self.ok("thumbnail", "-s", size, PACK, WORK / "t.png")
            width, height, rows = read_png(WORK / "t.png")
            self.assertEqual((width, height), (size, size))
            covered = sum(alphas(rows)) / 255 / size**2
            self.assertTrue(0.1 < covered < 0.9, covered)

    def test_the_stored_preview_is_what_the_tracer_shows(self):
        self.ok("preview", PACK, "-o", WORK / "q")
        self.ok("thumbnail", PACK, WORK / "t256.png")
        self.assertEqual((WORK / "q-256.png").read_bytes(), (WORK / "t256.png").read_bytes())
