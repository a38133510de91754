"""All that may be asked for of the paper, item by item: scenes, splittings, variations, and the job of each."""
import itertools
import math
import re
from pathlib import Path
from typing import NamedTuple

from ...program import COMPARED, COSTS, NSCDD, ROOT, SIMULATED, python, shown, simulated
from ...record import beside

ITEMS = ("packings", "fig1", "table1", "table1-windows", "fig3", "fig4", "beyond", "larger", "variations", "interface", "chance", "choices")
SCENES, VARIATIONS = beside(__file__, "scenes.toml").values()
PAPER = tuple(SCENES)[:3]  # with a packing and a file of their own; a million spheres are the triaxial test again
MEASURED = {"table1": "isotropic", "fig3": "biaxial", "fig4": "triaxial"}
TILES, LARGER_STEPS = (4, 2, 2), 3
STARTS = 5  # perturbed ones
QUICK = {"grains": 400, "steps": 3}
RUNS = Path(__file__).with_name("runs.txt").read_text().splitlines()[3:]


class What(NamedTuple):
    """What is run: its fields tell a row of the record from others."""

    scene: str
    method: str
    scheme: str
    partition: str = "none"
    subdomains: int = 1
    multiplicity: str = "minimal"

    def row(self, **more):
        return self._asdict() | more

    def label(self):
        wide = [self.multiplicity] if self.multiplicity != "minimal" else []
        cut = [self.partition.replace(" ", "-"), str(self.subdomains), *wide] if self.subdomains > 1 else []
        return "-".join([self.scene, self.method, self.scheme, *cut])

    def dealt(self):
        """Options of the program that say who owns what."""
        if self.partition == "none":
            return []
        kind, _, cells = self.partition.partition(" ")
        wide = ["--multiplicity", self.multiplicity] if self.multiplicity != "minimal" else []
        return ["--partition", kind, *(["--grid", cells] if cells else []), *wide]

    def how(self):
        """Options of a run in process."""
        return ["--scheme", self.scheme, "--method", self.method, *self.dealt(), *(["-n", self.subdomains] if self.subdomains > 1 else [])]


def splitting(word):
    """Partition, subdomains, and multiplicity if not minimal."""
    kind, _, more = word.partition("-")
    if "x" in kind:
        return f"grid {kind}", math.prod(map(int, kind.split("x"))), *([more] if more else [])
    return kind, int(more or 1)


def table_of_runs():
    """(item, what is run, platform of its window or -)"""
    for line in RUNS:
        item, scene, method, scheme, platform, *words = line.split()
        yield from ((item, What(scene, method, scheme, *splitting(word)), platform) for word in words)


def slug(text):
    return re.sub(r"[^\w.]+", "-", text)


class Asked:
    """Adds all jobs to a plan, each once, and knows which are of which item, and the rows that they make."""

    def __init__(self, plan):
        self.plan, self.folder, self.quick, self.of_item = plan, plan.folder, plan.quick, {item: set() for item in ITEMS}
        self.runs, self.windows, self.measured, self.compared, self.starts = [], [], [], [], {}
        self.network = self.folder / "fig1-network.json"
        self.add_runs()
        self.add_fig1()
        self.add_variations()
        self.add_perturbed()
        self.add_measured()

    def add(self, item, title, outputs, commands, **more):
        key = str(self.plan.add(title, outputs, commands, **more))
        if item:
            self.of_item[item].add(key)
        return key

    def scene(self, name):
        return self.folder / "scenes" / f"{name}.toml"

    def nlgs(self, scene, method="paper"):
        """The last state of its run by NLGS."""
        return str(self.folder / f"runs/{What(scene, method, 'nlgs').label()}.h5")

    def steps(self, n):
        return QUICK["steps"] if self.quick else n

    def packing(self, scene):
        name = SCENES[scene]["packing"]
        output = self.folder / f"packings/{name}.h5"
        if scene not in PAPER:
            source = self.packing("triaxial")
            return self.add("", f"packing {name}", [output], [python("tiling", source, output, *TILES)], needs=[source], cost=10)
        few = {"grains": QUICK["grains"], "generator": "own"} if self.quick else {}
        key = str(self.plan.pack(f"cases/packings/{name}.toml", output, cost={2: 25, 3: 120}[SCENES[scene]["dimension"]], **few))
        self.of_item["packings"].add(key)
        return key

    def source(self, scene, item):
        """Options that say where a whole run starts, and the files that it needs."""
        packing = self.packing(scene)
        if not SCENES[scene]["under_way"]:
            return ["--packing", packing], [packing]
        coarse, start = (self.folder / f"starts/{scene}{kind}.h5" for kind in ("-coarse", ""))
        begin = [NSCDD, "run", "--method", "auto", "--quiet"]
        commands = [
            [*begin, self.scene(f"{scene}-coarse"), "--packing", packing, "--steps", self.steps(100), "--state", coarse],
            [*begin, self.scene(scene), "--packing", packing, "--from", coarse, "--steps", self.steps(50), "--state", start],
        ]
        made = [start, coarse]
        if scene not in PAPER:  # a step of some thousand iterations follows soon, of a tenth of a second each
            commands, start, made = commands[:1], coarse, [coarse]
        self.add(item, f"start of {scene}", made, commands, needs=[packing], cost=SCENES[scene]["seconds"], fine=(0,))
        self.starts[scene] = [shown(command) for command in commands]
        return ["--packing", packing, "--from", start], [packing, start]

    def add_runs(self):
        for item, what, platform in table_of_runs():
            n = what.subdomains
            if self.quick and n > 8:
                continue
            self.add_run(item, what)
            if 1 < n <= 48 and (what.partition.startswith("grid") or what.method == "auto") and platform != "-":
                self.add_agreement(item, what)
            for slower in (1, 3) if item == "table1" else (1,) if platform != "-" else ():
                self.add_window(item, what, platform, slower)
        bands = ((2, 1, 0), (0.5, 1, 0), (1, 2, 0), (1, 0.5, 0), (1, 1, 0.05))
        for scene, band in itertools.product(("biaxial", "triaxial"), () if self.quick else bands):
            self.add_window("beyond", What(scene, "paper", "dcs", *splitting(SCENES[scene]["grid"])), "node48", 1, *band)

    def once(self, rows, key, *what):
        """Adds a row to be collected; a splitting may be asked for by several items."""
        if all(key != row[0] for row in rows):
            rows.append((key, *what))

    def add_run(self, item, what):
        source, needs = self.source(what.scene, item)
        out, seconds = self.folder / f"runs/{what.label()}", SCENES[what.scene]["seconds"] * (0.6 if what.method == "auto" else 1) * (1 + what.subdomains / 100)
        made = {"--json": f"{out}.json"}
        if what.scheme == "nlgs":
            made |= {"--state": f"{out}.h5", "--series": f"{out}.csv"}
        if what == What("isotropic", what.method, "dcs", "grid 2x2x2", 8):
            made |= {"--state": self.folder / "isotropic-dcs-grid-2x2x2.h5"}  # for the picture
        command = [NSCDD, "run", self.scene(what.scene), *source, *what.how(), "--quiet", *itertools.chain(*made.items())]
        key = self.add(item, " ".join(map(str, what)), list(made.values()), [command], needs=needs, cost=seconds)
        self.once(self.runs, key, what.row(variation="", perturbed=0), self.starts.get(what.scene, ()))

    def add_agreement(self, item, what):
        """One step from NLGS' last state, against that of NLGS."""
        alone, nlgs = What(what.scene, what.method, "nlgs"), self.nlgs(what.scene, what.method)
        reference, ours = (str(self.folder / f"steps/{one.label()}") for one in (alone, what))

        def step(how, stem):
            one = [NSCDD, "run", self.scene(what.scene), "--packing", self.packing(what.scene), "--from", nlgs, "--steps", 1, "--quiet"]
            return [*one, *how.how(), "--json", f"{stem}.json", "--state", f"{stem}.h5"]

        files = [f"{reference}.json", f"{reference}.h5"]
        needed = self.add(item, f"step {alone.label()}", files, [step(alone, reference)], needs=[nlgs], cost=3, fine=(0,))
        files = [f"{ours}.compare.json", f"{ours}.json", f"{ours}.h5"]
        commands = [step(what, ours), [NSCDD, "compare", f"{reference}.json", f"{ours}.json", "--json", files[0]]]
        key = self.add(item, f"step {what.label()}", files, commands, needs=[nlgs, needed], cost=4, fine=COMPARED)
        self.once(self.compared, key, what.row())

    def add_window(self, item, what, platform, slower, latency=1, bandwidth=1, noise=0):
        scene, n, nlgs = what.scene, what.subdomains, self.nlgs(what.scene)
        name = f"{what.label()}-{platform}-{slower}-{latency}-{bandwidth}-{noise}"
        out = self.folder / f"windows/{name}.json"
        # an iteration of 512 simulated ranks takes a second of this machine
        few = ["--skip", 10, "--iterations", 20 if self.quick else 50 if n <= 128 else 10] if n > 48 or self.quick else []
        command = [*simulated(n, platform, latency, bandwidth), SIMULATED, "window", self.scene(scene), "--packing", self.packing(scene)]
        command += ["--from", nlgs, "--scheme", what.scheme, "--method", what.method, *what.dealt(), *few]
        command += ["--costs", COSTS[SCENES[scene]["dimension"]], "--slower", slower, "--noise", noise, "--latency", latency, "--bandwidth", bandwidth]
        cost = 2 + n / 10 + n * n / 7000
        key = self.add(item, f"simulated {name}", [out], [[*command, "--quiet", "--json", out]], needs=[nlgs], cost=cost)
        if item == "table1":
            self.of_item["table1-windows"].add(key)
        self.once(self.windows, key, what.row(platform=platform, slower=slower, latency=latency, bandwidth=bandwidth, noise=noise))

    def add_fig1(self):
        packing, state = self.folder / "packings/network.h5", self.network.with_suffix(".h5")
        self.of_item["fig1"].add(str(self.plan.pack("cases/packings/network.toml", packing, cost=1)))
        # Eight steps after a broad phase: its predictions have had time to be wrong.
        command = [NSCDD, "run", "cases/reduced/network.toml", "--packing", packing, "--scheme", "dcs", "--grid", "2x2", "-n", 4, "--steps", 9]
        self.add("fig1", "fig1 network", [state, self.network], [[*command, "--quiet", "--json", self.network, "--state", state]], needs=[packing])

    def add_variations(self):
        for name, told in VARIATIONS.items():
            scene, item, where = name.partition(",")[0], told["item"], told.get("from")
            source, needs = self.source(scene, item)
            starts = self.starts.get(scene, ()) if not where else ()
            if where == "end":
                needs = [self.packing(scene), self.nlgs(scene)]
                source = ["--packing", needs[0], "--from", needs[1]]
            elif where:
                source, needs = source[:2], needs[:1]
            grid = self.quick and SCENES[scene].get("quick_grid") or SCENES[scene]["grid"]
            for what in (What(scene, "paper", "nlgs"), What(scene, "paper", "dcs", *splitting(grid))):
                n = what.subdomains
                if item == "choices" and (n == 1 or not where and not self.quick):
                    self.add_run(item, what)  # what it is compared with, or starts from
                out = self.folder / f"variations/{slug(name)}-{n}.json"
                few = ["--steps", self.steps(told["steps"])] if "steps" in told else []
                cost = 30 if where == "end" else SCENES[scene]["seconds"] * told.get("times", 1)
                command = [NSCDD, "run", self.scene(slug(name)), *source, *what.how(), *few, "--quiet", "--json", out]
                key = self.add(item, f"variation {name}, {n}", [out], [command], needs=needs, cost=cost)
                self.runs.append((key, what.row(variation=name.partition(", ")[2], perturbed=0), starts))

    def add_perturbed(self):
        """Runs of disks from other draws of the same start."""
        source, needs = self.source("biaxial", "chance")
        splittings = [("nlgs",), *(("dcs", *splitting(grid)) for grid in ("2x2", "2x4", "8x1", *([] if self.quick else ["4x12"])))]
        for seed in range(1, (2 if self.quick else STARTS) + 1):
            start = self.folder / f"starts/biaxial-perturbed-{seed}.h5"
            make = python("perturbed", needs[1], seed, start)
            self.add("chance", f"perturbed start {seed}", [start], [make], needs=needs)
            for what in (What("biaxial", "paper", *cut) for cut in splittings):
                out = self.folder / f"chance/{what.scheme}-{slug(what.partition)}-{seed}.json"
                command = [NSCDD, "run", self.scene("biaxial"), *source[:2], "--from", start, *what.how(), "--quiet", "--json", out]
                title = f"biaxial {what.scheme} {what.partition}, perturbed start {seed}"
                key = self.add("chance", title, [out], [command], needs=[needs[0], start], cost=4)
                self.runs.append((key, what.row(variation="", perturbed=seed), [*self.starts["biaxial"], f"PYTHONPATH=harness/suite {shown(make)}"]))

    def add_measured(self):
        """Alternately, three times. The last state of NLGS is where they start."""
        for item, scene in MEASURED.items():
            cut = splitting("2x1" if scene == "biaxial" else "2x1x1")
            outs, commands = {What(scene, "paper", *how): [] for how in (("nlgs",), ("dcs", *cut), ("ccs", *cut))}, []
            for repeat, what in itertools.product(range(3), outs):
                n = what.subdomains
                outs[what].append(self.folder / f"measured/{scene}-{what.scheme}-{n}-{repeat}.json")
                command = [*(["mpirun", "-np", n] if n > 1 else []), NSCDD, "run", self.scene(scene), "--packing", self.packing(scene)]
                command += ["--from", self.nlgs(scene), "--method", "paper", "--scheme", what.scheme, *what.dealt()]
                commands.append([*command, "--steps", self.steps(SCENES[scene]["measured"]), "--quiet", "--json", outs[what][-1]])
            files, cost = list(itertools.chain(*outs.values())), {2: 30, 3: 60}[SCENES[scene]["dimension"]]
            self.add(item, f"measured {scene}", files, commands, needs=[self.nlgs(scene)], cost=cost, alone=True)
            self.measured += [(made, scene, *what[2:5]) for what, made in outs.items()]

    def write_scenes(self):
        """Scenes as the runs see them: those of cases/, or fewer steps."""
        self.scene("").parent.mkdir(parents=True, exist_ok=True)
        for scene in PAPER:
            text = Path(ROOT, f"cases/paper/{scene}.toml").read_text()
            if self.quick:
                text = re.sub(r"count = \d+", f"count = {QUICK['steps']}", text)
            self.scene(scene).write_text(text)
            self.scene(f"{scene}-coarse").write_text(text.replace("h = 0.02", "h = 0.1"))
        for kind in ("", "-coarse"):
            text = re.sub(r"count = \d+", f"count = {self.steps(LARGER_STEPS)}", self.scene(f"triaxial{kind}").read_text())
            self.scene(f"million{kind}").write_text(text.replace('name = "triaxial"', 'name = "million"'))
        for name, told in VARIATIONS.items():
            text = self.scene(name.partition(",")[0]).read_text()
            assert "old" not in told or text.count(told["old"]) == 1, name
            self.scene(slug(name)).write_text(text.replace(told["old"], told["new"]) if "old" in told else text)
