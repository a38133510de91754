"""Speed against error: the section of the page."""
from html import escape

from ...page import tables
from ...page.page import Block, captions, figure_block
from ...page.style import save
from . import figures
from .figures import ALL_AT, COSTS, ERRORS, KINDS

CAPTIONS = captions(__file__)


def curves_caption(record, cost, error):
    shown, of = figures.chosen(record), len(figures.solvers(record["runs"]))
    drawn = figures.drawn(record, shown, cost, error)
    others = [solver for solver in shown if solver not in drawn]
    sweeps = tables.count(record["budget"]["sweeps"])
    return (
        CAPTIONS["curves"].format(drawn=len(drawn), of=of, names=escape("; ".join(drawn)), sweeps=sweeps)
        + (CAPTIONS["not_drawn"].format(names=escape(", ".join(others))) if others else "")
        + (CAPTIONS["cpu"] if cost == "cpu" else "")
        + (CAPTIONS["distance"].format(distance=tables.symbols("|V - V_ref|_M / |V_free|_M")) if error == "distance" else "")
    )


def parts(record, source, out):
    if record["scenes"]:
        yield Block(figures.scene_table(record), "Scenes of the work-precision curves", CAPTIONS["scenes"], source, ("counted",), wide=True)
        for cost in COSTS:
            for error in ERRORS:
                title, caption = f"{COSTS[cost][0].upper()}{COSTS[cost][1:]} against {ERRORS[error]}", curves_caption(record, cost, error)
                file = save(figures.draw_curves(record, figures.chosen(record), cost, error), out, f"accuracy-{cost}-{error}")
                yield figure_block(file, escape(title), caption, source, (KINDS[cost],), wide=True)
        title, caption = f"All solvers at \u03b7 = {ALL_AT:g}", CAPTIONS["solvers"].format(level=ALL_AT)
        yield Block(figures.solver_table(record), title, caption, source, ("measured", "counted"), wide=True)
        caption = CAPTIONS["distances"].format(norm=tables.symbols("|V_free|_M"))
        yield Block(figures.distance_table(record), "Distance of NLGS from the reference answer", caption, source)
    if table := figures.siconos_table(record):
        yield Block(table, "CPU time beside Siconos at equal error", CAPTIONS["siconos"], source, ("measured",), wide=True)
    for cost, label in (("cpu", "CPU time"), ("sweeps", "sweeps")) if record["profiles"] else ():
        caption = CAPTIONS["profiles"].format(cost=label) + (" Newton has no sweeps." if cost == "sweeps" else "")
        file = save(figures.draw_profiles(record, cost, label), out, f"accuracy-profile-{cost}")
        yield figure_block(file, f"Performance profiles, {label}", caption, source, (KINDS[cost],), wide=True)
