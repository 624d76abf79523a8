"""What the tests of the viewer share: runs of scripts with a folder, a display and a model of their own, and hands,
which send real events of pointer and keys to controls that the viewer says the places of."""

import json
import os
import shutil
import subprocess
import tempfile
import time
import unittest

import numpy as np
from render_test import pixels
from viewer_display import PATIENCE, PROGRAM, Display, Viewer, missing

SIZE = "860x560"  # of windows


def run(*words, **options):
    return subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, check=False, timeout=200, **options)


def make(*words):
    done = run(*words)
    if done.returncode:
        raise RuntimeError(f"{words}: {done.stderr}")


def difference(a, b):
    """Mean of the differences of two pictures, 0 to 255."""
    return np.abs(a[..., :3].astype(int) - b[..., :3].astype(int)).mean()


def commas(folder):
    """Variables of a user whose numbers have commas, with a locale made in a folder; None: there is no localedef."""
    language = "de_DE.UTF-8"
    made = shutil.which("localedef") and subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", os.path.join(folder, language)],
                                                        capture_output=True, check=False)
    return {"LC_ALL": language, "LOCPATH": folder} if made and not made.returncode else None


def numbers(text):
    return np.array([float(word) for word in text.replace(",", " ").split()])


class ViewerTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if missing():
            raise unittest.SkipTest(missing())
        cls.folder = tempfile.mkdtemp(prefix="tetralod-viewer-")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.display = Display()
        cls.addClassCleanup(cls.display.close)
        grid = cls.at("flow.vtu")
        make("sample", "sphere-flow", "-o", grid, "--size", "16")
        cls.model = cls.at("flow.tlod")
        make("build", grid, "-o", cls.model)

    @classmethod
    def at(cls, name):
        return os.path.join(cls.folder, name)

    def start(self, lines, *words, display=None, **options):
        viewer = Viewer(display or self.display, self.folder, lines, *words, **options)
        self.addCleanup(viewer.kill)
        return viewer

    def play(self, lines, *words, status=0, **options):
        """Runs a script to its end: (lines said, stderr)."""
        found, said, err = self.start([*lines, "quit"], *words, **options).end()
        self.assertEqual(found, status, f"{said} {err}")
        if status == 0:
            self.assertEqual([line for line in err.splitlines() if ": note: " not in line], [])
        return said, err

    def property_of(self, name, *path):
        """A value of a scene that was saved; things by their names."""
        with open(self.at(name), encoding="utf-8") as f:
            value = json.load(f)
        if path[0] not in value:
            value = {thing["name"]: thing for thing in value["things"]}
        for key in path:
            value = value[key]
        return value


class HandsTest(ViewerTest):
    """Rounds of events and of questions about what they did. Before each one asks where the view and its handles are."""
    SIZE = "1200x860"
    LINES = []  # before the controls are looked for
    CONTROLS = []

    def setUp(self):
        self.places = {}

    def act(self, *rounds, model=None, words=(), **options):
        """Each round sends events, then asks: a property is answered by its text, other words are commands."""
        script = ["wait settled", *self.LINES, "wait settled", "wait 0.4", *("where " + name for name in self.CONTROLS)]
        done = [tempfile.mktemp(dir=self.folder) for _ in rounds]  # files that say that the events were sent
        for number, (_, questions) in enumerate(rounds):
            script += ["wait settled", "print-tools", f"print round{number}", "wait for " + done[number], "wait 0.4", "wait settled"]
            script += [word if " " in word or "." not in word else "get " + word for word in questions]
        self.display.tool("mousemove", 0, 0)  # no tips from where it was left
        self.viewer = viewer = self.start([*script, "quit"], model or self.model, "--size", self.SIZE, *words, **options)
        for number, (events, _) in enumerate(rounds):
            begin = len(viewer.said)
            viewer.until(f"round{number}")
            self.look([line.split() for line in viewer.said[begin:]])
            if number == 0:
                self.window = self.display.window(viewer)
            events()
            self.display.tool("getmouselocation")  # the server has handed them on when it answers
            with open(done[number], "w", encoding="ascii"):
                pass
        status, self.said, self.err = viewer.end()
        self.assertEqual(status, 0, self.err)
        answers = [line.split(" ", 2) for line in self.said if line.startswith("get ")]
        return [answer[2] if len(answer) > 2 else "" for answer in answers]

    def look(self, lines):
        """Takes where things are from lines that the viewer said."""
        self.handles = {}
        for words in lines:
            if words[:1] == ["where"]:
                self.places[words[1]] = [int(word) for word in words[2:]]
            elif words[:1] == ["view"]:
                self.view = [float(word) for word in words[1:]]
                self.places["view"] = [int(number) for number in self.view]
            elif words[:1] == ["handle"]:
                self.handles.setdefault(words[1], {})[int(words[2])] = (self.view[0] + float(words[3]), self.view[1] + float(words[4]))

    # ---- hands ----

    def place(self, name, x, y):
        """Pixels of a place in a control, given from its left upper corner; below 0: from the other end."""
        left, top, width, height = self.places[name]
        return left + (x if x >= 0 else width + x), top + (y if y >= 0 else height + y)

    def move(self, place):
        self.display.tool("mousemove", "--window", self.window, *map(round, place))
        time.sleep(0.03)

    def drag(self, start, end, button=1):
        """One run of xdotool, so that a busy machine does not make a long press of it."""
        words = ["mousemove", "--window", self.window, *map(round, start), "sleep", 0.03, "mousedown", button]
        for part in (0.3, 0.6, 0.9, 1, 1):
            words += ["sleep", 0.03, "mousemove", "--window", self.window, *(round(a + part * (b - a)) for a, b in zip(start, end))]
        self.display.tool(*words, "sleep", 0.03, "mouseup", button)

    def part(self, x, y):
        """Pixels of a place of the view, given as parts of its width and height."""
        left, top, width, height = self.view
        return left + x * width, top + y * height

    def click(self, place, presses=1):
        self.move(place)
        self.display.tool("click", "--repeat", presses, "--delay", 40, 1)

    def wheel(self, place, steps):
        """Above 0: away from the hand."""
        self.move(place)
        self.display.tool("click", "--repeat", abs(steps), "--delay", 40, 4 if steps > 0 else 5)

    def key(self, *keys):
        self.display.tool("key", "--delay", 40, *keys)

    def front(self, name):
        """The dialog of a name comes, and has the keys."""
        end = time.monotonic() + PATIENCE
        while name not in (names := self.display.names(self.viewer)):
            self.assertLess(time.monotonic(), end, f"'{name}' does not come: {names}")
            time.sleep(0.05)
        self.display.tool("mousemove", "--window", self.display.window(self.viewer, name), 150, 25)
        time.sleep(0.3)

    def choose(self, name, path, begin=("ctrl+a",)):
        """Answers the dialog for a file that is to be written."""
        self.front(name)
        self.key(*begin)
        time.sleep(0.3)
        self.display.tool("type", "--delay", 15, path)
        before = self.display.names(self.viewer)
        for _ in range(5):  # the first one may answer a list of names that begin so
            time.sleep(0.5)
            self.key("Return")
            time.sleep(0.5)
            if self.display.names(self.viewer) != before:
                break

    def choose_old(self, name, path):
        """Answers the dialog for a file that is there."""
        self.choose(name, path, ["ctrl+l", "ctrl+a"])

    def type(self, control, text):
        self.click(self.place(control, 20, 12))
        self.key("ctrl+a")
        self.key(*({"-": "minus", ".": "period", ",": "comma", " ": "space", "=": "equal"}.get(letter, letter) for letter in text), "Return")
