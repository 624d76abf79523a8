"""The tour of viewer_test.py on real data, and a longer flight: memory stays where it is."""

import os
import unittest

from viewer_case import SIZE, ViewerTest, make
from viewer_display import SANITIZED
from viewer_monkey import lines_of, torment
from viewer_test import TourTest

DATA = os.environ.get("TETRALOD_DATA")
FLIGHT_SECONDS = 90
MONKEY_SECONDS = 60


class RealData(TourTest):
    def setUp(self):
        if not DATA:
            self.skipTest("no real data: TETRALOD_DATA is not set")

    def test_blunt_fin(self):
        model = self.at("fin.tlod")
        make("build", os.path.join(DATA, "curvilinear", "bluntfin.vtk"), "-o", model)
        self.tour(model, "volume1", "Density", 1.2, "Momentum")

    def test_bracket(self):
        """A part without a model: a mesh file, as it is."""
        self.tour(os.path.join(DATA, "tet", "bracket_appended_compressed.vtu"), "boundary1", "xdsp", 0)


class Flight(ViewerTest):
    def test_memory_is_flat(self):
        rounds = FLIGHT_SECONDS // 6
        lines = ["turn 120 20 2", "turn 120 -20 2", "turn 120 0 2", "wait settled", "print around"]
        viewer = self.start(["add surface channel=pressure value=0.2", "wait settled", *(rounds * lines), "quit"], self.model, "--size", SIZE)
        kept = []
        for _ in range(rounds):
            viewer.until("around")
            kept.append(viewer.status("VmRSS"))
        self.assertEqual(viewer.end()[0], 0)
        if not SANITIZED:
            self.assertLess(max(kept[rounds // 2:]), 1.05 * max(kept[:rounds // 2]), kept)


class Monkeys(ViewerTest):
    def test_events_at_random(self):
        """Whatever is pressed where, the viewer goes on until it is asked to end, and ends well."""
        events, status, err, log = torment([self.model], 7, MONKEY_SECONDS, self.folder, cwd=self.folder)
        self.assertEqual(status, 0, (events, err[-3000:], log))

    def test_commands_in_odd_order(self):
        """While a file is opened, played or saved, and with the events of the other monkey."""
        files = [self.model, self.at("flow.vtu")]
        lines = list(lines_of(11, files, 400, self.folder))
        events, status, err, log = torment(files, 8, MONKEY_SECONDS, self.folder, lines, cwd=self.folder)
        self.assertIn(status, (0, 1), (events, err[-3000:], log))  # 1: a note of an error ends a script
        self.assertNotIn("Sanitizer", err)


if __name__ == "__main__":
    unittest.main()
