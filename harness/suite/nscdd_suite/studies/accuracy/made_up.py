"""Made-up results, for tests of the page: no value here was ever counted, simulated or measured."""
from ...made_up import made_up


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
