"""Speed against error: what each solver spends to be how accurate, and how often which solver is the fastest.

Work-precision curves: one step of each scene in cases/accuracy from one loaded state, its impulses taken away, by every solver at tolerances from
1e-1 to 1e-8: CPU time of the solver and sweeps against eta and against the distance of the velocities from a reference answer, eta <= 1e-10.
Performance profiles: the first step of all hard cases, to 1e-4, 1e-6 and 1e-8. Siconos takes part where it is installed. Short runs are made three
times, and the median of their CPU times is taken. Quick: two small scenes, few tolerances, solvers and problems.
"""
import dataclasses
import re
from pathlib import Path

from ...measure import SICONOS, Budget
from ...record import beside
from ...study import Study, installed
from .measured import Curves, profile_rows

TOLERANCES = [10.0**-k for k in range(1, 9)]
QUICK_SCENES, QUICK_TOLERANCES, QUICK_GRAINS, QUICK_BUDGET = ("dense-3d", "loose-2d"), (1e-2, 1e-4), 120, Budget(5000, 20)
QUICK_CASES = r"(column-10|lid-10|pile-grains-stays|wedge-locked)-2d"
NOT_LONG = r"(?!pair|heap|rebound)"  # long runs are about their energy, their first steps are those of other cases
ONLY = {"large-3d": r"NLGS.*|NSCDD \d+, auto|Newton"}  # solvers of a scene, where not all
QUICK_SOLVERS = r"NLGS|NSCDD 8, n_GS 1|NSCDD 4|SPG|Newton|Siconos.*"


@dataclasses.dataclass
class Solver:
    """An entry of solvers.toml, which says what its fields are."""

    name: str
    run: str
    sweeps: int = 1
    profile: bool = False
    tolerances: tuple = tuple(TOLERANCES)

    def cap(self, budget):
        return ["--max-iterations", max(1, budget.sweeps // self.sweeps)] if self.sweeps else []


SOLVERS = [Solver(**one) for one in beside(__file__, "solvers.toml")["solvers"]]


class Accuracy(Study):
    name, title, about = "accuracy", "Speed against error", "what each solver spends to be how accurate"

    def jobs(self, plan):
        quick, budget, siconos = plan.quick, QUICK_BUDGET if plan.quick else Budget(), installed("siconos", "scipy")
        solvers = [solver for solver in SOLVERS if not quick or re.fullmatch(QUICK_SOLVERS, solver.name)]
        if not siconos:
            plan.leave_out(f"{SICONOS}: Siconos or SciPy is not installed (scripts/setup --siconos)")
        for path in scenes(quick):
            scene = Curves(path, plan, budget, QUICK_GRAINS if quick else 0)
            ladders = [(s, [t for t in s.tolerances if not quick or t in QUICK_TOLERANCES]) for s in solvers if re.fullmatch(ONLY.get(path.stem, ".*"), s.name)]
            of_siconos = (QUICK_TOLERANCES if quick else TOLERANCES) if siconos and path.stem not in ONLY else ()
            plan.rows(path.stem, scene.measured, ladders, of_siconos, needs=[scene.packing], cost=40, alone=True)
        for path in problems(quick):
            some = [solver for solver in solvers if solver.profile]
            plan.rows(f"hard {path.stem}", profile_rows, path, plan.folder, some, budget, alone=True, small=True)

    def rows(self, plan):
        curves = [made for path in scenes(plan.quick) if (made := plan.made(path.stem))]
        profiles = [row for path in problems(plan.quick) for row in plan.made(f"hard {path.stem}")]
        data = {"scenes": [made["scene"] for made in curves], "runs": [row for made in curves for row in made["runs"]], "profiles": profiles}
        return {"budget": dataclasses.asdict(QUICK_BUDGET if plan.quick else Budget()), **data, "left_out": plan.left_out} if curves or profiles else {}


def scenes(quick):
    return [path for path in sorted(Path("cases/accuracy").glob("*.toml")) if not quick or path.stem in QUICK_SCENES]


def problems(quick):
    return [path for path in sorted(Path("cases/hard").glob("*.toml")) if re.match(QUICK_CASES if quick else NOT_LONG, path.stem)]
