"""What `cmake --install` leaves: it can be moved, built against in four ways, and exports what the
headers declare and nothing else."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest

import house_rules as rules

ROOT = os.environ["TETRALOD_SOURCE"]
BUILD = os.environ["TETRALOD_BUILD"]
CONSUMER = os.path.join(ROOT, "tests", "install")
CELLS = 4 * 4 * 4  # of the sample that the consumer writes


def call(*command, **options):
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if done.returncode:
        raise AssertionError(f"{' '.join(command)}\nended with {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def declared():
    """Names of the functions that the public headers mark with TL_API."""
    names = set()
    for path in rules.files(ROOT, "include"):
        for declaration in re.findall(r"^TL_API\b([^;{]*)", rules.code_of(ROOT, path), re.M):
            names.add(re.search(r"(\w+)\s*\(", declaration)[1])
    return names


def mutable_globals(path):
    """Variables in sections that can be written; tables of pointers lie in .data.rel.ro and are constant."""
    found = []
    for line in call("objdump", "-t", path).splitlines():
        m = re.match(r"[0-9a-f]+ .{7} (\.data|\.bss|\.tdata|\.tbss|\*COM\*)(\.\S+)?\t[0-9a-f]+ +(?:\.hidden )?(\S+)$", line)
        if m and not m[3].startswith(".") and not (m[2] or "").startswith(".rel.ro"):
            found.append(f"{m[3]} in {m[1]}")
    return found


class Symbols(unittest.TestCase):
    def test_the_shared_library_exports_what_the_headers_declare(self):
        lines = call("nm", "-D", "--defined-only", os.path.join(BUILD, "libtetralod.so")).splitlines()
        exported = {line.split()[-1] for line in lines}
        self.assertGreater(len(declared()), 50)
        self.assertEqual([], sorted(declared() - exported), "declared and not exported")
        self.assertEqual([], sorted(exported - declared()), "exported and not declared")

    def test_the_soname_holds_the_major_version(self):
        out = call("readelf", "-d", os.path.join(BUILD, "libtetralod.so"))
        self.assertIn("[libtetralod.so.0]", out)

    def test_names_in_the_static_library_have_our_prefix(self):
        lines = call("nm", "-g", "--defined-only", os.path.join(BUILD, "libtetralod.a")).splitlines()
        names = {line.split()[2] for line in lines if len(line.split()) == 3}
        self.assertEqual([], sorted(n for n in names if not n.startswith(("tl_", "tli_"))))

    def test_no_mutable_globals(self):
        # The locks stand for what the whole process shares: rand(), which METIS uses, and HDF5's state.
        allowed = {"rand_lock in .bss", "hdf5_lock in .bss"}
        self.assertEqual([], sorted(set(mutable_globals(os.path.join(BUILD, "libtetralod.a"))) - allowed))

    def test_mutable_globals_are_found(self):
        code = ("static int seed = 1;\nstatic const char *const names[] = {\"a\", 0};\n"
                "const char *name(int i)\n{\n    static int calls;\n    calls += seed++;\n    return names[i + calls];\n}\n")
        with tempfile.TemporaryDirectory() as folder:
            call("cc", "-c", "-fPIC", "-x", "c", "-", "-o", "a.o", cwd=folder, input=code)
            found = mutable_globals(os.path.join(folder, "a.o"))
        self.assertEqual(["seed in .data", "calls.0 in .bss"], found)


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        first = os.path.join(cls.folder, "first")
        cls.prefix = os.path.join(cls.folder, "second place")  # moved, and with a blank in its name
        call("cmake", "--install", BUILD, "--prefix", first)
        os.rename(first, cls.prefix)
        cls.lib = os.path.dirname(next(os.path.join(p, "libtetralod.a") for p, _, n in os.walk(cls.prefix) if "libtetralod.a" in n))

    def works(self, program, shared):
        environment = dict(os.environ)
        environment.pop("LD_LIBRARY_PATH", None)
        needed = "libtetralod.so.0" in call("readelf", "-d", program)
        self.assertEqual(shared, needed, "linked to the other library")
        if shared:
            environment["LD_LIBRARY_PATH"] = self.lib
        out = call(program, os.path.join(self.folder, "sample.vtu"), env=environment)
        self.assertRegex(out, rf"^version \d+, {5 * CELLS} tets$")

    def by_cmake(self, component, *options):
        build = tempfile.mkdtemp(dir=self.folder)
        call("cmake", "-S", CONSUMER, "-B", build, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={self.prefix}",
             f"-DCOMPONENT={component}", *options)
        call("cmake", "--build", build)
        return os.path.join(build, "consumer")

    def test_cmake_chooses_the_shared_library(self):
        self.works(self.by_cmake(""), True)

    def test_cmake_static(self):
        self.works(self.by_cmake("static"), False)

    def test_cmake_refuses_an_unknown_component(self):
        with self.assertRaisesRegex(AssertionError, "nonsense"):
            self.by_cmake("nonsense")

    def pkg_config(self, *options):
        environment = dict(os.environ, PKG_CONFIG_PATH=os.path.join(self.lib, "pkgconfig"))
        words = call("pkg-config", *options, "tetralod", env=environment)
        return [w.replace("\\ ", " ") for w in re.findall(r"(?:\\.|\S)+", words)]

    def by_pkg_config(self, flags):
        program = os.path.join(tempfile.mkdtemp(dir=self.folder), "consumer")
        call("cc", "-std=c17", os.path.join(CONSUMER, "install_consumer.c"), "-o", program, *flags)
        return program

    def test_pkg_config_shared(self):
        self.works(self.by_pkg_config(self.pkg_config("--cflags", "--libs")), True)

    def test_pkg_config_static(self):
        flags = self.pkg_config("--static", "--cflags", "--libs")
        archive = os.path.join(self.lib, "libtetralod.a")
        self.works(self.by_pkg_config([archive if f == "-ltetralod" else f for f in flags]), False)

    def test_pkg_config_knows_the_version(self):
        number = int(re.search(r"#define TL_VERSION (\d+)", rules.text_of(ROOT, "include/tetralod/base.h"))[1])
        self.assertEqual([f"{number // 10000}.{number // 100 % 100}.{number % 100}"], self.pkg_config("--modversion"))

    def test_every_public_header_is_installed(self):
        self.assertEqual(sorted(os.listdir(os.path.join(ROOT, "include", "tetralod"))),
                         sorted(os.listdir(os.path.join(self.prefix, "include", "tetralod"))))

    def test_the_program_runs_from_where_it_lies(self):
        out = call(os.path.join(self.prefix, "bin", "tetralod"), "help")
        self.assertIn("simplify", out)

    def test_the_script_of_the_peer_is_there(self):
        scripts = [n for n in os.listdir(os.path.join(ROOT, "bench")) if n.endswith(".py")]
        share = os.path.join(self.prefix, "share", "tetralod")
        self.assertGreater(len(scripts), 0)
        self.assertEqual(sorted(scripts), sorted(os.listdir(share)) if os.path.isdir(share) else [])


if __name__ == "__main__":
    unittest.main()
