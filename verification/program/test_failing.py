"""Small inputs on which an earlier program told a wrong answer as a converged one, or never ended (shared/failing).

The inputs are not part of the repository: NSCDD_SHARED names the folder that has them, ../shared by default. Where it is missing the tests are
skipped. Their inputs on bad values, threads, partitions and streams have tests without it (test_bad_input, test_program, test_schemes, test_misuse).
"""
import json
import os
import pathlib
import tomllib
import unittest

import h5py
import numpy as np

from harness import ProgramTest

FAILING = pathlib.Path(os.environ.get("NSCDD_SHARED", pathlib.Path(__file__).resolve().parents[2] / ".." / "shared")) / "failing"
SOLVERS = {"nlgs": ["--scheme", "nlgs"], "dcs": ["--scheme", "dcs", "-n", 4], "ccs": ["--scheme", "ccs", "-n", 4], "paper": ["--method", "paper"]}
MOST_MADE = 1e-3  # of the energy of a step's change


@unittest.skipUnless(FAILING.is_dir(), f"no {FAILING}")
class Failing(ProgramTest):
    def step(self, name, scene, *options, codes=(0,)):
        """The JSON of a run and the state that it leaves; the exit code is one of `codes`."""
        path = self.folder / f"{name}.json"
        done = self.run_program("run", scene, "--json", path, "--state", path.with_suffix(".h5"), "--quiet", *options, timeout=600)
        self.assertIn(done.returncode, codes, done.stderr)
        return json.loads(path.read_text()), path.with_suffix(".h5")

    def velocities(self, state):
        with h5py.File(state) as file:
            return file["velocity"][...], file["x"][...], np.pi * file["radius"][...] ** 2

    def distances(self, scene, exact, others, before, h, parts):
        """Of each solver: the largest distance of a part (a mask by positions) to the exact answer, over what contacts change in it."""
        answer, x, mass = self.velocities(exact)
        free = before + [0, -10 * h]
        found = {}
        for name, options in others.items():
            report, state = self.step(name, scene, *options, codes=(0, 3))
            off = self.velocities(state)[0] - answer
            worst = max(np.sqrt((mass[part] @ (off[part] ** 2).sum(1)) / (mass[part] @ ((answer - free)[part] ** 2).sum(1))) for part in parts(x))
            found[name] = report, worst
        return found

    def judged(self, found):
        """A step is accepted and near, or told as not converged; all but the paper's method get there."""
        for name, (report, distance) in found.items():
            with self.subTest(solver=name):
                self.assertTrue(report["converged"] or name == "paper", report["distance"])
                if report["converged"]:
                    self.assertLess(distance, 0.3)

    def test_a_row_that_begins_to_touch_beside_a_loaded_column(self):
        scene = FAILING / "row-beside-column.toml"
        _, start = self.step("start", scene, "--scheme", "newton", "--tolerance", 1e-12, "--steps", 2)
        _, exact = self.step("exact", scene, "--scheme", "newton", "--tolerance", 1e-12, "--from", start, "--steps", 1)
        others = {name: [*options, "--from", start, "--steps", 1] for name, options in SOLVERS.items()}
        found = self.distances(scene, exact, others, self.velocities(start)[0], 0.001, lambda x: (x[:, 0] < 0.1, x[:, 0] >= 0.1))
        self.judged(found)
        for name in ("nlgs", "dcs", "ccs"):
            self.assertGreater(found[name][0]["iterations"][0], 10)

    def test_a_crowded_box(self):
        scene = FAILING / "crowded-box.toml"
        given = tomllib.loads(scene.read_text())
        before, h = np.array([grain["velocity"] for grain in given["grain"]]), given["step"]["h"]
        report, exact = self.step("exact", scene, "--scheme", "newton", "--tolerance", 1e-10, "--max-velocity-error", 1e-6)
        self.assertAlmostEqual(report["final"]["kinetic_energy"] / 3.266e5, 1, delta=1e-3)
        self.judged(self.distances(scene, exact, SOLVERS, before, h, lambda x: (slice(None),)))

    def test_a_column_beside_a_lid_that_is_pushed_hard(self):
        report, _ = self.step("lid", FAILING / "lid-beside-column.toml", "--steps", 1000)
        self.assertLessEqual(max(report["energy_gain"]), MOST_MADE)
        self.assertLess(report["final"]["kinetic_energy"], 1e-6)
        taken = np.cumsum(np.add(report["energy"]["normal"], report["energy"]["friction"]))
        self.assertLess(max(taken - np.minimum.accumulate(taken)), 0.1)  # J made; 40 J were

    def test_rolling_after_landing(self):
        text = (FAILING / "rolling-after-landing.toml").read_text()
        for h in (0.02, 0.01, 0.001):
            scene = self.write("rolling.toml", text.replace("h = 0.02", f"h = {h}"))
            report, state = self.step("rolling", scene, "--steps", round(3 / h))
            self.assertAlmostEqual(self.velocities(state)[0][0, 0], 2 * 5 / 7, delta=1e-5)

    def test_a_near_miss(self):
        _, state = self.step("miss", FAILING / "near-miss.toml")
        np.testing.assert_array_equal(self.velocities(state)[0], [[1, 0], [0, 0]])

    def test_a_pyramid_has_several_answers(self):
        runs = [(["--scheme", "nlgs"], "nlgs"), *((["--scheme", "dcs", "-n", n], f"dcs{n}") for n in (3, 6))]
        paths = []
        for options, name in runs:
            self.step(name, FAILING / "pyramid.toml", "--tolerance", 1e-8, "--max-velocity-error", 1e-3, *options)
            paths.append(self.folder / f"{name}.json")
        codes = {self.run_program("compare", paths[0], other).returncode for other in paths[1:]}
        self.assertLessEqual(codes, {0, 5})  # agrees, or another answer

    def test_a_heap_that_rebounds_in_corners(self):
        report, _ = self.step("heap", FAILING / "bouncy-heap.toml")
        self.assertGreater(max(report["newton_contacts"]), 0)  # first in step 2,217


if __name__ == "__main__":
    unittest.main()
