"""Tables of the page, as HTML; and the same numbers for summary.json."""
import re
from html import escape
from pathlib import Path

from .times import busy
from .load import row_ok
from .style import SCHEMES

# [Visseq14] Table 1: share of time in MPI, CCS and DCS, in per cent.
PAPER_TABLE_1 = {1: (0.0, 0.0), 3: (31.3, 14.0), 4: (35.6, 9.1), 8: (58.3, 18.4)}
SUPERSCRIPT = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")
NONE = "\u2013"
PARTS = {word.replace("-", ""): word.replace("-", "&shy;") for word in (
    "sub-domains", "iter-ations", "iter-ates", "trans-ferring", "trans-port", "acceler-ated", "con-verged", "con-vergence", "parti-tion",
    "solu-tion", "conver-ged", "rel-ative", "quan-tity", "expect-ed", "mes-sages", "inter-face", "con-tacts", "trans-fer")}


def number(value):
    """Three significant digits; powers of ten written out below a thousandth and from a million on."""
    if value is None:
        return "not finite"
    if value == 0 or 1e-3 <= abs(value) < 1e6:
        return f"{value:.3g}" if abs(value) < 1000 else count(value)
    mantissa, exponent = f"{value:.2e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".")
    times = "" if mantissa == "1" else f"{mantissa}\u202f\u00d7\u202f"
    return f"{times}10{str(int(exponent)).translate(SUPERSCRIPT)}"


def count(value):
    """Whole number with narrow no-break spaces between thousands; one decimal below 100 if it has any."""
    text = f"{value:,.1f}" if value < 100 and value != int(value) else f"{value:,.0f}"
    return text.replace(",", "\u202f")


def symbols(text):
    """HTML of what programs write: |V - V_ref|_M, eta, <=, 1e-4."""
    text = re.sub(r"\b1e-(\d+)\b", lambda power: "10" + f"-{power[1]}".translate(SUPERSCRIPT), escape(text))
    text = re.sub(r"\b([Vs])_(ref|free)\b", r"<i>\1</i><sub>\2</sub>", text)
    text = re.sub(r"(?<=\|)([Vs])\b|\b(V)\b(?!<)", lambda name: f"<i>{name[1] or name[2]}</i>", text)
    text = re.sub(r"\|_M(\^2)?", lambda norm: "|<sub><i>M</i></sub>" + ("\u00b2" if norm[1] else ""), text)
    return re.sub(r"\beta\b", "\u03b7", text).replace("&lt;=", "\u2264").replace(" - ", " \u2212 ")


def by_number(text):
    """Key of a sort that puts 2 before 16."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", text)]


def percent(value):
    return f"{100 * value:.1f}"


def parted(title):
    """With places where its long words may be parted, so that many columns fit."""
    return re.sub("|".join(PARTS), lambda word: PARTS[word[0]], title)


def table(head, rows, label):
    """head: rows of (text, columns spanned); rows: lists of cells, text or (text, class). Text is HTML. Long text is set left."""
    def cell(content):
        text, style = content if isinstance(content, tuple) else (content, "")
        if not style and len(re.sub("<[^>]*>", "", text)) > 32:
            style = "text"
        return f'<td class="{style}">{text}</td>' if style else f"<td>{text}</td>"
    lines = [f'<table aria-label="{escape(label)}">', "<thead>"]
    for row in head:
        lines.append("<tr>" + "".join(
            f'<th colspan="{span}" class="{"group" if text else ""}">{parted(text)}</th>' if span > 1 else f"<th>{parted(text)}</th>"
            for text, span in row) + "</tr>")
    lines += ["</thead>", "<tbody>"]
    lines += ["<tr>" + "".join(map(cell, row)) + "</tr>" for row in rows]
    return "\n".join([*lines, "</tbody>", "</table>"])


def mpi_share(results, role):
    """Table 1 of the paper: HTML, values for the summary, and the runs used."""
    timed = {scheme: results.timed(role, scheme) for scheme in SCHEMES}
    used = [run for runs in timed.values() for run in runs.values()]
    numbers = sorted({*PAPER_TABLE_1, *(n for runs in timed.values() for n in runs)})
    rows, values = [], []
    for n in numbers:
        row, value = [str(n)], {"subdomains": n}
        for scheme in SCHEMES:
            run = timed[scheme].get(n)
            if run is None:
                row += [NONE] * 3
                continue
            seconds, total = run["seconds"], max(run["seconds"]["total"], 1e-300)
            shares = run["mpi_fraction"], seconds["mpi_wait"] / total, seconds["mpi_transfer"] / total
            row += [(percent(shares[0]), "strong"), percent(shares[1]), percent(shares[2])]
            value[scheme] = dict(zip(("mpi", "wait", "transfer"), shares))
        paper = PAPER_TABLE_1.get(n)
        row += [(f"{p:.1f}" if n > 1 else "0", "faint") for p in paper] if paper else [(NONE, "faint")] * 2
        rows.append(row)
        if len(value) > 1:
            values.append(value)
    head = [[("", 1), ("CCS, measured here", 3), ("DCS, measured here", 3),
             ("paper<br>(55\u2009000 spheres, 48-core machine)", 2)],
            [("subdomains", 1)] + [("in MPI %", 1), ("waiting %", 1), ("transferring %", 1)] * 2
            + [("CCS %", 1), ("DCS %", 1)]]
    return table(head, rows, "Share of time in MPI"), values, used


def counted(results, role):
    """What the decomposition costs, counted: HTML, values for the summary, and the runs used."""
    runs = {scheme: results.counted(role, scheme) for scheme in SCHEMES}
    numbers = sorted({n for by_n in runs.values() for n in by_n})
    first = runs["dcs"].get(1) or runs["ccs"].get(1)
    rows, values = [], []
    for n in numbers:
        both = [runs[scheme].get(n) for scheme in SCHEMES]
        any_run = both[1] or both[0]
        work = any_run["work_per_rank"]
        share = max(work) / sum(work) if sum(work) else 0.0
        ratio = any_run.total_iterations / first.total_iterations if first and first.total_iterations else None
        row = [str(n), escape(any_run["partition"]), count(any_run["interface_grains"]),
               percent(any_run["interface_share"]), f"{percent(share)} <i>({percent(1 / n)})</i>",
               count(any_run.mean_iterations), NONE if ratio is None else f"{ratio:.2f}"]
        for key in ("messages_per_iteration", "bytes_per_iteration"):
            row += [NONE if run is None else count(run[key]) for run in both]
        rows.append(row)
        values.append({"subdomains": n, "interface_share": any_run["interface_share"], "largest_work_share": share,
                       "iterations": any_run.total_iterations, "ratio_to_one_subdomain": ratio,
                       **{scheme: {key: run[key] for key in ("messages_per_iteration", "bytes_per_iteration")}
                          for scheme, run in zip(SCHEMES, both) if run}})
    head = [[("", 1), ("", 1), ("interface grains", 2), ("largest share", 1), ("iterations per step", 2),
             ("messages per iteration", 2), ("bytes per iteration", 2)],
            [("subdomains", 1), ("partition", 1), ("mean", 1), ("% of all", 1), ("of work % <i>(even)</i>", 1),
             ("mean", 1), ("to 1 subd.", 1), ("CCS", 1), ("DCS", 1), ("CCS", 1), ("DCS", 1)]]
    used = [run for by_n in runs.values() for run in by_n.values()]
    return table(head, rows, "Messages and bytes per iteration"), values, used


def compared_steps(compare):
    """In words: one step from the reference's state, or the whole run, which differs more, as answers are not unique."""
    steps, last = compare.get("steps"), compare.get("last_step")
    if steps is None or last is None:
        return NONE
    return "one step, from the reference's last state" if steps == 1 < last else f"whole run, {count(steps)} step{'s' * (steps > 1)}"


def bounded(leading, entries, label):
    """A line for each entry (leading cells, rows of quantity, value and bound, whether it says ok), a column for each quantity; the
    bound in the head if all share it."""
    quantities = list(dict.fromkeys(row["quantity"] for _, own, _ in entries for row in own))
    bounds = {q: {row["bound"] for _, own, _ in entries for row in own if row["quantity"] == q} for q in quantities}
    lines = []
    for first, own, ok in entries:
        by_quantity = {row["quantity"]: row for row in own}
        cells = list(first)
        for quantity in quantities:
            row = by_quantity.get(quantity)
            if row is None:
                cells.append(NONE)
                continue
            text = number(row["value"])
            if len(bounds[quantity]) > 1:
                text += f" <i>\u2264\u202f{number(row['bound'])}</i>"
            cells.append(text if row_ok(row) else (text, "bad"))
        good = ok and all(map(row_ok, own))
        lines.append([*cells, ("ok", "good") if good else ("fails", "bad")])
    titles = []
    for quantity in quantities:
        name, _, formula = quantity.partition(", ")
        parts = [symbols(name), *([f"<i>{symbols(formula)}</i>"] if formula else [])]
        if len(bounds[quantity]) == 1:
            parts.append(f"<i>\u2264\u202f{number(min(bounds[quantity]))}</i>")
        titles.append("<br>".join(parts))
    return table([[(title, 1) for title in (*leading, *titles, "")]], lines, label)


def agreement(compares):
    """Two rows per run: one step from the reference's state, and the whole run."""
    entries = [([escape(Path(c["candidate"]).stem), (compared_steps(c), "text"), str(c["subdomains"]), escape(c["transport"])], c["rows"], c["ok"])
               for c in sorted(compares, key=lambda c: by_number(Path(c["candidate"]).stem))]
    return bounded(("run", "compared", "subdomains", "transport"), entries, "Agreement with the reference")


def busy_mark(cores):
    """Beside a time that is not believed."""
    return f" <i>busy: {100 * cores:.0f} % of a core</i>" if busy(cores) else ""


def all_runs(runs):
    """Every run with its residual; seconds only where they were measured."""
    rows = []
    for run in runs:
        fine = not list(run.problems())
        eta = f"{number(run.eta_max)} <i>\u2264\u202f{number(run['tolerance'])}</i>"
        rows.append([
            escape(run.name), str(run["subdomains"]), escape(run["transport"]), escape(run["partition"]),
            escape(run["interface"]), count(max(run["contacts"], default=0)), str(run["steps"]),
            count(run.total_iterations), str(run["check_every"]), (eta, "" if fine else "bad"),
            f"{run['seconds']['total']:.2f}" if run.measured else "machine busy" if run.busy else NONE, ("yes", "good") if fine else ("no", "bad")])
    head = [[(text, 1) for text in (
        "run", "subd.", "transport", "partition", "interface", "contacts,<br>most", "steps", "iterations",
        "checked<br>every", "largest \u03b7", "seconds", "converged")]]
    return table(head, rows, "All runs")


def acceleration(record):
    """Table 9: both methods side by side, and their ratios; growth is over the iterations of one subdomain."""
    rows = {(row["scene"], row["subdomains"], row["method"]): row for row in record["rows"]}
    lines = []
    for scene, subdomains in dict.fromkeys(key[:2] for key in rows):
        plain, fast, alone = (rows.get(key) for key in ((scene, subdomains, "paper"), (scene, subdomains, "auto"), (scene, 1, "auto")))
        if not plain or not fast:
            continue
        pair = [number(value) if row["converged"] else f"{number(value)} (not converged)"
                for row, value in ((plain, plain["iterations"] / plain["steps"]), (fast, fast["iterations"] / fast["steps"]))]
        lines.append([escape(scene), f"{plain['start']}, {plain['steps']}", count(plain["grains"]), count(round(plain["contacts"])),
                      str(subdomains), *pair, number(fast["iterations"] / plain["iterations"]),
                      number(fast["iterations"] / alone["iterations"]) if alone else NONE,
                      number(plain["cpu"]), number(fast["cpu"]), number(fast["cpu"] / plain["cpu"]) if plain["cpu"] else NONE])
    head = [[("", 5), ("iterations a step", 4), ("CPU time [s]", 3)],
            [("scene", 1), ("start, steps", 1), ("grains", 1), ("contacts", 1), ("subdomains", 1), ("plain", 1), ("accelerated", 1),
             ("ratio", 1), ("growth", 1), ("plain", 1), ("accelerated", 1), ("ratio", 1)]]
    return table(head, lines, "What acceleration saves")


def cost_ratio(row):
    plain, fast = row["paper"]["cpu"], row["auto"]["cpu"]
    return fast / plain if min(plain, fast) > 0 else 1.0  # too short for the clock


def hard_costs(record, noise):
    """Table 10: the hard cases that cost more accelerated, dearest first."""
    lines = []
    for row in sorted(record["hard"], key=cost_ratio, reverse=True):
        if cost_ratio(row) <= 1 + noise:
            break
        plain, fast = row["paper"], row["auto"]
        both = [count(solved["iterations"]) if solved["converged"] else f"{count(solved['iterations'])} (not converged)" for solved in (plain, fast)]
        lines.append([escape(row["scene"]), count(row["steps"]), count(round(row["contacts"])), *both,
                      number(1e6 * plain["cpu"]), number(1e6 * fast["cpu"]), number(cost_ratio(row))])
    head = [[("", 3), ("iterations, all steps", 2), ("CPU time [\u00b5s]", 3)],
            [("scene", 1), ("steps", 1), ("contacts,<br>most", 1), ("plain", 1), ("accelerated", 1), ("plain", 1), ("accelerated", 1), ("ratio", 1)]]
    return table(head, lines, "Hard cases that cost more accelerated")
