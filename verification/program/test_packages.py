"""What packages say of this project: one version, recipes that parse, completion of the program's own commands."""

import ast
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from harness import NSCDD, ROOT

PACKAGES = ROOT / "scripts/packages"


def version():
    return re.search(r"project\(nscdd VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]


class Version(unittest.TestCase):
    def test_all_that_names_it_names_one(self):
        expected = version()
        found = {
            "codemeta.json": json.loads((ROOT / "codemeta.json").read_text())["version"],
            ".zenodo.json": json.loads((ROOT / ".zenodo.json").read_text())["version"],
            "CITATION.cff": re.search(r"^version: (\S+)$", (ROOT / "CITATION.cff").read_text(), re.M)[1],
            "pyproject.toml": re.search(r'^version = "(.*)"$', (ROOT / "pyproject.toml").read_text(), re.M)[1],
            "CHANGELOG.md": re.search(r"^## (\d\S*[^,\s])", (ROOT / "CHANGELOG.md").read_text(), re.M)[1],
            "Spack": re.search(r'version\("(.*?)"', (PACKAGES / "spack/package.py").read_text())[1],
        }
        self.assertEqual(found, dict.fromkeys(found, expected))


class Recipes(unittest.TestCase):
    def test_they_parse(self):
        for recipe in ("conanfile.py", "spack/package.py"):
            ast.parse((PACKAGES / recipe).read_text(), recipe)

    @unittest.skipUnless(shutil.which("conan"), "conan is not installed")
    def test_conan_makes_the_package(self):
        with tempfile.TemporaryDirectory() as home:
            environment = {**os.environ, "CONAN_HOME": home}
            subprocess.run(["conan", "profile", "detect"], env=environment, check=True, capture_output=True)
            done = subprocess.run(["conan", "create", PACKAGES, "-s", "compiler.cppstd=20"], env=environment, capture_output=True, text=True)
            if re.search(r"Unable to connect|ConnectionError|not found in remotes|Max retries", done.stdout + done.stderr):
                self.skipTest("Conan's server of packages is out of reach")
            self.assertEqual(done.returncode, 0, done.stderr[-2000:])


class Completion(unittest.TestCase):
    def complete(self, *words):
        script = f'PATH={Path(NSCDD).parent}:$PATH; source {PACKAGES}/completion.bash; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _nscdd; printf "%s\\n" "${{COMPREPLY[@]}}"'
        return subprocess.run(["bash", "-c", script, "bash", *words], capture_output=True, text=True, check=True).stdout.split()

    def test_commands_and_their_options(self):
        self.assertEqual(self.complete("nscdd", "solve"), ["solve-fclib"])
        self.assertIn("run", self.complete("nscdd", ""))
        self.assertIn("--subdomains", self.complete("nscdd", "run", "--sub"))
        self.assertEqual(self.complete("nscdd", "compare", "--subdom"), [])


if __name__ == "__main__":
    unittest.main()
