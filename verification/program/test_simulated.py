"""Simulated machines: their ping-pong, times that repeat to the digit, bits of real runs, and `nscdd scale`."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

import h5py
import jsonschema
import numpy as np

from harness import NSCDD, ProgramTest, run_suite

ROOT = pathlib.Path(__file__).resolve().parents[2]
PLATFORMS = ROOT / "cases/platforms"
BIN = pathlib.Path(NSCDD).resolve().parent
KINDS = ("sweep", "accelerated", "driven", "residual", "pack", "glue", "factorised")
SMPIRUN = shutil.which("smpirun") and (BIN / "nscdd_simulated").exists()


def costs(**ns):
    """A file of costs that do not depend on the size, 10 ns a unit unless said."""
    return json.dumps({"schema": "nscdd.costs/1", "model": "2D Coulomb", "ns": {kind: [{"bytes": 1000, "ns": ns.get(kind, 10)}] for kind in KINDS}})


@unittest.skipUnless(SMPIRUN, "smpirun is not installed, or nscdd_simulated not built")
class Simulated(ProgramTest):
    def setUp(self):
        super().setUp()
        self.scene = ROOT / "cases/reduced/network.toml"
        self.packing = self.folder / "disks.h5"
        pack = self.write("pack.toml", "dimension = 2\ngrains = 300\nspread = 0.25\nseed = 4\ngenerator = 'own'\n")
        self.succeeds("pack", pack, "-o", self.packing, "--quiet")
        self.costs = self.write("costs.json", costs())

    def simulate(self, ranks, program, *arguments, platform="node48", options=()):
        """Of smpirun: its output."""
        return subprocess.run(
            [
                "smpirun",
                "-quiet",
                "-np",
                str(ranks),
                "-platform",
                PLATFORMS / f"{platform}.xml",
                "-hostfile",
                PLATFORMS / f"{platform}.hosts",
                "--log=root.thres:error",
                *options,
                BIN / program,
                *map(str, arguments),
            ],
            capture_output=True,
            text=True,
            cwd=self.folder,
        )

    def window(self, ranks, *arguments, **options):
        out = self.folder / "window.json"
        done = self.simulate(
            ranks,
            "nscdd_simulated",
            "window",
            self.scene,
            "--packing",
            self.packing,
            "--costs",
            self.costs,
            "--iterations",
            30,
            "--json",
            out,
            "--quiet",
            *arguments,
            **options,
        )
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return json.loads(out.read_text())

    def test_ping_pong_of_the_platforms_is_what_their_links_promise(self):
        for platform, ranks, microseconds, gigabytes in (
            ("two-cores", 2, 0.01, 20),
            ("node48", 2, 0.3, 33),
            ("node48", 48, 0.3, 33),
            ("cluster", 8, 0.3, 33),
            ("cluster", 9, 1.2, 12),
            ("cluster", 1024, 1.2, 12),
        ):
            with self.subTest(platform=platform, ranks=ranks):
                done = self.simulate(ranks, "ping_pong_simulated", platform=platform)
                self.assertEqual(done.returncode, 0, done.stderr)
                rows = {int(size): (float(us), float(rate)) for size, us, rate in re.findall(r"(\d+) B: ([\d.]+) us, ([\d.]+) GB/s", done.stdout)}
                self.assertLessEqual(abs(rows[8][0] / microseconds - 1), 0.2)
                self.assertLessEqual(abs(rows[1 << 20][1] / gigabytes - 1), 0.1)

    def test_simulated_seconds_are_the_same_to_the_digit(self):
        first, second = self.window(4), self.window(4)
        for key in ("seconds_per_iteration", "per_iteration", "work_per_iteration"):
            self.assertEqual(first[key], second[key])
        self.assertTrue(first["simulated"])

    def test_messages_and_time_are_told_by_operation(self):
        for scheme, glued in (("ccs", ("gather", "scatter")), ("dcs", ("exchange",))):
            window = self.window(4, "--scheme", scheme, "--method", "paper")
            parts = window["operations_per_iteration"]
            for kind, scale in (("messages", 1), ("wait", 1e6), ("transfer", 1e6)):
                self.assertAlmostEqual(scale * sum(one[kind]["mean"] for one in parts.values()), scale * window["per_iteration"][kind]["mean"])
            self.assertEqual({name for name, one in parts.items() if one["messages"]["mean"]}, {*glued, "reduction"})  # two walls are under pressure
            if scheme == "ccs":  # between rank 0 and each other: one way full, the other way empty; and all wait for what it glues
                self.assertEqual([4 * parts[name]["messages"]["mean"] for name in glued], [6, 6])
                self.assertGreater(parts["scatter"]["wait"]["largest"], parts["gather"]["wait"]["least"])

    def test_a_sequential_iteration_takes_what_its_work_costs(self):
        window = self.window(1, "--scheme", "nlgs", "--method", "paper")
        work = {kind: window["work_per_iteration"][kind]["mean"] for kind in KINDS}
        self.assertEqual(work["sweep"], window["contacts"])
        self.assertEqual(work["residual"], window["contacts"] / 10)  # tested every ten iterations
        self.assertGreater(work["driven"], 0)  # two walls are under pressure
        self.assertLess(work["driven"], 0.1 * window["contacts"])
        self.assertAlmostEqual(window["seconds_per_iteration"] / (1e-8 * sum(work.values())), 1, delta=1e-6)
        slower = self.window(1, "--scheme", "nlgs", "--method", "paper", "--slower", 3)
        self.assertAlmostEqual(slower["seconds_per_iteration"] / window["seconds_per_iteration"], 3, delta=1e-6)

    def test_latency_bandwidth_and_noise_count(self):
        def seconds(*arguments, method="auto", **options):
            return self.window(4, "--method", method, *arguments, **options)["seconds_per_iteration"]

        given, twice = seconds(), ["--cfg=smpi/lat-factor:0:2"]  # 0.3 us more a link
        self.assertGreater(seconds(options=twice), given + 0.3e-6)  # the one round of a reduction, and copies at the same time
        self.assertLess(seconds(method="paper", options=twice), seconds(method="paper") + 0.5e-6)  # messages are under way meanwhile
        self.assertLess(seconds(options=["--cfg=smpi/lat-factor:0:0.5"]), given - 0.1e-6)
        self.assertGreater(seconds(options=["--cfg=smpi/bw-factor:0:0.001"]), given)
        for within, kind, other, least in (("memory", "shared_message", "message", 0.05e-6), ("messages", "message", "shared_message", 0.16e-6)):
            work = self.window(4, "--method", "auto", "--within-node", within)["work_per_iteration"]
            self.assertGreaterEqual(work[kind]["least"], 6)  # to one neighbour at least, and the one round of a reduction; and back
            self.assertEqual(work[other]["largest"], 0)
            calls = least * work[kind]["least"]  # at least; some are made while a rank would wait
            for method in ("auto", "paper"):  # neither hides them
                once, twice = (seconds("--latency", factor, "--within-node", within, method=method) for factor in (1, 2))
                self.assertGreater(twice, once + 0.7 * calls)
        halves = [self.window(2, "--bandwidth", factor)["seconds_per_iteration"] for factor in (1, 0.5)]  # messages of more than 256 B
        self.assertGreater(halves[1], halves[0])
        noisy = seconds("--noise", 0.2, "--seed", 7)
        self.assertGreater(noisy, given)  # all wait for the slowest
        self.assertEqual(noisy, seconds("--noise", 0.2, "--seed", 7))
        self.assertNotEqual(noisy, seconds("--noise", 0.2, "--seed", 8))

    def test_threads_work_at_the_same_time_and_send_one_message(self):
        one, apart = self.window(1, "--threads", 4, "--method", "paper"), self.window(4, "--method", "paper")
        work = one["work_per_iteration"]
        self.assertEqual((one["ranks"], work["message"]["largest"], work["shared_message"]["largest"]), (4, 0, 1))  # a copy
        by_one_thread = 1e-8 * sum(work[kind]["mean"] for kind in KINDS)
        largest = 1e-8 * apart["work_per_iteration"]["sweep"]["largest"]  # of a rank, in the least that an iteration takes
        self.assertGreaterEqual(one["seconds_per_iteration"], largest)
        self.assertLess(one["seconds_per_iteration"], min(by_one_thread / 2, apart["seconds_per_iteration"]))
        two = self.window(2, "--threads", 2, "--method", "paper")["work_per_iteration"]["shared_message"]
        self.assertEqual(two["least"], two["largest"])
        self.assertAlmostEqual(two["mean"], 5.2, delta=1e-9)  # a copy; a message each way of the exchange, and of 1.1 rounds of reductions
        self.assertGreater(apart["work_per_iteration"]["shared_message"]["mean"], 4)
        done = self.simulate(1, "nscdd_simulated", "window", self.scene, "--packing", self.packing, "--costs", self.costs, "--threads", 49)
        self.assertIn("--threads 49: a node of the platform has 48 cores", done.stderr)

    def test_simulated_ranks_give_the_bits_of_those_in_process(self):
        run = ["run", self.scene, "--packing", self.packing, "--steps", 2, "--quiet", "--partition", "bisection"]
        for scheme in ("ccs", "dcs"):
            done = self.simulate(3, "nscdd_simulated", *run, "--scheme", scheme, "--transport", "mpi", "--state", self.folder / "a.h5")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            self.succeeds(*run, "--scheme", scheme, "--subdomains", 3, "--state", self.folder / "b.h5")
            with h5py.File(self.folder / "a.h5") as a, h5py.File(self.folder / "b.h5") as b:
                for key in ("x", "velocity", "contacts/impulse"):
                    np.testing.assert_array_equal(a[key][...], b[key][...])

    def test_noise_is_drawn_for_every_iteration(self):
        """Also on one rank: the mean of 30 draws of 5 % is within 4 % of the time without noise."""
        given, noisy = (self.window(1, "--scheme", "nlgs", "--noise", noise)["seconds_per_iteration"] for noise in (0, 0.05))
        self.assertNotEqual(noisy, given)
        self.assertAlmostEqual(noisy / given, 1, delta=0.04)

    def test_ranks_of_smpirun_are_one_run(self):
        done = self.simulate(3, "nscdd_simulated", "run", self.scene, "--packing", self.packing, "--scheme", "dcs", "--steps", 1)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(done.stdout.count("dcs on 3 subdomains"), 1, done.stdout)

    def test_noise_that_is_none(self):
        done = self.simulate(1, "nscdd_simulated", "window", self.scene, "--packing", self.packing, "--costs", self.costs, "--noise", "nan")
        self.assertIn("--noise: must be a number in [0, 10]", done.stderr)

    def test_bad_costs_are_one_line(self):
        for text, said in (
            ("{", "is no JSON"),
            ('{"schema": "x"}', "is no file of costs (schema nscdd.costs/1)"),
            (costs(sweep=-1), "ns.sweep: bytes must ascend from above 0, and ns must not be negative"),
            (re.sub(r'"driven": \[.*?\]', '"driven": []', costs()), f"has no cost of driven walls, which {self.scene} has"),
            (costs().replace("2D", "3D"), f"costs of a 3D Coulomb scene, {self.scene} is 2D Coulomb"),
        ):
            self.costs.write_text(text)
            done = self.simulate(2, "nscdd_simulated", "window", self.scene, "--packing", self.packing, "--costs", self.costs)
            self.assertEqual([line for line in done.stderr.splitlines() if line.startswith("nscdd: ")], [f"nscdd: {self.costs}: {said}"])
            self.assertNotEqual(done.returncode, 0)

    def scale(self, *arguments, iterations=20):
        return self.run_program(
            "scale",
            self.scene,
            "--packing",
            self.packing,
            "--platform",
            PLATFORMS / "node48.xml",
            "--costs",
            self.costs,
            "--iterations",
            iterations,
            "--json",
            self.folder / "scale.json",
            *arguments,
            cwd=self.folder,
        )

    def test_scale_goes_on_after_an_interruption(self):
        done = self.scale("--ranks", "1,2", "--bands")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("SIMULATED", done.stdout)
        path = self.folder / "scale.json"
        whole = json.loads(path.read_text())
        jsonschema.validate(whole, json.loads((ROOT / "reports/scale.schema.json").read_text()))
        self.assertEqual([len(point["windows"]) for point in whole["points"]], [6, 6])
        # as it was before the last but one of the windows
        cut = json.loads(path.read_text())
        del cut["points"][1]["windows"][4:]
        path.write_text(json.dumps(cut))
        done = self.scale("--ranks", "1,2", "--bands")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr.count("simulating"), 2, done.stderr)
        self.assertNotIn("counting", done.stderr)
        again = json.loads(path.read_text())
        self.assertEqual(again["points"], whole["points"])
        with self.subTest("the efficiency is that of the times and counts told"):
            alone, two = whole["points"]
            for window in two["windows"]:
                per = alone["windows"][0]["seconds_per_iteration"] / (2 * window["seconds_per_iteration"])
                self.assertAlmostEqual(window["efficiency_of_iteration"], per, delta=1e-12)
                self.assertAlmostEqual(window["efficiency"], per * sum(alone["iterations"]) / sum(two["iterations"]), delta=1e-12)
        with self.subTest("no trace is left"):
            left = {entry.name for entry in self.folder.iterdir()}
            self.assertEqual(left, {"scale.json", "costs.json", "disks.h5", "pack.toml"})
        with self.subTest("other settings are refused"):
            done = self.scale("--ranks", "1,2", "--slower", 3)
            self.assertEqual((done.returncode, done.stderr), (1, f"nscdd: {path}: was begun with another slower, give another file to begin anew\n"))
            self.assertEqual(json.loads(path.read_text()), again)

    def test_what_a_busy_machine_measures_is_made_again_and_marked(self):
        for _ in range(2 * len(os.sched_getaffinity(0))):
            other = subprocess.Popen([sys.executable, "-c", "while True: pass"])
            self.addCleanup(other.wait)
            self.addCleanup(other.kill)
        done = self.scale("--ranks", "1", "--measure", iterations=2000)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("THE MACHINE WAS BUSY", done.stdout)
        self.assertEqual(done.stderr.count("measuring again, the machine was busy"), 2)
        (point,) = json.loads((self.folder / "scale.json").read_text())["points"]
        load = point["measured"]["load"]
        self.assertFalse(load["believed"])
        self.assertLess(load["cores"]["least"], 0.95)

    def test_scale_tells_why_the_simulator_failed(self):
        broken = self.write("broken", "#!/bin/sh\necho nscdd: it is broken >&2\nexit 4\n")
        broken.chmod(0o755)
        done = self.scale("--ranks", "1", "--simulator", broken)
        self.assertEqual(done.returncode, 1)
        self.assertIn("nscdd: smpirun ended with exit code", done.stderr.splitlines()[-1])


@unittest.skipUnless(SMPIRUN, "smpirun is not installed, or nscdd_simulated not built")
class Studies(ProgramTest):
    def test_a_table_that_was_interrupted_goes_on(self):
        def tables():
            done = run_suite("run", "scaling", "--quick", "--only", "^weak-2k-16$", "--results", self.folder)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            return (folder / "logs/weak-2k-16.log").read_text()

        folder = self.folder / "scaling/quick"
        self.assertIn("4 ranks: simulating", tables())
        table = folder / "weak-2k-16.json"
        begun = re.search(r"--json (\S+)", json.loads(table.read_text())["command"])[1]
        self.assertFalse((ROOT / begun).exists())
        table.rename(ROOT / begun)
        self.assertNotIn("simulating", tables())
        self.assertEqual([row["ranks"] for row in json.loads((self.folder / "scaling.json").read_text())["rows"]], [1, 4])

    def test_spheres_side_by_side_are_run_and_gone_on_with(self):
        done = run_suite("run", "million", "--quick", "--results", self.folder)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        rows = json.loads((self.folder / "million.json").read_text())["rows"]
        self.assertEqual([(row["run"], row["grains"], row["steps"], row["converged"]) for row in rows], [("first", 600, 2, True), ("rest", 600, 1, True)])
        self.assertTrue(all(row["memory"]["largest"] > 0 for row in rows))


class Calibration(ProgramTest):
    def test_costs_are_measured_of_every_kind_of_work(self):
        pack = self.write("pack.toml", "dimension = 2\ngrains = 300\nspread = 0.25\nseed = 4\ngenerator = 'own'\n")
        self.succeeds("pack", pack, "-o", self.folder / "disks.h5", "--quiet")
        out = self.folder / "costs.json"
        text = (ROOT / "cases/reduced/network.toml").read_text()
        self.assertIn('method = "paper"\n', text)
        self.succeeds(
            "calibrate",
            self.write("accelerated.toml", text.replace('method = "paper"\n', "")),
            "--packing",
            self.folder / "disks.h5",
            "--subdomains",
            "1,2,4",
            "--seconds",
            1e-4,
            "-o",
            out,
            "--quiet",
        )
        measured = json.loads(out.read_text())
        jsonschema.validate(measured, json.loads((ROOT / "reports/costs.schema.json").read_text()))
        self.assertEqual(measured["model"], "2D Coulomb")
        for kind in ("sweep", "accelerated", "residual"):
            self.assertEqual(len(measured["ns"][kind]), 3)
        with self.subTest("a size whose subdomains have no contacts is left out"):
            done = self.succeeds(
                "calibrate", ROOT / "cases/reduced/network.toml", "--packing", self.folder / "disks.h5", "--subdomains", "2,5000", "--seconds", 1e-4, "-o", out
            )
            self.assertIn("5000 subdomains: left out", done.stderr)
            self.assertEqual(len(json.loads(out.read_text())["ns"]["sweep"]), 1)
        for kind in KINDS:
            for point in measured["ns"][kind]:
                self.assertTrue(0.01 < point["ns"] < 1e5, (kind, point))


if __name__ == "__main__":
    unittest.main()
