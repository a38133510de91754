"""The tutorial: its commands run in the order of the pages, and print what the pages say, in this order, times aside.

Commands are in blocks that begin with ```sh, what they print is in the block ```text that follows, where a line ... stands for
any lines. Blocks ```console are not run. Blocks ```cpp and ```cmake whose first line is a comment with the name of a file are saved as that
file. With NSCDD_ACCEPT=1 in the environment the pages take what the commands print.
"""
import difflib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest
import unittest.mock

from harness import NSCDD, ProgramTest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = [
    "1-first-scene.md",
    "2-paraview.md",
    "3-own-scene.md",
    "4-errors.md",
    "5-tolerance-and-step.md",
    "6-decompose.md",
    "7-mpi.md",
    "8-judge.md",
    "13-cells.md",
    "14-obstacles.md",
    "15-laws.md",
    "16-grains.md",
    "18-gallery.md",
]
OWN_CODE = "9-own-code.md"  # needs none of the others
PYTHON = ["17-python.md", "20-exchange.md"]  # neither do these
NUMBER = re.compile(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?%?")
TIME = re.compile(r"\d[\d.]*(?:e[-+]?\d+)? s\b|\b\d+:\d\d\b")
FUSED = "no fused products" not in subprocess.run([NSCDD, "--version"], capture_output=True, text=True).stdout


def steps(text):
    """(commands, what they print) of a page."""
    return re.findall(r"^```sh\n(.*?)^```\n(?:\n```text\n(.*?)^```)?", text, re.MULTILINE | re.DOTALL)


def files(text):
    """{name: text} of the files that a page asks to be saved."""
    blocks = re.findall(r"^```(?:cpp|cmake)\n((?://|#) (\S+)\n.*?)^```", text, re.MULTILINE | re.DOTALL)
    return {name: block for block, name in blocks}


def told(text):
    """Lines without times; without numbers by a program whose counts are not those of other machines."""
    return [" ".join((TIME if FUSED else NUMBER).sub("#", line).split()) for line in text.splitlines()]


def agrees(page, printed):
    """Whether a command has printed what a page says of it."""
    rest, parts = told(printed), [[]]
    for line in told(page):
        if line == "...":
            parts.append([])
        else:
            parts[-1].append(line)
    if len(parts) == 1:
        return rest == parts[0]
    first, *between, last = parts
    if rest[: len(first)] != first or len(rest) < len(first) + len(last) or (last and rest[-len(last) :] != last):
        return False
    rest = rest[len(first) : len(rest) - len(last)]
    for part in between:
        at = next((k for k in range(len(rest) - len(part) + 1) if rest[k : k + len(part)] == part), None)
        if at is None:
            return False
        rest = rest[at + len(part) :]
    return True


def accepted(page, printed):
    """The block of a page with what is printed now: in the place of each line the one that is most like it."""
    if "..." not in page.splitlines():
        return printed
    alike = lambda line: max(printed.splitlines(), key=lambda other: difflib.SequenceMatcher(None, line, other).ratio())
    return "".join(f"{line if line == '...' else alike(line)}\n" for line in page.splitlines())


class Page(ProgramTest):
    def run_block(self, commands):
        environment = {key: value for key, value in os.environ.items() if key != "NSCDD"}
        python = self.folder / "bin/python3"  # the one that has the packages of scripts/setup
        if not python.exists():
            python.parent.mkdir(exist_ok=True)
            python.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
            python.chmod(0o755)
        environment["PATH"] = f"{python.parent}:{environment['PATH']}"
        return subprocess.run(
            ["bash", "-e", "-c", commands], cwd=self.folder, env=environment, text=True, timeout=300, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )

    def follow(self, page):
        text = (ROOT / "manual" / page).read_text()
        for name, content in files(text).items():
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content)
        blocks = steps(text)
        self.assertTrue(blocks, page)
        for commands, printed in blocks:  # each needs what those before it have made
            # optimising takes a compiler longer than the page's example runs
            done = self.run_block(commands.replace(" -O2 ", " -O0 ").replace("BUILD_TYPE=Release", "BUILD_TYPE=None"))
            self.assertEqual(done.returncode, 0, f"{page}:\n{commands}{done.stdout}")
            if printed and not agrees(printed, done.stdout) and os.environ.get("NSCDD_ACCEPT"):
                path = ROOT / "manual" / page
                path.write_text(path.read_text().replace(printed, accepted(printed, done.stdout), 1))
            elif printed:
                self.assertTrue(agrees(printed, done.stdout), f"{page} says\n{printed}\nbut the commands print\n{done.stdout}")


class Checkout(Page):
    """A folder like that of the repository, with what has been built."""

    def setUp(self):
        super().setUp()
        for name in ("cases", "scripts"):  # copies, for scripts go to the root of their repository
            shutil.copytree(ROOT / name, self.folder / name)
        shutil.copytree(ROOT / "harness/suite", self.folder / "harness/suite", ignore=shutil.ignore_patterns("__pycache__"))
        (self.folder / "reports").symlink_to(ROOT / "reports")
        (self.folder / "build/bin").mkdir(parents=True)
        for name in ("nscdd", "nscdd_simulated"):
            program = pathlib.Path(NSCDD).resolve().with_name(name)
            if program.exists():
                (self.folder / "build/bin" / name).symlink_to(program)


class Tutorial(Checkout):
    def test_commands_do_what_the_pages_say(self):
        for page in ("../README.md", *PAGES):
            self.follow(page)


MODULE = pathlib.Path(NSCDD).resolve().parents[1] / "python"


class Python(Checkout):
    @unittest.skipUnless(MODULE.exists(), "pages 17 and 20 are not run: the Python module is not built")
    def test_commands_do_what_the_pages_say(self):
        (self.folder / "build/python").symlink_to(MODULE)
        (self.folder / "kernel").symlink_to(ROOT / "kernel")
        with unittest.mock.patch.dict(os.environ, PYTHONPATH="build/python"):  # which the page exports once
            for page in PYTHON:
                self.follow(page)


NEEDED = [program for program in ("g++", "cmake", "make") if not shutil.which(program)]
NEEDED += [] if pathlib.Path("/usr/include/eigen3/Eigen/Core").exists() else ["Eigen in /usr/include/eigen3"]


class OwnCode(Page):
    """One program is compiled twice, by a compiler and by CMake: less than a minute of one core."""

    @unittest.skipIf(NEEDED, f"page 9 is not run: there is no {', no '.join(NEEDED)}")
    def test_a_program_is_built_by_a_compiler_and_by_cmake(self):
        for name in ("CMakeLists.txt", "kernel"):
            (self.folder / name).symlink_to(ROOT / name)
        self.assertEqual(sorted(files((ROOT / "manual" / OWN_CODE).read_text())), ["results/manual/mine/CMakeLists.txt", "results/manual/mine/main.cpp"])
        self.follow(OWN_CODE)


class Agreement(unittest.TestCase):
    def test_numbers_and_order_count_times_do_not(self):
        page = "a: 10 iterations, 0.5 s\n...\nb\nc: 2.5e-3\n"
        for same in (page, "a: 10 iterations, 1.5e-3 s\nx\ny\nb\nc: 2.5e-3\n"):
            self.assertTrue(agrees(page, same))
        for other in ("a: 10 iterations, 1 s\nc: 2.5e-3\nb\n", "x\n" + page, page + "x\n", "a: 10 iterations, 1 s\nb\nx\nc: 2.5e-3\n", ""):
            self.assertFalse(agrees(page, other), other)
        self.assertTrue(agrees("...\nb\n...\nd\n...\n", "a\nb\nc\nd\ne\n"))
        self.assertFalse(agrees("...\nd\n...\nb\n...\n", "a\nb\nc\nd\ne\n"))

    @unittest.skipUnless(FUSED, "this program's counts are not those of other machines")
    def test_a_count_counts(self):
        self.assertFalse(agrees("10 iterations\n", "11 iterations\n"))


class Index(unittest.TestCase):
    def test_the_index_has_every_page(self):
        index = (ROOT / "manual/README.md").read_text()
        pages = list((ROOT / "manual").glob("[0-9]*.md"))
        self.assertEqual({path.name for path in pages if steps(path.read_text())}, {*PAGES, *PYTHON, OWN_CODE}, "each page with commands to paste is run")
        for path in pages:
            self.assertIn(f"({path.name})", index)
            self.assertLessEqual(len(path.read_text().splitlines()), 130, f"{path.name} is a page, not a chapter")

    def test_one_program_stands_in_three_places(self):
        example = (ROOT / "kernel/examples/ten_balls.cpp").read_text().split("\n", 1)[1]
        self.assertIn(f"```cpp\n{example}```", (ROOT / "README.md").read_text())
        self.assertEqual(files((ROOT / "manual" / OWN_CODE).read_text())["results/manual/mine/main.cpp"].split("\n", 1)[1], example)

    def test_the_front_page_is_a_page(self):
        self.assertLessEqual(len((ROOT / "README.md").read_text().splitlines()), 110)


if __name__ == "__main__":
    unittest.main()
