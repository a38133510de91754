"""Figs. 3 and 4 (speed-up and iterations against subdomains), the iteration histories, and subdomains and multiplicities of disks."""
import re

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.patches import Patch

from ...page.packings import contact_lines, draw_disks
from ...page.style import DCS, FAINT, INK, NLGS, SCHEMES, ideal, multiplicity_colour, plt, subdomain_colour, subdomain_ticks


def draw_schemes(axis, values):
    """CCS as open squares around the full circles of DCS, as both schemes make the same iterates."""
    for scheme, (label, colour, marker) in SCHEMES.items():
        look = {"markersize": 9, "markerfacecolor": "none", "linewidth": 2.2, "alpha": 0.8} if scheme == "ccs" else {"markersize": 5, "linewidth": 1.2}
        if scheme in values:
            axis.plot(*zip(*sorted(values[scheme].items())), marker=marker, color=colour, label=label, **look)
    numbers = {n for by_number in values.values() for n in by_number}
    if not numbers:
        axis.text(0.5, 0.5, "none", ha="center", transform=axis.transAxes, color=NLGS)
        axis.set_axis_off()
    return numbers


def draw_speed_up_and_iterations(speed, iterations, reference, mean):
    """The figure of one scene; `reference`: iterations of sequential NLGS, or None."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.4, 3.4), width_ratios=(1, 1.35))
    left.set_title("(a) speed-up, measured")
    most = max([2, *(n for by_rank in speed.values() for n in by_rank)])
    if speed:
        ideal(left, most)
    if ranks := draw_schemes(left, speed):
        subdomain_ticks(left, sorted({1, 2, *ranks}))
        left.set(xlim=(0.85, 1.18 * most), ylim=(0, 1.08 * left.dataLim.y1), xlabel="MPI ranks = subdomains", ylabel="speed-up over sequential NLGS")
        left.legend(loc="upper left")
    right.set_title(f"(b) {'mean iterations per step' if mean else 'iterations, all steps'}, counted")
    if numbers := draw_schemes(right, iterations):
        subdomain_ticks(right, sorted(numbers))
        if reference is not None:
            right.axhline(reference, linestyle="--", linewidth=1, color=NLGS, label="sequential NLGS")
        right.set(ylim=(0, 1.08 * right.dataLim.y1), xlabel="subdomains", ylabel="mean iterations" if mean else "total iterations")
        right.yaxis.set_major_formatter(lambda y, _: f"{y:,.0f}".replace(",", "\u00a0"))
        right.legend(loc="lower right")
    return figure


def draw_histories(panels):
    """Iterations of every step, a panel per scene, a line per number of subdomains; panels: {scene: {subdomains: run}}."""
    figure, axes = plt.subplots(1, len(panels), figsize=(3.1 * len(panels) + 0.6, 3.1), squeeze=False)
    numbers = sorted({n for found in panels.values() for n in found})
    colour = dict(zip(numbers, plt.get_cmap("viridis_r")(np.linspace(0.08, 0.95, len(numbers))) if len(numbers) > 1 else [DCS]))
    for axis, (scene, found) in zip(axes[0], panels.items()):
        for n, run in found.items():
            axis.plot(range(1, run["steps"] + 1), run["iterations"], color=colour[n], linewidth=1.1)
        axis.set(xlabel="step", ylim=(0, None), title=scene)
    axes[0][0].set_ylabel("iterations")
    handles = [plt.Line2D([], [], color=colour[n], label=str(n)) for n in numbers]
    axes[0][-1].legend(handles=handles, title="subdomains", loc="center left", bbox_to_anchor=(1.0, 0.5), edgecolor=FAINT)
    return figure


def grid_of(partition, state, lines):
    """Cells per axis and the box (low, high) of a 'grid 2x2' partition, or None if the contacts do not fit it.

    The state does not carry the box that was cut, so the likely ones are tried: the box of the packing, that of the
    centres and that of the grains. Contacts may have moved a little since the last repartition.
    """
    match = re.search(r"(\d+(?:x\d+)+)", partition)
    if not match or not len(lines):
        return None
    cells = np.array([int(n) for n in match.group(1).split("x")])
    x, r = state["x"], state["radius"][:, None]
    boxes = [(np.zeros(len(cells)), state["box"]), (x.min(0), x.max(0)), ((x - r).min(0), (x + r).max(0))]

    def hits(box):
        cell = np.floor((lines.mean(axis=1) - box[0]) / (box[1] - box[0]) * cells).astype(int)
        return np.mean(np.clip(cell, 0, cells - 1) @ np.cumprod([1, *cells[:-1]]) == state["contacts"]["subdomain"])

    best = max(boxes, key=hits)
    return (cells, *best) if hits(best) > 0.9 else None


def draw_network(state, grid):
    """Fig. 1: grains by multiplicity, contacts by subdomain, and the grid between them."""
    x, r, m, owner = state["x"], state["radius"], state["multiplicity"], state["contacts"]["subdomain"]
    width, height = (x + r[:, None]).max(0) - (x - r[:, None]).min(0)
    figure, axis = plt.subplots(figsize=(8.2, max(3.0, min(8.0, 6.2 * height / width))))
    draw_disks(axis, x, r, 0.03, facecolors=[multiplicity_colour(k) for k in m], edgecolors="#8a8a86", linewidths=0.5)
    widths = np.clip(150 / np.sqrt(len(r)) / 6, 0.8, 2.6)
    axis.add_collection(LineCollection(contact_lines(state), colors=[subdomain_colour(k) for k in owner], linewidths=widths, capstyle="round"))
    if grid:
        cells, low, high = grid
        for d, draw in enumerate((axis.axvline, axis.axhline)):
            for k in range(1, cells[d]):
                draw(low[d] + k * (high[d] - low[d]) / cells[d], color=INK, linewidth=1, dashes=(6, 3))
    how = {"edgecolor": "#8a8a86", "linewidth": 0.5}
    handles = [Patch(facecolor=multiplicity_colour(k), label=f"{k}  ({n})", **how) for k, n in zip(*np.unique(m, return_counts=True))]
    beside = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "alignment": "left"}
    axis.add_artist(axis.legend(handles=handles, title="multiplicity (grains)", **beside))
    handles = [plt.Line2D([], [], color=subdomain_colour(k), linewidth=2.5, label=str(k)) for k in np.unique(owner)]
    beside |= {"loc": "lower left", "bbox_to_anchor": (1.0, 0.0)}
    axis.legend(handles=handles, title="contacts of subdomain", ncols=1 + len(handles) // 9, **beside)
    return figure
