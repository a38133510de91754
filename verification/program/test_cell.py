"""Cells that repeat and flow: the same answer by every scheme, exact restarts, series, and what is refused."""
import csv
import itertools
import json
import shutil
import unittest

import h5py
import numpy as np

from harness import GLASS, ProgramTest

SCENE = (
    """name = "cell"
dimension = 2
law = "coulomb"

"""
    + GLASS
    + """
[packing]
file = "disks.h5"
material = "glass"

[cell]
periodic = ["x", "y"]
gradient = [[-0.02, 0.5], [0, -0.02]]

[step]
h = 0.01
count = 30
"""
)
FLOW = "gradient = [[-0.02, 0.5], [0, -0.02]]\n"


class Cell(ProgramTest):
    def setUp(self):
        super().setUp()
        self.scene = self.write("cell.toml", SCENE)
        self.pack("disks", 2, 80, '["x", "y"]', "own", "solid_fraction = 0.76\n")  # a jammed one could not be sheared as it is

    def pack(self, name, dimension, grains, periodic, generator, more=""):
        text = f"dimension = {dimension}\ngrains = {grains}\nspread = 0.25\nseed = 4\nperiodic = {periodic}\ngenerator = '{generator}'\n{more}"
        self.succeeds("pack", self.write(f"{name}.toml", text), "-o", self.folder / f"{name}.h5", "--quiet")

    def run_cell(self, name, *options, ranks=0):
        out = self.folder / name
        self.succeeds("run", self.scene, "--quiet", "--json", f"{out}.json", "--state", f"{out}.h5", *options, ranks=ranks)
        return json.loads((self.folder / f"{name}.json").read_text())

    def test_packings_repeat(self):
        generators = ["own"] + (["lammps"] if shutil.which("lmp") else [])
        for generator, (dimension, grains, periodic) in itertools.product(generators, ((2, 150, '["x", "y"]'), (2, 150, '["x"]'), (3, 200, '["x", "y", "z"]'))):
            with self.subTest(generator=generator, periodic=periodic):
                self.pack("packing", dimension, grains, periodic, generator)
                with h5py.File(self.folder / "packing.h5") as file:
                    x, radius, box, repeats = (file[name][...] for name in ("x", "radius", "box", "periodic"))
                    self.assertAlmostEqual(float(file.attrs["solid_fraction"]), {2: 0.83, 3: 0.62}[dimension], delta=0.06)
                self.assertEqual(sum(repeats), periodic.count('"') // 2)
                apart = x[:, None] - x[None]
                apart -= np.where(repeats, np.round(apart / box), 0) * box
                gap = np.linalg.norm(apart, axis=2) - radius[:, None] - radius[None]
                gap[np.diag_indices(len(x))] = np.inf
                self.assertGreaterEqual(gap.min(), -1e-12)
                self.assertGreater((gap < 1e-3).sum() / len(x), 3 if dimension == 2 else 4)
                across = np.abs(x[:, None] - x[None] - apart).max(axis=2) > 0.5
                self.assertGreater((gap[across] < 1e-3).sum(), 4)
                for d in np.flatnonzero(repeats == 0):
                    self.assertGreaterEqual((np.minimum(x[:, d], box[d] - x[:, d]) - radius).min(), -1e-12)

    def test_every_scheme_has_the_same_answer(self):
        exact = ("--tolerance", "1e-10", "--max-iterations", "50000", "--steps", "12")
        alone = self.run_cell("alone", *exact)
        self.assertGreater(alone["contacts"][-1], 60)
        for name, *options in (
            ("dcs", "--scheme", "dcs", "-n", 4),
            ("metis", "--scheme", "dcs", "-n", 3, "--partition", "metis"),
            ("ccs", "--scheme", "ccs", "-n", 4),
        ):
            self.run_cell(name, *options, *exact)
            self.succeeds("compare", self.folder / "alone.json", self.folder / f"{name}.json")
        for name in ("alone", "dcs"):
            ranks = {"alone": 0, "dcs": 2}[name]
            again = self.run_cell("again", *(("--scheme", "dcs", "-n", 4) if ranks else ()), *exact, ranks=ranks)
            self.assertEqual(again["answer"], json.loads((self.folder / f"{name}.json").read_text())["answer"])

    def test_a_run_goes_on_bit_for_bit(self):
        for flow in (True, False):
            self.scene.write_text(SCENE if flow else SCENE.replace(FLOW, ""))
            for scheme in ((), ("--scheme", "dcs", "-n", 4)):
                whole = self.run_cell("whole", *scheme)
                first = self.run_cell("first", "--steps", 13, *scheme)
                second = self.run_cell("second", "--from", self.folder / "first.h5", "--steps", 17, *scheme)
                self.assertEqual(first["iterations"] + second["iterations"], whole["iterations"])
                self.assertEqual(second["answer"], whole["answer"])

    def test_a_stress_presses_the_cell(self):
        pressed = "stress = { x = 3, y = 5 }\ngradient = [[0, 0.05], [0, 0]]\n"
        self.scene.write_text(SCENE.replace(FLOW, pressed).replace("count = 30", "count = 400"))
        whole = self.run_cell("whole", "--scheme", "dcs", "-n", 4, "--series", self.folder / "series.csv")
        with open(self.folder / "series.csv") as file:
            rows = list(csv.DictReader(file))
        mean = {axis: sum(float(row[f"stress_contacts_{axis}"]) for row in rows[-200:]) / 200 for axis in ("xx", "yy")}
        self.assertAlmostEqual(mean["xx"], 3, delta=0.3)
        self.assertAlmostEqual(mean["yy"], 5, delta=0.5)
        self.assertLess(float(rows[-1]["energy_error"]), 1e-10)
        first = self.run_cell("first", "--scheme", "dcs", "-n", 4, "--steps", 150)
        second = self.run_cell("second", "--scheme", "dcs", "-n", 4, "--from", self.folder / "first.h5", "--steps", 250)
        self.assertEqual(first["iterations"] + second["iterations"], whole["iterations"])
        self.assertEqual(second["answer"], whole["answer"])

    def test_the_series_has_the_cell(self):
        self.run_cell("run", "--series", self.folder / "series.csv")
        with open(self.folder / "series.csv") as file:
            rows = list(csv.DictReader(file))
        with h5py.File(self.folder / "disks.h5") as packing, h5py.File(self.folder / "run.h5") as state:
            box = packing["box"][...]
            self.assertAlmostEqual(float(rows[-1]["box_x"]), state["cell/size"][0], places=12)
            self.assertAlmostEqual(state["cell/size"][1] / box[1], (1 - 0.02 * 0.01) ** 30, places=6)
            self.assertAlmostEqual(state["cell/tilt"][0, 1] / state["cell/size"][1], 0.5 * 0.3, places=2)
        self.assertLess(float(rows[-1]["energy_error"]), 1e-10)
        self.assertGreater(float(rows[-1]["stress_contacts_yy"]), 0)
        self.assertGreater(float(rows[-1]["inertial_number"]), 0)

    def test_a_side_that_becomes_too_short_ends_the_run(self):
        self.scene.write_text(
            SCENE.replace(FLOW, "size = [40, 2.8]\ngradient = [[0, 0], [0, -0.5]]\n")
            .replace("[packing]", "[old]")
            .replace('[old]\nfile = "disks.h5"\nmaterial = "glass"\n', '[[grain]]\nposition = [1, 1]\nradius = 0.5\nmaterial = "glass"\n')
        )
        done = self.run_program("run", self.scene, "--steps", 100, "--quiet", "--series", self.folder / "series.csv", "--state", self.folder / "last.h5")
        self.assertEqual(done.returncode, 1)
        self.assertIn("the side of the cell along y is shorter than 2.01 diameters of the largest grain", done.stderr)
        with open(self.folder / "series.csv") as file:
            self.assertGreater(len(list(csv.DictReader(file))), 30)

    def test_a_state_as_packing_keeps_its_tilt(self):
        self.run_cell("first", "--steps", 20)
        state = self.folder / "first.h5"
        self.succeeds("run", self.scene, "--packing", state, "--steps", 1, "--quiet", "--state", self.folder / "next.h5")
        with h5py.File(state) as first, h5py.File(self.folder / "next.h5") as after:
            self.assertGreater(first["cell/tilt"][0, 1], 0.05)
            self.assertGreater(after["cell/tilt"][0, 1], first["cell/tilt"][0, 1])
        done = self.run_program(
            "run", self.write("free.toml", SCENE.replace(SCENE[SCENE.index("[cell]") : SCENE.index("[step]")], "")), "--steps", 1, "--max-iterations", 10
        )
        self.assertIn("the packing repeats along y, and no [cell] does", done.stdout + done.stderr)

    def refused(self, text, *options):
        done = self.run_program("run", self.write("wrong.toml", text), "--quiet", *options)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        lines = [line for line in done.stderr.splitlines() if line.startswith("nscdd:")]
        self.assertEqual(len(lines), 1, done.stderr)
        return lines[0].replace(str(self.folder) + "/", "")

    def test_what_cannot_be_is_refused_in_one_line(self):
        cell = SCENE[SCENE.index("[cell]") : SCENE.index("[step]")]
        wall = '[[wall]]\nname = "floor"\nside = "y-"\nmaterial = "glass"\nmotion = "fixed"\n\n[step]'
        for change, line in (
            (('["x", "y"]', '["x", "z"]'), "18: cell: periodic must name axes from x to y, found 'z'"),
            (('["x", "y"]', '["x", "x"]'), "18: cell: periodic names axis x twice"),
            (('["x", "y"]', "[]"), "18: cell: periodic must be a list of 1 to 2 strings"),
            ((FLOW, "size = [3, -1]\n"), "19: cell: size must be positive"),
            ((FLOW, "size = [3, 1.1]\n"), "cell: the side along y is shorter than 2.01 diameters of the largest grain"),
            ((FLOW, "stress = { y = 2, z = 1 }\n"), "19: stress: unknown key 'z' (known here: x, y)"),
            ((FLOW, FLOW + "stress = { x = 1 }\n"), "20: stress: x is driven by a stress and by the gradient"),
            ((FLOW, "stress = {}\n"), "19: stress: names no axis"),
            ((FLOW, "stress = { x = 0 }\n"), "19: stress: x must be > 0, found 0"),
            ((FLOW, "mass = 3.0\n"), "19: cell: mass is that of sides that a stress drives: give stress"),
            (
                (FLOW, "stress = { x = 1 }\nmass = 0.01\n"),
                "cell: the mass of sides must be at least three times that of all grains, 200 kg, for sweeps to converge",
            ),
            ((FLOW, "gradient = [1, 2]\n"), "19: cell: gradient must be 2 lists of 2 numbers"),
            ((FLOW, "gradient = [[0, 1], [1, 0]]\n"), "19: cell: gradient must be 0 below the diagonal"),
            (('["x", "y"]', '["x"]'), "19: cell: gradient must be 0 for axes that are not periodic"),
            (('law = "coulomb"', 'law = "frictionless"'), '17: cell: a gradient or a stress needs law = "coulomb", with friction 0 if there is none'),
            ((cell + "[step]", cell + wall), "21: wall 'floor': crosses the cell, which is periodic along y"),
        ):
            text = SCENE.replace(*change)
            if "frictionless" in text:
                text = text.replace("friction = 0.3", "")
            self.assertEqual(self.refused(text), "nscdd: " + (f"wrong.toml:{line}" if line[0].isdigit() else line))
        self.run_cell("state", "--steps", 2)
        self.assertIn("the periodic axes xy", self.refused(SCENE.replace(cell, ""), "--from", self.folder / "state.h5"))


if __name__ == "__main__":
    unittest.main()
