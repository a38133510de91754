"""How far accepted steps of random scenes are from the answer, by a judge with a method of its own (verification/wild)."""
from pathlib import Path

from ... import record
from ...program import NSCDD, ROOT
from ...study import Study

WILD_SCENES = Path(NSCDD).with_name("wild_scenes")  # built with the tests


class Wild(Study):
    name, title, about = "wild", "Accepted steps of random scenes", "how far accepted steps of random scenes are from the answer"

    def jobs(self, plan):
        if Path(ROOT, WILD_SCENES).exists():
            scenes = 20 if plan.quick else 2000
            out = plan.folder / "scenes.json"
            plan.add("random scenes", [out], [[WILD_SCENES, "--scenes", scenes, "--seed", 1, "--worst", 50, "--json", out]], cost=scenes * 0.6)
        else:
            plan.leave_out(f"random scenes: {WILD_SCENES} is not there: the tests of the program build it")

    def rows(self, plan):
        found = plan.folder / "scenes.json"
        return {key: value for key, value in record.load(found).items() if key not in ("schema", "command", *record.PROVENANCE)} if found.exists() else {}
