"""Walls that oscillate or follow a table are where the function says, go on bit for bit, and are refused in one line where they cannot be."""
import math
import unittest

import h5py
import numpy as np

from harness import SCENE, ProgramTest

FLOOR = SCENE[SCENE.index("[[wall]]") : SCENE.index("[step]")]
OSCILLATING = FLOOR.replace('"fixed"', '"oscillating"\namplitude = 0.02\nfrequency = 5\nphase = 0.3')
TABLE = FLOOR.replace('"fixed"', '"table"\nfile = "table.txt"')


def contents(path):
    """All datasets and attributes of a state."""
    found = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.update({name: item[...]} if isinstance(item, h5py.Dataset) else {}))
        return found | dict(file.attrs)


class Motions(ProgramTest):
    def setUp(self):
        super().setUp()
        self.write("table.txt", "# time, place\n0 1 1 1\n0.02, 1, 1, 1.001\n\n0.05 1 1 1.0  # back\n")

    def run_to(self, name, text, steps, *options, ranks=0):
        scene, state = self.write("scene.toml", text), self.folder / f"{name}.h5"
        self.succeeds("run", scene, "--steps", steps, "--quiet", "--state", state, *options, ranks=ranks)
        return contents(state)

    def test_walls_are_where_the_function_says(self):
        oscillating = self.run_to("oscillating", SCENE.replace(FLOOR, OSCILLATING), 33)
        self.assertAlmostEqual(oscillating["walls/offset"][0], 0.02 * (math.sin(2 * math.pi * 5 * 0.033 + 0.3) - math.sin(0.3)), places=14)
        aside = self.run_to("aside", SCENE.replace(FLOOR, OSCILLATING + "direction = [3, 0, 0]\n"), 33)
        self.assertEqual(aside["walls/offset"][0], 0)
        self.assertAlmostEqual(aside["walls/velocity"][0, 0], 0.02 * 31.416 * math.cos(2 * math.pi * 5 * 0.033 + 0.3), places=3)
        table = self.run_to("table", SCENE.replace(FLOOR, TABLE), 33)
        self.assertAlmostEqual(table["walls/offset"][0], 0.001 * 17 / 30, places=14)

    def test_they_go_on_bit_for_bit(self):
        for number, floor in enumerate((OSCILLATING, OSCILLATING + "direction = [1, 0, 1]\n", TABLE)):
            text = SCENE.replace(FLOOR, floor)
            whole = self.run_to(f"whole{number}", text, 40)
            self.run_to(f"first{number}", text, 17)
            rest = self.run_to(f"rest{number}", text, 23, "--from", self.folder / f"first{number}.h5")
            ranks = self.run_to(f"ranks{number}", text, 40, "--scheme", "dcs", ranks=2)
            own = self.run_to(f"own{number}", text, 40, "--scheme", "dcs", "-n", 2)
            for one, other in ((whole, rest), (ranks, own)):
                for key, values in one.items():
                    np.testing.assert_array_equal(other[key], values, key)

    def test_what_cannot_be_is_refused_in_one_line(self):
        first = SCENE[: SCENE.index("[[wall]]")].count("\n")
        self.write("down.txt", "0 0 0 0\n1 0 0 0\n0.5 0 0 0\n")
        self.write("short.txt", "\n0 0 0\n")
        self.write("empty.txt", "# nothing\n")
        for floor, line in (
            (OSCILLATING.replace("frequency = 5", ""), f"scene.toml:{first + 1}: wall 'floor': frequency is missing"),
            (OSCILLATING.replace("= 5", "= 0"), f"scene.toml:{first + 8}: wall 'floor': frequency must be > 0, found 0"),
            (OSCILLATING.replace("= 5", "= 500"), f"scene.toml:{first + 8}: wall 'floor': frequency is of a period of 0.002 s, and a step of 0.001 s does not"),
            (OSCILLATING + "direction = [0, 0, 0]\n", f"scene.toml:{first + 11}: wall 'floor': direction must not be 0"),
            (OSCILLATING + "force = 1\n", f"scene.toml:{first + 11}: wall 'floor': unknown key 'force'"),
            (TABLE.replace("table.txt", "none.txt"), f"scene.toml:{first + 7}: wall 'floor': file cannot read 'none.txt'"),
            (TABLE.replace("table.txt", "down.txt"), "down.txt:3: times must ascend"),
            (TABLE.replace("table.txt", "short.txt"), "short.txt:2: needs a time and 3 coordinates, found 3 numbers"),
            (TABLE.replace("table.txt", "empty.txt"), "empty.txt: has no time and place"),
        ):
            done = self.run_program("run", self.write("scene.toml", SCENE.replace(FLOOR, floor)), "--quiet")
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"nscdd: {line}", done.stderr.replace(f"{self.folder}/", ""))


if __name__ == "__main__":
    unittest.main()
