"""Commands of scripts: pictures and frames at a path with blanks, of a size, around; words that are none end the script
with what was expected; numbers where the user's have commas."""

import os
import shutil
import subprocess
import time
import unittest

from render_test import pixels
from viewer_case import ViewerTest, commas, difference
from viewer_display import PATIENCE, PROGRAM, SANITIZED, environment


class Pictures(ViewerTest):
    def test_quotes_keep_blanks(self):
        self.play(["wait settled", f'picture "{self.at("a picture.png")}" 300x200', f"frames {self.at('around.png')} 160x120 2",
                   f'frames "{self.at("a way.png")}" 160x120 2 0'], self.model)
        self.assertEqual(pixels(self.at("a picture.png")).shape[:2], (200, 300))
        front, back = (pixels(self.at(f"around_{frame:04}.png")) for frame in range(2))
        self.assertEqual(front.shape[:2], (120, 160))
        self.assertGreater(difference(front, back), 0.5)  # all around where nothing is said
        still = [pixels(self.at(f"a way_{frame:04}.png")) for frame in range(2)]
        self.assertEqual(difference(*still), 0)

    def test_words_that_are_none(self):
        for line, expected in (("picture a.png 50x50", "WIDTHxHEIGHT"), ("picture a.png 200x200 3", "WIDTHxHEIGHT"),
                               ("frames a.png 200x200 2 9x", "COUNT [DEGREES]"), ("picture \"a.png", "closing quote"),
                               ("click 9 9 -5", "BUTTON"), ("drag 1 1 2 2 9", "BUTTON"), ("turn 1 1 1e300", "SECONDS")):
            with self.subTest(line):
                _, err = self.play([line], self.model, status=1, cwd=self.folder)
                self.assertIn(expected, err)
        self.assertFalse(os.path.exists(self.at("a.png")))


class Places(ViewerTest):
    def test_scripts_without_end(self):
        for script, expected in (("/dev/zero", "lines of UTF-8, less than 16777216 bytes"), (self.folder, "directory")):
            done = subprocess.run([PROGRAM, "view", self.model, "--script", script], capture_output=True, text=True, check=False,
                                  timeout=PATIENCE, env=environment(self.display, self.folder))
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(expected, done.stderr)

    def test_data_are_not_replaced(self):
        """Under no name: what is written of them is less than they are."""
        link = self.at("link.json")
        os.symlink(self.model, link)
        with open(self.model, "rb") as f:
            before = f.read()
        for line in (f"save-scene {self.model}", f"save-scene {link}", f"build {link}"):
            with self.subTest(line):
                _, err = self.play(["wait settled", line], self.model, status=1)
                self.assertIn("is the data set that is open: choose another name", err)
        with open(self.model, "rb") as f:
            self.assertEqual(f.read(), before)


class Names(ViewerTest):
    def test_a_name_of_other_bytes(self):
        """A name that is no UTF-8 can't stand in a scene: the window says so, and shows what it can of it."""
        name = os.fsencode(self.at("")) + b"br\xfccke.tlod"
        shutil.copy(self.model, name)
        viewer = self.start(["wait settled", "quit"], os.fsdecode(name), errors="replace")
        status, _, err = viewer.end()
        self.assertEqual(status, 1, err)
        self.assertIn("expected a line of UTF-8", err)
        self.assertNotIn("Pango", err)


class Commas(ViewerTest):
    """Where the user's numbers have commas, those of files, scripts and panels have points."""

    def test_numbers_have_points(self):
        variables = commas(self.folder)
        if not variables:
            self.skipTest("localedef makes no locale with commas")
        said, _ = self.play(["wait settled", "add surface channel=pressure value=0.125", "get surface1.value", "wait settled",
                             "save-scene " + self.at("commas.json"), "print stats", "probe 300 200", "wait settled", "print-tools"],
                            self.model, env=variables)
        self.assertIn("get surface1.value 0.125", said)
        self.assertEqual(self.property_of("commas.json", "surface1", "value"), 0.125)
        numbers = [line for line in said if line.startswith(("first picture", "position", "memory"))]
        self.assertEqual(len(numbers), 3, said)
        for line in numbers:
            self.assertRegex(line, r"\d\.\d")
            self.assertNotRegex(line, r"\d,\d")


class Long(ViewerTest):
    LINES = 4000

    def test_lines_of_scenes_do_not_wait_for_each_other(self):
        """Many in a turn of the window's loop, which takes 8 ms; the last one counts."""
        begin = time.monotonic()
        self.play([*(f"set volume1.gradient_opacity {i / self.LINES}" for i in range(self.LINES)), "get volume1.gradient_opacity"], self.model)
        if not SANITIZED:
            self.assertLess(time.monotonic() - begin, 0.008 * self.LINES / 2)


if __name__ == "__main__":
    unittest.main()
