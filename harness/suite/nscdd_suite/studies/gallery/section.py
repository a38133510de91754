"""The gallery's section of the page: each quantity beside the published one."""
from html import escape

from ...page import tables
from ...page.page import Block, captions
from . import published

TEXTS = captions(__file__)


def verdict(row, quick):
    return ("cannot be told", "") if quick else ("within", "") if row["within"] else ("not within", "bad")


def parts(record, source, out):
    told, lines = published(), []
    for row in record["rows"]:
        texts, allowed = told[row["scene"]], " to ".join(map(tables.number, row["allowed"].values()))
        numbers = [None if row["ours"] is None else tables.number(row["ours"]), tables.number(row["published"]), allowed]
        lines.append([escape(texts["title"]), escape(row["quantity"]), *numbers, verdict(row, record.get("quick")), escape(row.get("note", ""))])
        lines[-1] += [escape(texts[key]) for key in ("law", "rule", "source")]
    head = "scene | quantity | ours | published | allowed | verdict | beside it | law | rule | source"
    yield Block(tables.table([head], lines, "Gallery"), "Gallery", TEXTS["table"], source, ("counted",), wide=True)
