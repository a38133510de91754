"""How the method scales: packings, loaded states, costs, and a table each of `nscdd scale`. Measured on two ranks, simulated on more.

Tables of the node and of the cluster take the costs of cases/platforms/costs-*.json. Those of two cores are predictions that are measured as well.
Their costs are those of this machine on the state of the table; messages and clock of their platform are what build/bin/ping_pong tells.
Measured: whatever says so; everything else is simulated. A table that was interrupted goes on. RESULTS/scale-NAME.json are the tables.

Without --only these are node48-paper, node48-auto and those of two cores. --only . makes all: of a node at a third of the speed, of the share of its time
in MPI, of a cluster, and of weak scaling, some of which take hours.
"""
import re
import shutil
from pathlib import Path

from ... import record
from ...jobs import chosen
from ...page.default import rows_block
from ...program import COSTS, NSCDD, PLATFORMS, ROOT, call, checksum, python
from ...study import Study

TABLES = record.beside(__file__, "tables.toml")
USUAL = r"^(node48-(paper|auto)|two-cores-.*-.*)$"  # tables where --only says nothing
QUICK_GRAINS, QUICK_STEPS, QUICK_RANKS, QUICK_ITERATIONS = 300, 2, 4, 20


class Scaling(Study):
    name, title, about = "scaling", "Tables of nscdd scale", "how an iteration would scale on two cores, a node and a cluster"
    kinds, tools = ("counted", "simulated", "measured"), ("mpirun", "smpirun")

    def jobs(self, plan):
        for name, told in TABLES["tables"].items():
            on, platform, ranks = told["state"], told["platform"], told["ranks"]
            here, out = platform == "two-cores", plan.folder / f"{name}.json"
            packing, start, how = self.state(plan, on)
            costs, machine = COSTS[len(TABLES["states"][on]["tiles"])], f"{PLATFORMS}/{platform}.xml"
            if here:
                costs, machine = self.costs(plan, on, how), self.two_cores(plan)
            if plan.quick:
                ranks = sorted({min(n, QUICK_RANKS) for n in ranks})
            iterations = ["--iterations", QUICK_ITERATIONS if plan.quick else 200] if here or plan.quick else []
            begun = f"{out}.{checksum()}"  # which scale goes on with, if this program began it
            command = [NSCDD, "scale", *how, "--ranks", ",".join(map(str, ranks)), "--platform", machine, "--costs", costs, *told["options"].split()]
            commands, cost = [[*command, *iterations, "--json", begun], ["mv", begun, out]], 60 * sum(ranks) / 16
            # one by one: what is measured, and what takes gigabytes
            plan.add(name, [out], commands, needs=[packing, start, costs, machine], cost=cost, alone=platform != "node48")

    def choose(self, plan):
        return chosen(plan.jobs, plan.only or USUAL)

    def state(self, plan, name):
        """A packing, its state, and options that say both."""
        scene, grains, tiles, steps = (TABLES["states"][name][key] for key in ("scene", "grains", "tiles", "steps"))
        cases = TABLES["states"][name].get("cases", "reduced")
        if plan.quick:
            grains, steps = QUICK_GRAINS, QUICK_STEPS
        full = TABLES["states"][name].get("packing")
        packing = plan.pack(
            f"cases/packings/{full or (scene if cases == 'reduced' else f'{cases}-{scene}')}.toml",
            grains=0 if full and not plan.quick else grains,
            cost=grains / 500,
            generator="own" if plan.quick else (),
        )
        if max(tiles) > 1:
            one, packing = packing, plan.folder / "packings" / f"{name}.h5"
            copies = [2] * len(tiles) if plan.quick else tiles
            plan.add(f"packing {name}", [packing], [python("tiling", one, packing, *copies)], needs=[one])
        out, source = plan.folder / f"{name}.h5", [f"cases/{cases}/{scene}.toml", "--packing", packing]
        command = [NSCDD, "run", *source, "--steps", steps, "--method", "auto", "--state", out, "--quiet"]
        plan.add(f"state {name}", [out], [command], needs=[packing], cost=steps * grains / 5000)
        return packing, out, [*source, "--from", out]

    def costs(self, plan, on, how):
        """Of this machine on a state."""
        out, where = plan.folder / f"costs-{on}.json", ["--subdomains", "1,2,4,8,16,48", "--seconds", 0.005 if plan.quick else 0.15]
        return plan.add(f"costs {on}", [out], [[NSCDD, "calibrate", *how, *where, "-o", out]], needs=[how[-1]], cost=60, alone=True)

    def two_cores(self, plan):
        """The platform of that name, with the messages and the clock of this machine."""
        out = plan.folder / "two-cores.xml"

        def measure():
            told = call(["mpirun", "-np", 2, Path(NSCDD).with_name("ping_pong")]).stdout
            words = re.search("^platform: (.*)", told, re.M)[1].split()
            value, text = dict(zip(words[::2], words[1::2])), (ROOT / PLATFORMS / "two-cores.xml").read_text()
            places = {"bandwidth": 'bandwidth="', "latency": 'latency="', "call": '"call" value="', "shared": '"shared" value="'}
            for name, before in {**places, "clock": '"smpi/wtime" value="'}.items():
                text = re.sub(f'(?<={before})[^"]*', value[name], text, count=1)
            out.write_text(re.sub("<!--.*?-->", f"<!-- {told}-->", text, count=1, flags=re.S))
            shutil.copy(ROOT / PLATFORMS / "two-cores.hosts", out.with_suffix(".hosts"))

        return plan.add("two-cores platform", [out, out.with_suffix(".hosts")], work=measure, alone=True)

    def section(self, results, out):
        records = results.records("scale")
        rows = [row(one.path.stem.removeprefix("scale-"), point) for one in records for point in one["points"]]
        return [rows_block(self.title, rows, records, record.beside(__file__, "captions.toml")["rows"], ("simulated", "measured", "counted"))] if rows else []

    def rows(self, plan):
        rows = []
        for name in TABLES["tables"]:
            if (table := plan.folder / f"{name}.json").exists():
                if not plan.quick:
                    shutil.copyfile(table, plan.results / f"scale-{name}.json")
                rows += [row(name, point) for point in record.load(table)["points"]]
        return {"rows": rows} if rows else {}


def row(name, point):
    window, measured = point["windows"][0], point.get("measured")
    told = {"table": name, "scheme": point["scheme"], "ranks": point["ranks"], "iterations": sum(point["iterations"])}
    seconds = {"simulated": window["seconds_per_iteration"], "measured": measured and measured["seconds_per_iteration"]}
    return {**told, **seconds, "efficiency": window["efficiency"]}
