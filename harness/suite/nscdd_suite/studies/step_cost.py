"""What a step costs beside its sweeps, on five scenes by NLGS with accelerated iterations.

A scene is run as a user would. From its end three steps go on with FEW and with MANY iterations a solve and no test of convergence but the last: what
they differ by is the time of a sweep. All else of the run is its fixed cost: detection, advancing, and in the solver loading, tests and estimates.
ns are of a contact and a solve, of a contact and an iteration for the sweep.
"""
from ..program import NSCDD, python
from ..record import load
from ..study import Study
from ..times import cores_of, least
from .million import QUICK_TILES, TILES
from .peers.settle import write_start

FEW, MANY, STEPS = 20, 120, 3
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
    kinds = ("measured", "counted")

    def jobs(self, plan):
        for scene, (case, packing, steps, cost) in SCENES.items():
            whole, start = self.file(plan, scene, "whole"), self.start(plan, scene, packing)
            how = [NSCDD, "run", case, "--scheme", "nlgs", "--packing", start, "--quiet"]
            command = [*how, "--steps", min(steps, 20) if plan.quick else steps, "--json", whole, "--state", whole.with_suffix(".h5")]
            plan.add(scene, [whole, whole.with_suffix(".h5")], [command], needs=[start], cost=1 if plan.quick else cost, alone=True)
            for count in (FEW, MANY):
                out = self.file(plan, scene, count)
                fixed = ["--tolerance", 1e-30, "--check-every", count, "--max-iterations", count, "--steps", STEPS, "--from", whole.with_suffix(".h5")]
                plan.add(f"{scene} {count}", [out], [[*how, *fixed, "--json", out]], needs=[start, whole.with_suffix(".h5")], cost=cost / 10, alone=True)

    def file(self, plan, scene, what):
        return plan.folder / f"{scene.replace(' ', '-')}-{what}.json"

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
        files = {scene: [self.file(plan, scene, what) for what in ("whole", FEW, MANY)] for scene in SCENES}
        rows = [row(scene, *map(load, three)) for scene, three in files.items() if all(path.exists() for path in three)]
        return {"rows": rows} if rows else {}


def row(scene, whole, few, many):
    solved, swept = (sum(c * n for c, n in zip(whole["contacts"], whole[key])) for key in ("solves", "iterations"))
    contacts, steps, seconds = sum(whole["contacts"]), whole["steps"], whole["seconds"]
    counted = [sum(c * n for c, n in zip(run["contacts"], run["iterations"])) for run in (few, many)]
    sweep = (many["seconds"]["sweep"] - few["seconds"]["sweep"]) / (counted[1] - counted[0])
    ns = {"detect": seconds["detect"], "advance": seconds["advance"], "solver_beside_sweeps": seconds["sweep"] - sweep * swept}
    return {
        **{"scene": scene, "grains": whole["grains"], "steps": steps, "contacts": contacts / steps},
        **{"solves_a_step": sum(whole["solves"]) / steps, "iterations_a_solve": sum(whole["iterations"]) / sum(whole["solves"])},
        **{"seconds_a_step": seconds["total"] / steps, "sweep_ns": 1e9 * sweep, **{f"{key}_ns": 1e9 * value / solved for key, value in ns.items()}},
        **{"fixed_cost_in_sweeps": (seconds["total"] - sweep * swept) / (sweep * contacts), "cores": least(map(cores_of, (whole, few, many)))},
        "command": whole["command"],
    }
