"""fix nscdd within LAMMPS: the numbers of the program, and what an ordinary input does besides: groups, restart, dump, regions, grains that come
and go. Skipped where nscdd-lammps is not built (NSCDD_LAMMPS)."""
import math
import os
import pathlib
import re
import subprocess
import unittest

import h5py
import numpy as np

from harness import MPIRUN, NSCDD, ProgramTest

LAMMPS = pathlib.Path(NSCDD).parent / "nscdd-lammps"
RADIUS, DENSITY, STEPS = 0.005, 2500.0, 300

BED = """name = "bed"
dimension = 3
gravity = [0, 0, -9.81]

[packing]
file = "bed.h5"
material = "grain"

[[material]]
name = "grain"
density = 2500.0

[[pair]]
materials = ["grain", "grain"]
friction = 0.3

[step]
h = 0.001
count = 300
"""
WALL = """
[[wall]]
name = "{0}"
side = "{0}"
material = "grain"
motion = "fixed"
"""

ONE_BALL = """
units si
atom_style sphere
boundary f f f
region box block 0 0.1 0 0.1 -0.01 0.1
create_box 1 box
create_atoms 1 single 0.05 0.05 0.02
set group all diameter 0.01
set group all density 2500
timestep 0.001
"""


def equal_masses(radius):
    """Radii next to these of which LAMMPS and the program compute one mass, to the last bit."""
    found = radius.copy()
    while (other := DENSITY * math.pi * (found * found) * (4.0 / 3.0 * found) != 4.0 * math.pi / 3.0 * found * found * found * DENSITY).any():
        found[other] = np.nextafter(found[other], 1)
    return found


@unittest.skipUnless(LAMMPS.exists(), "nscdd-lammps is not built: NSCDD_LAMMPS")
class Lammps(ProgramTest):
    def lammps(self, text, ranks=0, fails=False):
        """What LAMMPS says of an input; of one that fails, the error."""
        (self.folder / "in.lmp").write_text(text)
        launcher = [MPIRUN, "-np", str(ranks)] if ranks else []
        command = [*launcher, LAMMPS.resolve(), "-in", "in.lmp", "-log", "none"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=self.folder, env=os.environ | {"OMP_NUM_THREADS": "1"})
        said = done.stdout + done.stderr
        self.assertEqual(done.returncode, 1 if fails else 0, said)
        if not fails:
            self.assertNotIn("ERROR", said)
        return re.search("ERROR: (.*)", said)[1] if fails else said

    def dumped(self, name="end.dump"):
        """Columns of the last frame of a dump, by id."""
        lines = (self.folder / name).read_text().split("ITEM: ATOMS ")[-1].splitlines()
        table = np.array([line.split() for line in lines[1:]], dtype=float).reshape(len(lines) - 1, -1)
        table = table[np.argsort(table[:, 0])]
        return dict(zip(lines[0].split(), table.T))

    def write_bed(self, side=6):
        """side^3 spheres that start in a box at rest, for the program and for LAMMPS. Returns the edge of the box [m]."""
        rng = np.random.default_rng(1)
        cell = 2.5 * RADIUS
        cells = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)
        radius = equal_masses(RADIUS * rng.uniform(0.9, 1.1, len(cells)))
        x = (cells + 0.5) * cell + 0.1 * RADIUS * rng.uniform(-1, 1, cells.shape)
        edge = side * cell
        with h5py.File(self.folder / "bed.h5", "w") as file:
            file["x"], file["radius"], file["box"] = x, radius, np.full(3, edge)
        rows = "".join(f"{k} 1 {2 * r:.17g} {DENSITY} {a:.17g} {b:.17g} {c:.17g}\n" for k, (r, (a, b, c)) in enumerate(zip(radius, x), 1))
        bounds = "".join(f"{-RADIUS} {times * edge + RADIUS} {axis}lo {axis}hi\n" for axis, times in zip("xyz", (1, 1, 3)))
        self.write("bed.data", f"bed\n\n{len(x)} atoms\n1 atom types\n\n{bounds}\nAtoms # sphere\n\n{rows}")
        self.write("bed.toml", BED + "".join(map(WALL.format, ("z-", "x-", "x+", "y-", "y+"))))
        return edge

    def bed_input(self, edge, more="", walls=None):
        walls = walls or f"wall zplane 0 NULL wall xplane 0 {edge:.17g} wall yplane 0 {edge:.17g}"
        start = "units si\natom_style sphere\nboundary f f f\nread_data bed.data\ntimestep 0.001\n"
        return start + f"fix bed all nscdd friction 0.3 gravity 9.81 vector 0 0 -1 {walls} {more}\n"

    END = "write_dump all custom end.dump id x y z radius vx vy vz omegax omegay omegaz modify format float %.17g\n"

    def mean_overlap(self, x, radius):
        i, j = np.triu_indices(len(x), 1)
        overlap = radius[i] + radius[j] - np.linalg.norm(x[i] - x[j], axis=1)
        return overlap[overlap > 0].mean()

    def test_settling_bed_is_that_of_the_program(self):
        edge = self.write_bed()
        for ranks, scheme in ((0, "nlgs"), (2, "dcs")):
            with self.subTest(ranks=ranks):
                self.succeeds("run", self.folder / "bed.toml", "--scheme", scheme, "--quiet", "--state", self.folder / "bed.out.h5", ranks=ranks)
                self.lammps(self.bed_input(edge) + f"run {STEPS}\n" + self.END, ranks=ranks)
                end = self.dumped()
                with h5py.File(self.folder / "bed.out.h5") as file:
                    x, radius, velocity, spin = (file[name][...] for name in ("x", "radius", "velocity", "spin"))
                ours, alone = (self.mean_overlap(at, radius) for at in (np.stack([end["x"], end["y"], end["z"]], 1), x))
                self.assertGreater(alone, 0)
                self.assertLess(abs(ours / alone - 1), 1e-3)
                for axis in range(3):  # more than that: the same bits
                    np.testing.assert_array_equal(end["xyz"[axis]], x[:, axis])
                    np.testing.assert_array_equal(end["v" + "xyz"[axis]], velocity[:, axis])
                    np.testing.assert_array_equal(end["omega" + "xyz"[axis]], spin[:, axis])

    def test_bricks_of_lammps_are_subdomains_too(self):
        edge = self.write_bed(4)
        text = self.bed_input(edge, "subdomains lammps") + "fix even all balance 20 1.1 shift xyz 5 1.1\n"
        ends = []
        for ranks in (0, 2, 3):
            said = self.lammps(text + "thermo_style custom step f_bed[3] f_bed[6] f_bed[7]\n" + f"run {STEPS}\n" + self.END, ranks=ranks)
            contacts, overlap, unconverged = map(float, re.search(rf"^ *{STEPS} (.*)", said, re.M)[1].split())
            self.assertGreater(contacts, 100)
            self.assertLess(overlap, 1e-2 * RADIUS)
            self.assertEqual(unconverged, 0)
            ends.append(self.dumped()["z"].mean())
        self.assertLess(max(ends) - min(ends), 0.1 * RADIUS)

    def test_regions_are_walls(self):
        edge = self.write_bed(4)
        faces = f"wall xplane 0 {edge:.17g} wall yplane 0 {edge:.17g} wall zplane 0 NULL"
        ends = []
        for region, walls in (
            ("", faces),
            (f"region box block 0 {edge:.17g} 0 {edge:.17g} 0 {2 * edge} open 6 units box\n", "region box"),
            (
                f"region a plane 0 0 0 1 0 0\nregion b plane {edge:.17g} 0 0 -1 0 0\nregion c plane 0 0 0 0 1 0\n"
                f"region d plane 0 {edge:.17g} 0 0 1 0 side out\nregion e plane 0 0 0 0 0 2\n",
                "region a region b region c region d region e",
            ),
        ):
            self.lammps(self.bed_input(edge, walls=walls).replace("fix bed", region + "fix bed") + "run 150\n" + self.END)
            ends.append(self.dumped())
        for other in ends[1:]:
            np.testing.assert_allclose(other["z"], ends[0]["z"], atol=1e-3 * RADIUS)
        middle, radius = edge / 2, 0.75 * edge
        for axis, style in enumerate("xyz"):
            with self.subTest(cylinder=style):  # lying ones have ends of their own; all hold the grains
                low = 0 if style == "z" else -RADIUS
                region = f"region pipe cylinder {style} {middle} {middle} {radius} {low} {edge - low}\n"
                text = self.bed_input(edge, walls="region pipe").replace("boundary f f f", "boundary m m m").replace("fix bed", region + "fix bed")
                self.lammps(text + f"run {STEPS}\n" + self.END)
                end = self.dumped()
                x = np.stack([end["x"], end["y"], end["z"]], 1)
                across = np.delete(x, axis, 1) - middle
                self.assertLess((np.linalg.norm(across, axis=1) + end["radius"]).max(), radius + 0.01 * RADIUS)
                self.assertLess(x[:, 2].mean(), 0.5 * edge)

    def test_groups_restart_and_dump(self):
        edge = self.write_bed(4)
        text = self.bed_input(edge).replace("fix bed all", "group first id <= 4\ngroup others subtract all first\nfix bed others")
        frames = "dump frames all custom 50 frames.dump id x y z radius vx vy vz\ndump_modify frames sort id format float %.17g\n"
        self.lammps(text + frames + "run 100\nwrite_restart bed.restart\nrun 100\n" + self.END)
        start = np.loadtxt(self.folder / "bed.data", skiprows=11)
        with open(self.folder / "frames.dump") as file:
            self.assertEqual(file.read().count("ITEM: TIMESTEP"), 5)
        whole = self.dumped()
        np.testing.assert_array_equal(whole["z"][:4], start[:4, 6])  # outside of the group: fixed
        self.assertGreater((start[4:, 6] - whole["z"][4:]).min(), -RADIUS)
        self.assertGreater((start[4:, 6] - whole["z"][4:]).max(), RADIUS)
        again = "read_restart bed.restart\n" + text[text.index("group first") :].replace("group first id <= 4\ngroup others subtract all first\n", "")
        for ranks in (0, 2):
            self.lammps(again + "run 100\n" + self.END, ranks=ranks)
            self.assertLess(np.abs(self.dumped()["z"] - whole["z"]).mean(), 0.1 * RADIUS)  # impulses begin at zero

    def test_what_others_do_is_seen(self):
        ball = "molecule ball ball.mol\n"
        self.write("ball.mol", "a sphere\n\n1 atoms\n\nCoords\n\n1 0 0 0\n\nTypes\n\n1 1\n\nDiameters\n\n1 0.01\n\nMasses\n\n1 0.0013\n")
        edge = self.write_bed(4)
        more = f"""{ball}region above block 0.01 {edge - 0.01} 0.01 {edge - 0.01} {2 * edge} {3 * edge} units box
fix come all deposit 6 0 30 77 region above near 0.011 mol ball units box
run 150
group gone id 3 40
delete_atoms group gone
group lifted id 7
displace_atoms lifted move 0 0 {4 * edge} units box
velocity lifted set 1 0 0 units box
run 1
"""
        for ranks in (0, 2):
            with self.subTest(ranks=ranks):
                text = self.bed_input(edge).replace("boundary f f f", "boundary f f m")
                self.lammps(text + more + self.END, ranks=ranks)
                end = self.dumped()
                self.assertEqual(len(end["id"]), 64 + 6 - 2)
                lifted = list(end["id"]).index(7)
                self.assertGreater(end["z"][lifted], 4 * edge)
                self.assertEqual(end["vx"][lifted], 1)

    def test_forces_of_other_fixes_are_loads(self):
        weights = (
            "fix g all gravity 9.81 vector 0 0 -1\nfix n all nscdd\n",
            "fix n all nscdd gravity 9.81 vector 0 0 -1\n",
            "fix n all nscdd\nfix g all addforce 0 0 -0.0128418\n",
        )
        for weight in weights:
            self.lammps(ONE_BALL + weight + "run 20\n" + self.END)
            # Moreau-Jean of a constant force is exact; the third weight has six digits
            self.assertAlmostEqual(self.dumped()["z"][0], 0.02 - 0.5 * 9.81 * 0.02**2, delta=1e-7)

    def test_walls_that_move(self):
        fix = "fix g all gravity 9.81 vector 0 0 -1\nfix n all nscdd friction 1 wall zplane 0.015 NULL "
        self.lammps(ONE_BALL + fix + "wiggle z 0.002 0.4\nrun 100\nrun 100\n" + self.END)
        self.assertAlmostEqual(self.dumped()["z"][0], 0.02 + 0.002 * (1 - math.cos(2 * math.pi * 0.2 / 0.4)), delta=2e-5)
        self.lammps(ONE_BALL + fix + "shear x 0.1\nrun 100\n" + self.END)
        self.assertAlmostEqual(self.dumped()["vx"][0], 0.1 * 2 / 7, delta=1e-3)  # a sphere that has come to roll

    def test_periodic_box(self):
        ball = ONE_BALL.replace("boundary f f f", "boundary p f f") + "velocity all set 1 0.01 0 units box\nfix n all nscdd\nrun 230\n"
        self.lammps(ball + "write_dump all custom end.dump id x xu y modify format float %.17g\n", ranks=2)
        end = self.dumped()
        self.assertAlmostEqual(end["xu"][0], 0.05 + 0.23, delta=1e-12)
        self.assertAlmostEqual(end["x"][0], 0.08, delta=1e-12)

    def test_bad_input(self):
        for line, error in (
            ("fix n all nscdd frictoin 0.3", "Fix nscdd: unknown keyword `frictoin`"),
            ("fix n all nscdd friction", "Fix nscdd: `friction` lacks a value"),
            ("fix n all nscdd friction -1", "Fix nscdd: friction must be >= 0 and finite"),
            ("fix n all nscdd restitution 2", "Fix nscdd: restitution must be within [0, 1]"),
            ("fix n all nscdd coeff 1 2 0.3 0", "Numeric index 2 is out of bounds (1-1)"),
            ("fix n all nscdd wall plane 0 1", "Fix nscdd: wall `plane` is none of"),
            ("fix n all nscdd wiggle z 1 1", "Fix nscdd: `wiggle` stands behind a `wall`"),
            ("fix n all nscdd wall xplane 0 1 shear x 1", "Fix nscdd: shear moves a plane along itself"),
            ("fix n all nscdd max_iterations 0", "Fix nscdd: max_iterations must be a number of at least 1"),
            ("fix n all nscdd region none", "Fix nscdd region none: there is none of this ID"),
            ("region r sphere 0 0 0 1\nfix n all nscdd region r", "Fix nscdd region r: style sphere is none of block, cylinder, plane"),
            ("region r block 0 1 0 1 0 1 side out\nfix n all nscdd region r", "Fix nscdd region r: grains must be inside"),
            ("fix n all nscdd wall zplane 0.018 NULL\nrun 1", "Fix nscdd: step 1: grain 1 and wall 'zplane lo' overlap by 60 % of a radius"),
            ("fix n all nscdd\nfix m all nscdd\nrun 1", "Fix nscdd: there are two"),
            ("fix n all nscdd\nminimize 0 0 1 1", "Fix nscdd: works without minimize"),
            ("fix n all nscdd\nrun_style respa 1\nrun 1", "Fix nscdd: works without run_style respa"),
        ):
            with self.subTest(line=line):
                self.assertIn(error, self.lammps(ONE_BALL + line + "\n", fails=True))
        self.assertIn(
            "works where the dimension is 3",
            self.lammps(
                ONE_BALL.replace("units si", "dimension 2\nunits si").replace("f f f", "f f p").replace("-0.01 0.1", "-0.1 0.1").replace("0.02\n", "0\n")
                + "fix n all nscdd\n",
                fails=True,
            ),
        )


if __name__ == "__main__":
    unittest.main()
