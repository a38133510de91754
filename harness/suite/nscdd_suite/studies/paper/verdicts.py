"""What the record has on each statement of cases/paper/statements.toml, and the verdict by the rule that stands beside it. Nothing is judged by hand.

The function of a statement has its name, and returns whether we agree (None: it cannot be told) and what was found, for the texts that stand there."""
import dataclasses
import string

from ...page.tables import count, number
from ...program import ROOT
from ...record import toml
from .data import COLLECTIVE, FAMILIES, MILLION, NUMBERS, SCENES, TABLE_1, mean, total

AGREES, DIFFERS, UNTOLD = "agrees", "differs", "cannot be told"
STATEMENTS = toml(ROOT / "cases/paper/statements.toml")
NOTHING = None, {}  # from which something could be told


@dataclasses.dataclass
class Verdict:
    statement: str  # of the paper, in our words, with its place
    finding: str
    verdict: str
    why: str  # where it differs or cannot be told
    rule: str
    anchor: str  # of the evidence


class Text(string.Formatter):
    """As str.format(), with the conversions of statements.toml."""

    def convert_field(self, value, conversion):
        if conversion not in ("n", "c", "p"):
            return super().convert_field(value, conversion)
        show = {"n": number, "c": count, "p": percent}[conversion]
        return span(value, show) if isinstance(value, list) else show(value)


def judge(told, good, found):
    finding = Text().format(told["finding"], **found).strip() if found else ""
    if good is None:
        why, verdict = f"These results lack {told['lacks']}.", UNTOLD
    else:
        why, verdict = ("", AGREES) if good else (Text().format(told["why"], **found), DIFFERS)
    return Verdict(told["statement"], finding, verdict, why, told["rule"], told["anchor"])


def percent(share):
    return f"{100 * share:.1f}\u202f%"


def span(values, text=number):
    """least to largest, once where they are the same."""
    low, high = text(min(values)), text(max(values))
    return low if low == high else f"{low} to {high}"


def where(n, slower):
    return f"{n} subdomains{', cores 3 times slower' if slower > 1 else ''}"


def unknowns(paper):
    run = paper.nlgs("triaxial")
    if not run:
        return NOTHING
    found = {"unknowns": run["unknowns_mean"], "contacts": mean(run["contacts"]), "grains": run["grains"]}
    return abs(run["unknowns_mean"] / 6.5e5 - 1) <= 0.25, found | {"each": 2 * found["contacts"] / run["grains"]}


def minimal_interface(counted):
    return NOTHING if counted is None else (counted["not_boundary"] > 0, counted)


def predicted_grains(paper):
    pairs = [(run, paper.counted[key]) for key, run in paper.predicted.counted.items() if key in paper.counted and run["scheme"] != "nlgs"]
    steps = [entry for entry in paper.record["agreement"] if entry.get("multiplicity") == "predicted"]
    if not pairs or not steps:
        return NOTHING
    data = [run["bytes_per_iteration"] / other["bytes_per_iteration"] for run, other in pairs]
    wrong = [f"{entry['scene']}, {entry['partition']}" for entry in steps if not all(row["ok"] for row in entry["rows"])]
    found = {"pairs": len(pairs), "steps": len(steps), "data": data, "counts": [total(run) / total(other) for run, other in pairs]}
    found |= {"wrong": f"Bounds are not kept on {'; '.join(wrong)}. " if wrong else ""}
    return not wrong and min(data) > 1, found | {"fewest": f"Fewest bytes: {number(min(data))} times. " if min(data) <= 1 else ""}


def dcs_below_ccs(paper):
    pairs = {(n, slower): (paper.table_1("ccs", n, slower), paper.table_1("dcs", n, slower)) for slower in (1, 3) for n in NUMBERS}
    pairs = {key: pair for key, pair in pairs.items() if None not in pair}
    if not pairs:
        return NOTHING
    ratios = [ccs / max(dcs, 1e-12) for ccs, dcs in pairs.values()]
    wrong = [where(*key) for key, (ccs, dcs) in pairs.items() if not dcs < ccs]
    return not wrong, {"pairs": len(pairs), "ratios": ratios, "wrong": "; ".join(wrong)}


def theirs(scheme, n):
    """Share in MPI by Table 1, in per cent."""
    return TABLE_1[n][{"ccs": 1, "dcs": 2}[scheme]]


def order_of_magnitude(paper, slower=1):
    shares = {(scheme, n): paper.table_1(scheme, n, slower) for scheme in ("ccs", "dcs") for n in NUMBERS}
    ratios = {(scheme, n): 100 * share / theirs(scheme, n) for (scheme, n), share in shares.items() if share is not None}
    if not ratios:
        return NOTHING
    schemes = dict.fromkeys(scheme for scheme, _ in ratios)
    told = [f"{scheme.upper()} {span([ratio for (name, _), ratio in ratios.items() if name == scheme])}" for scheme in schemes]
    outside = [f"{scheme.upper()} on {n}" for (scheme, n), ratio in ratios.items() if not 1 / 3 <= ratio <= 3]
    both = [(paper.table_1(scheme, n, 1), paper.table_1(scheme, n, 3)) for scheme, n in ratios]
    times = [b / a for a, b in both if a and b]
    grows = f" The share is a ratio of network to core: with cores three times slower it is {span(times)} times as large." if times else ""
    return not outside, {"told": ", ".join(told), "outside": ", ".join(outside), "grows": grows}


def order_of_magnitude_slower(paper):
    return order_of_magnitude(paper, 3)


def shares_by_subdomains(paper):
    shares = {scheme: {n: paper.table_1(scheme, n) for n in NUMBERS} for scheme in ("ccs", "dcs")}
    if any(None in own.values() for own in shares.values()):
        return NOTHING
    wrong = []
    for scheme, own in shares.items():
        ours, published = sorted(NUMBERS, key=own.get), sorted(NUMBERS, key=lambda n: theirs(scheme, n))
        if ours != published:
            wrong.append(f"{scheme.upper()}: from least to most on {', '.join(map(str, ours))}, the paper's on {', '.join(map(str, published))}")
    told = "; ".join(f"{scheme.upper()} {', '.join(map(percent, own.values()))}" for scheme, own in shares.items())
    return not wrong, {"told": told, "wrong": "; ".join(wrong)}


def no_collectives(paper):
    sent = {scheme: {n: found for n in NUMBERS if (found := paper.operations(scheme, n))} for scheme in ("dcs", "ccs")}
    if not sent["dcs"]:
        return NOTHING

    def messages(operations, names):
        return sum(operations[name]["messages"] for name in names)

    def told(found):
        return "; ".join(f"{number(messages(each, COLLECTIVE))} of {number(messages(each, each))} on {n}" for n, each in found.items())

    kinds = [name for name in COLLECTIVE if any(messages(each, [name]) for each in sent["dcs"].values())]
    reductions = " Reductions sum the speeds of walls under pressure and, where convergence is tested, energies." if kinds == ["reduction"] else ""
    ccs = any(messages(each, ("gather", "scatter")) for each in sent["ccs"].values())
    found = {"told": ", ".join(f"{scheme.upper()} {told(found)}" for scheme, found in sent.items() if found), "kinds": ", ".join(kinds)}
    return not kinds, found | {"reductions": reductions, "ccs": " CCS gathers and scatters besides." if ccs else ""}


def scatter_is_expensive(paper):
    scattered, gathered, waited = {}, [], []
    for place in ((n, slower) for slower in (1, 3) for n in NUMBERS):
        if operations := paper.operations("ccs", *place):
            spent = {name: one["wait_share"] + one["transfer_share"] for name, one in operations.items()}
            scattered[place] = spent["scatter"] / sum(spent.values())
            gathered.append(spent["gather"] / sum(spent.values()))
            waited.append(operations["scatter"]["wait_share"] / spent["scatter"])
    if not scattered:
        return NOTHING
    outside = [f"{where(*place)}: {percent(share)}" for place, share in scattered.items() if share <= 0.5]
    return not outside, {"scattered": list(scattered.values()), "gathered": gathered, "waited": waited, "outside": "; ".join(outside)}


def interface_in_parallel(paper):
    waits = {}
    for n in NUMBERS:
        pair = [[paper.table_1(scheme, n, 1, field) for field in ("wait_share", "seconds_per_iteration")] for scheme in ("ccs", "dcs")]
        if all(None not in one for one in pair):
            waits[n] = [1e6 * share * seconds for share, seconds in pair]
    if not waits:
        return NOTHING
    wrong = [str(n) for n, (ccs, dcs) in waits.items() if not dcs < ccs]
    told = ", ".join(f"{number(ccs)} and {number(dcs)} \u00b5s on {n}" for n, (ccs, dcs) in waits.items())
    return not wrong, {"told": told, "wrong": ", ".join(wrong)}


def subdomains_of_fig_2(spheres):
    if not spheres:
        return NOTHING
    told = ", ".join(f"{count(grains)} of multiplicity {m}" for m, grains in spheres["multiplicity"].items())
    return None, {"subdomains": spheres["subdomains"], "told": told}


def both_schemes(paper, scene):
    """Curves of CCS and DCS, and the numbers of processes that both have."""
    ccs, dcs = (paper.curve(scene, "paper", scheme, "grid") for scheme in ("ccs", "dcs"))
    return ccs, dcs, sorted(ccs.keys() & dcs.keys())


def scheme_keeps_speed_up_2d(paper):
    ccs, dcs, numbers = both_schemes(paper, "biaxial")
    ratios = {n: dcs[n].speed_up / ccs[n].speed_up for n in numbers}
    few = [n for n in numbers if n <= 8]
    if not few:
        return NOTHING
    outside = ", ".join(str(n) for n in few if not 1 / 1.5 < ratios[n] < 1.5)
    told = ", ".join(f"{number(ratio)} on {n}" for n, ratio in ratios.items())
    return not outside, {"told": told, "outside": outside, "n": few[-1], "ccs": ccs[few[-1]].share, "dcs": dcs[few[-1]].share}


def scheme_keeps_iterations(paper):
    def same_steps(one, other):
        """Of how many first steps the iterations are the same."""
        return next((k for k, (a, b) in enumerate(zip(one["iterations"], other["iterations"])) if a != b), len(one["iterations"]))

    pairs = [(run, paper.counted.get((*key[:2], "dcs", *key[3:]))) for key, run in paper.counted.items() if key[2] == "ccs"]
    pairs = [(ccs, dcs) for ccs, dcs in pairs if dcs and ccs.get("commit") == dcs.get("commit")]  # two programs may round otherwise
    if not pairs:
        return NOTHING
    differ, same = [abs(total(ccs) - total(dcs)) / max(1, total(dcs)) for ccs, dcs in pairs], [same_steps(*pair) for pair in pairs]
    good = max(differ) <= 0.02 and all(steps >= min(20, ccs["steps"]) for steps, (ccs, _) in zip(same, pairs))
    return good, {"pairs": len(pairs), "same": min(same), "most": 100 * max(differ), "worst": pairs[differ.index(max(differ))][0]}


def splitting_keeps_iterations(paper):
    runs, chance = sorted(paper.runs("biaxial", of="grid"), key=lambda run: run["subdomains"]), paper.chance()
    if len({(run["partition"], run["subdomains"]) for run in runs}) < 2:
        return NOTHING
    least, most = min(map(total, runs)), max(map(total, runs))
    totals = {n: [total(run) for run in runs if run["subdomains"] <= n] for n in {run["subdomains"] for run in runs}}
    near = max((n for n, found in totals.items() if max(found) <= 1.1 * min(found)), default=None)
    ends = runs[0], max(runs, key=lambda run: (run["subdomains"], total(run)))
    found = {"least": least, "most": most, "spread": 100 * (most / least - 1), "near": f"Within 10 % up to {near} subdomains. " if near else ""}
    found |= {"shared": [run["interface_grains"] / run["grains"] for run in ends], "first": ends[0]["subdomains"], "last": ends[1]["subdomains"]}
    found |= {"chance": f" Chance makes up to {100 * (chance - 1):.0f} %." if chance else ""}
    return chance and most <= 1.1 * chance * least, found


def ccs_poor_3d(paper):
    for scene in ("triaxial", "isotropic"):
        ccs, dcs, numbers = both_schemes(paper, scene)
        if n := max((n for n in numbers if n <= 48), default=0):
            mine, other = ccs[n], dcs[n]
            return mine.efficiency <= 0.5 and mine.efficiency < other.efficiency, {"scene": scene, "n": n, "ccs": mine, "dcs": other}
    return NOTHING


def hardest(paper):
    each = {scene: mean(run["iterations"]) for scene in SCENES if (run := paper.nlgs(scene))}
    if "triaxial" not in each or len(each) < 2:
        return NOTHING
    harder = [scene for scene in each if scene != "triaxial" and each[scene] >= each["triaxial"]]
    return not harder, {"told": ", ".join(f"{scene} {count(value)}" for scene, value in each.items()), "harder": " and the ".join(harder)}


def speed_up_3d(paper):
    curve = [point for n, point in sorted(paper.curve("triaxial", "paper", "dcs", "grid").items()) if n <= 48]
    if len(curve) < 2:
        return NOTHING
    last, grows = curve[-1], all(a.speed_up < b.speed_up for a, b in zip(curve, curve[1:]))
    told = ", ".join(f"{number(point.speed_up)} on {point.n}" for point in curve)
    return grows and last.efficiency >= 0.5, {"told": told, "last": last, "more": last.iterations / total(paper.nlgs("triaxial"))}


def iterations_of_fig_4(paper):
    runs, nlgs = sorted(paper.runs("triaxial", scheme="dcs", of="grid"), key=lambda run: run["subdomains"]), paper.nlgs("triaxial")
    if not (nlgs and runs):
        return NOTHING
    found = {"nlgs": mean(nlgs["iterations"]), "each": [mean(run["iterations"]) for run in runs]}
    return None, found | {"first": runs[0]["subdomains"], "last": runs[-1]["subdomains"]}


def network_may_be_better(paper):
    place = ("triaxial", "paper", "dcs", "grid 4x4x3", 48, "node48", 1)
    bands = {"half the latency": (0.5, 1, 0), "twice the bandwidth": (1, 2, 0)}
    now = paper.window(place, "seconds_per_iteration")
    better = {name: seconds for name, band in bands.items() if (seconds := paper.window(place, "seconds_per_iteration", band))}
    if not now or not better:
        return NOTHING
    told = ", ".join(f"{percent(1 - seconds / now)} by {name}" for name, seconds in better.items())
    return min(better.values()) < 0.95 * now, {"told": told, "share": paper.window(place, "mpi_share")}


def hundred_processors(paper):
    def best(scene):
        """{processes: the point of the best partition}."""
        found = {}
        for n, point in (pair for of in FAMILIES for pair in paper.curve(scene, "paper", "dcs", of, "cluster").items()):
            if 64 <= n <= 256 and (n not in found or point.efficiency > found[n].efficiency):
                found[n] = point
        return dict(sorted(found.items()))

    def told(found):
        return ", ".join(f"{number(point.speed_up)} on {n} (efficiency {number(point.efficiency)})" for n, point in found.items())

    larger, own = best(MILLION), best("triaxial")
    if not (larger or own):
        return NOTHING
    near = larger and larger[min(larger, key=lambda n: (abs(n - 100), n))]
    found = {"larger": f"speed-up {told(larger)}. " if larger else "", "near": near}
    found |= {"own": f"The problem of the paper, on which the statement is not: {told(own)}." if own else ""}
    return near.efficiency >= 0.5 if larger else None, found


def verdicts(paper, network_counts, sphere_counts=None):
    """All statements in the order of the paper; network_counts: of network.counts(), sphere_counts: of packings.sphere_counts(), or None."""
    counted = {"minimal_interface": network_counts, "subdomains_of_fig_2": sphere_counts}
    return [judge(told, *globals()[name](counted.get(name, paper))) for name, told in STATEMENTS.items()]
