"""Made-up results, for tests of the page: no value here was ever counted, simulated or measured."""
from ...made_up import made_up


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
