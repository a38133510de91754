"""How far accepted steps of random scenes are from the answer: tables and section of the page."""
import math
from html import escape

from ...page import tables
from ...page.page import Block, captions

CAPTIONS = captions(__file__)


def number(value):
    return "infinite" if value is None else value


def beyond(count):
    return count, "bad" if count else ""


def spread_table(record, by):
    """Steps, and the spread of the distance and of the energy gain, by solver or by family, the worst first."""
    rows = [row for row in record["rows"] if row["by"] == by]
    rows.sort(key=lambda row: (row["name"] == "all", -(math.inf if row["distance"]["largest"] is None else row["distance"]["largest"])))
    columns = f"{by} | accepted | refused | refused, near | median | 99 % | largest | beyond 0.3 | 99 % | largest | beyond 1e-3"
    lines = []
    for row in rows:
        far, made = row["distance"], row["energy_gain"]
        cells = [escape(row["name"]), *(row[key] for key in ("accepted", "refused", "refused_near"))]
        cells += [*(number(far[key]) for key in ("median", "of_99", "largest")), beyond(far["beyond"])]
        lines.append([*cells, number(made["of_99"]), number(made["largest"]), beyond(made["beyond"])])
    return tables.table([" | steps *3 | distance, worst component *4 | energy gain *3", columns], lines, f"Random scenes by {by}")


def worst_table(record, most=20):
    """The accepted steps farthest from the answer, beside what the solver said of them."""
    head = "seed | family | solver | contacts | iterations | gap error | estimate | distance, scene | distance, worst component | of contacts | energy gain"
    lines = []
    for row in record["worst"][:most]:
        solver = row["solver"] + (f" on {row['subdomains']}" if row["subdomains"] > 1 else "")
        cells = [str(row["seed"]), escape(f"{row['family']}, {row['dimension']}D"), escape(solver), round(row["contacts"]), row["iterations"]]
        cells += [number(row[key]) for key in ("gap_error", "estimate", "scene_distance", "distance")]
        lines.append([*cells, round(row["contacts_component"]), number(row["energy_gain"])])
    return tables.table([head], lines, "Accepted steps, the farthest from the answer first")


def parts(record, source, out):
    numbers = {key: tables.count(value) for key, value in (record["not_judged"] | {"scenes": record["scenes"]}).items()}
    caption = CAPTIONS["rows"].format(**numbers, distance=tables.symbols("|V - V*|_M / |V* - V_free|_M"))
    for by, text in (("solver", caption), ("family", "As above.")):
        yield Block(spread_table(record, by), f"Random scenes by {by}, worst first", text, source, ("counted",), wide=True)
    heading = "Accepted steps of random scenes, the farthest from the answer first"
    yield Block(worst_table(record), heading, CAPTIONS["worst"], source, ("counted",), wide=True)
