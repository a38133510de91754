"""A packing side by side with itself, for scenes larger than what is worth packing.

    PYTHONPATH=harness/suite python3 -m nscdd_suite.tiling PACKING OUT NX NY [NZ]
"""
import sys
from pathlib import Path

import h5py
import numpy as np


def tile(source, target, tiles):
    """Writes a packing of so many copies of another along each axis. Walls touch it as they touched the one."""
    part = Path(f"{target}.part")
    with h5py.File(source) as one, h5py.File(part, "w") as many:
        x, radius, box = one["x"][...], one["radius"][...], one["box"][...]
        count = int(np.prod(tiles))
        to = many.create_dataset("x", (count * len(x), len(box)))
        for k, cell in enumerate(np.ndindex(*tiles)):
            to[k * len(x) : (k + 1) * len(x)] = x + np.array(cell) * box
        many["radius"] = np.tile(radius, count)
        many["box"] = box * tiles
        if "periodic" in one:  # what repeats is as whole with as many copies
            many["periodic"] = one["periodic"][...]
    part.replace(target)


if __name__ == "__main__":
    if len(sys.argv) not in (5, 6) or not all(word.isdigit() for word in sys.argv[3:]):
        sys.exit(__doc__)
    tile(sys.argv[1], sys.argv[2], tuple(map(int, sys.argv[3:])))
