"""The hard cases: scenes with exact answers (cases/hard), by NLGS and NSCDD, both accelerated, and by Newton: expected, found and error.

A row that is out of its bound, which comes from theory, is a failure. Quick: without what takes long and most of what repeats another case at
another size. Only: what matches, e.g. 'column-100-2d nlgs'.
"""
import re
from pathlib import Path

from ...study import Study
from .case import SCHEMES, Case

# What a scheme is not run on, and why.
LEFT_OUT = {
    "newton": {
        r"coincident": "refused before anything is solved",
        r"settled": "10,000 steps take longer than all its other cases",
        r"squeeze-slow": "impulses grow from step to step until the round-off of its factorisations makes the crystal buckle",
    }
}
# Left out by --quick, by "case scheme".
LONG = (
    r"-1000-|mass-1e[246]|radius-100|crystal-close-3d|settled|large-step-3d|bounce-1024|squeeze-slow-3d|"
    r"cradle-([2346789]-|.*-[01]-2d|10-[01]-)|restitution-[01]-2d|spin-free-2d|oblique-0-.*-2d|"
    r"order-(impact|packing|sliding-2d)|gas-2d|clump-2d|"
    r"pair-(?!1e5-0.5-3d (.*-auto|newton))|heap-(?!10-16-0.5-3d)|rebound-(?!column-0.5-3d|gas-1-3d)"
)
# Seconds of a case on one core, about: only for the time left.
COST = {
    **{r"heap-100": 2.1, r"heap": 0.16, r"pair-1e6": 3.2, r"pair-3e5": 1.7, r"pair-1e5": 0.4, r"pair": 0.1, r"rebound-pair": 0.64, r"rebound": 0.15},
    **{r"lid-1000": 2.7, r"squeeze-slow": 6, r"column-1000": 1.7, r"mass-1e6": 0.7, r"settled": 1.3, r"order": 0.2},
}
USUAL_COST = 0.03


class Hard(Study):
    name, title, about = "hard", "Hard cases", "scenes with exact answers, each by five schemes, held against bounds from theory"

    def jobs(self, plan):
        for path in sorted(Path("cases/hard").glob("*.toml")):
            cost = next((cost for pattern, cost in COST.items() if re.match(pattern, path.stem)), USUAL_COST)
            for scheme in SCHEMES:
                title, unfit = f"{path.stem} {scheme}", any(re.match(pattern, path.stem) for pattern in LEFT_OUT.get(scheme, ()))
                if not unfit and not (plan.quick and re.search(LONG, title)):
                    plan.rows(title, judged, path, scheme, plan, cost=cost, small=True)

    def rows(self, plan):
        rows = [row for job in plan.jobs for row in plan.made(job.title)]
        return {"rows": rows} if rows else {}

    def told(self, data):
        for row in data["rows"]:
            if not row["ok"]:
                why = row.get("note") or f"expected {row['relation']} {row['expected']:.6g}, found {row['found']}, error {row['error']} > {row['bound']:.3g}"
                yield f"OUT OF BOUNDS: {row['case']} {row['scheme']}: {row['quantity']}: {why}"
        yield f"{sum(row['ok'] for row in data['rows'])} of {len(data['rows'])} rows are within their bounds"

    def passes(self, data):
        return all(row["ok"] for row in data["rows"])


def judged(path, scheme, plan):
    return Case(path, scheme, plan.folder, plan.quick).rows()
