"""Problems of other codes: the section of the page."""
from ...page import tables
from ...page.page import Block, figure_block
from ...page.style import save
from ..accuracy.figures import draw_profiles, profile
from . import LEVELS, OTHERS, OURS, converged

LEAST = 1e-4  # s: shorter times say how warm a process was, so they count as this one
PROFILES = """
Performance profiles [DolanMore02] in CPU time: the share of problems that a solver solves in at most so many times the time of the fastest one. Times \
below {least:g} s count as that. {first} Problems that no solver solves are not counted."""
PROBLEMS = """
CPU seconds to the smallest error, {level:g} on the natural map; a dash where the solver does not get there, or is none for such a problem."""


def at_least(rows):
    return [row | {"set": "fclib", "cpu": row["cpu"] and max(row["cpu"], LEAST)} for row in rows]


def first_on(rows, level, solvers=(*OURS, *OTHERS)):
    """For each of the solvers the share of problems on which it is the fastest of them [%]."""
    ratios, count = profile([row for row in at_least(rows) if row["tolerance"] == level and row["solver"] in solvers], "cpu")
    return {solver: 100 * sum(ratio == 1 for ratio in ratios.get(solver, ())) / count for solver in solvers if count}


def said(rows, level):
    first = ", ".join(f"{solver} on {share:.0f} %" for solver, share in first_on(rows, level).items() if share)
    said = f"At {level:g} first are {first}."
    if any(row["solver"] in OTHERS for row in rows):  # our other solvers left out
        said += f" Beside other codes alone auto is first on {first_on(rows, level, ('auto', *OTHERS)).get('auto', 0):.0f} %."
    return said


def parts(record, source, out):
    rows = record["rows"]
    file = save(draw_profiles({"profiles": at_least(rows)}, "cpu", "CPU time"), out, "problems-profile")
    caption = PROFILES.format(least=LEAST, first=" ".join(said(rows, level) for level in LEVELS))
    yield figure_block(file, "Performance profiles on problems of other codes", caption, source, ("measured",), wide=True)
    solvers, least = [name for name in (*OURS, *OTHERS) if any(row["solver"] == name for row in rows)], min(LEVELS)
    lines = []
    for problem in dict.fromkeys(row["problem"] for row in rows):
        own = [row for row in rows if row["problem"] == problem]
        seconds = {row["solver"]: row["cpu"] for row in own if converged(row, row["solver"], least)}
        lines.append([problem, own[0]["dimension"], own[0]["contacts"], *(seconds.get(solver) for solver in solvers)])
    caption = PROBLEMS.format(level=least)
    yield Block(
        tables.table([["problem", "dimension", "contacts", *solvers]], lines, "Problems of other codes"),
        "Problems of other codes",
        caption,
        source,
        ("measured",),
        wide=True,
    )
