"""Made-up results, for tests of the page: no value here was ever counted, simulated or measured."""
from ...made_up import made_up


def problems(**changed):
    """The JSON of problems of other codes: one that NLGS is first on, then auto, and one that Siconos alone solves."""
    rows = [
        {"problem": problem, "contacts": 3, "dimension": 3, "solver": solver, "tolerance": level, "iterations": 10, "cpu": cost, "cores": 1.0}
        | {"error": 0.5 * level, "converged": (problem, solver) not in (("b", "auto"), ("b", "NLGS"))}
        for problem in "ab"
        for solver, cost in (("auto", 1.0), ("NLGS", 0.5), ("Siconos NSGS", 4.0))
        for level in (1e-4, 1e-8, 1e-10)
    ]
    return made_up("problems", quick=False, rows=rows, left_out=[]) | changed
