"""Speed against error: the section of the page."""
from html import escape

from ...page import tables
from ...page.page import figure_block, table_block
from ...page.style import save
from . import figures
from .figures import ALL_AT, COSTS, ERRORS, KINDS


def parts(record, source, out):
    yield from (f'<p class="missing">Left out: {escape(line)}.</p>' for line in record["left_out"])
    if record["scenes"]:
        caption = (
            "Scenes of the work-precision curves, one loaded state of each, solved for one step from impulses zero; the reference answer that "
            "distances are measured from, with its own residual; and that CCS makes the iterates of DCS (8 subdomains, to 1e-3), which is why DCS alone "
            "is in the figures."
        )
        yield table_block(figures.scene_table(record), "Scenes of the work-precision curves", caption, source, ("counted",), wide=True)
        for cost in COSTS:
            for error in ERRORS:
                title, caption = f"{COSTS[cost][0].upper()}{COSTS[cost][1:]} against {ERRORS[error]}", curves_caption(record, cost, error)
                figure = figures.draw_curves(record, figures.chosen(record), cost, error)
                yield figure_block(save(figure, out, f"accuracy-{cost}-{error}"), escape(title), caption, source, (KINDS[cost],), wide=True)
        caption = (
            f"CPU seconds, and sweeps beneath, to \u03b7 = {ALL_AT:g}, between the runs on both sides of it; a dash where a solver does not get there or "
            "took no part. NSCDD: the work of all its subdomains. Newton has no sweeps."
        )
        yield table_block(figures.solver_table(record), f"All solvers at \u03b7 = {ALL_AT:g}", caption, source, ("measured", "counted"), wide=True)
        caption = (
            "How far the velocities of plain NLGS are from the reference answer when it stops at each tolerance on \u03b7, in shares of "
            f"{tables.symbols('|V_free|_M')}; a dash where it does not get there."
        )
        yield table_block(figures.distance_table(record), "Distance of NLGS from the reference answer", caption, source)
    if table := figures.siconos_table(record):
        caption = (
            "CPU time of the solvers' calls at equal \u03b7, as our measure judges it for both, interpolated on the curves of the first figure of this "
            "section. Siconos solves the exported problem, with its stored <i>W</i>, by its own default stopping test."
        )
        yield table_block(table, "CPU time beside Siconos at equal error", caption, source, ("measured",), wide=True)
    for cost, label in (("cpu", "CPU time"), ("sweeps", "sweeps")) if record["profiles"] else ():
        caption = (
            f"Performance profiles [DolanMore02] in {label}: the share of problems that a solver solves with at most so many times the cost of the best "
            "solver of that problem. Hard cases: their first step, by \u03b7; FCLIB files: by the natural map as Siconos 4.4 normalises it. Problems that "
            "no solver solves are not counted." + (" Newton has no sweeps." if cost == "sweeps" else "")
        )
        figure = figures.draw_profiles(record, cost, label)
        yield figure_block(save(figure, out, f"accuracy-profile-{cost}"), f"Performance profiles, {label}", caption, source, (KINDS[cost],), wide=True)


def curves_caption(record, cost, error):
    shown = figures.chosen(record)
    drawn = figures.drawn(record, shown, cost, error)
    caption = (
        f"{len(drawn)} of the {len(figures.solvers(record['runs']))} solvers, {escape('; '.join(drawn))}; all are in the table that follows. Better to the "
        f"right and further down; a circle where a solver stalled, within {tables.count(record['budget']['sweeps'])} sweeps. "
    )
    if len(drawn) < len(shown):
        caption += f"{escape(', '.join(solver for solver in shown if solver not in drawn))} cannot be drawn: no such cost or error is recorded. "
    if cost == "cpu":
        caption += "In-process subdomains take turns on one core, so their CPU time is the work of all. "
    if error == "distance":
        caption += (
            f"Distances are {tables.symbols('|V - V_ref|_M / |V_free|_M')}; where one stays while \u03b7 goes on falling, the solver went to another answer, "
            "as velocities need not be unique with friction."
        )
    return caption
