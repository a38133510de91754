"""Tables of nscdd scale: the section of the page."""
from ...page.default import rows_block
from . import row


def section(results, out):
    tables = results.records("scale")
    rows = [row(table.path.stem.removeprefix("scale-"), point) for table in tables for point in table["points"]]
    caption = (
        "Seconds of an iteration, SIMULATED on the platform that the name of the table begins with, and measured on ranks of this machine where there are "
        "cores; iterations of all steps, counted in process; efficiency against sequential NLGS at equal error. "
    )
    return [rows_block("Tables of nscdd scale", rows, tables, caption, ("simulated", "measured", "counted"))] if rows else []
