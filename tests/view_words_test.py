"""The verb view where there is no window: wrong use, no display, a build without the viewer."""

import os
import shutil
import subprocess
import tempfile
import unittest

PROGRAM = os.environ["TETRALOD_PROGRAM"]
VIEWER = os.path.join(os.path.dirname(PROGRAM), "tetralod-view")


def run(program, *words):
    env = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return subprocess.run([program, *words], capture_output=True, text=True, check=False, timeout=60, env=env)


class Words(unittest.TestCase):
    def test_wrong_words_are_refused_by_the_verb(self):
        for words, said in ((["--sise", "3x4"], "unknown option '--sise'; did you mean '--size'?"),
                            (["a.tlod", "b.tlod"], "'b.tlod' is one too many"),
                            (["--renderer", "vulkan"], "--renderer")):
            done = run(PROGRAM, "view", *words)
            self.assertEqual(done.returncode, 2, words)
            self.assertIn(said, done.stderr)

    def test_a_build_without_the_viewer_says_so(self):
        with tempfile.TemporaryDirectory() as folder:
            lone = shutil.copy(PROGRAM, folder)
            done = run(lone, "view", "a.tlod")
        self.assertEqual(done.returncode, 1)
        self.assertIn("libgtk-4-dev", done.stderr)
        self.assertIn("tetralod render", done.stderr)


@unittest.skipUnless(os.path.exists(VIEWER), "this build has no viewer")
class Viewer(unittest.TestCase):
    def test_without_a_display_it_says_so(self):
        for words in (["view"], ["view", "nothing.tlod", "--script", "-"]):
            done = run(PROGRAM, *words)
            self.assertEqual(done.returncode, 1)
            self.assertIn("there is no display", done.stderr)
            self.assertIn("tetralod render", done.stderr)

    def test_wrong_words_are_refused_by_the_program_itself(self):
        for words in (["--size", "10"], ["--size", "0x0"], ["--size", "640x480x3"], ["--threads", "-1"],
                      ["--renderer", "vulkan"], ["a.tlod", "b.tlod"], ["--nonsense"]):
            done = run(VIEWER, *words)
            self.assertEqual(done.returncode, 2, f"{words}: {done.stderr}")
            self.assertTrue(done.stderr.startswith("tetralod-view: "), done.stderr)


if __name__ == "__main__":
    unittest.main()
