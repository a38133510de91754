"""The paper's section: its table and figures at full size beside its statements, and what it does not have (paper.json)."""
import dataclasses
from html import escape

from ...page import packings
from ...page.page import Block, command_list, commits, figure_block, machines, missing, table_block
from ...page.style import save
from ...page.tables import count, exceeds, number, row_ok
from ...times import CORES
from . import figures, network, tables
from .data import MILLION, SCENES, STARTS, Paper
from .verdicts import AGREES, DIFFERS, UNTOLD, verdicts

NETWORK, SPHERES = "fig1-network.h5", "isotropic-dcs-grid-2x2x2.h5"  # in the folder of the study
FIGURES = (("paper-fig-3", "Fig. 3", "biaxial", False, "disks"), ("paper-fig-4", "Fig. 4", "triaxial", True, "spheres"))


def source(paper, entries):
    """Machine and commit of the record, and the commands of these entries of it."""
    record = paper.record
    commands = [command for entry in entries for command in (*entry.get("start", ()), entry.get("command")) if command]
    made_by = [entry for entry in entries if "commit" in entry] or [record]
    return f'<div class="from">{escape(machines([record]))}; commit {escape(commits(made_by))}. From ' f"{command_list([record['command'], *commands])}</div>"


def provenance(paper):
    """Which commits made the rows, where it was not one."""
    record = paper.record
    rows = [row for kind in ("packings", "runs", "agreement", "windows", "measured") for row in record[kind]]
    if rows and not any("commit" in row for row in rows):
        yield (
            "<p>This record names one commit for all of its rows. Files that were there already were used again, so some may have been made by "
            "an earlier one.</p>"
        )
    elif len(record.get("commits", ())) > 1:
        yield (
            f'<div class="verdict open"><b>Rows of {len(record["commits"])} commits:</b> {escape(commits([record]))}. Each caption names those '
            "of its rows, the record that of each row.</div>"
        )
    if len(record.get("counted_on", ())) > 1:
        yield (
            f"<p>Counted and simulated rows were made on {escape(' and '.join(record['counted_on']))}, by one compiler and with vectors of one width. "
            "Captions name the machine of the measured times.</p>"
        )


def platform(paper):
    files = [escape(str(value)) for key, value in paper.record["platform"].items() if key != "name"]
    return f"Simulated: <code>{'</code>, <code>'.join(files)}</code>. "


def communication(paper):
    html = tables.table_1(paper)
    if not html:
        yield missing("Table 1 of the paper, simulated iterations of the isotropic compaction (scripts/suite run paper)")
        return
    windows = [w for w in paper.own_windows if w["scene"] == "isotropic" and w["method"] == "paper" and w["platform"] == "node48"]
    caption = (
        "Share of an iteration spent in MPI, in per cent: in all, waiting for other ranks, and transferring; mean over the ranks, isotropic "
        "compaction by the paper's method and splitting. The paper's numbers, in grey, are of whole runs of 500 steps of 55\u202f000 spheres; of "
        "the machine of its section 5 it says \u201c48 cores AMD processor\u201d. Three times slower is our guess at its cores: the paper was given in "
        "June 2012. " + platform(paper)
    )
    yield table_block(html, "Share of time in MPI (Table 1 of the paper)", caption, source(paper, windows), ("simulated",), wide=True, anchor="paper-table-1")
    html = tables.operations(paper)
    if html:
        caption = (
            "An iteration of Table 1 with present cores: messages of all ranks, waiting and "
            "transferring as means over the ranks. Exchanges go from rank to rank, all else is collective. Waiting for the scatter begins when "
            "a rank has sent what is gathered. " + platform(paper)
        )
        kinds = ("counted", "simulated")
        yield table_block(html, "Messages and time by operation", caption, source(paper, windows), kinds, wide=True, anchor="paper-operations")
    below = tables.below_the_paper(paper)
    if below:
        yield (
            f"<p>By DCS our shares with present cores are {number(below[0])} to {number(below[1])} times below the paper's. This program does not do "
            "what the paper's code did:</p><ul>"
            "<li>Grains are shared by the contacts of the narrow phase alone. The paper shares all that the rough one predicts, and leaves the "
            "minimal interface to the future (its section 3.2; METHOD.md, section 6.7).</li>"
            "<li>Contacts of shared grains are swept first, and their messages are under way while the rest is swept (METHOD.md, section 6.6). "
            "Only what the sweep does not hide counts as time in MPI.</li>"
            "<li>Messages lie where they are packed and read, one a neighbour. A message is copied into memory that "
            "the ranks of a node share, and out of it.</li>"
            "<li>The simulated node has no contention: that cores share the bandwidth of their memory is left out.</li></ul>"
            + (
                '<p>What the first makes, <a href="#paper-interface">runs on the predicted interface</a> tell. These results do not tell how much each of '
                "the others saves.</p>"
                if tables.interface(paper, Paper(paper.record, "predicted"))
                else "<p>These results do not tell how much each of them saves.</p>"
            )
        )


def real_ranks(paper):
    html = tables.measured(paper)
    if not html:
        yield missing("measured runs on real ranks (scripts/suite run paper)")
        return
    caption = (
        "Wall-clock times on real cores of some further steps after the last one of sequential NLGS; how many, the table says. Speed-up: over "
        "sequential NLGS by the paper's method of the same scene. In MPI: mean over the ranks, of all of these steps. "
        f"Without speed-up: a process had less than {100 * CORES:.0f} % of its core, or the reference had."
    )
    yield table_block(html, "Real ranks", caption, source(paper, paper.record["measured"]), ("measured",), wide=True, anchor="paper-measured")


def glued(paper):
    """What gluing the predicted interface costs beside the minimal one."""
    html = tables.interface(paper, Paper(paper.record, "predicted"))
    if not html:
        return missing(
            "runs that glue the interface which the broad phase predicts, as the paper does (scripts/suite run paper --only interface); all "
            "others glue the minimal one"
        )
    runs = [run for run in paper.record["runs"] if run.get("multiplicity") == "predicted"]
    windows = [window for window in paper.record["windows"] if window.get("multiplicity") == "predicted"]
    caption = (
        "DCS by the paper's method. Minimal: a grain has a copy in each subdomain where the narrow phase finds a contact of it, as in all other runs "
        "of this page. Predicted: where the broad phase finds a candidate, as in the paper (its section 3.1); masses are split by that number, and "
        "copies without a contact are glued too. " + platform(paper)
    )
    return table_block(
        html, "Minimal and predicted interface", caption, source(paper, [*runs, *windows]), ("counted", "simulated"), wide=True, anchor="paper-interface"
    )


def multiplicities(paper, results, out):
    """Figs. 1 and 2; their counts, or None, are the first thing yielded."""
    path, spheres = (results.files(paper.record) / name for name in (NETWORK, SPHERES))
    state = packings.read_state(spheres) if spheres.is_file() else None
    counted = packings.sphere_counts(state) if state else None
    if not path.is_file():
        yield None, counted
        yield missing(f"Fig. 1 of the paper, the state paper/{NETWORK}")
    else:
        drawn = network.predict(path)
        found = network.counts(drawn)
        yield found, counted
        caption = (
            f"A network of {found['grains']} disks. (a) The {found['candidates']} candidates of the last broad phase, where the disks "
            "were then: pairs, and disks at walls, closer than the skin. Each has the colour of the subdomain that owns the middle of the two "
            "centres; each disk that of the number of subdomains of its candidates, its predicted multiplicity. (b) The "
            f"{found['contacts']} contacts of the last step, {drawn['rough']['steps_since']} steps later, and the multiplicities that they "
            f"give; ringed, the {found['wrong']} wrongly predicted. Of {found['boundary_predicted']} predicted boundary disks "
            f"{found['not_boundary']} are not on the minimal interface. In parentheses: disks in (a), in (b). Dashed: the grid."
        )
        heading = "Multiplicities before and after the narrow phase (Fig. 1 of the paper)"
        yield figure_block(save(network.draw(drawn), out, "paper-fig1"), heading, caption, source(paper, []), ("counted",), wide=True, anchor="paper-fig-1")
    yield glued(paper)
    if not state:
        yield missing(f"Fig. 2 of the paper, the state paper/{SPHERES}")
        return
    caption = (
        f"{count(len(state['x']))} spheres under isotropic compaction, grid 2x2x2: (a) subdomain index, of a shared grain the lowest of those that hold it; "
        "(b) multiplicity number, with the number of grains in parentheses. The vertical quarter towards the reader is taken out."
    )
    image = save(packings.draw_spheres(state), out, "paper-fig2", "png")
    yield figure_block(image, "Subdomains and multiplicity (Fig. 2 of the paper)", caption, source(paper, []), ("counted",), anchor="paper-fig-2")


def scalability(paper, out):
    for anchor, label, scene, mean, grains in FIGURES:
        figure, drawn = figures.draw_scene(paper, scene, mean)
        if figure is None:
            yield missing(f"{label} of the paper, the {scene} test (scripts/suite run paper)")
            continue
        runs = [run for run in paper.counted.values() if run["scene"] == scene]
        size = f"{count(runs[0]['grains'])} {grains}, {runs[0]['steps']} steps. " if runs else ""
        windows = [w for w in paper.own_windows if w["scene"] == scene]
        kinds = tuple(kind for kind, there in zip(("simulated", "counted", "measured"), drawn) if there)
        start = f"The runs start from {STARTS[scene]}. " if paper.under_way(scene) else ""
        caption = (
            f"{size}{start}The paper's method and grid. (a) Speed-up on the simulated node of 48 cores at equal error: T<sub>NLGS</sub> "
            "I<sub>NLGS</sub> / (T<sub>N</sub> I<sub>N</sub>), T the seconds of an iteration, I the iterations of the whole run; bands: half "
            "and twice the latency, half and twice the bandwidth, noise, where simulated. Lines go through the splitting that shares fewest "
            "grains, small marks are the others. Where a scheme was not counted, the iterations of the other are taken. (b) Iterations of "
            f"whole runs, {'mean over the steps' if mean else 'all steps'}. (c) Real ranks on real cores. " + platform(paper)
        )
        heading = f"{scene.capitalize()} test: speed-up and iterations ({label} of the paper)"
        yield figure_block(save(figure, out, f"paper-{scene}"), heading, caption, source(paper, [*windows, *runs]), kinds, wide=True, anchor=anchor)


def points(paper):
    for scene in ("biaxial", "triaxial", "isotropic", MILLION):
        html = tables.speed_ups(paper, scene)
        if html:
            caption = (
                "All that was simulated on the machines as given. Efficiency of an iteration: T<sub>NLGS</sub> / (N T<sub>N</sub>), both by "
                "the same method. Speed-up: at equal error over sequential NLGS by the paper's method, so that methods can be compared; "
                "efficiency: that over the number of processes. " + platform(paper)
            )
            html = f"<details><summary>{html.count('<tr>') - 2} points of the {scene} test</summary>{html}</details>"
            windows = [w for w in paper.own_windows if w["scene"] == scene]
            heading = f"{scene.capitalize()} test, every simulated point"
            yield table_block(html, heading, caption, source(paper, windows), ("simulated", "counted"), wide=True, anchor=f"paper-points-{scene}")


def beyond(paper, out):
    """What the paper does not have, on the same axes."""
    yield "<h3>Beyond the paper: other partitions, the accelerated method, a cluster</h3>"
    first = True
    for scene in ("triaxial", "biaxial"):
        figure = figures.draw_beyond(paper, scene)
        if figure is None:
            yield missing(f"the {scene} test with other partitions, the accelerated method or on a cluster (scripts/suite run paper)")
            continue
        windows = [w for w in paper.record["windows"] if w["scene"] == scene and w["scheme"] != "ccs"]
        simulated = [w for w in windows if w["subdomains"] > 1]
        caption = (
            "DCS. Speed-up at equal error over sequential NLGS by the paper's method, whatever the method; bands as before. Solid: the "
            "paper's method, dashed: accelerated, crosses: the paper's method and its predicted interface. " + platform(paper)
        )
        image = save(figure, out, f"paper-{scene}-beyond")
        heading = f"{scene.capitalize()} test: partitions, methods and machines"
        kinds = ("simulated", "counted") if simulated else ("counted",)
        yield figure_block(image, heading, caption, source(paper, windows), kinds, wide=True, anchor="paper-beyond" if first else f"paper-beyond-{scene}")
        first = False


def rest(paper):
    record = paper.record
    plain = list(paper.counted.values())
    varied = [run for run in record["runs"] if run["variation"]]
    perturbed = [run for run in record["runs"] if run.get("perturbed")]
    nlgs = [run for run in plain if run["scheme"] == "nlgs" and run["method"] == "paper"]
    started = [scene for scene in SCENES if paper.under_way(scene)]
    start = (
        f"The {' and the '.join(started)} test start{'s' * (len(started) == 1)} from {STARTS[started[0]]}; what they count is not what they would "
        "from rest. "
        if started
        else ""
    )
    for html, entries, title, kinds, anchor, caption, lacks in (
        (
            tables.scenes(paper),
            nlgs,
            "The scenes as run",
            ("counted",),
            "paper-scenes",
            "What the paper does not say and we chose; units are those of unit density, pressure and mean diameter. <code>cases/paper</code> argues the "
            "choices, the table of variations shows how much some of them matter. Inertial number: rate of strain times mean diameter times the "
            "root of density over pressure. By sequential NLGS.",
            "sequential runs (scripts/suite run paper)",
        ),
        (
            tables.all_runs(paper),
            plain,
            "Whole runs",
            ("counted",),
            "paper-runs",
            start + "Iterations of all steps, and over those of sequential NLGS by the same method. Unknowns: impulse components of all contacts.",
            "whole runs (scripts/suite run paper)",
        ),
        (
            tables.chance(paper),
            perturbed,
            "One draw or another: perturbed starts",
            ("counted",),
            "paper-chance",
            start
            + "Whole runs of the biaxial test, each start with every coordinate off by up to 10\u207b\u2079 of a radius: rigid grains amplify it, so each is "
            "another draw of the same test. Counts of two splittings that differ by less than the most over the least of one of them tell nothing.",
            "runs from perturbed starts, which tell what of a count is chance (scripts/suite run paper --only chance)",
        ),
        (
            tables.agreement(paper),
            record["agreement"],
            "Agreement of one step with NLGS",
            ("computed",),
            "paper-agreement",
            "One step of each, from the last state of sequential NLGS, by <code>nscdd compare</code>, with the bound that it must keep.",
            "comparisons with NLGS (scripts/suite run paper)",
        ),
        (
            tables.packings(paper),
            record["packings"],
            "Packings",
            ("counted",),
            "paper-packings",
            "The core is two diameters from the walls. Loose: no grain touches another yet. Overlaps are those "
            "before one common shrink of the radii, after which there is none.",
            "packings (scripts/suite run paper)",
        ),
        (
            tables.variations(paper),
            varied,
            "Variations",
            ("counted",),
            "paper-variations",
            start + "Runs with one thing changed, from the same start unless named. Iterations a step are compared with the same steps of the same scheme and "
            "splitting on the scene as it is. The paper does not say, of all three: friction, walls, h, tolerance and of what, and the state at the start; of the "
            "compaction: pressure (it and h are one parameter, h (p/\u03c1)<sup>1/2</sup>/d, as grains are rigid) and the solid fraction at the start; of the two "
            "compressions: the speed of the top, which makes the inertial number.",
            "variations of the scenes (scripts/suite run paper)",
        ),
    ):
        if not html:
            yield missing(lacks)
            continue
        if html.count("<tr>") > 40:
            html = f"<details><summary>{html.count('<tr>') - 2} rows</summary>{html}</details>"
        yield table_block(html, title, caption, source(paper, entries), kinds, wide=True, anchor=anchor)


TEXT_ONLY = (
    "Of the paper this page has the text alone. The numbers behind its Figs. 2, 3 and 4 are not in it, so curves are judged by what the text says of them."
)


FIRST = ("paper-fig-2", "paper-table-1", "paper-fig-4", "paper-fig-3")  # what the first screen shows of them


def summary(paper, judged, blocks):
    """The first screen: the verdicts in a sentence, pictures beside the paper's words, and a line for each statement."""
    there = {block.anchor: block for block in blocks if isinstance(block, Block)}
    count_of = {verdict: sum(one.verdict == verdict for one in judged) for verdict in (AGREES, DIFFERS, UNTOLD)}
    quick = (
        '<div class="verdict open"><b>From a quick job with small sizes, made to test the command: its verdicts say nothing of the paper.' "</b></div>"
        if paper.record["quick"]
        else ""
    )
    tiles = "".join(there[anchor].tile() for anchor in FIRST if anchor in there)
    return (
        f'<h2 id="verdicts">What the paper says, and what we find</h2>{quick}<p class="first">Of {len(judged)} statements of the paper {count_of[AGREES]} agree '
        f'with what we find, {count_of[DIFFERS]} differ, and {count_of[UNTOLD]} cannot be told.</p><div class="tiles">{tiles}</div>'
        f"<p>Each verdict is computed from the record by a rule, which opens with its line. {TEXT_ONLY}</p>"
        + tables.statements(judged, {anchor: block.label for anchor, block in there.items()})
    )


def failures(record):
    """A line for each bound that is exceeded and each run that did not converge; variations may."""
    for entry in record["agreement"]:
        for row in entry["rows"]:
            if not row_ok(row):
                yield f"paper: {entry['scene']} {entry['scheme']} {entry['partition']}, one step: {exceeds(row)}"
    for run in record["runs"]:
        if run["unconverged_steps"] and not run["variation"]:
            yield (
                f"paper: {run['scene']} {run['scheme']} {run['partition']}, {run['method']}: not converged in {run['unconverged_steps']} of "
                f"{run['steps']} steps"
            )


def section(results, out):
    """All blocks of the paper; the summary is made when they have their numbers."""
    records = results.records("paper")
    for record in records:
        for place, run in enumerate(record["runs"]):
            record.check_steps(run, ("iterations", "contacts"), f"runs/{place}/")
        results.failures += failures(record)
    if len(records) != 1:
        names = ", ".join(record["command"] for record in records)
        return [missing(f"one record of the paper; there are {len(records)}: {names}")] if records else []
    paper = Paper(records[0])
    pictures = multiplicities(paper, results, out)
    found = next(pictures)
    parts = [
        *provenance(paper),
        *communication(paper),
        *real_ranks(paper),
        *pictures,
        *scalability(paper, out),
        *points(paper),
        *beyond(paper, out),
        *rest(paper),
    ]
    if paper.record["quick"]:
        parts.insert(0, '<div class="verdict open"><b>From a quick job with small sizes, made to test the command.</b></div>')
    judged = verdicts(paper, *found)
    results.summary["statements"] = [dataclasses.asdict(one) for one in judged]
    results.opening = lambda: summary(paper, judged, parts)
    return parts
