"""Physics that a scene leaves out is said at the start; what a packing file has besides places and radii is used."""
import json
import os
import pathlib
import unittest

import h5py
import jsonschema
import numpy as np

from harness import PACKED, SCENE, ProgramTest
from test_bad_input import Refusals

SCHEMA = json.loads((pathlib.Path(__file__).resolve().parents[2] / "reports" / "run.schema.json").read_text())
PAIR = SCENE[SCENE.index("[[pair]]") : SCENE.index("[[grain]]")]
WALL = SCENE[SCENE.index("[[wall]]") : SCENE.index("[step]")]
STEEL = '[[material]]\nname = "steel"\ndensity = 8.0\n\n'


class Notes(ProgramTest):
    def notes(self, text, *options, ranks=0):
        """Those of the JSON file, which are the lines printed."""
        path = self.folder / "out.json"
        done = self.succeeds("run", self.write("scene.toml", text), "--json", path, "--quiet", *options, ranks=ranks)
        report = json.loads(path.read_text())
        jsonschema.validate(report, SCHEMA)
        self.assertEqual([line for line in done.stderr.splitlines() if line.startswith("nscdd:")], [f"nscdd: note: {note}" for note in report["notes"]])
        return [note.replace(f"{self.folder}/", "") for note in report["notes"]]

    def test_nothing_is_left_out(self):
        self.assertEqual(self.notes(SCENE), [])
        self.assertEqual(self.notes(SCENE.replace(PAIR, STEEL + PAIR)), [], "nothing is of steel")
        explicit = PAIR.replace("0.3", "0")
        self.assertEqual(self.notes(SCENE.replace(PAIR, explicit)), [])

    def test_pairs(self):
        def says(names):
            return [f"scene.toml: no [[pair]] of {names}, which can touch: friction and restitution are 0 there"]

        bare = SCENE.replace(PAIR, STEEL)
        self.assertEqual(self.notes(bare), says("'glass'-'glass'"))
        self.assertEqual(self.notes(bare, "--repeat", 3), says("'glass'-'glass'"))
        for law in ("coulomb", "cohesive", "rolling"):
            self.assertEqual(self.notes(f'law = "{law}"\n{bare}'), says("'glass'-'glass'"))
        self.assertEqual(self.notes(bare, "--scheme", "dcs", ranks=3), says("'glass'-'glass'"))
        steel_wall = SCENE.replace(WALL, WALL.replace("glass", "steel")).replace(PAIR, STEEL + PAIR)
        self.assertEqual(self.notes(steel_wall), says("'glass'-'steel'"))
        one = SCENE[: SCENE.index("[[grain]]")] + SCENE[SCENE.rindex("[[grain]]") :]
        self.assertEqual(self.notes(one.replace(PAIR, STEEL).replace(WALL, WALL.replace("glass", "steel"))), says("'glass'-'steel'"))
        many = "".join(f'[[material]]\nname = "m{k}"\ndensity = 1\n[[grain]]\nmaterial = "m{k}"\nradius = 0.1\nposition = [{k + 2}, 0, 1]\n' for k in range(3))
        self.assertEqual(self.notes(SCENE.replace(WALL, many + WALL)), says("'glass'-'m0', 'glass'-'m1', 'glass'-'m2' and 3 more"))

    def test_gravity(self):
        falls = ["scene.toml: gravity, and no [[wall]] faces it: nothing but friction stops a fall"]
        self.assertEqual(self.notes(SCENE.replace(WALL, "")), falls)
        self.assertEqual(self.notes(SCENE.replace("gravity = [0, 0, -10]", "gravity = [0, -10, 0]")), falls)
        self.assertEqual(self.notes(SCENE.replace(WALL, "").replace("-10", "0")), [])

    def test_threads(self):
        cores = len(os.sched_getaffinity(0))
        self.assertEqual(self.notes(SCENE, "--scheme", "dcs", "-n", 2, "--threads", 1), [])
        (note,) = self.notes(SCENE, "--threads", cores + 1)
        self.assertIn(f"--threads {cores + 1}: this process may use {cores} core", note)
        self.assertEqual(self.notes(SCENE, "--threads", "auto", ranks=2), ["--threads auto is one over MPI: give the number of threads of a process"])

    def test_threads_of_a_process_that_has_one_core(self):
        before = os.sched_getaffinity(0)
        self.addCleanup(os.sched_setaffinity, 0, before)
        os.sched_setaffinity(0, {min(before)})
        (note,) = self.notes(SCENE, "--threads", 2)
        self.assertIn("--threads 2: this process may use 1 core, and", note)
        done = self.succeeds("run", self.write("scene.toml", SCENE), "--threads", "auto")
        self.assertIn("nlgs on 1 subdomain:", done.stdout)

    def test_overlaps(self):
        for overlap, says in ((0.05, True), (0.02, False)):  # of a radius of 0.5
            grains = "".join(f'[[grain]]\nmaterial = "glass"\nradius = 0.5\nposition = [{x}, 0, 2]\n\n' for x in (0, 1 - 0.5 * overlap))
            scene = self.write("two.toml", SCENE[: SCENE.index("[[grain]]")] + grains + SCENE[SCENE.index("[[wall]]") :])
            done = self.succeeds("run", scene, "--steps", 1)
            self.assertEqual("grains overlap by up to 5 % of a radius at the end" in done.stderr, says, done.stderr)

    def test_a_rebound_that_ends_in_an_overlap(self):
        """The pair was no contact when it was detected."""
        pair = 'pair = [{materials = ["a", "a"], restitution = 0.5}]'
        grains = [f'{{position = [{x}, 0, 0], radius = 0.1, velocity = [{v}, 0, 0], material = "a"}}' for x, v in ((0, 0), (0.2046, -1))]
        text = f'name = "pair"\ndimension = 3\nmaterial = [{{name = "a", density = 1000}}]\n{pair}\n'
        scene = self.write("pair.toml", text + f"grain = [{', '.join(grains)}]\nstep = {{h = 0.009, count = 1}}\n")
        done = self.succeeds("run", scene, "--json", self.folder / "pair.json")
        self.assertAlmostEqual(json.loads((self.folder / "pair.json").read_text())["final"]["max_overlap"], 0.044)
        self.assertIn("grains overlap by up to 4.4 % of a radius", done.stderr)

    def test_subdomains(self):
        for scheme in ("dcs", "ccs"):
            self.assertEqual(self.notes(SCENE, "--scheme", scheme), [f"--scheme {scheme} without -n: one subdomain, so nothing is decomposed"])
            self.assertEqual(self.notes(SCENE, "--scheme", scheme, "-n", 1), [])
        self.assertEqual(self.notes(SCENE, "--scheme", "dcs", ranks=1), [])


class PackingWithMore(Refusals):
    """Three spheres in free flight, so that what they start with is what they end with."""

    FLIGHT = PACKED.replace("-10", "0").replace(WALL, "").replace("[[pair]]", STEEL + "[[pair]]").replace("count = 5", "count = 1")
    MORE = {
        "velocity": np.array(((1.0, 0, 0), (0, 2.0, 0), (0, 0, 3.0))),
        "spin": np.array(((0, 0, 0.5), (0, 4.0, 0), (1.0, 0, 0))),
        "material": np.array((1, 0, 1), dtype="i4"),
        "materials/name": np.array((b"steel", b"glass")),
    }

    def packed(self, text=FLIGHT, **more):
        """The scene, with a packing of all that MORE has; None in `more` leaves a thing out."""
        with h5py.File(self.folder / "packing.h5", "w") as file:
            file["x"], file["radius"], file["box"] = np.array(((1.0, 1, 1), (3, 1, 1), (5, 1, 1))), np.full(3, 0.5), np.full(3, 6.0)
            for name, values in (self.MORE | {name.replace("names", "materials/name"): values for name, values in more.items()}).items():
                if values is not None:
                    file[name] = values
        return self.write("scene.toml", text)

    def state(self, scene, *options, **how):
        path = self.folder / "end.h5"
        self.succeeds("run", scene, "--state", path, "--json", self.folder / "end.json", "--quiet", *options, **how)
        with h5py.File(path) as file:
            return {name: file[name][...] for name in ("x", "velocity", "spin", "material")}

    def test_they_are_used(self):
        for options in ({}, {"ranks": 2}):
            end = self.state(self.packed(), "--scheme", "dcs", **options)
            for name in ("velocity", "spin"):
                np.testing.assert_array_equal(end[name], self.MORE[name])
            np.testing.assert_allclose(end["x"], ((1.001, 1, 1), (3, 1.002, 1), (5, 1, 1.003)), rtol=1e-14)
            self.assertEqual(end["material"].tolist(), [0, 1, 0])  # glass is the scene's first
            report = json.loads((self.folder / "end.json").read_text())
            mass = np.pi / 6 * np.array((1.0, 8.0, 1.0))
            energy = 0.5 * (mass * (np.square(self.MORE["velocity"]) + 0.1 * np.square(self.MORE["spin"])).sum(1)).sum()
            self.assertAlmostEqual(report["final"]["kinetic_energy"], energy, delta=1e-12)

    def test_each_may_be_left_out(self):
        self.assertEqual(self.state(self.packed(names=None))["material"].tolist(), [1, 0, 1])
        end = self.state(self.packed(velocity=None, spin=None, material=None))
        self.assertEqual(end["material"].tolist(), [0, 0, 0])
        self.assertEqual((np.abs(end["velocity"]).max(), np.abs(end["spin"]).max()), (0, 0))

    def test_a_run_goes_on_from_its_state(self):
        scene = self.packed()
        self.state(scene)
        (self.folder / "end.h5").rename(self.folder / "start.h5")
        self.state(scene, "--from", self.folder / "start.h5")
        self.packed(material=np.array((1, 1, 1)))
        self.refused(["the material of grain 1 is 'steel' in the state, 'glass' in the scene"], "run", scene, "--from", self.folder / "start.h5")

    def test_a_state_is_a_packing_with_motion(self):
        scene = self.packed()
        self.state(scene)
        (self.folder / "end.h5").rename(self.folder / "start.h5")
        np.testing.assert_array_equal(self.state(scene, "--packing", self.folder / "start.h5")["velocity"], self.MORE["velocity"])

    def test_bad_ones(self):
        broken = self.MORE["velocity"].copy()
        broken[2, 1] = np.nan
        for more, *fragments in (
            ({"velocity": broken}, "packing.h5: dataset 'velocity': row 2 is not finite"),
            ({"velocity": np.zeros((2, 3))}, "packing.h5: dataset 'velocity'", "(2, 3)"),
            ({"velocity": np.zeros(9)}, "packing.h5: dataset 'velocity'"),
            ({"spin": np.zeros((3, 1))}, "packing.h5: dataset 'spin'"),
            ({"periodic": np.array((0, 2, 0))}, "packing.h5: dataset 'periodic'", "must be 0 or 1, found 2"),
            ({"material": np.zeros(3)}, "packing.h5: dataset 'material'"),
            ({"material": np.zeros(4, dtype=int)}, "packing.h5: dataset 'material'"),
            ({"material": np.array((0, 1, 2))}, "packing.h5: dataset 'material': row 2 must lie in [0, 1], the materials of the file, found 2"),
            ({"material": np.array((0, -1, 1)), "names": None}, "dataset 'material': row 1 must lie in [0, 1], the materials of", "scene.toml, found -1"),
            ({"names": np.array((b"iron", b"glass"))}, "dataset 'material': row 1 is of 'iron', which is not a [[material]] of", "scene.toml"),
            ({"names": np.array((1.0, 2.0))}, "packing.h5: dataset 'materials/name'"),
        ):
            self.refused(fragments, "run", self.packed(**more))
        self.refused(["dataset 'velocity': row 2 is not finite"], "run", self.packed(velocity=broken), "--scheme", "dcs", ranks=3)
        smooth = self.FLIGHT.replace("dimension", 'law = "frictionless"\ndimension').replace("friction = 0.3\n", "")
        self.refused(["dataset 'spin': row 0 turns, which the law \"frictionless\" of", 'give law = "coulomb"'], "run", self.packed(smooth))
        self.state(self.packed(smooth, spin=np.zeros((3, 3))))


if __name__ == "__main__":
    unittest.main()
