"""The same grains by LAMMPS: stiff springs instead of rigid grains, at the volume that our run ended with."""
import math
from pathlib import Path

import h5py
import numpy as np

from ...program import ROOT, call, shown
from ...record import toml

STIFFNESS = 1e4  # over stress and, of spheres, diameter: mean overlaps of 1e-4 diameters
STEP = 0.15  # over the time of two grains' spring, of which an undamped contact lasts pi
MEANS = 160  # that are written, over equal times


def write_start(state, rate, out):
    """Grains and cell of a state as LAMMPS reads them: each within the cell, with the flow's velocity besides its own. Returns their number
    and the solid fraction."""
    with h5py.File(state) as file:
        x, radius, velocity, spin = (file[key][...] for key in ("x", "radius", "velocity", "spin"))
        size, tilt = file["cell/size"][...], file["cell/tilt"][...]
    dim = len(size)
    sides = np.diag(size) + tilt
    x = (sides @ (np.linalg.solve(sides, x.T) % 1)).T
    velocity[:, 0] += rate * x[:, -1]
    flat = dim == 2
    density = 0.75 / radius if flat else np.ones_like(radius)  # a sphere of it has the mass of a disk
    low, size3, xy, xz = (-0.5 if flat else 0.0), np.append(size, 0.5)[:3], tilt[0, 1], 0.0 if flat else tilt[0, 2]
    text = [f"sheared grains\n\n{len(x)} atoms\n1 atom types\n"]
    text += [f"{low if axis == 'z' else 0.0} {edge:.17g} {axis}lo {axis}hi" for axis, edge in zip("xyz", size3)]
    text += [f"{xy:.17g} {xz:.17g} {0.0 if flat else tilt[1, 2]:.17g} xy xz yz\n\nAtoms # sphere\n"]
    pad = np.zeros((len(x), 3 - dim))
    spins = np.c_[np.zeros((len(x), 2)), spin.reshape(-1, 1)] if flat else spin
    text += [line(k, 1, 2 * r, rho, *place) for k, (r, rho, place) in enumerate(zip(radius, density, np.c_[x, pad]), 1)]
    text += ["\nVelocities\n"] + [line(k, *one) for k, one in enumerate(np.c_[velocity, pad, spins], 1)]
    Path(out).write_text("\n".join(text) + "\n")
    return len(x), float((math.pi * radius**2 if flat else 4 / 3 * math.pi * radius**3).sum() / size.prod())


def line(*values):
    return " ".join(f"{value:.17g}" for value in values)


def by_lammps(scene, rate, stem, strain, mean, law):
    """One run: its row. Stresses are of contacts alone, as ours are."""
    friction = toml(Path(ROOT, f"cases/rheology/{scene}.toml"))["pair"][0]["friction"]
    dim, data, out = 2 if scene == "disks" else 3, Path(f"{stem}.data"), Path(f"{stem}.means")
    grains, fraction = write_start(f"{stem}.h5", rate, data)
    swing = math.sqrt(STIFFNESS / (0.5 * (math.pi / 4 if dim == 2 else math.pi / 6)))  # of two grains of diameter 1
    steps = math.ceil(strain / rate * swing / STEP / MEANS / 10) * MEANS * 10
    values = {"dim": dim, "data": data, "k": STIFFNESS, "damping": f"{2 * swing:.6g}", "friction": friction, "rate": f"{rate:.17g}"}
    values |= {"dt": f"{strain / rate / steps:.17g}", "steps": steps, "every": steps // MEANS, "out": out}
    command = ["lmp", "-in", "cases/rheology/shear.lmp", "-log", f"{stem}.log", "-screen", "none"]
    for name, value in values.items():
        command += ["-var", name, value]
    call(command, fine=(0,), out=out)
    means = np.loadtxt(out)
    half = means[len(means) // 2 :]
    normal, shear = (2, 4) if dim == 2 else (3, 5)  # columns: step, contacts, motion
    stress, stress_error = mean([float(value) for value in half[:, normal]])
    ratio = float(-half[:, shear].mean()) / stress
    mu, mu_error = mean([ratio - float(a + ratio * b) / stress for a, b in zip(half[:, shear], half[:, normal])])  # at this volume both vary together
    inertial = rate * (math.sqrt(math.pi / 4) if dim == 2 else 1.0) / math.sqrt(stress)
    by_law, fraction_by_law = law(scene, inertial)
    return {
        **{"scene": scene, "solver": "lammps", "grains": grains, "steps": steps, "inertial_number": inertial},
        **{"normal_stress": stress, "normal_stress_error": stress_error, "motion_over_normal_stress": float(half[:, normal + 6].mean()) / stress},
        **{"mu": mu, "mu_error": mu_error, "mu_published": by_law},
        **{"solid_fraction": fraction, "fraction_error": 0.0, "fraction_published": fraction_by_law},
        **{"iterations_a_step": None, "unconverged_steps": None, "command": shown(command)},
    }
