"""What a step costs beside its sweeps, on five scenes by NLGS with accelerated iterations, run as a user would.

ns are of a contact: of an iteration for the sweep, of a solve for detection, loading, tests and advancing. The fixed cost is all but the sweeps.
"""
from ..program import NSCDD, python
from ..record import load
from ..study import Study
from ..times import cores_of
from .million import QUICK_TILES, TILES
from .peers.settle import write_start

PHASES = ("detect", "load", "test", "advance")
# scene, its packing (None: the settling bed writes its own), steps, seconds about
SCENES = {
    "settling bed": ("cases/peers/settle.toml", None, 400, 40),
    "collapse": ("cases/partitions/collapse.toml", "cases/packings/triaxial.toml", 100, 60),
    "shear": ("cases/rheology/spheres.toml", "cases/packings/rheology-spheres.toml", 400, 60),
    "triaxial": ("cases/reduced/triaxial.toml", "cases/packings/triaxial.toml", 20, 20),
    "million": ("cases/reduced/triaxial.toml", "cases/packings/triaxial.toml", 2, 300),
}


class StepCost(Study):
    name, title, about = "step_cost", "What a step costs beside its sweeps", "ns a contact of the phases of a step, on five scenes"
    in_all = False
    kinds = ("measured", "counted")

    def jobs(self, plan):
        for scene, (case, packing, steps, cost) in SCENES.items():
            start, out = self.start(plan, scene, packing), self.file(plan, scene)
            command = [NSCDD, "run", case, "--scheme", "nlgs", "--packing", start, "--quiet", "--steps", min(steps, 20) if plan.quick else steps, "--json", out]
            plan.add(scene, [out], [command], needs=[start], cost=1 if plan.quick else cost, alone=True)

    def file(self, plan, scene):
        return plan.folder / f"{scene.replace(' ', '-')}.json"

    def start(self, plan, scene, packing):
        small = {"grains": 300, "generator": "own"} if plan.quick else {}
        if not packing:
            out = plan.folder / "start.h5"
            return plan.add("settling bed begins", [out], work=lambda: write_start(plan.folder, 7 if plan.quick else 20) and None)
        one = plan.pack(packing, **small)
        if scene != "million":
            return one
        out = plan.folder / "million.h5"
        return plan.add("a million side by side", [out], [python("tiling", one, out, *(QUICK_TILES if plan.quick else TILES))], needs=[one])

    def rows(self, plan):
        rows = [row(scene, load(self.file(plan, scene))) for scene in SCENES if self.file(plan, scene).exists()]
        return {"rows": rows} if rows else {}


def row(scene, run):
    solved, swept = (sum(c * n for c, n in zip(run["contacts"], run[key])) for key in ("solves", "iterations"))
    contacts, steps, seconds = sum(run["contacts"]), run["steps"], run["seconds"]
    sweep = seconds["sweep"] / swept
    return {
        **{"scene": scene, "grains": run["grains"], "steps": steps, "contacts": contacts / steps},
        **{"solves_a_step": sum(run["solves"]) / steps, "iterations_a_solve": sum(run["iterations"]) / sum(run["solves"])},
        **{"seconds_a_step": seconds["total"] / steps, "sweep_ns": 1e9 * sweep, **{f"{phase}_ns": 1e9 * seconds[phase] / solved for phase in PHASES}},
        **{"fixed_cost_in_sweeps": (seconds["total"] - seconds["sweep"]) / (sweep * contacts), "cores": cores_of(run)},
        "command": run["command"],
    }
