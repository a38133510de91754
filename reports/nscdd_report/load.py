"""Results of one folder: runs, comparisons, hard cases, failed jobs; and which run may answer which question."""
import json
from pathlib import Path

from .times import busy, cores_of

SCHEMAS = Path(__file__).resolve().parent.parent
NOT_SHOWN = tuple(f"nscdd.{name}/1" for name in ("summary", "fclib", "scale", "costs", "window", "partitions", "main"))
RECORDS = ("paper", "physics", "peers", "hard", "accuracy", "acceleration", "velocity_error", "wild", "bits")  # of scripts; schema nscdd.NAME/1
ROLES = ("isotropic", "biaxial", "triaxial", "network")  # scenes of the paper, known by their names


class InputError(Exception):
    """A results file that cannot be used; the text is one line that names it."""


class Run:
    """One run JSON, its fields by index: run["iterations"]."""

    def __init__(self, path, data):
        self.path, self.data = path, data

    def __getitem__(self, key):
        return self.data[key]

    @property
    def name(self):
        return self.path.stem

    @property
    def key(self):
        return tuple(self.data[k] for k in ("scene", "scheme", "subdomains", "transport"))

    @property
    def role(self):
        return next((role for role in ROLES if role in self["scene"].lower()), self["scene"])

    @property
    def measured(self):
        """Whether its times say anything about speed: a core for every rank, which nothing else took."""
        if self["transport"] == "mpi":
            return self["ranks_measured"] and self["subdomains"] <= self["machine"]["cores"] and not self.busy
        return self["transport"] == "sequential" and not self.busy

    @property
    def busy(self):
        return busy(cores_of(self.data))

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
    def command(self):
        launcher = f"mpirun -np {self['subdomains']} " if self["transport"] == "mpi" else ""
        return launcher + self["command"]

    @property
    def state(self):
        """Its state file, or None: relative to the JSON file, else of that name beside it."""
        if not self.data.get("state"):
            return None
        named = Path(self["state"])
        candidates = (self.path.parent / named, self.path.parent / named.name)
        return next((path for path in candidates if path.is_file()), None)

    def problems(self):
        """What keeps the run from being converged, in words; empty if nothing."""
        if not self["converged"] or self["unconverged_steps"]:
            yield f"{self.name}: not converged in {self['unconverged_steps']} of {self['steps']} steps"
        elif self.eta_max is None:
            yield f"{self.name}: a residual is not finite"
        elif self.eta_max > self["tolerance"] * (1 + 1e-9):
            yield f"{self.name}: called converged, yet its residual {self.eta_max:.3g} exceeds {self['tolerance']:g}"


class Record(dict):
    """The JSON of a script, such as that of the hard cases; its command and fields are asked for like those of a run."""

    @property
    def command(self):
        return self["command"]


class Results:
    """Everything read from one folder."""

    def __init__(self, folder, runs, compares, jobs, records, counts):
        self.folder = Path(folder)
        self.runs, self.compares, self.jobs = runs, compares, jobs
        (self.paper, self.physics, self.peers, self.hard, self.accuracy, self.acceleration, self.velocity_error,
         self.wild, self.bits) = (records[kind] for kind in RECORDS)
        self.counts = counts  # how many counted numbers are those of the committed records (scripts/counted)
        self.statements = None  # of the paper, set by its section: what the summary of verdicts needs
        self.summary = {}  # what sections add to summary.json
        self.records = [record for kind in RECORDS for record in records[kind]]

    @property
    def hard_rows(self):
        return [row for record in self.hard for row in record["rows"]]

    def select(self, **wanted):
        """Runs whose fields, or properties such as role, have the given values."""
        def value(run, key):
            return getattr(run, key) if key in ("role", "measured") else run[key]
        return [run for run in self.runs if all(value(run, k) == v for k, v in wanted.items())]

    def counted(self, role, scheme):
        """{subdomains: run} to take counts from: all with the same, finest, interval between checks."""
        runs = self.select(role=role, scheme=scheme)
        finest = min((run["check_every"] for run in runs), default=1)
        runs = [run for run in runs if run["check_every"] == finest]
        # both transports give the same numbers; of two runs the in-process one, coming last, is taken
        runs.sort(key=lambda run: (run["subdomains"], run["transport"] != "mpi"))
        return {run["subdomains"]: run for run in runs}

    def timed(self, role, scheme):
        """{ranks: fastest measured MPI run} to take times from."""
        runs = self.select(role=role, scheme=scheme, transport="mpi", measured=True)
        runs.sort(key=lambda run: (run["subdomains"], -run["seconds"]["total"]))
        return {run["subdomains"]: run for run in runs}

    def reference(self, run):
        """The sequential NLGS run that `run` may be compared with in speed or count, or None."""
        same = {key: run[key] for key in ("scene", "tolerance", "check_every", "steps", "grains")}
        runs = self.select(scheme="nlgs", **same)
        return min(runs, key=lambda r: r["seconds"]["total"], default=None)

    def unmeasured(self, role):
        """Numbers of subdomains of a scene for which there are not cores enough here."""
        return sorted({run["subdomains"] for run in self.runs if run.role == role and run["scheme"] != "nlgs"
                       and run["subdomains"] > run["machine"]["cores"]})

    def busy(self, role):
        """Numbers of subdomains of a scene of which a time was not believed, 1 for the reference."""
        return sorted({run["subdomains"] for run in self.runs
                       if run.role == role and run["transport"] in ("mpi", "sequential") and run["subdomains"] <= run["machine"]["cores"] and run.busy})

    def failures(self):
        """One line for each thing that fails the report."""
        lines = [problem for run in self.runs for problem in run.problems()]
        for compare in self.compares:
            bad = [row for row in compare["rows"] if not row_ok(row)]
            lines += [f"{Path(compare['candidate']).stem}: {row['quantity']} {show(row['value'])} "
                      f"exceeds {row['bound']:g}" for row in bad]
            if not compare["ok"] and not bad:
                lines.append(f"{Path(compare['candidate']).stem}: said to disagree with {compare['reference']}")
        lines += [f"hard case {row['case']} by {row['scheme']}: {row['quantity']}: "
                  + (row.get("note") or f"error {show(row['error'])} exceeds {row['bound']:.3g}")
                  for row in self.hard_rows if not hard_ok(row)]
        for record in self.paper:
            lines += [f"paper: {entry['scene']} {entry['scheme']} {entry['partition']}, one step: {row['quantity']} {show(row['value'])} exceeds "
                      f"{row['bound']:g}" for entry in record["agreement"] for row in entry["rows"] if not row_ok(row)]
            lines += [f"paper: {run['scene']} {run['scheme']} {run['partition']}, {run['method']}: not converged in {run['unconverged_steps']} of "
                      f"{run['steps']} steps" for run in record["runs"] if run["unconverged_steps"] and not run["variation"]]
        lines += [f"job failed (exit {job['exit']}): {job['title']}" for job in self.jobs if job["exit"]]
        return lines

    def unchecked(self):
        """Runs but those by NLGS that nothing was compared with."""
        checked = {tuple(c[k] for k in ("scene", "scheme", "subdomains", "transport")) for c in self.compares}
        return [run for run in self.runs if run["scheme"] != "nlgs" and run.key not in checked]


def row_ok(row):
    return row["ok"] and row["value"] is not None and row["value"] <= row["bound"]


def hard_ok(row):
    return row["ok"] and row["error"] is not None and row["error"] <= row["bound"]


def show(value):
    return "not finite" if value is None else f"{value:.3g}"


def check(path, data, schema):
    """Raises InputError at the first place where `data` departs from the schema file."""
    definition = json.loads((SCHEMAS / schema).read_text(encoding="utf-8"))
    try:
        import jsonschema
    except ImportError:  # then at least the fields that the report reads must be there
        missing = [key for key in definition["required"] if key not in data]
        if missing:
            raise InputError(f"{path}: field '{missing[0]}' is missing") from None
        return
    error = next(iter(jsonschema.Draft7Validator(definition).iter_errors(data)), None)
    if error:
        place = "/".join(map(str, error.absolute_path)) or "top level"
        raise InputError(f"{path}: {place}: {error.message[:160]}")


def read_json(path):
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not valid JSON (truncated?): line {error.lineno}: {error.msg}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    if not isinstance(data, dict) or not isinstance(data.get("schema"), str):
        raise InputError(f"{path}: not a result: field 'schema' is missing")
    return data


def check_steps(path, data):
    """Lists of a record of the paper that the schema cannot measure."""
    for place, run in enumerate(data["runs"]):
        for key in ("iterations", "contacts"):
            if len(run[key]) != run["steps"]:
                raise InputError(f"{path}: runs/{place}/{key}: {len(run[key])} entries for {run['steps']} steps")


def load(folder):
    """Reads every *.json of a folder, not of folders in it. Raises InputError."""
    runs, compares, jobs, counts, records = [], [], [], [], {kind: [] for kind in RECORDS}
    for path in sorted(Path(folder).glob("*.json")):
        data = read_json(path)
        if data["schema"] == "nscdd.run/1":
            check(path, data, "run.schema.json")
            for key in ("iterations", "residual", "contacts"):
                if len(data[key]) != data["steps"]:
                    raise InputError(f"{path}: {key}: {len(data[key])} entries for {data['steps']} steps")
            runs.append(Run(path, data))
        elif data["schema"] == "nscdd.compare/1":
            check(path, data, "compare.schema.json")
            compares.append(data)
        elif (kind := data["schema"].removeprefix("nscdd.").removesuffix("/1")) in RECORDS:
            check(path, data, f"{kind}.schema.json")
            if kind == "paper":
                check_steps(path, data)
            records[kind].append(Record(data))
        elif data["schema"] == "nscdd.counted/1":
            check(path, data, "counted.schema.json")
            counts.append(data)
        elif data["schema"] == "nscdd.job/1":
            try:
                jobs += [{"title": job["title"], "exit": job["exit"]} for job in data["jobs"]]
            except (KeyError, TypeError) as error:
                raise InputError(f"{path}: not a record of jobs: {error}") from None
        elif data["schema"] not in NOT_SHOWN:
            raise InputError(f"{path}: unknown schema '{data['schema']}'")
    if not (runs or any(records.values())):
        raise InputError(f"{folder}: no run JSON (schema nscdd.run/1) in this folder")
    for entries in (runs, compares):
        entries.sort(key=lambda e: (e["scene"], e["scheme"] != "nlgs", e["transport"], e["scheme"], e["subdomains"]))
    return Results(folder, runs, compares, jobs, records, counts)
