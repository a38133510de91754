"""Checksums of answers by several compilers and processors: table and section of the page."""
from html import escape

from ...page import tables
from ...page.page import Block, captions


def table(record):
    """One line for each run, one column for each build; what is not the accepted one, and what is not in the record of hard cases, is bad."""
    rows = record["rows"]
    lines = []
    for name in dict.fromkeys(key for row in rows for key in row["answers"]):
        cells = [(row["answers"].get(name), "bad" if name in row["differ"] else "") for row in rows]
        lines.append([escape(name.removesuffix(" answer")), *cells])
    others = [sum(not name.startswith("hard: ") and not name.endswith(" answer") for name in row["differ"]) for row in rows]
    if any(others):
        lines.append(["counts and residuals that differ", *((n, "bad" if n else "") for n in others)])
    hard = [row.get("hard") for row in rows]
    if any(hard):
        told = [one and (f"{tables.count(one['same'])} of {tables.count(one['of'])}", "" if one["same"] == one["of"] else "bad") for one in hard]
        lines.append(["hard cases", *told])
    head = [[first, *(escape(row[key]) for row in rows)] for first, key in (("run", "build"), ("", "compiler"))]
    return tables.table(head, lines, "Checksums of answers by several builds")


def parts(record, source, out):
    rows = record["rows"]
    same, of = tables.count(sum(row["numbers"] - len(row["differ"]) for row in rows)), tables.count(sum(row["numbers"] for row in rows))
    caption = captions(__file__)["rows"].format(builds=len(rows), same=same, of=of, commit=escape(record["accepted"]))
    yield Block(table(record), "The same bits by several compilers and processors", caption, source, ("counted",), wide=True)
