"""Hard cases: the section of the page, family by family, with sweeps of columns, and orders."""
import functools
import re
from html import escape

from ...page import tables
from ...page.page import Block, captions, figure_block, origin, warnings
from ...page.style import CCS, DCS, NLGS, SUBDOMAINS, plt, save

RELATIONS = {"=": "", "<=": "\u2264\u202f", ">=": "\u2265\u202f"}


hard_ok = functools.partial(tables.row_ok, key="error")


def schemes_of(rows):
    return list(dict.fromkeys((row["scheme"], row["subdomains"]) for row in rows))


def all_rows(rows):
    """All rows, folded by family; those of a family with an error beyond its bound are open."""
    for family in dict.fromkeys(row["family"] for row in rows):
        own = [row for row in rows if row["family"] == family]
        good, scenes = sum(map(hard_ok, own)), len({row["case"] for row in own})
        summary = f"<summary>{escape(family)}: {good} of {len(own)} rows of {scenes} scenes within their bounds</summary>"
        yield f'<details{"" if good == len(own) else " open"}>{summary}{family_table(own, schemes_of(rows))}</details>'


def family_table(rows, schemes):
    """One line per case and quantity: what is expected and allowed, then what each scheme found, how far off, in how many iterations.
    Where a scheme has another expectation or bound than the first, its cell says so."""
    lines, notes = [], [f'<p>{escape(row["case"])}, {escape(row["scheme"])}: {escape(row["note"])}</p>' for row in rows if "note" in row]
    for case, quantity in dict.fromkeys((row["case"], row["quantity"]) for row in rows):
        by_scheme = {(row["scheme"], row["subdomains"]): row for row in rows if (row["case"], row["quantity"]) == (case, quantity)}
        first, cells = next(iter(by_scheme.values())), []
        for row in map(by_scheme.get, schemes):
            if row is None:
                cells.append(None)
                continue
            more = [f"off {tables.number(row['error'])}", f"{tables.count(row['iterations'])} it."]
            more += [f"{key} {tables.number(row[key])}" for key in ("expected", "bound") if row[key] != first[key]]
            more += [f"exit code {row['exit']}"] if row.get("exit") else []
            cells.append(("<br>".join([tables.number(row["found"]), *(f"<i>{line}</i>" for line in more)]), "" if hard_ok(row) else "bad"))
        asked = [RELATIONS[first["relation"]] + tables.number(first["expected"]), tables.number(first["bound"])]
        lines.append([escape(case), tables.symbols(quantity), *asked, *cells, tables.symbols(first["bound_from"])])
    found = [f"{escape(name.upper())}{f', {n} subdomains' if n > 1 else ''}" for name, n in schemes]
    return tables.table([["case", "quantity", "expected", "bound", *found, "bound from"]], lines, f"Hard cases: {rows[0]['family']}") + "".join(notes)


def draw_columns(rows):
    """Iterations of columns against their height, or None if there are not two heights."""
    points = {}
    for row in rows:
        match = re.match(r"column-(\d+)-3d", row["case"])
        if match and row["relation"] == "<=" and row["found"] is not None:
            points.setdefault((row["scheme"], row["subdomains"]), []).append((int(match[1]), row["found"], row["expected"]))
    if max(map(len, points.values()), default=0) < 2:
        return None
    figure, axis = plt.subplots(figsize=(4.6, 3.2))
    for (scheme, subdomains), values in points.items():
        n, found, bound = zip(*sorted(values))
        colour = SUBDOMAINS[(subdomains - 1) % len(SUBDOMAINS)]
        look = {"marker": "s", "markerfacecolor": "none", "markersize": 8} if subdomains > 1 else {"marker": "o", "markersize": 5}
        axis.plot(n, bound, color=colour, linewidth=1.1)
        axis.plot(n, found, linestyle="", color=colour, label=f"{scheme.upper()}, {subdomains}", **look)
    axis.set(xscale="log", yscale="log", xlabel="N", ylabel="iterations")
    axis.legend(loc="upper left")
    return figure


def draw_orders(rows):
    """Errors against step sizes, a panel per family, a line per theta; or None. Of the first scheme, in 3D: the others'
    are the same to the tolerance."""
    series = {}
    for row in rows:
        if "series" in row and row["dimension"] == 3 and row["scheme"] == rows[0]["scheme"]:
            series.setdefault(row["family"], []).append(row)
    if not series:
        return None
    figure, axes = plt.subplots(1, len(series), figsize=(2.9 * len(series) + 0.4, 3.0), squeeze=False)
    for axis, (family, lines) in zip(axes[0], series.items()):
        for row, colour in zip(lines, (DCS, CCS) if len(lines) > 1 else (CCS,)):
            theta = row["quantity"].rpartition(", ")[2].replace("theta", "\u03b8")
            axis.plot(*zip(*row["series"]), "o-", color=colour, markersize=4, label=f"{theta}: {row['found']:.2f}")
        (h, error), (least, _) = lines[-1]["series"][0], lines[-1]["series"][-1]
        axis.plot([h, least], [2 * error, 2 * error * least / h], "--", color=NLGS, linewidth=1, label="order 1")
        axis.set(xscale="log", yscale="log", xlabel="h", title=family.removeprefix("order-"))
        axis.tick_params(axis="x", which="minor", labelbottom=False)
        axis.legend(loc="best")
    axes[0][0].set_ylabel("error of the place")
    return figure


def section(results, out):
    records = results.records("hard")
    rows = [row for record in records for row in record["rows"]]
    if not rows:
        return []
    results.summary["hard_rows"] = len(rows)
    results.good.append(f"All {len(rows)} rows of the hard cases are within their bounds.")
    for row in (row for row in rows if not hard_ok(row)):
        why = row.get("note") or f"error {tables.show(row['error'])} exceeds {row['bound']:.3g}"
        results.failures.append(f"hard case {row['case']} by {row['scheme']}: {row['quantity']}: {why}")
    texts, source = captions(__file__), "".join(origin([record]) for record in records)
    parts = [line for record in records for line in warnings(record)]
    caption = texts["rows"].format(scenes=len({row["case"] for row in rows}), schemes=len(schemes_of(rows)))
    parts.append(Block("\n".join(all_rows(rows)), "Hard cases by family", caption, source, wide=True))
    if figure := draw_columns(rows):
        parts.append(figure_block(save(figure, out, "hard-columns"), "Iterations of columns", texts["columns"], source, ("counted",)))
    if figure := draw_orders(rows):
        parts.append(figure_block(save(figure, out, "hard-orders"), "Error against step size", texts["orders"], source))
    return parts
