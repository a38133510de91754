"""Which measured times are believed, those of processes that had their cores (harness/program/files/load.hpp); and which of two are different."""
import functools
import math
import resource
import statistics
import time
from pathlib import Path

CORES = 0.95  # CPU over wall time, below which a process was kept waiting
TRIES = 3  # of a measurement, until it is believed
LEAST_PAIRS = 11  # runs of each side; of fewer no order is as rare as SIGNIFICANT
SIGNIFICANT, MATERIAL = 0.001, 0.01  # probability among equal commands; a median ratio that is worth a word


@functools.cache
def processor():
    """Its name, as records have it: times of another one are no times of this one."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")


def busy(cores):
    """Of a row's least `cores`; None, of records made before loads were measured, is taken as it is."""
    return cores is not None and cores < CORES


def cores_of(told):
    """Least cores of a run's processes, from its JSON; None where it says nothing, or threads wait for each other."""
    load = told.get("load")
    return load["cores"]["least"] if load and load["believed"] is not None else None


def least(cores):
    """Of several measurements that stand or fall together; None of none."""
    return min((value for value in cores if value is not None), default=None)


def believed(measure):
    """The first of at most TRIES results of measure() that was not made on a busy machine, or the last. Result: a dict with `cores`, or None."""
    for _ in range(TRIES):
        result = measure()
        if result is None or not busy(result.get("cores")):
            break
    return result


def taken(run):
    """What run() returns, and user seconds, CPU seconds and wall seconds of the processes that it has waited for."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = run()
    wall, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    user = after.ru_utime - before.ru_utime
    return done, user, user + after.ru_stime - before.ru_stime, wall


def compared(a, b):
    """B's seconds against A's, run by run in turn: median ratio, its probability among equal commands by Wilcoxon's signed-rank test (None of fewer
    than LEAST_PAIRS), and the verdict on B."""
    from scipy import stats  # the page is drawn without it

    logs = [math.log(theirs / ours) for ours, theirs in zip(a, b)]
    ratio = math.exp(statistics.median(logs))
    if len(logs) < LEAST_PAIRS:
        return {"ratio": ratio, "p": None, "verdict": "too few runs"}
    p = float(stats.wilcoxon(logs).pvalue) if any(logs) else 1.0
    differs = p < SIGNIFICANT and abs(ratio - 1) > MATERIAL
    return {"ratio": ratio, "p": p, "verdict": ("slower" if ratio > 1 else "faster") if differs else "no difference"}
