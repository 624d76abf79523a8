"""A monkey at the viewer: pointer and keys at random, from a seed, in the window and in every dialog that it opens, while a
script goes on with commands in odd order. The same seed gives the same events."""

import random
import signal
import time

from viewer_display import Display, Viewer

KEYS = ["f", "Home", "1", "2", "3", "4", "5", "6", "0", "p", "t", "space", "i", "m", "shift+m", "g", "h", "Delete", "k", "comma",
        "period", "F1", "F9", "F10", "F11", "Escape", "Tab", "shift+Tab", "Return", "Left", "Right", "Up", "Down", "alt+Up", "alt+Down",
        "Page_Down", "End", "Insert", "BackSpace", "ctrl+z", "ctrl+shift+z", "ctrl+d", "ctrl+c", "ctrl+v", "ctrl+a", "ctrl+o", "ctrl+s",
        "ctrl+b", "ctrl+f", "minus", "plus", "question", "Menu", "7", "a", "w", "s", "d", "q", "e", "x"]
KINDS = ["surface", "slice", "lines", "points", "volume", "boundary", "edges", "silhouettes", "clip", "threshold", "derive"]
MODIFIERS = ["shift", "ctrl", "alt"]


def lines_of(seed, files, count, outs):
    """Commands in odd order, all of which are right at any time: while a file is opened, played, saved."""
    hands = random.Random(seed)
    for number in range(count):
        yield hands.choice([
            lambda: "open " + hands.choice(files),
            lambda: "new " + hands.choice(KINDS),
            lambda: f"set camera.view_angle {hands.randint(5, 90)}",
            lambda: f"set detail.error_px {hands.choice([0.5, 1, 4, 20])}",
            lambda: f"set detail.full {hands.choice(['on', 'off'])}",
            lambda: f"set detail.frozen {hands.choice(['on', 'off'])}",
            lambda: f"set detail.ram_bytes {hands.choice([0, 1, 20_000_000, 200_000_000])}",
            lambda: f"set picture.renderer {hands.choice(['auto', 'cpu', 'gl'])}",
            lambda: "key undo", lambda: "key redo", lambda: "seal", lambda: "fit",
            lambda: f"view {hands.randint(-180, 180)},{hands.randint(-89, 89)}",
            lambda: f"turn {hands.randint(-90, 90)} {hands.randint(-20, 20)} {hands.choice([0.05, 0.3])}",
            lambda: f"click {hands.randint(0, 600)} {hands.randint(0, 400)} {hands.randint(1, 3)} {hands.randint(1, 3)}",
            lambda: f"drag {hands.randint(0, 600)} {hands.randint(0, 400)} {hands.randint(0, 600)} {hands.randint(0, 400)}",
            lambda: f"scroll {hands.randint(0, 600)} {hands.randint(0, 400)} {hands.randint(-3, 3)}",
            lambda: f"size {hands.randint(300, 1250)}x{hands.randint(200, 880)}",
            lambda: f"key {hands.choice(['k', 'space', 'i', 'm', 'g', 'comma', 'period', 'F9'])}",
            lambda: f"picture {outs}/p{number % 5}.png {hands.randint(100, 300)}x{hands.randint(100, 300)}",
            lambda: f"frames {outs}/f{number % 3}.png 120x100 {hands.randint(2, 5)}",
            lambda: f"save-scene {outs}/s{number % 4}.json",
            lambda: "wait 0.02", lambda: "wait 0.3", lambda: "print round",
        ])()


class Monkey:
    """Sends events from a seed to the windows of a viewer."""

    def __init__(self, display, viewer, seed):
        self.display, self.viewer, self.hands = display, viewer, random.Random(seed)
        self.log = []

    def tool(self, *words):
        self.log = self.log[-60:] + [" ".join(map(str, words))]
        try:
            self.display.tool(*words)
        except RuntimeError:
            pass  # the window has just gone

    def place(self):
        return self.hands.randint(0, 1279), self.hands.randint(0, 899)

    def act(self):
        hands = self.hands
        what = hands.random()
        if what < 0.25:
            self.tool("mousemove", *self.place(), "click", "--repeat", hands.choice([1, 1, 1, 2, 3]), "--delay", 15, hands.choice([1, 1, 1, 1, 2, 3]))
        elif what < 0.45:
            words = ["mousemove", *self.place(), "mousedown", button := hands.choice([1, 1, 1, 2, 3])]
            for _ in range(hands.randint(1, 6)):
                words += ["mousemove", *self.place(), "sleep", 0.01]
                if hands.random() < 0.1:
                    words += ["key", hands.choice(KEYS)]
            self.tool(*words, "mouseup", button)
        elif what < 0.55:
            self.tool("mousemove", *self.place(), "click", "--repeat", hands.randint(1, 8), "--delay", 5, hands.choice([4, 5, 6, 7]))
        elif what < 0.85:
            self.tool("key", "--delay", 5, *(hands.choice(KEYS) for _ in range(hands.randint(1, 5))))
        elif what < 0.9:
            modifier = hands.choice(MODIFIERS)
            self.tool("keydown", modifier, "mousemove", *self.place(), "click", hands.choice([1, 4, 5]), "keyup", modifier)
        elif what < 0.94:
            self.tool("type", "--delay", 5, hands.choice(["0.5", "1e9", "-3", "nan", "abc", "exact", "x" * 40, "mag(\"velocity\")"]))
            self.tool("key", "Return")
        elif what < 0.96:
            self.resize()
        else:
            self.tool("key", "Escape", "Escape")

    def resize(self):
        """Of the window, without a manager of windows."""
        try:
            window = self.display.window(self.viewer)
        except (RuntimeError, IndexError):
            return
        self.tool("windowsize", window, self.hands.randint(200, 1279), self.hands.randint(150, 899))

    def leave_dialogs(self):
        """What is asked in windows of their own is refused, so that no file of somebody's is written."""
        for _ in range(5):
            if len(self.display.names(self.viewer)) < 2:
                return
            self.tool("key", "Escape")

    def play(self, seconds):
        """Returns the number of events; fewer seconds where the viewer ended."""
        end, count = time.monotonic() + seconds, 0
        while time.monotonic() < end and self.viewer.child.poll() is None:
            self.act()
            self.leave_dialogs()
            count += 1
        for modifier in MODIFIERS:
            self.tool("keyup", modifier)
        for button in (1, 2, 3):
            self.tool("mouseup", button)
        return count


def torment(files, seed, seconds, folder, lines=None, **options):
    """A viewer under a monkey, then asked to end: (number of events, status, stderr, last events)."""
    display = Display()
    try:
        viewer = Viewer(display, folder, lines, files[0], "--size", "1200x860", **options)
        time.sleep(1)
        monkey = Monkey(display, viewer, seed)
        count = monkey.play(seconds)
        viewer.child.send_signal(signal.SIGTERM)
        status, _, err = viewer.end()
        return count, status, err, monkey.log
    finally:
        display.close()
