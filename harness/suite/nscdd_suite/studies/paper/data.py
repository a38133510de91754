"""The record of the paper's tables and figures (paper.json): which run and which simulated iteration answers which question."""
import dataclasses
import functools

from ...times import busy

SCENES = ("isotropic", "biaxial", "triaxial")  # of the paper
MILLION = "million"  # the triaxial test with 16 times the spheres
COLLECTIVE = ("gather", "scatter", "reduction", "all_gather")  # of the operations that messages are part of
FAMILIES = ("grid", "bisection", "metis")
# [Visseq14] Table 1: splitting, share of time in MPI in per cent by CCS and DCS.
TABLE_1 = {1: ("none", 0.0, 0.0), 3: ("grid 3x1x1", 31.3, 14.0), 4: ("grid 2x2x1", 35.6, 9.1), 8: ("grid 2x2x2", 58.3, 18.4)}
NUMBERS = (3, 4, 8)  # of its subdomains, where there is something to send
WAY = "the test under way: from the packing 100 steps of 5 h, then 50 of h, accelerated"
STARTS = {"isotropic": "the packing, loose", "biaxial": WAY, "triaxial": WAY, MILLION: WAY}


def family(partition):
    """grid 3x1x1 -> grid."""
    return partition.split()[0]


def mean(values):
    values = list(values)
    return sum(values) / len(values) if values else None


def total(run):
    return sum(run["iterations"])


@dataclasses.dataclass
class Point:
    """One splitting on a simulated machine. Speed-up at equal error: T_NLGS I_NLGS / (T_N I_N), T an iteration, I iterations."""

    n: int
    partition: str
    seconds: float  # of an iteration
    share: float  # in MPI
    iteration_efficiency: float  # T_NLGS / (N T_N), both by the same method
    iterations: int = None  # as all below, None or 0 where they were not counted
    interface: float = 0.0
    speed_up: float = None
    low: float = None  # of the bands: latency, bandwidth, noise
    high: float = None

    @property
    def efficiency(self):
        return None if self.speed_up is None else self.speed_up / self.n


class Paper:
    """What is in one record, by key; of runs and windows by NSCDD those with this interface: minimal, or predicted by the broad phase."""

    def __init__(self, record, multiplicity="minimal"):
        self.record, self.multiplicity = record, multiplicity
        self.counted, self.perturbed, self.windows = {}, {}, {}
        for run in filter(self.has, record["runs"]):
            if run.get("perturbed"):
                self.perturbed.setdefault(self.key(run), {})[run["perturbed"]] = run
            elif not run["variation"]:
                self.counted[self.key(run)] = run
        self.own_windows = list(filter(self.has, record["windows"]))
        for window in self.own_windows:
            if window["subdomains"] == 1:  # sequential, whatever it is called
                window = window | {"scheme": "nlgs"}
            place = (*self.key(window), window["platform"], window["slower"])
            band = (window["latency"], window["bandwidth"], window["noise"])
            self.windows.setdefault(place, {}).setdefault(band, []).append(window)

    @functools.cached_property
    def predicted(self):
        """The same of runs and windows that glue the predicted interface."""
        return Paper(self.record, "predicted")

    def has(self, entry):
        """Whether an entry has this interface; sequential ones have none."""
        return entry["subdomains"] == 1 or entry.get("multiplicity", "minimal") == self.multiplicity

    @staticmethod
    def key(entry):
        scheme, partition = entry["scheme"], entry["partition"]
        return (entry["scene"], entry["method"], scheme, "none" if scheme == "nlgs" else partition, entry["subdomains"])

    def nlgs(self, scene, method="paper"):
        """The sequential run, or None."""
        return self.counted.get((scene, method, "nlgs", "none", 1))

    def runs(self, scene, method="paper", scheme=None, of=None):
        """Runs by NSCDD of one scene; `of`: family of the partition."""
        own = [run for run in self.counted.values() if (run["scene"], run["method"]) == (scene, method) and run["scheme"] != "nlgs"]
        return [run for run in own if scheme in (None, run["scheme"]) and of in (None, family(run["partition"]))]

    def run(self, scene, method, scheme, *splitting):
        """Its counts; those of the other scheme, which makes the same iterates, where it was not counted itself."""
        found = (self.counted.get((scene, method, name, *splitting)) for name in (scheme, "dcs", "ccs"))
        return next(filter(None, found), None)

    def window(self, place, field, band=(1, 1, 0)):
        """Mean over the states that were simulated from; None if there is none. An unbanded machine has band (1, 1, 0)."""
        return mean(window[field] for window in self.windows.get(place, {}).get(band, []))

    def alone(self, scene, method, platform, slower):
        """Place of the window of sequential NLGS. It sends nothing, and a second of computing is one on every platform."""
        places = [(scene, method, "nlgs", "none", 1, name, slower) for name in (platform, "node48")]
        return places[0] if places[0] in self.windows else places[1]

    def point(self, scene, method, scheme, partition, n, platform, slower=1):
        """One point of a speed-up curve, over sequential NLGS by the paper's method; None where one of both was not simulated."""
        place, alone = (scene, method, scheme, partition, n, platform, slower), self.alone(scene, "paper", platform, slower)
        own, first, seconds = (self.window(at, "seconds_per_iteration") for at in (self.alone(scene, method, platform, slower), alone, place))
        if seconds is None or first is None:
            return None
        point = Point(n, partition, seconds, self.window(place, "mpi_share"), own and own / (n * seconds))
        run, nlgs = self.run(scene, method, scheme, partition, n), self.nlgs(scene)
        if run:
            point.iterations, point.interface = total(run), run["interface_grains"]
        if run and nlgs and total(run):
            ratio = total(nlgs) / total(run)
            bands = {band: self.window(place, "seconds_per_iteration", band) for band in self.windows[place]}
            banded = [(self.window(alone, "seconds_per_iteration", band) or first) / value for band, value in bands.items()]
            point.speed_up, point.low, point.high = first / seconds * ratio, min(banded) * ratio, max(banded) * ratio
        return point

    def points(self, scene, method, scheme, of, platform="node48"):
        """All points of one family of partitions, by number of subdomains; of several splittings the one that shares fewest grains first."""
        places = [key for key in self.windows if key[:3] == (scene, method, scheme) and key[5:] == (platform, 1) and family(key[3]) == of and key[4] > 1]
        found = filter(None, (self.point(*key) for key in places))
        return sorted(found, key=lambda point: (point.n, point.interface, point.partition))

    def curve(self, *where):
        """{subdomains: point}, of several splittings the one that shares fewest grains; points without a speed-up are left out."""
        chosen = {}
        for point in self.points(*where):
            if point.speed_up is not None:
                chosen.setdefault(point.n, point)
        return chosen

    def table_1(self, scheme, n, slower=1, field="mpi_share"):
        """Of an iteration of Table 1, the isotropic compaction by the paper's method and splitting; None if not simulated."""
        return self.window(("isotropic", "paper", scheme, TABLE_1[n][0], n, "node48", slower), field)

    def operations(self, scheme, n, slower=1):
        """What its messages are part of, by operation: messages of all ranks, shares of waiting and transferring; None if not in the record."""
        windows = self.windows.get(("isotropic", "paper", scheme, TABLE_1[n][0], n, "node48", slower), {}).get((1, 1, 0), [])
        return next((window["operations"] for window in windows if "operations" in window), None)

    def chance(self):
        """Most over least iterations of one splitting from starts that differ by 1e-9 of a radius, where that is largest; None if not run."""
        spreads = [max(map(total, runs.values())) / min(map(total, runs.values())) for runs in self.perturbed.values() if len(runs) > 1]
        return max(spreads, default=None)

    def unvaried(self, run):
        """Mean iterations of the same steps of the scene as it is, from the same start where the variation names one; None if not run."""
        base, start = self.counted.get(self.key(run)), run["variation"].partition(", ")[2]
        if start:
            same = (other for other in self.record["runs"] if other["variation"] == f"as it is, {start}" and self.key(other) == self.key(run))
            base = next(same, None)
        return mean(base["iterations"][: run["steps"]]) if base else None

    def under_way(self, scene):
        """Whether its runs start from a state, not from the packing."""
        return any("--from" in run["command"].split() or run.get("start") for run in self.counted.values() if run["scene"] == scene)

    def measured(self):
        """Measured runs of the paper's method and their speed-up over measured sequential NLGS, None where the machine was busy."""
        rows = self.record["measured"]
        fair = {row["scene"]: row["seconds"] for row in rows if row["scheme"] == "nlgs" and not busy(row.get("cores"))}
        return [(row, None if busy(row.get("cores")) or row["scene"] not in fair else fair[row["scene"]] / row["seconds"]) for row in rows]
