"""The one engine: jobs that make files from others, two at a time where nothing is timed, with progress, a log each, and time left."""
import concurrent.futures
import dataclasses
import functools
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path

from . import record
from .program import ROOT, Failed, environment, words
from .times import TRIES, busy, cores_of, processor

MADE = ".made"  # folder beside what jobs make: of each, from what it was made, or "failed"
SUITE = Path(__file__).parent
MAKE_NO_NUMBER = {"cli", "compare_times", "counted", "jobs", "study", "captions", "figures", "made_up", "section"}  # files of the suite and of its studies


def clock(seconds):
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def left(elapsed, done, total):
    """ ", about 1:23 left" by the share of the cost that is done; nothing before there is one."""
    return f", about {clock(elapsed * (total - done) / done)} left" if done > 0 else ""


@functools.cache
def source(name):
    """Digest of the files that say what a module's functions do: those of its study, of studies that it imports something from, and those that all share."""
    module, found = sys.modules[name], {*SUITE.iterdir()}
    for one in {module, *(sys.modules.get(getattr(value, "__module__", None)) for value in list(vars(module).values()))}:
        file = Path(getattr(one, "__file__", None) or "-")
        if one is module or file.is_relative_to(SUITE / "studies"):
            found.update(file.parent.iterdir() if file.parent.parent == SUITE / "studies" else [file])
    texts = (path.read_bytes() for path in sorted(found) if path.suffix in (".py", ".toml") and path.stem not in MAKE_NO_NUMBER)
    return hashlib.sha256(b"".join(texts)).hexdigest()


@dataclasses.dataclass(eq=False)
class Job:
    """Commands, or a function whose rows become the file of its only output."""

    title: str  # of the progress line; --only looks in it
    outputs: list  # files made; removed beforehand, so that a failure leaves no older result behind
    commands: list = ()  # argument lists, run one after the other, stopping at the first that fails
    work: Callable = None  # instead of commands: () -> JSON, or None where it made its outputs itself; raises Failed
    needs: list = ()  # files that earlier jobs make
    cost: float = 1.0  # seconds of one core, about: for the time left
    alone: bool = False  # its times are reported
    small: bool = False  # one of hundreds, of which one in twenty is announced
    fine: tuple = (0, 3)  # exit codes that are no failure
    folder: Path = Path("-")  # of the study: files there are made, and read where `needs` names them

    def __post_init__(self):
        self.outputs, self.needs = ([str(path) for path in paths] for paths in (self.outputs, self.needs))
        self.commands = [words(command) for command in self.commands]
        self.log = re.sub(r"\W+", "-", self.title) + ".log"
        self.read, self.function = {*self.needs, *(word for command in self.commands for word in command)}, getattr(self.work, "func", self.work)
        modules = (word.removeprefix("nscdd_suite.") for command in self.commands for word in command if word.startswith("nscdd_suite."))
        self.read |= {f"{SUITE / module.replace('.', '/')}.py" for module in modules}  # of program.python()
        about = [getattr(self.work, "args", ()), getattr(self.function, "__self__", None)]
        self.told = json.dumps(about, default=self.plain) if self.work else self.commands  # now: the work may give its arguments more fields

    def plain(self, value):
        """An argument of its function, for JSON: a path, whose file it reads, or a name and fields."""
        if isinstance(value, Path):
            if not value.is_relative_to(self.folder):
                self.read.add(str(value))
            return str(value)
        fields = [field.name for field in dataclasses.fields(value) if field.compare] if dataclasses.is_dataclass(value) else getattr(value, "__dict__", ())
        return [getattr(value, "__qualname__", type(value).__name__), {name: getattr(value, name) for name in fields}]

    def unmade(self):
        return [output for output in self.outputs if not Path(output).exists()]

    def inputs(self):
        """Digest of what it makes its outputs from: its commands, or its function's arguments and source; the files that it reads; the processor of times."""
        whole = hashlib.sha256(repr([self.told, self.work and source(self.function.__module__), self.alone and processor()]).encode())
        for path in sorted(self.read - set(self.outputs)):
            if os.path.isfile(path) and not os.access(path, os.X_OK):  # of the program the folder has a checksum (study.py)
                with open(path, "rb") as file:
                    whole.update(hashlib.file_digest(file, "sha256").digest())
        return whole.hexdigest()

    def made(self):
        """The file that says from what its outputs were made; studies share packings, and this file with them."""
        first = Path(self.outputs[0])
        return first.parent / MADE / first.name

    def done(self, keep=False):
        """Whether all that it makes is there, made from what is there now (or from anything, to `keep` it), and it did not fail: what failed may
        leave files as well, such as a comparison that disagrees."""
        if self.unmade():
            return False
        made_from = self.made().read_text() if self.made().exists() else ""
        return made_from == self.inputs() or keep and made_from != "failed"

    def disturbed(self):
        """Whether a run that it timed did not have its cores."""
        return any(busy(cores_of(record.load(path))) for path in self.outputs if path.endswith(".json") and Path(path).exists())


def chosen(jobs, only=""):
    """Those whose title matches, after what they need; those that must run alone last."""
    return with_needs(jobs, [job for job in jobs if re.search(only, job.title)])


def with_needs(jobs, wanted):
    """Some of the jobs, after what they need; those that must run alone last."""
    order, makes = [], {output: job for job in jobs for output in job.outputs}

    def visit(job):
        for need in job.needs:
            if need in makes:
                visit(makes[need])
        if job not in order:
            order.append(job)

    for job in wanted:
        visit(job)
    return sorted(order, key=lambda job: job.alone)


def unfinished(jobs, keep):
    """Jobs that are not done, and those that need what these make; each is after what it needs."""
    todo, remade = [], set()
    for job in jobs:
        if not job.done(keep) or not keep and remade.intersection(job.needs):
            todo.append(job)
            remade.update(job.outputs)
    return todo


class Runner:
    """Runs jobs, prints progress, and keeps a record of each."""

    def __init__(self, jobs, logs):
        self.jobs, self.logs = jobs, Path(logs)
        self.began, self.cost_done, self.started, self.records = time.monotonic(), 0.0, 0, []
        self.lock = threading.Lock()

    def elapsed(self):
        return time.monotonic() - self.began

    def failed(self):
        return [entry for entry in self.records if entry["exit"]]

    def announce(self, job):
        with self.lock:
            self.started += 1
            if not job.small or self.started % 20 == 1:
                about = f"elapsed {clock(self.elapsed())}{left(self.elapsed(), self.cost_done, sum(one.cost for one in self.jobs))}"
                print(f"[{self.started}/{len(self.jobs)}] {job.title} ... ({about})", flush=True)

    def run(self, job):
        if job.done():
            return  # what it needs was made again, and is the same
        self.announce(job)
        job.made().parent.mkdir(parents=True, exist_ok=True)
        job.made().write_text("failed")  # until it has ended
        for output in map(Path, job.outputs):
            output.unlink(missing_ok=True)
            output.parent.mkdir(parents=True, exist_ok=True)
        began, log = time.monotonic(), self.logs / job.log
        with log.open("w") as stream:
            code, failed = self.make(job, stream)
            if not code and job.unmade():
                code = 1
                stream.write(f"made no {', '.join(job.unmade())}\n")
        if not code:
            job.made().write_text(job.inputs())  # now, as a command may read what one before it has made
        with self.lock:
            self.cost_done += job.cost
            if code:
                tail = [line for line in log.read_text(errors="replace").splitlines() if not line.startswith("$ ")][-8:]
                print("\n  ".join([f"FAILED (exit {code}): {job.title}", f"$ {failed}", *(f"| {line}" for line in tail)]), flush=True)
            told = {"title": job.title, "commands": list(map(shlex.join, job.commands)), "seconds": round(time.monotonic() - began, 2), "exit": code}
            self.records.append(told)

    def make(self, job, stream):
        """Exit code, and what failed."""
        if missing := [need for need in job.needs if not Path(need).exists()]:
            stream.write(f"not run, for lack of {', '.join(missing)}\n")
            return 1, job.title
        if job.work:
            return self.work(job, stream), job.title
        for _ in range(TRIES):
            code, failed = self.run_commands(job, stream)
            if code or not job.alone or not job.disturbed():
                break
            stream.write("the machine was busy: again\n")
        return code, failed

    def work(self, job, stream):
        try:
            made = job.work()
            if made is not None:
                record.write(job.outputs[0], made)
            return 0
        except Failed as problem:
            stream.write(f"{problem}\n")
        except Exception:  # noqa: BLE001  (a mistake in one job is no reason to lose the others)
            stream.write(traceback.format_exc())
        return 1

    def run_commands(self, job, stream):
        for command in job.commands:
            stream.write(f"$ {shlex.join(command)}\n")
            stream.flush()
            try:
                code = subprocess.run(command, cwd=ROOT, stdout=stream, stderr=subprocess.STDOUT, env=environment()).returncode
            except OSError as error:
                stream.write(f"{error}\n")
                code = 127
            if code not in job.fine:
                return code, shlex.join(command)
        return 0, ""

    def run_all(self):
        """Two at a time, each as soon as the jobs that make what it needs have ended; one that must run alone after all before it."""
        self.logs.mkdir(parents=True, exist_ok=True)
        workers = min(2, os.cpu_count() or 1)
        waiting, running = list(self.jobs), {}
        with concurrent.futures.ThreadPoolExecutor(workers) as pool:
            while waiting or running:
                for job in list(waiting):
                    if len(running) == workers or job.alone and running:
                        break
                    unmade = {output for other in [*waiting, *running.values()] if other is not job for output in other.outputs}
                    if unmade.isdisjoint(job.needs):
                        waiting.remove(job)
                        running[pool.submit(self.run, job)] = job
                    if job.alone:
                        break
                done, _ = concurrent.futures.wait(running, return_when=concurrent.futures.FIRST_COMPLETED)
                for future in done:
                    del running[future]
                    future.result()
