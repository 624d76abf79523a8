"""Words that verbs which look at a mesh share: derived channels, thresholds, regions, planes."""

import json
import math
import os
import shutil
import subprocess
import tempfile
import unittest

import vtk

PROGRAM = os.environ["TETRALOD_PROGRAM"]


def run(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False, timeout=120)


def write_regions(path):
    """Two tets side by side, of regions 3 and 8, with a vector and a scalar."""
    grid = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    for place in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -2)):
        points.InsertNextPoint(place)
    grid.SetPoints(points)
    grid.InsertNextCell(vtk.VTK_TETRA, 4, (0, 1, 2, 3))
    grid.InsertNextCell(vtk.VTK_TETRA, 4, (0, 2, 1, 4))
    for name, components in (("a b", 1), ("U", 3)):
        values = vtk.vtkDoubleArray()
        values.SetName(name)
        values.SetNumberOfComponents(components)
        for i in range(5):
            values.InsertNextTuple([float(i + k) for k in range(components)])
        grid.GetPointData().AddArray(values)
    regions = vtk.vtkIntArray()
    regions.SetName("region")
    regions.InsertNextValue(3)
    regions.InsertNextValue(8)
    grid.GetCellData().AddArray(regions)
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetFileName(path)
    writer.Write()


class Derive(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tetralod-derive-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.grid = os.path.join(cls.folder, "g.vtu")
        cls.two = os.path.join(cls.folder, "two.vtu")
        assert run("sample", "gaussians", "-o", cls.grid, "--size", "20").returncode == 0
        write_regions(cls.two)

    def surface(self, path, *words):
        done = run("surface", path, "-o", os.path.join(self.folder, "s.vtp"), "--json", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_sphere_of_an_expression(self):
        """An isosurface of a formula of the positions is a sphere."""
        said = self.surface(self.grid, "--derive", "r2=x^2+y^2", "--derive", "r=sqrt(r2+z*z)", "--value", "r=0.8")
        self.assertTrue(said["closed"])
        self.assertAlmostEqual(said["area"], 4 * math.pi * 0.64, delta=0.02 * 8)

    def test_planes(self):
        """The cube is [-1, 1]^3; a hemisphere, a quarter, an eighth of a sphere."""
        whole = ("--derive", "r=sqrt(x^2+y^2+z^2)", "--value", "r=0.8")
        area = self.surface(self.grid, *whole)["area"]
        for words, part in ((["--clip", "x<0"], 2), (["--clip=-x=50%"], 2), (["--clip", "y=0"], 2),
                            (["--clip", "1,1,0,0"], 2), (["--clip", "x>0", "--clip", "z<50%"], 4),
                            (["--clip", "x>0", "--clip", "z<0", "--clip", "y>0"], 8), (["--clip", "x<9"], 1)):
            with self.subTest(words):
                said = self.surface(self.grid, *whole, *words)
                self.assertAlmostEqual(said["area"], area / part, delta=0.01 * area)
                self.assertEqual(said["volume"]["kept_tets"] > 0, True)

    def test_thresholds_and_regions(self):
        box = ("--plane", "0.1,0,0,1,0,0")
        both = self.surface(self.two, *box)["area"]
        self.assertAlmostEqual(both, 0.9 * 0.9 / 2 * 3, delta=1e-9)
        for words, area in ((["--regions", "3"], 0.405), (["--hide-regions", "3"], 0.81), (["--regions", "3,8"], 1.215),
                            (["--threshold", "a b=,3"], 0.405), (["--threshold", "a b=0,100%"], 1.215),
                            (["--threshold", "U=,7.5"], 0.405)):
            with self.subTest(words):
                self.assertAlmostEqual(self.surface(self.two, *box, *words)["area"], area, delta=1e-9)

    def test_model(self):
        """Of a model, at any error."""
        model = os.path.join(self.folder, "g.tlod")
        self.assertEqual(run("build", self.grid, "-o", model, "-q").returncode, 0)
        words = ("--derive", "r=sqrt(x^2+y^2+z^2)", "--value", "r=0.8", "--clip", "x<0")
        for more in ([], ["--error", "5%"]):
            said = self.surface(model, *words, *more)
            self.assertAlmostEqual(said["area"], 2 * math.pi * 0.64, delta=0.1 * 4)

    def test_wrong_use(self):
        for words, text in ((["--derive", "r"], "expected NAME=EXPRESSION"),
                            (["--derive", "r=2 *"], "expression '2 *', column 4: expected a number"),
                            (["--derive", "r=2 * heat"], "column 5: there is no channel 'heat'"),
                            (["--derive", "r=2 * heat"], "channels: 'value'"),
                            (["--derive", "value=1"], "there is a channel 'value' already"),
                            (["--threshold", "value"], "expected CHANNEL=LOW,HIGH"),
                            (["--threshold", "value=warm,3"], "expected CHANNEL=LOW,HIGH"),
                            (["--threshold", "heat=1,3"], "no channel 'heat'"), (["--regions", "7"], "no region '7'"),
                            (["--clip", "w<3"], "expected x<V"), (["--clip", "x<"], "expected x<V"),
                            (["--clip", "0,0,0,1"], "a normal with a length")):
            with self.subTest(words):
                done = run("surface", self.grid, "-o", os.path.join(self.folder, "w.ply"), "--value", "value=0.5", *words)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(text, done.stderr)

    def test_nothing_left(self):
        done = run("surface", self.grid, "-o", os.path.join(self.folder, "n.ply"), "--value", "0.5", "--clip", "x<-7")
        self.assertEqual(done.returncode, 1)
        self.assertIn("nothing is left", done.stderr)


if __name__ == "__main__":
    unittest.main()
