"""How much memory a grain takes: packings of one, four and sixteen copies of the reduced ones, each stepped twice by NLGS."""
from .. import record
from ..program import NSCDD, python
from ..study import Study

TILES = {"biaxial": ((1, 1), (2, 2), (4, 4)), "triaxial": ((1, 1, 1), (2, 2, 1), (4, 2, 2))}
QUICK = 2  # of them


class Memory(Study):
    name, title, about = "memory", "Memory", "how much memory a grain and a contact take"
    kinds = ("counted", "measured")

    def jobs(self, plan):
        for scene, all_tiles in TILES.items():
            one = plan.pack(f"cases/packings/{scene}.toml", **({"grains": 300, "generator": "own"} if plan.quick else {}))
            for tiles in all_tiles[: QUICK if plan.quick else None]:
                out, packing = self.made(plan, scene, tiles), plan.folder / f"packings/{scene}-{'x'.join(map(str, tiles))}.h5"
                plan.add(f"packing {packing.stem}", [packing], [python("tiling", one, packing, *tiles)], needs=[one])
                command = [NSCDD, "run", f"cases/reduced/{scene}.toml", "--packing", packing, "--steps", 2, "--quiet", "--json", out]
                plan.add(out.stem, [out], [command], needs=[packing], cost=20)

    def made(self, plan, scene, tiles):
        return plan.folder / f"{scene}-{'x'.join(map(str, tiles))}.json"

    def rows(self, plan):
        rows = []
        for scene, all_tiles in TILES.items():
            runs = [record.load(path) for tiles in all_tiles if (path := self.made(plan, scene, tiles)).exists()]
            rows += [row(scene, run, runs[0]) for run in runs]
        return {"rows": rows} if rows else {}


def row(scene, run, least):
    """Memory of a run, and what each grain beyond those of the least run takes [bytes]."""
    memory, more = run["peak_memory"]["total"], run["grains"] - least["grains"]
    told = {"scene": scene, "grains": run["grains"], "contacts": run["contacts"][-1], "memory": memory, "converged": run["converged"]}
    return told | {"bytes_a_grain": (memory - least["peak_memory"]["total"]) / more if more else None, "command": run["command"]}
