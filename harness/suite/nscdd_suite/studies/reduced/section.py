"""The paper's tables and figures at reduced size, and the agreement of all runs with the reference."""
from html import escape
from pathlib import Path

from ...page import packings
from ...page.page import Block, captions, figure_block, origin, warnings
from ...page.style import SCHEMES, save
from ...page.tables import bounded, by_number, count, exceeds, number, percent, row_ok, table
from ...times import CORES, TRIES
from ..paper.data import TABLE_1
from . import figures
from .runs import Runs, key, order

CAPTIONS = captions(__file__)


def left_out(runs, scene):
    """Says which numbers of subdomains have no measured time, and why."""
    few, busy = runs.unmeasured(scene)
    cores, named = max(run["machine"]["cores"] for run in runs), [", ".join(map(str, numbers)) for numbers in (few, busy)]
    text = " " + CAPTIONS["few"].format(numbers=named[0], cores=cores) if few else ""
    more = {"numbers": named[1], "s": "s" * (busy != [1]), "share": 100 * CORES, "tries": TRIES}
    return text + (" " + CAPTIONS["busy"].format(**more) if busy else "")


def interval(runs):
    names = {0: "where changes of iterations foretell it", 1: "at every iteration"}
    return f" Convergence was checked {' or '.join(names.get(k, f'every {k} iterations') for k in sorted({run['check_every'] for run in runs}))}."


def flat(by_scheme):
    return [run for by_number in by_scheme.values() for run in by_number.values()]


def mpi_share(timed):
    """Table 1 of the paper, and its values for the summary."""
    rows, values = [], []
    for n in sorted({*TABLE_1, *(run["subdomains"] for run in flat(timed))}):
        row, value = [str(n)], {"subdomains": n}
        for scheme, by_number in timed.items():
            if not (run := by_number.get(n)):
                row += [None] * 3
                continue
            seconds, total = run["seconds"], max(run["seconds"]["total"], 1e-300)
            shares = run["mpi_fraction"], seconds["mpi_wait"] / total, seconds["mpi_transfer"] / total
            row += [(percent(shares[0]), "strong"), *map(percent, shares[1:])]
            value[scheme] = dict(zip(("mpi", "wait", "transfer"), shares))
        paper = [f"{share:.1f}" if n > 1 else "0" for share in TABLE_1[n][1:]] if n in TABLE_1 else [None, None]
        rows.append([*row, *((share, "faint") for share in paper)])
        values += [value] * (len(value) > 1)
    above = " | CCS, measured here *3 | DCS, measured here *3 | paper<br>(55\u2009000 spheres, 48-core machine) *2"
    head = [above, "subdomains" + 2 * " | in MPI % | waiting % | transferring %" + " | CCS % | DCS %"]
    return table(head, rows, "Share of time in MPI"), values


def exchanged(found):
    """What the decomposition costs, counted."""
    first, rows = found["dcs"].get(1) or found["ccs"].get(1), []
    for n in sorted({run["subdomains"] for run in flat(found)}):
        both = [found[scheme].get(n) for scheme in SCHEMES]
        run = both[1] or both[0]
        work = run["work_per_rank"]
        share = max(work) / max(1, sum(work))
        ratio = f"{run.total_iterations / first.total_iterations:.2f}" if first and first.total_iterations else None
        row = [str(n), escape(run["partition"]), count(run["interface_grains"]), percent(run["interface_share"]), f"{percent(share)} <i>({percent(1 / n)})</i>"]
        per_iteration = [one and count(one[name]) for name in ("messages_per_iteration", "bytes_per_iteration") for one in both]
        rows.append([*row, count(run.mean_iterations), ratio, *per_iteration])
    above = " |  | interface grains *2 | largest share | iterations per step *2 | messages per iteration *2 | bytes per iteration *2"
    head = [above, "subdomains | partition | mean | % of all | of work % <i>(even)</i> | mean | to 1 subd. | CCS | DCS | CCS | DCS"]
    return table(head, rows, "Messages and bytes per iteration")


def compared_steps(compare):
    """In words: one step from the reference's state, or the whole run, which differs more, as answers are not unique."""
    steps, last = compare.get("steps"), compare.get("last_step")
    if steps is None or last is None:
        return None
    return "one step, from the reference's last state" if steps == 1 < last else f"whole run, {count(steps)} step{'s' * (steps > 1)}"


def agreement_table(compares):
    """Two rows per run: one step from the reference's state, and the whole run."""
    named = sorted(((Path(one["candidate"]).stem, one) for one in compares), key=lambda pair: by_number(pair[0]))
    entries = [([escape(name), (compared_steps(one), "text"), str(one["subdomains"]), escape(one["transport"])], one["rows"], one["ok"]) for name, one in named]
    return bounded(("run", "compared", "subdomains", "transport"), entries, "Agreement with the reference")


def run_table(runs):
    """Every run with its residual; seconds only where they were measured."""
    rows = []
    for run in runs:
        bad, eta = run.problem, f"{number(run.eta_max)} <i>\u2264\u202f{number(run['tolerance'])}</i>"
        cells = [escape(run.name), str(run["subdomains"]), *(escape(run[key]) for key in ("transport", "partition", "interface"))]
        cells += [max(run["contacts"], default=0), str(run["steps"]), run.total_iterations, str(run["check_every"]), (eta, "bad" if bad else "")]
        seconds = f"{run['seconds']['total']:.2f}" if run.measured else "machine busy" if run.busy else None
        rows.append([*cells, seconds, ("no", "bad") if bad else ("yes", "good")])
    head = "run | subd. | transport | partition | interface | contacts,<br>most | steps | iterations | checked<br>every | largest \u03b7 | seconds | converged"
    return table([head], rows, "All runs")


def communication(runs, summary, scene="isotropic"):
    """Table 1 of the paper, measured; and what each iteration exchanges."""
    timed, counted = ({scheme: of(scene, scheme) for scheme in SCHEMES} for of in (runs.timed, runs.counted))
    html, summary["mpi_share"] = mpi_share(timed)
    if used := flat(timed):
        caption, heading = CAPTIONS["mpi"].format(grains=count(used[0]["grains"]), steps=used[0]["steps"]), "Share of time in MPI, after Table 1 of the paper"
        yield Block(html, heading, caption + left_out(runs, scene), origin(used), ("measured",))
    if used := flat(counted):
        caption = CAPTIONS["exchanged"] + interval(used)
        yield Block(exchanged(counted), "What an iteration exchanges", caption, origin(used), ("counted",), wide=True)


def pictures(runs, out):
    found = [run for run in runs.select("network", dimension=2) if run["subdomains"] > 1 and run.state]
    for run in found[-1:]:
        state = packings.read_state(run.state)
        caption = CAPTIONS["network"].format(**run | {"grains": count(run["grains"])}) + ("; dashed, the grid." if state["grid"] else ".")
        heading, file = "Partition and multiplicity of a 2D network, after Fig. 1 of the paper", save(figures.draw_network(state), out, "network")
        yield figure_block(file, heading, caption, origin([run]), ("counted",))
    found = [run for run in runs.select("isotropic", dimension=3, subdomains=8) if run.state]
    for run in found[-1:]:
        caption = CAPTIONS["spheres"].format(**run | {"grains": count(run["grains"])})
        heading = "Subdomains and multiplicity of spheres, after Fig. 2 of the paper"
        file = save(packings.draw_spheres(packings.read_state(run.state)), out, "spheres", "png")
        yield figure_block(file, heading, caption, origin([run]), ("counted",))


def scaling(runs, out):
    for label, scene, mean, what in (
        ("Fig. 3", "biaxial", False, "Biaxial compression of disks"),
        ("Fig. 4", "triaxial", True, "Triaxial compression of spheres"),
    ):
        (speed, timed), found = runs.speed_ups(scene), {scheme: by_number for scheme in SCHEMES if (by_number := runs.counted(scene, scheme))}
        counted = flat(found)
        if not timed and not counted:
            continue
        of = (lambda run: run.mean_iterations) if mean else (lambda run: run.total_iterations)
        iterations = {scheme: {n: of(run) for n, run in by_number.items()} for scheme, by_number in found.items()}
        some = (counted or timed)[0]
        how = "mean over" if mean else "summed over"
        caption = CAPTIONS["scaling"].format(what=what, grains=count(some["grains"]), steps=some["steps"], how=how)
        caption += interval(counted) if counted else ""
        if len(iterations) == 2:
            differ = sorted(n for n, value in iterations["dcs"].items() if iterations["ccs"].get(n, value) != value)
            same = " CCS and DCS make the same number of iterations."
            caption += f" The counts of CCS and DCS differ at {', '.join(map(str, differ))} subdomains." if differ else same
        caption += left_out(runs, scene)
        source = (origin(timed, "(a) Measured") if timed else "") + (origin(counted, "(b) Counted") if counted else "")
        reference = runs.reference(some)
        figure = figures.draw_speed_up_and_iterations(speed, iterations, reference and of(reference), mean)
        heading, kinds = f"{what}: speed-up and iterations, after {label} of the paper", ("measured",) * bool(timed) + ("counted",) * bool(counted)
        yield figure_block(save(figure, out, f"{scene}-reduced"), heading, caption, source, kinds)

    panels = {}
    for scene in ("isotropic", "biaxial", "triaxial"):
        found = runs.counted(scene, "dcs") or runs.counted(scene, "ccs") or runs.counted(scene, "nlgs")
        if max((run["steps"] for run in found.values()), default=0) > 1:
            panels[scene] = found
    if panels:
        used, file = flat(panels), save(figures.draw_histories(panels), out, "histories")
        caption = CAPTIONS["histories"] + interval(used)
        yield figure_block(file, "Iterations of each step", caption, origin(used), ("counted",))


def agreement(runs, compares):
    if compares:
        source = origin([run for run in runs if key(run) in set(map(key, compares))] or runs)
        if command := next((one["command"] for one in compares if one.get("command")), None):
            source += f'<div class="from">Compared by commands such as <code>{escape(command)}</code>.</div>'
        yield Block(agreement_table(compares), "Agreement with the reference", CAPTIONS["agreement"], source, wide=True)
    yield Block(run_table(runs), "All runs", CAPTIONS["all_runs"], origin(runs, "Counted; seconds measured"), ("counted", "measured"), wide=True)


def judge(results, runs, compares):
    results.failures += [run.problem for run in runs if run.problem]
    for one in compares:
        bad, name = [row for row in one["rows"] if not row_ok(row)], Path(one["candidate"]).stem
        results.failures += [f"{name}: {exceeds(row)}" for row in bad]
        if not one["ok"] and not bad:
            results.failures.append(f"{name}: said to disagree with {one['reference']}")
    checked = set(map(key, compares))
    unchecked = [run.name for run in runs if run["scheme"] != "nlgs" and key(run) not in checked]
    converged = f"All {len(runs)} runs converged" if len(runs) > 1 else "The run converged"
    if runs and not compares:
        results.open.append((f"{converged}; agreement was not checked:", "no comparison with a reference is in these results."))
    elif runs:
        rows = sum(len(one["rows"]) for one in compares)
        results.good.append(f"{converged} and all {rows} comparisons with the reference are within their bounds.")
    if compares and unchecked:
        results.open.append((f"{len(unchecked)} not compared with a reference:", f"{', '.join(unchecked)}."))


def section(results, out):
    """Of all runs that are there, whatever their scenes."""
    runs, compares = Runs(results), sorted(results.records("compare"), key=order)
    judge(results, runs, compares)
    if not runs:
        return []
    parts = [line for record in results.records("reduced") for line in warnings(record)]
    for heading, some in (
        ("Communication", communication(runs, results.summary)),
        ("Partition and multiplicity", pictures(runs, out)),
        ("Speed-up and iterations", scaling(runs, out)),
        ("Agreement", agreement(runs, compares)),
    ):
        if some := list(some):
            parts += [f"<h3>{heading}</h3>", *some]
    return parts
