"""A million spheres on two ranks, from file to file: how much memory and how many seconds a step.

A packing of 4,000 spheres (cases/packings/triaxial.toml) is repeated 6 x 6 x 7 times and compressed as in cases/reduced/triaxial.toml, by DCS,
accelerated, to eta = 1e-4; then the run goes on from its state for one more step. Of both runs: the most memory that the ranks have had together, seconds
a step, and iterations. Files take 1.5 GB.
"""
from pathlib import Path

from ... import record
from ...program import NSCDD, python
from ...study import Study
from ...times import cores_of

TILES, QUICK_TILES, RANKS = (6, 6, 7), (2, 1, 1), 2
RUNS = {"first": 2, "rest": 1}  # steps


class Million(Study):
    name, title, about = "million", "A million spheres on two ranks", "memory and seconds of a million spheres on two ranks"
    in_all = False
    kinds, tools = ("counted", "measured"), ("mpirun",)

    def jobs(self, plan):
        one = plan.pack("cases/packings/triaxial.toml", **({"grains": 300, "generator": "own"} if plan.quick else {}))
        packing, start = plan.folder / "packing.h5", []
        plan.add("packing side by side with itself", [packing], [python("tiling", one, packing, *(QUICK_TILES if plan.quick else TILES))], needs=[one])
        for name, steps in RUNS.items():
            out, state = plan.folder / f"{name}.json", plan.folder / f"{name}.h5"
            command = ["mpirun", "-np", RANKS, NSCDD, "run", "cases/reduced/triaxial.toml", "--scheme", "dcs", "--method", "auto", "--quiet"]
            command += ["--packing", packing, *(word for file in start for word in ("--from", file)), "--steps", steps, "--json", out, "--state", state]
            plan.add(name, [out, state], [command], needs=[packing, *start], cost=300, alone=True)
            start = [state]

    def rows(self, plan):
        rows = [row(name, path) for name in RUNS if (path := plan.folder / f"{name}.json").exists()]
        return {"rows": rows} if rows else {}


def row(name, path):
    run = record.load(path)
    steps = run["steps"]
    return {
        **{"run": name, "grains": run["grains"], "contacts": run["contacts"][-1], "ranks": run["subdomains"], "steps": steps, "memory": run["peak_memory"]},
        **{"seconds_a_step": run["seconds"]["total"] / steps, "iterations_a_step": sum(run["iterations"]) / steps, "cores": cores_of(run)},
        **{"state_bytes": Path(path).with_suffix(".h5").stat().st_size, "converged": run["converged"], "command": f"mpirun -np {RANKS} {run['command']}"},
    }
