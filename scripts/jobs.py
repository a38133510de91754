"""Commands that make files from others, run two at a time where nothing is timed, with progress and a log each."""
import concurrent.futures
import dataclasses
import json
import os
import re
import shlex
import subprocess
import sys
import threading
import time
from pathlib import Path

from progress import clock, environment, left

sys.path.append(str(Path(__file__).resolve().parent.parent / "reports"))
from nscdd_report.times import TRIES, busy, cores_of  # noqa: E402


@dataclasses.dataclass
class Job:
    title: str  # for the progress line
    commands: list  # argument lists, run one after the other, stopping at the first that fails
    outputs: list  # files made; removed beforehand, so that a failure leaves no older result behind
    needs: list  # files that earlier jobs make
    cost: float
    alone: bool = False  # its times are reported
    fine: tuple = (0,)  # exit codes that are no failure

    @property
    def name(self):
        return re.sub(r"\W+", "-", self.title)


def disturbed(job):
    """Whether a run that it timed did not have its cores."""
    told = (json.loads(Path(path).read_text()) for path in job.outputs if str(path).endswith(".json") and Path(path).exists())
    return any(busy(cores_of(one)) for one in told)


class Runner:
    """Runs jobs, prints progress, and keeps a record of each."""

    def __init__(self, jobs, logs):
        self.jobs, self.logs, self.env = jobs, logs, environment()
        self.began, self.cost_done, self.started, self.records = time.monotonic(), 0.0, 0, []
        self.lock = threading.Lock()

    def elapsed(self):
        return time.monotonic() - self.began

    def failed(self):
        return [record for record in self.records if record["exit"]]

    def announce(self, job):
        elapsed = self.elapsed()
        with self.lock:
            self.started += 1
            about = left(elapsed, self.cost_done, sum(j.cost for j in self.jobs))
            print(f"[{self.started}/{len(self.jobs)}] {job.title} ... (elapsed {clock(elapsed)}{about})", flush=True)

    def run(self, job):
        self.announce(job)
        for output in job.outputs:
            Path(output).unlink(missing_ok=True)
        began, code, failed = time.monotonic(), 0, None
        log = self.logs / f"{job.name}.log"
        missing = [need for need in job.needs if not Path(need).exists()]
        with log.open("w") as stream:
            if missing:
                code, failed = 1, job.commands[0]
                stream.write(f"not run, for lack of {', '.join(missing)}\n")
            else:
                for _ in range(TRIES):
                    code, failed = self.run_commands(job, stream)
                    if code or not job.alone or not disturbed(job):
                        break
                    stream.write("the machine was busy: again\n")
        with self.lock:
            self.cost_done += job.cost
            if code:
                lines = [line for line in log.read_text(errors="replace").splitlines() if not line.startswith("$ ")]
                tail = "".join(f"\n  | {line}" for line in lines[-8:])
                print(f"FAILED (exit {code}): {job.title}\n  $ {shlex.join(failed)}{tail}", flush=True)
            self.records.append({"title": job.title, "commands": [shlex.join(c) for c in job.commands],
                                 "seconds": round(time.monotonic() - began, 2), "exit": code})

    def run_commands(self, job, stream):
        """Exit code, and the command that failed, or None."""
        for command in job.commands:
            stream.write(f"$ {shlex.join(command)}\n")
            stream.flush()
            try:
                code = subprocess.run(command, stdout=stream, stderr=subprocess.STDOUT, env=self.env).returncode
            except OSError as error:
                stream.write(f"{error}\n")
                code = 127
            if code not in job.fine:
                return code, command
        return 0, None

    def run_all(self):
        """Two at a time, each as soon as the jobs that make what it needs have ended; one that must run alone after all before it."""
        workers = min(2, os.cpu_count() or 1)
        waiting, running = list(self.jobs), {}
        with concurrent.futures.ThreadPoolExecutor(workers) as pool:
            while waiting or running:
                for job in list(waiting):
                    if len(running) == workers or job.alone and running:
                        break
                    unmade = {str(output) for other in [*waiting, *running.values()] if other is not job for output in other.outputs}
                    if unmade.isdisjoint(map(str, job.needs)):
                        waiting.remove(job)
                        running[pool.submit(self.run, job)] = job
                    if job.alone:
                        break
                done, _ = concurrent.futures.wait(running, return_when=concurrent.futures.FIRST_COMPLETED)
                for future in done:
                    del running[future]
                    future.result()
