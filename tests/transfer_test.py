"""Colour maps as ParaView writes them: colours and opacities of the control points that render makes of them, against VTK's functions."""

import bisect
import json
import math
import os
import shutil
import subprocess
import tempfile
import unittest

try:
    import vtk
except ImportError:
    vtk = None

PROGRAM = os.environ["TETRALOD_PROGRAM"]
VALUES = 257
TOLERANCE = 1 / 255

COLORS = {
    "cool to warm": [-1.013, 0.23, 0.30, 0.75, 0.27, 0.87, 0.87, 0.86, 2.031, 0.71, 0.02, 0.15],
    "ends alone": [-1, 0.23, 0.30, 0.75, 2, 0.71, 0.02, 0.15],
    "purple and green": [-1, 0.5, 0.0, 0.5, 0.2, 0.0, 0.6, 0.1, 2, 0.9, 0.9, 0.1],
    "grey to colour": [-1, 0.2, 0.2, 0.2, 0.51, 0.9, 0.9, 0.9, 1.1, 0.8, 0.3, 0.0, 2, 0.0, 0.0, 0.0],
    "gaudy": [-1, 1, 0, 0, -0.3, 0, 1, 0, 0.4, 0, 0, 1, 1.2, 1, 0, 1, 2, 1, 1, 0],
    "reds on both sides": [-1, 0.9, 0.1, 0.3, 2, 0.9, 0.3, 0.1],
}
# The name in JSON, the number in VTK, whether hues wrap.
SPACES = [("RGB", 0, 0), ("HSV", 1, 0), ("HSV", 1, 1), ("Lab", 2, 0), ("Diverging", 3, 0), ("Step", 5, 0)]


def linear(points, width, x):
    """Linear between control points of a value and width - 1 numbers; of a step the upper side."""
    values = points[::width]
    i = bisect.bisect_right(values, x)
    if i in (0, len(values)):
        at = width * max(i - 1, 0)
        return points[at + 1:at + width]
    a, b = points[width * (i - 1):width * i], points[width * i:width * (i + 1)]
    t = (x - a[0]) / (b[0] - a[0])
    return [(1 - t) * a[k] + t * b[k] for k in range(1, width)]


@unittest.skipUnless(vtk, "VTK is missing")
class Transfer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tetralod-transfer-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.grid = os.path.join(cls.folder, "g.vtu")
        subprocess.run([PROGRAM, "sample", "gaussians", "-o", cls.grid, "--size", "4"], check=True, capture_output=True)

    def render(self, text, *words):
        with open(os.path.join(self.folder, "map.json"), "w", encoding="utf-8") as f:
            f.write(text)
        return subprocess.run([PROGRAM, "render", self.grid, "-o", os.path.join(self.folder, "p.png"), "--size", "8x6", "-q", "--volume",
                               "value:" + os.path.join(self.folder, "map.json"), "--write-transfer",
                               os.path.join(self.folder, "used.json"), *words], capture_output=True, text=True, check=False, timeout=60)

    def used(self, color_map, *words):
        done = self.render(json.dumps([color_map]), *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(os.path.join(self.folder, "used.json"), encoding="utf-8") as f:
            return json.load(f)[0]

    def compare(self, used, width, expected, low, high, is_log=False):
        """The largest difference from expected(value) at values spread evenly (of a logarithm) from low to high, and a bit beyond."""
        position, value = (math.log, math.exp) if is_log else (float, float)
        low, high = position(low), position(high)
        points = list(used)
        points[::width] = [position(x) for x in points[::width]]
        worst = 0
        for i in range(VALUES):
            x = low + (high - low) * (1.1 * i / (VALUES - 1) - 0.05)
            for mine, theirs in zip(linear(points, width, x), expected(value(x))):
                worst = max(worst, abs(mine - theirs))
        print(f"difference {worst:.5f} <= {TOLERANCE:.5f}")
        self.assertLessEqual(worst, TOLERANCE)

    def test_color_spaces(self):
        for space, number, wrap in SPACES:
            for name, points in COLORS.items():
                with self.subTest(f"{space} {wrap}, {name}"):
                    theirs = vtk.vtkColorTransferFunction()
                    theirs.SetColorSpace(number)
                    theirs.SetHSVWrap(wrap)
                    for i in range(0, len(points), 4):
                        theirs.AddRGBPoint(*points[i:i + 4])
                    used = self.used({"ColorSpace": space, "HSVWrap": wrap, "RGBPoints": points})
                    self.compare(used["RGBPoints"], 4, theirs.GetColor, points[0], points[-4])

    def test_sharpness_and_midpoint(self):
        for sharpness in (0, 0.005, 0.3, 0.7, 0.98, 1):
            for middle in (0, 0.31, 0.5, 0.8, 1):
                with self.subTest(f"{sharpness}, {middle}"):
                    points = [-1, 0.1, middle, sharpness, 0.3, 0.9, middle, sharpness, 2, 0, 0.5, 0]
                    theirs = vtk.vtkPiecewiseFunction()
                    for i in range(0, len(points), 4):
                        theirs.AddPoint(*points[i:i + 4])
                    used = self.used({"RGBPoints": COLORS["ends alone"], "Points": points})["Points"]
                    pairs = [x for i in range(0, len(used), 4) for x in used[i:i + 2]]
                    self.compare(pairs, 2, lambda x, f=theirs: [f.GetValue(x)], -1, 2)

    def test_logarithmic_scale(self):
        """Straight in the logarithm in each space, and said so where it is written."""
        points = [0.01, 0.23, 0.30, 0.75, 100, 0.71, 0.02, 0.15]
        opacities = [0.01, 0, 0.5, 0.4, 1, 1, 0.5, 0, 100, 0.2, 0.5, 0]
        for space, number in (("RGB", 0), ("Lab", 2), ("Diverging", 3)):
            with self.subTest(space):
                theirs, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
                theirs.SetColorSpace(number)
                theirs.SetScaleToLog10()
                opacity.UseLogScaleOn()
                for i in range(0, len(points), 4):
                    theirs.AddRGBPoint(*points[i:i + 4])
                for i in range(0, len(opacities), 4):
                    opacity.AddPoint(*opacities[i:i + 4])
                used = self.used({"ColorSpace": space, "UseLogScale": 1, "RGBPoints": points, "Points": opacities})
                self.assertEqual(used["UseLogScale"], 1)
                self.compare(used["RGBPoints"], 4, lambda x, f=theirs: f.GetColor(x), 0.01, 100, True)
                pairs = [x for i in range(0, len(used["Points"]), 4) for x in used["Points"][i:i + 2]]
                self.compare(pairs, 2, lambda x, f=opacity: [f.GetValue(x)], 0.01, 100, True)

    def test_scale_that_has_no_logarithm(self):
        used = self.used({"UseLogScale": 1, "RGBPoints": COLORS["ends alone"]})
        self.assertNotIn("UseLogScale", used)
        self.assertEqual(used["RGBPoints"], COLORS["ends alone"])

    def test_many_points(self):
        """A thousand colours far apart, each way bent: room is shared, order stays."""
        points = [x for i in range(1024) for x in (i, i % 2, 0.1, 1 - i % 2)]
        bent = [x for i in range(1024) for x in (i, i % 2, 0.5, 0.7)]
        used = self.used({"ColorSpace": "Diverging", "RGBPoints": points, "Points": bent})
        self.assertEqual(used["RGBPoints"][-4:], points[-4:])
        for key in ("RGBPoints", "Points"):
            values = used[key][::4]
            self.assertEqual(values, sorted(values))

    def test_wrong_maps(self):
        for text, said in (('{"RGBPoints": [0, 0, 0, 0, 1, 1, 1]}', "RGBPoints: expected"), ('{"RGBPoints": [0, 0, 0, 2]}', "RGBPoints: expected"),
                           ('{"RGBPoints": [1, 0, 0, 0, 0, 0, 0, 0]}', "RGBPoints: expected"), ('{"RGBPoints": "red"}', "RGBPoints: expected"),
                           ('{"ColorSpace": "CMYK", "RGBPoints": [0, 0, 0, 0]}', "ColorSpace: expected"),
                           ('{"ColorSpace": 3, "RGBPoints": [0, 0, 0, 0]}', "ColorSpace: expected"),
                           ('{"RGBPoints": [0, 0, 0, 0], "Points": [0, 1, 0.5, 1.5]}', "Points: expected"),
                           ('{"RGBPoints": [0, 0, 0, 0], "Points": [0, 1, -0.5, 0]}', "Points: expected"),
                           ('{"RGBPoints": [0, 0, 0, 0], "Points": [1, 1, 0.5, 0, 0, 1, 0.5, 0]}', "Points: expected")):
            with self.subTest(text):
                done = self.render(text)
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertIn("map.json': " + said, done.stderr)


if __name__ == "__main__":
    unittest.main()
