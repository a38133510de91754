"""Figs. 3 and 4 (speed-up and iterations against subdomains) and the iteration histories."""
import numpy as np

from ...page.style import DCS, FAINT, NLGS, SCHEMES, ideal, plt, subdomain_ticks


def speed_ups(runs, scene):
    """{scheme: {ranks: T(sequential NLGS) / T(NSCDD over MPI)}}, and the runs used; measured runs only."""
    values, used = {}, []
    for scheme in SCHEMES:
        for n, run in runs.timed(scene, scheme).items():
            reference = runs.reference(run)
            if reference and reference.measured and run["seconds"]["total"] > 0:
                values.setdefault(scheme, {})[n] = reference["seconds"]["total"] / run["seconds"]["total"]
                used += [run] + [reference] * (reference not in used)
    return values, used


def counts(runs, scene, mean):
    """{scheme: {subdomains: total (or mean per step) iterations}}, and the runs used."""
    values, used = {}, []
    for scheme in SCHEMES:
        found = runs.counted(scene, scheme)
        if found:
            values[scheme] = {n: run.mean_iterations if mean else run.total_iterations for n, run in found.items()}
            used += found.values()
    return values, used


def draw_schemes(axis, values):
    """CCS as open squares around the full circles of DCS, as both schemes make the same iterates."""
    for scheme, (label, colour, marker) in SCHEMES.items():
        if scheme in values:
            n, y = zip(*sorted(values[scheme].items()))
            open_marker = scheme == "ccs"
            axis.plot(
                n,
                y,
                marker=marker,
                color=colour,
                label=label,
                markersize=9 if open_marker else 5,
                markerfacecolor="none" if open_marker else colour,
                linewidth=2.2 if open_marker else 1.2,
                alpha=0.8 if open_marker else 1,
            )


def draw_speed_up_and_iterations(runs, scene, mean):
    """The figure of one scene, or None if there is nothing to draw."""
    speed, timed = speed_ups(runs, scene)
    iterations, counted = counts(runs, scene, mean)
    if not timed and not counted:
        return None, speed, iterations, timed, counted
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.4, 3.4), width_ratios=(1, 1.35))

    ranks = sorted({n for by_rank in speed.values() for n in by_rank})
    left.set_title("(a) speed-up, measured")
    if ranks:
        most = max(2, *ranks)
        ideal(left, most)
        draw_schemes(left, speed)
        subdomain_ticks(left, sorted({1, 2, *ranks}))
        left.set_xlim(0.85, 1.18 * most)
        left.set_ylim(0, 1.08 * left.dataLim.y1)
        left.set(xlabel="MPI ranks = subdomains", ylabel="speed-up over sequential NLGS")
        left.legend(loc="upper left")
    else:
        left.text(0.5, 0.5, "not measured", ha="center", transform=left.transAxes, color=NLGS)
        left.set_axis_off()

    right.set_title(f"(b) {'mean iterations per step' if mean else 'iterations, all steps'}, counted")
    if iterations:
        draw_schemes(right, iterations)
        subdomain_ticks(right, sorted({n for by_n in iterations.values() for n in by_n}))
        reference = runs.reference(counted[0])
        if reference:
            count = reference.mean_iterations if mean else reference.total_iterations
            right.axhline(count, linestyle="--", linewidth=1, color=NLGS, label="sequential NLGS")
        right.set_ylim(0, 1.08 * right.dataLim.y1)
        right.set(xlabel="subdomains", ylabel="mean iterations" if mean else "total iterations")
        right.yaxis.set_major_formatter(lambda y, _: f"{y:,.0f}".replace(",", "\u00a0"))
        right.legend(loc="lower right")
    else:
        right.text(0.5, 0.5, "not counted", ha="center", transform=right.transAxes, color=NLGS)
        right.set_axis_off()
    return figure, speed, iterations, timed, counted


def draw_histories(runs, scenes):
    """Iterations of every step, a panel per scene, a line per number of subdomains; and the runs used."""
    panels = []
    for scene in scenes:
        found = runs.counted(scene, "dcs") or runs.counted(scene, "ccs") or runs.counted(scene, "nlgs")
        if found and max(run["steps"] for run in found.values()) > 1:
            panels.append((scene, found))
    if not panels:
        return None, []
    figure, axes = plt.subplots(1, len(panels), figsize=(3.1 * len(panels) + 0.6, 3.1), squeeze=False)
    numbers = sorted({n for _, found in panels for n in found})
    shades = plt.get_cmap("viridis_r")(np.linspace(0.08, 0.95, len(numbers))) if len(numbers) > 1 else [DCS]
    colour = dict(zip(numbers, shades))
    for axis, (scene, found) in zip(axes[0], panels):
        for n, run in found.items():
            axis.plot(range(1, run["steps"] + 1), run["iterations"], color=colour[n], linewidth=1.1)
        axis.set_title(scene)
        axis.set(xlabel="step", ylim=(0, None))
    axes[0][0].set_ylabel("iterations")
    handles = [plt.Line2D([], [], color=colour[n], label=str(n)) for n in numbers]
    axes[0][-1].legend(handles=handles, title="subdomains", loc="center left", bbox_to_anchor=(1.0, 0.5), edgecolor=FAINT)
    return figure, [run for _, found in panels for run in found.values()]
