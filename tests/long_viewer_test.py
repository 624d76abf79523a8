"""The tour of viewer_test.py on real data, and a longer flight: memory stays where it is."""

import os
import unittest

from viewer_case import SIZE, ViewerTest, make
from viewer_display import SANITIZED
from viewer_test import TourTest

DATA = os.environ.get("TETRALOD_DATA")
FLIGHT_SECONDS = 90


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


if __name__ == "__main__":
    unittest.main()
