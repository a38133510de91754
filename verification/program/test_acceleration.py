"""What acceleration saves: the command at its smallest, and what its numbers must satisfy."""
import json
import unittest

import jsonschema

from harness import ROOT, ProgramTest, run_suite


class Quick(ProgramTest):
    def test_accelerated_runs_need_fewer_iterations_for_the_same_error(self):
        done = run_suite("run", "acceleration", "--quick", "--results", self.folder)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        record = json.loads((self.folder / "acceleration.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/acceleration.schema.json").read_text()))
        rows = {(row["scene"], row["subdomains"], row["method"]): row for row in record["rows"]}
        self.assertEqual(len(rows), 5 * 2 * 2)
        for (scene, subdomains, method), row in rows.items():
            with self.subTest(scene=scene, subdomains=subdomains, method=method):
                self.assertTrue(row["converged"])
                self.assertLessEqual(row["eta"], 1e-4)
                if method == "auto":
                    self.assertLess(row["iterations"], rows[scene, subdomains, "paper"]["iterations"])
        with self.subTest("hard cases"):
            hard = {row["scene"]: row for row in record["hard"]}
            self.assertEqual(sorted(hard), ["column-10-2d", "column-10-3d", "cradle-10-0-2d", "cradle-3-0-2d", "rest-2d"])
            for name, row in hard.items():
                self.assertTrue(row["paper"]["converged"] and row["auto"]["converged"], name)
            for name in ("cradle-3-0-2d", "rest-2d"):  # over before acceleration would pay
                self.assertEqual(hard[name]["auto"]["iterations"], hard[name]["paper"]["iterations"])
            for name in ("column-10-2d", "column-10-3d", "cradle-10-0-2d"):
                self.assertLess(hard[name]["auto"]["iterations"], 0.3 * hard[name]["paper"]["iterations"])

    def test_nothing_to_do_is_said(self):
        done = run_suite("run", "acceleration", "--only", "no such", "--results", self.folder)
        self.assertEqual((done.returncode, done.stderr), (1, "acceleration: nothing matches 'no such'\n"))


if __name__ == "__main__":
    unittest.main()
