"""Table 1 and Figs. 1 to 4 of the paper at its full size, and beyond it: counted, simulated and measured.

--only takes items, such as table1,fig4: packings, fig1, table1 (fig2 is its picture), table1-windows (its windows alone), fig3, fig4, beyond, larger,
variations, interface, chance, choices. Each makes what it needs first:

    packings     13,000 disks, 55,000 loose and 64,000 jammed spheres by LAMMPS (cases/packings)
    starts       the two compressions under way: 100 steps of five times h, then 50, accelerated; the million spheres: the first 100 alone
    runs         whole runs of cases/paper in process by NLGS, CCS and DCS on several splittings: iterations are counted
    windows      100 iterations after the last step of NLGS on simulated machines (cases/platforms, costs included)
    larger       a million spheres, 16 copies of the jammed 64,000: 3 steps by NLGS and on 64 and 128 subdomains, and windows on the cluster
    interface    runs and windows that glue the grains which the broad phase predicts, as the paper does, and the same on the minimal interface
    chance       runs of disks from starts perturbed by 1e-9 of a radius: how much of a count is one draw
    choices      for each scene a variation of what the paper does not say, few steps
    measured     10 further steps, or 100 of disks, by NLGS and on two ranks with a core each, three times, the median

Each row of the record has the commit that made it. Where only some items are made, rows of others stay as they are in the record that is there.
Counted and simulated jobs run two at a time; measured ones run alone, so leave the machine to them.
"""
from pathlib import Path

from ... import record
from ...jobs import with_needs
from ...program import COSTS, PLATFORMS
from ...study import Study
from .items import ITEMS, PAPER, Asked
from .rows import agreement_row, commits_of, measured_row, merge, other_packings, packing_row, run_row, window_row


class Paper(Study):
    name, title, about = "paper", "The paper, table by table", "the paper's tables and figures at its full size, and beyond it"
    items = (*ITEMS, "fig2")
    tools = ("mpirun", "smpirun")

    def jobs(self, plan):
        plan.asked = Asked(plan)
        plan.asked.write_scenes()

    def choose(self, plan):
        items = ["table1" if item == "fig2" else item for item in plan.only.split(",")] if plan.only else ITEMS
        if unknown := [item for item in items if item not in ITEMS]:
            raise record.InputError(f"paper: --only {unknown[0]}: expected some of {', '.join(ITEMS)}")
        outputs = set().union(*(plan.asked.of_item[item] for item in items))
        return with_needs(plan.jobs, [job for job in plan.jobs if job.outputs[0] in outputs])

    def rows(self, plan):
        asked = plan.asked
        runs = [run_row(*row) for row in there(asked.runs)]
        if not runs and not asked.network.exists():
            return {}
        plain = [(row, told) for row, told in runs if row["scheme"] == "nlgs" and not row["variation"] and not row["perturbed"]]
        steps = {row["scene"]: told["start_step"] + told["steps"] for row, told in plain}
        rows = {
            "packings": [packing_row(asked.packing(scene), scene) for scene in PAPER if Path(asked.packing(scene)).exists()],
            "runs": [row for row, _ in runs],
            "agreement": [agreement_row(*row) for row in there(asked.compared)],
            "windows": [window_row(*row) | {"after_step": steps[row[1]["scene"]]} for row in there(asked.windows)],
            "measured": [measured_row(*row) for row in asked.measured if all(path.exists() for path in row[0])],
        }
        platform = {"name": "node48", "file": f"{PLATFORMS}/node48.xml", "costs_2d": COSTS[2], "costs_3d": COSTS[3]}
        return {"commits": commits_of(rows) or [self.provenance(plan)["commit"]], "platform": platform, **rows}

    def whole(self, plan, data):
        path = plan.results / "paper.json"
        earlier = record.read(path, "paper") if plan.only and path.exists() else data
        if earlier["quick"] != plan.quick or earlier is data:
            return data
        try:
            return merge(earlier, data)
        except ValueError as problem:
            raise record.InputError(f"paper: {path} cannot keep its other rows: {problem}; move it away, or give another --results") from None

    def told(self, data):
        yield from (f"paper: {line}" for line in other_packings(data["packings"]))
        if len(data["commits"]) > 1:
            yield f"paper: rows of {len(data['commits'])} commits: {', '.join(data['commits'])}"


def there(rows):
    return [row for row in rows if Path(row[0]).exists()]
