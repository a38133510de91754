"""All that may be asked for of the paper, item by item: scenes, splittings, variations, and the job of each."""
import re
from pathlib import Path

from ...program import COSTS, NSCDD, ROOT, SIMULATED, python, shown, simulated

ITEMS = ("packings", "fig1", "table1", "table1-windows", "fig3", "fig4", "beyond", "larger", "variations", "interface", "chance", "choices")

# Scene: packing, dimension, whether it starts under way, seconds of a run, about, steps that are measured.
SCENES = {
    "isotropic": ("isotropic-55k", 3, False, 480, 10),
    "biaxial": ("biaxial-13k", 2, True, 4, 100),
    "triaxial": ("triaxial-64k", 3, True, 60, 10),
    "million": ("million", 3, True, 3600, 0),
}
PAPER = ("isotropic", "biaxial", "triaxial")  # with a packing and a file of their own; a million spheres are the triaxial test again
MEASURED = {"table1": "isotropic", "fig3": "biaxial", "fig4": "triaxial"}
TILES, LARGER_STEPS = (4, 2, 2), 3
LARGEST = {"isotropic": ("grid 2x2x2", 8), "biaxial": ("grid 4x12", 48), "triaxial": ("grid 4x4x3", 48)}  # splittings of variations
# What a variation changes in the scene, and of which runs. Not the triaxial test with friction 0.5: neither of its runs ends within 20 minutes.
# From where: "" as the scene, or its packing, or the last state of NLGS; steps, 0: as the scene. For each start but that of the scene there is
# a run of the scene as it is.
VARIATIONS = {
    "biaxial, h x 5": ("variations", "biaxial", "h = 0.02", "h = 0.1", "", 0),
    "biaxial, friction 0.5": ("variations", "biaxial", "friction = 0.3", "friction = 0.5", "", 0),
    "biaxial, eta 1e-5": ("variations", "biaxial", "tolerance = 1e-4", "tolerance = 1e-5", "", 20),  # takes 60 times the iterations
    "triaxial, h x 5": ("variations", "triaxial", "h = 0.02", "h = 0.1", "", 0),
    "isotropic, as it is, from the last state": ("choices", "isotropic", "", "", "end", 20),
    "isotropic, h x 2, from the last state": ("choices", "isotropic", "h = 0.02", "h = 0.04", "end", 20),
    "biaxial, top 5 times as fast": ("choices", "biaxial", "velocity = [0, -0.02]", "velocity = [0, -0.1]", "", 0),
    "biaxial, from the packing": ("choices", "biaxial", "", "", "packing", 0),
    "triaxial, top 5 times as fast": ("choices", "triaxial", "velocity = [0, 0, -0.01]", "velocity = [0, 0, -0.05]", "", 25),
    "triaxial, from the packing": ("choices", "triaxial", "", "", "packing", 25),
}
STARTS = 5  # perturbed ones
QUICK = {"grains": 400, "steps": 3}


def table_of_runs():
    """(item, scene, method, scheme, partition, subdomains, platform of its window or "", and multiplicity if not minimal)"""
    for item, scene in MEASURED.items():
        yield item, scene, "paper", "nlgs", "none", 1, "node48"
    for scheme in ("ccs", "dcs"):
        for n, grid in ((3, "3x1x1"), (4, "2x2x1"), (8, "2x2x2")):
            yield "table1", "isotropic", "paper", scheme, f"grid {grid}", n, "node48"
        for n, grid in ((2, "1x2"), (4, "2x2"), (8, "2x4"), (16, "4x4"), (24, "3x8"), (32, "4x8"), (48, "4x12")):
            yield "fig3", "biaxial", "paper", scheme, f"grid {grid}", n, "node48"
    others = ((2, "2x1"), (4, "4x1"), (4, "1x4"), (8, "8x1"), (8, "1x8"), (16, "2x8"), (16, "16x1"), (16, "1x16"), (48, "6x8"), (48, "48x1"), (48, "1x48"))
    for n, grid in others:
        yield "fig3", "biaxial", "paper", "dcs", f"grid {grid}", n, ""
    for n, grid in ((2, "2x1x1"), (4, "2x2x1"), (8, "2x2x2"), (16, "4x2x2"), (24, "4x3x2"), (32, "4x4x2"), (48, "4x4x3")):
        yield "fig4", "triaxial", "paper", "dcs", f"grid {grid}", n, "node48"
    for n, grid in ((2, "2x1x1"), (8, "2x2x2"), (48, "4x4x3")):
        yield "fig4", "triaxial", "paper", "ccs", f"grid {grid}", n, "node48"
    for n, grid in ((2, "1x1x2"), (8, "8x1x1"), (8, "1x1x8")):
        yield "fig4", "triaxial", "paper", "dcs", f"grid {grid}", n, ""
    for scene, grids in (("biaxial", ("2x4", "4x12")), ("triaxial", ("2x2x2", "4x4x3"))):
        for partition in ("bisection", "metis"):
            for n in (8, 48):
                yield "beyond", scene, "paper", "dcs", partition, n, "node48"
        yield "beyond", scene, "auto", "nlgs", "none", 1, "node48"
        for n, grid in zip((8, 48), grids):
            yield "beyond", scene, "auto", "dcs", f"grid {grid}", n, "node48"
    for method in ("paper", "auto"):
        for n in (64, 128, 256, 512, 1024):
            yield "beyond", "triaxial", method, "dcs", "bisection", n, "cluster"
    yield "larger", "million", "paper", "nlgs", "none", 1, "node48"
    for n in (64, 128):
        yield "larger", "million", "paper", "dcs", "bisection", n, "cluster"
    for scene, n, grid in (("isotropic", 8, "2x2x2"), ("biaxial", 8, "2x4"), ("biaxial", 48, "4x12"), ("triaxial", 8, "2x2x2"), ("triaxial", 48, "4x4x3")):
        yield "interface", scene, "paper", "nlgs", "none", 1, "node48"
        for multiplicity in ("minimal", "predicted"):
            yield "interface", scene, "paper", "dcs", f"grid {grid}", n, "node48", multiplicity


def identity(scene, method, scheme, partition, n, multiplicity="minimal", **more):
    """Of a row of the record."""
    return {"scene": scene, "method": method, "scheme": scheme, "partition": partition, "subdomains": n, "multiplicity": multiplicity, **more}


def label(scene, method, scheme, partition, n, multiplicity="minimal"):
    cut = [partition.replace(" ", "-"), str(n), *([multiplicity] if multiplicity != "minimal" else [])] if n > 1 else []
    return "-".join([scene, method, scheme, *cut])


def dealt(partition, multiplicity="minimal"):
    """Options of the program."""
    if partition == "none":
        return []
    kind, _, cells = partition.partition(" ")
    return ["--partition", kind, *(["--grid", cells] if cells else []), *(["--multiplicity", multiplicity] if multiplicity != "minimal" else [])]


def how(method, scheme, partition, n, multiplicity="minimal"):
    """Options of a run in process."""
    return ["--scheme", scheme, "--method", method, *dealt(partition, multiplicity), *(["-n", n] if n > 1 else [])]


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

    def nlgs(self, scene):
        """The last state of its run by NLGS."""
        return str(self.folder / f"runs/{label(scene, 'paper', 'nlgs', 'none', 1)}.h5")

    def packing(self, scene):
        name = SCENES[scene][0]
        output = self.folder / f"packings/{name}.h5"
        if scene not in PAPER:
            source = self.packing("triaxial")
            return self.add("", f"packing {name}", [output], [python("tiling", source, output, *TILES)], needs=[source], cost=10)
        few = {"grains": QUICK["grains"], "generator": "own"} if self.quick else {}
        key = str(self.plan.pack(f"cases/packings/{name}.toml", output, cost={2: 25, 3: 120}[SCENES[scene][1]], **few))
        self.of_item["packings"].add(key)
        return key

    def source(self, scene, item):
        """Options that say where a whole run starts, and the files that it needs."""
        packing = self.packing(scene)
        if not SCENES[scene][2]:
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
        self.add(item, f"start of {scene}", made, commands, needs=[packing], cost=SCENES[scene][3], fine=(0,))
        self.starts[scene] = [shown(command) for command in commands]
        return ["--packing", packing, "--from", start], [packing, start]

    def steps(self, n):
        return QUICK["steps"] if self.quick else n

    def add_runs(self):
        for item, scene, method, scheme, partition, n, platform, *multiplicity in table_of_runs():
            if self.quick and n > 8:
                continue
            what = scene, method, scheme, partition, n, *multiplicity
            self.add_run(item, *what)
            if n > 1 and n <= 48 and (partition.startswith("grid") or method == "auto") and platform:
                self.add_agreement(item, *what)
            for slower in (1, 3) if item == "table1" else (1,) if platform else ():
                self.add_window(item, what, platform, slower)
        for scene in ("biaxial", "triaxial"):
            if not self.quick:
                for latency, bandwidth, noise in ((2, 1, 0), (0.5, 1, 0), (1, 2, 0), (1, 0.5, 0), (1, 1, 0.05)):
                    self.add_window("beyond", (scene, "paper", "dcs", *LARGEST[scene]), "node48", 1, latency, bandwidth, noise)

    def once(self, rows, key, *what):
        """Adds a row to be collected; a splitting may be asked for by several items."""
        if all(key != row[0] for row in rows):
            rows.append((key, *what))

    def add_run(self, item, scene, method, scheme, partition, n, multiplicity="minimal"):
        what = scene, method, scheme, partition, n, multiplicity
        source, needs = self.source(scene, item)
        out, seconds = self.folder / f"runs/{label(*what)}", SCENES[scene][3] * (0.6 if method == "auto" else 1) * (1 + n / 100)
        made = {"--json": f"{out}.json"}
        if scheme == "nlgs":
            made |= {"--state": f"{out}.h5", "--series": f"{out}.csv"}
        if (scene, scheme, partition, multiplicity) == ("isotropic", "dcs", "grid 2x2x2", "minimal"):
            made |= {"--state": self.folder / "isotropic-dcs-grid-2x2x2.h5"}  # for the picture
        command = [NSCDD, "run", self.scene(scene), *source, *how(*what[1:]), "--quiet", *(word for pair in made.items() for word in pair)]
        key = self.add(item, " ".join(map(str, what)), list(made.values()), [command], needs=needs, cost=seconds)
        self.once(self.runs, key, identity(*what, variation="", perturbed=0), self.starts.get(scene, ()))

    def add_agreement(self, item, scene, method, scheme, partition, n, multiplicity="minimal"):
        """One step from NLGS' last state, against that of NLGS."""
        what = scene, method, scheme, partition, n, multiplicity
        alone = label(scene, method, "nlgs", "none", 1)
        nlgs = self.folder / f"runs/{alone}.h5"
        one = [NSCDD, "run", self.scene(scene), "--packing", self.packing(scene), "--from", nlgs, "--steps", 1, "--quiet"]
        reference, ours = (self.folder / f"steps/{stem}" for stem in (alone, label(*what)))
        files, compared = {stem: [f"{stem}.json", f"{stem}.h5"] for stem in (reference, ours)}, f"{ours}.compare.json"
        command = [*one, "--scheme", "nlgs", "--method", method, "--json", f"{reference}.json", "--state", f"{reference}.h5"]
        needed = self.add(item, f"step {alone}", files[reference], [command], needs=[nlgs], cost=3, fine=(0,))
        commands = [
            [*one, *how(*what[1:]), "--json", f"{ours}.json", "--state", f"{ours}.h5"],
            [NSCDD, "compare", f"{reference}.json", f"{ours}.json", "--json", compared],
        ]
        key = self.add(item, f"step {ours.name}", [compared, *files[ours]], commands, needs=[nlgs, needed], cost=4, fine=(0, 2))
        self.once(self.compared, key, identity(*what))

    def add_window(self, item, what, platform, slower, latency=1, bandwidth=1, noise=0):
        scene, method, scheme, partition, n, *multiplicity = what
        name = f"{label(*what)}-{platform}-{slower}-{latency}-{bandwidth}-{noise}"
        out = self.folder / f"windows/{name}.json"
        # an iteration of 512 simulated ranks takes a second of this machine
        few = ["--skip", 10, "--iterations", 20 if self.quick else 50 if n <= 128 else 10] if n > 48 or self.quick else []
        command = [*simulated(n, platform, latency, bandwidth), SIMULATED, "window", self.scene(scene), "--packing", self.packing(scene)]
        command += ["--from", self.nlgs(scene), "--scheme", scheme, "--method", method, *dealt(partition, *multiplicity), *few]
        command += ["--costs", COSTS[SCENES[scene][1]], "--slower", slower, "--noise", noise, "--latency", latency, "--bandwidth", bandwidth]
        cost = 2 + n / 10 + n * n / 7000
        key = self.add(item, f"simulated {name}", [out], [[*command, "--quiet", "--json", out]], needs=[self.nlgs(scene)], cost=cost)
        if item == "table1":
            self.of_item["table1-windows"].add(key)
        self.once(self.windows, key, identity(*what, platform=platform, slower=slower, latency=latency, bandwidth=bandwidth, noise=noise))

    def add_fig1(self):
        packing, state = self.folder / "packings/network.h5", self.network.with_suffix(".h5")
        self.of_item["fig1"].add(str(self.plan.pack("cases/packings/network.toml", packing, cost=1)))
        # Eight steps after a broad phase: its predictions have had time to be wrong.
        command = [NSCDD, "run", "cases/reduced/network.toml", "--packing", packing, "--scheme", "dcs", "--grid", "2x2", "-n", 4, "--steps", 9]
        self.add("fig1", "fig1 network", [state, self.network], [[*command, "--quiet", "--json", self.network, "--state", state]], needs=[packing])

    def add_variations(self):
        for name, (item, scene, _, _, where, steps) in VARIATIONS.items():
            source, needs = self.source(scene, item)
            starts = self.starts.get(scene, ()) if not where else ()
            if where == "end":
                needs = [self.packing(scene), self.nlgs(scene)]
                source = ["--packing", needs[0], "--from", needs[1]]
            elif where:
                source, needs = source[:2], needs[:1]
            grid, most = LARGEST[scene]
            for n, partition in ((1, "none"), (most, grid)):
                if self.quick and n > 8:
                    n, partition = 4, "grid " + {"biaxial": "2x2", "triaxial": "2x2x1"}[scene]
                what = scene, "paper", "dcs" if n > 1 else "nlgs", partition, n
                if item == "choices" and (n == 1 or not where and not self.quick):
                    self.add_run(item, *what)  # what it is compared with, or starts from
                out = self.folder / f"variations/{slug(name)}-{n}.json"
                few = ["--steps", self.steps(steps)] if steps else []
                cost = 30 if where == "end" else SCENES[scene][3] * (10 if "1e-5" in name else 1)
                command = [NSCDD, "run", self.scene(slug(name)), *source, *how(*what[1:]), *few, "--quiet", "--json", out]
                key = self.add(item, f"variation {name}, {n}", [out], [command], needs=needs, cost=cost)
                self.runs.append((key, identity(*what, variation=name.partition(", ")[2], perturbed=0), starts))

    def add_perturbed(self):
        """Runs of disks from other draws of the same start."""
        source, needs = self.source("biaxial", "chance")
        splittings = [("nlgs", "none", 1), *(("dcs", f"grid {grid}", n) for n, grid in ((4, "2x2"), (8, "2x4"), (8, "8x1"), (48, "4x12")))]
        for seed in range(1, (2 if self.quick else STARTS) + 1):
            start = self.folder / f"starts/biaxial-perturbed-{seed}.h5"
            make = python("perturbed", needs[1], seed, start)
            self.add("chance", f"perturbed start {seed}", [start], [make], needs=needs)
            for scheme, partition, n in splittings:
                if self.quick and n > 8:
                    continue
                what, out = ("biaxial", "paper", scheme, partition, n), self.folder / f"chance/{scheme}-{slug(partition)}-{seed}.json"
                command = [NSCDD, "run", self.scene("biaxial"), *source[:2], "--from", start, *how(*what[1:]), "--quiet", "--json", out]
                key = self.add("chance", f"biaxial {scheme} {partition}, perturbed start {seed}", [out], [command], needs=[needs[0], start], cost=4)
                self.runs.append((key, identity(*what, variation="", perturbed=seed), [*self.starts["biaxial"], f"PYTHONPATH=harness/suite {shown(make)}"]))

    def add_measured(self):
        """Alternately, three times. The last state of NLGS is where they start."""
        for item, scene in MEASURED.items():
            grid = "2x1" if scene == "biaxial" else "2x1x1"
            kinds = [("nlgs", "none", 1), ("dcs", f"grid {grid}", 2), ("ccs", f"grid {grid}", 2)]
            outs, commands = {kind: [] for kind in kinds}, []
            for repeat in range(3):
                for scheme, partition, n in kinds:
                    out = self.folder / f"measured/{scene}-{scheme}-{n}-{repeat}.json"
                    outs[scheme, partition, n].append(out)
                    command = [*(["mpirun", "-np", n] if n > 1 else []), NSCDD, "run", self.scene(scene), "--packing", self.packing(scene)]
                    command += ["--from", self.nlgs(scene), "--method", "paper", "--scheme", scheme, *dealt(partition)]
                    commands.append([*command, "--steps", self.steps(SCENES[scene][4]), "--quiet", "--json", out])
            files, cost = [out for made in outs.values() for out in made], {2: 30, 3: 60}[SCENES[scene][1]]
            self.add(item, f"measured {scene}", files, commands, needs=[self.nlgs(scene)], cost=cost, alone=True)
            self.measured += [(outs[kind], scene, *kind) for kind in kinds]

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
        for name, (_, scene, old, new, *_) in VARIATIONS.items():
            text = self.scene(scene).read_text()
            assert not old or text.count(old) == 1, (name, old)
            self.scene(slug(name)).write_text(text.replace(old, new) if old else text)
