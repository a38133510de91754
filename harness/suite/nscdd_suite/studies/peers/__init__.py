"""Against what a user would pick instead: CPU time of LAMMPS granular and of Siconos NSGS beside ours, each at equal error.

settle: 8,000 spheres of 1 cm fall in a box for 0.4 s (cases/peers/settle.toml, settle.lmp). LAMMPS: Hertz contacts with history, on one rank. Its
damping and its neighbour list are the cheapest of some. For each stiffness the time step is the largest of a ladder at which energy does not grow and
no grain is lost. A tenth of a contact's time, as users take it, is measured beside it. Ours: some step sizes and tolerances. Error is the mean overlap
of what overlaps at the end, over the mean diameter, by one judge for both. Our runs that none of ours beats in both and the cheapest of LAMMPS for
each stiffness are made again, ours and theirs in turn; the median user CPU time is taken. The ratio is between a run of LAMMPS and our cheapest run
whose mean overlap is at most as large. A job that was stopped goes on after its last run.

siconos: one step of reduced scenes of the paper from impulses zero, by NLGS and by Siconos NSGS on the exported problem; eta by our measure
for both.

Cited figures (cases/peers/cited.json) are put in the record as such. Parts whose code is not installed are left out by name.
"""
import functools
import itertools
import shutil
import time

from ... import measure, record
from ...jobs import clock, left
from ...measure import ANY, SICONOS, Budget, Scene, asked, ladder
from ...program import ROOT, Failed, read, shown
from ...study import Study, installed
from ...times import LEAST_PAIRS, least
from . import choice, settle
from .choice import median, named, settled

SIDE, QUICK_SIDE = 20, 7  # grains along an edge of the box
REPEATS, QUICK_REPEATS = LEAST_PAIRS, 2  # runs of which the median counts, of those that are compared
STIFFNESSES = [4.3e7 * 4**n for n in range(5)]  # [Pa]; the softest: mean overlap about 1e-3 d
DAMPINGS = (1.0, 0.5, 0.25)  # an impact of 1 m/s rebounds with 0.33, 0.57, 0.76 of its speed
STEPS = (1.5, 1.25, 1.1, 1.0, 0.9, 0.8, 0.65, 0.5, 0.35, 0.25)  # of LAMMPS, over the time of an impact, of which a contact lasts 3.2
CUSTOMARY = 0.32  # a tenth of the contact
NEIGHBOURS = ((0.1, 1), (0.2, 1), (0.3, 1), (0.4, 1), (0.3, 5))  # skin [d], steps between two looks whether the list is due
OURS = [(h, one["arguments"]) for one in record.beside(__file__, "runs.toml")["ours"] for h in one["h"]]
QUICK_OURS = [(2e-3, "--tolerance 1e-3"), (1e-3, "--tolerance 1e-3")]
SO_FAR = "settle-so-far.json"  # the runs of the settling bed, while not all are made
SICONOS_SCENES, LOADING = ("biaxial", "triaxial"), 20  # steps before the one that is solved
SICONOS_TOLERANCES = [10.0**-k for k in range(1, 7)]
SOLVERS = {"NLGS": "--scheme nlgs --method paper", "NLGS, auto": "--scheme nlgs --method auto", SICONOS: "python3 -m nscdd_suite.siconos_solve"}


class Peers(Study):
    name, title, about = "peers", "Other codes", "CPU time beside LAMMPS granular and Siconos at equal error"

    def jobs(self, plan):
        if not shutil.which("lmp"):
            plan.leave_out("LAMMPS: lmp is not installed")
        inputs = ("cases/peers/settle.toml", "cases/peers/settle.lmp")
        plan.rows("settle", lambda plan: Settle(plan).all(), plan, needs=inputs, alone=True, cost=1 if plan.quick else 1000)
        if not installed("siconos", "scipy"):
            plan.leave_out("Siconos NSGS: Siconos or SciPy is not installed (scripts/setup --siconos)")
            return
        for name in SICONOS_SCENES[:1] if plan.quick else SICONOS_SCENES:
            scene = Scene(f"cases/reduced/{name}.toml", plan, 160 if plan.quick else 0, "cases/packings")
            plan.rows(f"siconos {name}", siconos, scene, plan.quick, needs=[scene.packing], alone=True, cost=1 if plan.quick else 200)

    def rows(self, plan):
        bed = plan.made("settle") or {"ours": [], "lammps": []}
        steps = [row for name in SICONOS_SCENES for row in plan.made(f"siconos {name}")]
        if not (bed["ours"] or steps):
            return {}
        scene = {"grains": (QUICK_SIDE if plan.quick else SIDE) ** 3, "seconds": settle.SECONDS, "friction": 0.3, "diameter": settle.DIAMETER}
        scene |= {"spread": settle.SPREAD, "density": settle.DENSITY, "how": record.beside(__file__, "captions.toml")["how"]}
        return {
            "repeats": QUICK_REPEATS if plan.quick else REPEATS,
            "settle": {**scene, **bed, "ratios": choice.ratios(bed)},
            "siconos": steps,
            "cited": [{"kind": "cited", **row} for row in read(ROOT / "cases/peers/cited.json")],
            "left_out": plan.left_out,
        }

    def run(self, plan, anew=False):
        if anew:
            (plan.folder / SO_FAR).unlink(missing_ok=True)
        return super().run(plan, anew)


class Settle:
    """The runs of the settling scene."""

    def __init__(self, plan):
        self.folder, self.quick, self.path, self.began = plan.folder, plan.quick, plan.folder / SO_FAR, time.monotonic()
        self.edge = settle.write_start(plan.folder, QUICK_SIDE if plan.quick else SIDE)
        self.bed = record.load(self.path) if self.path.exists() else {"ours": [], "lammps": []}

    def told(self, text):
        """Of a run that is in the bed now."""
        record.write(self.path, self.bed)
        print(f"  [{clock(time.monotonic() - self.began)}] {text}", flush=True)

    def run(self, code, what):
        return {"ours": settle.by_nscdd, "lammps": settle.by_lammps}[code](self.folder, self.edge, **what)

    def measure(self, code, role, **what):
        """The row of a run, which is made if there is none."""
        rows = self.bed[code]
        row = next((row for row in rows if row["asked"].items() >= what.items()), None)
        if row is None:
            made = self.run(code, what)
            row = {"role": role, "asked": what, "cpus": [made.pop("cpu")], **made}
            rows.append(row)
            overlaps = f"mean overlap {row['mean_overlap']:.2e} d, largest {row['largest_overlap']:.1e} d" if "mean_overlap" in row else ""
            self.told(f"{code} {role} {named(row)}: {row['cpus'][0]:.2f} s, {overlaps or row.get('refused') or row['why']}")
        return row

    def largest_step(self, role, steps=STEPS, **what):
        """The row of the largest step of the ladder at which the bed comes to rest."""
        row = next((row for step in steps if settled(row := self.measure("lammps", role, step=step, **what))), None)
        if row is None:
            raise Failed(f"LAMMPS: no step of {steps} is stable for {what}")
        return row

    def theirs(self):
        dampings, neighbours, stiffnesses = (DAMPINGS[-1:], NEIGHBOURS[1:2], STIFFNESSES[:1]) if self.quick else (DAMPINGS, NEIGHBOURS, STIFFNESSES)
        best = min((self.largest_step("damping", k=STIFFNESSES[0], damping=damping, skin=0.2, check=1) for damping in dampings), key=median)
        what = {"damping": best["damping"]}
        first = {"k": STIFFNESSES[0], "step": best["step_over_impact"]}
        lists = [self.measure("lammps", "neighbours", **first, skin=skin, check=check, **what) for skin, check in neighbours]
        good = min((row for row in [best, *lists] if settled(row) and not row["dangerous_builds"]), key=median)
        what |= {"skin": good["skin"], "check": good["check"]}
        longer = max(0, STEPS.index(first["step"]) - 1)  # one longer step is tried for each stiffness
        for k in stiffnesses:
            self.largest_step("stiffness", STEPS[longer:], k=k, **what)
            self.measure("lammps", "customary", k=k, step=CUSTOMARY, **what)

    def repeat(self, repeats):
        """Ours and theirs in turn, round by round: the runs that are compared."""
        chosen = choice.compared_rows(self.bed)
        turns = [(code, row) for pair in itertools.zip_longest(*chosen) for code, row in zip(("ours", "lammps"), pair) if row]
        todo = sum(median(row) * max(0, repeats - len(row["cpus"])) for _, row in turns)
        began, done = time.monotonic(), 0.0
        for count in range(2, repeats + 1):
            for code, row in turns:
                if len(row["cpus"]) < count:
                    again = self.run(code, row["asked"])
                    row["cpus"].append(again["cpu"])
                    row["cores"] = least((row.get("cores"), again["cores"]))
                    done += again["cpu"]
                    self.told(f"{code} again {named(row)}: {again['cpu']:.2f} s{left(time.monotonic() - began, done, max(todo, done))}")

    def all(self):
        if shutil.which("lmp"):
            self.theirs()
        for h, arguments in QUICK_OURS if self.quick else OURS:
            self.measure("ours", "step and tolerance", h=h, arguments=arguments)
        self.repeat(QUICK_REPEATS if self.quick else REPEATS)
        self.path.unlink()
        return self.bed


def siconos(scene, quick):
    """Work-precision rows of one step from impulses zero, by all solvers."""
    scene.load("--steps", 3 if quick else LOADING, *asked(ANY))
    state = read(scene.warm.with_suffix(".json"))
    about = {"scene": scene.name, "grains": state["grains"], "contacts": round(state["contacts"][-1])}
    out, problem, solved = (scene.folder / f"{scene.name}-{kind}" for kind in ("run.json", "problem.hdf5", "siconos.hdf5"))
    export = scene.export(scene.cold, 1e-2, problem)

    def by_siconos(tolerance):
        row = measure.theirs(problem, tolerance, solved)
        return row and row | {"commands": [shown(command) for command in (export, *measure.their_commands(problem, tolerance, solved))]}

    def by_ours(arguments, tolerance):
        command = [*scene.command(arguments, tolerance, out), "--max-iterations", Budget.sweeps]
        row = measure.ours(command, out)
        return row and row | {"commands": [shown(command)]}

    rows, kept = [], ("tolerance", "iterations", "cpu", "cores", "eta", "converged", "repeats")
    for solver, arguments in SOLVERS.items():
        once = by_siconos if solver == SICONOS else functools.partial(by_ours, arguments)
        for row in ladder(SICONOS_TOLERANCES[:2] if quick else SICONOS_TOLERANCES, once):
            told = {key: row.get(key) for key in kept}
            rows.append({**about, "solver": solver, "arguments": arguments, **told, "commands": row.get("commands", [])})
    return rows
