"""A display of its own (Xvfb, or Weston for Wayland) and the viewer on it, for the tests of the viewer."""

import os
import select
import shutil
import subprocess
import tempfile
import time

import numpy as np

PROGRAM = os.environ["TETRALOD_PROGRAM"]
VIEWER = os.path.join(os.path.dirname(PROGRAM), "tetralod-view")
SANITIZED = bool(os.environ.get("TETRALOD_SANITIZE"))
PATIENCE = 250 if SANITIZED else 120  # seconds for a run


def missing():
    """Why the viewer can't be tested here; None: it can."""
    if not os.path.exists(VIEWER):
        return "the viewer was not built: there is no GTK 4"
    for tool in ("Xvfb", "xdotool"):
        if not shutil.which(tool):
            return f"{tool} is not installed"
    return None


class Display:
    """Xvfb on a number that is free; close ends it."""

    def __init__(self, size="1280x900"):
        self.folder = tempfile.mkdtemp(prefix="tetralod-display-")  # of the file that is the screen
        reading, writing = os.pipe()
        self.server = subprocess.Popen(["Xvfb", "-displayfd", str(writing), "-screen", "0", size + "x24", "-nolisten", "tcp", "-noreset",
                                        "-fbdir", self.folder],
                                       pass_fds=[writing], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(writing)
        number = ""
        while not number.endswith("\n") and select.select([reading], [], [], 30)[0]:
            part = os.read(reading, 32).decode()
            number += part or "\n"
        os.close(reading)
        number = number.strip()
        if not number:
            self.close()
            raise RuntimeError("Xvfb does not start")
        self.name = ":" + number
        self.variables = {"DISPLAY": self.name, "GDK_BACKEND": "x11"}

    def close(self):
        self.server.terminate()  # it takes its socket along
        self.server.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def screen(self):
        """What is on it now: [height, width, 3], the upper row first."""
        whole = np.fromfile(os.path.join(self.folder, "Xvfb_screen0"), dtype=np.uint8)
        head = whole[:100].view(">u4")
        size, width, height, bits, row, colors = (int(head[i]) for i in (0, 4, 5, 11, 12, 19))
        assert bits == 32
        image = whole[size + 12 * colors:][:row * height].reshape(height, row)[:, :4 * width].reshape(height, width, 4)
        return image[..., 2::-1]

    def window(self, viewer, name="tetralod"):
        """The window of a viewer of this name, in the words of xdotool."""
        return self.tool("search", "--all", "--onlyvisible", "--pid", viewer.child.pid, "--name", name).split()[-1]

    def names(self, viewer):
        """Of all its windows that are seen."""
        found = []
        try:
            for number in self.tool("search", "--all", "--onlyvisible", "--pid", viewer.child.pid, "--name", "").split():
                found.append(self.tool("getwindowname", number))
        except RuntimeError:
            pass  # one goes, or there is none
        return found

    def tool(self, *words):
        """xdotool; returns what it prints."""
        done = subprocess.run(["xdotool", *map(str, words)], env=dict(os.environ, DISPLAY=self.name),
                              capture_output=True, text=True, check=False, timeout=30)
        if done.returncode:
            raise RuntimeError(f"xdotool {words}: {done.stderr}")
        return done.stdout.strip()


class Weston:
    """A display of Wayland, without a screen; close ends it."""
    NAME = "tetralod-0"

    def __init__(self, size="1280x900"):
        self.folder = tempfile.mkdtemp(prefix="tetralod-wayland-")
        width, height = size.split("x")
        self.server = subprocess.Popen(["weston", "--backend=headless-backend.so", "--socket=" + self.NAME, "--no-config", "--idle-time=0",
                                        "--width=" + width, "--height=" + height], env=dict(os.environ, XDG_RUNTIME_DIR=self.folder),
                                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.variables = {"WAYLAND_DISPLAY": self.NAME, "GDK_BACKEND": "wayland", "XDG_RUNTIME_DIR": self.folder}
        end = time.monotonic() + 30
        while not os.path.exists(os.path.join(self.folder, self.NAME)):
            if self.server.poll() is not None or time.monotonic() > end:
                self.close()
                raise RuntimeError("Weston does not start")
            time.sleep(0.05)

    def close(self):
        self.server.terminate()
        self.server.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def environment(display, folder, **more):
    """Nothing of the user's: state and settings lie in the folder, no session bus is asked for."""
    result = dict(os.environ, HOME=folder, XDG_STATE_HOME=folder, XDG_CONFIG_HOME=folder, XDG_CACHE_HOME=folder,
                  XDG_DATA_HOME=folder, XDG_RUNTIME_DIR=folder, GSETTINGS_BACKEND="memory", GTK_A11Y="none",
                  DBUS_SESSION_BUS_ADDRESS="disabled:")
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "GDK_BACKEND"):
        result.pop(name, None)
    if display:
        result.update(display.variables)
    result.update(more)
    return result


class Viewer:
    """A viewer that runs a script, line by line as it is written, or none where lines is None; talks on its standard output."""

    def __init__(self, display, folder, lines, *words, env=None, **options):
        if lines is not None:
            with tempfile.NamedTemporaryFile("w", suffix=".txt", dir=folder, delete=False, encoding="utf-8") as script:
                script.write("\n".join(lines) + "\n")
            words = (*words, "--script", script.name)
        self.child = subprocess.Popen([PROGRAM, "view", *map(str, words)],
                                      env=environment(display, folder, **(env or {})), stdin=subprocess.DEVNULL,
                                      stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)
        self.said = []

    def until(self, word):
        """Reads lines up to one that begins with word, and returns it."""
        for line in self.child.stdout:
            self.said.append(line.rstrip("\n"))
            if line.startswith(word):
                return self.said[-1]
        raise AssertionError(f"the viewer ended before it said '{word}': {self.said} {self.child.stderr.read()}")

    def end(self):
        """Waits for it; (status, lines of stdout, stderr)."""
        try:
            out, err = self.child.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self.child.kill()
            out, err = self.child.communicate()
            raise AssertionError(f"the viewer did not end: {self.said} {out} {err}") from None
        return self.child.returncode, self.said + out.splitlines(), err

    def status(self, key):
        """A number of /proc/PID/status, kB."""
        with open(f"/proc/{self.child.pid}/status", encoding="ascii") as f:
            for line in f:
                if line.startswith(key + ":"):
                    return int(line.split()[1])
        raise KeyError(key)

    def kill(self):
        if self.child.poll() is None:
            self.child.kill()
            self.child.communicate()

    def busy(self, seconds):
        """CPU seconds that all of its threads take in so many seconds."""
        def taken():
            with open(f"/proc/{self.child.pid}/stat", encoding="ascii") as f:
                fields = f.read().rsplit(")", 1)[1].split()
            return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        before = taken()
        time.sleep(seconds)
        return taken() - before
