"""Studies of the program: run them, draw their page, hold counts against those that were accepted.

    scripts/suite list                         # the studies, a line each
    scripts/suite run hard accuracy            # makes their records; goes on where it was stopped
    scripts/suite run paper --only table1      # a part: jobs whose title matches, and what they need
    scripts/suite run hard --quick             # small and short, to see that it works
    scripts/suite report results --out page    # the page of a folder of results
    scripts/suite front                        # the picture of the README, from a state of the study reduced and the committed record of the paper
    scripts/suite counted results              # which of its counted numbers are those of the committed records?
    scripts/suite times 'A' 'B'                # does the command B take longer than A?
    scripts/suite regression                   # are counts and answers of small scenes those that were accepted? --accept REASON: now they are

Results are in results/: NAME.json is the record of a study, NAME/ has its files. What this very program has made is not made again;
--anew makes it again, --keep takes what another program has made. Exit code 1 if a job failed or a number is out of its bound.
"""
import argparse
import os
import re
import shutil
import sys
from pathlib import Path

from . import compare_times, counted, program
from .program import ROOT, Failed
from .record import InputError
from .studies import studies
from .studies.regression import Regression
from .study import Plan, typed


def run(options, arguments):
    known = studies()
    unknown = [name for name in options.names if name not in known]
    if unknown:
        raise InputError(f"suite: no study '{unknown[0]}' (known: {', '.join(known)})")
    if why := program.missing():
        raise InputError(f"suite: {why}")
    good = True
    for name in options.names:
        study = known[name]
        for tool in getattr(study, "tools", ()):
            if not shutil.which(tool):
                raise InputError(f"suite: {name}: {tool} is not there: scripts/setup installs it")
        plan = Plan(Path(os.path.relpath(options.results, ROOT)), name, options.only, options.quick, typed(arguments))
        if options.list:
            study.jobs(plan)
            print(*(job.title for job in study.choose(plan)), sep="\n")
        else:
            good = study.run(plan, options.anew, options.keep) and good
    return 0 if good else 1


def main(arguments=None):
    arguments = sys.argv[1:] if arguments is None else arguments
    parser = argparse.ArgumentParser(prog="scripts/suite", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="what", required=True, metavar="list | run | report")
    commands.add_parser("list", help="the studies, a line each")
    one = commands.add_parser("run", help="make the records of some studies")
    one.add_argument("names", nargs="+", metavar="NAME")
    one.add_argument("--only", default="", metavar="REGEX", help="jobs whose title matches, and what they need")
    one.add_argument("--quick", action="store_true", help="small and short, to see that it works")
    one.add_argument("--results", type=Path, default=ROOT / "results", help="folder to write to (default: results)")
    one.add_argument("--anew", action="store_true", help="make all again")
    one.add_argument("--keep", action="store_true", help="take what is there, whatever program made it")
    one.add_argument("--list", action="store_true", help="print the jobs, run nothing")
    one = commands.add_parser("report", help="the page of a folder of results")
    one.add_argument("results", type=Path, help="folder with records of studies, or JSON files of run and compare")
    one.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the page, made if needed")
    one = commands.add_parser("front", help="the picture of the README")
    one.add_argument("state", nargs="?", type=Path, default=ROOT / "results/reduced/biaxial-dcs-16.h5", help="default: results/reduced/biaxial-dcs-16.h5")
    one = commands.add_parser("counted", help="counted numbers beside the committed records")
    one.add_argument("results", nargs="?", type=Path, default=ROOT / "results", help="folder of results (default: results)")
    one.add_argument("--record", action="store_true", help="make what is there the committed records")
    one = commands.add_parser("regression", help="counts and answers of small scenes beside those that were accepted")
    one.add_argument("--only", default="", metavar="REGEX", help="only scenes whose name matches")
    one.add_argument("--results", type=Path, default=ROOT / "results", help="folder to write to (default: results)")
    one.add_argument("--accept", metavar="REASON", help="accept what is now, and why")
    one.add_argument("--without-simulator", action="store_true", help="no speed-ups, where smpirun is not installed; without this option that is an error")
    one = commands.add_parser(
        "times", help="does one command take longer than another?", description=compare_times.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    compare_times.add_options(one)
    options = parser.parse_args(arguments)
    if options.what == "times":
        try:
            return compare_times.compare(options, typed(arguments))
        except (InputError, Failed, OSError) as problem:
            print(problem, file=sys.stderr)
            return 1
    for name in {"results", "out", "state"} & vars(options).keys():
        setattr(options, name, getattr(options, name).resolve())
    os.chdir(ROOT)
    try:
        if options.what == "list":
            width = max(map(len, studies()))
            print(*(f"{name:<{width}}  {study.about}" for name, study in studies().items()), sep="\n")
            return 0
        if options.what == "report":
            from .page.report import make  # matplotlib takes a while

            return 0 if make(options.results, options.out) else 1
        if options.what == "front":
            from .page.front import draw

            draw(options.state, counted.RECORDS)
            return 0
        if options.what == "counted":
            print(*counted.compare(Path(os.path.relpath(options.results, ROOT)), options.record), sep="\n")
            return 0
        if options.what == "regression":
            plan = Plan(Path(os.path.relpath(options.results, ROOT)), "regression", options.only, False, typed(arguments))
            return 0 if Regression(options.accept, not options.without_simulator).run(plan, anew=True) else 1
        return run(options, arguments)
    except re.error as problem:
        print(f"suite: --only: {problem}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("suite: stopped; the same command goes on", file=sys.stderr)
        return 130
    except (InputError, Failed, OSError) as problem:
        print(problem, file=sys.stderr)
        return 1
