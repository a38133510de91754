"""Are answers, iterations and simulated speed-ups of small scenes what they were? All must be those that were accepted.

The reduced scenes of the paper by NLGS, CCS and DCS, by the paper's method and accelerated, on 1, 8 and 48 subdomains in process, and one iteration of each
on 8 and 48 ranks of the simulated node, costs included. Nothing is timed. A program with fused products (`nscdd --version`) gives the same bits on every
machine, so all numbers and the checksums of the answers must be those of verification/regression.json. What differs has a word:

    WORSE     iterations or work more than 2 % above what was accepted, speed-up more than 3 % below, the residual of the last step above the tolerance of
              the scene and by more than 2 %
    better    as much on the other side
    changed   less

A program without fused products has bands of 10 %, and no answers to compare.
"""
import shutil
from pathlib import Path

from ... import record
from ...program import COSTS, NSCDD, ROOT, SIMULATED, made, simulated
from ...study import Study

ACCEPTED = Path("verification/regression.json")
SCENES = {"biaxial": (20, 2), "isotropic": (10, 3), "triaxial": (10, 3)}  # steps, dimension
METHODS = ("paper", "auto")
RUNS = (("nlgs", 1), ("dcs", 8), ("ccs", 8), ("dcs", 48))
WORSE_ABOVE = {"iterations": True, "work": True, "residual": True, "speed-up": False}
BAND = {"iterations": 0.02, "work": 0.02, "residual": 0.02, "speed-up": 0.03}
WITHOUT_FUSED = 0.10  # of a program whose products are rounded before they are added


class Regression(Study):
    name, title, about = "regression", "Regression", "are counts and answers of small scenes those that were accepted?"

    def __init__(self, accept=None, simulator=True):
        self.accept, self.simulator = accept, simulator

    def jobs(self, plan):
        if self.simulator and not (shutil.which("smpirun") and Path(ROOT, SIMULATED).exists()):
            raise record.InputError(
                "regression: smpirun or nscdd_simulated is not there: scripts/setup installs SimGrid; --without-simulator makes no speed-ups"
            )
        if not ACCEPTED.exists() and self.accept is None:
            raise record.InputError(f"regression: {ACCEPTED} is not there: nothing is accepted")
        if self.accept is not None and (plan.only or not self.simulator or not self.accept.strip()):
            raise record.InputError("regression: --accept takes a reason, all scenes, and speed-ups")
        for scene, (steps, _) in SCENES.items():
            packing = plan.pack(f"cases/packings/{scene}.toml")
            needs = [packing, f"cases/reduced/{scene}.toml"]
            for method in METHODS:
                plan.rows(f"{scene} {method}", measure, plan.folder, packing, scene, method, self.simulator, needs=needs, cost=steps)

    def rows(self, plan):
        done = {f"{scene} {method}": found for scene in SCENES for method in METHODS if (found := plan.made(f"{scene} {method}"))}
        if not done:
            return {}
        values = {name: value for found in done.values() for name, value in found["values"].items()}
        return {"scenes": sorted({title.split()[0] for title in done}), "tolerance": list(done.values())[-1]["tolerance"], "values": values}

    def differences(self, data):
        accepted = record.load(ACCEPTED)["values"]
        known = {name: value for name, value in accepted.items() if name.split()[0] in data["scenes"] and (self.simulator or not name.endswith(" speed-up"))}
        return judge(data["values"], known, data["tolerance"], data["machine"]["fused"]), len(known)

    def told(self, data):
        machine = data["machine"]
        if self.accept:
            if not machine["fused"]:
                raise record.InputError("regression: --accept takes numbers of a program with fused products, see nscdd --version")
            accept(data, self.accept.strip())
        rows, known = self.differences(data)
        if rows:
            yield f"{'':40} {'accepted':>16} {'now':>16} {'change':>8}"
        for name, old, new, change, verdict in rows:
            shown = ["-" if value is None else value if isinstance(value, str) else f"{value:.6g}" for value in (old, new)]
            yield f"{name:40} {shown[0]:>16} {shown[1]:>16} {'' if change is None else f'{100 * change:+.2f} %':>8}  {verdict}"
        worse = sum(verdict in ("WORSE", "gone") for *_, verdict in rows)
        yield (
            f"regression: {known} numbers and answers, {machine['compiler']}, {machine['lanes']} doubles a vector"
            f"{'' if machine['fused'] else ', no fused products: bands of 10 %, no answers'}"
            f"{'' if self.simulator else ', no speed-ups'}: {len(rows)} changed, {worse} worse"
        )
        if not passes(rows, machine["fused"]):
            yield "regression: --accept REASON makes these the accepted ones"

    def passes(self, data):
        return passes(self.differences(data)[0], data["machine"]["fused"])


def measure(folder, packing, scene, method, simulator):
    """All numbers and checksums of answers of a scene by a method."""
    steps, dimension = SCENES[scene]
    source = [f"cases/reduced/{scene}.toml", "--packing", packing]
    state, how = folder / f"{scene}-{method}.h5", ["--method", method, "--quiet"]
    values, iterations, seconds = {}, {}, {}
    for scheme, n in RUNS:
        out = folder / f"{scene}-{method}-{scheme}-{n}.json"
        told = made([NSCDD, "run", *source, *how, "--scheme", scheme, "--steps", steps, "--json", out, *(["-n", n] if n > 1 else ["--state", state])], out)
        name = f"{scene} {method} {scheme} {n}"
        iterations[scheme, n] = values[f"{name} iterations"] = sum(told["iterations"])
        values |= {f"{name} work": max(told["work_per_rank"]), f"{name} residual": told["residual"][-1], f"{name} answer": told["answer"]}
    for n in (1, 8, 48) if simulator else ():
        out = folder / f"{scene}-{method}-{n}.window.json"
        scheme = "dcs" if n > 1 else "nlgs"
        window = [*simulated(n), SIMULATED, "window", *source, "--from", state, "--costs", COSTS[dimension], *how, "--iterations", 50]
        seconds[n] = made([*window, "--scheme", scheme, "--json", out], out)["seconds_per_iteration"] * iterations[scheme, n]
        if n > 1:
            values[f"{scene} {method} dcs {n} speed-up"] = seconds[1] / seconds[n]
    return {"values": values, "tolerance": told["tolerance"]}


def judge(now, accepted, tolerance, fused=True):
    """(name, accepted, now, change, verdict) of all that has changed."""
    rows = []
    for name in sorted(now.keys() | accepted.keys()):
        old, new, kind = accepted.get(name), now.get(name), name.split()[-1]
        if old == new or kind == "answer" and not fused:
            continue
        if old is None or new is None:
            rows.append((name, old, new, None, "new" if old is None else "gone"))
        elif kind == "answer":
            rows.append((name, old, new, None, "changed"))
        else:
            band, change = BAND[kind] if fused else WITHOUT_FUSED, new / old - 1
            bad = change if WORSE_ABOVE[kind] else -change
            if kind == "residual" and new <= tolerance:
                bad = 0
            rows.append((name, old, new, change, "WORSE" if bad > band else "better" if bad < -band else "changed"))
    return rows


def passes(rows, fused=True):
    """Whether these rows may stay without a word."""
    return not any(verdict in ("WORSE", "gone") or fused for *_, verdict in rows)


def accept(data, reason):
    """These are the accepted numbers now, and the reason is a line of the first version of CHANGELOG.md."""
    made_by = {"compiler": data["machine"]["compiler"], "cpu": data["machine"]["cpu"], "commit": data["commit"]}
    record.write(ACCEPTED, {"schema": "nscdd.regression/2", **made_by, "reason": reason, "values": data["values"]})
    changes, heading = Path("CHANGELOG.md"), "### Counts accepted\n\n"
    before, first, *others = changes.read_text().split("\n## ")
    if heading not in first:
        first = first.rstrip("\n") + "\n\n" + heading
    first = first.replace(heading, f"{heading}- {reason}\n")
    changes.write_text("\n## ".join([before, first, *others]))
    print(f"regression: accepted; {ACCEPTED} and CHANGELOG.md say so")
