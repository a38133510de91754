"""How solvers are compared at equal error: one run for each tolerance, of one step from a loaded state."""
import dataclasses
import json
import re
import shutil
from pathlib import Path

from .program import COMPARED, NSCDD, Failed, call, made, python
from .times import believed, cores_of, least

ANY = 1e30  # velocity error: eta alone stops a run, so that costs are at equal eta
LONG = 600  # seconds for what is not compared: packings, states, references
SICONOS = "Siconos NSGS"


@dataclasses.dataclass
class Budget:
    """How much a run may take: what has not got there by then has stalled."""

    sweeps: int = 50000
    seconds: float = 60


def asked(velocity_error):
    """What a step is asked for besides eta; of ANY nothing, not even that it makes no energy."""
    more = ["--max-energy-gain", ANY, "--max-gap-error", ANY, "--max-distance", ANY] if velocity_error == ANY else []
    return ["--max-velocity-error", velocity_error, *more]


def answered(command, out, seconds=Budget.seconds):
    """The JSON that the command writes to `out`; None when out of time, or refused."""
    try:
        return made(command, out, seconds=seconds)
    except Failed:
        return None


def ours(command, out, seconds=Budget.seconds):
    """What our solver took for one step, and how exact its answer is; None when out of time, or refused."""
    if run := answered(command, out, seconds):
        told = {"iterations": run["iterations"][0], "cpu": run["seconds"]["solver_cpu"], "cores": cores_of(run), "converged": run["converged"]}
        return told | {"contacts": run["contacts"][0]} | dict.fromkeys(("eta", "reached", "error"), run["residual"][0])
    return None


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
    import h5py

    with h5py.File(state, "r+") as file:
        file["contacts/impulse"][...] = 0
        file["contacts/normal_impulse"][...] = 0


def distance(reference, json_file):
    """Of the velocities from the reference, |V - V_ref|_M / |V_free|_M."""
    table = Path(json_file).with_suffix(".compare.json")
    rows = made([NSCDD, "compare", reference, json_file, "--json", table], table, fine=COMPARED, seconds=Budget.seconds)["rows"]
    return next(row["value"] for row in rows if row["quantity"].startswith("velocities"))


class Scene:
    """A scene of a packing at one loaded state, from which one step is solved. What loads it needs its packing, which the plan makes."""

    def __init__(self, path, plan, grains=0, specifications="cases/accuracy/packings"):
        self.path, self.name, self.folder = Path(path), Path(path).stem, plan.folder
        packing = re.search(r"(\w[\w-]*)\.h5", self.path.read_text())[1]
        self.packing = plan.pack(f"{specifications}/{packing}.toml", grains=grains)
        self.warm, self.cold = (plan.folder / f"{self.name}-{start}.h5" for start in ("warm", "cold"))

    def load(self, *arguments):
        """The state after the scene's own steps, with its impulses (warm) and without (cold)."""
        # by the paper's method, so that the problem does not change with every change of the acceleration
        command = [NSCDD, "run", self.path, "--packing", self.packing, "--method", "paper", *arguments, "--quiet"]
        call([*command, "--json", self.warm.with_suffix(".json"), "--state", self.warm], seconds=LONG)
        shutil.copy(self.warm, self.cold)
        clear_impulses(self.cold)

    def command(self, arguments, tolerance, json_file, start=None, velocity_error=ANY):
        command = [NSCDD, "run", self.path, "--packing", self.packing, "--from", start or self.cold, "--steps", 1, *arguments.split()]
        state = Path(json_file).with_suffix(".h5")
        return [*command, *asked(velocity_error), "--tolerance", f"{tolerance:g}", "--quiet", "--json", json_file, "--state", state]

    def export(self, start, tolerance, problem):
        """Writes the step from a state as an FCLIB problem; returns the command."""
        command = [NSCDD, "export-fclib", self.path, "--packing", self.packing, "--from", start, "--tolerance", tolerance, "-o", problem, "--quiet"]
        call(command, seconds=LONG)
        return command


def their_commands(problem, tolerance, solved, sweeps=Budget.sweeps, solver="NSGS", repeat=1, module="siconos_solve"):
    """What solves an exported problem by a solver of another code, and what measures the answer."""
    return (
        python(module, problem, "--solver", solver, "--tolerance", tolerance, "--max-iterations", sweeps, "--repeat", repeat, "-o", solved),
        [NSCDD, "solve-fclib", solved, "--solver", "none", "--json", Path(solved).with_suffix(".json")],
    )


def theirs(problem, tolerance, solved, budget=Budget(), solver="NSGS", repeat=1, module="siconos_solve"):
    """Iterations, CPU time, and our measures of the answer; None when out of time."""
    solve, judge = their_commands(problem, tolerance, solved, budget.sweeps, solver, repeat, module)
    try:
        answer = json.loads(call(solve, fine=(0,), seconds=budget.seconds).stdout.splitlines()[-1])
    except Failed:
        return None
    measures, residual = made(judge, judge[-1], seconds=budget.seconds)["measures"], answer["residual"]
    told = {"iterations": answer["iterations"], "sweeps": answer["iterations"], "cpu": answer["solver_cpu"], "cores": answer["cores"]}
    return told | {"eta": measures["eta"], "reached": residual, "converged": residual <= tolerance, "error": measures["natural_map"]}
