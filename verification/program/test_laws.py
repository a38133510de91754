"""Contact laws by name: the same answer by every scheme, exact restarts, closed balances, and what is refused."""
import json
import unittest

import h5py

from harness import GLASS, ProgramTest, errors_of

SCENE = (
    """name = "heap"
dimension = 2
gravity = [1.0, -5.0]
law = "LAW"

"""
    + GLASS
    + """PAIR

[packing]
file = "disks.h5"
material = "glass"

[[wall]]
name = "floor"
side = "y-"
material = "glass"
motion = "fixed"

[[wall]]
name = "left"
side = "x-"
material = "glass"
motion = "fixed"

[step]
h = 0.02
count = 30
"""
)
LAWS = {"cohesive": "cohesion = 3.0\nrange = 1e-3", "rolling": "rolling = 0.05"}


class Laws(ProgramTest):
    def setUp(self):
        super().setUp()
        text = "dimension = 2\ngrains = 80\nspread = 0.25\nseed = 4\ngenerator = 'own'\n"
        self.succeeds("pack", self.write("disks.toml", text), "-o", self.folder / "disks.h5", "--quiet")

    def scene(self, law):
        return self.write(f"{law}.toml", SCENE.replace("LAW", law).replace("PAIR", LAWS[law]))

    def run_scene(self, scene, name, *options):
        out = self.folder / name
        self.succeeds("run", scene, "--quiet", "--json", f"{out}.json", "--state", f"{out}.h5", *options)
        return json.loads((self.folder / f"{name}.json").read_text())

    def test_every_scheme_has_the_same_answer(self):
        for law in LAWS:
            scene = self.scene(law)
            exact = ("--tolerance", "1e-6", "--max-iterations", "50000", "--steps", "8")
            alone = self.run_scene(scene, "alone", *exact)
            self.assertGreater(alone["contacts"][-1], 60)
            balance, kinetic = alone["energy"]["round_off"], alone["energy"]["kinetic"]
            self.assertLess(max(map(abs, balance)), 1e-12 * max(kinetic))
            for name, *options in (("dcs", "--scheme", "dcs", "-n", 4), ("ccs", "--scheme", "ccs", "-n", 4)):
                with self.subTest(law=law, scheme=name):
                    self.run_scene(scene, name, *options, *exact)
                    self.succeeds("compare", self.folder / "alone.json", self.folder / f"{name}.json")

    def test_a_run_goes_on_bit_for_bit(self):
        for law in LAWS:
            scene = self.scene(law)
            for scheme in ((), ("--scheme", "dcs", "-n", 4)):
                whole = self.run_scene(scene, "whole", *scheme)
                first = self.run_scene(scene, "first", "--steps", 13, *scheme)
                second = self.run_scene(scene, "second", "--from", self.folder / "first.h5", "--steps", 17, *scheme)
                self.assertEqual(first["iterations"] + second["iterations"], whole["iterations"])
                self.assertEqual(second["answer"], whole["answer"])

    def test_cohesion_pulls(self):
        self.run_scene(self.scene("cohesive"), "run")
        with h5py.File(self.folder / "run.h5") as state:
            impulses = state["contacts/normal_impulse"][:]
        self.assertGreaterEqual(impulses.min(), -3.0 * 0.02 * (1 + 1e-12))
        self.assertGreater((impulses < 0).sum(), 5)

    def test_a_column_collapses_less_with_resistance_to_rolling(self):
        scene = self.scene("rolling")
        text = (
            scene.read_text()
            .replace("gravity = [1.0, -5.0]", "gravity = [0.0, -5.0]")
            .replace('[[wall]]\nname = "left"\nside = "x-"\nmaterial = "glass"\nmotion = "fixed"\n', "")
        )
        reached = []
        for rolling in (0.0, 0.05, 0.25):
            scene.write_text(text.replace("rolling = 0.05", f"rolling = {rolling}"))
            self.run_scene(scene, "run", "--steps", 300)
            with h5py.File(self.folder / "run.h5") as state:
                reached.append((state["x"][:, 0].std(), state["x"][:, 1].max()))
        self.assertEqual(reached, sorted(reached, key=lambda r: -r[0]), "the stronger, the less it spreads")
        self.assertLess(reached[2][0], 0.8 * reached[0][0])
        self.assertGreater(reached[2][1], reached[0][1])

    def test_what_cannot_be_meant_is_refused_in_one_line(self):
        cohesive = self.scene("cohesive").read_text()
        for spoilt, problem in (
            (cohesive.replace("range = 1e-3", ""), "pair 'glass'-'glass': cohesion needs range, the gap up to which it pulls"),
            (cohesive.replace("range", "restitution = 0.5\nrange"), "pair 'glass'-'glass': cohesion needs restitution 0"),
            (cohesive.replace("cohesion = 3.0", "cohesion = -3.0"), "cohesion"),
            (cohesive.replace('"cohesive"', '"coulomb"'), "unknown key 'cohesion'"),
            (cohesive.replace('"cohesive"', '"sticky"'), "cohesive, rolling, found 'sticky'"),
        ):
            scene = self.write("spoilt.toml", spoilt)
            done = self.run_program("run", scene, "--quiet")
            self.assertEqual(done.returncode, 1)
            (line,) = errors_of(done)
            self.assertIn(f"{scene}:", line)
            self.assertIn(problem, line)
        for options in (("run", "--scheme", "newton"), ("export-fclib",)):
            done = self.run_program(*options, self.scene("cohesive"), *(() if options[0] == "run" else ("-o", self.folder / "out.h5")))
            self.assertEqual(done.returncode, 1)
            self.assertIn("cohesive Coulomb", errors_of(done)[0])


if __name__ == "__main__":
    unittest.main()
