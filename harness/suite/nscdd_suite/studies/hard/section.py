"""Hard cases: the section of the page."""
from ...page import tables
from ...page.page import figure_block, origin, quick, table_block
from ...page.style import save
from . import figures


def section(results, out):
    records = results.records("hard")
    rows = [row for record in records for row in record["rows"]]
    if not rows:
        return []
    results.summary["hard_rows"] = len(rows)
    results.good.append(f"All {len(rows)} rows of the hard cases are within their bounds.")
    results.failures += [
        f"hard case {row['case']} by {row['scheme']}: {row['quantity']}: "
        + (row.get("note") or f"error {tables.show(row['error'])} exceeds {row['bound']:.3g}")
        for row in rows
        if not figures.hard_ok(row)
    ]
    schemes = list(dict.fromkeys((row["scheme"], row["subdomains"]) for row in rows))
    caption = (
        f"Hard cases, {len({row['case'] for row in rows})} scenes by {len(schemes)} schemes: the exact answer, what was "
        "found, how far it is off, and the bound, which comes from theory: of the accuracy asked for "
        "(<i>tolerance</i>), of the step (<i>O(h)</i>), of the arithmetic (<i>round-off</i>), or an inequality (<i>law</i>; "
        "its error is by how much it fails). Iterations are those of all steps: sweeps, glued after each where there are "
        "several subdomains. An error beyond its bound is in red, and its family open."
    )
    source = "".join(origin([record]) for record in records)
    parts = [line for record in records for line in quick(record)]
    parts += [table_block(figures.table(rows), "Hard cases by family", caption, source, wide=True)]
    figure = figures.draw_columns(rows)
    if figure:
        caption = (
            "Iterations of a column of <i>N</i> from zero impulses: counted (marks), and the most that the spectral radius of "
            "the iteration allows for the tolerance (lines), by number of subdomains."
        )
        parts.append(figure_block(save(figure, out, "hard-columns"), "Iterations of columns", caption, source, ("counted",)))
    figure = figures.draw_orders(rows)
    if figure:
        caption = (
            "Error of the places against the step size, 3D, with the observed order: sliding under constant friction, which "
            "\u03b8 = 1/2 follows exactly (no line); an impact with e = 0.5; a ball sinking into others, against much smaller "
            "steps."
        )
        parts.append(figure_block(save(figure, out, "hard-orders"), "Error against step size", caption, source))
    table = figures.energy_table(rows)
    if table:
        steps = max(row["steps"] for row in rows if row["family"] in figures.ENERGY)
        caption = (
            f"The largest gain of energy beyond what gravity and walls put in, over the largest energy so far, "
            f"in {tables.count(steps)} steps to the default tolerance; allowed 10\u207b\u2076. Pairs: two balls at rest, the upper so "
            "many times the heavier; heaps: one ball of so many times the radius on 1 or 16, of one density; rebounds: without "
            "friction, by Newton's e. (3): exit code 3, steps hit the cap of iterations, and the run says so; (1): refused, when the "
            "light ball between the heavy one and the floor passes a tenth of its radius in a step, judged until then."
        )
        parts.append(table_block(table, "Energy from nothing", caption, source, wide=True))
    return parts
