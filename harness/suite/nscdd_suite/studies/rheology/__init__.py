"""How grains flow: stress ratio and solid fraction against the inertial number, in a cell that is sheared under a stress.

Disks and spheres start from packings that repeat (cases/packings/rheology-*.toml), and are sheared at rates that span three decades, each to a
strain of SHEARED, or of SLOWLY below an inertial number of SLOW. The slowest goes on from the end of the next, by a strain of SLOWEST.
Means and their errors are over the second half, by blocks. Beside them are published laws (cases/rheology/published.toml).
One rate is also run by NSCDD (DCS) on 8 subdomains. LAMMPS, where there is one, shears the grains on from the end of some runs. Nothing is timed.
"""
import csv
import itertools
import math
import shutil
import statistics
from pathlib import Path

import numpy as np

from ... import record
from ...program import NSCDD, ROOT
from ...study import Study
from ..physics.granular import lade_duncan
from . import lammps

INERTIAL = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.2)
SHEARED, SLOWLY, SLOWEST, SLOW, BLOCKS = 4.0, 2.0, 0.5, 1e-3, 8  # strains, least inertial number of the first, blocks of the second half
TOLERANCE, A_SHARE = 1e-4, 1 / 30  # in all, and at most this share of the inertial number: else slow grains sink into each other
A_STEP, LONGEST = 1e-3, 0.3  # largest strain of a step, and its longest time: longer ones need iterations by the square
SCENES = {"disks": (2, "yy", "xy", 10), "spheres": (3, "zz", "xz", 40)}  # dimension, normal and shear stress, seconds of the fastest run
DECOMPOSED, QUICK_GRAINS, QUICK_STEPS = 1e-2, 120, 60  # rate that DCS runs too; what a quick job has
BY_LAMMPS, SHEARED_ON = (3e-3, 1e-2, 3e-2, 0.1, 0.2), 2.0  # rates that LAMMPS runs too, and their strain


def rate(scene, inertial):
    """Shear rate at unit stress, density and mean diameter, by the inertial number of the source."""
    return inertial / (math.sqrt(math.pi / 4) if scene == "disks" else 1.0)


def law(scene, inertial):
    """(stress ratio, solid fraction) as published; None where the source has no number."""
    if scene == "disks":
        return 0.25 + 1.1 * inertial, 0.81 - 0.3 * inertial
    return 0.357 + 0.37 / ((0.32 / inertial) ** 1.5 + 1), 0.596 if inertial <= 1e-3 else None


def published():
    return record.toml(Path(ROOT, "cases/rheology/published.toml"))


class Rheology(Study):
    name, title, about = "rheology", "Homogeneous shear", "stress ratio and solid fraction of sheared grains beside published laws"
    kinds = ("counted",)

    def jobs(self, plan):
        for scene, inertial, solver in points():
            dimension, _, _, cost = SCENES[scene]
            packing = plan.pack(f"cases/packings/rheology-{scene}.toml", **({"grains": QUICK_GRAINS} if plan.quick else {}))
            stem = self.stem(plan, scene, inertial, solver)
            text = Path(ROOT, f"cases/rheology/{scene}.toml").read_text()
            strain = rate(scene, inertial)
            text = text.replace("0.01]" if dimension == 2 else "0.01],", f"{strain!r}]" if dimension == 2 else f"{strain!r}],", 1)
            h = min(A_STEP / strain, LONGEST)
            text = text.replace("h = 0.1", f"h = {h!r}")
            file = Path(f"{stem}.toml")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
            how = ["--scheme", "dcs", "-n", 8] if solver == "dcs" else ["--scheme", "nlgs"]
            sheared = SLOWEST if inertial == INERTIAL[0] else SLOWLY if inertial < SLOW else SHEARED
            steps = QUICK_STEPS if plan.quick else round(sheared / (strain * h))
            made = {"--json": f"{stem}.json", "--series": f"{stem}.csv", "--state": f"{stem}.h5"}
            how += ["--steps", steps, "--tolerance", min(TOLERANCE, A_SHARE * inertial), "--quiet"]
            start = ["--from", f"{self.stem(plan, scene, INERTIAL[1], solver)}.h5"] if inertial == INERTIAL[0] else ["--packing", packing]
            command = [NSCDD, "run", file, *start, *how, *itertools.chain(*made.items())]
            plan.add(
                stem.name, [*made.values()], [command], needs=[start[1]], cost=cost * steps * A_STEP / SHEARED * (INERTIAL[-1] / inertial) ** 0.6
            )  # slow flow needs more iterations
        if not shutil.which("lmp"):
            plan.leave_out("LAMMPS: lmp is not installed")
            return
        for scene, inertial in also_by_lammps():
            stem = self.stem(plan, scene, inertial, "nlgs")
            work = (lammps.by_lammps, scene, rate(scene, inertial), stem, A_STEP * QUICK_STEPS if plan.quick else SHEARED_ON, mean, law)
            plan.rows(f"lammps {stem.name}", *work, needs=[f"{stem}.h5", f"cases/rheology/{scene}.toml", "cases/rheology/shear.lmp"], cost=0.4 / inertial)

    def stem(self, plan, scene, inertial, solver):
        return plan.folder / f"{scene}-{inertial:g}{'-dcs' if solver == 'dcs' else ''}"

    def rows(self, plan):
        made = [(point, self.stem(plan, *point)) for point in points()]
        rows = [row(*point, stem) for point, stem in made if Path(f"{stem}.json").exists()]
        rows += filter(None, (plan.made(f"lammps {self.stem(plan, *point, 'nlgs').name}") for point in also_by_lammps()))
        return {"rows": rows, "sources": {scene: told["source"] for scene, told in published().items()}} if rows else {}


def points():
    for scene in SCENES:
        yield from ((scene, inertial, "nlgs") for inertial in INERTIAL)
        yield scene, DECOMPOSED, "dcs"


def also_by_lammps():
    return itertools.product(SCENES, BY_LAMMPS)


def mean(values):
    """Mean, and twice the standard error by blocks."""
    size = max(1, len(values) // BLOCKS)
    blocks = [statistics.fmean(values[k : k + size]) for k in range(0, size * BLOCKS, size) if values[k : k + size]]
    return statistics.fmean(values), 2 * statistics.stdev(blocks) / math.sqrt(len(blocks)) if len(blocks) > 1 else math.nan


def angles(stress):
    """Friction angles [degrees] of spheres: of shear, by the largest and least stress, and of triaxial compression by Lade's and Duncan's criterion."""
    least, middle, most = np.linalg.eigvalsh((stress + stress.T) / 2)
    invariant = (least + middle + most) ** 3 / (least * middle * most)
    return {"angle": math.degrees(math.asin((most - least) / (most + least))), "angle_triaxial": lade_duncan(math.sqrt(1 - 27 / invariant))}


def row(scene, inertial, solver, stem):
    run = record.load(f"{stem}.json")
    _, normal, shear, _ = SCENES[scene]
    with open(f"{stem}.csv") as file:
        series = [{key: float(value) for key, value in line.items()} for line in csv.DictReader(file)]
    half = series[len(series) // 2 :]
    stress = statistics.fmean(line[f"stress_contacts_{normal}"] for line in half)
    mu, mu_error = mean([-line[f"stress_contacts_{shear}"] / stress for line in half])
    fraction, fraction_error = mean([line["solid_fraction"] for line in half])
    by_law, fraction_by_law = law(scene, inertial)
    tensor = np.array([[statistics.fmean(line[f"stress_contacts_{a}{b}"] for line in half) for b in "xyz"] for a in "xyz"]) if scene == "spheres" else None
    return {
        **{"scene": scene, "solver": solver, "grains": run["grains"], "steps": run["steps"], "inertial_number": inertial / math.sqrt(stress)},
        **{"normal_stress": stress, "mu": mu, "mu_error": mu_error, "mu_published": by_law},
        **{"solid_fraction": fraction, "fraction_error": fraction_error, "fraction_published": fraction_by_law},
        **{
            "iterations_a_step": sum(run["iterations"]) / run["steps"],
            "unconverged_steps": run["unconverged_steps"],
            "max_overlap": run["final"]["max_overlap"],
            "command": run["command"],
        },
        **(angles(tensor) if scene == "spheres" else {}),
    }
