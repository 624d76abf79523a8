"""Data that are opened in the viewer as their owner has them: series of files with their steps, the first look of
long and flat ones, what holds no volume, and models that are built of them and found again."""

import os
import resource
import shutil
import unittest

import numpy as np
from render_test import pixels
from viewer_case import SIZE, ViewerTest, difference, make

STEPS = 4


def box(path, lengths, count=6, value=None):
    """A VTU file of a box of hexahedra with a channel T."""
    line = np.linspace(0, 1, count)
    unit = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    values = (value or (lambda x: np.exp(-8 * ((x - 0.5) ** 2).sum(1))))(unit)
    ids = np.arange(count**3).reshape(count, count, count)
    corner = [ids[i:count - 1 + i, j:count - 1 + j, k:count - 1 + k].ravel()
              for i, j, k in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))]
    cells = np.stack(corner, 1)

    def array(name, kind, data, components=1):
        return f'<DataArray Name="{name}" type="{kind}" NumberOfComponents="{components}" format="ascii">{" ".join(map(str, data.ravel()))}</DataArray>'

    with open(path, "w", encoding="ascii") as f:
        f.write(f'<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid><Piece NumberOfPoints="{len(unit)}" '
                f'NumberOfCells="{len(cells)}"><Points>{array("Points", "Float64", unit * lengths, 3)}</Points><Cells>'
                f'{array("connectivity", "Int64", cells)}{array("offsets", "Int64", 8 * np.arange(1, len(cells) + 1))}'
                f'{array("types", "UInt8", np.full(len(cells), 12))}</Cells><PointData>{array("T", "Float64", values)}</PointData></Piece>'
                "</UnstructuredGrid></VTKFile>")
    return path


class FilesTest(ViewerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        os.mkdir(cls.at("run"))
        for step in range(STEPS):
            box(cls.step_file(step), (1, 1, 1), value=lambda x, s=step: np.exp(-8 * ((x - [0.2 + 0.2 * s, 0.5, 0.5]) ** 2).sum(1)))

    @classmethod
    def step_file(cls, step):
        return cls.at(f"run/flow_{10 * step:03d}.vtu")

    def got(self, said, name):
        return [line.split(" ", 2)[2] for line in said if line.startswith(f"get {name} ")]


class Steps(FilesTest):
    def test_slider_of_files(self):
        """Steps go on and back, each is what a picture of its own file shows, and a saved scene draws it again."""
        lines = ["wait settled", "picture " + self.at("1.png") + " 200x150", "key step-on", "wait settled", "picture " + self.at("2.png") + " 200x150", "get data.step",
                 "save-scene " + self.at("step.json"), "key step-back", "wait settled", "get data.step", "key step-back", "wait settled", "get data.step", "key step-back",
                 "wait settled", "get data.step"]
        said, _ = self.play(lines, self.step_file(1), "--size", SIZE)
        self.assertEqual(self.got(said, "data.step"), ["20", "10", "0", str(10 * (STEPS - 1))])
        make("render", self.step_file(1), "--scene", self.at("step.json"), "--size", "200x150", "-o", self.at("render.png"))
        self.assertEqual(difference(pixels(self.at("2.png")), pixels(self.at("render.png"))), 0)
        self.assertGreater(difference(pixels(self.at("1.png")), pixels(self.at("2.png"))), 0.5)

    def test_scene_opens_its_step(self):
        with open(self.at("third.json"), "w", encoding="ascii") as f:
            f.write('{"tetralod_scene": 1, "data": {"file": "run/flow_000.vtu", "step": 20}}')
        said, _ = self.play(["wait settled", "get data.step"], "--scene", self.at("third.json"), "--size", SIZE)
        self.assertEqual(self.got(said, "data.step"), ["20"])

    def test_row_of_steps(self):
        """The page of the data set asks for a step where there are several."""
        lines = ["wait settled", "select data", "wait settled", "where step"]
        self.play(lines, self.step_file(0), "--size", SIZE)
        os.makedirs(self.at("alone"), exist_ok=True)
        shutil.copy(self.step_file(0), self.at("alone/flow.vtu"))
        _, err = self.play(lines, self.at("alone/flow.vtu"), "--size", SIZE, status=1)
        self.assertIn("nothing seen is called 'step'", err)

    def test_play(self):
        said, _ = self.play(["wait settled", "key play", "wait 3", "key play", "wait settled", "get data.step", "undo", "get data.step"], self.step_file(0), "--size", SIZE)
        steps = self.got(said, "data.step")
        self.assertIn(int(steps[0]), [10 * step for step in range(STEPS)])
        self.assertEqual(steps[1], "-1", "playing is one step of undo")

    def test_step_that_is_gone(self):
        lost = self.step_file(3)
        shutil.copy(self.step_file(0), self.at("run/kept"))
        os.rename(lost, self.at("run/away"))
        self.addCleanup(os.rename, self.at("run/away"), lost)
        with open(lost, "wb") as f:
            f.write(b"<VTKFile")
        self.addCleanup(lambda: os.path.exists(self.at("run/away")) and os.remove(lost))
        _, err = self.play(["wait settled", "set data.step 30", "wait settled"], self.step_file(0), "--size", SIZE, status=1)
        self.assertIn("flow_030.vtu", err)


class FirstLook(FilesTest):
    def test_all_is_seen(self):
        """The first camera sees all of long, tall and flat boxes in a window of any proportions: to fit them in changes nothing."""
        for number, lengths in enumerate(((10, 1, 1), (1, 1, 10), (1000, 1000, 1), (1e-9, 3e-9, 1e-9))):
            data = box(self.at(f"box{number}.vtu"), lengths)
            for size in ("700x700", "1300x760"):
                said, _ = self.play(["wait settled", "get camera.position", "fit", "wait settled", "get camera.position"], data, "--size", size)
                first, fitted = (np.array([float(word) for word in text.split()]) for text in self.got(said, "camera.position"))
                self.assertLess(np.abs(first - fitted).max(), 1e-3 * np.abs(fitted).max(), f"{lengths} {size}")  # a pixel of layout

    def test_no_volume(self):
        """What holds no tets is refused in words that say what it holds."""
        with open(self.at("flat.vtk"), "w", encoding="ascii") as f:
            f.write("# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\n"
                    "CELLS 2 8\n3 0 1 2\n3 0 2 3\nCELL_TYPES 2\n5\n5\n")
        _, err = self.play(["wait settled"], self.at("flat.vtk"), status=1)
        self.assertIn("2 surface", err)
        self.assertIn("volume", err)


class Models(FilesTest):
    def test_all_steps_then_one(self):
        """A model of all steps has the slider and keeps scene, camera and step; one of a single step has none."""
        self.play(["wait settled", "key step-on", "view 70,10", "add surface channel=T value=0.4", "wait settled", "build all " + self.at("all.tlod"), "wait settled",
                   "save-scene " + self.at("all.json"), "key step-on", "wait settled", "save-scene " + self.at("next.json")], self.step_file(0), "--size", SIZE)
        self.assertEqual(self.property_of("all.json", "data", "file"), self.at("all.tlod"))
        self.assertEqual(self.property_of("all.json", "data", "step"), 10)
        self.assertEqual(self.property_of("next.json", "data", "step"), 20)
        self.assertEqual(self.property_of("all.json", "surface1", "value"), 0.4)
        self.assertEqual(self.property_of("all.json", "camera", "position"), self.property_of("next.json", "camera", "position"))
        self.play(["wait settled", "key step-on", "set picture.note off", "set volume1.visible off", "add slice plane=x color_by=T", "wait settled", "picture " + self.at("mesh.png") + " 200x150", "build one " + self.at("one.tlod"), "wait settled",
                   "picture " + self.at("one.png") + " 200x150", "save-scene " + self.at("one.json")], self.step_file(0), "--size", SIZE)
        self.assertEqual(self.property_of("one.json", "data", "file"), self.at("one.tlod"))
        self.assertLess(difference(pixels(self.at("mesh.png")), pixels(self.at("one.png"))), 1.5)
        self.assertEqual(self.property_of("one.json", "data").get("step", -1), -1)

    def test_model_is_found(self):
        """One beside the data that is newer and of as many tets; none of another mesh, nor an older one."""
        data, model = box(self.at("found.vtu"), (1, 1, 1)), self.at("found.tlod")

        def find():
            return self.play(["wait settled", "find-model"], data, "--size", SIZE)[0][-1]

        self.assertEqual(find(), "none")
        make("build", data, "-o", model)
        self.assertEqual(find(), model)
        os.utime(model, (1e9, 1e9))
        self.assertEqual(find(), "none")
        shutil.copy(self.model, model)
        self.assertEqual(find(), "none")

    def test_full_disk_leaves_nothing(self):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        before = set(os.listdir(self.folder))
        _, err = self.play(["wait settled", "build all " + self.at("full.tlod"), "wait settled"], self.step_file(0), "--size", SIZE, status=1, preexec_fn=limit)
        self.assertIn("full.tlod", err)
        self.assertEqual({name for name in set(os.listdir(self.folder)) - before if "tlod" in name}, set())


if __name__ == "__main__":
    unittest.main()
