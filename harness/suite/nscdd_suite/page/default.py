"""The section of a study that has none of its own: a table of all rows of its record."""
from html import escape

from .page import Block, folded, origin, rows_from
from .tables import NONE, shown, table

SPREAD = {"least", "mean", "largest"}  # over ranks: their mean is shown


def flat(row, prefix=""):
    """Rows of scalars: what lies in a dict has a longer name, and each entry of a list of dicts is a row of its own, beside the rest."""
    found = [{}]
    for key, value in row.items():
        name = f"{prefix}{key}".replace("_", " ")
        if isinstance(value, dict) and value.keys() == SPREAD:
            value = value["mean"]
        if isinstance(value, dict):
            more = flat(value, f"{prefix}{key}, ")
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            more = [one for entry in value for one in flat(entry, f"{prefix}{key}, ")]
        elif isinstance(value, list):
            more = [{name: sum(value) if all(isinstance(one, (int, float)) for one in value) else ", ".join(map(str, value))}]
        else:
            more = [{name: value}]
        found = [old | new for old in found for new in more]
    return found


def commands(row):
    """All commands in a row, wherever they lie."""
    for key, value in row.items():
        if key == "command":
            yield value
        for entry in value if isinstance(value, list) else [value]:
            if isinstance(entry, dict):
                yield from commands(entry)


def rows_block(title, rows, sources, caption="", kinds=()):
    """One list of rows. Columns that are the same in all rows stand in the caption."""
    made_by = list(dict.fromkeys(command for row in rows for command in commands(row)))
    rows = [{name: escape(shown(value)) for name, value in one.items() if not name.endswith("command")} for row in rows for one in flat(row)]
    values = {name: {row.get(name, NONE) for row in rows} for name in dict.fromkeys(name for row in rows for name in row)}
    same = {name: found.pop() for name, found in values.items() if len(found) == 1 and len(rows) > 1}
    names = [name for name in values if name not in same]
    html = folded(table([list(map(escape, names))], [[row.get(name) for name in names] for row in rows], title))
    if same:
        caption += f"In all rows: {'; '.join(f'{escape(name)} {value}' for name, value in same.items())}. "
    source = origin(sources) + (rows_from(made_by) if made_by else "")
    return Block(html, escape(title), caption, source, kinds, wide=True)


def parts(study, data):
    for key, rows in data.items():
        if isinstance(rows, list) and rows and isinstance(rows[0], dict):
            yield rows_block(f"{study.title}: {key}", rows, [data], "All rows of the record. ", study.kinds)
