"""Figures and tables of speed against error: work-precision curves, performance profiles, CPU times beside those of Siconos at equal error."""
import math
import re
from html import escape

import numpy as np

from ...page import tables
from ...page.style import SUBDOMAINS, plt
from ...measure import SICONOS
from .levels import at_level, costs, of, points, solvers

DRAWN = ("NLGS", "NLGS, auto", "NSCDD 32, n_GS 1", "NSCDD 32, auto", "SPG", "APGD", "Newton", SICONOS)  # in the figures
ALL_AT = 1e-4  # eta of the table of all solvers
LEVELS = (1e-2, 1e-4, 1e-6)  # of the table
DISTANCES = (1e-3, 1e-4, 1e-6)
KINDS = {"cpu": "measured", "sweeps": "counted"}
COSTS = {"cpu": "CPU time of the solver [s]", "sweeps": "sweeps"}
ERRORS = {"eta": "\u03b7", "distance": "distance of the velocities"}


def look(solver):
    """Colour by method and number of subdomains; dashes by n_GS; other variants, "NLGS, relaxation 1.5", by dots and a mark."""
    name, _, variant = solver.partition(", ")
    nscdd = re.match(r"NSCDD (\d+)", name)
    fixed = {"NLGS": ("#222222", ""), "SPG": (SUBDOMAINS[4], "^"), "APGD": (SUBDOMAINS[7], "v"), "Newton": (SUBDOMAINS[5], "s"), SICONOS: (SUBDOMAINS[3], "o")}
    fixed |= {"auto": (SUBDOMAINS[0], ""), "Siconos ADMM": (SUBDOMAINS[1], ""), "Siconos NSN_AC": (SUBDOMAINS[6], "")}  # of the study `problems`
    colour, marker = (SUBDOMAINS[min(int(math.log2(int(nscdd[1]))) // 2, 2)], "") if nscdd else fixed.get(name, (SUBDOMAINS[6], "d"))
    line = {"": "-", "n_GS 1": "-", "n_GS 2": "--", "n_GS 5": ":"}.get(variant)
    if line is None:
        line, marker = "-.", "x+1234*"[sum(map(ord, variant)) % 7]
    return {"color": colour, "linestyle": line, "marker": marker, "markersize": 3.5 if marker not in "x+1234*" else 5, "linewidth": 1.0 if nscdd else 1.6}


def chosen(record):
    """The solvers that are drawn, at most eight: each method once, NSCDD on 32 subdomains plain and accelerated; the first eight
    where none of these took part."""
    present = solvers(record["runs"])
    return [solver for solver in DRAWN if solver in present] or present[:8]


def drawn(record, shown, cost, error):
    """Those of them that have a point: Newton counts no sweeps."""
    return [solver for solver in shown if points(of(record["runs"], solver=solver), error, cost)]


def panels(rows, columns, size):
    """A figure, its axes, and what ends it: labels at the edges, and the legend of its handles."""
    figure, axes = plt.subplots(rows, columns, squeeze=False, figsize=size)

    def finish(x, y, handles):
        figure.supxlabel(x, fontsize=11)
        figure.supylabel(y, fontsize=11)
        figure.legend(handles.values(), handles.keys(), loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4)
        return figure

    return axes, finish


def draw_curves(record, shown, cost, error):
    """A panel for each scene, a curve for each solver shown; an open circle where it stalled."""
    columns, handles = min(4, len(record["scenes"])), {}
    lines = -(-len(record["scenes"]) // columns)
    axes, finish = panels(lines, columns, (2.35 * columns + 1.6, 2.7 * lines))
    for axis in axes.flat[len(record["scenes"]) :]:
        axis.set_axis_off()
    for axis, scene in zip(axes.flat, record["scenes"]):
        for solver in shown:
            rows = of(record["runs"], scene=scene["name"], solver=solver)
            if not points(rows, error, cost):
                continue
            (handles[solver],) = axis.plot(*zip(*points(rows, error, cost)), **look(solver))
            stalled = points(of(rows, converged=False), error, cost)
            axis.plot(*(zip(*stalled) if stalled else ([], [])), "o", color=look(solver)["color"], markerfacecolor="none", markersize=7)
        axis.set(xscale="log", yscale="log", title=scene["name"])
        axis.invert_xaxis()
    return finish(ERRORS[error], f"{COSTS[cost]}, {KINDS[cost]}", handles)


def profile(rows, cost):
    """{solver: sorted ratios of its cost to that of the best solver, of the problems it solved}, and the number of problems
    that any solver solved. Rows of one set and tolerance; solvers whose cost is not counted take no part."""
    counted, best = [row for row in rows if row["converged"] and row[cost] is not None], {}
    for row in counted:
        best[row["problem"]] = min(best.get(row["problem"], math.inf), row[cost])
    ratios = {
        solver: sorted(row[cost] / best[row["problem"]] if best[row["problem"]] > 0 else 1.0 for row in of(counted, solver=solver))
        for solver in solvers(counted)
    }
    return ratios, len(best)


def draw_profiles(record, cost, label):
    """Dolan and More: rows are sets of problems, columns tolerances. What was not run, after a stall, is not converged."""
    sets = list(dict.fromkeys(row["set"] for row in record["profiles"]))
    levels = sorted({row["tolerance"] for row in record["profiles"]}, reverse=True)
    axes, finish = panels(len(sets), len(levels), (3.1 * len(levels) + 1.8, 2.7 * len(sets)))
    handles = {}
    for line, group in zip(axes, sets):
        for axis, level in zip(line, levels):
            ratios, count = profile(of(record["profiles"], set=group, tolerance=level), cost)
            for solver, values in ratios.items():
                share = np.arange(1, len(values) + 1) / count
                style = {key: value for key, value in look(solver).items() if "marker" not in key}
                (handles[solver],) = axis.step([1, *values, 1e4], [0, *share, share[-1]], where="post", **style)
            axis.set(xscale="log", xlim=(1, 1e3), ylim=(0, 1.03))
            axis.set_title(f"{'hard cases' if group == 'hard' else 'FCLIB'}, $10^{{{round(math.log10(level))}}}$, {count} problems", fontsize=10)
    return finish(f"{label}, {KINDS[cost]}, over that of the best solver", "share of problems", handles)


def siconos_table(record):
    """CPU seconds at equal eta: NLGS, the fastest of ours, Siconos; None when Siconos took no part."""
    if SICONOS not in solvers(record["runs"]):
        return None
    lines = []
    for scene in record["scenes"]:
        own = of(record["runs"], scene=scene["name"])
        for level in LEVELS:
            cost = costs(own, level)
            theirs, ours = cost.pop(SICONOS, None), {solver: value for solver, value in cost.items() if value is not None}
            best = min(ours, key=ours.get, default=None)
            pairs = [cell for one in ("NLGS", best) for cell in (ours.get(one), theirs / ours[one] if theirs and one in ours else None)]
            lines.append([escape(scene["name"]), level, theirs, *pairs[:2], best and escape(best), *pairs[2:]])
    head = ["scene | \u03b7 | Siconos NSGS [s] | NLGS [s] | times faster | fastest of ours | [s] | times faster"]
    return tables.table(head, lines, "CPU time at equal error")


def solver_table(record):
    """CPU seconds and sweeps of every solver at one error, a column for each scene."""

    def cell(**of_whom):
        own = of(record["runs"], **of_whom)
        seconds, sweeps = at_level(own, ALL_AT), at_level(own, ALL_AT, "sweeps")
        return tables.shown(seconds) + (f"<br><i>{tables.count(round(sweeps))}</i>" if seconds is not None and sweeps is not None else "")

    names = [scene["name"] for scene in record["scenes"]]
    lines = [[escape(solver), *(cell(solver=solver, scene=name) for name in names)] for solver in solvers(record["runs"])]
    return tables.table([["solver", *map(escape, names)]], lines, f"All solvers at \u03b7 = {ALL_AT:g}")


def scene_table(record):
    """What the scenes are, their reference answers, and that CCS makes the iterates of DCS."""
    lines = []
    for scene in record["scenes"]:
        reference, ccs = scene["reference"], scene["ccs"]
        cells = [escape(scene["name"]), escape(scene["shows"]), scene["grains"], scene["contacts"], escape(reference["scheme"].upper()), reference["eta"]]
        lines.append([*cells, f"{ccs['iterations_dcs']} / {ccs['iterations_ccs']}", ccs["velocity_difference"]])
    head = ["scene |  | grains | contacts | reference | its \u03b7 | iterations DCS / CCS | their velocities differ by"]
    return tables.table(head, lines, "Scenes of the work-precision curves")


def distance_table(record):
    """How far the answers of NLGS are from the reference at each tolerance."""
    found = {(row["scene"], row["tolerance"]): row["distance"] for row in of(record["runs"], solver="NLGS", converged=True)}
    lines = [[escape(scene["name"]), *(found.get((scene["name"], level)) for level in DISTANCES)] for scene in record["scenes"]]
    return tables.table([["scene", *(f"\u03b7 \u2264 {level:g}" for level in DISTANCES)]], lines, "Distance of NLGS velocities from the reference answer")
