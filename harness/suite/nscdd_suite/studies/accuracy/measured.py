"""What is measured: work-precision curves of a scene, by each solver from its loaded state, and rows of the performance profiles."""
import shutil

import h5py
import numpy as np

from ...measure import ANY, LONG, SICONOS, Scene, asked, distance, ladder, ours, theirs
from ...program import NSCDD, Failed, made, shown

REFERENCE, REFERENCE_WORST = 1e-11, 1e-10  # eta asked of the reference answer, and the most that is taken
LEVELS = (1e-4, 1e-6, 1e-8)  # tolerances of the profiles


class Curves(Scene):
    def __init__(self, path, plan, budget, grains):
        super().__init__(path, plan, grains)
        self.budget, self.reference = budget, self.folder / f"{self.name}-reference.json"

    def measured(self, ladders, of_siconos):
        """What the record says of the scene, and its runs; ladders: (solver, tolerances)."""
        about = self.prepare()
        rows = [row for solver, tolerances in ladders for row in self.rows(solver, tolerances)]
        return {"scene": about, "runs": rows + (list(self.siconos_rows(of_siconos)) if of_siconos else [])}

    def prepare(self):
        """The state, and the reference answer from it without impulses."""
        self.load()
        command = self.command("--scheme newton", REFERENCE, self.reference)
        run = made(command, self.reference, seconds=LONG)
        eta, self.free_norm = run["residual"][0], run["final"]["free_velocity_norm"]
        if eta > REFERENCE_WORST:
            raise Failed(f"{self.name}: the reference reached eta = {eta:.2g} only; choose a scene that can be solved")
        told = {"command": shown(command), "scheme": run["scheme"], "eta": eta, "iterations": run["iterations"][0], "cpu": run["seconds"]["solver_cpu"]}
        about = {"name": self.name, "dimension": run["dimension"], "grains": run["grains"], "contacts": run["contacts"][0], "model": run["model"]}
        return about | {"shows": self.path.read_text().splitlines()[0].lstrip("# "), "reference": told, "ccs": self.ccs()}

    def ccs(self):
        """Whether CCS makes the iterates of DCS: iterations of both, and how far their velocities are apart."""
        iterations, velocity = {}, {}
        for scheme in ("dcs", "ccs"):
            out = self.folder / f"{self.name}-{scheme}.json"
            command = self.command(f"--scheme {scheme} --method paper --subdomains 8", 1e-3, out)
            iterations[f"iterations_{scheme}"] = made(command, out, seconds=self.budget.seconds)["iterations"][0]
            with h5py.File(out.with_suffix(".h5")) as file:
                velocity[scheme] = file["velocity"][...]
        return iterations | {"velocity_difference": float(np.abs(velocity["dcs"] - velocity["ccs"]).max() / np.abs(velocity["dcs"]).max())}

    def rows(self, solver, tolerances):
        out = self.folder / f"{self.name}-run.json"

        def measure(tolerance):
            return swept(solver, ours(self.command(solver.run, tolerance, out) + solver.cap(self.budget), out, self.budget.seconds))

        for row in ladder(tolerances, measure):
            if row["cpu"] is not None:
                row["distance"] = distance(self.reference, out)
            yield self.row(solver.name, solver.run, row)

    def siconos_rows(self, tolerances):
        """By Siconos on the exported problem; the distance is that of the velocities again, as H^T M^-1 H = W."""
        import scipy.sparse

        problem, solved, answer = (self.folder / f"{self.name}-{kind}" for kind in ("problem.hdf5", "siconos.hdf5", "answer.h5"))
        shutil.copy(self.cold, answer)
        with h5py.File(answer, "r+") as file, h5py.File(self.reference.with_suffix(".h5")) as reference:
            del file["contacts"]
            reference.copy("contacts", file)
        self.export(answer, REFERENCE_WORST, problem)
        with h5py.File(problem) as file:
            w = scipy.sparse.csc_matrix(tuple(file[f"fclib_local/W/{key}"][...] for key in ("x", "i", "p")))
            exact = file["solution/r"][...]

        def measure(tolerance):
            if row := theirs(problem, tolerance, solved, self.budget):
                with h5py.File(solved) as file:
                    error = file["solution/r"][...] - exact
                row["distance"] = float(np.sqrt(max(0.0, error @ (w @ error)))) / self.free_norm
            return row

        for row in ladder(tolerances, measure):
            yield self.row(SICONOS, "python3 -m nscdd_suite.siconos_solve", row)

    def row(self, solver, arguments, row):
        keys = ("tolerance", "iterations", "sweeps", "cpu", "cores", "eta", "distance", "converged", "repeats")
        return {"scene": self.name, "solver": solver, "arguments": arguments, **{key: row.get(key) for key in keys}}


def swept(solver, row):
    """The row with its sweeps; Newton has none."""
    return row and row | {"sweeps": row["iterations"] * solver.sweeps or None}


def first_step(path, solver, tolerance, out, budget):
    command = [NSCDD, "run", path, "--steps", 1, *solver.run.split(), *asked(ANY), "--tolerance", f"{tolerance:g}", "--quiet", "--json", out]
    return swept(solver, ours(command + solver.cap(budget), out, budget.seconds))


def profile_rows(path, folder, solvers, budget):
    """A hard case by each solver; no rows where it has no contact."""
    rows, out = [], folder / "hard-run.json"
    keys = ("tolerance", "iterations", "sweeps", "cpu", "cores", "error", "converged")
    for solver in solvers:
        for row in ladder(LEVELS, lambda tolerance: first_step(path, solver, tolerance, out, budget), lambda measure: measure()):
            if row.get("contacts") == 0:
                return []
            rows.append({"set": "hard", "problem": path.stem, "solver": solver.name, **{key: row.get(key) for key in keys}})
    return rows
