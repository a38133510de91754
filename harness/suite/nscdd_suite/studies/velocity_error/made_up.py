"""Made-up results, for tests of the page: no value here was ever counted, simulated or measured."""
from ...made_up import made_up


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
