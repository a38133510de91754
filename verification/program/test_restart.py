"""A run that goes on from a state is the one that was not interrupted; the state of another scene is refused; a step in which grains
pass through each other is refused."""
import itertools
import json
import pathlib
import re
import unittest

import h5py
import numpy as np

from harness import PACKED, SCENE, ProgramTest

REDUCED = pathlib.Path(__file__).resolve().parents[2] / "cases/reduced"


def contents(path):
    """All datasets and attributes of a state."""
    found = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.update({name: item[...]} if isinstance(item, h5py.Dataset) else {}))
        return found | dict(file.attrs)


class Restart(ProgramTest):
    def pack(self, name, dimension, grains):
        path = self.folder / f"{name}.h5"
        if not path.exists():
            text = f"dimension = {dimension}\ngrains = {grains}\nspread = 0.25\nseed = 4\ngenerator = 'own'\n"
            self.succeeds("pack", self.write(f"{name}-packing.toml", text), "-o", path, "--quiet")
        return path

    def check_goes_on(self, *command, ranks=0):
        """30 steps at once, and as 13, 7 and 10: no broad phase falls on the cuts, with one every 10 steps."""

        def run(name, steps, *more):
            out = self.folder / name
            done = self.run_program("run", *command, *more, "--steps", steps, "--quiet", "--json", f"{out}.json", "--state", f"{out}.h5", ranks=ranks)
            self.assertIn(done.returncode, (0, 3), done.stderr)
            return json.loads(pathlib.Path(f"{out}.json").read_text()), contents(f"{out}.h5")

        with self.subTest(command=" ".join(map(str, command)), ranks=ranks):
            whole, expected = run("whole", 30)
            self.assertGreater(whole["contacts"][-1], 20)
            parts = [run("first", 13), run("second", 7, "--from", self.folder / "first.h5"), run("third", 10, "--from", self.folder / "second.h5")]
            self.assertGreater(parts[0][1]["rough/steps_since"] + parts[1][1]["rough/steps_since"], 0)
            for key in ("iterations", "residual", "contacts"):
                self.assertEqual(whole[key], list(itertools.chain(*(report[key] for report, _ in parts))), key)
            self.assertEqual(whole["final"], parts[2][0]["final"])
            self.assertEqual(parts[2][1].keys(), expected.keys())
            for key, values in expected.items():
                np.testing.assert_array_equal(parts[2][1][key], values, key)

    def test_disks_with_friction_between_walls_under_pressure(self):
        scene = (REDUCED / "biaxial.toml", "--packing", self.pack("disks", 2, 60))
        for options in (
            ("--scheme", "nlgs", "--method", "paper"),
            ("--scheme", "nlgs", "--method", "auto"),
            ("--scheme", "newton", "--tolerance", "1e-8"),
            ("--scheme", "spg"),
            ("--scheme", "apgd"),
            ("--scheme", "ccs", "-n", 3, "--method", "paper"),
            ("--scheme", "ccs", "-n", 4, "--interface", "closed-form", "--method", "auto"),
            ("--scheme", "dcs", "-n", 4, "--threads", 2, "--method", "auto"),
            ("--scheme", "dcs", "-n", 2, "--interface", "factorised", "--method", "paper"),
        ):
            self.check_goes_on(*scene, *options)

    def test_spheres_with_friction(self):
        scene = (REDUCED / "triaxial.toml", "--packing", self.pack("spheres", 3, 60))
        for options in (("--scheme", "nlgs", "--method", "auto"), ("--scheme", "dcs", "-n", 6, "--method", "paper")):
            self.check_goes_on(*scene, *options)

    def test_without_friction_between_fixed_walls(self):
        text = PACKED.replace("friction = 0.3", "friction = 0").replace("packing.h5", "spheres.h5")
        scene = self.write("smooth.toml", text.replace("h = 0.001", "h = 0.005"))
        self.pack("spheres", 3, 60)
        for options in (("--scheme", "nlgs"), ("--scheme", "ccs", "-n", 3)):
            self.check_goes_on(scene, *options)

    def test_over_mpi(self):
        scene = (REDUCED / "biaxial.toml", "--packing", self.pack("disks", 2, 60))
        self.check_goes_on(*scene, "--scheme", "dcs", ranks=2)

    def test_more_ranks_than_grains(self):
        """Some ranks read no row of a file, in which a packing and a grain of the scene are."""
        with h5py.File(self.folder / "packing.h5", "w") as file:
            file["x"], file["radius"], file["box"] = [[1, 1, 0.5], [3, 1, 0.5]], [0.5, 0.5], [4.0, 4, 4]
        grain = '[[grain]]\nposition = [1, 1.2, 1.6]\nradius = 0.5\nmaterial = "glass"\nforce = [0.1, 0, 0]\n\n[[wall]]'
        scene = self.write("scene.toml", PACKED.replace("[[wall]]", grain))
        ends = []
        for name, ranks, options in (("mpi", 5, ()), ("own", 0, ("-n", 5))):
            first, rest = self.folder / f"{name}-first.h5", self.folder / f"{name}.h5"
            self.succeeds("run", scene, "--scheme", "dcs", *options, "--steps", 30, "--state", first, "--quiet", ranks=ranks)
            self.succeeds("run", scene, "--scheme", "dcs", *options, "--from", first, "--steps", 30, "--state", rest, "--quiet", ranks=ranks)
            ends.append(rest.read_bytes())
        self.assertEqual(*ends)

    def test_on_other_subdomains(self):
        scene = ("run", REDUCED / "biaxial.toml", "--packing", self.pack("disks", 2, 60), "--quiet", "--tolerance", 1e-8)
        for name, more in (
            ("whole", ("--steps", 6)),
            ("first", ("--steps", 5)),
            ("rest", ("--steps", 1, "--from", self.folder / "first.h5", "--scheme", "dcs", "-n", 4)),
        ):
            self.succeeds(*scene, *more, "--state", self.folder / f"{name}.h5")
        whole, rest = (contents(self.folder / f"{name}.h5") for name in ("whole", "rest"))
        self.assertLess(np.abs(rest["x"] - whole["x"]).max(), 1e-5)
        self.assertEqual((rest["step"], rest["time"]), (whole["step"], whole["time"]))


class Refused(ProgramTest):
    def test_a_refusal_tells_of_steps_that_had_failed(self):
        squeezed = """
name = "squeezed"
dimension = 2
material = [{name = "a", density = 1}]
wall = [
  {name = "left", normal = [1, 0], through = [0, 0], material = "a", motion = "fixed"},
  {name = "right", normal = [-1, 0], through = [1, 0], material = "a", motion = "velocity", velocity = [-0.1, 0]},
]
grain = [{position = [0.5, 0], radius = 0.5, material = "a"}]
step = {h = 1e-2, count = 60}
"""
        done = self.run_program("run", self.write("scene.toml", squeezed), "--quiet", "--max-iterations", 100)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertRegex(done.stderr, r"step 5\d: grain 0 and wall .* overlap by 1\d % .*; 5\d of the 5\d steps before it did not converge")


class AnotherScene(ProgramTest):
    def setUp(self):
        super().setUp()
        self.state = self.folder / "state.h5"
        self.succeeds("run", self.write("scene.toml", SCENE), "--state", self.state, "--quiet")

    def go_on(self, text, *more, ranks=0):
        return self.run_program("run", self.write("other.toml", text), "--from", self.state, "--quiet", "--scheme", "dcs", *more, ranks=ranks)

    def refused(self, text, *fragments, adoptable=True):
        for ranks in (0, 2):
            done = self.go_on(text, ranks=ranks)
            lines = [line for line in done.stderr.splitlines() if line.startswith("nscdd:")]
            with self.subTest(fragments=fragments, ranks=ranks):
                self.assertEqual((done.returncode, len(lines)), (1, 1), done.stderr)
                for fragment in ("state.h5", "other.toml", *fragments):
                    self.assertIn(fragment, lines[0])
                self.assertEqual("--adopt" in lines[0], adoptable)
        done = self.go_on(text, "--adopt")
        self.assertEqual(done.returncode, 0 if adoptable else 1, done.stderr)

    def changed(self, *replacements):
        text = SCENE
        for old, new in replacements:
            self.assertIn(old, text)
            text = text.replace(old, new)
        return text

    def test_the_same_scene_with_other_forces_and_solver(self):
        text = self.changed(
            ("friction = 0.3", "friction = 0.5\nrestitution = 0.1"),
            ("h = 0.001", "h = 0.002"),
            ("-10]", "-9]"),
            ("count = 5", "count = 7\n[solver]\ntolerance = 1e-6"),
        )
        done = self.go_on(text)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_names(self):
        self.refused(self.changed(('name = "pair"', 'name = "twins"')), "the scene's name is 'pair' in the state, 'twins' in the scene")
        self.refused(self.changed(("glass", "steel")), "material 1 is 'glass' in the state, 'steel' in the scene")
        self.refused(self.changed(('"floor"', '"ground"')), "wall 1 is 'floor' in the state, 'ground' in the scene")

    def test_materials(self):
        self.refused(self.changed(("density = 1.0", "density = 2")), "density", "is 1 in the state, 2 in the scene")
        second = '[[material]]\nname = "wood"\ndensity = 1\n\n[[pair]]'
        self.refused(self.changed(("[[pair]]", second)), "number of materials is 1 in the state, 2 in the scene")

    def test_walls(self):
        self.refused(self.changed(("normal = [0, 0, 1]", "normal = [0, 0.28, 0.96]")), "normal of wall 'floor'", "[0, 0, 1]", "[0, 0.28, 0.96]")
        second = '[[wall]]\nname = "side"\nnormal = [1, 0, 0]\nthrough = [-9, 0, 0]\nmaterial = "glass"\nmotion = "fixed"\n\n[step]'
        self.refused(self.changed(("[step]", second)), "1 walls", "has 2", adoptable=False)

    def test_grains(self):
        one = SCENE.index("[[grain]]")
        two = SCENE.index("[[grain]]", one + 1)
        end = SCENE.index("[[wall]]")
        smaller = SCENE[two:end].replace("0.5\n", "0.25\n")
        self.refused(SCENE[:two] + smaller + SCENE[end:], "radius of grain 1 is 0.5 in the state, 0.25 in the scene")
        self.refused(SCENE[:two] + SCENE[end:], "number of grains is 2 in the state, 1 in the scene")
        third = SCENE[two:end].replace("1.5]", "2.6]")
        self.refused(SCENE[:end] + third + SCENE[end:], "2 grains", "has 3", adoptable=False)

    def test_a_packing(self):
        """It is compared where it is there, and not needed."""
        with h5py.File(self.folder / "packing.h5", "w") as file:
            file["x"], file["radius"], file["box"] = [[1, 1, 0.5], [3, 1, 0.5]], [0.5, 0.5], [4.0, 4, 4]
        self.succeeds("run", self.write("scene.toml", PACKED), "--state", self.state, "--quiet")
        self.assertEqual(self.go_on(PACKED).returncode, 0)
        with h5py.File(self.folder / "packing.h5", "r+") as file:
            file["radius"][1] = 0.25
        self.refused(PACKED, "radius of grain 1 is 0.5 in the state, 0.25 in the scene")
        (self.folder / "packing.h5").unlink()
        self.assertEqual(self.go_on(PACKED).returncode, 0)

    def test_many_differences_are_one_line(self):
        text = self.changed(
            ('name = "pair"', 'name = "twins"'), ("glass", "steel"), ('"floor"', '"ground"'), ("density = 1.0", "density = 2"), ("radius = 0.5", "radius = 0.4")
        )
        self.refused(text, "'twins'", "'steel'", "and more")

    def test_a_state_of_an_earlier_version(self):
        with h5py.File(self.state, "r+") as file:
            del file["rough"]
        done = self.go_on(SCENE)
        self.assertEqual((done.returncode, done.stderr), (1, f"nscdd: {self.state}: dataset 'rough/partition': is missing\n"))

    def test_a_state_with_damaged_names_or_rough_detection(self):
        for dataset, values, problem in (
            ("walls/name", ["floor"], "must hold strings of fixed length"),
            ("walls/name", np.array([b"floor"] * 2), "must have shape (1), found (2)"),
            ("materials/name", [7], "must hold strings of fixed length"),
            ("materials/density", np.zeros(0), "must have shape (0), found (1)"),
            ("rough/skin", [-1.0], "must be > 0"),
            ("rough/steps_since", [-1], "must be >= 0"),
            ("rough/x", np.full((2, 3), np.inf), "row 0 is not finite"),
        ):
            self.succeeds("run", self.folder / "scene.toml", "--state", self.state, "--quiet")
            with h5py.File(self.state, "r+") as file:
                del file[dataset]
                file[dataset] = values
            for more in ((), ("--adopt",)):
                done = self.go_on(SCENE, *more)
                with self.subTest(dataset=dataset, more=more):
                    self.assertEqual(done.returncode, 1)
                    self.assertIn(problem, done.stderr)

    def test_adopt_needs_a_state(self):
        done = self.run_program("run", self.folder / "scene.toml", "--adopt")
        self.assertEqual(done.returncode, 1)
        self.assertIn("--adopt", done.stderr)


class Passage(ProgramTest):
    def test_a_step_too_long_to_see_a_contact(self):
        """Four radii a step at another grain, and at a wall: exit 1 and the state before; with the step that it asks for they meet."""
        flight = SCENE.replace("[0, 0, -10]", "[0, 0, 0]").replace("friction = 0.3", "restitution = 0.5").replace("count = 5", "count = 2")
        fast = flight.replace("[0.3, 0.1, 1.5]", "[0, 0, 4.51]\nvelocity = [0, 0, -2000]")  # detected at 3.51, 1.51, -0.49
        grain = fast.replace("through = [0, 0, 0]", "through = [0, 0, -50]")
        wall = fast.replace("[0, 0, 0.5]", "[9, 0, 0.5]").replace("4.51", "3.7")
        for text, pair in ((grain, "grain 0 and grain 1"), (wall, "grain 1 and wall 'floor'")):
            out = self.folder / "out"
            for ranks in (0, 2):
                done = self.run_program(
                    "run", self.write("scene.toml", text), "--scheme", "dcs", "--quiet", "--json", f"{out}.json", "--state", f"{out}.h5", ranks=ranks
                )
                lines = [line for line in done.stderr.splitlines() if line.startswith("nscdd:") and not line.startswith("nscdd: note:")]
                with self.subTest(pair=pair, ranks=ranks):
                    self.assertEqual((done.returncode, len(lines)), (1, 1), done.stderr)
                    self.assertIn(f"step 2: {pair} pass into or through each other within the step: take h <= ", lines[0])
                    self.assertTrue(lines[0].endswith(f"; the state before it, of step 1, is in {out}.h5"), lines[0])
                    self.assertFalse((self.folder / "out.json").exists())
                    self.succeeds("run", self.folder / "scene.toml", "--scheme", "dcs", "--steps", 1, "--quiet", "--state", f"{out}-1.h5", ranks=ranks)
                    self.assertEqual((self.folder / "out.h5").read_bytes(), (self.folder / "out-1.h5").read_bytes())
            h = re.search(r"h <= (\S+) s", lines[0])[1]
            self.succeeds("run", self.write("fine.toml", text.replace("h = 0.001", f"h = {h}")), "--steps", 300, "--quiet", "--state", f"{out}.h5")
            end = contents(f"{out}.h5")["velocity"]
            self.assertGreater(end[1, 2], end[0, 2])  # they part
            (self.folder / "out.h5").unlink()


if __name__ == "__main__":
    unittest.main()
