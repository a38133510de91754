"""Granular physics: the command at its smallest, what its judge says, and whether its measures find what is known."""
import csv
import json
import math
import pathlib
import tempfile
import unittest

import jsonschema
import numpy as np

from harness import ROOT, run_suite
from nscdd_suite.page.load import Record, Results
from nscdd_suite.studies.physics import Physics, comparisons, granular, published
from nscdd_suite.study import Plan


class Judge(unittest.TestCase):
    def test_what_is_allowed_agrees_and_what_is_not_differs(self):
        expected = [*published.EXPECTED.values(), *published.jamming(2).values(), *published.jamming(3).values(), published.same("q/p")]
        for told in expected:
            low, high = told["allowed"]
            width = high - low
            for value, verdict in (
                ((low + high) / 2, "agrees"),
                (high + width, "differs"),
                (low - width, "differs"),
                (None, "cannot be told"),
                (math.nan, "cannot be told"),
            ):
                with self.subTest(told["quantity"], value=value):
                    row = published.row(told, value)
                    self.assertEqual(row["verdict"], verdict)
                    self.assertEqual(bool(row["why"]), verdict != "agrees")

    def test_two_standard_errors_decide_outside(self):
        for value, error, verdict in (
            (1.1, 0.04, "differs"),
            (1.1, 0.06, "cannot be told"),
            (-0.1, 0.06, "cannot be told"),
            (0.9, 10, "agrees"),
            (1.1, None, "differs"),
            (1.1, math.nan, "differs"),
        ):
            self.assertEqual(published.judge(value, error, (0, 1)), verdict, (value, error))

    def test_a_published_number_is_allowed_itself(self):
        for told in [*published.EXPECTED.values(), *published.jamming(2).values(), *published.jamming(3).values()]:
            if not isinstance(told["published"], str):
                for value in told["published"]:
                    self.assertEqual(published.row(told, value)["verdict"], "agrees", told["quantity"])


class Measures(unittest.TestCase):
    def test_decay_and_power_of_known_distributions(self):
        random = np.random.default_rng(1)
        self.assertAlmostEqual(granular.decay(random.exponential(1 / 1.4, 200_000)), 1.4, delta=0.02)
        for power in (-0.3, 0.0, 0.5):
            self.assertAlmostEqual(granular.power(random.power(1 + power, 200_000)), power, delta=0.03)

    def test_the_line_through_a_tail_tells_an_exponential_from_what_falls_faster(self):
        random = np.random.default_rng(1)
        least = published.EXPECTED["disk tail"]["allowed"][0]
        line = granular.tail(random.exponential(1 / 1.4, 100_000))
        self.assertAlmostEqual(line["beta"], 1.4, delta=0.05)
        self.assertAlmostEqual(line["start"], 1.4 * math.exp(-1.4), delta=0.03)
        self.assertGreater(line["R2"], least)
        self.assertLess(granular.tail(np.abs(random.normal(0, math.sqrt(math.pi / 2), 100_000)))["R2"], least)
        self.assertTrue(math.isnan(granular.tail(random.exponential(1, 100))["R2"]))

    def test_solid_fraction_of_lattices(self):
        for dimension, exact in ((2, math.pi / 4), (3, math.pi / 6)):
            x = np.stack(np.meshgrid(*[np.arange(12) + 0.5] * dimension), axis=-1).reshape(-1, dimension)
            self.assertAlmostEqual(granular.core_fraction(x, np.full(len(x), 0.5)), exact, delta=1e-9)

    def test_friction_angle_by_lade_and_duncan(self):
        """A weak material yields at one second invariant in every direction: q / p = sqrt(3) tau / p."""
        sine = lambda m: 3 * m / (6 + m)  # noqa: E731
        self.assertAlmostEqual(granular.lade_duncan(1e-3), granular.degrees(sine(math.sqrt(3) * 1e-3)), delta=1e-4)
        self.assertLess(granular.lade_duncan(0.357), granular.degrees(0.357))

    def test_curves_of_one_kind_are_told_from_shifted_ones(self):
        random = np.random.default_rng(2)
        curves = random.normal(size=(8, 1)) + random.normal(size=(8, 30))
        self.assertGreater(granular.permutation(curves[:4], curves[4:]), 0.05)
        self.assertEqual(granular.permutation(curves[:4], curves[4:] + 100), 2 / 70)  # of 70 ways, this one and its mirror


class Quick(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.done = cls.command()

    @classmethod
    def command(cls, *more):
        return run_suite("run", "physics", "--quick", "--results", cls.folder, *more)

    def test_record_and_figures(self):
        self.assertEqual(self.done.returncode, 0, self.done.stdout + self.done.stderr)
        record = json.loads((self.folder / "physics.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/physics.schema.json").read_text()))
        self.assertEqual({row["verdict"] for row in record["rows"]}, {"cannot be told"})  # few grains and steps tell nothing
        self.assertEqual(len(record["figures"]), 4)
        for name in record["figures"]:
            self.assertIn(b"<svg", (self.folder / name).read_bytes())
        told = "".join(part if isinstance(part, str) else part.html() for part in Physics().section(Results("", {Physics.name: [Record(record)]}), self.folder))
        self.assertIn(f"{len(record['rows'])} comparisons", told)
        self.assertEqual(told.count("<img"), 4)

    def test_what_is_there_is_not_made_again(self):
        again = self.command()
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertRegex(again.stdout, r"\Aphysics: (\d\d) of \1 jobs are done already\n")

    def test_a_wrong_value_flips_the_verdict(self):
        plan = Plan(self.folder, "physics", quick=True)
        path = plan.folder / "biaxial.csv"
        kept = path.read_text()
        self.addCleanup(path.write_text, kept)

        def verdicts():
            return {row["quantity"]: row["verdict"] for row in comparisons.all_rows(Physics().runs(plan), {})[0]}

        energy, strength = (published.EXPECTED[key]["quantity"] for key in ("energy", "disk sine"))
        names, *rows = csv.reader(kept.splitlines())
        major, minor = (names.index(f"stress_contacts_{axis}") for axis in ("yy", "xx"))

        def with_ratio(ratio):  # of the stresses: that of the few grains here is one draw
            for row in rows:
                row[major] = str(ratio * float(row[minor]))
            path.write_text("\n".join(map(",".join, [names, *rows])) + "\n")
            after = verdicts()
            return after[energy], after[strength]

        self.assertEqual(with_ratio(1.25 / 0.75), ("agrees", "agrees"))
        rows[-1][names.index("energy_error")] = "1e-3"
        self.assertEqual(with_ratio(2 * 1.25 / 0.75), ("differs", "differs"))

    def test_nothing_to_do_is_said(self):
        done = self.command("--only", "no such")
        self.assertEqual((done.returncode, done.stderr), (1, "physics: nothing matches 'no such'\n"))


if __name__ == "__main__":
    unittest.main()
