"""Against what a user would pick: CPU time of LAMMPS on a settling bed and of Siconos on exported steps, at equal error; cited figures."""
import itertools
import re
from html import escape

from ...measure import SICONOS
from ...page import tables
from ...page.page import Block, captions, figure_block, rows_from
from ...page.style import CCS, DCS, NLGS, plt, save
from ..accuracy.levels import costs, of
from .choice import customary_steps, frontier, median, named, settled, stable_steps, usable

CAPTIONS = captions(__file__)
LEVELS = (1e-2, 1e-3, 1e-4, 1e-6)


def draw_all(record, folder):
    """CPU time against the mean overlap, log-log: all measured. Returns the file, or None without a run of ours that counts."""
    record = record["settle"]
    if not (ours := usable(record["ours"])):
        return None
    figure, axis = plt.subplots(figsize=(6.2, 4.2))
    best = frontier(ours)
    for rows, how in (
        ([row for row in ours if row not in best], {"color": DCS, "marker": "o", "linestyle": "", "markerfacecolor": "none", "markersize": 4}),
        (best, {"label": "contact dynamics, this program", "color": DCS, "marker": "o", "markersize": 5}),
        (stable_steps(record), {"label": "LAMMPS, largest stable step", "color": CCS, "marker": "s", "markersize": 5}),
        (customary_steps(record), {"label": "LAMMPS, a tenth of a contact's time", "color": NLGS, "marker": "s", "linestyle": "--", "markersize": 5}),
    ):
        if rows:
            axis.plot([row["mean_overlap"] for row in rows], [median(row) for row in rows], **how)
    axis.set(xscale="log", yscale="log", xlabel="mean overlap at the end, over the mean diameter", ylabel="user CPU time [s]")
    axis.invert_xaxis()
    for which in (axis.yaxis.set_major_formatter, axis.yaxis.set_minor_formatter):
        which(lambda value, _: f"{value:g}" if f"{value:.0e}"[0] in "125" else "")
    axis.legend(loc="best")
    return save(figure, folder, "peers")


def value(number):
    return tables.number(number) if number else tables.NONE


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
        run = f'<span style="display:inline-block;min-width:25em">{escape(named(row))}</span>'
        run += f'<br><b style="color:var(--bad)">{escape(why)}</b>' if why else ""
        text = [(run, "text"), f"{median(row):.2f} <i>({len(row['cpus'])})</i>{tables.busy_mark(row.get('cores'))}"]
        if "mean_overlap" not in row:
            return [*text, *[tables.NONE] * 5]
        text += [tables.number(row[key]) for key in ("mean_overlap", "largest_overlap", "kinetic_energy")]
        return [*text, f"{1e3 * row['bed_height']:.1f}", f"{row['coordination']:.2f}"]

    lines = [[code, row["role"], *cells(row)] for code, rows in (("ours", record["ours"]), ("LAMMPS", record["lammps"])) for row in rows]
    columns = "code | tried | run | user CPU [s] <i>(runs)</i> | mean overlap [d] | largest overlap [d] | kinetic energy left [J]"
    return tables.table([columns + " | bed height [mm] | coordination"], lines, "Settling bed, all runs")


def ratio_table(record):
    lines = []
    for row in record["ratios"]:
        cells = [row["step"], f"{row['k']:.2g}", f"{row['dt']:.2g}", *(value(row[key]) for key in ("mean_overlap", "largest_overlap", "lammps_cpu"))]
        cells += [escape(row["ours"] or tables.NONE), *(value(row[f"ours_{key}"]) for key in ("mean_overlap", "largest_overlap", "cpu"))]
        lines.append([*cells, (value(row["ratio"]), "strong"), value(row.get("p")), value(row["ratio_both"])])
    columns = "step | k [Pa] | dt [s] | mean [d] | largest [d] | CPU [s] | run | mean [d] | largest [d] | CPU [s]"
    head = ["LAMMPS *6 | ours *4 | LAMMPS over ours *3", columns + " | equal mean | chance p | equal mean and largest"]
    return tables.table(head, lines, "CPU time of LAMMPS over ours at equal overlap")


def siconos_table(record):
    lines, titles = [], []
    for scene, level in itertools.product(dict.fromkeys(row["scene"] for row in record["siconos"]), LEVELS):
        cost = costs(of(record["siconos"], scene=scene), level)
        theirs = cost.pop(SICONOS, None)
        pairs = [(value(ours), (value(theirs and ours and theirs / ours), "strong" if theirs and ours else "")) for ours in cost.values()]
        lines.append([scene, tables.number(level), value(theirs), *(cell for pair in pairs for cell in pair)])
        titles = [title for name in cost for title in (f"{escape(name)} [s]", "times faster")]
    return tables.table([["scene", "\u03b7", "Siconos NSGS [s]", *titles]], lines, "CPU time of Siconos and ours at equal error")


def cited_table(record):
    lines = [[escape(row[key]) for key in ("code", "quantity", "value", "of", "source")] for row in record["cited"]]
    return tables.table(["code | quantity | value | of | source"], lines, "Cited figures")


def parts(record, source, out):
    bed, measured = record["settle"], ("measured",)
    if file := draw_all(record, out):
        caption = CAPTIONS["bed"].format(grains=tables.count(bed["grains"]), seconds=bed["seconds"])
        yield figure_block(file, "CPU time against mean overlap", caption, source, measured)
    if bed["ratios"]:
        yield Block(ratio_table(bed), "LAMMPS against ours", escape(bed["how"]) + " A ratio below 1: LAMMPS is cheaper.", source, measured, wide=True)
    if bed["ours"]:
        made_by = source + rows_from([row["command"] for row in [*bed["ours"], *bed["lammps"]]])
        yield Block(run_table(bed), "All runs of the settling bed", "In brackets how many runs the median is of.", made_by, measured, wide=True)
    if record["siconos"]:
        made_by = source + rows_from([command for row in record["siconos"] for command in row["commands"]])
        yield Block(siconos_table(record), "Siconos against ours", CAPTIONS["siconos"], made_by, measured, wide=True)
    yield Block(cited_table(record), "Cited", CAPTIONS["cited"], '<div class="from">From <code>cases/peers/cited.json</code>.</div>', (), wide=True)
