"""A copy of a packing or of a state with every coordinate off by up to 1e-9 of the grain's radius: another draw of the same test.

    PYTHONPATH=harness/suite python3 -m nscdd_suite.perturbed FILE SEED OUT
"""
import shutil
import sys
from pathlib import Path

import h5py
import numpy as np

PERTURBED = 1e-9  # radii


def perturb(file, seed, out):
    part = Path(f"{out}.part")
    shutil.copy(file, part)
    with h5py.File(part, "r+") as copy:
        x = copy["x"][:]
        copy["x"][:] = x + PERTURBED * copy["radius"][:][:, None] * np.random.default_rng(seed).uniform(-1, 1, x.shape)
    part.replace(out)


if __name__ == "__main__":
    if len(sys.argv) != 4 or not sys.argv[2].isdigit():
        sys.exit(__doc__)
    perturb(sys.argv[1], int(sys.argv[2]), sys.argv[3])
