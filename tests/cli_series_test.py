"""Models of several time steps on the command line: a Gaussian that moves over a mesh that does not, and real series."""

import importlib.util
import json
import os
import shutil
import subprocess
import tempfile
import unittest

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
        cls.points, cls.tets = grid(11)
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
        self.build(both, self.pvd, "--steps", "0,3", "--channels", "heat")
        self.build(first, self.pvd, "--steps", "0,3", "--channels", "heat", "--steer", "0")
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
