"""Granular physics beside published numbers: figures, table and section of the page."""
from html import escape

import numpy as np

from ...page import tables
from ...page.page import figure_block, origin, quick, table_block
from ...page.style import DCS, INK, NLGS, SUBDOMAINS, plt, save

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
AXIAL = "axial strain"
MARK = {"agrees": "good", "differs": "bad", "cannot be told": "faint"}


def line(axis, x, y, **how):
    """Null is a gap."""
    axis.plot(np.array(x, float), np.array(y, float), **how)


def draw_agreement(record):
    """Every curve of both solvers."""
    curves = record["curves"]["spread"]
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.6))
    for axis, (key, label, factor) in zip(
        axes, (("q/p", "q / p", 1), ("volumetric", "dilation, minus volumetric strain", -1), ("coordination", "coordination", 1))
    ):
        for solver, name, colour in (("nlgs", "NLGS", NLGS), ("dcs", "NSCDD (DCS), 8 subdomains", DCS)):
            for k, curve in enumerate(curves[key][solver]):
                line(axis, curves["axial"], factor * np.array(curve, float), color=colour, linewidth=0.9, alpha=0.85, label=None if k else name)
        axis.set(xlabel=AXIAL, ylabel=label)
    axes[1].legend(loc="lower right")
    return figure


def draw_shear(record):
    """Strength, dilation, solid fraction of the core and coordination of all tests."""
    figure, axes = plt.subplots(2, 2, figsize=(9, 6.4), sharex=True)
    for name, (label, colour, style) in SHEAR.items():
        told = record["curves"]["shear"].get(name)
        if not told:
            continue
        how = {"color": colour, "linestyle": style, "label": label}
        line(axes[0, 0], told["axial"], np.degrees(np.arcsin(np.array(told["sine"], float))), **how)
        line(axes[0, 1], told["axial"], -np.array(told["volumetric"], float), **how)
        if name != "biaxial":
            line(axes[1, 0], told["core"]["axial"], told["core"]["solid fraction"], **how)
        line(axes[1, 1], told["axial"], told["coordination"], **how)
    for axis, label in zip(
        axes.flat, ("friction angle that is mobilised, degrees", "dilation, minus volumetric strain", "solid fraction of spheres, core", "coordination")
    ):
        axis.set_ylabel(label)
    for axis in axes[1]:
        axis.set_xlabel(AXIAL)
    figure.legend(*axes[0, 1].get_legend_handles_labels(), loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3)
    return figure


def draw_fabric(record):
    """Anisotropy of the contacts; and where the work of the walls goes."""
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6))
    for name, (label, colour, style) in SHEAR.items():
        if told := record["curves"]["shear"].get(name):
            line(axes[0], told["axial"], told["fabric"], color=colour, linestyle=style, label=label)
    told = record["curves"]["shear"].get("triaxial") or next(iter(record["curves"]["shear"].values()))
    whole = np.array(told["work_walls total"], float)
    for key, label, colour in (("dissipated_friction", "friction", SUBDOMAINS[3]), ("dissipated_impact", "impact", SUBDOMAINS[2])):
        line(axes[1], told["axial"], np.array(told[f"{key} total"], float) / whole, color=colour, label=label)
    axes[0].set(xlabel=AXIAL, ylabel="fabric, axial less lateral")
    axes[1].set(xlabel=AXIAL, ylabel="dissipated, over work of the walls", ylim=(0, 1.05))
    axes[1].legend(loc="center right")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="lower center", bbox_to_anchor=(0.5, 1.0), ncol=3)
    return figure


def draw_forces(record):
    """P(f), and the exponential that fits above the mean."""
    figure, axis = plt.subplots(figsize=(5.6, 4))
    for name, (label, colour, marker) in FORCES.items():
        if not (told := record["curves"].get("forces", {}).get(name)):
            continue
        f, density, counts = (np.array(told[key], float) for key in ("f", "P", "counts"))
        some = counts >= 5
        axis.plot(f[some], density[some], marker, color=colour, markersize=3.5, markerfacecolor="none", label=label)
        if told["decay"] is not None:
            x = np.array([1, f[some].max()]) if some.any() else np.array([1, 2])
            start = told.get("at the mean") or told["above the mean"] * told["decay"]
            axis.plot(x, start * np.exp(-told["decay"] * (x - 1)), color=colour, linewidth=1, label=f"exp(-{told['decay']:.2f} f)")
    axis.set(yscale="log", xlabel="normal force over its mean, f", ylabel="P(f)")
    axis.axvline(1, color=INK, linewidth=0.6, linestyle=":")
    axis.legend(fontsize=9)
    return figure


FIGURES = {"physics-agreement": draw_agreement, "physics-shear": draw_shear, "physics-fabric": draw_fabric, "physics-forces": draw_forces}
NEEDS = {"physics-agreement": "spread", "physics-shear": "shear", "physics-fabric": "shear", "physics-forces": "forces"}


def drawable(record, name):
    return bool(record["curves"].get(NEEDS[name]))


def write_svg(record, name, folder):
    return save(FIGURES[name](record), folder, name)


def value_text(row):
    if row["ours"] is None:
        return tables.NONE
    value = f"{row['ours']:.4g}" if abs(row["ours"]) >= 1e-3 else tables.number(row["ours"])
    return value + (f" \u00b1 {row['error']:.1g}" if row["error"] else "")


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
        unit = {"1": "", "degrees": "\u00b0"}[row["unit"]]
        told = f"{row['verdict']}{': ' + row['why'] if row['why'] else ''}"
        note = f"<br><i>{escape(row['note'])}</i>" if row["note"] else ""
        cells = [wrapped(escape(row["quantity"]) + note, 20), value_text(row) + unit, wrapped(published_text(row), 10), wrapped(escape(row["rule"]), 12)]
        cells += [(wrapped(escape(told), 10), MARK[row["verdict"]]), ", ".join(number[reference] for reference in row["source"].split("; "))]
        lines.append(cells)
    head = ["quantity | ours | published | rule | verdict | sources"]
    return tables.table(head, lines, "Granular physics beside published numbers")


CAPTIONS = {
    "physics-agreement": (
        "One test, two solvers",
        "Triaxial compression of 2,000 spheres, friction 0.3: four runs by sequential NLGS and four by NSCDD on 8 subdomains, "
        "each from positions that differ by 10\u207b\u2079 of a radius. Rigid grains amplify any difference, so the curves of one "
        "solver part too: NSCDD is right if its curves are among them, which a permutation test judges (table).",
    ),
    "physics-shear": (
        "Shear to the critical state",
        "Friction angle, dilation, solid fraction and coordination against logarithmic axial strain. Rigid grains have no "
        "elastic strain: the strength is there from the first steps. The solid fraction is that two diameters and more "
        "away from the walls.",
    ),
    "physics-fabric": (
        "Fabric and energy",
        "Left: anisotropy of the contacts, the difference of the components of the mean of n \u2297 n along the "
        "axis and across. The table compares what it makes of the stress ratio; no published number of the anisotropy itself, at this "
        "friction and loading, could be read in its source. Right: of the work that the walls have done, "
        "spheres with friction 0.3, what friction and impact "
        "have dissipated.",
    ),
    "physics-forces": (
        "Forces",
        "Density of the normal forces between grains over their mean, of many frames, and the exponential that fits best above "
        "the mean. Bins with less than five forces are left out.",
    ),
}


def section(results, out):
    return [part for record in results.records("physics") for part in parts_of(record, out)]


def parts_of(record, out):
    counts = {verdict: sum(row["verdict"] == verdict for row in record["rows"]) for verdict in MARK}
    yield (f"<p>{len(record['rows'])} comparisons: {counts['agrees']} agree, {counts['differs']} differ, " f"{counts['cannot be told']} cannot be told.</p>")
    yield from quick(record)
    source = origin([record])
    caption = (
        "Each result beside a published number. A verdict allows the published number or range, and a margin of ours for other samples "
        "and loadings, which the rule states; errors are standard errors of means in time. Where a result is outside by less than two of "
        "them, nothing can be told. Published numbers are quoted; few were checked in the papers for this page (published.py says which)."
    )
    yield table_block(row_table(record), "Granular physics beside published numbers", caption, source, wide=True)
    yield "<p>Sources:</p><ol>" + "".join(f"<li>{escape(reference)}</li>" for reference in references(record)) + "</ol>"
    for name, (title, caption) in CAPTIONS.items():
        if drawable(record, name):
            yield figure_block(write_svg(record, name, out), title, caption, source, wide=True)
