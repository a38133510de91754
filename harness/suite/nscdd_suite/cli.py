"""Studies of the program: run them, draw their page, hold counts against those that were accepted.

    scripts/suite list                         # the studies, a line each
    scripts/suite run hard accuracy            # makes their records; goes on where it was stopped
    scripts/suite run paper --only table1      # a part: jobs whose title matches, and what they need
    scripts/suite run hard --quick             # small and short, to see that it works
    scripts/suite report results --out page    # the page of a folder of results
    scripts/suite picture frames.h5 film.mp4   # grains, force chains and walls of a run: a picture of the last frame, or a film
    scripts/suite front                        # the picture of the README, from a state of the study reduced and the committed record of the paper
    scripts/suite counted results              # which of its counted numbers are those of the committed records?
    scripts/suite times 'A' 'B'                # does the command B take longer than A?
    scripts/suite regression                   # are counts and answers of small scenes those that were accepted? --accept REASON: now they are

Results are in results/: NAME.json is the record of a study, NAME/ has its files. What this very program has made from the same inputs, and measured
on this processor, is not made again; --anew makes it again, --keep takes what is there. Exit code 1 if a job failed or a number is out of its bound.
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

RESULTS = ROOT / "results"


def placed(path):
    """As given: the suite itself works in the root of the project."""
    return Path(path).resolve()


AS_WRITTEN = argparse.RawDescriptionHelpFormatter


def plan_of(options, name, only, quick=False):
    return Plan(Path(os.path.relpath(options.results, ROOT)), name, only, quick, options.typed, getattr(options, "keep", False))


def asked(names):
    """{name of a study: its items}, () for all of it, in the order of the names. Raises InputError."""
    found, known = {}, studies()
    for name in names:
        for study in known.values():
            if name == study.name or name == "all" and study.in_all:
                found[study.name] = ()
            elif name in study.items and found.get(study.name) != ():
                found[study.name] = (*found.get(study.name, ()), name)
        if not any(name in ("all", study.name, *study.items) for study in known.values()):
            items = (item for study in known.values() for item in study.items)
            raise InputError(f"suite: no study '{name}' (known: all, {', '.join(known)}; parts: {', '.join(items)})")
    return found


def run(options):
    wanted = asked(options.names)
    if why := program.missing():
        raise InputError(f"suite: {why}")
    if options.only and any(wanted.values()):
        raise InputError("suite: --only is for whole studies: not beside a part such as table1")
    good, tools = True, {name: () if options.list else getattr(studies()[name], "tools", ()) for name in wanted}
    lacking = {name: found for name in wanted if (found := [tool for tool in tools[name] if not shutil.which(tool)])}
    for name, items in wanted.items():
        plan = plan_of(options, name, ",".join(items) or options.only, options.quick)
        if options.list:
            print(*(job.title for job in studies()[name].planned(plan)), sep="\n")
        elif name not in lacking:
            good = studies()[name].run(plan, options.anew) and good
    if left_out := "; ".join(f"{name}, for lack of {' and '.join(tools)}" for name, tools in lacking.items()):
        raise InputError(f"suite: left out: {left_out}: scripts/setup installs it")
    return good


def parsed(arguments):
    parser = argparse.ArgumentParser(prog="scripts/suite", description=__doc__, formatter_class=AS_WRITTEN)
    commands = parser.add_subparsers(dest="what", required=True, metavar="list | run | report")

    def command(name, about, **how):
        return commands.add_parser(name, help=about, **how).add_argument

    command("list", "the studies, a line each")("names", nargs="*", metavar="NAME", help="of these alone")
    add = command("run", "make the records of some studies")
    add("names", nargs="+", metavar="NAME", help="a study, a part of the paper such as table1, or all: those that take hours, not days")
    add("--only", default="", metavar="REGEX", help="jobs whose title matches, and what they need")
    add("--quick", action="store_true", help="small and short, to see that it works")
    add("--results", type=placed, default=RESULTS, help="folder to write to (default: results)")
    add("--anew", action="store_true", help="make all again")
    add("--keep", action="store_true", help="take what is there, whatever program made it, from whatever inputs")
    add("--list", action="store_true", help="print the jobs, run nothing")
    add = command("report", "the page of a folder of results")
    add("results", type=placed, help="folder with records of studies, or JSON files of run and compare")
    add("--out", type=placed, required=True, metavar="DIR", help="folder of the page, made if needed")
    add = command("picture", "grains, force chains and walls of a run")
    add("frames", type=placed, help="what nscdd run --frames has written; of a .pvd ParaView draws")
    add("out", type=placed, nargs="?", help="a picture (.png, .svg, .pdf) or a film (.gif, .mp4); default: FRAMES.png")
    add("--frame", type=int, metavar="N", help="number of the frame, from 0; -1 is the last (default: the last)")
    add("--colour", choices=("speed", "spin", "radius", "multiplicity", "subdomain"), default="speed", help="of the grains (default: speed)")
    add("--rate", type=float, default=10, metavar="N", help="frames a second of a film (default: 10)")
    add("--size", type=int, default=960, metavar="N", help="pixels of the longer side of a picture of frames in .h5, about (default: 960)")
    add = command("front", "the picture of the README")
    add("state", nargs="?", type=placed, default=RESULTS / "reduced/biaxial-dcs-16.h5", help="default: results/reduced/biaxial-dcs-16.h5")
    add = command("counted", "counted numbers beside the committed records")
    add("results", nargs="?", type=placed, default=RESULTS, help="folder of results (default: results)")
    add("--record", action="store_true", help="make what is there the committed records")
    add = command("regression", "counts and answers of small scenes beside those that were accepted")
    add("--only", default="", metavar="REGEX", help="only scenes whose name matches")
    add("--results", type=placed, default=RESULTS, help="folder to write to (default: results)")
    add("--accept", metavar="REASON", help="accept what is now, and why")
    add("--without-simulator", action="store_true", help="no speed-ups, where smpirun is not installed; without this option that is an error")
    about = {"description": compare_times.__doc__, "formatter_class": AS_WRITTEN}
    compare_times.add_options(command("times", "does one command take longer than another?", **about))
    return parser.parse_args(arguments)


def do(options):
    good = True
    if options.what == "list":
        names = asked(options.names or studies())
        width = max(map(len, names))
        print(*(f"{name:<{width}}  {studies()[name].about}" for name in names), sep="\n")
    elif options.what == "run":
        good = run(options)
    elif options.what == "report":
        from .page.report import make  # matplotlib takes a while

        good = make(options.results, options.out)
    elif options.what == "picture":
        from .page.picture import draw as draw_run

        draw_run(options.frames, options.out, options.frame, options.colour, options.rate, options.size)
    elif options.what == "front":
        from .page.front import draw

        draw(options.state, counted.RECORDS)
    elif options.what == "counted":
        print(*counted.compare(Path(os.path.relpath(options.results, ROOT)), options.record), sep="\n")
    elif options.what == "regression":
        good = Regression(options.accept, not options.without_simulator).run(plan_of(options, "regression", options.only), anew=True)
    else:
        return compare_times.compare(options)
    return 0 if good else 1


def main(arguments=None):
    arguments = sys.argv[1:] if arguments is None else arguments
    options = parsed(arguments)
    options.typed = typed(arguments)
    if options.what != "times":  # whose commands are those of the folder where it is called
        os.chdir(ROOT)
    try:
        return do(options)
    except KeyboardInterrupt:
        print("suite: stopped; the same command goes on", file=sys.stderr)
        return 130
    except (InputError, Failed, OSError, re.error) as problem:
        print(f"suite: --only: {problem}" if isinstance(problem, re.error) else problem, file=sys.stderr)
        return 1
