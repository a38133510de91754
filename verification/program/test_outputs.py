"""Results: targets are checked before the first step, nothing but regular files is replaced, and old ones stay where new ones fail."""
import json
import os
import re
import resource
import socket
import stat
import subprocess
import threading
import unittest

import h5py
import numpy as np

from fclib_files import write_local
from harness import NSCDD, SCENE, ProgramTest, errors_of

PACK = "dimension = 2\ngrains = 10\n"
ENDLESS = SCENE.replace("count = 5", "count = 2147483647")  # a refusal comes before the first step, or never


class Targets(ProgramTest):
    def setUp(self):
        super().setUp()
        self.scene = self.write("scene.toml", ENDLESS)
        self.before = {path: path.read_bytes() for path in self.folder.iterdir()}

    def refused(self, fragment, *arguments, **options):
        done = self.run_program(*arguments, timeout=20, **options)
        lines = [line for line in done.stderr.splitlines() if line.startswith("nscdd:") and "warning" not in line]
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertIn(fragment, lines[0])

    def commands(self, target):
        """Each way to write a file, to `target`."""
        spec = self.write("pack.toml", PACK)
        problem = self.folder / "problem.hdf5"
        write_local(problem, np.eye(2), np.array((-1.0, 0)), np.array((0.3,)))
        return (
            ("run", self.scene, "--json", target),
            ("run", self.scene, "--state", target),
            ("run", self.scene, "--frames", target),
            ("pack", spec, "-o", target),
            ("export-fclib", self.scene, "--step", 2_000_000_000, "-o", target),
            ("solve-fclib", problem, "-o", target),
            ("solve-fclib", problem, "--json", target),
        )

    def test_a_folder_that_is_not_there(self):
        for command in self.commands(self.folder / "none" / "out.h5"):
            self.refused("does not exist", *command)

    def test_only_regular_files_are_replaced(self):
        target = self.folder / "target.h5"
        bound = socket.socket(socket.AF_UNIX)
        self.addCleanup(bound.close)

        def device():
            os.mknod(target, stat.S_IFCHR | 0o600, os.makedev(1, 3))

        def linked(make):
            def both():
                make()
                target.rename(self.folder / "there")
                target.symlink_to("there")

            return both

        for make, what in (
            (lambda: os.mkfifo(target), "a FIFO"),
            (target.mkdir, "a folder"),
            (lambda: bound.bind(str(target)), "a socket"),
            (device, "a device"),
            (linked(lambda: os.mkfifo(target)), "a FIFO"),
            (linked(device), "a device"),
            (lambda: target.symlink_to("nowhere"), "a symbolic link to nothing"),
        ):
            try:
                make()
            except PermissionError:
                continue  # devices are made by root alone
            kind = os.stat(target).st_mode if os.path.exists(target) else None
            for command in self.commands(target):
                self.refused(what, *command)
            self.assertEqual(os.stat(target).st_mode if os.path.exists(target) else None, kind)
            target.rmdir() if kind and stat.S_ISDIR(kind) else target.unlink()
            (self.folder / "there").unlink(missing_ok=True)

    def test_no_output_is_an_input_or_another_output(self):
        spec, out, problem = self.write("pack.toml", PACK), self.folder / "out.h5", self.folder / "problem.hdf5"
        write_local(problem, np.eye(2), np.array((-1.0, 0)), np.array((0.3,)))
        (self.folder / "inner").mkdir()
        (self.folder / "again").symlink_to(".")
        os.link(self.scene, self.folder / "scene.json")
        packed = self.write("packed.toml", ENDLESS + '\n[packing]\nfile = "packing.h5"\nmaterial = "glass"\n')
        self.succeeds(
            "pack", self.write("spheres.toml", "dimension = 3\ngrains = 20\nseed = 2\ngenerator = 'own'\n"), "-o", self.folder / "packing.h5", "--quiet"
        )
        state = self.folder / "state.h5"
        self.succeeds("run", self.write("short.toml", SCENE), "--state", state)
        before = {path: path.read_bytes() for path in self.folder.iterdir() if path.is_file()}
        for command, fragment in (
            (("run", self.scene, "--json", self.scene), "--json is the same file as the scene"),
            (("run", self.scene, "--json", self.folder / "scene.json"), "--json is the same file as the scene"),
            (("run", self.scene, "--state", self.folder / "again" / "scene.toml"), "--state is the same file as the scene"),
            (("run", packed, "--json", self.folder / "packing.h5"), "--json is the same file as the packing"),
            (("run", self.scene, "--from", state, "--state", state), "--state is the same file as --from"),
            (("run", self.scene, "--json", out, "--state", out), "--state is the same file as --json"),
            (("run", self.scene, "--json", out, "--state", self.folder / "inner" / ".." / "out.h5"), "--state is the same file as --json"),
            (("run", self.scene, "--json", self.folder / "out.xdmf", "--state", out), "the .xdmf beside --state is the same file as --json"),
            (("run", self.scene, "--state", self.folder / "out.xdmf"), "the .xdmf beside --state is the same file as --state"),
            (("pack", spec, "-o", spec), "--output is the same file as the specification"),
            (("export-fclib", self.scene, "-o", self.scene), "--output is the same file as the scene"),
            (("solve-fclib", problem, "-o", problem), "--output is the same file as the problem"),
            (("solve-fclib", problem, "-o", out, "--json", out), "--json is the same file as --output"),
        ):
            with self.subTest(fragment=fragment):
                self.refused(fragment, *command)
        self.assertEqual({path: path.read_bytes() for path in self.folder.iterdir() if path.is_file()}, before)

    def test_permission(self):
        user = {}
        if os.geteuid() == 0:  # may write everywhere
            self.folder.chmod(0o755)
            user = {"user": 65534}
            try:
                self.run_program("--help", **user)
            except PermissionError:
                self.skipTest("the program is where root alone may start it")
        closed = self.folder / "closed"
        closed.mkdir(mode=0o555)
        self.refused("closed/out.json: cannot write: Permission denied", "run", self.scene, "--json", closed / "out.json", **user)
        own = self.folder / "open"
        own.mkdir()
        own.chmod(0o777)
        (own / "old.json").write_text("old")
        (own / "old.json").chmod(0o444)
        self.refused("old.json: cannot write: Permission denied", "run", self.scene, "--json", own / "old.json", **user)

    def test_too_little_space_is_a_warning(self):
        disk = os.statvfs(self.folder)
        if disk.f_bavail * disk.f_frsize > 200e9:
            self.skipTest("the disk has room for 2^31 steps")
        with subprocess.Popen([NSCDD, "run", self.scene, "--json", self.folder / "out.json"], stderr=subprocess.PIPE, text=True) as run:
            timer = threading.Timer(20, run.kill)
            timer.start()
            try:
                self.assertRegex(run.stderr.readline(), r"^nscdd: warning: .*out.json: .* MB are free, the file may take 2.15e\+05 MB")
                self.assertIsNone(run.poll())
            finally:
                timer.cancel()
                run.kill()


class Writing(ProgramTest):
    def setUp(self):
        super().setUp()
        self.scene = self.write("scene.toml", SCENE)
        self.json, self.state = self.folder / "out.json", self.folder / "out.h5"

    def run_pair(self, *options, **how):
        return self.run_program("run", self.scene, "--json", self.json, "--state", self.state, "--quiet", *options, **how)

    def parts(self):
        return [path.name for path in self.folder.rglob("*.part*")]

    def test_modes_and_links(self):
        old = os.umask(0o027)
        self.addCleanup(os.umask, old)
        self.assertEqual(self.run_pair().returncode, 0)
        self.assertEqual([stat.S_IMODE(path.stat().st_mode) for path in (self.json, self.state)], [0o640, 0o640])
        self.json.chmod(0o604)
        (self.folder / "far").mkdir()
        self.state.rename(self.folder / "far" / "there.h5")
        self.state.symlink_to("far/there.h5")
        (self.folder / "far" / "there.h5").chmod(0o600)
        before = (self.folder / "far" / "there.h5").read_bytes()
        self.assertEqual(self.run_pair("--steps", 3).returncode, 0)
        self.assertEqual(stat.S_IMODE(self.json.stat().st_mode), 0o604)
        self.assertTrue(self.state.is_symlink())
        self.assertEqual(stat.S_IMODE(self.state.stat().st_mode), 0o600)
        self.assertNotEqual((self.folder / "far" / "there.h5").read_bytes(), before)
        self.assertEqual(self.parts(), [])

    def test_peak_memory_is_the_programs_own(self):
        """Not that of who started it."""
        ballast = b"x" * 1_000_000_000
        self.assertEqual(self.run_pair().returncode, 0)
        self.assertLess(json.loads(self.json.read_text())["peak_memory"]["largest"], len(ballast) / 2)

    def test_the_part_of_another_is_left_alone(self):
        others = [self.write(f"{name}.part", "theirs") for name in ("out.json", "out.h5", "out.xdmf")]
        self.assertEqual(self.run_pair().returncode, 0)
        self.assertEqual([path.read_text() for path in others], ["theirs"] * 3)

    def test_the_old_pair_stays_where_one_file_fails(self):
        self.assertEqual(self.run_pair().returncode, 0)
        before = {path: path.read_bytes() for path in self.folder.iterdir()}
        self.write("scene.toml", SCENE.replace("count = 5", "count = 5000"))  # some 500 kB of JSON, 20 kB of state
        before[self.scene] = self.scene.read_bytes()

        def small_disk():
            resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))

        done = self.run_pair(preexec_fn=small_disk)
        self.assertEqual((done.returncode, errors_of(done)), (1, [f"nscdd: {self.json}: cannot write: File too large"]))
        self.assertEqual({path: path.read_bytes() for path in self.folder.iterdir()}, before)

    def test_streams_that_are_closed_or_full(self):
        """The exit code tells how the run ended, and no file gets what was to be printed."""
        touching = self.write("touching.toml", SCENE.replace("0.1, 1.5]", "0.1, 1.44]"))
        cases = (
            (0, ["run", self.scene, "--json", self.json, "--state", self.state]),
            (1, ["run", "nofile"]),
            (1, ["run", "--wrong"]),
            (0, ["--help"]),
            (3, ["run", touching, "--max-iterations", 1, "--tolerance", 1e-15, "--json", self.json, "--state", self.state]),
        )
        for code, arguments in cases:
            for redirected in ("2>&-", "2>/dev/full", ">&-", ">/dev/full", ">/dev/full 2>&1", "<&- >&- 2>&-"):
                with self.subTest(arguments=arguments[1:2], redirected=redirected):
                    done = subprocess.run(
                        ["bash", "-c", f'exec "$@" {redirected}', "bash", NSCDD, *map(str, arguments)], capture_output=True, text=True, timeout=60
                    )
                    self.assertEqual(done.returncode, code, done.stderr)
                    if code in (0, 3) and "--state" in arguments:
                        json.loads(self.json.read_text())
                        with h5py.File(self.state) as file:
                            self.assertIn("x", file)
        with subprocess.Popen([NSCDD, "run", touching, "--max-iterations", "1", "--tolerance", "1e-15"], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as run:
            run.stdout.close()
            run.stderr.close()  # nobody reads
            self.assertEqual(run.wait(60), 3)

    def test_a_disk_that_is_full_on_the_rank_that_writes(self):
        """All ranks stop, with one line, whichever had the error."""
        self.assertEqual(self.run_pair("--scheme", "dcs", ranks=3).returncode, 0)
        before = {path: path.read_bytes() for path in self.folder.iterdir()}
        command = ("run", self.scene, "--scheme", "dcs", "--json", self.json, "--state", self.state, "--quiet")
        self.assertEqual(self.run_on_small_disk(*command, ranks=3, kib=4), (1, [f"nscdd: {self.state}: cannot write: File too large"]))
        self.assertEqual({path: path.read_bytes() for path in self.folder.iterdir()}, before)

    def test_old_results_survive_a_run_that_fails(self):
        self.assertEqual(self.run_pair().returncode, 0)
        before = self.json.read_bytes(), self.state.read_bytes()
        self.write("scene.toml", SCENE.replace("[0.3, 0.1, 1.5]", "[0, 0, 1.35]"))
        self.assertEqual(self.run_pair().returncode, 1)
        self.assertEqual((self.json.read_bytes(), self.state.read_bytes()), before)
        self.assertEqual(self.parts(), [])

    def test_runs_to_one_pair_do_not_mix(self):
        """Whoever is last: each file is whole, and a pair of two runs is found out."""
        found = set()
        for _ in range(8):
            runs = [
                subprocess.Popen([NSCDD, "run", self.scene, "--json", self.json, "--state", self.state, "--quiet", "--steps", str(steps)])
                for steps in (3, 4, 5, 6)
            ]
            self.assertEqual([run.wait(60) for run in runs], [0] * 4)
            steps = json.loads(self.json.read_text())["steps"]
            other = self.folder / "other.json"
            self.succeeds("run", self.scene, "--json", other, "--state", self.folder / "other.h5", "--steps", steps, "--quiet")
            done = self.run_program("compare", other, self.json)
            self.assertTrue(done.returncode == 0 or re.search(r"steps made: \d, but \d in|is not the state", done.stderr), done.stderr)
            found.add(done.returncode)
            self.assertEqual(self.parts(), [])
        self.assertIn(0, found)

    def test_a_state_of_another_run_is_found_out(self):
        self.assertEqual(self.run_pair().returncode, 0)
        other = self.folder / "other"
        other.mkdir()
        for name, gravity in (("a", "-10"), ("b", "-9")):
            self.write("scene.toml", SCENE.replace("-10", gravity))
            self.succeeds("run", self.scene, "--json", other / f"{name}.json", "--state", other / f"{name}.h5")
        self.succeeds("compare", other / "a.json", self.json)
        self.state.write_bytes((other / "b.h5").read_bytes())
        done = self.run_program("compare", other / "a.json", self.json)
        self.assertEqual(done.returncode, 1)
        self.assertIn("out.h5: is not the state that", done.stderr)


if __name__ == "__main__":
    unittest.main()
