"""Contact problems of other codes, by each of our solvers, Siconos' and Pinocchio's: which are solved, and how often which is the fastest at equal error.

The problems are the FCLIB files of the folder that NSCDD_FCLIB names, else of ../shared/fclib; siconos_problems.py makes such files of the test data of
Siconos. Errors are on the natural map, as Siconos 4.4 normalises it, and judged by our measure for all. CPU times are those of the solver's call, the
median of three where it is short. Solvers in 2D, and with rolling resistance, are those that have it. Pinocchio stops on another measure: the mildest
of its tolerances that reaches the error counts.
"""
import os
from pathlib import Path

from ...measure import Budget, answered, ladder, theirs, timed
from ...program import NSCDD, ROOT
from ...study import Study, installed
from ...times import cores_of

PROBLEMS = Path(os.environ.get("NSCDD_FCLIB", ROOT.parent / "shared/fclib"))
LEVELS = (1e-4, 1e-8, 1e-10)
OURS = {"auto": "auto", "NLGS": "nlgs", "Newton": "newton", "SPG": "spg", "APGD": "apgd"}
BUDGET, QUICK_BUDGET, QUICK_PROBLEMS = Budget(seconds=30), Budget(1000, 10), 2
ROW = ("tolerance", "iterations", "cpu", "cores", "error", "converged")


class Problems(Study):
    name, title, about = "problems", "Problems of other codes", "contact problems of other codes by every solver, beside those of Siconos and Pinocchio"

    def jobs(self, plan):
        others, budget = [], QUICK_BUDGET if plan.quick else BUDGET
        if installed("siconos", "scipy"):
            others += SICONOS
        else:
            plan.leave_out("Siconos: it or SciPy is not installed (scripts/setup --siconos)")
        if installed("pinocchio", "scipy"):
            others += PINOCCHIO
        else:
            plan.leave_out("Pinocchio: it is not installed (its steps are in harness/suite/nscdd_suite/pinocchio_solve.py)")
        for path in (found := problems(plan.quick)):
            plan.rows(path.stem, solved, path, plan.folder, others, budget, alone=True, cost=1 if plan.quick else 20)
        if not found:
            plan.leave_out(f"FCLIB problems: there are none in {PROBLEMS}")

    def rows(self, plan):
        rows = [row for path in problems(plan.quick) for row in plan.made(path.stem)]
        return {"rows": rows, "left_out": plan.left_out} if rows else {}

    def told(self, data):
        for level in LEVELS:
            count = len({row["problem"] for row in data["rows"]})
            unsolved = {row["problem"] for row in data["rows"]} - {row["problem"] for row in data["rows"] if converged(row, "auto", level)}
            yield f"{level:g}: auto solves {count - len(unsolved)} of {count} problems" + (f", not {', '.join(sorted(unsolved))}" if unsolved else "")


def problems(quick):
    found = sorted(PROBLEMS.glob("*.hdf5"))
    return sorted(found, key=lambda path: path.stat().st_size)[:QUICK_PROBLEMS] if quick else found


def converged(row, solver, level):
    return row["solver"] == solver and row["tolerance"] == level and row["converged"]


def solved(path, folder, others, budget):
    """Rows of a problem: what each solver took to each error, until it stalls."""
    out, rows = folder / "solved.json", []
    about = answered([NSCDD, "solve-fclib", path, "--max-sweeps", 1, "--json", out], out)
    about = {"problem": path.stem, "contacts": about["contacts"], "dimension": about["dimension"]}
    for name, solver in OURS.items():
        rows += ({**about, "solver": name, **kept(row)} for row in ladder(LEVELS, lambda tolerance: ours(path, solver, tolerance, out, budget), timed))
    for name in others:
        once = lambda tolerance: OTHERS[name](path, tolerance, out.with_suffix(".hdf5"), budget)
        rows += ({**about, "solver": name, **kept(row)} for row in ladder(LEVELS, once, lambda measure: measure()))
    return rows


def kept(row):
    return {key: row.get(key) for key in ROW}


def ours(path, solver, tolerance, out, budget):
    cap = ["--max-sweeps", budget.sweeps] if solver != "newton" else []
    run = answered([NSCDD, "solve-fclib", path, "--solver", solver, "--tolerance", f"{tolerance:g}", "--json", out, *cap], out, budget.seconds)
    if run is None:
        return None
    error = run["measures"]["natural_map"]
    return {"iterations": run["iterations"], "cpu": run["solver_cpu"], "cores": cores_of(run), "converged": run["converged"], "error": error, "reached": error}


def by_siconos(solver):
    return lambda path, tolerance, out, budget: judged(theirs(path, tolerance, out, budget, solver, repeat=3), tolerance)


def by_pinocchio(path, tolerance, out, budget):
    """By the mildest of its own tolerances that reaches the error asked for, from ten times that error on."""
    row = None
    for power in range(1, -6, -1):
        row = judged(theirs(path, tolerance * 10.0**power, out, budget, "ADMM", repeat=3, module="pinocchio_solve"), tolerance)
        if row is None or row["converged"] or row["iterations"] >= budget.sweeps:
            break
    return row and row | {"reached": row["error"]}


def judged(row, tolerance):
    return row and row | {"converged": row["error"] <= 1.001 * tolerance}


SICONOS = {f"Siconos {solver}": by_siconos(solver) for solver in ("NSGS", "NSN_AC", "ADMM")}
PINOCCHIO = {"Pinocchio ADMM": by_pinocchio}
OTHERS = SICONOS | PINOCCHIO
