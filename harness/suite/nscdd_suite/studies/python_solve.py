"""Contact problems of our scenes, as Siconos' own objects: its Gauss-Seidel and nscdd.solve() in one process of Python, to the same natural map."""
import json
import shutil
import statistics
import sys
import time
from pathlib import Path

from ..measure import SICONOS
from ..program import NSCDD, python
from ..study import Study, installed

SCENES = {"triaxial": (450, 1000), "isotropic": (1000,)}  # spheres
STEP, TOLERANCES, REPEATS, SWEEPS = 5, (1e-4, 1e-8), 5, 200000


class PythonSolve(Study):
    name, title, about = "python_solve", "Contact problems from Python", "what nscdd.solve spends on Siconos' own objects, beside Siconos"
    in_all = False  # asks for the module
    kinds = ("measured",)

    def jobs(self, plan):
        if not installed("siconos", "scipy"):
            return plan.leave_out(f"{SICONOS}: Siconos or SciPy is not installed (scripts/setup --siconos)")
        for scene, grains, out in self.problems(plan):
            packing = plan.pack(f"cases/packings/{scene}.toml", grains=grains, generator="own")
            problem = out.with_suffix(".hdf5")
            export = [NSCDD, "export-fclib", f"cases/reduced/{scene}.toml", "--packing", packing, "--step", STEP, "-o", problem, "--quiet"]
            solve = python("studies.python_solve", problem, 1 if plan.quick else REPEATS, out)
            plan.add(out.stem, [problem, out], [export, solve], needs=[packing], cost=grains / 10, alone=True)

    def rows(self, plan):
        found = [json.loads(out.read_text())["rows"] for *_, out in self.problems(plan) if out.exists()]
        return {"rows": [row for rows in found for row in rows]} if found else {}

    def problems(self, plan):
        """Scene, number of grains, and the file of its rows."""
        for scene, sizes in ({"triaxial": (450,)} if plan.quick else SCENES).items():
            for grains in sizes:
                yield scene, grains, plan.folder / f"{scene}-{grains}.json"


def timed(call, repeats):
    """What the last call returned, the median of the CPU seconds, and the least CPU over wall time."""
    seconds, cores = [], []
    for _ in range(repeats):
        began, wall = time.process_time(), time.monotonic()
        found = call()
        seconds.append(time.process_time() - began)
        cores.append(seconds[-1] / (time.monotonic() - wall))
    return found, statistics.median(seconds), min(cores)


def measure(path, repeats):
    """A row of each tolerance, and the load, as a run has it. Siconos' time is that of its solver, once, ours that of the whole call, its matrix read and turned."""
    sys.path.insert(0, str(Path(shutil.which(NSCDD)).resolve().parents[1] / "python"))  # of this build, else an installed one
    import nscdd

    from .. import other_solver, siconos_solve

    problem = other_solver.read(path)
    as_object = siconos_solve.with_friction(*problem[:4])
    rows, cores = [], []
    for tolerance in TOLERANCES:
        r, theirs = siconos_solve.solve(*problem, "NSGS", tolerance, SWEEPS)
        reached = nscdd.solve(as_object, solver="none", start=r).errors["natural_map"]
        ours, cpu, share = timed(lambda: nscdd.solve(as_object, tolerance=reached, max_iterations=SWEEPS), repeats)
        cores += [share, theirs["cores"]]
        told = {"problem": Path(path).stem, "contacts": len(problem[3]), "tolerance": tolerance, "natural_map_siconos": reached}
        told |= {"natural_map": ours.errors["natural_map"], "sweeps_siconos": theirs["iterations"], "sweeps": ours.iterations}
        rows.append(told | {"cpu_siconos": theirs["solver_cpu"], "cpu": cpu, "cpu_solver": ours.cpu, "ratio": theirs["solver_cpu"] / cpu})
    return {"rows": rows, "load": {"cores": {"least": min(cores)}, "believed": True}}


if __name__ == "__main__":
    problem, repeats, out = sys.argv[1:]
    Path(out).write_text(json.dumps(measure(problem, int(repeats))))
