"""`nscdd compare` trusts nothing of what it is given, and judges restarted runs."""
import json
import os
import pathlib
import shutil
import unittest

import h5py
import jsonschema
import numpy as np

from harness import SCENE, ProgramTest

SCHEMA = json.loads((pathlib.Path(__file__).resolve().parents[2] / "reports" / "compare.schema.json").read_text())


def checksum(data):
    """FNV-1a, 64 bits."""
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return f"{value:016x}"


class Compare(ProgramTest):
    def setUp(self):
        super().setUp()
        self.scene = self.write("scene.toml", SCENE)
        self.reference = self.run_case("reference")
        self.candidate = self.run_case("candidate", "--scheme", "dcs", "-n", 2)

    def run_case(self, name, *options):
        path = self.folder / f"{name}.json"
        self.succeeds("run", self.scene, "--json", path, "--state", path.with_suffix(".h5"), "--quiet", *options)
        return path

    def tampered(self, change_report=None, change_state=None):
        """The candidate's files with other content, as somebody may have made them on purpose."""
        path, state = self.folder / "tampered.json", self.folder / "tampered.h5"
        shutil.copy(self.candidate.with_suffix(".h5"), state)
        if change_state:
            with h5py.File(state, "r+") as file:
                change_state(file)
        report = json.loads(self.candidate.read_text()) | {"state": state.name, "state_checksum": checksum(state.read_bytes())}
        if change_report:
            change_report(report)
        path.write_text(json.dumps(report))
        return path

    def compare(self, reference, candidate, *options):
        return self.run_program("compare", reference, candidate, *options)

    def refused(self, fragments, candidate, reference=None):
        done = self.compare(reference or self.reference, candidate)
        with self.subTest(fragments=fragments):
            self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
            self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
            for fragment in ("nscdd:", *fragments):
                self.assertIn(fragment, done.stderr)

    def disagrees(self, row, candidate):
        done = self.compare(self.reference, candidate)
        self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
        self.assertRegex(done.stdout, rf"{row}.* DISAGREES")

    def test_untampered(self):  # so that the refusals below are for the reason given
        self.succeeds("compare", self.reference, self.tampered())

    def test_keys(self):
        for key in (
            "schema",
            "scene",
            "scheme",
            "transport",
            "state",
            "state_checksum",
            "dimension",
            "grains",
            "steps",
            "start_step",
            "subdomains",
            "unconverged_steps",
            "h",
            "tolerance",
            "residual",
            "velocity_error",
            "max_velocity_error",
            "energy_gain",
            "penetration",
            "contacts",
            "densities",
            "wall_masses",
            "final",
        ):
            message = {"schema": "not the JSON of `nscdd run`", "state": "was run without --state"}.get(key, f"{key} is missing")
            self.refused(["tampered.json", message], self.tampered(lambda report: report.pop(key)))
            self.refused(["tampered.json", key if key != "schema" else "not the JSON"], self.tampered(lambda report: report.update({key: {}})))
        for key in ("kinetic_energy", "free_velocity_norm", "virial"):
            self.refused(["tampered.json", f"final: {key} is missing"], self.tampered(lambda report: report["final"].pop(key)))
            self.refused(["tampered.json", f"final: {key} must be"], self.tampered(lambda report: report["final"].update({key: None})))

    def test_values(self):
        for key, value, message in (
            ("unconverged_steps", -5, "unconverged_steps must be an integer in [0, 5], found -5"),
            ("unconverged_steps", 2**64 - 1, "unconverged_steps must be an integer"),
            ("steps", 4, "residual must be an array of 4 numbers, found an array of 5"),
            ("residual", [0, 0, 0, 0, "x\ny"], 'residual must be a number, found "x\\ny"'),
            ("residual", [0, 0, 0, 0, -1], "residual must be of numbers >= 0, found -1"),
            ("densities", [], "grain 0 has material 0, but"),
            ("dimension", 4, "dimension must be an integer in [2, 3]"),
            ("dimension", 2, "virial must be 2 rows of 2 numbers"),
            ("grains", 3, "grains: 2, but 3 in"),
            ("scene", "another", "scene: pair, but another in"),
            ("wall_masses", [0, 0], "walls: 1, but 2 in"),
            ("start_step", 1, "steps made: 5, but 6 in"),
            ("h", 0.002, "h is 0.002, but 0.001 in"),
            ("densities", [2.0], "density of material 0 is 2, but 1 in"),
            ("wall_masses", [3], "mass of wall 0 is 3, but 0 in"),
            ("state", "reference.h5", "is the state of both"),
            ("state", "none.h5", "none.h5: cannot open"),
            ("state", "/dev/zero", "/dev/zero: is a device, not a file"),
            ("state_checksum", "0", "is not the state that"),
        ):
            self.refused([message], self.tampered(lambda report: report.update({key: value})))
        self.refused(["is the state of both"], self.reference)

    def test_states(self):
        def resized(rows, *names):
            def change(state):
                for name in names:
                    values = np.resize(state[name][...], (rows, *state[name].shape[1:]))
                    del state[name]
                    state[name] = values

            return change

        def put(name, *at_value):
            return lambda state: state[name].__setitem__(*at_value)

        of_grains = ("x", "radius", "velocity", "spin", "material", "subdomain", "multiplicity", "rough/x")
        of_walls = tuple(f"walls/{name}" for name in ("name", "offset", "normal", "velocity", "normal_speed")) + ("rough/offset",)
        of_contacts = tuple(f"contacts/{name}" for name in ("i", "j", "gap", "normal", "impulse", "normal_impulse", "subdomain"))
        of_materials = ("materials/name", "materials/density")

        def two_materials(state):
            resized(2, *of_materials)(state)
            state["material"][1] = 1

        for change, message in (
            (resized(2, *of_walls), "walls: 2, but 1 in"),
            (resized(3, *of_grains), "grains: 3, but 2 in"),
            (put("material", 1, 7), "dataset 'material': row 1 must lie in [0, 0], found 7"),
            (two_materials, "grain 1 has material 1, but"),
            (put("radius", 1, 0.25), "radius of grain 1 is 0.25, but 0.5 in"),
            (put("velocity", (0, 0), np.inf), "dataset 'velocity': row 0 is not finite"),
        ):
            self.refused([message], self.tampered(change_state=change))

        def without_contacts_and_walls(state):
            resized(0, *of_contacts)(state)
            resized(0, *of_walls)(state)

        def with_one_grain(state):
            without_contacts_and_walls(state)
            resized(1, *of_grains)(state)

        self.refused(["walls: 0, but 1 in"], self.tampered(change_state=without_contacts_and_walls))
        self.refused(["grains: 1, but 2 in"], self.tampered(change_state=with_one_grain))

    def test_not_a_run(self):
        os.mkfifo(self.folder / "fifo.json")
        self.refused(["fifo.json: is a FIFO, not a file"], self.folder / "fifo.json")
        self.refused(["no.json: cannot open"], self.folder / "no.json")
        for text in ("", "[]", "{", '"nscdd.run/1"', "[" * 1_000_000, '{"schema": 1e999}', '{"schema": "nscdd.run/1"', "\0", "{}"):
            self.refused(["bad.json: ", "`nscdd run`"], self.write("bad.json", text))

    def test_the_candidate_does_not_judge_itself(self):
        excused = self.tampered(lambda report: report.update(tolerance=10.0, residual=[0, 0, 0.5, 0, 0]))
        self.disagrees("largest residual eta, <= 1e-4 or the reference's tolerance +0.5 +<= 0.0001", excused)
        self.disagrees("steps without convergence +1", excused)
        self.disagrees("steps without convergence +1", self.tampered(lambda report: report.update(penetration=[0, 0.5, 0, 0, 0])))
        # a velocity error beyond 0.1 is excused by the reference alone
        rough = {"velocity_error": [0, 0.5, 0, 0, 0], "max_velocity_error": 1}
        self.disagrees("steps without convergence +1", self.tampered(lambda report: report.update(rough)))
        asks_less = self.folder / "asks-less.json"
        asks_less.write_text(json.dumps(json.loads(self.reference.read_text()) | {"max_velocity_error": 1}))
        self.assertEqual(self.compare(asks_less, self.tampered(lambda report: report.update(rough))).returncode, 0)
        self.disagrees("steps without convergence +3", self.tampered(lambda report: report.update(unconverged_steps=3)))
        self.disagrees("largest residual eta.* +nan", self.tampered(lambda report: report.update(residual=[0, None, 0, 0, 0])))
        self.disagrees(
            "contacts, differences of the steps / their sum", self.tampered(lambda report: report.update(contacts=[1, 9, 1, 1, 1], residual=[1e-5] * 5))
        )

        def faster(state):
            state["velocity"][...] *= 2
            state["velocity"][...] += 1

        self.disagrees("velocities", self.tampered(lambda report: report.update(residual=[1e-5] * 5), faster))

    def test_a_restarted_run(self):
        first = self.run_case("first", "--steps", 3)
        rest = self.run_case("rest", "--from", first.with_suffix(".h5"), "--steps", 2)
        self.assertEqual([json.loads(path.read_text())["start_step"] for path in (first, rest)], [0, 3])
        table = self.folder / "table.json"
        for pair in ((self.reference, rest), (rest, self.reference)):
            done = self.compare(*pair, "--json", table)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            found = json.loads(table.read_text())
            jsonschema.validate(found, SCHEMA)
            self.assertEqual((found["steps"], found["last_step"]), (2, 5))
        shorter = self.run_case("shorter", "--from", first.with_suffix(".h5"), "--steps", 1)
        self.refused(["start_step + steps is 4, but 5 in"], shorter)

    def test_no_output_is_an_input(self):
        for path in (self.reference, self.candidate, self.reference.with_suffix(".h5"), self.candidate.with_suffix(".h5")):
            before = path.read_bytes()
            done = self.compare(self.reference, self.candidate, "--json", path)
            self.assertEqual(done.returncode, 1)
            self.assertIn("--json is the same file as", done.stderr)
            self.assertEqual(path.read_bytes(), before)


if __name__ == "__main__":
    unittest.main()
