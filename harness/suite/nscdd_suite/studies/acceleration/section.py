"""What acceleration saves: tables and section of the page."""
import math
from html import escape

from ...page.page import origin, quick, table_block
from ...page.tables import NONE, count, number, table


def saved(record):
    """Both methods side by side, and their ratios; growth is over the iterations of one subdomain."""
    rows = {(row["scene"], row["subdomains"], row["method"]): row for row in record["rows"]}
    lines = []
    for scene, subdomains in dict.fromkeys(key[:2] for key in rows):
        plain, fast, alone = (rows.get(key) for key in ((scene, subdomains, "paper"), (scene, subdomains, "auto"), (scene, 1, "auto")))
        if not plain or not fast:
            continue
        pair = [
            number(value) if row["converged"] else f"{number(value)} (not converged)"
            for row, value in ((plain, plain["iterations"] / plain["steps"]), (fast, fast["iterations"] / fast["steps"]))
        ]
        cells = [escape(scene), f"{plain['start']}, {plain['steps']}", count(plain["grains"]), count(round(plain["contacts"])), str(subdomains), *pair]
        cells += [number(fast["iterations"] / plain["iterations"]), number(fast["iterations"] / alone["iterations"]) if alone else NONE, number(plain["cpu"])]
        cells += [number(fast["cpu"]), number(fast["cpu"] / plain["cpu"]) if plain["cpu"] else NONE]
        lines.append(cells)
    columns = "scene | start, steps | grains | contacts | subdomains | plain | accelerated | ratio | growth | plain | accelerated | ratio"
    head = [" *5 | iterations a step *4 | CPU time [s] *3", columns]
    return table(head, lines, "What acceleration saves")


def cost_ratio(row):
    plain, fast = row["paper"]["cpu"], row["auto"]["cpu"]
    return fast / plain if min(plain, fast) > 0 else 1.0  # too short for the clock


def hard_costs(record, noise):
    """The hard cases that cost more accelerated, dearest first."""
    lines = []
    for row in sorted(record["hard"], key=cost_ratio, reverse=True):
        if cost_ratio(row) <= 1 + noise:
            break
        plain, fast = row["paper"], row["auto"]
        both = [count(solved["iterations"]) if solved["converged"] else f"{count(solved['iterations'])} (not converged)" for solved in (plain, fast)]
        cells = [escape(row["scene"]), count(row["steps"]), count(round(row["contacts"])), *both, number(1e6 * plain["cpu"]), number(1e6 * fast["cpu"])]
        cells += [number(cost_ratio(row))]
        lines.append(cells)
    head = [" *3 | iterations, all steps *2 | CPU time [\u00b5s] *3", "scene | steps | contacts,<br>most | plain | accelerated | plain | accelerated | ratio"]
    return table(head, lines, "Hard cases that cost more accelerated")


def section(results, out):
    parts = []
    for record in results.records("acceleration"):
        parts += quick(record)
        caption = (
            "Iterations and CPU time of the solver to \u03b7 = 1e-4 by the paper's own method and accelerated. Warm: all steps "
            "of a scene, each from the impulses of the one before; cold: one step from none. One subdomain is sequential NLGS; more "
            "are NSCDD by DCS, in process, whose subdomains take turns on one core: CPU time is the work of all."
        )
        if record["rows"]:
            parts.append(table_block(saved(record), "What acceleration saves", caption, origin([record]), ("counted", "measured"), wide=True))
        if record.get("hard"):
            noise = 0.05
            ratios = [cost_ratio(row) for row in record["hard"]]
            caption = (
                f"Hard cases by NLGS to the tolerance of each scene, medians of CPU times. Of {len(ratios)}, accelerated ones cost "
                f"less in {sum(r < 1 - noise for r in ratios)}, the same within {100 * noise:.0f} % in "
                f"{sum(abs(r - 1) <= noise for r in ratios)}, more in {sum(r > 1 + noise for r in ratios)}, listed here; geometric "
                f"mean of the ratios {math.exp(sum(map(math.log, ratios)) / len(ratios)):.2f}."
            )
            parts.append(
                table_block(hard_costs(record, noise), "Hard cases that cost more accelerated", caption, origin([record]), ("counted", "measured"), wide=True)
            )
    return parts
