"""What acceleration saves: tables and section of the page."""
import statistics
from html import escape

from ...page.page import Block, captions
from ...page.tables import count, number, table

NOISE = 0.05  # of the ratio of two CPU times


def unless(converged, text):
    return text if converged else f"{text} (not converged)"


def saved(record):
    """Both methods side by side, and their ratios; growth is over the iterations of one subdomain."""
    rows, lines = {(row["scene"], row["subdomains"], row["method"]): row for row in record["rows"]}, []
    for scene, subdomains in dict.fromkeys(key[:2] for key in rows):
        plain, fast, alone = (rows.get(key) for key in ((scene, subdomains, "paper"), (scene, subdomains, "auto"), (scene, 1, "auto")))
        if not plain or not fast:
            continue
        cells = [escape(scene), f"{plain['start']}, {plain['steps']}", plain["grains"], round(plain["contacts"]), subdomains]
        cells += [unless(row["converged"], number(row["iterations"] / row["steps"])) for row in (plain, fast)]
        cells += [fast["iterations"] / plain["iterations"], fast["iterations"] / alone["iterations"] if alone else None]
        lines.append([*cells, plain["cpu"], fast["cpu"], fast["cpu"] / plain["cpu"] if plain["cpu"] else None])
    columns = "scene | start, steps | grains | contacts | subdomains | plain | accelerated | ratio | growth | plain | accelerated | ratio"
    return table([" *5 | iterations a step *4 | CPU time [s] *3", columns], lines, "What acceleration saves")


def cost_ratio(row):
    plain, fast = row["paper"]["cpu"], row["auto"]["cpu"]
    return fast / plain if min(plain, fast) > 0 else 1.0  # too short for the clock


def hard_costs(record):
    """The hard cases that cost more accelerated, dearest first."""
    lines = []
    for row in sorted((row for row in record["hard"] if cost_ratio(row) > 1 + NOISE), key=cost_ratio, reverse=True):
        both = row["paper"], row["auto"]
        cells = [escape(row["scene"]), row["steps"], round(row["contacts"]), *(unless(one["converged"], count(one["iterations"])) for one in both)]
        lines.append([*cells, *(1e6 * one["cpu"] for one in both), cost_ratio(row)])
    head = [" *3 | iterations, all steps *2 | CPU time [\u00b5s] *3", "scene | steps | contacts,<br>most | plain | accelerated | plain | accelerated | ratio"]
    return table(head, lines, "Hard cases that cost more accelerated")


def parts(record, source, out):
    texts, kinds = captions(__file__), ("counted", "measured")
    if record["rows"]:
        yield Block(saved(record), "What acceleration saves", texts["rows"], source, kinds, wide=True)
    if record.get("hard"):
        ratios = [cost_ratio(row) for row in record["hard"]]
        numbers = {"of": len(ratios), "noise": 100 * NOISE, "same": sum(abs(r - 1) <= NOISE for r in ratios)}
        numbers |= {"less": sum(r < 1 - NOISE for r in ratios), "more": sum(r > 1 + NOISE for r in ratios), "mean": statistics.geometric_mean(ratios)}
        yield Block(hard_costs(record), "Hard cases that cost more accelerated", texts["hard"].format(**numbers), source, kinds, wide=True)
