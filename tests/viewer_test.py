"""The viewer, under Xvfb: a tour through its features by script; the same pictures as `tetralod render`; files, disks, displays and graphics that are not as they should be;
memory and idleness. What is seen is checked by properties, not by stored pictures."""

import os
import re
import resource
import shutil
import subprocess
import tempfile
import time
import unittest

import numpy as np
from render_test import pixels
from viewer_case import SIZE, ViewerTest, difference, make
from viewer_display import PROGRAM, SANITIZED, Display, Weston, environment

FRAME_PX = 12  # at most so many of a window's width and height are its frame
FAKE_GL = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}


class Pictures(ViewerTest):
    def check_same_as_render(self, data, commands):
        """The viewer's picture is that of `render --scene`, to the pixel; returns it."""
        self.play(["wait settled", *commands, "wait settled", "save-scene " + self.at("same.json"), "picture " + self.at("same.png") + " 400x300"],
                  data, "--size", SIZE)
        make("render", data, "--scene", self.at("same.json"), "--size", "400x300", "-o", self.at("other.png"), "--renderer", "cpu")
        mine, other = pixels(self.at("same.png")), pixels(self.at("other.png"))
        self.assertEqual(mine.shape, other.shape)
        self.assertEqual(difference(mine, other), 0)
        return mine

    def test_same_as_render(self):
        plain = self.check_same_as_render(self.model, [])
        things = self.check_same_as_render(self.model, ["set volume1.visible off", "add surface channel=pressure value=0.4 opacity=0.6", "add boundary",
                                                        "add slice plane=z color_by=velocity", "add lines channel=velocity", "view 20,30"])
        self.assertGreater(difference(plain, things), 2)

    def test_window_shows_the_picture(self):
        """What is on the screen is the same picture, where the window says that it is."""
        said, _ = self.play(["key handles", "view 20,30", "wait settled", "print-tools", "save-scene " + self.at("w.json"), "screenshot " + self.at("w.png")],
                            self.model, "--size", SIZE)
        x, y, width, height = (int(float(word)) for word in said[0].split()[1:])
        self.assertGreater(width * height, 200 * 200)
        make("render", self.model, "--scene", self.at("w.json"), "--size", f"{width}x{height}", "-o", self.at("w2.png"), "--renderer", "cpu")
        window = pixels(self.at("w.png"))[::-1]
        shown, drawn = window[y:y + height, x:x + width], pixels(self.at("w2.png"))[::-1]
        self.assertLess(difference(shown, drawn), 1.5)

    def test_screenshot_alone(self):
        done = subprocess.run([PROGRAM, "view", self.model, "--screenshot", self.at("s.png"), "--size", SIZE, "--stats"],
                              env=environment(self.display, self.folder), capture_output=True, text=True, check=False, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(", complete, by ", done.stdout)
        self.assertGreater(pixels(self.at("s.png")).std(), 10)


class TourTest(ViewerTest):
    # Each is followed by a look at the whole window: name, commands. {vector}: of a data set with one.
    TOUR = [
        ("first", []),
        ("turned", ["view 60,35", "turn 90 10 0.3"]),
        ("surface", ["set {first}.visible off", "add surface channel={scalar} value={middle}"]),
        ("more", ["set surface1.opacity 0.5", "add surface channel={scalar} value={middle} color=gold"]),
        ("slice", ["add slice plane=y color_by={scalar}"]),
        ("clip", ["add clip plane=x"]),
        ("unclipped", ["set clip1.on off"]),
        ("points", ["add points channel={scalar} count=5000"]),
        ("lines", ["add lines channel={vector} seeds=grid:60"]),
        ("box", ["set lines1.has_box on"]),
        ("colours", ["set {transfer}.map plasma", "set {transfer}.range_by percent"]),
        ("coarse", ["set detail.error_px 20"]),
        ("budget", ["set detail.error_px 0", "set detail.tets 20000"]),
        ("patches", ["add boundary opacity=1", "set detail.tets 0"]),
        ("frozen", ["set detail.frozen on", "turn -120 0 0.3"]),
        ("focus", ["set detail.frozen off", "set detail.focus on"]),
        ("probed", ["key i", "probe 300 250"]),
        ("measured", ["key m", "measure 250 250 350 300"]),
        ("parallel", ["key p", "key 5"]),
        ("undone", ["undo", "undo", "redo"]),
    ]

    def tour(self, data, first, scalar, middle, vector=None):
        lines, names = ["wait settled"], []
        for name, commands in self.TOUR:
            if not vector and name in ("lines", "box"):
                continue
            text = [c.format(first=first, scalar=scalar, middle=middle, vector=vector, transfer="transfer1") for c in commands]
            if name == "patches" and vector:
                text.append("set boundary1.mark patches")
            if name == "colours":
                text.insert(0, f"add transfer channel={scalar}")
            lines += [*text, "wait settled", "screenshot " + self.at(name + ".png")]
            names.append(name)
        lines += ["save-scene " + self.at("tour.json"), "print stats"]
        said, _ = self.play(lines, data, "--size", SIZE)
        self.assertTrue(any(line.startswith("drawn") and ", complete, " in line for line in said), said)
        views = [pixels(self.at(name + ".png")) for name in names]
        for name, before, after in zip(names[1:], views, views[1:]):
            self.assertGreater(difference(before, after), 0.005, f"'{name}' changes nothing in the window")
        make("render", data, "--scene", self.at("tour.json"), "--size", "200x150", "-o", self.at("tour.png"))


class Tour(TourTest):
    def test_sample(self):
        self.tour(self.model, "volume1", "pressure", 0.3, "velocity")


class Wayland(TourTest):
    """The same without X."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        if not shutil.which("weston"):
            raise unittest.SkipTest("weston is not installed")
        cls.display = Weston()
        cls.addClassCleanup(cls.display.close)

    def test_sample(self):
        self.tour(self.model, "volume1", "pressure", 0.3, "velocity")

    def test_full_screen(self):
        """Weston gives a window all of its display."""
        self.play(["wait settled", "key full-screen", "wait 1", "wait settled", "screenshot " + self.at("full.png")], self.model, "--size", SIZE)
        self.assertEqual(pixels(self.at("full.png")).shape[:2], (900, 1280))


class Troubles(ViewerTest):
    def fails(self, data, *words, message, lines=("wait settled",), **options):
        _, err = self.play(lines, data, *words, status=1, **options)
        self.assertIn(message, err)

    def write(self, name, content):
        with open(self.at(name), "wb") as f:
            f.write(content)
        return self.at(name)

    def test_bad_files(self):
        with open(self.model, "rb") as f:
            whole = f.read()
        self.fails(self.at("nowhere.tlod"), message="nowhere.tlod")
        self.fails(self.write("empty.vtu", b""), message="empty.vtu")
        self.fails(self.write("noise.vtu", os.urandom(5000)), message="noise.vtu")
        self.fails(self.write("short.tlod", whole[:len(whole) // 2]), message="short.tlod")
        huge = bytearray(whole)
        huge[64:72] = b"\xff" * 8
        self.fails(self.write("huge.tlod", bytes(huge)), message="huge.tlod")
        self.fails(self.model, "--scene", self.write("bad.json", b'{"tetralod_scene": 1, "things": [{"kind": "surface", "value": "x"}]}'),
                   message="things[0].value")

    def test_wrong_commands(self):
        for line, message in (("set nothing.value 1", "nothing"), ("fly to the moon", "fly"), ("wait long", "wait"), ("key none-such", "key"),
                              ("probe here", "probe"), ("screenshot /no/such/folder/a.png", "/no/such/folder")):
            self.fails(self.model, lines=["wait settled", line], message=message)
        self.fails(self.model, lines=["\0"], message="expected a script, lines of UTF-8")

    def test_file_goes_while_it_is_open(self):
        """Removed: it stays open. Cut short: what can't be read is said, the window stays."""
        model = self.at("goes.tlod")
        for change in (os.remove, lambda path: os.truncate(path, os.path.getsize(path) // 3)):
            shutil.copy(self.model, model)
            changed = self.at(f"{change.__name__} is done")
            viewer = self.start(["set detail.error_px 200", "wait settled", "print ready", "wait for " + changed, "set detail.error_px 0.01", "view 10,10",
                                 "wait settled", "screenshot " + self.at("gone.png"), "quit"], model, "--size", SIZE)
            viewer.until("ready")
            change(model)
            with open(changed, "w", encoding="ascii"):
                pass
            status, said, err = viewer.end()
            self.assertIn(status, (0, 1), f"{said} {err}")
            if change is os.remove:
                self.assertEqual(status, 0, err)
            elif status:
                self.assertIn("goes.tlod", err)

    def test_full_disk(self):
        def limit():
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        for line, name in (("save-scene", "full.json"), ("picture", "full.png"), ("screenshot", "full2.png")):
            before = [f"add surface channel=pressure value={0.1 + 0.001 * i:.3f}" for i in range(40 if name == "full.json" else 0)]
            _, err = self.play(["wait settled", *before, f"{line} {self.at(name)}"], self.model, "--size", SIZE, status=1, preexec_fn=limit)
            self.assertIn(name, err)
            self.assertFalse(os.path.exists(self.at(name)))

    def test_no_display(self):
        for more in ({}, {"DISPLAY": ":987"}):
            done = subprocess.run([PROGRAM, "view", self.model], env=environment(None, self.folder, **more), capture_output=True, text=True, check=False, timeout=60)
            self.assertEqual(done.returncode, 1)
            self.assertIn("no display", done.stderr)

    def test_no_graphics(self):
        """Without OpenGL, or with one that is too old, the processor draws, and the window says so."""
        for env in (FAKE_GL, {"MESA_GL_VERSION_OVERRIDE": "2.1", "MESA_GLES_VERSION_OVERRIDE": "2.0"}):
            said, err = self.start(["wait settled", "print stats", "quit"], self.model, "--size", SIZE, "--renderer", "gl", env=env).end()[1:]
            self.assertTrue(any(line.startswith("drawn") and line.endswith("by cpu") for line in said), f"{said} {err}")
            self.assertIn("processor", err)

    def test_displays(self):
        for size in ("800x600", "3840x2160"):
            display = Display(size)
            self.addCleanup(display.close)
            self.play(["wait settled", "screenshot " + self.at("whole.png")], self.model, "--size", size, display=display)
            shape, wanted = pixels(self.at("whole.png")).shape, tuple(map(int, size.split("x")))
            for side, most in zip((shape[1], shape[0]), wanted):
                self.assertTrue(most - FRAME_PX <= side <= most, shape)


class Rest(ViewerTest):
    def test_memory_and_idleness(self):
        """Memory is flat over a flight that repeats, and below its limit; nothing runs when nothing changes."""
        around = ["turn 180 20 0.6", "turn 180 -20 0.6", "wait settled", "print around"]
        watched = self.at("watched")
        viewer = self.start(["wait settled", *(4 * around), "wait for " + watched, "print stats", "quit"], self.model, "--size", SIZE, "--memory", "100M")
        kept = []
        for _ in range(4):
            viewer.until("around")
            kept.append(viewer.status("VmRSS"))
        busy = viewer.busy(2)
        with open(watched, "w", encoding="ascii"):
            pass
        status, said, err = viewer.end()
        self.assertEqual(status, 0, err)
        figures, = (line for line in said if line.startswith("memory"))
        most, limit = map(float, re.search("at most ([0-9.]+) of ([0-9.]+) MB", figures).groups())
        self.assertAlmostEqual(limit, 100 * 1.048576, delta=0.1)
        self.assertTrue(0 < most <= limit, figures)
        if not SANITIZED:
            self.assertLess(kept[-1] - kept[1], 0.1 * kept[1], kept)
        self.assertLess(busy, 0.1)


if __name__ == "__main__":
    unittest.main()
