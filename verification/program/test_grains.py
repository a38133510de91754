"""Which grains a scene has and when it ends: [stop], distributions of radii, materials dealt out, fixed grains, grains that enter and leave."""
import csv
import json
import math
import re
import shutil
import unittest

import h5py
import numpy as np

from harness import GLASS, ProgramTest
from test_restart import contents

HEAD = (
    """name = "scene"
dimension = 2
gravity = [0, -10]

"""
    + GLASS
)
SIDES = """
[[wall]]
name = "left"
normal = [1, 0]
through = [0, 0]
material = "glass"
motion = "fixed"

[[wall]]
name = "right"
normal = [-1, 0]
through = [8, 0]
material = "glass"
motion = "fixed"
"""
FLOOR = """
[[wall]]
name = "floor"
normal = [0, 1]
through = [0, 0]
material = "glass"
motion = "fixed"
"""


def step(h, count):
    return f"\n[step]\nh = {h}\ncount = {count}\n"


def grain(x, y, more=""):
    return f'\n[[grain]]\nposition = [{x}, {y}]\nradius = 0.5\nmaterial = "glass"\n{more}'


class GrainsTest(ProgramTest):
    def run_scene(self, text, *options, name="run", ranks=0):
        """The JSON of a run, its state and what it says."""
        out = self.folder / name
        done = self.succeeds("run", self.write("scene.toml", text), "--json", f"{out}.json", "--state", f"{out}.h5", *options, ranks=ranks)
        return json.loads((self.folder / f"{name}.json").read_text()), contents(f"{out}.h5"), done.stdout

    def refused(self, text, message):
        done = self.run_program("run", self.write("scene.toml", text))
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn(message, done.stderr)

    def rows(self, name="run.csv"):
        with open(self.folder / name) as file:
            return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]

    def check_goes_on(self, text, cut, *options):
        """The run at once and in two parts: the same to the last bit."""
        whole, at_once, _ = self.run_scene(text, *options, name="whole")
        self.assertGreater(whole["steps"], cut)
        self.run_scene(text, *options, "--steps", cut, name="first")
        rest, in_parts, _ = self.run_scene(
            text, *options, "--steps", 100000 if "stopped_by" in whole else whole["steps"] - cut, "--from", self.folder / "first.h5", name="rest"
        )
        self.assertEqual(whole["answer"], rest["answer"])
        self.succeeds("compare", self.folder / "whole.json", self.folder / "rest.json")
        self.assertEqual(at_once.keys(), in_parts.keys())
        for key, values in at_once.items():
            np.testing.assert_array_equal(in_parts[key], values, key)
        return whole, at_once


class Stop(GrainsTest):
    def test_time(self):
        report, state, said = self.run_scene(HEAD + grain(0, 0.5) + FLOOR + step(1e-3, 50) + "\n[stop]\ntime = 0.0205\n")
        self.assertEqual((report["steps"], state["step"]), (21, 21))
        self.assertEqual(report["stopped_by"]["condition"], "time")
        self.assertIn("scene: stopped after step 21: time 0.021 s, asked for 0.0205 s", said)
        report, _, said = self.run_scene(HEAD + grain(0, 0.5) + FLOOR + step(1e-3, 5) + "\n[stop]\ntime = 0.0205\n")
        self.assertEqual(report["steps"], 5)
        self.assertNotIn("stopped_by", report)

    def test_the_last_step_is_in_frames_and_log(self):
        text = HEAD + grain(0, 0.5) + FLOOR + step(1e-3, 50) + "\n[stop]\ntime = 0.0205\n"
        frames, log = self.folder / "run.pvd", self.folder / "run.log"
        self.run_scene(text, "--frames", frames, "--frame-every", 8, "--log", log, "--log-every", 8)
        self.assertEqual([line.split()[0] for line in log.read_text().splitlines()], ["step", "8", "16", "21"])
        self.assertEqual(log.read_text().split()[-1], "0:00")
        self.assertEqual(len(re.findall("<DataSet timestep=", frames.read_text())), 3)

    def test_strain_of_a_box_and_of_a_cell_is_from_the_start_of_the_scene(self):
        moving = SIDES.replace(
            'through = [8, 0]\nmaterial = "glass"\nmotion = "fixed"', 'through = [8, 0]\nmaterial = "glass"\nmotion = "velocity"\nvelocity = [-0.8, 0]'
        )
        report, _ = self.check_goes_on(HEAD + grain(4, 0.5) + moving + FLOOR + step(1e-2, 400) + "\n[stop]\nstrain = 0.05\n", 20)
        self.assertEqual(report["steps"], math.ceil((1 - math.exp(-0.05)) / 0.1 / 1e-2))
        cell = '\n[cell]\nperiodic = ["x", "y"]\nsize = [8, 8]\ngradient = [[0, 0.5], [0, 0]]\n'
        report, _ = self.check_goes_on(
            HEAD.replace("gravity = [0, -10]", "") + grain(4, 0.5) + grain(2, 3) + cell + step(1e-2, 400) + "\n[stop]\nstrain = 0.3\n", 20
        )
        self.assertIn(report["steps"], (60, 61))  # 60 terms of 0.005 add up to 0.3 but for round-off

    def test_rest(self):
        rows = [grain(0.5 + k, 0.5) for k in range(8)] + [grain(1 + k, 1.5, "velocity = [0, -0.2]\n") for k in range(7)]  # each falls into a hollow
        heap = HEAD + "".join(rows) + SIDES + FLOOR + step(2e-3, 3000)
        for key, most in (("kinetic_energy_over_work", 1e-7), ("largest_unbalanced_force", 1e-3)):
            with self.subTest(key=key):
                text = heap + f"\n[stop]\n{key} = {most}\nafter = 0.02\n"
                report, _, said = self.run_scene(text, "--series", self.folder / "run.csv")
                self.assertTrue(10 < report["steps"] < 3000, report["steps"])
                self.assertEqual(report["stopped_by"]["condition"], key)
                column = [row[{"largest_unbalanced_force": "unbalanced_force"}.get(key, key)] for row in self.rows()]
                self.assertLessEqual(column[-1], most)
                self.assertEqual(column[-1], report["stopped_by"]["value"])
                self.assertTrue(all(not value <= most for value in column[10:-1]))
        divided = [self.run_scene(text, "--scheme", "dcs", "-n", 2, name="divided", ranks=ranks)[0] for ranks in (0, 2)]
        self.assertEqual(divided[0]["answer"], divided[1]["answer"])
        self.assertEqual(divided[0]["stopped_by"], divided[1]["stopped_by"])

    def test_the_unbalanced_force_of_free_fall_is_the_weight(self):
        self.run_scene(HEAD + grain(1, 0.5) + grain(3, 4) + FLOOR + step(1e-3, 3), "--series", self.folder / "run.csv")
        self.assertAlmostEqual(self.rows()[-1]["unbalanced_force"], 1, places=6)  # what falls has the weight that the floor carries

    def test_what_cannot_be_meant(self):
        scene = HEAD + grain(0, 0.5) + FLOOR + step(1e-3, 5)
        for stop, message in (
            ("", "stop: names no condition"),
            ("after = 1\ntime = 1", "stop: after is of kinetic_energy_over_work and largest_unbalanced_force"),
            ("strain = 0.1", "stop: strain needs a [cell], or two walls that face each other"),
            ("time = 0", "stop: time must be > 0, found 0"),
            ("nothing_left = 1", "stop: nothing_left must be true or false, found"),
            ("energy = 1", "stop: unknown key 'energy' (known here: time, strain"),
        ):
            with self.subTest(stop=stop):
                self.refused(f"{scene}\n[stop]\n{stop}\n", message)


def kolmogorov(values, weights, up_to):
    order = np.argsort(values)
    shares = np.cumsum(weights[order]) / weights.sum()
    wanted = np.array([up_to(value) for value in values[order]])
    return max(np.abs(wanted - shares).max(), np.abs(wanted - np.concatenate([[0], shares[:-1]])).max())


class AutomaticStep(GrainsTest):
    """h = "auto": 5 % of the least radius over the speed that is to be expected, a fifth of it with rebounds, in two digits."""

    def test_steps(self):
        fall = HEAD + grain(0, 4.5) + FLOOR + step('"auto"', 30)
        speed = math.sqrt(2 * 10 * 4.5)
        for text, h in (
            (fall, 0.05 * 0.5 / speed),
            (fall.replace("friction = 0.3", "friction = 0.3\nrestitution = 0.5"), 0.01 * 0.5 / speed),
            (fall.replace("radius = 0.5", "radius = 0.5\nvelocity = [0, -3]"), 0.05 * 0.5 / (speed + 3)),
            (HEAD.replace("gravity = [0, -10]", "") + grain(0, 4.5, "velocity = [2, 0]\n") + step('"auto"', 3), 0.05 * 0.5 / 2),
        ):
            with self.subTest(text=text):
                report, _, _ = self.run_scene(text)
                unit = 10 ** (math.floor(math.log10(h)) - 1)
                self.assertAlmostEqual(report["h"], math.floor(h / unit + 1e-9) * unit, delta=1e-9 * h)
                self.assertTrue(any(f"h = {report['h']:g} s by" in note for note in report["notes"]), report["notes"])
        line = '[[obstacle]]\nname = "line"\nmaterial = "glass"\n'
        for obstacle, speed in (  # a fall may end on one, and its own speed counts
            ('motion = "fixed"\npoints = [[-9, -1], [9, -1]]', math.sqrt(2 * 10 * 5.5)),
            ('motion = "fixed"\ncylinder = { centre = [0, 4], radius = 6 }', math.sqrt(2 * 10 * 6.5)),
            ('motion = "velocity"\nvelocity = [0, 7]\npoints = [[-9, 4.5], [9, 9]]', 7),
            ('motion = "rotating"\nrate = -2\ncentre = [1, 6]\npoints = [[-1, 6], [5, 6]]', 8),
        ):
            with self.subTest(obstacle=obstacle):
                report, _, _ = self.run_scene(HEAD + grain(0, 4.5) + line + obstacle + step('"auto"', 1))
                self.assertAlmostEqual(report["h"], 0.05 * 0.5 / speed, delta=0.06 * report["h"])
        self.check_goes_on(fall, 13)  # with the step that was chosen at the start
        self.refused(HEAD.replace("gravity = [0, -10]", "") + grain(0, 4.5) + step('"auto"', 3), 'h = "auto" finds nothing that moves')
        self.refused(HEAD + grain(0, 4.5) + step('"small"', 3), 'h must be a number [s] or "auto"')


class Radii(GrainsTest):
    def packed(self, radii, generator="own", dimension=2, grains=200):
        text = f"dimension = {dimension}\ngrains = {grains}\nseed = 4\nsolid_fraction = {0.7 if dimension == 2 else 0.45}\n[radii]\n{radii}\n"
        done = self.succeeds("pack", self.write("pack.toml", text), "-o", self.folder / "packing.h5", "--quiet", "--generator", generator)
        with h5py.File(self.folder / "packing.h5") as file:
            shrink = float(re.search(r"radii shrunk by (\S+)\n", done.stdout)[1])
            self.assertEqual(file.attrs["radii"].decode(), done.stdout.splitlines()[-1])
            return file["radius"][...] / (1 - shrink), done.stdout.splitlines()[-1]

    def test_densities_are_met_as_well_as_grains_can(self):
        def normal(z):
            return 0.5 * math.erfc(-z / math.sqrt(2))

        def lognormal(r):
            low, high = normal(math.log(0.3 / 0.5) / 0.3), normal(math.log(0.9 / 0.5) / 0.3)
            return (normal(math.log(r / 0.5) / 0.3) - low) / (high - low)

        for generator in ["own"] + (["lammps"] if shutil.which("lmp") else []):
            for text, by, up_to in (
                ('distribution = "uniform"\nleast = 0.4\nlargest = 0.8', "number", lambda r: (r - 0.4) / 0.4),
                ('distribution = "uniform"\nby = "mass"\nleast = 0.4\nlargest = 0.8', "mass", lambda r: (r - 0.4) / 0.4),
                ('distribution = "lognormal"\nmedian = 0.5\ndeviation = 0.3\nleast = 0.3\nlargest = 0.9', "number", lognormal),
                ('distribution = "lognormal"\nby = "mass"\nmedian = 0.5\ndeviation = 0.3\nleast = 0.3\nlargest = 0.9', "mass", lognormal),
            ):
                with self.subTest(generator=generator, text=text):
                    radius, said = self.packed(text, generator)
                    weights = radius**2 if by == "mass" else np.ones(len(radius))
                    distance = kolmogorov(radius, weights, lambda r: min(max(up_to(r), 0), 1))
                    self.assertLess(distance, 1.1 * weights.max() / weights.sum())
                    self.assertAlmostEqual(float(said.split()[-1]), distance, delta=0.02 * distance)
                    self.assertLess(abs(np.corrcoef(radius, np.arange(len(radius)))[0, 1]), 0.3)  # in no order

    def test_sizes_have_their_shares(self):
        for dimension, text, wanted in (
            (2, 'distribution = "two sizes"\nradii = [0.4, 0.6]\nfractions = [0.3, 0.7]', {0.4: 60, 0.6: 140}),
            (3, 'distribution = "list"\nby = "mass"\nradii = [0.3, 0.4, 0.6]\nfractions = [0.2, 0.3, 0.5]', None),
        ):
            with self.subTest(text=text):
                radius, said = self.packed(text, dimension=dimension)
                sizes, counts = np.unique(np.round(radius, 6), return_counts=True)
                if wanted:
                    self.assertEqual(dict(zip(sizes, counts)), wanted)
                    self.assertIn("radii two sizes of the grains: 30.00 % 0.4, 70.00 % 0.6;", said)
                else:
                    mass = counts * sizes**3
                    np.testing.assert_allclose(mass / mass.sum(), [0.2, 0.3, 0.5], atol=0.6**3 / mass.sum())

    def test_what_cannot_be_meant(self):
        for text, message in (
            ('radius = 0.5\n[radii]\ndistribution = "uniform"\nleast = 1\nlargest = 2', "radius is given, and [radii] too"),
            ('[radii]\ndistribution = "uniform"\nleast = 2\nlargest = 1', "radii: largest must be above least"),
            ('[radii]\ndistribution = "two sizes"\nradii = [1, 2]\nfractions = [0.5, 0.4]', "radii: fractions must add up to 1, found 0.9"),
            ('[radii]\ndistribution = "list"\nradii = [1, 2, 1.5]\nfractions = [0.5, 0.4, 0.1]', "radii: radii must ascend"),
            ('[radii]\ndistribution = "two sizes"\nby = "mass"\nradii = [0.1, 10]\nfractions = [0.9, 0.1]', "of 100 grains none would have radius 10"),
            ('[radii]\ndistribution = "normal"', "radii: distribution must be one of uniform, lognormal, two sizes, list, found 'normal'"),
        ):
            with self.subTest(text=text):
                done = self.run_program("pack", self.write("pack.toml", f"dimension = 2\ngrains = 100\n{text}\n"), "-o", self.folder / "packing.h5")
                self.assertEqual(done.returncode, 1, done.stdout)
                self.assertIn(message, done.stderr)
                self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)


class Packed(GrainsTest):
    """Scenes on a packing that is written here: disks on a lattice."""

    HEAVY = (
        HEAD.replace("[[pair]]", '[[material]]\nname = "steel"\ndensity = 8.0\n\n[[pair]]')
        + '\n[[pair]]\nmaterials = ["steel", "glass"]\n\n[[pair]]\nmaterials = ["steel", "steel"]\n'
    )

    def setUp(self):
        super().setUp()
        x = np.array([[i + 0.5, j + 0.5] for j in range(6) for i in range(8)]) + 1e-3
        with h5py.File(self.folder / "packing.h5", "w") as file:
            file["x"], file["radius"], file["box"] = x, np.full(len(x), 0.495), np.array([8.1, 6.1])
        self.x = x

    def test_materials_by_fractions_and_regions(self):
        def scene(packing):
            return self.HEAVY + f'\n[packing]\nfile = "packing.h5"\n{packing}' + SIDES.replace("8, 0", "8.1, 0") + FLOOR + step(1e-3, 2)

        mixed = 'materials = ["steel", "glass"]\nfractions = [0.3, 0.7]\nseed = 5\n'
        _, state, _ = self.run_scene(scene(mixed))
        steel = state["material"] == 1
        self.assertEqual(steel.sum(), 14)  # 14.4 of 48
        self.assertGreater(len(set(self.x[steel, 1])), 3)
        _, again, _ = self.run_scene(scene(mixed), "--scheme", "dcs", name="again", ranks=3)
        np.testing.assert_array_equal(again["material"], state["material"])
        _, other, _ = self.run_scene(scene(mixed.replace("seed = 5", "seed = 6")), name="other")
        self.assertTrue((other["material"] != state["material"]).any())
        self.run_scene(scene(mixed), "--from", self.folder / "run.h5", "--steps", 1, name="on")  # compares the materials
        _, state, _ = self.run_scene(
            scene(
                'material = "glass"\n[[packing.region]]\nmaterial = "steel"\nlow = [0, 0]\nhigh = [3, 2]\n[[packing.region]]\nmaterial = "glass"\nnormal = [0, 1]\nthrough = [0, 1]\n'
            )
        )
        x, y = self.x.T
        np.testing.assert_array_equal(state["material"] == 1, (x < 3) & (y < 2) & (y > 1))
        self.refused(scene('material = "glass"\nmaterials = ["steel", "glass"]\nfractions = [0.3, 0.7]\n'), "packing: material is given, and materials too")
        self.refused(
            scene('material = "glass"\n[[packing.region]]\nmaterial = "wood"\nlow = [0, 0]\nhigh = [3, 2]\n'),
            "[[region]] 0: material 'wood' is not a [[material]]",
        )

    def test_fixed_grains(self):
        fixed = "\n[[fix]]\nlow = [0, 0]\nhigh = [9, 1]\n" + grain(4.0, 7.3, "fixed = true\n")
        scene = HEAD + '\n[packing]\nfile = "packing.h5"\nmaterial = "glass"\n' + fixed + SIDES.replace("8, 0", "8.1, 0") + step(2e-3, 60)
        _, state = self.check_goes_on(scene, 23, "--scheme", "dcs", "-n", 3)
        self.run_scene(scene, "--series", self.folder / "run.csv")
        np.testing.assert_array_equal(state["fixed"], [*(self.x[:, 1] < 1), True])
        held = state["fixed"] == 1
        np.testing.assert_array_equal(state["x"][held], np.vstack([self.x[self.x[:, 1] < 1], [4.0, 7.3]]))
        self.assertTrue((state["velocity"][held] == 0).all())
        self.assertGreater(state["x"][~held][:, 1].min(), 1.3)  # they do not fall through
        self.assertLess(max(row["energy_error"] for row in self.rows()), 1e-12)
        with h5py.File(self.folder / "packing.h5", "a") as file:  # or the packing says it
            file["fixed"] = (self.x[:, 1] < 1).astype(int)
        _, same, _ = self.run_scene(scene.replace("[[fix]]\nlow = [0, 0]\nhigh = [9, 1]\n", ""), "--scheme", "dcs", "-n", 3, name="said")
        np.testing.assert_array_equal(same["x"], state["x"])
        self.refused(HEAD + grain(0, 0.5, "fixed = true\nvelocity = [1, 0]\n") + step(1e-3, 5), "[[grain]] 0: velocity is that of a grain that is fixed")

    def test_a_fixed_grain_of_a_packing_on_more_processes_than_grains(self):
        with h5py.File(self.folder / "one.h5", "w") as file:
            file["x"], file["radius"], file["box"], file["fixed"] = [[1.0, 1.0]], [0.5], [2.0, 2.0], [1]
        scene = HEAD + '\n[packing]\nfile = "one.h5"\nmaterial = "glass"\n' + step(0.01, 10)
        _, state, _ = self.run_scene(scene, "--scheme", "dcs", "-n", 2, ranks=2)
        self.assertEqual((list(state["fixed"]), list(state["x"][0])), ([1], [1, 1]))
        flows = scene + "\n[cell]\nperiodic = ['x', 'y']\ngradient = [[0, 0.1], [0, 0]]\n"
        for ranks in (0, 2):
            done = self.run_program("run", self.write("flows.toml", flows), "--scheme", "dcs", "-n", 2, ranks=ranks)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn("a grain is fixed, which a [cell] with a gradient or a stress would move", done.stderr)

    def test_a_driven_wall_rests_on_a_fixed_grain(self):
        lid = '\n[[wall]]\nname = "lid"\nnormal = [0, -1]\nthrough = [0, 1.2]\nmaterial = "glass"\nmotion = "force"\nforce = 1\nmass = 1\n'
        scene = HEAD + grain(5, 0.45).replace("radius = 0.5", "radius = 0.45") + grain(0, 0.5, "fixed = true\n") + FLOOR + lid + step(1e-2, 150)
        for options, ranks in (
            ([], 0),
            (["--method", "paper"], 0),
            (["--scheme", "newton"], 0),
            (["--scheme", "spg"], 0),
            (["--scheme", "dcs"], 2),
            (["--scheme", "ccs", "-n", 2], 0),
        ):
            with self.subTest(options=options):
                _, state, _ = self.run_scene(scene, *options, ranks=ranks)
                self.assertAlmostEqual(-state["walls/offset"][1], 1, places=3)
        pressed = "".join(
            f'\n[[wall]]\nname = "{side}"\nside = "{side}"\nmaterial = "glass"\nmotion = "pressure"\npressure = 1\n' for side in ("x-", "x+", "y-", "y+")
        )
        box = HEAD.replace("gravity = [0, -10]", "") + '\n[packing]\nfile = "packing.h5"\nmaterial = "glass"\n[[fix]]\nlow = [0, 0]\nhigh = [2, 20]\n'
        _, state, _ = self.run_scene(box + pressed + step(0.02, 100))
        self.assertAlmostEqual(state["walls/offset"][0], 6e-3, places=4)

    def test_a_silo_empties(self):
        silo = (
            HEAD
            + '\n[packing]\nfile = "packing.h5"\nmaterial = "glass"\n'
            + SIDES.replace("8, 0", "8.1, 0")
            + "\n[[remove]]\nnormal = [0, 1]\nthrough = [0, -1]\n"
            + step(4e-3, 2000)
        )
        whole, _ = self.check_goes_on(silo.replace("2000", "200"), 130, "--scheme", "dcs", "-n", 3)
        apart = self.run_scene(silo.replace("2000", "200"), "--scheme", "dcs", "-n", 3, name="mpi", ranks=3)[0]
        self.assertEqual(apart["answer"], whole["answer"])
        self.assertEqual(apart["exchange"], whole["exchange"])
        left = whole["exchange"]
        self.assertTrue(10 < left["removed"]["grains"] < 48)
        self.assertEqual(left["removed"]["grains"] + left["grains_left"], 48)
        self.assertAlmostEqual(left["removed"]["mass"], left["removed"]["grains"] * math.pi * 0.495**2, places=9)
        report, state, said = self.run_scene(silo + "\n[stop]\nnothing_left = true\n", "--series", self.folder / "run.csv")
        self.assertEqual(report["stopped_by"]["condition"], "nothing_left")
        self.assertIn("scene: 0 grains inserted, 48 removed, 0 left", said)
        rows = self.rows()
        self.assertEqual((rows[0]["grains"], rows[-1]["grains"], rows[-1]["grains_removed"]), (48, 0, 48))
        self.assertLess(max(row["energy_error"] for row in rows), 1e-12)
        fallen = 48 * math.pi * 0.495**2 * 10 * 3.5  # at least: to y = -1 from 3 in the mean
        self.assertGreater(rows[-1]["energy_removed"], fallen)

    def test_grains_leave_by_rate_and_at_times(self):
        still = HEAD.replace("gravity = [0, -10]", "") + '\n[packing]\nfile = "packing.h5"\nmaterial = "glass"\n'
        for when, gone in (
            ("rate = 100\nfrom = 0.02", [0, 1, 2, 3, 4]),
            ("times = [0.02, 0.04]", [0, 8, 8, 8, 8]),
            ("from = 0.02", [0, 8, 8, 8, 8]),
            ("rate = 100\nuntil = 0.025", [2, 3, 3, 3, 3]),
        ):
            with self.subTest(when=when):
                self.run_scene(f"{still}\n[[remove]]\nlow = [0, 0]\nhigh = [9, 1.1]\n{when}\n" + step(1e-2, 5), "--series", self.folder / "run.csv")
                removed = [row["grains_removed"] for row in self.rows()]
                self.assertEqual(removed, [*([0] if when[-1] != "5" else [1]), *gone][: len(removed)])

    def test_each_time_is_of_one_step(self):
        """Also one that is half-way between two of them."""
        still = HEAD.replace("gravity = [0, -10]", "") + "".join(grain(2 * k, 0.5) for k in range(40))
        for k in range(2, 40):
            time = (k - 0.5) / 100
            removals = f"\n[[remove]]\nlow = [-1, 0]\nhigh = [{2 * k + 1}, 2]\ntimes = [{time}]\nfrom = {time}\nuntil = {time}\n"
            with self.subTest(time=time):
                self.run_scene(still + removals + step(1e-2, 41), "--series", self.folder / "run.csv")
                removed = [row["grains_removed"] for row in self.rows()]
                self.assertEqual(removed[-1], k + 1)
                self.assertEqual(len(set(removed)), 2)

    def test_no_step_makes_up_for_what_others_did_not_take(self):
        empty = HEAD + SIDES + FLOOR + '\n[[insert]]\nlow = [0, 0]\nhigh = [8, 3]\nmaterial = "glass"\nradius = 0.2\ncount = 20\nfrom = 0.5\n'
        self.run_scene(empty + "\n[[remove]]\nlow = [0, 0]\nhigh = [8, 3]\nrate = 10\n" + step(5e-3, 201), "--series", self.folder / "run.csv")
        removed = [row["grains_removed"] for row in self.rows()]
        self.assertEqual((removed[99], removed[200]), (0, 5))  # one each tenth of a second from 0.6 s on

    def test_large_grains_come_too(self):
        insert = """
[[insert]]
low = [0, 3]
high = [8, 6]
material = "glass"
rate = 400
count = 300
seed = 3
radii = { distribution = "two sizes", radii = [0.1, 0.7], fractions = [0.7, 0.3] }
"""
        report, state = self.check_goes_on(HEAD + insert + SIDES + FLOOR + step(2e-3, 600), 211)
        self.assertTrue(20 < len(state["x"]) < 300, len(state["x"]))  # many wait
        self.assertAlmostEqual((state["radius"] > 0.5).mean(), 0.3, delta=0.15)

    def test_a_scene_without_grains_goes_on(self):
        scene = HEAD + FLOOR + '\n[[insert]]\nlow = [0, 2]\nhigh = [4, 5]\nmaterial = "glass"\ncount = 3\nfrom = 0.3\nradius = 0.2\n' + step(5e-3, 120)
        self.check_goes_on(scene, 40)
        self.run_scene(scene, "--scheme", "dcs", "-n", 2, name="other")
        self.succeeds("compare", self.folder / "whole.json", self.folder / "other.json")

    def test_nothing_is_left_once_all_have_come(self):
        insert = '\n[[insert]]\nlow = [0, 2]\nhigh = [4, 5]\nmaterial = "glass"\nrate = 1\ncount = 3\nradius = 0.2\n'
        drain = "\n[[remove]]\nnormal = [0, 1]\nthrough = [0, 1]\n[stop]\nnothing_left = true\n"
        report, _, _ = self.run_scene(HEAD + insert + drain + step(5e-3, 3000))
        self.assertEqual(report["exchange"]["inserted"]["grains"], 3)
        self.assertTrue(2 < report["steps"] * 5e-3 < 4, report["steps"])

    def test_notes(self):
        insert = '\n[[insert]]\nlow = [0, -5]\nhigh = [4, -2]\nmaterial = "glass"\nrate = 1\nradius = 0.2\n'
        line = '\n[[obstacle]]\nname = "line"\nmaterial = "glass"\nmotion = "fixed"\npoints = [[0, 0], [4, 0]]\n'
        report, _, _ = self.run_scene(HEAD + insert + FLOOR + line + step(5e-3, 3))
        self.assertEqual(len(report["notes"]), 1, report["notes"])  # and none on units, where there is no grain
        self.assertIn("an [[insert]] lies behind wall 'floor': no grain of it comes", report["notes"][0])

    def test_a_hopper_is_filled(self):
        radii = 'radii = { distribution = "uniform", least = 0.2, largest = 0.4 }'
        insert = f'\n[[insert]]\nlow = [0, 6]\nhigh = [8, 9]\nmaterial = "glass"\nvelocity = [0, -2]\nrate = 60\ncount = 40\nseed = 3\n{radii}\n'
        hopper = HEAD + insert + SIDES + FLOOR + step(4e-3, 220)
        whole, state = self.check_goes_on(hopper, 77, "--scheme", "dcs", "-n", 3)
        self.assertEqual(whole["exchange"]["inserted"]["grains"], 40)
        self.assertEqual(len(state["x"]), 40)
        apart = self.run_scene(hopper, "--scheme", "dcs", "-n", 3, name="mpi", ranks=3)[0]
        self.assertEqual(apart["answer"], whole["answer"])
        alone, other, _ = self.run_scene(hopper, "--series", self.folder / "run.csv")
        np.testing.assert_array_equal(np.sort(other["radius"]), np.sort(state["radius"]))  # they follow from the seed
        self.assertLess(max(row["energy_error"] for row in self.rows()), 1e-12)
        self.assertEqual(self.rows()[0]["grains"], 1)
        mass = math.pi * (state["radius"] ** 2).sum()
        self.assertAlmostEqual(self.rows()[-1]["mass_inserted"], mass, places=9)
        self.assertAlmostEqual(self.rows()[-1]["energy_inserted"], 0.5 * mass * 4, places=9)
        self.assertLess(kolmogorov(state["radius"], np.ones(40), lambda r: (r - 0.2) / 0.2), 1.63 / math.sqrt(40))
        full = hopper.replace("rate = 60\ncount = 40", "count = 400").replace("velocity = [0, -2]", "velocity = [0, 0]").replace("220", "3")
        done = self.succeeds("run", self.write("full.toml", full), "--json", self.folder / "full.json")
        came = json.loads((self.folder / "full.json").read_text())["exchange"]["inserted"]["grains"]
        self.assertTrue(20 < came < 80)
        self.assertIn(f"note: grains still wait for a free place in their boxes: {400 - came:.0f} of [[insert]] 0", done.stderr)

    def test_what_cannot_be_meant(self):
        scene = HEAD + grain(1, 0.5, "") + SIDES + FLOOR + step(1e-3, 5)
        box = 'low = [0, 0]\nhigh = [3, 3]\nmaterial = "glass"\nradius = 0.5\n'
        for text, message in (
            ("[[remove]]\nlow = [0, 0]", "[[remove]] 0: high is missing"),
            ("[[remove]]", "[[remove]] 0: needs low and high, or normal and through"),
            ("[[remove]]\nlow = [0, 0]\nhigh = [1, 1]\nrate = 1\ntimes = [1]", "[[remove]] 0: times are given, and a rate too"),
            ("[[remove]]\nlow = [0, 0]\nhigh = [1, 1]\nfrom = 2\nuntil = 1", "[[remove]] 0: until must not be before from"),
            (f"[[insert]]\n{box}", "[[insert]] 0: needs a rate, or a count"),
            (f"[[insert]]\n{box}count = 1\nradii = {{}}", "[[insert]] 0: needs radius or radii"),
            (f"[[insert]]\n{box}count = 1\n".replace("0.5", "2"), "[[insert]] 0: high leaves no room for the largest grain"),
        ):
            with self.subTest(text=text):
                self.refused(f"{scene}\n{text}\n", message)
        driven = scene.replace('through = [8, 0]\nmaterial = "glass"\nmotion = "fixed"', 'through = [8, 0]\nmaterial = "glass"\nmotion = "force"\nforce = 1')
        self.refused(f"{driven}\n[[insert]]\n{box}count = 1\n", "[[insert]] 0: needs the mass of wall 'right'")


if __name__ == "__main__":
    unittest.main()
