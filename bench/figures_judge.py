"""Judges a simplified mesh with VTK and numpy alone: none of tetralod's code takes part.

The error of a channel at an original vertex is the difference between its value and that of the
simplified mesh's linear interpolant there; a vertex that no tet holds takes the value at the nearest
point of the simplified boundary. Tets that are flat have no interpolant and hold nothing."""

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

# A tet with six times its volume below this part of its longest edge cubed counts as flat.
FLAT = 1e-7


def read_tets(path, channel):
    """xyz, tets and values of a .vtu of tets."""
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    values = grid.GetPointData().GetArray(channel)
    if values is None:
        raise SystemExit(f"figures: '{path}' holds no channel '{channel}'")
    tets = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4).astype(numpy.int64)
    return vtk_to_numpy(grid.GetPoints().GetData()).copy(), tets, vtk_to_numpy(values).copy()


def volumes(xyz, tets):
    p = xyz.astype(numpy.float64)
    a = p[tets[:, 0]]
    normal = numpy.cross(p[tets[:, 1]] - a, p[tets[:, 2]] - a)
    return (normal * (p[tets[:, 3]] - a)).sum(1) / 6


def face_table(tets, vert_count):
    """The faces of one tet as vertex triples, and how many faces have more than two tets."""
    faces = numpy.concatenate([tets[:, [1, 2, 3]], tets[:, [0, 3, 2]], tets[:, [0, 1, 3]], tets[:, [0, 2, 1]]])
    keys = numpy.random.default_rng(5).integers(1, 1 << 63, vert_count, dtype=numpy.uint64)
    sums = keys[faces].sum(1, dtype=numpy.uint64)  # the same for the three vertices in any order
    _, first, counts = numpy.unique(sums, return_index=True, return_counts=True)
    return faces[first[counts == 1]], int((counts > 2).sum())


def area(xyz, triangles):
    p = xyz.astype(numpy.float64)
    a = p[triangles[:, 0]]
    return 0.5 * numpy.linalg.norm(numpy.cross(p[triangles[:, 1]] - a, p[triangles[:, 2]] - a), axis=1).sum()


def grid_of(xyz, tets, values):
    grid = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(numpy.ascontiguousarray(xyz), deep=1))
    grid.SetPoints(points)
    cells = vtk.vtkCellArray()
    cells.SetData(4, numpy_to_vtkIdTypeArray(numpy.ascontiguousarray(tets.ravel()), deep=1))
    grid.SetCells(vtk.VTK_TETRA, cells)
    array = numpy_to_vtk(values.astype(numpy.float64), deep=1)
    array.SetName("value")
    grid.GetPointData().SetScalars(array)
    return grid


def solid(xyz, tets):
    p = xyz.astype(numpy.float64)
    longest = numpy.zeros(len(tets))
    for i in range(4):
        for j in range(i):
            longest = numpy.maximum(longest, ((p[tets[:, i]] - p[tets[:, j]]) ** 2).sum(1))
    return tets[numpy.abs(6 * volumes(xyz, tets)) > FLAT * longest ** 1.5]


def probe(xyz, tets, values, queries):
    """Values at the queries, and which of them a tet holds."""
    source = vtk.vtkProbeFilter()
    source.SetSourceData(grid_of(xyz, tets, values))
    source.SetCellLocatorPrototype(vtk.vtkStaticCellLocator())
    source.ComputeToleranceOff()
    source.SetTolerance(1e-9)
    cloud, points = vtk.vtkPolyData(), vtk.vtkPoints()
    points.SetData(numpy_to_vtk(numpy.ascontiguousarray(queries), deep=1))
    cloud.SetPoints(points)
    source.SetInputData(cloud)
    source.Update()
    data = source.GetOutput().GetPointData()
    return vtk_to_numpy(data.GetArray("value")).copy(), vtk_to_numpy(data.GetArray("vtkValidPointMask")) != 0


def project(xyz, tets, values, queries):
    """Values and distances at the nearest points of the boundary."""
    triangles, _ = face_table(tets, len(xyz))
    p = xyz.astype(numpy.float64)
    surface, points, polys = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    points.SetData(numpy_to_vtk(p, deep=1))
    polys.SetData(3, numpy_to_vtkIdTypeArray(numpy.ascontiguousarray(triangles.ravel()), deep=1))
    surface.SetPoints(points)
    surface.SetPolys(polys)
    locator = vtk.vtkStaticCellLocator()
    locator.SetDataSet(surface)
    locator.BuildLocator()
    found, distances = numpy.empty(len(queries)), numpy.empty(len(queries))
    cell, nearest, squared = vtk.vtkGenericCell(), [0.0] * 3, vtk.reference(0.0)
    cell_id, sub_id = vtk.reference(0), vtk.reference(0)
    for n, query in enumerate(queries.astype(numpy.float64)):
        locator.FindClosestPoint(query, nearest, cell, cell_id, sub_id, squared)
        corners = triangles[int(cell_id)]
        edges = (p[corners[1:]] - p[corners[0]]).T
        weights = numpy.linalg.lstsq(edges, numpy.array(nearest) - p[corners[0]], rcond=None)[0]
        weights = numpy.clip([1 - weights.sum(), *weights], 0, 1)
        found[n] = weights @ values[corners] / weights.sum()
        distances[n] = float(squared) ** 0.5
    return found, distances


def judge(original, copy):
    """original and copy are (xyz, tets, values). Errors in percent of the original's range, changes in
    percent, distances in percent of the diagonal."""
    xyz, tets, values = original
    used = numpy.unique(tets)
    queries, wanted = xyz[used], values[used].astype(numpy.float64)
    held = solid(copy[0], copy[1])
    found, inside = probe(copy[0], held, copy[2], queries)
    outside = numpy.flatnonzero(~inside)
    distances = numpy.zeros(1)
    if len(outside):
        found[outside], distances = project(copy[0], held, copy[2].astype(numpy.float64), queries[outside])
    error = found - wanted
    value_range, diagonal = numpy.ptp(wanted), numpy.linalg.norm(numpy.ptp(queries, axis=0))
    before, after = volumes(xyz, tets), volumes(copy[0], copy[1])
    triangles_before, _ = face_table(tets, len(xyz))
    triangles_after, bad_faces = face_table(copy[1], len(copy[0]))
    area_before = area(xyz, triangles_before)
    return {"rms": 100 * float(numpy.sqrt((error * error).mean())) / value_range,
            "max": 100 * float(numpy.abs(error).max()) / value_range,
            "outside": int(len(outside)), "outside_distance": 100 * float(distances.max()) / diagonal,
            "volume": 100 * float(after.sum() / before.sum() - 1),
            "area": 100 * float(area(copy[0], triangles_after) / area_before - 1),
            "inverted": int((after < 0).sum()), "flat": int((after == 0).sum()),
            "inverted_before": int((before < 0).sum()), "flat_before": int((before == 0).sum()),
            "bad_faces": bad_faces}
