"""Rows and curves: what is measured in runs and packings, each beside what is published (published.py).

`runs` has what is there, by name: (JSON, series, path of the frames); `packings`: (path, dimension, generator, why it cannot be made)."""
import math

import numpy as np

from ... import record
from . import granular
from .published import EXPECTED, jamming, round_to, row, same

SOLVERS = ("nlgs", "dcs")
BINS = 60  # of a curve
POWER, POWER_ERROR = 0.4, 0.05  # of the inertial number, with which strength without friction exceeds that at rate 0 (peyneau)


def told(folder, name):
    """A run, or None where it has not been made."""
    table, series, frames = (folder / f"{name}.{kind}" for kind in ("json", "csv", "frames.h5"))
    return (record.load(table), granular.series(series), frames) if table.exists() and series.exists() else None


def nothing(keys, note="no run"):
    return [row(EXPECTED[key], None, note=note) for key in keys]


def rows_of_spread(runs, curves):
    groups, commands = {}, []
    for solver in SOLVERS:
        found = [told for name, told in runs.items() if name.startswith(f"spread-{solver}")]
        groups[solver] = [series for _, series, _ in found]
        commands += [run["command"] for run, _, _ in found]
    if any(len(group) < 2 for group in groups.values()):
        return [row(same(quantity), None, note="no runs") for quantity in ("q/p", "volumetric strain", "coordination")]
    edges = bins(*groups["nlgs"], *groups["dcs"])
    curves["spread"] = {"axial": few((edges[1:] + edges[:-1]) / 2)}
    rows = []
    for key, quantity in (("q/p", "q/p"), ("volumetric", "volumetric strain"), ("coordination", "coordination")):
        binned = {solver: np.array([granular.binned(told, key, edges) for told in group]) for solver, group in groups.items()}
        curves["spread"][key] = {solver: [few(curve) for curve in group] for solver, group in binned.items()}
        nlgs, dcs = binned["nlgs"], binned["dcs"]
        apart = granular.distance(dcs, nlgs)
        spread = float(np.sqrt(np.nanmean(np.nanvar(nlgs, axis=0, ddof=1))))
        within = np.mean((dcs >= nlgs.min(0)) & (dcs <= nlgs.max(0)))
        note = (
            f"{len(dcs)} curves against {len(nlgs)}, each from positions perturbed by 1e-9 radius; means {apart:.2g} apart (rms over strain), "
            f"one NLGS curve varies by {spread:.2g}; {100 * within:.0f} % of the points of DCS are between the least and the largest of NLGS"
        )
        rows.append(row(same(quantity), granular.permutation(dcs, nlgs), command=commands[-1], note=note))
    return rows


def bins(*series):
    """Edges between 0 and the axial strain that all have got to, a few steps apart at least."""
    return np.linspace(0, min(told["axial"][-1] for told in series), min(BINS, len(series[0]["axial"]) // 5) + 1)


def few(values, digits=5):
    """For JSON: few digits, null for NaN."""
    return [round_to(value, digits) if math.isfinite(value) else None for value in map(float, values)]


def curve(told):
    """A shear test in a few points."""
    run, series, frames = told
    edges = bins(series)
    at = {int(step): strain for step, strain in zip(series["step"], series["axial"])}
    core = granular.fractions(frames, run["dimension"])
    works = {f"{name} total": few(granular.binned(series, f"{name}_total", edges)) for name in ("work_walls", "dissipated_friction", "dissipated_impact")}
    return {
        "axial": few((edges[1:] + edges[:-1]) / 2),
        **{name: few(granular.binned(series, name, edges)) for name in ("sine", "q/p", "volumetric", "coordination", "fabric")},
        **works,
        "core": {"axial": few(at[step] for step in core), "solid fraction": few(core.values())},
    }


def angle(series, rows):
    """Friction angle of a window and its standard error, degrees."""
    mean, error = granular.mean_and_error(series["sine"][rows])
    return granular.degrees(mean), math.degrees(error / math.sqrt(1 - mean**2))


def peak(series):
    """Strain, friction angle and rate of dilation at the peak of the strength, over 2 % of strain."""
    width = min(0.02, series["axial"][-1] / 4)
    places = np.linspace(width / 2, series["axial"][-1] - width / 2, 100)
    windows = [np.abs(series["axial"] - place) <= width / 2 for place in places]
    best = max(range(len(places)), key=lambda k: series["sine"][windows[k]].mean())
    return places[best], granular.degrees(series["sine"][windows[best]].mean()), *granular.slope(series, windows[best])


def rows_of_spheres(runs):
    """The critical state of spheres with friction."""
    keys = ("sphere angle", "sphere fraction", "sphere dilation", "sphere peak", "sphere contacts", "sphere fabric")
    if not (told := runs.get("triaxial")):
        return nothing((*keys, "sphere rate"))
    (run, series, frames), rows = told, granular.last(told[1])
    command, grains = run["command"], run["grains"]
    critical, error = angle(series, rows)
    window = f"{grains} spheres, mean of axial strains {series['axial'][rows][0]:.2f} to {series['axial'][-1]:.2f}"
    where, highest, rate, rate_error = peak(series)
    first = series["step"][rows][0]
    core = [phi for step, phi in granular.fractions(frames, run["dimension"]).items() if step >= first]
    fabric = series["fabric"][rows]
    highest_note = f"peak {highest:.1f} degrees at strain {where:.3f} where the rate of dilation is {rate:.2f}; critical {critical:.1f} degrees"
    fabric_note = (
        f"{window}; 3 (F_axial - F_lateral) / (q/p), F the mean of n n: what forces alike in all directions would make; anisotropy a of "
        f"1 + a (3 cos^2 - 1): {2.5 * fabric.mean():.3f}"
    )
    values = (
        (critical, error, f"{window}; q/p {series['q/p'][rows].mean():.3f}; fabric deviator {fabric.mean():.3f}"),
        (*granular.mean_and_error(core), f"{window}; the whole box with layers at the walls has {series['solid_fraction'][rows].mean():.3f}"),
        (*granular.slope(series, rows), window),
        (highest - critical - 10 * rate, math.hypot(error, 10 * rate_error), highest_note),
        (*granular.mean_and_error(series["coordination"][rows]), f"{window}; rattlers {100 * series['rattlers'][rows].mean():.1f} %"),
        (*granular.mean_and_error(3 * fabric / series["q/p"][rows]), fabric_note),
    )
    made = [row(EXPECTED[key], value, spread, note, command) for key, (value, spread, note) in zip(keys, values)]
    slow = runs.get("triaxial-slow")
    if not slow:
        return [*made, *nothing(["sphere rate"])]
    low = granular.last(slow[1])
    both = (series["axial"] >= slow[1]["axial"][low][0]) & (series["axial"] <= slow[1]["axial"][-1])
    (fast, one), (calm, other) = angle(series, both), angle(slow[1], low)
    inertia = [np.median(told["inertial_number"][window]) for told, window in ((slow[1], low), (series, both))]
    note = f"{calm:.1f} degrees at I = {inertia[0]:.1e}, {fast:.1f} at {inertia[1]:.1e}, same strains"
    return [*made, row(EXPECTED["sphere rate"], calm - fast, math.hypot(one, other), note, slow[0]["command"])]


def rows_without_friction(runs):
    found = {name: runs.get(name) for name in ("frictionless", "frictionless-slow")}
    if not all(found.values()):
        return nothing(("free angle", "free dilation"))
    angles, rates = [], []
    for run, series, _ in found.values():
        rows = granular.last(series, 1 / 2)
        angles.append(angle(series, rows))
        rates.append(np.median(series["inertial_number"][rows]))
    (fast, one), (slow, other) = angles

    def limit(power):
        """The strength without rate, where what exceeds it is a power of the rate."""
        ratio = (rates[0] / rates[1]) ** power
        return (ratio * slow - fast) / (ratio - 1), math.hypot(ratio * other, one) / (ratio - 1)

    value, error = limit(POWER)
    error = math.hypot(error, limit(POWER + POWER_ERROR)[0] - value)
    run, series, frames = found["frictionless-slow"]
    core = list(granular.fractions(frames, run["dimension"]).values())
    half = core[len(core) // 2 :]
    strength = (
        f"{fast:.2f} degrees at I = {rates[0]:.1e} and {slow:.2f} at {rates[1]:.1e}, last half of the strain; "
        f"what exceeds the limit taken as I to the power {POWER} +- {POWER_ERROR}, after the source"
    )
    change = f"from {core[0]:.4f} to {np.mean(half):.4f}, mean of the last half, axial strain {series['axial'][-1]:.2f}"
    free = row(EXPECTED["free angle"], value, error, strength, run["command"])
    return [free, row(EXPECTED["free dilation"], np.mean(half) - core[0], granular.mean_and_error(half)[1], change, run["command"])]


def rows_of_disks(runs):
    keys = ("disk sine", "disk fraction", "disk dilation")
    if not (told := runs.get("biaxial")):
        return nothing(keys)
    (run, series, frames), rows = told, granular.last(told[1])
    first = series["step"][rows][0]
    core = [phi for step, phi in granular.fractions(frames, run["dimension"]).items() if step >= first]
    window = f"{run['grains']} disks, mean of axial strains {series['axial'][rows][0]:.2f} to {series['axial'][-1]:.2f}"
    sine = f"{window}; contacts per grain {series['coordination'][rows].mean():.2f}, fabric deviator {series['fabric'][rows].mean():.3f}"
    values = ((*granular.mean_and_error(series["sine"][rows]), sine), (*granular.mean_and_error(core), window), (*granular.slope(series, rows), window))
    return [row(EXPECTED[key], value, error, note, run["command"]) for key, (value, error, note) in zip(keys, values)]


def rows_of_forces(runs, curves):
    rows = []
    for key, name, first in (("disk", "biaxial", 2 / 3), ("free", "isotropic", 1 / 2), ("sphere", "triaxial", 2 / 3)):
        expected = [k for k in (f"{key} decay", f"{key} tail", f"{key} power") if k in EXPECTED] + (["weak deviator"] if key == "disk" else [])
        told = runs.get(name)
        if not told:
            rows += nothing(expected)
            continue
        run, series, frames = told
        begin = series["step"][granular.last(series, 1 - first)][0] if name != "isotropic" else first * run["steps"]
        parts = list(granular.forces(frames, run["dimension"], begin))
        f = np.concatenate([part["f"] for part in parts])
        share = {k: granular.mean_and_error([part[k] for part in parts]) for k in ("weak", "weak pressure", "weak deviator")}
        line = granular.tail(f)
        alpha = granular.mean_and_error([granular.power(part["f"]) for part in parts])[1]
        edges = np.concatenate([np.linspace(0, 1, 11), np.linspace(1, 8, 36)[1:]])
        counts = np.histogram(f, edges)[0]
        curves.setdefault("forces", {})[name] = {
            "f": few((edges[1:] + edges[:-1]) / 2),
            "P": few(counts / np.diff(edges) / len(f), 4),
            "counts": counts.tolist(),
            "decay": round_to(line["beta"]) if math.isfinite(line["beta"]) else None,
            "above the mean": round_to((f > 1).mean()),
            "at the mean": round_to(line["start"]) if math.isfinite(line["start"]) else None,
        }
        n = f"{len(f)} forces of {len(parts)} frames"
        fit = f"{n}; line by least squares through ln P(f) from 1 to {line.get('end', 1):.1f} mean forces"
        likely = f"most likely exponential from the mean on: {granular.decay(f):.2f}, from twice the mean on: {granular.decay(f, 2.0):.2f}"
        carry = f"{100 * share['weak'][0]:.0f} % of the contacts are weak and carry {100 * share['weak pressure'][0]:.0f} % of the pressure"
        values = {
            "decay": (line["beta"], line["error"], f"{fit}; {likely}"),
            "tail": (line["R2"], None, fit),
            "power": (granular.power(f), alpha, f"{n}; between 0.02 and 1 mean force"),
            "deviator": (*share["weak deviator"], carry),
        }
        rows += [row(EXPECTED[k], *values[k.split()[-1]], run["command"]) for k in expected]
    return rows


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


def rows_of_care(runs):
    """Whether the runs were slow, fine and exact enough for what is said of them."""
    shear = {name: told for name, told in runs.items() if name != "isotropic"}
    if not shear:
        return nothing(("inertia", "motion", "overlap", "energy"), "no runs")
    inertia = {name: float(np.median(series["inertial_number"])) for name, (_, series, _) in shear.items()}
    moved = {name: granular.motion(frames, run["dimension"], run["h"]) for name, (run, _, frames) in shear.items() if frames.exists()}
    energy = {name: float(series["energy_error"].max()) for name, (_, series, _) in runs.items()}
    overlaps = {name: granular.overlap(frames) for name, (_, _, frames) in runs.items() if frames.exists()}
    steps, capped = (sum(run[key] for run, _, _ in runs.values()) for key in ("steps", "unconverged_steps"))
    largest = max((value[1] for value in moved.values()), default=math.nan)
    told = []
    for key, values, note in (
        ("inertia", inertia, "the first steps, in which the walls begin to move, have more"),
        ("motion", {name: value[0] for name, value in moved.items()}, f"the largest of any grain {largest:.3f}"),
        ("overlap", overlaps, "of contacts that carry, the mean of a frame, the largest of all frames"),
        ("energy", energy, f"{steps} steps, of which {capped} hit the cap of iterations"),
    ):
        if not values:
            told += nothing([key], "no runs with frames")
            continue
        name = max(values, key=values.get)
        told.append(row(EXPECTED[key], values[name], None, f"{name}; {note}", runs[name][0]["command"]))
    return told


def all_rows(runs, packings):
    """Rows, and the curves of the figures."""
    curves = {"shear": {name: curve(told) for name, told in runs.items() if name != "isotropic" and not name.startswith("spread")}}
    rows = [*rows_of_spread(runs, curves), *rows_of_spheres(runs), *rows_without_friction(runs), *rows_of_disks(runs), *rows_of_jamming(packings)]
    return [*rows, *rows_of_forces(runs, curves), *rows_of_care(runs)], curves
