"""Runs of a folder: whether each converged, and which may answer which question."""
from pathlib import Path

from ...page.load import Record
from ...page.style import SCHEMES
from ...times import busy, cores_of


class Run(Record):
    @property
    def name(self):
        return self.path.stem

    @property
    def measured(self):
        """Whether its times say anything about speed: a core for every rank, which nothing else took."""
        has_cores = self["transport"] == "sequential" or self["ranks_measured"] and self["subdomains"] <= self["machine"]["cores"]
        return self["transport"] in ("mpi", "sequential") and has_cores and not self.busy

    @property
    def busy(self):
        return busy(cores_of(self))

    @property
    def total_iterations(self):
        return sum(self["iterations"])

    @property
    def mean_iterations(self):
        return self.total_iterations / max(1, len(self["iterations"]))

    @property
    def eta_max(self):
        """Largest residual of all steps; None if one is not finite."""
        return None if None in self["residual"] else max(self["residual"], default=0.0)

    @property
    def state(self):
        """Its state file, or None: relative to the JSON file, else of that name beside it."""
        named = Path(self.get("state") or "-")
        return next((path for path in (self.path.parent / named, self.path.parent / named.name) if path.is_file()), None)

    @property
    def problem(self):
        """What keeps the run from being converged, in words; empty if nothing."""
        if not self["converged"] or self["unconverged_steps"]:
            return f"{self.name}: not converged in {self['unconverged_steps']} of {self['steps']} steps"
        if self.eta_max is None:
            return f"{self.name}: a residual is not finite"
        if self.eta_max > self["tolerance"] * (1 + 1e-9):
            return f"{self.name}: called converged, yet its residual {self.eta_max:.3g} exceeds {self['tolerance']:g}"
        return ""


def key(told):
    """Of a run, and of its comparison."""
    return tuple(told[name] for name in ("scene", "scheme", "subdomains", "transport"))


def order(told):
    return told["scene"], told["scheme"] != "nlgs", told["transport"], told["scheme"], told["subdomains"]


class Runs(list):
    """All runs of a folder. Raises InputError."""

    def __init__(self, results):
        super().__init__(sorted((Run(run, run.path) for run in results.records("run")), key=order))
        for run in self:
            run.check_steps(run, ("iterations", "residual", "contacts"))

    def select(self, scene="", **wanted):
        """Those with these fields, of scenes whose name has this word."""
        return [run for run in self if scene in run["scene"].lower() and all(run[name] == value for name, value in wanted.items())]

    def counted(self, scene, scheme):
        """{subdomains: run} to take counts from: all with the same, finest, interval between checks."""
        runs = self.select(scene, scheme=scheme)
        finest = min((run["check_every"] for run in runs), default=1)
        # both transports give the same numbers; of two runs the in-process one, coming last, is taken
        runs.sort(key=lambda run: (run["subdomains"], run["transport"] != "mpi"))
        return {run["subdomains"]: run for run in runs if run["check_every"] == finest}

    def timed(self, scene, scheme):
        """{ranks: fastest measured MPI run} to take times from."""
        runs = sorted(self.select(scene, scheme=scheme, transport="mpi"), key=lambda run: (run["subdomains"], -run["seconds"]["total"]))
        return {run["subdomains"]: run for run in runs if run.measured}

    def speed_ups(self, scene):
        """{scheme: {ranks: T(sequential NLGS) / T(NSCDD over MPI)}}, and the runs used; measured runs only."""
        values, used = {}, []
        for scheme in SCHEMES:
            for n, run in self.timed(scene, scheme).items():
                reference = self.reference(run)
                if reference and reference.measured and run["seconds"]["total"] > 0:
                    values.setdefault(scheme, {})[n] = reference["seconds"]["total"] / run["seconds"]["total"]
                    used += [run] + [reference] * (reference not in used)
        return values, used

    def reference(self, run):
        """The sequential NLGS run that `run` may be compared with in speed or count, or None."""
        same = {name: run[name] for name in ("tolerance", "check_every", "steps", "grains")}
        runs = [other for other in self.select(scheme="nlgs", **same) if other["scene"] == run["scene"]]
        return min(runs, key=lambda other: other["seconds"]["total"], default=None)

    def unmeasured(self, scene):
        """Numbers of subdomains of a scene for which there are not cores enough here, and those of which a time was not believed."""
        few, busy = set(), set()
        for run in self.select(scene):
            if run["subdomains"] > run["machine"]["cores"]:
                few |= {run["subdomains"]}
            elif run["transport"] != "in-process" and run.busy:
                busy |= {run["subdomains"]}
        return sorted(few), sorted(busy)
