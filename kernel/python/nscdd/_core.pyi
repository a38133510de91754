"""Types of the compiled part that users meet; the rest is for the Python sources alone."""
from typing import Any

__version__: str

class StepEnergy:
    before: float
    kinetic: float
    external: float
    walls: float
    normal: float
    friction: float
    round_off: float

class SolveReport:
    converged: bool
    iterations: int
    eta: float
    velocity_error: float
    energy_gain: float
    penetration: float
    gap_error: float
    distance: float
    newton_contacts: float

class StepReport:
    converged: bool
    iterations: int
    eta: float
    contacts: int
    interface_grains: int
    attempts: int
    solve: SolveReport
    energy: StepEnergy

class StepRefused(RuntimeError):
    step: int
    i: int
    j: int
    h: float

class Live:
    def __getattr__(self, name: str) -> Any: ...

class Asked:
    def __init__(self, *arguments: Any) -> None: ...

def __getattr__(name: str) -> Any: ...
