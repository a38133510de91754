"""The picture of the README: force chains across subdomains, beside the speed-up over sequential NLGS."""
import h5py
import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import to_rgb

from ..record import read
from ..studies.paper.data import Paper
from .packings import contact_lines, read_state
from .style import INK, SUBDOMAINS, apart, ideal, plt, save, subdomain_colour, subdomain_ticks

CURVES = (("triaxial", "auto", "64,000 spheres, accelerated", SUBDOMAINS[3]), ("triaxial", "paper", "64,000 spheres, paper's method", SUBDOMAINS[0]))
PALE = 0.35  # of a subdomain's colour on its grains


def chains(axis, path):
    """Grains in the colour of their subdomain, contacts as wide as their impulse."""
    state = read_state(path)
    with h5py.File(path) as file:
        impulse = file["contacts/normal_impulse"][()]
    x, r = state["x"], state["radius"]
    colours = [1 - PALE * (1 - np.array(to_rgb(subdomain_colour(k)))) for k in state["subdomain"]]
    axis.add_collection(
        EllipseCollection(2 * r, 2 * r, 0 * r, units="xy", offsets=x, transOffset=axis.transData, facecolors=colours, edgecolors="#b9b8b2", linewidths=0.25)
    )
    axis.add_collection(
        LineCollection(contact_lines(state), colors=INK, linewidths=np.minimum(0.8 * impulse / impulse[impulse > 0].mean(), 4), capstyle="round")
    )
    low, high = (x - r[:, None]).min(0), (x + r[:, None]).max(0)
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axis.set_title(f"{len(r)} disks, {len(np.unique(state['subdomain']))} subdomains")
    axis.set_axis_off()


def speed_ups(axis, record):
    """Simulated speed-ups on both platforms, and the ideal."""
    paper, numbers = Paper(record), {1}
    for scene, method, label, colour in CURVES:
        for of, platform, style in (("grid", "node48", "o-"), ("bisection", "cluster", "s--")):
            curve = sorted(paper.curve(scene, method, "dcs", of, platform).items())
            if not curve:
                continue
            numbers |= {n for n, _ in curve}
            where = {"node48": "node of 48 cores", "cluster": "cluster"}[platform]
            axis.plot([n for n, _ in curve], [point.speed_up for _, point in curve], style, color=colour, markersize=4, label=f"{label}, {where}")
    ideal(axis, max(numbers))
    axis.set(xlabel="processes", ylabel="speed-up over sequential NLGS", yscale="log", title="speed-up, SIMULATED")
    subdomain_ticks(axis, [4**k for k in range(6)])
    axis.set_yticks([1, 10, 100, 1000], ["1", "10", "100", "1000"])
    axis.legend(fontsize=8.5)


def draw(state, records):
    """Writes front.png beside the records, of which that of the paper is drawn."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.6, 4.6), width_ratios=(0.5, 1.0))
    chains(left, state)
    speed_ups(right, read(records / "paper.json", "paper"))
    return save(apart(figure), records, "front", "png")
