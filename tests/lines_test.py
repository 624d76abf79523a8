"""tetralod lines: files that VTK reads, lines where VTK's tracer has them, seeds of all kinds, words and files that make no sense."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

PROGRAM = os.environ["TETRALOD_PROGRAM"]


def run(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False, timeout=120)


def read(reader, path):
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def lines_of(polydata):
    """The points of each line."""
    ids, points = vtk.vtkIdList(), vtk_to_numpy(polydata.GetPoints().GetData())
    polydata.GetLines().InitTraversal()
    lines = []
    while polydata.GetLines().GetNextCell(ids):
        lines.append(points[[ids.GetId(i) for i in range(ids.GetNumberOfIds())]])
    return lines


class Lines(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tetralod-lines-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.mesh = os.path.join(cls.folder, "m.vtu")
        assert run("sample", "sphere-flow", "-o", cls.mesh, "--size", "24").returncode == 0

    def path(self, name):
        return os.path.join(self.folder, name)

    def lines(self, *words, name="l.vtp"):
        done = run("lines", self.mesh, "-o", self.path(name), "--json", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def check_fails(self, status, said, *words, name="none.vtp"):
        done = run("lines", self.mesh, "-o", self.path(name), *words)
        self.assertEqual(done.returncode, status, done.stderr)
        self.assertIn(said, done.stderr)
        self.assertFalse(os.path.exists(self.path(name)))

    def test_where_vtk_has_them(self):
        """Both follow the flow past the sphere from the same points to the outlet."""
        seeds = [(-9.0, 0.4 + 0.3 * i, 0.1 * i) for i in range(10)]
        with open(self.path("seeds.csv"), "w", encoding="ascii") as f:
            f.write("x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in seeds))
        said = self.lines("--seeds", self.path("seeds.csv"), "--order", "5", "--direction", "forward")
        self.assertEqual(said["ends"]["boundary"], 10)
        ours = lines_of(read(vtk.vtkXMLPolyDataReader(), self.path("l.vtp")))
        source, points = vtk.vtkPolyData(), vtk.vtkPoints()
        for seed in seeds:
            points.InsertNextPoint(seed)
        source.SetPoints(points)
        grid = read(vtk.vtkXMLUnstructuredGridReader(), self.mesh)
        grid.GetPointData().SetActiveVectors("velocity")
        tracer = vtk.vtkStreamTracer()
        tracer.SetInputData(grid)
        tracer.SetSourceData(source)
        tracer.SetIntegratorTypeToRungeKutta45()
        tracer.SetMaximumError(1e-7)
        tracer.SetMaximumPropagation(100)
        tracer.SetMaximumNumberOfSteps(100000)
        tracer.SetIntegrationDirectionToForward()
        tracer.Update()
        theirs = lines_of(tracer.GetOutput())
        self.assertEqual(len(ours), len(theirs))
        for mine, other in zip(ours, theirs):
            x = numpy.linspace(-8.9, min(mine[-1][0], other[-1][0]), 300)
            for k in (1, 2):
                apart = numpy.interp(x, mine[:, 0], mine[:, k]) - numpy.interp(x, other[:, 0], other[:, k])
                self.assertLess(abs(apart).max(), 0.02)

    def test_files(self):
        """Points, lines and channels as VTK reads them."""
        said = self.lines("--seeds", "grid:6", "--box", "-1,0,0,1,2,2")
        polydata = read(vtk.vtkXMLPolyDataReader(), self.path("l.vtp"))
        self.assertEqual(polydata.GetNumberOfLines(), said["lines"])
        self.assertEqual(polydata.GetNumberOfPoints(), said["vertices"])
        self.assertAlmostEqual(sum(numpy.linalg.norm(numpy.diff(line, axis=0), axis=1).sum() for line in lines_of(polydata)),
                               said["length"], delta=1e-4 * said["length"])
        data = polydata.GetPointData()
        names = [data.GetArrayName(i) for i in range(data.GetNumberOfArrays())]
        self.assertEqual(names, ["time", "speed", "pressure", "velocity", "selected"])
        velocity = vtk_to_numpy(data.GetArray("velocity"))
        self.assertLess(abs(numpy.linalg.norm(velocity, axis=1) - vtk_to_numpy(data.GetArray("speed"))).max(), 1e-5)
        self.assertTrue(0 < said["selected"] < said["lines"])
        for name in ("l.ply", "l.obj", "l.glb"):
            self.lines("--seeds", "grid:6", name=name)
            self.assertTrue(os.path.getsize(self.path(name)) > 1000)

    def test_bench(self):
        """Our lines and VTK's have one length; the bench verifies it."""
        done = run("bench", "lines", "--size", "20", "--runs", "1", "--against-vtk", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        row = json.loads(done.stdout)["rows"][0]
        self.assertEqual(row["lines"], 1000)
        self.assertTrue(row["steps_per_core_second"] > row["vtk_steps_per_core_second"] > 0)

    def test_seeds(self):
        for seeds, lines in (("line:-9,-3,1,-9,3,1:7", 7), ("plane:-9,0,0,1,0,0:100", 100), ("box:-9,-1,-1,-8,1,1:32", 32)):
            self.assertAlmostEqual(self.lines("--seeds", seeds)["lines"], lines, delta=0.2 * lines)
        said = self.lines("--seeds", "critical:50", "--length", "1")
        self.assertTrue(30 < said["lines"] < 70)  # about half of them lies in the sphere
        self.assertTrue(said["length"] <= 2 * said["lines"] * (1 + 1e-6))

    def test_what_makes_no_sense(self):
        self.check_fails(2, "must end in .vtp", name="none.stl")
        self.check_fails(2, "expected grid[:N]", "--seeds", "box:1,2,3")
        self.check_fails(2, "expected grid[:N]", "--seeds", "grid:0")
        self.check_fails(1, "no file", "--seeds", self.path("nothing.csv"))
        self.check_fails(2, "expected X0,Y0,Z0", "--box", "1,2")
        self.check_fails(2, "'vlocity'", "--channel", "vlocity")
        self.check_fails(2, "a flow has 3", "--channel", "pressure")
        self.check_fails(2, "'nope'", "--channels", "nope")
        self.check_fails(2, "does not meet", "--seeds", "plane:99,0,0,1,0,0")
        with open(self.path("bad.csv"), "w", encoding="ascii") as f:
            f.write("x,y,z\n1,2,3\n1,2\n")
        self.check_fails(1, "line 3", "--seeds", self.path("bad.csv"))
        with open(self.path("wide.csv"), "w", encoding="ascii") as f:
            f.write("1,2,3\n1,2,3" + " " * 1018 + "4,5,6\n")  # not two lines
        self.check_fails(1, "line 2 is no text of less than 1024 bytes", "--seeds", self.path("wide.csv"))


if __name__ == "__main__":
    unittest.main()
