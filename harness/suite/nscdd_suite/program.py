"""How the program is called: where it is, its environment, one command, and what several studies do with it."""
import functools
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
NSCDD = os.environ.get("NSCDD", "build/bin/nscdd")  # from ROOT; the simulated one lies beside it
SIMULATED = f"{NSCDD}_simulated"
PLATFORMS = "cases/platforms"
COSTS = {2: f"{PLATFORMS}/costs-2d-coulomb.json", 3: f"{PLATFORMS}/costs-3d-coulomb.json"}
CAP = 3  # exit code: a step hit the cap of iterations, which the row says
COMPARED = (0, 2, 5)  # exit codes of compare: the runs agree, they do not, it is another answer


class Failed(Exception):
    """A command that should have worked; the text says which, and what it said."""


@functools.cache
def environment():
    """Variables of scripts/environment.sh, none of Open MPI's daemons beside a process that is alone, and where modules of the suite are."""
    told = dict(re.findall(r"^\s*export (OMPI_\w+)=(\S+)$", (ROOT / "scripts/environment.sh").read_text(), re.M))
    return {**os.environ, **told, "OMPI_MCA_ess_singleton_isolated": "1", "PYTHONPATH": str(ROOT / "harness/suite")}


class Killed(Failed):
    """A command that a signal ended: it says nothing of the program."""


def words(command):
    """As one types it in the repository."""
    return [os.path.relpath(word, ROOT) if isinstance(word, Path) and word.is_relative_to(ROOT) else str(word) for word in command]


def shown(command):
    """The same as text, whatever machine and build this is."""
    names = {NSCDD: "nscdd", SIMULATED: "nscdd_simulated", sys.executable: "python3"}
    return shlex.join([names.get(word, word) for word in words(command)])


def python(module, *arguments):
    """A command that is a module of the suite."""
    return [sys.executable, "-m", f"nscdd_suite.{module}", *arguments]


def call(command, fine=(0, CAP), seconds=None, out=None):
    """Runs it to its end. `out`: the file that it makes anew. Raises Failed."""
    command = words(command)
    if out:
        Path(out).unlink(missing_ok=True)
    try:  # by the wall clock: with a limit on CPU time the clock that measures it would only move in ticks of 4 ms
        done = subprocess.run(command, cwd=ROOT, env=environment(), capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        raise Failed(f"{shlex.join(command)}: took more than {seconds} s") from None
    except OSError as error:
        raise Failed(f"{shlex.join(command)}: {error.strerror}") from None
    if done.returncode < 0:
        raise Killed(f"{shlex.join(command)}: ended by signal {-done.returncode}")
    if done.returncode not in fine:
        raise Failed(f"{shlex.join(command)}: exit code {done.returncode}: {done.stderr.strip()[-300:]}")
    if out and not Path(out).exists():  # smpirun's exit code is 0 after MPI_Abort
        raise Failed(f"{shlex.join(command)}: no {out}: {done.stderr.strip()[-300:]}")
    return done


def made(command, out, **how):
    """The JSON that the command writes to `out`. Raises Failed."""
    call(command, out=out, **how)
    return read(out)


def read(path):
    return json.loads(Path(path).read_text())


def factors(file, latency, bandwidth):
    """What the simulator multiplies latency and bandwidth by, for messages of each size, times more."""
    for name, more in (("smpi/lat-factor", latency), ("smpi/bw-factor", bandwidth)):
        if more != 1:
            entries = re.search(rf'{name}" value="([^"]*)"', Path(ROOT, file).read_text())[1].split(";")
            yield f"--cfg={name}:" + ";".join(f"{size}:{float(factor) * more:g}" for size, factor in (entry.split(":") for entry in entries))


def simulated(ranks, platform="node48", latency=1, bandwidth=1):
    """What a simulated command begins with; `platform`: a name of cases/platforms, or a path without its ending; times its latency and bandwidth."""
    place = platform if "/" in str(platform) else f"{PLATFORMS}/{platform}"
    begin = ["smpirun", "-quiet", "-np", str(ranks), "-platform", f"{place}.xml", "-hostfile", f"{place}.hosts", "--log=root.thres:error"]
    return [*begin, *factors(f"{place}.xml", latency, bandwidth)]


def specification(source, grains=0, loose=False):
    """The text of a packing's specification, with other numbers of grains. Loose: few grains jam early."""
    text = Path(ROOT, source).read_text()
    if grains:
        text = re.sub(r"grains = \d+", f"grains = {grains}", text)
    if loose:
        text = re.sub(r"(?<=solid_fraction = )[\d.]+", lambda dense: f"{0.94 * float(dense[0]):.3f}", text)
    return text


@functools.cache
def checksum():
    """Of the program: what it made need not be made again."""
    return hashlib.sha256(Path(ROOT, NSCDD).read_bytes()).hexdigest()[:16]


def missing():
    """What to do where the program is not there, or None."""
    return None if os.access(ROOT / NSCDD, os.X_OK) else f"{NSCDD} is missing; build it with: cmake --preset release && cmake --build build"
