"""Stress ratio and solid fraction of sheared grains: figure and table of the page."""
import numpy as np

from ...page.page import Block, captions, figure_block
from ...page.style import INK, SUBDOMAINS, plt, save
from ...page.tables import table
from . import SCENES, law, published

TEXTS = captions(__file__)


def draw(record):
    figure, axes = plt.subplots(1, 2, figsize=(8.6, 3.6))
    for scene, colour in zip(SCENES, SUBDOMAINS):
        for solver, marker in (("nlgs", "o"), ("dcs", "x"), ("lammps", "s")):
            rows = [row for row in record["rows"] if (row["scene"], row["solver"]) == (scene, solver)]
            if not rows:
                continue
            how = {"fmt": marker, "color": colour, "markersize": 4, "markerfacecolor": "none", "label": f"{scene}, {solver}"}
            for axis, value, error in ((axes[0], "mu", "mu_error"), (axes[1], "solid_fraction", "fraction_error")):
                axis.errorbar([row["inertial_number"] for row in rows], [row[value] for row in rows], [row[error] for row in rows], **how)
        for which, axis in enumerate(axes):
            told = [(i, law(scene, i)[which]) for i in np.geomspace(5e-5, 0.3, 60) if law(scene, i)[which] is not None]
            axis.plot(*zip(*told), color=colour, linewidth=0.8)
    for axis, label in zip(axes, ("shear stress over normal stress", "solid fraction")):
        axis.set(xscale="log", xlabel="inertial number", ylabel=label)
    axes[0].plot([], [], color=INK, linewidth=0.8, label="published")
    axes[0].legend(fontsize=8)
    return figure


def parts(record, source, out):
    sources = "; ".join(f"{scene}: {told['source']}, {told['law']}" for scene, told in published().items())
    file = save(draw(record), out, "rheology")
    yield figure_block(file, "Shear in a cell under stress", f"{TEXTS['figure']} {sources}.", source, ("counted",), wide=True)
    columns = ("scene", "solver", "grains", "inertial_number", "mu", "mu_error", "mu_published", "solid_fraction", "fraction_error", "fraction_published")
    lines = [[row[key] for key in (*columns, "iterations_a_step", "unconverged_steps")] for row in record["rows"]]
    names = "scene | solver | grains | inertial number | mean | \u00b1 | law | mean | \u00b1 | law | iterations a step | steps not converged"
    head = [" *4 | stress ratio *3 | solid fraction *3 |  *2", names]
    yield Block(table(head, lines, "Homogeneous shear"), "Homogeneous shear", TEXTS["table"], source, ("counted",), wide=True)
