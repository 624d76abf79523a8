"""The cost of simplifying grows linearly: a grid of 0.1, 1 and 10 M tets to a tenth, one channel."""

import json
import os
import subprocess
import unittest

PROGRAM = os.environ["TETRALOD_PROGRAM"]
VERTICES_ALONG = {"0.1 M": 28, "1 M": 60, "10 M": 127}
# Ten times the tets may cost this much more a tet: they leave the caches, a heap gets deeper.
COST_GROWTH_BOUND = 1.6
BYTES_PER_TET_BOUND = 120


class Linear(unittest.TestCase):
    def simplify(self, vertices_along):
        subprocess.run([PROGRAM, "sample", "gaussians", "-o", "in.vtu", "--size", str(vertices_along)],
                       check=True, capture_output=True)
        done = subprocess.run([PROGRAM, "simplify", "in.vtu", "-o", "out.vtu", "--ratio", "0.1", "--threads", "1", "--json"],
                              check=True, capture_output=True, text=True)
        result = json.loads(done.stdout)
        self.assertLessEqual(result["tets_out"], 0.1 * result["tets_in"])
        return result

    def test_cost_a_tet(self):
        costs = []
        for name, vertices_along in VERTICES_ALONG.items():
            r = self.simplify(vertices_along)
            costs.append(r["seconds"] / r["tets_in"])
            size = r["peak_bytes"] / r["tets_in"]
            print(f"{name}: {r['tets_in']} tets, {r['seconds']:.2f} s, {1e-3 / costs[-1]:.0f} k tets/s, {size:.0f} bytes a tet")
            print(f"memory {size:.1f} <= {BYTES_PER_TET_BOUND} {'ok' if size <= BYTES_PER_TET_BOUND else 'BROKEN'}", flush=True)
            with self.subTest(name):
                self.assertLessEqual(size, BYTES_PER_TET_BOUND)
        growth = costs[2] / costs[1]
        print(f"cost a tet, 10 M to 1 M: {growth:.2f} <= {COST_GROWTH_BOUND}", flush=True)
        self.assertLessEqual(growth, COST_GROWTH_BOUND)


if __name__ == "__main__":
    unittest.main()
