"""An option is said once: the manual's table of [solver], scenes and `nscdd run --help` have the same names and defaults."""
import json
import os
import re
import subprocess
import unittest

from harness import NSCDD, ROOT, SCENE, ProgramTest

OPTION = re.compile(r"^  --([a-z-]+) (?:FLOAT|INT):NUMBER(.*?)(?=^  -)", re.MULTILINE | re.DOTALL)
MANUAL = ROOT / "manual/3-own-scene.md"


def in_help():
    """{name: (default, sentence)} of the options that a scene may give too."""
    text = subprocess.run([NSCDD, "run", "--help"], capture_output=True, text=True, check=True).stdout
    found = {}
    for name, rest in OPTION.findall(text):
        if told := re.fullmatch(r"(.*) \(default: the scene's, or (\S+)\)", " ".join(rest.split())):
            found[name.replace("-", "_")] = (float(told[2]), told[1])
    return found


def in_manual(text):
    """Rows of the table of [solver] that have a number as default."""
    return re.findall(r"^\| `\w+` \| [\d.e-]+ \| [^|]* \|$", text[text.index("| `[solver]` |") :].split("\n\n")[0], re.MULTILINE)


class Options(ProgramTest):
    def test_the_manual_has_the_options_and_defaults_of_the_program(self):
        """Its table is made of what --help says: NSCDD_ACCEPT=1 writes it."""
        expected = [f"| `{name}` | {default:g} | {sentence} |" for name, (default, sentence) in in_help().items()]
        self.assertGreater(len(expected), 10)
        text = MANUAL.read_text()
        if os.environ.get("NSCDD_ACCEPT"):
            text = text.replace("\n".join(in_manual(text)), "\n".join(expected))
            MANUAL.write_text(text)
        self.assertEqual(in_manual(text), expected)

    def test_the_results_have_every_option(self):
        given = {
            name: 7 if name == "window" else 0.0625 if default < 1 and name != "check_every" else 1.5 if name == "relaxation" else 11
            for name, (default, _) in in_help().items()
        }
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
