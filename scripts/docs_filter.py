#!/usr/bin/env python3
"""Doxygen's input filter (scripts/docs): prints a header or a page as Doxygen wants it. The files themselves stay as they are.

    scripts/docs_filter.py kernel/include/nscdd/core/grain.hpp     # comments before and behind declarations become /// and ///<
    scripts/docs_filter.py kernel/METHOD.md                        # formulas, headings and links become Doxygen's

It adds no words: a name without a comment stays without documentation. One comment is that of both names of `int i, j;`, of overloads that
follow each other, and that of a file is that of the type or function which has the file's name (Grain in grain.hpp), unless it has its own.
Not shown: namespaces `detail`, the macros of core/abi.hpp, the inline namespace that they name, defaulted or deleted functions, and a model's
types under their own names (`using Vec = typename M::Vec`).
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = ["manual/*.md", "kernel/METHOD.md", "kernel/REFERENCES.md", "reports/series.md", "reports/findings/*.md"]  # of the site

# ---- headers

NO_DECLARATION = re.compile(r"\s*($|#|\}|public:|private:|protected:|namespace\b|static_assert\b)")
NO_STATEMENT = re.compile(r"\s*(#|(public|private|protected):\s*$)")
TYPE = re.compile(r"(?:^|[\s>])(?:struct|class|union|enum|concept)\b[^()=]*$")
LEFT_OUT = re.compile(r"\s*((virtual\s+)?[\w~]+(& operator=)?\([^()]*\)( noexcept)? = (default|delete)|using (\w+) = typename \w+::\6);\s*$")


def split_comment(line):
    """(code, text behind //, or None); quoted text is no comment."""
    found = re.match(r"""((?:"(?:\\.|[^"\\])*"|(?<!\w)'(?:\\.|[^'\\])*'|(?!//).)*)(?://(.*))?$""", line)
    return found[1], found[2]


def escaped(text):
    """What Doxygen would take for its commands or for HTML, outside of backticks."""
    parts = text.split("`")
    parts[::2] = [re.sub(r"([\\@<>&#])", r"\\\1", part) for part in parts[::2]]
    return "`".join(parts)


def as_lines(block):
    """The lines of a comment, as many as there were; those that are indented between empty ones are code."""
    out, code = [], False
    for text in block:
        text = text[1:] if text.startswith(" ") else text
        indented = text.startswith("  ")
        if code and not indented and text.strip():
            out[-1] = "\\endcode" if not out[-1] else out[-1]
            code = False
        elif not code and indented and out and not out[-1]:
            out[-1] = "\\code{.cpp}"
            code = True
        out.append(text[2:] if code else escaped(text.strip()))
    return out[:-1] + [f"{out[-1]} \\endcode"] if code else out


def in_a_line(lines):
    """The text up to the first code."""
    end = lines.index("\\code{.cpp}") if "\\code{.cpp}" in lines else len(lines)
    return "/** " + " ".join(lines[:end]) + " */ "


class Scopes:
    """Whether a place is among declarations, or within a function, an initialiser, parentheses."""

    def __init__(self):
        self.stack, self.parens, self.statement = [], 0, ""

    def declarative(self):
        return self.parens == 0 and "body" not in self.stack

    def fresh(self):
        return self.declarative() and not self.statement.strip()

    def read(self, code):
        for c in re.sub(r'"(?:\\.|[^"\\])*"' + r"|(?<!\w)'(?:\\.|[^'\\])*'", '""', code):
            if c in "()":
                self.parens += 1 if c == "(" else -1
            if c == "{":
                head = re.sub(r"template\s*<.*?>\s*(?=struct|class|union|requires|concept)", "", self.statement)
                is_type = self.parens == 0 and TYPE.search(" " + head) and "concept" not in head
                kind = "namespace" if re.search(r"\bnamespace\b", head) else "enum" if is_type and "enum" in head else "type" if is_type else "body"
                self.stack.append(kind)
                self.statement = "" if kind != "body" else self.statement + ("" if self.parens else "{")  # of `= {}`
            elif c == "}":
                kind = self.stack.pop() if self.stack else "body"
                function = kind == "body" and "body" not in self.stack and self.parens == 0 and re.search(r"\)[^=]*$", self.statement.split("{")[0])
                self.statement = "" if kind == "namespace" or function and not self.initialises() else self.statement + "}"
            elif c in ";," and (c == ";" or self.stack[-1:] == ["enum"]) and self.parens == 0:
                self.statement = "" if "body" not in self.stack else self.statement
            else:
                self.statement += c
        self.statement += " "

    def initialises(self):
        """The } of `: a_{1}` in the list of a constructor: the body is still to come."""
        return re.search(r"[:,]\s*\w+\s*\{[^{}]*$", self.statement)


def declarators(code):
    """`int a = 1, b;` as [`int a = 1;`, `int b;`]; one entry where it is no list of variables."""
    text, depth, pieces = code.strip(), 0, [""]
    if not text.endswith(";") or re.match(r"(using|friend|return|template|typedef)\b", text) or "(" in text.split("=")[0]:
        return [text]
    for c in text[:-1]:
        depth += (c in "<({[") - (c in ">)}]")
        pieces = pieces + [""] if c == "," and depth == 0 else pieces[:-1] + [pieces[-1] + c]
    first = re.match(r"([^={]*[^={\s])\s+(\w+)\s*(=.*|\{.*\})?$", pieces[0].strip())
    others = [piece.strip() for piece in pieces[1:]]
    if not first or not others or not all(re.match(r"\w+\s*(=.*|\{.*\})?$", piece) for piece in others):
        return [text]
    return [pieces[0].strip() + ";"] + [f"{first[1]} {piece};" for piece in others]


def name_of(code):
    """Of the type or function that a line declares; "" for anything else."""
    code = re.sub(r"^\s*template\s*<.*>\s*(?=struct|class|concept)", "", code)
    found = re.search(r"\b(?:struct|class|concept)\s+(\w+)", code)
    return found[1] if found else (re.findall(r"(\w+)\(", code.split("=")[0]) or [""])[0]


class Header:
    """Goes through a header line by line; `out` is what Doxygen reads."""

    def __init__(self, stem):
        self.stem, self.scopes, self.out = stem, Scopes(), []
        self.block, self.margin, self.column = [], "", None  # a comment not yet put; its indentation; where the last ///< stood
        self.about = []             # the comment of the file
        self.doc, self.start = [], None  # of the declaration that has begun: its comment, and its line in `out` until its name is read
        self.last = ("", [])        # the last declaration that was named, and its comment

    def put_block(self, code):
        """The comment lines above `code`."""
        if not self.out:
            self.about = as_lines(self.block)
            self.out += [f"/// {part}" for part in ["\\aboutfile " + self.about[0], *self.about[1:]]]  # of manual/Doxyfile
        elif self.scopes.fresh() and not NO_DECLARATION.match(code):
            self.doc = as_lines(self.block)
            self.out += [f"{self.margin}/// {part}".rstrip() for part in self.doc]
        else:
            self.out += [f"{self.margin}//{part}" for part in self.block]
        self.block = []

    def share(self, code):
        """The comment of the file, or of the overload above, for what has none of its own; "" where there is none to share."""
        name, top, shared = name_of(code), set(self.scopes.stack) <= {"namespace"}, ""
        if not self.doc and name and name == self.last[0] and self.last[1]:
            self.doc = self.last[1]
            shared = in_a_line(self.doc)
        elif not self.doc and top and self.about and name.lower() == self.stem.replace("_", ""):
            self.doc, self.about = self.about, []
            shared = in_a_line(self.doc)
        self.last = (name, self.doc)
        return shared

    def declare(self, code, note):
        """A line of code among declarations, with what stands behind it."""
        begins, first, shared = self.scopes.fresh(), self.start, ""
        if begins:
            first = self.start = len(self.out)
        if self.start is not None and not re.match(r"\s*(template\b[^;{]*|requires\b.*)$", code):
            shared, self.start = self.share(code), None
        self.scopes.read(code)
        enum, text = self.scopes.stack[-1:] == ["enum"], code.strip()
        whole, indent = begins and (self.scopes.fresh() or enum), code[:len(code) - len(code.lstrip())]
        behind = f" /**< {note} */" if note else ""
        if whole and re.match(r"(template\s*<.*>\s*)?(struct|class|union|enum)\b", text):
            self.out.append(f"{indent}/** {note} */ {text}" if note and not self.doc else code)
        elif enum and self.scopes.declarative():
            self.out.append(code.rstrip() + behind)
        elif whole and text != "}" and not text.endswith("{"):
            again = in_a_line(self.doc) if self.doc else ""
            self.out.append(indent + " ".join((again if k else "") + piece + behind for k, piece in enumerate(declarators(code))))
        else:
            self.out.append(code.rstrip())
            note = ""
        if shared:
            self.out[first] = shared + self.out[first]
        if self.start is None:
            self.doc = []
        self.column = len(code) if note else None  # a comment below, in the same column, goes on with it

    def read(self, line):
        code, comment = split_comment(line)
        if comment is not None and not code.strip():
            if self.column == len(code):
                self.out.append(f"{code}///< {escaped(comment.strip())}")
            else:
                self.margin, self.block = code, [*self.block, comment]
            return
        if self.block:
            self.put_block(code)
        self.column = None
        if not code.strip() or NO_STATEMENT.match(code) or LEFT_OUT.match(code) and self.scopes.fresh():
            self.out.append("" if LEFT_OUT.match(code) else code)
        elif self.scopes.declarative():
            self.declare(code, escaped(comment.strip()) if comment else "")
        else:
            self.scopes.read(code)
            self.out.append(code.rstrip())


def header(text, stem=""):
    text = re.sub(r"(?m)^namespace nscdd \{ inline namespace NSCDD_ABI \{", "namespace nscdd {", text)
    text = re.sub(r"(?m)^\}\}", "}", text)
    text = re.sub(r"(?m)^#define NSCDD_(?:ABI|LANES)(?:.*\\\n)*.*$", lambda found: "\n" * found[0].count("\n"), text)
    made = Header(stem)
    for line in text.splitlines():
        made.read(line)
    return "\n".join(made.out) + "\n"


# ---- pages


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
    text, target = found[1], found[2]
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
        return re.sub(r"\[([^\]]+)\]\(([^)\s]+)\)", lambda found: linked(found, path, pages, children), part)

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
    text = path.read_text()
    sys.stdout.write(page(text, path) if path.suffix == ".md" else header(text, path.stem) if path.suffix == ".hpp" else text)


if __name__ == "__main__":
    main()
