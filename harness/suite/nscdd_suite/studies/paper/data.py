"""The record of the paper's tables and figures (paper.json): which run and which simulated iteration answers which question."""
import dataclasses

from ...times import busy

SCENES = ("isotropic", "biaxial", "triaxial")  # of the paper
MILLION = "million"  # the triaxial test with 16 times the spheres
COLLECTIVE = ("gather", "scatter", "reduction", "all_gather")  # of the operations that messages are part of
FAMILIES = ("grid", "bisection", "metis")
# [Visseq14] Table 1: splitting, share of time in MPI in per cent by CCS and DCS.
TABLE_1 = {1: ("none", 0.0, 0.0), 3: ("grid 3x1x1", 31.3, 14.0), 4: ("grid 2x2x1", 35.6, 9.1), 8: ("grid 2x2x2", 58.3, 18.4)}
INERTIAL = {"biaxial": 1.3e-4, "triaxial": 2.7e-4}  # by the rate of strain, as the comments of cases/paper say
STARTS = {
    "isotropic": "the packing, loose",
    **dict.fromkeys(("biaxial", "triaxial", MILLION), "the test under way: from the packing 100 steps of 5 h, then 50 of h, " "accelerated"),
}
UNKNOWNS = 6.5e5  # [Visseq14] section 2.1, of the 64,000 spheres, average


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
    iteration_efficiency: float  # T_NLGS / (N T_N)
    iterations: int  # None where they were not counted
    speed_up: float  # None where iterations were not counted
    low: float  # of the bands: latency, bandwidth, noise
    high: float
    interface: float

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
        return [
            run
            for key, run in self.counted.items()
            if key[0] == scene and key[1] == method and run["scheme"] != "nlgs" and scheme in (None, run["scheme"]) and of in (None, family(run["partition"]))
        ]

    def run(self, scene, method, scheme, partition, n):
        """Its counts; those of the other scheme, which makes the same iterates, where it was not counted itself."""
        for name in (scheme, *(other for other in ("dcs", "ccs") if other != scheme)):
            found = self.counted.get((scene, method, name, partition, n))
            if found:
                return found
        return None

    def window(self, place, field, band=(1, 1, 0)):
        """Mean over the states that were simulated from; None if there is none. An unbanded machine has band (1, 1, 0)."""
        return mean(window[field] for window in self.windows.get(place, {}).get(band, []))

    def point(self, scene, method, scheme, partition, n, platform, slower=1, reference="paper"):
        """One point of a speed-up curve, or None; the reference is sequential NLGS by the method named."""
        place, alone = (scene, method, scheme, partition, n, platform, slower), (scene, reference, "nlgs", "none", 1, platform, slower)
        if alone not in self.windows:  # it sends nothing, and a second of computing is one on every platform
            alone = (*alone[:5], "node48", slower)
        seconds, first = self.window(place, "seconds_per_iteration"), self.window(alone, "seconds_per_iteration")
        if seconds is None or first is None:
            return None
        run, nlgs = self.run(scene, method, scheme, partition, n), self.nlgs(scene, reference)
        same = method == reference
        point = Point(
            n,
            partition,
            seconds,
            self.window(place, "mpi_share"),
            first / (n * seconds) if same else None,
            total(run) if run else None,
            None,
            None,
            None,
            run["interface_grains"] if run else 0.0,
        )
        if run and nlgs and total(run):
            ratio = total(nlgs) / total(run)
            banded = [
                (self.window(alone, "seconds_per_iteration", band) or first) / self.window(place, "seconds_per_iteration", band) for band in self.windows[place]
            ]
            point.speed_up, point.low, point.high = first / seconds * ratio, min(banded) * ratio, max(banded) * ratio
        return point

    def points(self, scene, method, scheme, of, platform="node48", slower=1, reference="paper"):
        """All points of one family of partitions, by number of subdomains; of several splittings the one that shares fewest grains first."""
        found = []
        for key in self.windows:
            if key[:3] == (scene, method, scheme) and key[5:] == (platform, slower) and family(key[3]) == of and key[4] > 1:
                found.append(self.point(scene, method, scheme, key[3], key[4], platform, slower, reference))
        return sorted((point for point in found if point), key=lambda point: (point.n, point.interface, point.partition))

    def curve(self, *where, **how):
        """{subdomains: point}, of several splittings the one that shares fewest grains; points without a speed-up are left out."""
        chosen = {}
        for point in self.points(*where, **how):
            if point.speed_up is not None:
                chosen.setdefault(point.n, point)
        return chosen

    def share(self, scheme, n, slower, which="mpi_share"):
        """Table 1: share of an iteration in MPI, isotropic compaction by the paper's method and splitting; None if not simulated."""
        if n == 1:
            return 0.0
        return self.window(("isotropic", "paper", scheme, TABLE_1[n][0], n, "node48", slower), which)

    def iteration(self, scheme, n, slower):
        """Its seconds."""
        return self.window(("isotropic", "paper", scheme, TABLE_1[n][0], n, "node48", slower), "seconds_per_iteration")

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
        start = run["variation"].partition(", ")[2]
        if start:
            same = [other for other in self.record["runs"] if other["variation"] == f"as it is, {start}" and self.key(other) == self.key(run)]
            base = same[0] if same else None
        else:
            base = self.counted.get(self.key(run))
        return mean(base["iterations"][: run["steps"]]) if base else None

    def under_way(self, scene):
        """Whether its runs start from a state, not from the packing."""
        return any("--from" in run["command"].split() or run.get("start") for run in self.counted.values() if run["scene"] == scene)

    def measured(self, scene=None):
        """Measured runs with their speed-up over measured sequential NLGS by the paper's method: (row, speed-up or None), None
        where the machine was busy."""
        rows = [row for row in self.record["measured"] if scene in (None, row["scene"])]
        first = {row["scene"]: row for row in rows if row["scheme"] == "nlgs" and row["method"] == "paper"}
        fair = lambda row: not busy(row.get("cores")) and row["scene"] in first and not busy(first[row["scene"]].get("cores"))  # noqa: E731
        return [(row, first[row["scene"]]["seconds"] / row["seconds"] if fair(row) else None) for row in rows]
