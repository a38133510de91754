"""Sections of records that bring their own figures and tables, such as physics.json and peers.json.

Such a record has, beside command, commit, date, machine and quick: `figures`, names of SVG files beside it, or objects {file, title, caption,
kind}; `tables`, objects {title, caption, kind, head: [text], rows: [[text or number]]}; and, if it likes, `lead`, a paragraph. All is
plain text. kind: measured, counted, computed or simulated.
"""
import shutil
from html import escape

from . import tables
from .load import InputError
from .page import KINDS, figure_block, origin, table_block


def of_record(kind):
    """The function that makes the section of one kind of record; without a record there is no section."""
    def section(results, out):
        return [part for record in getattr(results, kind) for part in blocks(kind, record, results.folder, out)]
    return section


def field(kind, entry, name, default=None):
    value = entry.get(name, default)
    if value is None:
        raise InputError(f"{kind}.json: a figure or table lacks '{name}'")
    if name == "kind" and value not in KINDS:
        raise InputError(f"{kind}.json: kind: '{value}' is none of {', '.join(KINDS)}")
    return value


def cell(value):
    text = tables.number(value) if isinstance(value, float) else str(value)
    return escape(text)


def blocks(kind, record, folder, out):
    if record.get("quick"):
        yield '<div class="verdict open"><b>From a quick job with small sizes, made to test the command.</b></div>'
    if record.get("lead"):
        yield f"<p>{escape(record['lead'])}</p>"
    for entry in record["figures"]:
        entry = {"file": entry} if isinstance(entry, str) else entry
        name = field(kind, entry, "file")
        if "/" in name or not name.endswith(".svg") or not (folder / name).is_file():
            raise InputError(f"{kind}.json: figures: no SVG file '{name}' beside it")
        if (folder / name).resolve() != (out / name).resolve():
            shutil.copyfile(folder / name, out / name)
        yield figure_block(name, escape(field(kind, entry, "title", name.removesuffix(".svg").replace("-", " "))), escape(entry.get("caption", "")),
                           origin([record]), (field(kind, entry, "kind", "computed"),), wide=True)
    for entry in record["tables"]:
        html = tables.table([[(escape(str(text)), 1) for text in field(kind, entry, "head")]],
                            [list(map(cell, row)) for row in field(kind, entry, "rows")], field(kind, entry, "title"))
        yield table_block(html, escape(entry["title"]), escape(entry.get("caption", "")), origin([record]),
                          (field(kind, entry, "kind", "computed"),), wide=True)
