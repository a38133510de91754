"""Rows and curves: what is measured in runs and packings, each beside what is published (published.py).

`runs` has what is there, by name; `packings`: (path, dimension, generator, why it cannot be made). Each of_...() returns {name in published.toml: row}
of what was made."""
import dataclasses
import math
from pathlib import Path

import numpy as np

from ... import record
from . import granular
from .published import EXPECTED, FILE, jamming, not_made, round_to, row, same

BINS = 60  # of a curve
POWER, POWER_ERROR = 0.4, 0.05  # of the inertial number, with which strength without friction exceeds that at rate 0 (peyneau)
SPREAD = {"q/p": "q/p", "volumetric": "volumetric strain", "coordination": "coordination"}  # columns that are compared, and their names


@dataclasses.dataclass
class Run:
    """A run that was made: its JSON, its time series, the file of its frames."""

    told: dict
    series: dict
    frames: Path

    @property
    def command(self):
        return self.told["command"]

    def core(self, rows=slice(None)):
        """{step: solid fraction of the core}, of the frames from the first of some rows of the series on."""
        first = self.series["step"][rows][0]
        return {step: phi for step, phi in granular.fractions(self.frames, self.told["dimension"]).items() if step >= first}

    def window(self, rows, grains):
        """Some rows of the series, up to the last, in words."""
        return f"{self.told['grains']} {grains}, mean of axial strains {self.series['axial'][rows][0]:.2f} to {self.series['axial'][-1]:.2f}"

    def inertia(self, rows=slice(None)):
        return float(np.median(self.series["inertial_number"][rows]))

    def angle(self, rows):
        """Friction angle of some rows of the series and its standard error, degrees."""
        mean, error = granular.mean_and_error(self.series["sine"][rows])
        return granular.degrees(mean), math.degrees(error / math.sqrt(1 - mean**2))


def load(folder, name):
    """A run, or None where it has not been made."""
    table, series, frames = (folder / f"{name}.{kind}" for kind in ("json", "csv", "frames.h5"))
    return Run(record.load(table), granular.series(series), frames) if table.exists() and series.exists() else None


def bins(*series):
    """Edges between 0 and the axial strain that all have got to, a few steps apart at least."""
    return np.linspace(0, min(told["axial"][-1] for told in series), min(BINS, len(series[0]["axial"]) // 5) + 1)


def few(values, digits=5):
    """For JSON: few digits, null for NaN."""
    return [round_to(value, digits) for value in map(float, values)]


def rows_of(run, measured, **found):
    """{name: row} of {name: (value, standard error)}, what was measured in a run; found: what the notes say of it."""
    return {key: row(EXPECTED[key], *pair, run.command, **found) for key, pair in measured.items() if key in EXPECTED}


def middles(edges):
    return few((edges[1:] + edges[:-1]) / 2)


def curve(run):
    """A shear test in a few points."""
    edges = bins(run.series)
    at = {int(step): strain for step, strain in zip(run.series["step"], run.series["axial"])}
    names = {name: name for name in ("sine", "q/p", "volumetric", "coordination", "fabric")}
    names |= {f"{name} total": f"{name}_total" for name in ("work_walls", "dissipated_friction", "dissipated_impact")}
    columns = {name: few(granular.binned(run.series, column, edges)) for name, column in names.items()}
    core = run.core()
    return {"axial": middles(edges), **columns, "core": {"axial": few(at[step] for step in core), "solid fraction": few(core.values())}}


def rows_of_spread(runs, curves):
    """Whether runs by NSCDD and by NLGS are of one kind."""
    groups = {solver: [run for name, run in runs.items() if name.startswith(f"spread-{solver}")] for solver in ("nlgs", "dcs")}
    if any(len(group) < 2 for group in groups.values()):
        return [not_made(same(quantity), "no run") for quantity in SPREAD.values()]
    edges = bins(*(run.series for group in groups.values() for run in group))
    curves["spread"], rows = {"axial": middles(edges)}, []
    for key, quantity in SPREAD.items():
        nlgs, dcs = (np.array([granular.binned(run.series, key, edges) for run in group]) for group in groups.values())
        curves["spread"][key] = {"nlgs": list(map(few, nlgs)), "dcs": list(map(few, dcs))}
        found = {"nscdd": len(dcs), "nlgs": len(nlgs), "apart": granular.distance(dcs, nlgs)}
        found |= {"spread": np.sqrt(np.nanmean(np.nanvar(nlgs, axis=0, ddof=1))), "within": 100 * np.mean((dcs >= nlgs.min(0)) & (dcs <= nlgs.max(0)))}
        rows.append(row(same(quantity), granular.permutation(dcs, nlgs), None, groups["dcs"][-1].command, **found))
    return rows


def peak(run):
    """Strain, friction angle and rate of dilation at the peak of the strength, over 2 % of strain."""
    series = run.series
    width = min(0.02, series["axial"][-1] / 4)
    places = np.linspace(width / 2, series["axial"][-1] - width / 2, 100)
    windows = [np.abs(series["axial"] - place) <= width / 2 for place in places]
    best = max(range(len(places)), key=lambda k: series["sine"][windows[k]].mean())
    return places[best], granular.degrees(series["sine"][windows[best]].mean()), *granular.slope(series, windows[best])


def of_spheres(runs):
    """The critical state of spheres with friction."""
    if not (run := runs.get("triaxial")):
        return {}
    series, rows = run.series, granular.last(run.series)
    critical, error = run.angle(rows)
    where, highest, rate, rate_error = peak(run)
    measured = {
        "sphere angle": (critical, error),
        "sphere fraction": granular.mean_and_error(list(run.core(rows).values())),
        "sphere dilation": granular.slope(series, rows),
        "sphere peak": (highest - critical - 10 * rate, math.hypot(error, 10 * rate_error)),
        "sphere contacts": granular.mean_and_error(series["coordination"][rows]),
        "sphere fabric": granular.mean_and_error(3 * series["fabric"][rows] / series["q/p"][rows]),
    }
    found = {"window": run.window(rows, "spheres"), "highest": highest, "where": where, "rate": rate, "critical": critical}
    found |= {name: series[name][rows].mean() for name in ("fabric", "solid_fraction")} | {"q_p": series["q/p"][rows].mean()}
    return rows_of(run, measured, **found, anisotropy=2.5 * found["fabric"], rattlers=100 * series["rattlers"][rows].mean())


def of_rates(runs):
    """Spheres with friction at two rates, at the same strains."""
    run, slow = runs.get("triaxial"), runs.get("triaxial-slow")
    if not (run and slow):
        return {}
    low, axial = granular.last(slow.series), slow.series["axial"]
    both = (run.series["axial"] >= axial[low][0]) & (run.series["axial"] <= axial[-1])
    (fast, one), (calm, other) = run.angle(both), slow.angle(low)
    measured = {"sphere rate": (calm - fast, math.hypot(one, other))}
    return rows_of(slow, measured, calm=calm, fast=fast, rates=(slow.inertia(low), run.inertia(both)))


def of_spheres_without_friction(runs):
    run, slow = runs.get("frictionless"), runs.get("frictionless-slow")
    if not (run and slow):
        return {}
    halves = [granular.last(one.series, 1 / 2) for one in (run, slow)]
    (fast, one), (calm, other) = run.angle(halves[0]), slow.angle(halves[1])
    rates = run.inertia(halves[0]), slow.inertia(halves[1])

    def limit(power):
        """The strength without rate, where what exceeds it is a power of the rate."""
        ratio = (rates[0] / rates[1]) ** power
        return (ratio * calm - fast) / (ratio - 1), math.hypot(ratio * other, one) / (ratio - 1)

    value, error = limit(POWER)
    error = math.hypot(error, limit(POWER + POWER_ERROR)[0] - value)
    core = list(slow.core().values())
    half = core[len(core) // 2 :]
    measured = {"free angle": (value, error), "free dilation": (np.mean(half) - core[0], granular.mean_and_error(half)[1])}
    found = {"fast": fast, "calm": calm, "rates": rates, "power": POWER, "power_error": POWER_ERROR, "axial": slow.series["axial"][-1]}
    return rows_of(slow, measured, **found, first=core[0], mean=np.mean(half))


def of_disks(runs):
    if not (run := runs.get("biaxial")):
        return {}
    series, rows = run.series, granular.last(run.series)
    measured = {
        "disk sine": granular.mean_and_error(series["sine"][rows]),
        "disk fraction": granular.mean_and_error(list(run.core(rows).values())),
        "disk dilation": granular.slope(series, rows),
    }
    found = {name: series[name][rows].mean() for name in ("coordination", "fabric")}
    return rows_of(run, measured, window=run.window(rows, "disks"), **found)


def of_forces(runs, curves):
    found = {}
    for grains, name, first in (("disk", "biaxial", 2 / 3), ("free", "isotropic", 1 / 2), ("sphere", "triaxial", 2 / 3)):
        if not (run := runs.get(name)):
            continue
        begin = run.series["step"][granular.last(run.series, 1 - first)][0] if name != "isotropic" else first * run.told["steps"]
        parts = list(granular.forces(run.frames, run.told["dimension"], begin))
        f = np.concatenate([part["f"] for part in parts])
        line, edges = granular.tail(f), np.concatenate([np.linspace(0, 1, 11), np.linspace(1, 8, 36)[1:]])
        counts = np.histogram(f, edges)[0]
        density = {"f": middles(edges), "P": few(counts / np.diff(edges) / len(f), 4), "counts": counts.tolist()}
        fitted = {"decay": round_to(line["beta"]), "above the mean": round_to((f > 1).mean()), "at the mean": round_to(line["start"])}
        curves.setdefault("forces", {})[name] = density | fitted
        weak, pressure, deviator = (granular.mean_and_error([part[kind] for part in parts]) for kind in ("weak", "weak pressure", "weak deviator"))
        power = granular.power(f), granular.mean_and_error([granular.power(part["f"]) for part in parts])[1]
        measured = {f"{grains} decay": (line["beta"], line["error"]), f"{grains} tail": (line["R2"], None), f"{grains} power": power}
        measured |= {"weak deviator": deviator} if grains == "disk" else {}
        told = {"forces": len(f), "frames": len(parts), "end": line.get("end", 1), "decay": granular.decay(f), "decay_of_twice": granular.decay(f, 2.0)}
        found |= rows_of(run, measured, **told, weak=100 * weak[0], pressure=100 * pressure[0])
    return found


def rows_of_jamming(packings):
    rows = []
    for name, (path, dimension, generator, why) in packings.items():
        there = path.exists() and not why
        told = granular.packing(path) if there else {}
        by = f": {told['grains'] if there else name}, by {'LAMMPS' if generator == 'lammps' else 'our contact dynamics'}"
        for key, expected in jamming(dimension).items():
            expected |= {"quantity": expected["quantity"] + by}
            if not there:
                rows.append(not_made(expected, why or "no packing"))
                continue
            half, twice = told["isostatic of other gaps"]
            found = {"free": 100 * told["free"], "gap": granular.GAP, "coordination": told["coordination"], "half": half, "twice": twice}
            found["widened"] = "; half the gap is less than the shrink that took overlaps away" if half == 0 else ""
            rows.append(row(expected, told[key], None, told["command"], **found))
    return rows


def of_care(runs):
    """Whether the runs were slow, fine and exact enough for what is said of them."""
    shear = {name: run for name, run in runs.items() if name != "isotropic"}
    framed = {name: run for name, run in runs.items() if run.frames.exists()}
    moved = {name: granular.motion(run.frames, run.told["dimension"], run.told["h"]) for name, run in framed.items() if name in shear}
    steps, capped = (sum(run.told[key] for run in runs.values()) for key in ("steps", "unconverged_steps"))
    largest = max((value[1] for value in moved.values()), default=math.nan)
    measures = {
        "inertia": {name: run.inertia() for name, run in shear.items()},
        "motion": {name: value[0] for name, value in moved.items()},
        "overlap": {name: granular.overlap(run.frames) for name, run in framed.items()},
        "energy": {name: float(run.series["energy_error"].max()) for name, run in runs.items()},
    }
    worst = {key: max(values, key=values.get) for key, values in measures.items() if values}
    told, found = {"steps": steps, "capped": capped, "largest": largest}, {}
    for key, name in worst.items():
        found |= rows_of(runs[name], {key: (measures[key][name], None)}, name=name, **told)
    return found


def all_rows(runs, packings):
    """Rows, and the curves of the figures."""
    curves = {"shear": {name: curve(run) for name, run in runs.items() if name != "isotropic" and not name.startswith("spread")}}
    spread = rows_of_spread(runs, curves)
    found = of_spheres(runs) | of_rates(runs) | of_spheres_without_friction(runs) | of_disks(runs) | of_forces(runs, curves) | of_care(runs)
    shear, forces, care = ([found.get(key) or not_made(EXPECTED[key], "no run") for key in FILE[kind]] for kind in ("shear", "forces", "care"))
    return [*spread, *shear, *rows_of_jamming(packings), *forces, *care], curves
