"""Tables of the paper's section, as HTML; None where they would have no rows."""
from html import escape

from ...page import tables
from ...page.tables import NONE, count, number, percent
from .data import COLLECTIVE, MILLION, NUMBERS, SCENES, STARTS, TABLE_1, family, mean, total

ORDER = (*SCENES, MILLION)


def table(head, rows, label):
    return tables.table(head, rows, label) if rows else None


def splitting(partition):
    """grid 2x2x1 on one line."""
    return escape(partition).replace(" ", "\u00a0")


def place(entry, names):
    """Cells that say which run, window or step it is."""
    told = entry | {"scheme": entry["scheme"].upper(), "partition": splitting(entry["partition"])}
    return [str(told[name]) for name in names.split()]


def or_none(value, text=number):
    return NONE if value is None else text(value)


def span(values, text=number):
    """least - largest; NONE of none."""
    return f"{text(min(values))} \u2013 {text(max(values))}" if values else NONE


def unconverged(run):
    return f"{run['unconverged_steps']}", "bad" if run["unconverged_steps"] else ""


def table_1(paper):
    """Shares in MPI: the paper's, and simulated with present cores and with those three times slower."""
    ours, nothing = [(slower, scheme) for slower in (1, 3) for scheme in ("ccs", "dcs")], True
    rows = []
    for n, (cut, *theirs) in TABLE_1.items():
        cells = [str(n), splitting(cut), *[(f"{share:.1f}", "faint") for share in theirs]]
        for slower, scheme in ours:
            shares = [0.0 if n == 1 else paper.table_1(scheme, n, slower, f"{kind}_share") for kind in ("mpi", "wait", "transfer")]
            all_of_it, *parts = (or_none(share, percent) for share in shares)
            cells += [(all_of_it, "strong"), *parts]
            nothing &= n == 1 or shares[0] is None
        rows.append(cells)
    above = " |  | paper *2 | SIMULATED, present cores *6 | SIMULATED, cores 3 times slower *6"
    head = [above, "subdomains | splitting | CCS % | DCS %" + 2 * " | CCS % | waiting | trans&shy;ferring | DCS % | waiting | trans&shy;ferring"]
    return None if nothing else table(head, rows, "Table 1: share of time in MPI")


def operations(paper):
    """Messages of an iteration and microseconds in MPI by operation, for Table 1 with present cores."""
    rows, names = [], ("exchange", *COLLECTIVE[:3])
    for n, scheme in ((n, scheme) for n in NUMBERS for scheme in ("ccs", "dcs")):
        if found := paper.operations(scheme, n):
            seconds = 1e6 * paper.table_1(scheme, n, 1, "seconds_per_iteration")
            cells = [str(n), scheme.upper(), *(number(found[name]["messages"]) for name in names)]
            rows.append([*cells, *(number(seconds * found[name][which]) for name in names for which in ("wait_share", "transfer_share"))])
    above = " *2 | messages of all ranks, counted *4" + "".join(f" | {name}, \u00b5s, SIMULATED *2" for name in names)
    return table([above, ["subdomains", "scheme", *names, *("waiting", "trans&shy;ferring") * 4]], rows, "Messages and time by operation")


def below_the_paper(paper):
    """How many times our shares of DCS with present cores are below the paper's, least and most; None if not simulated."""
    times = [TABLE_1[n][2] / (100 * share) for n in NUMBERS if (share := paper.table_1("dcs", n))]
    return (min(times), max(times)) if times else None


def scenes(paper):
    """What the paper does not give, as the sequential runs have it."""
    rows = []
    for scene, run in ((scene, run) for scene in ORDER if (run := paper.nlgs(scene))):
        start = STARTS[scene] if paper.under_way(scene) or scene == "isotropic" else "packing"
        cells = [scene, count(run["grains"]), (start, "text"), str(run["steps"]), number(run["h"]), number(run["tolerance"])]
        rows.append([*cells, or_none(run.get("inertial_number")), or_none(run.get("largest_overlap"))])
    head = ["scene | grains | starts from | steps | h | tolerance on \u03b7 | inertial number, median | largest overlap at the end [mean diameters]"]
    return table(head, rows, "Scenes of the paper as run")


def measured(paper):
    """Runs on real cores; speed-up over measured sequential NLGS."""
    rows = []
    for row, speed_up in paper.measured():
        cells = [*place(row, "scene scheme method partition ranks steps"), number(row["seconds"]) + tables.busy_mark(row.get("cores"))]
        cells += [span(row["seconds_all"]), or_none(speed_up)]
        rows.append([*cells, (percent(row["mpi_share"]), "strong") if row["scheme"] != "nlgs" else NONE, count(row["iterations_total"])])
    head = ["scene | scheme | method | partition | real ranks | steps | seconds, median | seconds, all | speed-up | in MPI % | iterations"]
    return table(head, rows, "Measured runs")


def speed_ups(paper, scene):
    """Every simulated point of a scene, those of the paper's method and grid first."""

    def order(key):
        _, method, scheme, partition, n, platform, slower = key
        return method != "paper", platform != "node48", slower, family(partition) != "grid", scheme, n, partition

    rows = []
    for key in sorted((key for key in paper.windows if key[0] == scene and key[4] > 1), key=order):
        _, method, scheme, partition, n, platform, slower = key
        if point := paper.point(*key):
            cells = [method, scheme.upper(), splitting(partition), str(n), platform + (f", {slower:g}\u00d7 slower" if slower != 1 else "")]
            cells += [or_none(point.iterations, count), number(1e6 * point.seconds), percent(point.share), or_none(point.iteration_efficiency)]
            band = NONE if point.low == point.high else span([point.low, point.high])
            rows.append([*cells, (or_none(point.speed_up), "strong"), band, or_none(point.efficiency)])
    columns = "method | scheme | partition | processes | machine | iterations, total | \u00b5s an iteration"
    head = [" *5 | counted | SIMULATED *6", columns + " | in MPI % | efficiency of an iteration | speed-up | its band | efficiency"]
    return table(head, rows, f"Simulated points: {scene}")


def packings(paper):
    rows = []
    for row in paper.record["packings"]:
        cells = [row["scene"], count(row["grains"]), (escape(row["source"]), "text"), f"{row['solid_fraction']:.4f}", f"{row['solid_fraction_core']:.4f}"]
        cells += ("loose", NONE) if row["coordination"] == 0 else (f"{row['coordination']:.3f}", percent(row["rattlers"]))
        rows.append([*cells, number(row["largest_overlap"]), (row.get("checksum", NONE), "text")])
    above = "scene | grains | made by | solid fraction *2 | contacts a grain | rattlers % | largest overlap | checksum"
    return table([above, " |  |  | all | core | core, without rattlers |  | mean diameters | "], rows, "Packings")


def variations(paper):
    """Each variation beside the same steps of the scene as it is, by the same method, scheme and splitting."""
    rows = []
    for run in (run for run in paper.record["runs"] if run["variation"]):
        base, each = paper.unvaried(run), mean(run["iterations"])
        cells = [run["scene"], tables.symbols(run["variation"]), *place(run, "scheme method partition subdomains"), number(run["h"]), number(run["tolerance"])]
        cells += [str(run["steps"]), count(each), number(each / base) if base else NONE]
        rows.append([*cells, count(mean(run["contacts"])), unconverged(run)])
    columns = "scene | variation | scheme | method | partition | subdomains | h [s] | tolerance | steps | iterations a step | over the scene as it is"
    return table([columns + " | contacts, mean | steps not converged"], rows, "Variations")


def interface(paper):
    """Runs that glue what the broad phase predicts beside those on the minimal interface of the same splitting."""
    rows = []
    for key, wide in sorted(paper.predicted.counted.items(), key=lambda item: (ORDER.index(item[0][0]), item[0][4])):
        narrow = paper.counted.get(key)
        if wide["scheme"] == "nlgs" or not narrow:
            continue
        points, both = [view.point(*key, "node48") for view in (paper, paper.predicted)], (narrow, wide)
        cells = [key[0], splitting(key[3]), *(count(run["interface_grains"]) for run in both), *(count(total(run)) for run in both)]
        cells += [(number(total(wide) / total(narrow)), "strong"), *(count(run["bytes_per_iteration"]) for run in both)]
        cells += [or_none(point and 1e6 * point.seconds) for point in points]
        rows.append([*cells, *((number(point.speed_up), "strong") if point and point.speed_up else NONE for point in points)])
    above = " *2 | shared grains, mean *2 | iterations, counted *3 | bytes an iteration *2 | \u00b5s an iteration, SIMULATED *2 | speed-up, SIMULATED *2"
    head = [above, "scene | partition" + 2 * " | minimal | predicted" + " | ratio" + 3 * " | minimal | predicted"]
    return table(head, rows, "Minimal and predicted interface")


def chance(paper):
    """Iterations from perturbed starts."""
    rows = []
    nlgs = paper.perturbed.get(("biaxial", "paper", "nlgs", "none", 1), {})
    for key, runs in sorted(paper.perturbed.items(), key=lambda item: (item[0][2] != "nlgs", item[0][4], item[0][3])):
        totals = [total(run) for run in runs.values()]
        ratios = [total(run) / total(nlgs[seed]) for seed, run in runs.items() if seed in nlgs]
        cells = [key[0], key[2].upper(), splitting(key[3]), str(key[4]), str(len(totals)), count(min(totals)), count(mean(totals)), count(max(totals))]
        rows.append([*cells, (number(max(totals) / min(totals)), "strong"), or_none(mean(ratios)), span(ratios)])
    columns = "scene | scheme | partition | subdomains | starts | least | mean | most | most over least | mean | least, most"
    return table([" *5 | iterations, total *4 | over NLGS from the same start *2", columns], rows, "Iterations from perturbed starts")


def all_runs(paper):
    """Whole runs, counted, by scene in the order of the paper; iterations over those of NLGS by the same method."""

    def order(run):
        first = ORDER.index(run["scene"]), run["method"] != "paper", run["scheme"] != "nlgs", family(run["partition"]) != "grid"
        return *first, run["scheme"], run["subdomains"], run["partition"]

    rows, asked = [], {run["tolerance"] for run in paper.counted.values()}
    largest = "largest \u03b7" + (f"<br><i>\u2264\u202f{number(min(asked))}</i>" if len(asked) == 1 else "")
    for run in sorted(paper.counted.values(), key=order):
        nlgs = paper.nlgs(run["scene"], run["method"])
        eta = number(run["residual_max"]) + (f" <i>\u2264\u202f{number(run['tolerance'])}</i>" if len(asked) > 1 else "")
        cells = [*place(run, "scene method scheme partition subdomains"), "under way" if paper.under_way(run["scene"]) else "packing", str(run["steps"])]
        cells += [count(total(run)), count(mean(run["iterations"])), number(total(run) / total(nlgs)) if nlgs and total(nlgs) else NONE]
        cells += [count(mean(run["contacts"])), number(run["unknowns_mean"]), count(run["interface_grains"]), percent(run["interface_grains"] / run["grains"])]
        rows.append([*cells, (eta, "bad" if run["unconverged_steps"] or run["residual_max"] is None else ""), unconverged(run)])
    columns = "scene | method | scheme | partition | sub&shy;domains | start | steps | total | a step | over NLGS | contacts | unknowns | mean | %"
    head = [" *7 | iterations *3 | mean *2 | shared grains *2 |  *2", f"{columns} | {largest} | not converged"]
    return table(head, rows, "Runs of the paper's scenes")


def agreement(paper):
    names, entries = "scene scheme method partition subdomains", []
    for entry in paper.record["agreement"]:
        cells = place(entry, names)
        cells[3] += ", predicted interface" if entry.get("multiplicity") == "predicted" else ""
        entries.append((cells, entry["rows"], True))
    return tables.bounded(names.split(), entries, "Agreement of one step with NLGS") if entries else None


def statements(verdicts, links):
    """The summary: a line for each statement and its verdict; finding, reason, rule and a link to the evidence on demand. links: {anchor: label}."""
    lines = ['<ul class="statements" aria-label="Statements of the paper">']
    for one in verdicts:
        link = f' <a href="#{one.anchor}">{links[one.anchor]}</a>.' if one.anchor in links else ""
        told = " ".join(escape(text) for text in (one.finding, one.why, one.rule) if text)
        summary = f"<summary><b>{one.verdict}</b> {escape(one.statement)}</summary>"
        style = "untold" if one.verdict == "cannot be told" else one.verdict
        lines.append(f'<li class="{style}"><details>{summary}<p class="rule">{told}{link}</p></details></li>')
    return "\n".join([*lines, "</ul>"])
