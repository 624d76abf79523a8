"""tetralod points: counts, values and files that VTK's readers take."""

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
    return subprocess.run([PROGRAM, "points", *words], capture_output=True, text=True, check=False, timeout=120)


def read(reader, path):
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


class Points(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tetralod-points-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.grid = os.path.join(cls.folder, "g.vtu")
        done = subprocess.run([PROGRAM, "sample", "gaussians", "-o", cls.grid, "--size", "24", "-q"], check=False)
        assert done.returncode == 0

    def points(self, name, *words):
        path = os.path.join(self.folder, name)
        done = run(self.grid, "-o", path, "--json", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout), path

    def test_on_their_isosurfaces(self):
        said, path = self.points("p.vtp", "--values", "40%,60%", "--values", "0.5", "--count", "20000")
        found = read(vtk.vtkXMLPolyDataReader(), path)
        self.assertEqual(found.GetNumberOfPoints(), said["points"])
        self.assertAlmostEqual(said["points"], 20000, delta=5 * math.sqrt(20000))
        data = found.GetPointData()
        values = data.GetArray("value")
        off = max(min(abs(values.GetValue(i) - v) for v in said["values"]) for i in range(said["points"]))
        self.assertLess(off, 1e-6)
        normal = data.GetArray("Normals").GetTuple3(7)
        self.assertAlmostEqual(sum(x * x for x in normal), 1, delta=1e-5)

    def test_as_dense_as_the_surface(self):
        """Areas are those of the verb surface."""
        said, _ = self.points("a.ply", "--values", "40%", "--area", "0.001")
        done = subprocess.run([PROGRAM, "surface", self.grid, "-o", os.path.join(self.folder, "s.ply"), "--value", "40%", "--json"],
                              capture_output=True, text=True, check=False)
        expected = json.loads(done.stdout)["area"] / 0.001
        self.assertAlmostEqual(said["points"], expected, delta=5 * math.sqrt(expected))

    def test_shells_and_ranges(self):
        said, path = self.points("r.ply", "--range", "20%,0.9", "--count", "5000")
        values = read(vtk.vtkPLYReader(), path)
        self.assertEqual(values.GetNumberOfPoints(), said["points"])
        self.assertEqual(said["values"], [])
        said, _ = self.points("r.glb", "--range", "0.5,0.9", "--shells", "4")
        for found, value in zip(said["values"], (0.55, 0.65, 0.75, 0.85)):
            self.assertAlmostEqual(found, value, delta=1e-12)
        said, path = self.points("r.obj", "--derive", "r=sqrt(x^2+y^2+z^2)", "--channel", "r", "--clip", "x<0", "--values", "0.7")
        bounds = read(vtk.vtkOBJReader(), path).GetBounds()
        self.assertLess(bounds[1], 1e-6)
        self.assertAlmostEqual(bounds[0], -0.7, delta=0.02)

    def test_seeds(self):
        files = []
        for name, words in (("1.ply", ["--threads", "1"]), ("2.ply", ["--threads", "3"]), ("3.ply", ["--seed", "4"])):
            _, path = self.points(name, "--count", "3000", *words)
            with open(path, "rb") as f:
                files.append(f.read())
        self.assertEqual(files[0], files[1])
        self.assertNotEqual(files[0], files[2])

    def test_wrong_use(self):
        for words, text in ((["--channel", "heat"], "no channel 'heat'"), (["--values", "warm"], "expected V,V"),
                            (["--range", "3"], "expected LOW,HIGH"), (["--range", "3,2"], "expected LOW,HIGH"),
                            (["--values", "1", "--shells", "3"], "--values goes with"), (["--shells", "0"], "--shells")):
            with self.subTest(words):
                done = run(self.grid, "-o", os.path.join(self.folder, "w.ply"), *words)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(text, done.stderr)
        done = run(self.grid, "-o", os.path.join(self.folder, "w.stl"))
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertIn("must end in .ply", done.stderr)


if __name__ == "__main__":
    unittest.main()
