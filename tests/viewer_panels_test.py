"""The panels of the viewer, by real events of pointer and keys: values dragged on histograms, control points of
transfer functions, maps, the list of what is shown, the level of detail. Each drag is one step of undo."""

import json
import time
import unittest

from render_test import pixels
from viewer_case import HandsTest, commas, make, numbers
from viewer_display import Display


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

    def test_wheel_zooms_about_the_pointer(self):
        """What is at the pointer stays, what is beside it is nearer; a double click on the numbers shows all again."""
        held, beside = self.place_of_value(150), self.place_of_value(200)
        at, away, again, near, back = map(float, self.act(
            (lambda: self.click(held()), ["surface1.value"]), (lambda: self.click(beside()), ["surface1.value"]),
            (lambda: (self.wheel(held(), 5), self.click(held())), ["surface1.value"]), (lambda: self.click(beside()), ["surface1.value"]),
            (lambda: (self.click(self.place("value", 150, -6), presses=2), self.click(beside())), ["surface1.value"])))
        self.assertAlmostEqual(again, at, delta=0.02 * abs(away - at))
        self.assertAlmostEqual((near - again) / (away - at), 0.8 ** 5, delta=0.05)
        self.assertAlmostEqual(back, away, delta=0.02 * abs(away - at))

    def place_of_value(self, x):
        return lambda: self.place("value", x, 40)

    def test_another_channel_has_a_value_of_its_own(self):
        """That of the one before would be nowhere in it. One step of undo."""
        def choose():
            self.click(self.place("channel", 60, 10))
            time.sleep(0.4)
            self.key("Down", "Down", "Return")
        self.CONTROLS = [*self.CONTROLS, "channel"]
        ask = ["surface1.channel", "surface1.value"]
        channel, value, *before = self.act((choose, [*ask, "undo", *ask]))
        self.assertEqual(channel, "velocity")
        self.assertNotEqual(value, "0.02")
        self.assertEqual(before, ["pressure", "0.02"])

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


class Commas(HandsTest):
    """Numbers as they are written where they have commas, and as the program shows them."""
    LINES = ["set volume1.visible off", "add slice", "add surface channel=pressure value=0.02", "select surface1"]
    CONTROLS = ["value-entry"]

    def test_both_are_understood(self):
        variables = commas(self.folder)
        if not variables:
            self.skipTest("localedef makes no locale with commas")
        comma, point, both = self.act((lambda: self.type("value-entry", "0,0125"), ["surface1.value"]),
                                      (lambda: self.type("value-entry", "0.025"), ["surface1.value"]),
                                      (lambda: self.type("value-entry", "1.000,5"), ["surface1.value"]), env=variables)
        self.assertEqual([comma, point, both], ["0.0125", "0.025", "0.025"])

    def test_places_are_understood(self):
        variables = commas(self.folder)
        if not variables:
            self.skipTest("localedef makes no locale with commas")
        self.LINES, self.CONTROLS = [*self.LINES, "select slice1"], ["plane"]
        words, several = self.act((lambda: self.type("plane", "x=0,5"), ["slice1.plane"]),
                                  (lambda: self.type("plane", "0,5 0 0 0 0 1"), ["slice1.plane"]), env=variables)
        self.assertEqual(numbers(words)[[0, 3, 4, 5]].tolist(), [0.5, 1, 0, 0])
        self.assertEqual(numbers(several).tolist(), [0.5, 0, 0, 0, 0, 1])


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

    def test_end_of_the_range_is_held_when_it_is_not_seen(self):
        def zoom():
            self.wheel(self.place("points", 0.5 * self.places["points"][2], 60), 8)

        def drag():  # its marker stands at the left end
            self.drag(self.place("points", 6, 140), self.place("points", 60, 140))
        before, after = self.act((zoom, ["transfer1.range"]), (drag, ["transfer1.range"]))
        before, after = ([float(word) for word in text.replace(",", " ").split()] for text in (before, after))
        self.assertEqual(before, [-0.1, 0.1])
        self.assertEqual(after[1], 0.1)
        self.assertTrue(-0.05 < after[0] < 0.05, after)

    def test_double_click_asks_for_exact_numbers(self):
        def value():  # of the point at the right end of the line, above the end of the range
            left, right = self.place("points", 9, 0), self.place("points", -9, 0)
            self.click((left[0] + (right[0] - left[0]) * 1.3 / 1.6, left[1] + 8), presses=2)
            self.key("0", "period", "0", "8", "7", "5", "Return")

        def color():
            left, right = self.place("points", 9, 0), self.place("points", -9, 0)
            self.click((left[0] + (right[0] - left[0]) * 1.3 / 1.6, left[1] + 140), presses=2)
            time.sleep(1)
            self.windows = self.display.tool("search", "--all", "--onlyvisible", "--pid", self.viewer.child.pid, "--name", "Pick").split()
            self.key("Escape")
        rows, _ = self.act((lambda: None, ["set transfer1.opacities \"-0.1,0 0.1,0.98765\""]), (value, ["transfer1.opacities", "set transfer1.colors \"-0.1,0,0,1 0.1,1,0,0\"", "wait settled"]), (color, ["transfer1.colors"]))
        self.assertEqual(self.rows(rows)[-1], [0.0875, 0.98765])  # what was not written stays
        self.assertEqual(len(self.windows), 1)

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
    CONTROLS = ["add", "volume1", "remove", "add-surface"]

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

    def test_isosurfaces_are_one_click_each(self):
        def add():
            for _ in range(3):
                self.click(self.place("add-surface", 20, 12))
                time.sleep(1.5)  # the picture says which values are free
        *values, first, third = self.act((add, ["surface1.value", "surface2.value", "surface3.value", "surface1.opacity", "surface3.opacity"]))
        self.assertEqual(len(set(values)), 3, values)
        self.assertEqual(float(first), 1)
        self.assertLess(float(third), 1)  # what is inside of it is seen

    def test_rows_are_dragged(self):
        names = ["new surface", "wait settled", "new slice", "wait settled", "where surface1", "where slice1"]

        def order(name):
            with open(self.at(name), encoding="utf-8") as f:
                return [thing["name"] for thing in json.load(f)["things"] if thing["kind"] != "transfer"]
        self.act((lambda: None, names),
                 (lambda: self.drag(self.place("slice1", 100, 12), self.place("volume1", 100, 4)), ["save-scene " + self.at("up.json")]),
                 (lambda: self.drag(self.place("volume1", 100, 12), self.place("slice1", 100, -3)), ["save-scene " + self.at("down.json"), "undo", "undo",
                                                                                                "save-scene " + self.at("back.json")]))
        self.assertEqual(order("up.json"), ["slice1", "volume1", "surface1"])
        self.assertEqual(order("down.json"), ["volume1", "surface1", "slice1"])
        self.assertEqual(order("back.json"), ["volume1", "surface1", "slice1"])

    def test_eye(self):
        hidden, shown = self.act((lambda: self.click(self.place("volume1", 18, 13)), ["volume1.visible", "undo", "volume1.visible"]))
        self.assertEqual([hidden, shown], ["off", "on"])

    def test_all_is_in_view_at_first(self):
        """The camera that was chosen while the window took its size is that of the window."""
        for size in (self.SIZE, "800x600"):
            said, _ = self.play(["wait settled", "get camera.position", "fit", "wait settled", "get camera.position"], self.model, "--size", size)
            first, fitted = ([float(word) for word in line.split()[2:]] for line in said)
            for a, b in zip(first, fitted):
                self.assertAlmostEqual(a, b, delta=1e-6)

    def test_each_kind_shows_something(self):
        kinds = ["surface", "slice", "boundary", "edges", "silhouettes", "points", "lines", "clip", "threshold", "derive", "volume"]
        self.play([line for kind in kinds for line in ("new " + kind, "wait settled")], self.model, "--size", self.SIZE)


class Detail(HandsTest):
    CONTROLS = ["error_px-slider", "error_px", "detail-more"]
    ASKED = ["detail.full", "detail.error_px"]

    def asked(self, *rounds):
        answers = self.act(*((events, [*self.ASKED, *more]) for events, *more in rounds))
        return list(zip(answers[::2], answers[1::2]))

    def test_slider(self):
        """The fine end is the exact mesh, the coarse one many pixels; a drag is one step."""
        def fine():
            self.drag(self.place("error_px-slider", 60, 8), self.place("error_px-slider", 4, 8))

        def coarse():
            self.drag(self.place("error_px-slider", 12, 8), self.place("error_px-slider", -8, 8))
        finest, before, coarsest, again = self.asked((fine, "undo", *self.ASKED), (coarse, "undo", *self.ASKED))
        self.assertEqual(finest[0], "on")
        self.assertEqual(before, ("off", "1"))
        self.assertEqual(coarsest[0], "off")
        self.assertGreater(float(coarsest[1]), 30)
        self.assertEqual(again, ("off", "1"))

    def test_words(self):
        exact, some, none, zero = self.asked((lambda: self.type("error_px", "exact"),), (lambda: self.type("error_px", "2.5"),),
                                             (lambda: self.type("error_px", "much"),), (lambda: self.type("error_px", "0"),))
        self.assertEqual(exact[0], "on")
        self.assertEqual(some, ("off", "2.5"))
        self.assertEqual(none, some)
        self.assertEqual(zero[0], "on")

    def test_no_bound_is_a_switch(self):
        opened, none, again = self.asked((lambda: self.click(self.place("detail-more", 20, 10)), "where no-bound"),
                                         (lambda: self.click(self.place("no-bound", 10, 10)),), (lambda: self.click(self.place("no-bound", 10, 10)),))
        self.assertEqual(opened, ("off", "1"))
        self.assertEqual(none, ("off", "0"))
        self.assertEqual(again, ("off", "1"))

    def figures(self, said):
        return dict(line.split(" ", 2)[1:] for line in said if line.startswith("figure "))

    def test_figures_say_that_they_pass(self):
        """What is asked for is not on the screen yet: they belong to the past, and the window says so."""
        coarse, passing, fine = "coarse", "passing", "fine"
        lines = []
        for name, before in ((coarse, ["set detail.tets 5000", "wait settled"]), (passing, ["set detail.tets 0"]), (fine, ["wait settled"])):
            lines += [*before, "print " + name, "figures"]
        said, _ = self.play(["wait settled", *lines], self.model, "--size", self.SIZE)
        found = {name: self.figures(said[said.index(name) + 1:][:9]) for name in (coarse, passing, fine)}
        self.assertEqual([found[name]["state"] for name in found], ["at rest", "refining", "at rest"])
        self.assertEqual(found[passing]["tets"], found[coarse]["tets"])
        self.assertNotEqual(found[fine]["tets"], found[coarse]["tets"])
        for name in ("error", "tets", "patches", "frame", "memory", "read"):
            self.assertTrue(found[fine][name], name)

    def test_figures_of_a_mesh_that_lost_a_peak(self):
        """The surface of a value that is nowhere has no place, in pixels: the values themselves are promised."""
        grid, model = self.at("hills.vtu"), self.at("hills.tlod")
        make("sample", "gaussians", "-o", grid, "--size", "24")
        make("build", grid, "-o", model)
        said, _ = self.play(["set detail.error_px 0", "set detail.tets 2000", "wait settled", "figures"], model, "--size", self.SIZE)
        found = self.figures(said)
        self.assertRegex(found["error"], r"^value ± 0\.\d+$")
        self.assertEqual(found["error"], found["channels"])

    def test_figures_are_of_what_is_shown(self):
        """Streamlines need a mesh with all channels; one of them is shown. Of the coarsest mesh there is one patch."""
        said, _ = self.play(["wait settled", "set volume1.visible off", "add lines channel=velocity", "set detail.tets 1", "wait settled", "figures"],
                            self.model)
        found = self.figures(said)
        self.assertRegex(found["channels"], "^velocity ± [0-9.e-]+$")
        self.assertEqual(found["patches"], "1 patch")

    def test_messages_leave_the_picture_its_size(self):
        said = self.start(["wait settled", "print-tools", "key copy-probe", "wait 1", "print-tools", "quit"], self.model, "--size", self.SIZE).end()[1]
        views = [line for line in said if line.startswith("view\t")]
        self.assertEqual(views[0], views[1])

    def test_tips_are_at_words_alone(self):
        """None over what one works on: they are windows of their own."""
        def hover(place):
            self.move((2, 2))
            time.sleep(0.3)
            self.move(place)
            self.move((place[0] + 1, place[1]))
            time.sleep(1.4)
            return len(self.display.tool("search", "--all", "--onlyvisible", "--pid", self.viewer.child.pid).split())
        counts = []

        def events():
            counts.extend(hover(self.place(*place)) for place in (("error_px-slider", -60, 8), ("points", 100, 60), ("map", 50, 12), ("error_px-word", 10, 8)))
        self.CONTROLS = [*self.CONTROLS, "points", "map", "error_px-word"]
        self.act((events, ["detail.full"]))
        self.assertEqual(counts[:3], [counts[0]] * 3)
        self.assertGreater(counts[3], counts[0])  # its word has one


class Keys(HandsTest):
    # Not tried: what opens a dialog or another window, ends the program, or does not rest.
    LEFT = {"keys", "close", "open", "save-scene", "save-picture", "save-frames", "build-model", "full-screen", "spin"}
    NAMES = {"<Control>": "ctrl+", "<Shift>": "shift+"}

    def rows(self, said, where):
        return [line.split("\t")[1:] for line in said if line.startswith(where + "\t")]

    def test_the_page_has_all_keys(self):
        said, _ = self.play(["wait settled", "print-keys"], self.model, "--size", self.SIZE)
        table, page = self.rows(said, "table"), self.rows(said, "page")
        self.assertGreater(len(table), 40)
        self.assertEqual(sorted(page), sorted(row for row in table if row[1] and row[2]))
        self.assertEqual({row[0] for row in table if row[1] and not row[2]}, {"turn-left", "turn-right", "turn-up", "turn-down"})  # one row: "Arrow keys"
        keys = [key for row in table if row[0] for key in row[1].split()]
        self.assertEqual(len(keys), len(set(keys)))

    def test_each_key_does_what_the_page_says(self):
        said, _ = self.play(["wait settled", "print-keys"], self.model, "--size", self.SIZE)
        wanted = [(row[0], key) for row in self.rows(said, "page") for key in row[1].split() if row[0] and row[0] not in self.LEFT]
        self.assertGreater(len(wanted), 30)

        def press(name):
            for written, typed in self.NAMES.items():
                name = name.replace(written, typed)
            self.key(name)
        self.CONTROLS = ["add"]
        # undo and redo have something to do
        self.act((lambda: self.move((300, 300)), ["set volume1.lit on", "seal"]), *((lambda key=key: press(key), ["print-keys ran"]) for _, key in wanted))
        self.assertEqual([row[0] for row in self.rows(self.said, "ran")], [name for name, _ in wanted])


class Scale(HandsTest):
    """Pixels of the screen that are twice as many as those of the window."""

    def test_twice_the_pixels(self):
        seen = {}
        for scale, size in ((1, "1280x900"), (2, "2560x1800")):
            display = Display(size)
            self.addCleanup(display.close)
            said, _ = self.play(["key handles", "set volume1.visible off", "add surface channel=pressure value=0.1", "set camera.position 6 -9 5", "set camera.focal_point 0 0 0", "wait settled", "print-tools",
                                 "probe 400 380", "wait settled", "print-tools", "picture " + self.at(f"{scale}.png")],
                                self.model, "--size", "900x700", display=display, env={"GDK_SCALE": str(scale)})
            seen[scale] = ([line for line in said if line.startswith("view")][0],
                           [float(word) for line in said if line.startswith("position") for word in line.replace(",", " ").split()[1:4]], pixels(self.at(f"{scale}.png")))
        self.assertEqual(seen[1][0], seen[2][0])
        self.assertEqual(tuple(2 * side for side in seen[1][2].shape[:2]), seen[2][2].shape[:2])
        self.assertEqual(len(seen[1][1]), 3)
        for one, two in zip(seen[1][1], seen[2][1]):
            self.assertAlmostEqual(one, two, delta=0.02)


if __name__ == "__main__":
    unittest.main()
