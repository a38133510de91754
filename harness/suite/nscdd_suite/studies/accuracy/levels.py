"""Cost of solvers at equal error, from the rows of their curves."""
import math


def solvers(rows):
    return list(dict.fromkeys(row["solver"] for row in rows))


def of(rows, **wanted):
    return [row for row in rows if all(row[key] == value for key, value in wanted.items())]


def points(rows, x, y):
    return [(row[x], row[y]) for row in rows if row[x] and row[y]]  # logarithmic: zeros have no place


def costs(rows, level):
    """{solver: its cost}."""
    return {solver: at_level(of(rows, solver=solver), level) for solver in solvers(rows)}


def at_level(rows, level, cost="cpu", measure="eta"):
    """Cost of a solver at eta = level, between the runs before and after it on the curve in logarithms; None beyond its ends,
    but the first run where that was better than asked."""
    curve = sorted(points(rows, measure, cost), reverse=True)
    if not curve or curve[-1][0] > level:
        return None
    if curve[0][0] <= level:
        return curve[0][1]
    (e0, c0), (e1, c1) = next((before, after) for before, after in zip(curve, curve[1:]) if after[0] <= level < before[0])
    part = math.log(e0 / level) / math.log(e0 / e1)
    return math.exp((1 - part) * math.log(c0) + part * math.log(c1))
