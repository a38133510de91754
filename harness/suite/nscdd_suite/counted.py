"""Are the counted numbers of a folder of results those of the committed records?

Compares iterations, contacts, messages, bytes, work, residuals, checksums of answers, and what hard cases and physics found, with reports/results. Times
are not compared, no number of a simulated machine, and none of another program. A program with fused products has the same numbers on every machine.
"""
import shutil
from pathlib import Path

from . import record

RECORDS = Path("reports/results")
TABLES = record.beside(__file__, "counted.toml")
SHOWN = 20


def total(value):
    return sum(value) if isinstance(value, list) else value


def at(value, key):
    """What lies in a dict at "a.b", None where there is no such key."""
    for name in key.split("."):
        value = value and value.get(name)
    return value


def of_record(kind, data):
    """{name of a number: number} of a record. A quick one has other numbers than a whole one."""
    label, found = kind + (" --quick" if data.get("quick") else ""), {}
    if kind == "reduced":
        return {f"{label}: {run}: {key}": value for run, numbers in data["runs"].items() for key, value in numbers.items()}
    for table in TABLES[kind.partition("-")[0]]:
        for row in at(data, table["rows"]):
            if str(row.get("solver")).startswith("Siconos"):  # no number of ours
                continue
            name = " ".join(str(row[key]) for key in table["named"] if row.get(key) not in (None, ""))
            found |= {f"{label}: {name}: {key}": total(at(row, key)) for key in table["numbers"] if at(row, key) is not None}
    return found


def kinds(folder):
    """Records of a folder that have counted numbers."""
    names = ["reduced", *(kind for kind in TABLES if kind != "scale"), *sorted(path.stem for path in folder.glob("scale-*.json"))]
    return [kind for kind in names if (folder / f"{kind}.json").exists()]


def read(folder, kind):
    """The numbers of a record. Raises InputError."""
    path, schema = folder / f"{kind}.json", kind.partition("-")[0]
    try:
        return of_record(kind, record.read(path, schema))
    except (KeyError, TypeError, AttributeError) as error:
        raise record.InputError(f"{path}: rows are not those of nscdd.{schema}/1: {error}") from None


def require_whole(folder, kind, new):
    """Raises InputError for a record of a quick job, or one that lacks numbers of the committed one."""
    old = committed(kind)
    gone = len(old.keys() - new.keys())
    if gone or record.read(folder / f"{kind}.json").get("quick"):
        raise record.InputError(
            f"counted: --record: {folder / kind}.json is quick, or lacks numbers of the committed record ({gone} of {len(old)}): "
            f"remove {RECORDS / kind}.json first if that is meant"
        )


def committed(kind):
    return read(RECORDS, kind) if (RECORDS / f"{kind}.json").exists() else {}


def compare(folder, keep=False):
    """Writes counted.json, which the page shows, and yields lines about it. `keep`: what is there becomes the committed records, whole, instead."""
    if not folder.is_dir():
        raise record.InputError(f"counted: {folder}: no such folder")
    now = {kind: read(folder, kind) for kind in kinds(folder)}
    if not any(now.values()):
        raise record.InputError(f"counted: {folder}: no records")
    if keep:
        for kind in now:
            require_whole(folder, kind, now[kind])
        for kind in now:
            shutil.copyfile(folder / f"{kind}.json", RECORDS / f"{kind}.json")
        (folder / "counted.json").unlink(missing_ok=True)  # a record says nothing beside itself
        yield f"counted: the records of {', '.join(now)} are those of {folder}"
        return
    known = [kind for kind in now if (RECORDS / f"{kind}.json").exists()]
    yield from (f"counted: {RECORDS / kind}.json is not there: nothing to compare {kind} with" for kind in now if kind not in known)
    new, old = ({name: value for kind in known for name, value in of(kind).items()} for of in (now.get, committed))
    both = [name for name in new if name in old]
    differ = [{"name": name, "now": new[name], "record": old[name]} for name in both if old[name] != new[name]]
    same, unknown, missing = len(both) - len(differ), len(new) - len(both), len(old) - len(both)
    counts = {"same": same, "of": len(both), "not_in_the_record": unknown, "missing": missing}
    record.write(folder / "counted.json", {"schema": "nscdd.counted/1", "records": known, **counts, "differ": differ})
    yield from (f"    {entry['name']}: {entry['now']}, in the record {entry['record']}" for entry in differ[:SHOWN])
    if len(differ) > SHOWN:
        yield f"    and {len(differ) - SHOWN} more, in {folder / 'counted.json'}"
    yield (
        f"counted: {same} of {len(both)} counted numbers are those of the record ({', '.join(known) or 'none'})"
        + (f"; {unknown} more are not in it" if unknown else "")
        + (f"; {missing} of it are not in these results" if missing else "")
        + ("; results of --quick have none of the record's" if not both and any(record.read(folder / f"{kind}.json").get("quick") for kind in known) else "")
    )
