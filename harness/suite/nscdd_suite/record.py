"""Files that studies write: JSON with a schema, commit and machine; whole or not at all."""
import json
import tomllib
from pathlib import Path

from .program import ROOT, read as load  # of our own, which no user writes

SCHEMAS = ROOT / "reports"
PROVENANCE = ("commit", "date", "machine")


class InputError(Exception):
    """A results file that cannot be used; the text is one line that names it."""


def write(path, data):
    """As JSON, a row of a list a line."""

    def text(value):
        if isinstance(value, list) and any(isinstance(row, (dict, list)) for row in value):
            return "[" + ",".join(f"\n  {json.dumps(row)}" for row in value) + "\n ]"
        return json.dumps(value)

    entries = ",".join(f"\n {json.dumps(key)}: {text(value)}" for key, value in data.items()) if isinstance(data, dict) else None
    aside(path, ((text(data) if entries is None else "{" + entries + "\n}") + "\n").encode())


def aside(path, data):
    """Writes bytes aside, then renames: a reader meets the old file or the whole new one."""
    part = Path(f"{path}.part")
    part.write_bytes(data)
    part.replace(path)


def read(path, kind=None):
    """A JSON file with a schema, of this kind if one is given. Raises InputError."""
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise InputError(f"{path}: not valid JSON (truncated?): line {error.lineno}: {error.msg}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    if not isinstance(data, dict) or not isinstance(data.get("schema"), str):
        raise InputError(f"{path}: not a result: field 'schema' is missing")
    if kind and data["schema"] != f"nscdd.{kind}/1":
        raise InputError(f"{path}: schema is {data['schema']}, not nscdd.{kind}/1")
    return data


def check(path, data, schema):
    """Raises InputError at the first place where `data` departs from the schema file."""
    import jsonschema  # of the page, not of the studies

    definition = json.loads((SCHEMAS / schema).read_text(encoding="utf-8"))
    error = next(iter(jsonschema.Draft7Validator(definition).iter_errors(data)), None)
    if error:
        place = "/".join(map(str, error.absolute_path)) or "top level"
        raise InputError(f"{path}: {place}: {error.message[:200]}")


def toml(path):
    return tomllib.loads(path.read_text(encoding="utf-8"))


def beside(module, name):
    """The TOML file of this name in the folder of a module."""
    return toml(Path(module).with_name(name))
