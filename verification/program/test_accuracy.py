"""Speed against error: the command at its smallest, what its numbers must satisfy, and a stopped job that is gone on with."""
import json
import unittest

import jsonschema

from harness import ROOT, ProgramTest, run_suite
from nscdd_suite import measure, program
from nscdd_suite.studies import accuracy


class Quick(ProgramTest):
    def run_study(self):
        done = run_suite("run", "accuracy", "--quick", "--results", self.folder)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        record = json.loads((self.folder / "accuracy.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/accuracy.schema.json").read_text()))
        return record

    def test_numbers_are_what_they_should_be(self):
        record = self.run_study()
        self.assertEqual({scene["name"] for scene in record["scenes"]}, set(accuracy.QUICK_SCENES))
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

        rows = self.folder / "accuracy/quick/rows"
        made = json.loads((rows / "dense-3d.json").read_text())
        made["runs"][0]["cpu"] = record["runs"][0]["cpu"] = 12345.0  # had it been measured again, it would be another
        (rows / "dense-3d.json").write_text(json.dumps(made))
        (rows / "loose-2d.json").unlink()  # what a stopped job had not measured
        again = self.run_study()
        self.assertEqual([row for row in again["runs"] if row["scene"] == "dense-3d"], [row for row in record["runs"] if row["scene"] == "dense-3d"])
        self.assertEqual({(row["scene"], row["solver"]) for row in again["runs"]}, {(row["scene"], row["solver"]) for row in record["runs"]})
        self.assertEqual(again["profiles"], record["profiles"])


class Problems(ProgramTest):
    def test_each_solver_gets_there_or_says_so(self):
        for case in ("wedge-locked-2d", "column-10-2d"):
            self.succeeds("export-fclib", ROOT / f"cases/hard/{case}.toml", "-o", self.folder / f"{case}.hdf5")
        done = run_suite("run", "problems", "--quick", "--results", self.folder, NSCDD_FCLIB=str(self.folder))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("1e-10: auto solves 2 of 2 problems", done.stdout)
        rows = json.loads((self.folder / "problems.json").read_text())["rows"]
        self.assertEqual({(row["problem"], row["dimension"]) for row in rows}, {("wedge-locked-2d", 2), ("column-10-2d", 2)})
        self.assertTrue(all(row["error"] <= 1.001 * row["tolerance"] for row in rows if row["converged"]))
        self.assertLessEqual({"auto", "NLGS", "Newton", "SPG", "APGD"}, {row["solver"] for row in rows})


class VelocityError(ProgramTest):
    def test_it_tells_the_distance_within_a_factor_and_eta_does_not(self):
        done = run_suite("run", "velocity_error", "--quick", "--results", self.folder)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        record = json.loads((self.folder / "velocity_error.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/velocity_error.schema.json").read_text()))
        rows = [row for row in record["rows"] if row["distance"] > 1e-6]
        self.assertEqual({row["case"] for row in rows}, {"loose-2d", "biaxial", "column-10-2d", "mass-1e2-above-3d"})
        ratios = [row["distance"] / row["velocity_error"] for row in rows]
        self.assertLess(max(ratios), 5)
        self.assertGreater(min(ratios), 0.2)
        self.assertGreater(max(row["distance"] / row["eta"] for row in rows), 100)
        for asked, alone in (
            (row, other)
            for row in record["cost"]
            for other in record["cost"]
            if row["allowed"] and not other["allowed"] and all(row[key] == other[key] for key in ("case", "start", "method"))
        ):
            self.assertLessEqual(asked["velocity_error"], asked["allowed"])
            self.assertTrue(asked["converged"])
            if asked["start"] == "cold":  # one step: the same iteration, perhaps longer
                self.assertGreaterEqual(asked["iterations"], alone["iterations"])

    def test_nothing_to_do_is_said(self):
        done = run_suite("run", "velocity_error", "--only", "no such", "--results", self.folder)
        self.assertEqual((done.returncode, done.stderr), (1, "velocity_error: nothing matches 'no such'\n"))


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
        (row,) = measure.ladder((1e-1, 1e-2), lambda tolerance: None)
        self.assertEqual((row["cpu"], row["converged"]), (None, False))

    def test_the_median_of_short_runs_is_taken(self):
        seconds = iter([0.3, 0.1, 0.2])
        self.assertEqual(measure.timed(lambda: {"cpu": next(seconds)}), {"cpu": 0.2, "repeats": 3, "cores": None})
        self.assertEqual(measure.timed(lambda: {"cpu": 5.0}), {"cpu": 5.0, "repeats": 1})

    def test_too_long_is_out_of_time(self):
        self.assertIsNone(measure.answered(["sleep", "5"], "/tmp/no-such.json", seconds=0.1))
        with self.assertRaisesRegex(program.Failed, "sleep 5: took more than"):
            program.call(["sleep", "5"], seconds=0.1)


if __name__ == "__main__":
    unittest.main()
