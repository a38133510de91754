"""Speed against error: the command at its smallest, what its numbers must satisfy, and a stopped job that is gone on with."""
import json
import os
import pathlib
import subprocess
import sys
import unittest

import jsonschema

from harness import NSCDD, ProgramTest, load_script

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "cases/accuracy"))
os.environ["NSCDD"] = str(pathlib.Path(NSCDD).resolve())  # absolute, so that the program under test is the one run
import measure  # noqa: E402  (after the path is set)

script = load_script("accuracy")


class Quick(ProgramTest):
    def run_script(self, *arguments):
        done = subprocess.run([sys.executable, ROOT / "scripts/accuracy", "--quick", "--results", self.folder, *arguments],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        record = json.loads((self.folder / "accuracy.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/accuracy.schema.json").read_text()))
        return record

    def test_numbers_are_what_they_should_be(self):
        record = self.run_script()
        self.assertEqual({scene["name"] for scene in record["scenes"]}, set(script.QUICK_SCENES))
        for scene in record["scenes"]:
            with self.subTest(scene=scene["name"]):
                self.assertLessEqual(scene["reference"]["eta"], 1e-10)
                self.assertEqual(scene["ccs"]["iterations_dcs"], scene["ccs"]["iterations_ccs"])
                self.assertLess(scene["ccs"]["velocity_difference"], 1e-9)
                rows = {(row["solver"], row["tolerance"]): row for row in record["runs"] if row["scene"] == scene["name"]}
                for name in ("NLGS", "NSCDD 8, n_GS 1", "SPG"):
                    coarse, fine = rows[name, 1e-2], rows[name, 1e-4]
                    self.assertTrue(fine["converged"], name)
                    self.assertLessEqual(fine["eta"], 1e-4)
                    self.assertLess(fine["distance"], 0.5 * coarse["distance"], name)
                    self.assertGreater(fine["sweeps"], coarse["sweeps"], name)
                    self.assertGreater(fine["cpu"], 0)
                # Siconos judged by our measures: an answer as good is as near
                if measure.SICONOS in {row["solver"] for row in rows.values()}:
                    self.assertLess(rows[measure.SICONOS, 1e-4]["distance"], 0.5 * rows[measure.SICONOS, 1e-2]["distance"])
        solved = [row for row in record["profiles"] if row["converged"]]
        self.assertGreater(len(solved), 30)
        self.assertTrue(all(row["error"] <= row["tolerance"] for row in solved))
        for name in ("accuracy-cpu-eta.svg", "accuracy-profile-sweeps.svg"):
            self.assertTrue((self.folder / name).exists())

        record["runs"][0]["cpu"] = 12345.0  # had it been measured again, it would be another
        (self.folder / "accuracy.json").write_text(json.dumps(record))
        again = self.run_script("--resume")
        self.assertEqual(again["runs"], record["runs"])
        self.assertEqual(again["profiles"], record["profiles"])


class VelocityError(ProgramTest):
    def test_it_tells_the_distance_within_a_factor_and_eta_does_not(self):
        done = subprocess.run([sys.executable, ROOT / "scripts/velocity_error", "--quick", "--results", self.folder],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        record = json.loads((self.folder / "velocity_error.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/velocity_error.schema.json").read_text()))
        rows = [row for row in record["rows"] if row["distance"] > 1e-6]
        self.assertEqual({row["case"] for row in rows}, {"loose-2d", "biaxial", "column-10-2d", "mass-1e2-above-3d"})
        ratios = [row["distance"] / row["velocity_error"] for row in rows]
        self.assertLess(max(ratios), 5)
        self.assertGreater(min(ratios), 0.2)
        self.assertGreater(max(row["distance"] / row["eta"] for row in rows), 100)
        for asked, alone in ((row, other) for row in record["cost"] for other in record["cost"]
                             if row["allowed"] and not other["allowed"]
                             and all(row[key] == other[key] for key in ("case", "start", "method"))):
            self.assertLessEqual(asked["velocity_error"], asked["allowed"])
            self.assertTrue(asked["converged"])
            if asked["start"] == "cold":  # one step: the same iteration, perhaps longer
                self.assertGreaterEqual(asked["iterations"], alone["iterations"])

    def test_nothing_to_do_is_said(self):
        done = subprocess.run([sys.executable, ROOT / "scripts/velocity_error", "--only", "no such", "--results", self.folder],
                              capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (1, "velocity_error: no case matches 'no such'\n"))


class Ladder(unittest.TestCase):
    def test_stops_where_it_stalls_and_keeps_runs_that_went_further(self):
        reached, asked = {1e-1: 5e-2, 1e-2: 1e-4, 1e-5: 1e-5, 1e-6: 2e-6}, []

        def run(tolerance):
            asked.append(tolerance)
            return {"cpu": 2.0, "reached": reached[tolerance], "converged": reached[tolerance] <= tolerance}
        rows = list(measure.ladder((1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7), run))
        self.assertEqual(asked, [1e-1, 1e-2, 1e-5, 1e-6])
        self.assertEqual([row["tolerance"] for row in rows], [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
        self.assertEqual([row["converged"] for row in rows], 5 * [True] + [False])

    def test_out_of_time_is_a_row_without_numbers(self):
        row, = measure.ladder((1e-1, 1e-2), lambda tolerance: None)
        self.assertEqual((row["cpu"], row["converged"]), (None, False))

    def test_the_median_of_short_runs_is_taken(self):
        seconds = iter([0.3, 0.1, 0.2])
        self.assertEqual(measure.timed(lambda: {"cpu": next(seconds)}), {"cpu": 0.2, "repeats": 3, "cores": None})
        self.assertEqual(measure.timed(lambda: {"cpu": 5.0}), {"cpu": 5.0, "repeats": 1})

    def test_too_long_is_out_of_time(self):
        self.assertIsNone(measure.call(["sleep", "5"], needed=False, seconds=0.1))
        with self.assertRaisesRegex(measure.Failed, "sleep 5: took more than"):
            measure.call(["sleep", "5"], seconds=0.1)


if __name__ == "__main__":
    unittest.main()
