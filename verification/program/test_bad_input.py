"""Bad input gives one clear line and a non-zero exit on every rank, without a hang, and leaves old results alone."""
import unittest

import h5py
import numpy as np

from harness import PACKED, SCENE, ProgramTest


class BadInput(ProgramTest):
    def refused(self, fragments, *arguments):
        """Alone and on two ranks: exit 1 and exactly one line of ours, with all fragments in it."""
        for ranks in (0, 2):
            done = self.run_program(*arguments, "--quiet", ranks=ranks)
            lines = [line for line in done.stderr.splitlines() if line.startswith("nscdd:")]
            with self.subTest(fragments=fragments, ranks=ranks):
                self.assertEqual(done.returncode, 1, done.stderr)
                self.assertEqual(len(lines), 1, done.stderr)
                for fragment in fragments:
                    self.assertIn(fragment, lines[0])
                self.assertEqual(done.stdout, "")

    def refused_scene(self, old, new, *fragments):
        self.assertIn(old, SCENE)
        scene = self.write("scene.toml", SCENE.replace(old, new, 1))
        self.refused(["scene.toml", *fragments], "run", scene, "--scheme", "dcs")

    def test_missing_scene(self):
        self.refused(["nowhere.toml"], "run", self.folder / "nowhere.toml", "--scheme", "dcs")

    def test_unknown_key(self):
        self.refused_scene("[step]\n", "[step]\nsteps = 5\n", "steps")

    def test_negative_radius(self):
        self.refused_scene("radius = 0.5", "radius = -0.5", "radius", "-0.5")

    def test_zero_mass(self):
        self.refused_scene("density = 1.0", "density = 0.0", "density")

    def test_nan(self):
        self.refused_scene("position = [0, 0, 0.5]", "position = [0, nan, 0.5]", "position")

    def test_overlapping_grains(self):
        scene = self.write("scene.toml", SCENE.replace("[0.3, 0.1, 1.5]", "[0, 0, 1.35]"))
        self.refused(["grain 0", "grain 1", "overlap"], "run", scene, "--scheme", "dcs")

    def test_coincident_grains(self):
        scene = self.write("scene.toml", SCENE.replace("[0.3, 0.1, 1.5]", "[0, 0, 0.5]"))
        self.refused(["grain 0", "grain 1", "overlap"], "run", scene, "--scheme", "dcs")

    def test_subdomains_that_are_not_the_ranks(self):
        scene = self.write("scene.toml", SCENE)
        done = self.run_program("run", scene, "--scheme", "dcs", "--subdomains", 3, ranks=2)
        self.assertEqual(done.returncode, 1)
        self.assertIn("--subdomains 3", done.stderr)

    def test_threads_without_subdomains_of_their_own(self):
        scene = self.write("scene.toml", SCENE)
        for arguments, ranks in ((("--subdomains", 2, "--threads", 3), 0), (("--threads", 2), 2)):
            done = self.run_program("run", scene, "--scheme", "dcs", *arguments, ranks=ranks)
            self.assertEqual(done.returncode, 1)
            self.assertIn("--threads", done.stderr)

    def test_grid_that_does_not_fit(self):
        scene = self.write("scene.toml", SCENE)
        done = self.run_program("run", scene, "--scheme", "dcs", "--subdomains", 4, "--grid", "3x1x1")
        self.assertEqual(done.returncode, 1)
        self.assertIn("--grid 3x1x1", done.stderr)

    def test_sequential_scheme_on_two_ranks(self):
        scene = self.write("scene.toml", SCENE)
        for scheme in ("nlgs", "newton"):
            done = self.run_program("run", scene, "--scheme", scheme, ranks=2)
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"{scheme} is sequential", done.stderr)

    def test_options_of_sweeps_for_a_scheme_without(self):
        scene = self.write("scene.toml", SCENE)
        for scheme, option in (("newton", ("--window", 2)), ("spg", ("--method", "paper")), ("apgd", ("--relaxation", 1.5)),
                               ("newton", ("--sweeps", 2))):
            done = self.run_program("run", scene, "--scheme", scheme, *option)
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"{option[0]} is of sweeps, which --scheme {scheme} does not make", done.stderr)

    def test_window_of_a_scene_too_large(self):
        scene = self.write("scene.toml", SCENE + "\n[solver]\nwindow = 9\n")
        done = self.run_program("run", scene, "--scheme", "dcs", ranks=2)
        self.assertEqual(done.returncode, 1)
        self.assertIn("solver: window must be <= 8, found 9", done.stderr)

    def packing(self, x=((1.0, 1.0, 0.5), (3.0, 1.0, 0.5)), radius=(0.5, 0.5)):
        with h5py.File(self.folder / "packing.h5", "w") as file:
            file["x"] = np.array(x)
            file["radius"] = np.array(radius)
            file["box"] = np.array((4.0, 4.0, 4.0))
        return self.write("scene.toml", PACKED)

    def test_good_packing(self):  # so that the refusals below are for the reason given
        self.succeeds("run", self.packing(), "--scheme", "dcs", ranks=2)

    def test_packing_with_nan(self):
        self.refused(["packing.h5", "x"], "run", self.packing(x=((1, np.nan, 1), (3, 1, 1))), "--scheme", "dcs")

    def test_packing_with_negative_radius(self):
        self.refused(["packing.h5", "radius"], "run", self.packing(radius=(0.5, -0.5)), "--scheme", "dcs")

    def test_truncated_packing(self):
        scene = self.packing()
        path = self.folder / "packing.h5"
        path.write_bytes(path.read_bytes()[:1000])
        self.refused(["packing.h5"], "run", scene, "--scheme", "dcs")

    def test_old_results_survive(self):
        scene = self.write("scene.toml", SCENE)
        out = self.folder / "out.json"
        self.succeeds("run", scene, "--json", out)
        before = out.read_bytes()
        self.write("scene.toml", SCENE.replace("[0.3, 0.1, 1.5]", "[0, 0, 1.35]"))
        self.assertEqual(self.run_program("run", scene, "--json", out).returncode, 1)
        self.assertEqual(out.read_bytes(), before)
        self.assertEqual([path.name for path in self.folder.glob("*.part")], [])

    def test_unwritable_result(self):
        scene = self.write("scene.toml", SCENE)
        self.refused(["no-folder"], "run", scene, "--scheme", "dcs", "--json", self.folder / "no-folder" / "out.json")

    def test_more_subdomains_than_contacts_is_valid(self):
        scene = self.write("scene.toml", SCENE)
        self.succeeds("run", scene, "--scheme", "dcs", "--subdomains", 16)
        self.succeeds("run", scene, "--scheme", "ccs", ranks=4)

    def test_the_cap_is_reported(self):
        scene = self.write("scene.toml", SCENE.replace("count = 5", "count = 150") + "\n[solver]\ntolerance = 1e-14\nmax_iterations = 1\ncheck_every = 1\n")
        done = self.run_program("run", scene, "--scheme", "dcs", "--subdomains", 2)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("without reaching", done.stderr)


if __name__ == "__main__":
    unittest.main()
