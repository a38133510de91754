"""What each way to divide space costs: imbalance, interface, neighbours, messages, iterations and simulated time, on four scenes.

The reduced scenes of the paper and a column that collapses in a box half empty are run by grid, bisection and METIS, in process, to the tolerance of
the scene: by the paper's method and accelerated, and by sequential NLGS. Then an iteration after the last step of NLGS is simulated on the node of 48
cores, and efficiency is T(NLGS) / (N T_N) at equal error: with the iterations of the whole run. Nothing is timed.
"""
import itertools
from pathlib import Path

from ... import record
from ...program import COSTS, NSCDD, SIMULATED, simulated
from ...study import Study

SCENES = {
    "biaxial": ("cases/reduced/biaxial.toml", "biaxial", 2),
    "isotropic": ("cases/reduced/isotropic.toml", "isotropic", 3),
    "triaxial": ("cases/reduced/triaxial.toml", "triaxial", 3),
    "collapse": ("cases/partitions/collapse.toml", "triaxial", 3),
}  # packing, dimension
PARTITIONS, METHODS, SUBDOMAINS = ("grid", "bisection", "metis"), ("paper", "auto"), (8, 48)
QUICK_STEPS = 3


def points():
    """(scene, method, partition, subdomains), sequential ones first."""
    yield from ((scene, method, "none", 1) for scene, method in itertools.product(SCENES, METHODS))
    yield from itertools.product(SCENES, METHODS, PARTITIONS, SUBDOMAINS)


class Partitions(Study):
    name, title, about = "partitions", "Ways to divide space", "what grid, bisection and METIS cost"
    kinds, tools = ("counted", "simulated"), ("smpirun",)

    def jobs(self, plan):
        for scene, method, partition, n in points():
            case, packing, dimension = SCENES[scene]
            packing = plan.pack(f"cases/packings/{packing}.toml")
            out, start = self.stem(plan, scene, method, partition, n), f"{self.stem(plan, scene, method, 'none', 1)}.h5"
            source, few = [case, "--packing", packing], ["--steps", QUICK_STEPS] if plan.quick else []
            how = ["--scheme", "nlgs"] if n == 1 else ["--scheme", "dcs", "--partition", partition]
            how += ["--method", method, "--quiet", "--json"]
            run = [NSCDD, "run", *source, *how, f"{out}.json", *(["-n", n] if n > 1 else ["--state", start]), *few]
            window = [*simulated(n), SIMULATED, "window", *source, "--from", start, "--costs", COSTS[dimension], *how, f"{out}.window.json"]
            made, needs = [f"{out}.json", f"{out}.window.json"], [packing]
            (made if n == 1 else needs).append(start)
            plan.add(f"{scene} {method} {partition} {n}", made, [run, window], needs=needs, cost=dict(zip(SCENES, (2, 5, 8, 12)))[scene] + n / 8)

    def stem(self, plan, *point):
        return plan.folder / "-".join(map(str, point))

    def rows(self, plan):
        rows = [row(self.stem(plan, *point), *point) for point in points() if Path(f"{self.stem(plan, *point)}.window.json").exists()]
        nlgs = {(one["scene"], one["method"]): one for one in rows if one["subdomains"] == 1}
        for one, alone in ((one, alone) for one in rows if (alone := nlgs.get((one["scene"], one["method"])))):
            seconds, first = (each["simulated"]["seconds_per_iteration"] for each in (one, alone))
            one["iterations_over_nlgs"] = one["iterations"] / alone["iterations"]
            one["simulated"]["efficiency"] = first / (one["subdomains"] * seconds * one["iterations_over_nlgs"])
        return {"rows": rows} if rows else {}


def row(stem, scene, method, partition, n):
    run, window = record.load(f"{stem}.json"), record.load(f"{stem}.window.json")
    work = run["work_per_rank"]
    told = {"scene": scene, "method": method, "partition": partition, "subdomains": n}
    told |= {key: run[key] for key in ("grains", "steps", "unconverged_steps")}
    told |= {"iterations": sum(run["iterations"]), "imbalance": max(work) * len(work) / sum(work)}
    told |= {key: run[key] for key in ("interface_grains", "neighbours", "messages_per_iteration", "bytes_per_iteration", "command")}
    return told | {"simulated": {key: window[key] for key in ("seconds_per_iteration", "per_iteration", "command")}}
