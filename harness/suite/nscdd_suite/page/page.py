"""The page: its blocks (tables and figures with captions), contents and frame. Images lie beside it, named by relative links."""
import dataclasses
import re
from html import escape
from pathlib import Path

from ..record import beside

STYLE = (Path(__file__).parent / "style.css").read_text(encoding="utf-8")
# Where numbers come from; the first thing that a caption says.
KINDS = {"simulated": "SIMULATED", "measured": "measured", "counted": "counted", "computed": "computed"}


@dataclasses.dataclass
class Block:
    """A table or figure with its caption beneath. All text is HTML; the page numbers them."""

    content: str
    title: str
    caption: str
    source: str = ""
    kinds: tuple = ("computed",)
    wide: bool = False
    anchor: str = ""  # of links to it; made from its number if empty
    what: str = "Table"
    label: str = ""  # "Table 2.1", set by number()

    def tags(self):
        return "".join(f' <span class="tag {kind}">{KINDS[kind]}</span>' for kind in self.kinds)

    def tile(self):
        """The same small, with a link to all that is said of it."""
        link = f'<a href="#{self.anchor}">{self.label}. {self.title}</a>'
        return f'<div class="tile"><div class="scroll">{self.content}</div><p>{link}{self.tags()}</p></div>'

    def html(self):
        style = ' class="wide"' if self.wide else ""
        return (
            f'<figure id="{self.anchor}"{style}><div class="scroll">{self.content}</div>\n'
            f"<figcaption><b>{self.label}. {self.title}.</b>{self.tags()} {self.caption}{self.source}</figcaption></figure>"
        )


def figure_block(file, title, *more, **how):
    """`file`: name of the image beside the page."""
    plain = re.sub("<[^>]*>", "", title)
    return Block(f'<img alt="{plain}" src="{escape(file)}">', title, *more, what="Fig.", **how)


def blocks(parts):
    return [part for part in parts if isinstance(part, Block)]


def number(sections):
    """Labels and anchors of all blocks: Table 2.1 is the first table of the second section."""
    for place, (_, _, parts) in enumerate(sections, 1):
        counts = {}
        for block in blocks(parts):
            counts[block.what] = counts.get(block.what, 0) + 1
            block.label = f"{block.what} {place}.{counts[block.what]}"
            block.anchor = block.anchor or re.sub(r"\W+", "-", block.label.lower())


def contents(sections):
    items = []
    for place, (key, heading, parts) in enumerate(sections, 1):
        inner = "".join(f'<li><a href="#{block.anchor}">{block.label}</a> {block.title}</li>' for block in blocks(parts))
        items.append(f'<li><a href="#{key}">{place}. {escape(heading)}</a>' + (f"<ul>{inner}</ul>" if inner else "") + "</li>")
    return f'<nav aria-label="Contents"><h2>Contents</h2><ul class="contents">{"".join(items)}</ul></nav>'


def machines(runs):
    """The machines of some runs, in words; several only if they differ."""
    names = {f"{r['machine']['cpu']}, {r['machine']['cores']} core{'s' * (r['machine']['cores'] > 1)}" for r in runs}
    return "; ".join(sorted(names))


def commits(runs):
    """Of runs and of records, which may have rows of several commits."""
    found = {commit for run in runs for commit in run.get("commits") or [run["commit"]]}
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


def rows_from(commands):
    return f'<div class="from">Rows from {command_list(commands)}</div>'


def folded(html, what="rows", most=40):
    """A table, closed at first where it has more rows."""
    rows = html.count("<tr><td")
    return f"<details><summary>{rows} {what}</summary>{html}</details>" if rows > most else html


def origin(runs, kind=""):
    """Where something comes from: commands, machine, commit; `kind` where a caption has several."""
    return (
        f'<div class="from">{f"<b>{kind}.</b> " if kind else ""}{escape(machines(runs))}; commit {escape(commits(runs))}. From '
        f"{command_list([run.command for run in runs])}</div>"
    )


def captions(section):
    """The texts beside the file of a section, as HTML; in braces what it knows."""
    return beside(section, "captions.toml")


def warnings(data):
    """That a record is of a quick job, and what it lacks."""
    quick = ["<p>From a quick job, made small to test the command: its numbers say nothing.</p>"] if data.get("quick") else []
    return quick + [f'<p class="missing">Left out: {escape(line)}.</p>' for line in data.get("left_out", ())]


def page(title, lead, facts, opening, sections, footer):
    """The whole document. facts: (name, text); opening: HTML before the contents; sections: (id, heading, parts), numbered."""
    described = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in facts)
    body = "\n".join(
        f'<h2 id="{key}">{place}. {escape(heading)}</h2>\n' + "\n".join(part.html() if isinstance(part, Block) else part for part in parts)
        for place, (key, heading, parts) in enumerate(sections, 1)
    )
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
