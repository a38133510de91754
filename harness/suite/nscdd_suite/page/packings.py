"""State files, and subdomains and multiplicities drawn on their spheres."""
import h5py
import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.colors import to_rgb
from matplotlib.patches import Rectangle

from ..record import InputError
from .style import multiplicity_colour, plt, subdomain_colour

FIELDS = ("x", "radius", "box", "subdomain", "multiplicity")
CONTACTS = ("i", "j", "normal", "gap", "subdomain")


def read_state(path):
    """Arrays of a state file by name, those of contacts in a dictionary of their own. Raises InputError."""
    try:
        with h5py.File(path) as file:
            state = {name: file[name][()] for name in FIELDS}
            state["contacts"] = {name: file["contacts"][name][()] for name in CONTACTS}
    except (OSError, KeyError) as error:
        raise InputError(f"{path}: not a state file: {str(error).splitlines()[0][:120]}") from None
    return state


def contact_lines(state):
    """Ends of each contact's branch, (c, 2, dim): from centre to centre, or from a wall to the centre."""
    x, contacts = state["x"], state["contacts"]
    i, j = contacts["i"], contacts["j"]
    distance = (state["radius"][i] + contacts["gap"])[:, None]
    other = np.where((j >= 0)[:, None], x[np.maximum(j, 0)], x[i] - distance * contacts["normal"])
    return np.stack([x[i], other], axis=1)


def draw_disks(axis, x, radius, pad=0.0, **look):
    """Disks on an axis without a frame, as far as they reach and a margin of so much of their extent."""
    axis.add_collection(EllipseCollection(2 * radius, 2 * radius, 0 * radius, units="xy", offsets=x, transOffset=axis.transData, **look))
    low, high = (x - radius[:, None]).min(0), (x + radius[:, None]).max(0)
    pad *= max(high - low)
    axis.set(xlim=(low[0] - pad, high[0] + pad), ylim=(low[1] - pad, high[1] + pad), aspect="equal")
    axis.set_axis_off()


def render_spheres(x, radius, colours, size=900, oversample=2):
    """Image (size, size, 4) of shaded spheres, seen from above a corner, nearer spheres hiding farther ones.

    x (n, 3), radius (n), colours (n, 3) in 0 to 1. Parallel projection; drawn `oversample` times larger and averaged.
    """
    turn, tilt = np.radians(-52), np.radians(28)
    right = np.array([np.cos(turn + np.pi / 2), np.sin(turn + np.pi / 2), 0])
    towards = np.array([np.cos(turn) * np.cos(tilt), np.sin(turn) * np.cos(tilt), np.sin(tilt)])
    up = np.cross(towards, right)
    centre = x @ np.stack([right, up, towards], axis=1)
    span = max(np.ptp(centre[:, k]) for k in (0, 1)) + 2.2 * radius.max()
    pixels = size * oversample
    scale = pixels / span
    middle = (centre[:, :2].max(0) + centre[:, :2].min(0)) / 2
    screen = (centre[:, :2] - middle) * [scale, -scale] + pixels / 2
    light = np.array([-0.45, 0.6, 0.66])  # over the left shoulder, in (right, up, towards)

    image, depth = np.zeros((pixels, pixels, 4), np.float32), np.full((pixels, pixels), -np.inf, np.float32)
    for (cx, cy), z, r, colour in zip(screen, centre[:, 2], radius * scale, colours):
        x0, x1, y0, y1 = int(cx - r), int(cx + r) + 2, int(cy - r), int(cy + r) + 2
        window = np.s_[max(y0, 0) : y1, max(x0, 0) : x1]
        nx = (np.arange(max(x0, 0), min(x1, pixels)) + 0.5 - cx)[None, :] / r
        ny = -(np.arange(max(y0, 0), min(y1, pixels)) + 0.5 - cy)[:, None] / r
        rest = 1 - nx**2 - ny**2
        nz = np.sqrt(np.maximum(rest, 0))
        here = z + nz * r / scale
        seen = (rest > 0) & (here > depth[window])
        diffuse = np.maximum(0, nx * light[0] + ny * light[1] + nz * light[2])
        shade = (0.30 + 0.70 * diffuse) * (0.55 + 0.45 * np.sqrt(nz))  # darker rims set neighbours apart
        gloss = 0.16 * diffuse**24
        pixel = np.clip(shade[..., None] * colour + gloss[..., None], 0, 1)
        depth[window][seen] = here[seen]
        image[window][seen] = np.concatenate([pixel, np.ones_like(pixel[..., :1])], axis=-1)[seen]
    blocks = image.reshape(size, oversample, size, oversample, 4).astype(np.float64)
    covered = blocks[..., 3:].sum(axis=(1, 3))
    colour = (blocks[..., :3] * blocks[..., 3:]).sum(axis=(1, 3)) / np.maximum(covered, 1)
    return np.dstack([colour, covered / oversample**2])


def sphere_counts(state):
    """Subdomains, and grains of each multiplicity."""
    numbers, grains = np.unique(state["multiplicity"], return_counts=True)
    return {"subdomains": len(np.unique(state["subdomain"])), "multiplicity": dict(zip(numbers.tolist(), grains.tolist()))}


def draw_spheres(state):
    """Fig. 2: (a) subdomain index and (b) multiplicity, the quarter facing the reader taken out."""
    x, r, m, owner = state["x"], state["radius"], state["multiplicity"], state["subdomain"]
    middle = (x.max(0) + x.min(0)) / 2
    kept = ~((x[:, 0] > middle[0]) & (x[:, 1] < middle[1]))
    figure, axes = plt.subplots(1, 2, figsize=(9.6, 5.4))
    how = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "handlelength": 1, "handleheight": 1, "columnspacing": 1.2}
    for axis, title, values, colour_of, label, columns in (
        (axes[0], "(a) subdomain index", owner, subdomain_colour, "{}", 8),
        (axes[1], "(b) multiplicity", m, multiplicity_colour, "{}  ({})", 6),
    ):
        numbers, grains = np.unique(values, return_counts=True)
        palette = {k: to_rgb(colour_of(k)) for k in numbers}
        colours = np.array([palette[k] for k in values])
        axis.imshow(render_spheres(x[kept], r[kept], colours[kept]))
        axis.set_title(title)
        axis.set_axis_off()
        handles = [Rectangle((0, 0), 1, 1, facecolor=palette[k], edgecolor="#8a8a86", linewidth=0.4, label=label.format(k, n)) for k, n in zip(numbers, grains)]
        axis.legend(handles=handles, ncols=min(columns, len(handles)), **how)
    return figure
