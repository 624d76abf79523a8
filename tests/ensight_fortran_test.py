"""A real EnSight case in C binary, put into records of Fortran: read as the same data set; damaged records."""

import json
import os
import random
import shutil
import struct
import subprocess
import tempfile
import unittest

PROGRAM = os.environ["TETRALOD_PROGRAM"]
DATA = os.path.join(os.environ.get("TETRALOD_DATA", "/nowhere"), "ensight")
FILES = ("test_bin.geo", "test_bin.pressure.0001", "test_bin.velocity.0001", "test_bin.extr_velocity.0001", "test_bin.extr_pressure.0001")


def run(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False, timeout=60)


def records(data, order, seed):
    """The head in a record, the rest in records of any length: what they hold together is what counts."""
    draw, parts, at = random.Random(seed), [data[:80]], 80
    while at < len(data):
        count = 4 * draw.randint(1, 500)
        parts.append(data[at:at + count])
        at += count
    return b"".join(struct.pack(order + "I", len(p)) + p + struct.pack(order + "I", len(p)) for p in parts)


@unittest.skipUnless(os.path.isdir(DATA), "TETRALOD_DATA names no folder with EnSight cases")
class Fortran(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="tetralod-ensight-")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        shutil.copy(os.path.join(DATA, "TEST_bin.case"), self.folder)

    def write(self, order):
        for seed, name in enumerate(FILES):
            with open(os.path.join(DATA, name), "rb") as f:
                data = f.read()
            if name.endswith(".geo"):
                data = b"Fortran Binary".ljust(80) + data[80:]
            with open(os.path.join(self.folder, name), "wb") as f:
                f.write(records(data, order, seed))

    def info(self, folder):
        done = run("info", os.path.join(folder, "TEST_bin.case"), "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        said = json.loads(done.stdout)
        return {key: said[key] for key in ("vertices", "tets", "cells", "bounds", "channels", "volume")}

    def test_same_as_c_binary(self):
        for order in "<>":
            with self.subTest(order):
                self.write(order)
                self.assertEqual(self.info(self.folder), self.info(DATA))

    def test_damaged_records(self):
        self.write("<")
        path = os.path.join(self.folder, "test_bin.geo")
        with open(path, "rb") as f:
            data = f.read()
        for damaged in (data[:-1], data[:200], data[:90] + b"\xff\xff\xff\x7f" + data[94:], data + b"\0"):
            with open(path, "wb") as f:
                f.write(damaged)
            done = run("info", os.path.join(self.folder, "TEST_bin.case"))
            self.assertEqual(done.returncode, 1, done.stdout)
            self.assertIn("test_bin.geo", done.stderr)


if __name__ == "__main__":
    unittest.main()
