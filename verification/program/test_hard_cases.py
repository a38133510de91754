"""The hard cases: the quick ones within their bounds, the scenes as their generator writes them, and a judge that fails."""
import json
import subprocess
import unittest

import jsonschema
import numpy as np

from harness import ROOT, ProgramTest, run_suite
from nscdd_suite.program import environment, python
from nscdd_suite.studies.hard import theory
from nscdd_suite.studies.hard.case import FAMILIES, SCHEMES, Case


class HardCases(ProgramTest):
    def rows(self, *arguments, code=0):
        """The rows that the command writes."""
        done = run_suite("run", "hard", "--results", self.folder, *arguments)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        record = json.loads((self.folder / "hard.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/hard.schema.json").read_text()))
        return record["rows"]

    def test_quick_rows_are_within_their_bounds(self):
        rows = self.rows("--quick")
        self.assertTrue(all(row["ok"] and row["error"] <= row["bound"] for row in rows))
        self.assertEqual({row["family"] for row in rows}, set(FAMILIES) - {"settled", "order-impact", "order-packing"})
        self.assertEqual({row["scheme"] for row in rows}, set(SCHEMES))


class Scenes(unittest.TestCase):
    def test_are_what_the_generator_writes(self):
        done = subprocess.run(python("studies.hard.generate", "--check"), env=environment(), cwd=ROOT, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_each_says_what_it_shows(self):
        for path in (ROOT / "cases/hard").glob("*.toml"):
            self.assertRegex(path.read_text(), r"\A# \w", path.name)


class LastDigits(unittest.TestCase):
    def test_of_counted_numbers_are_no_matter_of_the_processor(self):
        for file in ("hard/exact.py", "hard/case.py", "physics/granular.py", "gallery/measures.py"):
            text = (ROOT / "harness/suite/nscdd_suite/studies" / file).read_text()
            self.assertNotRegex(text, r" @ |polyfit|linregress|lstsq|np\.dot|np\.log\(", f"{file}: by BLAS, or by logarithms of the processor")


class Judge(ProgramTest):
    """That rows fail when the answer is wrong."""

    def judged(self, name, scheme="nlgs", spoil=None):
        case = Case(ROOT / f"cases/hard/{name}.toml", scheme, self.folder)
        run = case.run

        def spoiled(*arguments, **options):
            result = run(*arguments, **options)
            spoil(result)
            return result

        if spoil:
            case.run = spoiled
        return case.rows()

    def test_a_wrong_impulse_fails(self):
        def spoil(result):
            result.impulse[3] *= 1 + 1e-6

        good, bad = self.judged("column-10-3d"), self.judged("column-10-3d", spoil=spoil)
        self.assertEqual([row["ok"] for row in good], [True, True])
        self.assertEqual([row["ok"] for row in bad], [False, True])

    def test_too_many_sweeps_fail(self):
        def spoil(result):
            result.json["iterations"] = [2 * result.json["iterations"][0]]

        self.assertEqual([row["ok"] for row in self.judged("column-10-3d", spoil=spoil)], [True, False])

    def test_a_wrong_velocity_fails(self):
        def spoil(result):
            result.velocity[0, 0] += 1e-6

        for name in ("cradle-5-0.5-2d", "oblique-0.5-slides-3d", "restitution-0.5-3d", "rolling-2d", "wedge-squeezed-slips-2d"):
            self.assertFalse(all(row["ok"] for row in self.judged(name, spoil=spoil)), name)

    def test_a_pile_that_stays_where_it_should_fall_fails(self):
        def spoil(result):
            result.x[-1, -1] += 1.0

        self.assertEqual([row["ok"] for row in self.judged("pile-floor-falls-2d", spoil=spoil)], [False])

    def test_a_scene_that_should_be_refused_but_runs_fails(self):
        case = Case(ROOT / "cases/hard/rest-2d.toml", "nlgs", self.folder)
        case.family = "coincident"
        (row,) = case.rows()
        self.assertFalse(row["ok"])
        self.assertIn("exit code 0", row["note"])

    def test_energy_out_of_nothing_fails(self):
        def spoil(result):
            result.json["energy"]["kinetic"][500] *= 1 + 2e-6

        def lift(result):
            result.x[-1, -1] -= 0.1

        name = "rebound-gas-1-3d"
        self.assertEqual([row["ok"] for row in self.judged(name)], [True])
        self.assertEqual([row["ok"] for row in self.judged(name, spoil=spoil)], [False])
        self.assertEqual([row["ok"] for row in self.judged("pair-1e1-0-3d", spoil=lift)], [True, False, True])


class Theory(unittest.TestCase):
    """The bounds rest on these."""

    def test_rate_of_a_column_and_of_two_masses(self):
        for n in (2, 5, 20):
            self.assertAlmostEqual(theory.iteration_rate([1.0] * n, [0] * n), np.cos(np.pi / (2 * n)) ** 2, places=12)
        heavy = 1e3
        self.assertAlmostEqual(theory.iteration_rate([1.0, heavy], [0, 0]), heavy / (1 + heavy), places=12)
        # the light ball halved, each half gluing: m/(4M) of the error an iteration, where one domain takes m/M
        share = 0.5 / (0.5 + heavy)
        self.assertAlmostEqual(theory.iteration_rate([1.0, heavy], [0, 1]), 1 - share / 2, places=12)

    def test_least_eigenvalue_of_a_free_chain(self):
        for n in (2, 5, 10):
            self.assertAlmostEqual(theory.chain([2.0] * n, False).least, 1 - np.cos(np.pi / n), places=12)


if __name__ == "__main__":
    unittest.main()
