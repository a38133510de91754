"""Do other compilers and processors give the same bits? Builds the program for them and holds it against the accepted answers.

    g++-v3     GCC, any processor with AVX2
    g++-v4     GCC, any processor with AVX-512; left out where this one has none
    clang-v3   Clang 16, any processor with AVX2
    aarch64    GCC for ARM, under qemu-aarch64: Debian's packages for it are unpacked under build-bits/, nothing is installed

Each runs the regression without the simulator: all counts and checksums of answers must be the accepted ones. Then each runs the hard cases, of which all
counted numbers must be those of reports/results/hard.json; under qemu only those that take no second here. A build takes 3 minutes of two cores, its runs 7;
under qemu half an hour. Needs scripts/setup --clang --aarch64.
"""
import shutil
from pathlib import Path

from ... import record
from ...program import Failed, call
from ...study import Study
from ..regression import ACCEPTED
from .compilers import BUILDS, build

# Hard cases of a build that does not run all of them.
HARD = {"aarch64": r"^(?!heap|pair|rebound|lid-1000|squeeze-slow|column-1000|mass-1e6|settled|order|bounce-1024|restitution|gas|clump)"}
WIDE = ("avx512f", "avx512vl", "avx512bw", "avx512dq", "avx512cd")


class Bits(Study):
    name, title, about = "bits", "The same bits everywhere", "do other compilers and processors give the same bits?"
    in_all = False

    def jobs(self, plan):
        for name, (compiler, _) in BUILDS.items():
            lacking = [tool for tool in (compiler, *(["qemu-aarch64"] if name == "aarch64" else [])) if not shutil.which(tool)]
            if lacking:
                plan.leave_out(f"{name}: {' and '.join(lacking)} missing: scripts/setup --clang --aarch64")
            elif name.endswith("v4") and not all(f" {flag}" in Path("/proc/cpuinfo").read_text() for flag in WIDE):
                plan.leave_out(f"{name}: this processor has no AVX-512")
            else:  # a build has both cores
                plan.rows(name, row, name, plan.folder / name, plan.quick, cost=600 if name != "aarch64" else 1800, alone=True)

    def rows(self, plan):
        rows = [found for name in BUILDS if (found := plan.made(name))]
        return {"accepted": record.load(ACCEPTED)["commit"], "rows": rows} if rows else {}

    def told(self, data):
        for row in data["rows"]:
            yield f"{row['build']}: {row['numbers'] - len(row['differ'])} of {row['numbers']} numbers and answers are the accepted ones"
            yield from (f"    {name}" for name in row["differ"])

    def passes(self, data):
        return not any(row["differ"] for row in data["rows"])


def suite(program, *words):
    """The suite's own command with another program."""
    call(["env", f"NSCDD={program}", "scripts/suite", *words], fine=(0, 1))


def row(name, folder, quick):
    """Counts and answers of a build beside the accepted ones."""
    shutil.rmtree(folder, ignore_errors=True)  # what an earlier program made
    folder.mkdir(parents=True)
    program = build(name)
    suite(program, "regression", "--without-simulator", "--results", folder)
    if not (folder / "regression.json").exists():
        raise Failed(f"{name}: the regression made no numbers")
    told, accepted = record.load(folder / "regression.json"), record.load(ACCEPTED)["values"]
    now, asked = told["values"], {key for key in accepted if not key.endswith(" speed-up")}
    numbers, wrong = len(asked | now.keys()), {key for key in asked | now.keys() if now.get(key) != accepted.get(key)}
    found = {"build": name, "compiler": told["machine"]["compiler"], "lanes": told["machine"]["lanes"]}
    if not quick:
        suite(program, "run", "hard", "--only", HARD.get(name, ""), "--results", folder)
        suite(program, "counted", folder)
        hard = record.load(folder / "counted.json")
        counts = ("not_in_the_record",) if name in HARD else ("not_in_the_record", "missing")  # also of cases that failed
        wrong |= {entry["name"] for entry in hard["differ"]} | {f"hard: {key}: {hard[key]}" for key in counts if hard[key]}
        found["hard"], numbers = {"same": hard["same"], "of": hard["of"]}, numbers + hard["of"]
    return found | {"numbers": numbers, "answers": {key: value for key, value in now.items() if key.endswith(" answer")}, "differ": sorted(wrong)}
