"""A made-up record of the paper's tables and figures, and the network of its Fig. 1: no value here was ever counted, simulated or measured."""
import h5py
import numpy as np

from ...made_up import MACHINE, made_up
from .items import What, splitting

GRAINS = {"isotropic": 55000, "biaxial": 13000, "triaxial": 64000, "million": 1024000}
SPLITTINGS = {"isotropic": ("3x1x1", "2x2x1", "2x2x2"), "biaxial": ("2x1", "4x2", "8x6"), "triaxial": ("2x1x1", "2x2x2", "4x4x3")}
COUNTS = {"grains": 90, "candidates": 190, "contacts": 170, "boundary_predicted": 17, "boundary": 15, "wrong": 2, "not_boundary": 2}


def place(scene, scheme, partition, n, method):
    made = What(scene, method, scheme, partition, n).row()
    del made["multiplicity"]  # rows that do not say are of the minimal interface
    return made


def run(scene, scheme, partition, n, method="paper", variation="", **more):
    """Iterations grow by 1 % to 8 % with the subdomains, and acceleration makes a fifth of them. Triaxial ones are more."""
    each = int(((1200 if scene == "triaxial" else 1000) + 100 * (n > 1) * n**0.5 / 10) * (1 if method == "paper" else 0.2))
    made = place(scene, scheme, partition, n, method) | {"variation": variation, "grains": GRAINS[scene], "dimension": 2 if scene == "biaxial" else 3}
    made |= {"steps": 2, "h": 0.01, "tolerance": 1e-4, "iterations": [each, each], "contacts": [2e5, 2.2e5], "unknowns_mean": 6.3e5}
    made |= {"interface_grains": 100.0 * (n - 1), "bytes_per_iteration": 5e3 * (n - 1), "residual_max": 9e-5, "unconverged_steps": 0}
    return made | {"command": f"nscdd run FABRICATED {scene} {scheme} {partition}", **more}


def operations(scheme, n, share):
    """CCS gathers and scatters, which takes three quarters of its time; DCS sends from rank to rank alone."""
    parts = {"exchange": 1} if scheme == "dcs" else {"gather": 0.25, "scatter": 0.75}
    found = {}
    for name in ("exchange", "route", "gather", "scatter", "reduction", "all_gather"):
        part = parts.get(name, 0)
        found[name] = {"messages": (n - 1) * (part > 0), "wait_share": part * max(0, share - 0.05), "transfer_share": part * min(share, 0.05)}
    return found


def window(scene, scheme, partition, n, method="paper", platform="node48", slower=1, latency=1):
    """An iteration of NLGS takes 1000 us; CCS loses 20 us for each subdomain in 3D, 2 us in 2D, DCS little."""
    lost = 0 if n == 1 else (2e-6 if scene == "biaxial" else 20e-6) * n if scheme == "ccs" else (10e-6 if platform == "node48" else 2e-6) * latency
    seconds = 1e-3 * slower / n + lost * slower
    share = {"ccs": {3: 0.3, 4: 0.35, 8: 0.58}, "dcs": {3: 0.14, 4: 0.09, 8: 0.18}}.get(scheme, {}).get(n, min(0.9, lost / seconds))
    made = place(scene, scheme, partition, n, method) | {"platform": platform, "after_step": 9, "slower": slower, "latency": latency}
    made |= {"bandwidth": 1, "noise": 0, "seconds_per_iteration": seconds, "mpi_share": share, "wait_share": max(0, share - 0.05)}
    made |= {"transfer_share": min(share, 0.05), "command": f"nscdd window FABRICATED {scene} {scheme} {partition}"}
    return made | ({"operations": operations(scheme, n, share)} if scheme != "nlgs" else {})


def measured(scene, scheme, partition, ranks):
    made = {"scene": scene, "method": "paper", "scheme": scheme, "partition": partition, "ranks": ranks, "steps": 10, "seconds": 100.0 / ranks}
    made |= {"seconds_all": [99.0 / ranks, 101.0 / ranks], "mpi_share": 0.04 * (ranks - 1), "iterations_total": 2000}
    return made | {"command": "mpirun FABRICATED"}


def paper(**changed):
    """A record in which every statement that can be told agrees."""
    runs, windows = [], []
    for scene, grids in SPLITTINGS.items():
        runs.append(run(scene, "nlgs", "none", 1))
        windows += [window(scene, "nlgs", "none", 1, platform=platform) for platform in ("node48", "cluster")]
        for partition, n in map(splitting, grids):
            for scheme in ("ccs", "dcs"):
                runs.append(run(scene, scheme, partition, n))
                windows += [window(scene, scheme, partition, n, latency=latency) for latency in ((1, 2, 0.5) if n == 48 else (1, 2))]
                windows += [window(scene, scheme, partition, n, slower=3)] * (scene == "isotropic")
        for method in ("paper", "auto"):
            for partition in ("bisection", "metis"):
                runs += [run(scene, "dcs", partition, n, method) for n in (8, 128)]
                windows += [window(scene, "dcs", partition, n, method, "cluster") for n in (8, 128)]
    runs += [run("million", "nlgs", "none", 1), run("million", "dcs", "bisection", 128)]
    windows += [window("million", "nlgs", "none", 1), window("million", "dcs", "bisection", 128, platform="cluster")]
    runs.append(run("triaxial", "nlgs", "none", 1, variation="h = 0.1") | {"h": 0.1})
    wide = {"multiplicity": "predicted", "interface_grains": 150.0, "bytes_per_iteration": 5e5, "command": "nscdd run FABRICATED --multiplicity predicted"}
    runs.append(run("triaxial", "dcs", "grid 2x2x2", 8) | wide)
    windows.append(window("triaxial", "dcs", "grid 2x2x2", 8) | {"multiplicity": "predicted", "seconds_per_iteration": 150e-6})
    for seed in (1, 2, 3):
        for scheme, partition, n in (("nlgs", "none", 1), ("dcs", "grid 4x2", 8)):
            drawn = run("biaxial", scheme, partition, n, perturbed=seed)
            runs.append(drawn | {"iterations": [each + 10 * seed for each in drawn["iterations"]]})
    packing = {"scene": "triaxial", "grains": 64000, "source": "FABRICATED", "solid_fraction": 0.6, "solid_fraction_core": 0.63, "coordination": 5.9}
    packing |= {"rattlers": 0.02, "largest_overlap": 1e-4, "command": "nscdd pack FABRICATED"}
    steps = [What("triaxial", "paper", "dcs", "grid 2x2x2", 8, multiplicity).row() for multiplicity in ("minimal", "predicted")]
    for step in steps:
        step["rows"] = [{"quantity": "velocities", "value": 0.01, "bound": 0.03, "ok": True}]
    made = made_up("paper") | {"quick": False, "machine": MACHINE | {"os": "Fabricated OS", "compiler": "g++ 0", "lanes": 2, "fused": True}}
    made |= {"platform": {"name": "node48", "file": "FABRICATED.xml", "costs_2d": "FABRICATED-2d.json", "costs_3d": "FABRICATED-3d.json"}}
    made |= {"packings": [packing], "runs": runs, "windows": windows}
    made |= {"measured": [measured(scene, *how) for scene in SPLITTINGS for how in (("nlgs", "none", 1), ("dcs", "grid 2x1", 2))]}
    return made | {"agreement": steps} | changed


def write_network(path):
    """Four touching disks in a square, cut by a grid 2x1 at its middle. Since the broad phase the upper left one has moved away from
    the upper right one: it was foreseen on both sides, and is on one."""
    x = np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5], [1.5, 1.5]])
    moved = x + [[0, 0], [0, 0], [-0.1, 0], [0, 0]]
    with h5py.File(path, "w") as file:
        file["x"], file["radius"], file["box"] = moved, np.full(4, 0.5), np.full(2, 2.0)
        file["subdomain"], file["multiplicity"] = np.array([0, 1, 0, 1], np.int32), np.array([2, 1, 1, 1], np.int32)
        file["contacts/i"], file["contacts/j"] = np.array([0, 1, 0], np.int32), np.array([1, 3, 2], np.int32)
        file["contacts/normal"], file["contacts/gap"] = np.array([[-1.0, 0], [0, -1], [0, -1]]), np.zeros(3)
        file["contacts/subdomain"], file["contacts/normal_impulse"] = np.array([1, 1, 0], np.int32), np.ones(3)
        file["rough/kind"] = [b"grid"]
        file["rough/partition"] = np.array([2, 1, 0.5, 0.5, 1.5, 1.5])
        file["rough/x"], file["rough/skin"], file["rough/steps_since"] = x, [0.05], [3]
        file["rough/offset"], file["walls/normal"] = [-0.2], [[0.0, 1.0]]  # a floor, beyond the skin
