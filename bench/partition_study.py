#!/usr/bin/env python3
"""How good models are by how they are partitioned: a table in Markdown, a row for each data set and way to build.

    bench/partition_study.py PROGRAM FOLDER [--data NAME]... [--build "OPTIONS"]...

Errors are those of whole levels of 1 to 60 % of the tets, over those of `simplify` to the same number (between the
numbers it is asked for, straight lines in logarithms); the mean of the ratios, and the largest. FOLDER keeps the
reference and the data. A program built without METIS shows what that costs."""

import argparse
import json
import math
import os
import resource
import subprocess

SHARED = os.environ.get("TETRALOD_DATA", os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "shared", "data"))
# Name: file, options of reading, channel, or the sample that is written.
DATA = {
    "gaussians": (None, [], "value", ["gaussians", "--size", "64"]),
    "sphere-flow": (None, [], "pressure", ["sphere-flow"]),
    "blunt-fin": (os.path.join(SHARED, "curvilinear/bluntfin.vtk"), [], "Density", None),
    "gaussians-10m": (None, [], "value", ["gaussians", "--size", "128"]),
    "neghip": (os.path.join(SHARED, "volume/neghip_64x64x64_uint8.raw"), ["--raw", "64,64,64,u8"], "value", None),
}
LARGE = {"gaussians-10m"}  # only where asked for
SHARES = (0.6, 0.35, 0.2, 0.1, 0.05, 0.025, 0.01)


def run(*words):
    """What the program says, and its processor seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(f"{' '.join(words)}: {done.stderr.strip()}")
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return json.loads(done.stdout) if done.stdout.startswith("{") else {}, seconds


def source(program, folder, name):
    path, options, channel, sample = DATA[name]
    if sample:
        path = os.path.join(folder, name + ".vtu")
        if not os.path.exists(path):
            run(program, "sample", *sample, "-o", path, "-q")
    return path, options, channel


def reference(program, folder, name):
    """Lists of tets, RMS and largest errors of simplifying the whole mesh, descending."""
    kept = os.path.join(folder, name + ".json")
    if os.path.exists(kept):
        with open(kept, encoding="utf-8") as f:
            return json.load(f)
    path, options, channel = source(program, folder, name)
    points = []
    for share in SHARES:
        out = os.path.join(folder, "reference.vtu")
        said, _ = run(program, "simplify", path, *options, "--channels", channel, "-o", out, "--ratio", str(share), "--json")
        error = next(c for c in said["channels"] if c["name"] == channel)
        if not points or said["tets_out"] < 0.95 * points[-1][0]:
            points.append((said["tets_out"], error["rms_error"], error["max_error"]))
        os.unlink(out)
    with open(kept, "w", encoding="utf-8") as f:
        json.dump(points, f)
    return points


def between(points, tets, column):
    """The reference's error at a number of tets; None outside of what it reaches."""
    for a, b in zip(points, points[1:]):
        if b[0] <= tets <= a[0]:
            at = math.log(tets / a[0]) / math.log(b[0] / a[0])
            return a[column] * (b[column] / a[column]) ** at
    return None


def ratios(points, levels, key, column):
    """Where the reference is above what rounding of values alone gives."""
    least = 3 * levels[0]["error"][0]["rms"]
    found = [(level["error"][0][key], between(points, level["tets"], column)) for level in levels[1:]
             if (between(points, level["tets"], 1) or 0) > least]
    return [own / other for own, other in found if other]


def mean(values):
    return math.exp(sum(map(math.log, values)) / len(values)) if values else math.nan


def row(program, folder, name, build):
    points = reference(program, folder, name)
    path, options, channel = source(program, folder, name)
    model = os.path.join(folder, f"study_{os.getpid()}.tlod")
    built, seconds = run(program, "build", path, *options, "--channels", channel, "-o", model, "--json", *build.split())
    said, _ = run(program, "info", model, "--details", "--json")
    os.unlink(model)
    rms = ratios(points, said["levels"], "rms", 1)
    most = ratios(points, said["levels"], "error", 2)
    view = said["full_detail_at_a_point"]
    patch = said["levels"][0]["tets"] / said["levels"][0]["patches"]
    return (f"| {name} | {build or 'default'} | {mean(rms):.3f} | {max(rms, default=math.nan):.2f} | {mean(most):.2f} | "
            f"{max(most, default=math.nan):.2f} | {built['bytes'] / built['tets_in']:.3f} | {view['mean']['tets'] / 1000:.0f} | "
            f"{view['worst']['tets'] / 1000:.0f} | {view['worst']['patches']} | {patch:.0f} | {seconds:.1f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--data", action="append", choices=sorted(DATA))
    parser.add_argument("--build", action="append")
    given = parser.parse_args()
    os.makedirs(given.folder, exist_ok=True)
    print("| data | options | RMS: mean | largest | max error: mean | largest | bytes a tet | a point draws, k tets: mean | "
          "worst | patches | tets a patch | CPU s |")
    print("| --- " * 12 + "|")
    for name in given.data or sorted(set(DATA) - LARGE):
        for build in given.build or [""]:
            print(row(os.path.abspath(given.program), given.folder, name, build), flush=True)


if __name__ == "__main__":
    main()
