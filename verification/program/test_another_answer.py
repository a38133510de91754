"""With friction a step may have several answers: `nscdd compare` tells another one from a wrong one."""
import json
import math
import pathlib
import shutil
import unittest

import h5py
import jsonschema
import numpy as np

from harness import ProgramTest

SCHEMA = json.loads((pathlib.Path(__file__).resolve().parents[2] / "reports" / "compare.schema.json").read_text())

# A disk under two walls that open downwards. It falls freely, or friction holds it where it is wedged in.
SINE, COSINE = 0.28, 0.96
WEDGE = f"""name = "wedge"
dimension = 2
gravity = [0, -10]

[[material]]
name = "steel"
density = 1.0

[[pair]]
materials = ["steel", "steel"]
friction = 0.6

[[grain]]
position = [0, {-0.5 / SINE}]
radius = 0.5
material = "steel"

[[wall]]
name = "left"
normal = [{COSINE}, {-SINE}]
through = [0, 0]
material = "steel"
motion = "fixed"

[[wall]]
name = "right"
normal = [{-COSINE}, {-SINE}]
through = [0, 0]
material = "steel"
motion = "fixed"

[step]
h = 0.001
count = 1
"""


def pyramid(rows, friction):
    """The scene of a pile of disks that touch, all gaps zero."""
    disks = [(i + 0.5 * k, 0.5 + k * math.sqrt(0.75)) for k in range(rows) for i in range(rows - k)]
    return (
        WEDGE[: WEDGE.index("[[grain]]")].replace("0.6", f"{friction}").replace("wedge", "pyramid")
        + "".join(f'[[grain]]\nposition = [{x}, {y}]\nradius = 0.5\nmaterial = "steel"\n\n' for x, y in disks)
        + """[[wall]]
name = "floor"
normal = [0, 1]
through = [0, 0]
material = "steel"
motion = "fixed"

[step]
h = 0.01
count = 1

[solver]
tolerance = 1e-8
"""
    )


class Judged(ProgramTest):
    def step(self, name, scene, *options):
        path = self.folder / f"{name}.json"
        self.succeeds("run", scene, "--json", path, "--state", path.with_suffix(".h5"), "--quiet", *options)
        return path

    def judged(self, reference, candidate):
        """Exit code, what is said last, and the verdict of the table."""
        table = self.folder / "table.json"
        done = self.run_program("compare", reference, candidate, "--json", table)
        found = json.loads(table.read_text())
        jsonschema.validate(found, SCHEMA)
        return done.returncode, done.stdout.splitlines()[-1].replace(f"{self.folder}/", ""), found["verdict"]


class Wedge(Judged):
    def setUp(self):
        super().setUp()
        start = self.folder / "start.h5"
        self.succeeds("run", self.write("still.toml", WEDGE.replace("-10", "0")), "--state", start, "--quiet")
        shutil.copy(start, self.folder / "wedged.h5")
        weight = 10 * 0.001 * np.pi * 0.25
        with h5py.File(self.folder / "wedged.h5", "r+") as state:
            pushes = {-1: (10 * weight, weight / 2), -2: (-10 * weight, weight / 2)}  # by left and right, inside the cones
            state["contacts/impulse"][...] = [pushes[j] for j in state["contacts/j"][...]]
        self.scene = self.write("wedge.toml", WEDGE)
        self.falls, self.holds = (self.step(name, self.scene, "--from", path) for name, path in (("falls", start), ("holds", self.folder / "wedged.h5")))

    def told(self, path, **changes):
        """The files of a run that tells something else."""
        other = self.folder / f"told-{path.name}"
        other.write_text(json.dumps(json.loads(path.read_text()) | changes))
        return other

    def test_two_answers(self):
        for pair in ((self.falls, self.holds), (self.holds, self.falls)):
            self.assertEqual(
                self.judged(*pair), (5, "another answer: each step of both is exact to 1e-08, and with friction velocities are not unique", "another answer")
            )
        again = self.step("again", self.scene, "--from", self.folder / "start.h5", "--scheme", "dcs", "-n", 2)
        code, _, verdict = self.judged(self.falls, again)
        self.assertEqual((code, verdict), (0, "agrees"))

    def test_what_is_not_exact_cannot_be_told(self):
        for changes, said in (
            ({"residual": [2e-8]}, "step 2 of told-holds.json has eta 2.0e-08 and velocity error"),
            ({"velocity_error": [0.01]}, "and velocity error 1.0e-02; make both runs with --tolerance 1e-08 --max-velocity-error 0.001"),
        ):
            told = self.told(self.holds, **changes)
            for pair in ((self.falls, told), (told, self.falls)):
                code, line, verdict = self.judged(*pair)
                self.assertEqual((code, verdict), (2, "cannot be told"))
                self.assertIn(said, line)

    def test_another_problem_is_not_another_answer(self):
        slippery = self.write("slippery.toml", WEDGE.replace("friction = 0.6", "friction = 0.5"))
        other = self.step("other", slippery, "--from", self.folder / "start.h5")
        for pair in ((self.holds, other), (self.holds, self.told(self.falls, problem="0" * 16))):
            code, line, verdict = self.judged(*pair)
            self.assertEqual((code, verdict), (2, "different problems"))
            self.assertIn("coefficients, h or theta differ at the start", line)
        code, line, verdict = self.judged(self.holds, self.told(self.step("again", self.scene, "--from", self.folder / "wedged.h5"), problem="0" * 16))
        self.assertEqual((code, verdict), (0, "agrees"))
        self.assertIn("within the bounds, but grains, walls, coefficients, h or theta differ", line)
        earlier = self.told(self.falls)  # as by a program that did not tell it
        run = json.loads(earlier.read_text())
        del run["problem"]
        earlier.write_text(json.dumps(run))
        code, line, verdict = self.judged(self.holds, earlier)
        self.assertEqual((code, verdict), (2, "cannot be told"))
        self.assertIn("does not say which problem it solves", line)
        whole = self.step("whole", self.scene, "--steps", 2)  # the other begins with its second step
        code, line, verdict = self.judged(self.holds, whole)
        self.assertEqual((code, verdict), (2, "cannot be told"))
        self.assertIn("do not begin at one step", line)

    def test_what_has_not_converged_is_no_answer(self):
        code, line, verdict = self.judged(self.falls, self.told(self.holds, residual=[0.01]))
        self.assertEqual((code, line, verdict), (2, "wrong answer: eta of told-holds.json is beyond its bound, so it is none", "wrong answer"))
        code, line, verdict = self.judged(self.falls, self.told(self.holds, unconverged_steps=1))
        self.assertEqual((code, verdict), (2, "cannot be told"))
        self.assertIn("told-holds.json has steps without convergence, 1", line)
        self.assertIn("a higher --max-iterations or fewer --steps", line)
        again = self.step("again", self.scene, "--from", self.folder / "start.h5", "--scheme", "dcs", "-n", 2)
        code, _, verdict = self.judged(self.falls, self.told(again, unconverged_steps=1))
        self.assertEqual((code, verdict), (2, "not converged"))

    def test_without_friction_one_of_them_is_wrong(self):
        code, line, verdict = self.judged(*(self.told(path, friction=False) for path in (self.falls, self.holds)))
        self.assertEqual((code, verdict), (2, "wrong answer"))
        self.assertIn("without friction velocities are unique", line)


class Pyramid(Judged):
    def test_it_stands_or_falls_by_the_number_of_subdomains(self):
        scene = self.write("pyramid.toml", pyramid(3, 0.7))
        stands = self.step("stands", scene, "--scheme", "spg")
        verdicts = {self.judged(stands, self.step(f"{n}", scene, "--scheme", "dcs", "-n", n))[::2] for n in range(1, 9)}
        self.assertIn((5, "another answer"), verdicts)
        self.assertLessEqual(verdicts, {(5, "another answer"), (0, "agrees")})
        for n in (1, 3, 8):  # impulses under which it stands are an answer for all
            warm = json.loads(self.step("warm", scene, "--scheme", "dcs", "-n", n, "--from", stands.with_suffix(".h5")).read_text())
            self.assertLess(warm["final"]["kinetic_energy"], 1e-12)


if __name__ == "__main__":
    unittest.main()
