"""Long builds on the command line: killed and gone on with, interrupted, on full disks, under small
limits; and meshes that are hard to build."""

import json
import os
import re
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

try:
    import vtk
except ImportError:
    vtk = None

PROGRAM = os.environ["TETRALOD_PROGRAM"]
SHAPE = ("--segment-tets", "1500", "--patch-tets", "300")


def run(*words, **options):
    options.setdefault("timeout", 300)
    return subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, check=False, **options)


def read(path):
    with open(path, "rb") as f:
        return f.read()


def legacy(path, points, tets, channels):
    """A legacy VTK file in text; channels maps names to lists of values on points."""
    with open(path, "w", encoding="ascii") as f:
        f.write(f"# vtk DataFile Version 3.0\nm\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {len(points)} double\n")
        f.writelines("%.17g %.17g %.17g\n" % p for p in points)
        f.write(f"CELLS {len(tets)} {5 * len(tets)}\n")
        f.writelines("4 %d %d %d %d\n" % t for t in tets)
        f.write(f"CELL_TYPES {len(tets)}\n" + "10\n" * len(tets))
        if channels:
            f.write(f"POINT_DATA {len(points)}\n")
        for name, values in channels.items():
            f.write(f"SCALARS {name} double 1\nLOOKUP_TABLE default\n" + "\n".join(map(str, values)) + "\n")


def cubes(cells, base=(0, 0, 0)):
    """Unit cubes at those places, six tets each, with common corners."""
    numbers, tets = {}, []

    def corner(*p):
        return numbers.setdefault(p, len(numbers))

    for c in cells:
        v = [corner(*(base[k] + c[k] + (i >> k & 1) for k in range(3))) for i in range(8)]
        tets += [(v[0], v[a], v[b], v[7]) for a, b in ((1, 3), (3, 2), (2, 6), (6, 4), (4, 5), (5, 1))]
    return [tuple(map(float, p)) for p in numbers], tets


class Builds(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tetralod-build-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.input = os.path.join(cls.folder, "in.vtu")
        done = run("sample", "gaussians", "--size", 22, "-o", cls.input)
        assert done.returncode == 0, done.stderr
        cls.once = cls.build_once("once.tlod", "--threads", 2)

    @classmethod
    def build_once(cls, name, *words):
        path = os.path.join(cls.folder, name)
        done = run("build", cls.input, "-o", path, *SHAPE, *words)
        assert done.returncode == 0, done.stderr
        return read(path)

    def setUp(self):
        self.place = tempfile.mkdtemp(dir=self.folder)
        self.model = os.path.join(self.place, "m.tlod")
        self.work = os.path.join(self.place, "work")

    def test_limits_and_threads(self):
        for i, words in enumerate((("--memory", "16M", "--threads", 1), ("--memory", "33M", "--threads", 3), ("--memory", "2G"))):
            self.assertEqual(self.build_once(f"limit{i}.tlod", *words), self.once)

    def test_limit_that_would_do(self):
        """In windows, as a whole, compressed, with five components, with channels on cells."""
        data = os.environ.get("TETRALOD_DATA")
        inputs = [(self.input,)]
        if data:
            inputs += [(os.path.join(data, "curvilinear/bluntfin.vtk"),),
                       (os.path.join(data, "tet/bracket_appended_compressed.vtu"),),
                       (os.path.join(data, "curvilinear/combxyz.bin"), "--solution",
                        os.path.join(data, "curvilinear/combq.bin"))]
        for words in inputs:
            done = run("build", *words, "-o", self.model, "--memory", "1M")
            self.assertEqual(done.returncode, 1)
            limit = re.search(r"a limit of (\d+)M would do", done.stderr)
            self.assertTrue(limit, done.stderr)
            done = run("build", *words, "-o", self.model, "--memory", limit.group(1) + "M")
            self.assertEqual(done.returncode, 0, done.stderr)
            if words[0] == self.input:
                continue  # so small that any build needs more
            done = run("build", *words, "-o", self.model, "--memory", f"{int(limit.group(1)) // 3}M")
            self.assertEqual(done.returncode, 1)

    def test_killed_and_resumed(self):
        """Killed as soon as the state says that a stage is done, and the same again while it goes on."""
        words = ["build", self.input, "-o", self.model, *SHAPE, "--keep", self.work]
        state = os.path.join(self.work, "state.work")
        kills = 0
        for _ in range(6):
            before = os.stat(state).st_mtime_ns if os.path.exists(state) else 0
            with subprocess.Popen([PROGRAM, *map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
                deadline = time.monotonic() + 200
                while process.poll() is None and time.monotonic() < deadline:
                    if os.path.exists(state) and os.stat(state).st_mtime_ns != before:
                        process.kill()
                    time.sleep(0.002)
                message = process.communicate()[1]
            if process.returncode == 0:
                break
            self.assertEqual(process.returncode, -signal.SIGKILL, message)
            kills += 1
            words = ["build", self.input, "-o", self.model, *SHAPE, "--resume", self.work, "--threads", 1 + kills % 2]
            self.assertFalse(os.path.exists(self.model))
        self.assertGreaterEqual(kills, 2)
        if not os.path.exists(self.model):
            done = run("build", self.input, "-o", self.model, *SHAPE, "--resume", self.work)
            self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(read(self.model), self.once)
        self.assertEqual([n for n in os.listdir(self.place) if n not in ("work", "m.tlod")], [])

    def test_interrupted_leaves_nothing(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            tmp = tempfile.mkdtemp(dir=self.place)
            with subprocess.Popen([PROGRAM, "build", self.input, "-o", self.model, *SHAPE, "--tmp", tmp], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.PIPE, text=True) as process:
                time.sleep(0.15)
                process.send_signal(number)
                message = process.communicate(timeout=200)[1]
            if process.returncode == 0:
                os.remove(self.model)
            else:
                self.assertEqual(process.returncode, 1, message)
                self.assertIn("stopped on request", message)
            self.assertEqual(os.listdir(tmp), [])
            self.assertFalse(os.path.exists(self.model))

    def test_full_disk(self):
        for limit in (50_000, 1_000_000, 3_000_000):
            done = run("build", self.input, "-o", self.model, *SHAPE, "--tmp", self.place,
                       preexec_fn=lambda limit=limit: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
            self.assertEqual(done.returncode, 1)
            self.assertIn(self.place, done.stderr)
            self.assertRegex(done.stderr, r"\d+ bytes")
            self.assertEqual(os.listdir(self.place), [])

    def test_no_folder(self):
        for folder in ("/proc", os.path.join(self.place, "none")):
            done = run("build", self.input, "-o", self.model, "--tmp", folder)
            self.assertEqual(done.returncode, 1)
            self.assertIn(folder, done.stderr)
            done = run("build", self.input, "-o", self.model, "--keep", os.path.join(folder, "deep", "work"))
            self.assertEqual(done.returncode, 1)
            self.assertIn(folder, done.stderr)

    def test_folder_of_simplify(self):
        """--tmp goes before TMPDIR, in parts too."""
        path, out = os.path.join(self.place, "in.vtu"), os.path.join(self.place, "out.vtu")
        self.assertEqual(run("sample", "gaussians", "--size", 42, "-o", path).returncode, 0)
        words = ("simplify", path, "-o", out, "--ratio", "0.5", "--memory", "32M", "--json")
        bad, none = dict(os.environ, TMPDIR=os.path.join(self.place, "none")), os.path.join(self.place, "gone")
        done = run(*words, "--tmp", self.place, env=bad)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(json.loads(done.stdout)["in_parts"])
        self.assertEqual(sorted(os.listdir(self.place)), ["in.vtu", "out.vtu"])
        for place, more, env in ((none, ("--tmp", none), os.environ), (bad["TMPDIR"], (), bad)):
            done = run(*words, *more, env=env)
            self.assertEqual(done.returncode, 1)
            self.assertIn(place, done.stderr)
        done = run("build", self.input, "-o", self.model, env=bad)
        self.assertEqual(done.returncode, 1)
        self.assertIn(bad["TMPDIR"], done.stderr)

    def test_stages(self):
        done = run("build", self.input, *SHAPE, "--keep", self.work, "--stop-after", "level 1", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        said = json.loads(done.stdout)
        self.assertEqual((said["stopped_after"], said["levels"], said["bytes"]), ("level 1", 2, 0))
        done = run("build", self.input, "-o", self.model, "--resume", self.work)
        self.assertEqual(done.returncode, 1)
        self.assertIn('there it is "segment tets: 1500", here "segment tets: 0"', done.stderr)
        done = run("build", self.input, "-o", self.model, *SHAPE, "--resume", self.work)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(read(self.model), self.once)
        self.assertEqual(run("build", self.input, "--stop-after", "finest").returncode, 2)

    @unittest.skipUnless(vtk, "python3-vtk9 is not installed")
    def test_others_open_each_stage(self):
        """What a stage leaves behind is opened by VTK: all tets, the whole volume, every number there."""
        volume = json.loads(run("info", self.input, "--json").stdout)["volume"]
        words, counts = ("--keep", self.work), []
        for stage, name, number in (("segment", "segments", "segment"), ("finest", "level_0", "patch"),
                                    ("level 2", "level_2", "segment")):
            done = run("build", self.input, *SHAPE, *words, "--stop-after", stage)
            self.assertEqual(done.returncode, 0, done.stderr)
            words = ("--resume", self.work)
            reader = vtk.vtkXMLUnstructuredGridReader()
            reader.SetFileName(os.path.join(self.work, name + ".vtu"))
            quality = vtk.vtkMeshQuality()
            quality.SetInputConnection(reader.GetOutputPort())
            quality.SetTetQualityMeasureToVolume()
            quality.Update()
            cells = quality.GetOutput().GetCellData()
            counts.append(quality.GetOutput().GetNumberOfCells())
            volumes = [cells.GetArray("Quality").GetValue(i) for i in range(counts[-1])]
            self.assertGreater(min(volumes), 0)
            self.assertAlmostEqual(sum(volumes) / volume, 1, delta=0.005)
            seen = {cells.GetArray(number).GetValue(i) for i in range(counts[-1])}
            self.assertEqual(len(seen), max(seen) - min(seen) + 1)
            self.assertGreater(len(seen), 1)
        done = run("build", self.input, "-o", self.model, *SHAPE, *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(read(self.model), self.once)
        levels = json.loads(run("info", self.model, "--json").stdout)["levels"]
        self.assertEqual(counts, [levels[0]["tets"], levels[0]["tets"], levels[2]["tets"]])

    def test_whole_files_under_a_limit(self):
        """Formats that have no windows: the same segments as without a limit, which reading alone would pass."""
        large, limit = os.path.join(self.place, "large.vtu"), 14 << 20
        self.assertEqual(run("sample", "gaussians", "--size", 45, "-o", large).returncode, 0)
        for name in ("a.vtk", "a.msh"):
            path, found, peaks = os.path.join(self.place, name), [], []
            self.assertEqual(run("convert", large, path).returncode, 0)
            for words in ((), ("--memory", limit, "--tmp", self.place)):
                done = run("build", path, "--keep", self.work, "--stop-after", "segment", *words, "--json")
                self.assertEqual(done.returncode, 0, done.stderr)
                found.append(read(os.path.join(self.work, "segments.work")))
                peaks.append(json.loads(done.stdout)["peak_bytes"])
                shutil.rmtree(self.work)
            self.assertEqual(found[0], found[1])
            self.assertGreater(peaks[0], limit)
            self.assertLessEqual(peaks[1], limit)

    def check_mesh(self, points, tets, channels):
        path = os.path.join(self.place, "hard.vtk")
        legacy(path, points, tets, channels)
        done = run("build", path, "-o", self.model, "--segment-tets", 500, "--patch-tets", 100)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = run("check", self.model, "--against", path, "--json")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertTrue(json.loads(done.stdout)["ok"])

    def test_hard_meshes(self):
        block = [(x, y, z) for x in range(7) for y in range(7) for z in range(7)]
        points, tets = cubes(block)
        wave = [x * x + y - z for x, y, z in points]
        self.check_mesh(*cubes([(0, 0, 0)])[:1], [(0, 1, 3, 7)], {"f": [0, 1, 2, 3, 4, 5, 6, 7]})
        self.check_mesh(points, tets, {})
        self.check_mesh(points, tets, {"same": [3] * len(points)})
        self.check_mesh(points, tets, {f"f{i}": [v * (i + 1) for v in wave] for i in range(20)})
        self.check_mesh(points, tets, {"holes": ["nan" if i % 50 == 0 else v for i, v in enumerate(wave)]})
        cavity = [c for c in block if not all(2 <= k < 5 for k in c)]
        apart = [c for c in block if c[0] != 3]
        corner = [c for c in block if (c[0] < 3) == (c[1] < 3)]  # halves that touch in an edge
        for cells in (cavity, apart, corner):
            points, tets = cubes(cells)
            self.check_mesh(points, tets, {"f": [x * y + z * z for x, y, z in points]})


if __name__ == "__main__":
    unittest.main()
