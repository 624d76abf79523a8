#!/usr/bin/python3
"""Makes every figure of the comparison with VTK in one go: speed, errors, memory and validity of
simplifying to a tenth, on the same data, in the same run, judged by the same measure (figures_judge.py,
on VTK and numpy alone). Prints a table in Markdown and keeps the figures in baseline.csv.

    figures.py [--tetralod PROGRAM] [--rows TEXT...] [--big] [--runs N] [--out FILE] [--work FOLDER]
    figures.py --check       runs tetralod alone; fails where sizes or errors are not those of baseline.csv

Run it with Debian's /usr/bin/python3 (packages python3-vtk9, python3-numpy; libtet1.5-dev and g++ for
the graded mesh). Rows whose data can't be had are skipped, and said.
"""

import argparse
import csv
import json
import os
import platform
import subprocess
import sys
import tempfile

from figures_data import DATA, HERE, LONG, write_vtu
from figures_judge import judge, read_tets

KEEP = 0.1
# Targets: times as fast as VTK on one thread, two threads over one, bytes an input tet, volume in percent.
SPEED, THREADS, BYTES, VOLUME = 10, 1.7, 120, 0.01
# Columns of baseline.csv that do not depend on the machine: what --check compares.
FIXED = ("tets_in", "tets_out", "rms_percent", "max_percent", "volume_percent")
# Relative. Results have the same bytes in every run, but VTK's probe does not always take the same tet
# for a vertex that two of them hold.
CHECK_TOLERANCE = 1e-4


def machine():
    model = "unknown processor"
    with open("/proc/cpuinfo", encoding="utf-8") as f:
        for line in f:
            if line.startswith("model name"):
                model = line.split(":", 1)[1].strip()
                break
    return f"{model}, {os.cpu_count()} processors, {platform.system()} {platform.release()}, load {os.getloadavg()[0]:.2f}"


def simplify(program, source, out, threads, runs):
    """What `tetralod simplify --json` says of the last of runs, with the least seconds of all:
    what others do on the machine only adds to them."""
    seconds, cpu_seconds = [], []
    for _ in range(runs):
        done = subprocess.run([program, "simplify", source, "-o", out, "--ratio", str(KEEP), "--threads", str(threads),
                               "--json", "--quiet"], check=True, stdout=subprocess.PIPE)
        said = json.loads(done.stdout)
        seconds.append(said["seconds"])
        cpu_seconds.append(said["cpu_seconds"])
    said["seconds"], said["cpu_seconds"] = min(seconds), min(cpu_seconds)
    return said


def run_vtk(source, out, runs):
    done = subprocess.run(["/usr/bin/python3", os.path.join(HERE, "vtk_peer.py"), "simplify", source, out,
                           "--keep", str(KEEP), "--runs", str(runs)], check=True, stdout=subprocess.PIPE)
    said = json.loads(done.stdout)
    said["seconds"], said["cpu_seconds"] = min(said["seconds"]), min(said["cpu_seconds"])
    return said


def figure(name, mesh, options, folder):
    """One row: everything about one data set."""
    source, out = os.path.join(folder, "input.vtu"), os.path.join(folder, "out.vtu")
    write_vtu(source, *mesh[:2], "value", mesh[2])
    original = read_tets(source, "value")
    count = len(original[1])
    said = simplify(options.tetralod, source, out, 1, 1 if options.check else options.runs)
    ours = judge(original, read_tets(out, "value"))
    row = {"data": name, "tets_in": count, "tets_out": said["tets_out"], "rms_percent": ours["rms"],
           "max_percent": ours["max"], "volume_percent": ours["volume"], "outside": ours["outside"],
           "inverted": ours["inverted"] - ours["inverted_before"], "flat": ours["flat"], "flat_in": ours["flat_before"],
           "bad_faces": ours["bad_faces"], "bytes_per_tet": said["peak_bytes"] / count, "seconds": said["seconds"],
           "cpu_seconds": said["cpu_seconds"]}
    if options.check:
        return row
    row["seconds_2"] = simplify(options.tetralod, source, out, 2, options.runs)["seconds"]
    vtk = run_vtk(source, out, 1 if name in LONG else options.runs)
    theirs = judge(original, read_tets(out, "value"))
    row.update({"vtk_tets_out": vtk["tets_out"], "vtk_rms_percent": theirs["rms"], "vtk_max_percent": theirs["max"],
                "vtk_volume_percent": theirs["volume"], "vtk_bytes_per_tet": vtk["peak_bytes"] / count,
                "vtk_seconds": vtk["seconds"], "vtk_cpu_seconds": vtk["cpu_seconds"], "vtk_scale": vtk["scale"]})
    return row


def verdict(row):
    """What a row misses of the targets."""
    missed = []
    if row["vtk_seconds"] < SPEED * row["seconds"]:
        missed.append(f"speed {row['vtk_seconds'] / row['seconds']:.1f} < {SPEED}")
    if row["seconds"] < THREADS * row["seconds_2"]:
        missed.append(f"threads {row['seconds'] / row['seconds_2']:.2f} < {THREADS}")
    if row["rms_percent"] > row["vtk_rms_percent"]:
        missed.append("rms")
    if row["max_percent"] > row["vtk_max_percent"]:
        missed.append("max")
    if abs(row["volume_percent"]) > VOLUME:
        missed.append("volume")
    if row["inverted"] > 0 or row["flat"] > row["flat_in"] or row["bad_faces"] > 0:
        missed.append("validity")
    if row["bytes_per_tet"] >= BYTES:
        missed.append("memory")
    return ", ".join(missed) or "ok"


def print_row(row):
    rate = [row["tets_in"] / row[key] / 1e3 for key in ("vtk_seconds", "seconds", "seconds_2")]
    print("| " + " | ".join([
        row["data"] + (f" (VTK: x {row['vtk_scale']:g})" if row["vtk_scale"] != 1 else ""),
        f"{row['tets_in']:,}", f"{row['vtk_tets_out']:,} / {row['tets_out']:,}",
        f"{rate[0]:.0f} / {rate[1]:.0f} / {rate[2]:.0f}", f"{rate[1] / rate[0]:.1f}",
        f"{row['vtk_cpu_seconds'] / row['cpu_seconds']:.1f}", f"{rate[2] / rate[1]:.2f}",
        f"{row['vtk_rms_percent']:.4g} / {row['rms_percent']:.4g}",
        f"{row['vtk_max_percent']:.4g} / {row['max_percent']:.4g}",
        f"{row['vtk_volume_percent']:.2g} / {row['volume_percent']:.2g}",
        f"{row['vtk_bytes_per_tet']:.0f} / {row['bytes_per_tet']:.0f}", verdict(row)]) + " |", flush=True)


def print_head(options):
    said = subprocess.run([options.tetralod, "--version"], check=True, stdout=subprocess.PIPE, text=True).stdout.strip()
    print(f"{machine()}; {said}; to {100 * KEEP:g} % of the tets; least of {options.runs} runs; VTK / tetralod\n")
    head = ["data", "tets", "tets out", "k tets/s: VTK / 1 thread / 2", "times VTK", "times VTK's processor time, measuring included",
            "2 threads", "RMS %", "max %", "volume %", "bytes/tet", "targets"]
    print("| " + " | ".join(head) + " |\n|" + " --- |" * len(head), flush=True)


def read_baseline(path):
    if not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8", newline="") as f:
        return {row["data"]: row for row in csv.DictReader(f)}


def write_baseline(path, rows):
    """Rows that were not made this time stay."""
    kept = read_baseline(path)
    columns = list(rows[0])
    for row in rows:
        kept[row["data"]] = {k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()}
    with open(path, "w", encoding="utf-8", newline="") as f:
        writer = csv.DictWriter(f, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(kept[name] for name in DATA if name in kept)


def check(row, baseline):
    """Complaints where a row is not what baseline.csv says."""
    if row["data"] not in baseline:
        return [f"{row['data']}: is not in the baseline"]
    complaints = []
    for key in FIXED:
        # the file keeps six digits
        told, found = float(baseline[row["data"]][key]), float(f"{row[key]:.6g}" if isinstance(row[key], float) else row[key])
        if abs(told - found) > CHECK_TOLERANCE * max(abs(told), 1e-3):
            complaints.append(f"{row['data']}: {key} is {found}, the baseline says {told}")
    return complaints


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--tetralod", default=os.path.join(HERE, "../build/release/tetralod"))
    parser.add_argument("--rows", nargs="+", default=[], help="only rows whose name holds one of these")
    parser.add_argument("--big", action="store_true", help="also the grid of 20.5 million tets")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--out", default=os.path.join(HERE, "baseline.csv"))
    parser.add_argument("--work", help="folder for the data; default a temporary one")
    parser.add_argument("--check", action="store_true")
    return parser.parse_args()


def main():
    options = parse()
    names = [n for n in DATA if (options.big or n not in LONG or options.rows)
             and (not options.rows or any(r.lower() in n.lower() for r in options.rows))]
    rows, complaints, baseline = [], [], read_baseline(options.out)
    with tempfile.TemporaryDirectory(prefix="tetralod-figures-", dir=options.work) as folder:
        if not options.check:
            print_head(options)
        for name in names:
            mesh = DATA[name](options.tetralod, folder)
            if mesh is None:
                print(f"figures: skipped {name}: its data can't be had here", file=sys.stderr)
                continue
            rows.append(figure(name, mesh, options, folder))
            if options.check:
                complaints += check(rows[-1], baseline)
            else:
                print_row(rows[-1])
    if options.check:
        print("\n".join(complaints) or f"{len(rows)} rows as in the baseline")
    elif rows:
        write_baseline(options.out, rows)
    return 1 if complaints or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
