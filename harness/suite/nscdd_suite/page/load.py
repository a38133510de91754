"""Results of one folder: the records of studies, and the files of single runs and comparisons."""
from pathlib import Path

from .. import record
from ..record import InputError
from ..studies import studies
from ..study import MADE_BY

OF_THE_PROGRAM = ("run", "compare", "scale", "counted", "job")  # kinds beside those of studies


class Record(dict):
    """The JSON of a study, or of a run, with the file that it is from."""

    def __init__(self, data, path=""):
        super().__init__(data)
        self.path = Path(path)

    @property
    def command(self):
        launcher = f"mpirun -np {self['subdomains']} " if self.get("transport") == "mpi" else ""
        return launcher + self["command"]

    def check_steps(self, run, keys, place=""):
        """Of a run of this file: lists with an entry a step, which no schema can measure. Raises InputError."""
        for key in keys:
            if len(run[key]) != run["steps"]:
                raise InputError(f"{self.path}: {place}{key}: {len(run[key])} entries for {run['steps']} steps")


class Results:
    """Everything read from one folder, and what sections say of it."""

    def __init__(self, folder, found):
        self.folder, self.found = Path(folder), found
        self.failures = []  # a line for each thing that fails the page
        self.good, self.open = [], []  # sentences at the top: what was checked and holds; (what is open, which)
        self.summary = {}  # what sections add to summary.json
        self.opening = None  # () -> HTML before all else, asked for when all blocks have their numbers

    def records(self, kind):
        return self.found.get(kind, [])

    @property
    def sources(self):
        """Whatever names its commit and machine."""
        return [one for kind in ("run", "scale", *studies()) for one in self.records(kind)]

    def files(self, data):
        """The folder of what the record of a study was made from."""
        return self.folder / data.path.stem / ("quick" if data.get("quick") else "")


def load(folder):
    """Reads every *.json of a folder, and runs, comparisons and failed jobs of the studies that made them there. Raises InputError."""
    if not Path(folder).is_dir():
        raise InputError(f"report: {folder}: no such folder")
    results = Results(folder, {})
    add(results, results.folder.glob("*.json"), (*OF_THE_PROGRAM, *studies()))
    add(results, results.folder.glob("*/job.json"), ("job",))
    for data in results.records("reduced"):
        add(results, results.files(data).glob("*.json"), ("run", "compare"))
    if not results.sources:
        raise InputError(f"{folder}: no run JSON (schema nscdd.run/1) and no record of a study in this folder")
    return results


def add(results, paths, kinds):
    for path in sorted(path for path in paths if path.name != MADE_BY):
        data = record.read(path)
        kind = data["schema"].removeprefix("nscdd.").removesuffix("/1")
        if data["schema"] != f"nscdd.{kind}/1":
            raise InputError(f"{path}: unknown schema '{data['schema']}'")
        if kind in kinds:  # the program has files of other kinds too, of which no page is made
            if (record.SCHEMAS / f"{kind}.schema.json").exists():
                record.check(path, data, f"{kind}.schema.json")
            results.found.setdefault(kind, []).append(Record(data, path))
