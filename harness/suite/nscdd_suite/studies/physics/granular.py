"""What granular mechanics measures: from time series (--series, CSV), frames (--frames) and packings of the program nscdd."""
import csv
import itertools
import math
from statistics import correlation, linear_regression  # in one order on every machine, unlike NumPy's fits by BLAS

import h5py
import numpy as np
from scipy.optimize import brentq
from scipy.spatial import cKDTree

MARGIN = 2.0  # the core of a sample begins so many mean diameters from its walls
GAP = 1e-3  # mean diameters: what is nearer is a contact of a packing, for the shrink that takes overlaps away opens all by up to 7e-4
BLOCKS = 5  # of a window in time, for the standard error of its mean


def standard_error(blocks):
    return float(np.std(blocks, ddof=1) / math.sqrt(len(blocks))) if len(blocks) > 1 else math.nan


def mean_and_error(values):
    """Mean of a window, and the standard error from the means of its blocks, which are longer than what correlates."""
    values = np.asarray(values, float)
    blocks = [block.mean() for block in np.array_split(values, BLOCKS) if len(block)]
    return float(values.mean()) if len(values) else math.nan, standard_error(blocks)


def series(path):
    """Columns of a compression along the last axis: strains and stress by their roles, all else by its name."""
    with open(path, newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    told = dict(zip(names, np.array(rows, float).T))
    axis, *sides = ("z", "x", "y") if "strain_z" in told else ("y", "x")

    def across(name):
        return sum(told[name.format(side)] for side in sides) / len(sides)

    major, minor = told[f"stress_contacts_{axis}{axis}"], across("stress_contacts_{0}{0}")
    told["axial"] = told[f"strain_{axis}"]
    told["volumetric"] = told["axial"] + len(sides) * across("strain_{}")
    told["sine"] = (major - minor) / (major + minor)  # of the friction angle that is mobilised
    told["q/p"] = (major - minor) / ((major + len(sides) * minor) / (1 + len(sides)))
    told["fabric"] = told[f"fabric_{axis}{axis}"] - across("fabric_{0}{0}")
    return told


def last(told, share=1 / 3):
    """Which rows are of the last third of the axial strain."""
    return told["axial"] >= (1 - share) * told["axial"][-1]


def binned(told, name, edges):
    """Means of a column between values of axial strain; NaN where there is no row."""
    place = np.digitize(told["axial"], edges) - 1
    return np.array([told[name][place == k].mean() if (place == k).any() else math.nan for k in range(len(edges) - 1)])


def slope(told, rows):
    """Rate of dilation, -d(volumetric) / d(axial), by a straight line; its standard error from the slopes of blocks."""
    x, y = told["axial"][rows], told["volumetric"][rows]
    blocks = [-linear_regression(a, b).slope for a, b in zip(np.array_split(x, BLOCKS), np.array_split(y, BLOCKS)) if len(a) > 1]
    return -linear_regression(x, y).slope, standard_error(blocks)


def degrees(sine):
    return math.degrees(math.asin(sine))


def lade_duncan(ratio):
    """Friction angle [degrees] in triaxial compression by the criterion I1^3 / I3 = constant. ratio: shear stress over pressure at which the
    material yields in simple shear, the middle stress the mean of the others."""
    invariant = 27 / (1 - ratio**2)
    stress = brentq(lambda s: (s + 2) ** 3 / s - invariant, 1, 100)
    return degrees((stress - 1) / (stress + 1))


def frames(path):
    """(step, group) of all frames, in order."""
    with h5py.File(path) as file:
        for name in sorted(key for key in file if key.startswith("step_")):
            yield int(name[5:]), file[name]


def grains(frame, dimension):
    return frame["grains/x"][:, :dimension], frame["grains/radius"][:]


def cut_share(t):
    """Share of a sphere, or of a disk, on the inner side of a plane `t` radii from its centre; t > 0: the centre is inside."""
    t = np.clip(t, -1, 1)
    return {3: (2 + 3 * t - t**3) / 4, 2: 0.5 + (t * np.sqrt(1 - t * t) + np.arcsin(t)) / math.pi}


def core(x, radius, box=None):
    """Ends of the core: of the box between the walls, which outermost grains touch, without a margin."""
    low, high = (np.zeros_like(box), box) if box is not None else ((x - radius[:, None]).min(0), (x + radius[:, None]).max(0))
    margin = min(2 * radius.mean() * MARGIN, (high - low).min() / 4)
    return low + margin, high - margin


def core_fraction(x, radius, box=None):
    """Solid fraction of the core; grains are cut at its planes."""
    dimension = x.shape[1]
    low, high = core(x, radius, box)
    shares = [cut_share(t / radius[:, None])[dimension] for t in (x - low, high - x)]
    volume = (4 / 3 * math.pi if dimension == 3 else math.pi) * radius**dimension
    return float((np.prod(shares[0] * shares[1], axis=1) * volume).sum() / np.prod(high - low))


def fractions(path, dimension):
    """{step: solid fraction of the core}."""
    return {step: core_fraction(*grains(frame, dimension)) for step, frame in frames(path)}


def motion(path, dimension, h):
    """Displacement in a step over the smallest radius, of all grains of all frames: that of 999 in 1,000, and the largest."""
    speeds, smallest = [], math.inf
    for _, frame in frames(path):
        speeds.append(np.linalg.norm(frame["grains/velocity"][:, :dimension], axis=1))
        smallest = min(smallest, frame["grains/radius"][:].min())
    moved = h * np.concatenate(speeds) / smallest
    return float(np.quantile(moved, 0.999)), float(moved.max())


def overlap(path):
    """Mean overlap of the contacts that carry over the mean diameter, in the frame where it is largest."""
    found = []
    for _, frame in frames(path):
        gaps = frame["contacts/gap"][:][frame["contacts/normal_force"][:] > 0]
        found.append(float(np.maximum(-gaps, 0).mean() / (2 * frame["grains/radius"][:].mean())))
    return max(found)


def forces(path, dimension, first):
    """From the step `first` on, a frame each: normal forces between grains over their mean, and of the contacts below the mean their
    share of the number, of the pressure and of the deviatoric stress."""
    for step, frame in frames(path):
        if step < first:
            continue
        normal = frame["contacts/normal_force"][:]
        between = (normal > 0) & (frame["contacts/grains"][:, 1] >= 0)
        ends = frame["contacts/ends"][:, :dimension].reshape(-1, 2, dimension)[between]
        force, normal = frame["contacts/force"][:, :dimension][between], normal[between]
        moment = np.einsum("ci,ci->ci", force, ends[:, 0] - ends[:, 1])  # of the diagonal of the stress
        weak = normal < normal.mean()
        below, all_of_it = moment[weak].sum(0), moment.sum(0)
        deviators = [stress[-1] - stress[:-1].mean() for stress in (below, all_of_it)]
        shares = {"weak": weak.mean(), "weak pressure": below.sum() / all_of_it.sum(), "weak deviator": deviators[0] / deviators[1]}
        yield {"f": normal / normal.mean(), **shares}


def decay(f, above=1.0):
    """beta of P(f) ~ exp(-beta f) above a force, the most likely: 1 / mean excess."""
    tail = f[f > above]
    return float(1 / (tail - above).mean()) if len(tail) else math.nan


def tail(f, above=1.0, width=0.2, least=30):
    """ln P(f) above a force, in bins of this width up to the first with fewer forces, and the straight line by least squares:
    beta of exp(-beta f), its standard error, R^2, and P of the line at that force. NaN with fewer than four bins."""
    edges = np.arange(above, f.max(initial=above) + width, width)
    counts = np.histogram(f, edges)[0]
    counts = counts[: np.argmax(counts < least) if (counts < least).any() else len(counts)]
    if len(counts) < 4:
        return {"beta": math.nan, "error": math.nan, "R2": math.nan, "start": math.nan}
    x, y = width * (np.arange(len(counts)) + 0.5), [*map(math.log, counts / (width * len(f)))]
    line, r2 = linear_regression(x, y), correlation(x, y) ** 2
    error = abs(line.slope) * math.sqrt((1 / r2 - 1) / (len(y) - 2))
    fit = {"beta": -line.slope, "error": error, "R2": r2, "start": math.exp(line.intercept)}
    return fit | {"end": float(above + width * len(counts))}


def power(f, low=0.02, high=1.0, bins=12):
    """alpha of P(f) ~ f^alpha between two forces, by a line through the logarithms of a histogram."""
    counts, edges = np.histogram(f, [low * (high / low) ** (k / bins) for k in range(bins)] + [high])
    some = counts > 0
    x, y = np.sqrt(edges[1:] * edges[:-1])[some], (counts / np.diff(edges))[some]
    return linear_regression([*map(math.log, x)], [*map(math.log, y)]).slope if some.sum() > 1 else math.nan


def packing(path):
    """Solid fraction of the core, contacts per grain there without rattlers, and their share. Contacts per degree of freedom of all grains that
    are held (isostatic: 1), walls included, for half and twice the gap too."""
    with h5py.File(path) as file:
        x, radius, box = file["x"][:], file["radius"][:], file["box"][:]
        told = {name: file.attrs[name].decode() for name in ("source", "command", "commit", "coordination", "rattlers")}
    n, dimension = x.shape
    diameter = 2 * radius.mean()
    pairs = cKDTree(x).query_pairs(2 * radius.max() + 2 * GAP * diameter, output_type="ndarray")
    gaps = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) - radius[pairs].sum(1)
    walls = np.concatenate([x - radius[:, None], box - x - radius[:, None]], axis=1)
    low, high = core(x, radius, box)
    inside = ((x > low) & (x < high)).all(1)

    def count(gap):
        """Grains that are held, by dim + 1 contacts each at least, and the contacts among them and with walls."""
        near, wall, held = pairs[gaps < gap * diameter], (walls < gap * diameter).sum(1), np.ones(n, bool)
        while True:
            among = near[held[near].all(1)]
            degree = np.bincount(among.ravel(), minlength=n) + wall
            stays = held & (degree > dimension)
            if (stays == held).all():
                return held, degree, float((len(among) + wall[held].sum()) / (dimension * max(1, held.sum())))
            held = stays

    held, degree, isostatic = count(GAP)
    contacts = float(degree[held & inside].mean()) if (held & inside).any() else math.nan
    told |= {"grains": n, "solid fraction": core_fraction(x, radius, box), "contacts": contacts, "free": float(1 - held.mean())}
    return told | {"isostatic": isostatic, "isostatic of other gaps": [count(factor * GAP)[2] for factor in (0.5, 2)]}


def distance(one, other):
    """Root mean square, over strain, of the difference of the means of two groups of curves."""
    return float(np.sqrt(np.nanmean((np.nanmean(one, axis=0) - np.nanmean(other, axis=0)) ** 2)))


def permutation(one, other):
    """Of all ways to deal the curves to two groups of these sizes, the share whose means are at least as far apart."""
    curves, seen = np.array([*one, *other]), distance(one, other)
    ways = [list(chosen) for chosen in itertools.combinations(range(len(curves)), len(one))]
    far = [distance(curves[chosen], np.delete(curves, chosen, axis=0)) >= seen * (1 - 1e-12) for chosen in ways]
    return sum(far) / len(far)
