"""What a converged step is worth: the section of the page on eta and the velocity error."""
from html import escape

from ...page import tables
from ...page.page import figure_block, origin, quick, table_block
from ...page.style import save
from . import figures


def section(results, out):
    parts = []
    for record in results.records("velocity_error"):
        parts += quick(record)
        source = origin([record])
        caption = (
            f"Distance of the velocities from the answer, {tables.symbols('|V - V*|_M / |V* - V_free|_M')}, against \u03b7 and against the "
            "velocity error, of iterates that \u03b7 alone stopped; circles: plain, crosses: accelerated; colours: families of cases. "
            "Lines: equal, and a factor of three either way. With friction "
            "there may be several answers, so V* is the end of the same iteration, \u03b7 \u2264 10\u207b\u00b9\u00b2 or at least a hundred "
            "times smaller. A measure is worth what its points keep to a line: \u03b7 compares with all energies of single "
            "contacts, which grow with mass ratios and the length of force chains while the velocities do not; the velocity error "
            "compares with what the contacts changed."
        )
        heading = "Distance against \u03b7 and against the velocity error"
        parts.append(figure_block(save(figures.draw(record), out, "velocity-error"), heading, caption, source, wide=True))
        caption = (
            "Least, median and most of all iterates, and the standard deviation of its logarithm. "
            "A distance many times the measure is a step called better than it is."
        )
        parts.append(table_block(figures.ratio_table(record), "The distance over each measure", caption, source, wide=True))
        left_out = figures.unreached(record)
        some = len(left_out) < len(figures.reduced(record))
        caption = (
            "Below which value of a measure every iterate of every case is within a distance"
            + (
                "; and how many iterations the three reduced scenes together take for one step to get there, by \u03b7 and by the velocity "
                "error: the price of the same certainty."
                if some
                else "."
            )
            + (
                f" What they would take is left out for {escape('; '.join(left_out))}: not all of the recorded iterates of the reduced scenes "
                "get to any of these levels."
                if left_out
                else ""
            )
        )
        parts.append(table_block(figures.level_table(record), "What a measure must be for a distance", caption, source, wide=True))
        if record["cost"]:
            caption = "Iterations to \u03b7 = 10\u207b\u2074 alone, and how many times as many with a velocity error; in red where steps did not " "get there."
            parts.append(table_block(figures.cost_table(record), "Iterations to a velocity error", caption, source, ("counted",), wide=True))
    return parts
