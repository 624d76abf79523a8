"""What the viewer remembers: the scene of a window that crashed is offered to the next one; windows side by side; state
that can't be read or written. Without scripts, which leave state alone: by keys, and by what is on the screen."""

import configparser
import glob
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import numpy as np
from viewer_case import ViewerTest
from viewer_display import PATIENCE, PROGRAM, SANITIZED, environment

SAVED_SECONDS = 4  # a changed scene is written after so long at most


class Window:
    """A viewer without a script."""

    def __init__(self, display, folder, state, *words):
        self.display = display
        self.errors = tempfile.TemporaryFile(dir=folder)
        self.child = subprocess.Popen([PROGRAM, "view", *words, "--size", "900x600"], env=environment(display, folder, XDG_STATE_HOME=state),
                                      stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self.errors)
        self.wait(lambda: self.shown(), "there is no window")
        self.number = self.shown()[-1]

    def shown(self):
        try:
            return self.display.tool("search", "--all", "--onlyvisible", "--pid", self.child.pid, "--name", "tetralod").split()
        except RuntimeError:  # none yet
            return []

    def said(self):
        self.errors.seek(0)
        return self.errors.read().decode()

    def wait(self, condition, what):
        end = time.monotonic() + PATIENCE
        while not condition():
            if time.monotonic() > end or self.child.poll() is not None:
                raise AssertionError(f"{what}; status {self.child.poll()}: {self.said()}")
            time.sleep(0.1)

    def title(self):
        return self.display.tool("getwindowname", self.number)

    def wait_open(self, name):
        self.wait(lambda: self.title().startswith(name), f"'{name}' is not opened, but '{self.title()}'")

    def key(self, *keys):
        """To this window, which is raised."""
        self.display.tool("windowraise", self.number)
        self.display.tool("mousemove", "--window", self.number, 300, 300)
        time.sleep(0.2)
        self.display.tool("key", "--delay", 60, *keys)

    def end(self, sign=None):
        """By a signal, or as a person does; its status."""
        if sign:
            self.child.send_signal(sign)
        else:
            self.key("ctrl+q")
        return self.child.wait(PATIENCE)

    def kill(self):
        if self.child.poll() is None:
            self.child.kill()
            self.child.wait()
        self.errors.close()


class SessionTest(ViewerTest):
    def setUp(self):
        self.state = tempfile.mkdtemp(dir=self.folder)

    def open(self, *words):
        window = Window(self.display, self.folder, self.state, *words)
        self.addCleanup(window.kill)
        return window

    def kept(self, ending):
        """Files of windows, the oldest first."""
        return sorted(glob.glob(os.path.join(self.state, "tetralod", "session-*" + ending)), key=os.path.getmtime)

    @staticmethod
    def is_parallel(path):
        with open(path, encoding="utf-8") as f:
            return json.load(f)["camera"].get("parallel", False)

    def crash(self, sign=signal.SIGKILL, model=None):
        """A window whose scene was changed by hand, and saved by itself, ends badly."""
        before = len(self.kept(".json"))
        window = self.open(model or self.model)
        window.wait_open(os.path.basename(model or self.model))
        window.key("p")
        window.wait(lambda: len(self.kept(".json")) > before and self.is_parallel(self.kept(".json")[-1]), "the scene is not kept")
        self.assertEqual(window.end(sign), -sign)

    def accept(self, window):
        """From the view back to the bar above it: its cross, then its button."""
        window.key("shift+Tab", "shift+Tab", "Return")

    def refuse(self, window):
        window.key("shift+Tab", "Return")

    def test_crash_is_offered(self):
        for sign in (signal.SIGKILL, signal.SIGKILL if SANITIZED else signal.SIGSEGV):  # a sanitizer catches the latter
            self.crash(sign)
            window = self.open()
            self.accept(window)
            window.wait_open("flow.tlod")
            window.wait(lambda: len(self.kept(".json")) == 1 and len(self.kept(".lock")) == 1, "the files of the crashed window stay")
            self.assertTrue(self.is_parallel(self.kept(".json")[0]))
            self.assertEqual(window.end(), 0)
            self.assertEqual(self.kept(""), [])

    def test_refused(self):
        self.crash()
        window = self.open()
        self.refuse(window)
        window.wait(lambda: len(self.kept(".lock")) == 1, "what was refused stays")
        self.assertEqual(window.title(), "tetralod")
        self.assertEqual(window.end(), 0)
        self.assertEqual(self.kept(""), [])

    def test_not_answered(self):
        """It is asked again; also a window that crashed over the question."""
        self.crash()
        self.assertEqual(self.open().end(), 0)
        self.assertEqual(self.open().end(signal.SIGKILL), -signal.SIGKILL)
        window = self.open()
        self.accept(window)
        window.wait_open("flow.tlod")

    def test_asked_to_end(self):
        """By its user or by the system: no crash."""
        for sign in (None, signal.SIGTERM, signal.SIGINT):
            window = self.open(self.model)
            window.wait_open("flow.tlod")
            window.wait(lambda: self.kept(".json"), "the scene is not kept")
            self.assertEqual(window.end(sign), 0)
            self.assertEqual(self.kept(""), [])

    def test_two_windows(self):
        """What a window shows that is open is not offered to another; of two that crashed the last comes first."""
        other = self.at("other.tlod")
        shutil.copy(self.model, other)
        first = self.open(self.model)
        first.wait_open("flow.tlod")
        first.wait(lambda: self.kept(".json"), "the scene is not kept")
        plain = self.open()
        empty = self.display.screen()
        self.assertEqual(plain.end(), 0)
        self.assertEqual(first.end(signal.SIGKILL), -signal.SIGKILL)
        self.crash(model=other)
        window = self.open()
        window.key("shift")
        self.assertGreater(np.abs(self.display.screen().astype(int) - empty).sum(), 0)
        self.accept(window)
        window.wait_open("other.tlod")
        second = self.open()
        self.accept(second)
        second.wait_open("flow.tlod")

    def test_recent_files_of_two_windows(self):
        other = self.at("other.tlod")
        shutil.copy(self.model, other)
        first = self.open(self.model)
        first.wait_open("flow.tlod")
        second = self.open(other)
        second.wait_open("other.tlod")
        self.assertEqual([second.end(), first.end()], [0, 0])
        ini = configparser.ConfigParser()
        ini.read(os.path.join(self.state, "tetralod", "viewer.ini"))
        self.assertEqual(ini["viewer"]["recent"], f"{other};{self.model};")

    def spoil(self, change):
        """Nothing is offered of a session that change has spoilt, and it is taken away."""
        self.crash()
        change(self.kept(".json")[-1])
        window = self.open()
        self.accept(window)
        time.sleep(0.5)
        self.assertEqual(window.title(), "tetralod")
        self.assertEqual(len(self.kept(".lock")), 1)
        self.assertEqual(window.end(), 0)
        self.assertEqual(self.kept(""), [])

    def test_spoilt(self):
        def write(text):
            def change(path):
                with open(path, "w", encoding="utf-8") as f:
                    f.write(text)
            return change
        self.spoil(write(""))
        self.spoil(write('{"tetralod_scene": 1, "camera": {"position": "here"}}'))
        self.spoil(lambda path: write("\0\0[viewer")(path.replace(".json", ".ini")))
        self.spoil(os.remove)

    def test_data_are_gone(self):
        """Said in the window; it is offered again, as the disk may come back."""
        lost = self.at("lost.tlod")
        shutil.copy(self.model, lost)
        self.crash(model=lost)
        os.rename(lost, self.at("away.tlod"))
        window = self.open()
        self.accept(window)
        time.sleep(0.5)
        self.assertEqual(window.title(), "tetralod")
        self.assertEqual(window.end(), 0)
        os.rename(self.at("away.tlod"), lost)
        window = self.open()
        self.accept(window)
        window.wait_open("lost.tlod")

    def works(self, what):
        """A window opens, shows and ends well, whatever the state is."""
        window = self.open(self.model)
        window.wait_open("flow.tlod")
        window.key("p")
        time.sleep(SAVED_SECONDS + 1)
        self.assertEqual(window.end(), 0, what)
        self.assertEqual(window.said(), "", what)

    def test_state_that_cannot_be(self):
        folder = os.path.join(self.state, "tetralod")
        with open(folder, "w", encoding="ascii"):  # a file where the folder should be
            pass
        self.works("a file")
        os.remove(folder)
        os.mkdir(folder)
        with open(os.path.join(folder, "viewer.ini"), "wb") as f:
            f.write(os.urandom(500))
        self.works("noise")
        shutil.rmtree(self.state)
        self.works("no folder")
        self.state = "/dev/full/none"
        self.works("no folder can be")

    def test_disk_is_full_or_read_only(self):
        folder = os.path.join(self.state, "tetralod")
        os.mkdir(folder)
        for options in ("size=4k,nr_inodes=3", "ro"):
            if subprocess.run(["mount", "-t", "tmpfs", "-o", options, "none", folder], capture_output=True, check=False).returncode:
                self.skipTest("no file system can be mounted here")
            try:
                self.works(options)
            finally:
                subprocess.run(["umount", folder], check=True)


if __name__ == "__main__":
    unittest.main()
