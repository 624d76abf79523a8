"""Models on the command line: what info says of one, and what check finds in damaged ones."""

import json
import os
import resource
import shutil
import subprocess
import tempfile
import unittest

PROGRAM = os.environ["TETRALOD_PROGRAM"]
GOLDEN = os.path.join(os.environ["TETRALOD_SOURCE"], "tests", "golden", "store_v1.tlod")


def run(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False, timeout=60)


class Models(unittest.TestCase):
    def setUp(self):
        folder = tempfile.mkdtemp(prefix="tetralod-cli-")
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        self.path = os.path.join(folder, "m.tlod")
        shutil.copy(GOLDEN, self.path)
        with open(self.path, "rb") as f:
            self.data = f.read()

    def write(self, data):
        with open(self.path, "wb") as f:
            f.write(data)

    def test_info_for_machines(self):
        done = run("info", self.path, "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        said = json.loads(done.stdout)
        self.assertEqual([said[k] for k in ("vertices", "tets", "tets_stored", "segments", "patches", "region_count")], [5, 2, 3, 1, 3, 1])
        self.assertEqual(said["cells"], {"tetra": 2})
        self.assertEqual(said["bounds"], [-1, 1, 0, 2, 0, 2])
        self.assertEqual(said["regions"], [{"id": 7, "tets": 2, "name": "steel"}])
        self.assertEqual([(c["name"], c["unit"], c["on"], c["range"]) for c in said["channels"]], [("heat", "K", "vertex", [0, 1.5625])])
        self.assertEqual([(v["tets"], v["segments"], v["patches"]) for v in said["levels"]], [(2, 1, 2), (1, 0, 1)])
        self.assertEqual(said["levels"][1]["error"], [{"channel": "heat", "error": 0.046875}])
        self.assertEqual(said["bytes_per_input_tet"], len(self.data) / 2)
        self.assertEqual({k: said["bits_per_tet"][k] for k in ("connectivity", "positions", "channels")},
                         {"connectivity": 8, "positions": 384, "channels": 8 * 54 / 3})
        self.assertEqual(said["border_share"], 0.6)

    def test_info_details(self):
        """What only the whole index tells: one segment that takes up two leaves and hands on one root."""
        done = run("info", self.path, "--json", "--details")
        self.assertEqual(done.returncode, 0, done.stderr)
        said = json.loads(done.stdout)
        view = {"tets": 2, "patches": 2, "segments": 1}
        self.assertEqual(said["full_detail_at_a_point"], {"mean": view, "worst": view})
        self.assertEqual([set(level["error"][0]) for level in said["levels"]], [{"channel", "error", "rms"}] * 2)
        self.assertLessEqual(said["levels"][1]["error"][0]["rms"], 0.046875)
        done = run("info", self.path, "--details")
        self.assertNotIn("nan", done.stdout)
        for line in done.stdout.splitlines()[:6]: # what a model does not know it does not say
            self.assertNotIn(" - ", line)
        self.assertIn("full detail at one point draws 2 tets in 2 patches, 2 in 2 at most", done.stdout)

    def test_info_for_people(self):
        done = run("info", self.path)
        self.assertEqual(done.returncode, 0, done.stderr)
        for words in ("a model of 2 tets, 5 vertices", "levels: 2, segments: 1, patches: 3 (roots: 1), tets stored: 3", "7 'steel' (2 tets)", "heat"):
            self.assertIn(words, done.stdout)

    def test_file_size_limit(self):
        """A file that may not grow is an error with a message, and leaves nothing."""
        folder = os.path.dirname(self.path)
        flow, model = os.path.join(folder, "g.vtu"), os.path.join(folder, "out.tlod")
        self.assertEqual(run("sample", "gaussians", "-o", flow, "--size", "16").returncode, 0)
        before = sorted(os.listdir(folder))
        done = subprocess.run([PROGRAM, "build", flow, "-o", model, "--tmp", folder], capture_output=True, text=True, check=False, timeout=60,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)))
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("File too large", done.stderr)
        self.assertEqual(sorted(os.listdir(folder)), before)

    def test_check(self):
        for words in (("check", self.path), ("check", self.path, "--fast")):
            done = run(*words)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("patches: 3", done.stdout)
        said = json.loads(run("check", self.path, "--json").stdout)
        self.assertTrue(said["ok"])
        self.assertEqual(said["patches"], 3)

    def test_check_finds_damage(self):
        for place in (9, 40, 600, len(self.data) // 2, len(self.data) - 1):
            changed = bytearray(self.data)
            changed[place] ^= 4
            self.write(changed)
            done = run("check", self.path, "--json")
            self.assertEqual(done.returncode, 1, place)
            self.assertIn("m.tlod", done.stderr)
            said = json.loads(done.stdout)
            self.assertFalse(said["ok"])
            self.assertIn("m.tlod", said["message"])
        for data in (b"", self.data[:100], self.data[:-1], self.data + b"\0"):
            self.write(data)
            self.assertEqual(run("check", self.path).returncode, 1, len(data))

    def test_info_refuses_what_is_cut_short(self):
        self.write(self.data[:-8])
        done = run("info", self.path)
        self.assertEqual(done.returncode, 1)
        self.assertIn("1384 bytes where its head says 1392", done.stderr)

    def test_newer_versions_are_refused_by_name(self):
        self.write(self.data[:8] + b"\x02" + self.data[9:])
        for verb in ("info", "check"):
            done = run(verb, self.path)
            self.assertEqual(done.returncode, 1)
            self.assertIn("format version 2; this library reads version 1", done.stderr)

    def test_wrong_use(self):
        self.assertEqual(run("check").returncode, 2)
        self.assertEqual(run("check", os.path.join(self.path, "nothing")).returncode, 1)


if __name__ == "__main__":
    unittest.main()
