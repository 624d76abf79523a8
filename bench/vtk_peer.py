"""The peer, VTK, measured on a file that tetralod wrote. Run by `tetralod bench --against-vtk` and by
figures.py with Debian's /usr/bin/python3 (package python3-vtk9). Prints one JSON object.

    vtk_peer.py simplify IN.vtu OUT.vtu [--keep 0.1] [--runs 3] [--scale S] [--channel NAME]
    vtk_peer.py mesh IN.vtu [--runs 3]
    vtk_peer.py surface IN.vtu --value V [--threads N] [--runs 3]
    vtk_peer.py lines IN.vtu --seeds SEEDS.csv [--runs 3]
    vtk_peer.py draw IN.vtu --camera X,Y,Z,FX,FY,FZ,UX,UY,UZ,ANGLE --range LOW,HIGH --unit D [--size 512]
                [--threads N] [--runs 3] [--against OUR.png]

simplify runs vtkUnstructuredGridQuadricDecimation, which uses one thread and one scalar. VTK 9.1
compares volumes with an absolute number, so that on fine meshes of unit size it gives up long before
its target without a word; --scale 0 (the default) then takes the coordinates times 100 and says so.
The result is scaled back and its scalar gets its name back. seconds are wall seconds of the filter
alone; peak_bytes is the growth of the process during the first run plus what the input takes.

mesh runs vtkDataSetSurfaceFilter (one thread) and vtkUnstructuredGrid.BuildLinks (all threads) and
prints the median of their seconds.

surface runs vtkContour3DLinearGrid: without and with merged points, and with a scalar tree made before.

lines runs vtkStreamTracer (one thread) with second order and steps of half a cell, both ways; processor seconds.

draw renders frames by vtkUnstructuredGridVolumeRayCastMapper and vtkProjectedTetrahedraMapper, off the
screen under xvfb-run (started by itself), with the transfer function of `tetralod bench draw`, and compares
the first of the former with a picture.
"""

import argparse
import json
import os
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


def median_seconds(work, runs, clock=time.perf_counter):
    work()
    seconds = []
    for _ in range(runs):
        start = clock()
        work()
        seconds.append(clock() - start)
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


def surface(options):
    vtk.vtkSMPTools.Initialize(options.threads)
    grid, name = with_one_scalar(read(options.file), None)
    said = {"vtk": vtk.vtkVersion().GetVTKVersion(), "channel": name}
    for key, merge, tree in (("plain", False, False), ("merged", True, False), ("tree", True, True)):
        contour = vtk.vtkContour3DLinearGrid()
        contour.SetInputData(grid)
        contour.SetMergePoints(merge)
        contour.SetComputeNormals(False)
        contour.InterpolateAttributesOff()
        contour.SetUseScalarTree(tree)
        contour.SetValue(0, options.value)

        def extract():
            contour.Modified()
            contour.Update()

        said[key] = median_seconds(extract, options.runs)
        area = vtk.vtkMassProperties()
        area.SetInputData(contour.GetOutput())
        said[key + "_triangles"] = contour.GetOutput().GetNumberOfPolys()
        said[key + "_area"] = area.GetSurfaceArea() if said[key + "_triangles"] else 0
    return said


def lines(options):
    grid = read(options.file)
    names = [grid.GetPointData().GetArrayName(i) for i in range(grid.GetPointData().GetNumberOfArrays())]
    grid.GetPointData().SetActiveVectors(names[0])
    points, source = vtk.vtkPoints(), vtk.vtkPolyData()
    points.SetData(numpy_to_vtk(numpy.loadtxt(options.seeds, delimiter=",", ndmin=2), deep=1))
    source.SetPoints(points)
    tracer = vtk.vtkStreamTracer()
    tracer.SetInputData(grid)
    tracer.SetSourceData(source)
    tracer.SetIntegratorTypeToRungeKutta2()
    tracer.SetIntegrationStepUnit(vtk.vtkStreamTracer.CELL_LENGTH_UNIT)
    tracer.SetInitialIntegrationStep(0.5)
    tracer.SetMaximumPropagation(4 * grid.GetLength())
    tracer.SetMaximumNumberOfSteps(10000)
    tracer.SetIntegrationDirectionToBoth()
    tracer.SetComputeVorticity(False)

    def trace():
        tracer.Modified()
        tracer.Update()

    seconds = median_seconds(trace, options.runs, time.process_time)
    out = tracer.GetOutput()
    xyz, ids, length = vtk_to_numpy(out.GetPoints().GetData()), vtk.vtkIdList(), 0.0
    out.GetLines().InitTraversal()
    while out.GetLines().GetNextCell(ids):
        line = xyz[[ids.GetId(i) for i in range(ids.GetNumberOfIds())]]
        length += float(numpy.linalg.norm(numpy.diff(line, axis=0), axis=1).sum())
    return {"seconds": seconds, "steps": out.GetNumberOfPoints() - out.GetNumberOfLines(), "length": length,
            "lines": out.GetNumberOfLines(), "vtk": vtk.vtkVersion().GetVTKVersion()}


# Parts of the range with colours and opacities, as in src/cli/cli_bench_draw.c.
COLORS = ((0, .1, .1, .6), (.3, .1, .7, .8), (.5, .9, .9, .3), (.75, .95, .4, .1), (1, .9, .05, .05))
OPACITIES = ((0, 0), (.15, 0), (.3, .05), (.6, .15), (1, .8))


def volume_property(low, high, unit):
    colors, opacities = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    for part, *rgb in COLORS:
        colors.AddRGBPoint(low + part * (high - low), *rgb)
    for part, opacity in OPACITIES:
        opacities.AddPoint(low + part * (high - low), opacity)
    look = vtk.vtkVolumeProperty()
    look.SetColor(colors)
    look.SetScalarOpacity(opacities)
    look.SetScalarOpacityUnitDistance(unit)
    look.ShadeOff()
    look.SetInterpolationTypeToLinear()
    return look


def frames(grid, mapper, options):
    """Seconds of each frame, and the pixels of the first, bottom row first."""
    x = [float(word) for word in options.camera.split(",")]
    low, high = (float(word) for word in options.range.split(","))
    window, renderer, volume = vtk.vtkRenderWindow(), vtk.vtkRenderer(), vtk.vtkVolume()
    window.SetOffScreenRendering(1)
    window.SetSize(options.size, options.size)
    window.SetMultiSamples(0)
    window.AddRenderer(renderer)
    renderer.SetBackground(0, 0, 0)
    mapper.SetInputData(grid)
    volume.SetMapper(mapper)
    volume.SetProperty(volume_property(low, high, options.unit))
    renderer.AddVolume(volume)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(x[0:3])
    camera.SetFocalPoint(x[3:6])
    camera.SetViewUp(x[6:9])
    camera.SetViewAngle(x[9])
    renderer.ResetCameraClippingRange()
    window.Render()
    pixels = vtk.vtkUnsignedCharArray()
    window.GetRGBACharPixelData(0, 0, options.size - 1, options.size - 1, 1, pixels)
    first = vtk_to_numpy(pixels).reshape(-1, 4)[:, :3].astype(float)
    seconds, one = [], vtk.vtkUnsignedCharArray()
    for _ in range(options.runs):
        camera.Azimuth(5)
        start = time.perf_counter()
        window.Render()
        window.GetRGBACharPixelData(0, 0, 0, 0, 1, one)  # waits for the frame
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds), first


def decibels(ours, theirs):
    error = ((ours - theirs) ** 2).mean() ** 0.5
    return float(20 * numpy.log10(255 / error)) if error else 999.0


def draw(options):
    if not os.environ.get("DISPLAY"):
        os.environ["LIBGL_ALWAYS_SOFTWARE"] = "1"
        # between two windows the server has no client, and without -noreset it begins anew: who comes meanwhile
        # finds none
        server = "-screen 0 1024x1024x24 -noreset"
        os.execvp("xvfb-run", ["xvfb-run", "-a", "-s", server, sys.executable, *sys.argv])
    vtk.vtkMultiThreader.SetGlobalMaximumNumberOfThreads(options.threads)
    grid, _ = with_one_scalar(read(options.file), None)
    ray = vtk.vtkUnstructuredGridVolumeRayCastMapper()
    ray.AutoAdjustSampleDistancesOff()
    ray.SetImageSampleDistance(1.0)
    ray.SetNumberOfThreads(options.threads)
    said = {"vtk": vtk.vtkVersion().GetVTKVersion()}
    said["ray"], ray_pixels = frames(grid, ray, options)
    said["projected"], projected_pixels = frames(grid, vtk.vtkProjectedTetrahedraMapper(), options)
    said["vtk_decibels"] = decibels(ray_pixels, projected_pixels)
    if options.against:
        reader = vtk.vtkPNGReader()
        reader.SetFileName(options.against)
        reader.Update()
        ours = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())[:, :3].astype(float)
        said["decibels"] = decibels(ours, ray_pixels)
    return said


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
    verb = verbs.add_parser("surface")
    verb.add_argument("file")
    verb.add_argument("--value", type=float, required=True)
    verb.add_argument("--threads", type=int, default=1)
    verb.add_argument("--runs", type=int, default=3)
    verb = verbs.add_parser("lines")
    verb.add_argument("file")
    verb.add_argument("--seeds", required=True)
    verb.add_argument("--runs", type=int, default=3)
    verb = verbs.add_parser("draw")
    verb.add_argument("file")
    verb.add_argument("--camera", required=True)
    verb.add_argument("--range", required=True)
    verb.add_argument("--unit", type=float, required=True)
    verb.add_argument("--size", type=int, default=512)
    verb.add_argument("--threads", type=int, default=1)
    verb.add_argument("--runs", type=int, default=3)
    verb.add_argument("--against")
    options = parser.parse_args()
    works = {"simplify": simplify, "mesh": mesh, "surface": surface, "lines": lines, "draw": draw}
    print(json.dumps(works[options.verb](options)), flush=True)
    os._exit(0)  # VTK's windows outlive the X server of xvfb-run and abort


if __name__ == "__main__":
    main()
