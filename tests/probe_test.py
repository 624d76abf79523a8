"""tetralod probe: values at points and along lines, integrals, statistics; of files and models; wrong use."""

import csv
import json
import math
import os
import shutil
import subprocess
import tempfile
import unittest

PROGRAM = os.environ["TETRALOD_PROGRAM"]


def run(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False, timeout=120)


class Probe(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tetralod-probe-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.grid, cls.model = os.path.join(cls.folder, "g.vtu"), os.path.join(cls.folder, "g.tlod")
        assert run("sample", "gaussians", "-o", cls.grid, "--size", "20").returncode == 0
        assert run("build", cls.grid, "-o", cls.model, "-q").returncode == 0

    def table(self, *words, source=None):
        """Rows as dictionaries, from stdout and from a file, which must be equal."""
        done = run("probe", source or self.grid, *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        path = os.path.join(self.folder, "out.csv")
        filed = run("probe", source or self.grid, *words, "-o", path)
        self.assertEqual(filed.returncode, 0, filed.stderr)
        with open(path, encoding="utf-8", newline="") as f:
            self.assertEqual(f.read(), done.stdout)
        self.assertFalse(os.path.exists(path + ".part"))
        return list(csv.DictReader(done.stdout.splitlines()))

    def test_points(self):
        """What is linear is exact anywhere; outside there is nothing."""
        rows = self.table("--derive", "f=2*x-3*y+z/2+1", "--derive", "u=vec(x,y,z)", "--at", "0.123,-0.456,0.789", "--at", "5,0,0",
                          "--at=-1,-1,-1")
        self.assertEqual(len(rows), 3)
        self.assertLess(abs(float(rows[0]["f"]) - (2 * 0.123 + 3 * 0.456 + 0.789 / 2 + 1)), 1e-12)
        self.assertLess(abs(float(rows[0]["u_z"]) - 0.789), 1e-13)
        self.assertEqual((rows[1]["f"], rows[1]["tet"], rows[1]["x"]), ("", "", "5"))
        self.assertLess(abs(float(rows[2]["f"]) - 1.5), 1e-12)

    def test_many_components(self):
        """Every component is there, however many."""
        rows = self.table("--derive", "v=vec(" + ",".join("x+%d" % i for i in range(70)) + ")", "--channels", "v", "--at", "0.25,0,0")
        for i in range(70):
            self.assertLess(abs(float(rows[0]["v_%d" % i]) - 0.25 - i), 1e-12)

    def test_along(self):
        rows = self.table("--derive", "f=x+y", "--along=-2,0,0,2,1,0,5", "--channels", "f")
        self.assertEqual(len(rows), 5)
        self.assertEqual([r["f"] == "" for r in rows], [True, False, False, False, True])
        self.assertLess(abs(float(rows[4]["distance"]) - math.sqrt(17)), 1e-12)
        self.assertLess(abs(float(rows[3]["f"]) - 1.75), 1e-12)
        self.assertNotIn("value", rows[0])

    def test_integral(self):
        rows = self.table("--derive", "f=x+2", "--integral", "--channels", "f")
        self.assertLess(abs(float(rows[0]["volume"]) - 8), 1e-12)
        self.assertLess(abs(float(rows[0]["integral"]) - 16), 1e-11)
        self.assertLess(abs(float(rows[0]["mean"]) - 2), 1e-12)

    def test_statistics(self):
        rows = {r["channel"]: r for r in self.table("--derive", "u=vec(x,1,0)", "--statistics")}
        self.assertEqual(set(rows), {"value", "u_x", "u_y", "u_z", "u_length"})
        self.assertLess(abs(float(rows["u_x"]["deviation"]) - 2 / math.sqrt(12)), 1e-12)
        self.assertLess(abs(float(rows["u_x"]["p95"]) - 0.9), 2e-6)
        self.assertEqual(float(rows["u_y"]["p5"]), 1)
        self.assertEqual(float(rows["value"]["within"]), 0)

    def test_model_within_its_promise(self):
        """Values of a coarse mesh lie within what is promised beside them, at original vertices."""
        at = ["--at=0,0,0", f"--at={-1 + 4 / 19},{-1 + 6 / 19},{-1 + 20 / 19}"]
        fine = self.table(*at)
        for words in ([], ["--error", "2%"]):
            coarse = self.table(*at, *words, source=self.model)
            within = float(coarse[1]["value_within"])
            self.assertLessEqual(abs(float(coarse[1]["value"]) - float(fine[1]["value"])), within + 1e-12)
        self.assertGreater(within, 0)

    def test_json(self):
        said = json.loads(run("probe", self.grid, "--statistics", "--json").stdout)
        self.assertEqual(said["statistics"][0]["channel"], "value")
        said = json.loads(run("probe", self.grid, "--along=-2,0,0,2,0,0", "--json").stdout)
        self.assertEqual(said["points"], 201)
        self.assertEqual(said["inside"], 101)

    def test_wrong_use(self):
        for status, words, text in ((2, [], "say one of"), (2, ["--at", "1,2"], "expected X,Y,Z"),
                                    (2, ["--at", "1,2,3", "--integral"], "say one of"),
                                    (2, ["--along", "1,2,3"], "expected X0"), (2, ["--along", "0,0,0,1,1,1,1"], "2 to"),
                                    (2, ["--integral", "--channels", "heat"], "'value'"),
                                    (1, ["--integral", "-o", "no/such/folder.csv"], "can't write")):
            with self.subTest(words):
                done = run("probe", self.grid, *words)
                self.assertEqual(done.returncode, status, done.stderr)
                self.assertIn(text, done.stderr)


if __name__ == "__main__":
    unittest.main()
