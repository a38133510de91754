"""A scene of cases/hard by a scheme, as the families of exact.py see it: it makes runs, and rows of what they should have been."""
import math
import re
import shutil
from pathlib import Path

import h5py
import numpy as np

from ... import record
from ...program import NSCDD, Failed, Killed, call, shown
from .exact import FAMILIES, norm

SCHEMES = {  # subdomains, options
    "nlgs": (1, "--scheme nlgs --method paper"),
    "dcs": (4, "--scheme dcs --method paper"),
    "nlgs-auto": (1, "--scheme nlgs"),
    "dcs-auto": (4, "--scheme dcs"),
    "newton": (1, "--scheme newton"),
}


def strips(places, subdomains):
    """Options for so many strips across the longest side: the grid that is chosen for rods and planes may not cut them."""
    sides = [max(axis) - min(axis) for axis in zip(*places)]
    cells = ["1"] * len(sides)
    cells[sides.index(max(sides))] = str(subdomains)
    return ["--subdomains", subdomains, "--grid", "x".join(cells)]


class Result:
    """One run of the program; its arrays are those of the state file."""

    def __init__(self, command, stem=None, errors="", exit_code=0):
        self.command, self.stem, self.errors, self.exit, self.json = shown(command), stem, errors, exit_code, None
        if stem is None or not Path(f"{stem}.json").exists():  # failed, or refused
            return
        self.json = record.load(f"{stem}.json")
        with h5py.File(f"{stem}.h5") as file:
            self.x, self.radius, self.velocity, self.spin = (file[key][...] for key in ("x", "radius", "velocity", "spin"))
            self.i, self.j, self.normal, self.impulse, self.owner = (file[f"contacts/{key}"][...] for key in ("i", "j", "normal", "impulse", "subdomain"))

    def on_wall(self, wall):
        """The sizes of all impulses on it."""
        return sum(norm(impulse) for impulse, j in zip(self.impulse, self.j) if j == -1 - wall)


class Case:
    def __init__(self, path, scheme, folder, quick=False):
        self.path, self.scheme, self.folder, self.quick = path, scheme, folder, quick
        self.scene = record.toml(path)
        self.name, self.dimension, self.tolerance = self.scene["name"], self.scene["dimension"], self.scene["solver"]["tolerance"]
        self.h, self.count, self.g = self.scene["step"]["h"], self.scene["step"]["count"], math.hypot(*self.scene["gravity"])
        self.inertia_share = 0.4 if self.dimension == 3 else 0.5  # I / (m R^2)
        self.radii = self.of_grains("radius")[:, 0]
        density = {entry["name"]: entry["density"] for entry in self.scene["material"]}
        volumes = math.pi * self.radii**2 * (4 / 3 * self.radii if self.dimension == 3 else 1)
        self.m = np.array([density[grain["material"]] for grain in self.scene["grain"]]) * volumes
        self.subdomains, self.options = SCHEMES[scheme]
        self.gauss_seidel = "paper" in self.options  # its iterations are sweeps, whose number theory bounds
        self.family = max((key for key in FAMILIES if re.match(rf"{key}(-|$)", self.name)), key=len)
        self.runs = {}

    def of_grains(self, key):
        """What the scene says of each grain, a row each."""
        return np.array([grain[key] for grain in self.scene["grain"]], float).reshape(len(self.scene["grain"]), -1)

    def law(self, *names):
        return next(entry for entry in self.scene["pair"] if sorted(entry["materials"]) == sorted(names))

    def sibling(self, name):
        """Another scene of the same dimension and scheme, in a folder of its own: it may also run as a case, at the same time."""
        folder = self.folder / f"for-{self.name}"
        folder.mkdir(exist_ok=True)
        return Case(self.path.with_name(f"{name}-{self.dimension}d.toml"), self.scheme, folder)

    def command(self):
        divided = strips(self.of_grains("position"), self.subdomains) if self.subdomains > 1 else []
        return [NSCDD, "run", self.path, *self.options.split(), "--quiet", *divided]

    def at_rest(self, result):
        """The same state with all velocities zero, to go on from."""
        stem = result.stem.with_name(result.stem.name + "-at-rest")
        for suffix in (".h5", ".json"):
            shutil.copy(f"{result.stem}{suffix}", f"{stem}{suffix}")
        with h5py.File(f"{stem}.h5", "r+") as file:
            file["velocity"][...] = file["spin"][...] = 0
        return Result([], stem)

    def with_step(self, **step):
        """The same scene with another [step], written beside the results."""
        lines = "\n".join(f"{key} = {value!r}" for key, value in (self.scene["step"] | step).items())
        text = re.sub(r"\[step\]\n(\w.*\n)+", f"[step]\n{lines}\n", self.path.read_text())
        name = "-".join([self.name, *(f"{key}-{value:.6g}" for key, value in step.items())])
        path = self.folder / f"{name}-{self.scheme}.toml"
        path.write_text(re.sub(r'name = ".*"', f'name = "{name}"', text, count=1))
        return Case(path, self.scheme, self.folder)

    def run(self, steps=None, start=None, tolerance=None, exits=(0,)):
        """The scene, or its first `steps` steps; `start`: a result to go on from. Raises Failed unless the program's exit code is one of `exits`."""
        key = steps, start and start.stem, tolerance, exits
        if key not in self.runs:
            stem = self.folder / f"{self.name}-{self.scheme}{f'-{len(self.runs)}' if self.runs else ''}"
            Path(f"{stem}.json").unlink(missing_ok=True)  # what is refused leaves none
            command = [*self.command(), "--json", f"{stem}.json", "--state", f"{stem}.h5"]
            command += ["--steps", steps] if steps else []
            command += ["--tolerance", tolerance] if tolerance else []
            if start:
                command += ["--from", f"{start.stem}.h5", *(["--adopt"] if start.json["scene"] != self.scene["name"] else [])]
            done = call(command, fine=exits)
            self.runs[key] = Result(command, stem, done.stderr, done.returncode)
        return self.runs[key]

    def row(self, quantity, expected, found, bound, source, result, relation="=", error=None):
        """One row of the table. relation: found = expected, or an inequality; the error is how far it is from that."""
        expected, found, run = float(expected), float(found), result.json or {}
        if error is None:
            error = {"=": abs(found - expected), "<=": max(0.0, found - expected), ">=": max(0.0, expected - found)}[relation]
        residuals = run.get("residual", [])
        return {
            **{"case": self.name, "family": self.family, "dimension": self.dimension, "scheme": self.scheme, "subdomains": self.subdomains},
            **{"quantity": quantity, "relation": relation, "expected": expected, "found": finite(found), "error": finite(error)},
            **{"bound": float(bound), "bound_from": source, "ok": bool(error <= bound)},
            **{"iterations": sum(run.get("iterations", [])), "steps": run.get("steps", 0)},
            "residual": None if None in residuals else max(residuals, default=0.0),
            **{"answer": run.get("answer"), "commands": [result.command]},
        }

    def rows(self):
        try:
            return list(FAMILIES[self.family](self))
        except Killed:
            raise
        except Failed as problem:
            return [self.row("the run", 0, math.nan, 0, "law", Result(self.command())) | {"note": str(problem)}]


def finite(value):
    return float(value) if math.isfinite(value) else None
