"""How far accepted steps of random scenes are from the answer: tables and section of the page."""
import math
from html import escape

from ...page import tables
from ...page.page import origin, quick, table_block


def number(value):
    return "infinite" if value is None else tables.number(value)


def beyond(count):
    return (tables.count(count), "bad") if count else "0"


def spread_table(record, by):
    """Steps, and the spread of the distance and of the energy gain, by solver or by family, the worst first."""
    rows = [row for row in record["rows"] if row["by"] == by]
    rows.sort(key=lambda row: (row["name"] == "all", -(math.inf if row["distance"]["largest"] is None else row["distance"]["largest"])))
    columns = f"{by} | accepted | refused | refused, near | median | 99 % | largest | beyond 0.3 | 99 % | largest | beyond 1e-3"
    head = [" | steps *3 | distance, worst component *4 | energy gain *3", columns]
    lines = []
    for row in rows:
        far, made = row["distance"], row["energy_gain"]
        cells = [escape(row["name"]), *(tables.count(row[key]) for key in ("accepted", "refused", "refused_near"))]
        cells += [*(number(far[key]) for key in ("median", "of_99", "largest")), beyond(far["beyond"]), *(number(made[key]) for key in ("of_99", "largest"))]
        cells += [beyond(made["beyond"])]
        lines.append(cells)
    return tables.table(head, lines, f"Random scenes by {by}")


def worst_table(record, most=20):
    """The accepted steps farthest from the answer, beside what the solver said of them."""
    head = ["seed | family | solver | contacts | iterations | gap error | estimate | distance, scene | distance, worst component | of contacts | energy gain"]
    lines = []
    for row in record["worst"][:most]:
        cells = [str(row["seed"]), escape(f"{row['family']}, {row['dimension']}D")]
        cells += [escape(row["solver"] + (f" on {row['subdomains']}" if row["subdomains"] > 1 else "")), tables.count(round(row["contacts"]))]
        cells += [tables.count(row["iterations"]), *(number(row[key]) for key in ("gap_error", "estimate", "scene_distance", "distance"))]
        cells += [tables.count(round(row["contacts_component"])), number(row["energy_gain"])]
        lines.append(cells)
    return tables.table(head, lines, "Accepted steps, the farthest from the answer first")


def section(results, out):
    """What both measures of accepted steps are worth in random scenes, worst first."""
    parts = []
    for record in results.records("wild"):
        parts += quick(record)
        source, skipped = origin([record]), record["not_judged"]
        distance = tables.symbols("|V - V*|_M / |V* - V_free|_M")
        caption = (
            f"{tables.count(record['scenes'])} random scenes, most of them built to fool the tests of convergence. V*: the answer by an "
            f"active-set method of its own, in scenes without friction. Distance: {distance} of the worst component; energy gain by "
            "the contacts of a component, in all scenes. Refused: not converged at the cap of iterations; near: of them those within 0.3 of the "
            f"answer. Not judged: {tables.count(skipped['no_room'])} steps whose law no velocities satisfy, "
            f"{tables.count(skipped['no_answer'])} that the judge did not solve."
        )
        parts += [
            table_block(
                spread_table(record, by), f"Random scenes by {by}, worst first", caption if by == "solver" else "As above.", source, ("counted",), wide=True
            )
            for by in ("solver", "family")
        ]
        caption = (
            "Gap error: the step is proven to be exact for gaps that differ by at most this share of the contact's radius. Estimate: what the solver "
            "said of the distance of the worst component. Seed: <code>wild_scenes --scenes 1 --seed</code> makes the scene again."
        )
        parts.append(
            table_block(worst_table(record), "Accepted steps of random scenes, the farthest from the answer first", caption, source, ("counted",), wide=True)
        )
    return parts
