"""The page: one HTML file with its style and images inside."""
import base64
from html import escape
from pathlib import Path

STYLE = (Path(__file__).parent / "style.css").read_text(encoding="utf-8")


def machines(runs):
    """The machines of some runs, in words; several only if they differ."""
    names = {f"{r['machine']['cpu']}, {r['machine']['cores']} core{'s' * (r['machine']['cores'] > 1)}" for r in runs}
    return "; ".join(sorted(names))


def commits(runs):
    return ", ".join(sorted({run["commit"][:12] for run in runs}))


def origin(runs, kind):
    """Where something comes from: commands, machine, commit; and whether it was measured or counted."""
    commands = list(dict.fromkeys(run.command for run in runs))
    text = (f"<b>{kind}.</b> From <code>{escape(commands[0])}</code>; {escape(machines(runs))}; "
            f"commit {escape(commits(runs))}.")
    if len(commands) > 1:
        items = "".join(f"<li><code>{escape(command)}</code></li>" for command in commands[1:])
        more = f"and {len(commands) - 1} more command{'s' * (len(commands) > 2)}"
        text += f" <details><summary>{more}</summary><ul>{items}</ul></details>"
    return f'<div class="from">{text}</div>'


def image(images, kind, alternative):
    """An <img> that carries its file: svg for lines, png for pictures."""
    mime = {"svg": "image/svg+xml", "png": "image/png"}[kind]
    data = base64.b64encode(images[kind]).decode()
    return f'<img alt="{escape(alternative)}" src="data:{mime};base64,{data}">'


def block(content, title, caption, source="", wide=False):
    """A figure or table with its caption beneath. All HTML."""
    style = ' class="wide"' if wide else ""
    return (f'<figure{style}><div class="scroll">{content}</div>\n'
            f"<figcaption><b>{title}.</b> {caption}{source}</figcaption></figure>")


def missing(text):
    return f'<p class="missing">Not in these results: {escape(text)}.</p>'


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
        return '<div class="verdict open"><b>Costs alone: nothing here is judged.</b></div>', True
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


def page(title, lead, facts, verdict_html, sections, footer):
    """The whole document. facts: (name, text); sections: (id, heading, HTML)."""
    links = "".join(f'<a href="#{key}">{escape(heading)}</a>' for key, heading, _ in sections)
    described = "".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in facts)
    body = "\n".join(f'<h2 id="{key}">{escape(heading)}</h2>\n{html}' for key, heading, html in sections)
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
{verdict_html}
<dl class="facts">{described}</dl>
<nav>{links}</nav>
{body}
<footer>{footer}</footer>
</main></body>
</html>
"""
