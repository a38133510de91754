"""What the record has on each statement of cases/paper/statements.toml, and the verdict by the rule that stands beside it. Nothing is judged by hand.

The function of a statement has its name, and returns what was found, whether that agrees (None: it cannot be told), and why it may not."""
import dataclasses
import tomllib

from .data import COLLECTIVE, FAMILIES, MILLION, NUMBERS, SCENES, TABLE_1, mean, total
from ...page.tables import count, number
from ...program import ROOT

AGREES, DIFFERS, UNTOLD = "agrees", "differs", "cannot be told"
STATEMENTS = tomllib.loads((ROOT / "cases/paper/statements.toml").read_text(encoding="utf-8"))
NOTHING = "", None  # from which something could be told


@dataclasses.dataclass
class Verdict:
    statement: str  # of the paper, in our words, with its place
    finding: str
    verdict: str
    why: str  # where it differs or cannot be told
    rule: str
    anchor: str  # of the evidence


def judge(told, finding, good, why=""):
    why = f"These results lack {told['lacks']}." if good is None else "" if good else why
    return Verdict(told["statement"], finding, {True: AGREES, False: DIFFERS, None: UNTOLD}[good], why, told["rule"], told["anchor"])


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
    contacts = mean(run["contacts"])
    why = f"Ours are {count(run['grains'])} spheres with {number(2 * contacts / run['grains'])} contacts each, walls included."
    return f"Counted: {number(run['unknowns_mean'])}, of {count(contacts)} contacts.", abs(run["unknowns_mean"] / 6.5e5 - 1) <= 0.25, why


def minimal_interface(counted):
    if counted is None:
        return NOTHING
    finding = (
        f"Counted: {counted['boundary_predicted']} of {counted['grains']} disks predicted, {counted['boundary']} found, "
        f"{counted['not_boundary']} of those predicted not on the interface."
    )
    why = f"All {counted['boundary_predicted']} predictions held: {counted['candidates']} candidates, {counted['contacts']} contacts."
    return finding, counted["not_boundary"] > 0, why


def predicted_grains(paper):
    pairs = [(run, paper.counted[key]) for key, run in paper.predicted.counted.items() if key in paper.counted and run["scheme"] != "nlgs"]
    steps = [entry for entry in paper.record["agreement"] if entry.get("multiplicity") == "predicted"]
    if not pairs or not steps:
        return NOTHING
    data = [run["bytes_per_iteration"] / other["bytes_per_iteration"] for run, other in pairs]
    counts = [total(run) / total(other) for run, other in pairs]
    wrong = [f"{entry['scene']}, {entry['partition']}" for entry in steps if not all(row["ok"] for row in entry["rows"])]
    why = (f"Bounds are not kept on {'; '.join(wrong)}. " if wrong else "") + (f"Fewest bytes: {number(min(data))} times. " if min(data) <= 1 else "")
    finding = f"{span(data)} times the bytes an iteration, {span(counts)} times the iterations; {len(steps)} steps compared."
    return f"Counted on {len(pairs)} splittings: {finding}", not wrong and min(data) > 1, why


def dcs_below_ccs(paper):
    pairs = {(n, slower): (paper.table_1("ccs", n, slower), paper.table_1("dcs", n, slower)) for slower in (1, 3) for n in NUMBERS}
    pairs = {key: pair for key, pair in pairs.items() if None not in pair}
    if not pairs:
        return NOTHING
    ratios = [ccs / max(dcs, 1e-12) for ccs, dcs in pairs.values()]
    wrong = [where(*key) for key, (ccs, dcs) in pairs.items() if not dcs < ccs]
    return f"SIMULATED: CCS has {span(ratios)} times the share of DCS, {len(pairs)} pairs.", not wrong, f"Not so on {'; '.join(wrong)}."


def order_of_magnitude(paper, slower=1):
    found = {(scheme, n): paper.table_1(scheme, n, slower) for scheme in ("ccs", "dcs") for n in NUMBERS}
    ratios = {(scheme, n): 100 * share / theirs(scheme, n) for (scheme, n), share in found.items() if share is not None}
    if not ratios:
        return NOTHING
    schemes = dict.fromkeys(scheme for scheme, _ in ratios)
    told = [f"{scheme.upper()} {span([ratio for (name, _), ratio in ratios.items() if name == scheme])}" for scheme in schemes]
    outside = [f"{scheme.upper()} on {n}" for (scheme, n), ratio in ratios.items() if not 1 / 3 <= ratio <= 3]
    both = [(paper.table_1(scheme, n, 1), paper.table_1(scheme, n, 3)) for scheme, n in ratios]
    grows = [b / a for a, b in both if a and b]
    why = f"Outside: {', '.join(outside)}. "
    why += f"The share is a ratio of network to core: with cores three times slower it is {span(grows)} times as large. " if grows else ""
    finding = f"SIMULATED: our shares over the paper's: {', '.join(told)}."
    return finding, not outside, why + "The paper gives no seconds to tell core from network."


def order_of_magnitude_slower(paper):
    return order_of_magnitude(paper, 3)


def theirs(scheme, n):
    """Share in MPI by Table 1, in per cent."""
    return TABLE_1[n][{"ccs": 1, "dcs": 2}[scheme]]


def shares_by_subdomains(paper):
    shares = {scheme: {n: paper.table_1(scheme, n) for n in NUMBERS} for scheme in ("ccs", "dcs")}
    if any(share is None for own in shares.values() for share in own.values()):
        return NOTHING
    ours = {scheme: sorted(NUMBERS, key=own.get) for scheme, own in shares.items()}
    published = {scheme: sorted(NUMBERS, key=lambda n: theirs(scheme, n)) for scheme in shares}
    told = "; ".join(f"{scheme.upper()} {', '.join(map(percent, own.values()))}" for scheme, own in shares.items())
    why = "; ".join(
        f"{scheme.upper()}: from least to most on {', '.join(map(str, ours[scheme]))}, the paper's on {', '.join(map(str, published[scheme]))}"
        for scheme in shares
        if ours[scheme] != published[scheme]
    )
    return f"SIMULATED, on 3, 4, 8: {told}.", not why, f"{why}."


def no_collectives(paper):
    counts = {scheme: {n: found for n in NUMBERS if (found := paper.operations(scheme, n))} for scheme in ("dcs", "ccs")}
    if not counts["dcs"]:
        return NOTHING

    def messages(operations, names):
        return sum(operations[name]["messages"] for name in names)

    def told(scheme):
        return "; ".join(f"{number(messages(found, COLLECTIVE))} of {number(messages(found, found))} on {n}" for n, found in counts[scheme].items())

    finding = "Counted, collective messages an iteration: " + ", ".join(f"{scheme.upper()} {told(scheme)}" for scheme in counts if counts[scheme])
    kinds = [name for name in COLLECTIVE if any(messages(found, [name]) for found in counts["dcs"].values())]
    why = f"Those of DCS are of: {', '.join(kinds)}. Copies of grains are glued from rank to rank."
    if kinds == ["reduction"]:
        why += " Reductions sum the speeds of walls under pressure and, where convergence is tested, energies."
    if any(messages(found, ("gather", "scatter")) for found in counts["ccs"].values()):
        why += " CCS gathers and scatters besides."
    return f"{finding}.", not kinds, why


def scatter_is_expensive(paper):
    shares, gathered, waited = {}, [], []
    for place in ((n, slower) for slower in (1, 3) for n in NUMBERS):
        if operations := paper.operations("ccs", *place):
            spent = {name: one["wait_share"] + one["transfer_share"] for name, one in operations.items()}
            shares[place] = spent["scatter"] / sum(spent.values())
            gathered.append(spent["gather"] / sum(spent.values()))
            waited.append(operations["scatter"]["wait_share"] / spent["scatter"])
    if not shares:
        return NOTHING
    outside = [f"{where(*place)}: {percent(share)}" for place, share in shares.items() if share <= 0.5]
    finding = (
        f"SIMULATED: of the time in MPI scattering takes {span(list(shares.values()), percent)}, gathering {span(gathered, percent)}. Of the "
        f"scattering {span(waited, percent)} is waiting for rank 0, which gathers and glues."
    )
    return finding, not outside, f"Not so on {'; '.join(outside)}."


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
    return f"SIMULATED: waiting by CCS and DCS {told} subdomains.", not wrong, f"Not so on {', '.join(wrong)}."


def subdomains_of_fig_2(spheres):
    if not spheres:
        return NOTHING
    numbers = ", ".join(f"{count(grains)} of multiplicity {m}" for m, grains in spheres["multiplicity"].items())
    return f"Counted on {spheres['subdomains']} subdomains: {numbers}.", None


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
    finding = "SIMULATED: DCS over CCS: " + ", ".join(f"{number(ratio)} on {n}" for n, ratio in ratios.items()) + "."
    outside = [str(n) for n in few if not 1 / 1.5 < ratios[n] < 1.5]
    shares = f"{percent(ccs[few[-1]].share)} and {percent(dcs[few[-1]].share)} on {few[-1]}"
    return finding, not outside, f"Outside on {', '.join(outside)} processes; CCS and DCS are in MPI for {shares}."


def scheme_keeps_iterations(paper):
    def same_steps(one, other):
        """Of how many first steps the iterations are the same."""
        return next((k for k, (a, b) in enumerate(zip(one["iterations"], other["iterations"])) if a != b), len(one["iterations"]))

    pairs = [(run, paper.counted.get((*key[:2], "dcs", *key[3:]))) for key, run in paper.counted.items() if key[2] == "ccs"]
    pairs = [(ccs, dcs) for ccs, dcs in pairs if dcs and ccs.get("commit") == dcs.get("commit")]  # two programs may round otherwise
    if not pairs:
        return NOTHING
    differ = [abs(total(ccs) - total(dcs)) / max(1, total(dcs)) for ccs, dcs in pairs]
    worst = pairs[differ.index(max(differ))][0]
    good = max(differ) <= 0.02 and all(same_steps(*pair) >= min(20, pair[0]["steps"]) for pair in pairs)
    same = min(same_steps(*pair) for pair in pairs)
    finding = f"Counted: {len(pairs)} pairs, the same in the first {same} steps of each and more; largest difference in all {100 * max(differ):.2g} %."
    return finding, good, f"Most in {worst['scene']}, {worst['partition']}, {worst['method']}."


def splitting_keeps_iterations(paper):
    runs = sorted(paper.runs("biaxial", of="grid"), key=lambda run: run["subdomains"])
    if len({(run["partition"], run["subdomains"]) for run in runs}) < 2:
        return NOTHING
    least, most = min(map(total, runs)), max(map(total, runs))
    near = {n: [total(run) for run in runs if run["subdomains"] <= n] for n in {run["subdomains"] for run in runs}}
    up_to = max((n for n, totals in near.items() if max(totals) <= 1.1 * min(totals)), default=None)
    first, last = runs[0], max(runs, key=lambda run: (run["subdomains"], total(run)))
    finding = f"Counted: {count(least)} to {count(most)} on {first['subdomains']} to {last['subdomains']} subdomains, spread {100 * (most / least - 1):.0f} %."
    chance = paper.chance()
    if chance is None:
        return finding, None
    shared = [percent(run["interface_grains"] / run["grains"]) for run in (first, last)]
    why = f"Within 10 % up to {up_to} subdomains. " if up_to else ""
    why += f"Shared are {shared[0]} of the grains by {first['subdomains']} subdomains, {shared[1]} by {last['subdomains']}."
    return f"{finding} Chance makes up to {100 * (chance - 1):.0f} %.", most <= 1.1 * chance * least, why


def ccs_poor_3d(paper):
    for scene in ("triaxial", "isotropic"):
        ccs, dcs, numbers = both_schemes(paper, scene)
        if n := max((n for n in numbers if n <= 48), default=0):
            mine, other = ccs[n].efficiency, dcs[n].efficiency
            why = f"CCS is in MPI for {percent(ccs[n].share)} of an iteration, DCS for {percent(dcs[n].share)}."
            return f"SIMULATED, {scene}, {n} processes: CCS {number(mine)}, DCS {number(other)}.", mine <= 0.5 and mine < other, why
    return NOTHING


def hardest(paper):
    each = {scene: mean(run["iterations"]) for scene in SCENES if (run := paper.nlgs(scene))}
    if "triaxial" not in each or len(each) < 2:
        return NOTHING
    harder = [scene for scene in each if scene != "triaxial" and each[scene] >= each["triaxial"]]
    why = (
        f"More in the {' and the '.join(harder)} test. The triaxial test starts under way here, with impulses of the step before; the "
        "isotropic one starts from loose grains and is dynamic, until its walls stop. The paper gives no numbers of its own to compare."
    )
    return f"Counted, iterations a step: {', '.join(f'{scene} {count(value)}' for scene, value in each.items())}.", not harder, why


def speed_up_3d(paper):
    curve = [point for n, point in sorted(paper.curve("triaxial", "paper", "dcs", "grid").items()) if n <= 48]
    if len(curve) < 2:
        return NOTHING
    last, grows = curve[-1], all(a.speed_up < b.speed_up for a, b in zip(curve, curve[1:]))
    more = last.iterations / total(paper.nlgs("triaxial"))
    why = f"Of the loss on {last.n}: an iteration alone has an efficiency of {number(last.iteration_efficiency)}, and "
    why += f"{number(more)} times the iterations of NLGS are made."
    told = ", ".join(f"{number(point.speed_up)} on {point.n}" for point in curve)
    return f"SIMULATED: {told}; efficiency {number(last.efficiency)} on {last.n}.", grows and last.efficiency >= 0.5, why


def iterations_of_fig_4(paper):
    runs, nlgs = sorted(paper.runs("triaxial", scheme="dcs", of="grid"), key=lambda run: run["subdomains"]), paper.nlgs("triaxial")
    if not (nlgs and runs):
        return NOTHING
    each = [mean(run["iterations"]) for run in runs]
    ends = f"{runs[0]['subdomains']} to {runs[-1]['subdomains']} subdomains"
    return f"Counted: {count(mean(nlgs['iterations']))} by NLGS, {count(min(each))} to {count(max(each))} by DCS on {ends}.", None


def network_may_be_better(paper):
    place = ("triaxial", "paper", "dcs", "grid 4x4x3", 48, "node48", 1)
    bands = {"half the latency": (0.5, 1, 0), "twice the bandwidth": (1, 2, 0)}
    now = paper.window(place, "seconds_per_iteration")
    better = {name: seconds for name, band in bands.items() if (seconds := paper.window(place, "seconds_per_iteration", band))}
    if not now or not better:
        return NOTHING
    told = ", ".join(f"{percent(1 - seconds / now)} by {name}" for name, seconds in better.items())
    why = (
        f"Our iteration on 48 is in MPI for {percent(paper.window(place, 'mpi_share'))} only. That cores share the bandwidth of their memory is "
        "not simulated; the paper's loss may be of that."
    )
    return f"SIMULATED: off an iteration {told}.", min(better.values()) < 0.95 * now, why


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
    finding = f"The problem of the paper, on which the statement is not: {told(own)}." if own else ""
    if not larger:
        return finding and f"SIMULATED: {finding}", None
    near = larger[min(larger, key=lambda n: (abs(n - 100), n))]
    why = f"On {near.n}, {percent(near.share)} of an iteration are in MPI."
    return f"SIMULATED: speed-up {told(larger)}. {finding}".rstrip(), near.efficiency >= 0.5, why


def verdicts(paper, network_counts, sphere_counts=None):
    """All statements in the order of the paper; network_counts: of network.counts(), sphere_counts: of packings.sphere_counts(), or None."""
    counted = {"minimal_interface": network_counts, "subdomains_of_fig_2": sphere_counts}
    return [judge(told, *globals()[name](counted.get(name, paper))) for name, told in STATEMENTS.items()]
