"""tetralod render: pictures of known scenes, of models and files, and wrong use."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest

import vtk
from vtk.util.numpy_support import vtk_to_numpy

PROGRAM = os.environ["TETRALOD_PROGRAM"]

TRANSFER = """[{"ColorSpace": "RGB", "Name": "red",
  "Points": [0, 1, 0.5, 0, 2, 1, 0.5, 0,],
  "RGBPoints": [0, 1, 0, 0, 2, 1, 0, 0,],},]"""


def run(*words):
    return subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False, timeout=120)


def pixels(path):
    """[height, width, channels], bottom row first."""
    reader = vtk.vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    image = reader.GetOutput()
    width, height, _ = image.GetDimensions()
    return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, -1).astype(int)


class Render(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tetralod-render-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.grid = os.path.join(cls.folder, "g.vtu")
        assert run("sample", "gaussians", "-o", cls.grid, "--size", "20").returncode == 0

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as f:
            f.write(text)
        return self.path(name)

    def draw(self, *words, source=None):
        done = run("render", source or self.grid, "-o", self.path("p.png"), "--size", "160x120", "--json", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return pixels(self.path("p.png")), json.loads(done.stdout)

    def test_first_look(self):
        image, said = self.draw()
        self.assertEqual(image.shape, (120, 160, 3))
        self.assertEqual(said["renderer"], "cpu")
        self.assertTrue((image[0, 0] == 255).all())
        self.assertLess(image[60, 80].min(), 200)

    def test_opaque_silhouette(self):
        """A cube that is opaque red, seen along y: a square of a known size, and nothing else."""
        transfer = self.write("red.json", TRANSFER)
        camera = self.write("camera.json", '{"position": [0, -9, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, 1], "parallel_scale": 2}')
        image, _ = self.draw("--volume", "value:" + transfer, "--camera", camera, "--background", "black")
        red = (image == [255, 0, 0]).all(axis=2)
        self.assertEqual(red.sum(), 60 * 60)  # sides of 2 in a height of 4
        self.assertTrue(red[31:89, 51:109].all())
        self.assertTrue((image[~red] == 0).all())

    def test_transparent_background(self):
        image, _ = self.draw("--background", "none")
        self.assertEqual(image.shape[2], 4)
        self.assertEqual(image[0, 0, 3], 0)
        self.assertGreater(image[60, 80, 3], 100)

    def test_samples_keep_the_picture(self):
        one, _ = self.draw()
        four, _ = self.draw("--samples", "2")
        self.assertEqual(one.shape, four.shape)
        self.assertLess(abs(one - four).mean(), 0.5)

    def test_same_with_any_number_of_threads(self):
        one, _ = self.draw("--threads", "1")
        three, _ = self.draw("--threads", "3")
        self.assertTrue((one == three).all())

    def test_model(self):
        """A coarse mesh of a model looks like the full one."""
        model = self.path("m.tlod")
        self.assertEqual(run("build", self.grid, "-o", model).returncode, 0)
        ramp = self.write("ramp.json", '{"RGBPoints": [0, 0, 0, 1, 1.6, 1, 0, 0], "Points": [0, 0, 0.5, 0, 1.6, 0.4, 0.5, 0]}')
        full, said = self.draw("--volume", "value:" + ramp)
        for words in ([], ["--error", "2%"]):
            image, said = self.draw("--volume", "value:" + ramp, *words, source=model)
            self.assertIn("bounds_promised", said)
            self.assertLess(((image - full) ** 2).mean() ** 0.5, 3)
        self.assertLess(said["tets"], 19**3 * 5)

    def test_camera_inside(self):
        camera = self.write("inside.json", '{"position": [0, 0, 0], "focal_point": [1, 0, 0], "view_up": [0, 0, 1], "view_angle": 60}')
        image, _ = self.draw("--camera", camera)
        self.assertLess(image.min(), 250)

    def test_wrong_use(self):
        bad = self.write("bad.json", "[{")
        empty = self.write("empty.json", "[]")
        for status, words, text in ((2, [], "-o OUT.png is missing"), (2, ["-o", "p.jpg"], "must end in .png"),
                                    (2, ["-o", "p.png", "--size", "0x5"], "expected WxH"),
                                    (2, ["-o", "p.png", "--volume", "heat"], "no channel 'heat'"),
                                    (2, ["-o", "p.png", "--colormap", "pink"], "viridis"),
                                    (2, ["-o", "p.png", "--view", "1"], "expected AZ,EL"),
                                    (2, ["-o", "p.png", "--range", "1,1"], "expected LOW,HIGH"),
                                    (1, ["-o", "p.png", "--volume", "value:" + bad], "JSON"),
                                    (1, ["-o", "p.png", "--volume", "value:" + empty], "expected a list of colour maps"),
                                    (1, ["-o", "p.png", "--camera", "nowhere.json"], "nowhere.json"),
                                    (1, ["-o", "no/folder/p.png"], "can't write")):
            with self.subTest(words):
                done = subprocess.run([PROGRAM, "render", self.grid, *words], capture_output=True, text=True, check=False, timeout=60,
                                      cwd=self.folder)
                self.assertEqual(done.returncode, status, done.stderr)
                self.assertIn(text, done.stderr)


if __name__ == "__main__":
    unittest.main()
