"""What acceleration saves: iterations and CPU time of the paper's own method and of the accelerated one.

The paper's three scenes at a reduced size, step by step, each started by the impulses of the one before; and one step of 5,000 and of 20,000
spheres in compaction from impulses zero. By NLGS, and by NSCDD on 8, 48 and 128 subdomains, which take turns on one core: their CPU time is the
work of all. To eta = 1e-4. Then hard cases (cases/hard) by NLGS, to their own tolerance, in microseconds too: which of them cost more when
accelerated? Short runs are made three times, hard cases nine times, and the median of their CPU times is taken. Quick: few grains and subdomains.
"""
import re
import statistics
from pathlib import Path

from ...measure import LONG, clear_impulses, timed
from ...program import NSCDD, call, made
from ...study import Study
from ...times import believed, cores_of, least

WARM = ("biaxial", "isotropic", "triaxial")
COLD = ("5000 spheres", "20000 spheres")
SCENES = (*WARM, *COLD)
LOADING = 20  # steps of compaction before the cold one
SUBDOMAINS = (1, 8, 48, 128)
METHODS = ("paper", "auto")
QUICK_GRAINS = 300
LEFT_OUT = r"coincident|squeeze-slow|pair|heap|rebound"  # they end in an error, as they should, or are long and of few contacts
QUICK_HARD = r"cradle-(3|10)-0-2d|column-10-|rest-2d"


class Acceleration(Study):
    name, title, about = "acceleration", "What acceleration saves", "iterations and CPU time, plain and accelerated"

    def jobs(self, plan):
        for name in SCENES:
            scene, grains = name if name in WARM else "isotropic", 0 if name in WARM else int(name.split()[0])
            packing = plan.pack(f"cases/packings/{scene}.toml", grains=QUICK_GRAINS if plan.quick else grains, loose=plan.quick)
            plan.rows(name, measured, name, [Path(f"cases/reduced/{scene}.toml"), "--packing", packing], plan, needs=[packing], cost=30, alone=True)
        for name in hard_cases(plan.quick):
            plan.rows(f"hard/{name}", hard_row, name, plan.folder, needs=[f"cases/hard/{name}.toml"], alone=True, small=True)

    def rows(self, plan):
        rows = [row for name in SCENES for row in plan.made(name)]
        hard = [row for name in hard_cases(plan.quick) if (row := plan.made(f"hard/{name}"))]
        return {"rows": rows, "hard": hard} if rows or hard else {}


def hard_cases(quick):
    names = [path.stem for path in sorted(Path("cases/hard").glob("*.toml"))]
    return [name for name in names if re.search(QUICK_HARD if quick else "", name) and not re.match(LEFT_OUT, name)]


def solved(where, out, *how):
    """The JSON of a run, with the CPU time of the solver and the share of the core that it had."""
    run = made([NSCDD, "run", *where, *how, "--quiet", "--json", out], out, seconds=LONG)
    return run | {"cpu": run["seconds"]["solver_cpu"], "cores": cores_of(run)}


def measured(name, where, plan):
    if name in COLD:
        state = plan.folder / f"{name}-cold.h5"
        call([NSCDD, "run", *where, "--method", "auto", "--steps", LOADING, "--quiet", "--json", state.with_suffix(".json"), "--state", state], seconds=LONG)
        clear_impulses(state)
        where = [*where, "--from", state, "--steps", 1]
    elif plan.quick:
        where = [*where, "--steps", 5]
    return [row(name, where, method, n, plan.folder / "run.json") for n in (SUBDOMAINS[:2] if plan.quick else SUBDOMAINS) for method in METHODS]


def row(name, where, method, subdomains, out):
    scheme = ["--scheme", "nlgs"] if subdomains == 1 else ["--scheme", "dcs", "--subdomains", subdomains]

    def once():
        run = solved(where, out, *scheme, "--method", method)
        told = {"cpu": run["cpu"], "iterations": sum(run["iterations"]), **{key: run[key] for key in ("steps", "grains", "converged")}}
        return told | {"contacts": sum(run["contacts"]) / run["steps"], "cores": run["cores"], "eta": max(run["residual"])}

    return {"scene": name, "start": "warm" if name in WARM else "cold", "method": method, "subdomains": subdomains, **timed(once)}


def hard_row(name, folder):
    """One hard case by both methods in turn, so that a processor which changes its pace changes it for both."""

    def once(method, repeat):
        return believed(lambda: solved([f"cases/hard/{name}.toml"], folder / "run.json", "--method", method, "--repeat", repeat))

    cpu = once("paper", 1)["cpu"]
    repeats = 1 if cpu > 1 else 9  # where two processes put the same code matters more than the method
    found = {method: [] for method in METHODS}
    for _ in range(repeats):
        for method in METHODS:  # enough runs in one process that code and memory touched for the first time do not count
            found[method].append(once(method, max(1, min(201, int(0.02 / max(cpu, 1e-6))))))
    last = found["paper"][-1]
    told = {"scene": name, "steps": last["steps"], "contacts": max(last["contacts"]), "repeats": repeats}
    return told | {method: summary(runs) for method, runs in found.items()}


def summary(runs):
    cpu, cores = statistics.median(run["cpu"] for run in runs), least(run["cores"] for run in runs)
    return {"iterations": sum(runs[-1]["iterations"]), "cpu": cpu, "cores": cores, "converged": runs[-1]["converged"]}
