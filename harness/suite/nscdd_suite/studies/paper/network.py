"""Fig. 1 of the paper: the rough graph with the multiplicities that it predicts, and the fine graph with those that are."""
import h5py
import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.patches import Patch

from ...page.packings import contact_lines, read_state
from ...page.style import INK, multiplicity_colour, plt, subdomain_colour
from ...record import InputError

WRONG = "#c2185b"


def read_rough(path):
    """The last broad phase of a state file, with the walls as they were. Raises InputError."""
    try:
        with h5py.File(path) as file:
            return {
                "kind": file["rough/kind"][0].decode(),
                "partition": file["rough/partition"][()],
                "x": file["rough/x"][()],
                "skin": float(file["rough/skin"][0]),
                "steps_since": int(file["rough/steps_since"][0]),
                "offset": file["rough/offset"][()],
                "normal": file["walls/normal"][()],
            }
    except (OSError, KeyError) as error:
        raise InputError(f"{path}: not a state file with a broad phase: {str(error).splitlines()[0][:120]}") from None


def owners(rough, points):
    """Subdomain of each point, as the kernel's partitions decide (partition/grid.hpp, bisection.hpp)."""
    numbers, dim = rough["partition"], points.shape[1]
    if rough["kind"] == "grid":
        cells, low, high = numbers[:dim], numbers[dim : 2 * dim], numbers[2 * dim :]
        cell = np.clip(np.floor((points - low) / (high - low) * cells), 0, cells - 1)
        return (cell @ np.cumprod([1, *cells[:-1]])).astype(int)
    if rough["kind"] != "bisection":
        return None
    cuts = numbers.reshape(-1, 2)

    def descend(node, first, count, point):
        while count > 1:
            low = count // 2
            if point[int(cuts[node, 0])] < cuts[node, 1]:
                node, count = node + 1, low
            else:
                node, first, count = node + low, first + low, count - low
        return first

    return np.array([descend(0, 0, len(cuts) + 1, point) for point in points])


def candidates(state, rough):
    """The rough graph: pairs (i, j) with a gap below the skin, j < 0 wall -1-j; the ends of their branches, and their subdomains. A pair
    belongs to the subdomain of the middle of its centres, a grain at a wall to that of its centre. None for partitions that a state
    does not tell."""
    x, radius, skin = rough["x"], state["radius"], rough["skin"]
    i, j = np.triu_indices(len(x), 1)
    close = np.linalg.norm(x[i] - x[j], axis=1) < radius[i] + radius[j] + skin
    i, j = i[close], j[close]
    distance = x @ rough["normal"].T - rough["offset"]  # (grains, walls)
    g, w = np.nonzero(distance - radius[:, None] < skin)
    foot = x[g] - distance[g, w][:, None] * rough["normal"][w]
    owner = owners(rough, np.concatenate([(x[i] + x[j]) / 2, x[g]]))
    if owner is None:
        return None
    lines = np.stack([np.concatenate([x[i], x[g]]), np.concatenate([x[j], foot])], axis=1)
    return np.concatenate([i, g]), np.concatenate([j, -1 - w]), lines, owner


def multiplicities(grains, i, j, owner):
    """Subdomains in which each grain has an edge; 0 without one."""
    touched = [set() for _ in range(grains)]
    for a, b, k in zip(i, j, owner):
        touched[a].add(k)
        if b >= 0:
            touched[b].add(k)
    return np.array([len(subdomains) for subdomains in touched])


def predict(path):
    """What Fig. 1 shows: state, rough graph, both multiplicities (1 for grains without a contact, which are in one subdomain)."""
    state, rough = read_state(path), read_rough(path)
    if state["x"].shape[1] != 2:
        raise InputError(f"{path}: the network of Fig. 1 is of disks, this one has dimension {state['x'].shape[1]}")
    graph = candidates(state, rough)
    if graph is None:
        raise InputError(f"{path}: rough/kind: '{rough['kind']}' does not tell who owns a point; grid and bisection do")
    i, j, lines, owner = graph
    return {
        "state": state,
        "rough": rough,
        "lines": lines,
        "owner": owner,
        "pairs": (i, j),
        "predicted": np.maximum(1, multiplicities(len(state["x"]), i, j, owner)),
        "found": np.maximum(1, state["multiplicity"]),
    }


def counts(network):
    """Grains by what was predicted and found."""
    predicted, found = network["predicted"], network["found"]
    return {
        "grains": len(found),
        "candidates": len(network["owner"]),
        "contacts": len(network["state"]["contacts"]["i"]),
        "boundary_predicted": int((predicted > 1).sum()),
        "boundary": int((found > 1).sum()),
        "wrong": int((predicted != found).sum()),
        "not_boundary": int(((predicted > 1) & (found == 1)).sum()),
    }


def draw(network):
    """(a) the rough graph at the last broad phase; (b) the contacts of the last step, wrong predictions ringed."""
    state, rough = network["state"], network["rough"]
    radius = state["radius"]
    panels = (
        ("(a) after the broad phase, predicted", rough["x"], network["predicted"], network["lines"], network["owner"]),
        ("(b) after the narrow phase", state["x"], network["found"], contact_lines(state), state["contacts"]["subdomain"]),
    )
    low, high = (state["x"] - radius[:, None]).min(0), (state["x"] + radius[:, None]).max(0)
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 5.0 * min(1.6, (high - low)[1] / (high - low)[0]) + 0.9))
    for axis, (title, x, multiplicity, lines, owner) in zip(axes, panels):
        axis.add_collection(
            EllipseCollection(
                2 * radius,
                2 * radius,
                0 * radius,
                units="xy",
                offsets=x,
                transOffset=axis.transData,
                facecolors=[multiplicity_colour(m) for m in multiplicity],
                edgecolors="#8a8a86",
                linewidths=0.5,
            )
        )
        axis.add_collection(LineCollection(lines, colors=[subdomain_colour(k) for k in owner], linewidths=1.7, capstyle="round"))
        if rough["kind"] == "grid":
            cells, corner, end = np.split(rough["partition"], 3)
            for d, line in enumerate((axis.axvline, axis.axhline)):
                for k in range(1, int(cells[d])):
                    line(corner[d] + k * (end[d] - corner[d]) / cells[d], color=INK, linewidth=1, dashes=(6, 3))
        pad = 0.03 * max(high - low)
        axis.set(xlim=(low[0] - pad, high[0] + pad), ylim=(low[1] - pad, high[1] + pad), aspect="equal")
        axis.set_title(f"{title}, counted")
        axis.set_axis_off()
    wrong = network["predicted"] != network["found"]
    axes[1].add_collection(
        EllipseCollection(
            2 * radius[wrong],
            2 * radius[wrong],
            0 * radius[wrong],
            units="xy",
            offsets=state["x"][wrong],
            transOffset=axes[1].transData,
            facecolors="none",
            edgecolors=WRONG,
            linewidths=2.4,
        )
    )
    handles = [
        Patch(
            facecolor=multiplicity_colour(m),
            edgecolor="#8a8a86",
            linewidth=0.5,
            label=f"multiplicity {m}  ({(network['predicted'] == m).sum()}, {(network['found'] == m).sum()})",
        )
        for m in np.unique(np.concatenate([network["predicted"], network["found"]]))
    ]
    handles += [Patch(facecolor="none", edgecolor=WRONG, linewidth=2.0, label=f"wrongly predicted  ({wrong.sum()})")]
    handles += [plt.Line2D([], [], color=subdomain_colour(k), linewidth=2.5, label=f"edges of subdomain {k}") for k in np.unique(network["owner"])]
    figure.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4)
    return figure
