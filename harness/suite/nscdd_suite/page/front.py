"""The picture of the README: force chains across subdomains, beside the speed-up over sequential NLGS."""
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb

from ..record import read
from ..studies.paper.data import Paper
from .packings import contact_lines, draw_disks, read_state
from .style import INK, SUBDOMAINS, apart, ideal, plt, save, subdomain_colour, subdomain_ticks

CURVES = (("triaxial", "auto", "64,000 spheres, accelerated", SUBDOMAINS[3]), ("triaxial", "paper", "64,000 spheres, paper's method", SUBDOMAINS[0]))
PLATFORMS = {"node48": "node of 48 cores", "cluster": "cluster"}
PALE = 0.35  # of a subdomain's colour on its grains


def chains(axis, path):
    """Grains in the colour of their subdomain, contacts as wide as their impulse."""
    state = read_state(path)
    x, r, impulse = state["x"], state["radius"], state["contacts"]["normal_impulse"]
    colours = [1 - PALE * (1 - np.array(to_rgb(subdomain_colour(k)))) for k in state["subdomain"]]
    draw_disks(axis, x, r, facecolors=colours, edgecolors="#b9b8b2", linewidths=0.25)
    widths = np.minimum(0.8 * impulse / impulse[impulse > 0].mean(), 4)
    axis.add_collection(LineCollection(contact_lines(state), colors=INK, linewidths=widths, capstyle="round"))
    axis.set_title(f"{len(r)} disks, {len(np.unique(state['subdomain']))} subdomains")


def speed_ups(axis, record):
    """Simulated speed-ups on both platforms, and the ideal."""
    paper, most = Paper(record), 1
    for scene, method, label, colour in CURVES:
        for of, platform, style in (("grid", "node48", "o-"), ("bisection", "cluster", "s--")):
            if curve := sorted(paper.curve(scene, method, "dcs", of, platform).items()):
                n, points = zip(*curve)
                axis.plot(n, [point.speed_up for point in points], style, color=colour, markersize=4, label=f"{label}, {PLATFORMS[platform]}")
                most = max(most, *n)
    ideal(axis, most)
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
