"""Sections of the records: hard cases, speed against error, acceleration, and what a converged step is worth."""
import math
from html import escape

from . import accuracy, bits, hard, tables, velocity, wild
from .page import figure_block, missing, origin, table_block
from .style import save


def hard_cases(results, out):
    if not results.hard:
        return [missing("the hard cases (scripts/hard_cases)")]
    rows = results.hard_rows
    schemes = list(dict.fromkeys((row["scheme"], row["subdomains"]) for row in rows))
    caption = (f"Hard cases, {len({row['case'] for row in rows})} scenes by {len(schemes)} schemes: the exact answer, what was "
               "found, how far it is off, and the bound, which comes from theory: of the accuracy asked for "
               "(<i>tolerance</i>), of the step (<i>O(h)</i>), of the arithmetic (<i>round-off</i>), or an inequality (<i>law</i>; "
               "its error is by how much it fails). Iterations are those of all steps: sweeps, glued after each where there are "
               "several subdomains. An error beyond its bound is in red, and its family open.")
    source = "".join(origin([record]) for record in results.hard)
    parts = [table_block(hard.table(rows), "Hard cases by family", caption, source, wide=True)]
    figure = hard.draw_columns(rows)
    if figure:
        caption = ("Iterations of a column of <i>N</i> from zero impulses: counted (marks), and the most that the spectral radius of "
                   "the iteration allows for the tolerance (lines), by number of subdomains.")
        parts.append(figure_block(save(figure, out, "hard-columns"), "Iterations of columns", caption, source, ("counted",)))
    figure = hard.draw_orders(rows)
    if figure:
        caption = ("Error of the places against the step size, 3D, with the observed order: sliding under constant friction, which "
                   "\u03b8 = 1/2 follows exactly (no line); an impact with e = 0.5; a ball sinking into others, against much smaller "
                   "steps.")
        parts.append(figure_block(save(figure, out, "hard-orders"), "Error against step size", caption, source))
    return parts


def speed_against_error(results, out):
    if not results.accuracy:
        return [missing("speed against error (scripts/accuracy)")]
    parts = []
    for record in results.accuracy:
        source = origin([record])
        if record["quick"]:
            parts.append("<p>From a quick job with small scenes, made to test the command: its times say nothing.</p>")
        parts += [f'<p class="missing">Left out: {escape(line)}.</p>' for line in record["left_out"]]
        if record["scenes"]:
            caption = ("Scenes of the work-precision curves, one loaded state of each, solved for one step from impulses zero; the "
                       "reference answer that distances are measured from, with its own residual; and that CCS makes the "
                       "iterates of DCS (8 subdomains, to 1e-3), which is why DCS alone is in the figures.")
            parts.append(table_block(accuracy.scene_table(record), "Scenes of the work-precision curves", caption, source, ("counted",), wide=True))
            shown, others = accuracy.chosen(record), len(accuracy.solvers(record["runs"]))
            for cost, error, cost_label, error_label in accuracy.VIEWS:
                drawn = accuracy.drawn(record, shown, cost, error)
                caption = (f"{len(drawn)} of the {others} solvers, {escape('; '.join(drawn))}; all are in the table that follows. Better to the "
                           "right and further down; a circle where a solver stalled, within "
                           f"{tables.count(record['budget']['sweeps'])} sweeps. "
                           + (f"{escape(', '.join(solver for solver in shown if solver not in drawn))} cannot be drawn: no such cost or error is "
                              "recorded. " if len(drawn) < len(shown) else "")
                           + ("In-process subdomains take turns on one core, so their CPU time is the work of all. " if cost == "cpu" else "")
                           + (f"Distances are {tables.symbols('|V - V_ref|_M / |V_free|_M')}; where one stays while \u03b7 goes on falling, the solver went to "
                              "another answer, as velocities need not be unique with friction." if error == "distance" else ""))
                figure = accuracy.draw_curves(record, shown, cost, error, cost_label, error_label)
                title = f"{cost_label[0].upper()}{cost_label[1:]} against {error_label}"
                parts.append(figure_block(save(figure, out, f"accuracy-{cost}-{error}"), escape(title), caption, source,
                                          ("measured",) if cost == "cpu" else ("counted",), wide=True))
            level = f"{accuracy.ALL_AT:g}"
            caption = (f"CPU seconds, and sweeps beneath, to \u03b7 = {level}, between the runs on both sides of it; a dash where a solver does not "
                       "get there or took no part. NSCDD: the work of all its subdomains. Newton has no sweeps.")
            parts.append(table_block(accuracy.solver_table(record), f"All solvers at \u03b7 = {level}", caption, source,
                                     ("measured", "counted"), wide=True))
            caption = ("How far the velocities of plain NLGS are from the reference answer when it stops at each tolerance on \u03b7, "
                       f"in shares of {tables.symbols('|V_free|_M')}; a dash where it does not get there.")
            parts.append(table_block(accuracy.distance_table(record), "Distance of NLGS from the reference answer", caption, source))
        table = accuracy.siconos_table(record)
        if table:
            caption = ("CPU time of the solvers' calls at equal \u03b7, as our measure judges it for both, interpolated on the curves of "
                       "the first figure of this section. Siconos solves the exported problem, with its stored <i>W</i>, by its own default "
                       "stopping test.")
            parts.append(table_block(table, "CPU time beside Siconos at equal error", caption, source, ("measured",), wide=True))
        if record["profiles"]:
            for cost, label in (("cpu", "CPU time"), ("sweeps", "sweeps")):
                caption = (f"Performance profiles [DolanMore02] in {label}: the share of problems that a solver solves with at most so "
                           "many times the cost of the best solver of that problem. Hard cases: their first step, by \u03b7; FCLIB "
                           "files: by the natural map as Siconos 4.4 normalises it. Problems that no solver solves are not counted."
                           + (" Newton has no sweeps." if cost == "sweeps" else ""))
                figure = accuracy.draw_profiles(record, cost, label)
                parts.append(figure_block(save(figure, out, f"accuracy-profile-{cost}"), f"Performance profiles, {label}", caption, source,
                                          ("measured",) if cost == "cpu" else ("counted",), wide=True))
    return parts


def acceleration(results, out):
    if not results.acceleration:
        return [missing("what acceleration saves (scripts/acceleration)")]
    parts = []
    for record in results.acceleration:
        if record["quick"]:
            parts.append("<p>From a quick job with few grains, made to test the command: its numbers say nothing.</p>")
        caption = ("Iterations and CPU time of the solver to \u03b7 = 1e-4 by the paper's own method and accelerated. Warm: all steps "
                   "of a scene, each from the impulses of the one before; cold: one step from none. One subdomain is sequential NLGS; more "
                   "are NSCDD by DCS, in process, whose subdomains take turns on one core: CPU time is the work of all.")
        if record["rows"]:
            parts.append(table_block(tables.acceleration(record), "What acceleration saves", caption, origin([record]),
                                     ("counted", "measured"), wide=True))
        if record.get("hard"):
            noise = 0.05
            ratios = [tables.cost_ratio(row) for row in record["hard"]]
            caption = (f"Hard cases by NLGS to the tolerance of each scene, medians of CPU times. Of {len(ratios)}, accelerated ones cost "
                       f"less in {sum(r < 1 - noise for r in ratios)}, the same within {100 * noise:.0f} % in "
                       f"{sum(abs(r - 1) <= noise for r in ratios)}, more in {sum(r > 1 + noise for r in ratios)}, listed here; geometric "
                       f"mean of the ratios {math.exp(sum(map(math.log, ratios)) / len(ratios)):.2f}.")
            parts.append(table_block(tables.hard_costs(record, noise), "Hard cases that cost more accelerated", caption,
                                     origin([record]), ("counted", "measured"), wide=True))
    return parts


def random_scenes(results):
    """What both measures of accepted steps are worth in random scenes, worst first."""
    if not results.wild:
        return [missing("accepted steps of random scenes (build/bin/wild_scenes)")]
    parts = []
    for record in results.wild:
        source, skipped = origin([record]), record["not_judged"]
        distance = tables.symbols("|V - V*|_M / |V* - V_free|_M")
        caption = (f"{tables.count(record['scenes'])} random scenes, most of them built to fool the tests of convergence. V*: the answer by an "
                   f"active-set method of its own, in scenes without friction. Distance: {distance} of the worst component; energy made by "
                   "the contacts of a component, in all scenes. Refused: not converged at the cap of iterations; near: of them those within 0.3 of the "
                   f"answer. Not judged: {tables.count(skipped['no_room'])} steps whose law no velocities satisfy, "
                   f"{tables.count(skipped['no_answer'])} that the judge did not solve.")
        parts += [table_block(wild.spread_table(record, by), f"Random scenes by {by}, worst first", caption if by == "solver" else "As above.", source,
                              ("counted",), wide=True) for by in ("solver", "family")]
        caption = ("Gap error: the step is proven to be exact for gaps that differ by at most this share of the contact's radius. Estimate: what the solver "
                   "said of the distance of the worst component. Seed: <code>wild_scenes --scenes 1 --seed</code> makes the scene again.")
        parts.append(table_block(wild.worst_table(record), "Accepted steps of random scenes, the farthest from the answer first", caption, source,
                                 ("counted",), wide=True))
    return parts


def same_bits(results, _out):
    """Answers by several compilers and processors."""
    parts = []
    for record in results.bits:
        rows = record["rows"]
        same = sum(row["numbers"] - len(row["differ"]) for row in rows)
        caption = (f"Checksums of positions, velocities, driven walls and impulses at the end of the reduced scenes, by {len(rows)} builds "
                   f"of one source. {tables.count(same)} of {tables.count(sum(row['numbers'] for row in rows))} counts, residuals and checksums are the "
                   f"accepted ones (commit {escape(record['accepted'])}) or those of the record of hard cases; others are in red. The build for aarch64 ran under qemu.")
        parts.append(table_block(bits.table(record), "The same bits by several compilers and processors", caption, origin([record]), ("counted",), wide=True))
    return parts or [missing("the same runs by other compilers and processors (scripts/same_bits)")]


def converged(results, out):
    """Energy of long runs at the default tolerance, and what the measures of a step say of its distance to the answer."""
    parts = []
    table = hard.energy_table(results.hard_rows)
    if table:
        steps = max(row["steps"] for row in results.hard_rows if row["family"] in hard.ENERGY)
        caption = (f"The largest gain of energy beyond what gravity and walls put in, over the largest energy so far, "
                   f"in {tables.count(steps)} steps to the default tolerance; allowed 10\u207b\u2076. Pairs: two balls at rest, the upper so "
                   "many times the heavier; heaps: one ball of so many times the radius on 1 or 16, of one density; rebounds: without "
                   "friction, by Newton's e. (3): exit code 3, steps hit the cap of iterations, and the run says so; (1): refused, when the "
                   "light ball between the heavy one and the floor passes a tenth of its radius in a step, judged until then.")
        parts.append(table_block(table, "Energy from nothing", caption, "".join(origin([record]) for record in results.hard), wide=True))
    else:
        parts.append(missing("energy of long runs (scripts/hard_cases)"))
    parts += random_scenes(results)
    if not results.velocity_error:
        return [*parts, missing("what the velocity error says (scripts/velocity_error)")]
    for record in results.velocity_error:
        if record["quick"]:
            parts.append("<p>From a quick job with small scenes, made to test the command: its numbers say nothing.</p>")
        source = origin([record])
        caption = (f"Distance of the velocities from the answer, {tables.symbols('|V - V*|_M / |V* - V_free|_M')}, against \u03b7 and against the "
                   "velocity error, of iterates that \u03b7 alone stopped; circles: plain, crosses: accelerated; colours: families of cases. "
                   "Lines: equal, and a factor of three either way. With friction "
                   "there may be several answers, so V* is the end of the same iteration, \u03b7 \u2264 10\u207b\u00b9\u00b2 or at least a hundred "
                   "times smaller. A measure is worth what its points keep to a line: \u03b7 compares with all energies of single "
                   "contacts, which grow with mass ratios and the length of force chains while the velocities do not; the velocity error "
                   "compares with what the contacts changed.")
        parts.append(figure_block(save(velocity.draw(record), out, "velocity-error"), "Distance against \u03b7 and against the velocity error",
                                  caption, source, wide=True))
        caption = ("Least, median and most of all iterates, and the standard deviation of its logarithm. "
                   "A distance many times the measure is a step called better than it is.")
        parts.append(table_block(velocity.ratio_table(record), "The distance over each measure", caption, source, wide=True))
        left_out = velocity.unreached(record)
        some = len(left_out) < len(velocity.reduced(record))
        caption = ("Below which value of a measure every iterate of every case is within a distance"
                   + ("; and how many iterations the three reduced scenes together take for one step to get there, by \u03b7 and by the velocity "
                      "error: the price of the same certainty." if some else ".")
                   + (f" What they would take is left out for {escape('; '.join(left_out))}: not all of the recorded iterates of the reduced scenes "
                      "get to any of these levels." if left_out else ""))
        parts.append(table_block(velocity.level_table(record), "What a measure must be for a distance", caption, source, wide=True))
        if record["cost"]:
            caption = ("Iterations to \u03b7 = 10\u207b\u2074 alone, and how many times as many with a velocity error; in red where steps did not "
                       "get there.")
            parts.append(table_block(velocity.cost_table(record), "Iterations to a velocity error", caption, source, ("counted",), wide=True))
    return parts
