"""Figs. 3 and 4 (speed-up and iterations against subdomains), the iteration histories, and subdomains and multiplicities of disks."""
import numpy as np

from ...page.packings import contact_lines, draw_partition, partition_handles
from ...page.style import DCS, FAINT, NLGS, SCHEMES, blank, ideal, plt, subdomain_ticks


def draw_schemes(axis, values):
    """CCS as open squares around the full circles of DCS, as both schemes make the same iterates."""
    for scheme, (label, colour, marker) in SCHEMES.items():
        look = {"markersize": 9, "markerfacecolor": "none", "linewidth": 2.2, "alpha": 0.8} if scheme == "ccs" else {"markersize": 5, "linewidth": 1.2}
        if scheme in values:
            axis.plot(*zip(*sorted(values[scheme].items())), marker=marker, color=colour, label=label, **look)
    numbers = {n for by_number in values.values() for n in by_number}
    if not numbers:
        blank(axis, "none")
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


def draw_network(state):
    """Fig. 1: grains by multiplicity, contacts by subdomain, and the grid between them."""
    x, r, m, owner = state["x"], state["radius"], state["multiplicity"], state["contacts"]["subdomain"]
    width, height = (x + r[:, None]).max(0) - (x - r[:, None]).min(0)
    figure, axis = plt.subplots(figsize=(8.2, max(3.0, min(8.0, 6.2 * height / width))))
    draw_partition(axis, x, r, m, contact_lines(state), owner, state["grid"], np.clip(150 / np.sqrt(len(r)) / 6, 0.8, 2.6))
    labels = {k: f"{k}  ({n})" for k, n in zip(*np.unique(m, return_counts=True))}
    grains, contacts = partition_handles(labels, owner, "{}")
    beside = {"loc": "upper left", "bbox_to_anchor": (1.0, 1.0), "alignment": "left"}
    axis.add_artist(axis.legend(handles=grains, title="multiplicity (grains)", **beside))
    beside |= {"loc": "lower left", "bbox_to_anchor": (1.0, 0.0)}
    axis.legend(handles=contacts, title="contacts of subdomain", ncols=1 + len(contacts) // 9, **beside)
    return figure
