"""A run as a picture or a film: grains, force chains, walls and cell, from frames that the program has written.

Frames in HDF5 are drawn by matplotlib. Frames for ParaView (.pvd) are drawn by ParaView's pvpython, with real spheres and tubes."""
import io
import os
import shutil
import subprocess
from pathlib import Path

import h5py
import numpy as np
from matplotlib import animation
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from ..record import InputError, aside
from .packings import add_disks, from_a_corner, shaded_spheres
from .style import INK, fewer_colours, plt

ENDINGS = {".png": "picture", ".svg": "picture", ".pdf": "picture", ".gif": "film", ".mp4": "film"}
INCHES = 6.4  # the longer side of what is drawn
WALL = {"colors": "#6b6b66", "linewidths": 1.6}
RIM = {"edgecolors": "#8a8a86", "linewidths": 0.3}


class Frame:
    """One frame: centres (n, 3), radii, values of the colour, contacts with ends (c, 2, 3) and normal forces, outlines of walls and cell."""

    def __init__(self, group, colour):
        grains, contacts, walls = group["grains"], group["contacts"], group["walls"]
        self.time, self.x, self.radius = float(group.attrs["time"]), grains["x"][()], grains["radius"][()]
        source = grains[{"speed": "velocity"}.get(colour, colour)][()]
        self.values = np.linalg.norm(source, axis=1) if source.ndim > 1 else source
        self.ends, self.force = contacts["ends"][()].reshape(-1, 2, 3), contacts["normal_force"][()]
        corners = np.split(walls["points"][()], np.cumsum(walls["corners"][()]))[:-1]
        self.outlines = [np.vstack([c, c[:1]]) if len(c) > 2 else c for c in corners]


def read_frames(path, colour):
    """All frames of a file; whether they are of disks. Raises InputError."""
    try:
        with h5py.File(path) as file:
            frames = [Frame(file[name], colour) for name in sorted(file) if name.startswith("step_")]
    except (OSError, KeyError) as error:
        raise InputError(f"{path}: no frames of nscdd in HDF5: {str(error).splitlines()[0][:120]}") from None
    if not frames:
        raise InputError(f"{path}: there is no frame: is it what nscdd run --frames has written?")
    return frames, not any(frame.x[:, 2].any() for frame in frames)


class Canvas:
    """Axes with the extent and the scales of all frames, on which one frame after the other is drawn."""

    def __init__(self, frames, disks, colour):
        self.disks, self.colour = disks, colour
        plane = (lambda x: x[..., :2]) if disks else from_a_corner
        self.plane = plane
        reach = [(plane(f.x), f.radius) for f in frames]
        outlines = [plane(line) for f in frames for line in f.outlines]
        low = np.min([(p - r[:, None]).min(0) for p, r in reach] + [line.min(0) for line in outlines], axis=0)
        high = np.max([(p + r[:, None]).max(0) for p, r in reach] + [line.max(0) for line in outlines], axis=0)
        margin = 0.02 * max(high - low)
        self.limits = {"xlim": (low[0] - margin, high[0] + margin), "ylim": (low[1] - margin, high[1] + margin), "aspect": "equal"}
        forces = np.concatenate([f.force[f.force > 0] for f in frames])
        self.mean_force = forces.mean() if len(forces) else 1.0
        values = np.concatenate([f.values for f in frames])
        self.norm = Normalize(values.min(), max(values.max(), values.min() + 1e-300))
        diameter = 2 * INCHES * 72 * np.mean(np.concatenate([f.radius for f in frames])) / max(high - low)  # as it is drawn, in points
        self.width = min(5, 0.4 * diameter)  # of the thickest chain
        width, height = (high - low) / max(high - low)
        panels = 1 if disks else 2
        size = (max(panels * (INCHES * width + 0.6), 2.6), INCHES * height + 0.9)  # the title wants room
        self.figure, axes = plt.subplots(1, panels, figsize=size, squeeze=False)
        self.axes = axes[0]
        self.map = plt.cm.ScalarMappable(self.norm, "viridis")
        self.figure.colorbar(self.map, ax=list(self.axes), label=colour, shrink=0.8)

    def draw(self, frame):
        for axis in self.axes:
            axis.clear()
        colours = self.map.to_rgba(frame.values)[:, :3]
        if self.disks:
            add_disks(self.axes[0], frame.x[:, :2], frame.radius, facecolors=colours, **RIM)
        else:
            shaded_spheres(self.axes[0], frame.x, frame.radius, colours)
            self.axes[1].set_title("force chains")
        widths = self.width * np.minimum(0.16 * np.abs(frame.force) / self.mean_force, 1)
        chains = {"colors": INK if not self.disks else "#c33c2c", "linewidths": widths, "capstyle": "round"}
        self.axes[-1].add_collection(LineCollection(self.plane(frame.ends), **chains))
        for axis in self.axes:
            axis.add_collection(LineCollection([self.plane(line) for line in frame.outlines], **WALL))
            axis.set(**self.limits)
            axis.set_axis_off()
        self.axes[0].set_title(f"{len(frame.radius)} grains, time {frame.time:.4g}")


def draw_picture(frame, disks, out, colour, size):
    """One frame, with extent and scales of its own; its longer side has about so many pixels."""
    canvas, stream = Canvas([frame], disks, colour), io.BytesIO()
    canvas.draw(frame)
    canvas.figure.savefig(stream, format=out.suffix[1:], dpi=size / max(canvas.figure.get_size_inches()))
    plt.close(canvas.figure)
    aside(out, fewer_colours(stream.getvalue(), 192) if out.suffix == ".png" else stream.getvalue())


def draw_hdf5(path, out, step, colour, rate, size):
    frames, disks = read_frames(path, colour)
    if ENDINGS[out.suffix] == "picture":
        if step is not None and not -len(frames) <= step < len(frames):
            raise InputError(f"picture: {path} has {len(frames)} frames, counted from 0: there is no frame {step}")
        draw_picture(frames[-1 if step is None else step], disks, out, colour, size)
        return
    if out.suffix == ".mp4" and not shutil.which("ffmpeg"):
        raise InputError("picture: ffmpeg is not there, which makes .mp4: install it, or ask for .gif")
    writer = animation.FFMpegWriter(fps=rate) if out.suffix == ".mp4" else animation.PillowWriter(fps=rate)
    canvas = Canvas(frames, disks, colour)
    with plt.rc_context({"savefig.bbox": None}), writer.saving(canvas.figure, out, dpi=100):  # all of one size
        for frame in frames:
            canvas.draw(frame)
            writer.grab_frame()


def draw(path, out, step, colour, rate, size=960):
    """Writes the picture `out` of the frame number `step` (None: the last) with `size` pixels on its longer side, or the film of all frames. Raises InputError."""
    out = Path(out) if out else Path(path).with_suffix(".png")
    if out.suffix not in ENDINGS:
        raise InputError(f"picture: {out}: expected a name that ends in one of {', '.join(ENDINGS)}")
    if not Path(path).exists():
        raise InputError(f"picture: {path} is not there: nscdd run --frames makes it")
    if Path(path).suffix != ".pvd":
        draw_hdf5(path, out, step, colour, rate, size)
        return
    if not shutil.which("pvpython"):
        raise InputError("picture: pvpython is not there, which draws .pvd: scripts/setup --paraview installs it, or write --frames to a name in .h5")
    if ENDINGS[out.suffix] == "film" or out.suffix != ".png":
        raise InputError("picture: of a .pvd a .png is made; films are made of frames in .h5")
    script = Path(__file__).with_name("paraview_scene.py")
    screen = [] if os.environ.get("DISPLAY") else ["xvfb-run", "-a"]  # Debian's ParaView draws on one, if not a real one
    if screen and not shutil.which(screen[0]):
        raise InputError("picture: pvpython needs a display: give one, or install xvfb, whose xvfb-run makes one")
    command = [*screen, "pvpython", "--force-offscreen-rendering", script, path, out, colour, str(-1 if step is None else step)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise InputError(f"picture: {path}: pvpython: exit code {done.returncode}: {' '.join(done.stderr.splitlines()[-1:])}")
