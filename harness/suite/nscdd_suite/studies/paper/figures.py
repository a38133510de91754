"""Figs. 3 and 4 of the paper, and the same axes for what the paper does not have: other partitions, acceleration, a cluster."""
import numpy as np

from .data import FAMILIES, Paper, total
from ...page.style import NLGS, SCHEMES, SUBDOMAINS, apart, ideal, plt, subdomain_ticks

PLATFORMS = {"node48": "node of 48 cores", "cluster": "cluster of 128 nodes of 8"}
METHODS = {"paper": ("paper's method", "-"), "auto": ("accelerated", "--"), "predicted": ("paper's method, predicted interface", ":")}
COLOUR = dict(zip(FAMILIES, (SUBDOMAINS[0], SUBDOMAINS[1], SUBDOMAINS[2])))
MARK = {
    "grid": {"marker": "o", "markersize": 3.5},
    "bisection": {"marker": "s", "markersize": 7, "markerfacecolor": "none"},
    "metis": {"marker": "^", "markersize": 4.5},
}
PREDICTED = {"marker": "x", "markersize": 7}


def chosen_counts(runs):
    """{subdomains: run}, of several splittings the one that shares fewest grains."""
    found = {}
    for run in sorted(runs, key=lambda run: (run["subdomains"], run["interface_grains"])):
        found.setdefault(run["subdomains"], run)
    return found


def ticks(axis, numbers):
    """Those of a logarithmic axis that are far enough apart to be read."""
    kept, most = [], max(numbers)
    for n in sorted(numbers, reverse=True):
        if not kept or kept[-1] / n >= max(1.3, (most / min(numbers)) ** 0.11):
            kept.append(n)
    subdomain_ticks(axis, kept[::-1])


def iterations(run, mean):
    return total(run) / run["steps"] if mean else total(run)


def speed_up_panel(axis, paper, scene):
    """Simulated points of CCS and DCS with their bands; whether there are any."""
    curves = {scheme: paper.curve(scene, "paper", scheme, "grid") for scheme in SCHEMES}
    numbers = sorted({n for curve in curves.values() for n in curve})
    axis.set_title("(a) speed-up, SIMULATED")
    if not numbers:
        axis.text(0.5, 0.5, "not in these results", ha="center", transform=axis.transAxes, color=NLGS)
        axis.set_axis_off()
        return False
    ideal(axis, numbers[-1])
    for scheme, (label, colour, marker) in SCHEMES.items():
        if not curves[scheme]:
            continue
        n, points = zip(*sorted(curves[scheme].items()))
        axis.fill_between(n, [p.low for p in points], [p.high for p in points], color=colour, alpha=0.18, linewidth=0)
        axis.plot(n, [p.speed_up for p in points], marker=marker, color=colour, label=label, markersize=5)
        every = [p for p in paper.points(scene, "paper", scheme, "grid") if p.speed_up is not None]
        axis.plot([p.n for p in every], [p.speed_up for p in every], marker, color=colour, markersize=3, markerfacecolor="none")
    ticks(axis, [1, *numbers])
    axis.set(xlabel="processes", ylabel="speed-up over NLGS, SIMULATED", ylim=(0, None))
    axis.legend(loc="upper left")
    return True


def iteration_panel(axis, paper, scene, mean):
    """Counts of every splitting; a line through those that share fewest grains. CCS as open squares around the points of DCS."""
    axis.set_title(f"(b) {'mean' if mean else 'total'} iterations, counted")
    numbers = set()
    for scheme, (label, colour, marker) in SCHEMES.items():
        runs = paper.runs(scene, "paper", scheme, "grid")
        if not runs:
            continue
        numbers |= {run["subdomains"] for run in runs}
        line = chosen_counts(runs)
        size = 9 if scheme == "ccs" else 5
        axis.plot(list(line), [iterations(run, mean) for run in line.values()], color=colour, linewidth=1.2, label=f"{label}, fewest shared grains")
        axis.plot(
            [run["subdomains"] for run in runs],
            [iterations(run, mean) for run in runs],
            marker,
            color=colour,
            markersize=size,
            markerfacecolor="none" if scheme == "ccs" else colour,
            label=f"{label}, each splitting",
        )
    if not numbers:
        axis.text(0.5, 0.5, "not in these results", ha="center", transform=axis.transAxes, color=NLGS)
        axis.set_axis_off()
        return False
    if paper.nlgs(scene):
        axis.axhline(iterations(paper.nlgs(scene), mean), linestyle="--", linewidth=1, color=NLGS, label="sequential NLGS")
    ticks(axis, numbers)
    axis.set(xlabel="subdomains", ylabel=f"{'mean' if mean else 'total'} iterations, counted", ylim=(0, 1.3 * axis.dataLim.y1))
    axis.yaxis.set_major_formatter(lambda y, _: f"{y:,.0f}".replace(",", "\u00a0"))
    axis.legend(loc="lower right", fontsize=9)
    return True


def measured_panel(axis, paper, scene):
    """Real ranks on real cores, each repeat a small point where it has seconds of its own."""
    axis.set_title("(c) speed-up, measured")
    rows = [(row, speed_up) for row, speed_up in paper.measured(scene) if speed_up and row["method"] == "paper"]
    if not rows:
        axis.text(0.5, 0.5, "not in these results", ha="center", transform=axis.transAxes, color=NLGS)
        axis.set_axis_off()
        return False
    most = max(2, *(row["ranks"] for row, _ in rows))
    ideal(axis, most)
    for scheme, (label, colour, marker) in {"nlgs": ("NLGS", NLGS, "D"), **SCHEMES}.items():
        own = sorted((row["ranks"], speed_up) for row, speed_up in rows if row["scheme"] == scheme)
        if own:
            axis.plot(
                *zip(*own), marker, color=colour, label=label, markersize=8 if scheme == "ccs" else 5, markerfacecolor="none" if scheme == "ccs" else colour
            )
    ticks(axis, sorted({1, 2, *(row["ranks"] for row, _ in rows)}))
    axis.set(xlabel="real ranks", ylabel="speed-up over NLGS, measured", ylim=(0, 1.1 * most), xlim=(0.85, 1.2 * most))
    axis.legend(loc="upper left")
    return True


def draw_scene(paper, scene, mean):
    """Fig. 3 or 4: simulated, counted and measured each in a panel of its own; None if there is none."""
    figure, axes = plt.subplots(1, 3, figsize=(10.6, 3.5), width_ratios=(1.15, 1.25, 0.8))
    drawn = (speed_up_panel(axes[0], paper, scene), iteration_panel(axes[1], paper, scene, mean), measured_panel(axes[2], paper, scene))
    if any(drawn):
        return apart(figure), drawn
    plt.close(figure)
    return None, drawn


def beyond(paper, scene, platform):
    """{(partition family, method): {n: point}} of DCS, all over plain sequential NLGS."""
    curves = {(of, method): paper.curve(scene, method, "dcs", of, platform) for of in FAMILIES for method in ("paper", "auto")}
    curves["grid", "predicted"] = Paper(paper.record, "predicted").curve(scene, "paper", "dcs", "grid", platform)
    return {key: curve for key, curve in curves.items() if curve}


def draw_beyond(paper, scene):
    """Speed-up on each platform, and iterations: a colour for each partition, dashes for the accelerated method, dots for the predicted interface; None if there is
    nothing but the grid by the paper's method, which is in the figures before."""
    platforms = {platform: curves for platform in PLATFORMS if (curves := beyond(paper, scene, platform))}
    counts = {(of, method): chosen_counts(paper.runs(scene, method, "dcs", of)) for of in FAMILIES for method in ("paper", "auto")}
    counts["grid", "predicted"] = chosen_counts(Paper(paper.record, "predicted").runs(scene, "paper", "dcs", "grid"))
    counts = {key: runs for key, runs in counts.items() if runs}
    if not any(key != ("grid", "paper") for curves in (*platforms.values(), counts) for key in curves) and "cluster" not in platforms:
        return None
    figure, axes = plt.subplots(1, len(platforms) + 1, figsize=(3.5 * (len(platforms) + 1), 3.6), squeeze=False)
    handles = {}
    for axis, (platform, curves) in zip(axes[0], platforms.items()):
        numbers = sorted({n for curve in curves.values() for n in curve})
        handles["ideal"] = ideal(axis, numbers[-1], ":")
        for (of, method), curve in curves.items():
            n, points = zip(*sorted(curve.items()))
            axis.fill_between(n, [p.low for p in points], [p.high for p in points], color=COLOUR[of], alpha=0.15, linewidth=0)
            (handles[f"{of}, {METHODS[method][0]}"],) = axis.plot(
                n, [p.speed_up for p in points], METHODS[method][1], color=COLOUR[of], **(PREDICTED if method == "predicted" else MARK[of])
            )
        axis.set_yscale("log", base=2)
        axis.yaxis.set_major_formatter(lambda y, _: f"{y:g}")
        ticks(axis, [1, *numbers])
        axis.set(xlabel="processes", ylabel="speed-up over NLGS, SIMULATED")
        axis.set_title(f"{PLATFORMS[platform]}, SIMULATED")
    axis = axes[0][-1]
    for (of, method), runs in counts.items():
        (handles[f"{of}, {METHODS[method][0]}"],) = axis.plot(
            list(runs),
            [iterations(run, True) for run in runs.values()],
            METHODS[method][1],
            color=COLOUR[of],
            **(PREDICTED if method == "predicted" else MARK[of]),
        )
    if counts:
        ticks(axis, {n for runs in counts.values() for n in runs})
        axis.set(xlabel="subdomains", ylabel="mean iterations, counted", ylim=(0, 1.1 * np.max([axis.dataLim.y1, 1e-9])))
    else:
        axis.set_axis_off()
    axis.set_title("iterations, counted")
    figure.legend(handles.values(), handles.keys(), loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4)
    return apart(figure)
