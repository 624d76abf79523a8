#!/usr/bin/python3
"""Writes VTK XML files in every mode of VTK's writers and meshio's into a folder, and beside each what
VTK reads back from it, for test_formats_vtkxml_peer.c to compare.

    vtk_xml_peer.py FOLDER

FOLDER/list has the names of the files. NAME.truth: points, cells (0 where structured) and arrays; all
numbers in hexadecimal, so that the comparison is exact."""
import os
import random
import sys

import vtk
from vtk.util.numpy_support import vtk_to_numpy

TYPES = {"i8": vtk.vtkSignedCharArray, "u8": vtk.vtkUnsignedCharArray, "i16": vtk.vtkShortArray,
         "u16": vtk.vtkUnsignedShortArray, "i32": vtk.vtkIntArray, "u32": vtk.vtkUnsignedIntArray,
         "i64": vtk.vtkLongLongArray, "u64": vtk.vtkUnsignedLongLongArray, "f32": vtk.vtkFloatArray,
         "f64": vtk.vtkDoubleArray}
LIMITS = {"i8": 127, "u8": 255, "i16": 32767, "u16": 65535, "i32": 2**31 - 1, "u32": 2**32 - 1,
          "i64": 2**52, "u64": 2**53}


def make_value(rng, name):
    if name in LIMITS:
        return rng.randint(0 if name[0] == "u" else -LIMITS[name], LIMITS[name])
    return rng.uniform(-1, 1) * 10.0 ** rng.randint(-30, 30)


def add_arrays(rng, attributes, count, special):
    for at, (name, make) in enumerate(TYPES.items()):
        array = make()
        array.SetName("%s, %d \u03b1" % (name, at))
        array.SetNumberOfComponents(at % 4 + 1)
        array.SetNumberOfTuples(count)
        for i in range(count * (at % 4 + 1)):
            array.SetValue(i, make_value(rng, name))
        if special and name == "f64":
            array.SetValue(0, float("nan"))
            array.SetValue(1, float("-inf"))
        attributes.AddArray(array)
    words = vtk.vtkStringArray()
    words.SetName("words")
    words.SetNumberOfValues(count)
    for i in range(count):
        words.SetValue(i, "word %d" % i)
    attributes.AddArray(words)


def add_fields(rng, data, special):
    add_arrays(rng, data.GetPointData(), data.GetNumberOfPoints(), special)
    add_arrays(rng, data.GetCellData(), data.GetNumberOfCells(), special)
    time = vtk.vtkDoubleArray()
    time.SetName("TimeValue")
    time.InsertNextValue(12.5)
    data.GetFieldData().AddArray(time)


def make_points(rng, count, double):
    points = vtk.vtkPoints()
    points.SetDataType(vtk.VTK_DOUBLE if double else vtk.VTK_FLOAT)
    for _ in range(count):
        points.InsertNextPoint(*(rng.uniform(-5, 5) for _ in range(3)))
    return points


def make_unstructured(rng, special, double):
    sizes = {vtk.VTK_TETRA: 4, vtk.VTK_HEXAHEDRON: 8, vtk.VTK_WEDGE: 6, vtk.VTK_PYRAMID: 5,
             vtk.VTK_TRIANGLE: 3, vtk.VTK_QUADRATIC_TETRA: 10, vtk.VTK_POLY_LINE: 7, vtk.VTK_VOXEL: 8}
    grid = vtk.vtkUnstructuredGrid()
    grid.SetPoints(make_points(rng, 90, double))
    for _ in range(120):
        kind = rng.choice(list(sizes))
        ids = vtk.vtkIdList()
        for point in rng.sample(range(90), sizes[kind]):
            ids.InsertNextId(point)
        grid.InsertNextCell(kind, ids)
    add_fields(rng, grid, special)
    return grid


def make_image(rng, special, _):
    image = vtk.vtkImageData()
    image.SetExtent(-2, 3, 4, 8, 0, 3)
    image.SetOrigin(0.5, -1.25, 7)
    image.SetSpacing(0.1, 0.25, 3)
    image.SetDirectionMatrix(0, -1, 0, 1, 0, 0, 0, 0, 1)
    add_fields(rng, image, special)
    return image


def make_rectilinear(rng, special, double):
    grid = vtk.vtkRectilinearGrid()
    grid.SetExtent(1, 6, -1, 3, 5, 8)
    for count, place in ((6, grid.SetXCoordinates), (5, grid.SetYCoordinates), (4, grid.SetZCoordinates)):
        axis = vtk.vtkDoubleArray() if double else vtk.vtkFloatArray()
        for value in sorted(rng.uniform(-5, 5) for _ in range(count)):
            axis.InsertNextValue(value)
        place(axis)
    add_fields(rng, grid, special)
    return grid


def make_structured(rng, special, double):
    grid = vtk.vtkStructuredGrid()
    grid.SetExtent(0, 5, 2, 6, -3, 0)
    grid.SetPoints(make_points(rng, 120, double))
    add_fields(rng, grid, special)
    return grid


KINDS = (("vtu", make_unstructured, vtk.vtkXMLUnstructuredGridWriter, vtk.vtkXMLUnstructuredGridReader),
         ("vti", make_image, vtk.vtkXMLImageDataWriter, vtk.vtkXMLImageDataReader),
         ("vtr", make_rectilinear, vtk.vtkXMLRectilinearGridWriter, vtk.vtkXMLRectilinearGridReader),
         ("vts", make_structured, vtk.vtkXMLStructuredGridWriter, vtk.vtkXMLStructuredGridReader))


def hexes(values):
    return " ".join(float(v).hex() if v == v else "nan" for v in values)


def write_truth(path, data):
    """What a reader hands on: points, cells, arrays that hold numbers."""
    with open(path, "w", encoding="utf-8") as out:
        count = data.GetNumberOfPoints()
        print("points", count, file=out)
        for i in range(count):
            print(hexes(data.GetPoint(i)), file=out)
        listed = data.GetNumberOfCells() if isinstance(data, vtk.vtkUnstructuredGrid) else 0
        print("cells", listed, data.GetNumberOfCells(), file=out)
        ids = vtk.vtkIdList()
        for i in range(listed):
            data.GetCellPoints(i, ids)
            points = [ids.GetId(j) for j in range(ids.GetNumberOfIds())]
            print(data.GetCellType(i), len(points), *points, file=out)
        time = data.GetFieldData().GetArray("TimeValue")
        print("time", time.GetValue(0).hex() if time else "nan", file=out)
        for attributes in (data.GetPointData(), data.GetCellData()):
            arrays = [attributes.GetArray(i) for i in range(attributes.GetNumberOfArrays())]
            arrays = [array for array in arrays if array]
            print("arrays", len(arrays), file=out)
            for array in arrays:
                print(array.GetNumberOfComponents(), array.GetNumberOfTuples(),
                      array.GetName(), file=out)
                print(hexes(vtk_to_numpy(array).ravel()), file=out)


def modes():
    """Mode, encoded, compressor, big endian, 64-bit header, 64-bit ids, block size."""
    for mode in ("Ascii", "Binary", "Appended"):
        for encoded in ((0, 1) if mode == "Appended" else (0,)):
            for packing in (("None",) if mode == "Ascii" else ("None", "ZLib", "LZ4", "LZMA")):
                for bits in range(8 if mode != "Ascii" else 2):
                    yield mode, encoded, packing, bits & 1, bits >> 1 & 1, bits >> 2


def write_vtk(folder, names):
    for ending, make, writer_class, reader_class in KINDS:
        for number, (mode, encoded, packing, big, wide, long_ids) in enumerate(modes()):
            if ending != "vtu" and number % 3:
                continue
            rng = random.Random(number)
            name = "%s_%s%d_%s_%d%d%d.%s" % (ending, mode, encoded, packing, big, wide, long_ids, ending)
            path = os.path.join(folder, name)
            writer = writer_class()
            writer.SetFileName(path)
            writer.SetInputData(make(rng, mode != "Ascii", number % 2))
            getattr(writer, "SetDataModeTo" + mode)()
            writer.SetEncodeAppendedData(encoded)
            getattr(writer, "SetCompressorTypeTo" + packing)()
            if big:
                writer.SetByteOrderToBigEndian()
            (writer.SetHeaderTypeToUInt64 if wide else writer.SetHeaderTypeToUInt32)()
            (writer.SetIdTypeToInt64 if long_ids else writer.SetIdTypeToInt32)()
            writer.SetBlockSize(512 if number % 2 else 32768)
            if not writer.Write():
                raise SystemExit("VTK can't write " + name)
            read_back(folder, name, reader_class, names)


def read_back(folder, name, reader_class, names):
    reader = reader_class()
    reader.SetFileName(os.path.join(folder, name))
    reader.Update()
    write_truth(os.path.join(folder, name + ".truth"), reader.GetOutput())
    names.append(name)


def write_meshio(folder, names):
    import meshio
    import numpy
    rng = numpy.random.default_rng(1)
    points = rng.uniform(-1, 1, (40, 3))
    cells = [("tetra", rng.integers(0, 40, (30, 4))), ("hexahedron", rng.integers(0, 40, (9, 8))),
             ("triangle", rng.integers(0, 40, (5, 3)))]
    mesh = meshio.Mesh(points, cells,
                       point_data={"p": rng.uniform(-1, 1, 40), "v": rng.uniform(-1, 1, (40, 3))},
                       cell_data={"c": [numpy.arange(len(c[1])) for c in cells]})
    for binary, packing, header in ((True, None, "UInt32"), (True, "zlib", "UInt64"),
                                    (True, "lzma", "UInt32"), (False, None, "UInt32")):
        name = "meshio_%d_%s.vtu" % (binary, packing)
        meshio.vtu.write(os.path.join(folder, name), mesh, binary=binary, compression=packing,
                         header_type=header)
        read_back(folder, name, vtk.vtkXMLUnstructuredGridReader, names)


def main():
    folder, names = sys.argv[1], []
    write_vtk(folder, names)
    try:
        write_meshio(folder, names)
    except ImportError:
        print("# meshio is not installed; its files are left out")
    with open(os.path.join(folder, "list"), "w", encoding="utf-8") as out:
        print(*names, sep="\n", file=out)


if __name__ == "__main__":
    main()
