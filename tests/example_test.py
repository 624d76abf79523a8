"""The demo and the example of the README do what they say, on a small data set."""

import json
import os
import re
import subprocess
import tempfile
import unittest

ROOT, BUILD = os.environ["TETRALOD_SOURCE"], os.environ["TETRALOD_BUILD"]
PROGRAM = os.environ["TETRALOD_PROGRAM"]


def read(*parts):
    with open(os.path.join(*parts), encoding="utf-8") as f:
        return f.read()


class Examples(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def call(self, *command, status=0):
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(status, done.returncode, done.stdout + done.stderr)
        return done

    def test_the_demo_ends_with_two_meshes(self):
        out = self.call(os.path.join(ROOT, "examples", "demo.sh"), PROGRAM, "demo", "12").stdout
        seen = re.search(r"([\d,]+) tetrahedra became ([\d,]+)", out)
        self.assertIsNotNone(seen, out)
        tets, fewer = (int(count.replace(",", "")) for count in seen.groups())
        self.assertGreater(tets, 0)
        self.assertLess(fewer, tets)
        for name, count in ("sphere-flow.vtu", tets), ("sphere-flow-tenth.vtu", fewer):
            info = json.loads(self.call(PROGRAM, "info", os.path.join("demo", name), "--json").stdout)
            self.assertEqual(count, info["tets"])
            self.assertIn(name, out)
        compared = json.loads(read(self.folder, "demo", "compare.json"))
        self.assertEqual({"pressure", "velocity"}, {c["name"] for c in compared["channels"]})

    def test_the_sheet_of_pictures(self):
        """The demo's pictures of its model, on one sheet of three columns."""
        sheet = os.path.join(BUILD, "examples", "contact_sheet")
        self.call(PROGRAM, "sample", "sphere-flow", "-o", "sphere-flow.vtu", "--size", "12", "-q")
        self.call(PROGRAM, "build", "sphere-flow.vtu", "-o", "sphere-flow.tlod", "-q")
        self.call(os.path.join(ROOT, "examples", "demo_pictures.sh"), PROGRAM, sheet, ".")
        with open(os.path.join(self.folder, "pictures.png"), "rb") as f:
            head = f.read(24)
        size = [int.from_bytes(head[at:at + 4], "big") for at in (16, 20)]
        self.assertEqual(size, [3 * 644 + 4, 3 * 484 + 4])
        self.call(sheet, "out.png", "2", "none.png", status=1)
        self.call(sheet, "out.png", status=2)

    def test_the_example_simplifies(self):
        self.call(PROGRAM, "sample", "marschner-lobb", "-o", "in.vtu", "--size", "12")
        out = self.call(os.path.join(BUILD, "examples", "example_simplify"), "in.vtu", "out.vtu").stdout
        tets = json.loads(self.call(PROGRAM, "info", "out.vtu", "--json").stdout)["tets"]
        self.assertIn(f"{tets} tets from {5 * 11 ** 3}\n", out)

    def test_the_example_tells_what_is_wrong(self):
        done = self.call(os.path.join(BUILD, "examples", "example_simplify"), "none.vtu", "out.vtu", status=1)
        self.assertIn("none.vtu", done.stderr)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "out.vtu")))
        self.call(os.path.join(BUILD, "examples", "example_simplify"), status=2)

    def test_the_example_renders(self):
        """A first look, and a scene by commands: other pixels of the same size."""
        example = os.path.join(BUILD, "examples", "example_render")
        self.call(PROGRAM, "sample", "sphere-flow", "-o", "flow.vtu", "--size", "12", "-q")
        self.call(PROGRAM, "build", "flow.vtu", "-o", "flow.tlod", "-q")
        tets = json.loads(self.call(PROGRAM, "info", "flow.tlod", "--json").stdout)["tets"]
        self.assertIn(f" of {tets} tets", self.call(example, "flow.tlod", "look.png").stdout)
        self.call(example, "flow.tlod", "surface.png", "add surface channel=pressure value=0.1", "view 30,20")
        pictures = []
        for name in ("look.png", "surface.png"):
            with open(os.path.join(self.folder, name), "rb") as f:
                pictures.append(f.read())
            self.assertEqual([int.from_bytes(pictures[-1][at:at + 4], "big") for at in (16, 20)], [800, 600])
        self.assertNotEqual(*pictures)
        said = self.call(example, "flow.tlod", "none.png", "add surface channel=heat value=1", status=1).stderr
        self.assertIn("'pressure'", said)  # what there is
        self.assertFalse(os.path.exists(os.path.join(self.folder, "none.png")))
        self.call(example, status=2)

    def test_the_readme_lists_the_verbs(self):
        table = re.search(r"\| verb \|.*?\n\n", read(ROOT, "README.md"), re.S)[0]
        shown = set(re.findall(r"`(\w+)", table))
        said = self.call(PROGRAM, "help").stdout
        self.assertEqual(set(re.findall(r"^  (\w+)  +\w", said, re.M)), shown)

    def test_the_readme_shows_the_example_as_it_is(self):
        shown = re.search(r"```c\n(.*?)```", read(ROOT, "README.md"), re.S)[1]
        self.assertEqual(read(ROOT, "examples", "example_simplify.c"), shown)


if __name__ == "__main__":
    unittest.main()
