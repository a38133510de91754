"""Times: loads in results, jobs that are made again, and `scripts/suite times`."""
import json
import math
import os
import pathlib
import random
import subprocess
import sys
import unittest

from harness import NSCDD, ProgramTest, run_suite
from nscdd_suite import compare_times, jobs, times

ROOT = pathlib.Path(__file__).resolve().parents[2]
BURN = "import time, sys\nwhile time.process_time() < float(sys.argv[1]): pass"


def load(cores):
    return {"cores": {"least": cores, "mean": 1.0, "largest": 1.0}, "believed": cores >= times.CORES}


class Times(ProgramTest):
    def told(self, case, *options, core=None):
        """The JSON of a run, on one core of the machine where it is given."""
        out = self.folder / "run.json"
        kept = [] if core is None else ["taskset", "-c", str(core)]
        done = subprocess.run([*kept, NSCDD, "run", ROOT / f"cases/hard/{case}.toml", *options, "--quiet", "--json", out], capture_output=True, text=True)
        self.assertIn(done.returncode, (0, 3), done.stderr)
        return json.loads(out.read_text())

    def test_a_run_says_how_much_of_its_core_it_had(self):
        told = self.told("column-10-3d")
        self.assertEqual(set(told["load"]), {"cores", "switches", "running", "cores_allowed", "believed"})
        self.assertGreater(told["load"]["cores"]["least"], 0)
        self.assertLess(told["load"]["cores"]["largest"], 1.05)
        self.assertEqual(told["load"]["believed"], told["load"]["cores"]["least"] >= times.CORES)
        self.assertGreaterEqual(told["load"]["cores_allowed"]["least"], 1)
        self.assertEqual(set(told["machine"]["libraries"]), {"eigen", "hdf5", "metis", "mpi", "suitesparse"})

    def test_a_run_beside_another_on_one_core_is_not_believed(self):
        core = min(os.sched_getaffinity(0))
        other = subprocess.Popen(["taskset", "-c", str(core), sys.executable, "-c", BURN, "60"])
        try:
            told = self.told("column-1000-3d", "--method", "paper", "--tolerance", "1e-30", "--max-iterations", "300000", core=core)
        finally:
            other.kill()
            other.wait()
        self.assertLess(told["load"]["cores"]["least"], 0.8)
        self.assertFalse(told["load"]["believed"])
        self.assertGreater(told["load"]["switches"]["least"], 0)

    def test_a_disturbed_job_is_made_again_three_times_at_most(self):
        for busy, made in ((0, 1), (1, 2), (5, times.TRIES)):
            out, count = self.folder / "out.json", self.folder / "count"
            count.write_text("")
            write = (
                f"import json, pathlib; count = pathlib.Path({str(count)!r}); count.write_text(count.read_text() + 'x'); "
                f"cores = 0.5 if len(count.read_text()) <= {busy} else 1.0; "
                f"pathlib.Path({str(out)!r}).write_text(json.dumps({{'load': {{'cores': {{'least': cores}}, 'believed': cores > 0.9}}}}))"
            )
            runner = jobs.Runner([jobs.Job("timed", [out], [[sys.executable, "-c", write]], alone=True)], self.folder)
            runner.run_all()
            self.assertFalse(runner.failed())
            self.assertEqual(len(count.read_text()), made, busy)

    def test_without_loads_times_are_taken_as_they_are(self):
        self.assertFalse(times.busy(times.cores_of({})))
        self.assertFalse(times.busy(times.cores_of({"load": load(0.5) | {"believed": None}})))
        self.assertTrue(times.busy(times.cores_of({"load": load(0.94)})))


class Compared(unittest.TestCase):
    """The rank test on made-up seconds: a drift of 10 % in common, noise of 2 % of each."""

    def verdicts(self, slower, trials, noise=0.02):
        for seed in range(trials):
            draw = random.Random(seed)
            drift = [1 + 0.1 * math.sin(turn) for turn in range(compare_times.PAIRS)]
            a, b = ([factor * one * math.exp(draw.gauss(0, noise)) for one in drift] for factor in (1, slower))
            yield times.compared(a, b)["verdict"]

    def test_equal_programs_are_hardly_ever_called_different(self):
        self.assertLessEqual(sum(verdict != "no difference" for verdict in self.verdicts(1, 1000)), 3)

    def test_five_per_cent_are_found(self):
        self.assertGreaterEqual(sum(verdict == "slower" for verdict in self.verdicts(1.05, 100)), 95)
        self.assertGreaterEqual(sum(verdict == "faster" for verdict in self.verdicts(1 / 1.05, 100)), 95)

    def test_a_real_difference_of_half_a_per_cent_is_not_worth_a_word(self):
        self.assertEqual(set(self.verdicts(1.005, 20, noise=1e-4)), {"no difference"})

    def test_too_few_runs_prove_nothing(self):
        found = times.compared([1.0] * 9, [2.0] * 9)
        self.assertEqual((found["verdict"], found["p"]), ("too few runs", None))


class CompareTimes(ProgramTest):
    def compare_commands(self, *arguments):
        return run_suite("times", *arguments)

    def compare(self, a, b, *options):
        commands = [f"{sys.executable} -c '{BURN}' {seconds}" for seconds in (a, b)]
        return self.compare_commands(*commands, "--pairs", "11", *options)

    def test_a_slower_command_is_found(self):
        out = self.folder / "times.json"
        done = self.compare(0.1, 0.13, "--json", out)
        self.assertEqual(done.returncode, 3, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"B / A: 1\.\d+ in cpu time, 11 pairs, p = 0\.00098: slower")
        told = json.loads(out.read_text())
        self.assertEqual((len(told["pairs"]), told["verdict"]), (11, "slower"))

    def test_a_command_that_fails_is_one_line(self):
        done = self.compare_commands("true", "false")
        self.assertEqual((done.returncode, done.stderr), (1, "false: exit code 1: \n"))

    def test_an_empty_command_is_one_line(self):
        done = self.compare_commands("true", "")
        self.assertEqual((done.returncode, done.stderr), (1, "times: a command is empty\n"))

    def test_few_pairs_are_refused(self):
        done = self.compare_commands("true", "true", "--pairs", "9")
        self.assertEqual((done.returncode, done.stderr), (1, "times: --pairs must be at least 11, found 9\n"))


if __name__ == "__main__":
    unittest.main()
