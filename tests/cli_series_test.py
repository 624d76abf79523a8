"""Models of several time steps on the command line: a Gaussian that moves over a mesh that does not, and real series."""

import importlib.util
import itertools
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


def nearest_on_edges(p, x):
    """Weights of the nearest points of the six edges of each tet to x: [6][tets][4]."""
    found = []
    for a, b in itertools.combinations(range(4), 2):
        edge = p[:, b] - p[:, a]
        t = np.clip(np.einsum("ij,ij->i", x - p[:, a], edge) / np.einsum("ij,ij->i", edge, edge), 0, 1)
        w = np.zeros((len(p), 4))
        w[:, a], w[:, b] = 1 - t, t
        found.append(w)
    return found


def nearest_on_faces(p, x):
    """Weights of the feet of x on the planes of the four faces of each tet, where they lie on the face: [4][tets][4]."""
    found = []
    for a, b, c in itertools.combinations(range(4), 3):
        u, v, d = p[:, b] - p[:, a], p[:, c] - p[:, a], x - p[:, a]
        uu, uv, vv = (np.einsum("ij,ij->i", i, j) for i, j in ((u, u), (u, v), (v, v)))
        du, dv = np.einsum("ij,ij->i", d, u), np.einsum("ij,ij->i", d, v)
        det = uu * vv - uv * uv
        s, t = (vv * du - uv * dv) / det, (uu * dv - uv * du) / det
        w = np.zeros((len(p), 4))
        w[:, a], w[:, b], w[:, c] = 1 - s - t, s, t
        w[(w < 0).any(axis=1)] = [1, 0, 0, 0]
        found.append(w)
    return found


def errors_at(points, originals, mesh, values, reach):
    """By brute force: the least error of each original vertex at points of the tets within reach; where none of the cheap ones is, at
    the nearest ones of faces and edges."""
    corners, tets = mesh
    p = corners[tets]
    inverse = np.linalg.inv((p[:, 1:] - p[:, :1]).transpose(0, 2, 1))
    field = values.reshape(len(values), -1)[tets]
    originals = originals.reshape(len(originals), -1)
    errors = np.empty(len(points))
    for v, x in enumerate(points):
        tail = np.einsum("tij,tj->ti", inverse, x - p[:, 0])
        inside = np.clip(np.concatenate([1 - tail.sum(axis=1, keepdims=True), tail], axis=1), 0, None)
        inside /= inside.sum(axis=1, keepdims=True)
        least = np.inf
        for places in (lambda: [inside], lambda: nearest_on_faces(p, x) + nearest_on_edges(p, x)):
            for w in places() if least == np.inf else []:
                near = np.linalg.norm(np.einsum("ti,tij->tj", w, p) - x, axis=1) <= reach
                if near.any():
                    least = min(least, np.linalg.norm(np.einsum("ti,tij->tj", w[near], field[near]) - originals[v], axis=1).min())
        assert np.isfinite(least), f"vertex {v} is outside"
        errors[v] = least
    return errors


def errors_in(centres, originals, mesh, values, reach):
    """The same of original centroids and values on tets: each tet by itself, with its value at all of its corners."""
    corners, tets = mesh
    apart = corners[tets].reshape(-1, 3), np.arange(4 * len(tets)).reshape(-1, 4)
    return errors_at(centres, originals, apart, np.repeat(values, 4, axis=0), reach)


def heat(points, step):
    return np.exp(-((points - [0.25 + 0.15 * step, 0.5, 0.5])**2).sum(axis=1) / 0.03).astype(np.float32)


def write_pvd(path, files, times):
    with open(path, "w", encoding="utf-8") as f:
        f.write('<VTKFile type="Collection" version="0.1"><Collection>')
        f.write("".join(f'<DataSet timestep="{t}" file="{name}"/>' for name, t in zip(files, times)))
        f.write("</Collection></VTKFile>\n")


class Moving(unittest.TestCase):
    """The data of all cases."""

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


class Series(Moving):
    """Models that are made of several steps."""

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


class Adding(Moving):
    """Channels that are added to a model."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        done = run("build", cls.pvd, "-o", cls.path("base.tlod"), "--steps", "0", "--channels", "heat", "--segment-tets", "1200", "--patch-tets", "300")
        assert done.returncode == 0, done.stderr

    def fresh(self, name):
        shutil.copy(self.path("base.tlod"), self.path(name))
        return self.path(name)

    def add(self, model, *words):
        return run("build", "--add-channel", model, *words)

    def bytes_of(self, path):
        with open(path, "rb") as f:
            return f.read()

    def test_added_steps_keep_their_promises(self):
        model, out = self.fresh("added.tlod"), self.path("added.vtu")
        before = run("extract", model, "-o", out, "--level", "1", "--ascii")
        self.assertEqual(before.returncode, 0, before.stderr)
        kept = self.bytes_of(out)
        done = self.add(model, self.pvd, "--steps", "1:3", "--channels", "heat,wind")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([(c["name"], c["step"]) for c in self.info("added.tlod")["channels"]],
                         [("heat", 0)] + [(n, s) for s in (1, 2, 3) for n in ("heat", "wind")])
        run("extract", model, "-o", out, "--level", "1", "--ascii", "--step", "0")
        self.assertEqual(self.bytes_of(out), kept, "what was there has changed")
        for step in (1, 3):
            for how in (("--full",), ("--level", "2"), ("--error", "heat=5%")):
                done = run("extract", model, "-o", out, "--step", str(step), *how, "--ascii", "--json")
                self.assertEqual(done.returncode, 0, done.stderr)
                said = json.loads(done.stdout)
                corners, tets, arrays = read_vtu(out)
                wind = np.stack([self.points[:, 1] * step, np.sin(3 * self.points[:, 0] + step), self.points[:, 2]], axis=1)
                for name, original in (("heat", heat(self.points, step)), ("wind", wind)):
                    promised = next(b["error"] for b in said["bounds_promised"] if b["channel"] == name)
                    measured = errors_at(self.points, original, (corners, tets), arrays[name], said["boundary_error"] + 2e-5).max()
                    self.assertLessEqual(measured, promised * (1 + 1e-6), f"{name} at step {step}, {how}")
                    if how[0] == "--full":
                        self.assertLess(promised, 2e-4 * 3)
        for words in ((), ("--step", "0")):
            done = run("check", model, "--against", self.pvd, "--channels", "heat", "--cuts", "4") if not words else run("check", model)
            self.assertIn(done.returncode, (0, 2), done.stderr)

    def test_added_field_is_as_good_as_a_built_one(self):
        """Fitted to the originals, so that its errors are near those of a build that does not steer by it."""
        model = self.fresh("fit.tlod")
        self.assertEqual(self.add(model, self.pvd, "--steps", "1", "--channels", "heat").returncode, 0)
        self.build("built.tlod", self.pvd, "--steps", "0,1", "--steer", "0", "--channels", "heat", "--segment-tets", "1200", "--patch-tets", "300")
        added, built = ([v["error"][1]["error"] for v in self.info(n)["levels"]] for n in ("fit.tlod", "built.tlod"))
        self.assertEqual(len(added), len(built))
        self.assertAlmostEqual(added[0], built[0], delta=0.2 * built[0])
        for a, b in zip(added[1:], built[1:]):
            self.assertLess(a, 1.5 * b)

    def test_as_step_and_without(self):
        model = self.fresh("as.tlod")
        done = self.add(model, self.files[2], "--channels", "heat", "--as-step", "7")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.add(model, self.files[1], self.files[2], "--channels", "wind", "--as-step", "8")
        self.assertEqual(done.returncode, 0, done.stderr)
        renamed = self.path("mask.vtu")
        write_vtu(renamed, self.points, self.tets, [("mask", np.arange(len(self.points), dtype=np.int32))])
        done = self.add(model, renamed, "--channel-error", "lossless")
        self.assertEqual(done.returncode, 0, done.stderr)
        channels = self.info("as.tlod")["channels"]
        self.assertEqual([(c["name"], c.get("step")) for c in channels], [("heat", 0), ("heat", 7), ("wind", 8), ("wind", 9), ("mask", None)])
        out = self.path("mask_out.vtu")
        self.assertEqual(run("extract", model, "-o", out, "--full", "--step", "8", "--ascii").returncode, 0)
        arrays = read_vtu(out)[2]
        self.assertEqual(sorted(arrays["mask"].tolist()), list(range(len(self.points))))
        self.assertEqual(run("check", model).returncode, 0)

    def test_what_does_not_fit_is_refused(self):
        model = self.fresh("refused.tlod")
        before = self.bytes_of(model)
        moved, fewer = self.path("far.vtu"), self.path("few.vtu")
        points = self.points.copy()
        points[300] += 0.01
        write_vtu(moved, points, self.tets, [("other", heat(points, 1))])
        write_vtu(fewer, self.points, self.tets[1:], [("other", heat(points, 1))])
        for words, said, status in (((moved,), "another mesh", 1), ((fewer,), "another mesh", 1),
                                    ((self.pvd, "--steps", "0", "--channels", "heat"), "at step 0 already", 1),
                                    ((self.files[1], "--channels", "cold"), "no channel 'cold'", 1),
                                    ((self.files[1], "-o", "x.tlod"), "--add-channel", 2)):
            done = self.add(model, *words)
            self.assertEqual((done.returncode, said in done.stderr), (status, True), done.stderr)
            self.assertEqual(self.bytes_of(model), before)

    def cells(self, name, points, tets):
        """A file with channels on cells and the heat of step 0; gives names and values of the former."""
        centres = points[tets].mean(axis=1)
        data = [("kind", (10 * centres[:, 0]).astype(np.int32)), ("density", heat(centres, 2)), ("flux", np.stack([np.sin(4 * centres[:, 1]), centres[:, 2], centres[:, 0]**2], axis=1))]
        write_vtu(self.path(name), points, tets, [("heat", heat(points, 0))], data)
        return dict(data)

    CELLS = ("--channels", "kind,density,flux")

    def assert_promised(self, said, out, centres, data):
        """By brute force at every third centroid."""
        corners, tets, arrays = read_vtu(out)
        for name, values in data.items():
            promised = next(b["error"] for b in said["bounds_promised"] if b["channel"] == name)
            measured = errors_in(centres[::3], values[::3], (corners, tets), arrays[name], said["boundary_error"] + 2e-5).max()
            self.assertLessEqual(measured, promised * (1 + 1e-6), name)

    def test_added_cells_keep_their_promises(self):
        model, out = self.fresh("cells.tlod"), self.path("cells_out.vtu")
        data = self.cells("cells.vtu", self.points, self.tets)
        centres = self.points[self.tets].mean(axis=1)
        done = self.add(model, self.path("cells.vtu"), *self.CELLS)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([(c["name"], c["on"]) for c in self.info("cells.tlod")["channels"][1:]], [(name, "tet") for name in data])
        for how in (("--full",), ("--level", "2"), ("--error", "density=10%")):
            done = run("extract", model, "-o", out, *how, "--ascii", "--json")
            self.assertEqual(done.returncode, 0, done.stderr)
            said = json.loads(done.stdout)
            self.assert_promised(said, out, centres, data)
            if how[0] == "--full":
                self.assertEqual({b["channel"]: b["error"] < 1e-3 for b in said["bounds_promised"]}, dict.fromkeys(("heat", *data), True))
        for words in ((), ("--against", self.path("cells.vtu"), "--cuts", "6")):
            done = run("check", model, *words)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_added_cells_are_those_of_a_build(self):
        """The finest values are the same bit by bit, the errors of coarse levels near."""
        model = self.fresh("cells_added.tlod")
        self.cells("cells.vtu", self.points, self.tets)
        done = self.add(model, self.files[1], "--as-step", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.build("cells_built.tlod", self.pvd, "--steps", "0,1", "--steer", "0", "--segment-tets", "1200", "--patch-tets", "300")
        found = []
        for name in ("cells_added.tlod", "cells_built.tlod"):
            out = self.path("finest.vtu")
            self.assertEqual(run("extract", self.path(name), "-o", out, "--full", "--step", "1", "--ascii").returncode, 0)
            corners, tets, arrays = read_vtu(out)
            centres = np.round(corners[tets].mean(axis=1), 4)
            order = np.lexsort(centres.T)
            found.append((centres[order], arrays["rank"][order]))
        np.testing.assert_array_equal(found[0][0], found[1][0])
        np.testing.assert_array_equal(found[0][1], found[1][1])
        added, built = ([{e["channel"]: e["error"] for e in v["error"][-1:]} for v in self.info(n)["levels"]] for n in ("cells_added.tlod", "cells_built.tlod"))
        for a, b in zip(added[1:], built[1:]):
            self.assertLess(a["rank"], 1.5 * b["rank"])
            self.assertGreater(a["rank"], 0)

    def test_cells_of_another_mesh(self):
        model = self.fresh("other.tlod")
        before = self.bytes_of(model)
        tets = self.tets.copy()
        tets[1000, 0] = next(v for v in range(len(self.points)) if v not in tets[1000])
        self.cells("other.vtu", self.points, tets)
        done = self.add(model, self.path("other.vtu"), *self.CELLS)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, "the tet around .* is none of the model: another mesh")
        self.assertEqual(self.bytes_of(model), before)

    def test_cells_and_threads(self):
        self.cells("cells.vtu", self.points, self.tets)
        data = []
        for threads in ("1", "3"):
            model = self.fresh("threads.tlod")
            done = self.add(model, self.path("cells.vtu"), *self.CELLS, "--threads", threads)
            self.assertEqual(done.returncode, 0, done.stderr)
            data.append(self.bytes_of(model))
        self.assertEqual(*data)

    def test_interrupted(self):
        """A killed run leaves the old model or the new one, never another."""
        model = self.fresh("killed.tlod")
        before = self.bytes_of(model)
        words = [PROGRAM, "build", "--add-channel", model, self.files[1], "--as-step", "1", "--channels", "heat"]
        for wait in (0.01, 0.05, 0.2):
            with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                try:
                    process.wait(wait)
                except subprocess.TimeoutExpired:
                    process.kill()
            if self.bytes_of(model) != before:
                break
        self.assertEqual(run("check", model).returncode, 0)

    def test_threads_do_not_matter(self):
        data = []
        for threads in ("1", "3"):
            model = self.fresh("threads.tlod")
            done = self.add(model, self.pvd, "--steps", "1,2", "--channels", "heat", "--threads", threads)
            self.assertEqual(done.returncode, 0, done.stderr)
            data.append(self.bytes_of(model))
        self.assertEqual(*data)

    def baffle(self):
        """The mesh with the vertices of its middle plane twice, one for each side: points, tets, how many were there before."""
        points, tets = self.points.copy(), self.tets.copy()
        above = np.where(points[:, 0] == 0.5)[0]
        twin = dict(zip(above.tolist(), range(len(points), len(points) + len(above))))
        points = np.concatenate([points, points[above]])
        right = points[tets].mean(axis=1)[:, 0] > 0.5
        tets[right] = np.vectorize(lambda v: twin.get(v, v))(tets[right])
        return points, tets, len(self.points)

    def test_cells_at_a_baffle(self):
        """The cells of both sides are their own."""
        points, tets, _ = self.baffle()
        write_vtu(self.path("baffle_base.vtu"), points, tets, [("heat", heat(points, 0))])
        self.build("baffle_cells.tlod", self.path("baffle_base.vtu"), "--segment-tets", "1200", "--patch-tets", "300")
        data = self.cells("baffle_cells.vtu", points, tets)
        model, out = self.path("baffle_cells.tlod"), self.path("baffle_out.vtu")
        done = self.add(model, self.path("baffle_cells.vtu"), *self.CELLS)
        self.assertEqual(done.returncode, 0, done.stderr)
        for level in ("0", "2"):
            done = run("extract", model, "-o", out, "--level", level, "--ascii", "--json")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assert_promised(json.loads(done.stdout), out, points[tets].mean(axis=1), data)
        self.assertEqual(run("check", model, "--against", self.path("baffle_cells.vtu"), "--cuts", "4").returncode, 0)

    def test_baffle(self):
        """Vertices at one place: fine with one value, refused with several."""
        points, tets, before = self.baffle()
        same, different = heat(points, 1), heat(points, 1)
        different[before:] += 1
        names = [self.path(f"baffle_{k}.vtu") for k in "abc"]
        for name, values in zip(names, (heat(points, 0), same, different)):
            write_vtu(name, points, tets, [("heat", values)])
        self.build("baffle.tlod", names[0])
        done = self.add(self.path("baffle.tlod"), names[1], "--as-step", "1")
        self.assertEqual(done.returncode, 1, "a channel without a step holds at all")
        self.build("baffle.tlod", names[0], "--steps", "0")
        done = self.add(self.path("baffle.tlod"), names[1], "--as-step", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.add(self.path("baffle.tlod"), names[2], "--as-step", "2")
        self.assertIn("at one place", done.stderr)


class Lossless(Moving):
    """What must come back bit by bit."""

    def round_trip(self, *words):
        points, tets = self.points + 1 / 3, self.tets
        rng = np.random.default_rng(3)
        data = [("single", rng.normal(size=len(points)).astype(np.float32)), ("double", rng.normal(size=len(points)) / 3),
                ("pairs", rng.normal(size=(len(points), 3)) * 1e30), ("count", rng.integers(-2**31, 2**31, len(points)).astype(np.int32))]
        cells = [("kind", rng.integers(0, 100000, len(tets)).astype(np.int32)), ("load", rng.normal(size=len(tets)) * 1e-9)]
        source, out = self.path("exact.vtu"), self.path("exact_out.vtu")
        write_vtu(source, points, tets, data, cells)
        self.build("exact.tlod", source, *words)
        done = run("extract", self.path("exact.tlod"), "-o", out, "--full", "--ascii")
        self.assertEqual(done.returncode, 0, done.stderr)
        found, found_tets, arrays = read_vtu(out)
        return points, tets, dict(data), dict(cells), found, found_tets, arrays

    def assert_exact(self, *words):
        points, tets, data, cells, found, found_tets, arrays = self.round_trip(*words)
        number = {p.tobytes(): i for i, p in enumerate(points)}
        to = np.array([number[p.tobytes()] for p in found.astype(np.float64)])
        self.assertEqual(len(set(to.tolist())), len(points))
        for name, values in data.items():
            self.assertEqual(arrays[name].astype(values.dtype).tobytes(), values[to].tobytes(), name)
        tet = {tuple(sorted(t)): i for i, t in enumerate(tets.tolist())}
        of = np.array([tet[tuple(sorted(t))] for t in to[found_tets].tolist()])
        self.assertEqual(len(set(of.tolist())), len(tets))
        for name, values in cells.items():
            self.assertEqual(arrays[name].astype(values.dtype).tobytes(), values[of].tobytes(), name)

    def test_lossless(self):
        self.assert_exact("--lossless")

    def test_lossless_layout_of_plain_numbers(self):
        self.assert_exact("--lossless", "--raw-layout")

    def test_position_and_channel_errors(self):
        self.assert_exact("--position-error", "lossless", "--channel-error", "lossless")

    def test_one_channel_lossless_the_others_within_their_bounds(self):
        points, _, data, _, found, _, arrays = self.round_trip("--channel-error", "double=lossless", "--channel-error", "single=0.5", "--channel-error", "1%")
        to = ((points[:, None] - found[None])**2).sum(axis=2).argmin(axis=0)
        self.assertLess(np.abs(points[to] - found).max(), 2e-5)
        self.assertEqual(arrays["double"].tobytes(), data["double"][to].tobytes())
        self.assertLessEqual(np.abs(arrays["single"] - data["single"][to]).max(), 0.5)
        self.assertGreater(np.abs(arrays["single"] - data["single"][to]).max(), 0)
        self.fails(self.pvd, "--position-error", "0.5", status=2)
        self.fails(self.pvd, "--channel-error", "heat=-1", status=2)


if __name__ == "__main__":
    unittest.main()
