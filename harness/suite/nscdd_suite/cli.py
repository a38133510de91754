"""Studies of the program: run them, draw their page, hold counts against those that were accepted.

    scripts/suite list                         # the studies, a line each
    scripts/suite run hard accuracy            # makes their records; goes on where it was stopped
    scripts/suite run paper --only table1      # a part: jobs whose title matches, and what they need
    scripts/suite run hard --quick             # small and short, to see that it works
    scripts/suite report results --out page    # the page of a folder of results

Results are in results/: NAME.json is the record of a study, NAME/ has its files. What this very program has made is not made again;
--anew makes it again, --keep takes what another program has made. Exit code 1 if a job failed or a number is out of its bound.
"""
import argparse
import os
import shutil
import sys
from pathlib import Path

from . import program
from .program import ROOT, Failed
from .record import InputError
from .studies import studies
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
            print(*(job.title for job in plan.jobs), sep="\n")
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
    options = parser.parse_args(arguments)
    if hasattr(options, "results"):
        options.results = options.results.resolve()
    os.chdir(ROOT)
    try:
        if options.what == "list":
            width = max(map(len, studies()))
            print(*(f"{name:<{width}}  {study.about}" for name, study in studies().items()), sep="\n")
            return 0
        return run(options, arguments)
    except (InputError, Failed) as problem:
        print(problem, file=sys.stderr)
        return 1
