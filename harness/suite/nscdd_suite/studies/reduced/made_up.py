"""Made-up runs, comparisons and states."""
import json

import h5py
import numpy as np

from ...page.made_up import COMMIT, DATE, MACHINE

STEPS = 3


def run(scene, scheme, n, transport, state=None):
    """A run JSON with made-up numbers."""
    mpi = transport == "mpi"
    iterations = [100 + 10 * n - 20 * step for step in range(STEPS)]
    data = {"schema": "nscdd.run/1", "command": f"nscdd run {scene}.toml --scheme {scheme} --json FABRICATED.json"}
    data |= {"machine": MACHINE | {"os": "Fabricated OS", "compiler": "g++ 0"}, "commit": COMMIT, "date": DATE, "scene": scene}
    data |= {"dimension": 2 if scene in ("biaxial", "network") else 3, "grains": 64, "model": "fabricated", "friction": True, "subdomains": n}
    data |= {"scheme": scheme, "interface": "none" if scheme == "nlgs" else "closed-form"}
    data |= {"partition": "none" if scheme == "nlgs" else "grid 2x1" if n == 2 else f"grid {n}x1x1", "transport": transport}
    data |= {"ranks_measured": not mpi or n <= MACHINE["cores"], "steps": STEPS, "tolerance": 1e-4, "check_every": 1, "sweeps": 1, "iterations": iterations}
    data |= {"residual": [9e-5] * STEPS, "contacts": [200] * STEPS, "interface_grains": 4.0 * (n - 1), "interface_share": (n - 1) / 64}
    data |= {"multiplicity": {"1": 60, "2": 4}}
    data |= {"seconds": {"total": 8.0 / n, "detect": 1, "sweep": 2, "interface": 1, "mpi_wait": 0.5 * mpi, "mpi_transfer": 0.25 * mpi}}
    data |= {"mpi_fraction": 0.75 * n / 8 * mpi, "messages": 10 * n, "bytes": 1000 * n, "messages_per_iteration": 2.0 * (n - 1)}
    data |= {"bytes_per_iteration": 480.0 * (n - 1), "work_per_rank": [100 + rank for rank in range(n)], "converged": True, "unconverged_steps": 0}
    data |= {"final": {"kinetic_energy": 0.0, "max_overlap": 1e-4}}
    if state:
        data["state"] = state
    return data


def compare(scene, scheme, n, transport, value=1e-3):
    made = {"schema": "nscdd.compare/1", "command": "nscdd compare FABRICATED", "scene": scene, "scheme": scheme, "reference": f"{scene}-nlgs.json"}
    made |= {"candidate": f"{scene}-{scheme}-{transport}-{n}.json", "subdomains": n, "transport": transport, "ok": value <= 1e-2}
    made |= {
        "rows": [{"quantity": "velocity", "value": value, "bound": 1e-2, "ok": value <= 1e-2}, {"quantity": "stress", "value": 2e-4, "bound": 1e-3, "ok": True}]
    }
    return made


def write_state(path, dim):
    """Grains of diameter 1 on a square or cubic lattice, cut in halves along x; eight octants in 3D."""
    side = 8 if dim == 2 else 4
    index = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim)
    x = index + 0.5
    position = {tuple(k): n for n, k in enumerate(index)}
    pairs = [(position[tuple(k)], position[tuple(k + step)], step) for k in index for step in np.eye(dim, dtype=int) if tuple(k + step) in position]
    i, j = (np.array([pair[k] for pair in pairs], np.int32) for k in (0, 1))
    middle = (x[i] + x[j]) / 2 - 0.01
    cells = np.array([2, 1] if dim == 2 else [2, 2, 2])
    owner = (np.floor(middle / side * cells).astype(int) @ np.cumprod([1, *cells[:-1]])).astype(np.int32)
    touched = [set() for _ in x]
    for a, b, k in zip(i, j, owner):
        touched[a].add(k)
        touched[b].add(k)
    with h5py.File(path, "w") as file:
        file["x"], file["radius"], file["box"] = x, np.full(len(x), 0.5), np.full(dim, float(side))
        file["subdomain"] = np.array([min(t) for t in touched], np.int32)
        file["multiplicity"] = np.array([len(t) for t in touched], np.int32)
        file["contacts/i"], file["contacts/j"] = i, j
        file["contacts/normal"] = np.array([-pair[2] for pair in pairs], float)
        file["contacts/gap"], file["contacts/subdomain"] = np.zeros(len(i)), owner


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
