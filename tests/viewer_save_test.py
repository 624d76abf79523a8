"""Pictures, pages and sequences that the viewer saves, and data sets of several steps that it plays."""

import os
import subprocess
import time
import unittest
import xml.etree.ElementTree

import numpy as np
from cli_series_test import grid, heat, write_pvd, write_vtu
from render_test import pixels
from viewer_case import HandsTest, make, numbers
from viewer_display import PATIENCE

STEPS = 4


class Saves(HandsTest):
    def files(self, folder):
        return sorted(os.listdir(folder))

    def empty(self, name):
        os.mkdir(self.at(name))
        return self.at(name)

    def ask(self, keys, title, fields, end="alt+s"):
        """Opens the dialog and goes from field to field; a text is typed, True is a switch pressed, None is passed over."""
        self.click(self.part(0.9, 0.1))
        self.key(keys)
        self.front(title)
        for number, field in enumerate(fields):
            if number:
                self.key("Tab")
            if field is True:
                self.key("space")
            elif field:
                self.key("ctrl+a")
                self.display.tool("type", "--delay", 15, field)
        self.key(end)

    def test_picture_by_hand(self):
        """Of another size, transparent where nothing is; a name without a known ending is refused."""
        path = self.at("hand.png")

        def save(name):
            # width, height, not in proportion, transparent
            self.ask("ctrl+p", "Save picture", ["300", None, True, True])
            self.choose("Save picture as", name)
        self.LINES = ["set volume1.visible off", "add surface channel=pressure value=0.02", "set picture.box off", "set picture.axes off",
                      "set picture.triad off", "set picture.bar off", "set picture.note off"]
        self.act((lambda: save(path), []))
        picture = pixels(path)
        self.assertEqual(picture.shape[1:], (300, 4))
        self.assertEqual(picture[0, 0, 3], 0)
        self.assertEqual(picture[..., 3].max(), 255)
        with self.assertRaisesRegex(AssertionError, r"hand\.jpg.*expected a name that ends in \.png"):
            self.act((lambda: save(self.at("hand.jpg")), []))
        self.assertFalse(os.path.exists(self.at("hand.jpg")))

    def test_enter_saves_and_the_size_stays(self):
        """Enter in an entry goes on; the next dialog begins with that size, out of proportion as it was."""
        first, second = self.at("first.png"), self.at("second.pdf")

        def save():
            self.ask("ctrl+p", "Save picture", [None, None, True], "shift+Tab")
            self.display.tool("type", "--delay", 15, "120")
            self.key("Return")
            self.choose("Save picture as", first)
            self.ask("ctrl+p", "Save picture", ["200"], "Return")
            self.choose("Save picture as", second)
        self.act((save, []))
        self.assertEqual(pixels(first).shape[0], 120)
        with open(second, "rb") as f:
            self.assertIn(b"[ 0 0 200 120 ]", f.read())

    def test_the_window_waits_for_a_name(self):
        """Nothing else is done while a file is asked for: what is asked is of the picture that was seen."""
        path = self.at("waiting.png")

        def save():
            self.ask("ctrl+p", "Save picture", ["300"])
            self.front("Save picture as")
            self.drag(self.part(0.95, 0.9), self.part(0.8, 0.9))
            self.choose("Save picture as", path)
        before, after = self.act((lambda: None, ["camera.position"]), (save, ["camera.position"]))
        self.assertEqual(before, after)
        self.assertEqual(pixels(path).shape[1], 300)

    def sequence(self, folder, fields, events=lambda: None):
        def save():
            self.ask("ctrl+shift+p", "Save frames", fields)
            self.choose("Save frames as", os.path.join(folder, "turn.png"))
            events()
        return save

    def test_sequence_by_hand(self):
        """Turned around once; pictures that are there are asked about."""
        folder = self.empty("turn")
        fields = ["120", None, None, None, "4", "180"]

        def deny():
            self.front("Replace pictures")
            self.key("Escape")

        def allow():
            self.front("Replace pictures")
            self.key("alt+r")
        first = os.path.join(folder, "turn_0000.png")

        def spoil():
            with open(first, "w", encoding="ascii") as f:
                f.write("old")
        self.LINES = ["view 25,20"]
        self.act((self.sequence(folder, fields), []))
        self.assertEqual(self.files(folder), [f"turn_{i:04}.png" for i in range(4)])
        pictures = [pixels(os.path.join(folder, name)) for name in self.files(folder)]
        for a, b in zip(pictures, pictures[1:]):
            self.assertEqual(a.shape, b.shape)
            self.assertGreater(np.abs(a - b).mean(), 0.5)
        spoil()
        self.act((self.sequence(folder, fields, deny), []))
        self.assertEqual(os.path.getsize(first), 3)
        self.act((self.sequence(folder, fields, allow), []))
        self.assertEqual(np.abs(pixels(first) - pictures[0]).max(), 0)

    def test_sequence_is_cancelled(self):
        """By the cross of what says how far it is: whole pictures stay, nothing else."""
        folder = self.empty("cancelled")

        def save():
            self.click(self.part(0.9, 0.1))
            time.sleep(0.5)
            before = self.display.screen().astype(int)
            self.sequence(folder, ["120", None, None, None, "5000", "0"])()
            end = time.monotonic() + PATIENCE
            while len(self.files(folder)) < 3:
                self.assertLess(time.monotonic(), end, self.files(folder))
                time.sleep(0.05)
            # what is new at the lower end of the view; the cross is at its right end
            left, top, width, height = self.places["view"]
            strip = (slice(top + height - 70, top + height - 25), slice(left, left + width))
            rows, columns = np.nonzero(np.abs(self.display.screen() - before)[strip].sum(axis=2) > 30)
            self.click((left + columns.max() - 4, top + height - 70 + int(np.median(rows))))
            self.count = len(self.files(folder))
        self.act((save, []))
        names = self.files(folder)
        self.assertLess(len(names), self.count + 100)
        self.assertEqual(names, [f"turn_{i:04}.png" for i in range(len(names))])
        self.assertEqual(pixels(os.path.join(folder, names[-1])).shape, pixels(os.path.join(folder, names[0])).shape)
        self.assertIn("Stopped", self.err)


class Scripts(HandsTest):
    def test_pages(self):
        pdf, svg = self.at("page.pdf"), self.at("page.svg")
        self.play(["wait settled", f"picture {pdf} 300x200", f"picture {svg} 300x200"], self.model)
        with open(pdf, "rb") as f:
            content = f.read()
        self.assertTrue(content.startswith(b"%PDF-") and content.rstrip().endswith(b"%%EOF"))
        root = xml.etree.ElementTree.parse(svg).getroot()
        self.assertEqual([float(root.get(side).removesuffix("pt")) for side in ("width", "height")], [300, 200])
        tags = [element.tag.split("}")[1] for element in root.iter()]
        self.assertEqual(tags.count("image"), 1)
        self.assertGreater(tags.count("use") + tags.count("g"), 20)  # words

    def test_disk_is_full(self):
        """What was whole before stays, nothing else; the message names the file."""
        folder = self.at("full")
        os.mkdir(folder)
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=128k", "none", folder], capture_output=True, check=False).returncode:
            self.skipTest("no file system can be mounted here")
        try:
            _, err = self.play(["wait settled", f"frames {folder}/f.png 200x150 20 90"], self.model, status=1)
            names = sorted(os.listdir(folder))
            self.assertIn(f"f_{len(names):04}.png", err)
            self.assertTrue(0 < len(names) < 20, names)
            for name in names:
                self.assertEqual(pixels(os.path.join(folder, name)).shape, (150, 200, 3))
            for name in ("p.pdf", "p.svg", "p.png"):
                _, err = self.play(["wait settled", f"picture {folder}/{name} 900x900"], self.model, status=1)
                self.assertIn(name, err)
            self.assertEqual(sorted(os.listdir(folder)), names)
        finally:
            subprocess.run(["umount", folder], check=True)


class Times(HandsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        points, tets = grid(9)
        files = [cls.at(f"moving_{s}.vtu") for s in range(STEPS)]
        for s, name in enumerate(files):
            write_vtu(name, points, tets, [("heat", heat(points, s))])
        write_pvd(cls.at("moving.pvd"), [os.path.basename(name) for name in files], [0.5 * s for s in range(STEPS)])
        cls.steps = cls.at("moving.tlod")
        make("build", cls.at("moving.pvd"), "-o", cls.steps, "--steps", "all")

    def step(self, *rounds):
        asked = [(events, [*questions, "data.step"]) for events, questions in rounds]
        return [int(float(text)) for text in self.act(*asked, model=self.steps)]

    def test_keys_go_around(self):
        def press(*keys):
            def events():
                self.click(self.part(0.9, 0.1))
                self.key(*keys)
            return events
        self.assertEqual(self.step((press("period"), []), (press("period", "period"), []), (press("period"), []), (press("comma"), []), (press("comma"), [])),
                         [1, 3, 0, 3, 2])

    def watch(self, changes):
        """Until what is on the screen was another so many times."""
        seen, before, end = 0, self.display.screen(), time.monotonic() + PATIENCE
        while seen < changes:
            self.assertLess(time.monotonic(), end)
            time.sleep(0.05)
            now = self.display.screen()
            seen += (now != before).any()
            before = now

    def test_plays_every_step(self):
        """Each is shown before the next one; the same key stops."""
        def play():
            self.click(self.part(0.9, 0.1))
            self.key("k")
            self.watch(2 * STEPS)
            self.key("k")
        first, second = self.step((play, []), (lambda: time.sleep(1), []))
        self.assertEqual(first, second)

    def test_steps_look_different(self):
        lines = ["set data.step -1", "wait settled"]
        for s in range(STEPS):
            lines += [f"set data.step {s}", "wait settled", f"picture {self.at(f'step{s}.png')} 200x150"]
        self.play(lines, self.steps)
        pictures = [pixels(self.at(f"step{s}.png")) for s in range(STEPS)]
        for a, b in zip(pictures, pictures[1:]):
            self.assertGreater(np.abs(a - b).mean(), 0.5)

    def test_spin(self):
        def spin():
            self.click(self.part(0.9, 0.1))
            self.key("space")
            self.watch(5)
            self.key("space")
        before, after, later = map(numbers, self.act((lambda: None, ["camera.position"]), (spin, ["camera.position"]), (lambda: None, ["camera.position", "undo"])))
        self.assertGreater(np.linalg.norm(before - after), 0.1)
        self.assertAlmostEqual(before[2], after[2], delta=1e-6 * np.linalg.norm(before))
        self.assertEqual(list(after), list(later))


if __name__ == "__main__":
    unittest.main()
