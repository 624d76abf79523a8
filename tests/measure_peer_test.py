"""What `tetralod compare --json` says, against VTK: other code, other formulas where there is a choice."""

import json
import os
import subprocess
import tempfile
import unittest

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

PROGRAM = os.environ.get("TETRALOD_PROGRAM", "")
ISO = 0.35
SURFACE_SAMPLES = 40000


def tet_grid(n, seed, scale):
    """n^3 points around (0.5, 0.5, 0.5), moved a little at random, and the tets of their cells."""
    rng = np.random.default_rng(seed)
    image = vtk.vtkImageData()
    image.SetDimensions(n, n, n)
    split = vtk.vtkDataSetTriangleFilter()
    split.SetInputData(image)
    split.Update()
    grid = split.GetOutput()
    points = vtk_to_numpy(grid.GetPoints().GetData()).astype(np.float64) / (n - 1)
    points += rng.uniform(-0.08, 0.08, points.shape) / n
    tets = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4).astype(np.int64)
    points = 0.5 + scale * (points - 0.5)
    edges = points[tets[:, 1:]] - points[tets[:, :1]]
    turned = np.einsum("ij,ij->i", np.cross(edges[:, 0], edges[:, 1]), edges[:, 2]) < 0
    tets[turned] = tets[turned][:, [1, 0, 2, 3]]
    return points, tets


def dataset(points, tets, point_data, cell_data):
    grid = vtk.vtkUnstructuredGrid()
    vtk_points = vtk.vtkPoints()
    vtk_points.SetDataTypeToDouble()
    vtk_points.SetData(numpy_to_vtk(points, deep=1))
    cells = vtk.vtkCellArray()
    cells.SetData(4, numpy_to_vtkIdTypeArray(tets.ravel().copy(), deep=1))
    grid.SetPoints(vtk_points)
    grid.SetCells(vtk.VTK_TETRA, cells)
    for data, arrays in ((grid.GetPointData(), point_data), (grid.GetCellData(), cell_data)):
        for name, values in arrays.items():
            array = numpy_to_vtk(np.ascontiguousarray(values), deep=1)
            array.SetName(name)
            data.AddArray(array)
    return grid


def write(grid, path):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(path)
    writer.SetInputData(grid)
    writer.Write()


def volumes(points, tets):
    edges = points[tets[:, 1:]] - points[tets[:, :1]]
    return np.einsum("ij,ij->i", np.cross(edges[:, 0], edges[:, 1]), edges[:, 2]) / 6


class Mesh:
    def __init__(self, n, seed, scale):
        self.points, self.tets = tet_grid(n, seed, scale)
        x, y, z = self.points.T
        self.s = np.sin(5 * x) * np.cos(4 * y) + z * z
        self.v = np.stack([x * y, np.sin(6 * z), x - z * z], axis=1)
        self.c = np.sin(7 * self.points[self.tets].mean(axis=1)).sum(axis=1)
        self.grid = dataset(self.points, self.tets, {"s": self.s, "v": self.v}, {"c": self.c})
        self.locator = vtk.vtkStaticCellLocator()
        self.locator.SetDataSet(self.grid)
        self.locator.BuildLocator()

    def holders(self, places):
        """For each place the tet that holds it, -1 outside, by trying all tets."""
        corners = self.points[self.tets]
        to_weights = np.linalg.inv((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))
        found = np.full(len(places), -1)
        for i, x in enumerate(places):
            w = np.einsum("tij,tj->ti", to_weights, x - corners[:, 0])
            smallest = np.minimum(w.min(axis=1), 1 - w.sum(axis=1))
            if smallest.max() >= 0:
                found[i] = smallest.argmax()
        return found

    def at(self, places):
        """Values of s, v and c at places by VTK's locator, outside at the nearest point. The locator takes
        what is outside of a tet by a thousandth of its size for inside."""
        cell, inside, weights = vtk.vtkGenericCell(), [0.0] * 3, [0.0] * 4
        near, number, sub, d2 = [0.0] * 3, vtk.reference(0), vtk.reference(0), vtk.reference(0.0)
        s, v, c = np.empty(len(places)), np.empty((len(places), 3)), np.empty(len(places))
        for i, x in enumerate(places):
            k = self.locator.FindCell(x, 0.0, cell, inside, weights)
            if k < 0:
                self.locator.FindClosestPoint(x, near, cell, number, sub, d2)
                k = int(number)
                corners = self.points[self.tets[k]]
                rest = np.linalg.solve((corners[1:] - corners[0]).T, np.array(near) - corners[0])
                weights = [1 - rest.sum(), *rest]
            w = np.array(weights)
            s[i], v[i], c[i] = w @ self.s[self.tets[k]], w @ self.v[self.tets[k]], self.c[k]
        return s, v, c


def boundary(grid):
    surface = vtk.vtkGeometryFilter()
    surface.SetInputData(grid)
    surface.Update()
    return surface.GetOutput()


def isosurface(grid, value):
    grid.GetPointData().SetActiveScalars("s")
    contour = vtk.vtkContourFilter()
    contour.SetInputData(grid)
    contour.SetValue(0, value)
    contour.Update()
    return contour.GetOutput()


def triangles_of(surface):
    points = vtk_to_numpy(surface.GetPoints().GetData()).astype(np.float64)
    return points[vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)]


def surface_distances(a, b):
    """Distances of a to b: mean of random points, largest of these and the corners; and the area of a."""
    rng = np.random.default_rng(1)
    t = triangles_of(a)
    areas = np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1) / 2
    chosen = t[rng.choice(len(t), SURFACE_SAMPLES, p=areas / areas.sum())]
    r1, r2 = np.sqrt(rng.random((SURFACE_SAMPLES, 1))), rng.random((SURFACE_SAMPLES, 1))
    inner = (1 - r1) * chosen[:, 0] + r1 * (1 - r2) * chosen[:, 1] + r1 * r2 * chosen[:, 2]
    samples = np.concatenate([inner, t.reshape(-1, 3)])
    locator = vtk.vtkStaticCellLocator()
    locator.SetDataSet(b)
    locator.BuildLocator()
    cell, near, d2 = vtk.vtkGenericCell(), [0.0] * 3, vtk.reference(0.0)
    number, sub = vtk.reference(0), vtk.reference(0)
    distances = np.empty(len(samples))
    for i, x in enumerate(samples):
        locator.FindClosestPoint(x, near, cell, number, sub, d2)
        distances[i] = float(d2) ** 0.5
    return distances[:SURFACE_SAMPLES].mean(), distances.max(), areas.sum()


def compare(a, b, *options):
    with tempfile.TemporaryDirectory() as folder:
        paths = [os.path.join(folder, name) for name in ("a.vtu", "b.vtu")]
        for mesh, path in zip((a, b), paths):
            write(mesh.grid, path)
        done = subprocess.run([PROGRAM, "compare", *paths, *options, "--json"], capture_output=True, text=True)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return json.loads(done.stdout)


@unittest.skipUnless(PROGRAM, "TETRALOD_PROGRAM is not set: no program to compare with")
class Compare(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.a, cls.b = Mesh(12, 1, 1.0), Mesh(7, 2, 0.98)
        cls.said = compare(cls.a, cls.b, "--iso", f"s={ISO}")
        cls.channels = {c["name"]: c for c in cls.said["channels"]}

    def near(self, said, expected, relative):
        self.assertLessEqual(abs(said - expected), relative * abs(expected), f"said {said}, VTK {expected}")

    def test_fields_at_the_vertices(self):
        s, v, _ = self.b.at(self.a.points)
        for name, errors in (("s", abs(s - self.a.s)), ("v", np.linalg.norm(v - self.a.v, axis=1))):
            self.near(self.channels[name]["rms"], np.sqrt((errors**2).mean()), 1e-5)
            self.near(self.channels[name]["max"], errors.max(), 1e-5)
        self.assertEqual(self.said["outside_vertices"], int((self.b.holders(self.a.points) < 0).sum()))
        norms = np.linalg.norm(self.a.v, axis=1)
        for said, expected in zip(self.channels["v"]["range"], (norms.min(), norms.max())):
            self.near(said, expected, 1e-12)

    def test_cell_data_at_the_centroids(self):
        """In a copy that holds them all: outside, the nearest point may lie between several tets."""
        larger = Mesh(7, 2, 1.05)
        said = next(c for c in compare(self.a, larger)["channels"] if c["name"] == "c")
        holders = larger.holders(self.a.points[self.a.tets].mean(axis=1))
        self.assertGreaterEqual(holders.min(), 0)
        errors = abs(larger.c[holders] - self.a.c)
        self.near(said["rms"], np.sqrt((errors**2).mean()), 1e-12)
        self.near(said["max"], errors.max(), 1e-12)

    def test_means_over_the_volume(self):
        """Against random points in each tet, so within their noise."""
        rng = np.random.default_rng(3)
        volume = volumes(self.a.points, self.a.tets)
        weights = rng.dirichlet(np.ones(4), (len(self.a.tets), 8))
        places = np.einsum("tpi,tik->tpk", weights, self.a.points[self.a.tets])
        s, v, c = self.b.at(places.reshape(-1, 3))
        here_s = np.einsum("tpi,ti->tp", weights, self.a.s[self.a.tets]).ravel()
        here_v = np.einsum("tpi,tik->tpk", weights, self.a.v[self.a.tets]).reshape(-1, 3)
        each = np.repeat(volume, 8) / 8
        errors_of = {"s": abs(s - here_s), "v": np.linalg.norm(v - here_v, axis=1), "c": abs(c - np.repeat(self.a.c, 8))}
        for name, errors in errors_of.items():
            self.near(self.channels[name]["mean"], (errors * each).sum() / volume.sum(), 0.02)
        self.near(self.said["volume"][0], volume.sum(), 1e-12)
        self.near(self.said["volume"][1], volumes(self.b.points, self.b.tets).sum(), 1e-12)

    def distances(self, said, surfaces, areas):
        there, back = surface_distances(*surfaces), surface_distances(*reversed(surfaces))
        for said_area, (_, _, area) in zip(areas, (there, back)):
            self.near(said_area, area, 1e-5)
        mean = (there[0] * there[2] + back[0] * back[2]) / (there[2] + back[2])
        self.near(said["mean"], mean, 0.02)
        largest = max(there[1], back[1])
        self.assertGreaterEqual(said["hausdorff"], largest * (1 - 1e-6))
        self.near(said["hausdorff"], largest, 0.06)  # it may lie between the random points
        if "hausdorff_bound" in said:
            self.assertGreaterEqual(said["hausdorff_bound"], largest)

    def test_boundary(self):
        self.distances(self.said["boundary"], (boundary(self.a.grid), boundary(self.b.grid)), self.said["area"])

    def test_isosurface(self):
        iso = self.said["isos"][0]
        self.distances(iso, (isosurface(self.a.grid, ISO), isosurface(self.b.grid, ISO)), iso["area"])


if __name__ == "__main__":
    unittest.main()
