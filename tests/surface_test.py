"""tetralod surface against VTK: the same triangles, and files that VTK's readers take."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest

import vtk

PROGRAM = os.environ["TETRALOD_PROGRAM"]


def run(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False, timeout=120)


def area(polydata):
    only = vtk.vtkTriangleFilter()
    only.SetInputData(polydata)
    measure = vtk.vtkMassProperties()
    measure.SetInputConnection(only.GetOutputPort())
    measure.Update()
    return measure.GetSurfaceArea()


def read(reader, path):
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def read_glb(path):
    reader = vtk.vtkGLTFReader()
    reader.SetFileName(path)
    flat = vtk.vtkCompositeDataGeometryFilter()
    flat.SetInputConnection(reader.GetOutputPort())
    flat.Update()
    return flat.GetOutput()


def names(polydata):
    data = polydata.GetPointData()
    return [data.GetArrayName(i) for i in range(data.GetNumberOfArrays())]


class Surface(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tetralod-surface-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.grid = os.path.join(cls.folder, "g.vtu")
        assert run("sample", "gaussians", "-o", cls.grid, "--size", "24").returncode == 0
        done = run("surface", cls.grid, "-o", os.path.join(cls.folder, "s.ply"), "--value", "40%", "--json")
        assert done.returncode == 0, done.stderr
        cls.said = json.loads(done.stdout)

    def path(self, name):
        return os.path.join(self.folder, name)

    def test_same_as_vtk(self):
        """As many triangles and points as vtkContour3DLinearGrid, with the same area."""
        grid = read(vtk.vtkXMLUnstructuredGridReader(), self.grid)
        contour = vtk.vtkContour3DLinearGrid()
        contour.SetInputData(grid)
        grid.GetPointData().SetActiveScalars(grid.GetPointData().GetArrayName(0))
        contour.SetMergePoints(True)
        contour.SetValue(0, self.said["values"][0])
        contour.Update()
        peer = contour.GetOutput()
        self.assertEqual(self.said["triangles"], peer.GetNumberOfPolys())
        self.assertEqual(self.said["vertices"], peer.GetNumberOfPoints())
        self.assertAlmostEqual(self.said["area"], area(peer), delta=1e-5 * self.said["area"])

    def check_file(self, polydata, fields):
        self.assertEqual(polydata.GetNumberOfPolys(), self.said["triangles"])
        self.assertEqual(polydata.GetNumberOfPoints(), self.said["vertices"])
        self.assertAlmostEqual(area(polydata), self.said["area"], delta=1e-5 * self.said["area"])
        for name in fields:
            self.assertIn(name, names(polydata))

    def test_files_of_all_kinds(self):
        for ending, reader, fields in (("ply", vtk.vtkPLYReader(), ["Normals"]),
                                       ("vtp", vtk.vtkXMLPolyDataReader(), ["Normals", "value"]),
                                       ("obj", vtk.vtkOBJReader(), ["Normals"]), ("stl", vtk.vtkSTLReader(), [])):
            with self.subTest(ending):
                path = self.path("s." + ending)
                done = run("surface", self.grid, "-o", path, "--value", "value=40%")
                self.assertEqual(done.returncode, 0, done.stderr)
                self.check_file(read(reader, path), fields)
        path = self.path("s.glb")
        self.assertEqual(run("surface", self.grid, "-o", path, "--value", "40%", "-q").returncode, 0)
        self.check_file(read_glb(path), ["NORMAL", "_VALUE"])

    def test_values_on_the_surface(self):
        """What is carried has the value that was asked for, and normals point against the gradient."""
        path = self.path("v.vtp")
        self.assertEqual(run("surface", self.grid, "-o", path, "--value", "40%").returncode, 0)
        data = read(vtk.vtkXMLPolyDataReader(), path).GetPointData()
        values = data.GetArray("value")
        low, high = values.GetRange()
        self.assertAlmostEqual(low, self.said["values"][0], delta=1e-6)
        self.assertAlmostEqual(high, self.said["values"][0], delta=1e-6)
        normal = data.GetArray("Normals").GetTuple3(0)
        self.assertAlmostEqual(sum(x * x for x in normal), 1, delta=1e-5)

    def test_model(self):
        """A surface of a model: of its finest mesh, and of a coarse one."""
        model = self.path("m.tlod")
        done = run("build", self.grid, "-o", model)
        self.assertEqual(done.returncode, 0, done.stderr)
        counts = []
        for words in ([], ["--error", "10%"]):
            done = run("surface", model, "-o", self.path("m.ply"), "--value", "40%", "--json", *words)
            self.assertEqual(done.returncode, 0, done.stderr)
            said = json.loads(done.stdout)
            self.assertIn("bounds_promised", said["volume"])
            self.assertAlmostEqual(said["area"], self.said["area"], delta=0.2 * self.said["area"])
            counts.append(said["triangles"])
        self.assertLess(counts[1], counts[0])

    def surface(self, model, *words):
        done = run("surface", model, "-o", self.path("m.vtp"), "--json", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_model_in_patches(self):
        """Patches that the value misses are not read; errors and pixels count where the value is."""
        model = self.path("p.tlod")
        done = run("build", self.grid, "-o", model, "--segment-tets", "4000", "--patch-tets", "400", "--channel-error", "0.001%")
        self.assertEqual(done.returncode, 0, done.stderr)
        full = self.surface(model, "--value", "70%")
        self.assertGreater(full["patches"]["passed_over"], full["patches"]["decoded"])
        self.assertEqual(full["patches"]["passed_over"] + full["patches"]["decoded"], full["volume"]["patches"])
        again = self.surface(model, "--value", "value=70%", "--derive", "other=2*value")  # the whole mesh
        self.assertNotIn("tets_decoded", again)
        for key in ("triangles", "vertices", "closed"):
            self.assertEqual(full[key], again[key])
        self.assertLess(full["volume"]["bytes_read"], again["volume"]["bytes_read"])
        span = self.said["values"][0] / 0.4
        here = self.surface(model, "--value", "70%", "--error", "2%")
        self.assertLessEqual(here["field_error"], 0.02 * span * 1.01)
        self.assertEqual(here, {**here, **{key: self.surface(model, "--value", "70%", "--error", "value=2%")[key]
                                           for key in ("triangles", "area", "field_error")}})
        self.assertLess(here["volume"]["tets"], full["volume"]["tets"])
        seen = self.surface(model, "--value", "70%", "--error", "2px", "--view", "30,20", "--size", "320x240")
        self.assertLessEqual(seen["volume"]["error_px"], 2)
        self.assertLessEqual(self.surface(model, "--value", "70%", "--space-error", "1%")["volume"]["space_error"], 0.01 * 12**0.5)
        for words, text in ((["--error", "2px"], "there is no view"), (["--error", "heat=1%"], "no channel 'heat'"),
                            (["--error", "no"], "expected E"), (["--view", "1"], "expected AZ,EL")):
            done = run("surface", model, "-o", self.path("m.vtp"), "--value", "70%", *words)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(text, done.stderr)

    def test_first_picture(self):
        """The bench of a model's first picture: fewer tets than there are, and nearly the same picture."""
        model = self.path("b.tlod")
        self.assertEqual(run("build", self.grid, "-o", model).returncode, 0)
        done = run("bench", "view", "--data", model, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        seen, full = json.loads(done.stdout)["rows"]
        self.assertLess(seen["tets"], full["tets"])
        self.assertLessEqual(seen["error_px"], 1)
        self.assertGreater(seen["decibels"], 45)

    def test_numbers_that_are_none(self):
        """glTF has finite numbers alone: NaN values become 0, and the file is read."""
        text = open(self.path("nan.vtk"), "w", encoding="utf-8")
        with text:
            text.write("# vtk DataFile Version 3.0\nnan\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n"
                       "0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nPOINT_DATA 4\n"
                       "SCALARS x float 1\nLOOKUP_TABLE default\n0 1 1 1\n"
                       "SCALARS odd float 1\nLOOKUP_TABLE default\n1 nan 2 3\n")
        done = run("surface", self.path("nan.vtk"), "-o", self.path("nan.glb"), "--value", "x=0.5")
        self.assertEqual(done.returncode, 0, done.stderr)
        data = read_glb(self.path("nan.glb")).GetPointData().GetArray("_ODD")
        self.assertEqual(data.GetNumberOfTuples(), 3)
        self.assertIn(0.0, [data.GetValue(i) for i in range(3)])

    def test_plane(self):
        done = run("surface", self.grid, "-o", self.path("p.vtp"), "--plane", "0,0,0,0,0,2", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertAlmostEqual(json.loads(done.stdout)["area"], 4, delta=1e-9)

    def test_names_that_a_ply_has(self):
        """Properties of a .ply differ, also where channels are called like coordinates or nearly the same."""
        cells = vtk.vtkUnstructuredGrid()
        points = vtk.vtkPoints()
        for place in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)):
            points.InsertNextPoint(place)
        cells.SetPoints(points)
        cells.InsertNextCell(vtk.VTK_TETRA, 4, (0, 1, 2, 3))
        for name, components in (("x", 1), ("a b", 1), ("a-b", 1), ("v", 3), ("v_0", 1)):
            values = vtk.vtkDoubleArray()
            values.SetName(name)
            values.SetNumberOfComponents(components)
            for i in range(4):
                values.InsertNextTuple([float(i)] * components)
            cells.GetPointData().AddArray(values)
        writer = vtk.vtkXMLUnstructuredGridWriter()
        writer.SetInputData(cells)
        writer.SetFileName(self.path("names.vtu"))
        writer.Write()
        done = run("surface", self.path("names.vtu"), "-o", self.path("names.ply"), "--value", "x=0.5")
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.path("names.ply"), "rb") as f:
            head = f.read().split(b"end_header")[0].decode().splitlines()
        found = [line.split()[-1] for line in head if line.startswith("property")]
        self.assertEqual(len(found), len(set(found)), found)
        self.assertEqual(found[6:], ["channel0", "a_b", "channel2", "v_0", "v_1", "v_2", "channel4", "vertex_indices"])

    def test_wrong_use(self):
        for words, text in ((["-o", "s.ply"], "say --value"), (["--value", "1"], "-o OUT is missing"),
                            (["-o", "s.ply", "--value", "heat=1"], "no channel 'heat'"),
                            (["-o", "s.ply", "--value", "value=warm"], "expected CHANNEL=VALUE"),
                            (["-o", "s.xyz", "--value", "1"], "must end in"),
                            (["-o", "s.ply", "--plane", "0,0,0,0,0,0"], "normal")):
            with self.subTest(words):
                done = subprocess.run([PROGRAM, "surface", self.grid, *words], capture_output=True, text=True, check=False, timeout=60,
                                      cwd=self.folder)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(text, done.stderr)

    def test_empty_surface(self):
        for ending in ("ply", "vtp", "stl", "obj", "glb"):
            with self.subTest(ending):
                done = run("surface", self.grid, "-o", self.path("e." + ending), "--value", "1e9", "--json")
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(json.loads(done.stdout)["triangles"], 0)
        self.assertEqual(read(vtk.vtkXMLPolyDataReader(), self.path("e.vtp")).GetNumberOfPolys(), 0)


if __name__ == "__main__":
    unittest.main()
