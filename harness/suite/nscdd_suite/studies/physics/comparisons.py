"""Rows and curves: what is measured in runs and packings, each beside what is published (published.py).

`runs` has what is there, by name; `packings`: (path, dimension, generator, why it cannot be made). Each of_...() returns {name in published.toml:
(value, standard error, note, command)} of what was made."""
import dataclasses
import math
from pathlib import Path

import numpy as np

from ... import record
from . import granular
from .published import EXPECTED, FILE, jamming, round_to, row, same

BINS = 60  # of a curve
POWER, POWER_ERROR = 0.4, 0.05  # of the inertial number, with which strength without friction exceeds that at rate 0 (peyneau)
NO_RUN = None, None, "no run"
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
        return [row(same(quantity), *NO_RUN) for quantity in SPREAD.values()]
    edges = bins(*(run.series for group in groups.values() for run in group))
    curves["spread"], rows = {"axial": middles(edges)}, []
    for key, quantity in SPREAD.items():
        nlgs, dcs = (np.array([granular.binned(run.series, key, edges) for run in group]) for group in groups.values())
        curves["spread"][key] = {"nlgs": list(map(few, nlgs)), "dcs": list(map(few, dcs))}
        apart = granular.distance(dcs, nlgs)
        spread = float(np.sqrt(np.nanmean(np.nanvar(nlgs, axis=0, ddof=1))))
        within = np.mean((dcs >= nlgs.min(0)) & (dcs <= nlgs.max(0)))
        note = (
            f"{len(dcs)} curves against {len(nlgs)}, each from positions perturbed by 1e-9 radius; means {apart:.2g} apart (rms over strain), "
            f"one NLGS curve varies by {spread:.2g}; {100 * within:.0f} % of the points of DCS are between the least and the largest of NLGS"
        )
        rows.append(row(same(quantity), granular.permutation(dcs, nlgs), command=groups["dcs"][-1].command, note=note))
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
    window, mean = run.window(rows, "spheres"), {name: column[rows].mean() for name, column in series.items()}
    critical, error = run.angle(rows)
    where, highest, rate, rate_error = peak(run)
    highest_note = f"peak {highest:.1f} degrees at strain {where:.3f} where the rate of dilation is {rate:.2f}; critical {critical:.1f} degrees"
    fabric_note = (
        f"{window}; 3 (F_axial - F_lateral) / (q/p), F the mean of n n: what forces alike in all directions would make; anisotropy a of "
        f"1 + a (3 cos^2 - 1): {2.5 * mean['fabric']:.3f}"
    )
    core, contacts = list(run.core(rows).values()), series["coordination"][rows]
    walls = f"{window}; the whole box with layers at the walls has {mean['solid_fraction']:.3f}"
    fabric = 3 * series["fabric"][rows] / series["q/p"][rows]
    return {
        "sphere angle": (critical, error, f"{window}; q/p {mean['q/p']:.3f}; fabric deviator {mean['fabric']:.3f}", run.command),
        "sphere fraction": (*granular.mean_and_error(core), walls, run.command),
        "sphere dilation": (*granular.slope(series, rows), window, run.command),
        "sphere peak": (highest - critical - 10 * rate, math.hypot(error, 10 * rate_error), highest_note, run.command),
        "sphere contacts": (*granular.mean_and_error(contacts), f"{window}; rattlers {100 * mean['rattlers']:.1f} %", run.command),
        "sphere fabric": (*granular.mean_and_error(fabric), fabric_note, run.command),
    }


def of_rates(runs):
    """Spheres with friction at two rates, at the same strains."""
    run, slow = runs.get("triaxial"), runs.get("triaxial-slow")
    if not (run and slow):
        return {}
    low, axial = granular.last(slow.series), slow.series["axial"]
    both = (run.series["axial"] >= axial[low][0]) & (run.series["axial"] <= axial[-1])
    (fast, one), (calm, other) = run.angle(both), slow.angle(low)
    note = f"{calm:.1f} degrees at I = {slow.inertia(low):.1e}, {fast:.1f} at {run.inertia(both):.1e}, same strains"
    return {"sphere rate": (calm - fast, math.hypot(one, other), note, slow.command)}


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
    strength = (
        f"{fast:.2f} degrees at I = {rates[0]:.1e} and {calm:.2f} at {rates[1]:.1e}, last half of the strain; "
        f"what exceeds the limit taken as I to the power {POWER} +- {POWER_ERROR}, after the source"
    )
    change = f"from {core[0]:.4f} to {np.mean(half):.4f}, mean of the last half, axial strain {slow.series['axial'][-1]:.2f}"
    dilation = np.mean(half) - core[0], granular.mean_and_error(half)[1]
    return {"free angle": (value, error, strength, slow.command), "free dilation": (*dilation, change, slow.command)}


def of_disks(runs):
    if not (run := runs.get("biaxial")):
        return {}
    series, rows = run.series, granular.last(run.series)
    window = run.window(rows, "disks")
    sine = f"{window}; contacts per grain {series['coordination'][rows].mean():.2f}, fabric deviator {series['fabric'][rows].mean():.3f}"
    return {
        "disk sine": (*granular.mean_and_error(series["sine"][rows]), sine, run.command),
        "disk fraction": (*granular.mean_and_error(list(run.core(rows).values())), window, run.command),
        "disk dilation": (*granular.slope(series, rows), window, run.command),
    }


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
        n = f"{len(f)} forces of {len(parts)} frames"
        fit = f"{n}; line by least squares through ln P(f) from 1 to {line.get('end', 1):.1f} mean forces"
        likely = f"most likely exponential from the mean on: {granular.decay(f):.2f}, from twice the mean on: {granular.decay(f, 2.0):.2f}"
        alpha = granular.power(f), granular.mean_and_error([granular.power(part["f"]) for part in parts])[1]
        found |= {
            f"{grains} decay": (line["beta"], line["error"], f"{fit}; {likely}", run.command),
            f"{grains} tail": (line["R2"], None, fit, run.command),
            f"{grains} power": (*alpha, f"{n}; between 0.02 and 1 mean force", run.command),
        }
        if grains == "disk":
            weak = {name: granular.mean_and_error([part[name] for part in parts]) for name in ("weak", "weak pressure", "weak deviator")}
            carry = f"{100 * weak['weak'][0]:.0f} % of the contacts are weak and carry {100 * weak['weak pressure'][0]:.0f} % of the pressure"
            found["weak deviator"] = (*weak["weak deviator"], carry, run.command)
    return found


def rows_of_jamming(packings):
    rows = []
    for name, (path, dimension, generator, why) in packings.items():
        there = path.exists() and not why
        told = granular.packing(path) if there else {}
        by = f": {told['grains'] if there else name}, by {'LAMMPS' if generator == 'lammps' else 'our contact dynamics'}"
        notes = dict.fromkeys(("solid fraction", "contacts", "isostatic"), why or "no packing")
        if there:
            others = told["isostatic of other gaps"]
            widened = "; half the gap is less than the shrink that took overlaps away" if others[0] == 0 else ""
            notes["solid fraction"] = f"rattlers {100 * told['free']:.1f} %"
            notes["contacts"] = f"gaps up to {granular.GAP:g} diameters; the file says {told['coordination']} with gaps up to 1e-4"
            notes["isostatic"] = "with half and twice the gap " + " and ".join(f"{x:.3f}" for x in others) + widened
        for key, expected in jamming(dimension).items():
            rows.append(row(expected | {"quantity": expected["quantity"] + by}, told.get(key), None, notes[key], told.get("command", "")))
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
    notes = {
        "inertia": "the first steps, in which the walls begin to move, have more",
        "motion": f"the largest of any grain {largest:.3f}",
        "overlap": "of contacts that carry, the mean of a frame, the largest of all frames",
        "energy": f"{steps} steps, of which {capped} hit the cap of iterations",
    }
    worst = {key: max(values, key=values.get) for key, values in measures.items() if values}
    return {key: (measures[key][name], None, f"{name}; {notes[key]}", runs[name].command) for key, name in worst.items()}


def all_rows(runs, packings):
    """Rows, and the curves of the figures."""
    curves = {"shear": {name: curve(run) for name, run in runs.items() if name != "isotropic" and not name.startswith("spread")}}
    spread = rows_of_spread(runs, curves)
    found = of_spheres(runs) | of_rates(runs) | of_spheres_without_friction(runs) | of_disks(runs) | of_forces(runs, curves) | of_care(runs)
    shear, forces, care = ([row(EXPECTED[key], *found.get(key, NO_RUN)) for key in FILE[kind]] for kind in ("shear", "forces", "care"))
    return [*spread, *shear, *rows_of_jamming(packings), *forces, *care], curves
