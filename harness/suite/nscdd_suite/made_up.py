"""What the studies' made-up results, for tests of the page, share: no value in them was ever counted, simulated or measured."""
COMMIT, DATE, MACHINE = "fabricated", "2000-01-01T00:00:00Z", {"cpu": "Fabricated CPU", "cores": 2}


def made_up(kind, **rows):
    return {"schema": f"nscdd.{kind}/1", "command": f"scripts/suite run {kind} FABRICATED", "commit": COMMIT, "date": DATE, "machine": MACHINE} | rows
