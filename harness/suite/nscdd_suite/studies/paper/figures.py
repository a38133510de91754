"""Figs. 3 and 4 of the paper, and the same axes for what the paper does not have: other partitions, acceleration, a cluster."""
from ...page.style import NLGS, SCHEMES, SUBDOMAINS, apart, blank, ideal, plt, subdomain_ticks
from .data import FAMILIES, total

PLATFORMS = {"node48": "node of 48 cores", "cluster": "cluster of 128 nodes of 8"}
METHODS = {"paper": ("paper's method", "-"), "auto": ("accelerated", "--"), "predicted": ("paper's method, predicted interface", ":")}
COLOUR = dict(zip(FAMILIES, SUBDOMAINS))
MARK = {
    "grid": {"marker": "o", "markersize": 3.5},
    "bisection": {"marker": "s", "markersize": 7, "markerfacecolor": "none"},
    "metis": {"marker": "^", "markersize": 4.5},
    "predicted": {"marker": "x", "markersize": 7},
}


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


def marks(scheme, colour):
    """CCS as open squares around the points of DCS."""
    return {"color": colour, "markersize": 5, "markerfacecolor": colour} | ({"markersize": 9, "markerfacecolor": "none"} if scheme == "ccs" else {})


def plot_curve(axis, curve, band, *marker, **how):
    """Speed-ups of {subdomains: point} with their bands; returns the line."""
    n, points = zip(*sorted(curve.items()))
    axis.fill_between(n, [p.low for p in points], [p.high for p in points], color=how["color"], alpha=band, linewidth=0)
    return axis.plot(n, [p.speed_up for p in points], *marker, **how)[0]


def speed_up_panel(axis, paper, scene):
    """Simulated points of CCS and DCS with their bands; whether there are any."""
    axis.set_title("(a) speed-up, SIMULATED")
    curves = {scheme: paper.curve(scene, "paper", scheme, "grid") for scheme in SCHEMES}
    numbers = sorted({n for curve in curves.values() for n in curve})
    if not numbers:
        return blank(axis, "not in these results")
    ideal(axis, numbers[-1])
    for scheme, (label, colour, marker) in SCHEMES.items():
        if curves[scheme]:
            plot_curve(axis, curves[scheme], 0.18, marker=marker, color=colour, label=label, markersize=5)
            every = [p for p in paper.points(scene, "paper", scheme, "grid") if p.speed_up is not None]
            axis.plot([p.n for p in every], [p.speed_up for p in every], marker, color=colour, markersize=3, markerfacecolor="none")
    ticks(axis, [1, *numbers])
    axis.set(xlabel="processes", ylabel="speed-up over NLGS, SIMULATED", ylim=(0, None))
    axis.legend(loc="upper left")
    return "simulated"


def iteration_panel(axis, paper, scene, mean):
    """Counts of every splitting; a line through those that share fewest grains."""
    what = f"{'mean' if mean else 'total'} iterations, counted"
    axis.set_title(f"(b) {what}")
    numbers = set()
    for scheme, (label, colour, marker) in SCHEMES.items():
        if runs := paper.runs(scene, "paper", scheme, "grid"):
            numbers |= {run["subdomains"] for run in runs}
            line = chosen_counts(runs)
            axis.plot(list(line), [iterations(run, mean) for run in line.values()], color=colour, linewidth=1.2, label=f"{label}, fewest shared grains")
            points = [run["subdomains"] for run in runs], [iterations(run, mean) for run in runs]
            axis.plot(*points, marker, label=f"{label}, each splitting", **marks(scheme, colour))
    if not numbers:
        return blank(axis, "not in these results")
    if paper.nlgs(scene):
        axis.axhline(iterations(paper.nlgs(scene), mean), linestyle="--", linewidth=1, color=NLGS, label="sequential NLGS")
    ticks(axis, numbers)
    axis.set(xlabel="subdomains", ylabel=what, ylim=(0, 1.3 * axis.dataLim.y1))
    axis.yaxis.set_major_formatter(lambda y, _: f"{y:,.0f}".replace(",", "\u00a0"))
    axis.legend(loc="lower right", fontsize=9)
    return "counted"


def draw_scene(paper, scene, mean):
    """Fig. 3 or 4: simulated and counted, a panel each; None if there is neither. And which of them there are."""
    figure, axes = plt.subplots(1, 2, figsize=(8.4, 3.5))
    drawn = (speed_up_panel(axes[0], paper, scene), iteration_panel(axes[1], paper, scene, mean))
    if any(drawn):
        return apart(figure), tuple(filter(None, drawn))
    plt.close(figure)
    return None, ()


def views(paper):
    """(partition family, method, which runs, the method as they name it) of all that is drawn beyond the paper."""
    return [*((of, method, paper, method) for of in FAMILIES for method in ("paper", "auto")), ("grid", "predicted", paper.predicted, "paper")]


def look(of, method):
    return {"linestyle": METHODS[method][1], "color": COLOUR[of], **MARK["predicted" if method == "predicted" else of]}


def draw_beyond(paper, scene):
    """Speed-up of DCS on each platform, and iterations: a colour for each partition, dashes for the accelerated method, dots for the predicted
    interface. None if there is nothing but the grid by the paper's method, which is in the figures before."""

    def there(of_view):
        return {(of, method): found for of, method, view, name in views(paper) if (found := of_view(view, name, of))}

    platforms = {platform: there(lambda view, name, of: view.curve(scene, name, "dcs", of, platform)) for platform in PLATFORMS}
    platforms = {platform: curves for platform, curves in platforms.items() if curves}
    counts = there(lambda view, name, of: chosen_counts(view.runs(scene, name, "dcs", of)))
    if not any(key != ("grid", "paper") for curves in (*platforms.values(), counts) for key in curves) and "cluster" not in platforms:
        return None
    figure, axes = plt.subplots(1, len(platforms) + 1, figsize=(3.5 * (len(platforms) + 1), 3.6), squeeze=False)
    handles = {}
    for axis, (platform, curves) in zip(axes[0], platforms.items()):
        numbers = sorted({n for curve in curves.values() for n in curve})
        handles["ideal"] = ideal(axis, numbers[-1], ":")
        for (of, method), curve in curves.items():
            handles[f"{of}, {METHODS[method][0]}"] = plot_curve(axis, curve, 0.15, **look(of, method))
        axis.set_yscale("log", base=2)
        axis.yaxis.set_major_formatter(lambda y, _: f"{y:g}")
        ticks(axis, [1, *numbers])
        axis.set(xlabel="processes", ylabel="speed-up over NLGS, SIMULATED", title=f"{PLATFORMS[platform]}, SIMULATED")
    axis = axes[0][-1]
    for (of, method), runs in counts.items():
        (handles[f"{of}, {METHODS[method][0]}"],) = axis.plot(list(runs), [iterations(run, True) for run in runs.values()], **look(of, method))
    if counts:
        ticks(axis, {n for runs in counts.values() for n in runs})
        axis.set(xlabel="subdomains", ylabel="mean iterations, counted", ylim=(0, 1.1 * axis.dataLim.y1))
    else:
        axis.set_axis_off()
    axis.set_title("iterations, counted")
    figure.legend(handles.values(), handles.keys(), loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4)
    return apart(figure)
