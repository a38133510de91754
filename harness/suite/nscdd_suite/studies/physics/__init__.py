"""What a granular scientist asks of a code: shear to the critical state, jamming, forces, and whether NSCDD and NLGS give one curve.

Spheres and disks with friction 0.3 are compressed between walls to the critical state, spheres without friction at two rates (cases/physics). Disks
and spheres are jammed by both generators. One triaxial test is run four times by sequential NLGS and four times by NSCDD (DCS) on 8 subdomains, each
from positions that differ by 1e-9 of a radius. Each result is a row beside a published number, with its source, rule and verdict, which is computed.
Nothing is timed. Packings by LAMMPS need lmp; without it their rows say so. Numbers of a quick job say nothing.
"""
import shutil

from ... import record
from ...program import NSCDD, python
from ...study import Study
from . import comparisons

PACKINGS, RUNS = record.beside(__file__, "runs.toml").values()
NLGS = ("--scheme", "nlgs")
SPREAD, COPIES = "spheres-2k", 4  # packing of the perturbed runs, and how many each solver makes
SOLVERS = {"nlgs": (NLGS, 18), "dcs": (("--scheme", "dcs", "--subdomains", "8"), 32)}  # options, about how many seconds
SPREADS = {f"spread-{solver}-{seed}": (seed, *SOLVERS[solver]) for seed, solver in enumerate((solver for solver in SOLVERS for _ in range(COPIES)), 1)}
QUICK_GRAINS, QUICK_STEPS = {2: 100, 3: 150}, 40
FIGURES = {"physics-agreement": "spread", "physics-shear": "shear", "physics-fabric": "shear", "physics-forces": "forces"}  # figure: its curves


class Physics(Study):
    name, title, about = "physics", "Granular physics", "shear, jamming and forces beside published numbers, and one curve of both solvers"

    def jobs(self, plan):
        packings = {}
        for name, told in PACKINGS.items():
            if name not in left_out():
                grains = QUICK_GRAINS[told["dimension"]] if plan.quick else 0
                packings[name] = plan.pack(told["source"], plan.folder / "packings" / f"{name}.h5", grains, cost=told["seconds"], generator=told["generator"])
        for name, told in RUNS.items():
            packing = packings[told["packing"]]
            frames = ["--frames", plan.folder / f"{name}.frames.h5", "--frame-every", 10 if plan.quick else told["every"]]
            self.compress(plan, name, name, packing, packing, NLGS, told["seconds"], frames=frames)
        source = packings[SPREAD]
        for name, (seed, solver, cost) in SPREADS.items():
            copy = plan.folder / f"{SPREAD}-perturbed-{seed}.h5"
            self.compress(plan, name, "spread", source, copy, solver, cost, before=[python("perturbed", source, seed, copy)])

    def compress(self, plan, name, scene, source, packing, solver, cost, frames=(), before=()):
        table, series = (plan.folder / f"{name}.{kind}" for kind in ("json", "csv"))
        command = [NSCDD, "run", f"cases/physics/{scene}.toml", "--packing", packing, "--method", "auto", *solver]
        command += [*(["--steps", QUICK_STEPS] if plan.quick else []), "--series", series, *frames, "--json", table, "--quiet"]
        plan.add(name, [table, series, *frames[1:2]], [*before, command], needs=[source], cost=cost)

    def runs(self, plan):
        return {name: told for name in (*RUNS, *sorted(SPREADS)) if (told := comparisons.load(plan.folder, name))}

    def rows(self, plan):
        files, untold = plan.folder / "packings", left_out()
        packings = {name: (files / f"{name}.h5", told["dimension"], told["generator"], untold.get(name)) for name, told in PACKINGS.items()}
        rows, curves = comparisons.all_rows(self.runs(plan), packings)
        if plan.quick:
            rows = [told | {"verdict": "cannot be told", "why": "a quick job has few grains and steps"} for told in rows]
        if all(told["ours"] is None for told in rows):
            return {}
        return {"rows": rows, "curves": curves, "figures": [f"{name}.svg" for name, needed in FIGURES.items() if curves.get(needed)]}


def left_out():
    """Packings that cannot be made, with the reason."""
    return {} if shutil.which("lmp") else {name: "lmp is not installed" for name, told in PACKINGS.items() if told["generator"] == "lammps"}
