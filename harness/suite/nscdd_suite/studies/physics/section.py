"""Granular physics beside published numbers: figures, table and section of the page. Texts of the figures: captions.toml."""
from html import escape

import numpy as np

from ...page import tables
from ...page.page import Block, captions, figure_block
from ...page.style import DCS, INK, NLGS, SUBDOMAINS, plt, save
from . import FIGURES

CAPTIONS = captions(__file__)
SHEAR = {
    "triaxial": ("spheres, friction 0.3", SUBDOMAINS[0], "-"),
    "triaxial-slow": ("spheres, friction 0.3, half the rate", SUBDOMAINS[5], "--"),
    "biaxial": ("disks, friction 0.3", SUBDOMAINS[1], "-"),
    "frictionless": ("spheres, no friction", SUBDOMAINS[3], "-"),
    "frictionless-slow": ("spheres, no friction, a quarter of the rate", SUBDOMAINS[7], "--"),
}
FORCES = {
    "biaxial": ("disks, friction 0.3, sheared", SUBDOMAINS[1], "o"),
    "triaxial": ("spheres, friction 0.3, sheared", SUBDOMAINS[0], "s"),
    "isotropic": ("spheres, no friction, isotropic", SUBDOMAINS[3], "^"),
}
AXIAL, DILATION = "axial strain", "dilation, minus volumetric strain"
MARK = {"agrees": "good", "differs": "bad", "cannot be told": "faint"}


def array(values):
    """Null is a gap."""
    return np.array(values, float)


def shear_tests(curves):
    """(name, its curves, how it is drawn) of those that there are."""
    for name, (label, colour, style) in SHEAR.items():
        if told := curves["shear"].get(name):
            yield name, told, {"color": colour, "linestyle": style, "label": label}


def draw_agreement(curves):
    """Every curve of both solvers."""
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.6))
    for axis, key, label, factor in zip(axes, ("q/p", "volumetric", "coordination"), ("q / p", DILATION, "coordination"), (1, -1, 1)):
        for solver, name, colour in (("nlgs", "NLGS", NLGS), ("dcs", "NSCDD (DCS), 8 subdomains", DCS)):
            for k, curve in enumerate(curves["spread"][key][solver]):
                how = {"color": colour, "linewidth": 0.9, "alpha": 0.85, "label": None if k else name}
                axis.plot(array(curves["spread"]["axial"]), factor * array(curve), **how)
        axis.set(xlabel=AXIAL, ylabel=label)
    axes[1].legend(loc="lower right")
    return figure


def draw_shear(curves):
    """Strength, dilation, solid fraction of the core and coordination of all tests."""
    figure, axes = plt.subplots(2, 2, figsize=(9, 6.4), sharex=True)
    for name, told, how in shear_tests(curves):
        axial, core = array(told["axial"]), told["core"]
        axes[0, 0].plot(axial, np.degrees(np.arcsin(array(told["sine"]))), **how)
        axes[0, 1].plot(axial, -array(told["volumetric"]), **how)
        if name != "biaxial":
            axes[1, 0].plot(array(core["axial"]), array(core["solid fraction"]), **how)
        axes[1, 1].plot(axial, array(told["coordination"]), **how)
    labels = ("friction angle that is mobilised, degrees", DILATION, "solid fraction of spheres, core", "coordination")
    for axis, label, below in zip(axes.flat, labels, ("", "", AXIAL, AXIAL)):
        axis.set(ylabel=label, xlabel=below)
    figure.legend(*axes[0, 1].get_legend_handles_labels(), loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3)
    return figure


def draw_fabric(curves):
    """Anisotropy of the contacts; and where the work of the walls goes."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6))
    for _, told, how in shear_tests(curves):
        axes[0].plot(array(told["axial"]), array(told["fabric"]), **how)
    told = curves["shear"].get("triaxial") or next(iter(curves["shear"].values()))
    for key, colour in (("friction", SUBDOMAINS[3]), ("impact", SUBDOMAINS[2])):
        axes[1].plot(array(told["axial"]), array(told[f"dissipated_{key} total"]) / array(told["work_walls total"]), color=colour, label=key)
    axes[0].set(xlabel=AXIAL, ylabel="fabric, axial less lateral")
    axes[1].set(xlabel=AXIAL, ylabel="dissipated, over work of the walls", ylim=(0, 1.05))
    axes[1].legend(loc="center right")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3)
    return figure


def draw_forces(curves):
    """P(f), and the exponential that fits above the mean."""
    figure, axis = plt.subplots(figsize=(5.6, 4))
    for name, (label, colour, marker) in FORCES.items():
        if not (told := curves["forces"].get(name)):
            continue
        f, density, counts = (array(told[key]) for key in ("f", "P", "counts"))
        some = counts >= 5
        axis.plot(f[some], density[some], marker, color=colour, markersize=3.5, markerfacecolor="none", label=label)
        if told["decay"] is not None:
            x = np.array([1, max(f[some], default=2)])
            start = told.get("at the mean") or told["above the mean"] * told["decay"]
            axis.plot(x, start * np.exp(-told["decay"] * (x - 1)), color=colour, linewidth=1, label=f"exp(-{told['decay']:.2f} f)")
    axis.set(yscale="log", xlabel="normal force over its mean, f", ylabel="P(f)")
    axis.axvline(1, color=INK, linewidth=0.6, linestyle=":")
    axis.legend(fontsize=9)
    return figure


DRAW = {"physics-agreement": draw_agreement, "physics-shear": draw_shear, "physics-fabric": draw_fabric, "physics-forces": draw_forces}


def draw_all(record, folder):
    """{name: file} of all figures whose curves are there."""
    return {name: save(DRAW[name](record["curves"]), folder, name) for name, needed in FIGURES.items() if record["curves"].get(needed)}


def value_text(row):
    if row["ours"] is None:
        return tables.NONE
    value = f"{row['ours']:.4g}" if abs(row["ours"]) >= 1e-3 else tables.number(row["ours"])
    return value + (f" \u00b1 {row['error']:.1g}" if row["error"] else "") + {"1": "", "degrees": "\u00b0"}[row["unit"]]


def published_text(row):
    told = row["published"]
    return escape(told) if isinstance(told, str) else tables.number(told[0]) if told[0] == told[1] else f"{told[0]:g} to {told[1]:g}"


def wrapped(text, width):
    """Text of several lines in a cell; cells of tables do not wrap by themselves."""
    return f'<span style="display:inline-block;white-space:normal;overflow-wrap:anywhere;text-align:left;width:{width}em">{text}</span>'


def references(record):
    """What the rows are compared with, each once, in the order of the rows."""
    return list(dict.fromkeys(reference for row in record["rows"] for reference in row["source"].split("; ")))


def row_table(record):
    """Every comparison, with how it was measured beneath; what explains a difference stands with the verdict."""
    lines, number = [], {reference: str(n) for n, reference in enumerate(references(record), 1)}
    for row in record["rows"]:
        told = f"{row['verdict']}{': ' + row['why'] if row['why'] else ''}"
        note = f"<br><i>{escape(row['note'])}</i>" if row["note"] else ""
        cells = [wrapped(escape(row["quantity"]) + note, 20), value_text(row), wrapped(published_text(row), 10), wrapped(escape(row["rule"]), 12)]
        sources = ", ".join(number[reference] for reference in row["source"].split("; "))
        lines.append([*cells, (wrapped(escape(told), 10), MARK[row["verdict"]]), sources])
    return tables.table(["quantity | ours | published | rule | verdict | sources"], lines, "Granular physics beside published numbers")


def parts(record, source, out):
    agree, differ, untold = (sum(row["verdict"] == verdict for row in record["rows"]) for verdict in MARK)
    yield f"<p>{len(record['rows'])} comparisons: {agree} agree, {differ} differ, {untold} cannot be told.</p>"
    yield Block(row_table(record), *CAPTIONS["rows"].values(), source, wide=True)
    yield "<p>Sources:</p><ol>" + "".join(f"<li>{escape(reference)}</li>" for reference in references(record)) + "</ol>"
    for name, file in draw_all(record, out).items():
        yield figure_block(file, *CAPTIONS[name].values(), source, wide=True)
