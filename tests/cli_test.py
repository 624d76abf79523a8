"""The program tetralod, as a user meets it: exit statuses, messages, JSON, wrong use, ctrl-C, full
disks. Transcripts with the expected text stand in tests/cli/."""

import filecmp
import json
import os
import pty
import re
import resource
import shlex
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

PROGRAM = os.environ["TETRALOD_PROGRAM"]
SOURCE = os.environ["TETRALOD_SOURCE"]
DATA = os.environ.get("TETRALOD_DATA")
TRANSCRIPTS = os.path.join(SOURCE, "tests", "cli")
PYTHON = "/usr/bin/python3"

# Seconds after which ctrl-C is tried; a machine that is done by then gets the next, shorter one.
PATIENCE = (0.4, 0.2, 0.1, 0.05, 0.02)


def grid_file(path, side=5):
    """A grid of unit cells with a scalar (x + y + z) and a vector (the position)."""
    points = [(x, y, z) for z in range(side) for y in range(side) for x in range(side)]
    with open(path, "w", encoding="ascii") as f:
        f.write("# vtk DataFile Version 3.0\ncube\nASCII\nDATASET STRUCTURED_POINTS\n"
                f"DIMENSIONS {side} {side} {side}\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA {len(points)}\n"
                "SCALARS temperature float 1\nLOOKUP_TABLE default\n")
        f.write("\n".join(str(sum(p)) for p in points) + "\nVECTORS wind float\n")
        f.write("\n".join("%d %d %d" % p for p in points) + "\n")


def surface_file(path):
    with open(path, "w", encoding="ascii") as f:
        f.write("# vtk DataFile Version 3.0\nsurface\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n"
                "0 0 0 1 0 0 0 1 0 1 1 2\nCELLS 2 8\n3 0 1 2\n3 1 3 2\nCELL_TYPES 2\n5\n5\n"
                "POINT_DATA 4\nSCALARS height float 1\nLOOKUP_TABLE default\n0 0 0 2\n")


def run(*words, **options):
    options.setdefault("timeout", 120)
    return subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, check=False, **options)


def transcript(path):
    """(command, status, stdout lines, stderr lines) of each command in a transcript."""
    found = []
    with open(path, encoding="utf-8") as f:
        for line in f.read().splitlines():
            if line.startswith("$ "):
                found.append((shlex.split(line[2:])[1:], [], [], []))
            elif line.startswith("["):
                found[-1][1].append(int(line.strip("[]")))
            elif line.startswith((">", "!")):
                found[-1][2 if line[0] == ">" else 3].append(line[2:])
    return found


def pattern(lines):
    """<*> is any text in a line, <...> any lines."""
    text = ""
    for line in lines:
        text += r"(?:.*\n)*?" if line == "<...>" else re.escape(line).replace(re.escape("<*>"), ".*?") + " *\n"
    return re.compile(text)


def strict(text):
    """JSON without the NaN and Infinity that Python would take."""
    def refuse(word):
        raise ValueError(f"{word} is no JSON")
    return json.loads(text, parse_constant=refuse)


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="tetralod-cli-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.before = os.getcwd()
        os.chdir(self.folder)
        self.addCleanup(os.chdir, self.before)
        grid_file("cube.vtk")
        surface_file("surface.vtk")
        with open("notes.txt", "w", encoding="ascii") as f:
            f.write("this is no mesh\n")

    def good(self, *words, **options):
        done = run(*words, **options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def said(self, *words):
        return strict(self.good(*words, "--json").stdout)

    def transcript(self, name):
        commands = transcript(os.path.join(TRANSCRIPTS, name))
        self.assertTrue(commands)
        for words, status, out, err in commands:
            with self.subTest(" ".join(words)):
                done = run(*words)
                self.assertEqual([done.returncode], status, done.stderr)
                self.assertRegex(done.stdout, "^" + pattern(out).pattern + "$")
                self.assertRegex(done.stderr, "^" + pattern(err).pattern + "$")


class Words(Case):
    def test_wrong_use(self):
        self.transcript("wrong_use.txt")
        self.assertFalse(os.path.exists("out.vtu"))

    def test_failures(self):
        self.transcript("failures.txt")
        self.assertFalse(os.path.exists("out.vtu"))

    def test_summaries(self):
        self.transcript("summaries.txt")

    def test_help_of_every_verb(self):
        program = self.good("--help").stdout
        self.assertEqual(self.good("help").stdout, program)
        verbs = re.findall(r"^  (\w+) +\w", program, re.M)
        for verb in ("sample", "info", "convert", "simplify", "compare", "bench"):
            self.assertIn(verb, verbs)
            text = self.good("help", verb).stdout
            self.assertEqual(self.good(verb, "--help").stdout, text)
            self.assertIn(f"Usage: tetralod {verb} ", text)
            self.assertIn("Examples", text)
            self.assertLessEqual(max(len(line) for line in text.split("Examples")[0].splitlines()), 92)
        self.assertRegex(self.good("help", "simplify").stdout, r"\(default\s+0\.1%\)")

    def test_manual_is_current(self):
        with open(os.path.join(SOURCE, "docs", "CLI.md"), encoding="utf-8") as f:
            self.assertEqual(f.read(), self.good("help", "--markdown").stdout,
                             "write it again: tetralod help --markdown > docs/CLI.md")

    def test_manual_of_scenes_is_current(self):
        with open(os.path.join(SOURCE, "docs", "SCENE.md"), encoding="utf-8") as f:
            page = f.read()
        self.assertEqual(page, self.good("help", "scene").stdout, "write it again: tetralod help scene > docs/SCENE.md")
        # each property of a scene as it is written, with its preset, is in the page
        self.assertEqual(len(re.findall(r"^### \w+$", page, re.M)), 16)
        for line in re.findall(r"^\| `(?:\w+)` \| .*$", page[page.index("\n### "):], re.M):
            self.assertEqual(len(re.findall(r"(?<!\\)\|", line)), 5, line)

    def test_forms_of_options(self):
        for words in (("--output=a.vtu", "--ratio=50%"), ("-oa.vtu", "--ratio", "0.5"), ("-o", "a.vtu", "--tets", "160")):
            said = self.said("simplify", "cube.vtk", *words)
            self.assertLessEqual(said["tets_out"], 160)
            os.remove("a.vtu")
        os.rename("cube.vtk", "--cube.vtk")
        done = self.good("info", "--json", "--", "--cube.vtk")
        self.assertEqual(strict(done.stdout)["tets"], 320)


class Objects(Case):
    def test_info(self):
        said = self.said("info", "cube.vtk")
        self.assertEqual([said[k] for k in ("vertices", "tets", "boundary_triangles", "components", "inverted", "degenerate")],
                         [125, 320, 192, 1, 0, 0])
        self.assertEqual(said["bounds"], [0, 4, 0, 4, 0, 4])
        self.assertAlmostEqual(said["volume"], 64)
        self.assertAlmostEqual(said["boundary_area"], 96)
        self.assertEqual(sum(said["cells"].values()), 64)
        self.assertEqual([(c["name"], c["components"], c["on"]) for c in said["channels"]],
                         [("temperature", 1, "vertex"), ("wind", 3, "vertex")])
        self.assertEqual(said["channels"][0]["range"], [0, 12])
        self.assertAlmostEqual(said["channels"][1]["range"][1], 48 ** 0.5)
        self.assertEqual(self.said("info", "cube.vtk", "--split", "6")["tets"], 384)

    def test_info_without_volume(self):
        said = self.said("info", "surface.vtk")
        self.assertEqual(said["tets"], 0)
        self.assertEqual(sum(said["cells"].values()), 2)
        self.assertEqual(said["bounds"], [0, 1, 0, 1, 0, 2])
        self.assertEqual([c["name"] for c in said["channels"]], ["height"])

    def test_simplify(self):
        said = self.said("simplify", "cube.vtk", "-o", "small.vtu", "--ratio", "0.25")
        self.assertEqual(said["tets_in"], 320)
        self.assertLessEqual(said["tets_out"], 80)
        for key in ("vertices_out", "seconds", "peak_bytes", "boundary_error"):
            self.assertIsInstance(said[key], (int, float))
        self.assertEqual(said["inverted"], 0)
        self.assertEqual([c["name"] for c in said["channels"]], ["temperature", "wind"])
        for channel in said["channels"]:  # both fields are linear: next to nothing is lost
            self.assertLessEqual(channel["rms_error"], channel["max_error"])
            self.assertLess(channel["max_error"], 1e-4 * (channel["range"][1] - channel["range"][0]))
        self.assertLessEqual(said["boundary_error"], 0.001 * 48 ** 0.5)
        info = self.said("info", "small.vtu")
        self.assertEqual((info["tets"], info["vertices"]), (said["tets_out"], said["vertices_out"]))
        self.assertAlmostEqual(info["volume"], 64, delta=0.0064)

    def test_compare(self):
        self.good("simplify", "cube.vtk", "-o", "small.vtu", "--ratio", "0.25")
        said = self.said("compare", "cube.vtk", "small.vtu", "--iso", "temperature=6", "--iso", "temperature=3.5")
        for channel in said["channels"]:
            self.assertEqual({"name", "rms", "max", "mean", "range"} - set(channel), set())
        self.assertIsInstance(said["outside_vertices"], int)
        self.assertEqual({"mean", "hausdorff"} - set(said["boundary"]), set())
        for key in ("volume", "area", "inverted"):
            self.assertEqual(len(said[key]), 2)
        self.assertEqual([i["value"] for i in said["isos"]], [6, 3.5])
        same = self.said("compare", "cube.vtk", "cube.vtk")
        self.assertEqual([c["max"] for c in same["channels"]], [0, 0])
        self.assertEqual(same["boundary"]["hausdorff"], 0)

    def test_bounds_that_are_promised(self):
        size = self.sample("gaussians", 16)
        said = self.said("simplify", "gaussians.vtu", "-o", "small.vtu", "--error", "2%")
        channel = said["channels"][0]
        promise = 0.02 * (channel["range"][1] - channel["range"][0])
        print(f"# error {channel['max_error']:.6g} <= {promise:.6g} at {said['tets_out']} of {size} tets")
        self.assertLessEqual(channel["max_error"], promise * (1 + 1e-12))
        self.assertLess(said["tets_out"], size)
        measured = self.said("compare", "gaussians.vtu", "small.vtu")["channels"][0]["max"]
        self.assertLessEqual(measured, promise * (1 + 1e-6))
        absolute = self.said("simplify", "gaussians.vtu", "-o", "small.vtu", "--error", f"{channel['name']}={promise:.17g}")
        self.assertEqual(absolute["tets_out"], said["tets_out"])

    def sample(self, name, size):
        self.good("sample", name, "-o", f"{name}.vtu", "--size", size)
        return self.said("info", f"{name}.vtu")["tets"]

    def test_numbers_that_are_none(self):
        with open("cube.vtk", encoding="ascii") as f:
            text = f.read().replace("default\n0\n1\n", "default\nnan\n1\n")
        with open("nan.vtk", "w", encoding="ascii") as f:
            f.write(text)
        channel = self.said("info", "nan.vtk")["channels"][0]
        self.assertEqual(channel["nonfinite"], 1)
        self.assertEqual(channel["range"], [1, 12])
        self.said("convert", "nan.vtk", "nan.vtu")
        self.said("compare", "nan.vtk", "nan.vtu")
        self.said("simplify", "nan.vtk", "-o", "small.vtu", "--ratio", "0.5")

    def test_names_that_are_no_text(self):
        with open("cube.vtk", "rb") as f:
            text = f.read().replace(b"temperature", b"t\xe9mp\x1b[2J")
        with open("name.vtk", "wb") as f:
            f.write(text)
        done = subprocess.run([PROGRAM, "info", "name.vtk"], capture_output=True, check=False)
        self.assertEqual(done.returncode, 0)
        self.assertNotIn(b"\x1b", done.stdout)
        done = subprocess.run([PROGRAM, "info", "name.vtk", "--json"], capture_output=True, check=True)
        strict(done.stdout.decode("utf-8"))

    def test_quiet(self):
        done = self.good("convert", "cube.vtk", "quiet.vtu", "--quiet")
        self.assertEqual(done.stdout + done.stderr, "")

    def test_raw_holds_for_the_raw_file_alone(self):
        with open("volume.raw", "wb") as f:
            f.write(bytes(range(125)))
        raw = ("--raw", "5,5,5,u8")
        self.assertEqual(self.said("convert", "volume.raw", "volume.vtu", *raw)["tets"], 320)
        self.assertEqual(self.said("compare", "volume.raw", "volume.vtu", *raw)["channels"][0]["max"], 0)


class Files(Case):
    def test_output_is_input(self):
        self.good("convert", "cube.vtk", "mesh.vtu")
        self.good("convert", "mesh.vtu", "mesh.vtu", "--zlib")
        self.assertEqual(self.said("info", "mesh.vtu")["tets"], 320)
        self.good("simplify", "mesh.vtu", "-o", "mesh.vtu", "--ratio", "0.5")
        self.assertLessEqual(self.said("info", "mesh.vtu")["tets"], 160)
        self.assertEqual([n for n in os.listdir(".") if "mesh" in n], ["mesh.vtu"])

    def test_output_over_another_file(self):
        """Under any name: what is made of a file is less than the file."""
        self.good("sample", "gaussians", "-o", "g.vtu", "--size", 8)
        self.good("build", "g.vtu", "-o", "g.tlod")
        os.symlink("g.vtu", "soft.ply")
        os.link("g.tlod", "hard.png")
        os.link("g.tlod", "hard.vtu")
        before = {name: (os.stat(name).st_ino, os.stat(name).st_mtime_ns) for name in ("g.vtu", "g.tlod")}
        for words, name in (("surface g.vtu -o soft.ply --value 1", "g.vtu"), ("points g.vtu -o soft.ply", "g.vtu"),
                            ("lines g.vtu -o ./soft.ply", "g.vtu"), ("extract g.tlod -o hard.vtu --full", "g.tlod"),
                            ("build soft.ply -o g.vtu", "soft.ply"), ("build --add-channel g.tlod hard.vtu", "hard.vtu"),
                            ("probe g.vtu --at 0,0,0 -o ../" + os.path.basename(os.getcwd()) + "/g.vtu", "g.vtu"),
                            ("render g.tlod -o hard.png", "g.tlod"), ("render g.vtu -o hard.png --volume value:g.tlod", "g.tlod"),
                            ("render g.vtu -o p.png --scene g.tlod --write-camera hard.png", "g.tlod"),
                            ("convert cube.vtk g.vtu --solution soft.ply", "soft.ply")):
            with self.subTest(words):
                done = run(*words.split())
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertRegex(done.stderr, f"would be written over '{name}', which is read")
        for words in ("-o s.png --write-scene s.png", "-o s.png --write-camera ./s.png",
                      "-o s.png --write-transfer t.json --write-scene t.json"):
            with self.subTest(words):
                done = run("render", "g.vtu", *words.split())
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertRegex(done.stderr, "would be written twice: --[a-z-]+ needs another name")
        self.assertEqual(before, {name: (os.stat(name).st_ino, os.stat(name).st_mtime_ns) for name in before})
        small = ("render", "g.vtu", "-o", "s.png", "--size", "40x30")
        self.good(*small, "--write-scene", "/dev/null", "--write-camera", "/dev/null")
        self.good(*small, "--write-scene", "s.json", "--write-camera", "c.json")
        self.good(*small, "--scene", "s.json", "--write-scene", "./s.json", "--camera", "c.json", "--write-camera", "c.json")

    def test_same_bytes_on_any_number_of_threads(self):
        self.good("sample", "gaussians", "-o", "g.vtu", "--size", 16)
        for threads in (1, 2, 5):
            self.good("simplify", "g.vtu", "-o", f"small{threads}.vtu", "--ratio", "0.1", "--threads", threads)
            self.assertTrue(filecmp.cmp("small1.vtu", f"small{threads}.vtu", shallow=False), threads)

    def test_options_of_writing(self):
        self.good("sample", "gaussians", "-o", "g.vtu", "--size", 12)
        for name, words in (("plain.vtu", ()), ("zlib.vtu", ("--zlib",)), ("text.vtk", ("--ascii",)), ("plain.vtk", ())):
            self.good("convert", "g.vtu", name, *words)
            self.assertEqual([c["max"] for c in self.said("compare", "g.vtu", name)["channels"]], [0])
        self.assertLess(os.path.getsize("zlib.vtu"), os.path.getsize("plain.vtu"))

    def test_folder_that_is_read_only(self):
        done = run("convert", "cube.vtk", "/proc/out.vtu")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("/proc", done.stderr)
        os.mkdir("locked", 0o555)
        if os.geteuid() == 0:
            # Root may write anywhere, so a copy of the program runs as nobody: the tree itself may lie
            # where nobody can enter, the copy is reached from the folder that the test stands in.
            os.chmod(self.folder, 0o755)
            shutil.copy(PROGRAM, "program")
            done = subprocess.run(["./program", "convert", "cube.vtk", "locked/out.vtu"], user=65534, group=65534,
                                  capture_output=True, text=True, check=False)
        else:
            done = run("convert", "cube.vtk", "locked/out.vtu")
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("Permission denied", done.stderr)

    def test_output_that_is_a_folder(self):
        os.mkdir("folder.vtu")
        done = run("convert", "cube.vtk", "folder.vtu")
        self.assertEqual((done.returncode, done.stderr), (1, "tetralod: can't write 'folder.vtu': it is a folder\n"))

    def test_standard_output_that_is_full(self):
        for words in (("info", "cube.vtk"), ("info", "cube.vtk", "--json"), ("help", "simplify"), ("--version",)):
            with open("/dev/full", "w", encoding="ascii") as full:
                done = subprocess.run([PROGRAM, *words], stdout=full, stderr=subprocess.PIPE, check=False)
            self.assertEqual(done.returncode, 1, words)

    def refuses_to_fill(self, folder, **options):
        """A write that fails half way: status 1, a reason, and nothing left."""
        before = sorted(os.listdir(folder))
        for words in (("convert", "g.vtu", os.path.join(folder, "out.vtu")),
                      ("convert", "g.vtu", os.path.join(folder, "out.vtu"), "--zlib"),
                      ("convert", "g.vtu", os.path.join(folder, "out.vtk"), "--ascii"),
                      ("simplify", "g.vtu", "-o", os.path.join(folder, "out.vtu"), "--ratio", "0.9"),
                      ("sample", "gaussians", "-o", os.path.join(folder, "out.vtu"), "--size", "32")):
            done = run(*words, **options)
            self.assertEqual(done.returncode, 1, f"{words}: {done.stderr}")
            self.assertIn("out.vt", done.stderr)
            self.assertEqual(sorted(os.listdir(folder)), before, words)

    def test_file_that_may_not_grow(self):
        self.good("sample", "gaussians", "-o", "g.vtu", "--size", 32)

        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (100000, 100000))
        self.refuses_to_fill(".", preexec_fn=limit)

    def test_disk_that_is_full(self):
        self.good("sample", "gaussians", "-o", "g.vtu", "--size", 32)
        os.mkdir("disk")
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", "disk"], capture_output=True, check=False)
        if mounted.returncode:
            self.skipTest("a tmpfs can't be mounted here")
        try:
            self.refuses_to_fill("disk")
        finally:
            subprocess.run(["umount", "disk"], check=True)


class Interrupts(Case):
    def interrupted(self, words, number, count=1):
        """Sends a signal while the program works; returns status and stderr. What a run wrote that was
        done before the signal is taken away."""
        before = set(os.listdir("."))
        for patience in PATIENCE:
            child = subprocess.Popen([PROGRAM, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            time.sleep(patience)
            for _ in range(count):
                child.send_signal(number)
            _, err = child.communicate(timeout=60)
            if child.returncode != 0:
                return child.returncode, err
            for name in set(os.listdir(".")) - before:
                os.remove(name)
        self.fail(f"{words} was always done before the signal")

    def test_ctrl_c(self):
        self.good("sample", "gaussians", "-o", "g.vtu", "--size", 56)
        before = sorted(os.listdir("."))
        for words in (("simplify", "g.vtu", "-o", "out.vtu", "--ratio", "0.05"), ("convert", "g.vtu", "out.vtk", "--ascii"),
                      ("convert", "g.vtu", "out.vtu", "--zlib"), ("sample", "gaussians", "-o", "out.vtu", "--size", "150"),
                      ("compare", "g.vtu", "g.vtu")):
            for number in (signal.SIGINT, signal.SIGTERM):
                status, err = self.interrupted(words, number)
                self.assertEqual((status, err.splitlines()[-1:]), (1, ["tetralod: stopped on request; nothing was written"]), words)
                self.assertEqual(sorted(os.listdir(".")), before, words)

    def test_ctrl_c_between_frames(self):
        """Frames that are there are whole, and are counted."""
        self.good("sample", "gaussians", "-o", "g.vtu", "--size", 20)
        words = ("render", "g.vtu", "-o", "frame%d.png", "--frames", "3000", "--orbit", "90", "--size", "300x200")
        with subprocess.Popen([PROGRAM, *words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as child:
            while not os.path.exists("frame1.png") and child.poll() is None:
                time.sleep(0.01)
            child.send_signal(signal.SIGINT)
            _, err = child.communicate(timeout=60)
        self.assertEqual(child.returncode, 1)
        frames = [name for name in os.listdir(".") if name.startswith("frame")]
        self.assertEqual(err.splitlines()[-1], f"tetralod: stopped on request; written, and complete: {len(frames)}")
        for name in frames:
            with open(name, "rb") as f:
                self.assertEqual(f.read()[-8:-4], b"IEND")

    def test_second_ctrl_c_ends_at_once(self):
        self.good("sample", "gaussians", "-o", "g.vtu", "--size", 56)
        status, _ = self.interrupted(("simplify", "g.vtu", "-o", "out.vtu", "--ratio", "0.05"), signal.SIGINT, 2)
        self.assertIn(status, (1, -signal.SIGINT))
        self.assertFalse(os.path.exists("out.vtu"))

    def test_progress_is_for_terminals(self):
        words = ("sample", "gaussians", "-o", "g.vtu", "--size", "150")
        self.assertNotIn("\r", self.good(*words).stderr)
        try:
            ours, theirs = pty.openpty()
        except OSError as error:
            self.skipTest(f"this machine has no pseudo terminals: {error}")
        child = subprocess.Popen([PROGRAM, *words], stdout=subprocess.DEVNULL, stderr=theirs)
        os.close(theirs)
        seen = b""
        try:
            while True:
                seen += os.read(ours, 4096)
        except OSError:
            pass  # the other end is closed
        os.close(ours)
        self.assertEqual(child.wait(), 0)
        self.assertRegex(seen.decode(), r"\[#*\.*\] +\d+ %")
        self.assertTrue(seen.endswith(b"\r\x1b[K"), seen[-40:])


class Benches(Case):
    def test_mesh(self):
        said = self.said("bench", "mesh", "--sample", "gaussians", "--size", 10, "--runs", 1)
        self.assertTrue(all(row["verified"] for row in said["rows"]), said["rows"])
        self.assertIn("boundary", {row["operation"] for row in said["rows"]})
        self.assertIn("verified", self.good("bench", "mesh", "--data", "cube.vtk", "--runs", 1).stdout)

    def test_segment(self):
        said = self.said("bench", "segment", "--sample", "gaussians", "--size", 30, "--runs", 1)
        self.assertEqual(said["broken"], 0, said["rows"])
        self.assertEqual({row["tets"] for row in said["rows"]}, {5 * 29 ** 3})
        self.assertIn("stream holds", self.good("bench", "segment", "--data", "cube.vtk", "--runs", 1).stdout)

    def test_codec(self):
        said = self.said("bench", "codec", "--sample", "gaussians", "--size", 16, "--runs", 1)
        self.assertEqual([row["patch_tets"] for row in said["rows"]], [2000, 4000, 8000, 16000])
        for row in said["rows"]:
            self.assertLess(row["connectivity_bits"], 1.5, row)
            self.assertLess(row["bytes_per_tet"], 2, row)
        self.assertIn("connectivity", self.good("bench", "codec", "--data", "cube.vtk", "--runs", 1).stdout)

    def test_simplify(self):
        said = self.said("bench", "simplify", "--sample", "gaussians", "--size", 12, "--runs", 1)
        self.assertEqual(said["broken"], 0, said["rows"])
        self.assertEqual({row["by"] for row in said["rows"]}, {"tetralod"})
        self.assertEqual({"hash", "seconds_median", "seconds_least", "rms_percent", "max_percent", "peak_bytes"} -
                         set(said["rows"][0]), set())

    def test_against_vtk(self):
        if subprocess.run([PYTHON, "-c", "import vtk"], capture_output=True, check=False).returncode:
            self.skipTest("python3-vtk9 is not installed")
        said = self.said("bench", "simplify", "--sample", "gaussians", "--size", 12, "--runs", 1, "--against-vtk")
        self.assertIn("VTK", {row["by"] for row in said["rows"]})
        self.assertIn("as fast as VTK", self.good("bench", "simplify", "--data", "cube.vtk", "--runs", 1, "--against-vtk").stdout)
        said = self.said("bench", "mesh", "--sample", "gaussians", "--size", 10, "--runs", 1, "--against-vtk")
        self.assertEqual(len([row for row in said["rows"] if row["vtk_seconds"]]), 2 * len({row["threads"] for row in said["rows"]}))

    def test_script_that_is_missing(self):
        done = run("bench", "mesh", "--data", "cube.vtk", "--runs", 1, "--against-vtk", "--script", "nothing.py")
        self.assertEqual(done.returncode, 1)
        self.assertIn("the peer script 'nothing.py' failed", done.stderr)


class RealData(Case):
    @unittest.skipUnless(DATA, "no folder of real data: neither TETRALOD_DATA nor ../shared/data")
    def test_plot3d_with_its_solution(self):
        grid, solution = (os.path.join(DATA, "curvilinear", n) for n in ("bluntfinxyz.bin", "bluntfinq.bin"))
        said = self.said("info", grid, "--solution", solution)
        self.assertEqual((said["vertices"], said["tets"]), (40960, 187395))
        self.good("convert", grid, "fin.vtu", "--solution", solution)
        same = self.said("compare", grid, "fin.vtu", "--solution", solution, "--skip-boundary")
        self.assertEqual({c["max"] for c in same["channels"]}, {0})
        self.assertIsNone(same["boundary"]["mean"])


if __name__ == "__main__":
    unittest.main()
