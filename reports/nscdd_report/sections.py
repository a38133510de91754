"""The sections of the page: what each figure and table shows, says, and lacks."""
import math
from html import escape

from . import accuracy, curves, hard, packings, tables, velocity
from .page import block, image, missing, origin
from .style import SCHEMES, save


def left_out(results, role):
    """Says which numbers of subdomains have no measured time, and why."""
    numbers = results.unmeasured(role)
    if not numbers:
        return ""
    cores = max(run["machine"]["cores"] for run in results.runs)
    listed = ", ".join(map(str, numbers))
    return (f" Left out: {listed} subdomains, being more ranks than the {cores} cores of this machine; "
            "times of ranks that take turns on a core measure no speed.")


def interval(runs):
    listed = " or ".join(str(k) for k in sorted({run["check_every"] for run in runs}))
    return " Convergence was checked " + ("at every iteration." if listed == "1" else f"every {listed} iterations.")


def communication(results, role="isotropic"):
    html, values, used = tables.mpi_share(results, role)
    parts = []
    if used:
        grains, steps = used[0]["grains"], used[0]["steps"]
        caption = (f"Share of time spent in MPI, CCS against DCS, isotropic compaction of {tables.count(grains)} "
                   f"spheres, {steps} steps, and of it waiting for other ranks and transferring. Means over ranks, in "
                   "per cent of the time of the run. Only MPI runs with a core for each rank."
                   + left_out(results, role))
        parts.append(block(html, "Table 1", caption, origin(used, "Measured")))
    else:
        parts.append(missing("Table 1, measured MPI runs of the isotropic compaction"))
    html, counts, used = tables.counted(results, role)
    if used:
        caption = ("What each iteration exchanges, for the same scene: messages and bytes sent, summed over ranks; "
                   "grains in more than one subdomain; the largest share of contact updates done by one rank, beside "
                   "an even share." + interval(used))
        parts.append(block(html, "Table 2", caption, origin(used, "Counted")))
    else:
        parts.append(missing("Table 2, in-process runs of the isotropic compaction"))
    return "\n".join(parts), {"mpi_share": values, "counted": counts}


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
        parts.append(block(image(save(figure, out, "fig1-network"), "svg", "Partition of a 2D network"), "Fig. 1",
                           caption, origin([run], "Counted")))
    else:
        parts.append(missing("Fig. 1, a state file of the 2D scene 'network' with several subdomains"))

    runs = [r for r in results.select(role="isotropic", dimension=3, subdomains=8) if r.state]
    if runs:
        run = runs[-1]
        figure = packings.draw_spheres(packings.read_state(run.state))
        caption = (f"Compacted sample of {tables.count(run['grains'])} spheres, {run['subdomains']} subdomains "
                   f"({run['partition']}): (a) subdomain index, (b) multiplicity number, with the number of grains in "
                   "parentheses. The vertical quarter towards the reader is taken out.")
        parts.append(block(image(save(figure, out, "fig2-spheres"), "png", "Subdomains and multiplicity of spheres"),
                           "Fig. 2", caption, origin([run], "Counted")))
    else:
        parts.append(missing("Fig. 2, a state file of the isotropic compaction with 8 subdomains"))
    return "\n".join(parts)


def scaling(results, out):
    parts, summary = [], {}
    for label, role, mean, what in (("Fig. 3", "biaxial", False, "Biaxial compression of disks"),
                                    ("Fig. 4", "triaxial", True, "Triaxial compression of spheres")):
        figure, speed, iterations, timed, counted = curves.draw_speed_up_and_iterations(results, role, mean)
        if figure is None:
            parts.append(missing(f"{label}, runs of the {role} scene"))
            continue
        name = f"fig{label[-1]}-{role}"
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
        drawing = image(save(figure, out, name), "svg", f"{what}: speed-up and iterations")
        parts.append(block(drawing, label, caption, source))
        if not timed:
            parts.append(missing(f"{label} (a), a measured MPI run of the {role} scene and its sequential reference"))
        summary[role] = {"speed_up": speed, "iterations": iterations}

    figure, used = curves.draw_histories(results, ("isotropic", "biaxial", "triaxial"))
    if figure:
        parts.append(block(image(save(figure, out, "fig5-histories"), "svg", "Iterations of each step"), "Fig. 5",
                           "Iterations of each step, a line for each number of subdomains (this figure is not in the "
                           "paper)." + interval(used), origin(used, "Counted")))
    else:
        parts.append(missing("Fig. 5, runs of more than one step of the three scenes"))
    return "\n".join(parts), summary


def agreement(results):
    parts = []
    if results.compares:
        caption = ("Difference of each run from the sequential reference, with the bound that it must keep; values "
                   "beyond their bound are in red. Residuals are evaluated on the unsplit problem, whatever the "
                   "partition.")
        command = next((c["command"] for c in results.compares if c.get("command")), None)
        used = [r for r in results.runs if r.key in {tuple(c[k] for k in ("scene", "scheme", "subdomains", "transport"))
                                                     for c in results.compares}]
        source = origin(used or results.runs, "Computed")
        if command:
            source += f'<div class="from">Compared by commands such as <code>{escape(command)}</code>.</div>'
        parts.append(block(tables.agreement(results.compares), "Table 3", caption, source, wide=True))
    else:
        parts.append(missing("Table 3, comparisons with the reference (nscdd compare)"))
    if not results.runs:
        return "\n".join([*parts, missing("Table 4, runs")])
    caption = ("All runs: largest energy residual \u03b7 of any step with its tolerance, and counts. Seconds are given "
               "only where they are measured.")
    parts.append(block(tables.all_runs(results.runs), "Table 4", caption,
                       origin(results.runs, "Counted; seconds measured"), wide=True))
    return "\n".join(parts)


def hard_cases(results, out):
    if not results.hard:
        return missing("Table 5 and Fig. 6, the hard cases (scripts/hard_cases)")
    rows = results.hard_rows
    schemes = list(dict.fromkeys((row["scheme"], row["subdomains"]) for row in rows))
    caption = (f"Hard cases, {len({row['case'] for row in rows})} scenes by {len(schemes)} schemes: the exact answer, what was "
               "found, how far it is from that, and the bound, which comes from theory: of the accuracy asked for "
               "(<i>tolerance</i>), of the step (<i>O(h)</i>), of the arithmetic (<i>round-off</i>), or an inequality (<i>law</i>; "
               "its error is by how much it fails). Iterations are those of all steps: sweeps, glued after each where there are "
               "several subdomains. An error beyond its bound is in red, and its family open.")
    source = "".join(origin([record], "Computed") for record in results.hard)
    parts = [block(hard.table(rows), "Table 5", caption, source, wide=True)]
    figure = hard.draw_columns(rows)
    if figure:
        caption = ("Iterations of a column of <i>N</i> from zero impulses: counted (marks), and the most that the spectral radius of "
                   "the iteration allows for the tolerance (lines), by number of subdomains.")
        parts.append(block(image(save(figure, out, "fig6-columns"), "svg", "Iterations of columns"), "Fig. 6", caption, source))
    figure = hard.draw_orders(rows)
    if figure:
        caption = ("Error of the places against the step size, 3D, with the observed order: sliding under constant friction, which "
                   "\u03b8 = 1/2 follows exactly (no line); an impact with e = 0.5; a ball sinking into others, against much smaller "
                   "steps.")
        parts.append(block(image(save(figure, out, "fig7-orders"), "svg", "Error against step size"), "Fig. 7", caption, source))
    return "\n".join(parts)


def speed_against_error(results, out):
    if not results.accuracy:
        return missing("Tables 6 to 8, Figs. 8 to 13, speed against error (scripts/accuracy)")
    parts = []
    for record in results.accuracy:
        source = origin([record], "Measured")
        if record["quick"]:
            parts.append("<p>From a quick job with small scenes, made to test the command: its times say nothing.</p>")
        parts += [f'<p class="missing">Left out: {escape(line)}.</p>' for line in record["left_out"]]
        if record["scenes"]:
            caption = ("Scenes of the work-precision curves, one loaded state of each, solved for one step from impulses zero; the "
                       "reference answer that distances are measured from, with its own residual; and that CCS makes the "
                       "iterates of DCS (8 subdomains, to 1e-3), which is why DCS alone is in the figures.")
            parts.append(block(accuracy.scene_table(record), "Table 6", caption, source, wide=True))
            for number, (cost, error, cost_label, error_label) in enumerate(accuracy.VIEWS, 8):
                caption = (f"{escape(cost_label)} against {escape(error_label)}, a curve for each solver, better to the right and "
                           "further down; a circle where it stalled, within "
                           f"{tables.count(record['budget']['sweeps'])} sweeps. In-process subdomains take turns on one core, so "
                           "their CPU time is the work of all. "
                           + ("Distances are |V - V_ref|_M / |V_free|_M; where one stays while \u03b7 goes on falling, the solver went to "
                              "another answer, as velocities need not be unique with friction." if error == "distance" else ""))
                figure = accuracy.draw_curves(record, cost, error, cost_label, error_label)
                name = f"fig{number}-{cost}-{error}"
                parts.append(block(image(save(figure, out, name), "svg", f"{cost_label} against {error_label}"), f"Fig. {number}",
                                   caption, source, wide=True))
            caption = ("How far the velocities of plain NLGS are from the reference answer when it stops at each tolerance on \u03b7, "
                       "in shares of |V_free|_M; a dash where it does not get there.")
            parts.append(block(accuracy.distance_table(record), "Table 7", caption, source))
        table = accuracy.siconos_table(record)
        if table:
            caption = ("CPU time of the solvers' calls at equal \u03b7, as our measure judges it for both, interpolated on the curves of "
                       "Fig. 8. Siconos solves the exported problem, with its stored <i>W</i>, by its own default stopping test.")
            parts.append(block(table, "Table 8", caption, source, wide=True))
        if record["profiles"]:
            for number, (cost, label) in enumerate((("cpu", "CPU time"), ("sweeps", "sweeps")), 12):
                caption = (f"Performance profiles [DolanMore02] in {label}: the share of problems that a solver solves with at most so "
                           "many times the cost of the best solver of that problem. Hard cases: their first step, by \u03b7; FCLIB "
                           "files: by the natural map as Siconos 4.4 normalises it. Problems that no solver solves are not counted."
                           + (" Newton has no sweeps." if cost == "sweeps" else ""))
                figure = accuracy.draw_profiles(record, cost, label)
                parts.append(block(image(save(figure, out, f"fig{number}-profile-{cost}"), "svg", f"Performance profiles, {label}"),
                                   f"Fig. {number}", caption, source, wide=True))
    return "\n".join(parts)


def acceleration(results):
    if not results.acceleration:
        return missing("Table 9, what acceleration saves (scripts/acceleration)")
    parts = []
    for record in results.acceleration:
        if record["quick"]:
            parts.append("<p>From a quick job with few grains, made to test the command: its numbers say nothing.</p>")
        caption = ("Iterations and CPU time of the solver to \u03b7 = 1e-4 by the paper's own method and accelerated. Warm: all steps "
                   "of a scene, each from the impulses of the one before; cold: one step from none. One subdomain is sequential NLGS; more "
                   "are NSCDD by DCS, in process, whose subdomains take turns on one core: CPU time is the work of all.")
        if record["rows"]:
            parts.append(block(tables.acceleration(record), "Table 9", caption, origin([record], "Measured"), wide=True))
        if record.get("hard"):
            noise = 0.05
            ratios = [tables.cost_ratio(row) for row in record["hard"]]
            caption = (f"Hard cases by NLGS to the tolerance of each scene, medians of CPU times. Of {len(ratios)}, accelerated ones cost "
                       f"less in {sum(r < 1 - noise for r in ratios)}, the same within {100 * noise:.0f} % in "
                       f"{sum(abs(r - 1) <= noise for r in ratios)}, more in {sum(r > 1 + noise for r in ratios)}, listed here; geometric "
                       f"mean of the ratios {math.exp(sum(map(math.log, ratios)) / len(ratios)):.2f}.")
            parts.append(block(tables.hard_costs(record, noise), "Table 10", caption, origin([record], "Measured"), wide=True))
    return "\n".join(parts)


def converged(results, out):
    """Energy of long runs at the default tolerance, and what the measures of a step say of its distance to the answer."""
    parts = []
    table = hard.energy_table(results.hard_rows)
    if table:
        steps = max(row["steps"] for row in results.hard_rows if row["family"] in hard.ENERGY)
        caption = (f"Energy from nothing: the largest gain of energy beyond what gravity and walls put in, over the largest energy so far, "
                   f"in {tables.count(steps)} steps to the default tolerance; allowed 10\u207b\u2076. Pairs: two balls at rest, the upper so "
                   "many times the heavier; heaps: one ball of so many times the radius on 1 or 16, of one density; rebounds: without "
                   "friction, by Newton's e. (3): exit code 3, steps hit the cap of iterations, and the run says so; (1): refused, when the "
                   "light ball between the heavy one and the floor passes a tenth of its radius in a step, judged until then.")
        parts.append(block(table, "Table 11", caption, "".join(origin([record], "Computed") for record in results.hard), wide=True))
    else:
        parts.append(missing("Table 11, energy of long runs (scripts/hard_cases)"))
    if not results.velocity_error:
        return "\n".join([*parts, missing("Fig. 14, Tables 12 to 14, what the velocity error says (scripts/velocity_error)")])
    for record in results.velocity_error:
        if record["quick"]:
            parts.append("<p>From a quick job with small scenes, made to test the command: its numbers say nothing.</p>")
        source = origin([record], "Computed")
        caption = ("Distance of the velocities from the answer, |V - V*|_M / |V* - V_free|_M, against \u03b7 and against the velocity error, of "
                   "iterates that \u03b7 alone stopped; crosses: accelerated. Lines: equal, and a factor of three either way. With friction "
                   "there may be several answers, so V* is the end of the same iteration, \u03b7 \u2264 10\u207b\u00b9\u00b2 or at least a hundred "
                   "times smaller. A measure is worth what its points keep to a line: \u03b7 compares with all energies of single "
                   "contacts, which grow with mass ratios and the length of force chains while the velocities do not; the velocity error "
                   "compares with what the contacts changed.")
        parts.append(block(image(save(velocity.draw(record), out, "fig14-velocity-error"), "svg", "Distance against eta and velocity error"),
                           "Fig. 14", caption, source, wide=True))
        caption = ("The distance over each measure: least, median and most of all iterates, and the standard deviation of its logarithm. "
                   "A distance many times the measure is a step called better than it is.")
        parts.append(block(velocity.ratio_table(record), "Table 12", caption, source, wide=True))
        caption = ("Below which value of a measure every iterate of every case is within a distance; and how many iterations the three "
                   "reduced scenes together take for one step to get there, by \u03b7 and by the velocity error: the price of the same "
                   "certainty.")
        parts.append(block(velocity.level_table(record), "Table 13", caption, source, wide=True))
        if record["cost"]:
            caption = ("Iterations to \u03b7 = 10\u207b\u2074 alone, and how many times as many with a velocity error; in red where steps did not "
                       "get there.")
            parts.append(block(velocity.cost_table(record), "Table 14", caption, source, wide=True))
    return "\n".join(parts)
