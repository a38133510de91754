"""Rows of scripts/paper's record, from the files that its jobs left; and what a simulated command begins with."""
import csv
import functools
import hashlib
import json
import math
import re
import shlex
import statistics
import sys
from datetime import datetime, timezone
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "reports"))
from nscdd_report.times import cores_of, least  # noqa: E402

PLATFORMS = "cases/platforms"
COSTS = {2: f"{PLATFORMS}/costs-2d-coulomb.json", 3: f"{PLATFORMS}/costs-3d-coulomb.json"}
PLACE = ("scene", "method", "scheme", "partition", "subdomains", "multiplicity")
# What tells a row of the record from all others of its kind.
IDENTITY = {"packings": ("scene",), "runs": (*PLACE, "variation", "perturbed"), "agreement": PLACE,
            "windows": (*PLACE, "platform", "slower", "latency", "bandwidth", "noise"),
            "measured": ("scene", "method", "scheme", "partition", "ranks")}
USUAL = {"multiplicity": "minimal", "perturbed": 0}  # of rows that do not say


@functools.cache
def platform_factors(file, name):
    return re.search(rf'{name}" value="([^"]*)"', (ROOT / file).read_text()).group(1)


def factors(file, latency, bandwidth):
    """What the simulator multiplies latency and bandwidth by, for messages of each size, times more."""
    options = []
    for name, more in (("smpi/lat-factor", latency), ("smpi/bw-factor", bandwidth)):
        if more != 1:
            entries = (entry.split(":") for entry in platform_factors(file, name).split(";"))
            options.append(f"--cfg={name}:" + ";".join(f"{size}:{float(factor) * more:g}" for size, factor in entries))
    return options


def simulator(n, platform, latency, bandwidth):
    """What a simulated command begins with."""
    file = f"{PLATFORMS}/{platform}.xml"
    return ["smpirun", "-quiet", "-np", str(n), "-platform", file, "-hostfile", file.replace(".xml", ".hosts"), "--log=root.thres:error",
            *factors(file, latency, bandwidth)]


def loading(path):
    """How slow and how exact a whole run was, from the series and the last state beside its JSON, where it wrote them."""
    found, series, state = {}, Path(path).with_suffix(".csv"), Path(path).with_suffix(".h5")
    if series.exists():
        with series.open(newline="") as file:
            numbers = [float(row["inertial_number"]) for row in csv.DictReader(line for line in file if not line.startswith("#"))]
        if numbers := [number for number in numbers if math.isfinite(number)]:
            found["inertial_number"] = statistics.median(numbers)
    if state.exists():
        with h5py.File(state) as file:
            gaps, radii = file["contacts/gap"][()], file["radius"][()]
        found["largest_overlap"] = float(max(0, -gaps.min(initial=0)) / (2 * radii.mean()))
    return found


def run_row(path, what, start=()):
    """`what`: its identity. Returns the row and the JSON of the run."""
    told = json.loads(Path(path).read_text())
    contacts = told["contacts"]
    return what | {"grains": told["grains"], "dimension": told["dimension"], "steps": told["steps"], "h": told["h"], "tolerance": told["tolerance"],
                   "iterations": told["iterations"], "contacts": contacts, "unknowns_mean": told["dimension"] * statistics.mean(contacts),
                   "interface_grains": told["interface_grains"], "bytes_per_iteration": told["bytes_per_iteration"],
                   "residual_max": max(told["residual"]), "unconverged_steps": told["unconverged_steps"],
                   **loading(path), "command": told["command"], "start": list(start), "commit": told["commit"]}, told


def window_row(path, what):
    told = json.loads(Path(path).read_text())
    seconds, each = told["seconds_per_iteration"], told["per_iteration"]
    wait, transfer = (each[kind]["mean"] / seconds for kind in ("wait", "transfer"))
    begin = simulator(what["subdomains"], what["platform"], what["latency"], what["bandwidth"])
    operations = {name: {"messages": what["subdomains"] * one["messages"]["mean"], "wait_share": one["wait"]["mean"] / seconds,
                         "transfer_share": one["transfer"]["mean"] / seconds} for name, one in told.get("operations_per_iteration", {}).items()}  # files made before lack it
    return what | {"after_step": None, "seconds_per_iteration": seconds, "mpi_share": wait + transfer, "wait_share": wait, "transfer_share": transfer,
                   **({"operations": operations} if operations else {}), "command": f"{shlex.join(begin)} {told['command']}", "commit": told["commit"]}


def agreement_row(path, what):
    told = json.loads(Path(path).read_text())
    made = json.loads(Path(path.replace(".compare.json", ".json")).read_text())
    return what | {"command": told.get("command", ""), "commit": made["commit"],
                   "rows": [{key: row[key] for key in ("quantity", "value", "bound", "ok")} for row in told["rows"]]}


def measured_row(paths, scene, scheme, partition, n):
    told = [json.loads(Path(path).read_text()) for path in paths]
    seconds = [one["seconds"]["total"] for one in told]
    cores = least(cores_of(one) for one in told)
    middle = sorted(told, key=lambda one: one["seconds"]["total"])[len(told) // 2]
    return {"scene": scene, "method": "paper", "scheme": scheme, "partition": partition, "ranks": n, "steps": middle["steps"], "seconds": statistics.median(seconds),
            "seconds_all": seconds, **({"cores": cores} if cores is not None else {}), "mpi_share": middle["mpi_fraction"] if n > 1 else 0.0, "iterations_total": sum(middle["iterations"]),
            "command": " ".join([*(["mpirun", "-np", str(n)] if n > 1 else []), middle["command"]]), "commit": middle["commit"]}


def packing_row(path, scene):
    with h5py.File(path) as file:
        text = {key: file.attrs[key] for key in file.attrs}
        grains, checksum = len(file["radius"]), packing_checksum(file)
    text = {key: value.decode() if isinstance(value, bytes) else value for key, value in text.items()}
    numbers = ("solid_fraction", "solid_fraction_core", "coordination", "rattlers", "largest_overlap")
    return {"scene": scene, "grains": grains, "source": text["source"], "checksum": checksum, "command": text["command"],
            **({"commit": text["commit"]} if "commit" in text else {}), **{key: float(text[key]) for key in numbers}}


def packing_checksum(file):
    """Of positions, radii and box, to the last bit."""
    sha = hashlib.sha256()
    for name in ("x", "radius", "box"):
        sha.update(np.ascontiguousarray(file[name][...], "<f8").tobytes())
    return sha.hexdigest()[:16]


def other_packings(rows):
    """Lines on those that are not the accepted ones of the repository, whose counts are not those of the record."""
    accepted = json.loads((ROOT / "cases/packings/accepted.json").read_text())
    for row in rows:
        ours = accepted.get(row["scene"])
        if not ours or row["grains"] != ours["grains"] or row["checksum"] == ours["checksum"]:
            continue
        other = "" if row["source"] == ours["source"] else f", which was made by {ours['source']}"
        yield f"packing of {row['scene']}, made by {row['source']}: not the accepted one{other}; counts are not those of the record"


def collect(plan, command):
    """The record of all that is there; None without a run or the network of Fig. 1, which name commit and machine."""
    there = lambda rows: [row for row in rows if Path(row[0]).exists()]  # noqa: E731
    runs = [run_row(*row) for row in there(plan.runs)]
    network = plan.folder / "fig1-network.json"
    made = [told for _, told in runs] + ([json.loads(network.read_text())] if network.exists() else [])
    if not made:
        return None
    newest = max(made, key=lambda told: told["date"])
    steps = {row["scene"]: told["start_step"] + told["steps"] for row, told in runs
             if row["scheme"] == "nlgs" and not row["variation"] and not row["perturbed"]}
    rows = {"packings": [packing_row(plan.packing(scene), scene) for scene in plan.scenes if Path(plan.packing(scene)).exists()],
            "runs": [row for row, _ in runs],
            "agreement": [agreement_row(*row) for row in there(plan.compared)],
            "windows": [window_row(*row) | {"after_step": steps[row[1]["scene"]]} for row in there(plan.windows)],
            "measured": [measured_row(*row) for row in plan.measured if all(path.exists() for path in row[0])]}
    return {"schema": "nscdd.paper/1", "command": command, "commit": newest["commit"], "commits": commits_of(rows) or [newest["commit"]],
            "date": datetime.now(timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ"), "machine": newest["machine"], "quick": plan.quick,
            "platform": {"name": "node48", "file": f"{PLATFORMS}/node48.xml", "costs_2d": COSTS[2], "costs_3d": COSTS[3]}, **rows}


def commits_of(rows):
    return sorted({row["commit"] for kind in IDENTITY for row in rows[kind] if "commit" in row})


def merge(earlier, record):
    """The earlier record with the rows of this one: those of the same identity are replaced, others added. Raises ValueError where
    rows could not stand side by side. Counts are the same on all machines with fused products, measured times depend on the whole machine:
    `machine` stays that of the measured times."""
    measured = ["cpu", "cores", "os"] if record["measured"] else []
    for told, what, keys in (("", lambda r: r, ["schema", "quick"]), ("machine's ", lambda r: r["machine"], ["fused", *measured])):
        for key in keys:
            was, now = what(earlier).get(key), what(record).get(key)
            if was != now:
                raise ValueError(f"{told}{key} was {was}, and is {now}")
    commands = dict.fromkeys([*earlier["command"].split("; "), record["command"]])  # each once
    merged = record | {"command": "; ".join(commands), "machine": earlier["machine"],
                       "counted_on": sorted({*earlier.get("counted_on", [earlier["machine"]["cpu"]]), record["machine"]["cpu"]})}
    for kind, names in IDENTITY.items():
        def identity(row):
            return tuple(row.get(name, USUAL.get(name)) for name in names)
        rows = {identity(row): row for row in earlier[kind]}
        rows |= {identity(row): row for row in record[kind]}
        merged[kind] = list(rows.values())
    return merged | {"commits": commits_of(merged)}
