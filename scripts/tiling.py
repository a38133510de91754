"""A packing side by side with itself, for scenes larger than what is worth packing."""
import h5py
import numpy as np


def tile(source, target, tiles):
    """Writes a packing of so many copies of another along each axis. Walls touch it as they touched the one."""
    with h5py.File(source) as one, h5py.File(target, "w") as many:
        x, radius, box = one["x"][...], one["radius"][...], one["box"][...]
        count = int(np.prod(tiles))
        to = many.create_dataset("x", (count * len(x), len(box)))
        for k, cell in enumerate(np.ndindex(*tiles)):
            to[k * len(x):(k + 1) * len(x)] = x + np.array(cell) * box
        many["radius"] = np.tile(radius, count)
        many["box"] = box * tiles
