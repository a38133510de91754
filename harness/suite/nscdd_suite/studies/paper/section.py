"""The paper's section: its table and figures at full size beside its statements, and what it does not have (paper.json). Texts: captions.toml."""
import dataclasses
from html import escape

from ...page import packings
from ...page.page import Block, captions, command_list, commits, figure_block, folded, machines
from ...page.style import save
from ...page.tables import count, exceeds, number, row_ok
from ...times import CORES
from . import figures, network, tables
from .data import MILLION, SCENES, STARTS, Paper
from .verdicts import AGREES, DIFFERS, UNTOLD, verdicts

TEXTS = captions(__file__)
HTML = TEXTS["html"]
NETWORK, SPHERES = "fig1-network.h5", "isotropic-dcs-grid-2x2x2.h5"  # in the folder of the study
FIGURES = (("paper-fig-3", "Fig. 3", "biaxial", False, "disks"), ("paper-fig-4", "Fig. 4", "triaxial", True, "spheres"))
FIRST = ("paper-fig-2", "paper-table-1", "paper-fig-4", "paper-fig-3")  # what the first screen shows of them


def source(paper, entries):
    """Machine and commit of the record, and the commands of these entries of it."""
    record = paper.record
    commands = [command for entry in entries for command in (*entry.get("start", ()), entry.get("command")) if command]
    made_by = [entry for entry in entries if "commit" in entry] or [record]
    return f'<div class="from">{escape(machines([record]))}; commit {escape(commits(made_by))}. From {command_list([record["command"], *commands])}</div>'


def block(paper, anchor, content, entries, text="", make=Block, kinds=(), wide=True, **told):
    """The table or figure of an anchor with its texts, those of `text` where several share them; nothing where it is not there."""
    if not content:
        return ""
    texts = TEXTS[text or anchor]
    files = [escape(str(value)) for key, value in paper.record["platform"].items() if key != "name"]
    told["platform"] = f"Simulated: <code>{'</code>, <code>'.join(files)}</code>. "
    caption, title = (texts[name].format(**told) for name in ("caption", "title"))
    return make(content, title, caption, source(paper, entries), kinds or texts["kinds"], wide=wide, anchor=anchor)


def warning(text, more=""):
    return f'<div class="verdict open"><b>{text}</b>{more}</div>'


def provenance(paper):
    """Which commits and machines made the rows, where it was not one."""
    record = paper.record
    if len(record.get("commits", ())) > 1:
        more = f" {escape(commits([record]))}. Each caption names those of its rows, the record that of each row."
        yield warning(f"Rows of {len(record['commits'])} commits:", more)
    if len(record.get("counted_on", ())) > 1:
        yield HTML["counted_on"].format(machines=escape(" and ".join(record["counted_on"])))


def communication(paper):
    windows = [w for w in paper.own_windows if w["scene"] == "isotropic" and w["method"] == "paper" and w["platform"] == "node48"]
    yield block(paper, "paper-table-1", tables.table_1(paper), windows)
    if html := tables.operations(paper):
        yield block(paper, "paper-operations", html, windows)
    if below := tables.below_the_paper(paper):
        least, most = map(number, below)
        yield HTML["below_the_paper"].format(least=least, most=most) + HTML["with_interface" if tables.interface(paper) else "without_interface"]
    yield block(paper, "paper-measured", tables.measured(paper), paper.record["measured"], cores=100 * CORES)


def multiplicities(paper, drawn, spheres, out):
    """Figs. 1 and 2, and what gluing the predicted interface costs beside the minimal one."""
    image, told = "", {}
    if drawn:
        image = save(network.draw(drawn), out, "paper-fig1")
        told = network.counts(drawn) | {"steps_since": drawn["state"]["rough"]["steps_since"][0]}
    yield block(paper, "paper-fig-1", image, [], make=figure_block, **told)
    glued = [entry for kind in ("runs", "windows") for entry in paper.record[kind] if entry.get("multiplicity") == "predicted"]
    yield block(paper, "paper-interface", tables.interface(paper), glued)
    image = save(packings.draw_spheres(spheres), out, "paper-fig2", "png") if spheres else ""
    yield block(paper, "paper-fig-2", image, [], make=figure_block, wide=False, grains=count(len(spheres["x"]) if spheres else 0))


def scalability(paper, out):
    for anchor, label, scene, mean, grains in FIGURES:
        figure, drawn = figures.draw_scene(paper, scene, mean)
        runs = [run for run in paper.counted.values() if run["scene"] == scene]
        windows = [w for w in paper.own_windows if w["scene"] == scene]
        told = {
            "label": label,
            "test": scene,
            "scene": scene.capitalize(),
            "size": f"{count(runs[0]['grains'])} {grains}, {runs[0]['steps']} steps. " if runs else "",
            "start": f"The runs start from {STARTS[scene]}. " if paper.under_way(scene) else "",
            "over": "mean over the steps" if mean else "all steps",
        }
        image = figure and save(figure, out, f"paper-{scene}")
        yield block(paper, anchor, image, [*windows, *runs], "paper-fig", figure_block, drawn, **told)


def points(paper):
    for scene in ("biaxial", "triaxial", "isotropic", MILLION):
        if html := tables.speed_ups(paper, scene):
            html = folded(html, f"points of the {scene} test", most=0)
            windows = [w for w in paper.own_windows if w["scene"] == scene]
            yield block(paper, f"paper-points-{scene}", html, windows, "paper-points", scene=scene.capitalize())


def beyond(paper, out):
    """What the paper does not have, on the same axes."""
    yield "<h3>Beyond the paper: other partitions, the accelerated method, a cluster</h3>"
    first = True
    for scene in ("triaxial", "biaxial"):
        figure = figures.draw_beyond(paper, scene)
        image = figure and save(figure, out, f"paper-{scene}-beyond")
        windows = [w for w in paper.record["windows"] if w["scene"] == scene and w["scheme"] != "ccs"]
        kinds = ("simulated", "counted") if any(w["subdomains"] > 1 for w in windows) else ("counted",)
        anchor = "paper-beyond" if first else f"paper-beyond-{scene}"
        yield block(paper, anchor, image, windows, "paper-beyond", figure_block, kinds, scene=scene.capitalize(), test=scene)
        first = first and not image


def rest(paper):
    record, plain = paper.record, list(paper.counted.values())
    started = [scene for scene in SCENES if paper.under_way(scene)]
    start = f"The {' and the '.join(started)} test start{'s' * (len(started) == 1)} from {STARTS[started[0]]}; " if started else ""
    start += "what they count is not what they would from rest. " if started else ""
    for name, entries in (
        ("scenes", [run for run in plain if run["scheme"] == "nlgs" and run["method"] == "paper"]),
        ("all_runs", plain),
        ("chance", [run for run in record["runs"] if run.get("perturbed")]),
        ("agreement", record["agreement"]),
        ("packings", record["packings"]),
        ("variations", [run for run in record["runs"] if run["variation"]]),
    ):
        html = getattr(tables, name)(paper)
        yield block(paper, f"paper-{name.removeprefix('all_')}", html and folded(html), entries, start=start)


def summary(paper, judged, blocks):
    """The first screen: the verdicts in a sentence, pictures beside the paper's words, and a line for each statement."""
    there = {block.anchor: block for block in blocks if isinstance(block, Block)}
    agree, differ, untold = (sum(one.verdict == verdict for one in judged) for verdict in (AGREES, DIFFERS, UNTOLD))
    quick = "From a quick job with small sizes, made to test the command: its verdicts say nothing of the paper."
    tiles = "".join(there[anchor].tile() for anchor in FIRST if anchor in there)
    return (
        f'<h2 id="verdicts">What the paper says, and what we find</h2>{warning(quick) if paper.record["quick"] else ""}<p class="first">Of {len(judged)} '
        f'statements of the paper {agree} agree with what we find, {differ} differ, and {untold} cannot be told.</p><div class="tiles">{tiles}</div>'
        f"<p>Each verdict is computed from the record by a rule, which opens with its line. {HTML['text_only']}</p>"
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
            steps = f"{run['unconverged_steps']} of {run['steps']} steps"
            yield f"paper: {run['scene']} {run['scheme']} {run['partition']}, {run['method']}: not converged in {steps}"


def section(results, out):
    """All blocks of the paper; the summary is made when they have their numbers."""
    records = results.records("paper")
    for record in records:
        for place, run in enumerate(record["runs"]):
            record.check_steps(run, ("iterations", "contacts"), f"runs/{place}/")
        results.failures += failures(record)
    if len(records) != 1:
        names = ", ".join(record["command"] for record in records)
        return [warning("Not one record of the paper:", f" {len(records)}, by {escape(names)}.")] if records else []
    paper, folder = Paper(records[0]), results.files(records[0])
    drawn = network.predict(folder / NETWORK) if (folder / NETWORK).is_file() else None
    spheres = packings.read_state(folder / SPHERES) if (folder / SPHERES).is_file() else None
    parts = [warning("From a quick job with small sizes, made to test the command.")] if paper.record["quick"] else []
    parts += [*provenance(paper), *communication(paper), *multiplicities(paper, drawn, spheres, out), *scalability(paper, out)]
    parts += [*points(paper), *beyond(paper, out), *rest(paper)]
    judged = verdicts(paper, drawn and network.counts(drawn), spheres and packings.sphere_counts(spheres))
    results.summary["statements"] = [dataclasses.asdict(one) for one in judged]
    results.opening = lambda: summary(paper, judged, parts)
    return parts
