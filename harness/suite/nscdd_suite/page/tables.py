"""Tables of the page, as HTML."""
import re
from html import escape

from ..times import busy

SUPERSCRIPT = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")
NONE = "\u2013"


def number(value):
    """Three significant digits; powers of ten written out below a thousandth and from a million on."""
    if value is None:
        return "not finite"
    if value == 0 or 1e-3 <= abs(value) < 1e6:
        return f"{value:.3g}" if abs(value) < 1000 else count(value)
    mantissa, exponent = f"{value:.2e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".")
    times = "" if mantissa == "1" else f"{mantissa}\u202f\u00d7\u202f"
    return f"{times}10{str(int(exponent)).translate(SUPERSCRIPT)}"


def count(value):
    """Whole number with narrow no-break spaces between thousands; one decimal below 100 if it has any."""
    text = f"{value:,.1f}" if value < 100 and value != int(value) else f"{value:,.0f}"
    return text.replace(",", "\u202f")


def shown(value):
    """What stands in a cell: text is HTML already."""
    if value is None or isinstance(value, str):
        return NONE if value is None else value
    return ("no", "yes")[value] if isinstance(value, bool) else count(value) if isinstance(value, int) else number(value)


def symbols(text):
    """HTML of what programs write: |V - V_ref|_M, eta, <=, 1e-4."""
    text = re.sub(r"\b1e-(\d+)\b", lambda power: "10" + f"-{power[1]}".translate(SUPERSCRIPT), escape(text))
    text = re.sub(r"\b([Vs])_(ref|free)\b", r"<i>\1</i><sub>\2</sub>", text)
    text = re.sub(r"(?<=\|)([Vs])\b|\b(V)\b(?!<)", lambda name: f"<i>{name[1] or name[2]}</i>", text)
    text = re.sub(r"\|_M(\^2)?", lambda norm: "|<sub><i>M</i></sub>" + ("\u00b2" if norm[1] else ""), text)
    return re.sub(r"\beta\b", "\u03b7", text).replace("&lt;=", "\u2264").replace(" - ", " \u2212 ")


def by_number(text):
    """Key of a sort that puts 2 before 16."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", text)]


def percent(value):
    return f"{100 * value:.1f}"


def columns(row):
    """[(title, columns spanned)] of a row of a head: "scene | iterations *2", or ["scene", ("iterations", 2)]."""
    if isinstance(row, str):
        return [(text, int(span or 1)) for text, _, span in (title.partition(" *") for title in row.split(" | "))]
    return [title if isinstance(title, tuple) else (title, 1) for title in row]


def table(head, rows, label):
    """head: rows of columns(); rows: lists of cells, each a value or (value, class). Long text is set left."""

    def cell(content):
        value, style = content if isinstance(content, tuple) else (content, "")
        text = shown(value)
        if not style and any(len(re.sub("<[^>]*>", "", line)) > 32 for line in text.split("<br>")):
            style = "text"
        return f'<td class="{style}">{text}</td>' if style else f"<td>{text}</td>"

    def title(text, span):
        spanned = f' colspan="{span}" class="{"group" if text else ""}"' if span > 1 else ""
        return f"<th{spanned}>{text}</th>"

    heads = ["<tr>" + "".join(title(*column) for column in columns(row)) + "</tr>" for row in head]
    lines = ["<tr>" + "".join(map(cell, row)) + "</tr>" for row in rows]
    return "\n".join([f'<table aria-label="{escape(label)}">', "<thead>", *heads, "</thead>", "<tbody>", *lines, "</tbody>", "</table>"])


def row_ok(row, key="value"):
    """Whether a row of a comparison keeps its bound; null is not finite."""
    return row["ok"] and row[key] is not None and row[key] <= row["bound"]


def exceeds(row):
    """Of a row that does not, in words."""
    return f"{row['quantity']} {show(row['value'])} exceeds {row['bound']:g}"


def show(value):
    return "not finite" if value is None else f"{value:.3g}"


def bounded(leading, entries, label):
    """A line for each entry (leading cells, rows of quantity, value and bound, whether it says ok), a column for each quantity; the
    bound in the head if all share it."""
    bounds, lines = {}, []
    for _, rows, _ in entries:
        for row in rows:
            bounds.setdefault(row["quantity"], set()).add(row["bound"])

    def most(bound):
        return f"<i>\u2264\u202f{number(bound)}</i>"

    def cell(row):
        text = number(row["value"]) + (f" {most(row['bound'])}" if len(bounds[row["quantity"]]) > 1 else "")
        return text, "" if row_ok(row) else "bad"

    for first, rows, ok in entries:
        cells = {row["quantity"]: cell(row) for row in rows}
        lines.append([*first, *map(cells.get, bounds), ("ok", "good") if ok and all(map(row_ok, rows)) else ("fails", "bad")])
    titles = []
    for quantity, found in bounds.items():
        name, _, formula = quantity.partition(", ")
        parts = [symbols(name), *([f"<i>{symbols(formula)}</i>"] if formula else []), *(map(most, found) if len(found) == 1 else [])]
        titles.append("<br>".join(parts))
    return table([[*leading, *titles, ""]], lines, label)


def busy_mark(cores):
    """Beside a time that is not believed."""
    return f" <i>busy: {100 * cores:.0f} % of a core</i>" if busy(cores) else ""
