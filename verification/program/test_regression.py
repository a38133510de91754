"""What scripts/regression calls worse, and how numbers are accepted."""
import json
import os
import unittest

from harness import ProgramTest, load_script

script = load_script("regression")
OLD = {"box paper dcs 8 iterations": 1000, "box paper dcs 8 speed-up": 4.0, "box paper dcs 8 residual": 5e-5}


def verdicts(same_program=True, method="paper", same_compiler=True, **changes):
    old = {name.replace("paper", method): value for name, value in OLD.items()}
    now = {**old, **{f"box {method} dcs 8 {kind.replace('_', '-')}": value for kind, value in changes.items()}}
    return {row[0].split()[-1]: row[-1] for row in script.judge(now, old, 1e-4, same_program, same_compiler)}


class Judge(unittest.TestCase):
    def test_what_has_not_changed_is_not_told(self):
        self.assertEqual(verdicts(), {})

    def test_counts_have_a_band_of_two_per_cent(self):
        for iterations, verdict in ((1001, "changed"), (1019, "changed"), (1021, "WORSE"), (981, "changed"), (979, "better")):
            self.assertEqual(verdicts(iterations=iterations), {"iterations": verdict}, iterations)

    def test_speed_ups_have_a_band_of_three_per_cent(self):
        for speed_up, verdict in ((3.89, "changed"), (3.87, "WORSE"), (4.11, "changed"), (4.13, "better")):
            self.assertEqual(verdicts(speed_up=speed_up), {"speed-up": verdict}, speed_up)

    def test_residuals_are_worse_above_the_tolerance_alone(self):
        self.assertEqual(verdicts(residual=9.9e-5), {"residual": "changed"})
        self.assertEqual(verdicts(residual=1.1e-4), {"residual": "WORSE"})

    def test_another_program_has_ten_per_cent_where_it_accelerates(self):
        self.assertEqual(verdicts(False, "auto", iterations=1099, speed_up=3.7), {"iterations": "changed", "speed-up": "changed"})
        self.assertEqual(verdicts(False, "auto", iterations=1101, speed_up=3.5), {"iterations": "WORSE", "speed-up": "WORSE"})

    def test_the_same_program_has_the_narrow_bands_where_it_accelerates(self):
        self.assertEqual(verdicts(True, "auto", iterations=1021, speed_up=3.87), {"iterations": "WORSE", "speed-up": "WORSE"})

    def test_another_compiler_has_ten_per_cent(self):
        self.assertEqual(verdicts(False, same_compiler=False, iterations=1099), {"iterations": "changed"})
        self.assertEqual(verdicts(False, same_compiler=False, iterations=1101), {"iterations": "WORSE"})

    def test_another_program_keeps_the_narrow_bands_by_the_method_of_the_paper(self):
        self.assertEqual(verdicts(False, iterations=1019, speed_up=3.89), {"iterations": "changed", "speed-up": "changed"})
        self.assertEqual(verdicts(False, iterations=1021, speed_up=3.87), {"iterations": "WORSE", "speed-up": "WORSE"})

    def test_numbers_that_are_new_or_gone_are_told(self):
        rows = script.judge({"a b dcs 8 iterations": 1}, {"a b dcs 4 iterations": 1}, 1e-4, True)
        self.assertEqual([(row[0], row[-1]) for row in rows], [("a b dcs 4 iterations", "gone"), ("a b dcs 8 iterations", "new")])


class Accept(ProgramTest):
    def test_the_reason_lands_in_the_changelog(self):
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(self.folder)
        (self.folder / "verification").mkdir()
        self.write("CHANGELOG.md", "# Changelog\n\n## Unreleased\n\n### Added\n\n- this\n\n## 0.1\n\n- that\n")
        record = {"schema": "nscdd.regression/1", "accepted": {}}
        machine = {"compiler": "g++ 12", "cpu": "some", "commit": "abc"}
        for reason in ("first", "second"):
            script.accept(record, "8 doubles a vector", OLD, machine, reason)
        accepted = json.loads((self.folder / "verification/regression.json").read_text())["accepted"]["8 doubles a vector"]
        self.assertEqual((accepted["values"], accepted["reason"], accepted["cpu"]), (OLD, "second", "some"))
        self.assertEqual((self.folder / "CHANGELOG.md").read_text(),
                         "# Changelog\n\n## Unreleased\n\n### Added\n\n- this\n\n### Counts accepted\n\n"
                         "- second (8 doubles a vector)\n- first (8 doubles a vector)\n\n## 0.1\n\n- that\n")


if __name__ == "__main__":
    unittest.main()
