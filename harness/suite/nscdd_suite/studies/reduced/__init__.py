"""The paper's scenes at a reduced size: packings, the sequential reference, NSCDD with CCS and DCS, agreement of each with the reference.

Each run is compared with the reference, and so is one step from the reference's last state. Runs whose times are reported have the machine alone; runs
in process, of which only counts are reported, go two at a time.
"""
from pathlib import Path

from ... import record
from ...program import NSCDD
from ...study import Study

# Scene: numbers of subdomains in process (counted) and over MPI (measured), schemes; seconds of one core, about, of a packing and of a run on one
# subdomain, of which each adds a tenth.
SCENES = {
    "network": ([4], [], ["dcs"], 0.1, 0.1),  # the small 2D picture of Fig. 1
    "biaxial": ([1, 2, 3, 4, 8, 16], [1, 2], ["ccs", "dcs"], 8, 1),
    "isotropic": ([1, 2, 3, 4, 8, 16], [1, 2], ["ccs", "dcs"], 3, 5),
    "triaxial": ([1, 2, 3, 4, 8, 16], [1, 2], ["ccs", "dcs"], 16, 9),
}
COUNTED = ("iterations", "contacts", "messages", "bytes", "work_per_rank", "answer")


class Reduced(Study):
    name, title, about = "reduced", "Runs and their agreement", "the paper's scenes at a reduced size, each run beside the reference"

    def jobs(self, plan):
        for scene, (subdomains, ranks, schemes, pack_cost, cost) in SCENES.items():
            packing = plan.pack(f"cases/packings/{scene}.toml", cost=pack_cost)

            def add(title, name, how, **more):
                self.add_run(plan, scene, packing, f"{scene} {title}", f"{scene}-{name}", how, **more)

            add("nlgs sequential", "nlgs", ["--scheme", "nlgs"], cost=cost, alone=True)
            # How far the reference is from itself: what the differences of whole runs have to be seen against.
            add("nlgs at half the tolerance", "nlgs-half", ["--scheme", "nlgs", "--tolerance", "5e-5"], cost=cost)
            for scheme in schemes:
                for n in ranks:
                    launcher, title = ["mpirun", "-np", n], f"{scheme} {n} MPI rank{'s' * (n > 1)}"
                    add(title, f"{scheme}-mpi{n}", ["--scheme", scheme], launcher=launcher, cost=cost, alone=True)
                for n in subdomains:  # checked at every iteration, so that counts are not multiples of the interval between checks
                    how = ["--scheme", scheme, "--subdomains", n, "--check-every", "1"]
                    add(f"{scheme} {n} subdomain{'s' * (n > 1)}", f"{scheme}-{n}", how, cost=cost * (1 + n / 10))

    def add_run(self, plan, scene, packing, title, name, how, launcher=(), **more):
        """The run, its comparison with the reference, and one step from the reference's last state, compared too."""
        reference, start = f"{scene}-nlgs", plan.folder / f"{scene}-nlgs.h5"
        program = [*launcher, NSCDD, "run", f"cases/reduced/{scene}.toml", "--packing", packing, *how]
        made = [(plan.folder, name, ["--steps", 2] if plan.quick else [])]
        if not name.endswith("-half"):
            made.append((plan.folder / "steps", f"{name}-step", ["--from", start, "--steps", 1]))
        commands, outputs = [], []
        for folder, _, steps in made:
            files = [f"{folder / name}.json", f"{folder / name}.h5"]
            commands.append([*program, *steps, "--json", files[0], "--state", files[1]])
            outputs += files
        for folder, table, _ in made if name != reference else ():
            outputs.append(f"{plan.folder / table}.compare.json")
            commands.append([NSCDD, "compare", f"{folder / reference}.json", f"{folder / name}.json", "--json", outputs[-1]])
        plan.add(title, outputs, commands, needs=[packing, *([start] if name != reference else [])], fine=(0,), **more)

    def rows(self, plan):
        runs = counted(plan.folder)
        return {"runs": runs} if runs else {}


def counted(folder):
    """The counted numbers of the runs of a folder, {name of the run: {quantity: number}}."""
    runs = {}
    for path in sorted(Path(folder).glob("*.json")):
        told = record.load(path)
        if told.get("schema") == "nscdd.run/1" and path.stem != "probe":
            runs[path.stem] = {key: sum(told[key]) if isinstance(told[key], list) else told[key] for key in COUNTED if key in told}
    return runs
