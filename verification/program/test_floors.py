"""The floors of kernel and program: what scripts/floors calls an include that goes up, on a made-up tree and on ours."""
import contextlib
import io
import subprocess
import sys
import unittest
import xml.etree.ElementTree

from harness import ProgramTest, load_script

script = load_script("floors")
FLOORS = [("low", "what all need"), ("high", "what needs it")]


class Floors(ProgramTest):
    def problems(self, **headers):
        """Of a tree with one header for each name: low_a is nscdd/low/a.hpp."""
        for name, text in headers.items():
            path = self.folder / "nscdd" / f"{name.replace('_', '/')}.hpp"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return script.problems(script.read_includes(self.folder), FLOORS)

    def test_includes_may_go_down_or_stay(self):
        self.assertEqual(self.problems(low_a="#include <vector>\n", low_b='#include "nscdd/low/a.hpp"\n', high_c="#include <nscdd/low/a.hpp>\n"), [])

    def test_an_include_that_goes_up_is_named_with_its_file(self):
        self.assertEqual(
            self.problems(low_a='  #  include "nscdd/high/c.hpp"  // why\n', high_c=""), ['low/a.hpp includes "high/c.hpp": high is a higher floor than low']
        )

    def test_a_folder_needs_a_floor(self):
        self.assertEqual(self.problems(attic_a='#include "nscdd/low/b.hpp"\n', low_b=""), ["attic: no floor; add it to a list in scripts/floors"])

    def test_a_tree_without_headers_is_refused(self):
        with self.assertRaises(SystemExit) as end, contextlib.redirect_stderr(io.StringIO()):
            script.read_includes(self.folder)
        self.assertIn("no headers in", str(end.exception))

    def test_the_command_fails_on_an_include_that_goes_up(self):
        self.problems(core_a='#include "nscdd/step/b.hpp"\n', step_b="")
        done = subprocess.run([sys.executable, script.__file__, "--check", "--tree", str(self.folder)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn('core/a.hpp includes "step/b.hpp"', done.stderr)

    def test_no_header_of_the_kernel_includes_a_higher_floor(self):
        done = subprocess.run([sys.executable, script.__file__, "--check"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_no_source_of_the_program_includes_a_higher_floor(self):
        self.assertEqual(script.problems(script.read_program(), script.PROGRAM_FLOORS), [])
        up = [("files/a.hpp", "commands/b.hpp")]
        self.assertEqual(script.problems(up, script.PROGRAM_FLOORS), ['files/a.hpp includes "commands/b.hpp": commands is a higher floor than files'])

    def test_the_drawing_has_every_floor_and_every_arrow(self):
        found = script.arrows(script.read_includes(script.ROOT / "kernel/include"))
        names = [name for name, _ in script.FLOORS]
        picture = xml.etree.ElementTree.fromstring(script.drawing(found, names))
        tag = "{http://www.w3.org/2000/svg}"
        self.assertEqual(len(picture.findall(f"{tag}rect")), len(names))
        self.assertEqual(len(picture.findall(f"{tag}path")), len(found))


if __name__ == "__main__":
    unittest.main()
