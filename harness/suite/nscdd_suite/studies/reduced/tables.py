"""Tables of the reduced scenes and of any runs; and the same numbers for summary.json."""
from html import escape
from pathlib import Path

from ...page.style import SCHEMES
from ...page.tables import NONE, bounded, by_number, count, number, percent, table
from ..paper.data import TABLE_1


def mpi_share(runs, scene):
    """Table 1 of the paper: HTML, values for the summary, and the runs used."""
    timed = {scheme: runs.timed(scene, scheme) for scheme in SCHEMES}
    used = [run for by_n in timed.values() for run in by_n.values()]
    numbers = sorted({*TABLE_1, *(n for by_n in timed.values() for n in by_n)})
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
        paper = TABLE_1[n][1:] if n in TABLE_1 else None
        row += [(f"{p:.1f}" if n > 1 else "0", "faint") for p in paper] if paper else [(NONE, "faint")] * 2
        rows.append(row)
        if len(value) > 1:
            values.append(value)
    above = " | CCS, measured here *3 | DCS, measured here *3 | paper<br>(55\u2009000 spheres, 48-core machine) *2"
    head = [above, "subdomains" + 2 * " | in MPI % | waiting % | transferring %" + " | CCS % | DCS %"]
    return table(head, rows, "Share of time in MPI"), values, used


def counted(runs, scene):
    """What the decomposition costs, counted: HTML, values for the summary, and the runs used."""
    found = {scheme: runs.counted(scene, scheme) for scheme in SCHEMES}
    numbers = sorted({n for by_n in found.values() for n in by_n})
    first = found["dcs"].get(1) or found["ccs"].get(1)
    rows, values = [], []
    for n in numbers:
        both = [found[scheme].get(n) for scheme in SCHEMES]
        any_run = both[1] or both[0]
        work = any_run["work_per_rank"]
        share = max(work) / sum(work) if sum(work) else 0.0
        ratio = any_run.total_iterations / first.total_iterations if first and first.total_iterations else None
        row = [
            str(n),
            escape(any_run["partition"]),
            count(any_run["interface_grains"]),
            percent(any_run["interface_share"]),
            f"{percent(share)} <i>({percent(1 / n)})</i>",
            count(any_run.mean_iterations),
            NONE if ratio is None else f"{ratio:.2f}",
        ]
        for key in ("messages_per_iteration", "bytes_per_iteration"):
            row += [NONE if run is None else count(run[key]) for run in both]
        rows.append(row)
        values.append(
            {
                "subdomains": n,
                "interface_share": any_run["interface_share"],
                "largest_work_share": share,
                "iterations": any_run.total_iterations,
                "ratio_to_one_subdomain": ratio,
                **{scheme: {key: run[key] for key in ("messages_per_iteration", "bytes_per_iteration")} for scheme, run in zip(SCHEMES, both) if run},
            }
        )
    above = " |  | interface grains *2 | largest share | iterations per step *2 | messages per iteration *2 | bytes per iteration *2"
    head = [above, "subdomains | partition | mean | % of all | of work % <i>(even)</i> | mean | to 1 subd. | CCS | DCS | CCS | DCS"]
    used = [run for by_n in found.values() for run in by_n.values()]
    return table(head, rows, "Messages and bytes per iteration"), values, used


def compared_steps(compare):
    """In words: one step from the reference's state, or the whole run, which differs more, as answers are not unique."""
    steps, last = compare.get("steps"), compare.get("last_step")
    if steps is None or last is None:
        return NONE
    return "one step, from the reference's last state" if steps == 1 < last else f"whole run, {count(steps)} step{'s' * (steps > 1)}"


def agreement(compares):
    """Two rows per run: one step from the reference's state, and the whole run."""
    entries = [
        ([escape(Path(c["candidate"]).stem), (compared_steps(c), "text"), str(c["subdomains"]), escape(c["transport"])], c["rows"], c["ok"])
        for c in sorted(compares, key=lambda c: by_number(Path(c["candidate"]).stem))
    ]
    return bounded(("run", "compared", "subdomains", "transport"), entries, "Agreement with the reference")


def all_runs(runs):
    """Every run with its residual; seconds only where they were measured."""
    rows = []
    for run in runs:
        fine = not list(run.problems())
        eta = f"{number(run.eta_max)} <i>\u2264\u202f{number(run['tolerance'])}</i>"
        cells = [escape(run.name), str(run["subdomains"]), escape(run["transport"]), escape(run["partition"]), escape(run["interface"])]
        cells += [count(max(run["contacts"], default=0)), str(run["steps"]), count(run.total_iterations), str(run["check_every"])]
        cells += [(eta, "" if fine else "bad"), f"{run['seconds']['total']:.2f}" if run.measured else "machine busy" if run.busy else NONE]
        cells += [("yes", "good") if fine else ("no", "bad")]
        rows.append(cells)
    head = [
        "run | subd. | transport | partition | interface | contacts,<br>most | steps | iterations | checked<br>every | largest \u03b7 | seconds | converged"
    ]
    return table(head, rows, "All runs")
