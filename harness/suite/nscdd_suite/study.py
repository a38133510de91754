"""The interface of a study: one question, the jobs that answer it, the record of the answer, and its section of the page."""
import contextlib
import copy
import dataclasses
import fcntl
import functools
import importlib
import importlib.util
import io
import itertools
import shlex
import sys
import tempfile
from pathlib import Path

from . import program, record
from .jobs import Job, Runner, chosen, clock, unfinished

MADE_BY = "made-by.json"  # in a study's folder: the program that made what is there


@dataclasses.dataclass
class Plan:
    """What a study is asked for, and helpers to make its jobs. Files are in `folder`, records in `results`."""

    results: Path
    name: str
    only: str = dataclasses.field(default="", compare=False)  # no job's result is from what is not compared
    quick: bool = False
    command: str = dataclasses.field(default="", compare=False)  # as typed, for the record
    keep: bool = dataclasses.field(default=False, compare=False)  # takes what another program has made, or was made from other inputs

    def __post_init__(self):
        self.folder = self.results / self.name / ("quick" if self.quick else "")
        self.logs = self.folder / "logs"
        self.packings = self.results / "packings"  # which studies share, where scenes look for them
        self.jobs, self.left_out = [], []

    def add(self, title, outputs, commands=(), **how):
        """A job, once: two studies' parts may need the same file. Returns its first output."""
        if not any(job.outputs[0] == str(outputs[0]) for job in self.jobs):
            self.jobs.append(Job(title, outputs, commands, folder=self.folder, **how))
        return outputs[0]

    def rows(self, title, work, *arguments, **how):
        """A job of Python, work(*arguments), whose rows are kept in a file of their own: (folder/rows/TITLE.json)."""
        out = self.folder / "rows" / f"{title.replace(' ', '-').replace('/', '-')}.json"
        return self.add(title, [out], work=functools.partial(work, *arguments), **how)

    def pack(self, source, out=None, grains=0, loose=False, cost=10.0, generator=()):
        """A job that packs by a specification of cases/, with so many grains instead."""
        name, text, file = Path(source).stem, program.specification(source, grains, loose), Path(source)
        changed = text != Path(program.ROOT, source).read_text()
        shared = self.packings / f"{name}.h5" if not changed and not generator else None
        out = out or shared or self.folder / "packings" / f"{name}{f'-{grains}' if grains else ''}.h5"
        if changed:
            file = out.with_suffix(".toml")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        command = [program.NSCDD, "pack", file, *(["--generator", generator] if generator else []), "-o", out, "--quiet"]
        return self.add(f"packing {out.stem}", [out], [command], cost=cost)

    def leave_out(self, text):
        """Says of a part that it is not made, and why."""
        self.left_out.append(text)
        print(f"skipped: {text}", flush=True)

    def made(self, title):
        """The rows of a job of Python, or () where it failed or was not asked for."""
        job = next((job for job in self.jobs if job.title == title), None)
        return record.load(job.outputs[0]) if job and job.done(self.keep) else ()


class Study:
    """Subclasses say what; this class says how. All that a new study needs is a subclass and a line in studies/__init__.py."""

    name = ""  # on the command line; NAME.json is the record, nscdd.NAME/1 its schema, reports/NAME.schema.json describes it
    title = ""  # of the section
    about = ""  # one line of `scripts/suite list`
    in_all = True  # `scripts/suite run all` makes it
    items = ()  # parts that may be asked for in the place of the study
    kinds = ()  # measured, counted, computed or SIMULATED are the numbers of a section without section.py

    def jobs(self, plan):
        """Adds all jobs to the plan."""
        raise NotImplementedError

    def rows(self, plan):
        """What the record has beside commit, machine and command, from the files that the jobs left; {} if there is nothing."""
        raise NotImplementedError

    def page(self):
        """The module section.py beside the study, if there is one; a study may be a single file."""
        module = sys.modules[type(self).__module__]
        name = f"{module.__name__}.section"
        return importlib.import_module(name) if hasattr(module, "__path__") and importlib.util.find_spec(name) else None

    def section(self, results, out):
        """Blocks and HTML of the page, its images in the folder `out`; [] for no section. studies/NAME/section.py has section(results, out),
        or parts(record, source, out) of each record; without it there is a table of all rows."""
        from .page import default, page

        module = self.page()
        if hasattr(module, "section"):
            return module.section(results, out)
        parts = module.parts if module else lambda data, source, out: default.parts(self, data)
        return [part for data in results.records(self.name) for part in (*page.warnings(data), *parts(data, page.origin([data]), out))]

    def choose(self, plan):
        """The jobs that plan.only asks for, and what they need."""
        return chosen(plan.jobs, plan.only)

    def planned(self, plan):
        """The jobs that it asks for, planned in a folder aside, as a plan writes inputs of its jobs."""
        with tempfile.TemporaryDirectory() as folder:
            self.jobs(plan := dataclasses.replace(plan, results=Path(folder)))
            return self.choose(plan)

    def whole(self, plan, data):
        """The record that is written; a study may keep rows of an earlier one."""
        return data

    def draw(self, plan, data):
        """Writes figures beside a new record: by draw_all of section.py, if it has one."""
        if draw_all := getattr(self.page(), "draw_all", None):
            draw_all(data, plan.results)

    def told(self, data):
        """Lines for the console about a new record."""
        return ()

    def passes(self, data):
        """Whether the record is as it should be."""
        return True

    def provenance(self, plan):
        """Commit and machine of the last run that the jobs left; of one for this purpose where they left none."""
        made = (record.load(path) for job in plan.jobs for path in job.outputs if path.endswith(".json") and Path(path).exists())
        runs = [told for told in made if isinstance(told, dict) and told.keys() >= {"schema", *record.PROVENANCE}]
        out = plan.logs / "probe.json"
        runs = runs or [program.made([program.NSCDD, "run", "cases/hard/column-10-2d.toml", "--quiet", "--json", out], out)]
        last = max(runs, key=lambda run: run["date"])
        return {key: last[key] for key in record.PROVENANCE}

    def command(self, plan):
        """As typed; where parts have come to the whole, and that is what runs without `only`, that of the whole."""
        if not plan.only or unfinished(plan.jobs, plan.keep):
            return plan.command
        without = copy.copy(plan)
        without.only = ""
        repeats = len(self.choose(without)) == len(plan.jobs)
        given = [option for option, is_given in (("--quick", plan.quick), ("--keep", plan.keep)) if is_given]
        return typed(["run", self.name, *given]) if repeats else plan.command

    def run(self, plan, anew=False):
        """Makes what is not there yet, and the record. True if all went well."""
        with alone_in(plan.results):
            return self.make(plan, anew)

    def make(self, plan, anew):
        path = plan.results / f"{self.name}.json"
        if plan.quick and path.exists() and not record.read(path).get("quick"):
            raise record.InputError(f"{self.name}: {path} is of a whole job: give --quick a --results of its own")
        with contextlib.redirect_stdout(io.StringIO()):
            if plan.only and not self.planned(plan):  # said before anything is moved
                raise record.InputError(f"{self.name}: nothing matches '{plan.only}'")
        for folder in (plan.folder, plan.packings):
            by = {"program": program.checksum(), "quick": plan.quick and folder == plan.folder}
            if not plan.keep and not made_by(folder, by):
                set_aside(folder)
            folder.mkdir(parents=True, exist_ok=True)
            record.write(folder / MADE_BY, by)
        self.jobs(plan)
        jobs = self.choose(plan)
        if not jobs:
            return True  # all of it is left out, and it said so
        for output in (output for job in jobs for output in job.outputs) if anew else ():
            Path(output).unlink(missing_ok=True)  # now, or a run that is stopped would leave them to be taken for its own
        todo = unfinished(jobs, plan.keep)
        if len(todo) < len(jobs):
            print(f"{self.name}: {len(jobs) - len(todo)} of {len(jobs)} jobs are done already")
        runner = Runner(todo, plan.logs)
        runner.run_all()
        failed, data, problem = runner.failed(), None, None
        told = plan.folder / "job.json"
        before = {entry["title"]: entry for entry in (record.load(told)["jobs"] if told.exists() else ()) if entry["exit"]}
        before = [before[job.title] for job in plan.jobs if job.title in before and job not in todo and not job.done(plan.keep)]
        seconds, count = round(runner.elapsed(), 2), len(failed) + len(before)
        record.write(told, {"schema": "nscdd.job/1", "seconds": seconds, "failed": count, "jobs": [*runner.records, *before]})
        try:
            rows = self.rows(plan)
        except OSError as error:
            rows, problem = {}, f"{self.name}: {path} is not written: {error}"
        if rows:
            data = {"schema": f"nscdd.{self.name}/1", "command": self.command(plan), **self.provenance(plan), "quick": plan.quick, **rows}
            data = self.whole(plan, data | ({"left_out": plan.left_out} if plan.left_out else {}))
            record.write(path, data)
            self.draw(plan, data)
            for line in self.told(data):
                print(line)
        print(f"{self.name}: {len(todo) - len(failed)} of {len(todo)} jobs succeeded in {clock(runner.elapsed())}")
        for entry in failed:
            print(f"  failed: {entry['title']}")
        if problem:
            print(problem, file=sys.stderr)
            return False
        return not failed and (data is None or self.passes(data))  # files alone, such as packings, make no record


@contextlib.contextmanager
def alone_in(results):
    """Nobody else makes studies there meanwhile. Raises InputError."""
    results.mkdir(parents=True, exist_ok=True)
    with (results / ".lock").open("a") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise record.InputError(f"suite: another run is at work in {results}: wait for it, or give another --results") from None
        yield


def made_by(folder, program_and_kind):
    """Whether what is there was made by this program."""
    path = folder / MADE_BY
    return path.exists() and record.load(path) == program_and_kind


def set_aside(folder):
    """What another program made stays, under a name that nothing has. Raises InputError for a folder of somebody else."""
    if not folder.exists() or all(path.name == "quick" for path in folder.iterdir()):
        return
    if not (folder / MADE_BY).exists():
        raise record.InputError(f"{folder}: not made by the suite, for it has no {MADE_BY}: move it, give another --results, or --keep to use what is in it")
    names = (f"{folder.name}-before{f'-{k}' if k else ''}" for k in itertools.count())
    before = next(path for path in map(folder.with_name, names) if not path.exists())
    folder.rename(before)
    print(f"{folder}: made by another program, now {before}")


def installed(*modules):
    return all(importlib.util.find_spec(name) for name in modules)


def typed(arguments):
    return shlex.join(["scripts/suite", *arguments])
