"""Figure and tables of what eta and the velocity error say of the distance to the answer, and what a velocity error costs."""
import math
from html import escape

from ...page import tables
from ...page.style import SUBDOMAINS, plt

MEASURES = (("eta", "\u03b7"), ("velocity_error", "velocity error"))
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
    for axis, (measure, label) in zip(axes, MEASURES):
        for (family, rows), colour in zip(families(record).items(), SUBDOMAINS):
            for accelerated, marker in ((False, "o"), (True, "x")):
                drawn = pairs([row for row in rows if ("auto" in row["method"]) == accelerated], measure)
                axis.plot(*(zip(*drawn) if drawn else ([], [])), marker, color=colour, markersize=3.5, markeredgewidth=0.9, markerfacecolor="none")
        ends = (1e-9, 3.0)
        for factor, style in ((1, "-"), (3, ":"), (1 / 3, ":")):
            axis.plot(ends, [factor * x for x in ends], style, color="#222222", linewidth=0.8)
        axis.set(xscale="log", yscale="log", xlabel=label, xlim=(1e-9, 3.0), ylim=(1e-8, 3.0))
    axes[0].set_ylabel("distance of the velocities")
    axes[0].legend(
        handles=[
            plt.Line2D([], [], linestyle="", marker=marker, color="#222222", markersize=3.5, markerfacecolor="none", label=label)
            for marker, label in (("o", "plain"), ("x", "accelerated"))
        ],
        loc="upper left",
        fontsize=9,
    )
    axes[1].legend(
        handles=[plt.Line2D([], [], color=colour, linewidth=3, label=FAMILIES[family]) for family, colour in zip(families(record), SUBDOMAINS)],
        loc="lower right",
        fontsize=9,
    )
    return figure


def ratio_table(record):
    """By family and measure: the distance over the measure, least, middle and most, and the spread of its logarithm."""
    lines = []
    groups = [*families(record).items(), ("all", record["rows"])]
    for family, rows in groups:
        cells = [escape(FAMILIES.get(family, "all")), str(len({row["case"] for row in rows})), str(len(rows))]
        for measure, _ in MEASURES:
            ratios = sorted(math.log10(distance / value) for value, distance in pairs(rows, measure))
            if not ratios:
                cells += [tables.NONE] * 4
                continue
            mean = sum(ratios) / len(ratios)
            spread = math.sqrt(sum((x - mean) ** 2 for x in ratios) / len(ratios))
            cells += [tables.number(10**x) for x in (ratios[0], ratios[len(ratios) // 2], ratios[-1])] + [f"{spread:.2f}"]
        lines.append(cells)
    above = ["", "", "", *[(f"distance over {label}", 4) for _, label in MEASURES]]
    head = [above, " | cases | iterates" + 2 * " | least | median | most | spread, decades"]
    return tables.table(head, lines, "Distance over \u03b7 and over the velocity error")


def level(rows, measure, distance):
    """Below this value of the measure every row is within the distance."""
    return min((row[measure] for row in rows if row["distance"] > distance and row[measure] is not None), default=None)


def iterations_at(rows, measure, value):
    """Iterations until the measure is so small, between rows in logarithms; None where no row gets there."""
    before = None
    for row in sorted(rows, key=lambda row: row["iterations"]):
        if row[measure] is not None and row[measure] <= value:
            if before is None or not (row[measure] > 0 and before["iterations"] > 0):
                return row["iterations"]
            part = math.log(before[measure] / value) / math.log(before[measure] / row[measure])
            return math.exp((1 - part) * math.log(before["iterations"]) + part * math.log(row["iterations"]))
        before = row if row[measure] else before
    return None


def reduced(record):
    """{(method, start): {scene: rows}} of the reduced scenes."""
    groups = {}
    for row in record["rows"]:
        if row["family"] == "reduced":
            groups.setdefault((row["method"], row["start"]), {}).setdefault(row["case"], []).append(row)
    return groups


def certainty(record):
    """{distance: (the level of each measure, {(method, start): iterations of all reduced scenes to each level, None where one does not get there})}."""
    found = {}
    for distance in DISTANCES:
        levels = [level(record["rows"], measure, distance) for measure, _ in MEASURES]
        iterations = {}
        for key, cases in reduced(record).items():
            each = [[iterations_at(rows, measure, value) if value else None for rows in cases.values()] for (measure, _), value in zip(MEASURES, levels)]
            iterations[key] = [None if None in counts else sum(counts) for counts in each]
        found[distance] = levels, iterations
    return found


def unreached(record):
    """Methods and starts by which the reduced scenes reach no level: they have no column."""
    found = certainty(record)
    return [
        f"{method}, {start}"
        for method, start in reduced(record)
        if not any(count is not None for _, iterations in found.values() for count in iterations[method, start])
    ]


def level_table(record):
    """What must be asked of each measure to be sure of a distance, and the iterations of the reduced scenes to it where they get there."""
    left_out = unreached(record)
    groups = [key for key in reduced(record) if ", ".join(key) not in left_out]
    lines = []
    for distance, (levels, iterations) in certainty(record).items():
        cells = [tables.number(distance), *[tables.number(value) if value else tables.NONE for value in levels]]
        cells += [tables.NONE if count is None else tables.count(round(count)) for key in groups for count in iterations[key]]
        lines.append(cells)
    above = ["", ("below", 2), *[(f"{escape(method)}, {start}", 2) for method, start in groups]]
    head = [above, ["distance", *[label for _, label in MEASURES] * (1 + len(groups))]]
    return tables.table(head, lines, "What each measure must be for a distance")


def cost_table(record):
    """Iterations to eta = 1e-4 and each velocity error, by eta alone and over that."""
    asked = list(dict.fromkeys(row["allowed"] for row in record["cost"] if row["allowed"] is not None))
    lines = []
    for key in dict.fromkeys((row["start"], row["case"], row["method"]) for row in record["cost"]):
        own = {row["allowed"]: row for row in record["cost"] if (row["start"], row["case"], row["method"]) == key}
        alone = own[None]
        cells = [
            escape(key[1]),
            key[0],
            escape(key[2]),
            str(alone["steps"]),
            tables.count(alone["iterations"]),
            tables.number(alone["velocity_error"]) if alone["velocity_error"] is not None else tables.NONE,
        ]
        for allowed in asked:
            row = own[allowed]
            ratio = tables.number(row["iterations"] / max(1, alone["iterations"]))
            cells.append(ratio if row["converged"] else (ratio, "bad"))
        lines.append(cells)
    head = [
        "scene | start | method | steps | iterations by \u03b7 alone | its largest velocity error"
        + "".join(f" | times, \u2264 {allowed:g}" for allowed in asked)
    ]
    return tables.table(head, lines, "Iterations to a velocity error")
