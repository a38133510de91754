"""An option is said once: the manual's table of [solver], scenes and `nscdd run --help` have the same names and defaults."""
import json
import re
import subprocess
import unittest

from harness import NSCDD, ROOT, SCENE, ProgramTest

OPTION = re.compile(r"^  (--[a-z-]+) (?:FLOAT|INT):NUMBER(.*?)(?=^  -)", re.MULTILINE | re.DOTALL)


def in_help():
    """{name: default} of the options that a scene may give too."""
    text = subprocess.run([NSCDD, "run", "--help"], capture_output=True, text=True, check=True).stdout
    found = {}
    for name, rest in OPTION.findall(text):
        default = re.search(r"\(default: the scene's, or (\S+)\)", " ".join(rest.split()))
        if default:
            found[name.removeprefix("--").replace("-", "_")] = float(default[1])
    return found


def in_manual():
    """{name: default} of the table of [solver]."""
    text = (ROOT / "manual/3-own-scene.md").read_text()
    table = text[text.index("| `[solver]` |") :].split("\n\n")[0]
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \|", table, re.MULTILINE)
    return {name: float(re.match(r"[\d.e-]+", default)[0]) for name, default in rows if not default.startswith("`")}


class Options(ProgramTest):
    def test_the_manual_has_the_options_and_defaults_of_the_program(self):
        self.assertGreater(len(in_help()), 10)
        self.assertEqual(in_manual(), in_help())

    def test_the_results_have_every_option(self):
        given = {name: 7 if name == "window" else 0.0625 if default < 1 else 1.5 if name == "relaxation" else 11 for name, default in in_help().items()}
        options = [word for name, value in given.items() for word in (f"--{name.replace('_', '-')}", value)]
        self.succeeds("run", self.write("pair.toml", SCENE), *options, "--json", self.folder / "run.json", "--quiet")
        run = json.loads((self.folder / "run.json").read_text())
        self.assertEqual({name: run[name] for name in given}, given)

    def test_names_of_earlier_programs_are_taken_but_not_beside_those_of_now(self):
        scene, results = self.write("pair.toml", SCENE), self.folder / "run.json"
        self.succeeds("run", scene, "--distance", 0.0625, "--newton-contacts", 11, "--json", results, "--quiet")
        run = json.loads(results.read_text())
        done = self.run_program("run", scene, "--distance", "nan")
        self.assertEqual(done.stderr, "nscdd: --distance: must be a finite number > 0, found nan; see --help\n")
        self.assertEqual((run["max_distance"], run["max_newton_contacts"]), (0.0625, 11))
        for options in (("--distance", 1, "--max-distance", 1), ("--max-distance", 1, "--distance", 1)):
            done = self.run_program("run", scene, *options)
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, "^nscdd: --distance: is the earlier name of --max-distance, which is given too; see --help\n$")

    def test_what_would_be_read_as_another_value_or_dropped_is_refused(self):
        scene = self.write("pair.toml", SCENE)
        for message, *options in (
            ("--steps: must be written as 10, found 010; see --help", "--steps", "010"),
            ("--from: is empty, give a file; see --help", "--from", ""),
            ("--json: is empty, give a file; see --help", "--json", ""),
            ("--max-newton-contacts is not of the method paper, which hands nothing over", "--method", "paper", "--max-newton-contacts", 5),
        ):
            done = self.run_program("run", scene, *options)
            self.assertEqual((done.returncode, done.stderr), (1, f"nscdd: {message}\n"))


if __name__ == "__main__":
    unittest.main()
