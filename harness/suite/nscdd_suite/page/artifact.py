"""The artifact appendix of a paper: each table and figure of a page, what makes it, how long that takes, what to expect and how closely."""
import contextlib
import io
import os
import re
import tempfile
from pathlib import Path

from .. import counted, program
from ..study import Plan
from .page import blocks

# What another machine may find, by kind of number.
BANDS = {
    "counted": "the same digits, with fused products",
    "computed": "the same digits, from the same numbers",
    "measured": "times are the machine's: compare ratios of one run",
    "simulated": "of the machine whose costs the record names",
}


def hours(study, folder):
    """What its jobs are stated to take on one core; "" where the program is not built, which some ask for their jobs."""
    if program.missing():
        return ""
    plan = Plan(Path(folder), study.name)
    plan.folder.mkdir(parents=True, exist_ok=True)
    with contextlib.redirect_stdout(io.StringIO()):  # what it leaves out is not for this page
        study.jobs(plan)
    return f"{sum(job.cost for job in plan.jobs) / 3600:.2g}"


def plain(html):
    return re.sub(r"\s+", " ", re.sub("<[^>]*>", "", html)).replace("|", "\\|")


def numbers(results, name):
    """How many counted numbers its record has."""
    return len(counted.read(results, name)) if name in counted.kinds(results) else 0


def artifact(studies, sections, results, out):
    """Markdown. sections: as page() takes them, numbered; results: folder of the records; out: of the page."""
    lines = ["# Artifact appendix", "", "Each command runs in the root of the repository, after `scripts/setup` and the build of the README."]
    lines += ["`scripts/reproduce --full` runs nearly all. Values are in the tables and figures themselves, by the links.", ""]
    lines += ["| table or figure | command | hours on one core, as stated | expected | band |", "|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        for name, _, parts in sections:
            study = studies[name]
            count = numbers(results, name)
            beside = out.parent in (results, results.parent)  # else the page may be moved without them
            link = f"[record]({os.path.relpath(results / f'{name}.json', out)})" if beside else f"record {name}.json"
            expected = f"{count:,} counted numbers of the {link}" if count else "the table or figure"
            own = name == "reduced" and not (results / "reduced.json").exists()  # runs of a user
            command, cost = ("in its caption", "") if own else (f"`scripts/suite run {name}`", hours(study, folder))
            for block in blocks(parts):
                band = "; ".join(dict.fromkeys(BANDS[kind] for kind in block.kinds))
                title = f"[{block.label}](index.html#{block.anchor}) {plain(block.title)}"
                lines.append(f"| {title} | {command} | {cost} | {expected} | {band} |")
    return "\n".join(lines) + "\n"
