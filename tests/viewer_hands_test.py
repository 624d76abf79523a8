"""The view by real events of pointer and keys: the camera, handles of planes and boxes, the probe."""

import time
import unittest

import numpy as np
from viewer_case import HandsTest, numbers


class Camera(HandsTest):
    def test_drag_turns(self):
        before, after, undone = map(numbers, self.act((lambda: None, ["camera.position"]),
                                                      (lambda: self.drag(self.part(0.3, 0.7), self.part(0.6, 0.6)), ["camera.position", "undo", "camera.position"])))
        self.assertGreater(np.linalg.norm(before - after), 0.1)
        self.assertLess(np.linalg.norm(before - undone), 1e-9)

    def test_wheel_zooms(self):
        def wheel():
            self.move(self.part(0.5, 0.5))
            self.display.tool("click", "--repeat", 4, "--delay", 30, 4)
        far, near = map(numbers, self.act((lambda: None, ["camera.position"]), (wheel, ["camera.position"])))
        self.assertGreater(np.linalg.norm(far - near), 0.1)

    def test_keys(self):
        def press():
            self.click(self.part(0.9, 0.9))
            self.key("5")
        position, focus = map(numbers, self.act((press, ["camera.position", "camera.focal_point"])))
        self.assertGreater((position - focus)[2], 0.99 * np.linalg.norm(position - focus))  # from above


class Probe(HandsTest):
    LINES = ["key i"]

    def test_hovers(self):
        def hover():
            for x in (0.4, 0.45, 0.5):
                self.move(self.part(x, 0.35))
                time.sleep(0.1)
        self.act((hover, ["print-tools"]))
        self.assertTrue(any(line.startswith("position") for line in self.said), self.said)
        self.assertTrue(any(line.startswith("pressure") for line in self.said), self.said)


# Parts of handles, as print-tools names them.
SHIFT, TILT, CARRY, FACE = 1, 2, 4, 5


class Handles(HandsTest):
    """Planes and boxes follow the pointer, in perspective and in parallel, nearer and farther; a drag is one step of undo."""
    REACH_PX = 4  # a handle ends no farther from the pointer

    def pull(self, name, part, along):
        """Events that drag a handle; along(handles) says from where to where."""
        def events():
            start = self.handles[name][part]
            step = along(self.handles[name])
            self.target = (start[0] + step[0], start[1] + step[1])
            self.drag(start, self.target)
        return events

    def follows(self, name, part):
        """The handle is where the pointer has left it."""
        def events():
            found = self.handles[name][part]
            self.assertLess(np.hypot(found[0] - self.target[0], found[1] - self.target[1]), self.REACH_PX, f"{name} {part}: {found}, not {self.target}")
        return events

    def try_all(self, lines, prop, *pulls):
        """Pulls are (part, along, does it follow, check(before, after)), for each camera: in perspective, in parallel, and nearer."""
        self.LINES = lines
        name, rounds, checks = prop.split(".")[0], [(lambda: None, [prop])], []
        for number, camera in enumerate((["view 25,20"], ["key p", "scroll 300 300 2"], ["key p", "scroll 300 300 -3.5"])):
            rounds.append((lambda: None, camera))
            for part, along, is_followed, check in pulls[number % len(pulls)]:
                rounds.append((self.pull(name, part, along), [prop]))
                rounds.append((self.follows(name, part) if is_followed else lambda: None, ["undo", prop]))
                checks.append((camera, part, check))
        first, *answers = map(numbers, self.act(*rounds))
        self.assertEqual(len(answers), 2 * len(checks))
        for (camera, part, check), after, undone in zip(checks, answers[::2], answers[1::2]):
            with self.subTest(camera=camera, part=part):
                self.assertTrue(check(first, after), f"{first} became {after}")
                self.assertEqual(list(undone), list(first))

    @staticmethod
    def moved(first, after):
        """A plane along its normal."""
        normal = first[3:]
        step = after[:3] - first[:3]
        return np.allclose(after[3:], normal) and np.linalg.norm(step) > 0.02 and np.linalg.norm(np.cross(step, normal)) < 1e-6

    @staticmethod
    def turned(first, after):
        cosine = first[3:] @ after[3:] / np.linalg.norm(first[3:]) / np.linalg.norm(after[3:])
        return np.allclose(after[:3], first[:3]) and 0.2 < cosine < 0.999

    def arrow(self, handles):
        """Along the arrow of a plane, 40 pixels."""
        step = np.subtract(handles[TILT], handles[SHIFT])
        return 40 * step / np.linalg.norm(step)

    def check_plane(self, lines, prop):
        self.try_all(lines, prop, [(SHIFT, self.arrow, True, self.moved), (TILT, lambda _: (25, 30), False, self.turned)])

    def test_slice(self):
        self.check_plane(["set volume1.visible off", "add slice plane=y color_by=pressure", "select slice1"], "slice1.plane")

    def test_clip(self):
        self.check_plane(["add clip plane=x", "select clip1"], "clip1.plane")

    def test_dot_selects(self):
        """Of a slice that is not selected a dot is there; dragging that moves it at once."""
        self.LINES = ["set volume1.visible off", "add slice plane=y color_by=pressure", "select volume1", "view 25,20"]
        before, after = map(numbers, self.act((lambda: None, ["slice1.plane"]), (self.pull("slice1", SHIFT, lambda _: (40, 0)), ["slice1.plane"])))
        self.assertTrue(self.moved(before, after))

    def check_box(self, lines, prop):
        def side(axis, far):
            def along(handles):
                step = np.subtract(handles[FACE + 2 * axis], handles[FACE + 2 * axis + 1])
                return 0.3 * (step if far else -step)

            def check(first, after):
                step = after - first
                here = axis + 3 * far
                return (step[here] < 0) == far and abs(step[here]) > 0.01 and not np.delete(step, here).any()
            return FACE + 2 * axis + far, along, True, check

        def carried(first, after):
            step = after - first
            return np.linalg.norm(step) > 0.01 and np.allclose(step[:3], step[3:])
        carry = (CARRY, lambda _: (12, -9), True, carried)
        self.try_all([*lines, f"set {prop} -0.9 -0.8 -0.7 1 0.9 0.8"], prop, [side(0, 0), side(0, 1), carry], [side(1, 0), side(1, 1)], [side(2, 0), side(2, 1), carry])

    def test_box_of_lines(self):
        self.check_box(["set volume1.visible off", "add lines channel=velocity seeds=grid:20", "set lines1.has_box on", "select lines1"], "lines1.box")

    def test_box_of_focus(self):
        self.check_box(["set detail.focus on"], "detail.focus_box")

    def test_hidden_handles_are_not_hit(self):
        self.LINES = ["set volume1.visible off", "add slice plane=y color_by=pressure", "select slice1", "view 25,20"]
        def pull():
            self.start_at = self.handles["slice1"][SHIFT]
        before, after = self.act((pull, ["slice1.plane", "key g"]), (lambda: self.drag(self.start_at, np.add(self.start_at, (60, 0))), ["slice1.plane"]))
        self.assertEqual(before, after)


if __name__ == "__main__":
    unittest.main()
