"""Meshes out of a model on the command line: by error, budget, view, isovalue and colour map, into every format, and what is said of
words and files that make no sense."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest

PROGRAM = os.environ["TETRALOD_PROGRAM"]
CAMERA = {"position": [4, 3, 2.5], "focal_point": [0, 0, 0], "view_up": [0, 0, 1], "view_angle": 30, "size": [800, 600]}
# ParaView's own files end lists with a comma here and there
MAP = """[
 { "ColorSpace": "Diverging", "Name": "cold, ] to \\"warm\\",}",
   "Points": [ %s, ],
   "RGBPoints": [0, 0, 0, 0, 2, 1, 1, 1,],
 },
]
"""


def run(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False, timeout=120)


class Extract(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tetralod-cli-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.model = cls.path("m.tlod")
        for done in (run("sample", "gaussians", "-o", cls.path("g.vtu"), "--size", "24"),
                     run("build", cls.path("g.vtu"), "-o", cls.model, "--segment-tets", "6000", "--patch-tets", "800")):
            assert done.returncode == 0, done.stderr

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as f:
            f.write(text if isinstance(text, str) else json.dumps(text))
        return self.path(name)

    def extract(self, *words, name="o.vtu"):
        done = run("extract", self.model, "-o", self.path(name), "--json", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def check_fails(self, status, said, *words):
        done = run("extract", self.model, "-o", self.path("none.vtu"), *words)
        self.assertEqual(done.returncode, status, done.stderr)
        for part in said:
            self.assertIn(part, done.stderr)
        self.assertFalse(os.path.exists(self.path("none.vtu")))

    def test_keys(self):
        said = self.extract("--error", "value=5%")
        for key in ("tets", "vertices", "patches", "bounds_promised", "boundary_error", "seconds", "space_error", "bounds_kept"):
            self.assertIn(key, said)
        self.assertNotIn("pixels", said)
        self.assertEqual(said["bounds_promised"][0]["channel"], "value")
        self.assertTrue(said["bounds_kept"])
        read = json.loads(run("info", self.path("o.vtu"), "--json").stdout)
        self.assertEqual((read["tets"], read["vertices"]), (said["tets"], said["vertices"]))
        width = read["channels"][0]["range"][1] - read["channels"][0]["range"][0]
        self.assertLessEqual(said["bounds_promised"][0]["error"], 0.0501 * width)

    def test_every_format(self):
        tets = [self.extract("--tets", "9000", name="o" + end)["tets"]
                for end in (".vtu", ".vtk", ".msh", ".mesh", ".node")]
        self.assertEqual(len(set(tets)), 1)
        self.assertTrue(0 < tets[0] <= 9000)
        for end in (".vtu", ".vtk", ".msh", ".mesh", ".node"):
            self.assertEqual(json.loads(run("info", self.path("o" + end), "--json").stdout)["tets"], tets[0], end)
        self.check_fails(2, ["none.xyz"], "-o", self.path("none.xyz"), "--full")

    def test_bytes(self):
        full, less = self.extract("--full"), self.extract("--bytes", "40K")
        self.assertLess(less["tets"], full["tets"])
        self.assertTrue(less["bounds_kept"])
        both = self.extract("--bytes", "40K", "--error", "0.001%")
        self.assertFalse(both["bounds_kept"])

    def test_isovalues(self):
        near, far = (self.extract("--iso", "value=0.9", "--space-error", e) for e in ("0.3%", "3%"))
        self.assertGreater(near["tets"], far["tets"])
        self.assertLessEqual(far["space_error"], 0.03 * 3.4642)
        self.assertEqual(self.extract("--iso", "0.9", "--space-error", "3%")["tets"], far["tets"])
        every = self.extract("--space-error", "3%")
        self.assertGreaterEqual(every["tets"], far["tets"])

    def test_colour_maps(self):
        none = self.write("none.json", MAP % "0, 0, 0.5, 0, 2, 0, 0.5, 0")
        some = self.write("some.json", MAP % "0, 0, 0.5, 0, 0.8, 0, 0.5, 0, 0.9, 1, 0.5, 0, 1.0, 0, 0.5, 0")
        full = self.write("full.json", '{"RGBPoints": [0, 1, 1, 1]}')
        tets = [self.extract("--transfer", "value=" + path, "--classified-error", "20%")["tets"] for path in (none, some, full)]
        coarsest = self.extract("--error", "1000%")["tets"]
        self.assertEqual(tets[0], coarsest)
        self.assertTrue(tets[0] < tets[1] < tets[2], tets)
        self.assertEqual(self.extract("--classified-error", "20%")["tets"], tets[2])
        camera = self.write("map_camera.json", CAMERA)
        said = self.extract("--view", camera, "--pixels", "2", "--transfer", some)
        self.assertLessEqual(said["pixels"], 2)

    def test_views(self):
        camera = self.write("camera.json", CAMERA)
        fine, coarse = (self.extract("--view", camera, "--pixels", p, "--iso", "value=0.9") for p in ("1", "20"))
        self.assertGreater(fine["tets"], coarse["tets"])
        self.assertLessEqual(coarse["pixels"], 20)

    def test_broken_cameras(self):
        text = json.dumps(CAMERA)
        broken = {"comma": text[:-1] + ",}", "cut": text[:40], "empty": "", "list": "[1]", "words": text.replace("0.5", "x").replace("2.5", "x"),
                  "short": json.dumps({"position": [1, 2], "focal_point": [0, 0, 0]}), "none": json.dumps({"view_angle": 30}),
                  "same": json.dumps({"position": [0, 0, 0], "focal_point": [0, 0, 0]}), "angle": json.dumps(dict(CAMERA, view_angle=180)),
                  "size": json.dumps(dict(CAMERA, size=[0, 600])), "text": json.dumps(dict(CAMERA, position="here")),
                  "up": json.dumps(dict(CAMERA, view_up=CAMERA["position"]))}
        for name, text in broken.items():
            path = self.write(name + ".json", text)
            with self.subTest(name):
                self.check_fails(1, [name + ".json"], "--view", path)
        self.check_fails(1, ["missing.json"], "--view", self.path("missing.json"))
        self.check_fails(1, [self.folder], "--view", self.folder)

    def test_broken_maps(self):
        broken = {"odd": MAP % "0, 0, 0.5", "opacity": MAP % "0, 2, 0.5, 0", "word": MAP % '"a", 0, 0.5, 0', "none": '{"Name": "x"}',
                  "cut": '[{"Points": [0, 0', "list": "[]", "number": "[3]", "empty": ""}
        for name, text in broken.items():
            path = self.write(name + "_map.json", text)
            with self.subTest(name):
                self.check_fails(1, [name + "_map.json"], "--transfer", path, "--space-error", "1%")
        self.check_fails(1, ["missing.json"], "--transfer", self.path("missing.json"), "--space-error", "1%")
        self.check_fails(1, [self.folder], "--transfer", self.folder, "--space-error", "1%")

    def test_wrong_use(self):
        self.check_fails(2, ["no channel 'x'"], "--iso", "x=1", "--space-error", "1%")
        self.check_fails(2, ["expected CHANNEL=VALUE"], "--iso", "value=wide", "--space-error", "1%")
        self.check_fails(2, ["need --space-error"], "--iso", "value=1", "--full")
        self.check_fails(2, ["how fine?"])
        self.check_fails(2, ["--pixels needs --view"], "--full", "--pixels", "1")


if __name__ == "__main__":
    unittest.main()
