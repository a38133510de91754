#!/usr/bin/env python3
"""Doxygen's input filter for pages (scripts/docs): prints one as Doxygen wants it. The files themselves stay as they are.

    scripts/docs_filter.py kernel/METHOD.md     # formulas, headings and links become Doxygen's
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = ["manual/*.md", "kernel/METHOD.md", "kernel/REFERENCES.md", "reports/series.md", "reports/findings/*.md"]  # of the site


def label(path):
    """kernel/METHOD.md is METHOD, manual/first-scene.md manual-first-scene, reports/findings/README.md findings."""
    path = Path(path)
    if path.parent.name in ("manual", "findings"):
        return path.parent.name if path.stem == "README" else f"{path.parent.name}-{path.stem}"
    return path.stem


def site():
    """{file: label} of all pages."""
    return {path.resolve(): label(path) for pattern in PAGES for path in ROOT.glob(pattern)}


def slug(heading):
    """The anchor that a heading has on code hosting sites."""
    return re.sub(r"[^\w\- ]", "", re.sub(r"[`*]", "", heading).lower()).strip().replace(" ", "-")


def linked(found, path, pages, children):
    text, target = " ".join(found[1].split()), found[2]  # Doxygen loses its place in a text of two lines
    if re.match(r"\w+:", target):
        return found[0]
    file, _, anchor = target.partition("#")
    there = (path.parent / file).resolve() if file else path
    if there in pages:
        if anchor:
            return f'@ref {pages[there]}_{anchor} "{text}"'
        command = "@ref"
        if path.name == "README.md" and there.parent == path.parent and there not in children:
            children.add(there)
            command = "@subpage"
        return f'{command} {pages[there]} "{text}"'
    shown = there.relative_to(ROOT) if there.is_relative_to(ROOT) else file
    return text if text.strip("`") in (str(shown), there.name) else f"{text} (`{shown}`)"


def page(text, path):
    pages, children, out, first = site(), set(), [], True
    own = pages.get(path, path.stem)

    def prose(part):
        part = re.sub(r"\$\$(.+?)\$\$", r"\\f[\1\\f]", part, flags=re.DOTALL)
        part = re.sub(r"(?<![\\f])\$([^$\n]+(?:\n[^$\n]+)?)\$", r"\\f$\1\\f$", part)
        part = re.sub(r"(?<=\n\n)(?=\\f\$)", "\u200b", part)  # else a paragraph that begins so is a part of the list above it
        part = re.sub(r"!\[([^\]]+)\]\((?:[^)\s]*/)?([^)\s/]+)\)", r"![\1](\2)", part)  # Doxygen looks for a picture by its name
        return re.sub(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)", lambda found: linked(found, path, pages, children), part)

    def curly(paragraph):  # Doxygen loses formulas between quotation marks that are straight
        if "$" not in paragraph or re.match(r"```| {4}", paragraph):
            return paragraph
        return re.sub(r'`[^`]*`|"([^"]*)"', lambda found: found[0] if found[1] is None else f"\u201c{found[1]}\u201d", paragraph)

    text = "\n\n".join(curly(paragraph) for paragraph in text.split("\n\n"))
    # fenced blocks, indented blocks and code in a line stay as they are
    for part in re.split(r"(?ms)(^```.*?^```[^\n]*$|(?<=\n\n)(?: {4}[^\n]*\n|\n(?= {4}))+|`[^`\n]+`)", text):
        if re.match(r"```|`", part):
            out.append(part)
        elif part.startswith("    "):
            out.append("```{.unparsed}\n" + re.sub("(?m)^ {4}", "", part).rstrip() + "\n```\n\n")
        else:
            out.append(prose(part))
    lines, fenced = "".join(out).split("\n"), False
    for k, line in enumerate(lines):
        fenced ^= line.startswith("```")
        found = re.match(r"(#+) (.*)$", line)
        if found and not fenced:
            title = re.sub(r"^(\d+)\. ", "\\1.\u00a0", found[2]) if first else found[2]  # else Doxygen makes a list of it
            lines[k] = f"{found[1]} {title} {{#{own}{'' if first else '_' + slug(found[2])}}}"
            first = False
    return "\n".join(lines)


def main():
    if len(sys.argv) != 2 or sys.argv[1] in ("-h", "--help"):
        sys.exit(__doc__)
    path = Path(sys.argv[1]).resolve()
    sys.stdout.write(page(path.read_text(), path))


if __name__ == "__main__":
    main()
