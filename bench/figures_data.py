"""The data sets of figures.py, each as a .vtu of tets with one scalar: made from a formula and a seed,
or read from the folder of real data. Nothing of tetralod makes the generated ones."""

import os
import shutil
import subprocess
import sys

import numpy

from figures_judge import read_tets

HERE = os.path.dirname(os.path.abspath(__file__))


def write_vtu(path, xyz, tets, name, values):
    """Appended raw data, 64-bit headers, as plain as VTU can be."""
    arrays = [("points", xyz.astype("<f4") if xyz.dtype == numpy.float32 else xyz.astype("<f8")),
              ("values", values.astype("<f4") if values.dtype == numpy.float32 else values.astype("<f8")),
              ("connectivity", tets.astype("<i4")),
              ("offsets", numpy.arange(4, 4 * len(tets) + 1, 4, dtype="<i8")),
              ("types", numpy.full(len(tets), 10, "u1"))]
    kinds = {"<f4": "Float32", "<f8": "Float64", "<i4": "Int32", "<i8": "Int64", "|u1": "UInt8"}
    kind, offset, at = {}, {}, 0
    for key, array in arrays:
        kind[key], offset[key] = kinds[array.dtype.str], at
        at += 8 + array.nbytes
    head = f"""<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<UnstructuredGrid><Piece NumberOfPoints="{len(xyz)}" NumberOfCells="{len(tets)}">
<PointData Scalars="{name}"><DataArray type="{kind['values']}" Name="{name}" format="appended" offset="{offset['values']}"/></PointData>
<Points><DataArray type="{kind['points']}" NumberOfComponents="3" format="appended" offset="{offset['points']}"/></Points>
<Cells>
<DataArray type="{kind['connectivity']}" Name="connectivity" format="appended" offset="{offset['connectivity']}"/>
<DataArray type="{kind['offsets']}" Name="offsets" format="appended" offset="{offset['offsets']}"/>
<DataArray type="{kind['types']}" Name="types" format="appended" offset="{offset['types']}"/>
</Cells></Piece></UnstructuredGrid><AppendedData encoding="raw">_"""
    with open(path, "wb") as f:
        f.write(head.encode())
        for _, array in arrays:
            f.write(numpy.uint64(array.nbytes).tobytes())
            numpy.ascontiguousarray(array).tofile(f)
        f.write(b"</AppendedData></VTKFile>\n")


# ---- fields ----

def gaussians(xyz):
    """Twelve bumps; smooth."""
    random = numpy.random.default_rng(7)
    sum_of_bumps = numpy.zeros(len(xyz))
    for _ in range(12):
        centre = random.uniform(-0.8, 0.8, 3)
        width, height = random.uniform(0.08, 0.45), random.uniform(0.3, 1.0)
        squared = ((xyz.astype(numpy.float64) - centre) ** 2).sum(1)
        sum_of_bumps += height * numpy.exp(-squared / (2 * width * width))
    return sum_of_bumps.astype(numpy.float32)


def marschner_lobb(xyz):
    """Marschner and Lobb 1994 with the usual constants, 6 and 0.25; hard."""
    x, y, z = xyz.T.astype(numpy.float64)
    ripple = numpy.cos(12 * numpy.pi * numpy.cos(numpy.pi * numpy.hypot(x, y) / 2))
    return ((1 - numpy.sin(numpy.pi * z / 2) + 0.25 * (1 + ripple)) / 2.5).astype(numpy.float32)


# ---- meshes ----

# The corners of a cell are numbered x + 2 y + 4 z; a cell's five tets depend on its parity.
EVEN = ((0, 1, 2, 4), (3, 2, 1, 7), (5, 4, 7, 1), (6, 7, 4, 2), (1, 2, 4, 7))
ODD = ((1, 0, 5, 3), (2, 3, 6, 0), (4, 6, 5, 0), (7, 5, 6, 3), (0, 5, 6, 3))


def positive(xyz, tets):
    corners = [xyz[tets[:, k]].astype(numpy.float64) for k in range(4)]
    edges = [c - corners[0] for c in corners[1:]]
    negative = (numpy.cross(edges[0], edges[1]) * edges[2]).sum(1) < 0
    tets[negative] = tets[negative][:, [0, 1, 3, 2]]
    return tets


def grid(side):
    """side^3 vertices in [-1, 1]^3, five tets a cell."""
    axis = numpy.linspace(-1, 1, side)
    z, y, x = numpy.meshgrid(axis, axis, axis, indexing="ij")
    xyz = numpy.stack([x.ravel(), y.ravel(), z.ravel()], 1).astype(numpy.float32)
    k, j, i = numpy.meshgrid(*[numpy.arange(side - 1, dtype=numpy.int32)] * 3, indexing="ij")
    first = (i + side * (j + side * k)).ravel()
    corner = numpy.stack([first + dx + side * (dy + side * dz)
                          for dz in (0, 1) for dy in (0, 1) for dx in (0, 1)], 1).astype(numpy.int32)
    odd = ((i + j + k) & 1).ravel().astype(bool)
    tets = corner[:, numpy.array(EVEN)]
    tets[odd] = corner[odd][:, numpy.array(ODD)]
    return xyz, positive(xyz, tets.reshape(-1, 4))


def graded_points(count):
    """Points of a cube that is dense along a helix, in random order; faces, edges and corners are
    sampled so that the hull is the cube."""
    random = numpy.random.default_rng(3)
    parts = [numpy.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], float)]
    on_face, on_edge = int(0.9 * count ** (2 / 3)), int(count ** (1 / 3))
    for axis in range(3):
        for side in (-1, 1):
            face = random.uniform(-1, 1, (on_face, 3))
            face[:, axis] = side
            parts.append(face)
            for other in (-1, 1):
                edge = random.uniform(-1, 1, (on_edge, 3))
                edge[:, (axis + 1) % 3], edge[:, (axis + 2) % 3] = side, other
                parts.append(edge)
    inside = count - sum(map(len, parts))
    uniform = int(0.4 * inside)
    parts.append(random.uniform(-1, 1, (uniform, 3)))
    missing = inside - uniform
    while missing > 0:
        t = random.uniform(0, 1, 2 * missing)
        on_helix = numpy.stack([0.55 * numpy.cos(6 * numpy.pi * t), 0.55 * numpy.sin(6 * numpy.pi * t),
                                1.6 * t - 0.8], 1)
        away = random.normal(size=(2 * missing, 3))
        away *= (0.5 * random.uniform(0, 1, 2 * missing) ** 1.5 / numpy.linalg.norm(away, axis=1))[:, None]
        near = on_helix + away
        near = near[(numpy.abs(near) < 0.999).all(1)][:missing]
        parts.append(near)
        missing -= len(near)
    points = numpy.unique(numpy.concatenate(parts).astype(numpy.float32), axis=0)
    return points[numpy.random.default_rng(1).permutation(len(points))]


def graded(count, folder):
    """Delaunay tets of graded_points by libtet; None where it or a C++ compiler is missing."""
    program = os.path.join(folder, "delaunay")
    if not os.path.exists(program):
        if not shutil.which("g++") or not os.path.exists("/usr/include/tetgen.h"):
            return None
        subprocess.run(["g++", "-O2", "-DTETLIBRARY", "-o", program, os.path.join(HERE, "delaunay.cpp"), "-ltet"],
                       check=True)
    xyz = graded_points(count)
    points, tets = os.path.join(folder, "points.bin"), os.path.join(folder, "tets.bin")
    xyz.astype("<f4").tofile(points)
    subprocess.run([program, points, tets], check=True)
    return xyz, positive(xyz, numpy.fromfile(tets, "<i4").reshape(-1, 4))


# ---- data sets ----

def converted(tetralod, folder, source, channel, *options):
    """A real file cut into tets by tetralod (structured grids: five a cell)."""
    path = os.path.join(folder, "converted.vtu")
    subprocess.run([tetralod, "convert", source, path, "--quiet", *options], check=True)
    xyz, tets, values = read_tets(path, channel)
    os.remove(path)
    used, index = numpy.unique(tets, return_inverse=True)
    return xyz[used], index.reshape(tets.shape), values[used]


def with_field(mesh, field):
    return None if mesh is None else (mesh[0], mesh[1], field(mesh[0]))


def data_folder():
    """TETRALOD_DATA, else shared/data beside the checkout; None where there is none."""
    folder = os.environ.get("TETRALOD_DATA") or os.path.join(HERE, "../../shared/data")
    return folder if os.path.isdir(folder) else None


def real(tetralod, folder, channel, name, *options):
    data = data_folder()
    if not data:
        return None
    options = [os.path.join(data, o[1:]) if o.startswith("@") else o for o in options]
    return converted(tetralod, folder, os.path.join(data, name), channel, *options)


def first_scalar(tetralod, path, *options):
    text = subprocess.run([tetralod, "info", path, "--json", *options], check=True, capture_output=True).stdout
    import json
    for channel in json.loads(text)["channels"]:
        if channel["on"] == "vertex" and channel["components"] == 1:
            return channel["name"]
    sys.exit(f"figures: '{path}' holds no scalar on vertices")


def neghip(tetralod, folder):
    data = data_folder()
    if not data:
        return None
    path, raw = os.path.join(data, "volume/neghip_64x64x64_uint8.raw"), ("--raw", "64,64,64,u8")
    return converted(tetralod, folder, path, first_scalar(tetralod, path, *raw), *raw)


def combustor(tetralod, folder):
    data = data_folder()
    if not data:
        return None
    path = os.path.join(data, "curvilinear/combxyz.bin")
    solution = ("--solution", os.path.join(data, "curvilinear/combq.bin"))
    return converted(tetralod, folder, path, first_scalar(tetralod, path, *solution), *solution)


# name -> function of (program, folder) that gives xyz, tets, values, or None where it can't
DATA = {
    "grid 64, 12 Gaussians": lambda program, folder: with_field(grid(64), gaussians),
    "grid 64, Marschner-Lobb": lambda program, folder: with_field(grid(64), marschner_lobb),
    "Blunt Fin, density": lambda program, folder: real(program, folder, "Density", "curvilinear/bluntfin.vtk"),
    "Neghip": neghip,
    "graded Delaunay, 12 Gaussians": lambda program, folder: with_field(graded(195000, folder), gaussians),
    "combustor, density": combustor,
    "grid 161, 12 Gaussians": lambda program, folder: with_field(grid(161), gaussians),
}
LONG = ("grid 161, 12 Gaussians",)
