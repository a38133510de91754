"""How the curves and profiles of scripts/accuracy are measured: one program run for each solver and tolerance."""
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.append(str(ROOT / "reports"))
from nscdd_report.times import believed, cores_of, least  # noqa: E402

NSCDD = os.environ.get("NSCDD", "build/bin/nscdd")
LEVELS = (1e-4, 1e-6, 1e-8)  # of the profiles
REFERENCE, REFERENCE_WORST = 1e-11, 1e-10  # eta asked of the reference answer, and the most that is taken
ANY = 1e30  # velocity error: eta alone stops a run, so that costs are at equal eta
LONG = 600  # seconds for what is not compared: packings, states, references
ALONE = os.environ | {"OMPI_MCA_ess_singleton_isolated": "1"}  # or Open MPI would start a daemon beside each run
SICONOS = "Siconos NSGS"


class Failed(Exception):
    """A command that should have worked; the text says which, and what it said."""


class Budget:
    """How much a run may take: what has not got there by then has stalled."""
    sweeps, seconds = 50000, 60


def asked(velocity_error):
    """What a step is asked for besides eta; of ANY nothing, not even that it makes no energy."""
    return ["--velocity-error", velocity_error, *(["--energy-made", ANY, "--gap-error", ANY, "--distance", ANY] if velocity_error == ANY else [])]


def call(command, needed=True, seconds=None):
    """Runs it within the budget of time. Exit code 3, not converged, is an answer too; None when out of time."""
    command = list(map(str, command))
    try:  # by the wall clock: with a limit on CPU time the clock that measures it would only move in ticks of 4 ms
        done = subprocess.run(command, cwd=ROOT, env=ALONE, capture_output=True, text=True,
                              timeout=seconds or Budget.seconds)
    except subprocess.TimeoutExpired:
        if needed:
            raise Failed(f"{shlex.join(command)}: took more than {seconds or Budget.seconds} s") from None
        return None
    if needed and done.returncode not in (0, 3):
        raise Failed(f"{shlex.join(command)}: exit code {done.returncode}: {done.stderr.strip()[-300:]}")
    return done


def answered(command, out):
    """The JSON that the command writes to `out`; None when out of time, or refused."""
    out.unlink(missing_ok=True)
    done = call(command, needed=False)
    return read(out) if done and done.returncode in (0, 3) and out.exists() else None


def shown(command):
    """As typed in the repository, whatever machine this is."""
    return shlex.join(["nscdd", *(os.path.relpath(a, ROOT) if isinstance(a, Path) else str(a) for a in command[1:])])


def read(path):
    return json.loads(Path(path).read_text())


def timed(measure):
    """measure() -> dict with the CPU seconds `cpu` and the `cores` it had, or None; of short ones the one with the median time of three."""
    first = believed(measure)
    if first is None or first["cpu"] > 1:
        return first and first | {"repeats": 1}
    three = sorted([first, believed(measure), believed(measure)], key=lambda result: result["cpu"])
    return three[1] | {"repeats": 3, "cores": least(one.get("cores") for one in three)}


def ladder(tolerances, measure, repeat=timed):
    """Rows of a solver from the mildest tolerance on, until it stalls. measure(tolerance): a row, with what the tolerance is on
    as `reached`, or None when out of time. A run that got below the next tolerance already is that one's run too."""
    row = None
    for tolerance in tolerances:
        if row is None or row["reached"] > tolerance:
            row = repeat(lambda: measure(tolerance))
        if row is None:
            yield {"tolerance": tolerance, "iterations": None, "sweeps": None, "cpu": None, "converged": False}
            return
        yield {"tolerance": tolerance} | row
        if not row["converged"]:
            return


def clear_impulses(state):
    with h5py.File(state, "r+") as file:
        file["contacts/impulse"][...] = 0
        file["contacts/normal_impulse"][...] = 0


def once(measure):
    return measure()


def pack(specification, out, grains=0, loose=False):
    """With as many grains, or as many as the specification says; loose: few of them jam early."""
    text = specification.read_text()
    if grains:
        text = re.sub(r"grains = \d+", f"grains = {grains}", text)
    if loose:
        text = re.sub(r"(?<=solid_fraction = )[\d.]+", lambda dense: f"{0.94 * float(dense[0]):.3f}", text)
    specification = out.with_suffix(".toml")
    specification.write_text(text)
    call([NSCDD, "pack", specification, "-o", out, "--quiet"], seconds=LONG)


def distance(reference, json_file):
    """Of the velocities from the reference, |V - V_ref|_M / |V_free|_M."""
    table = Path(json_file).with_suffix(".compare.json")
    done = call([NSCDD, "compare", reference, json_file, "--json", table], needed=False)
    if done is None or done.returncode not in (0, 2):
        raise Failed(f"nscdd compare {json_file}: {done and done.stderr.strip()}")
    return next(row["value"] for row in read(table)["rows"] if row["quantity"].startswith("velocities"))


class Scene:
    """A scene of a packing at one loaded state, from which one step is solved."""
    packings = set()  # made so far

    def __init__(self, path, folder, grains, specifications=ROOT / "cases/accuracy/packings"):
        self.path, self.name, self.folder, self.grains, self.specifications = path, path.stem, folder, grains, specifications
        self.packing = folder / re.search(r"(\w[\w-]*)\.h5", path.read_text())[0]
        self.warm, self.cold = (folder / f"{self.name}-{start}.h5" for start in ("warm", "cold"))

    def load(self, *arguments):
        """The state after the scene's own steps, with its impulses (warm) and without (cold)."""
        if self.packing not in self.packings:  # two scenes may have one
            pack(self.specifications / f"{self.packing.stem}.toml", self.packing, self.grains)
            self.packings.add(self.packing)
        # by the paper's method, so that the problem does not change with every change of the acceleration
        call([NSCDD, "run", os.path.relpath(self.path, ROOT), "--packing", self.packing, "--method", "paper", *arguments, "--quiet",
              "--json", self.warm.with_suffix(".json"), "--state", self.warm], seconds=LONG)
        shutil.copy(self.warm, self.cold)
        clear_impulses(self.cold)

    def prepare(self):
        """The state, and the reference answer from it without impulses; returns what the record says of it."""
        self.load()
        eta, command = self.solve_reference()
        run = read(self.reference)
        self.free_norm = run["final"]["free_velocity_norm"]
        return {"name": self.name, "dimension": run["dimension"], "grains": run["grains"], "contacts": run["contacts"][0],
                "model": run["model"], "shows": self.path.read_text().splitlines()[0].lstrip("# "),
                "reference": {"command": shown(command), "scheme": run["scheme"], "eta": eta,
                              "iterations": run["iterations"][0], "cpu": run["seconds"]["solver_cpu"]},
                "ccs": self.ccs()}

    def solve_reference(self):
        """By Newton. Leaves a state to go on from with the answer's impulses."""
        self.reference = self.folder / f"{self.name}-reference.json"
        command = self.command("--scheme newton", REFERENCE, self.reference)
        call(command, seconds=LONG)
        eta = read(self.reference)["residual"][0]
        if eta > REFERENCE_WORST:
            raise Failed(f"{self.name}: the reference reached eta = {eta:.2g} only; choose a scene that can be solved")
        self.answer = self.folder / f"{self.name}-answer.h5"
        shutil.copy(self.cold, self.answer)
        with h5py.File(self.answer, "r+") as file, h5py.File(self.reference.with_suffix(".h5")) as solved:
            del file["contacts"]
            solved.copy("contacts", file)
        return eta, command

    def command(self, arguments, tolerance, json_file, start=None, velocity_error=ANY):
        return [NSCDD, "run", os.path.relpath(self.path, ROOT), "--packing", self.packing, "--from", start or self.cold, "--steps", 1,
                *arguments.split(), *asked(velocity_error), "--tolerance", f"{tolerance:g}", "--quiet", "--json", json_file, "--state", Path(json_file).with_suffix(".h5")]

    def distance(self, json_file):
        return distance(self.reference, json_file)

    def ccs(self):
        """Whether CCS makes the iterates of DCS: iterations of both, and how far their velocities are apart."""
        found = []
        for scheme in ("dcs", "ccs"):
            out = self.folder / f"{self.name}-{scheme}.json"
            call(self.command(f"--scheme {scheme} --method paper --subdomains 8", 1e-3, out))
            found.append(read(out)["iterations"][0])
        velocity = []
        for scheme in ("dcs", "ccs"):
            with h5py.File(self.folder / f"{self.name}-{scheme}.h5") as file:
                velocity.append(file["velocity"][...])
        apart = np.abs(velocity[0] - velocity[1]).max() / np.abs(velocity[0]).max()
        return {"iterations_dcs": found[0], "iterations_ccs": found[1], "velocity_difference": float(apart)}

    def rows(self, solver, tolerances):
        out = self.folder / f"{self.name}-run.json"
        cap = ["--max-iterations", max(1, Budget.sweeps // solver.sweeps)] if solver.sweeps else []

        def measure(tolerance):
            run = answered(self.command(solver.run, tolerance, out) + cap, out)
            if run is None:
                return None
            iterations = run["iterations"][0]
            return {"iterations": iterations, "sweeps": iterations * solver.sweeps or None, "cpu": run["seconds"]["solver_cpu"],
                    "cores": cores_of(run), "eta": run["residual"][0], "reached": run["residual"][0], "converged": run["converged"]}
        for row in ladder(tolerances, measure):
            if row["cpu"] is not None:
                row["distance"] = self.distance(out)
            yield curve_row(self.name, solver.name, solver.run, row)

    def siconos_rows(self, tolerances):
        """By Siconos on the exported problem; the distance is that of the velocities again, as H^T M^-1 H = W."""
        problem, solved = (self.folder / f"{self.name}-{kind}.hdf5" for kind in ("problem", "siconos"))
        call([NSCDD, "export-fclib", self.path, "--packing", self.packing, "--from", self.answer, "--tolerance", REFERENCE_WORST, "-o", problem, "--quiet"],
             seconds=LONG)
        with h5py.File(problem) as file:
            import scipy.sparse
            w = scipy.sparse.csc_matrix(tuple(file[f"fclib_local/W/{key}"][...] for key in ("x", "i", "p")))
            exact = file["solution/r"][...]

        def measure(tolerance):
            row = siconos(problem, tolerance, solved)
            if row is None:
                return None
            with h5py.File(solved) as file:
                error = file["solution/r"][...] - exact
            return row | {"distance": float(np.sqrt(max(0.0, error @ (w @ error)))) / self.free_norm}
        for row in ladder(tolerances, measure):
            yield curve_row(self.name, SICONOS, "scripts/siconos_nsgs", row)


def curve_row(scene, solver, arguments, row):
    keys = ("tolerance", "iterations", "sweeps", "cpu", "cores", "eta", "distance", "converged", "repeats")
    return {"scene": scene, "solver": solver, "arguments": arguments, **{key: row.get(key) for key in keys}}


def siconos_commands(problem, tolerance, solved):
    """What solves an exported problem, and what measures the answer."""
    return ([Path("scripts/siconos_nsgs"), problem, "--tolerance", tolerance, "--max-iterations", Budget.sweeps, "-o", solved],
            [NSCDD, "solve-fclib", solved, "--solver", "none", "--json", solved.with_suffix(".json")])


def siconos(problem, tolerance, solved):
    """Iterations, CPU time, and our measures of the answer; None when out of time."""
    solve, judge = siconos_commands(problem, tolerance, solved)
    done = call(solve, needed=False)
    if done is None or done.returncode:
        return None
    answer = json.loads(done.stdout.splitlines()[-1])
    call(judge)
    measures = read(solved.with_suffix(".json"))["measures"]
    return {"iterations": answer["iterations"], "sweeps": answer["iterations"], "cpu": answer["solver_cpu"], "cores": answer["cores"], "eta": measures["eta"],
            "reached": answer["residual"], "converged": answer["residual"] <= tolerance, "error": measures["natural_map"]}


def hard_rows(path, folder, solvers):
    """One hard case by each solver: rows of the profile, none where the first step has no contact."""
    out = folder / "hard-run.json"
    for solver in solvers:
        def measure(tolerance):
            command = [NSCDD, "run", path, "--steps", 1, *solver.run.split(), *asked(ANY), "--tolerance", f"{tolerance:g}", "--quiet",
                       "--json", out]
            if solver.sweeps:
                command += ["--max-iterations", max(1, Budget.sweeps // solver.sweeps)]
            run = answered(command, out)
            if run is None:
                return None
            iterations = run["iterations"][0]
            return {"iterations": iterations, "sweeps": iterations * solver.sweeps or None, "cpu": run["seconds"]["solver_cpu"],
                    "cores": cores_of(run), "error": run["residual"][0], "reached": run["residual"][0], "converged": run["converged"],
                    "contacts": run["contacts"][0]}
        for row in ladder(LEVELS, measure, once):
            if row.get("contacts") == 0:
                return
            yield profile_row("hard", path.stem, solver.name, row)


def fclib_rows(path, folder, solvers, with_siconos):
    """One FCLIB file by each solver."""
    out = folder / "fclib-run.json"
    for solver in solvers:
        def measure(tolerance):
            command = [NSCDD, "solve-fclib", path, *solver.fclib.split(), "--tolerance", f"{tolerance:g}", "--json", out]
            if solver.sweeps:
                command += ["--max-sweeps", Budget.sweeps]
            run = answered(command, out)
            if run is None:
                return None
            return {"iterations": run["iterations"], "sweeps": run["iterations"] * solver.sweeps or None, "cpu": run["solver_cpu"],
                    "cores": cores_of(run), "error": run["measures"]["natural_map"], "reached": run["measures"]["natural_map"],
                    "converged": run["converged"]}
        for row in ladder(LEVELS, measure):
            yield profile_row("fclib", path.stem, solver.name, row)
    if with_siconos:
        def by_siconos(tolerance):
            row = siconos(path, tolerance, folder / "siconos.hdf5")
            return row and row | {"converged": row["error"] <= 1.001 * tolerance}
        for row in ladder(LEVELS, by_siconos):
            yield profile_row("fclib", path.stem, SICONOS, row)


def profile_row(group, problem, solver, row):
    return {"set": group, "problem": problem, "solver": solver,
            **{key: row.get(key) for key in ("tolerance", "iterations", "sweeps", "cpu", "cores", "error", "converged")}}


