"""Rows of the record on the paper, from the files that its jobs left; and how they join those of an earlier record."""
import csv
import hashlib
import math
import shlex
import statistics
from pathlib import Path

import h5py
import numpy as np

from ...program import ROOT, simulated
from ...record import load
from ...times import cores_of, least

PLACE = ("scene", "method", "scheme", "partition", "subdomains", "multiplicity")
# What tells a row of the record from all others of its kind.
IDENTITY = {
    "packings": ("scene",),
    "runs": (*PLACE, "variation", "perturbed"),
    "agreement": PLACE,
    "windows": (*PLACE, "platform", "slower", "latency", "bandwidth", "noise"),
    "measured": ("scene", "method", "scheme", "partition", "ranks"),
}
USUAL = {"multiplicity": "minimal", "perturbed": 0}  # of rows that do not say
OF_RUNS = ("grains", "dimension", "steps", "h", "tolerance", "iterations", "contacts", "interface_grains", "bytes_per_iteration", "unconverged_steps")


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
    told = load(path)
    means = {"unknowns_mean": told["dimension"] * statistics.mean(told["contacts"]), "residual_max": max(told["residual"])}
    made = {"command": told["command"], "start": list(start), "commit": told["commit"]}
    return what | {key: told[key] for key in OF_RUNS} | means | loading(path) | made, told


def window_row(path, what):
    told = load(path)
    seconds, n = told["seconds_per_iteration"], what["subdomains"]

    def shares(times):
        return {f"{kind}_share": times[kind]["mean"] / seconds for kind in ("wait", "transfer")}

    each = shares(told["per_iteration"])
    operations = {name: {"messages": n * one["messages"]["mean"]} | shares(one) for name, one in told.get("operations_per_iteration", {}).items()}
    begin = simulated(n, what["platform"], what["latency"], what["bandwidth"])
    made = {"command": f"{shlex.join(begin)} {told['command']}", "commit": told["commit"]}
    return what | {"seconds_per_iteration": seconds, "mpi_share": sum(each.values()), **each, "operations": operations, **made}


def agreement_row(path, what):
    told, made = load(path), load(path.replace(".compare.json", ".json"))
    rows = [{key: row[key] for key in ("quantity", "value", "bound", "ok")} for row in told["rows"]]
    return what | {"command": told["command"], "commit": made["commit"], "rows": rows}


def measured_row(paths, scene, scheme, partition, n):
    told = [load(path) for path in paths]
    seconds, cores = [one["seconds"]["total"] for one in told], least(map(cores_of, told))
    middle = sorted(told, key=lambda one: one["seconds"]["total"])[len(told) // 2]
    launcher = ["mpirun", "-np", str(n)] if n > 1 else []
    row = {"scene": scene, "method": "paper", "scheme": scheme, "partition": partition, "ranks": n, "steps": middle["steps"]}
    row |= {"seconds": statistics.median(seconds), "seconds_all": seconds} | ({"cores": cores} if cores is not None else {})
    row |= {"mpi_share": middle["mpi_fraction"] if n > 1 else 0.0, "iterations_total": sum(middle["iterations"])}
    return row | {"command": " ".join([*launcher, middle["command"]]), "commit": middle["commit"]}


def packing_row(path, scene):
    with h5py.File(path) as file:
        text = {key: file.attrs[key].decode() for key in ("source", "command", "commit")}
        numbers = {key: float(file.attrs[key]) for key in ("solid_fraction", "solid_fraction_core", "coordination", "rattlers", "largest_overlap")}
        return {"scene": scene, "grains": len(file["radius"]), "checksum": packing_checksum(file), **text, **numbers}


def packing_checksum(file):
    """Of positions, radii and box, to the last bit."""
    sha = hashlib.sha256()
    for name in ("x", "radius", "box"):
        sha.update(np.ascontiguousarray(file[name][...], "<f8").tobytes())
    return sha.hexdigest()[:16]


def other_packings(rows):
    """Lines on those that are not the accepted ones of the repository, whose counts are not those of the record."""
    accepted = load(ROOT / "cases/packings/accepted.json")
    for row in rows:
        ours = accepted.get(row["scene"])
        if not ours or row["grains"] != ours["grains"] or row["checksum"] == ours["checksum"]:
            continue
        other = "" if row["source"] == ours["source"] else f", which was made by {ours['source']}"
        yield f"packing of {row['scene']}, made by {row['source']}: not the accepted one{other}; counts are not those of the record"


def commits_of(rows):
    return sorted({row["commit"] for kind in IDENTITY for row in rows[kind] if "commit" in row})


def merge(earlier, record):
    """The earlier record with the rows of this one: those of the same identity are replaced, others added. Raises ValueError where
    rows could not stand side by side. Counts are the same on all machines with fused products, measured times depend on the whole machine:
    `machine` stays that of the measured times."""
    for key in ("quick", "fused", *(("cpu", "cores", "os") if record["measured"] else ())):
        was, now = (({"quick": one["quick"]} | one["machine"]).get(key) for one in (earlier, record))
        if was != now:
            raise ValueError(f"{key} was {was}, and is {now}")
    commands = dict.fromkeys([*earlier["command"].split("; "), record["command"]])  # each once
    counted_on = sorted({*earlier.get("counted_on", [earlier["machine"]["cpu"]]), record["machine"]["cpu"]})
    merged = record | {"command": "; ".join(commands), "machine": earlier["machine"], "counted_on": counted_on}
    for kind, names in IDENTITY.items():
        rows = {tuple(row.get(name, USUAL.get(name)) for name in names): row for row in [*earlier[kind], *record[kind]]}
        merged[kind] = list(rows.values())
    return merged | {"commits": commits_of(merged)}
