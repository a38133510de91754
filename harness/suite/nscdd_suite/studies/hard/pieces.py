"""What the scenes of cases/hard are made of, and how one is written as TOML."""
import itertools
import textwrap

G = 10.0  # gravity
R = 0.5  # radius: places are multiples of it, so that gaps of columns and rows are exactly zero
H = 1 / 128  # step, an exact number as well
DIMS = (2, 3)
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


def up(dim, z, x=0.0):
    """A vector with height z along the last axis and x along the first."""
    return [x, z] if dim == 2 else [x, 0.0, z]


def spin(dim, rate):
    """About the horizontal axis across x: positive rolls towards +x, which is clockwise in 2D."""
    return -rate if dim == 2 else [0.0, rate, 0.0]


def grain(position, radius=R, material="grain", **more):
    return {"position": position, "radius": radius, "material": material, **more}


def wall(name, normal, through, motion="fixed", **more):
    return {"name": name, "normal": normal, "through": through, "material": "wall", "motion": motion, **more}


def floor(dim):
    return wall("floor", up(dim, 1.0), up(dim, 0.0))


def sides(dim, width):
    """The walls of a square box."""
    walls = []
    for axis, letter in enumerate("xy"[: dim - 1]):
        for upper in (0, 1):
            normal, through = [0.0] * dim, [0.0] * dim
            normal[axis], through[axis] = 1.0 - 2 * upper, width * upper
            walls.append(wall(f"{letter}{'-+'[upper]}", normal, through))
    return walls


def contact(a, b, **law):
    return {"materials": [a, b], **law}


def on_walls(**law):
    return [contact("grain", "wall", **law)]


def everywhere(**law):
    return [contact("grain", "grain", **law), *on_walls(**law)]


def scene(name, dim, says, grains, *, walls=None, pairs=(), weightless=False, gravity=None, densities=None, h=H, count=1, **solver):
    """On a floor, if no other walls are given."""
    materials = {"grain": 1.0, "wall": 1.0} if densities is None else densities
    return {
        "says": says,
        "name": f"{name}-{dim}d",
        "dimension": dim,
        "gravity": gravity or up(dim, 0.0 if weightless else -G),
        "grain": list(grains),
        "material": [{"name": key, "density": density} for key, density in materials.items()],
        "pair": list(pairs),
        "wall": [floor(dim)] if walls is None else list(walls),
        "step": {"h": h, "count": count},
        "solver": {"tolerance": 1e-10, "check_every": 10, "max_iterations": 100_000} | solver,
    }


def lattice(dim, across, layers, gap=0.0):
    """A square or cubic lattice on the floor, its lowest corner at the origin."""
    sides = [range(across)] * (dim - 1) + [range(layers)]
    for place in itertools.product(*sides):
        yield [R + k * (2 * R + gap) for k in place[:-1]] + [R + 2 * R * place[-1]]


def loose(dim, across, layers):
    """Grains apart, a little out of line, and the sides of the box around them."""
    places = []
    for row in range(layers):
        for place in itertools.product(range(across), repeat=dim - 1):
            shifts = [0.4 * R * ((sum(place) * share + 0.2 * row) % 1.0) for share in (0.618034, 0.414214)]
            places.append([R + 2.5 * R * k + shift for k, shift in zip(place, shifts)] + [R + 2.4 * R * row + 0.2 * R * ((sum(place) + row) % 3)])
    return map(grain, places), [floor(dim), *sides(dim, 2.5 * R * across + R)]


def strips(places, subdomains):
    """The grid of so many strips across the longest side, as an argument of the program."""
    sides = [max(axis) - min(axis) for axis in zip(*places)]
    cells = ["1"] * len(sides)
    cells[sides.index(max(sides))] = str(subdomains)
    return "x".join(cells)
