"""Reads a file with a peer and dumps what it found, for tests to compare.

    /usr/bin/python3 peer_dump.py vtk|meshio FILE OUT

OUT holds records, little-endian: kind (1 byte: P points, C connectivity, v point array, c cell array,
t time), uint32 bytes of the name, the name, uint32 components, uint64 tuples, then the numbers as
float64. Cells other than tetrahedra end the script with an error.
"""

import struct
import sys
import urllib.parse

import numpy


def record(out, kind, name, values):
    values = numpy.asarray(values, dtype=numpy.float64)
    components = 1 if values.ndim == 1 else int(numpy.prod(values.shape[1:]))
    name = name.encode("utf-8")
    out.write(kind + struct.pack("<I", len(name)) + name)
    out.write(struct.pack("<IQ", components, len(values)))
    out.write(values.astype("<f8").tobytes())


def dump_vtk(path, out):
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    errors = []
    legacy = path.endswith(".vtk")
    reader = vtk.vtkUnstructuredGridReader() if legacy else vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.AddObserver("ErrorEvent", lambda *args: errors.append(args))
    reader.AddObserver("WarningEvent", lambda *args: errors.append(args))
    reader.Update()
    grid = reader.GetOutput()
    if errors:
        sys.exit("vtk complains about " + path)
    count = grid.GetNumberOfCells()
    if any(grid.GetCellType(i) != vtk.VTK_TETRA for i in range(count)):
        sys.exit("cells that are no tetrahedra")
    if grid.GetPoints():
        record(out, b"P", "", vtk_to_numpy(grid.GetPoints().GetData()))
    if count:
        record(out, b"C", "", vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4))
    for kind, data in ((b"v", grid.GetPointData()), (b"c", grid.GetCellData())):
        for i in range(data.GetNumberOfArrays()):
            record(out, kind, data.GetArrayName(i), vtk_to_numpy(data.GetArray(i)))
    time = grid.GetFieldData().GetArray("TimeValue")
    if time:
        record(out, b"t", "", vtk_to_numpy(time))


def dump_meshio(path, out):
    import meshio

    mesh = meshio.read(path)
    # meshio leaves the %XX of legacy names as they are.
    name_of = urllib.parse.unquote if path.endswith(".vtk") else str
    record(out, b"P", "", mesh.points)
    for block in mesh.cells:
        if block.type != "tetra":
            sys.exit("cells that are no tetrahedra")
        record(out, b"C", "", block.data)
    for name, values in mesh.point_data.items():
        record(out, b"v", name_of(name), values)
    for name, values in mesh.cell_data.items():
        record(out, b"c", name_of(name), numpy.concatenate(values))


if __name__ == "__main__":
    with open(sys.argv[3], "wb") as dump:
        {"vtk": dump_vtk, "meshio": dump_meshio}[sys.argv[1]](sys.argv[2], dump)
