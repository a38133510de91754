"""Against other codes: the command at its smallest, what its numbers must satisfy, and its judge against cases with known answers."""
import json
import shutil
import unittest

import jsonschema
import numpy as np

from harness import ROOT, ProgramTest, run_suite
from nscdd_suite.measure import SICONOS
from nscdd_suite.page.load import Record, Results
from nscdd_suite.studies.peers import Peers, choice, settle
from nscdd_suite.study import installed


def row(cpu, mean, largest=0.1, **more):
    return {"cpus": [cpu], "mean_overlap": mean, "largest_overlap": largest, "at_rest": True, "h": 1e-3, "arguments": "", "role": "", **more}


class Judge(unittest.TestCase):
    def test_pairs_are_those_of_all_distances(self):
        x = np.random.default_rng(1).uniform(size=(400, 3)) * (3, 1, 0.5)
        apart = np.linalg.norm(x[:, None] - x[None], axis=2)
        expected = {(i, j) for i, j in np.argwhere(apart < 0.2).tolist() if i < j}
        found = settle.close_pairs(x, 0.2).T.tolist()
        self.assertEqual(len(found), len(expected))
        self.assertEqual({tuple(pair) for pair in found}, expected)

    def test_overlaps_of_a_pair_and_of_walls(self):
        # two grains that overlap by 0.02, one 0.01 into the floor, one 0.03 into the far wall
        x = np.array([[0.5, 0.5, 0.49], [0.5, 0.5, 1.47], [4.53, 2.0, 2.0]])
        end = settle.judge(x, np.full(3, 0.5), np.zeros((3, 3)), 5.0)
        self.assertEqual(end["overlapping"], 3)
        self.assertAlmostEqual(end["mean_overlap"], 0.02)
        self.assertAlmostEqual(end["largest_overlap"], 0.03)
        self.assertTrue(end["at_rest"])


class Ratios(unittest.TestCase):
    def test_only_a_run_that_is_as_good_is_compared(self):
        ours = [row(1.0, 1e-3, 1e-2), row(2.0, 1e-4, 5e-3), row(4.0, 5e-5, 1e-4), row(0.1, 1e-5, at_rest=False), row(3.0, 2e-4)]
        lammps = {"k": 1e7, "dt": 1e-5, "damping": 1.0, "skin": 0.2, "check": 1, "stable": True}
        record = {"ours": ours, "lammps": [row(6.0, 2e-4, 1e-3, **lammps), row(1.0, 1e-6, stable=False, k=1), row(9.0, 1e-6, 1e-6, **lammps | {"k": 2e7})]}
        self.assertEqual([r["cpus"][0] for r in choice.frontier(ours[:3] + ours[4:])], [1.0, 2.0, 4.0])
        good, none = choice.ratios(record)
        self.assertEqual((good["ratio"], good["ratio_both"], good["ours_cpu"]), (3.0, 1.5, 2.0))
        self.assertEqual((none["ratio"], none["ratio_both"], none["ours"]), (None, None, None))


class Quick(ProgramTest):
    def run_study(self, *arguments, **variables):
        return run_suite("run", "peers", "--quick", "--results", self.folder, *arguments, **variables)

    def read(self):
        record = json.loads((self.folder / "peers.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/peers.schema.json").read_text()))
        return record

    def test_numbers_are_what_they_should_be(self):
        done = self.run_study()
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        record = self.read()
        for own in record["settle"]["ours"]:
            self.assertTrue(own["at_rest"])
            self.assertLess(own["mean_overlap"], 1e-3)
        self.assertEqual({cited["kind"] for cited in record["cited"]}, {"cited"})
        if shutil.which("lmp"):
            bed = record["settle"]
            stable = [r for r in bed["lammps"] if r["stable"]]
            self.assertTrue(stable)
            heights = [r["centre_height"] for r in bed["ours"] + stable]
            self.assertLess(max(heights), 1.1 * min(heights))  # both codes end in the same bed
            self.assertTrue(all(r["ratio"] > 0 for r in bed["ratios"] if r["ours"]))
            self.assertGreater(min(r["dt"] for r in bed["lammps"] if not r["stable"]), max(r["dt"] for r in stable))
        if installed("siconos", "scipy"):
            self.assertIn(SICONOS, {r["solver"] for r in record["siconos"]})
        self.assertTrue((self.folder / "peers.svg").exists())
        page = "".join(part if isinstance(part, str) else part.html() for part in Peers().section(Results("", {Peers.name: [Record(record)]}), self.folder))
        for words in ("Cited", "All runs of the settling bed", "quick job"):
            self.assertIn(words, page)

        folder = self.folder / "peers/quick"
        bed = json.loads((folder / "rows/settle.json").read_text())
        bed["ours"][0]["cpus"] = [12345.0, 12345.0]  # had it been measured again, it would be another
        bed["ours"].pop()
        (folder / "settle-so-far.json").write_text(json.dumps(bed))  # as a job leaves it that is stopped
        (folder / "rows/settle.json").unlink()
        done = self.run_study()
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        again = self.read()
        self.assertEqual(again["settle"]["ours"][0]["cpus"], [12345.0, 12345.0])
        self.assertEqual(len(again["settle"]["ours"]), len(record["settle"]["ours"]))
        self.assertEqual(again["siconos"], record["siconos"])
        self.assertFalse((folder / "settle-so-far.json").exists())

    def test_what_is_not_installed_is_named(self):
        done = self.run_study("--only", "settle", PATH=str(self.folder))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("skipped: LAMMPS: lmp is not installed\n", done.stdout)
        self.assertIn("LAMMPS: lmp is not installed", self.read()["left_out"])


if __name__ == "__main__":
    unittest.main()
