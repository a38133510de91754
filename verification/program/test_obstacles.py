"""Scenes with obstacles: solvers and ranks agree, runs go on bit for bit, STL files are read, and what cannot be is refused in one line."""
import csv
import struct
import unittest

import h5py
import numpy as np

from harness import GLASS, SCENE, ProgramTest
from test_motions import contents

FLOOR = SCENE[SCENE.index("[[wall]]") : SCENE.index("[step]")]
HEAD = (
    """name = "flow"
dimension = 2
gravity = [0, -10]

"""
    + GLASS
    + """
"""
)
FUNNEL = """[[obstacle]]
name = "funnel"
material = "glass"
motion = "fixed"
points = [[0, 12], [0, 4], [3, 2]]

[[obstacle]]
name = "right"
material = "glass"
motion = "fixed"
points = [[8, 12], [8, 4], [5, 2]]

[[obstacle]]
name = "gate"
material = "glass"
motion = "velocity"
velocity = [3, 0]
points = [[2, 1.9], [6, 1.9]]

"""
DRUM = """[[obstacle]]
name = "drum"
material = "glass"
motion = "rotating"
rate = 1.5
cylinder = { centre = [4, 8], radius = 5.5 }

[[obstacle]]
name = "blade"
material = "glass"
motion = "rotating"
rate = 1.5
centre = [4, 8]
points = [[4, 2.5], [4, 3.2]]

"""
STEP = "[step]\nh = 0.01\ncount = 60\n"


def disks():
    """Grains that fall: rows of five."""
    grain = '[[grain]]\nposition = [{}, {}]\nradius = {}\nmaterial = "glass"\n\n'
    return "".join(grain.format(1.5 + 1.25 * (k % 5) + 0.1 * (k // 5 % 2), 3.8 + 1.1 * (k // 5), 0.5 - 0.02 * (k % 4)) for k in range(25))


def stl(triangles, text=False):
    if text:
        lines = ["solid sheet"]
        for corners in triangles:
            lines += ["facet normal 0 0 0", " outer loop", *(f"  vertex {x} {y} {z}" for x, y, z in corners), " endloop", "endfacet"]
        return ("\n".join([*lines, "endsolid"]) + "\n").encode()
    head = b"solid, but binary".ljust(80) + struct.pack("<I", len(triangles))
    return head + b"".join(struct.pack("<12fH", 0, 0, 0, *(x for corner in corners for x in corner), 0) for corners in triangles)


SHEET = [[(-2, -2, 0), (2, -2, 0), (2, 2, 0)], [(-2, -2, 0), (2, 2, 0), (-2, 2, 0)]]
PLATE = '[[obstacle]]\nname = "plate"\nmaterial = "glass"\nmotion = "fixed"\nstl = "plate.stl"\n\n'


class Obstacles(ProgramTest):
    def run_to(self, name, text, steps, *options, ranks=0):
        scene, state = self.write("scene.toml", text), self.folder / f"{name}.h5"
        self.succeeds("run", scene, "--steps", steps, "--quiet", "--state", state, *options, ranks=ranks)
        return contents(state)

    def test_solvers_agree(self):
        for number, obstacles in enumerate((FUNNEL, DRUM)):
            text = HEAD + disks() + obstacles + STEP
            ends = {}
            for scheme in ("nlgs", "ccs", "dcs"):
                more = () if scheme == "nlgs" else ("-n", 4)
                ends[scheme] = self.run_to(f"{scheme}{number}", text, 60, "--scheme", scheme, "--tolerance", 1e-9, "--max-iterations", 100000, *more)
            for scheme in ("ccs", "dcs"):
                self.assertLess(np.abs(ends[scheme]["x"] - ends["nlgs"]["x"]).max(), 5e-3)
            self.assertTrue((ends["nlgs"]["contacts/j"] < 0).any())

    def test_runs_go_on_bit_for_bit_and_over_mpi(self):
        for number, obstacles in enumerate(
            (FUNNEL, DRUM, FUNNEL.replace('"velocity"\nvelocity = [3, 0]', '"oscillating"\namplitude = 0.1\nfrequency = 4\ndirection = [0, 1]'))
        ):
            text = HEAD + disks() + obstacles + STEP
            whole = self.run_to(f"whole{number}", text, 60)
            self.run_to(f"first{number}", text, 27)
            rest = self.run_to(f"rest{number}", text, 33, "--from", self.folder / f"first{number}.h5")
            ranks = self.run_to(f"ranks{number}", text, 60, "--scheme", "dcs", ranks=2)
            own = self.run_to(f"own{number}", text, 60, "--scheme", "dcs", "-n", 2)
            self.assertGreater(len(set(ranks["subdomain"])), 1)
            for one, other in ((whole, rest), (ranks, own)):
                for key, values in one.items():
                    np.testing.assert_array_equal(other[key], values, key)

    def test_an_stl_file_is_the_plane_that_it_says(self):
        plane = self.run_to("plane", SCENE, 50)
        for name, text in (("binary", False), ("text", True)):
            (self.folder / "plate.stl").write_bytes(stl(SHEET, text))
            sheet = self.run_to(name, SCENE.replace(FLOOR, PLATE), 50)
            np.testing.assert_allclose(sheet["x"], plane["x"], atol=1e-12)
            np.testing.assert_allclose(sheet["velocity"], plane["velocity"], atol=1e-11)
        (self.folder / "plate.stl").write_bytes(b"  \n" + stl(SHEET, True).upper())
        np.testing.assert_array_equal(self.run_to("letters", SCENE.replace(FLOOR, PLATE), 50)["x"], sheet["x"])
        (self.folder / "plate.stl").write_bytes(stl([[(x * 1000, y * 1000, z * 1000 - 500) for x, y, z in c] for c in SHEET]))
        scaled = self.run_to("scaled", SCENE.replace(FLOOR, PLATE.replace(".stl", '.stl"\nscale = 1e-3\nshift = [0, 0, 0.5]\n#"')), 50)
        np.testing.assert_allclose(scaled["x"], plane["x"], atol=1e-6)
        faces = PLATE.replace('stl = "plate.stl"', "points = [[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]]\nfaces = [[0, 1, 2, 3]]")
        square = self.run_to("faces", SCENE.replace(FLOOR, faces), 50)
        np.testing.assert_allclose(square["x"], plane["x"], atol=1e-12)

    def test_faces_are_flat_and_convex(self):
        pentagon = "[[-2, -2, 0], [2, -2, 0], [2, 2, 0], [0, {}, {}], [-2, 2, 0]]"
        for y, z, face, problem in (
            (3, 0, [0, 1, 2, 3, 4], None),
            (2, 0, [0, 1, 2, 3, 4], None),
            (0, 0, [0, 1, 2, 3, 4], "face 0 is not convex, give triangles"),
            (3, 0.01, [0, 1, 2, 3, 4], "face 0 is not flat, give triangles"),
            (3, 0, [0, 2, 1, 4], "face 0 is not convex, give triangles"),
            (3, 0, [0, 2, 4, 1, 3], "face 0 is not convex, give triangles"),
        ):
            text = SCENE.replace(FLOOR, PLATE.replace('stl = "plate.stl"', f"points = {pentagon.format(y, z)}\nfaces = [{face}]"))
            with self.subTest(y=y, z=z, face=face):
                self.run_to("flat", text, 1) if problem is None else self.assertIn(f"faces must be flat and convex: {problem}", self.refused(text))

    def test_the_series_has_forces_and_a_closed_balance(self):
        scene, series = self.write("scene.toml", HEAD + disks() + DRUM + STEP), self.folder / "series.csv"
        self.succeeds("run", scene, "--steps", 400, "--quiet", "--series", series)
        with open(series) as file:
            rows = list(csv.DictReader(file))
        self.assertLess(float(rows[-1]["energy_error"]), 1e-10)
        self.assertGreater(float(rows[-1]["work_walls_total"]), 0)
        down = np.mean([float(row["obstacle_force_drum_y"]) + float(row["obstacle_force_blade_y"]) for row in rows[200:]])
        weight = 10 * np.pi * sum((0.5 - 0.02 * (k % 4)) ** 2 for k in range(25))
        self.assertLess(abs(down + weight), 0.2 * weight)

    def refused(self, text, *options):
        done = self.run_program("run", self.write("scene.toml", text), "--quiet", *options)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        lines = [line for line in done.stderr.splitlines() if line.startswith("nscdd:") and ": note:" not in line]
        self.assertEqual(len(lines), 1, done.stderr)
        return lines[0].replace(str(self.folder) + "/", "")

    def test_what_cannot_be_is_refused_in_one_line(self):
        plate, flow = SCENE.replace(FLOOR, PLATE), HEAD + disks() + FUNNEL + STEP
        first = plate[: plate.index("[[obstacle]]")].count("\n")
        line = flow[: flow.index("[[obstacle]]")].count("\n")
        binary = stl(SHEET)
        for content, problem in (
            (binary[:-1], "plate.stl: says that it has 2 triangles, which take 184 bytes, found 183"),
            (b"PK", "plate.stl: is no STL file"),
            (stl([]), "plate.stl: has no triangle"),
            (stl([[(0, 0, 0), (1, 1, 1), (2, 2, 2)]]), "scene.toml: obstacle 'plate': facet 0: its corners are on one line"),
            (stl([[(0, 0, 0), (float("nan"), 1, 1), (2, 2, 2)]]), "plate.stl: triangle 0 is not finite"),
            (stl(SHEET, True).replace(b"vertex 2", b"vertex x"), "plate.stl:5: a vertex has three finite numbers"),
            (stl(SHEET, True).replace(b" endloop", b"  vertex 1 2 3"), "plate.stl:8: a facet has three vertices"),
            (b"solid\nsphere 1\n", "plate.stl:2: 'sphere' is no word of an STL file"),
        ):
            (self.folder / "plate.stl").write_bytes(content)
            self.assertEqual(self.refused(plate), f"nscdd: {problem}")
        for change, problem in (
            (("points = [[0, 12], [0, 4], [3, 2]]\n", ""), f"{line + 1}: obstacle 'funnel': needs one of points, stl and cylinder"),
            (("[[0, 12], [0, 4], [3, 2]]", "[[0, 12]]"), f"{line + 5}: obstacle 'funnel': points must be at least 2 lists of 2 numbers"),
            (("points = [[0, 12]", 'stl = "x.stl"\n#'), f"{line + 5}: obstacle 'funnel': stl is for three dimensions: give points"),
            (('"right"', '"funnel"'), f"{line + 8}: obstacle 'funnel': name is given twice"),
            (('motion = "velocity"', 'motion = "rotating"'), f"{line + 13}: obstacle 'gate': rate is missing"),
            (("velocity = [3, 0]\n", "velocity = [3, 0]\nforce = 2\n"), f"{line + 18}: obstacle 'gate': unknown key 'force'"),
        ):
            self.assertIn(f"nscdd: scene.toml:{problem}", self.refused(flow.replace(*change)))
        self.assertEqual(
            self.refused(flow.replace("[0, 4], [3, 2]", "[0, 4], [0, 4]", 1)), "nscdd: scene.toml: obstacle 'funnel': facet 1: its corners are on one line"
        )
        self.run_to("state", flow, 3)
        self.assertIn("3 obstacles", self.refused(HEAD + disks() + DRUM + STEP, "--from", self.folder / "state.h5"))

    def test_a_fast_obstacle_is_noted(self):
        flow = HEAD + disks() + FUNNEL + STEP
        for speed, noted in ((3, False), (30000, True)):
            scene = self.write("scene.toml", flow.replace("velocity = [3, 0]", f"velocity = [{speed}, 0]"))
            said = self.run_program("run", scene, "--steps", 1, "--quiet").stderr
            self.assertEqual("obstacle 'gate' moves by " in said, noted, said)

    def test_no_output_is_an_input(self):
        (self.folder / "plate.stl").write_bytes(stl(SHEET))
        (self.folder / "way.txt").write_text("0 0 0 0\n1 0 0 0\n")
        (self.folder / "link.txt").symlink_to(self.folder / "way.txt")
        moving = PLATE.replace('"fixed"', '"table"\nfile = "way.txt"')
        scene = SCENE.replace(FLOOR, moving) + FLOOR.replace('"fixed"', '"table"\nfile = "wall.txt"')
        (self.folder / "wall.txt").write_text("0 0 0 0\n1 0 0 0\n")
        before = {path.name: path.read_bytes() for path in self.folder.glob("*.[st][tx][lt]")}
        self.assertEqual(len(before), 4)
        for option in ("--json", "--log", "--state", "--checkpoint"):
            for name in before:
                self.assertIn(" is the same file as ", self.refused(scene, option, self.folder / name))
        for name, content in before.items():
            self.assertEqual((self.folder / name).read_bytes(), content)

    def test_other_units_are_told(self):
        (self.folder / "plate.stl").write_bytes(stl([[(2000 * x, 2000 * y, z) for x, y, z in corners] for corners in SHEET]))
        done = self.succeeds("run", self.write("scene.toml", SCENE.replace(FLOOR, PLATE)), "--quiet")
        self.assertIn("obstacle 'plate' has the size 8e+03, the box of the grains 2: is its unit of length another one?", done.stderr)

    def test_a_grain_that_passes_an_obstacle_ends_the_run(self):
        (self.folder / "plate.stl").write_bytes(stl(SHEET))
        fast = SCENE.replace(FLOOR, PLATE).replace("friction = 0.3", "restitution = 0.5").replace("radius = 0.5", "radius = 0.5\nvelocity = [0, 0, -900]", 1)
        self.assertIn("grain 0 and wall 'plate' pass into or through each other within the step", self.refused(fast.replace("[0, 0, 0.5]", "[0, 0, 0.7]")))


if __name__ == "__main__":
    unittest.main()
