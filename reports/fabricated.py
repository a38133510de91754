"""Fabricated results for the tests of the report: no value here was ever measured."""
import json

import h5py
import numpy as np

CORES, STEPS = 2, 3


def run(scene, scheme, n, transport, state=None):
    """A run JSON with made-up numbers."""
    mpi = transport == "mpi"
    iterations = [100 + 10 * n - 20 * step for step in range(STEPS)]
    data = {
        "schema": "nscdd.run/1", "command": f"nscdd run {scene}.toml --scheme {scheme} --json FABRICATED.json",
        "machine": {"cpu": "Fabricated CPU", "cores": CORES, "os": "Fabricated OS", "compiler": "g++ 0"},
        "commit": "fabricated", "date": "2000-01-01T00:00:00Z", "scene": scene,
        "dimension": 2 if scene in ("biaxial", "network") else 3, "grains": 64, "model": "fabricated", "friction": True,
        "subdomains": n, "scheme": scheme, "interface": "none" if scheme == "nlgs" else "closed-form",
        "partition": "none" if scheme == "nlgs" else "grid 2x1" if n == 2 else f"grid {n}x1x1", "transport": transport,
        "ranks_measured": not mpi or n <= CORES, "steps": STEPS, "tolerance": 1e-4, "check_every": 1, "sweeps": 1,
        "iterations": iterations, "residual": [9e-5] * STEPS, "contacts": [200] * STEPS,
        "interface_grains": 4.0 * (n - 1), "interface_share": (n - 1) / 64, "multiplicity": {"1": 60, "2": 4},
        "seconds": {"total": 8.0 / n, "detect": 1, "sweep": 2, "interface": 1, "mpi_wait": 0.5 * mpi,
                    "mpi_transfer": 0.25 * mpi},
        "mpi_fraction": 0.75 * n / 8 * mpi, "messages": 10 * n, "bytes": 1000 * n,
        "messages_per_iteration": 2.0 * (n - 1), "bytes_per_iteration": 480.0 * (n - 1),
        "work_per_rank": [100 + rank for rank in range(n)], "converged": True, "unconverged_steps": 0,
        "final": {"kinetic_energy": 0.0, "max_overlap": 1e-4},
    }
    if state:
        data["state"] = state
    return data


def compare(scene, scheme, n, transport, value=1e-3):
    return {"schema": "nscdd.compare/1", "command": "nscdd compare FABRICATED", "scene": scene, "scheme": scheme,
            "reference": f"{scene}-nlgs.json", "candidate": f"{scene}-{scheme}-{transport}-{n}.json", "subdomains": n,
            "transport": transport, "ok": value <= 1e-2,
            "rows": [{"quantity": "velocity", "value": value, "bound": 1e-2, "ok": value <= 1e-2},
                     {"quantity": "stress", "value": 2e-4, "bound": 1e-3, "ok": True}]}


def hard(**changed):
    """The JSON of the hard cases, with a row of each relation by both schemes; `changed` fields of the first row."""
    rows = [{"case": f"column-{n}-3d", "family": "column", "dimension": 3, "scheme": scheme, "subdomains": subdomains,
             "quantity": quantity, "relation": relation, "expected": 2.0 * n, "found": 1.0 * n, "error": 0.0, "bound": 1e-3,
             "bound_from": "law", "ok": True, "iterations": n, "steps": 1, "residual": 1e-5, "commands": ["nscdd run FABRICATED"]}
            for n in (10, 100) for scheme, subdomains in (("nlgs", 1), ("dcs", 4))
            for quantity, relation in (("impulse", "="), ("sweeps", "<="), ("fall", ">="))]
    rows.append(rows[0] | {"case": "order-impact-3d", "family": "order-impact", "quantity": "order, theta = 1",
                           "series": [[0.1, 0.2], [0.05, 0.1]]})
    rows += [rows[0] | {"case": f"pair-1e5-{mu:g}-3d", "family": "pair", "quantity": "gain", "relation": "<=", "expected": 0.0, "found": found,
                        "error": found, "bound": 1e-6, "exit": code} for mu, found, code in ((0.0, 2e-9, 0), (0.5, 3e-8, 3))]
    rows[0].update(changed)
    return {"schema": "nscdd.hard/1", "command": "scripts/hard_cases FABRICATED", "rows": rows,
            "machine": {"cpu": "Fabricated CPU", "cores": CORES}, "commit": "fabricated", "date": "2000-01-01T00:00:00Z"}


def accuracy(**changed):
    """The JSON of speed against error: two solvers and Siconos on one scene, the last of which stalls; profiles of two sets."""
    def curve(solver, cost, levels, **last):
        rows = [{"scene": "dense", "solver": solver, "arguments": "FABRICATED", "tolerance": 10.0**-k, "iterations": 10 * k,
                 "sweeps": 10 * k, "cpu": cost * k, "eta": 10.0**-k, "distance": 10.0**(1 - k), "converged": True, "repeats": 3}
                for k in range(1, levels + 1)]
        rows[-1].update(last)
        return rows

    profiles = [{"set": group, "problem": problem, "solver": solver, "tolerance": 1e-4, "iterations": 10, "sweeps": 10,
                 "cpu": cost * (1 + (problem == "b")), "error": 1e-5, "converged": (problem, solver) != ("b", "SPG")}
                for group in ("hard", "fclib") for problem in "ab" for solver, cost in (("NLGS", 1.0), ("SPG", 4.0))]
    record = {"schema": "nscdd.accuracy/1", "command": "scripts/accuracy FABRICATED", "commit": "fabricated",
              "machine": {"cpu": "Fabricated CPU", "cores": CORES}, "date": "2000-01-01T00:00:00Z", "quick": False,
              "budget": {"sweeps": 100, "seconds": 60}, "left_out": ["FABRICATED"],
              "scenes": [{"name": "dense", "dimension": 3, "grains": 8, "contacts": 9, "model": "fabricated", "shows": "Nothing.",
                          "reference": {"command": "nscdd FABRICATED", "scheme": "nlgs", "eta": 1e-11, "iterations": 1, "cpu": 1.0},
                          "ccs": {"iterations_dcs": 10, "iterations_ccs": 10, "velocity_difference": 0.0}}],
              "runs": [*curve("NLGS", 1.0, 8), *curve("NSCDD 8, n_GS 2", 2.0, 4, converged=False), *curve("Siconos NSGS", 30.0, 8)],
              "profiles": profiles}
    return record | changed


def acceleration(**changed):
    """The JSON of what acceleration saves: one scene, on one and on eight subdomains."""
    rows = [{"scene": "dense", "start": "cold", "method": method, "subdomains": n, "steps": 1, "grains": 8, "contacts": 9.0,
             "iterations": iterations * (2 if n > 1 else 1), "cpu": 1e-3 * iterations, "repeats": 3, "eta": 1e-5, "converged": True}
            for n in (1, 8) for method, iterations in (("paper", 100), ("auto", 25))]
    hard = [{"scene": name, "steps": 2, "contacts": 3, "repeats": 5, "paper": {"iterations": 40, "cpu": 4e-6, "converged": True},
             "auto": {"iterations": 20, "cpu": cpu, "converged": True}} for name, cpu in (("cheap", 1e-6), ("even", 4e-6), ("dear", 5e-6))]
    return {"schema": "nscdd.acceleration/1", "command": "scripts/acceleration FABRICATED", "commit": "fabricated",
            "machine": {"cpu": "Fabricated CPU", "cores": CORES}, "date": "2000-01-01T00:00:00Z", "quick": False,
            "rows": rows, "hard": hard} | changed


def velocity_error(**changed):
    """The JSON of what the velocity error says: it is the distance halved, eta that squared."""
    rows = [{"case": family, "family": family, "dimension": 3, "method": method, "start": "cold", "tolerance": 10.0**-k, "iterations": 10 * k,
             "eta": 10.0**(-2 * k), "velocity_error": 0.5 * 10.0**-k, "distance": 10.0**-k, "reference_eta": 1e-12}
            for family in ("packing", "reduced", "mass") for method in ("NLGS", "NLGS, auto") for k in (1, 2, 3)]
    cost = [{"case": "reduced", "start": "cold", "method": "NLGS", "allowed": allowed, "steps": 1, "iterations": iterations, "eta": 1e-4,
             "velocity_error": 0.02, "converged": True} for allowed, iterations in ((None, 10), (0.03, 15))]
    return {"schema": "nscdd.velocity_error/1", "command": "scripts/velocity_error FABRICATED", "commit": "fabricated",
            "machine": {"cpu": "Fabricated CPU", "cores": CORES}, "date": "2000-01-01T00:00:00Z", "quick": False,
            "rows": rows, "cost": cost} | changed


def wild(**changed):
    """The JSON of random scenes: of 100 steps one is beyond the stated distance."""
    far = {"of": 90, "median": 0.01, "of_99": 0.25, "largest": 0.5, "beyond": 1}
    made = {"of": 98, "median": 0.0, "of_99": 1e-4, "largest": 5e-4, "beyond": 0}
    row = {"steps": 100, "accepted": 98, "refused": 2, "refused_near": 1, "iterations_median": 30, "scene_distance": far, "distance": far,
           "energy_made": made}
    step = {"seed": 7, "family": "row", "solver": "dcs", "subdomains": 4, "dimension": 2, "grains": 5, "contacts": 6, "iterations": 20, "estimate": 0.2, "gap_error": 1e-6,
            "scene_distance": 0.1, "distance": 0.5, "contacts_component": 3, "energy_made": 5e-4}
    return {"schema": "nscdd.wild/1", "command": "wild_scenes FABRICATED", "commit": "fabricated", "machine": {"cpu": "Fabricated CPU", "cores": CORES},
            "date": "2000-01-01T00:00:00Z", "scenes": 50, "steps": 100,
            "not_judged": {"no_room": 1, "no_answer": 2, "refused": 3, "no_contact": 4},
            "rows": [{"by": by, "name": name} | row for by, name in (("solver", "dcs"), ("solver", "all"), ("family", "row"), ("family", "all"))],
            "worst": [step]} | changed


def bits(**changed):
    """The JSON of two builds, one of which has another answer and another work by DCS, and another number in a hard case."""
    answers = {"biaxial auto nlgs 1 answer": "00aa", "biaxial auto dcs 8 answer": "00bb"}
    row = {"build": "g++-v4", "compiler": "g++ 0", "lanes": 8, "numbers": 24, "differ": [], "hard": {"same": 20, "of": 20}, "answers": answers}
    other = row | {"build": "clang-v3", "differ": ["biaxial auto dcs 8 answer", "biaxial auto dcs 8 work", "hard: row nlgs: found"], "hard": {"same": 19, "of": 20},
                   "answers": answers | {"biaxial auto dcs 8 answer": "00cc"}}
    return {"schema": "nscdd.bits/1", "command": "scripts/same_bits FABRICATED", "commit": "fabricated", "accepted": "fabricated",
            "machine": {"cpu": "Fabricated CPU", "cores": CORES}, "date": "2000-01-01T00:00:00Z", "rows": [row, other]} | changed


def counted(**changed):
    """Two of three counted numbers are those of the record."""
    return {"schema": "nscdd.counted/1", "records": ["hard"], "same": 2, "of": 3, "not_in_the_record": 0, "missing": 0,
            "differ": [{"name": "hard: column nlgs: iterations", "now": 11, "record": 10}]} | changed


def write_state(path, dim):
    """Grains of diameter 1 on a square or cubic lattice, cut in halves along x; eight octants in 3D."""
    side = 8 if dim == 2 else 4
    index = np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim)
    x = index + 0.5
    position = {tuple(k): n for n, k in enumerate(index)}
    pairs = [(position[tuple(k)], position[tuple(k + step)], step) for k in index
             for step in np.eye(dim, dtype=int) if tuple(k + step) in position]
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


def fabricate(folder, scenes):
    """A passing set of results for some scenes, with states to draw for the network and the isotropic scene."""
    def put(name, data):
        (folder / name).write_text(json.dumps(data))

    if "network" in scenes:
        write_state(folder / "network-dcs-in-process-2.h5", 2)
        put("accuracy.json", accuracy())
        put("acceleration.json", acceleration())
        put("velocity_error.json", velocity_error())
        put("wild.json", wild())
        put("bits.json", bits())
    if "isotropic" in scenes:
        write_state(folder / "isotropic-dcs-in-process-8.h5", 3)
    put("hard.json", hard())
    for scene in scenes:
        put(f"{scene}-nlgs.json", run(scene, "nlgs", 1, "sequential"))
        for scheme in ("ccs", "dcs"):
            for transport, numbers in (("in-process", (1, 2, 8)), ("mpi", (1, 2, 4))):
                for n in numbers:
                    stem = f"{scene}-{scheme}-{transport}-{n}"
                    state = f"{stem}.h5" if (folder / f"{stem}.h5").exists() else None
                    put(f"{stem}.json", run(scene, scheme, n, transport, state))
                    put(f"{stem}.compare.json", compare(scene, scheme, n, transport))
