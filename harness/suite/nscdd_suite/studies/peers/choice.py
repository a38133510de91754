"""Which runs of the settling bed count, which are compared, and their ratios."""
import statistics

from ...times import LEAST_PAIRS, compared

CUSTOMARY = "customary"
OVERLAPS = ("mean_overlap", "largest_overlap")


def median(row):
    return statistics.median(row["cpus"])


def settled(row):
    """Whether a run of either code is an answer: the bed is at rest and nothing went wrong on the way."""
    return "refused" not in row and row.get("stable", True) and row.get("at_rest", False)


def named(row):
    """What a run of the settling bed was asked for, in words."""
    if "h" in row:
        return f"h = {row['h']:.3g} s {row['arguments']}"
    looks = f" looked at every {row['check']} steps" if row["check"] > 1 else ""
    return f"k = {row['k']:.3g} Pa, dt = {row['dt']:.3g} s, damping {row['damping']:g}, skin {row['skin']:g} d{looks}"


def frontier(rows):
    """Those that no other row beats in both time and mean overlap, from the cheapest on."""
    best, kept = float("inf"), []
    for row in sorted(rows, key=lambda row: (median(row), row["mean_overlap"])):
        if row["mean_overlap"] < best:
            best = row["mean_overlap"]
            kept.append(row)
    return kept


def usable(rows):
    return [row for row in rows if settled(row)]


def cheapest(rows):
    """Of each stiffness the cheapest row, from the softest on."""
    best = {}
    for row in sorted(rows, key=median):
        best.setdefault(row["k"], row)
    return [best[k] for k in sorted(best)]


def stable_steps(record):
    """LAMMPS at its largest stable step."""
    return cheapest([row for row in usable(record["lammps"]) if row["role"] != CUSTOMARY])


def customary_steps(record):
    return cheapest([row for row in usable(record["lammps"]) if row["role"] == CUSTOMARY])


def as_good(record, row):
    """Our cheapest runs that are as good as one of LAMMPS: by the mean overlap, and by the largest too; None: none is."""
    good = [own for own in usable(record["ours"]) if own["mean_overlap"] <= row["mean_overlap"]]
    both = [own for own in good if own["largest_overlap"] <= row["largest_overlap"]]
    return tuple(min(some, key=median, default=None) for some in (good, both))


def compared_rows(record):
    """Our runs and those of LAMMPS that ratios are made of, each once."""
    theirs = stable_steps(record) + customary_steps(record)
    ours = [own for row in theirs for own in as_good(record, row) if own]
    return [[row for at, row in enumerate(rows) if row not in rows[:at]] for rows in (ours, theirs)]


def chance(row, own):
    """Probability of their difference between equal programs; None: too few runs, or none in turn."""
    return compared(own["cpus"], row["cpus"])["p"] if own and min(len(own["cpus"]), len(row["cpus"])) >= LEAST_PAIRS else None


def ratios(record):
    """Of each run of LAMMPS that counts: its time over that of our cheapest run that is as good by the mean overlap, and by the largest too."""
    found = []
    for role, row in [*(("largest stable step", row) for row in stable_steps(record)), *((CUSTOMARY, row) for row in customary_steps(record))]:
        best, best_both = as_good(record, row)
        theirs = {"step": role, "k": row["k"], "dt": row["dt"], "lammps_cpu": median(row)} | {key: row[key] for key in OVERLAPS}
        ours = {"ours": best and named(best), "ours_cpu": best and median(best)} | {f"ours_{key}": best and best[key] for key in OVERLAPS}
        ratio, both = (own and median(row) / median(own) for own in (best, best_both))
        found.append({**theirs, **ours, "ratio": ratio, "ratio_both": both, "p": chance(row, best)})
    return found
