"""Long runs to the default tolerance, judged by their energy: none may come out of nothing.

Rows are made as in exact.py. A step that did not converge within the cap of iterations may be as wrong as it is, for the
run then ends with exit code 3; energy it must not gain either. --quick runs a tenth of the steps.
"""
import math

import numpy as np
from exact import ROUND_OFF, gravity, masses, radii

ALLOWED = 1e-6  # gain over the largest energy so far: the bound that the project states


def balance(case, result):
    """The largest gain of energy, beyond what gravity and walls put in, and the largest rise of the work of contacts, each
    over the largest energy until then. Heights are measured from where each grain would lie on the floor, z = 0."""
    e = {key: np.array(values, float) for key, values in result.json["energy"].items()}
    height = np.array([g["position"][-1] for g in case.scene["grain"]]) - radii(case.scene)
    start = e["before"][0] + gravity(case.scene) * float(masses(case.scene) @ height)
    gain = e["kinetic"] - e["before"][0] - np.cumsum(e["external"] + e["walls"])
    energy = start + gain + np.cumsum(e["walls"])
    largest = np.maximum.accumulate(np.maximum(start, energy))
    work = np.concatenate([[0.0], np.cumsum(e["normal"] + e["friction"])])
    rise = work - np.minimum.accumulate(work)
    return max(0.0, float((gain / largest).max())), float((rise[1:] / largest).max())


def kept(case):
    """Contacts only take energy: without friction for every e <= 1, with friction for e = 0."""
    result = case.long_run()
    gain, rise = balance(case, result)
    yield case.row("largest gain of energy / largest energy so far", 0, gain, ALLOWED, "law: contacts only take, to the bound stated",
                   result, relation="<=") | {"exit": result.exit}
    yield case.row("largest rise of the contacts' work / largest energy so far", 0, rise, ALLOWED,
                   "law: contacts only take, to the bound stated", result, relation="<=")


def stays(case):
    """Both at rest. A converged step leaves each of the two contacts a normal velocity of at most the velocity error times
    the mean change of velocity, which is g h but for such errors; one that did not converge what its penetration says."""
    yield from kept(case)
    result, scene = case.long_run(), case.scene
    h, radius = scene["step"]["h"], min(radii(scene))
    each = 1.1 * result.json["velocity_error_allowed"] * gravity(scene) * h
    penetration = np.array(result.json["penetration"]) * radius
    sinks = float(np.minimum(penetration, h * each).sum() if result.exit == 0 else penetration.sum())
    source = "law: the velocity error of its two contacts" if result.exit == 0 else "law: what the steps were allowed"
    found = scene["grain"][-1]["position"][-1] - result.x[-1, -1]
    yield case.row("the upper sinks / least R", 0, found / radius, 2 * sinks / radius + ROUND_OFF, source, result, relation="<=")
    if result.exit == 0:
        speed = float(np.abs(result.velocity).max())
        yield case.row("largest velocity at the end", 0, speed, 2 * each, "law: the velocity error of its two contacts", result)


def heap(case):
    """One ball on one stays; on sixteen it may push them apart, and then no place is known but that overlaps keep to what
    the steps allowed."""
    if len(case.scene["grain"]) == 2:
        yield from stays(case)
        return
    yield from kept(case)
    result = case.long_run()
    yield case.row("largest overlap / R", math.fsum(result.json["penetration"]), result.json["final"]["max_overlap"], ROUND_OFF,
                   "law: what the steps were allowed", result, relation="<=")


FAMILIES = {"pair": stays, "heap": heap, "rebound": kept}
