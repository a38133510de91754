#!/usr/bin/env python3
"""Report of a folder of results: OUT/index.html, its figures beside it (SVG, pictures PNG), summary.json.

    python3 report.py results --out results/report

Exits 1 if a run did not converge, a comparison is out of its bounds or a job failed (the page then says which), and
if an input is malformed (one line on the terminal, no page).
"""
import argparse
import dataclasses
import json
import sys
from datetime import datetime, timezone
from pathlib import Path

from nscdd_report import peers, physics, section_main, section_paper, section_records
from nscdd_report.load import InputError, load
from nscdd_report.page import commits, counted, machines, number, page, verdict
from nscdd_report.style import write
from nscdd_report.tables import count

PAPER = ("V. Visseq, A. Martin, D. Dureisseix, F. Dubois, P. Alart, <i>Distributed Nonsmooth Contact Domain "
         "Decomposition (NSCDD): Algorithmic Structure and Scalability</i>, DD 21, LNCSE 98, 627\u2013636 (2014), "
         '<a href="https://doi.org/10.1007/978-3-319-05789-7_60">doi:10.1007/978-3-319-05789-7_60</a>')

# To add one: a function of the results and the folder of the images, which returns blocks and HTML, in a file of its own;
# no section where it returns none.
SECTIONS = (("paper", "The paper, table by table", section_paper.section),
            ("physics", "Physics", physics.section),
            ("peers", "Beside other codes", peers.section),
            ("communication", "Reduced scenes: communication", section_main.communication),
            ("pictures", "Reduced scenes: partition and multiplicity", section_main.pictures),
            ("scaling", "Reduced scenes: speed-up and iterations", section_main.scaling),
            ("agreement", "Reduced scenes: agreement", section_main.agreement),
            ("bits", "The same bits everywhere", section_records.same_bits),
            ("hard", "Hard cases", section_records.hard_cases),
            ("accuracy", "Speed against error", section_records.speed_against_error),
            ("acceleration", "Acceleration", section_records.acceleration),
            ("converged", "What a converged step is worth", section_records.converged))


def facts(results):
    """What the page was made from, as (name, text)."""
    runs, sources = results.runs, [*results.runs, *results.records]
    dates = sorted(source["date"] for source in sources)
    scenes = ", ".join(dict.fromkeys(f"{run['scene']} ({count(run['grains'])} grains)" for run in runs))
    systems = "; ".join(sorted({", ".join(filter(None, (r["machine"].get("os"), r["machine"].get("compiler"))))
                                for r in sources} - {""}))
    return [("Runs of the main job", f"{len(runs)}: {scenes}" if runs else "none"), ("Rows of hard cases", count(len(results.hard_rows))),
            ("Made", f"{dates[0]} to {dates[-1]}"), ("Machine", machines(sources)), ("System", systems), ("Commit", commits(sources)),
            ("Page written", datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"))], dates


def make(folder, out):
    """Writes the report; returns whether it passes."""
    results = load(folder)
    out.mkdir(parents=True, exist_ok=True)
    verdict_html, passes = verdict(results)
    verdict_html += counted(results)
    sections = [(key, heading, make_parts(results, out)) for key, heading, make_parts in SECTIONS]
    sections = [section for section in sections if section[2]]
    number(sections)
    opening, judged = verdict_html, []
    if results.statements:
        html, judged = section_paper.summary(*results.statements)
        opening = html + verdict_html
    lead = ("Nonsmooth contact domain decomposition with centralised (CCS) and distributed (DCS) communication, "
            "against sequential nonlinear Gauss\u2013Seidel (NLGS). Each caption says whether its numbers were measured on a real "
            "machine, counted, computed, or SIMULATED on a machine that is not there.")
    described, dates = facts(results)
    html = page("nscdd: report", lead, described, opening, sections, "Method: " + PAPER + ".")
    runs, sources = results.runs, [*results.runs, *results.records]
    summary = {"schema": "nscdd.summary/1", "passes": passes, "failures": results.failures(),
               "unchecked": [run.name for run in results.unchecked()], "runs": len(runs),
               "compared_rows": sum(len(c["rows"]) for c in results.compares), "hard_rows": len(results.hard_rows),
               "largest_residual": {run.name: run.eta_max for run in runs}, "machine": machines(sources),
               "commit": commits(sources), "dates": [dates[0], dates[-1]],
               "statements": [dataclasses.asdict(one) for one in judged], **results.summary}
    write(out / "summary.json", (json.dumps(summary, indent=1) + "\n").encode())
    write(out / "index.html", html.encode())
    for line in results.failures():
        print(f"report: {line}", file=sys.stderr)
    print(f"report: {out / 'index.html'}: {len(runs)} runs, " + ("passes" if passes else "FAILS"))
    return passes


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path, help="folder with run, compare and state files")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to, made if needed")
    options = parser.parse_args(arguments)
    try:
        return 0 if make(options.results, options.out) else 1
    except (InputError, OSError) as error:
        print(f"report: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
