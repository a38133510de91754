"""What the tests of the program share: a scratch folder, small scenes, and a way to run `nscdd`."""
import importlib.machinery
import importlib.util
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "harness/suite"))  # for nscdd_suite
NSCDD = os.environ.get("NSCDD", "build/bin/nscdd")
MPIRUN = os.environ.get("NSCDD_MPIRUN", "mpirun")

GLASS = """[[material]]
name = "glass"
density = 1.0

[[pair]]
materials = ["glass", "glass"]
friction = 0.3
"""

SCENE = (
    """name = "pair"
dimension = 3
gravity = [0, 0, -10]

"""
    + GLASS
    + """
[[grain]]
position = [0, 0, 0.5]
radius = 0.5
material = "glass"

[[grain]]
position = [0.3, 0.1, 1.5]
radius = 0.5
material = "glass"

[[wall]]
name = "floor"
normal = [0, 0, 1]
through = [0, 0, 0]
material = "glass"
motion = "fixed"

[step]
h = 0.001
count = 5
"""
)

PACKED = SCENE[: SCENE.index("[[grain]]")] + '[packing]\nfile = "packing.h5"\nmaterial = "glass"\n\n' + SCENE[SCENE.index("[[wall]]") :]


def load_script(name):
    """scripts/NAME as a module."""
    scripts = pathlib.Path(__file__).resolve().parents[2] / "scripts"
    if str(scripts) not in sys.path:
        sys.path.append(str(scripts))  # for what scripts share
    loader = importlib.machinery.SourceFileLoader(name, str(scripts / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    sys.modules[name] = module
    loader.exec_module(module)
    return module


def run_suite(*arguments, **variables):
    """What scripts/suite runs, with these arguments and variables of the environment."""
    environment = os.environ | {"NSCDD": str(pathlib.Path(NSCDD).resolve()), "PYTHONPATH": str(ROOT / "harness/suite")} | variables
    return subprocess.run([sys.executable, "-m", "nscdd_suite", *map(str, arguments)], capture_output=True, text=True, env=environment)


def errors_of(done):
    """The lines of ours on stderr that are no notes: a program without fused products begins with one."""
    return [line for line in done.stderr.splitlines() if line.startswith("nscdd:") and not line.startswith("nscdd: note:")]


class ProgramTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def run_program(self, *arguments, ranks=0, timeout=120, **options):
        """ranks = 0: alone, without mpirun. Options are those of subprocess.run."""
        launcher = [MPIRUN, "-np", str(ranks)] if ranks else []
        return subprocess.run([*launcher, NSCDD, *map(str, arguments)], capture_output=True, text=True, timeout=timeout, **options)

    def run_on_small_disk(self, *arguments, ranks, kib):
        """Files of rank 0, which writes, may have so many KiB. Exit code, and the errors."""
        command = [NSCDD, *map(str, arguments)]
        small = ["bash", "-c", f'ulimit -f {kib}; exec "$@"', "bash", *command]
        with unittest.mock.patch.dict(os.environ, OMPI_MCA_btl="self,tcp"):  # shared memory is files too
            done = subprocess.run([MPIRUN, "-np", "1", *small, ":", "-np", str(ranks - 1), *command], capture_output=True, text=True, timeout=60)
        return done.returncode, errors_of(done)

    def succeeds(self, *arguments, ranks=0):
        done = self.run_program(*arguments, ranks=ranks)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done
