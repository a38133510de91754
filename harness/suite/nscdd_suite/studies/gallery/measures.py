"""What is measured in each scene of the gallery: (ours, the least and the most that the published law allows, the law itself, what else is told).

`run` is the stem of the files of the scene's run, `packing` the file that it started from. Further runs of a scene have a name behind the stem."""
import csv
import math
from statistics import linear_regression

import h5py
import numpy as np
from scipy.optimize import brentq
from scipy.signal import find_peaks

from ..physics.granular import lade_duncan


def series(run):
    with open(f"{run}.csv") as file:
        return {name: np.array(column, float) for name, *column in zip(*csv.reader(file))}


def collapse(run, packing):
    """Run-out of the grains that touch each other and, through others, the greatest heap; ours, and published low and high."""
    with h5py.File(packing) as file:
        width, height = file["box"][()]
    with h5py.File(f"{run}.h5") as end:
        x, i, j = end["x"][()], end["contacts/i"][()], end["contacts/j"][()]
        touching = (j >= 0) & (end["contacts/gap"][()] < 0.01)
    heap = np.arange(len(x))
    while True:  # the least number of what it touches
        least = heap.copy()
        for a, b in ((i[touching], j[touching]), (j[touching], i[touching])):
            np.minimum.at(least, a, heap[b])
        if (least == heap).all():
            break
        heap = least
    law = 3.25 * (height / width) ** 0.7
    reached = x[heap == np.bincount(heap).argmax(), 0].max()
    return (reached - width) / width, 0.85 * law, 1.15 * law, law


def gas(run, packing):
    told, fraction, restitution = series(run), 0.45, 0.95
    with h5py.File(packing) as file:
        grains = len(file["radius"])
    temperature = told["kinetic_energy"] / grains
    at_contact = (1 - 7 * fraction / 16) / (1 - fraction) ** 2
    collisions = 2 * math.sqrt(math.pi) * (4 * fraction / math.pi) * at_contact  # a grain's, at temperature 1
    rate = (temperature[-1] ** -0.5 - 1) / told["time"][-1]
    return rate / ((1 - restitution**2) / 4 * collisions), 0.9, 1.1, 1.0


def janssen(run, packing):
    told, wall, internal = series(run), 0.2, math.atan(0.25)
    bottom = told["wall_normal_force_bottom"][len(told["time"]) // 2 :].mean()
    with h5py.File(packing) as file:
        (width, height), weight = file["box"][()], math.pi * (file["radius"][()] ** 2).sum()

    def carried(ratio):
        length = width / (2 * wall * ratio)
        return length / height * (1 - math.exp(-height / length))

    active = (1 - math.sin(internal)) / (1 + math.sin(internal))
    return bottom / weight, 0.9 * carried(1), 1.1 * carried(active), (carried(1) + carried(active)) / 2


def triaxial(run, packing):
    told = series(run)
    last = slice(2 * len(told["time"]) // 3, None)
    axial, lateral = told["stress_contacts_zz"][last].mean(), 0.5 * (told["stress_contacts_xx"] + told["stress_contacts_yy"])[last].mean()
    angle = math.degrees(math.asin((axial - lateral) / (axial + lateral)))
    low, high = sorted((math.degrees(math.asin(0.357)), lade_duncan(0.357)))
    return angle, low - 1.5, high + 1.5, (low + high) / 2


def vibrated(run, packing):
    told, strength = series(run), 2.0  # acceleration of the floor over that of gravity
    off = math.asin(1 / strength)
    flight = brentq(lambda phase: math.sin(off) + math.cos(off) * phase - phase**2 / (2 * strength) - math.sin(off + phase), 0.5, 6)
    law = flight / (2 * math.pi)
    late = told["wall_normal_force_floor"][len(told["time"]) * 2 // 5 :]  # the last six periods
    return float(np.mean(late <= 0)), 0.95 * law, 1.05 * law, law


def silo(run, packing):
    """Power of the width of the orifice, less 1.4 diameters, by which disks leave, from four widths."""
    with h5py.File(packing) as file:
        whole = math.pi * (file["radius"][()] ** 2).sum()
    rates = {}
    for width, stem in ((10, run), *((width, f"{run}-{width}") for width in (8, 12, 16))):
        told = series(stem)
        steady = (told["mass_removed"] > 0.05 * whole) & (told["mass_removed"] < 0.4 * whole)
        rates[width] = linear_regression(told["time"][steady], told["mass_removed"][steady]).slope if steady.sum() > 1 else math.nan
    widths = sorted(rates)
    logarithms = [(math.log(width - 1.4), math.log(rates[width])) for width in widths]
    power = linear_regression(*zip(*logarithms)).slope
    note = "; ".join(f"{rates[width]:.1f} at {width}" for width in widths)
    return power, 1.35, 1.65, 1.5, f"mass a unit of time at widths in diameters: {note}"


def shearbox(run, packing):
    """Angle of shear over normal force on the lower half, from the second third of the way on."""
    told = series(run)
    shear, normal = (sum(told[f"obstacle_force_{part}_{axis}"] for part in ("bottom", "lower left", "lower right")) for axis in "xy")
    steady, law = slice(len(shear) // 3, None), math.degrees(math.atan(0.3))
    angle = math.degrees(math.atan2(shear[steady].mean(), -normal[steady].mean()))
    return angle, *(math.degrees(math.atan(share * 0.3)) for share in (0.85, 1.15)), law, f"shear over normal force {math.tan(math.radians(angle)):.3f}"


def slopes(run):
    """Slope of a bed, degrees, in each frame: across the line from the middle of the drum to the centre of mass."""
    with h5py.File(f"{run}.frames.h5") as file:
        for name in sorted(name for name in file if name.startswith("step_")):
            grains, walls = file[name]["grains"], file[name]["walls/points"][()]
            mass, rim = grains["radius"][()] ** 2, (walls.min(0) + walls.max(0)) / 2
            x, y, _ = (mass[:, None] * (grains["x"][()] - rim)).sum(0) / mass.sum()
            yield math.degrees(math.atan2(x, -y))


def drum(run, packing):
    """Slope at which avalanches begin in slow rotation: the mean of the highest before each fall of two degrees or more."""
    slow, medium, fast = (np.array(list(slopes(stem))) for stem in (run, f"{run}-0.03", f"{run}-0.3"))
    peaks, _ = find_peaks(slow, prominence=2)
    means = zip((0.003, 0.03, 0.3), (slope[len(slope) // 3 :].mean() for slope in (slow, medium, fast)))
    note = "; ".join(f"{mean:.1f} at {froude:g}" for froude, mean in means)
    return slow[peaks].mean() if len(peaks) else math.nan, 27, 33, 30.0, f"{len(peaks)} avalanches; mean slopes at Froude numbers: {note}"
