"""What eta and the velocity error say of the distance to the answer, and what asking for a velocity error costs.

Distances: one step of the scenes of cases/accuracy and cases/reduced, from a loaded state with its impulses (warm) and without (cold), and of hard
cases with one answer (cases/hard), cold; by plain and by accelerated NLGS and by accelerated NSCDD, stopped by eta alone at 1e-1 to 1e-8. With
friction there may be several answers, so the distance is taken from the end of the very same iteration, eta <= 1e-12, and rows are kept down to a
hundred times the eta that it got to. Cost: iterations of the reduced scenes, 50 warm steps, and of one cold step of all scenes, to eta = 1e-4 and
to several velocity errors. Nothing is timed. Quick: few small cases and tolerances.
"""
import re
from pathlib import Path

from ...measure import ANY, LONG, Scene, asked, distance
from ...program import NSCDD, made
from ...record import toml
from ...study import Study
from ..hard.case import strips

REDUCED = ("biaxial", "isotropic", "triaxial")
LOADING = 20  # steps of a reduced scene before the one that is solved
HARD = r"(column-10|column-100|lid-10|lid-100|(mass|radius)-.*-above)-[23]d"
TOLERANCES = [10.0**-k for k in range(1, 9)]
REFERENCE, MOST = 1e-12, 20_000  # eta asked of the last iterate, and the most iterations of a packing towards it
BETTER = 100  # times smaller must the reference's eta be
LARGE = "large-3d"  # by one method alone
METHODS = {"NLGS": "--scheme nlgs --method paper", "NLGS, auto": "--scheme nlgs --method auto", "NSCDD 8, auto": "--scheme dcs --method auto --subdomains 8"}
COSTS = METHODS | {"NSCDD 8": "--scheme dcs --method paper --subdomains 8"}
ALLOWED = (ANY, 0.1, 0.03)  # velocity errors; the first: eta alone
QUICK_TOLERANCES, QUICK_GRAINS, QUICK_STEPS = (1e-2, 1e-4), 120, 3
QUICK = r"loose-2d|biaxial|column-10-2d|mass-1e2-above-3d"


class Packing(Scene):
    """A scene of cases/accuracy or cases/reduced."""

    starts, cap = ("warm", "cold"), MOST

    def __init__(self, path, plan):
        self.reduced = path.parent.name == "reduced"
        self.family, specifications = ("reduced", "cases/packings") if self.reduced else ("packing", "cases/accuracy/packings")
        super().__init__(path, plan, QUICK_GRAINS if plan.quick else 0, specifications)
        self.needs, self.seconds = [self.packing], 60

    def prepare(self):
        self.load(*(["--steps", LOADING] if self.reduced else []), *asked(ANY))

    def by(self, method, start, tolerance, velocity_error, out):
        return [*self.command(COSTS[method], tolerance, out, getattr(self, start), velocity_error), "--check-every", 10]

    def warm_steps(self, method, velocity_error, out, steps):
        few = ["--steps", steps] if steps else []
        command = [NSCDD, "run", self.path, "--packing", self.packing, *COSTS[method].split(), *few, *asked(velocity_error)]
        return [*command, "--check-every", 10, "--quiet", "--json", out]


class Hard:
    """The first step of a hard case."""

    starts, cap, needs, seconds = ("cold",), 100_000_000, (), 2

    def __init__(self, path, plan):
        self.path, self.name, self.folder = path, path.stem, plan.folder
        self.family = {"lid": "column"}.get(key := path.stem.partition("-")[0], key)

    def prepare(self):
        self.data = toml(self.path)

    def by(self, method, start, tolerance, velocity_error, out):
        places = [grain["position"] for grain in self.data["grain"]]
        arguments = COSTS[method].split()
        if "--subdomains" in arguments:
            arguments = ["--scheme", "dcs", "--method", "auto", *strips(places, min(8, len(places)))]
        # what takes millions of sweeps is not tested after each
        every = self.data["solver"]["check_every"] if method == "NLGS" and self.data["solver"]["check_every"] >= 1000 else 1
        command = [NSCDD, "run", self.path, "--steps", 1, *arguments, "--tolerance", f"{tolerance:g}", *asked(velocity_error)]
        return [*command, "--check-every", every, "--quiet", "--json", out, "--state", out.with_suffix(".h5")]


class VelocityError(Study):
    name, title, about = "velocity_error", "What η and the velocity error say", "how far from the answer an iterate is, and what asking for it costs"

    def jobs(self, plan):
        cases = [(Hard if path.parent.name == "hard" else Packing)(path, plan) for path in paths(plan.quick)]
        for case in cases:
            plan.rows(case.name, measured, case, plan.quick, needs=case.needs, cost=case.seconds)

    def rows(self, plan):
        found = [made for path in paths(plan.quick) if (made := plan.made(path.stem))]
        return {key: [row for made in found for row in made[key]] for key in ("rows", "cost")} if found else {}


def paths(quick):
    found = [Path(f"cases/reduced/{name}.toml") for name in REDUCED] + sorted(Path("cases/accuracy").glob("*.toml"))
    found += [path for path in sorted(Path("cases/hard").glob("*.toml")) if re.fullmatch(HARD, path.stem)]
    return [path for path in found if not quick or re.fullmatch(QUICK, path.stem)]


def measured(case, quick):
    case.prepare()
    tolerances, steps = (QUICK_TOLERANCES, QUICK_STEPS) if quick else (TOLERANCES, 0)
    methods = [method for method in METHODS if case.name != LARGE or method == "NLGS, auto"]
    rows = [row for start in case.starts for method in methods for row in distances(case, method, start, tolerances)]
    starts = ("cold", *(["warm"] if case.reduced else [])) if isinstance(case, Packing) else ()
    return {"rows": rows, "cost": [row for method in COSTS for start in starts for row in cost(case, method, start, steps)]}


def distances(case, method, start, tolerances):
    """Rows of one iteration, at its tolerances."""
    reference, out = case.folder / f"{case.name}-reference.json", case.folder / f"{case.name}-run.json"
    cap = ["--max-iterations", case.cap]
    answer = made([*case.by(method, start, REFERENCE, 1e-9, reference), *cap], reference, seconds=LONG)
    best, reached, final = answer["residual"][0], 1e300, answer["final"]
    for tolerance in tolerances:
        if tolerance < BETTER * best:
            return
        if reached <= tolerance:  # was that one's run too
            continue
        run = made([*case.by(method, start, tolerance, ANY, out), *cap], out, seconds=LONG)
        reached = run["residual"][0]
        yield {
            **{"case": case.name, "family": case.family, "dimension": run["dimension"], "method": method, "start": start},
            **{"tolerance": tolerance, "iterations": run["iterations"][0], "eta": reached, "velocity_error": run["velocity_error"][0]},
            "distance": distance(reference, out) * final["free_velocity_norm"] / final["turned_velocity_norm"],
            "reference_eta": best,
        }


def cost(case, method, start, steps):
    """Rows of iterations to eta = 1e-4 and to each velocity error."""
    out = case.folder / f"{case.name}-cost.json"
    for allowed in ALLOWED:
        command = case.warm_steps(method, allowed, out, steps) if start == "warm" else case.by(method, start, 1e-4, allowed, out)
        run = made(command, out, seconds=LONG)
        yield {
            **{"case": case.name, "start": start, "method": method, "allowed": None if allowed == ANY else allowed, "steps": run["steps"]},
            **{"iterations": sum(run["iterations"]), "eta": max(run["residual"]), "converged": run["converged"]},
            "velocity_error": None if None in run["velocity_error"] else max(run["velocity_error"]),
        }
