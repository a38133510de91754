"""The paper's statements, what the record has on each, and the verdict by a rule that is written beside it. Nothing is judged by hand."""
import dataclasses

from .data import COLLECTIVE, MILLION, SCENES, TABLE_1, UNKNOWNS, Paper, mean, total
from ...page.tables import count, number

AGREES, DIFFERS, UNTOLD = "agrees", "differs", "cannot be told"
FEW = 8  # processes


@dataclasses.dataclass
class Verdict:
    statement: str  # of the paper, in our words, with its place
    finding: str
    verdict: str
    why: str  # where it differs or cannot be told
    rule: str
    anchor: str  # of the evidence


def judge(statement, anchor, rule, finding, good, why):
    return Verdict(statement, finding, AGREES if good else DIFFERS, "" if good else why, rule, anchor)


def untold(statement, anchor, rule, lacks, finding=""):
    return Verdict(statement, finding, UNTOLD, f"These results lack {lacks}.", rule, anchor)


def percent(share):
    return f"{100 * share:.1f}\u202f%"


def span(values, text=number):
    """least to largest, once where they are the same."""
    low, high = text(min(values)), text(max(values))
    return low if low == high else f"{low} to {high}"


def dcs_below_ccs(paper):
    statement = "DCS spends a smaller share of its time in MPI than CCS (section 4.3, Table 1)."
    rule = "Agrees if the share of DCS is the smaller one for each number of subdomains of Table 1, with present cores and with slower ones."
    pairs = {(n, slower): (paper.share("ccs", n, slower), paper.share("dcs", n, slower)) for slower in (1, 3) for n in TABLE_1 if n > 1}
    pairs = {key: pair for key, pair in pairs.items() if None not in pair}
    if not pairs:
        return untold(statement, "paper-table-1", rule, "simulated iterations of the isotropic compaction by both schemes")
    ratios = [ccs / max(dcs, 1e-12) for ccs, dcs in pairs.values()]
    wrong = [f"{n} subdomains{', cores 3 times slower' if slower > 1 else ''}" for (n, slower), (ccs, dcs) in pairs.items() if not dcs < ccs]
    finding = f"SIMULATED: CCS has {span(ratios)} times the share of DCS, {len(pairs)} pairs."
    return judge(statement, "paper-table-1", rule, finding, not wrong, f"Not so on {'; '.join(wrong)}.")


def order_of_magnitude(paper, slower):
    cores = "cores three times slower, our guess at those of the paper, which was given in June 2012" if slower > 1 else "present cores"
    statement = f"Shares in MPI: CCS 31.3, 35.6, 58.3 %, DCS 14.0, 9.1, 18.4 % on 3, 4, 8 subdomains (Table 1). Order of magnitude, {cores}."
    rule = "Agrees if each of our shares is within a factor of 3 of the paper's."
    ratios = {
        (scheme, n): 100 * share / TABLE_1[n][column]
        for column, scheme in ((1, "ccs"), (2, "dcs"))
        for n in TABLE_1
        if n > 1 and (share := paper.share(scheme, n, slower)) is not None
    }
    if not ratios:
        return untold(statement, "paper-table-1", rule, f"simulated iterations of the isotropic compaction with {cores}")
    by_scheme = [
        f"{scheme.upper()} {span([ratio for (name, _), ratio in ratios.items() if name == scheme])}"
        for scheme in ("ccs", "dcs")
        if any(name == scheme for name, _ in ratios)
    ]
    outside = [f"{scheme.upper()} on {n}" for (scheme, n), ratio in ratios.items() if not 1 / 3 <= ratio <= 3]
    both = [(paper.share(scheme, n, 1), paper.share(scheme, n, 3)) for scheme, n in ratios]
    grows = [b / a for a, b in both if a and b]
    why = f"Outside: {', '.join(outside)}. "
    why += f"The share is a ratio of network to core: with cores three times slower it is {span(grows)} times as large. " if grows else ""
    finding = f"SIMULATED: our shares over the paper's: {', '.join(by_scheme)}."
    return judge(statement, "paper-table-1", rule, finding, not outside, why + "The paper gives no seconds to tell core from network.")


def same_steps(one, other):
    """Of how many first steps the iterations are the same."""
    return next((k for k, (a, b) in enumerate(zip(one["iterations"], other["iterations"])) if a != b), len(one["iterations"]))


def scheme_keeps_iterations(paper):
    statement = "The number of iterations does not depend on the communication scheme (section 5)."
    rule = (
        "Agrees if CCS and DCS on the same splitting make the same iterations in each of the first 20 steps, and the same in all within 2 %: "
        "their interface problems are solved in two ways, by round-off apart, which rigid grains amplify step by step."
    )
    runs = paper.counted
    pairs = [(run, runs[(*key[:2], "dcs", *key[3:])]) for key, run in runs.items() if key[2] == "ccs" and (*key[:2], "dcs", *key[3:]) in runs]
    pairs = [(ccs, dcs) for ccs, dcs in pairs if ccs.get("commit") == dcs.get("commit")]  # two programs may round otherwise
    if not pairs:
        return untold(statement, "paper-runs", rule, "runs by both schemes on the same splitting, of one commit")
    differ = [abs(total(ccs) - total(dcs)) / max(1, total(dcs)) for ccs, dcs in pairs]
    same = min(same_steps(*pair) for pair in pairs)
    worst = max(zip(differ, pairs), key=lambda both: both[0])[1][0]
    good = max(differ) <= 0.02 and all(same_steps(*pair) >= min(20, pair[0]["steps"]) for pair in pairs)
    finding = f"Counted: {len(pairs)} pairs, the same in the first {same} steps of each and more; largest difference in all {100 * max(differ):.2g} %."
    return judge(statement, "paper-fig-3", rule, finding, good, f"Most in {worst['scene']}, {worst['partition']}, {worst['method']}.")


def splitting_keeps_iterations(paper):
    statement = "In 2D the number of iterations is nearly constant for all splittings (section 5, Fig. 3b)."
    rule = (
        "Agrees if the most total iterations of a splitting by grid are at most 1.1 times the least, times what chance makes: the most over the "
        "least of one splitting from starts perturbed by 1e-9 of a radius."
    )
    runs = sorted(paper.runs("biaxial", of="grid"), key=lambda run: run["subdomains"])
    if len({(run["partition"], run["subdomains"]) for run in runs}) < 2:
        return untold(statement, "paper-fig-3", rule, "whole runs of the biaxial test on two splittings")
    least, most = min(map(total, runs)), max(map(total, runs))
    up_to = max(
        (n for n in {run["subdomains"] for run in runs} if (near := [total(r) for r in runs if r["subdomains"] <= n]) and max(near) <= 1.1 * min(near)),
        default=None,
    )
    last = max(runs, key=lambda run: (run["subdomains"], total(run)))
    finding = (
        f"Counted: {count(least)} to {count(most)} on {runs[0]['subdomains']} to {last['subdomains']} subdomains, spread {100 * (most / least - 1):.0f} %."
    )
    chance = paper.chance()
    if chance is None:
        return untold(statement, "paper-fig-3", rule, "runs from perturbed starts (scripts/suite run paper --only chance): not run", finding)
    finding += f" Chance makes up to {100 * (chance - 1):.0f} %."
    why = (
        (f"Within 10 % up to {up_to} subdomains. " if up_to else "")
        + f"Shared are {percent(runs[0]['interface_grains'] / runs[0]['grains'])} of the grains by {runs[0]['subdomains']} subdomains, "
        f"{percent(last['interface_grains'] / last['grains'])} by {last['subdomains']}."
    )
    return judge(statement, "paper-chance", rule, finding, most <= 1.1 * chance * least, why)


def scheme_keeps_speed_up_2d(paper):
    statement = "In 2D the speed-up does not change drastically with the scheme, at least for few processes (section 5, Fig. 3a)."
    rule = f"Agrees if the speed-ups by CCS and DCS differ by less than a factor of 1.5 up to {FEW} processes."
    ccs, dcs = (paper.curve("biaxial", "paper", scheme, "grid") for scheme in ("ccs", "dcs"))
    ratios = {n: dcs[n].speed_up / ccs[n].speed_up for n in sorted(ccs.keys() & dcs.keys())}
    few = {n: ratio for n, ratio in ratios.items() if n <= FEW}
    if not few:
        return untold(statement, "paper-fig-3", rule, "simulated iterations and counts of the biaxial test by both schemes")
    finding = "SIMULATED: DCS over CCS: " + ", ".join(f"{number(ratio)} on {n}" for n, ratio in ratios.items()) + "."
    outside = [str(n) for n, ratio in few.items() if not 1 / 1.5 < ratio < 1.5]
    shares = [f"{percent(ccs[n].share)} and {percent(dcs[n].share)} on {n}" for n in list(few)[-1:]]
    return judge(statement, "paper-fig-3", rule, finding, not outside, f"Outside on {', '.join(outside)} processes; CCS and DCS are in MPI for {shares[0]}.")


def ccs_poor_3d(paper):
    statement = "In 3D the centralised scheme has a very poor efficiency (section 5)."
    rule = (
        "Agrees if the efficiency at equal error by CCS is at most 0.5 on the most processes up to 48 that were simulated for both schemes, "
        "and below that of DCS there."
    )
    for scene in ("triaxial", "isotropic"):
        ccs, dcs = (paper.curve(scene, "paper", scheme, "grid") for scheme in ("ccs", "dcs"))
        numbers = [n for n in ccs.keys() & dcs.keys() if n <= 48]
        if numbers:
            break
    else:
        return untold(statement, "paper-fig-4", rule, "simulated iterations and counts of a 3D scene by both schemes")
    n = max(numbers)
    mine, other = ccs[n].efficiency, dcs[n].efficiency
    finding = f"SIMULATED, {scene}, {n} processes: CCS {number(mine)}, DCS {number(other)}."
    why = f"CCS is in MPI for {percent(ccs[n].share)} of an iteration, DCS for {percent(dcs[n].share)}."
    return judge(statement, "paper-fig-4", rule, finding, mine <= 0.5 and mine < other, why)


def speed_up_3d(paper):
    statement = "In 3D the speed-up has a good quantitative behaviour (section 5, Fig. 4a)."
    rule = "Agrees if the speed-up by DCS grows with each number of processes up to 48, and is at least half of the ideal on the most."
    curve = {n: point for n, point in paper.curve("triaxial", "paper", "dcs", "grid").items() if n <= 48}
    if len(curve) < 2:
        return untold(statement, "paper-fig-4", rule, "simulated iterations and counts of the triaxial test by DCS")
    numbers = sorted(curve)
    values = [curve[n].speed_up for n in numbers]
    last = curve[numbers[-1]]
    nlgs = paper.nlgs("triaxial")
    why = (
        f"Of the loss on {last.n}: an iteration alone has an efficiency of {number(last.iteration_efficiency)}, and "
        f"{number(last.iterations / total(nlgs))} times the iterations of NLGS are made."
    )
    finding = "SIMULATED: " + ", ".join(f"{number(curve[n].speed_up)} on {n}" for n in numbers) + f"; efficiency {number(last.efficiency)} on {last.n}."
    return judge(statement, "paper-fig-4", rule, finding, all(a < b for a, b in zip(values, values[1:])) and last.efficiency >= 0.5, why)


def hundred_processors(paper):
    statement = "About a hundred processors, for larger problems, take a supercomputing platform for a reasonable speed-up (section 5)."
    rule = (
        "Agrees if a simulated cluster reaches at least half of the ideal speed-up on the triaxial test of a million spheres, by the best "
        "partition, on that number of processes from 64 to 256 which is nearest to 100."
    )

    def best(scene):
        points = [
            point for of in ("grid", "bisection", "metis") for point in paper.curve(scene, "paper", "dcs", of, "cluster").values() if 64 <= point.n <= 256
        ]
        return {n: max((point for point in points if point.n == n), key=lambda point: point.efficiency) for n in sorted({point.n for point in points})}

    def told(found):
        return ", ".join(f"{number(point.speed_up)} on {n} (efficiency {number(point.efficiency)})" for n, point in found.items())

    larger, own = best(MILLION), best("triaxial")
    finding = f"The problem of the paper, on which the statement is not: {told(own)}." if own else ""
    if not larger:
        lacks = "a million spheres on 64 to 256 processes of the cluster (scripts/suite run paper --only larger): not run"
        return untold(statement, "paper-beyond", rule, lacks, finding and f"SIMULATED: {finding}")
    near = larger[min(larger, key=lambda n: (abs(n - 100), n))]
    why = f"On {near.n}, {percent(near.share)} of an iteration are in MPI."
    return judge(statement, f"paper-points-{MILLION}", rule, f"SIMULATED: speed-up {told(larger)}. {finding}".rstrip(), near.efficiency >= 0.5, why)


def unknowns(paper):
    statement = "The 64,000 spheres have 6.5\u202f\u00d7\u202f10\u2075 contact unknowns on average (sections 2.1 and 5)."
    rule = "Agrees if the mean of the sequential run is within 25 % of that."
    run = paper.nlgs("triaxial")
    if not run:
        return untold(statement, "paper-runs", rule, "the sequential run of the triaxial test")
    contacts = mean(run["contacts"])
    finding = f"Counted: {number(run['unknowns_mean'])}, of {count(contacts)} contacts."
    why = f"Ours are {count(run['grains'])} spheres with {number(2 * contacts / run['grains'])} contacts each, walls included."
    return judge(statement, "paper-runs", rule, finding, abs(run["unknowns_mean"] / UNKNOWNS - 1) <= 0.25, why)


def minimal_interface(counted):
    statement = "Predicted boundary grains may turn out not to belong to the minimal interface (section 3.2, Fig. 1)."
    rule = "Agrees if a grain of Fig. 1 was predicted in several subdomains and has contacts in one at most."
    if counted is None:
        return untold(statement, "paper-fig-1", rule, "the state of the network of Fig. 1")
    finding = (
        f"Counted: {counted['boundary_predicted']} of {counted['grains']} disks predicted, {counted['boundary']} found, "
        f"{counted['not_boundary']} of those predicted not on the interface."
    )
    why = f"All {counted['boundary_predicted']} predictions held: {counted['candidates']} candidates, {counted['contacts']} contacts."
    return judge(statement, "paper-fig-1", rule, finding, counted["not_boundary"] > 0, why)


def scatter_is_expensive(paper):
    statement = "Of CCS the scattering of updated multipliers is especially expensive (section 4.3)."
    rule = (
        "Agrees if ranks spend more than half of their time in MPI by CCS in the scattering, waiting for it included, on each number of "
        "subdomains of Table 1, with present cores and with slower ones."
    )
    shares, gathered, waited = {}, [], []
    for slower in (1, 3):
        for n in TABLE_1:
            operations = paper.operations("ccs", n, slower) if n > 1 else None
            if not operations:
                continue
            spent = {name: one["wait_share"] + one["transfer_share"] for name, one in operations.items()}
            all_of_them = sum(spent.values())
            shares[n, slower] = spent["scatter"] / all_of_them
            gathered.append(spent["gather"] / all_of_them)
            waited.append(operations["scatter"]["wait_share"] / spent["scatter"])
    if not shares:
        return untold(statement, "paper-table-1", rule, "the time of CCS by operation (scripts/suite run paper --only table1): not run")
    outside = [f"{n} subdomains{', cores 3 times slower' if slower > 1 else ''}: {percent(share)}" for (n, slower), share in shares.items() if share <= 0.5]
    finding = (
        f"SIMULATED: of the time in MPI scattering takes {span(list(shares.values()), percent)}, gathering {span(gathered, percent)}. Of the "
        f"scattering {span(waited, percent)} is waiting for rank 0, which gathers and glues."
    )
    return judge(statement, "paper-operations", rule, finding, not outside, f"Not so on {'; '.join(outside)}.")


def predicted_grains(paper):
    statement = "Gluing predicted grains that are not on the minimal interface does not change the problem, it adds data to send (section 3.2)."
    rule = (
        "Agrees if a step that glues them keeps every bound of its comparison with sequential NLGS, and an iteration of whole runs sends more bytes "
        "than on the minimal interface, on each splitting that was run with both."
    )
    wide = Paper(paper.record, "predicted")
    pairs = [(run, paper.counted[key]) for key, run in wide.counted.items() if key in paper.counted and run["scheme"] != "nlgs"]
    pairs = [pair for pair in pairs if all("bytes_per_iteration" in run for run in pair)]
    steps = [entry for entry in paper.record["agreement"] if entry.get("multiplicity") == "predicted"]
    if not pairs or not steps:
        return untold(statement, "paper-fig-1", rule, "runs that glue the predicted interface (scripts/suite run paper --only interface): not run")
    data = [run["bytes_per_iteration"] / other["bytes_per_iteration"] for run, other in pairs]
    counts = [total(run) / total(other) for run, other in pairs]
    wrong = [f"{entry['scene']}, {entry['partition']}" for entry in steps if not all(row["ok"] for row in entry["rows"])]
    why = (f"Bounds are not kept on {'; '.join(wrong)}. " if wrong else "") + (f"Fewest bytes: {number(min(data))} times. " if min(data) <= 1 else "")
    finding = (
        f"Counted on {len(pairs)} splittings: {span(data)} times the bytes an iteration, {span(counts)} times the iterations; {len(steps)} steps compared."
    )
    return judge(statement, "paper-interface", rule, finding, not wrong and min(data) > 1, why)


def subdomains_of_fig_2(spheres):
    statement = "Subdomain indices and multiplicity numbers of the 55,000 spheres under isotropic compaction (Fig. 2)."
    finding = ""
    if spheres:
        numbers = ", ".join(f"{count(grains)} of multiplicity {m}" for m, grains in spheres["multiplicity"].items())
        finding = f"Counted on {spheres['subdomains']} subdomains: {numbers}."
    lacks = "the paper's numbers of spheres: they are in its picture alone, of which this page has the text"
    return untold(statement, "paper-fig-2", "Would agree if as many spheres had each multiplicity.", lacks, finding)


def shares_by_subdomains(paper):
    statement = "From 3 to 4 to 8 subdomains the share in MPI of CCS grows; that of DCS is least on 4 and most on 8 (Table 1)."
    rule = "Agrees if our shares with present cores, of each scheme on 3, 4 and 8 subdomains, have the order of the paper's."
    numbers = [n for n in TABLE_1 if n > 1]
    shares = {scheme: [paper.share(scheme, n, 1) for n in numbers] for scheme in ("ccs", "dcs")}
    if any(share is None for own in shares.values() for share in own):
        return untold(statement, "paper-table-1", rule, "simulated iterations of the isotropic compaction by both schemes on 3, 4 and 8 subdomains")

    def order(values):
        return [numbers[k] for k in sorted(range(len(numbers)), key=values.__getitem__)]

    theirs = {scheme: order([TABLE_1[n][column] for n in numbers]) for column, scheme in ((1, "ccs"), (2, "dcs"))}
    wrong = [scheme for scheme in shares if order(shares[scheme]) != theirs[scheme]]
    told = "; ".join(f"{scheme.upper()} {', '.join(percent(share) for share in own)}" for scheme, own in shares.items())
    why = "; ".join(
        f"{scheme.upper()}: from least to most on {', '.join(map(str, order(shares[scheme])))}, the paper's on {', '.join(map(str, theirs[scheme]))}"
        for scheme in wrong
    )
    return judge(statement, "paper-table-1", rule, f"SIMULATED, on 3, 4, 8: {told}.", not wrong, f"{why}.")


def no_collectives(paper):
    statement = "DCS avoids collective communications (section 4.3)."
    rule = (
        "Agrees if an iteration by DCS sends no message of a collective operation (gather, scatter, reduction, all-gather), on each number of "
        "subdomains of Table 1."
    )
    counts = {}
    for n in TABLE_1:
        for scheme in ("ccs", "dcs"):
            operations = paper.operations(scheme, n) if n > 1 else None
            if operations:
                counts.setdefault(scheme, {})[n] = {name: one["messages"] for name, one in operations.items()}
    if "dcs" not in counts:
        return untold(statement, "paper-table-1", rule, "counts of messages by operation (scripts/suite run paper --only table1): not run")

    def collective(sent):
        return sum(sent[name] for name in COLLECTIVE)

    def told(scheme):
        return "; ".join(f"{number(collective(sent))} of {number(sum(sent.values()))} on {n}" for n, sent in counts[scheme].items())

    finding = "Counted, collective messages an iteration: " + ", ".join(f"{scheme.upper()} {told(scheme)}" for scheme in ("dcs", "ccs") if scheme in counts)
    kinds = [name for name in COLLECTIVE if any(sent[name] for sent in counts["dcs"].values())]
    why = f"Those of DCS are of: {', '.join(kinds)}. Copies of grains are glued from rank to rank."
    if kinds == ["reduction"]:
        why += " Reductions sum the speeds of walls under pressure and, where convergence is tested, energies."
    if any(sent[name] for sent in counts.get("ccs", {}).values() for name in ("gather", "scatter")):
        why += " CCS gathers and scatters besides."
    return judge(statement, "paper-operations", rule, f"{finding}.", not kinds, why)


def interface_in_parallel(paper):
    statement = "DCS treats the interface partially in parallel (section 4.3)."
    rule = (
        "Agrees if ranks wait for others, which by CCS they do while one rank glues, for less time in an iteration by DCS than by CCS, on each "
        "number of subdomains of Table 1, with present cores."
    )
    waits = {}
    for n in TABLE_1:
        pair = [(paper.share(scheme, n, 1, "wait_share"), paper.iteration(scheme, n, 1)) for scheme in ("ccs", "dcs")] if n > 1 else []
        if pair and all(None not in one for one in pair):
            waits[n] = [1e6 * share * seconds for share, seconds in pair]
    if not waits:
        return untold(statement, "paper-table-1", rule, "simulated iterations of the isotropic compaction by both schemes")
    wrong = [str(n) for n, (ccs, dcs) in waits.items() if not dcs < ccs]
    told = ", ".join(f"{number(ccs)} and {number(dcs)} \u00b5s on {n}" for n, (ccs, dcs) in waits.items())
    return judge(statement, "paper-table-1", rule, f"SIMULATED: waiting by CCS and DCS {told} subdomains.", not wrong, f"Not so on {', '.join(wrong)}.")


def hardest(paper):
    statement = "The triaxial test of a random close packing is the hardest mechanical configuration (section 5)."
    rule = "Agrees if sequential NLGS by the paper's method makes more iterations a step of it than of the isotropic and the biaxial test."
    each = {scene: mean(run["iterations"]) for scene in SCENES if (run := paper.nlgs(scene))}
    if "triaxial" not in each or len(each) < 2:
        return untold(statement, "paper-runs", rule, "sequential runs of the triaxial test and of another one")
    harder = [scene for scene in each if scene != "triaxial" and each[scene] >= each["triaxial"]]
    finding = f"Counted, iterations a step: {', '.join(f'{scene} {count(value)}' for scene, value in each.items())}."
    why = (
        f"More in the {' and the '.join(harder)} test. The triaxial test starts under way here, with impulses of the step before; the "
        "isotropic one starts from loose grains and is dynamic, until its walls stop. The paper gives no numbers of its own to compare."
    )
    return judge(statement, "paper-runs", rule, finding, not harder, why)


def iterations_of_fig_4(paper):
    statement = "Mean number of iterations of the triaxial test against the number of subdomains (Fig. 4b)."
    runs = sorted(paper.runs("triaxial", scheme="dcs", of="grid"), key=lambda run: run["subdomains"])
    nlgs = paper.nlgs("triaxial")
    finding = ""
    if nlgs and runs:
        low, high = min(mean(run["iterations"]) for run in runs), max(mean(run["iterations"]) for run in runs)
        finding = (
            f"Counted: {count(mean(nlgs['iterations']))} by NLGS, {count(low)} to {count(high)} by DCS on {runs[0]['subdomains']} to "
            f"{runs[-1]['subdomains']} subdomains."
        )
    lacks = "the paper's numbers: they are in its figure alone, and its text says nothing of them"
    return untold(statement, "paper-fig-4", "Would agree if our mean numbers were within 25 % of the paper's.", lacks, finding)


def network_may_be_better(paper):
    statement = "In 3D the speed-up could be better with other hardware and a better MPI library (section 5)."
    rule = "Agrees if half the latency or twice the bandwidth takes more than 5 % off an iteration by DCS on 48 processes of the simulated node."
    place = ("triaxial", "paper", "dcs", "grid 4x4x3", 48, "node48", 1)
    now = paper.window(place, "seconds_per_iteration")
    better = {
        name: seconds
        for name, band in (("half the latency", (0.5, 1, 0)), ("twice the bandwidth", (1, 2, 0)))
        if (seconds := paper.window(place, "seconds_per_iteration", band))
    }
    if not now or not better:
        return untold(statement, "paper-fig-4", rule, "simulated iterations of the triaxial test on a better network")
    told = ", ".join(f"{percent(1 - seconds / now)} by {name}" for name, seconds in better.items())
    why = (
        f"Our iteration on 48 is in MPI for {percent(paper.window(place, 'mpi_share'))} only. That cores share the bandwidth of their memory is "
        "not simulated; the paper's loss may be of that."
    )
    return judge(statement, "paper-fig-4", rule, f"SIMULATED: off an iteration {told}.", min(better.values()) < 0.95 * now, why)


def verdicts(paper, network_counts, sphere_counts=None):
    """All statements in the order of the paper; network_counts: of network.counts(), sphere_counts: of packings.sphere_counts(), or None."""
    return [
        unknowns(paper),
        minimal_interface(network_counts),
        predicted_grains(paper),
        dcs_below_ccs(paper),
        order_of_magnitude(paper, 1),
        order_of_magnitude(paper, 3),
        shares_by_subdomains(paper),
        no_collectives(paper),
        scatter_is_expensive(paper),
        interface_in_parallel(paper),
        subdomains_of_fig_2(sphere_counts),
        scheme_keeps_speed_up_2d(paper),
        scheme_keeps_iterations(paper),
        splitting_keeps_iterations(paper),
        ccs_poor_3d(paper),
        hardest(paper),
        speed_up_3d(paper),
        iterations_of_fig_4(paper),
        network_may_be_better(paper),
        hundred_processors(paper),
    ]
