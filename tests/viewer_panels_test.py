"""The panels of the viewer, by real events of pointer and keys: values dragged on histograms, control points of
transfer functions, maps, the list of what is shown, the level of detail. Each drag is one step of undo."""

import time
import unittest

from viewer_case import HandsTest


class Values(HandsTest):
    """An isosurface: its value on the histogram, beside it, and its opacity."""
    LINES = ["set volume1.visible off", "add surface channel=pressure value=0.02", "select surface1"]
    CONTROLS = ["value", "value-entry", "opacity-slider"]

    def test_value_is_dragged(self):
        dragged, = self.act((lambda: self.drag(self.place("value", 80, 40), self.place("value", 200, 40)), ["surface1.value"]))
        self.assertNotEqual(float(dragged), 0.02)

    def test_a_drag_is_one_step(self):
        before, = self.act((lambda: self.drag(self.place("value", 80, 40), self.place("value", 200, 40)), ["undo", "surface1.value"]))
        self.assertEqual(float(before), 0.02)

    def test_clicks_and_keys(self):
        def keys():
            self.key("Right", "Right", "shift+Right", "Left")
        low, high, keyed = map(float, self.act((lambda: self.click(self.place("value", 60, 50)), ["surface1.value"]),
                                               (lambda: self.click(self.place("value", 200, 50)), ["surface1.value"]),
                                               (keys, ["surface1.value"])))
        self.assertLess(low, high)
        self.assertLess(high, keyed)

    def test_words_that_are_wrong_and_right(self):
        wrong, right = self.act((lambda: self.type("value-entry", "much"), ["surface1.value"]),
                                (lambda: self.type("value-entry", "-0.0123"), ["surface1.value"]))
        self.assertEqual(float(wrong), 0.02)
        self.assertEqual(float(right), -0.0123)

    def test_slider(self):
        def events():
            self.drag(self.place("opacity-slider", -12, 10), self.place("opacity-slider", 40, 10))
        opacity, before = self.act((events, ["surface1.opacity", "undo", "surface1.opacity"]))
        self.assertTrue(0.1 < float(opacity) < 0.9, opacity)
        self.assertEqual(float(before), 1)


class Colours(HandsTest):
    """A volume whose opacities have two points, at the ends of the range."""
    LINES = ["add transfer channel=pressure range_by=values range=\"-0.1 0.1\" opacities=\"-0.1,0 0.1,1\""]
    CONTROLS = ["points", "map", "low"]

    def rows(self, text):
        return [[float(number) for number in row.split(",")] for row in text.split()]

    def add(self):
        self.click(self.place("points", 100, 20), presses=2)

    def test_points_come_move_and_go(self):
        def move():
            left, right = self.place("points", 9, 60), self.place("points", -9, 60)
            self.drag(self.place("points", 100, 20), [(left[0] + right[0]) / 2, left[1]])

        def take_out():
            left, right = self.place("points", 9, 60), self.place("points", -9, 60)
            self.drag([(left[0] + right[0]) / 2, left[1]], self.place("points", -500, -400))
        added, moved, gone, back = map(self.rows, self.act((self.add, ["transfer1.opacities"]), (move, ["transfer1.opacities"]),
                                                           (take_out, ["transfer1.opacities", "undo", "transfer1.opacities"])))
        self.assertEqual(len(added), 3)
        self.assertAlmostEqual(moved[1][0], 0, delta=0.003)
        self.assertAlmostEqual(moved[1][1], 0.5, delta=0.02)
        self.assertEqual([row[0] for row in gone], [-0.1, 0.1])
        self.assertEqual(back, moved)

    def test_keys(self):
        def up():
            self.key("Up", "Up", "shift+Up")
        added, higher, gone = map(self.rows, self.act((self.add, ["transfer1.opacities"]), (up, ["transfer1.opacities"]),
                                                      (lambda: self.key("Delete"), ["transfer1.opacities"])))
        self.assertAlmostEqual(higher[1][1], min(added[1][1] + 0.12, 1), delta=0.001)
        self.assertEqual(len(gone), 2)

    def test_range_and_colours_on_the_strip(self):
        def drag_end():
            left, right = self.place("points", 9, 140), self.place("points", -9, 140)
            width = right[0] - left[0]
            # beside the range are 0.3 of its width, as there are values
            self.drag([left[0] + width * 0.3 / 1.6, left[1]], [left[0] + width / 2, left[1]])

        def add_color():
            self.click(self.place("points", -140, 126), presses=2)
        text, colors = self.act((drag_end, ["transfer1.range"]), (add_color, ["transfer1.colors"]))
        low, high = map(float, text.replace(",", " ").split())
        self.assertTrue(-0.1 < low < 0.1, text)
        self.assertEqual(high, 0.1)
        self.assertGreaterEqual(len(self.rows(colors)), 3)

    def test_map_and_range_are_chosen(self):
        def choose():
            self.click(self.place("map", 40, 12))
            time.sleep(0.4)
            self.key("Down", "Down", "Return")
        name, by, text = self.act((choose, ["transfer1.map", "set transfer1.range_by data"]),
                                  (lambda: self.type("low", "-0.05"), ["transfer1.range_by", "transfer1.range"]))
        self.assertNotEqual(name, "viridis")
        self.assertEqual(by, "values")
        self.assertEqual(float(text.replace(",", " ").split()[0]), -0.05)


class Things(HandsTest):
    CONTROLS = ["add", "volume1", "remove", "error_px-slider", "error_px"]

    def test_add_and_remove(self):
        def add():
            self.click(self.place("add", 20, 12))
            time.sleep(0.5)
            self.key("Return")  # the first one: an isosurface

        def remove():
            self.click(self.place("remove", 10, 12))
        # a name is free again once its node is gone
        channel, value = self.act((add, ["surface1.channel", "surface1.value"]), (remove, ["rename volume1 surface1"]))
        self.assertEqual(channel, "pressure")
        self.assertTrue(-1 < float(value) < 1)

    def test_eye(self):
        hidden, shown = self.act((lambda: self.click(self.place("volume1", 18, 13)), ["volume1.visible", "undo", "volume1.visible"]))
        self.assertEqual([hidden, shown], ["off", "on"])

    def test_error(self):
        def drag():
            self.drag(self.place("error_px-slider", 20, 10), self.place("error_px-slider", -12, 10))
        error, before, typed = self.act((drag, ["detail.error_px", "undo", "detail.error_px"]),
                                        (lambda: self.type("error_px", "2.5"), ["detail.error_px"]))
        self.assertGreater(float(error), 8)
        self.assertEqual(float(before), 1)
        self.assertEqual(float(typed), 2.5)

    def test_each_kind_shows_something(self):
        kinds = ["surface", "slice", "boundary", "edges", "silhouettes", "points", "lines", "clip", "threshold", "derive", "volume"]
        self.play([line for kind in kinds for line in ("new " + kind, "wait settled")], self.model, "--size", self.SIZE)


if __name__ == "__main__":
    unittest.main()
