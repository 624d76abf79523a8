"""Models of several time steps on the command line: a Gaussian that moves over a mesh that does not, and real series."""

import importlib.util
import json
import os
import shutil
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree

import numpy as np

PROGRAM = os.environ["TETRALOD_PROGRAM"]
SOURCE = os.environ["TETRALOD_SOURCE"]
DATA = os.environ.get("TETRALOD_DATA", "")


def second_reader():
    """The reader of tests/store_format_test.py, which is written from docs/FORMAT.md alone."""
    spec = importlib.util.spec_from_file_location("store_format", os.path.join(SOURCE, "tests", "store_format_test.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Reader


def run(*words, timeout=200):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False, timeout=timeout)


def grid(n):
    """Points of a jittered grid and its tets, six a cell, all positive."""
    line = np.linspace(0, 1, n)
    points = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    inner = np.all((points > 0) & (points < 1), axis=1)
    points[inner] += np.random.default_rng(1).uniform(-0.15, 0.15, (inner.sum(), 3)) / (n - 1)
    ids = np.arange(n**3).reshape(n, n, n)
    corner = [ids[i:n - 1 + i, j:n - 1 + j, k:n - 1 + k].ravel() for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    paths = ((0, 4, 6, 7), (0, 6, 2, 7), (0, 2, 3, 7), (0, 3, 1, 7), (0, 1, 5, 7), (0, 5, 4, 7))
    tets = np.concatenate([np.stack([corner[c] for c in path], axis=1) for path in paths])
    p = points[tets]
    turned = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p[:, 3] - p[:, 0]) < 0
    tets[turned] = tets[turned][:, [0, 2, 1, 3]]
    return points, tets


def write_vtu(path, points, tets, point_data, cell_data=(), time=None):
    """Plain text, with all digits."""
    def array(name, kind, values, components=1):
        text = " ".join(repr(v) for v in np.asarray(values).ravel().tolist())
        return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="ascii">{text}</DataArray>\n'

    def arrays(data):
        kinds = {"float32": "Float32", "float64": "Float64", "int32": "Int32", "uint8": "UInt8"}
        return "".join(array(name, kinds[str(v.dtype)], v, 1 if v.ndim == 1 else v.shape[1]) for name, v in data)

    field = "" if time is None else f'<FieldData><DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{time}</DataArray></FieldData>'
    with open(path, "w", encoding="utf-8") as f:
        f.write('<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid>' + field +
                f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(tets)}">\n<Points>' + array("Points", "Float64", points, 3) +
                "</Points>\n<Cells>" + array("connectivity", "Int64", tets) + array("offsets", "Int64", 4 * np.arange(1, len(tets) + 1)) +
                array("types", "UInt8", np.full(len(tets), 10)) + f"</Cells>\n<PointData>{arrays(point_data)}</PointData>\n<CellData>{arrays(cell_data)}</CellData>"
                "</Piece></UnstructuredGrid></VTKFile>\n")


def read_vtu(path):
    """What write_vtu writes, and --ascii: points, tets, arrays by name."""
    def values(node):
        kind = {"Float32": np.float32, "Float64": np.float64}.get(node.get("type"), np.int64)
        found = np.array((node.text or "").split()).astype(kind)
        width = int(node.get("NumberOfComponents") or 1)
        return found.reshape(-1, width) if width > 1 else found

    root = xml.etree.ElementTree.parse(path).getroot()
    found = {node.get("Name"): values(node) for node in root.iter("DataArray") if node.get("Name")}
    points = values(next(iter(root.iter("Points")))[0])
    return points, found.pop("connectivity").reshape(-1, 4), found


def errors_at(points, originals, mesh, values, reach):
    """By brute force: the least error of each original vertex among the tets with a point within reach of it."""
    corners, tets = mesh
    p = corners[tets]
    inverse = np.linalg.inv((p[:, 1:] - p[:, :1]).transpose(0, 2, 1))
    field = values.reshape(len(values), -1)[tets]
    originals = originals.reshape(len(originals), -1)
    errors = np.empty(len(points))
    for v, x in enumerate(points):
        tail = np.einsum("tij,tj->ti", inverse, x - p[:, 0])
        w = np.clip(np.concatenate([1 - tail.sum(axis=1, keepdims=True), tail], axis=1), 0, None)
        w /= w.sum(axis=1, keepdims=True)
        near = np.linalg.norm(np.einsum("ti,tij->tj", w, p) - x, axis=1) <= reach
        assert near.any(), f"vertex {v} is outside"
        errors[v] = np.linalg.norm(np.einsum("ti,tij->tj", w[near], field[near]) - originals[v], axis=1).min()
    return errors


def heat(points, step):
    return np.exp(-((points - [0.25 + 0.15 * step, 0.5, 0.5])**2).sum(axis=1) / 0.03).astype(np.float32)


def write_pvd(path, files, times):
    with open(path, "w", encoding="utf-8") as f:
        f.write('<VTKFile type="Collection" version="0.1"><Collection>')
        f.write("".join(f'<DataSet timestep="{t}" file="{name}"/>' for name, t in zip(files, times)))
        f.write("</Collection></VTKFile>\n")


class Series(unittest.TestCase):
    STEPS = 4

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tetralod-series-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.points, cls.tets = grid(9)
        cls.files = [cls.path(f"moving_{s}.vtu") for s in range(cls.STEPS)]
        for s, name in enumerate(cls.files):
            wind = np.stack([cls.points[:, 1] * s, np.sin(3 * cls.points[:, 0] + s), cls.points[:, 2]], axis=1)
            rank = ((np.arange(len(cls.tets)) + s) % 17).astype(np.int32)
            write_vtu(name, cls.points, cls.tets, [("heat", heat(cls.points, s)), ("wind", wind)], [("rank", rank)])
        cls.times = [0.5 * s for s in range(cls.STEPS)]
        cls.pvd = cls.path("moving.pvd")
        write_pvd(cls.pvd, [os.path.basename(name) for name in cls.files], cls.times)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    def build(self, name, *words):
        done = run("build", *words, "-o", self.path(name), "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def info(self, name):
        done = run("info", self.path(name), "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def fails(self, *words, status=1):
        done = run("build", *words, "-o", self.path("none.tlod"))
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        self.assertFalse(os.path.exists(self.path("none.tlod")))
        return done.stderr

    def test_all_steps(self):
        built = self.build("all.tlod", self.pvd, "--steps", "all")
        self.assertEqual(built["tets_in"], len(self.tets))
        channels = self.info("all.tlod")["channels"]
        self.assertEqual([(c["name"], c["on"], c["step"], c["time"]) for c in channels],
                         [(n, "vertex", s, self.times[s]) for s in range(self.STEPS) for n in ("heat", "wind")] +
                         [("rank", "tet", s, self.times[s]) for s in range(self.STEPS)])
        ranges = {(c["name"], tuple(c["range"])) for c in channels}
        self.assertEqual(len(ranges), 3, "steps have one range together")
        done = run("check", self.path("all.tlod"))
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_promises_hold_at_every_step(self):
        """Promise >= measured by brute force, at the levels and under a bound, for every step."""
        self.build("promise.tlod", self.pvd, "--steps", "all", "--segment-tets", "1200", "--patch-tets", "300")
        out = self.path("step.vtu")
        for step in range(self.STEPS):
            for how in (("--level", "2"), ("--error", "heat=5%")):
                done = run("extract", self.path("promise.tlod"), "-o", out, "--step", str(step), *how, "--ascii", "--json")
                self.assertEqual(done.returncode, 0, done.stderr)
                said = json.loads(done.stdout)
                self.assertEqual((said["step"], said["time"]), (step, self.times[step]))
                self.assertEqual([b["channel"] for b in said["bounds_promised"]], ["heat", "wind", "rank"])
                corners, tets, arrays = read_vtu(out)
                reach = said["boundary_error"] + 2e-5
                wind = np.stack([self.points[:, 1] * step, np.sin(3 * self.points[:, 0] + step), self.points[:, 2]], axis=1)
                for name, original in (("heat", heat(self.points, step)), ("wind", wind)):
                    promised = next(b["error"] for b in said["bounds_promised"] if b["channel"] == name)
                    measured = errors_at(self.points, original, (corners, tets), arrays[name], reach).max()
                    self.assertLessEqual(measured, promised * (1 + 1e-6), f"{name} at step {step}, {how}")
                    if how[0] == "--error" and name == "heat":
                        self.assertLessEqual(promised, 0.05)

    def test_check_against_every_step(self):
        self.build("check.tlod", self.pvd, "--steps", "1,3", "--channels", "heat")
        done = run("check", self.path("check.tlod"), "--against", self.pvd, "--cuts", "6", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        said = json.loads(done.stdout)
        self.assertEqual([(m["channel"], m["step"]) for m in said["measured"]], [("heat", 1), ("heat", 3)])
        for promised, measured in zip(said["promised"], said["measured"]):
            self.assertGreater(measured["error"], 0)
            self.assertLessEqual(measured["error"], promised["error"])
        done = run("check", self.path("check.tlod"), "--against", self.files[3], "--step", "3", "--cuts", "4")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run("check", self.path("check.tlod"), "--against", self.files[2], "--step", "3", "--cuts", "4")
        self.assertEqual(done.returncode, 1, "another step of the series passed for it")
        self.assertIn("'heat' is off by", done.stderr)

    def test_steps_are_chosen(self):
        self.build("choose.tlod", self.pvd, "--steps", "1:3", "--channels", "heat")
        out = self.path("chosen.vtu")
        for words, step in (((), 1), (("--step", "2"), 2), (("--step", "last"), 3), (("--time", "1.2"), 2), (("--time", "0"), 1)):
            done = run("extract", self.path("choose.tlod"), "-o", out, "--full", *words, "--json")
            self.assertEqual((done.returncode, json.loads(done.stdout)["step"]), (0, step), done.stderr)
        done = run("info", out, "--json")
        self.assertEqual(json.loads(done.stdout)["time"], self.times[1])
        done = run("extract", self.path("choose.tlod"), "-o", out, "--full", "--step", "0")
        self.assertEqual(done.returncode, 2)
        self.assertIn("steps: 1 2 3", done.stderr)
        done = run("info", self.path("choose.tlod"))
        self.assertIn("steps       3: 1 (time 0.5) 2 (time 1) 3 (time 1.5)", done.stdout)

    def test_real_series(self):
        """Exodus and XDMF files with steps of a mesh that does not move."""
        for name, steps in (("exodus/mug.e", "0,10:20:5"), ("xdmf-hdf5/no_checkpoint.xdmf", "all")):
            path = os.path.join(DATA, name)
            if not DATA or not os.path.exists(path):
                self.skipTest(f"{name} is not there")
            self.build("real.tlod", path, "--steps", steps)
            numbers = sorted({c["step"] for c in self.info("real.tlod")["channels"]})
            self.assertEqual(numbers, [0, 10, 15, 20] if "mug" in name else [0, 1, 2, 3, 4])
            done = run("check", self.path("real.tlod"), "--against", path, "--cuts", "4")
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_second_reader_knows_steps(self):
        self.build("raw.tlod", self.pvd, "--steps", "1,3", "--raw-layout", "--lossless", "--channels", "heat")
        with open(self.path("raw.tlod"), "rb") as f:
            reader = second_reader()(f.read())
        self.assertEqual([(c["name"], c["number"], c["time"]) for c in reader.channel], [("heat", 1, 0.5), ("heat", 3, 1.5)])
        for index, step in ((0, 1), (1, 3)):  # images of binary32 at the finest level are the input's
            known = set(heat(self.points, step).view(np.int32).tolist())
            finest = [p for p in range(reader.patch_count) if reader.producer[p] == 0xFFFFFFFF]
            stored = set()
            for p in finest:
                stored |= set(reader.decoded[p, index])
            self.assertEqual(stored, known)

    def test_lists_of_steps(self):
        for words, steps in (("last", [3]), ("0,2:3", [0, 2, 3]), ("0:3:2", [0, 2])):
            self.build("list.tlod", self.pvd, "--steps", words, "--channels", "heat")
            self.assertEqual([c["step"] for c in self.info("list.tlod")["channels"]], steps)
        for words in ("4", "2:1", "0:3:0", "x", "0,", "0:", ""):
            self.assertIn("--steps", self.fails(self.pvd, "--steps", words, status=2))

    def test_files_are_steps(self):
        self.build("files.tlod", *self.files[:3], "--channels", "heat")
        self.assertEqual([(c["name"], c["step"]) for c in self.info("files.tlod")["channels"]], [("heat", s) for s in range(3)])

    def test_steer(self):
        """The steps that steer decide what goes: the errors of those are smaller, those of others larger."""
        both, first = "both.tlod", "first.tlod"
        words = ("--steps", "0,3", "--channels", "heat", "--patch-tets", "500")
        self.build(both, self.pvd, *words)
        self.build(first, self.pvd, *words, "--steer", "0")
        errors = {name: [e["error"] for e in self.info(name)["levels"][2]["error"]] for name in (both, first)}
        self.assertLess(errors[first][0], errors[both][0])
        self.assertGreater(errors[first][1], errors[both][1])
        self.assertIn("step 1 is not among --steps", self.fails(self.pvd, "--steps", "0,3", "--steer", "1", status=2))

    def test_other_meshes_are_refused(self):
        moved, fewer = self.path("moved.vtu"), self.path("fewer.vtu")
        points = self.points.copy()
        points[7, 2] += 1e-9
        write_vtu(moved, points, self.tets, [("heat", heat(points, 1))])
        write_vtu(fewer, self.points, self.tets[:-1], [("heat", heat(points, 1))])
        said = self.fails(self.files[0], moved)
        self.assertIn("step 1", said)
        self.assertIn("the mesh moves: vertex 7", said)
        self.assertIn("the mesh changes", self.fails(self.files[0], fewer))
        turned = self.tets.copy()
        turned[5] = turned[5][[1, 2, 0, 3]]
        write_vtu(fewer, self.points, turned, [("heat", heat(points, 1))])
        self.assertIn("tet 5 has other vertices", self.fails(self.files[0], fewer))

    def test_threads_do_not_matter(self):
        """The same bytes with one thread and with three."""
        data = []
        for threads in ("1", "3"):
            self.build("threads.tlod", self.pvd, "--steps", "all", "--threads", threads, "--segment-tets", "2000", "--patch-tets", "500")
            with open(self.path("threads.tlod"), "rb") as f:
                data.append(f.read())
        self.assertEqual(*data)


if __name__ == "__main__":
    unittest.main()
