"""Whether one command takes longer than another, by a rank test over interleaved runs.

    scripts/suite times 'old/nscdd run cases/hard/column-100-3d.toml --quiet --repeat 9' 'build/bin/nscdd run cases/hard/column-100-3d.toml --quiet --repeat 9'

Runs A and B in turn, which of the two first by turns, and takes the CPU time of each (--wall: wall-clock time). A pair of which a process had less than
95 % of its core is made again, up to three times. Wilcoxon's signed-rank test over the pairs' ratios then gives the probability p of such a difference
between two equal commands. B is called slower or faster at p < 0.001 and a median ratio beyond 1 %; both hold, or nothing is said to differ.
Exit code: 0 no difference, or B is faster; 3 B is slower; 1 an error.
"""
import shlex
import subprocess
import sys
import time
from datetime import datetime, timezone

from . import record
from .jobs import clock, left
from .program import Failed
from .times import CORES, LEAST_PAIRS, believed, busy, compared, least, taken

PAIRS = 15


def timed(command):
    """{cpu: seconds, wall, cores} of one run. 3, not converged, is no error."""
    done, _, cpu, wall = taken(lambda: subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True))
    if done.returncode not in (0, 3):
        raise Failed(f"{shlex.join(command)}: exit code {done.returncode}: {done.stderr.strip()[-300:]}")
    return {"cpu": cpu, "wall": wall, "cores": cpu / wall}


def pair(commands, turn):
    """Both commands, A first in even turns; made again where the machine was busy."""

    def once():
        made = {which: timed(commands[which]) for which in ((0, 1) if turn % 2 == 0 else (1, 0))}
        return {"a": made[0], "b": made[1], "cores": least(one["cores"] for one in made.values())}

    return believed(once)


def add_options(add):
    add("a", metavar="A", help="the command that B is compared with")
    add("b", metavar="B")
    add("--pairs", type=int, default=PAIRS, metavar="N", help=f"runs of each (default: {PAIRS})")
    add("--wall", action="store_true", help="compare wall-clock times")
    add("--json", metavar="FILE", help="record to write")


def compare(options):
    """Exit code. Raises Failed, InputError and OSError."""
    if options.pairs < LEAST_PAIRS:
        raise record.InputError(f"times: --pairs must be at least {LEAST_PAIRS}, found {options.pairs}")
    try:
        commands = [shlex.split(text) for text in (options.a, options.b)]
    except ValueError as error:
        raise record.InputError(f"times: not a command: {error}") from None
    if not all(commands):
        raise record.InputError("times: a command is empty")
    key, began, pairs = "wall" if options.wall else "cpu", time.monotonic(), []
    for command in commands:
        timed(command)  # files and pages that are touched for the first time
    for turn in range(options.pairs):
        pairs.append(pair(commands, turn))
        if sys.stderr.isatty():
            about = left(time.monotonic() - began, turn + 1, options.pairs)
            print(f"\r{turn + 1} of {options.pairs} pairs ({clock(time.monotonic() - began)}{about})  ", end="", file=sys.stderr)
    result = compared(*([one[side][key] for one in pairs] for side in "ab"))
    disturbed = sum(busy(one.pop("cores")) for one in pairs)
    told = f"; {disturbed} pairs had less than {100 * CORES:.0f} % of a core" if disturbed else ""
    print(f"B / A: {result['ratio']:.3f} in {key} time, {options.pairs} pairs, p = {result['p']:.2g}: {result['verdict']}{told}")
    if options.json:
        made = {"schema": "nscdd.times/1", "command": options.typed, "a": options.a, "b": options.b, "of": key}
        made["date"] = datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
        record.write(options.json, made | result | {"disturbed": disturbed, "pairs": pairs})
    return 3 if result["verdict"] == "slower" else 0
