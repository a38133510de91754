"""What `scripts/suite regression` calls worse, and how numbers are accepted."""
import contextlib
import io
import json
import os
import unittest
import unittest.mock

from harness import ProgramTest
from nscdd_suite import cli, program, study
from nscdd_suite.studies import regression

OLD = {"box paper dcs 8 iterations": 1000, "box paper dcs 8 speed-up": 4.0, "box paper dcs 8 residual": 5e-5, "box paper dcs 8 answer": "cbf29ce484222325"}


def verdicts(fused=True, **changes):
    now = {**OLD, **{f"box paper dcs 8 {kind.replace('_', '-')}": value for kind, value in changes.items()}}
    rows = regression.judge(now, OLD, 1e-4, fused)
    return {row[0].split()[-1]: row[-1] for row in rows}, regression.passes(rows, fused)


class Judge(unittest.TestCase):
    def test_what_has_not_changed_is_not_told(self):
        self.assertEqual(verdicts(), ({}, True))

    def test_counts_are_worse_beyond_two_per_cent(self):
        for iterations, verdict in ((1001, "changed"), (1019, "changed"), (1021, "WORSE"), (981, "changed"), (979, "better")):
            self.assertEqual(verdicts(iterations=iterations), ({"iterations": verdict}, False), iterations)

    def test_speed_ups_are_worse_beyond_three_per_cent(self):
        for speed_up, verdict in ((3.89, "changed"), (3.87, "WORSE"), (4.11, "changed"), (4.13, "better")):
            self.assertEqual(verdicts(speed_up=speed_up), ({"speed-up": verdict}, False), speed_up)

    def test_residuals_are_worse_above_the_tolerance_alone(self):
        self.assertEqual(verdicts(residual=9.9e-5), ({"residual": "changed"}, False))
        self.assertEqual(verdicts(residual=1.1e-4), ({"residual": "WORSE"}, False))

    def test_another_answer_does_not_pass(self):
        self.assertEqual(verdicts(answer="cbf29ce484222326"), ({"answer": "changed"}, False))

    def test_without_fused_products_there_are_bands_of_ten_per_cent_and_no_answers(self):
        self.assertEqual(verdicts(False, iterations=1099, speed_up=3.7, answer="0"), ({"iterations": "changed", "speed-up": "changed"}, True))
        self.assertEqual(verdicts(False, iterations=1101, speed_up=3.5), ({"iterations": "WORSE", "speed-up": "WORSE"}, False))

    def test_numbers_that_are_new_or_gone_do_not_pass(self):
        rows = regression.judge({"a b dcs 8 iterations": 1}, {"a b dcs 4 iterations": 1}, 1e-4)
        self.assertEqual([(row[0], row[-1]) for row in rows], [("a b dcs 4 iterations", "gone"), ("a b dcs 8 iterations", "new")])
        self.assertFalse(regression.passes(rows))


class Gate(ProgramTest):
    """The command as it is called, with a program that makes given numbers."""

    def setUp(self):
        super().setUp()
        self.addCleanup(os.chdir, os.getcwd())
        self.accepted = self.write("accepted.json", json.dumps({"values": {f"biaxial {name}": value for name, value in self.numbers().items()}}))
        self.simulated = self.write("nscdd_simulated", "")
        for where, name, value in (
            (regression, "ACCEPTED", self.accepted),
            (regression, "SIMULATED", self.simulated),
            (regression, "METHODS", ("paper",)),
            (regression.Study, "provenance", lambda study, plan: {"machine": {"fused": True, "compiler": "g++", "lanes": 8}}),
        ):
            self.patch(unittest.mock.patch.object(where, name, value))
        self.patch(unittest.mock.patch("shutil.which", return_value="smpirun"))

    def patch(self, patch):
        patch.start()
        self.addCleanup(patch.stop)

    @staticmethod
    def numbers(**changes):
        return {"paper dcs 8 iterations": 1000, "paper dcs 8 speed-up": 4.0, "paper dcs 8 answer": "aa"} | changes

    def gate(self, *arguments, **changes):
        """Exit code, and what it says."""
        values = {f"biaxial {name}": value for name, value in self.numbers(**changes).items()}
        said = io.StringIO()
        with unittest.mock.patch.object(regression, "measure", lambda *_: {"values": values, "tolerance": 1e-4}), unittest.mock.patch.object(
            study.Plan, "pack", lambda plan, source: source
        ), contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            code = cli.main(["regression", "--only", "biaxial", "--results", str(self.folder / "results"), *arguments])
        return code, said.getvalue()

    def test_the_accepted_numbers_pass_and_others_do_not(self):
        self.assertEqual(self.gate()[0], 0)
        for changes in ({"paper dcs 8 iterations": 1020}, {"paper dcs 8 speed-up": 3.88}, {"paper dcs 8 answer": "ab"}):
            code, said = self.gate(**changes)
            self.assertEqual(code, 1, changes)
            self.assertIn("--accept REASON", said)

    def test_what_is_missing_is_told(self):
        self.simulated.unlink()
        code, said = self.gate()
        self.assertEqual(code, 1)
        self.assertIn("nscdd_simulated is not there", said)
        self.accepted.unlink()
        self.assertIn("nothing is accepted", self.gate("--without-simulator")[1])


class Calls(ProgramTest):
    def test_a_file_of_an_earlier_run_is_not_taken(self):
        out = self.write("old.json", "{}")
        with self.assertRaisesRegex(program.Failed, "true: no .*old.json"):
            program.call(["true"], out=out)


class Accept(ProgramTest):
    def test_the_reason_lands_in_the_changelog(self):
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.folder)
        (self.folder / "verification").mkdir()
        self.write("CHANGELOG.md", "# Changelog\n\n## Unreleased\n\n### Added\n\n- this\n\n## 0.1\n\n- that\n")
        data = {"machine": {"compiler": "g++ 12", "cpu": "some"}, "commit": "abc", "values": OLD}
        for reason in ("first", "second"):
            regression.accept(data, reason)
        accepted = json.loads((self.folder / "verification/regression.json").read_text())
        self.assertEqual((accepted["values"], accepted["reason"], accepted["cpu"]), (OLD, "second", "some"))
        self.assertEqual(
            (self.folder / "CHANGELOG.md").read_text(),
            "# Changelog\n\n## Unreleased\n\n### Added\n\n- this\n\n### Counts accepted\n\n" "- second\n- first\n\n## 0.1\n\n- that\n",
        )


if __name__ == "__main__":
    unittest.main()
