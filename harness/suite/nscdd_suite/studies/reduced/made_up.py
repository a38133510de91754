"""Made-up results, for tests of the page: no value here was ever counted, simulated or measured."""
import json

import h5py
import numpy as np

from ...made_up import COMMIT, DATE, MACHINE

STEPS = 3


def run(scene, scheme, n, transport, state=None):
    """A run JSON with made-up numbers."""
    mpi, nlgs = transport == "mpi", scheme == "nlgs"
    data = {"schema": "nscdd.run/1", "command": f"nscdd run {scene}.toml --scheme {scheme} --json FABRICATED.json", "commit": COMMIT, "date": DATE}
    data |= {"machine": MACHINE | {"os": "Fabricated OS", "compiler": "g++ 0"}, "scene": scene, "dimension": 2 if scene in ("biaxial", "network") else 3}
    data |= {"grains": 64, "model": "fabricated", "friction": True, "subdomains": n, "scheme": scheme, "interface": "none" if nlgs else "closed-form"}
    data |= {"partition": "none" if nlgs else "grid 2x1" if n == 2 else f"grid {n}x1x1", "transport": transport, "steps": STEPS, "tolerance": 1e-4}
    data |= {"ranks_measured": not mpi or n <= MACHINE["cores"], "check_every": 1, "sweeps": 1, "iterations": [100 + 10 * n - 20 * k for k in range(STEPS)]}
    data |= {"residual": [9e-5] * STEPS, "contacts": [200] * STEPS, "interface_grains": 4.0 * (n - 1), "interface_share": (n - 1) / 64}
    data |= {"seconds": {"total": 8.0 / n, "detect": 1, "sweep": 2, "interface": 1, "mpi_wait": 0.5 * mpi, "mpi_transfer": 0.25 * mpi}}
    data |= {"mpi_fraction": 0.75 * n / 8 * mpi, "messages": 10 * n, "bytes": 1000 * n, "messages_per_iteration": 2.0 * (n - 1)}
    data |= {"bytes_per_iteration": 480.0 * (n - 1), "work_per_rank": [100 + rank for rank in range(n)], "converged": True, "unconverged_steps": 0}
    return data | {"multiplicity": {"1": 60, "2": 4}, "final": {"kinetic_energy": 0.0, "max_overlap": 1e-4}} | ({"state": state} if state else {})


def compare(scene, scheme, n, transport, value=1e-3):
    told = {"schema": "nscdd.compare/1", "command": "nscdd compare FABRICATED", "scene": scene, "scheme": scheme, "reference": f"{scene}-nlgs.json"}
    told |= {"candidate": f"{scene}-{scheme}-{transport}-{n}.json", "subdomains": n, "transport": transport, "ok": value <= 1e-2}
    stress = {"quantity": "stress", "value": 2e-4, "bound": 1e-3, "ok": True}
    return told | {"rows": [{"quantity": "velocity", "value": value, "bound": 1e-2, "ok": value <= 1e-2}, stress]}


def write_state(path, dim):
    """Grains of diameter 1 on a square or cubic lattice, cut in halves along x; eight octants in 3D."""
    side = 8 if dim == 2 else 4
    index = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim)
    position = {tuple(k): n for n, k in enumerate(index)}
    steps = [(k, step) for k in index for step in np.eye(dim, dtype=int) if tuple(k + step) in position]
    x, i, j = index + 0.5, *(np.array([position[tuple(k + far * step)] for k, step in steps], np.int32) for far in (0, 1))
    cells = np.array([2, 1] if dim == 2 else [2, 2, 2])
    owner = (np.floor(((x[i] + x[j]) / 2 - 0.01) / side * cells).astype(int) @ np.cumprod([1, *cells[:-1]])).astype(np.int32)
    touched = [set(owner[(i == grain) | (j == grain)]) for grain in range(len(x))]
    with h5py.File(path, "w") as file:
        file["x"], file["radius"], file["box"] = x, np.full(len(x), 0.5), np.full(dim, float(side))
        file["subdomain"] = np.array([min(t) for t in touched], np.int32)
        file["multiplicity"] = np.array([len(t) for t in touched], np.int32)
        file["contacts/i"], file["contacts/j"] = i, j
        file["contacts/normal"] = np.array([-step for _, step in steps], float)
        file["contacts/gap"], file["contacts/subdomain"], file["contacts/normal_impulse"] = np.zeros(len(i)), owner, np.ones(len(i))
        file["rough/kind"], file["rough/partition"] = [b"grid"], np.concatenate([cells, np.zeros(dim), np.full(dim, float(side))])
        file["rough/x"], file["rough/skin"], file["rough/steps_since"], file["rough/offset"] = x, [0.05], [3], [0.0]
        file["walls/normal"] = np.eye(dim)[-1:]


def fabricate(folder, scene, state):
    """A passing set of results of a scene; with states to draw on so many subdomains, if on any."""

    def put(name, data):
        (folder / name).write_text(json.dumps(data))

    if state:
        write_state(folder / f"{scene}-dcs-in-process-{state}.h5", 2 if scene == "network" else 3)
    put(f"{scene}-nlgs.json", run(scene, "nlgs", 1, "sequential"))
    for scheme in ("ccs", "dcs"):
        for transport, numbers in (("in-process", (1, 2, 8)), ("mpi", (1, 2, 4))):
            for n in numbers:
                stem = f"{scene}-{scheme}-{transport}-{n}"
                put(f"{stem}.json", run(scene, scheme, n, transport, f"{stem}.h5" if (folder / f"{stem}.h5").exists() else None))
                put(f"{stem}.compare.json", compare(scene, scheme, n, transport))
