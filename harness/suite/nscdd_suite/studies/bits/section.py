"""Checksums of answers by several compilers and processors: table and section of the page."""
from html import escape

from ...page import tables
from ...page.page import origin, quick, table_block


def of_hard(row):
    """How many numbers of the hard cases of a build are those of their record."""
    if "hard" not in row:
        return "\u2013"
    same, of = row["hard"]["same"], row["hard"]["of"]
    text = f"{tables.count(same)} of {tables.count(of)}"
    return text if same == of else (text, "bad")


def table(record):
    """One line for each run, one column for each build; those that are not the accepted ones are bad."""
    rows = record["rows"]
    runs = list(dict.fromkeys(key.removesuffix(" answer") for row in rows for key in row["answers"]))
    lines = []
    for run in runs:
        line = [escape(run)]
        for row in rows:
            answer = row["answers"].get(f"{run} answer")
            line.append("\u2013" if answer is None else (answer, "bad") if f"{run} answer" in row["differ"] else answer)
        lines.append(line)
    others = [sum(not name.startswith("hard: ") and not name.endswith(" answer") for name in row["differ"]) for row in rows]
    if any(others):
        lines.append(["counts and residuals that differ", *((tables.count(n), "bad") if n else "0" for n in others)])
    if any("hard" in row for row in rows):
        lines.append(["hard cases", *(of_hard(row) for row in rows)])
    head = [[first, *(escape(row[key]) for row in rows)] for first, key in (("run", "build"), ("", "compiler"))]
    return tables.table(head, lines, "Checksums of answers by several builds")


def section(results, out):
    """Answers by several compilers and processors."""
    parts = []
    for record in results.records("bits"):
        parts += quick(record)
        rows = record["rows"]
        same = sum(row["numbers"] - len(row["differ"]) for row in rows)
        caption = (
            f"Checksums of positions, velocities, driven walls and impulses at the end of the reduced scenes, by {len(rows)} builds "
            f"of one source. {tables.count(same)} of {tables.count(sum(row['numbers'] for row in rows))} counts, residuals and checksums are the "
            f"accepted ones (commit {escape(record['accepted'])}) or those of the record of hard cases; others are in red. The build for aarch64 ran under qemu."
        )
        parts.append(table_block(table(record), "The same bits by several compilers and processors", caption, origin([record]), ("counted",), wide=True))
    return parts
