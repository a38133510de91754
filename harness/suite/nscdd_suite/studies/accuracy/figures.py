"""Figures and tables of speed against error: work-precision curves, performance profiles, CPU times beside those of Siconos at equal error."""
import math
import re
from html import escape

import numpy as np

from ...page import tables
from ...page.style import SUBDOMAINS, plt
from ...measure import SICONOS
from .levels import at_level, points, solvers

DRAWN = ("NLGS", "NLGS, auto", "NSCDD 32, n_GS 1", "NSCDD 32, auto", "SPG", "APGD", "Newton", SICONOS)  # in the figures
ALL_AT = 1e-4  # eta of the table of all solvers
LEVELS = (1e-2, 1e-4, 1e-6)  # of the table
DISTANCES = (1e-3, 1e-4, 1e-6)
VIEWS = (
    ("cpu", "eta", "CPU time of the solver [s]", "\u03b7"),
    ("cpu", "distance", "CPU time of the solver [s]", "distance of the velocities"),
    ("sweeps", "eta", "sweeps", "\u03b7"),
    ("sweeps", "distance", "sweeps", "distance of the velocities"),
)


def look(solver):
    """Colour by method and number of subdomains; dashes by n_GS; other variants, "NLGS, relaxation 1.5", by dots and a mark."""
    name, _, variant = solver.partition(", ")
    nscdd = re.match(r"NSCDD (\d+)", name)
    fixed = {"NLGS": ("#222222", ""), "SPG": (SUBDOMAINS[4], "^"), "APGD": (SUBDOMAINS[7], "v"), "Newton": (SUBDOMAINS[5], "s"), SICONOS: (SUBDOMAINS[3], "o")}
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
    return [solver for solver in shown if points([row for row in record["runs"] if row["solver"] == solver], error, cost)]


def draw_curves(record, shown, cost, error, cost_label, error_label):
    """A panel for each scene, a curve for each solver shown; an open circle where it stalled."""
    scenes = record["scenes"]
    columns = min(4, len(scenes))
    figure, axes = plt.subplots(-(-len(scenes) // columns), columns, squeeze=False, figsize=(2.35 * columns + 1.6, 2.7 * -(-len(scenes) // columns)))
    handles = {}
    for axis, scene in zip(axes.flat, scenes):
        own = [row for row in record["runs"] if row["scene"] == scene["name"]]
        for solver in shown:
            rows = [row for row in own if row["solver"] == solver]
            curve = points(rows, error, cost)
            if not curve:
                continue
            (handles[solver],) = axis.plot(*zip(*curve), **look(solver))
            stalled = points([row for row in rows if not row["converged"]], error, cost)
            axis.plot(*(zip(*stalled) if stalled else ([], [])), "o", color=look(solver)["color"], markerfacecolor="none", markersize=7)
        axis.set(xscale="log", yscale="log")
        axis.invert_xaxis()
        axis.set_title(scene["name"])
    for axis in list(axes.flat)[len(scenes) :]:
        axis.set_axis_off()
    figure.supxlabel(error_label, fontsize=11)
    figure.supylabel(f"{cost_label}, {'measured' if cost == 'cpu' else 'counted'}", fontsize=11)
    figure.legend(handles.values(), handles.keys(), loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4)
    return figure


def profile(rows, cost):
    """{solver: sorted ratios of its cost to that of the best solver, of the problems it solved}, and the number of problems
    that any solver solved. Rows of one set and tolerance; solvers whose cost is not counted take no part."""
    counted = [row for row in rows if row["converged"] and row[cost] is not None]
    best = {}
    for row in counted:
        best[row["problem"]] = min(best.get(row["problem"], math.inf), row[cost])
    ratios = {
        solver: sorted(row[cost] / best[row["problem"]] if best[row["problem"]] > 0 else 1.0 for row in counted if row["solver"] == solver)
        for solver in solvers(counted)
    }
    return ratios, len(best)


def draw_profiles(record, cost, label):
    """Dolan and More: rows are sets of problems, columns tolerances."""
    filled = complete(record["profiles"])
    sets = list(dict.fromkeys(row["set"] for row in filled))
    levels = sorted({row["tolerance"] for row in filled}, reverse=True)
    figure, axes = plt.subplots(len(sets), len(levels), squeeze=False, figsize=(3.1 * len(levels) + 1.8, 2.7 * len(sets)))
    handles = {}
    for line, group in zip(axes, sets):
        for axis, level in zip(line, levels):
            ratios, count = profile([r for r in filled if r["set"] == group and r["tolerance"] == level], cost)
            for solver, values in ratios.items():
                share = np.arange(1, len(values) + 1) / count
                (handles[solver],) = axis.step(
                    [1, *values, 1e4],
                    [0, *share, share[-1] if len(share) else 0],
                    where="post",
                    **{key: value for key, value in look(solver).items() if "marker" not in key},
                )
            axis.set(xscale="log", xlim=(1, 1e3), ylim=(0, 1.03))
            axis.set_title(f"{'hard cases' if group == 'hard' else 'FCLIB'}, $10^{{{round(math.log10(level))}}}$, {count} problems", fontsize=10)
    figure.supxlabel(f"{label}, {'measured' if cost == 'cpu' else 'counted'}, over that of the best solver", fontsize=11)
    figure.supylabel("share of problems", fontsize=11)
    figure.legend(handles.values(), handles.keys(), loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4)
    return figure


def complete(rows):
    """With a row for each tolerance of each problem and solver: those after a stall, which were not run, not converged."""
    levels = sorted({row["tolerance"] for row in rows}, reverse=True)
    keys = {(row["set"], row["problem"], row["solver"]) for row in rows}
    have = {(row["set"], row["problem"], row["solver"], row["tolerance"]) for row in rows}
    blank = {"iterations": None, "sweeps": None, "cpu": None, "error": None, "converged": False}
    return rows + [
        dict(zip(("set", "problem", "solver"), key)) | {"tolerance": level} | blank for key in sorted(keys) for level in levels if (*key, level) not in have
    ]


def siconos_table(record):
    """CPU seconds at equal eta: NLGS, the fastest of ours, Siconos; None when Siconos took no part."""
    if SICONOS not in solvers(record["runs"]):
        return None
    lines = []
    for scene in record["scenes"]:
        own = [row for row in record["runs"] if row["scene"] == scene["name"]]
        for level in LEVELS:
            cost = {solver: at_level([row for row in own if row["solver"] == solver], level) for solver in solvers(own)}
            theirs, ours = cost.pop(SICONOS, None), {solver: value for solver, value in cost.items() if value is not None}
            best = min(ours, key=ours.get, default=None)

            def ratio(value):
                return tables.number(theirs / value) if theirs and value else tables.NONE

            cells = [escape(scene["name"]), tables.number(level), tables.number(theirs) if theirs else tables.NONE]
            cells += [tables.number(cost["NLGS"]) if cost.get("NLGS") else tables.NONE, ratio(cost.get("NLGS")), escape(best) if best else tables.NONE]
            cells += [tables.number(ours[best]) if best else tables.NONE, ratio(ours.get(best))]
            lines.append(cells)
    head = ["scene | \u03b7 | Siconos NSGS [s] | NLGS [s] | times faster | fastest of ours | [s] | times faster"]
    return tables.table(head, lines, "CPU time at equal error")


def solver_table(record):
    """CPU seconds and sweeps of every solver at one error, a column for each scene."""
    lines = []
    for solver in solvers(record["runs"]):
        cells = [escape(solver)]
        for scene in record["scenes"]:
            own = [row for row in record["runs"] if (row["scene"], row["solver"]) == (scene["name"], solver)]
            seconds, sweeps = at_level(own, ALL_AT), at_level(own, ALL_AT, "sweeps")
            cells.append(
                tables.NONE if seconds is None else tables.number(seconds) + (f"<br><i>{tables.count(round(sweeps))}</i>" if sweeps is not None else "")
            )
        lines.append(cells)
    head = [["solver", *(escape(scene["name"]) for scene in record["scenes"])]]
    return tables.table(head, lines, f"All solvers at \u03b7 = {ALL_AT:g}")


def scene_table(record):
    """What the scenes are, their reference answers, and that CCS makes the iterates of DCS."""
    lines = []
    for scene in record["scenes"]:
        cells = [escape(scene["name"]), escape(scene["shows"]), tables.count(scene["grains"]), tables.count(scene["contacts"])]
        cells += [escape(scene["reference"]["scheme"].upper()), tables.number(scene["reference"]["eta"])]
        cells += [f"{scene['ccs']['iterations_dcs']} / {scene['ccs']['iterations_ccs']}", tables.number(scene["ccs"]["velocity_difference"])]
        lines.append(cells)
    head = ["scene |  | grains | contacts | reference | its \u03b7 | iterations DCS / CCS | their velocities differ by"]
    return tables.table(head, lines, "Scenes of the work-precision curves")


def distance_table(record):
    """How far the answers of NLGS are from the reference at each tolerance."""
    lines = []
    for scene in record["scenes"]:
        cells = [escape(scene["name"])]
        cells += [
            *[
                tables.number(row["distance"]) if row and row["converged"] else tables.NONE
                for row in (
                    next((row for row in record["runs"] if (row["scene"], row["solver"], row["tolerance"]) == (scene["name"], "NLGS", level)), None)
                    for level in DISTANCES
                )
            ]
        ]
        lines.append(cells)
    head = [["scene", *(f"\u03b7 \u2264 {level:g}" for level in DISTANCES)]]
    return tables.table(head, lines, "Distance of NLGS velocities from the reference answer")
