"""Made-up results, for tests of the page: no value here was ever counted, simulated or measured."""
import json

import h5py
import numpy as np

COMMIT, DATE, MACHINE = "fabricated", "2000-01-01T00:00:00Z", {"cpu": "Fabricated CPU", "cores": 2}
STEPS = 3


def made_up(kind, **rows):
    return {"schema": f"nscdd.{kind}/1", "command": f"scripts/suite run {kind} FABRICATED", "commit": COMMIT, "date": DATE, "machine": MACHINE} | rows


def hard(**changed):
    """The JSON of the hard cases, with a row of each relation by both schemes; `changed` fields of the first row."""
    usual = {"error": 0.0, "bound": 1e-3, "bound_from": "law", "ok": True, "steps": 1, "residual": 1e-5, "commands": ["nscdd run FABRICATED"]}
    rows = [
        {"case": f"column-{n}-3d", "family": "column", "dimension": 3, "scheme": scheme, "subdomains": subdomains, "quantity": quantity}
        | {"relation": relation, "expected": 2.0 * n, "found": 1.0 * n, "iterations": n, **usual}
        for n in (10, 100)
        for scheme, subdomains in (("nlgs", 1), ("dcs", 4))
        for quantity, relation in (("impulse", "="), ("sweeps", "<="), ("fall", ">="))
    ]
    rows.append(rows[0] | {"case": "order-impact-3d", "family": "order-impact", "quantity": "order, theta = 1", "series": [[0.1, 0.2], [0.05, 0.1]]})
    gain = rows[0] | {"family": "pair", "quantity": "gain", "relation": "<=", "expected": 0.0, "bound": 1e-6}
    rows += [gain | {"case": f"pair-1e5-{mu:g}-3d", "found": found, "error": found, "exit": code} for mu, found, code in ((0.0, 2e-9, 0), (0.5, 3e-8, 3))]
    rows[0].update(changed)
    return made_up("hard", rows=rows)


def accuracy(**changed):
    """The JSON of speed against error: two solvers and Siconos on one scene, the last of which stalls; profiles."""

    def curve(solver, cost, levels, **last):
        row = {"scene": "dense", "solver": solver, "arguments": "FABRICATED", "converged": True, "repeats": 3}
        rows = [
            row | {"tolerance": 10.0**-k, "iterations": 10 * k, "sweeps": 10 * k, "cpu": cost * k, "eta": 10.0**-k, "distance": 10.0 ** (1 - k)}
            for k in range(1, levels + 1)
        ]
        rows[-1].update(last)
        return rows

    profiles = [
        {"set": group, "problem": problem, "solver": solver, "tolerance": 1e-4, "iterations": 10, "sweeps": 10}
        | {"cpu": cost * (1 + (problem == "b")), "error": 1e-5, "converged": (problem, solver) != ("b", "SPG")}
        for group in ("hard",)
        for problem in "ab"
        for solver, cost in (("NLGS", 1.0), ("SPG", 4.0))
    ]
    scene = {"name": "dense", "dimension": 3, "grains": 8, "contacts": 9, "model": "fabricated", "shows": "Nothing."}
    scene["reference"] = {"command": "nscdd FABRICATED", "scheme": "nlgs", "eta": 1e-11, "iterations": 1, "cpu": 1.0}
    scene["ccs"] = {"iterations_dcs": 10, "iterations_ccs": 10, "velocity_difference": 0.0}
    runs = [*curve("NLGS", 1.0, 8), *curve("NSCDD 8, n_GS 2", 2.0, 4, converged=False), *curve("Siconos NSGS", 30.0, 8)]
    record = {"quick": False, "budget": {"sweeps": 100, "seconds": 60}, "left_out": ["FABRICATED"], "scenes": [scene], "runs": runs, "profiles": profiles}
    return made_up("accuracy", **record | changed)


def problems(**changed):
    """The JSON of problems of other codes: one that ours is first on, and one that Siconos alone solves."""
    rows = [
        {"problem": problem, "contacts": 3, "dimension": 3, "solver": solver, "tolerance": level, "iterations": 10, "cpu": cost, "cores": 1.0}
        | {"error": 0.5 * level, "converged": (problem, solver) != ("b", "auto")}
        for problem in "ab"
        for solver, cost in (("auto", 1.0), ("Siconos NSGS", 4.0))
        for level in (1e-4, 1e-8, 1e-10)
    ]
    return made_up("problems", quick=False, rows=rows, left_out=[]) | changed


def acceleration(**changed):
    """The JSON of what acceleration saves: one scene, on one and on eight subdomains."""
    usual = {"scene": "dense", "start": "cold", "steps": 1, "grains": 8, "contacts": 9.0, "repeats": 3, "eta": 1e-5, "converged": True}
    rows = [
        usual | {"method": method, "subdomains": n, "iterations": iterations * (2 if n > 1 else 1), "cpu": 1e-3 * iterations}
        for n in (1, 8)
        for method, iterations in (("paper", 100), ("auto", 25))
    ]
    plain, fast = {"iterations": 40, "cpu": 4e-6, "converged": True}, {"iterations": 20, "converged": True}
    hard = [
        {"scene": name, "steps": 2, "contacts": 3, "repeats": 5, "paper": plain, "auto": fast | {"cpu": cpu}}
        for name, cpu in (("cheap", 1e-6), ("even", 4e-6), ("dear", 5e-6))
    ]
    return made_up("acceleration", quick=False, rows=rows, hard=hard) | changed


def velocity_error(**changed):
    """The JSON of what the velocity error says: it is the distance halved, eta that squared."""
    rows = [
        {"case": family, "family": family, "dimension": 3, "method": method, "start": "cold", "tolerance": 10.0**-k, "iterations": 10 * k}
        | {"eta": 10.0 ** (-2 * k), "velocity_error": 0.5 * 10.0**-k, "distance": 10.0**-k, "reference_eta": 1e-12}
        for family in ("packing", "reduced", "mass")
        for method in ("NLGS", "NLGS, auto")
        for k in (1, 2, 3)
    ]
    cost = {"case": "reduced", "start": "cold", "method": "NLGS", "steps": 1, "eta": 1e-4, "velocity_error": 0.02, "converged": True}
    costs = [cost | {"allowed": allowed, "iterations": iterations} for allowed, iterations in ((None, 10), (0.03, 15))]
    return made_up("velocity_error", quick=False, rows=rows, cost=costs) | changed


def wild(**changed):
    """The JSON of random scenes: of 100 steps one is beyond the stated distance."""
    far = {"of": 90, "median": 0.01, "of_99": 0.25, "largest": 0.5, "beyond": 1}
    made = {"of": 98, "median": 0.0, "of_99": 1e-4, "largest": 5e-4, "beyond": 0}
    row = {"steps": 100, "accepted": 98, "refused": 2, "refused_near": 1, "iterations_median": 30, "scene_distance": far, "distance": far, "energy_gain": made}
    step = {"seed": 7, "family": "row", "solver": "dcs", "subdomains": 4, "dimension": 2, "grains": 5, "contacts": 6, "iterations": 20, "estimate": 0.2}
    step |= {"gap_error": 1e-6, "scene_distance": 0.1, "distance": 0.5, "contacts_component": 3, "energy_gain": 5e-4}
    made = made_up("wild") | {"scenes": 50, "steps": 100, "not_judged": {"no_room": 1, "no_answer": 2, "refused": 3, "no_contact": 4}}
    made |= {"rows": [{"by": by, "name": name} | row for by, name in (("solver", "dcs"), ("solver", "all"), ("family", "row"), ("family", "all"))]}
    made |= {"worst": [step]}
    return made | changed


def bits(**changed):
    """The JSON of two builds, one of which has another answer and another work by DCS, and another number in a hard case."""
    answers = {"biaxial auto nlgs 1 answer": "00aa", "biaxial auto dcs 8 answer": "00bb"}
    row = {"build": "g++-v4", "compiler": "g++ 0", "lanes": 8, "numbers": 24, "differ": [], "hard": {"same": 20, "of": 20}, "answers": answers}
    differ = ["biaxial auto dcs 8 answer", "biaxial auto dcs 8 work", "hard: row nlgs: found"]
    other = {"build": "clang-v3", "differ": differ, "hard": {"same": 19, "of": 20}, "answers": answers | {"biaxial auto dcs 8 answer": "00cc"}}
    return made_up("bits", accepted="fabricated", rows=[row, row | other]) | changed


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


def rheology(**changed):
    """The JSON of homogeneous shear: two rates of disks, one also by DCS, and one of spheres, also by LAMMPS."""
    usual = {
        "grains": 9,
        "steps": STEPS,
        "normal_stress": 1.0,
        "mu": 0.3,
        "mu_error": 0.01,
        "mu_published": 0.31,
        "solid_fraction": 0.8,
        "fraction_error": 0.01,
    }
    usual |= {"fraction_published": None, "iterations_a_step": 10.0, "unconverged_steps": 0, "command": "nscdd run FABRICATED"}
    points = (("disks", "nlgs", 1e-3), ("disks", "nlgs", 0.1), ("disks", "dcs", 1e-3), ("spheres", "nlgs", 1e-3))
    rows = [{"scene": scene, "solver": solver, "inertial_number": inertial, **usual} for scene, solver, inertial in points]
    by_lammps = {"solver": "lammps", "fraction_error": 0.0, "iterations_a_step": None, "unconverged_steps": None, "command": "lmp FABRICATED"}
    rows.append(rows[-1] | by_lammps | {"motion_over_normal_stress": 0.01})
    return made_up("rheology", rows=rows, sources={}) | changed
