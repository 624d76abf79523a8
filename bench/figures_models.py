#!/usr/bin/python3
"""Figures of models that do not depend on the machine: sizes, bits and errors of `tetralod build` with its
defaults, on samples and real files. Keeps them in models.csv.

    figures_models.py [--tetralod PROGRAM] [--data FOLDER] [--out FILE]
    figures_models.py --check       fails where a figure is not that of models.csv

A change that moves a figure writes the file anew in the same commit. Rows whose data can't be had are
skipped, and said.
"""

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
SAMPLES = {"gaussians 48": ("gaussians", "--size", "48"), "sphere-flow 32": ("sphere-flow", "--size", "32")}
FILES = {"Blunt Fin": ("curvilinear/bluntfin.vtk",), "bracket": ("tet/bracket_appended_compressed.vtu",),
         "combustor": ("curvilinear/combxyz.bin", "--solution", "curvilinear/combq.bin")}
# Of which the error of the first channel (in its unit) and of the boundary (mesh units) are kept.
LEVELS = (1, 3)
# Counts and bytes are the same in every run; floating point may differ by a compiler's choice. Relative.
TOLERANCE = 1e-4


def said(program, *words):
    done = subprocess.run([program, *words, "--json", "--quiet"], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def figure(name, program, words, model):
    built = said(program, "build", *words, "-o", model)
    info = said(program, "info", model)
    row = {"data": name, "tets_in": built["tets_in"], "tets_stored": built["tets_stored"], "levels": built["levels"],
           "segments": built["segments"], "patches": built["patches"], "bytes": built["bytes"]}
    for part, bits in info["bits_per_tet"].items():
        row["bits_" + part] = bits
    for level in LEVELS:
        row[f"tets_{level}"] = info["levels"][level]["tets"]
        row[f"error_{level}"] = info["levels"][level]["error"][0]["error"]
        row[f"boundary_{level}"] = info["levels"][level]["boundary_error"]
    return row


def sources(program, data, folder):
    for name, words in SAMPLES.items():
        path = os.path.join(folder, "sample.vtu")
        subprocess.run([program, "sample", *words, "-o", path, "--quiet"], check=True, stdout=subprocess.DEVNULL)
        yield name, (path,)
    for name, words in FILES.items():
        words = [w if w.startswith("--") else os.path.join(data, w) for w in words]
        if os.path.exists(words[0]):
            yield name, words
        else:
            print(f"{name}: skipped, no '{words[0]}'")


def differs(row, kept):
    return [f"{key} {value}, was {kept.get(key)}" for key, value in row.items() if key != "data" and (
        key not in kept or abs(float(kept[key]) - value) > TOLERANCE * abs(value))]


def main():
    parser = argparse.ArgumentParser(description="figures of models")
    parser.add_argument("--tetralod", default=os.path.join(HERE, "../build/release/tetralod"))
    parser.add_argument("--data", default=os.environ.get("TETRALOD_DATA", os.path.join(HERE, "../../shared/data")))
    parser.add_argument("--out", default=os.path.join(HERE, "models.csv"))
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    kept, rows, moved = {}, [], 0
    if options.check:
        with open(os.path.join(HERE, "models.csv"), newline="", encoding="utf-8") as f:
            kept = {row["data"]: row for row in csv.DictReader(f)}
    with tempfile.TemporaryDirectory() as folder:
        for name, words in sources(options.tetralod, options.data, folder):
            row = figure(name, options.tetralod, words, os.path.join(folder, "model.tlod"))
            rows.append(row)
            wrong = differs(row, kept.get(name, {})) if options.check else []
            moved += bool(wrong)
            print(f"{name}: {row['tets_in']:,} tets, {row['bytes'] / row['tets_in']:.3f} bytes each",
                  "; ".join(wrong) if options.check and wrong else "ok" if options.check else "")
    if not options.check:
        with open(options.out, "w", newline="", encoding="utf-8") as f:
            out = csv.DictWriter(f, list(rows[0]), lineterminator="\n")
            out.writeheader()
            out.writerows(rows)
    return 1 if moved else 0


if __name__ == "__main__":
    sys.exit(main())
