"""How far accepted steps of random scenes are from the answer."""
import math
from html import escape

from . import tables


def number(value):
    return "infinite" if value is None else tables.number(value)


def beyond(count):
    return (tables.count(count), "bad") if count else "0"


def spread_table(record, by):
    """Steps, and the spread of the distance and of the energy made, by solver or by family, the worst first."""
    rows = [row for row in record["rows"] if row["by"] == by]
    rows.sort(key=lambda row: (row["name"] == "all", -(math.inf if row["distance"]["largest"] is None else row["distance"]["largest"])))
    head = [[("", 1), ("steps", 3), ("distance, worst component", 4), ("energy made", 3)],
            [(by, 1), ("accepted", 1), ("refused", 1), ("refused, near", 1), ("median", 1), ("99 %", 1), ("largest", 1), ("beyond 0.3", 1),
             ("99 %", 1), ("largest", 1), ("beyond 1e-3", 1)]]
    lines = []
    for row in rows:
        far, made = row["distance"], row["energy_made"]
        lines.append([escape(row["name"]), *(tables.count(row[key]) for key in ("accepted", "refused", "refused_near")),
                      *(number(far[key]) for key in ("median", "of_99", "largest")), beyond(far["beyond"]),
                      *(number(made[key]) for key in ("of_99", "largest")), beyond(made["beyond"])])
    return tables.table(head, lines, f"Random scenes by {by}")


def worst_table(record, most=20):
    """The accepted steps farthest from the answer, beside what the solver said of them."""
    head = [[(name, 1) for name in ("seed", "family", "solver", "contacts", "iterations", "gap error", "estimate", "distance, scene", "distance, worst component",
                                    "of contacts", "energy made")]]
    lines = [[str(row["seed"]), escape(f"{row['family']}, {row['dimension']}D"),
              escape(row["solver"] + (f" on {row['subdomains']}" if row["subdomains"] > 1 else "")), tables.count(round(row["contacts"])),
              tables.count(row["iterations"]), *(number(row[key]) for key in ("gap_error", "estimate", "scene_distance", "distance")),
              tables.count(round(row["contacts_component"])), number(row["energy_made"])] for row in record["worst"][:most]]
    return tables.table(head, lines, "Accepted steps, the farthest from the answer first")
