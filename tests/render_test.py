"""tetralod render: pictures of known scenes, of models and files, and wrong use."""

import filecmp
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

    def test_fog_of_one_value(self):
        """Equal values have no integral between them: thick layers are of the value's colour, as opaque as it says."""
        fog = self.write("fog.json", '{"RGBPoints": [0, 0, 0, 1, 1, 1, 0, 0], "Points": [0, 0, 0.5, 0, 1, 0.9, 0.5, 0]}')
        camera = self.write("fog-camera.json", '{"position": [0, -9, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, 1], "parallel_scale": 2}')
        image, _ = self.draw("--derive", "c=0*value+1", "--volume", "c:" + fog, "--camera", camera, "--background", "black")
        self.assertLessEqual(abs(image[60, 80] - [255, 0, 0]).max(), 1)
        thin = self.write("thin.json", '{"RGBPoints": [0, 1, 0, 0, 1, 1, 0, 0], "Points": [0, 0.01, 0.5, 0, 1, 0.01, 0.5, 0]}')
        image, _ = self.draw("--derive", "c=0*value+1", "--volume", "c:" + thin, "--camera", camera, "--background", "black")
        layers = 2 / (0.02 * 12**0.5)  # the cube by the thickness that opacities hold for
        self.assertLessEqual(abs(image[60, 80] - [255 * (1 - 0.99**layers), 0, 0]).max(), 1.5)

    def test_sphere_of_a_surface(self):
        """The silhouette of an isosurface that is a ball, seen without perspective."""
        image, said = self.draw("--derive", "r=sqrt(x*x+y*y+z*z)", "--surface", "r=0.8:red", "--view", "+x", "--parallel",
                                "--camera", self.write("ball.json", '{"position": [9, 0, 0], "focal_point": [0, 0, 0], '
                                                       '"view_up": [0, 0, 1], "parallel_scale": 1}'))
        seen = (image != 255).any(axis=2)
        self.assertLess(abs(seen.sum() - 3.14159 * 48**2) / (3.14159 * 48**2), 0.02)
        self.assertEqual([c["channel"] for c in said["channels"]], ["r"])
        ys, xs = seen.nonzero()
        self.assertLess(abs(xs.mean() - 79.5), 0.5)
        self.assertLess(abs(ys.mean() - 59.5), 0.5)

    def test_plane_shows_the_values(self):
        """A plane coloured by a linear channel, unlit: the colours of the map at known places."""
        flat = self.write("grey.json", '{"RGBPoints": [-1, 0, 0, 0, 1, 1, 1, 1]}')
        image, _ = self.draw("--derive", "height=z", "--slice", "y", "--color-by", "height:" + flat, "--camera",
                             self.write("front.json", '{"position": [0, -9, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, 1], '
                                        '"parallel_scale": 2}'), "--background", "blue")
        for row in (31, 45, 60, 88):
            z = (row + 0.5 - 60) / 30
            self.assertLessEqual(abs(image[row, 80] - 255 * (z + 1) / 2).max(), 2, row)

    def test_translucent_surface_over_a_colour(self):
        camera = self.write("half.json", '{"position": [0, -9, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, 1], "parallel_scale": 2}')
        image, _ = self.draw("--derive", "side=y", "--surface", "side=0:0,0,0:0.25", "--camera", camera)
        self.assertEqual(len({tuple(p) for p in image[40:80, 60:100].reshape(-1, 3)}), 1)
        self.assertTrue(150 < image[60, 80, 0] < 255)

    def test_boundary_of_a_part(self):
        image, _ = self.draw("--boundary", "--color-by", "value", "--view", "iso")
        self.assertLess(image[60, 80].min(), 250)

    def test_views_from_all_sides(self):
        """A ramp along an axis is dark on one side and bright on the other."""
        ramp = self.write("axis.json", '{"RGBPoints": [-1, 0, 0, 0, 1, 1, 1, 1]}')
        for side, along in (("+x", "y"), ("-x", "-y"), ("+y", "-x"), ("-y", "x"), ("+z", "x"), ("-z", "-x")):
            image, _ = self.draw("--derive", "a=" + along, "--boundary", "--color-by", "a:" + ramp, "--view", side, "--parallel")
            with self.subTest(side):
                self.assertLess(image[60, 50, 0] + 60, image[60, 110, 0])

    def test_logarithmic(self):
        """Powers of ten of a linear exponent are a linear ramp."""
        image, said = self.draw("--derive", "p=exp(2.302585092994046*4*z)", "--slice", "y", "--color-by", "p", "--log",
                                "--colormap", "grey", "--range", "1e-4,1e4", "--camera", self.write(
                                    "log.json", '{"position": [0, -9, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, 1], '
                                    '"parallel_scale": 2}'))
        grey, _ = self.draw("--derive", "h=z", "--slice", "y", "--color-by", "h", "--colormap", "grey", "--range", "-1,1",
                            "--camera", self.path("log.json"))
        self.assertLessEqual(abs(image - grey).max(), 2)
        self.assertEqual(said["channels"][0]["range"], [1e-4, 1e4])

    def test_range_by_percentile(self):
        """Of a linear channel in a cube, parts of the volume are parts of the range; outliers do not matter."""
        _, said = self.draw("--derive", "h=if(z>0.99, 1e30, z)", "--volume", "h", "--range", "10%,90%")
        low, high = said["channels"][0]["range"]
        self.assertLess(abs(low + 0.8), 0.06)
        self.assertLess(abs(high - 0.8), 0.06)

    def test_range_about_a_value(self):
        """A diverging map of signed values has 0 in its middle; --center says another value, or none; a clip changes nothing."""
        def ends(*words):
            return self.draw("--derive", "h=value-0.5", "--slice", "x", "--color-by", "h", *words)[1]["channels"][0]["range"]
        low, high = ends()
        self.assertGreater(high, -2 * low)
        self.assertEqual(ends("--colormap", "cool-to-warm"), [-high, high])
        self.assertEqual(ends("--colormap", "cool-to-warm", "--clip", "y<0"), [-high, high])
        self.assertEqual(ends("--colormap", "cool-to-warm", "--center", "none"), [low, high])
        for got, expected in zip(ends("--center", "0.1"), (0.2 - high, high)):
            self.assertAlmostEqual(got, expected, 9)

    def test_channels_of_all_kinds(self):
        """Constant, huge, tiny, whole, with NaN, without any number: there is a picture of each."""
        for text in ("0*value", "0*value+7", "value*1e308", "(value-0.5)*1.7e308", "value*1e-310", "if(value>0.5,1,0)", "0/0*value",
                     "if(value>0.5,0/0,value)", "if(value>1.55,1e300,value)", "1/(value-value)"):
            for words in ([], ["--log"]):
                with self.subTest(text + " ".join(words)):
                    image, _ = self.draw("--volume", text, "--annotation", "bar,axes", *words)
                    self.assertEqual(image.shape, (120, 160, 3))

    def test_control_points_at_one_value(self):
        one = self.write("one.json", '{"RGBPoints": [0.5, 1, 0, 0, 0.5, 0, 0, 1], "Points": [0.5, 0, 0.5, 0, 0.5, 1, 0.5, 0]}')
        image, _ = self.draw("--volume", "value:" + one, "--annotation", "bar")
        self.assertEqual(image.shape, (120, 160, 3))

    def test_transfer_function_out_and_in(self):
        first, _ = self.draw("--volume", "value", "--write-transfer", self.path("used.json"))
        with open(self.path("used.json"), encoding="utf-8") as f:
            used = json.load(f)[0]
        self.assertEqual(len(used["Points"]) % 4, 0)
        self.assertEqual(len(used["RGBPoints"]) % 4, 0)
        again, _ = self.draw("--volume", "value:" + self.path("used.json"))
        self.assertLessEqual(abs(first - again).max(), 1)

    def test_camera_out_and_in(self):
        first, _ = self.draw("--view", "70,40,1.3", "--write-camera", self.path("used-camera.json"))
        again, _ = self.draw("--camera", self.path("used-camera.json"))
        self.assertTrue((first == again).all())

    def test_orbit(self):
        """The frame after a quarter of a round is the picture from that azimuth; each has a file of its own."""
        pattern = self.path("f_%03d.png")
        done = run("render", self.grid, "-o", pattern, "--size", "160x120", "--frames", "4", "--orbit", "360", "--view", "20,10", "--json",
                   "--write-camera", self.path("orbit.json"))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["frames"], 4)
        with open(self.path("orbit.json"), encoding="utf-8") as f:
            cameras = json.load(f)
        frames = [pixels(self.path(f"f_{i:03}.png")) for i in range(4)]
        for i in range(4):
            camera = cameras[i]
            offset = [camera["position"][k] - camera["focal_point"][k] for k in range(2)]
            self.assertGreater(abs(frames[i] - frames[i - 1]).mean(), 0.1)
            self.assertLess(abs(offset[0]**2 + offset[1]**2 - sum((cameras[0]["position"][k] - cameras[0]["focal_point"][k])**2
                                                                  for k in range(2))), 1e-9)
        keys = self.write("third.json", json.dumps(cameras[2]))
        again, _ = self.draw("--camera", keys)
        self.assertTrue((again == frames[2]).all())

    def test_key_frames(self):
        """A path goes through its cameras, and between two of them in the middle."""
        keys = [{"position": [0, -9, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, 1], "view_angle": 30},
                {"position": [9, -9, 2], "focal_point": [0, 1, 0], "view_up": [0, 0, 1], "view_angle": 20}]
        done = run("render", self.grid, "-o", self.path("k%d.png"), "--size", "80x60", "--frames", "3", "-q",
                   "--camera", self.write("keys.json", json.dumps(keys)), "--write-camera", self.path("path.json"))
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.path("path.json"), encoding="utf-8") as f:
            path = json.load(f)
        self.assertEqual(path[0]["position"], [0, -9, 0])
        self.assertEqual(path[2]["position"], [9, -9, 2])
        self.assertEqual(path[1]["focal_point"], [0, 0.5, 0])
        self.assertLess(abs(path[1]["view_angle"] - 25), 1e-9)

    def test_words_around(self):
        plain, _ = self.draw("--view", "+x")
        words, _ = self.draw("--view", "+x", "--annotation", "bar,axes,box,triad,error", "--title", "Zwölf Glocken")
        self.assertTrue((plain[0] == 255).all())
        self.assertLess(words[100:].min(), 100)  # the title
        self.assertLess(words[:12, :60].min(), 100)  # the error

    def test_bars_are_of_colours_that_are_seen(self):
        """A boundary that is glass has none, a surface with the colour of its value has that of its channel."""
        camera = {"position": [0, -6, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, 1]}
        boundary, picture = {"kind": "boundary", "color_by": "value"}, {"axes": False, "box": False, "note": False}
        surface, gold = {"kind": "surface", "channel": "value", "value": 0.5}, {"color": [1, 0.8, 0.2]}

        def bar_is_seen(*things):
            images = []
            for bar in (False, True):
                scene = {"tetralod_scene": 1, "camera": camera, "picture": dict(picture, bar=bar), "things": things}
                images.append(self.draw("--scene", self.write("bars.json", json.dumps(scene)))[0])
            return bool((images[0] != images[1]).any())
        self.assertTrue(bar_is_seen(boundary))
        self.assertTrue(bar_is_seen(boundary, surface))
        self.assertTrue(bar_is_seen(dict(boundary, opacity=0.5), dict(surface, **gold)))
        self.assertFalse(bar_is_seen(boundary, dict(surface, **gold)))

    def test_patches_of_a_model(self):
        model = self.path("p.tlod")
        self.assertEqual(run("build", self.grid, "-o", model).returncode, 0)
        for words in (["--color-levels"], ["--color-patches", "--clip", "x<0"]):
            image, said = self.draw(*words, source=model)
            self.assertLess(image[60, 80].min(), 250)
            self.assertGreater(said["patches"], 0)
            self.assertIsNotNone(said["error_px"])

    def test_points(self):
        image, said = self.draw("--points", "value=5000")
        self.assertGreater((image != 255).any(axis=2).sum(), 500)
        self.assertEqual(said["channels"][0]["channel"], "value")

    def test_points_on_shells(self):
        """Of a linear channel ten planes, seen from their edges: rows of points with nothing between."""
        camera = self.write("rows.json", '{"position": [0, -9, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, 1], "parallel_scale": 1}')
        words = ["--derive", "h=z", "--camera", camera, "--range=-1,1"]
        shells, _ = self.draw(*words, "--points", "h")
        cloud, _ = self.draw(*words, "--points", "h=200000")
        for z in range(-9, 10):
            seen = (shells[60 + 6 * z, 40:120] != 255).any(axis=1)
            self.assertEqual(seen.mean(), z % 2, z)
            self.assertGreater((cloud[60 + 6 * z, 40:120] != 255).any(axis=1).mean(), 0.9)

    def test_smooth_edges_unless_said(self):
        """Two rays a pixel and side where there are edges, one through a volume alone."""
        for words, samples in ((["--surface", "value=60%"], "2"), (["--boundary"], "2"), (["--volume", "value"], "1")):
            with self.subTest(words):
                default, _ = self.draw(*words)
                same, _ = self.draw(*words, "--samples", samples)
                self.assertTrue((default == same).all())
                other, _ = self.draw(*words, "--samples", "3")
                self.assertTrue((default != other).any())

    def test_gradient_opacity(self):
        """A channel that is linear on one side and constant on the other: its gradient is seen, in proportion to the word."""
        fog = self.write("even.json", '{"RGBPoints": [0, 1, 0, 0, 1, 1, 0, 0], "Points": [0, 0.05, 0.5, 0, 1, 0.05, 0.5, 0]}')
        camera = self.write("even-camera.json", '{"position": [0, -9, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, 1], "parallel_scale": 2}')
        words = ["--derive", "c=max(x,0)", "--volume", "c:" + fog, "--camera", camera, "--background", "black"]
        plain, _ = self.draw(*words)
        for word, part in (("1", 1), ("2", 0.5), ("100%", 1), ("400%", 0.25)):
            with self.subTest(word):
                image, _ = self.draw(*words, "--gradient-opacity", word)
                self.assertEqual(image[60, 60].max(), 0)
                layers = 2 / (0.02 * 12**0.5)  # the cube by the thickness that opacities hold for
                self.assertLessEqual(abs(image[60, 100] - [255 * (1 - 0.95**(layers * part)), 0, 0]).max(), 1.5)
        self.assertGreater(plain[60, 60].max(), 50)

    def test_lines(self):
        """Lines of a uniform flow along x are horizontal strokes from side to side; a box picks those that stay."""
        words = ["--derive", "u=vec(1,0,0)", "--lines", "u:flat,width=2", "--view", "-y", "--parallel"]
        image, _ = self.draw(*words, "--seeds", "line:0,0,-0.5,0,0,0.5:2")
        seen = (image != 255).any(axis=2)
        rows = seen.sum(axis=1)
        self.assertTrue(2 <= (rows > 100).sum() <= 6)
        self.assertEqual((rows[rows > 0] < 100).sum(), 0)
        some, _ = self.draw(*words, "--seeds", "line:0,0,-0.5,0,0,0.5:2", "--box=-1,-1,0,1,1,1")
        dark = 255 - some.min(axis=2)
        self.assertGreater(dark[60:].max(), 2 * dark[:60].max())
        self.assertGreater(dark[:60].max(), 5)

    def test_arrows_move(self):
        done = run("render", self.grid, "-o", self.path("a%d.png"), "--size", "160x120", "--frames", "2", "-q", "--derive", "u=vec(1,0,0)",
                   "--lines", "u:arrows,width=3", "--seeds", "grid:4")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_scene_out_and_in(self):
        """What words draw is drawn again from the scene they wrote, to the byte, and more words come on top of it."""
        model = self.path("s.tlod")
        self.assertEqual(run("build", self.grid, "-o", model).returncode, 0)
        ramp = self.write("scene-ramp.json", '{"RGBPoints": [0, 0, 0, 1, 1.6, 1, 0, 0], "Points": [0, 0, 0.5, 0, 1.6, 0.4, 0.5, 0]}')
        for words in (["--volume", "value:" + ramp, "--parallel", "--view", "+x,1.2", "--title", "one"],
                      ["--surface", "value=40%:gold:0.5", "--slice", "y=20%", "--edges", "--boundary", "--error", "5%"],
                      ["--volume", "value", "--log", "--range", "5%,0.9", "--background", "none", "--annotation", "bar,axes"],
                      ["--derive", "u=vec(-y,x,0.3)", "--lines", "u:arrows,halo,dash=3", "--box=-1,-1,0,1,1,1", "--clip", "x<0.3"],
                      ["--points", "value=500", "--silhouettes", "--threshold", "value=10%,", "--tets", "5000"]):
            for source in (self.grid, model):
                with self.subTest(words, source=source):
                    self.draw(*words, "--write-scene", self.path("scene.json"), source=source)
                    shutil.copy(self.path("p.png"), self.path("words.png"))
                    self.draw("--scene", self.path("scene.json"), "--write-scene", self.path("scene2.json"), source=source)
                    self.assertTrue(filecmp.cmp(self.path("p.png"), self.path("words.png"), shallow=False))
                    self.assertTrue(filecmp.cmp(self.path("scene.json"), self.path("scene2.json"), shallow=False))
        self.draw("--surface", "value=0.5", "--write-scene", self.path("scene.json"))
        self.draw("--scene", self.path("scene.json"), "--edges", "--colormap", "magma", "--title", "two", "--write-scene", self.path("scene.json"))
        with open(self.path("scene.json"), encoding="utf-8") as f:
            scene = json.load(f)
        self.assertEqual([thing["kind"] for thing in scene["things"]], ["transfer", "surface", "edges"])
        self.assertEqual(scene["picture"]["title"], "two")
        self.assertEqual(scene["data"]["file"], self.grid)

    def test_scene_names_its_data(self):
        """Without a data set the scene's own is drawn, found beside the scene where its name has no folder to begin with."""
        drawn, _ = self.draw("--surface", "value=0.5", "--write-scene", self.path("named.json"))
        with open(self.path("named.json"), encoding="utf-8") as f:
            scene = json.load(f)
        scene["data"]["file"] = "g.vtu"
        for name in (self.path("named.json"), self.write("beside.json", json.dumps(scene))):
            done = run("render", "--scene", name, "-o", self.path("p.png"), "--size", "160x120")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue((pixels(self.path("p.png")) == drawn).all())
        none = self.write("none.json", '{"tetralod_scene": 1}')
        for words, said in (([], "IN is missing: a model, a mesh"), (["--scene", none], "none.json' names no data set")):
            done = run("render", "-o", self.path("p.png"), *words)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(said, done.stderr)

    def test_scene_of_a_step(self):
        """A scene keeps which step of a series was drawn; words choose another one."""
        for i, kind in enumerate(("gaussians", "gaussians", "marschner-lobb")):
            self.assertEqual(run("sample", kind, "-o", self.path(f"step{i}.vtu"), "--size", str(6 + 2 * i)).returncode, 0)
        steps = "".join(f'<DataSet timestep="{i}" file="step{i}.vtu"/>' for i in range(3))
        series = self.write("series.pvd", f'<VTKFile type="Collection"><Collection>{steps}</Collection></VTKFile>')
        for words, step in ((("--step", "last"), 2), (("--time", "0.9"), 1), (("--step", "0"), -1), ((), -1)):
            with self.subTest(words):
                drawn, said = self.draw("--boundary", *words, "--write-scene", self.path("step.json"), source=series)
                self.assertEqual(said["tets"], json.loads(run("info", series, "--json", *words).stdout)["tets"])
                again, _ = self.draw("--scene", self.path("step.json"), source=series)
                self.assertTrue((drawn == again).all())
                with open(self.path("step.json"), encoding="utf-8") as f:
                    self.assertEqual(json.load(f)["data"]["step"], step)
        scene = self.write("step.json", '{"tetralod_scene": 1, "data": {"step": 2}, "things": [{"kind": "boundary"}]}')
        self.draw("--scene", scene, "--step", "0", "--write-scene", scene, source=series)
        with open(scene, encoding="utf-8") as f:
            self.assertEqual(json.load(f)["data"]["step"], -1)
        scene = self.write("step.json", '{"tetralod_scene": 1, "data": {"step": 3}}')
        done = run("render", series, "-o", self.path("w.png"), "--scene", scene)
        self.assertEqual(done.returncode, 2)
        self.assertIn("step 3: there are 3", done.stderr)

    def test_channels_of_one_value(self):
        """A first look at nothing but constants is the boundary; points have no isosurface to lie on."""
        scene = self.path("constant.json")
        lonely = self.write("constant.vtk", """# vtk DataFile Version 3.0
constant to rounding
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 4 double
0 0 0 1 0 0 0 1 0 0 0 1
CELLS 1 5
4 0 1 2 3
CELL_TYPES 1
10
POINT_DATA 4
SCALARS one double
LOOKUP_TABLE default
1 1.000000000000001 1 1
""")
        self.draw("--write-scene", scene, source=lonely)
        with open(scene, encoding="utf-8") as f:
            self.assertEqual([(thing["kind"], thing.get("color_by")) for thing in json.load(f)["things"]],
                             [("boundary", ""), ("edges", None)])
        for words in (("--derive", "n=0/0*value"), ("--derive", "n=7")):
            image, _ = self.draw(*words, "--points", "n", "--annotation", "none")
            self.assertTrue((image == 255).all())

    def test_wrong_scenes(self):
        for status, text, said in ((1, "{", "JSON"), (1, '{"tetralod_scene": 9}', "tetralod_scene"),
                                   (1, '{"tetralod_scene": 1, "things": [{"kind": "surface", "value": "high"}]}', "things[0].value"),
                                   (1, '{"tetralod_scene": 1, "things": [{"kind": "teapot"}]}', "'teapot'"),
                                   (2, '{"tetralod_scene": 1, "things": [{"kind": "volume", "channel": "heat"}]}', "'value'"),
                                   (2, '{"tetralod_scene": 1, "things": [{"kind": "volume", "channel": "value"}, {"kind": "transfer", '
                                    '"channel": "value", "range_by": "values", "range": [-1.7e308, 1.7e308]}]}', "transfer1.range")):
            with self.subTest(text):
                done = run("render", self.grid, "-o", self.path("w.png"), "--scene", self.write("wrong.json", text))
                self.assertEqual(done.returncode, status, done.stderr)
                self.assertIn(said, done.stderr)

    def test_figures_of_a_picture(self):
        _, said = self.draw()
        for key in ("tets", "patches", "seconds", "error_px", "renderer", "peak_bytes"):
            self.assertIn(key, said)
        for key in ("open", "cut", "extract", "draw"):
            self.assertIn(key, said["seconds"])

    def test_no_gl_falls_back(self):
        done = run("render", self.grid, "-o", self.path("gl.png"), "--size", "40x30", "--renderer", "gl", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        if json.loads(done.stdout)["renderer"] == "cpu":
            self.assertIn("the processor draws", done.stderr)

    def test_empty_things_are_named(self):
        """A picture without them, and a warning for each, once."""
        frames = ("--frames", "2", "--orbit", "20", "-o", self.path("e%d.png"))
        for words, said in ((("--surface", "value=99"), "surface1 is empty: 'value' has the value 99 nowhere, it goes from"),
                            (("--slice", "x=7"), "slice1 is empty: its plane lies beside the mesh, x -1 .. 1"),
                            (("--interfaces",), "boundary1 is empty: the mesh has no two regions that touch"),
                            (("--derive", "n=7", "--points", "n"), "points1 is empty: 'n' goes from 7 to 7"),
                            (("--derive", "n=-1-value", "--volume", "n", "--log"), "no value of 'n' is above 0: a logarithmic scale shows none"),
                            (("--derive", "u=grad(value)", "--lines", "u", "--seeds", "line:7,0,0,8,0,0:9"),
                             "of which 9 lie outside of the mesh")):
            with self.subTest(words):
                done = run("render", self.grid, "-q", "--size", "160x120", "--annotation", "none", *words, *frames)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
                self.assertIn(said, done.stderr)
                self.assertTrue((pixels(self.path("e0.png")) == 255).all())

    def test_nothing_is_left(self):
        for words, said in ((("--threshold", "value=5,6"), "by threshold1: no tet is within 5 and 6, 'value' goes from"),
                            (("--clip", "x<-7"), "by thresholds, regions and planes")):
            done = run("render", self.grid, "-o", self.path("n.png"), *words)
            self.assertEqual(done.returncode, 1)
            self.assertIn("nothing is left of the mesh " + said, done.stderr)
            self.assertFalse(os.path.exists(self.path("n.png")))

    def test_seeds_without_end(self):
        done = run("render", self.grid, "-o", self.path("n.png"), "--derive", "u=grad(value)", "--lines", "u", "--seeds", "/dev/zero")
        self.assertEqual(done.returncode, 1)
        self.assertIn("'/dev/zero': line 1 is no text", done.stderr)

    def test_wrong_use(self):
        bad = self.write("bad.json", "[{")
        empty = self.write("empty.json", "[]")
        same = self.write("same.json", '{"position": [0, 0, 0], "focal_point": [0, 0, 0], "view_up": [0, 0, 1]}')
        for status, words, text in ((2, [], "-o OUT.png is missing"), (2, ["-o", "p.jpg"], "must end in .png"),
                                    (2, ["-o", "p.png", "--size", "0x5"], "expected WxH"),
                                    (2, ["-o", "p.png", "--volume", "heat"], "no channel 'heat'"),
                                    (2, ["-o", "p.png", "--colormap", "pink"], "viridis"),
                                    (2, ["-o", "p.png", "--view", "1"], "expected AZ,EL"),
                                    (2, ["-o", "p.png", "--view", "up"], "+x -x"),
                                    (2, ["-o", "p.png", "--range", "1,1"], "expected LOW,HIGH"),
                                    (2, ["-o", "p.png", "--range", "1"], "expected LOW,HIGH"),
                                    (2, ["-o", "p.png", "--range", "5%,200%"], "expected LOW,HIGH"),
                                    (2, ["-o", "p.png", "--log", "--range", "0,1"], "begins above 0"),
                                    (2, ["-o", "p.png", "--volume", "value", "--center", "0.5mid"], "a value, or none"),
                                    (2, ["-o", "p.png", "--volume", "value", "--center", "1", "--range", "0,2"], "--range says the ends"),
                                    (2, ["-o", "p.png", "--volume", "value", "--center", "1", "--log"], "has no middle"),
                                    (2, ["-o", "p.png", "--surface", "value"], "CHANNEL=VALUE"),
                                    (2, ["-o", "p.png", "--surface", "value=1:pinkish"], "'pinkish' is no colour"),
                                    (2, ["-o", "p.png", "--surface", "heat=1"], "'value'"),
                                    (2, ["-o", "p.png", "--color-by", "heat"], "'value'"),
                                    (2, ["-o", "p.png", "--lines", "heat"], "heat"),
                                    (2, ["-o", "p.png", "--derive", "u=vec(1,0,0)", "--lines", "u:thick"], "'thick' is none of"),
                                    (1, ["-o", "p.png", "--derive", "u=vec(1,0,0)", "--lines", "u", "--seeds", "x"], "no words of --seeds"),
                                    (2, ["-o", "p.png", "--points", "value=many"], "expected CHANNEL=NUMBER"),
                                    (2, ["-o", "p.png", "--points", "heat"], "'value'"),
                                    (2, ["-o", "p.png", "--gradient-opacity", "-1"], "--gradient-opacity"),
                                    (2, ["-o", "p.png", "--slice", "w=1"], "expected X,Y,Z,NX,NY,NZ"),
                                    (2, ["-o", "p.png", "--slice", "0,0,0,0,0,0"], "expected X,Y,Z,NX,NY,NZ"),
                                    (2, ["-o", "p.png", "--background", "#12"], "expected none or a colour"),
                                    (2, ["-o", "p.png", "--annotation", "bars"], "expected none, or some of"),
                                    (2, ["-o", "p.png", "--frames", "3"], "needs a number"),
                                    (2, ["-o", "p.png", "--color-levels"], "is no model"),
                                    (1, ["-o", "p.png", "--camera", same], "focal point"),
                                    (1, ["-o", "p.png", "--camera", bad], "JSON"),
                                    (1, ["-o", "p.png", "--write-camera", "no/folder/c.json"], "no/folder"),
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
