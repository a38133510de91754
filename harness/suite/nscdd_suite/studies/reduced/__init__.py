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
            self.add_run(plan, scene, packing, f"{scene} nlgs sequential", f"{scene}-nlgs", [], ["--scheme", "nlgs"], cost, True)
            # How far the reference is from itself: what the differences of whole runs have to be seen against.
            self.add_run(
                plan, scene, packing, f"{scene} nlgs at half the tolerance", f"{scene}-nlgs-half", [], ["--scheme", "nlgs", "--tolerance", "5e-5"], cost
            )
            for scheme in schemes:
                for n in ranks:
                    title = f"{scene} {scheme} {n} MPI rank{'s' * (n > 1)}"
                    self.add_run(plan, scene, packing, title, f"{scene}-{scheme}-mpi{n}", ["mpirun", "-np", n], ["--scheme", scheme], cost, True)
                for n in subdomains:  # checked at every iteration, so that counts are not multiples of the interval between checks
                    how = ["--scheme", scheme, "--subdomains", n, "--check-every", "1"]
                    self.add_run(plan, scene, packing, f"{scene} {scheme} {n} subdomain{'s' * (n > 1)}", f"{scene}-{scheme}-{n}", [], how, cost * (1 + n / 10))

    def add_run(self, plan, scene, packing, title, name, launcher, options, cost, alone=False):
        """The run, its comparison with the reference, and one step from the reference's last state, compared too."""
        stem, steps, reference = plan.folder / name, plan.folder / "steps", f"{scene}-nlgs"
        start = plan.folder / f"{reference}.h5"
        program = [*launcher, NSCDD, "run", f"cases/reduced/{scene}.toml", "--packing", packing, *options]
        few = ["--steps", 2] if plan.quick else []
        commands, outputs = [[*program, *few, "--json", f"{stem}.json", "--state", f"{stem}.h5"]], [f"{stem}.json", f"{stem}.h5"]
        compared = [(plan.folder / reference, stem, stem)]
        if not name.endswith("-half"):
            step = steps / name
            commands.append([*program, "--from", start, "--steps", 1, "--json", f"{step}.json", "--state", f"{step}.h5"])
            outputs += [f"{step}.json", f"{step}.h5"]
            compared.append((steps / reference, step, plan.folder / f"{name}-step"))
        needs = [packing]
        if name != reference:
            needs.append(start)
            for theirs, ours, table in compared:
                commands.append([NSCDD, "compare", f"{theirs}.json", f"{ours}.json", "--json", f"{table}.compare.json"])
                outputs.append(f"{table}.compare.json")
        plan.add(title, outputs, commands, needs=needs, cost=cost, alone=alone, fine=(0,))

    def rows(self, plan):
        runs = counted(plan.folder)
        return {"runs": runs} if runs else {}

    def provenance(self, plan):
        return record.provenance([record.load(path) for path in plan.folder.glob("*-nlgs.json")] or [super().provenance(plan)])


def counted(folder):
    """The counted numbers of the runs of a folder, {name of the run: {quantity: number}}."""
    runs = {}
    for path in sorted(Path(folder).glob("*.json")):
        told = record.load(path)
        if told.get("schema") == "nscdd.run/1" and path.stem != "probe":
            runs[path.stem] = {key: sum(told[key]) if isinstance(told[key], list) else told[key] for key in COUNTED if key in told}
    return runs
