#!/usr/bin/env python3
"""Prints the table of docs/FORMATS.md: every file of a folder of data as `tetralod info` reads it.

    bench/formats_table.py PROGRAM FOLDER

Files that belong to another (values, solutions, pieces) have no line of their own."""

import json
import os
import re
import subprocess
import sys

# What is given besides the name, by the end of the path.
OPTIONS = {
    "neghip_64x64x64_uint8.raw": ["--raw", "64,64,64,u8"],
    "Bucky.raw": ["--raw", "32,32,32,u8"],
    "tooth_103x94x161_uint8.raw": ["--raw", "103,94,161,u8"],
    "bluntfinxyz.bin": ["--solution", "bluntfinq.bin"],
    "combxyz.bin": ["--solution", "combq.bin"],
}
# Read too, but not every time: 32 million points become 155 million tets, in minutes.
LARGE = ("frogtissue.mhd",)
# Parts of other files and texts.
PASSED_OVER = re.compile(
    r"SOURCES\.md$|readme$|q\.bin$|\.(h5|zraw|sol|ele|face|bvec|bval|gz_|txt|info|dat|p3d)$|/openfoam/|/horse-gallop/|"
    r"elements6?\.(?!case)|/test[^/]*\.(?!case)|cylinder_Re35\.(?!case)|multi-[^/]*\.q|/wavy/wavy/|T0000000500/|\.(f|q|fun)$")
OPENFOAM = ("openfoam/cubeflow", "openfoam/cavity", "openfoam/64BitFloats")


def paths(folder):
    for root, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            path = os.path.join(root, name)
            if name not in LARGE and not PASSED_OVER.search("/" + os.path.relpath(path, folder)):
                yield path
    for case in OPENFOAM:
        path = os.path.join(folder, case)
        if os.path.isdir(path):
            yield path


def info(program, path):
    options = OPTIONS.get(os.path.basename(path), [])
    if options and options[0] == "--solution":
        options = ["--solution", os.path.join(os.path.dirname(path), options[1])]
    done = subprocess.run([program, "info", path, "--json", "--quiet", *options], capture_output=True, text=True)
    return json.loads(done.stdout) if done.returncode == 0 else None, done.stderr


def line(program, folder, path):
    name = os.path.relpath(path, folder)
    found, message = info(program, path)
    if not found:
        reason = message.split("\n")[0].split("': ", 1)[-1].split("; this build reads")[0]
        return f"| {name} | refused: {reason.replace('|', ' ')} | | | | |"
    cells = ", ".join(f"{count:,} {kind}" for kind, count in found["cells"].items()) or "none"
    steps = found["steps"]
    series = f"{steps['count']}, {steps['mesh']}" if steps["count"] > 1 else ""
    return (f"| {name} | {cells} | {found['read']['points']:,} | {found['tets']:,} | {len(found['channels'])} | "
            f"{found['region_count'] or ''} / {len(found['labels']) or ''} | {series} |")


def main():
    program, folder = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    print("| file | cells | points | tets | channels | regions / labels | steps |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for path in paths(folder):
        print(line(program, folder, path).replace("|  /  |", "| |"))


if __name__ == "__main__":
    main()
