"""What a converged step is worth: the section of the page on eta and the velocity error."""
import math
from html import escape

from ...page import tables
from ...page.page import Block, captions, figure_block
from ...page.style import INK, SUBDOMAINS, plt, save
from ..accuracy.levels import at_level

MEASURES = {"eta": "\u03b7", "velocity_error": "velocity error"}
DISTANCES = (0.3, 0.1, 0.03, 0.01)
FAMILIES = {"packing": "packings", "reduced": "reduced scenes of the paper", "column": "columns and lids", "mass": "mass ratios", "radius": "radius ratios"}


def pairs(rows, measure):
    """(measure, distance) of all rows where both have a logarithm."""
    return [(row[measure], row["distance"]) for row in rows if row[measure] and row["distance"]]


def families(record):
    """{family: its rows}, in the order of FAMILIES."""
    found = {key: [row for row in record["rows"] if row["family"] == key] for key in FAMILIES}
    return {key: rows for key, rows in found.items() if rows}


def draw(record):
    """Distance against each measure; the diagonal, and a factor of three on both sides."""
    figure, axes = plt.subplots(1, 2, figsize=(8.6, 4.0), sharey=True)
    marks = {"plain": "o", "accelerated": "x"}
    for axis, (measure, label) in zip(axes, MEASURES.items()):
        for (family, rows), colour in zip(families(record).items(), SUBDOMAINS):
            for name, marker in marks.items():
                drawn = pairs([row for row in rows if ("auto" in row["method"]) == (name == "accelerated")], measure)
                axis.plot(*(zip(*drawn) if drawn else ([], [])), marker, color=colour, markersize=3.5, markeredgewidth=0.9, markerfacecolor="none")
        for factor, style in ((1, "-"), (3, ":"), (1 / 3, ":")):
            axis.plot((1e-9, 3.0), [factor * 1e-9, factor * 3.0], style, color=INK, linewidth=0.8)
        axis.set(xscale="log", yscale="log", xlabel=label, xlim=(1e-9, 3.0), ylim=(1e-8, 3.0))
    axes[0].set_ylabel("distance of the velocities")
    how = {"linestyle": "", "color": INK, "markersize": 3.5, "markerfacecolor": "none"}
    axes[0].legend(handles=[plt.Line2D([], [], marker=marker, label=name, **how) for name, marker in marks.items()], loc="upper left", fontsize=9)
    lines = [plt.Line2D([], [], color=colour, linewidth=3, label=FAMILIES[family]) for family, colour in zip(families(record), SUBDOMAINS)]
    axes[1].legend(handles=lines, loc="lower right", fontsize=9)
    return figure


def ratio_table(record):
    """By family and measure: the distance over the measure, least, middle and most, and the spread of its logarithm."""
    lines = []
    for family, rows in [*families(record).items(), ("all", record["rows"])]:
        cells = [FAMILIES.get(family, "all"), len({row["case"] for row in rows}), str(len(rows))]
        for measure in MEASURES:
            ratios = sorted(math.log10(distance / value) for value, distance in pairs(rows, measure))
            if not ratios:
                cells += [None] * 4
                continue
            mean = sum(ratios) / len(ratios)
            spread = math.sqrt(sum((x - mean) ** 2 for x in ratios) / len(ratios))
            cells += [10 ** ratios[0], 10 ** ratios[len(ratios) // 2], 10 ** ratios[-1], f"{spread:.2f}"]
        lines.append(cells)
    above = ["", "", "", *[(f"distance over {label}", 4) for label in MEASURES.values()]]
    head = [above, " | cases | iterates" + 2 * " | least | median | most | spread, decades"]
    return tables.table(head, lines, "Distance over \u03b7 and over the velocity error")


def level(rows, measure, distance):
    """Below this value of the measure every row is within the distance."""
    return min((row[measure] for row in rows if row["distance"] > distance and row[measure] is not None), default=None)


def certainty(record):
    """The level of each measure at each distance; and {method and start: iterations of all reduced scenes to each of these levels, None
    where one does not get there}."""
    levels, groups = [(measure, level(record["rows"], measure, distance)) for distance in DISTANCES for measure in MEASURES], {}
    for row in record["rows"]:
        if row["family"] == "reduced":
            groups.setdefault(f"{row['method']}, {row['start']}", {}).setdefault(row["case"], []).append(row)

    def iterations(cases, measure, value):
        each = [at_level(rows, value, "iterations", measure) if value else None for rows in cases.values()]
        return None if None in each else round(sum(each))

    return [value or None for _, value in levels], {group: [iterations(cases, *one) for one in levels] for group, cases in groups.items()}


def unreached(iterations):
    """Methods and starts by which the reduced scenes reach no level: they have no column."""
    return [group for group, counts in iterations.items() if set(counts) == {None}]


def level_table(levels, iterations):
    """What must be asked of each measure to be sure of a distance, and the iterations of the reduced scenes to it where they get there."""
    groups = {group: counts for group, counts in iterations.items() if group not in unreached(iterations)}
    columns = [levels, *groups.values()]
    lines = [[distance, *(value for column in columns for value in column[2 * k : 2 * k + 2])] for k, distance in enumerate(DISTANCES)]
    above = ["", ("below", 2), *[(escape(group), 2) for group in groups]]
    return tables.table([above, ["distance", *list(MEASURES.values()) * len(columns)]], lines, "What each measure must be for a distance")


def cost_table(record):
    """Iterations to eta = 1e-4 and each velocity error, by eta alone and over that."""
    asked = list(dict.fromkeys(row["allowed"] for row in record["cost"] if row["allowed"] is not None))
    rows, lines = {(row["start"], row["case"], row["method"], row["allowed"]): row for row in record["cost"]}, []
    for start, case, method in dict.fromkeys(key[:3] for key in rows):
        alone = rows[start, case, method, None]
        cells = [escape(case), start, escape(method), alone["steps"], alone["iterations"], alone["velocity_error"]]
        for row in (rows[start, case, method, allowed] for allowed in asked):
            cells.append((row["iterations"] / max(1, alone["iterations"]), "" if row["converged"] else "bad"))
        lines.append(cells)
    times = "".join(f" | times, \u2264 {value:g}" for value in asked)
    head = "scene | start | method | steps | iterations by \u03b7 alone | its largest velocity error" + times
    return tables.table([head], lines, "Iterations to a velocity error")


def parts(record, source, out):
    texts = captions(__file__)
    caption = texts["distances"].format(distance=tables.symbols("|V - V*|_M / |V* - V_free|_M"))
    yield figure_block(save(draw(record), out, "velocity-error"), "Distance against \u03b7 and against the velocity error", caption, source, wide=True)
    yield Block(ratio_table(record), "The distance over each measure", texts["ratios"], source, wide=True)
    levels, iterations = certainty(record)
    left_out = unreached(iterations)
    caption = texts["levels"] + (texts["price"] if len(left_out) < len(iterations) else ".")
    if left_out:
        caption += " " + texts["left_out"].format(left_out=escape("; ".join(left_out)))
    yield Block(level_table(levels, iterations), "What a measure must be for a distance", caption, source, wide=True)
    if record["cost"]:
        yield Block(cost_table(record), "Iterations to a velocity error", texts["cost"], source, ("counted",), wide=True)
