"""Tables of the paper's section, as HTML: Table 1 beside the paper's, speed-ups, measured runs, packings, variations, all runs."""
from html import escape

from ...page import tables
from .data import COLLECTIVE, INERTIAL, MILLION, SCENES, STARTS, TABLE_1, family, mean, total
from ...page.tables import NONE, count, number, percent

ORDER = (*SCENES, MILLION)


def splitting(partition):
    """grid 2x2x1 on one line."""
    return escape(partition).replace(" ", "\u00a0")


def or_none(value, text=number):
    return NONE if value is None else text(value)


def table_1(paper):
    """Shares in MPI: the paper's, and simulated with present cores and with those three times slower; None if nothing is simulated."""
    rows, found = [], False
    for n, (cut, *theirs) in TABLE_1.items():
        cells = [str(n), splitting(cut), *[(f"{share:.1f}", "faint") for share in theirs]]
        for slower in (1, 3):
            for scheme in ("ccs", "dcs"):
                share = paper.share(scheme, n, slower)
                found |= n > 1 and share is not None
                cells.append((NONE if share is None else percent(share), "strong"))
                cells += [or_none(0.0 if n == 1 else paper.share(scheme, n, slower, which), percent) for which in ("wait_share", "transfer_share")]
        rows.append(cells)
    above = " |  | paper *2 | SIMULATED, present cores *6 | SIMULATED, cores 3 times slower *6"
    head = [above, "subdomains | splitting | CCS % | DCS %" + 2 * " | CCS % | waiting | trans&shy;ferring | DCS % | waiting | trans&shy;ferring"]
    return tables.table(head, rows, "Table 1: share of time in MPI") if found else None


def operations(paper):
    """Messages of an iteration and microseconds in MPI by operation, for Table 1 with present cores; None if they are not in the record."""
    rows, names = [], ("exchange", *COLLECTIVE[:3])
    for n in TABLE_1:
        for scheme in ("ccs", "dcs"):
            found = paper.operations(scheme, n) if n > 1 else None
            if found:
                seconds = 1e6 * paper.iteration(scheme, n, 1)
                cells = [str(n), escape(scheme.upper()), *(number(found[name]["messages"]) for name in names)]
                cells += [*(number(seconds * found[name][which]) for name in names for which in ("wait_share", "transfer_share"))]
                rows.append(cells)
    above = " *2 | messages of all ranks, counted *4" + "".join(f" | {name}, \u00b5s, SIMULATED *2" for name in names)
    head = [above, ["subdomains", "scheme", *names, *("waiting", "trans&shy;ferring") * 4]]
    return tables.table(head, rows, "Messages and time by operation") if rows else None


def below_the_paper(paper):
    """How many times our shares of DCS with present cores are below the paper's, least and most; None if not simulated."""
    times = [theirs / (100 * share) for n, (_, _, theirs) in TABLE_1.items() if n > 1 and (share := paper.share("dcs", n, 1))]
    return (min(times), max(times)) if times else None


def scenes(paper):
    """What the paper does not give, as the sequential runs have it; the inertial number by the scene's comment where the record lacks it."""
    rows = []
    for scene in ORDER:
        run = paper.nlgs(scene)
        if not run:
            continue
        inertial = (
            number(run["inertial_number"])
            if "inertial_number" in run
            else f"{number(INERTIAL[scene])} <i>by the rate of strain</i>"
            if scene in INERTIAL
            else NONE
        )
        cells = [escape(scene), count(run["grains"]), (escape(STARTS[scene] if paper.under_way(scene) or scene == "isotropic" else "packing"), "text")]
        cells += [str(run["steps"]), number(run["h"]), number(run["tolerance"]), inertial, or_none(run.get("largest_overlap"))]
        rows.append(cells)
    head = ["scene | grains | starts from | steps | h | tolerance on \u03b7 | inertial number, median | largest overlap at the end [mean diameters]"]
    return tables.table(head, rows, "Scenes of the paper as run") if rows else None


def measured(paper):
    """Runs on real cores; speed-up over measured sequential NLGS."""
    rows = []
    for row, speed_up in paper.measured():
        cells = [escape(row["scene"]), escape(row["scheme"].upper()), escape(row["method"]), splitting(row["partition"]), str(row["ranks"])]
        cells += [or_none(row.get("steps"), str), number(row["seconds"]) + tables.busy_mark(row.get("cores"))]
        cells += [f"{number(min(row['seconds_all']))} \u2013 {number(max(row['seconds_all']))}", or_none(speed_up)]
        cells += [(percent(row["mpi_share"]), "strong") if row["scheme"] != "nlgs" else NONE, count(row["iterations_total"])]
        rows.append(cells)
    head = ["scene | scheme | method | partition | real ranks | steps | seconds, median | seconds, all | speed-up | in MPI % | iterations"]
    return tables.table(head, rows, "Measured runs") if rows else None


def speed_ups(paper, scene):
    """Every simulated point of a scene, those of the paper's method and grid first; None if there are none."""
    rows = []
    keys = sorted(
        {key for key in paper.windows if key[0] == scene and key[4] > 1},
        key=lambda key: (key[1] != "paper", key[5] != "node48", key[6], family(key[3]) != "grid", key[2], key[4], key[3]),
    )
    for _, method, scheme, partition, n, platform, slower in keys:
        point = paper.point(scene, method, scheme, partition, n, platform, slower)
        own = paper.point(scene, method, scheme, partition, n, platform, slower, method)
        if point is None:
            continue
        band = NONE if point.speed_up is None or point.low == point.high else f"{number(point.low)} \u2013 {number(point.high)}"
        cells = [escape(method), escape(scheme.upper()), splitting(partition), str(n)]
        cells += [escape(platform) + (f", {slower:g}\u00d7 slower" if slower != 1 else ""), or_none(point.iterations, count), number(1e6 * point.seconds)]
        cells += [percent(point.share), or_none(own and own.iteration_efficiency), (or_none(point.speed_up), "strong"), band, or_none(point.efficiency)]
        rows.append(cells)
    columns = "method | scheme | partition | processes | machine | iterations, total | \u00b5s an iteration"
    head = [" *5 | counted | SIMULATED *6", columns + " | in MPI % | efficiency of an iteration | speed-up | its band | efficiency"]
    return tables.table(head, rows, f"Simulated points: {scene}") if rows else None


def packings(paper):
    rows = [
        [
            escape(row["scene"]),
            count(row["grains"]),
            (escape(row["source"]), "text"),
            f"{row['solid_fraction']:.4f}",
            f"{row['solid_fraction_core']:.4f}",
            *(("loose", NONE) if row["coordination"] == 0 else (f"{row['coordination']:.3f}", percent(row["rattlers"]))),
            number(row["largest_overlap"]),
        ]
        + [(row.get("checksum", NONE), "text")]
        for row in paper.record["packings"]
    ]
    above = "scene | grains | made by | solid fraction *2 | contacts a grain | rattlers % | largest overlap | checksum"
    head = [above, " |  |  | all | core | core, without rattlers |  | mean diameters | "]
    return tables.table(head, rows, "Packings") if rows else None


def variations(paper):
    """Each variation beside the same steps of the scene as it is, by the same method, scheme and splitting."""
    rows = []
    for run in paper.record["runs"]:
        if not run["variation"]:
            continue
        base, each = paper.unvaried(run), mean(run["iterations"])
        cells = [escape(run["scene"]), tables.symbols(run["variation"]), escape(run["scheme"].upper()), escape(run["method"]), splitting(run["partition"])]
        cells += [str(run["subdomains"]), number(run["h"]), number(run["tolerance"]), str(run["steps"]), count(each), number(each / base) if base else NONE]
        cells += [count(mean(run["contacts"])), (f"{run['unconverged_steps']}", "bad" if run["unconverged_steps"] else "")]
        rows.append(cells)
    columns = "scene | variation | scheme | method | partition | subdomains | h [s] | tolerance | steps | iterations a step | over the scene as it is"
    head = [columns + " | contacts, mean | steps not converged"]
    return tables.table(head, rows, "Variations") if rows else None


def interface(paper, predicted):
    """Runs that glue what the broad phase predicts beside those on the minimal interface; None without both of one splitting."""
    rows = []
    for key, wide in sorted(predicted.counted.items(), key=lambda item: (ORDER.index(item[0][0]), item[0][4])):
        narrow = paper.counted.get(key)
        if wide["scheme"] == "nlgs" or not narrow:
            continue
        points = [view.point(*key, "node48") for view in (paper, predicted)]

        def pair(values, text=count):
            return [or_none(value, text) for value in values]

        cells = [escape(key[0]), splitting(key[3]), *pair(run["interface_grains"] for run in (narrow, wide)), *pair(total(run) for run in (narrow, wide))]
        cells += [(number(total(wide) / total(narrow)), "strong"), *pair((run.get("bytes_per_iteration") for run in (narrow, wide)))]
        cells += [*pair((point and 1e6 * point.seconds for point in points), number)]
        cells += [*((number(point.speed_up), "strong") if point and point.speed_up else NONE for point in points)]
        rows.append(cells)
    above = " *2 | shared grains, mean *2 | iterations, counted *3 | bytes an iteration *2 | \u00b5s an iteration, SIMULATED *2 | speed-up, SIMULATED *2"
    head = [above, "scene | partition" + 2 * " | minimal | predicted" + " | ratio" + 3 * " | minimal | predicted"]
    return tables.table(head, rows, "Minimal and predicted interface") if rows else None


def chance(paper):
    """Iterations from perturbed starts; None without any."""
    rows = []
    nlgs = paper.perturbed.get(("biaxial", "paper", "nlgs", "none", 1), {})
    for key, runs in sorted(paper.perturbed.items(), key=lambda item: (item[0][2] != "nlgs", item[0][4], item[0][3])):
        totals = [total(run) for run in runs.values()]
        ratios = [total(run) / total(nlgs[seed]) for seed, run in runs.items() if seed in nlgs and total(nlgs[seed])]
        cells = [escape(key[0]), escape(key[2].upper()), splitting(key[3]), str(key[4]), str(len(totals)), count(min(totals)), count(mean(totals))]
        cells += [count(max(totals)), (number(max(totals) / min(totals)), "strong"), number(mean(ratios)) if ratios else NONE]
        cells += [f"{number(min(ratios))} \u2013 {number(max(ratios))}" if ratios else NONE]
        rows.append(cells)
    columns = "scene | scheme | partition | subdomains | starts | least | mean | most | most over least | mean | least, most"
    head = [" *5 | iterations, total *4 | over NLGS from the same start *2", columns]
    return tables.table(head, rows, "Iterations from perturbed starts") if rows else None


def all_runs(paper):
    """Whole runs, counted, by scene in the order of the paper; iterations over those of NLGS by the same method."""
    rows = []
    runs = sorted(
        paper.counted.values(),
        key=lambda run: (
            ORDER.index(run["scene"]),
            run["method"] != "paper",
            run["scheme"] != "nlgs",
            family(run["partition"]) != "grid",
            run["scheme"],
            run["subdomains"],
            run["partition"],
        ),
    )
    asked = {run["tolerance"] for run in runs}
    largest = "largest \u03b7" + (f"<br><i>\u2264\u202f{number(min(asked))}</i>" if len(asked) == 1 else "")
    for run in runs:
        nlgs = paper.nlgs(run["scene"], run["method"])
        eta = number(run["residual_max"]) + (f" <i>\u2264\u202f{number(run['tolerance'])}</i>" if len(asked) > 1 else "")
        bad = run["unconverged_steps"] or run["residual_max"] is None
        cells = [escape(run["scene"]), escape(run["method"]), escape(run["scheme"].upper()), splitting(run["partition"]), str(run["subdomains"])]
        cells += ["under way" if paper.under_way(run["scene"]) else "packing", str(run["steps"]), count(total(run)), count(mean(run["iterations"]))]
        cells += [number(total(run) / total(nlgs)) if nlgs and total(nlgs) else NONE, count(mean(run["contacts"])), number(run["unknowns_mean"])]
        cells += [count(run["interface_grains"]), percent(run["interface_grains"] / run["grains"]), (eta, "bad" if bad else "")]
        cells += [(str(run["unconverged_steps"]), "bad" if run["unconverged_steps"] else "")]
        rows.append(cells)
    columns = "scene | method | scheme | partition | sub&shy;domains | start | steps | total | a step | over NLGS | contacts | unknowns | mean | %"
    head = [" *7 | iterations *3 | mean *2 | shared grains *2 |  *2", f"{columns} | {largest} | not converged"]
    return tables.table(head, rows, "Runs of the paper's scenes") if rows else None


def agreement(paper):
    entries = [
        (
            [
                escape(entry["scene"]),
                escape(entry["scheme"].upper()),
                escape(entry["method"]),
                splitting(entry["partition"]) + (", predicted interface" if entry.get("multiplicity") == "predicted" else ""),
                str(entry["subdomains"]),
            ],
            entry["rows"],
            True,
        )
        for entry in paper.record["agreement"]
    ]
    return tables.bounded(("scene", "scheme", "method", "partition", "subdomains"), entries, "Agreement of one step with NLGS") if entries else None


def statements(verdicts, links):
    """The summary: a line for each statement and its verdict; finding, reason, rule and a link to the evidence on demand. links: {anchor: label}."""
    style = {"agrees": "agrees", "differs": "differs", "cannot be told": "untold"}
    lines = ['<ul class="statements" aria-label="Statements of the paper">']
    for one in verdicts:
        link = f' <a href="#{one.anchor}">{links[one.anchor]}</a>.' if one.anchor in links else ""
        told = " ".join(escape(text) for text in (one.finding, one.why, one.rule) if text)
        lines.append(
            f'<li class="{style[one.verdict]}"><details><summary><b>{one.verdict}</b> {escape(one.statement)}</summary><p class="rule">{told}{link}</p></details></li>'
        )
    return "\n".join([*lines, "</ul>"])
