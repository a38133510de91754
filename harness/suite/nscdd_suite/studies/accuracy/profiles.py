"""Rows of the performance profiles: one problem by each solver, to three tolerances."""
from ...measure import ANY, SICONOS, answered, asked, ladder, siconos
from ...program import NSCDD
from .curves import counted

LEVELS = (1e-4, 1e-6, 1e-8)


def once(measure):
    return measure()


def hard_rows(path, folder, solvers, budget, _):
    """The first step of a hard case; none where it has no contact."""
    rows, out = [], folder / "hard-run.json"
    for solver in solvers:

        def measure(tolerance):
            command = [NSCDD, "run", path, "--steps", 1, *solver.run.split(), *asked(ANY), "--tolerance", f"{tolerance:g}", "--quiet", "--json", out]
            run = answered(command + solver.cap(budget), out, budget.seconds)
            error = run and run["residual"][0]
            return run and counted(solver, run, run["seconds"]["solver_cpu"], error) | {"error": error, "contacts": run["contacts"][0]}

        for row in ladder(LEVELS, measure, once) if solver.profile else ():
            if row.get("contacts") == 0:
                return rows
            rows.append(profile_row("hard", path, solver.name, row))
    return rows


def fclib_rows(path, folder, solvers, budget, with_siconos):
    """One FCLIB file."""
    rows, out = [], folder / "fclib-run.json"
    for solver in (solver for solver in solvers if solver.fclib):

        def measure(tolerance):
            command = [NSCDD, "solve-fclib", path, *solver.fclib.split(), "--tolerance", f"{tolerance:g}", "--json", out]
            run = answered(command + solver.cap(budget, "--max-sweeps"), out, budget.seconds)
            error = run and run["measures"]["natural_map"]
            return run and counted(solver, run, run["solver_cpu"], error) | {"error": error}

        rows += [profile_row("fclib", path, solver.name, row) for row in ladder(LEVELS, measure)]

    def by_siconos(tolerance):
        row = siconos(path, tolerance, folder / "siconos.hdf5", budget)
        return row and row | {"converged": row["error"] <= 1.001 * tolerance}

    return rows + [profile_row("fclib", path, SICONOS, row) for row in (ladder(LEVELS, by_siconos) if with_siconos else ())]


def profile_row(group, path, solver, row):
    keys = ("tolerance", "iterations", "sweeps", "cpu", "cores", "error", "converged")
    return {"set": group, "problem": path.stem, "solver": solver, **{key: row.get(key) for key in keys}}
