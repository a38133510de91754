"""Checksums of answers by several compilers and processors."""
from html import escape

from . import tables


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
    head = [[("run", 1), *((escape(row["build"]), 1) for row in rows)], [("", 1), *((escape(row["compiler"]), 1) for row in rows)]]
    return tables.table(head, lines, "Checksums of answers by several builds")
