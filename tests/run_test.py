"""./run installs what is missing and nothing else, says what it can't do, and counts failures.
The machine is played by small scripts that come first on the PATH and write down how they are called."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest

ROOT = os.environ.get("TETRALOD_SOURCE") or os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

DPKG_QUERY = """for name; do :; done
case " $MISSING " in *" $name "*) exit 1 ;; esac
printf installed
"""
SUDO = '[ "$1" = -n ] && shift\nexec "$@"\n'
NOTED = 'echo "${0##*/} $* ($DEBIAN_FRONTEND)" >> "$CALLS"\n'


class Run(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(dir="/tmp")  # the test's own folder is closed to nobody
        self.addCleanup(folder.cleanup)
        self.tree = os.path.join(folder.name, "tree")
        self.bin = os.path.join(folder.name, "bin")
        self.calls = os.path.join(folder.name, "calls")
        os.makedirs(self.tree)
        os.makedirs(self.bin)
        for name in "run", "packages.txt":
            shutil.copy(os.path.join(ROOT, name), self.tree)
        self.program("dpkg-query", DPKG_QUERY)
        self.program("sudo", SUDO)
        self.program("apt-get", NOTED)
        self.program("cmake", NOTED + 'case "$1" in --preset) mkdir -p build/$2; touch build/$2/build.ninja build/$2/CMakeCache.txt ;; esac\n')

    def program(self, name, text):
        path = os.path.join(self.bin, name)
        with open(path, "w", encoding="utf-8") as f:
            f.write("#!/bin/sh\n" + text)
        os.chmod(path, 0o755)

    def run_it(self, *words, missing=(), as_nobody=False):
        if os.path.exists(self.calls):
            os.remove(self.calls)
        environment = dict(os.environ, PATH=self.bin + ":" + os.environ["PATH"], CALLS=self.calls, MISSING=" ".join(missing))
        command = [os.path.join(self.tree, "run"), *words]
        if as_nobody and os.geteuid() == 0:
            command = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"] + command
        done = subprocess.run(command, env=environment, capture_output=True,
                              stdin=subprocess.DEVNULL, text=True, check=False)
        calls = []
        if os.path.exists(self.calls):
            with open(self.calls, encoding="utf-8") as f:
                calls = f.read().splitlines()
        return done, calls

    def test_targets_are_there_without_tests(self):
        with open(os.path.join(ROOT, "run"), encoding="utf-8") as f:
            named = {target for targets in re.findall(r"\bbuild release +([a-z_ ]+)", f.read()) for target in targets.split()}
        self.assertIn("tetralod_programs", named)
        tree = os.path.join(self.tree, "none")
        subprocess.run(["cmake", "-S", ROOT, "-B", tree, "-G", "Ninja", "-DTETRALOD_TESTS=OFF"], check=True, capture_output=True)
        done = subprocess.run(["ninja", "-C", tree, "-n", *sorted(named)], check=False, capture_output=True, text=True)
        self.assertEqual(0, done.returncode, done.stdout)

    def test_nothing_missing_calls_no_apt(self):
        done, calls = self.run_it("build")
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual([], [c for c in calls if c.startswith("apt-get")])
        self.assertIn("--preset release -DTETRALOD_TESTS=OFF", calls[0])

    def test_a_second_run_configures_nothing(self):
        self.run_it("build")
        _, calls = self.run_it("build")
        self.assertEqual(1, len(calls), calls)
        self.assertIn("cmake --build build/release", calls[0])

    def test_what_is_missing_is_installed(self):
        done, calls = self.run_it("build", missing=["ninja-build", "zlib1g-dev", "valgrind"])
        self.assertEqual(0, done.returncode, done.stderr)
        update, install = [c for c in calls if c.startswith("apt-get")]
        self.assertTrue(update.endswith(" update (noninteractive)"), update)
        self.assertIn("DPkg::Lock::Timeout=600", install)
        # valgrind is not for this verb
        self.assertTrue(install.endswith(" install --no-install-recommends ninja-build zlib1g-dev (noninteractive)"), install)

    def test_an_installation_that_fails_ends_it(self):
        self.program("apt-get", NOTED + 'echo "E: no network" >&2; [ "$9" != install ]; exit 100\n')
        done, calls = self.run_it("build", missing=["ninja-build"])
        self.assertEqual(1, done.returncode)
        self.assertIn("E: no network", done.stderr)
        self.assertIn("Wanted: ninja-build", done.stderr)
        self.assertEqual([], [c for c in calls if c.startswith("cmake")])

    def test_sudo_that_asks_for_a_password_ends_it(self):
        self.program("sudo", "exit 1\n")
        os.chmod(os.path.dirname(self.tree), 0o755)
        done, calls = self.run_it("build", missing=["ninja-build"], as_nobody=True)
        self.assertEqual((1, []), (done.returncode, calls))
        self.assertIn("apt-get install --no-install-recommends ninja-build", done.stderr)

    def test_words_that_are_no_verb(self):
        done, _ = self.run_it("tset")
        self.assertEqual(2, done.returncode)
        self.assertIn("there is no 'tset'", done.stderr)
        self.assertEqual(0, self.run_it("help")[0].returncode)
        self.assertEqual(1, self.run_it("fuzz", "soon")[0].returncode)

    def test_packages_are_listed_once_with_a_use(self):
        with open(os.path.join(ROOT, "packages.txt"), encoding="utf-8") as f:
            rows = [line.split("#")[0].split() for line in f]
        rows = [row for row in rows if row]
        self.assertEqual([], [row for row in rows if len(row) != 2 or row[1] not in ("build", "test", "long")])
        self.assertEqual(len(rows), len({row[0] for row in rows}))


if __name__ == "__main__":
    unittest.main()
