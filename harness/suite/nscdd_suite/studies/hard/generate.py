"""Writes the scenes of cases/hard, one TOML each: the hard cases of the method, whose answers exact.py knows.

    cases/hard/generate [--check]

Nothing is random: the same files come out every time. With --check nothing is written, and the exit code is 1 if a
committed file is not what would be written, or is no longer written.
"""
import argparse
import itertools
import math
import sys

from ...program import ROOT
from .pieces import ABOVE, BELOW, DIMS, G, H, R, contact, everywhere, floor, grain, lattice, loose, on_walls, scene, sides, spin, text, up, wall

FOLDER = ROOT / "cases/hard"


# --- the cases ---------------------------------------------------------------------------------------------------


def columns():
    """Stacks whose contact k carries the weight of all that is above."""
    for dim, n in itertools.product(DIMS, (10, 100, 1000)):
        says = f"A column of {n} at rest, all gaps zero, from zero impulses: contact k above the floor carries ({n} - k) m g h."
        grains = (grain(up(dim, R + 2 * R * k)) for k in range(n))
        yield scene(f"column-{n}", dim, says, grains, tolerance=1e-9 if n == 1000 else 1e-10, check_every=n, max_iterations=20 * n * n)
    for dim, exponent in itertools.product(DIMS, (0, 2, 4, 6)):
        for heavy in ("above", "below") if exponent else ("above",):
            says = (
                f"Two equal balls, the one {heavy} 1e{exponent} times the heavier: impulses (M + m) g h on the floor, and the upper weight times h "
                "between them."
            )
            lower, upper = ("heavy", "grain") if heavy == "below" else ("grain", "heavy")
            grains = [grain(up(dim, R), material=lower), grain(up(dim, 3 * R), material=upper)]
            solver = {"tolerance": 5e-10, "check_every": 10 if exponent < 4 else 1000, "max_iterations": 200 * 10**exponent + 1000}
            densities = {"grain": 1.0, "heavy": 10.0**exponent, "wall": 1.0}
            yield scene(f"mass-1e{exponent}-{heavy}", dim, says, grains, densities=densities, **solver)
    for dim, ratio, big in itertools.product(DIMS, (10, 100), ("above", "below")):
        low, high = (R, R / ratio) if big == "below" else (R / ratio, R)
        says = f"Two balls, the one {big} {ratio} times the larger: impulses are the weights above times h."
        grains = [grain(up(dim, low), low), grain(up(dim, 2 * low + high), high)]
        solver = {"tolerance": 5e-10, "check_every": 10 if ratio**dim < 1e4 else 1000, "max_iterations": 200 * ratio**dim + 1000}
        yield scene(f"radius-{ratio}-{big}", dim, says, grains, **solver)
    for dim in DIMS:
        across, layers = (10, 10) if dim == 2 else (5, 10)
        says = (
            f"A crystal, {across} across and {layers} high, all gaps zero, frictionless, on one wall: every contact k of a column carries ({layers} "
            "- k) m g h, those sideways nothing."
        )
        yield scene("crystal-square", dim, says, map(grain, lattice(dim, across, layers)), max_iterations=10_000)


def crystals():
    """Close packings, whose impulses are many but whose answer is rest."""
    for dim in DIMS:
        layers = 10 if dim == 2 else 8
        rise = math.sqrt(3) * R if dim == 2 else math.sqrt(2) * R
        across = 10 if dim == 2 else 5
        places = []
        for layer in range(layers):
            shift, n = layer % 2, across - layer % 2
            for place in itertools.product(range(n), repeat=dim - 1):
                places.append([R + shift * R + 2 * R * k for k in place] + [R + layer * rise])
        says = f"A close-packed crystal between walls, {layers} layers, frictionless: it stays at rest; the floor carries the whole weight."
        yield scene("crystal-close", dim, says, map(grain, places), walls=[floor(dim), *sides(dim, 2 * R * across)], count=20, tolerance=1e-8)


def impacts():
    """One impact by Newton's law: of two, of a row at once, and of one obliquely on a wall."""
    for dim, e in itertools.product(DIMS, (0.0, 0.5, 1.0)):
        h, speeds = 1 / 8, (2.0, -1.0)
        says = f"Two balls, the second of five times the mass, meet head on: the relative velocity v becomes -{e:g} v."
        pairs = [contact("grain", "heavy", restitution=e)]
        grains = [
            grain(up(dim, 0.0, -0.5 * h * speeds[0]), velocity=up(dim, 0.0, speeds[0])),
            grain(up(dim, 0.0, 2 * R - 0.5 * h * speeds[1]), material="heavy", velocity=up(dim, 0.0, speeds[1])),
        ]
        yield scene(f"restitution-{e:g}", dim, says, grains, pairs=pairs, weightless=True, h=h, densities={"grain": 1.0, "heavy": 5.0}, walls=())
    for dim, e, n in itertools.product(DIMS, (0.0, 0.5, 1.0), range(2, 11)):
        h = 1 / 8
        says = (
            f"A cradle of {n}, one arriving at speed 1, by the simultaneous Newton law with e = {e:g}: the first goes on at 1 - (1 + e) {n - 1}/{n}, "
            f"all others at (1 + e)/{n}."
        )
        pairs = [contact("grain", "grain", restitution=e)]
        grains = [grain(up(dim, 0.0, -0.5 * h), velocity=up(dim, 0.0, 1.0))] + [grain(up(dim, 0.0, 2 * R * k)) for k in range(1, n)]
        yield scene(f"cradle-{n}-{e:g}", dim, says, grains, pairs=pairs, weightless=True, h=h, densities={"grain": 1.0}, walls=())
    for dim, e, share in itertools.product(DIMS, (0.0, 0.5), (BELOW, ABOVE)):
        h, mu, down, spun = 1 / 64, 0.25, 1.5, 0.2
        ratio = 3.5 if dim == 3 else 3.0
        slip = share * ratio * mu * (1 + e) * down
        word = "below: it sticks" if share < 1 else "above: it slides"
        says = (
            f"Oblique impact, e = {e:g}, the contact's tangential velocity 1 % from the threshold {ratio:g} mu (1 + e) |u_n|, {word}; a fifth of "
            "that velocity is spin."
        )
        grains = [grain(up(dim, R + 0.5 * h * down), velocity=up(dim, -down, (1 - spun) * slip), spin=spin(dim, -spun * slip / R))]
        yield scene(f"oblique-{e:g}-{'sticks' if share < 1 else 'slides'}", dim, says, grains, pairs=on_walls(friction=mu, restitution=e), weightless=True, h=h)
    for dim, h in itertools.product(DIMS, (1 / 256, 1 / 1024)):
        e, height = 0.5, 1.0
        total = math.sqrt(2 * height / G) * (1 + e) / (1 - e)
        says = f"A ball dropped from 1 bounces with e = 0.5 until sqrt(2 h0/g) (1+e)/(1-e); step 1/{round(1 / h)}."
        yield scene(f"bounce-{round(1 / h)}", dim, says, [grain(up(dim, R + height))], pairs=on_walls(restitution=e), h=h, count=math.ceil(1.2 * total / h))


def rolling():
    for dim in DIMS:
        ratio = 3.5 if dim == 3 else 3.0
        fraction = "5/7" if dim == 3 else "2/3"
        says = f"Sliding at v0 = 1 to rolling at {fraction} v0: from t = v0/({ratio:g} mu g) on."
        yield scene("rolling", dim, says, [grain(up(dim, R), velocity=up(dim, 0.0, 1.0))], pairs=on_walls(friction=0.3), h=1e-4, count=2000)
        for share in (BELOW, ABOVE):
            mu = 0.2
            angle = math.atan(share * ratio * mu)
            name = "rolls" if share < 1 else "slides"
            says = f"An incline 1 % {'below' if share < 1 else 'above'} tan = {ratio:g} mu: from rest it {name}. The axes are the incline's."
            gravity = up(dim, -G * math.cos(angle), G * math.sin(angle))
            yield scene(f"incline-{name}", dim, says, [grain(up(dim, R))], pairs=on_walls(friction=mu), gravity=gravity, h=1e-3, count=200)
    for dim in DIMS:
        gap = [wall("bottom", up(dim, 1.0), up(dim, 0.0)), wall("top", up(dim, -1.0), up(dim, 2 * R))]
        pressed = [gap[0], gap[1] | {"motion": "force", "force": 5.0, "mass": 2.0}]
        law = on_walls(friction=0.3)
        axes = {"": spin(dim, 10.0)} | ({"-upright": [0.0, 0.0, 10.0]} if dim == 3 else {})
        for suffix, rate in axes.items():
            kept = "about their normal the spin is kept." if suffix else "the spin falls by 2 mu F R/I a second, and ends at zero."
            answers = {"free": "at rest and not pressed: the spin is kept.", "pressed": f"one of them pushed by a force F: {kept}"}
            for name, walls in (("free", gap), ("pressed", pressed)):
                says = f"A spinning grain between two walls, {answers[name]}"
                yield scene(f"spin-{name}{suffix}", dim, says, [grain(up(dim, R), spin=rate)], walls=walls, pairs=law, weightless=True, h=1e-4, count=1000)


def thresholds():
    """Piles and wedges that stand or fall by one per cent of friction."""
    for dim in DIMS:
        tilt = math.pi / 6 if dim == 2 else math.asin(1 / math.sqrt(3))  # of the contact from the vertical
        if dim == 2:
            base = [[-R, R], [R, R]]
        else:
            base = [[2 * R / math.sqrt(3) * math.cos(a), 2 * R / math.sqrt(3) * math.sin(a), R] for a in (math.pi / 2, math.pi * 7 / 6, math.pi * 11 / 6)]
        grains = [grain(place) for place in base] + [grain(up(dim, R + 2 * R * math.cos(tilt)))]
        limits = {"grains": math.tan(tilt / 2), "floor": math.tan(tilt / 2) / (len(base) + 1)}
        for where, share in itertools.product(limits, (BELOW, ABOVE)):
            name = f"pile-{where}-{'falls' if share < 1 else 'stays'}"
            mu = {"grains": 1.0, "floor": 1.0} | {where: share * limits[where]}
            between = "grain and grain" if where == "grains" else "grain and floor"
            says = (
                f"One on {len(base)}: friction between {between} is 1 % {'below' if share < 1 else 'above'} {limits[where]:.4f}, so the pile "
                f"{name.split('-')[2]}."
            )
            pairs = [contact("grain", "grain", friction=mu["grains"]), contact("grain", "wall", friction=mu["floor"])]
            yield scene(name, dim, says, grains, pairs=pairs, h=1e-3, count=1000, tolerance=1e-9)
    half = math.radians(20)  # of the wedge's opening
    for dim in DIMS:
        normals = [up(dim, -math.sin(half), sign * math.cos(half)) for sign in (1.0, -1.0)]
        place = up(dim, -R / math.sin(half))  # touches both walls of the wedge that opens downwards at the origin
        left, right = (wall(name, normal, up(dim, 0.0)) for name, normal in zip(("left", "right"), normals))
        for name, share in (("slips", BELOW), ("holds", ABOVE)):
            mu = share * math.tan(half)
            says = (
                f"A grain in a wedge of opening 2 beta, one side pushed in by a force; mu is 1 % "
                f"{'below' if share < 1 else 'above'} tan beta, so it {'is squeezed out' if share < 1 else 'holds'}."
            )
            walls = [left, right | {"motion": "force", "force": 1e4, "mass": 10.0}]
            yield scene(f"wedge-squeezed-{name}", dim, says, [grain(place)], walls=walls, pairs=on_walls(friction=mu), weightless=True, h=1e-3, count=20)
        says = (
            "The same wedge with both sides fixed, mu 1 % above tan beta, and gravity pulling the grain out. From zero impulses it carries "
            "nothing and falls freely; with the impulses that wedge-squeezed-holds left it stays."
        )
        yield scene("wedge-locked", dim, says, [grain(place)], walls=[left, right], pairs=on_walls(friction=ABOVE * math.tan(half)), h=1e-3, count=20)


def infeasible():
    """Scenes without an answer: the program must say so."""
    for dim in DIMS:
        for name, speed, count, says in (
            ("fast", 4e-2, 4, "Each step would close each contact by 1 % of a radius: no step converges, and each stops at its cap."),
            ("slow", 2e-3, 400, "Each step closes each contact by 5e-4 of a radius, less than a step may: the overlap adds up until it is an error."),
        ):
            half = 0.5 * speed * R / H
            says = f"Two walls close on a jammed crystal. {says}"
            walls = [
                wall("low", up(dim, 1.0), up(dim, 0.0), "velocity", velocity=up(dim, half)),
                wall("high", up(dim, -1.0), up(dim, 6 * R), "velocity", velocity=up(dim, -half)),
            ]
            pairs = [contact("grain", "grain", friction=0.3)]
            grains = map(grain, lattice(dim, 3, 3))
            yield scene(f"squeeze-{name}", dim, says, grains, walls=walls, pairs=pairs, weightless=True, count=count, tolerance=1e-4, max_iterations=2000)
        yield scene("coincident", dim, "Two grains at one place: there is no normal; an error that names both.", [grain(up(dim, R)), grain(up(dim, R))])


def rest():
    for dim in DIMS:
        across = 5 if dim == 2 else 4
        says = "A crystal with friction, all gaps exactly zero, nothing pushing: no velocity and no impulse, exactly."
        yield scene("rest", dim, says, map(grain, lattice(dim, across, across)), pairs=everywhere(friction=0.3), weightless=True, count=10)
        for n in (10, 100, 1000):
            across = n if dim == 2 else math.isqrt(n) + (math.isqrt(n) ** 2 < n)
            places = list(lattice(dim, across, 1, gap=0.25 * R))[:n]
            says = (
                f"A lid pushed by a force F onto {n} grains on a floor, one wall in contact with everything: the lid's contacts carry F h in all, "
                "the floor's the weights too."
            )
            walls = [floor(dim), wall("lid", up(dim, -1.0), up(dim, 2 * R), "force", force=100.0)]
            yield scene(f"lid-{n}", dim, says, map(grain, places), walls=walls, tolerance=1e-8, max_iterations=1_000_000)


def long_runs():
    friction = everywhere(friction=0.3)
    for dim in DIMS:
        grains, walls = loose(dim, 4, 6)
        says = (
            "Loose grains fall into a box with steps ten times too large, 10 % of a radius at full speed: no overlap beyond what the steps were "
            "allowed, no energy gained."
        )
        yield scene("large-step", dim, says, grains, walls=walls, pairs=friction, h=0.01, count=200, tolerance=1e-4)
        grains, walls = loose(dim, *((4, 6) if dim == 2 else (3, 4)))
        says = "Loose grains settle in a box and lie there for 10,000 steps: neither creep nor energy gained."
        yield scene("settled", dim, says, grains, walls=walls, pairs=friction, h=1e-3, count=10_000, tolerance=1e-6)


def time_stepping():
    """Scenes that are run again with other steps and theta, and long ones without loss."""
    law = on_walls(friction=0.3)
    for dim in DIMS:
        ratio = 3.5 if dim == 3 else 3.0
        until = 0.9 / (ratio * 0.3 * G)
        says = "Sliding on a floor until shortly before it rolls: constant acceleration, which theta = 1/2 follows exactly and theta = 1 to first order."
        yield scene("order-sliding", dim, says, [grain(up(dim, R), velocity=up(dim, 0.0, 1.0))], pairs=law, h=until / 32, count=32)
        fall = math.sqrt(2 / G)
        says = "A ball dropped from 1 rebounds with e = 0.5, two thirds into a step of whatever size: place at one and a half times its time, to first order."
        yield scene("order-impact", dim, says, [grain(up(dim, R + 1.0))], pairs=on_walls(restitution=0.5), h=fall / (64 + 2 / 3), count=97)
        tilt = math.radians(45)
        base = [[sign * 2 * R * math.sin(tilt)] + [0.0] * (dim - 2) + [R] for sign in (-1, 1)]
        if dim == 3:
            base += [[0.0, sign * 2 * R * math.sin(tilt), R] for sign in (-1, 1)]
        says = (
            f"One ball sinks between {len(base)} that give way on the floor, with friction at every contact: places to first order, against steps "
            "eight times smaller than the smallest."
        )
        grains = [grain(place) for place in base] + [grain(up(dim, R + 2 * R * math.cos(tilt)))]
        yield scene("order-packing", dim, says, grains, pairs=everywhere(friction=0.1), h=0.2 / 32, count=32, tolerance=1e-9)
        grains, walls = loose(dim, 4 if dim == 2 else 3, 4 if dim == 2 else 3)
        gas = [entry | {"velocity": [math.sin(7.0 * k + 2.0 * d) for d in range(dim)]} for k, entry in enumerate(grains)]
        lid = wall("lid", up(dim, -1.0), up(dim, 12 * R))
        says = "Balls without friction, rebounding with e = 1 from each other and the walls for 10,000 steps: their energy is kept."
        yield scene("gas", dim, says, gas, walls=[*walls, lid], pairs=everywhere(restitution=1.0), weightless=True, h=1e-3, count=10_000, tolerance=1e-9)
        places = list(lattice(dim, 4 if dim == 2 else 3, 4 if dim == 2 else 3, gap=0.02))
        middle = [sum(axis) / len(places) for axis in zip(*places)]
        clump = []
        for k, place in enumerate(places):
            inwards = [m - x for m, x in zip(middle, place)]
            turn = [-0.5 * inwards[-1]] + [0.0] * (dim - 2) + [0.5 * inwards[0]]
            rate = 2.0 * math.cos(k) if dim == 2 else [math.cos(k), 2.0 * math.sin(k), 1.0]
            clump.append(grain(place, velocity=[0.3 * a + b for a, b in zip(inwards, turn)], spin=rate))
        says = "A clump that turns, spins, closes in and rubs, alone in space, for 10,000 steps: momentum and angular momentum are kept, energy is only lost."
        yield scene("clump", dim, says, clump, pairs=[contact("grain", "grain", friction=0.4)], weightless=True, h=1e-3, count=10_000, tolerance=1e-6, walls=())


DEFAULT = {"h": 1e-3, "count": 10_000, "tolerance": 1e-4, "max_iterations": 20_000}  # a run's, for those who choose nothing
RATIOS = ("1e1", "1e2", "1e3", "1e4", "1e5", "3e5", "1e6")


def energies():
    """Solved to the default tolerance, for long: whatever the ratio of masses or radii, no energy comes out of nothing."""

    def upper(ratio):
        return [grain(up(3, R)), grain(up(3, 3 * R), material="heavy")], {"grain": 1.0, "heavy": float(ratio), "wall": 1.0}

    for ratio, mu in itertools.product(RATIOS, (0.0, 0.1, 0.5, 1.0)):
        grains, densities = upper(ratio)
        says = f"Two balls at rest on a floor, the upper {ratio} times the heavier, friction {mu:g}: they stay, and gain no energy."
        pairs = [contact(*names, friction=mu) for names in (("grain", "heavy"), ("grain", "wall"))]
        yield scene(f"pair-{ratio}-{mu:g}", 3, says, grains, densities=densities, **DEFAULT, pairs=pairs)
    for ratio, n, mu in itertools.product((1, 3, 10, 30, 100), (1, 16), (0.0, 0.1, 0.5, 1.0)):
        side = math.isqrt(n)
        small = [[x - (side - 1) * R, y - (side - 1) * R, z] for x, y, z in ([2 * R * i, 2 * R * j, R] for i in range(side) for j in range(side))]
        height = R + R * math.sqrt((1 + ratio) ** 2 - (2 if n > 1 else 0))
        after = ", whether it stays or pushes them apart." if n > 1 else "; both stay."
        says = f"A ball of {ratio} times the radius at rest on {n} of the same density, friction {mu:g}: no energy is gained{after}"
        grains = [*map(grain, small), grain(up(3, height), ratio * R)]
        # pushed apart by exact answers they gain 1.0e-6 at h = 1e-3, a quarter of that at h/2: the time stepping's
        yield scene(f"heap-{ratio}-{n}-{mu:g}", 3, says, grains, **DEFAULT | ({"h": 5e-4} if n > 1 else {}), pairs=everywhere(friction=mu))
    for e in (0.5, 1.0):
        both = everywhere(restitution=e)
        claim = f"without friction, rebounding with e = {e:g}: no energy is gained."
        for ratio in RATIOS:
            grains, densities = upper(ratio)
            says = f"Two balls at rest on a floor, the upper {ratio} times the heavier, {claim}"
            pairs = [contact(*names, restitution=e) for names in (("grain", "heavy"), ("grain", "wall"))]
            yield scene(f"rebound-pair-{ratio}-{e:g}", 3, says, grains, densities=densities, **DEFAULT, pairs=pairs)
        for dim in DIMS:
            says = f"A column of 10, each 1 % of a diameter above the next, falls by one, {claim}"
            yield scene(f"rebound-column-{e:g}", dim, says, (grain(up(dim, R + 1.0 + 1.01 * 2 * R * k)) for k in range(10)), pairs=both, **DEFAULT)
            grains, walls = loose(dim, 4 if dim == 2 else 3, 4 if dim == 2 else 3)
            gas = [entry | {"velocity": [math.sin(7.0 * k + 2.0 * d) for d in range(dim)]} for k, entry in enumerate(grains)]
            walls = [*walls, wall("lid", up(dim, -1.0), up(dim, 12 * R))]
            yield scene(f"rebound-gas-{e:g}", dim, f"Balls in a box, {claim}", gas, walls=walls, pairs=both, weightless=True, **DEFAULT)


def all_scenes():
    for family in (columns, crystals, impacts, rolling, thresholds, infeasible, rest, long_runs, time_stepping, energies):
        yield from family()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare with the committed files, write nothing")
    options = parser.parse_args()
    files = {f"{one['name']}.toml": text(one) for one in all_scenes()}
    stale = sorted(path.name for path in FOLDER.glob("*.toml") if path.name not in files)
    if options.check:
        wrong = stale + [name for name, content in files.items() if not (FOLDER / name).exists() or (FOLDER / name).read_text() != content]
        if wrong:
            sys.exit(f"generate: not as written by this script: {', '.join(wrong)}")
        return
    for name in stale:
        (FOLDER / name).unlink()
    for name, content in files.items():
        (FOLDER / name).write_text(content)
    print(f"generate: {len(files)} scenes")


if __name__ == "__main__":
    main()
