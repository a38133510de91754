"""Made-up savings by acceleration."""
from ...page.made_up import made_up


def acceleration(**changed):
    """The JSON of what acceleration saves: one scene, on one and on eight subdomains."""
    rows = [
        {
            "scene": "dense",
            "start": "cold",
            "method": method,
            "subdomains": n,
            "steps": 1,
            "grains": 8,
            "contacts": 9.0,
            "iterations": iterations * (2 if n > 1 else 1),
            "cpu": 1e-3 * iterations,
            "repeats": 3,
            "eta": 1e-5,
            "converged": True,
        }
        for n in (1, 8)
        for method, iterations in (("paper", 100), ("auto", 25))
    ]
    hard = [
        {
            "scene": name,
            "steps": 2,
            "contacts": 3,
            "repeats": 5,
            "paper": {"iterations": 40, "cpu": 4e-6, "converged": True},
            "auto": {"iterations": 20, "cpu": cpu, "converged": True},
        }
        for name, cpu in (("cheap", 1e-6), ("even", 4e-6), ("dear", 5e-6))
    ]
    return made_up("acceleration", quick=False, rows=rows, hard=hard) | changed
