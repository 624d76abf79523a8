"""The peer, VTK, measured on a file that tetralod wrote. Run by `tetralod bench --against-vtk` and by
figures.py with Debian's /usr/bin/python3 (package python3-vtk9). Prints one JSON object.

    vtk_peer.py simplify IN.vtu OUT.vtu [--keep 0.1] [--runs 3] [--scale S] [--channel NAME]
    vtk_peer.py mesh IN.vtu [--runs 3]

simplify runs vtkUnstructuredGridQuadricDecimation, which uses one thread and one scalar. VTK 9.1
compares volumes with an absolute number, so that on fine meshes of unit size it gives up long before
its target without a word; --scale 0 (the default) then takes the coordinates times 100 and says so.
The result is scaled back and its scalar gets its name back. seconds are wall seconds of the filter
alone; peak_bytes is the growth of the process during the first run plus what the input takes.

mesh runs vtkDataSetSurfaceFilter (one thread) and vtkUnstructuredGrid.BuildLinks (all threads) and
prints the median of their seconds.
"""

import argparse
import json
import statistics
import sys
import time

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

# A result with more than this many times the tets asked for is a stall.
STALLED = 1.05
SCALE_OF_STALLED = 100.0


def memory(key):
    with open("/proc/self/status", encoding="ascii") as f:
        for line in f:
            if line.startswith(key):
                return 1024 * int(line.split()[1])
    return 0


def forget_peak():
    try:
        with open("/proc/self/clear_refs", "w", encoding="ascii") as f:
            f.write("5")
    except OSError:
        pass  # then the peak is that of the whole process: an upper bound


def read(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = vtk.vtkUnstructuredGrid()
    grid.ShallowCopy(reader.GetOutput())
    if grid.GetNumberOfCells() == 0:
        sys.exit(f"vtk_peer: no cells in '{path}'")
    return grid


def write(grid, path):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(path)
    writer.SetInputData(grid)
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToNone()
    if not writer.Write():
        sys.exit(f"vtk_peer: can't write '{path}'")


def set_points(grid, xyz):
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(numpy.ascontiguousarray(xyz), deep=1))
    grid.SetPoints(points)


def with_one_scalar(grid, name):
    """A grid of the tets and one scalar; returns it and the scalar's name."""
    data = grid.GetPointData()
    names = [data.GetArrayName(i) for i in range(data.GetNumberOfArrays())
             if data.GetArray(i) and data.GetArray(i).GetNumberOfComponents() == 1]
    name = name or (names[0] if names else None)
    if name not in names:
        sys.exit(f"vtk_peer: no scalar '{name}' on points; there are: {', '.join(names) or 'none'}")
    slim = vtk.vtkUnstructuredGrid()
    slim.CopyStructure(grid)
    slim.GetPointData().SetScalars(data.GetArray(name))
    return slim, name


def input_bytes(grid):
    return 1024 * grid.GetActualMemorySize()


def decimate(grid, name, keep, runs):
    """Runs the filter; returns its last output, the seconds of each run (wall and processor) and the bytes it took."""
    decimation = vtk.vtkUnstructuredGridQuadricDecimation()
    decimation.SetInputData(grid)
    decimation.SetScalarsName(name)
    decimation.SetTargetReduction(1 - keep)
    seconds, cpu_seconds, growth = [], [], 0
    for run in range(runs):
        before = memory("VmRSS")
        forget_peak()
        decimation.Modified()
        start, cpu_start = time.perf_counter(), time.process_time()
        decimation.Update()
        seconds.append(time.perf_counter() - start)
        cpu_seconds.append(time.process_time() - cpu_start)
        if run == 0:
            growth = max(0, memory("VmHWM") - before)
    return decimation.GetOutput(), seconds, cpu_seconds, growth


def restore(grid, name, scale):
    """The output on the input's scale; the filter calls its scalar "scalars" and gives doubles."""
    out = vtk.vtkUnstructuredGrid()
    out.CopyStructure(grid)
    scalars = grid.GetPointData().GetArray("scalars") or grid.GetPointData().GetArray(name)
    kept = vtk.vtkDoubleArray()
    kept.DeepCopy(scalars)
    kept.SetName(name)
    out.GetPointData().SetScalars(kept)
    if scale != 1:
        set_points(out, vtk_to_numpy(grid.GetPoints().GetData()).astype(numpy.float64) / scale)
    return out


def simplify(options):
    grid, name = with_one_scalar(read(options.file), options.channel)
    tets, base = grid.GetNumberOfCells(), input_bytes(grid)
    xyz = vtk_to_numpy(grid.GetPoints().GetData())
    for scale in [options.scale] if options.scale else [1.0, SCALE_OF_STALLED]:
        if scale != 1:
            set_points(grid, xyz * xyz.dtype.type(scale))
        out, seconds, cpu_seconds, growth = decimate(grid, name, options.keep, options.runs)
        stalled = out.GetNumberOfCells() > STALLED * options.keep * tets
        if not stalled:
            break
    write(restore(out, name, scale), options.out)
    return {"tets_in": tets, "tets_out": out.GetNumberOfCells(), "seconds": seconds, "cpu_seconds": cpu_seconds,
            "peak_bytes": base + growth, "input_bytes": base, "scale": scale, "stalled": stalled,
            "channel": name, "vtk": vtk.vtkVersion().GetVTKVersion()}


def median_seconds(work, runs):
    work()
    seconds = []
    for _ in range(runs):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def mesh(options):
    grid = read(options.file)
    surface = vtk.vtkDataSetSurfaceFilter()
    surface.SetInputData(grid)

    def extract():
        surface.Modified()
        surface.Update()

    return {"tets": grid.GetNumberOfCells(), "surface": median_seconds(extract, options.runs),
            "links": median_seconds(grid.BuildLinks, options.runs),
            "triangles": surface.GetOutput().GetNumberOfPolys(),
            "vtk": vtk.vtkVersion().GetVTKVersion()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    verb = verbs.add_parser("simplify")
    verb.add_argument("file")
    verb.add_argument("out")
    verb.add_argument("--keep", type=float, default=0.1)
    verb.add_argument("--runs", type=int, default=3)
    verb.add_argument("--scale", type=float, default=0)
    verb.add_argument("--channel")
    verb = verbs.add_parser("mesh")
    verb.add_argument("file")
    verb.add_argument("--runs", type=int, default=3)
    options = parser.parse_args()
    print(json.dumps(simplify(options) if options.verb == "simplify" else mesh(options)))


if __name__ == "__main__":
    main()
