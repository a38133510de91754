"""The page of a folder of results: OUT/index.html, its figures beside it (SVG, pictures PNG), summary.json, artifact.md."""
import json
import os
import sys
from datetime import datetime, timezone
from html import escape

from ..record import InputError, aside
from ..studies import studies
from .artifact import artifact
from .load import load
from .page import captions, commits, machines, number, page
from .tables import count

TEXTS = captions(__file__)


def div(style, text, items=(), more=""):
    listed = f"<ul>{''.join(f'<li>{escape(item)}</li>' for item in items)}</ul>" if items else ""
    return f'<div class="verdict {style}"><b>{text}</b>{more}{listed}</div>'


def verdict(results):
    if failures := results.failures:
        return div("bad", f"Failed: {len(failures)} finding{'s' * (len(failures) > 1)}.", failures)
    lines = [div("good", " ".join(results.good))] if results.good else []
    lines += [div("open", what, more=f" {escape(which)}") for what, which in results.open]
    return "".join(lines) or div("open", "No run and no hard case is in these results.")


def counted(results, most=10):
    """How many counted numbers are those of the committed records, and the first that are not."""
    for record in results.records("counted"):
        text = f"{count(record['same'])} of {count(record['of'])} counted numbers are those of the record."
        if record["missing"]:
            text += f" {count(record['missing'])} of the record are not in these results."
        names = [f"{row['name']}: {row['now']}, in the record {row['record']}" for row in record["differ"]]
        more = [f"and {len(names) - most} more"] if len(names) > most else []
        yield div("good" if record["of"] and not names else "open", text, names[:most] + more)


def facts(results, dates):
    """What the page was made from, as (name, text)."""
    runs, sources = results.records("run"), results.sources
    scenes = ", ".join(dict.fromkeys(f"{run['scene']} ({count(run['grains'])} grains)" for run in runs))
    systems = {", ".join(one["machine"][key] for key in ("os", "compiler") if one["machine"].get(key)) for one in sources} - {""}
    told = {
        "Runs": runs and f"{len(runs)}: {scenes}",
        "Rows of hard cases": "hard_rows" in results.summary and count(results.summary["hard_rows"]),
        "Made": f"{dates[0]} to {dates[-1]}",
        "Machine": machines(sources),
        "System": "; ".join(sorted(systems)),
        "Commit": commits(sources),
        "Page written": datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"),
    }
    return [(name, text) for name, text in told.items() if text]


def section(study, results, out):
    """What a study has on the page. Raises InputError where its record, for which there is no schema, is not as it should be."""
    records = results.records(study.name)
    try:
        commits(records), machines(records)  # of which the head of the page tells
        return study.section(results, out)
    except (KeyError, TypeError, AttributeError) as error:
        files = ", ".join(str(one.path) for one in records) or results.folder
        raise InputError(f"{files}: not a whole record of {study.name}: {error!r}") from error


def make(folder, out):
    """Writes the page; returns whether it passes: every run converged, every comparison is within its bounds and no job failed. Raises InputError."""
    if out.exists() and not out.is_dir():
        raise InputError(f"report: --out {out}: expected a folder, found a file")
    results = load(folder)
    out.mkdir(parents=True, exist_ok=True)
    sections = [(study.name, study.title, parts) for study in studies().values() if (parts := section(study, results, out))]
    number(sections)
    results.failures += [f"job failed (exit {job['exit']}): {job['title']}" for record in results.records("job") for job in record["jobs"] if job["exit"]]
    dates = sorted(source["date"] for source in results.sources if "date" in source) or [""]
    opening = (results.opening() if results.opening else "") + verdict(results) + "".join(counted(results))
    html = page("nscdd: report", TEXTS["lead"], facts(results, dates), opening, sections, TEXTS["method"])
    summary = {"schema": "nscdd.summary/1", "passes": not results.failures, "failures": results.failures, "runs": len(results.records("run"))}
    summary |= {"machine": machines(results.sources), "commit": commits(results.sources), "dates": [dates[0], dates[-1]], **results.summary}
    aside(out / "summary.json", (json.dumps(summary, indent=1) + "\n").encode())
    aside(out / "index.html", html.encode())
    aside(out / "artifact.md", artifact(studies(), sections, folder, out).encode())
    for line in results.failures:
        print(f"report: {line}", file=sys.stderr)
    print(f"report: {os.path.relpath(out / 'index.html')}: " + ("FAILS" if results.failures else "passes"))
    return not results.failures
