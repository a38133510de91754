"""Made-up results, for tests of the page: no value here was ever counted, simulated or measured."""
from ...made_up import made_up


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
