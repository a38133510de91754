"""What results are compared with (cases/physics/published.toml), and the judge."""
import math

from ...program import ROOT
from ...record import toml
from .granular import lade_duncan

SHEAR = 0.357  # shear stress over pressure in slow simple shear of spheres with friction 0.3
FRICTIONLESS = math.tan(math.radians(5.76)), math.tan(math.radians(0.22))  # the same without friction, and its error
MOHR_COULOMB, LADE = math.degrees(math.asin(SHEAR)), lade_duncan(SHEAR)
LADE_FREE = lade_duncan(FRICTIONLESS[0] - FRICTIONLESS[1]), lade_duncan(FRICTIONLESS[0] + FRICTIONLESS[1])
COMPUTED = {"sphere angle": [LADE - 1, MOHR_COULOMB + 1], "free angle": [LADE_FREE[0], 5.98]}  # what is allowed
FILE = toml(ROOT / "cases/physics/published.toml")
IN_BRACES = {**FILE["sources"], "shear": SHEAR, "lade": LADE, "mohr_coulomb": MOHR_COULOMB, "lade_least": LADE_FREE[0], "lade_most": LADE_FREE[1]}


def expected(told, key="", **more):
    texts = {name: text.format(**IN_BRACES, **more) for name, text in told.items() if isinstance(text, str) and name != "note"}
    source = "; ".join(FILE["sources"][name] for name in told["source"])
    return {"unit": "1", "allowed": COMPUTED.get(key), **told, **texts, "source": source}


EXPECTED = {key: expected(told, key) for kind in ("shear", "forces", "care") for key, told in FILE[kind].items()}


def same(quantity):
    return expected(FILE["same"], quantity=quantity)


def jamming(dimension):
    """Solid fraction, contacts per grain and contacts per degree of freedom at jamming, without friction."""
    return {key: expected(told) for key, told in FILE["jamming"][str(dimension)].items()}


def judge(value, error, allowed):
    """agrees: the value is allowed, within its own standard error or not. differs: it is not, nor are two standard errors off. Else it cannot be
    told, nor where there is no number."""
    low, high = allowed
    if value is None or not math.isfinite(value):
        return "cannot be told"
    if low <= value <= high:
        return "agrees"
    spread = 2 * error if error is not None and math.isfinite(error) else 0
    return "cannot be told" if value + spread >= low and value - spread <= high else "differs"


def row(expected, value, error=None, command="", **found):
    """A comparison, noted with what was found; null where there is no finite number."""
    ours, verdict = round_to(value), judge(value, error, expected["allowed"])
    untold = "no number" if ours is None else "within two standard errors of what is allowed; " + expected["why"]
    why = {"agrees": "", "differs": expected["why"], "cannot be told": untold}[verdict]
    told = {key: expected[key] for key in ("quantity", "unit", "published", "allowed", "rule", "source")}
    told |= {"ours": ours, "error": round_to(error), "verdict": verdict, "why": why}
    return told | {"note": expected["note"].format(**found) if found else "", "command": command}


def round_to(value, digits=5):
    """Few digits; null of what is not finite."""
    return float(f"{value:.{digits}g}") if value is not None and math.isfinite(value) else None


def not_made(expected, note):
    return row(expected, None) | {"note": note}
