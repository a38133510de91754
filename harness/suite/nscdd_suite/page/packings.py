"""State files, and subdomains and multiplicities drawn on their spheres."""
import h5py
import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch, Rectangle

from ..record import InputError
from .style import INK, multiplicity_colour, plt, subdomain_colour

FIELDS = ("x", "radius", "box", "subdomain", "multiplicity")
ROUGH = ("x", "skin", "steps_since", "offset")  # of the last broad phase
CONTACTS = ("i", "j", "normal", "gap", "subdomain", "normal_impulse")
RIM = {"edgecolor": "#8a8a86", "linewidth": 0.5}


def read_state(path):
    """Arrays of a state file by name, those of contacts and of the last broad phase, with the walls as they were, in dictionaries of their own; grid: its
    cells, low and high corner, or None. Raises InputError."""
    try:
        with h5py.File(path) as file:
            state = {name: file[name][()] for name in FIELDS}
            state["contacts"] = {name: file["contacts"][name][()] for name in CONTACTS}
            state["rough"] = {"normal": file["walls/normal"][()]} | {name: file["rough"][name][()] for name in ROUGH}
            state["grid"] = np.split(file["rough/partition"][()], 3) if file["rough/kind"][0] == b"grid" else None
    except (OSError, KeyError) as error:
        raise InputError(f"{path}: not a state file with a broad phase: {str(error).splitlines()[0][:120]}") from None
    return state


def contact_lines(state):
    """Ends of each contact's branch, (c, 2, dim): from centre to centre, or from a wall to the centre."""
    x, contacts = state["x"], state["contacts"]
    i, j = contacts["i"], contacts["j"]
    distance = (state["radius"][i] + contacts["gap"])[:, None]
    other = np.where((j >= 0)[:, None], x[np.maximum(j, 0)], x[i] - distance * contacts["normal"])
    return np.stack([x[i], other], axis=1)


def add_disks(axis, x, radius, **look):
    """Disks in the units of the axis."""
    axis.add_collection(EllipseCollection(2 * radius, 2 * radius, 0 * radius, units="xy", offsets=x, transOffset=axis.transData, **look))


def draw_disks(axis, x, radius, pad=0.0, **look):
    """Disks on an axis without a frame, as far as they reach and a margin of so much of their extent."""
    add_disks(axis, x, radius, **look)
    low, high = (x - radius[:, None]).min(0), (x + radius[:, None]).max(0)
    pad *= max(high - low)
    axis.set(xlim=(low[0] - pad, high[0] + pad), ylim=(low[1] - pad, high[1] + pad), aspect="equal")
    axis.set_axis_off()


def draw_partition(axis, x, radius, multiplicity, lines, owner, grid, width):
    """Disks in the colour of their multiplicity, contacts in that of their subdomain, and the grid between them, if there is one."""
    draw_disks(axis, x, radius, 0.03, facecolors=[multiplicity_colour(m) for m in multiplicity], **RIM)
    axis.add_collection(LineCollection(lines, colors=[subdomain_colour(k) for k in owner], linewidths=width, capstyle="round"))
    for line, cells, first, last in zip((axis.axvline, axis.axhline), *(grid or [()] * 3)):
        for k in range(1, int(cells)):
            line(first + k * (last - first) / cells, color=INK, linewidth=1, dashes=(6, 3))


def partition_handles(labels, owner, of_subdomain):
    """Of a legend: {multiplicity: label}, and what lines of a subdomain are called."""
    return (
        [Patch(facecolor=multiplicity_colour(m), label=label, **RIM) for m, label in labels.items()],
        [plt.Line2D([], [], color=subdomain_colour(k), linewidth=2.5, label=of_subdomain.format(k)) for k in np.unique(owner)],
    )


TURN, TILT = np.radians(-52), np.radians(28)  # of who looks, from above a corner
TOWARDS = np.array([np.cos(TURN) * np.cos(TILT), np.sin(TURN) * np.cos(TILT), np.sin(TILT)])
RIGHT = np.array([np.cos(TURN + np.pi / 2), np.sin(TURN + np.pi / 2), 0])


def from_a_corner(x):
    """Places (..., 3) in the plane of the picture, (..., 2)."""
    return x @ np.stack([RIGHT, np.cross(TOWARDS, RIGHT)], axis=1)


def shaded_spheres(axis, x, radius, colours):
    """Spheres seen from above a corner, the nearest drawn last; four disks each, ever smaller and lighter towards the light."""
    order = np.argsort(x @ TOWARDS)
    centre, radius, colours = from_a_corner(x)[order], radius[order], colours[order]
    disks = ((1.0, 0.0, 0.62 * colours), (0.86, 0.1, 0.85 * colours), (0.6, 0.24, colours), (0.25, 0.36, 1 - 0.8 * (1 - colours)))
    size = np.stack([share * radius for share, _, _ in disks], axis=1).ravel()
    place = np.stack([centre + shift * radius[:, None] * [-0.6, 0.8] for _, shift, _ in disks], axis=1).reshape(-1, 2)
    draw_disks(axis, place, size, 0.01, facecolors=np.stack([shade for _, _, shade in disks], axis=1).reshape(-1, 3), edgecolors="none")


def sphere_counts(state):
    """Subdomains, and grains of each multiplicity."""
    numbers, grains = np.unique(state["multiplicity"], return_counts=True)
    return {"subdomains": len(np.unique(state["subdomain"])), "multiplicity": dict(zip(numbers.tolist(), grains.tolist()))}


def draw_spheres(state):
    """Fig. 2: (a) subdomain index and (b) multiplicity, the quarter facing the reader taken out."""
    x, r, m, owner = state["x"], state["radius"], state["multiplicity"], state["subdomain"]
    middle = (x.max(0) + x.min(0)) / 2
    kept = ~((x[:, 0] > middle[0]) & (x[:, 1] < middle[1]))
    figure, axes = plt.subplots(1, 2, figsize=(9.6, 5.4))
    how = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "handlelength": 1, "handleheight": 1, "columnspacing": 1.2}
    for axis, title, values, colour_of, label, columns in (
        (axes[0], "(a) subdomain index", owner, subdomain_colour, "{}", 8),
        (axes[1], "(b) multiplicity", m, multiplicity_colour, "{}  ({})", 6),
    ):
        numbers, grains = np.unique(values, return_counts=True)
        palette = {k: to_rgb(colour_of(k)) for k in numbers}
        colours = np.array([palette[k] for k in values])
        shaded_spheres(axis, x[kept], r[kept], colours[kept])
        axis.set_title(title)
        handles = [Rectangle((0, 0), 1, 1, facecolor=palette[k], edgecolor="#8a8a86", linewidth=0.4, label=label.format(k, n)) for k, n in zip(numbers, grains)]
        axis.legend(handles=handles, ncols=min(columns, len(handles)), **how)
    return figure
