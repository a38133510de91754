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
EIGEN = """
from conan import ConanFile

class Eigen(ConanFile):
    name, version, package_type = "eigen", "3.4.0", "header-library"

    def package_info(self):
        self.cpp_info.includedirs = ["/usr/include/eigen3"]
        self.cpp_info.set_property("cmake_file_name", "Eigen3")
        self.cpp_info.set_property("cmake_target_name", "Eigen3::Eigen")
"""


def version():
    return re.search(r"project\(nscdd VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]


def conan(command, *words, environment):
    """Output of a command of Conan, which may ask no server."""
    offline = ["--no-remote"] if command == "create" else []
    done = subprocess.run(["conan", command, *words, *offline], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout + done.stderr


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
            conan("profile", "detect", environment=environment)
            stand_in = Path(home, "eigen/conanfile.py")  # Conan's server of packages is not asked
            stand_in.parent.mkdir()
            stand_in.write_text(EIGEN)
            conan("create", stand_in.parent, environment=environment)
            options = ("-s", "compiler.cppstd=20", "-s", "build_type=Debug", "-c", f"tools.cmake.cmake_layout:test_folder={home}/test")
            told = conan("create", PACKAGES, *options, environment=environment)
            self.assertIn("step 1000: 10 contacts", told)


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
