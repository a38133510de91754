"""Nonsmooth contact dynamics of disks and spheres, by NLGS and by domain decomposition (NSCDD).

    import nscdd
    sim = nscdd.Simulation(positions, radii, density=2500, friction=0.3, h=1e-4, gravity=(0, 0, -9.81),
                           walls=[nscdd.Wall(normal=(0, 0, 1), through=(0, 0, 0))])
    for k in range(1000):
        report = sim.step()

Simulation      a scene of arrays, walls and materials; step(), run(), save(), arrays of positions, contacts
read            the same of a scene file of the program `nscdd`
Wall, Obstacle, Cell
                planes that bound the sample; lines, meshes and cylinders in it; a cell that repeats
solve           a contact problem with matrices: u = W r + q, or M v = H r + f and u = H^T v + w
solve_contacts  a contact problem of your own detection: grains, and contacts between them
load            a state that Simulation.save() or the program wrote, as arrays
read_packing, write_packing, read_series, read_problem
                files of the program: packings, time series, and problems in FCLIB's format
read_vtkhdf, write_vtkhdf, read_csv, write_csv
                grains for other programs: ON-DEM's VTKHDF, and text; `python3 -m nscdd.exchange FROM TO`

Units are yours, if they are coherent: SI is written here. Arrays are float64, (n, 2) of disks and (n, 3) of spheres.
A scene has the same numbers as in the program, to the last bit. What is wrong in what you give is a ValueError of one
line, a step that cannot be made is StepRefused (a RuntimeError), a file that cannot be written an OSError, an attribute
that is not there an AttributeError.
"""
from typing import TYPE_CHECKING, Any

try:
    from ._core import SolveReport, StepEnergy, StepRefused, StepReport, __version__
except ModuleNotFoundError as missing:
    raise ModuleNotFoundError("nscdd: the module is not built: run cmake --build build, or pip install .", name=missing.name) from missing
from .files import Packing, State, load, read_packing, read_problem, read_series, write_packing
from .scene import Cell, Obstacle, Wall
from .simulation import LiveWall, Simulation, read
from .solve import Answer, solve, solve_contacts

if TYPE_CHECKING:
    from .exchange import read_csv, read_vtkhdf, write_csv, write_vtkhdf

__all__ = [
    "Answer",
    "Cell",
    "LiveWall",
    "Obstacle",
    "Packing",
    "Simulation",
    "SolveReport",
    "State",
    "StepEnergy",
    "StepRefused",
    "StepReport",
    "Wall",
    "load",
    "read",
    "read_csv",
    "read_packing",
    "read_problem",
    "read_series",
    "read_vtkhdf",
    "solve",
    "solve_contacts",
    "write_csv",
    "write_packing",
    "write_vtkhdf",
]


def __dir__() -> list:
    """With the names of nscdd.exchange, for help()."""
    return sorted({*globals(), *__all__})


def __getattr__(name: str) -> Any:
    """Names of nscdd.exchange, which needs h5py, when they are asked for."""
    if name in ("read_csv", "read_vtkhdf", "write_csv", "write_vtkhdf"):
        from . import exchange

        return getattr(exchange, name)
    raise AttributeError(f"module 'nscdd' has no attribute '{name}'")
