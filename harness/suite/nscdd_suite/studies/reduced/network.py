"""Subdomains and multiplicities drawn on the disks of a state file."""
import re

import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.patches import Patch

from ...page.packings import contact_lines
from ...page.style import INK, multiplicity_colour, plt, subdomain_colour


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
    strides = np.cumprod([1, *cells[:-1]])
    middles = lines.mean(axis=1)

    def hits(box):
        cell = np.floor((middles - box[0]) / (box[1] - box[0]) * cells).astype(int)
        return np.mean(np.clip(cell, 0, cells - 1) @ strides == state["contacts"]["subdomain"])

    best = max(boxes, key=hits)
    return (cells, *best) if hits(best) > 0.9 else None


def draw_network(run, state):
    """Fig. 1: grains by multiplicity, contacts by subdomain, and the grid between them."""
    x, r, m = state["x"], state["radius"], state["multiplicity"]
    lines = contact_lines(state)
    low, high = (x - r[:, None]).min(0), (x + r[:, None]).max(0)
    width, height = high - low
    figure, axis = plt.subplots(figsize=(8.2, max(3.0, min(8.0, 6.2 * height / width))))
    axis.add_collection(
        EllipseCollection(
            2 * r,
            2 * r,
            np.zeros_like(r),
            units="xy",
            offsets=x,
            transOffset=axis.transData,
            facecolors=[multiplicity_colour(k) for k in m],
            edgecolors="#8a8a86",
            linewidths=0.5,
        )
    )
    owner = state["contacts"]["subdomain"]
    axis.add_collection(
        LineCollection(lines, colors=[subdomain_colour(k) for k in owner], linewidths=np.clip(150 / np.sqrt(len(r)) / 6, 0.8, 2.6), capstyle="round")
    )
    grid = grid_of(run["partition"], state, lines)
    pad = 0.03 * max(width, height)
    if grid:
        cells, box_low, box_high = grid
        for d, draw in enumerate((axis.axvline, axis.axhline)):
            for k in range(1, cells[d]):
                draw(box_low[d] + k * (box_high[d] - box_low[d]) / cells[d], color=INK, linewidth=1, dashes=(6, 3))
    axis.set(xlim=(low[0] - pad, high[0] + pad), ylim=(low[1] - pad, high[1] + pad), aspect="equal")
    axis.set_axis_off()
    legends(axis, m, np.unique(owner))
    return figure, grid is not None


def legends(axis, multiplicity, subdomains):
    numbers, grains = np.unique(multiplicity, return_counts=True)
    handles = [Patch(facecolor=multiplicity_colour(k), edgecolor="#8a8a86", linewidth=0.5, label=f"{k}  ({n})") for k, n in zip(numbers, grains)]
    first = axis.legend(handles=handles, title="multiplicity (grains)", loc="upper left", bbox_to_anchor=(1.0, 1.0), alignment="left")
    axis.add_artist(first)
    handles = [plt.Line2D([], [], color=subdomain_colour(k), linewidth=2.5, label=str(k)) for k in subdomains]
    axis.legend(handles=handles, title="contacts of subdomain", loc="lower left", bbox_to_anchor=(1.0, 0.0), alignment="left", ncols=1 + len(handles) // 9)
