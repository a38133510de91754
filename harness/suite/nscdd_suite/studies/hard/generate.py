"""Writes the scenes of cases/hard, one TOML each: the hard cases of the method, whose answers
harness/suite/nscdd_suite/studies/hard/exact.py knows.

    PYTHONPATH=harness/suite python3 -m nscdd_suite.studies.hard.generate [--check]

Nothing is random: the same files come out every time. With --check nothing is written, and the exit code is 1 if a
committed file is not what would be written, or is no longer written.
"""
import argparse
import itertools
import math
import sys
import textwrap

from ...program import ROOT

FOLDER = ROOT / "cases/hard"
G = 10.0  # gravity
R = 0.5  # radius: places are multiples of it, so that gaps of columns and rows are exactly zero
H = 1 / 128  # step, an exact number as well
BELOW, ABOVE = (0.99, "below"), (1.01, "above")  # how near thresholds are approached
DEFAULT = {"h": 1e-3, "count": 10_000, "tolerance": 1e-4, "max_iterations": 20_000}  # a run's, for those who choose nothing
RATIOS = ("1e1", "1e2", "1e3", "1e4", "1e5", "3e5", "1e6")


def value(x):
    """As TOML."""
    if isinstance(x, str):
        return f'"{x}"'
    if isinstance(x, (list, tuple)):
        return "[" + ", ".join(map(value, x)) + "]"
    if isinstance(x, dict):
        return "{ " + ", ".join(pairs(x)) + " }"
    return repr(x)


def pairs(table):
    return [f"{key} = {value(x)}" for key, x in table.items()]


def text(scene):
    """The file of a scene. `says` becomes the comment above it; grains are a line each."""
    lines = [*(f"# {line}" for line in textwrap.wrap(scene["says"], 116)), ""]
    lines += [*pairs({key: scene[key] for key in ("name", "dimension", "gravity")}), ""]
    lines += ["grain = [", *(f"  {value(grain)}," for grain in scene["grain"]), "]"]
    for table in ("material", "pair", "wall"):
        for entry in scene[table]:
            lines += ["", f"[[{table}]]", *pairs(entry)]
    for table in ("step", "solver"):
        lines += ["", f"[{table}]", *pairs(scene[table])]
    return "\n".join(lines) + "\n"


def scene(name, dim, says, grains, *, walls=None, pairs=(), weightless=False, gravity=None, densities=None, h=H, count=1, **solver):
    """On a floor, if no other walls are given."""
    return {
        "says": says,
        "name": f"{name}-{dim}d",
        "dimension": dim,
        "gravity": gravity or up(dim, 0.0 if weightless else -G),
        "grain": list(grains),
        "material": [{"name": key, "density": density} for key, density in (densities or {"grain": 1.0, "wall": 1.0}).items()],
        "pair": pairs,
        "wall": [floor(dim)] if walls is None else walls,
        "step": {"h": h, "count": count},
        "solver": {"tolerance": 1e-10, "check_every": 10, "max_iterations": 100_000} | solver,
    }


def up(dim, z, x=0.0):
    """A vector with height z along the last axis and x along the first."""
    return [x, z] if dim == 2 else [x, 0.0, z]


def spin(dim, rate):
    """About the horizontal axis across x: positive rolls towards +x, which is clockwise in 2D."""
    return -rate if dim == 2 else [0.0, rate, 0.0]


def slip_ratio(dim):
    """W_t / W_n of a contact with a wall."""
    return 3.5 if dim == 3 else 3.0


def grain(position, radius=R, material="grain", **more):
    return {"position": position, "radius": radius, "material": material, **more}


def wall(name, normal, through, motion="fixed", **more):
    return {"name": name, "normal": normal, "through": through, "material": "wall", "motion": motion, **more}


def floor(dim):
    return wall("floor", up(dim, 1.0), up(dim, 0.0))


def lid(dim, height, *motion, **more):
    return wall("lid", up(dim, -1.0), up(dim, height), *motion, **more)


def sides(dim, width):
    """The walls of a square box."""
    for axis, upper in itertools.product(range(dim - 1), (0, 1)):
        normal, through = ([size if k == axis else 0.0 for k in range(dim)] for size in (1.0 - 2 * upper, width * upper))
        yield wall(f"{'xy'[axis]}{'-+'[upper]}", normal, through)


def contact(a, b, **law):
    return {"materials": [a, b], **law}


def on_walls(**law):
    return [contact("grain", "wall", **law)]


def everywhere(**law):
    return [contact("grain", "grain", **law), *on_walls(**law)]


def lattice(dim, across, layers, gap=0.0):
    """A square or cubic lattice on the floor, its lowest corner at the origin."""
    for place in itertools.product(*[range(across)] * (dim - 1), range(layers)):
        yield [R + k * (2 * R + gap) for k in place[:-1]] + [R + 2 * R * place[-1]]


def loose(dim, across, layers):
    """Grains apart, a little out of line, and the sides of the box around them."""
    places = []
    for row in range(layers):
        for place in itertools.product(range(across), repeat=dim - 1):
            shifts = [0.4 * R * ((sum(place) * share + 0.2 * row) % 1.0) for share in (0.618034, 0.414214)]
            places.append([R + 2.5 * R * k + shift for k, shift in zip(place, shifts)] + [R + 2.4 * R * row + 0.2 * R * ((sum(place) + row) % 3)])
    return map(grain, places), [floor(dim), *sides(dim, 2.5 * R * across + R)]


def gas(dim):
    """Moving grains in a closed box."""
    grains, walls = loose(dim, 6 - dim, 6 - dim)
    moving = [entry | {"velocity": [math.sin(7.0 * k + 2.0 * d) for d in range(dim)]} for k, entry in enumerate(grains)]
    return moving, [*walls, lid(dim, 12 * R)]


def columns(dim):
    """Stacks whose contact k carries the weight of all that is above."""
    for n in (10, 100, 1000):
        says = f"A column of {n} at rest, all gaps zero, from zero impulses: contact k above the floor carries ({n} - k) m g h."
        grains = (grain(up(dim, R + 2 * R * k)) for k in range(n))
        yield scene(f"column-{n}", dim, says, grains, tolerance=1e-9 if n == 1000 else 1e-10, check_every=n, max_iterations=20 * n * n)
    for exponent, heavy in ((0, "above"), *itertools.product((2, 4, 6), ("above", "below"))):
        says = f"Two equal balls, the one {heavy} 1e{exponent} times the heavier: impulses (M + m) g h on the floor, and the upper weight times h between them."
        lower, upper = ("heavy", "grain") if heavy == "below" else ("grain", "heavy")
        grains = [grain(up(dim, R), material=lower), grain(up(dim, 3 * R), material=upper)]
        solver = {"tolerance": 5e-10, "check_every": 10 if exponent < 4 else 1000, "max_iterations": 200 * 10**exponent + 1000}
        yield scene(f"mass-1e{exponent}-{heavy}", dim, says, grains, densities={"grain": 1.0, "heavy": 10.0**exponent, "wall": 1.0}, **solver)
    for ratio, big in itertools.product((10, 100), ("above", "below")):
        low, high = (R, R / ratio) if big == "below" else (R / ratio, R)
        says = f"Two balls, the one {big} {ratio} times the larger: impulses are the weights above times h."
        grains = [grain(up(dim, low), low), grain(up(dim, 2 * low + high), high)]
        solver = {"tolerance": 5e-10, "check_every": 10 if ratio**dim < 1e4 else 1000, "max_iterations": 200 * ratio**dim + 1000}
        yield scene(f"radius-{ratio}-{big}", dim, says, grains, **solver)


def crystals(dim):
    """Packings whose impulses are many but whose answer is rest."""
    across = 10 if dim == 2 else 5
    says = (
        f"A crystal, {across} across and 10 high, all gaps zero, frictionless, on one wall: every contact k of a column carries (10 - k) m g h, "
        "those sideways nothing."
    )
    yield scene("crystal-square", dim, says, map(grain, lattice(dim, across, 10)), max_iterations=10_000)
    layers, rise = (10, math.sqrt(3) * R) if dim == 2 else (8, math.sqrt(2) * R)
    places = []
    for layer in range(layers):
        for place in itertools.product(range(across - layer % 2), repeat=dim - 1):
            places.append([R + layer % 2 * R + 2 * R * k for k in place] + [R + layer * rise])
    says = f"A close-packed crystal between walls, {layers} layers, frictionless: it stays at rest; the floor carries the whole weight."
    yield scene("crystal-close", dim, says, map(grain, places), walls=[floor(dim), *sides(dim, 2 * R * across)], count=20, tolerance=1e-8)
    across = 5 if dim == 2 else 4
    says = "A crystal with friction, all gaps exactly zero, nothing pushing: no velocity and no impulse, exactly."
    yield scene("rest", dim, says, map(grain, lattice(dim, across, across)), pairs=everywhere(friction=0.3), weightless=True, count=10)


def lids(dim):
    for n in (10, 100, 1000):
        across = n if dim == 2 else math.isqrt(n) + (math.isqrt(n) ** 2 < n)
        places = list(lattice(dim, across, 1, gap=0.25 * R))[:n]
        says = (
            f"A lid pushed by a force F onto {n} grains on a floor, one wall in contact with everything: the lid's contacts carry F h in all, "
            "the floor's the weights too."
        )
        walls = [floor(dim), lid(dim, 2 * R, "force", force=100.0)]
        yield scene(f"lid-{n}", dim, says, map(grain, places), walls=walls, tolerance=1e-8, max_iterations=1_000_000)


def impacts(dim):
    """One impact by Newton's law: of two, of a row at once, and of one obliquely on a wall."""
    for e in (0.0, 0.5, 1.0):
        h, speeds = 1 / 8, (2.0, -1.0)
        says = f"Two balls, the second of five times the mass, meet head on: the relative velocity v becomes -{e:g} v."
        how = {"pairs": [contact("grain", "heavy", restitution=e)], "densities": {"grain": 1.0, "heavy": 5.0}}
        grains = [
            grain(up(dim, 0.0, 2 * R * k - 0.5 * h * speed), material=material, velocity=up(dim, 0.0, speed))
            for k, (material, speed) in enumerate(zip(("grain", "heavy"), speeds))
        ]
        yield scene(f"restitution-{e:g}", dim, says, grains, **how, weightless=True, h=h, walls=())
    for e, n in itertools.product((0.0, 0.5, 1.0), range(2, 11)):
        h = 1 / 8
        says = (
            f"A cradle of {n}, one arriving at speed 1, by the simultaneous Newton law with e = {e:g}: the first goes on at 1 - (1 + e) {n - 1}/{n}, "
            f"all others at (1 + e)/{n}."
        )
        grains = [grain(up(dim, 0.0, -0.5 * h), velocity=up(dim, 0.0, 1.0))] + [grain(up(dim, 0.0, 2 * R * k)) for k in range(1, n)]
        how = {"pairs": [contact("grain", "grain", restitution=e)], "densities": {"grain": 1.0}}
        yield scene(f"cradle-{n}-{e:g}", dim, says, grains, **how, weightless=True, h=h, walls=())
    for e, (share, side) in itertools.product((0.0, 0.5), (BELOW, ABOVE)):
        h, mu, down, spun, name = 1 / 64, 0.25, 1.5, 0.2, "sticks" if side == "below" else "slides"
        slip = share * slip_ratio(dim) * mu * (1 + e) * down
        says = (
            f"Oblique impact, e = {e:g}, the contact's tangential velocity 1 % from the threshold {slip_ratio(dim):g} mu (1 + e) |u_n|, {side}: it {name}; "
            "a fifth of that velocity is spin."
        )
        grains = [grain(up(dim, R + 0.5 * h * down), velocity=up(dim, -down, (1 - spun) * slip), spin=spin(dim, -spun * slip / R))]
        yield scene(f"oblique-{e:g}-{name}", dim, says, grains, pairs=on_walls(friction=mu, restitution=e), weightless=True, h=h)
    for each in (256, 1024):
        e, height = 0.5, 1.0
        total = math.sqrt(2 * height / G) * (1 + e) / (1 - e)
        says = f"A ball dropped from 1 bounces with e = 0.5 until sqrt(2 h0/g) (1+e)/(1-e); step 1/{each}."
        yield scene(f"bounce-{each}", dim, says, [grain(up(dim, R + height))], pairs=on_walls(restitution=e), h=1 / each, count=math.ceil(1.2 * total * each))


def rolling(dim):
    ratio, mu = slip_ratio(dim), 0.2
    says = f"Sliding at v0 = 1 to rolling at {'5/7' if dim == 3 else '2/3'} v0: from t = v0/({ratio:g} mu g) on."
    yield scene("rolling", dim, says, [grain(up(dim, R), velocity=up(dim, 0.0, 1.0))], pairs=on_walls(friction=0.3), h=1e-4, count=2000)
    for share, side in (BELOW, ABOVE):
        angle, name = math.atan(share * ratio * mu), "rolls" if side == "below" else "slides"
        says = f"An incline 1 % {side} tan = {ratio:g} mu: from rest it {name}. The axes are the incline's."
        gravity = up(dim, -G * math.cos(angle), G * math.sin(angle))
        yield scene(f"incline-{name}", dim, says, [grain(up(dim, R))], pairs=on_walls(friction=mu), gravity=gravity, h=1e-3, count=200)
    gap = [wall("bottom", up(dim, 1.0), up(dim, 0.0)), wall("top", up(dim, -1.0), up(dim, 2 * R))]
    pressed = [gap[0], gap[1] | {"motion": "force", "force": 5.0, "mass": 2.0}]
    for suffix, rate in (("", spin(dim, 10.0)), *([("-upright", [0.0, 0.0, 10.0])] if dim == 3 else [])):
        kept = "about their normal the spin is kept." if suffix else "the spin falls by 2 mu F R/I a second, and ends at zero."
        for name, walls, answer in (
            ("free", gap, "at rest and not pressed: the spin is kept."),
            ("pressed", pressed, f"one of them pushed by a force F: {kept}"),
        ):
            how = {"walls": walls, "pairs": on_walls(friction=0.3), "weightless": True, "h": 1e-4, "count": 1000}
            yield scene(f"spin-{name}{suffix}", dim, f"A spinning grain between two walls, {answer}", [grain(up(dim, R), spin=rate)], **how)


def piles(dim):
    """That stand or fall by one per cent of friction."""
    tilt = math.pi / 6 if dim == 2 else math.asin(1 / math.sqrt(3))  # of the contact from the vertical
    turns, arm = ((math.pi / 2, math.pi * 7 / 6, math.pi * 11 / 6), 2 * R / math.sqrt(3))
    base = [[-R, R], [R, R]] if dim == 2 else [[arm * math.cos(a), arm * math.sin(a), R] for a in turns]
    grains = [*map(grain, base), grain(up(dim, R + 2 * R * math.cos(tilt)))]
    limits = {"grains": math.tan(tilt / 2), "floor": math.tan(tilt / 2) / (len(base) + 1)}
    for where, (share, side) in itertools.product(limits, (BELOW, ABOVE)):
        mu, ends = {"grains": 1.0, "floor": 1.0} | {where: share * limits[where]}, "falls" if side == "below" else "stays"
        between = "grain and grain" if where == "grains" else "grain and floor"
        says = f"One on {len(base)}: friction between {between} is 1 % {side} {limits[where]:.4f}, so the pile {ends}."
        pairs = [contact("grain", "grain", friction=mu["grains"]), contact("grain", "wall", friction=mu["floor"])]
        yield scene(f"pile-{where}-{ends}", dim, says, grains, pairs=pairs, h=1e-3, count=1000, tolerance=1e-9)


def wedges(dim):
    """That hold or not by one per cent of friction."""
    half = math.radians(20)  # of the wedge's opening
    place = up(dim, -R / math.sin(half))  # touches both walls of the wedge that opens downwards at the origin
    left, right = (wall(name, up(dim, -math.sin(half), sign * math.cos(half)), up(dim, 0.0)) for name, sign in (("left", 1.0), ("right", -1.0)))
    walls = [left, right | {"motion": "force", "force": 1e4, "mass": 10.0}]
    for name, ends, (share, side) in (("slips", "is squeezed out", BELOW), ("holds", "holds", ABOVE)):
        says = f"A grain in a wedge of opening 2 beta, one side pushed in by a force; mu is 1 % {side} tan beta, so it {ends}."
        how = {"walls": walls, "pairs": on_walls(friction=share * math.tan(half)), "weightless": True}
        yield scene(f"wedge-squeezed-{name}", dim, says, [grain(place)], **how, h=1e-3, count=20)
    says = (
        "The same wedge with both sides fixed, mu 1 % above tan beta, and gravity pulling the grain out. From zero impulses it carries "
        "nothing and falls freely; with the impulses that wedge-squeezed-holds left it stays."
    )
    yield scene("wedge-locked", dim, says, [grain(place)], walls=[left, right], pairs=on_walls(friction=ABOVE[0] * math.tan(half)), h=1e-3, count=20)


def infeasible(dim):
    """Scenes without an answer: the program must say so."""
    for name, speed, count, says in (
        ("fast", 4e-2, 4, "Each step would close each contact by 1 % of a radius: no step converges, and each stops at its cap."),
        ("slow", 2e-3, 400, "Each step closes each contact by 5e-4 of a radius, less than a step may: the overlap adds up until it is an error."),
    ):
        half = 0.5 * speed * R / H
        walls = [
            wall(which, up(dim, side), up(dim, height), "velocity", velocity=up(dim, side * half))
            for which, side, height in (("low", 1.0, 0.0), ("high", -1.0, 6 * R))
        ]
        how = {"walls": walls, "pairs": [contact("grain", "grain", friction=0.3)], "weightless": True, "tolerance": 1e-4, "max_iterations": 2000}
        yield scene(f"squeeze-{name}", dim, f"Two walls close on a jammed crystal. {says}", map(grain, lattice(dim, 3, 3)), count=count, **how)
    yield scene("coincident", dim, "Two grains at one place: there is no normal; an error that names both.", [grain(up(dim, R)), grain(up(dim, R))])


def long_runs(dim):
    grains, walls = loose(dim, 4, 6)
    says = (
        "Loose grains fall into a box with steps ten times too large, 10 % of a radius at full speed: no overlap beyond what the steps were "
        "allowed, no energy gained."
    )
    yield scene("large-step", dim, says, grains, walls=walls, pairs=everywhere(friction=0.3), h=0.01, count=200, tolerance=1e-4)
    grains, walls = loose(dim, *((4, 6) if dim == 2 else (3, 4)))
    says = "Loose grains settle in a box and lie there for 10,000 steps: neither creep nor energy gained."
    yield scene("settled", dim, says, grains, walls=walls, pairs=everywhere(friction=0.3), h=1e-3, count=10_000, tolerance=1e-6)
    grains, walls = gas(dim)
    says = "Balls without friction, rebounding with e = 1 from each other and the walls for 10,000 steps: their energy is kept."
    yield scene("gas", dim, says, grains, walls=walls, pairs=everywhere(restitution=1.0), weightless=True, h=1e-3, count=10_000, tolerance=1e-9)
    places = list(lattice(dim, 6 - dim, 6 - dim, gap=0.02))
    middle, clump = [sum(axis) / len(places) for axis in zip(*places)], []
    for k, place in enumerate(places):
        inwards = [m - x for m, x in zip(middle, place)]
        turn = [-0.5 * inwards[-1]] + [0.0] * (dim - 2) + [0.5 * inwards[0]]
        rate = 2.0 * math.cos(k) if dim == 2 else [math.cos(k), 2.0 * math.sin(k), 1.0]
        clump.append(grain(place, velocity=[0.3 * a + b for a, b in zip(inwards, turn)], spin=rate))
    says = "A clump that turns, spins, closes in and rubs, alone in space, for 10,000 steps: momentum and angular momentum are kept, energy is only lost."
    yield scene("clump", dim, says, clump, pairs=[contact("grain", "grain", friction=0.4)], weightless=True, h=1e-3, count=10_000, tolerance=1e-6, walls=())


def orders(dim):
    """Scenes that are run again with other steps and theta."""
    until = 0.9 / (slip_ratio(dim) * 0.3 * G)
    says = "Sliding on a floor until shortly before it rolls: constant acceleration, which theta = 1/2 follows exactly and theta = 1 to first order."
    moving = [grain(up(dim, R), velocity=up(dim, 0.0, 1.0))]
    yield scene("order-sliding", dim, says, moving, pairs=on_walls(friction=0.3), h=until / 32, count=32)
    fall = math.sqrt(2 / G)
    says = "A ball dropped from 1 rebounds with e = 0.5, two thirds into a step of whatever size: place at one and a half times its time, to first order."
    yield scene("order-impact", dim, says, [grain(up(dim, R + 1.0))], pairs=on_walls(restitution=0.5), h=fall / (64 + 2 / 3), count=97)
    arm = 2 * R * math.sin(math.radians(45))
    base = [up(dim, R, sign * arm) for sign in (-1, 1)] + ([[0.0, sign * arm, R] for sign in (-1, 1)] if dim == 3 else [])
    says = (
        f"One ball sinks between {len(base)} that give way on the floor, with friction at every contact: places to first order, against steps "
        "eight times smaller than the smallest."
    )
    grains = [*map(grain, base), grain(up(dim, R + 2 * R * math.cos(math.radians(45))))]
    yield scene("order-packing", dim, says, grains, pairs=everywhere(friction=0.1), h=0.2 / 32, count=32, tolerance=1e-9)


def energies(dim):
    """Solved to the default tolerance, for long: whatever the ratio of masses or radii, no energy comes out of nothing."""
    for e in (0.5, 1.0):
        claim, how = f"without friction, rebounding with e = {e:g}: no energy is gained.", {"pairs": everywhere(restitution=e), **DEFAULT}
        grains = (grain(up(dim, R + 1.0 + 1.01 * 2 * R * k)) for k in range(10))
        yield scene(f"rebound-column-{e:g}", dim, f"A column of 10, each 1 % of a diameter above the next, falls by one, {claim}", grains, **how)
        grains, walls = gas(dim)
        yield scene(f"rebound-gas-{e:g}", dim, f"Balls in a box, {claim}", grains, walls=walls, weightless=True, **how)
    if dim == 2:
        return
    stacked = [grain(up(3, R)), grain(up(3, 3 * R), material="heavy")]
    for ratio, (law, number) in itertools.product(RATIOS, (*(("friction", mu) for mu in (0.0, 0.1, 0.5, 1.0)), ("restitution", 0.5), ("restitution", 1.0))):
        name, claim = (
            ("pair", f"friction {number:g}: they stay, and gain no energy.")
            if law == "friction"
            else ("rebound-pair", f"without friction, rebounding with e = {number:g}: no energy is gained.")
        )
        says = f"Two balls at rest on a floor, the upper {ratio} times the heavier, {claim}"
        pairs = [contact(*names, **{law: number}) for names in (("grain", "heavy"), ("grain", "wall"))]
        yield scene(f"{name}-{ratio}-{number:g}", 3, says, stacked, densities={"grain": 1.0, "heavy": float(ratio), "wall": 1.0}, **DEFAULT, pairs=pairs)
    for ratio, n, mu in itertools.product((1, 3, 10, 30, 100), (1, 16), (0.0, 0.1, 0.5, 1.0)):
        side = math.isqrt(n)
        small = [grain([2 * R * i - (side - 1) * R, 2 * R * j - (side - 1) * R, R]) for i in range(side) for j in range(side)]
        height = R + R * math.sqrt((1 + ratio) ** 2 - (2 if n > 1 else 0))
        after = ", whether it stays or pushes them apart." if n > 1 else "; both stay."
        says = f"A ball of {ratio} times the radius at rest on {n} of the same density, friction {mu:g}: no energy is gained{after}"
        # pushed apart by exact answers they gain 1.0e-6 at h = 1e-3, a quarter of that at h/2: the time stepping's
        how = DEFAULT | ({"h": 5e-4} if n > 1 else {})
        yield scene(f"heap-{ratio}-{n}-{mu:g}", 3, says, [*small, grain(up(3, height), ratio * R)], **how, pairs=everywhere(friction=mu))


FAMILIES = (columns, crystals, lids, impacts, rolling, piles, wedges, infeasible, long_runs, orders, energies)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare with the committed files, write nothing")
    check = parser.parse_args().check
    files = {f"{one['name']}.toml": text(one) for family in FAMILIES for dim in (2, 3) for one in family(dim)}
    there = {path.name: path.read_text() for path in FOLDER.glob("*.toml")}
    wrong = sorted(name for name in there.keys() | files.keys() if there.get(name) != files.get(name))
    if check and wrong:
        sys.exit(f"generate: not as written by this script: {', '.join(wrong)}")
    for name in wrong:
        (FOLDER / name).write_text(files[name]) if name in files else (FOLDER / name).unlink()
    print(f"generate: {len(files)} scenes" + ("" if check else f", {len(wrong)} of them anew"))


if __name__ == "__main__":
    main()
