"""Files of the viewer by real events: dialogs for scenes and data, ParaView's colours, files that are dropped."""

import json
import os
import shutil
import unittest

from viewer_case import HandsTest, numbers

# As ParaView 5.11 exports it.
PARAVIEW = """[
    {
        "ColorSpace" : "Diverging",
        "Creator" : "ParaView",
        "DefaultMap" : false,
        "NanColor" : [ 1, 1, 0 ],
        "Name" : "Cool to Warm",
        "Points" : [ -0.1, 0, 0.5, 0, 0.02, 0.25, 0.5, 0, 0.1, 1, 0.5, 0 ],
        "RGBPoints" : [ -0.1, 0.231373, 0.298039, 0.752941, 0, 0.865, 0.865, 0.865, 0.1, 0.705882, 0.0156863, 0.14902 ]
    }
]
"""


class Dialogs(HandsTest):
    def replace(self, name, path):
        """Saves to a file that is there: a question comes, which is denied at first."""
        with open(path, "w", encoding="ascii") as f:
            f.write("old")
        self.choose(name, path)
        self.front("")
        self.key("Escape")
        with open(path, encoding="ascii") as f:
            self.assertEqual(f.read(), "old")
        self.front(name)
        self.key("Return")
        self.front("")
        self.key("Return")

    def test_scenes_and_data(self):
        scene, other = self.at("dialog.json"), self.at("other.tlod")
        shutil.copy(self.model, other)

        def save():
            self.key("ctrl+s")
            self.replace("Save scene", scene)

        def open_file(path):
            self.key("ctrl+o")
            self.choose_old("Open", path)
        changed, back, file = self.act((save, ["set volume1.lit on", "volume1.lit"]), (lambda: open_file(scene), ["volume1.lit"]), (lambda: open_file(other), ["data.file"]))
        self.assertEqual([changed, back, file], ["on", "off", other])
        self.assertEqual(self.property_of("dialog.json", "data", "file"), self.model)

    def test_scene_in_place_of_data(self):
        """`view S.json` and `open S.json`; a scene that was saved says how it is drawn without a window."""
        scene = self.at("in place.json")

        def save():
            self.key("ctrl+s")
            self.choose("Save scene", scene)
        self.act((save, []))
        said = [line for line in self.err.splitlines() if "tetralod render" in line]
        self.assertEqual(len(said), 1, self.err)
        self.assertIn(f"--scene '{scene}' -o", said[0])
        self.LINES = ["set volume1.lit on"]
        on, off, file = self.act((lambda: None, ["volume1.lit", f"open {scene}", "wait settled", "volume1.lit", "data.file"]), model=scene)
        self.assertEqual([on, off, file], ["on", "off", self.model])

    def test_colours_of_paraview(self):
        """What is exported is what was imported; undo brings the colours back."""
        path, out = self.at("paraview.json"), self.at("exported.json")
        with open(path, "w", encoding="utf-8") as f:
            f.write(PARAVIEW)
        self.LINES = ["add transfer channel=pressure", "key colours-import"]
        colors, opacities, before = self.act((lambda: self.choose_old("Import colours", path), ["transfer1.colors", "transfer1.opacities", "key colours-export"]),
                                             (lambda: self.choose("Export colours", out), ["undo", "transfer1.colors"]))
        with open(out, encoding="utf-8") as f:
            (exported,), (given,) = json.load(f), json.loads(PARAVIEW)
        self.assertEqual(before, "auto")
        self.assertEqual(exported["Points"], given["Points"])
        self.assertEqual(list(numbers(opacities)[::2]), given["Points"][::4])
        self.assertEqual(exported["RGBPoints"][0], -0.1)
        self.assertEqual(exported["RGBPoints"][-4], 0.1)
        ends = [exported["RGBPoints"][1:4], exported["RGBPoints"][-3:]]
        for found, wanted in zip(ends, (given["RGBPoints"][1:4], given["RGBPoints"][-3:])):
            self.assertLess(max(abs(a - b) for a, b in zip(found, wanted)), 1e-5)
        self.assertGreaterEqual(len(colors.split()), 3)

    def test_what_is_no_colour_map(self):
        path = self.at("no.json")
        with open(path, "w", encoding="utf-8") as f:
            f.write("[1, 2]")
        self.LINES = ["add transfer channel=pressure", "key colours-import"]
        with self.assertRaisesRegex(AssertionError, "no.json"):  # the script ends, and says why
            self.act((lambda: self.choose_old("Import colours", path), ["transfer1.colors"]))


if __name__ == "__main__":
    unittest.main()
