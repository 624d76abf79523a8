"""The window goes while something is still going on in it: a slider or the view is dragged, an entry is written in. What
widgets do on their way out must not reach the parts that are gone."""

import signal
import time
import unittest

from viewer_case import ViewerTest

SIZE = "1200x860"


class End(ViewerTest):
    def ended(self, control, events, lines=()):
        """Ends a viewer from outside after events(x, y, width), given where a control is; it has to end well."""
        asks = "print-tools" if control == "view" else "where " + control
        viewer = self.start(["wait settled", *lines, "wait settled", "wait 0.4", asks, "wait 60"], self.model, "--size", SIZE)
        words = viewer.until("view" if control == "view" else "where").split()
        left, top, width, height = (float(word) for word in words[-4:])
        try:
            events(left, top + height / 2, width)
            viewer.child.send_signal(signal.SIGTERM)
            status, _, err = viewer.end()
        finally:
            self.display.tool("mouseup", 1)
        self.assertEqual((status, err), (0, ""))

    def hold(self, left, middle, width):
        """A drag that has begun and goes on."""
        for part in (0.4, 0.5, 0.6):
            self.display.tool("mousemove", int(left + part * width), int(middle))
            if part == 0.4:
                self.display.tool("mousedown", 1)
            time.sleep(0.1)
        self.display.tool("mousemove", int(left + 0.7 * width), int(middle))

    def write(self, left, middle, _):
        self.display.tool("mousemove", int(left + 20), int(middle))
        self.display.tool("click", 1)
        self.display.tool("key", "--delay", 40, "3")

    def test_a_slider_is_dragged(self):
        self.ended("error_px-slider", self.hold)

    def test_a_value_is_dragged(self):
        self.ended("value", self.hold, ["set volume1.visible off", "add surface channel=pressure value=0.02", "select surface1"])

    def test_the_view_is_dragged(self):
        self.ended("view", self.hold)

    def test_an_entry_is_written_in(self):
        self.ended("error_px", self.write)


if __name__ == "__main__":
    unittest.main()
