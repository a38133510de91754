"""The bundle of scripts/bundle: it is made, and runs where the environment names no program of this machine."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

from harness import NSCDD

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(NSCDD).resolve().parents[1]
MISSING = [name for name in ("ompi_info", "mpirun", "smpirun") if not shutil.which(name)]
MISSING += [name for name in ("nscdd_simulated", "ping_pong") if not (BUILD / "bin" / name).exists()]


@unittest.skipIf(MISSING, f"{', '.join(MISSING)}: not there")
class Bundle(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        archive = pathlib.Path(folder.name) / "bundle.tar"
        subprocess.run([ROOT / "scripts/bundle", "--build", BUILD, "-o", archive], check=True)
        subprocess.run(["tar", "-xf", archive, "-C", folder.name], check=True)
        cls.root = pathlib.Path(folder.name) / "nscdd-bundle"

    def run_there(self, *words, timeout=120):
        """With no environment but the bundle's programs: what it prints."""
        done = subprocess.run(list(map(str, words)), cwd=self.root, env={"PATH": f"{self.root}/bin"}, capture_output=True, text=True, timeout=timeout)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_programs_start_and_ranks_are_simulated_and_measured(self):
        self.assertEqual(self.run_there("nscdd", "--version"), subprocess.run([NSCDD, "--version"], capture_output=True, text=True).stdout)
        (self.root / "pack.toml").write_text("dimension = 2\ngrains = 300\nspread = 0.25\nseed = 4\ngenerator = 'own'\n")
        self.run_there("nscdd", "pack", "pack.toml", "-o", "disks.h5", "--quiet")
        scene = ["cases/reduced/biaxial.toml", "--packing", "disks.h5"]
        self.assertIn("on 2 subdomains", self.run_there("mpirun", "-np", 2, self.root / "bin/nscdd", "run", *scene, "--scheme", "dcs", "--steps", 2))
        kinds = ("sweep", "accelerated", "driven", "residual", "pack", "glue", "factorised")
        (self.root / "costs.json").write_text(
            json.dumps({"schema": "nscdd.costs/1", "model": "2D Coulomb", "ns": {kind: [{"bytes": 1000, "ns": 10}] for kind in kinds}})
        )
        platform = (self.root / "cases/platforms/node.xml.in").read_text()
        (self.root / "node.xml").write_text(
            platform.replace("@clock@", "0")
            .replace("@call@", "0:1e-7:0")
            .replace("@latency@", "1us")
            .replace("@bandwidth@", "5GBps")
            .replace("@shared@", "0:1e-8:0")
        )
        (self.root / "node.hosts").write_text("node\nnode\n")
        self.run_there(
            "nscdd",
            "scale",
            *scene,
            "--ranks",
            2,
            "--platform",
            "node.xml",
            "--costs",
            "costs.json",
            "--simulator",
            "lib/nscdd_simulated",
            "--iterations",
            1000,
            "--measure",
            "--json",
            "scale.json",
        )  # longer than a busy machine's hiccups
        points = json.loads((self.root / "scale.json").read_text())["points"]
        self.assertEqual([point["ranks"] for point in points], [1, 2])
        for point in points:
            self.assertGreater(point["windows"][0]["seconds_per_iteration"], 0)
            if point["ranks"] <= len(os.sched_getaffinity(0)):
                self.assertEqual(len(point["measured"]["all_repeats"]), 5)

    def test_run_makes_what_is_sent_back(self):
        self.run_there(self.root / "run", "--quick", "--ranks", "1,2", timeout=800)
        for method in ("paper", "auto"):
            self.assertIn("simulated / measured", (self.root / f"results/quick/spheres4k-{method}.txt").read_text())
            points = json.loads((self.root / f"results/quick/spheres4k-{method}.json").read_text())["points"]
            self.assertEqual([point["ranks"] for point in points], [1, 2])
        self.assertEqual(json.loads((self.root / "results/quick/costs-spheres4k.json").read_text())["model"], "3D Coulomb")
        self.run_there(self.root / "run", "--quick", "--ranks", "1,2")  # all is there
