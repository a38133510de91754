"""Against what a user would pick: CPU time of LAMMPS on a settling bed and of Siconos on exported steps, at equal error; cited figures."""
import re
from html import escape

from ...page import tables
from ...page.page import command_list, figure_block, origin, quick, table_block
from ...page.style import CCS, DCS, NLGS, plt, save
from ...measure import SICONOS
from ..accuracy.levels import at_level
from .choice import customary_steps, frontier, median, named, settled, stable_steps, usable

LEVELS = (1e-2, 1e-3, 1e-4, 1e-6)


def draw(record):
    """CPU time against the mean overlap, log-log: all measured."""
    figure, axis = plt.subplots(figsize=(6.2, 4.2))
    ours = usable(record["ours"])
    curves = (
        ("contact dynamics, this program", frontier(ours), {"color": DCS, "marker": "o", "linestyle": "-"}),
        ("LAMMPS, largest stable step", stable_steps(record), {"color": CCS, "marker": "s", "linestyle": "-"}),
        ("LAMMPS, a tenth of a contact's time", customary_steps(record), {"color": NLGS, "marker": "s", "linestyle": "--"}),
    )
    rest = [row for row in ours if row not in curves[0][1]]
    axis.plot([row["mean_overlap"] for row in rest], [median(row) for row in rest], "o", color=DCS, markerfacecolor="none", markersize=4)
    for label, rows, look in curves:
        if rows:
            axis.plot([row["mean_overlap"] for row in rows], [median(row) for row in rows], label=label, markersize=5, **look)
    axis.set(xscale="log", yscale="log", xlabel="mean overlap at the end, over the mean diameter", ylabel="user CPU time [s]")
    axis.invert_xaxis()
    for which in (axis.yaxis.set_major_formatter, axis.yaxis.set_minor_formatter):
        which(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "125" else "")
    axis.legend(loc="best")
    return figure


def wrong(row):
    """Why a run of the settling bed does not count, in words; nothing where it does."""
    if "mean_overlap" in row:
        return "" if settled(row) else "gains energy" if not row.get("stable", True) else "not at rest"
    told = row.get("refused") or row["why"]
    lost = re.search(r"Lost atoms: original (\d+) current (\d+)", told)
    return f"unstable: {tables.count(int(lost[1]) - int(lost[2]))} of {tables.count(int(lost[1]))} grains left the box" if lost else told


def run_table(record):
    """Every run of the settling bed; beneath one that does not count, why."""

    def cells(row):
        why = wrong(row)
        run = f'<span style="display:inline-block;min-width:25em">{escape(named(row))}</span>' + (
            f'<br><b style="color:var(--bad)">{escape(why)}</b>' if why else ""
        )
        text = [(run, "text"), f"{median(row):.2f} <i>({len(row['cpus'])})</i>{tables.busy_mark(row.get('cores'))}"]
        if "mean_overlap" not in row:
            return [*text, *[tables.NONE] * 5]
        return [
            *text,
            tables.number(row["mean_overlap"]),
            tables.number(row["largest_overlap"]),
            tables.number(row["kinetic_energy"]),
            f"{1e3 * row['bed_height']:.1f}",
            f"{row['coordination']:.2f}",
        ]

    lines = [[code, row["role"], *cells(row)] for code, rows in (("ours", record["ours"]), ("LAMMPS", record["lammps"])) for row in rows]
    head = [
        "code | tried | run | user CPU [s] <i>(runs)</i> | mean overlap [d] | largest overlap [d] | kinetic energy left [J] | bed height [mm] | coordination"
    ]
    return tables.table(head, lines, "Settling bed, all runs")


def ratio_table(record):
    def value(number):
        return tables.NONE if number is None else tables.number(number)

    lines = []
    for row in record["ratios"]:
        cells = [escape(row["step"]), f"{row['k']:.2g}", f"{row['dt']:.2g}", value(row["mean_overlap"]), value(row["largest_overlap"])]
        cells += [value(row["lammps_cpu"]), escape(row["ours"] or tables.NONE), value(row["ours_mean_overlap"]), value(row["ours_largest_overlap"])]
        cells += [value(row["ours_cpu"]), (value(row["ratio"]), "strong"), value(row.get("p")), value(row["ratio_both"])]
        lines.append(cells)
    columns = "step | k [Pa] | dt [s] | mean [d] | largest [d] | CPU [s] | run | mean [d] | largest [d] | CPU [s]"
    head = ["LAMMPS *6 | ours *4 | LAMMPS over ours *3", columns + " | equal mean | chance p | equal mean and largest"]
    return tables.table(head, lines, "CPU time of LAMMPS over ours at equal overlap")


def siconos_levels(record):
    """[(scene, eta, {solver: CPU seconds or None})]."""
    found = []
    for scene in dict.fromkeys(row["scene"] for row in record["siconos"]):
        own = [row for row in record["siconos"] if row["scene"] == scene]
        for level in LEVELS:
            found.append(
                (
                    scene,
                    level,
                    {solver: at_level([row for row in own if row["solver"] == solver], level) for solver in dict.fromkeys(row["solver"] for row in own)},
                )
            )
    return found


def siconos_table(record):
    lines = []
    for scene, level, cost in siconos_levels(record):
        theirs = cost.pop(SICONOS, None)
        cells = [escape(scene), tables.number(level), tables.number(theirs) if theirs else tables.NONE]
        for value in cost.values():
            cells += [tables.number(value) if value else tables.NONE, (tables.number(theirs / value), "strong") if theirs and value else tables.NONE]
        lines.append(cells)
    solvers = list(dict.fromkeys(row["solver"] for row in record["siconos"] if row["solver"] != SICONOS))
    head = [["scene", "\u03b7", "Siconos NSGS [s]", *(title for name in solvers for title in (f"{escape(name)} [s]", "times faster"))]]
    return tables.table(head, lines, "CPU time of Siconos and ours at equal error")


def cited_table(record):
    lines = [[escape(row[key]) for key in ("code", "quantity", "value", "of", "source")] for row in record["cited"]]
    return tables.table(["code | quantity | value | of | source"], lines, "Cited figures")


def commands(rows):
    """The commands of rows, folded; says how many rows lack theirs."""
    found = [command for row in rows for command in row.get("commands", [row["command"]] if "command" in row else [])]
    without = sum(not row.get("commands") and "command" not in row and row.get("cpu") is not None for row in rows)
    return (f'<div class="from">Rows from {command_list(found)}</div>' if found else "") + (
        f'<div class="from">{without} rows of this record do not have their command: they were made before rows had it.</div>' if without else ""
    )


def section(results, out):
    return [part for record in results.records("peers") for part in parts_of(record, out)]


def parts_of(record, out):
    bed, source, measured = record["settle"], origin([record]), ("measured",)
    yield from quick(record)
    for line in record["left_out"]:
        yield f'<p class="missing">Left out: {escape(line)}.</p>'
    if usable(bed["ours"]):
        caption = (
            f"{tables.count(bed['grains'])} spheres settle in a box for {bed['seconds']:g} s: user CPU time on one core against the mean "
            "overlap of what overlaps at the end, better to the right and further down. Open circles: our runs that another of ours "
            "beats in both. LAMMPS at the largest step at which energy does not grow, and at a tenth of the time of a contact."
        )
        yield figure_block(save(draw(bed), out, "peers"), "CPU time against mean overlap", caption, source, measured)
    if bed["ratios"]:
        yield table_block(ratio_table(bed), "LAMMPS against ours", escape(bed["how"]) + " A ratio below 1: LAMMPS is cheaper.", source, measured, wide=True)
    if bed["ours"]:
        made_by = source + commands([*bed["ours"], *bed["lammps"]])
        yield table_block(run_table(bed), "All runs of the settling bed", "In brackets how many runs the median is of.", made_by, measured, wide=True)
    if record["siconos"]:
        caption = (
            "One step of reduced scenes of the paper from impulses zero: CPU time of the solvers' calls at equal \u03b7, by our measure for "
            "both, between runs in logarithms. Siconos solves the exported problem with its stored <i>W</i>."
        )
        yield table_block(siconos_table(record), "Siconos against ours", caption, source + commands(record["siconos"]), measured, wide=True)
    caption = "Figures that this job did not measure, with where they are from. Beside those above they say no more than their order."
    yield table_block(cited_table(record), "Cited", caption, '<div class="from">From <code>cases/peers/cited.json</code>.</div>', (), wide=True)
