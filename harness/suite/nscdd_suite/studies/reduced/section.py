"""The paper's tables and figures at reduced size, and the agreement of all runs with the reference."""
from html import escape
from pathlib import Path

from ...page import packings
from ...page.page import figure_block, origin, quick, table_block
from ...page.style import SCHEMES, save
from ...page.tables import count, exceeds, row_ok
from ...times import CORES, TRIES
from . import curves, network, tables
from .runs import Runs, key, order


def left_out(runs, scene):
    """Says which numbers of subdomains have no measured time, and why."""
    numbers, disturbed, text = runs.unmeasured(scene), runs.busy(scene), ""
    if numbers:
        cores = max(run["machine"]["cores"] for run in runs)
        text = (
            f" Left out: {', '.join(map(str, numbers))} subdomains, being more ranks than the {cores} cores of this machine; "
            "times of ranks that take turns on a core measure no speed."
        )
    if disturbed:
        text += (
            f" Left out: {', '.join(map(str, disturbed))} subdomain{'s' * (disturbed != [1])}, measured while the machine was busy: "
            f"a process had less than {100 * CORES:.0f} % of its core, {TRIES} times."
        )
    return text


def interval(runs):
    listed = " or ".join(str(k) for k in sorted({run["check_every"] for run in runs}))
    return " Convergence was checked " + ("at every iteration." if listed == "1" else f"every {listed} iterations.")


def communication(runs, summary, scene="isotropic"):
    """Table 1 of the paper, measured; and what each iteration exchanges."""
    html, values, used = tables.mpi_share(runs, scene)
    parts = []
    if used:
        grains, steps = used[0]["grains"], used[0]["steps"]
        caption = (
            f"Share of time spent in MPI, CCS against DCS, isotropic compaction of {count(grains)} "
            f"spheres, {steps} steps, and of it waiting for other ranks and transferring. Means over ranks, in "
            "per cent of the time of the run. Only MPI runs with a core for each rank." + left_out(runs, scene)
        )
        parts.append(table_block(html, "Share of time in MPI, after Table 1 of the paper", caption, origin(used), ("measured",)))
    html, counts, used = tables.counted(runs, scene)
    if used:
        caption = (
            "What each iteration exchanges, for the same scene: messages and bytes sent, summed over ranks; "
            "grains in more than one subdomain; the largest share of contact updates done by one rank, beside "
            "an even share." + interval(used)
        )
        parts.append(table_block(html, "What an iteration exchanges", caption, origin(used), ("counted",), wide=True))
    summary |= {"mpi_share": values, "counted": counts}
    return parts


def pictures(runs, out):
    parts = []
    found = [run for run in runs.select("network", dimension=2) if run["subdomains"] > 1 and run.state]
    if found:
        run = found[-1]
        figure, with_grid = network.draw_network(run, packings.read_state(run.state))
        caption = (
            f"Partition and multiplicity of a network of {count(run['grains'])} disks, "
            f"{run['subdomains']} subdomains. Each contact, drawn between the centres (or from the wall), has "
            "the colour of the subdomain in which its midpoint lies; each grain that of its multiplicity "
            "number, the number of subdomains that it has contacts in" + ("; dashed, the grid." if with_grid else ".")
        )
        heading = "Partition and multiplicity of a 2D network, after Fig. 1 of the paper"
        parts.append(figure_block(save(figure, out, "network"), heading, caption, origin([run]), ("counted",)))

    found = [run for run in runs.select("isotropic", dimension=3, subdomains=8) if run.state]
    if found:
        run = found[-1]
        figure = packings.draw_spheres(packings.read_state(run.state))
        caption = (
            f"Compacted sample of {count(run['grains'])} spheres, {run['subdomains']} subdomains "
            f"({run['partition']}): (a) subdomain index, (b) multiplicity number, with the number of grains in "
            "parentheses. The vertical quarter towards the reader is taken out."
        )
        heading = "Subdomains and multiplicity of spheres, after Fig. 2 of the paper"
        parts.append(figure_block(save(figure, out, "spheres", "png"), heading, caption, origin([run]), ("counted",)))
    return parts


def scaling(runs, out, summary):
    parts, numbers = [], {}
    for label, scene, mean, what in (
        ("Fig. 3", "biaxial", False, "Biaxial compression of disks"),
        ("Fig. 4", "triaxial", True, "Triaxial compression of spheres"),
    ):
        figure, speed, iterations, timed, counted = curves.draw_speed_up_and_iterations(runs, scene, mean)
        if figure is None:
            continue
        some = (counted or timed)[0]
        caption = (
            f"{what}, {count(some['grains'])} grains, {some['steps']} steps. (a) Speed-up of NSCDD over "
            "MPI, against the sequential NLGS of the same program: wall-clock time of the whole run, the "
            "slowest rank. (b) Iterations, " + ("mean over the steps." if mean else "summed over the steps.")
        )
        caption += interval(counted) if counted else ""
        both = [iterations[s] for s in SCHEMES if s in iterations]
        if len(both) == 2:
            differ = [n for n in both[0].keys() & both[1].keys() if both[0][n] != both[1][n]]
            caption += (
                f" The counts of CCS and DCS differ at {', '.join(map(str, sorted(differ)))} subdomains."
                if differ
                else " CCS and DCS make the same number of iterations."
            )
        caption += left_out(runs, scene)
        source = (origin(timed, "(a) Measured") if timed else "") + (origin(counted, "(b) Counted") if counted else "")
        heading = f"{what}: speed-up and iterations, after {label} of the paper"
        parts.append(figure_block(save(figure, out, f"{scene}-reduced"), heading, caption, source, ("measured",) * bool(timed) + ("counted",) * bool(counted)))
        numbers[scene] = {"speed_up": speed, "iterations": iterations}

    figure, used = curves.draw_histories(runs, ("isotropic", "biaxial", "triaxial"))
    if figure:
        caption = "A line for each number of subdomains. The paper has no such figure." + interval(used)
        parts.append(figure_block(save(figure, out, "histories"), "Iterations of each step", caption, origin(used), ("counted",)))
    summary["scaling"] = numbers
    return parts


def agreement(runs, compares):
    parts = []
    if compares:
        caption = (
            "Difference of each run from the sequential reference, with the bound that it must keep; values "
            "beyond their bound are in red. A run has two rows: one step, both from the last state of the reference, where both "
            "solve the same problem; and the whole run, whose bounds are wider, because small differences grow from step to step. "
            "Residuals are evaluated on the unsplit problem, whatever the partition."
        )
        command = next((c["command"] for c in compares if c.get("command")), None)
        source = origin([run for run in runs if run.key in set(map(key, compares))] or runs)
        if command:
            source += f'<div class="from">Compared by commands such as <code>{escape(command)}</code>.</div>'
        parts.append(table_block(tables.agreement(compares), "Agreement with the reference", caption, source, wide=True))
    caption = "All runs: largest energy residual \u03b7 of any step with its tolerance, and counts. Seconds are given only where they are measured."
    parts.append(table_block(tables.all_runs(runs), "All runs", caption, origin(runs, "Counted; seconds measured"), ("counted", "measured"), wide=True))
    return parts


def judge(results, runs, compares):
    """What fails the page, what holds, and what was not compared."""
    results.summary |= {"compared_rows": sum(len(one["rows"]) for one in compares), "largest_residual": {run.name: run.eta_max for run in runs}}
    results.failures += [problem for run in runs for problem in run.problems()]
    for one in compares:
        bad = [row for row in one["rows"] if not row_ok(row)]
        results.failures += [f"{Path(one['candidate']).stem}: {exceeds(row)}" for row in bad]
        if not one["ok"] and not bad:
            results.failures.append(f"{Path(one['candidate']).stem}: said to disagree with {one['reference']}")
    checked = set(map(key, compares))
    unchecked = [run.name for run in runs if run["scheme"] != "nlgs" and run.key not in checked]
    results.summary["unchecked"] = unchecked
    if runs and not compares:
        results.open.append((f"All {len(runs)} runs converged; agreement was not checked:", "no comparison with a reference is in these results."))
    elif runs:
        rows = results.summary["compared_rows"]
        results.good.append(f"All {len(runs)} runs converged and all {rows} comparisons with the reference are within their bounds.")
    if compares and unchecked:
        results.open.append((f"{len(unchecked)} not compared with a reference:", f"{', '.join(unchecked)}."))


def section(results, out):
    """Of all runs that are there, whatever their scenes."""
    runs, compares = Runs(results), sorted(results.records("compare"), key=order)
    judge(results, runs, compares)
    if not runs:
        return []
    parts = [line for record in results.records("reduced") for line in quick(record)]
    for heading, some in (
        ("Communication", communication(runs, results.summary)),
        ("Partition and multiplicity", pictures(runs, out)),
        ("Speed-up and iterations", scaling(runs, out, results.summary)),
        ("Agreement", agreement(runs, compares)),
    ):
        parts += [f"<h3>{heading}</h3>", *some] if some else []
    return parts
