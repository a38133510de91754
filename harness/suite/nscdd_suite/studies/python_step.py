"""What a step costs more from Python: steps of about 1,000 contacts, by the program, by one call, one by one, and with their arrays read after each."""
import json
import shutil
import statistics
import sys
import tempfile
import time
from pathlib import Path

from .. import record
from ..program import NSCDD, call, python
from ..study import Study
from ..times import LEAST_PAIRS, compared, cores_of

SCENE, PROGRAM = "cases/reduced/triaxial.toml", "the program"
GRAINS, STEPS, QUICK_STEPS = 450, 50, 3  # spheres that make about 1,000 contacts; steps of a measurement


def one_call(sim, steps):
    sim.run(steps)


def one_by_one(sim, steps):
    for _ in range(steps):
        sim.step()


def with_arrays(sim, steps):
    for _ in range(steps):
        sim.step()
        sim.positions[:, 2].max(), sim.velocities[:, 2].mean(), sim.contacts["normal_impulse"].sum()


HOWS = {"run(n)": one_call, "n times step()": one_by_one, "step(), and arrays read": with_arrays}


class PythonStep(Study):
    name, title, about = "python_step", "A step from Python", "what a step of 1,000 contacts costs more from Python"
    in_all = False  # asks for the module
    kinds = ("measured",)

    def jobs(self, plan):
        packing = plan.pack("cases/packings/triaxial.toml", grains=GRAINS, generator="own")
        steps, pairs = (QUICK_STEPS, 3) if plan.quick else (STEPS, LEAST_PAIRS)
        command = python("studies.python_step", packing, steps, pairs, self.out(plan))
        plan.add("steps", [self.out(plan)], [command], needs=[packing], cost=1 if plan.quick else 60, alone=True)

    def out(self, plan):
        return plan.folder / "steps.json"

    def rows(self, plan):
        return {"rows": json.loads(self.out(plan).read_text())["rows"]} if self.out(plan).exists() else {}


def by_program(packing, steps):
    """Seconds of the steps of a run of the program, and what it says of its load."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "run.json")
        call([NSCDD, "run", SCENE, "--packing", packing, "--scheme", "nlgs", "--steps", steps, "--quiet", "--json", out])
        run = record.load(out)
    return run["seconds"]["total"], cores_of(run)


def measure(packing, steps, pairs):
    """A row of each way of stepping, and the load, as a run has it. Each measurement begins with the same state."""
    sys.path.insert(0, str(Path(shutil.which(NSCDD)).resolve().parents[1] / "python"))  # of this build, else an installed one
    import nscdd

    seconds, cores = {how: [] for how in (PROGRAM, *HOWS)}, []
    for turn in range(pairs):
        for how in sorted(seconds, reverse=turn % 2):
            if how == PROGRAM:
                wall, share = by_program(packing, steps)
            else:
                sim = nscdd.read(SCENE, packing=packing)
                began, cpu = time.monotonic(), time.process_time()
                HOWS[how](sim, steps)
                wall = time.monotonic() - began
                share = (time.process_time() - cpu) / wall
            seconds[how].append(wall)
            cores.append(share)
    first, contacts = seconds[PROGRAM], len(sim.contacts)
    told = {"contacts": contacts, "steps": steps}
    rows = [{"how": how, **told, "seconds_a_step": statistics.median(each) / steps, **compared(first, each)} for how, each in seconds.items()]
    return {"rows": rows, "load": {"cores": {"least": min(cores)}, "believed": True}}


if __name__ == "__main__":
    packing, steps, pairs, out = sys.argv[1:]
    Path(out).write_text(json.dumps(measure(packing, int(steps), int(pairs))))
