"""What the scenes of this folder are made of, and how one is written as TOML."""
import itertools
import textwrap

G = 10.0  # gravity
R = 0.5  # radius: places are multiples of it, so that gaps of columns and rows are exactly zero
H = 1 / 128  # step, an exact number as well
DIMENSIONS = (2, 3)
BELOW, ABOVE = 0.99, 1.01  # how near thresholds are approached


# --- TOML --------------------------------------------------------------------------------------------------------

def value(x):
    if isinstance(x, str):
        return f'"{x}"'
    if isinstance(x, (list, tuple)):
        return "[" + ", ".join(map(value, x)) + "]"
    if isinstance(x, dict):
        return "{ " + ", ".join(f"{key} = {value(entry)}" for key, entry in x.items()) + " }"
    return repr(x)


def text(scene):
    """The file of a scene. `says` becomes the comment above it; grains are a line each."""
    lines = [f"# {line}" for line in textwrap.wrap(scene["says"], 116)] + [""]
    for key in ("name", "dimension", "gravity"):
        lines.append(f"{key} = {value(scene[key])}")
    lines += ["", "grain = ["] + [f"  {value(grain)}," for grain in scene["grain"]] + ["]"]
    for table in ("material", "pair", "wall"):
        for entry in scene.get(table, []):
            lines += ["", f"[[{table}]]"] + [f"{key} = {value(x)}" for key, x in entry.items()]
    for table in ("step", "solver"):
        lines += ["", f"[{table}]"] + [f"{key} = {value(x)}" for key, x in scene[table].items()]
    return "\n".join(lines) + "\n"


# --- pieces of scenes --------------------------------------------------------------------------------------------

def up(dimension, z, x=0.0):
    """A vector with height z along the last axis and x along the first."""
    return [x, z] if dimension == 2 else [x, 0.0, z]


def spin(dimension, rate):
    """About the horizontal axis across x: positive rolls towards +x, which is clockwise in 2D."""
    return -rate if dimension == 2 else [0.0, rate, 0.0]


def grain(position, radius=R, material="grain", **more):
    return {"position": position, "radius": radius, "material": material, **more}


def wall(name, normal, through, motion="fixed", **more):
    return {"name": name, "normal": normal, "through": through, "material": "wall", "motion": motion, **more}


def floor(dimension):
    return wall("floor", up(dimension, 1.0), up(dimension, 0.0))


def sides(dimension, width):
    """The walls of a square box."""
    walls = []
    for axis, letter in enumerate("xy"[:dimension - 1]):
        for upper in (0, 1):
            normal, through = [0.0] * dimension, [0.0] * dimension
            normal[axis], through[axis] = 1.0 - 2 * upper, width * upper
            walls.append(wall(f"{letter}{'-+'[upper]}", normal, through))
    return walls


def contact(a, b, **law):
    return {"materials": [a, b], **law}


def scene(name, dimension, says, grains, *, walls=(), pairs=(), gravity=None, densities=None, h=H, count=1, theta=None,
          tolerance=1e-10, check_every=10, max_iterations=100_000):
    materials = {"grain": 1.0, "wall": 1.0} if densities is None else densities
    step = {"h": h, "count": count} | ({} if theta is None else {"theta": theta})
    return {"says": says, "name": f"{name}-{dimension}d", "dimension": dimension,
            "gravity": up(dimension, -G) if gravity is None else gravity, "grain": list(grains),
            "material": [{"name": key, "density": density} for key, density in materials.items()],
            "pair": list(pairs), "wall": list(walls), "step": step,
            "solver": {"tolerance": tolerance, "check_every": check_every, "max_iterations": max_iterations}}


def lattice(dimension, across, layers, gap=0.0):
    """A square or cubic lattice on the floor, its lowest corner at the origin."""
    sides = [range(across)] * (dimension - 1) + [range(layers)]
    for place in itertools.product(*sides):
        yield [R + k * (2 * R + gap) for k in place[:-1]] + [R + 2 * R * place[-1]]


def loose(dimension, across, layers):
    """Grains apart, a little out of line, and the sides of the box around them."""
    places = []
    for row in range(layers):
        for place in itertools.product(range(across), repeat=dimension - 1):
            shifts = [0.4 * R * ((sum(place) * share + 0.2 * row) % 1.0) for share in (0.618034, 0.414214)]
            places.append([R + 2.5 * R * k + shift for k, shift in zip(place, shifts)]
                          + [R + 2.4 * R * row + 0.2 * R * ((sum(place) + row) % 3)])
    return map(grain, places), [floor(dimension), *sides(dimension, 2.5 * R * across + R)]


def strips(places, subdomains):
    """The grid of so many strips across the longest side, as an argument of the program."""
    sides = [max(axis) - min(axis) for axis in zip(*places)]
    cells = ["1"] * len(sides)
    cells[sides.index(max(sides))] = str(subdomains)
    return "x".join(cells)
