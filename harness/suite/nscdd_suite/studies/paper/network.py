"""Fig. 1 of the paper: the rough graph with the multiplicities that it predicts, and the fine graph with those that are."""
import numpy as np
from matplotlib.patches import Patch

from ...page.packings import add_disks, contact_lines, draw_partition, partition_handles, read_state
from ...page.style import plt

WRONG = "#c2185b"


def owners(grid, points):
    """Subdomain of each point, as the kernel's partition decides (partition/grid.hpp). grid: cells, low corner, high corner."""
    cells, low, high = grid
    cell = np.clip(np.floor((points - low) / (high - low) * cells), 0, cells - 1)
    return (cell @ np.cumprod([1, *cells[:-1]])).astype(int)


def candidates(state):
    """The rough graph: pairs (i, j) with a gap below the skin, j < 0 wall -1-j; the ends of their branches, and their subdomains. A pair
    belongs to the subdomain of the middle of its centres, a grain at a wall to that of its centre."""
    rough, radius = state["rough"], state["radius"]
    x, skin = rough["x"], rough["skin"]
    i, j = np.triu_indices(len(x), 1)
    close = np.linalg.norm(x[i] - x[j], axis=1) < radius[i] + radius[j] + skin
    i, j = i[close], j[close]
    distance = x @ rough["normal"].T - rough["offset"]  # (grains, walls)
    g, w = np.nonzero(distance - radius[:, None] < skin)
    foot = x[g] - distance[g, w][:, None] * rough["normal"][w]
    lines = np.stack([np.concatenate([x[i], x[g]]), np.concatenate([x[j], foot])], axis=1)
    owner = owners(state["grid"], np.concatenate([(x[i] + x[j]) / 2, x[g]]))
    return np.concatenate([i, g]), np.concatenate([j, -1 - w]), lines, owner


def multiplicities(grains, i, j, owner):
    """Subdomains in which each grain has an edge; 0 without one."""
    ends = np.concatenate([np.stack([i, owner], 1), np.stack([j, owner], 1)[j >= 0]])
    return np.bincount(np.unique(ends, axis=0)[:, 0], minlength=grains)


def predict(path):
    """What Fig. 1 shows: state, lines of the rough graph and their owners, both multiplicities (1 for grains without a contact, which are in one subdomain)."""
    state = read_state(path)
    i, j, lines, owner = candidates(state)
    predicted = np.maximum(1, multiplicities(len(state["x"]), i, j, owner))
    return {"state": state, "lines": lines, "owner": owner, "predicted": predicted, "found": np.maximum(1, state["multiplicity"])}


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
    state, predicted, found = (network[name] for name in ("state", "predicted", "found"))
    x, radius = state["x"], state["radius"]
    low, high = (x - radius[:, None]).min(0), (x + radius[:, None]).max(0)
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 5.0 * min(1.6, (high - low)[1] / (high - low)[0]) + 0.9))
    for axis, title, at, multiplicity, lines, owner in (
        (axes[0], "(a) after the broad phase, predicted", state["rough"]["x"], predicted, network["lines"], network["owner"]),
        (axes[1], "(b) after the narrow phase", x, found, contact_lines(state), state["contacts"]["subdomain"]),
    ):
        draw_partition(axis, at, radius, multiplicity, lines, owner, state["grid"], 1.7)
        axis.set_title(f"{title}, counted")
    wrong = predicted != found
    add_disks(axes[1], x[wrong], radius[wrong], facecolors="none", edgecolors=WRONG, linewidths=2.4)
    labels = {m: f"multiplicity {m}  ({(predicted == m).sum()}, {(found == m).sum()})" for m in np.unique(np.concatenate([predicted, found]))}
    grains, edges = partition_handles(labels, network["owner"], "edges of subdomain {}")
    handles = [*grains, Patch(facecolor="none", edgecolor=WRONG, linewidth=2.0, label=f"wrongly predicted  ({wrong.sum()})"), *edges]
    figure.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4)
    return figure
