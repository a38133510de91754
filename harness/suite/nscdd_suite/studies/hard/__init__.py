"""The hard cases: scenes with exact answers (cases/hard), by NLGS and NSCDD, both accelerated, and by Newton: expected, found and error.

A row that is out of its bound, which comes from theory, is a failure. Quick: without what takes long and most of what repeats another case at
another size. Only: what matches, e.g. 'column-100-2d nlgs'.
"""
import re
from pathlib import Path

from ...record import beside
from ...study import Study
from .case import SCHEMES, Case

CASES = beside(__file__, "cases.toml")


class Hard(Study):
    name, title, about = "hard", "Hard cases", "scenes with exact answers, each by five schemes, held against bounds from theory"

    def jobs(self, plan):
        for path in sorted(Path("cases/hard").glob("*.toml")):
            cost = next(seconds for pattern, seconds in CASES["seconds"].items() if re.match(pattern, path.stem))
            for scheme in SCHEMES:
                title, unfit = f"{path.stem} {scheme}", any(re.match(pattern, path.stem) for pattern in CASES["left_out"].get(scheme, ()))
                if not unfit and not (plan.quick and re.search("|".join(CASES["quick_without"]), title)):
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
