"""Long runs to the default tolerance, judged by their energy: none may come out of nothing.

Rows are made as in exact.py. A step that did not converge within the cap of iterations may be as wrong as it is, for the
run then ends with exit code 3; energy it must not gain either. --quick runs a tenth of the steps.
"""
import re

import numpy as np
from .exact import ROUND_OFF, overlap

ALLOWED = 1e-6  # gain over the largest energy so far: the bound that the project states
PASSES = re.compile(r"nscdd: step (\d+): .* pass into or through each other")


def long_run(case, may_be_refused=False):
    """All steps, converged or not, and the exit code. `may_be_refused`: when a grain becomes too fast for the step, which the
    program says, the steps before."""
    count = case.count // (10 if case.quick else 1)
    result = case.run(steps=count, exits=(0, 1, 3) if may_be_refused else (0, 3))
    if result.exit != 1:
        return result, result.exit
    refused = PASSES.search(result.errors)
    return case.run(steps=int(refused[1]) - 1 if refused else count, exits=(0, 3)), 1


def balance(case, result):
    """The largest gain of energy, beyond what gravity and walls put in, and the largest rise of the work of contacts, each
    over the largest energy until then. Heights are measured from where each grain would lie on the floor, z = 0."""
    e = {key: np.array(values, float) for key, values in result.json["energy"].items()}
    start = e["before"][0] + case.g * float(case.m @ (case.of_grains("position")[:, -1] - case.radii))
    gain = e["kinetic"] - e["before"][0] - np.cumsum(e["external"] + e["walls"])
    energy = start + gain + np.cumsum(e["walls"])
    largest = np.maximum.accumulate(np.maximum(start, energy))
    work = np.concatenate([[0.0], np.cumsum(e["normal"] + e["friction"])])
    rise = work - np.minimum.accumulate(work)
    return max(0.0, float((gain / largest).max())), float((rise[1:] / largest).max())


def gained(case, result, code):
    """Contacts only take energy: without friction for every e <= 1, with friction for e = 0. The rise of their work is told
    and not judged: where weight was not carried in one step, it is lifted in a later one."""
    (gain, rise), name = balance(case, result), "largest gain of energy / largest energy so far"
    row = case.row(name, 0, gain, ALLOWED, "law: contacts only take; the bound is stated", result, relation="<=")
    return row | {"exit": code, "rise": rise}


def stays(case):
    """Both at rest. A converged step leaves each of the two contacts a normal velocity of at most the velocity error times
    the mean change of velocity, which is g h but for such errors; one that did not converge what its penetration says."""
    result, code = long_run(case)
    yield gained(case, result, code)
    radius = case.radii.min()
    each = 1.1 * result.json["max_velocity_error"] * case.g * case.h
    penetration = np.array(result.json["penetration"]) * radius
    sinks = float(np.minimum(penetration, case.h * each).sum() if code == 0 else penetration.sum())
    source = "law: the velocity error of its two contacts" if code == 0 else "law: what the steps were allowed"
    found = case.scene["grain"][-1]["position"][-1] - result.x[-1, -1]
    yield case.row("the upper sinks / least R", 0, found / radius, 2 * sinks / radius + ROUND_OFF, source, result, relation="<=")
    if code == 0:
        yield case.row("largest velocity at the end", 0, float(np.abs(result.velocity).max()), 2 * each, source, result)


def heap(case):
    """One ball on one stays; on sixteen it may push them apart, and then no place is known but that overlaps keep to what
    the steps allowed."""
    if len(case.m) == 2:
        yield from stays(case)
        return
    result, code = long_run(case)
    yield gained(case, result, code)
    yield overlap(case, result)


def rebound(case):
    """A light ball between a heavy one and the floor, e near 1, carries it by ever faster rebounds in an ever smaller gap."""
    yield gained(case, *long_run(case, may_be_refused=True))


FAMILIES = {"pair": stays, "heap": heap, "rebound": rebound}
