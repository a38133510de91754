"""The gallery: small scenes that people ask for, each with a picture and with one quantity beside a published number.

A scene is a TOML of at most 60 lines in cases/gallery, with a packing beside it. Nothing is timed."""
import csv
import math
import tomllib
from pathlib import Path

import h5py
import numpy as np
from scipy.optimize import brentq

from ... import record
from ...program import NSCDD, ROOT
from ...study import Study
from ..physics.granular import lade_duncan

FRAMES, QUICK_STEPS = 8, 60  # frames of a run; steps of a quick job


def warm(source, out):
    """Gives the grains of a packing random velocities: mean 0, mean square 1 along each axis."""
    with h5py.File(source) as packing, h5py.File(out, "w") as file:
        for name in packing:
            packing.copy(name, file)
        velocity = np.random.default_rng(1).normal(size=packing["x"].shape)
        velocity -= velocity.mean(0)
        file["velocity"] = velocity / np.sqrt((velocity**2).mean())


def series(run):
    with open(f"{run}.csv") as file:
        return {name: np.array(column, float) for name, *column in zip(*csv.reader(file))}


def collapse(run, packing):
    """Run-out of the grains that touch each other and, through others, the greatest heap; ours, and published low and high."""
    with h5py.File(packing) as file:
        width, height = file["box"][()]
    with h5py.File(f"{run}.h5") as end:
        x, i, j = end["x"][()], end["contacts/i"][()], end["contacts/j"][()]
        touching = (j >= 0) & (end["contacts/gap"][()] < 0.01)
    heap = np.arange(len(x))
    while True:  # the least number of what it touches
        least = heap.copy()
        for a, b in ((i[touching], j[touching]), (j[touching], i[touching])):
            np.minimum.at(least, a, heap[b])
        if (least == heap).all():
            break
        heap = least
    law = 3.25 * (height / width) ** 0.7
    reached = x[heap == np.bincount(heap).argmax(), 0].max()
    return (reached - width) / width, 0.85 * law, 1.15 * law, law


def gas(run, packing):
    told, fraction, restitution = series(run), 0.45, 0.95
    with h5py.File(packing) as file:
        grains = len(file["radius"])
    temperature = told["kinetic_energy"] / grains
    at_contact = (1 - 7 * fraction / 16) / (1 - fraction) ** 2
    collisions = 2 * math.sqrt(math.pi) * (4 * fraction / math.pi) * at_contact  # a grain's, at temperature 1
    rate = (temperature[-1] ** -0.5 - 1) / told["time"][-1]
    return rate / ((1 - restitution**2) / 4 * collisions), 0.9, 1.1, 1.0


def janssen(run, packing):
    told, wall, internal = series(run), 0.2, math.atan(0.25)
    bottom = told["wall_normal_force_bottom"][len(told["time"]) // 2 :].mean()
    with h5py.File(packing) as file:
        (width, height), weight = file["box"][()], math.pi * (file["radius"][()] ** 2).sum()

    def carried(ratio):
        length = width / (2 * wall * ratio)
        return length / height * (1 - math.exp(-height / length))

    active = (1 - math.sin(internal)) / (1 + math.sin(internal))
    return bottom / weight, 0.9 * carried(1), 1.1 * carried(active), (carried(1) + carried(active)) / 2


def triaxial(run, packing):
    told = series(run)
    last = slice(2 * len(told["time"]) // 3, None)
    axial, lateral = told["stress_contacts_zz"][last].mean(), 0.5 * (told["stress_contacts_xx"] + told["stress_contacts_yy"])[last].mean()
    angle = math.degrees(math.asin((axial - lateral) / (axial + lateral)))
    low, high = sorted((math.degrees(math.asin(0.357)), lade_duncan(0.357)))
    return angle, low - 1.5, high + 1.5, (low + high) / 2


def vibrated(run, packing):
    told, strength = series(run), 2.0  # acceleration of the floor over that of gravity
    off = math.asin(1 / strength)
    flight = brentq(lambda phase: math.sin(off) + math.cos(off) * phase - phase**2 / (2 * strength) - math.sin(off + phase), 0.5, 6)
    law = flight / (2 * math.pi)
    late = told["wall_normal_force_floor"][len(told["time"]) * 2 // 5 :]  # the last six periods
    return float(np.mean(late <= 0)), 0.95 * law, 1.05 * law, law


SCENES = {"collapse": (collapse, 20), "gas": (gas, 15), "janssen": (janssen, 20), "triaxial": (triaxial, 30), "vibrated": (vibrated, 10)}  # measure, seconds


def published():
    return tomllib.loads(Path(ROOT, "cases/gallery/published.toml").read_text())


class Gallery(Study):
    name, title, about = "gallery", "Gallery", "small scenes that people ask for, each with a picture and a published number"
    kinds = ("counted",)

    def jobs(self, plan):
        for scene, (_, cost) in SCENES.items():
            packing = self.packing(plan, scene)
            source = Path(f"{packing.with_suffix('')}-cold.h5") if scene == "gas" else packing
            plan.add(f"packing {scene}", [source], [[NSCDD, "pack", f"cases/gallery/packings/{scene}.toml", "-o", source, "--quiet"]], cost=10)
            if source != packing:
                plan.add(f"velocities {scene}", [packing], work=lambda source=source, packing=packing: warm(source, packing), needs=[source])
            run = plan.folder / scene
            text = tomllib.loads(Path(ROOT, f"cases/gallery/{scene}.toml").read_text())
            steps = QUICK_STEPS if plan.quick else text["step"]["count"]
            outputs = [f"{run}.csv", f"{run}.h5", f"{run}.json", f"{run}.frames.h5"]
            command = [NSCDD, "run", f"cases/gallery/{scene}.toml", "--packing", packing, "--steps", steps, "--quiet", "--series", outputs[0]]
            command += ["--state", outputs[1], "--json", outputs[2], "--frames", outputs[3], "--frame-every", steps // FRAMES]
            plan.add(scene, outputs, [command], needs=[packing], cost=cost)
            plan.add(f"picture {scene}", [f"{run}.png"], [["scripts/suite", "picture", outputs[3], f"{run}.png"]], needs=[outputs[3]], cost=3)

    def packing(self, plan, scene):
        return plan.folder / "packings" / f"{scene}.h5"

    def rows(self, plan):
        rows = [self.row(plan, scene) for scene in SCENES if Path(f"{plan.folder / scene}.json").exists()]
        return {"rows": rows} if rows else {}

    def row(self, plan, scene):
        measure, _ = SCENES[scene]
        run, told = record.load(f"{plan.folder / scene}.json"), published()[scene]
        ours, low, high, law = measure(plan.folder / scene, self.packing(plan, scene))
        return {
            **{"scene": scene, "grains": run["grains"], "steps": run["steps"], "quantity": told["quantity"], "ours": float(ours), "published": float(law)},
            **{"allowed": [float(low), float(high)], "within": bool(low <= ours <= high), "unconverged_steps": run["unconverged_steps"]},
            **{"command": run["command"]},
        }

    def passes(self, data):
        return data["quick"] or all(row["within"] for row in data["rows"])
