"""Made-up results, for tests of the page: no value here was ever counted, simulated or measured."""
from ...made_up import made_up


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
