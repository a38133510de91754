"""The gallery: small scenes that people ask for, each with a picture and with one quantity beside a published number.

A scene is a TOML of at most 60 lines in cases/gallery, with a packing beside it. Where the quantity is of several runs, the others differ from
the scene by a line or two, which `more` says. Nothing is timed."""
import dataclasses
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

from ... import record
from ...page.tables import number
from ...program import NSCDD, ROOT
from ...study import Study
from . import measures

QUICK_GRAINS, QUICK_STEPS = 150, 60  # of a quick job


@dataclasses.dataclass(frozen=True)
class Scene:
    measure: Callable  # see measures.py
    cost: float  # seconds of one core, about, of its runs
    frames: int = 8
    drawn: int = -1  # number of the frame of the picture
    size: int = 480  # pixels of its longer side
    more: dict = dataclasses.field(default_factory=dict)  # {name of a further run: ((what the scene says, what stands in its place), ...)}


def orifice(width, steps):
    return (("[12, 0]", f"[{17 - width / 2:g}, 0]"), ("[22, 0]", f"[{17 + width / 2:g}, 0]"), ("count = 700", f"count = {steps}"))


def turning(rate, h, steps):
    return (("rate = 0.0131", f"rate = {rate}"), ("h = 0.08", f"h = {h}"), ("count = 4000", f"count = {steps}"))


SCENES = {
    "collapse": Scene(measures.collapse, 20, drawn=0),
    "drum": Scene(measures.drum, 30, frames=100, more={"0.03": turning(0.0414, 0.05, 1500), "0.3": turning(0.1309, 0.03, 1000)}),
    "gas": Scene(measures.gas, 3, drawn=3),
    "janssen": Scene(measures.janssen, 45, size=640),
    "shearbox": Scene(measures.shearbox, 20, size=640),
    "silo": Scene(measures.silo, 30, drawn=3, more={"8": orifice(8, 1000), "12": orifice(12, 500), "16": orifice(16, 330)}),
    "triaxial": Scene(measures.triaxial, 25, size=800),
    "vibrated": Scene(measures.vibrated, 2, drawn=2),
}


def warm(source, out):
    """Gives the grains of a packing random velocities: mean 0, mean square 1 along each axis."""
    with h5py.File(source) as packing, h5py.File(out, "w") as file:
        for name in packing:
            packing.copy(name, file)
        velocity = np.random.default_rng(1).normal(size=packing["x"].shape)
        velocity -= velocity.mean(0)
        file["velocity"] = velocity / np.sqrt((velocity**2).mean())


def published():
    return record.toml(Path(ROOT, "cases/gallery/published.toml"))


def case(name):
    return Path(ROOT, f"cases/gallery/{name}.toml").read_text()


def changed(name, changes):
    """The scene with other words in some places."""
    text = case(name)
    for old, new in changes:
        if text.count(old) != 1:
            raise record.InputError(f"cases/gallery/{name}.toml: '{old}' is there {text.count(old)} times, not once")
        text = text.replace(old, new)
    return text


class Gallery(Study):
    name, title, about = "gallery", "Gallery", "small scenes that people ask for, each with a picture and a published number"
    kinds = ("counted",)

    def jobs(self, plan):
        for name, scene in SCENES.items():
            packing = self.packing(plan, name)
            source = Path(f"{packing.with_suffix('')}-cold.h5") if name == "gas" else packing
            plan.pack(f"cases/gallery/packings/{name}.toml", source, QUICK_GRAINS if plan.quick else 0, cost=8)
            if source != packing:
                plan.add(f"velocities {name}", [packing], work=lambda source=source, packing=packing: warm(source, packing), needs=[source])
            runs = {name: Path(f"cases/gallery/{name}.toml")}
            for more, changes in scene.more.items():
                runs[f"{name}-{more}"] = file = plan.folder / f"{name}-{more}.toml"
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(changed(name, changes))
            for stem, file in runs.items():
                self.run_of(plan, stem, file, packing, scene)
            run = plan.folder / name
            draw = ["scripts/suite", "picture", f"{run}.frames.h5", f"{run}.png", "--frame", scene.drawn, "--size", scene.size]
            plan.add(f"picture {name}", [f"{run}.png"], [draw], needs=[f"{run}.frames.h5"], cost=3)

    def run_of(self, plan, stem, file, packing, scene):
        run = plan.folder / stem
        steps = QUICK_STEPS if plan.quick else record.toml(Path(ROOT, file))["step"]["count"]
        outputs = [f"{run}.csv", f"{run}.h5", f"{run}.json", f"{run}.frames.h5"]
        command = [NSCDD, "run", file, "--packing", packing, "--steps", steps, "--quiet", "--series", outputs[0]]
        command += ["--state", outputs[1], "--json", outputs[2], "--frames", outputs[3], "--frame-every", max(1, steps // scene.frames)]
        plan.add(stem, outputs, [command], needs=[packing], cost=scene.cost / (1 + len(scene.more)))

    def packing(self, plan, name):
        return plan.folder / "packings" / f"{name}.h5"

    def rows(self, plan):
        made = [name for name, scene in SCENES.items() if all(Path(f"{run}.json").exists() for run in self.runs(plan, name, scene))]
        return {"rows": [self.row(plan, name) for name in made]} if made else {}

    def runs(self, plan, name, scene):
        return [plan.folder / name, *(plan.folder / f"{name}-{more}" for more in scene.more)]

    def row(self, plan, name):
        scene, told = SCENES[name], published()[name]
        runs = [record.load(f"{run}.json") for run in self.runs(plan, name, scene)]
        ours, low, high, law, *note = scene.measure(plan.folder / name, self.packing(plan, name))
        return {
            **{"scene": name, "grains": runs[0]["grains"], "steps": sum(run["steps"] for run in runs), "quantity": told["quantity"]},
            **{"ours": float(f"{ours:.9g}") if np.isfinite(ours) else None, "published": float(law), "allowed": {"from": float(low), "to": float(high)}},
            **{"within": bool(low <= ours <= high)},
            **({"note": note[0]} if note else {}),
            **{"unconverged_steps": sum(run["unconverged_steps"] for run in runs), "command": runs[0]["command"]},
        }

    def told(self, data):
        for row in data["rows"] if not data["quick"] else ():
            verdict = "within" if row["within"] else "NOT WITHIN"
            allowed = " to ".join(map(number, row["allowed"].values()))
            yield f"{row['scene']}: {row['quantity']}: {number(row['ours'])}, published {number(row['published'])}, {verdict} {allowed}"

    def passes(self, data):
        return data["quick"] or all(row["within"] for row in data["rows"])
