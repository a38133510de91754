"""The settling scene by both codes: the grains, a run of each, and one judge for both ends."""
import math
import re
from pathlib import Path

import h5py
import numpy as np
from scipy.spatial import cKDTree

from ...program import CAP, NSCDD, ROOT, Failed, call, read, shown
from ...times import believed, taken

HERE = "cases/peers"
DIAMETER, DENSITY, GRAVITY, SECONDS = 0.01, 2500.0, 9.81, 0.4
SPREAD, CELL, SEED = 0.1, 1.25, 1  # diameters are +- SPREAD; each grain starts somewhere in a cell of CELL diameters
SPEED = 1.0  # [m/s] of the impact that times and damping of LAMMPS are scaled with: half the largest speed of the fall is less
REST = 1e-3  # mean kinetic energy of a grain at rest, over m g d


def write_start(folder, side):
    """side^3 grains at rest, none in touch, as start.h5 for nscdd and start.data for LAMMPS; returns the edge of the box [m]."""
    rng = np.random.default_rng(SEED)
    edge = side * CELL * DIAMETER
    cells = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)
    radius = 0.5 * DIAMETER * rng.uniform(1 - SPREAD, 1 + SPREAD, len(cells))
    room = 0.5 * DIAMETER * (CELL - 1 - SPREAD)  # the largest grains stay in their cells
    x = (cells + 0.5) * CELL * DIAMETER + room * rng.uniform(-1, 1, cells.shape)
    with h5py.File(folder / "start.h5", "w") as file:
        file["x"], file["radius"], file["box"] = x, radius, np.full(3, edge)
    bounds = "".join(f"{-DIAMETER} {edge + DIAMETER} {axis}lo {axis}hi\n" for axis in "xyz")
    rows = "".join(f"{k} 1 {2 * r:.17g} {DENSITY} {a:.17g} {b:.17g} {c:.17g}\n" for k, (r, (a, b, c)) in enumerate(zip(radius, x), 1))
    (folder / "start.data").write_text(f"settling spheres\n\n{len(x)} atoms\n1 atom types\n\n{bounds}\nAtoms # sphere\n\n{rows}")
    return edge


def close_pairs(x, reach):
    """Pairs of points nearer than `reach`."""
    return cKDTree(x).query_pairs(reach, output_type="ndarray").T


def judge(x, radius, velocity, edge):
    """What the end of a run is like, by geometry alone. Overlaps are of all that overlap, walls included, over the mean diameter."""
    i, j = close_pairs(x, 2 * radius.max())
    pairs = radius[i] + radius[j] - np.linalg.norm(x[i] - x[j], axis=1)
    walls = np.concatenate([radius - x[:, 2], *[radius - x[:, k] for k in (0, 1)], *[x[:, k] + radius - edge for k in (0, 1)]])
    overlap = np.concatenate([pairs[pairs > 0], walls[walls > 0]]) / (2 * radius.mean())
    mass = DENSITY * 4 / 3 * math.pi * radius**3
    kinetic = float(0.5 * (mass * (velocity**2).sum(1)).sum())
    return {
        "mean_overlap": float(overlap.mean()),
        "largest_overlap": float(overlap.max()),
        "overlapping": len(overlap),
        "coordination": 2 * int((pairs > 0).sum()) / len(x),
        "kinetic_energy": kinetic,
        "at_rest": bool(kinetic <= REST * mass.sum() * GRAVITY * 2 * radius.mean()),
        "bed_height": float(np.quantile(x[:, 2] + radius, 0.999)),
        "centre_height": float((mass * x[:, 2]).sum() / mass.sum()),
        "mass": float(mass.sum()),
    }


def timed(command):
    """User CPU time of a command run to its end, CPU over wall time, and how it ended. Tried again where the machine was busy."""

    def once():
        done, user, cpu, wall = taken(lambda: call(command, fine=(0, 1, CAP)))  # 1: what it says decides
        return {"cpu": user, "cores": cpu / wall, "done": done}

    return believed(once)


def by_nscdd(folder, edge, h, arguments):
    """One run of contact dynamics: a row without repeats. `arguments` of nscdd run."""
    steps = round(SECONDS / h)
    scene, out, state = folder / f"settle-{steps}.toml", folder / "ours.json", folder / "ours.h5"
    text = Path(ROOT, HERE, "settle.toml").read_text()
    scene.write_text(re.sub(r"count = .*", f"count = {steps}", re.sub(r"\bh = .*", f"h = {SECONDS / steps:.17g}", text)))
    command = [NSCDD, "run", scene, "--packing", folder / "start.h5", *arguments.split(), "--quiet", "--json", out, "--state", state]
    found = timed(command)
    done = found.pop("done")
    row = {"h": SECONDS / steps, "arguments": arguments, "steps": steps, **found, "command": shown(command)}
    if done.returncode == 1:
        if re.search("overlap by|within the step|smaller step", done.stderr):  # the step is too long, as the program says
            return row | {"refused": done.stderr.strip().splitlines()[-1][-300:]}
        raise Failed(f"{row['command']}: exit code 1: {done.stderr.strip()[-300:]}")
    run = read(out)
    with h5py.File(state) as file:
        x, radius, velocity = file["x"][...], file["radius"][...], file["velocity"][:, :3]
        pairs = (file["contacts/j"][...] >= 0) & (file["contacts/normal_impulse"][...] > 0)
    row |= judge(x, radius, velocity, edge) | {"coordination": 2 * float(pairs.sum()) / len(radius)}
    row |= {"iterations": sum(run["iterations"]), "most_contacts": round(max(run["contacts"])), "unconverged_steps": run["unconverged_steps"]}
    return row | {"seconds": {key: run["seconds"][key] for key in ("detect", "solver_cpu", "advance")}}


def impact(k):
    """Length and time of an impact of two grains of the mean size at SPEED, with m D/T^2 = k sqrt(R) D^1.5 and D/T = SPEED. An
    elastic one lasts 3.2 T."""
    mass, radius = 0.5 * DENSITY * math.pi / 6 * DIAMETER**3, 0.25 * DIAMETER
    length = (mass * SPEED**2 / (k * math.sqrt(radius))) ** 0.4
    return length, length / SPEED


def by_lammps(folder, edge, k, damping, step, skin, check):
    """One run of LAMMPS: a row without repeats. damping: in units of the impact; step: in units of its time; skin: in diameters."""
    length, time = impact(k)
    steps = math.ceil(SECONDS / (step * time))
    dt = SECONDS / steps
    end, log = folder / "lammps.dump", folder / "lammps.log"
    end.unlink(missing_ok=True)
    values = {
        "data": folder / "start.data",
        "edge": edge,
        "k": k,
        "damping": f"{damping / (math.sqrt(0.25 * DIAMETER * length) * time):.4g}",
        "dt": f"{dt:.17g}",
        "steps": steps,
        "every": max(1, steps // 40),
        "skin": skin * DIAMETER,
        "check": check,
        "end": end,
    }
    command = ["lmp", "-in", f"{HERE}/settle.lmp", "-log", log, "-screen", "none"]
    for name, value in values.items():
        command += ["-var", name, value]
    found = timed(command)
    done = found.pop("done")
    row = {"k": k, "damping": damping, "dt": dt, "step_over_impact": step, "skin": skin, "check": check, "steps": steps, **found, "command": shown(command)}
    text = log.read_text()
    if done.returncode and not re.search(r"ERROR: (Lost atoms|Non-numeric|Out of range|One or more)", text):
        raise Failed(f"{row['command']}: exit code {done.returncode}: {(text + done.stderr).strip()[-300:]}")
    if done.returncode or not end.exists():
        return row | {"stable": False, "why": re.search(r"ERROR.*", text)[0]}
    x = np.loadtxt(end, skiprows=9)
    result = judge(x[:, 1:4], x[:, 4], x[:, 5:8], edge)
    table = [line.split() for line in text[text.index("Step KinEng") :].splitlines()[1:] if re.fullmatch(r"\s*\d+( +\S+){3}\s*", line)]
    energy = [float(ke) + float(rotation) + result["mass"] * GRAVITY * float(z) for _, ke, rotation, z in table]
    gain = max(energy) / energy[0] - 1
    dangerous = int(re.search(r"Dangerous builds = (\d+)", text)[1])
    return row | result | {"stable": bool(gain <= 0.01), "energy_gain": gain, "dangerous_builds": dangerous}
