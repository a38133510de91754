"""Checkpoints: a run that is killed at any moment, stopped by a signal or by a full disk goes on from the last one, to the last bit."""
import json
import os
import pathlib
import random
import resource
import signal
import stat
import subprocess
import time
import unittest

import h5py
import numpy as np

from harness import MPIRUN, NSCDD, PACKED, ProgramTest

STEPS = 200


def ranks_of(launcher):
    """Process ids of the ranks that mpirun has started; of a run without it its own."""
    if launcher.args[0] == NSCDD:
        return [launcher.pid]
    children = pathlib.Path(f"/proc/{launcher.pid}/task/{launcher.pid}/children")
    return [int(pid) for pid in children.read_text().split()] if children.exists() else []


def alive(pid):
    """Not gone, and no zombie that waits for its parent."""
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


class CheckpointTest(ProgramTest):
    def setUp(self):
        super().setUp()
        side = 1.02 * np.arange(6) + 0.6  # 216 spheres, that fall on each other
        x = np.stack(np.meshgrid(side, side, side, indexing="ij"), -1).reshape(-1, 3)
        x += 0.01 * np.sin(np.arange(x.size)).reshape(x.shape)
        with h5py.File(self.folder / "packing.h5", "w") as file:
            file["x"], file["radius"], file["box"] = x, np.full(len(x), 0.5), np.full(3, 7.0)
        self.scene = self.write("scene.toml", PACKED.replace("count = 5", f"count = {STEPS}").replace("h = 0.001", "h = 0.002"))
        self.checkpoint = self.folder / "checkpoint.h5"

    def command(self, *more, ranks=0, out="out"):
        launcher = [MPIRUN, "-np", ranks] if ranks else []
        in_process = () if ranks else ("-n", 3)
        return [
            str(part)
            for part in (
                *launcher,
                NSCDD,
                "run",
                self.scene,
                "--scheme",
                "dcs",
                *in_process,
                "--quiet",
                "--json",
                self.folder / f"{out}.json",
                "--state",
                self.folder / f"{out}.h5",
                *more,
            )
        ]

    def run_to_end(self, *more, **how):
        done = subprocess.run(self.command(*more, **how), capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)

    def start(self, *more, **how):
        run = subprocess.Popen(self.command(*more, **how), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        self.addCleanup(run.stderr.close)
        self.addCleanup(lambda: run.poll() is None and run.kill())
        return run

    def wait_for(self, run, path):
        """Until the file is there."""
        for _ in range(6000):
            if path.exists():
                return
            self.assertIsNone(run.poll(), run.poll() is not None and run.stderr.read())
            time.sleep(0.005)
        self.fail(f"{path} does not come")

    def wait_until_gone(self, pid):
        """Ranks whose mpirun is killed end by themselves."""
        for _ in range(3000):
            if not alive(pid):
                return
            time.sleep(0.01)
        self.fail(f"process {pid} does not end")

    def end_of(self, run):
        """Exit code. mpiexec of Open MPI 4.1.4 can hang in its own PMIx_server_finalize where a rank was killed while it connected (2 of
        452 kills during the start): mpiexec alone, with all ranks dead, is killed and counted; a rank that lives is our hang."""
        ranks = ranks_of(run)
        try:
            return run.wait(60)
        except subprocess.TimeoutExpired:
            ranks += ranks_of(run)
            self.assertEqual([pid for pid in ranks if alive(pid)], [], "these processes do not end")
            self.launchers_hung += 1
            run.kill()
            return run.wait()

    def steps(self):
        """Made, and left; reads all that is in the checkpoint."""
        with h5py.File(self.checkpoint) as file:
            file.visititems(lambda name, item: item[...] if isinstance(item, h5py.Dataset) else None)
            return int(file.attrs["step"]), int(file.attrs["steps_left"])

    def result(self, out="out"):
        """What is the same to the last bit however a run came to its end."""
        return (self.folder / f"{out}.h5").read_bytes(), json.loads((self.folder / f"{out}.json").read_text())["final"]


class Checkpoints(CheckpointTest):
    def test_they_change_nothing_and_are_where_they_should_be(self):
        self.run_to_end(out="plain")
        for every, step in (("70", 140), ("7", 196), ("200", None), ("1e-9s", 199), ("1000s", None)):
            self.checkpoint.unlink(missing_ok=True)
            self.run_to_end("--checkpoint", self.checkpoint, "--every", every)
            self.assertEqual(self.result(), self.result("plain"))
            self.assertEqual(self.steps() if self.checkpoint.exists() else None, step and (step, STEPS - step))
        self.assertEqual([path for path in self.folder.iterdir() if path.suffix == ".part"], [])

    def test_a_run_goes_on_to_its_end(self):
        self.run_to_end(out="plain")
        for ranks in (0, 3):
            self.run_to_end("--checkpoint", self.checkpoint, "--every", 70, ranks=ranks)
            self.run_to_end("--from", self.checkpoint, "--checkpoint", self.checkpoint, "--every", 45, out="rest", ranks=ranks)
            self.assertEqual(self.steps(), (180, STEPS - 180))  # counted from the start
            self.assertEqual(self.result("rest"), self.result("plain"))
        self.run_to_end("--from", self.checkpoint, "--steps", 5, out="rest")
        self.assertEqual(json.loads((self.folder / "rest.json").read_text())["steps"], 5)
        self.run_to_end("--from", self.folder / "plain.h5", out="rest")  # that has none left
        self.assertEqual(json.loads((self.folder / "rest.json").read_text())["steps"], STEPS)

    def test_on_other_numbers_of_ranks(self):
        self.run_to_end(out="plain")
        self.run_to_end("--checkpoint", self.checkpoint, "--every", 190)
        for ranks in (1, 2, 4):
            self.run_to_end("--from", self.checkpoint, out="rest", ranks=ranks)
            done = self.run_program("compare", self.folder / "plain.json", self.folder / "rest.json")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_refusals(self):
        for more, fragment in (
            (("--every", "5"), "--every is of checkpoints: give --checkpoint"),
            (("--checkpoint", self.checkpoint, "--repeat", "2"), "--checkpoint is of one run"),
            (("--checkpoint", self.scene), "--checkpoint is the same file as the scene"),
            (("--checkpoint", self.folder / "out.h5"), "--state is the same file as --checkpoint"),
            (("--checkpoint", self.folder / "none" / "c.h5"), "does not exist"),
            *(
                (("--checkpoint", self.checkpoint, "--every", every), "--every " + every)
                for every in ("0", "-1", "5m", "s", "nans", "infs", "0s", "1.5", "99999999999999999999")
            ),
        ):
            done = subprocess.run(self.command(*map(str, more)), capture_output=True, text=True, timeout=20)
            self.assertEqual((done.returncode, len(done.stderr.splitlines())), (1, 1), done.stderr)
            self.assertIn(fragment, done.stderr)
        self.assertFalse(self.checkpoint.exists())


class Faults(CheckpointTest):
    def test_a_signal_to_any_rank_stops_all_with_a_checkpoint(self):
        many = 1_000_000  # it does not come to its end before
        for ranks, chosen in ((0, 0), (3, 0), (3, 2), (3, None)):  # None: mpirun
            with self.subTest(ranks=ranks, chosen=chosen):
                for path in (self.checkpoint, self.folder / "out.h5", self.folder / "out.json"):
                    path.unlink(missing_ok=True)
                run = self.start("--checkpoint", self.checkpoint, "--every", 20, "--steps", many, ranks=ranks)
                self.wait_for(run, self.checkpoint)
                os.kill(run.pid if chosen is None else ranks_of(run)[chosen], signal.SIGUSR1)
                self.assertEqual(run.wait(60), 4)
                made, left = self.steps()
                self.assertIn(f"nscdd: stopped by SIGUSR1 after step {made}, before the end: go on with --from", run.stderr.read())
                self.assertEqual(made + left, many)
                self.assertFalse((self.folder / "out.json").exists() or (self.folder / "out.h5").exists())
                self.run_to_end("--steps", made + 5, out="plain", ranks=ranks)
                self.run_to_end("--from", self.checkpoint, "--steps", 5, out="rest", ranks=ranks)
                self.assertEqual(self.result("rest"), self.result("plain"))

    def test_a_full_disk_leaves_the_checkpoint_before(self):
        self.run_to_end("--checkpoint", self.checkpoint, "--every", 150)
        before = self.checkpoint.read_bytes()

        def small_disk():
            resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))

        done = subprocess.run(self.command("--checkpoint", self.checkpoint, "--every", 10), capture_output=True, text=True, timeout=60, preexec_fn=small_disk)
        self.assertEqual((done.returncode, done.stderr), (1, f"nscdd: {self.checkpoint}: cannot write: File too large\n"))
        arguments = self.command("--checkpoint", self.checkpoint, "--every", "10", ranks=3)[4:]
        self.assertEqual(self.run_on_small_disk(*arguments, ranks=3, kib=8), (1, [f"nscdd: {self.checkpoint}: cannot write: File too large"]))
        self.assertEqual(self.checkpoint.read_bytes(), before)
        self.assertEqual([path for path in self.folder.iterdir() if path.suffix == ".part"], [])

    def wait_a_while(self, run, choose):
        """Some checkpoints and a part of the next; or a time in which there may be none."""

        def current():
            return self.checkpoint.stat()[stat.ST_INO] if self.checkpoint.exists() else None

        if choose.random() < 0.25:
            return time.sleep(choose.uniform(0, 0.6))
        for _ in range(choose.randint(1, 20)):
            before = current()
            while run.poll() is None and current() == before:
                time.sleep(0.001)
        time.sleep(choose.uniform(0, 0.02))

    def frames(self, path):
        """Steps of the frames of a run that may have been killed; reads all that is in the file."""
        if not path.exists():
            return []
        with h5py.File(path) as file:
            file.visititems(lambda name, item: item[...] if isinstance(item, h5py.Dataset) else None)
            steps = [int(frame.attrs["step"]) for frame in file.values()]
            self.assertEqual(steps, list(range(steps[0], steps[0] + len(steps))))
        return steps

    def killed(self, kills, ranks, seed):
        """Runs are killed at random moments, and others go on, until one comes to its end; then from the start again, until there were
        enough. Each checkpoint is whole, and each end that of the run that was left alone."""
        choose = random.Random(seed)
        self.run_to_end(out="plain", ranks=ranks)
        self.checkpoint.unlink(missing_ok=True)
        frames = self.folder / "frames.h5"
        done = ends = 0
        while done < kills or ends == 0:
            go_on = ("--from", self.checkpoint) if self.checkpoint.exists() else ()
            out = [self.folder / "out.h5", self.folder / "out.json", self.folder / "out.xdmf"]
            frames.unlink(missing_ok=True)
            run = self.start(*go_on, "--checkpoint", self.checkpoint, "--every", 1 if done < kills else 50, "--frames", frames, ranks=ranks)
            if done < kills:
                self.wait_a_while(run, choose)
                victims = ranks_of(run)
                if run.poll() is None and victims:
                    victim = choose.choice([run.pid, *victims])
                    try:
                        os.kill(victim, choose.choice((signal.SIGKILL, signal.SIGKILL, signal.SIGTERM)))
                    except ProcessLookupError:
                        pass  # it has just come to its end
            code = self.end_of(run)
            for pid in victims if done < kills else ():
                self.wait_until_gone(pid)
            self.assertNotIn("nscdd:", run.stderr.read())
            shown = self.frames(frames)
            if code == 0:
                self.assertEqual(self.result(), self.result("plain"))
                self.assertEqual(shown[-1], STEPS)
                ends += 1
                for path in (*out, self.checkpoint):
                    path.unlink()
            else:
                done += 1
                for part in self.folder.glob("frames.*.part"):
                    part.unlink()
                if self.checkpoint.exists():
                    made, left = self.steps()
                    self.assertEqual(made + left, STEPS)
                    self.moments.add(made)
                    if shown and shown[-1] > made - 1:
                        self.shown += 1

    def test_killed_at_random_moments(self):
        self.moments, self.launchers_hung, self.shown = set(), 0, 0
        for ranks, kills in ((0, 8), (2, 4)):
            self.killed(kills, ranks, seed=ranks)
        self.assertGreater(len(self.moments), 4)
        self.assertGreater(self.shown, 2)


class HundredKills(Faults):
    def test_killed_at_random_moments(self):
        self.moments, self.launchers_hung, self.shown = set(), 0, 0
        for ranks, kills in ((0, 60), (2, 25), (3, 15)):
            self.killed(kills, ranks, seed=100 + ranks)
        self.assertGreater(len(self.moments), 50)
        self.assertGreater(self.shown, 50)
        print(
            f"100 kills: checkpoints of {len(self.moments)} different steps were left, frames up to them {self.shown} times, mpiexec hung {self.launchers_hung} times"
        )


if __name__ == "__main__":
    unittest.main()
