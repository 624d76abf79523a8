"""Files of the collection as VTK and meshio read them, against `tetralod info`; and Exodus files written here as both
read them back. Points, cells by kind, bounds, volumes, channels and their ranges over the volume cells."""

import json
import os
import subprocess
import tempfile
import unittest

import numpy as np

try:
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy
    vtk.vtkLogger.SetStderrVerbosity(vtk.vtkLogger.VERBOSITY_OFF)
    vtk.vtkObject.GlobalWarningDisplayOff()
except ImportError:
    vtk = None
try:
    import meshio
except ImportError:
    meshio = None

PROGRAM = os.environ.get("TETRALOD_PROGRAM", "")
DATA = os.environ.get("TETRALOD_DATA", "")

# Corners and our name of VTK's volume cells, 0: all points.
VOLUME_CELLS = {
    10: (4, "tetra"), 24: (4, "quadratic_tetra"), 12: (8, "hexahedron"), 11: (8, "voxel"),
    25: (8, "quadratic_hexahedron"), 29: (8, "triquadratic_hexahedron"), 13: (6, "wedge"), 26: (6, "quadratic_wedge"),
    32: (6, "quadratic_wedge"), 14: (5, "pyramid"), 27: (5, "quadratic_pyramid"), 42: (0, "polyhedron"),
    15: (10, "prism"), 16: (12, "prism"),
}
OTHER_CELLS = {1: "point", 2: "point", 3: "line", 4: "line", 21: "line"}
LINEAR = {"tetra", "hexahedron", "voxel", "wedge", "pyramid", "polyhedron"}

# What differs, and why.
FILES = {
    "exodus/block-names.e": {},
    "exodus/box-noglom.ex2": {},
    "exodus/disk_out_ref.ex2": {},
    "exodus/mesh_fs8.exo": {"points": False},  # VTK gives each block its own points
    "exodus/mug.e": {"points": False},
    # the names of its maps of nodes and elements, which are numbers of the file
    "exodus/edgeFaceElem.exii": {"points": False, "theirs": {"Luigi PISTILLI", "Benito STEFANELLI"}},
    "exodus/biplane_rms_pressure_bs.exo": {"points": False},
    "exodus/simple-cube-hex8.e": {},
    "exodus/simple-cube-hex27.e": {},
    "exodus/simple-cube-tet4.e": {},
    "exodus/simple-cube-tet10.e": {},
    "exodus/simple-cube-wedge6.e": {},
    "exodus/simple-cube-wedge18.e": {},
    "exodus/simple-cube-pyramid5.e": {},
    "exodus/simple-cube-multi-element-order1.e": {},
    "exodus/simple-cube-multi-element-order2.e": {},
    # not simple-cube-pyramid14.e, whose nodes VTK 9.1 reads in rows of another length
    "cgns/HeatingCoil.cgns": {},
    "cgns/bump_3df_hybrid.cgns": {},
    "cgns/bump_3df_unstr.cgns": {},
    "cgns/sqnz_s.adf.cgns": {},
    "cgns/sqnz_s.hdf.cgns": {},
    "cgns/tut21.cgns": {},
    "cgns/tut21_hdf5.cgns": {},
    # of surfaces alone, so that no volume cell has a value; and n-sided cells
    "ensight/TEST.case": {"ours": {"Face_Velocity", "Face_Pressure"}},
    "ensight/TEST_bin.case": {"ours": {"Face_Velocity", "Face_Pressure"}},
    "ensight/cylinder_Re35.case": {},
    # complex values are two channels here, a pair there
    "ensight/elements.case": {
        "theirs": {"pointCScalars", "cellCScalars"},
        "ours": {"pointCScalars_r", "pointCScalars_i", "cellCScalars_r", "cellCScalars_i"}},
    "xdmf-hdf5/can_0.hdf": {},
    # deformed: the faces of its cells are not plane, and each program has another volume for them
    "xdmf-hdf5/can_1.hdf": {"volume": 0.02},
    "xdmf-hdf5/can_2.hdf": {"volume": 0.04},
    "hexmixed/can.vtu": {"volume": 0.04},
    "openfoam/cubeflow": {},
    "openfoam/cavity": {},
    "openfoam/64BitFloats": {},
    "hexmixed/fire_ug.vtu": {},
    "hexmixed/ball_4.vtk": {},
    "tensor/notch_stress_fixed.vtk": {},
    "tet/CylinderQuadratic.vtk": {},
    "tet/bracket_appended_compressed.vtu": {},
    "tet/monodomain3d_0.vtu": {},
}

MESHIO_FILES = {
    # regions and labels are no channels here
    "gmsh/piece.asc.v22.msh": {"theirs": {"gmsh:physical", "gmsh:geometrical"}},
    "gmsh/piece.bin.v22.msh": {"theirs": {"gmsh:physical", "gmsh:geometrical"}},
    "gmsh/piece.asc.v41.msh": {"theirs": {"gmsh:dim_tags", "gmsh:geometrical"}},
    "gmsh/piece.bin.v41.msh": {"theirs": {"gmsh:dim_tags", "gmsh:geometrical"}},
    # not piece.*.v40.msh, which meshio can't read
    "gmsh/surfaces_in_3d.bin.v41.msh": {},
    "gmsh/unstructured_hex.v22.msh": {"theirs": {"gmsh:physical", "gmsh:geometrical"}},
    "tet/Armadillo13K.msh": {"theirs": {"gmsh:dim_tags", "gmsh:geometrical"}},
    # references are regions here; values of a .sol are not read there
    "tet/hand.mesh": {"theirs": {"medit:ref"}},
    "tet/tinyBoxt.mesh": {"theirs": {"medit:ref"}, "ours": {"solution1"}},
    "tet/ellipsoid_15811_elements.ele": {},
    "multimaterial/mickey_mesh.ele": {"theirs": {"tetgen:ref"}},
    "xdmf-hdf5/mesh.xdmf": {},
}
MESHIO_VOLUMES = {"tetra": 4, "tetra10": 4, "hexahedron": 8, "hexahedron20": 8, "hexahedron27": 8, "wedge": 6,
                  "wedge15": 6, "pyramid": 5, "pyramid13": 5}
MESHIO_KINDS = {"tetra10": "quadratic_tetra", "hexahedron20": "quadratic_hexahedron", "triangle": "surface",
                "hexahedron27": "triquadratic_hexahedron", "quad": "surface", "triangle6": "surface",
                "vertex": "point"}


class Summary:
    """What a peer found."""

    def __init__(self):
        self.points, self.kinds, self.ranges, self.volume = 0, {}, {}, 0.0
        self.bounds = None

    def count(self, kind, count):
        if count:
            self.kinds[kind] = self.kinds.get(kind, 0) + int(count)

    def stretch(self, places):
        box = np.stack([places.min(axis=0), places.max(axis=0)], axis=1)
        if self.bounds is not None:
            box = np.stack([np.minimum(box[:, 0], self.bounds[:, 0]), np.maximum(box[:, 1], self.bounds[:, 1])], axis=1)
        self.bounds = box

    def add_values(self, on, name, values):
        values = np.asarray(values, dtype=float).reshape(len(values), -1)
        values = np.linalg.norm(values, axis=1) if values.shape[1] > 1 else values[:, 0]
        values = values[np.isfinite(values)]
        if len(values):
            low, high = self.ranges.get((on, name), (np.inf, -np.inf))
            self.ranges[(on, name)] = (min(low, values.min()), max(high, values.max()))


# ---- VTK ----

def vtk_reader(path):
    end = os.path.splitext(path)[1]
    if os.path.isdir(path):
        reader = vtk.vtkOpenFOAMReader()
        reader.SetFileName(os.path.join(path, "case.foam"))
        reader.DecomposePolyhedraOff()
        reader.CreateCellToPointOff()
        reader.UpdateInformation()
        reader.EnableAllCellArrays()
        reader.EnableAllPointArrays()
        reader.DisableAllPatchArrays()
        reader.SetPatchArrayStatus("internalMesh", 1)
    elif end in (".e", ".exo", ".ex2", ".exii"):
        reader = vtk.vtkExodusIIReader()
        reader.SetFileName(path)
        reader.UpdateInformation()
        for kind in (reader.NODAL, reader.ELEM_BLOCK):
            for i in range(reader.GetNumberOfObjectArrays(kind)):
                reader.SetObjectArrayStatus(kind, reader.GetObjectArrayName(kind, i), 1)
        reader.GenerateObjectIdCellArrayOff()
        reader.GenerateGlobalElementIdArrayOff()
        reader.GenerateGlobalNodeIdArrayOff()
        reader.SetApplyDisplacements(0)
    elif end == ".cgns":
        reader = vtk.vtkCGNSReader()
        reader.SetFileName(path)
        reader.UpdateInformation()
        reader.EnableAllBases()
        reader.EnableAllPointArrays()
        reader.EnableAllCellArrays()
    elif end == ".case":
        reader = vtk.vtkGenericEnSightReader()
        reader.SetCaseFileName(path)
        reader.ReadAllVariablesOn()
    elif end == ".vtk":
        reader = vtk.vtkDataSetReader()
        reader.SetFileName(path)
        reader.ReadAllScalarsOn()
        reader.ReadAllVectorsOn()
        reader.ReadAllTensorsOn()
        reader.ReadAllFieldsOn()
    else:
        reader = vtk.vtkHDFReader() if end == ".hdf" else vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(path)
    return reader


def leaves(data):
    if not data.IsA("vtkCompositeDataSet"):
        yield data, None
        return
    at = data.NewIterator()
    at.InitTraversal()
    while not at.IsDoneWithTraversal():
        yield at.GetCurrentDataObject(), at.GetCurrentMetaData()
        at.GoToNextItem()


def add_dataset(found, grid):
    ids, used, cells = vtk.vtkIdList(), set(), []
    found.points += grid.GetNumberOfPoints()
    for c in range(grid.GetNumberOfCells()):
        kind = grid.GetCellType(c)
        if kind not in VOLUME_CELLS:
            found.count(OTHER_CELLS.get(kind, "surface"), 1)
            continue
        corners, name = VOLUME_CELLS[kind]
        found.count(name, 1)
        grid.GetCellPoints(c, ids)
        used.update(ids.GetId(i) for i in range(corners or ids.GetNumberOfIds()))
        cells.append(c)
    if not cells:
        return
    used = sorted(used)
    found.stretch(np.array([grid.GetPoint(i) for i in used]))
    for on, data, rows in (("vertex", grid.GetPointData(), used), ("tet", grid.GetCellData(), cells)):
        for i in range(data.GetNumberOfArrays()):
            if data.GetArray(i):
                found.add_values(on, data.GetArrayName(i), vtk_to_numpy(data.GetArray(i))[rows])
    sizes = vtk.vtkCellSizeFilter()
    sizes.SetInputData(grid)
    sizes.Update()
    found.volume += abs(vtk_to_numpy(sizes.GetOutput().GetCellData().GetArray("Volume"))[cells]).sum()


def vtk_summary(path):
    reader = vtk_reader(path)
    reader.UpdateInformation()
    steps, info = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS(), reader.GetOutputInformation(0)
    if info.Has(steps):
        reader.UpdateTimeStep(info.Get(steps, 0))
    else:
        reader.Update()
    found = Summary()
    for grid, _ in leaves(reader.GetOutputDataObject(0)):
        add_dataset(found, grid)
    return found


# ---- meshio ----

def meshio_summary(path):
    mesh, found = meshio.read(path), Summary()
    found.points = len(mesh.points)
    volumes = [i for i, block in enumerate(mesh.cells) if block.type in MESHIO_VOLUMES]
    for block in mesh.cells:
        found.count(MESHIO_KINDS.get(block.type, block.type), len(block.data))
    if not volumes:
        return found
    used = np.unique(np.concatenate([mesh.cells[i].data[:, :MESHIO_VOLUMES[mesh.cells[i].type]].ravel()
                                     for i in volumes]))
    found.stretch(mesh.points[used])
    for name, values in mesh.point_data.items():
        found.add_values("vertex", name, np.asarray(values)[used])
    for name, values in mesh.cell_data.items():
        found.add_values("tet", name, np.concatenate([values[i] for i in volumes]))
    return found


# ---- the comparison ----

def formats():
    done = subprocess.run([PROGRAM, "formats", "--json"], capture_output=True, text=True, check=True)
    return {row["name"]: row["reads"] for row in json.loads(done.stdout)["formats"]}


def differences(info, found, allowed):
    """One line for each thing that differs and may not."""
    if allowed.get("points", True) and info["read"]["points"] != found.points:
        yield "%d points, %d there" % (info["read"]["points"], found.points)
    if info["cells"] != found.kinds:
        yield "cells %s, there %s" % (info["cells"], found.kinds)
    if not info["tets"]:
        return
    if not np.allclose(info["bounds"], found.bounds.ravel(), rtol=0, atol=1e-6 * info["diagonal"]):
        yield "bounds %s, there %s" % (info["bounds"], found.bounds)
    if found.volume and set(info["cells"]) <= LINEAR | {"surface", "line", "point"}:
        if abs(info["volume"] - found.volume) > allowed.get("volume", 1e-4) * found.volume:
            yield "volume %g, there %g" % (info["volume"], found.volume)
    # VTK leaves the '_' before the letters of components at the names of vectors that it joins.
    theirs = {(on, name.rstrip("_")): span for (on, name), span in found.ranges.items()}
    ours = {(c["on"], c["name"].rstrip("_")): c["range"] for c in info["channels"]}
    for key in sorted(set(theirs) | set(ours)):
        if key not in ours:
            if key[1] not in allowed.get("theirs", ()):
                yield "%s is there alone" % (key,)
        elif key not in theirs:
            if key[1] not in allowed.get("ours", ()):
                yield "%s is here alone" % (key,)
        elif not np.allclose(ours[key], theirs[key], rtol=1e-5, atol=1e-6 * max(map(abs, theirs[key]))):
            yield "%s %s, there %s" % (key, ours[key], theirs[key])


class Read(unittest.TestCase):
    def check(self, files, summary, needed):
        """needed: ending to the format that must be there."""
        there, done = formats(), 0
        for name, allowed in files.items():
            path = os.path.join(DATA, name)
            if not DATA or not os.path.exists(path):
                continue
            run = subprocess.run([PROGRAM, "info", path, "--json", "--quiet"], capture_output=True, text=True)
            if run.returncode and any(name.endswith(end) and not there[form] for end, form in needed.items()):
                continue
            with self.subTest(file=name):
                self.assertEqual(run.returncode, 0, run.stderr)
                self.assertEqual(list(differences(json.loads(run.stdout), summary(path), allowed)), [])
                done += 1
        if not done:
            self.skipTest("no data")

    @unittest.skipUnless(vtk, "python3-vtk9 is not installed")
    def test_as_vtk_reads(self):
        self.check(FILES, vtk_summary, {".hdf": "VTKHDF", ".hdf.cgns": "VTKHDF", "hdf5.cgns": "VTKHDF", ".exo": "VTKHDF"})

    @unittest.skipUnless(meshio, "python3-meshio is not installed")
    def test_as_meshio_reads(self):
        self.check(MESHIO_FILES, meshio_summary, {".xdmf": "XDMF"})


# ---- Exodus out ----

def exodus_reader(path):
    reader = vtk_reader(path)
    for i in range(reader.GetNumberOfObjects(reader.SIDE_SET)):
        reader.SetObjectStatus(reader.SIDE_SET, i, 1)
    reader.Update()
    return reader


class Written(unittest.TestCase):
    def setUp(self):
        self.source = os.path.join(DATA, "tet/tinyBoxt.mesh")
        if not DATA or not os.path.exists(self.source):
            self.skipTest("no data")
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def convert(self, name):
        path = os.path.join(self.folder.name, name)
        subprocess.run([PROGRAM, "convert", self.source, path, "--quiet"], check=True, stdout=subprocess.DEVNULL)
        return path

    def info(self, path):
        run = subprocess.run([PROGRAM, "info", path, "--json"], capture_output=True, text=True, check=True)
        return json.loads(run.stdout)

    @unittest.skipUnless(vtk, "python3-vtk9 is not installed")
    def test_vtk_reads_exodus(self):
        plain = vtk_reader(self.convert("plain.vtu"))
        plain.Update()
        grid = plain.GetOutput()
        points = vtk_to_numpy(grid.GetPoints().GetData())
        tets = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4)
        regions = vtk_to_numpy(grid.GetCellData().GetArray("region"))
        values = vtk_to_numpy(grid.GetPointData().GetArray("solution1"))
        reader = exodus_reader(self.convert("blocks.exo"))
        facts = {label["id"]: label["faces"] for label in self.info(self.source)["labels"]}
        blocks, sides = 0, {}
        for part, meta in leaves(reader.GetOutput()):
            name = meta.Get(vtk.vtkCompositeDataSet.NAME())
            number = int(name.split(": ")[-1])
            if "set ID" in name:
                sides[number] = part.GetNumberOfCells()
                continue
            found = vtk_to_numpy(part.GetCells().GetConnectivityArray()).reshape(-1, 4)
            # VTK numbers the points of each block anew, in the order in which its cells use them.
            rows, places = tets[regions == number], vtk_to_numpy(part.GetPoints().GetData())
            self.assertTrue(np.array_equal(places[found], points[rows].astype(places.dtype)))
            there = vtk_to_numpy(part.GetPointData().GetArray("solution1_"))
            self.assertTrue(np.array_equal(there[found], values[rows].astype(there.dtype)))
            blocks += 1
        self.assertEqual(blocks, len(set(regions)))
        self.assertEqual(sides, facts)

    @unittest.skipUnless(meshio, "python3-meshio is not installed")
    def test_meshio_reads_exodus(self):
        try:
            import netCDF4  # noqa: F401
        except ImportError:
            self.skipTest("python3-netcdf4 is not installed")
        plain, blocks = meshio.read(self.convert("plain.vtu")), meshio.read(self.convert("blocks.e"))
        order = np.argsort(plain.cell_data["region"][0].ravel(), kind="stable")
        self.assertTrue(np.array_equal(np.concatenate([b.data for b in blocks.cells]), plain.cells[0].data[order]))
        self.assertTrue(np.array_equal(plain.points, blocks.points))
        parts = [blocks.point_data["solution1_" + axis] for axis in "xyz"]
        self.assertTrue(np.array_equal(plain.point_data["solution1"], np.stack(parts, axis=1)))


if __name__ == "__main__":
    unittest.main()
