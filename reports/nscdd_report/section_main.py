"""Sections of the main job: the paper's tables and figures at reduced size, and the agreement of all runs with the reference."""
from html import escape

from . import curves, packings, tables
from .times import CORES, TRIES
from .page import figure_block, missing, origin, table_block
from .style import SCHEMES, save


def left_out(results, role):
    """Says which numbers of subdomains have no measured time, and why."""
    numbers, disturbed, text = results.unmeasured(role), results.busy(role), ""
    if numbers:
        cores = max(run["machine"]["cores"] for run in results.runs)
        text = (f" Left out: {', '.join(map(str, numbers))} subdomains, being more ranks than the {cores} cores of this machine; "
                "times of ranks that take turns on a core measure no speed.")
    if disturbed:
        text += (f" Left out: {', '.join(map(str, disturbed))} subdomain{'s' * (disturbed != [1])}, measured while the machine was busy: "
                 f"a process had less than {100 * CORES:.0f} % of its core, {TRIES} times.")
    return text


def interval(runs):
    listed = " or ".join(str(k) for k in sorted({run["check_every"] for run in runs}))
    return " Convergence was checked " + ("at every iteration." if listed == "1" else f"every {listed} iterations.")


def communication(results, out, role="isotropic"):
    """Table 1 of the paper, measured; and what each iteration exchanges."""
    html, values, used = tables.mpi_share(results, role)
    parts = []
    if used:
        grains, steps = used[0]["grains"], used[0]["steps"]
        caption = (f"Share of time spent in MPI, CCS against DCS, isotropic compaction of {tables.count(grains)} "
                   f"spheres, {steps} steps, and of it waiting for other ranks and transferring. Means over ranks, in "
                   "per cent of the time of the run. Only MPI runs with a core for each rank."
                   + left_out(results, role))
        parts.append(table_block(html, "Share of time in MPI, after Table 1 of the paper", caption, origin(used), ("measured",)))
    else:
        parts.append(missing("measured MPI runs of the isotropic compaction"))
    html, counts, used = tables.counted(results, role)
    if used:
        caption = ("What each iteration exchanges, for the same scene: messages and bytes sent, summed over ranks; "
                   "grains in more than one subdomain; the largest share of contact updates done by one rank, beside "
                   "an even share." + interval(used))
        parts.append(table_block(html, "What an iteration exchanges", caption, origin(used), ("counted",), wide=True))
    else:
        parts.append(missing("in-process runs of the isotropic compaction"))
    results.summary |= {"mpi_share": values, "counted": counts}
    return parts


def pictures(results, out):
    parts = []
    runs = [r for r in results.select(role="network", dimension=2) if r["subdomains"] > 1 and r.state]
    if runs:
        run = runs[-1]
        figure, with_grid = packings.draw_network(run, packings.read_state(run.state))
        caption = (f"Partition and multiplicity of a network of {tables.count(run['grains'])} disks, "
                   f"{run['subdomains']} subdomains. Each contact, drawn between the centres (or from the wall), has "
                   "the colour of the subdomain in which its midpoint lies; each grain that of its multiplicity "
                   "number, the number of subdomains that it has contacts in"
                   + ("; dashed, the grid." if with_grid else "."))
        parts.append(figure_block(save(figure, out, "network"), "Partition and multiplicity of a 2D network, after Fig. 1 of the paper", caption,
                                  origin([run]), ("counted",)))
    else:
        parts.append(missing("a state file of the 2D scene 'network' with several subdomains"))

    runs = [r for r in results.select(role="isotropic", dimension=3, subdomains=8) if r.state]
    if runs:
        run = runs[-1]
        figure = packings.draw_spheres(packings.read_state(run.state))
        caption = (f"Compacted sample of {tables.count(run['grains'])} spheres, {run['subdomains']} subdomains "
                   f"({run['partition']}): (a) subdomain index, (b) multiplicity number, with the number of grains in "
                   "parentheses. The vertical quarter towards the reader is taken out.")
        parts.append(figure_block(save(figure, out, "spheres", "png"), "Subdomains and multiplicity of spheres, after Fig. 2 of the paper", caption,
                                  origin([run]), ("counted",)))
    else:
        parts.append(missing("a state file of the isotropic compaction with 8 subdomains"))
    return parts


def scaling(results, out):
    parts, summary = [], {}
    for label, role, mean, what in (("Fig. 3", "biaxial", False, "Biaxial compression of disks"),
                                    ("Fig. 4", "triaxial", True, "Triaxial compression of spheres")):
        figure, speed, iterations, timed, counted = curves.draw_speed_up_and_iterations(results, role, mean)
        if figure is None:
            parts.append(missing(f"runs of the {role} scene"))
            continue
        some = (counted or timed)[0]
        caption = (f"{what}, {tables.count(some['grains'])} grains, {some['steps']} steps. (a) Speed-up of NSCDD over "
                   "MPI, against the sequential NLGS of the same program: wall-clock time of the whole run, the "
                   "slowest rank. (b) Iterations, " + ("mean over the steps." if mean else "summed over the steps."))
        caption += interval(counted) if counted else ""
        both = [iterations[s] for s in SCHEMES if s in iterations]
        if len(both) == 2:
            differ = [n for n in both[0].keys() & both[1].keys() if both[0][n] != both[1][n]]
            caption += (f" The counts of CCS and DCS differ at {', '.join(map(str, sorted(differ)))} subdomains."
                        if differ else " CCS and DCS make the same number of iterations.")
        caption += left_out(results, role)
        source = (origin(timed, "(a) Measured") if timed else "") + (origin(counted, "(b) Counted") if counted else "")
        parts.append(figure_block(save(figure, out, f"{role}-reduced"), f"{what}: speed-up and iterations, after {label} of the paper", caption,
                                  source, ("measured",) * bool(timed) + ("counted",) * bool(counted)))
        if not timed:
            parts.append(missing(f"a measured MPI run of the {role} scene and its sequential reference"))
        summary[role] = {"speed_up": speed, "iterations": iterations}

    figure, used = curves.draw_histories(results, ("isotropic", "biaxial", "triaxial"))
    if figure:
        parts.append(figure_block(save(figure, out, "histories"), "Iterations of each step",
                                  "A line for each number of subdomains. The paper has no such figure." + interval(used),
                                  origin(used), ("counted",)))
    else:
        parts.append(missing("runs of more than one step of the three scenes"))
    results.summary["scaling"] = summary
    return parts


def agreement(results, out):
    parts = []
    if results.compares:
        caption = ("Difference of each run from the sequential reference, with the bound that it must keep; values "
                   "beyond their bound are in red. A run has two rows: one step, both from the last state of the reference, where both "
                   "solve the same problem; and the whole run, whose bounds are wider, because small differences grow from step to step. "
                   "Residuals are evaluated on the unsplit problem, whatever the partition.")
        command = next((c["command"] for c in results.compares if c.get("command")), None)
        used = [r for r in results.runs if r.key in {tuple(c[k] for k in ("scene", "scheme", "subdomains", "transport"))
                                                     for c in results.compares}]
        source = origin(used or results.runs)
        if command:
            source += f'<div class="from">Compared by commands such as <code>{escape(command)}</code>.</div>'
        parts.append(table_block(tables.agreement(results.compares), "Agreement with the reference", caption, source, wide=True))
    else:
        parts.append(missing("comparisons with the reference (nscdd compare)"))
    if not results.runs:
        return [*parts, missing("runs of the main job")]
    caption = ("All runs: largest energy residual \u03b7 of any step with its tolerance, and counts. Seconds are given "
               "only where they are measured.")
    parts.append(table_block(tables.all_runs(results.runs), "All runs", caption, origin(results.runs, "Counted; seconds measured"),
                             ("counted", "measured"), wide=True))
    return parts
