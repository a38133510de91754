"""What the long scripts share: how times are shown, how a record is written, and how Open MPI is run."""
import json
import shlex
import subprocess
from pathlib import Path


def clock(seconds):
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def left(elapsed, done, total):
    """", about 1:23 left" by the share of the cost that is done; nothing before there is one."""
    return f", about {clock(elapsed * (total - done) / done)} left" if done > 0 else ""


def write_record(path, record):
    """As JSON, aside and then renamed: a reader meets the old file or the whole new one."""
    part = Path(f"{path}.part")
    part.write_text(json.dumps(record, indent=1) + "\n")
    part.replace(path)


def environment():
    """The variables that scripts/environment.sh sets for Open MPI."""
    script = f"source {shlex.quote(str(Path(__file__).parent / 'environment.sh'))} && env -0"
    text = subprocess.run(["bash", "-c", script], check=True, capture_output=True, text=True).stdout
    return dict(entry.split("=", 1) for entry in text.split("\0") if "=" in entry)
