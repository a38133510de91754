"""The page: its blocks (tables and figures with captions), contents and frame. Images lie beside it, named by relative links."""
import dataclasses
import re
from html import escape
from pathlib import Path

from .tables import count

STYLE = (Path(__file__).parent / "style.css").read_text(encoding="utf-8")
# Where numbers come from; the first thing that a caption says.
KINDS = {"simulated": "SIMULATED", "measured": "measured", "counted": "counted", "computed": "computed"}


@dataclasses.dataclass
class Block:
    """A table or figure with its caption beneath. All text is HTML; the page numbers them."""
    content: str
    title: str
    caption: str
    source: str
    kinds: tuple
    wide: bool = False
    what: str = "Table"
    anchor: str = ""  # of links to it; made from its number if empty
    label: str = ""  # "Table 2.1", set by number()

    def html(self):
        style = ' class="wide"' if self.wide else ""
        tags = "".join(f' <span class="tag {kind}">{KINDS[kind]}</span>' for kind in self.kinds)
        return (f'<figure id="{self.anchor}"{style}><div class="scroll">{self.content}</div>\n'
                f"<figcaption><b>{self.label}. {self.title}.</b>{tags} {self.caption}{self.source}</figcaption></figure>")


def table_block(content, title, caption, source="", kinds=("computed",), wide=False, anchor=""):
    return Block(content, title, caption, source, kinds, wide, "Table", anchor)


def figure_block(file, title, caption, source="", kinds=("computed",), wide=False, anchor=""):
    """`file`: name of the image beside the page."""
    plain = re.sub("<[^>]*>", "", title)
    return Block(f'<img alt="{plain}" src="{escape(file)}">', title, caption, source, kinds, wide, "Fig.", anchor)


def number(sections):
    """Labels and anchors of all blocks: Table 2.1 is the first table of the second section."""
    for place, (_, _, parts) in enumerate(sections, 1):
        counts = {}
        for part in parts:
            if isinstance(part, Block):
                counts[part.what] = counts.get(part.what, 0) + 1
                part.label = f"{part.what} {place}.{counts[part.what]}"
                part.anchor = part.anchor or re.sub(r"\W+", "-", part.label.lower())


def contents(sections):
    """The list of sections with their tables and figures."""
    items = []
    for place, (key, heading, parts) in enumerate(sections, 1):
        blocks = [part for part in parts if isinstance(part, Block)]
        inner = "".join(f'<li><a href="#{block.anchor}">{block.label}</a> {block.title}</li>' for block in blocks)
        note = "" if blocks else ' <span class="missing">(not in these results)</span>'
        items.append(f'<li><a href="#{key}">{place}. {escape(heading)}</a>{note}' + (f"<ul>{inner}</ul>" if inner else "") + "</li>")
    return f'<nav aria-label="Contents"><h2>Contents</h2><ul class="contents">{"".join(items)}</ul></nav>'


def machines(runs):
    """The machines of some runs, in words; several only if they differ."""
    names = {f"{r['machine']['cpu']}, {r['machine']['cores']} core{'s' * (r['machine']['cores'] > 1)}" for r in runs}
    return "; ".join(sorted(names))


def commits(runs):
    """Of runs and of records, which may have rows of several commits."""
    found = {commit for run in runs for commit in (run.get("commits") if isinstance(run, dict) else None) or [run["commit"]]}
    return ", ".join(sorted({commit.removesuffix("-dirty")[:12] + "-dirty" * commit.endswith("-dirty") for commit in found}))


def command_list(commands):
    """The first command, and the others folded."""
    commands = list(dict.fromkeys(commands))
    text = f"<code>{escape(commands[0])}</code>"
    if len(commands) > 1:
        items = "".join(f"<li><code>{escape(command)}</code></li>" for command in commands[1:])
        more = f"and {len(commands) - 1} more command{'s' * (len(commands) > 2)}"
        text += f" <details><summary>{more}</summary><ul>{items}</ul></details>"
    return text


def origin(runs, kind=""):
    """Where something comes from: commands, machine, commit; `kind` where a caption has several."""
    return (f'<div class="from">{f"<b>{kind}.</b> " if kind else ""}{escape(machines(runs))}; commit {escape(commits(runs))}. From '
            f"{command_list([run.command for run in runs])}</div>")


def missing(text):
    return f'<p class="missing">Not in these results: {escape(text)}.</p>'


def counted(results, most=10):
    """How many counted numbers are those of the committed records, and the first that are not."""
    html = ""
    for record in results.counts:
        text = f"{count(record['same'])} of {count(record['of'])} counted numbers are those of the record."
        if record["missing"]:
            text += f" {count(record['missing'])} of the record are not in these results."
        names = "".join(f"<li>{escape(row['name'])}: {escape(str(row['now']))}, in the record {escape(str(row['record']))}</li>" for row in record["differ"][:most])
        more = f"<li>and {len(record['differ']) - most} more</li>" if len(record["differ"]) > most else ""
        html += f'<div class="verdict {"good" if record["of"] and not names else "open"}"><b>{text}</b>' + (f"<ul>{names}{more}</ul>" if names else "") + "</div>"
    return html


def verdict(results):
    """The line at the top, and whether the report passes."""
    failures, unchecked = results.failures(), results.unchecked()
    rows = sum(len(compare["rows"]) for compare in results.compares)
    if failures:
        items = "".join(f"<li>{escape(line)}</li>" for line in failures)
        return f'<div class="verdict bad"><b>Failed: {len(failures)} finding{"s" * (len(failures) > 1)}.</b>' \
               f"<ul>{items}</ul></div>", False
    hard = f"All {len(results.hard_rows)} rows of the hard cases are within their bounds." if results.hard else ""
    if not results.runs and not results.hard:
        return '<div class="verdict open"><b>No run of the main job and no hard case is in these results.</b></div>', True
    if not results.runs:
        return f'<div class="verdict good"><b>{hard}</b></div>', True
    text = f"{hard} All {len(results.runs)} runs converged".strip()
    if not results.compares:
        return f'<div class="verdict open"><b>{text}; agreement was not checked:</b> no comparison with a ' \
               "reference is in these results.</div>", True
    text += f" and all {rows} comparisons with the reference are within their bounds."
    html = f'<div class="verdict good"><b>{text}</b></div>'
    if unchecked:
        names = ", ".join(run.name for run in unchecked)
        html += (f'<div class="verdict open"><b>{len(unchecked)} not compared with a reference:</b> '
                 f"{escape(names)}.</div>")
    return html, True


def page(title, lead, facts, opening, sections, footer):
    """The whole document. facts: (name, text); opening: HTML before the contents; sections: (id, heading, parts), numbered."""
    described = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in facts)
    body = "\n".join(f'<h2 id="{key}">{place}. {escape(heading)}</h2>\n'
                     + "\n".join(part.html() if isinstance(part, Block) else part for part in parts)
                     for place, (key, heading, parts) in enumerate(sections, 1))
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title>
<style>{STYLE}</style>
</head>
<body><main>
<h1>{escape(title)}</h1>
<p class="lead">{lead}</p>
{opening}
{contents(sections)}
<dl class="facts">{described}</dl>
{body}
<footer>{footer}</footer>
</main></body>
</html>
"""
