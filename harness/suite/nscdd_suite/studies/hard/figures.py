"""Figures and tables of the hard cases: family by family, sweeps of columns, orders, and energy from nothing."""
import re
from html import escape

from ...page import tables
from ...page.style import CCS, DCS, NLGS, SUBDOMAINS, plt

ENERGY = {"pair": "\u03bc =", "heap": "\u03bc =", "rebound": "e ="}  # families of the long runs: the last number of their names
RELATIONS = {"=": "", "<=": "\u2264\u202f", ">=": "\u2265\u202f"}


def hard_ok(row):
    return row["ok"] and row["error"] is not None and row["error"] <= row["bound"]


def table(rows):
    """All rows, folded by family; those of a family with an error beyond its bound are open."""
    schemes = list(dict.fromkeys((row["scheme"], row["subdomains"]) for row in rows))
    parts = []
    for family in dict.fromkeys(row["family"] for row in rows):
        own = [row for row in rows if row["family"] == family]
        good = sum(map(hard_ok, own))
        parts.append(
            f'<details{"" if good == len(own) else " open"}><summary>{escape(family)}: {good} of {len(own)} rows of '
            f'{len({row["case"] for row in own})} scenes within their bounds</summary>{family_table(own, schemes)}'
            "</details>"
        )
    return "\n".join(parts)


def family_table(rows, schemes):
    """One line per case and quantity: what is expected and allowed, then what each scheme found, how far off, in how many iterations.
    Where a scheme has another expectation or bound than the first, its cell says so."""
    lines, notes = [], []
    for key in dict.fromkeys((row["case"], row["quantity"]) for row in rows):
        by_scheme = {(row["scheme"], row["subdomains"]): row for row in rows if (row["case"], row["quantity"]) == key}
        first = next(iter(by_scheme.values()))
        cells = [escape(key[0]), tables.symbols(key[1]), RELATIONS[first["relation"]] + tables.number(first["expected"]), tables.number(first["bound"])]
        for scheme in schemes:
            row = by_scheme.get(scheme)
            if row is None:
                cells.append(tables.NONE)
                continue
            text = [tables.number(row["found"]), f"off {tables.number(row['error'])}", f"{tables.count(row['iterations'])} it."]
            text += [f"expected {tables.number(row['expected'])}"] * (row["expected"] != first["expected"])
            text += [f"bound {tables.number(row['bound'])}"] * (row["bound"] != first["bound"])
            cells.append(("<br>".join([text[0], *(f"<i>{line}</i>" for line in text[1:])]), "" if hard_ok(row) else "bad"))
            if "note" in row:
                notes.append(f'<p>{escape(row["case"])}, {escape(row["scheme"])}: {escape(row["note"])}</p>')
        lines.append([*cells, tables.symbols(first["bound_from"])])
    found = [f"{escape(name.upper())}{f', {n} subdomains' if n > 1 else ''}" for name, n in schemes]
    head = [["case", "quantity", "expected", "bound", *found, "bound from"]]
    return tables.table(head, lines, f"Hard cases: {rows[0]['family']}") + "".join(notes)


def draw_columns(rows):
    """Iterations of columns against their height, or None if there are not two heights."""
    points = {}
    for row in rows:
        match = re.match(r"column-(\d+)-3d", row["case"])
        if match and row["relation"] == "<=" and row["found"] is not None:
            points.setdefault((row["scheme"], row["subdomains"]), []).append((int(match[1]), row["found"], row["expected"]))
    if not points or max(map(len, points.values())) < 2:
        return None
    figure, axis = plt.subplots(figsize=(4.6, 3.2))
    for (scheme, subdomains), values in points.items():
        n, found, bound = zip(*sorted(values))
        colour = SUBDOMAINS[(subdomains - 1) % len(SUBDOMAINS)]
        axis.plot(n, bound, color=colour, linewidth=1.1)
        axis.plot(
            n,
            found,
            "o" if subdomains == 1 else "s",
            color=colour,
            markerfacecolor="none" if subdomains > 1 else colour,
            markersize=5 + (subdomains > 1) * 3,
            label=f"{scheme.upper()}, {subdomains}",
        )
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
            h, error = zip(*row["series"])
            axis.plot(
                h, error, "o-", color=colour, markersize=4, label=f"{row['quantity'].rpartition(', ')[2].replace('theta', chr(0x3b8))}: {row['found']:.2f}"
            )
        first = lines[-1]["series"]
        axis.plot([first[0][0], first[-1][0]], [2 * first[0][1], 2 * first[0][1] * first[-1][0] / first[0][0]], "--", color=NLGS, linewidth=1, label="order 1")
        axis.set(xscale="log", yscale="log", xlabel="h")
        axis.tick_params(axis="x", which="minor", labelbottom=False)
        axis.set_title(family.removeprefix("order-"))
        axis.legend(loc="best")
    axes[0][0].set_ylabel("error of the place")
    return figure


def energy_cell(row):
    if row is None:
        return tables.NONE
    text = "refused" if row["found"] is None else tables.number(row["found"]) + (f" ({row['exit']})" if row["exit"] else "")
    return text if hard_ok(row) else (text, "bad")


def energy_table(rows):
    """Largest gain of energy of the long runs: by scene but its last number, and by scheme and that number, friction or
    restitution; the exit code where it is not zero. None if there are no such rows."""
    rows = [row for row in rows if row["family"] in ENERGY and ("exit" in row or "note" in row)]
    if not rows:
        return None
    schemes = list(dict.fromkeys(row["scheme"] for row in rows))
    tables_html = []
    for family, last in ENERGY.items():
        own = {}
        for row in rows:
            if row["family"] == family:
                *scene, number, dimension = row["case"].split("-")
                own.setdefault("-".join([*scene, dimension]), {})[row["scheme"], float(number)] = row
        if not own:
            continue
        columns = sorted({key for cells in own.values() for key in cells}, key=lambda key: (schemes.index(key[0]), key[1]))
        titles = [f"{escape(scheme.upper())}, {last} {value:g}" for scheme, value in columns]
        cells = [[energy_cell(by_column.get(column)) for by_column in own.values()] for column in columns]
        names = list(map(escape, own))
        if len(names) > len(titles):  # the longer list goes down
            titles, names, cells = names, titles, list(zip(*cells))
        lines = [[title, *line] for title, line in zip(titles, cells)]
        head = [["", *names]]
        tables_html.append(tables.table(head, lines, f"Energy gained: {family}"))
    return "\n".join(tables_html)
