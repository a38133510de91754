"""Files of the program: packings, states, time series, contact problems."""
from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass
from typing import Any, Iterator, Mapping, Optional, Sequence

import numpy as np

from . import _core
from ._checks import Path, array, axes
from ._checks import path as name_of
from ._checks import points


@dataclass(frozen=True, eq=False)
class Packing:
    """Grains in a box; what the file does not have is None.

    positions (n, dim) [m], radii (n) [m], box (dim) [m], velocities (n, dim) [m/s], spins (n) in 2D, (n, 3) in 3D [rad/s],
    material (n) rows of `materials`, names; periodic: axes along which the box repeats, such as "xy". fixed (n): 1 of grains
    that nothing moves. tilt, gradient (dim, dim) [m, 1/s] of a box that repeats: column d of diag(box) + tilt is the next
    image along d; row: what moves, column: along what.
    """

    positions: np.ndarray
    radii: np.ndarray
    box: np.ndarray
    velocities: Optional[np.ndarray] = None
    spins: Optional[np.ndarray] = None
    material: Optional[np.ndarray] = None
    materials: Sequence[str] = ()
    periodic: str = ""
    fixed: Optional[np.ndarray] = None
    tilt: Optional[np.ndarray] = None
    gradient: Optional[np.ndarray] = None

    def __repr__(self) -> str:
        return f"<nscdd.{type(self).__name__}: {len(self.radii)} grains in {self.positions.shape[1]}D>"


@dataclass(frozen=True, eq=False, repr=False)
class State(Packing):
    """The state of a simulation at the end of a step: a Packing with its motion, and more.

    contacts (structured as Simulation.contacts), walls {name: {"offset", "normal", "velocity"}}, densities of the materials,
    step, time [s], and the name of the scene.
    """

    contacts: Optional[np.ndarray] = None
    walls: Optional[dict] = None
    densities: Optional[np.ndarray] = None
    step: int = 0
    time: float = 0.0
    scene: str = ""


def read_packing(path: Path) -> Packing:
    """Reads a packing, as `nscdd pack` writes it, or the packing in a state. Raises ValueError naming file and dataset."""
    return Packing(**_core.read_packing(name_of(path)))


def write_packing(path: Path, positions: Any, radii: Any, box: Any, *, periodic: str = "") -> None:
    """Writes a packing of positions (n, dim), radii (n), and box (dim) that it fills from 0 on [m]."""
    x = points("write_packing: positions", positions, least=1)
    n, dim = x.shape
    r, edges = array("write_packing: radii", radii, (n,), positive=True), array("write_packing: box", box, (dim,), positive=True)
    repeats = axes("write_packing: periodic", periodic, dim)
    _core.write_packing(name_of(path), x, r, edges, [int(axis in repeats) for axis in "xyz"[:dim]] if repeats else [])


def load(path: Path) -> State:
    """Reads a state that Simulation.save() or `nscdd run --state` wrote. Raises ValueError naming file and dataset."""
    found = _core.read_state(name_of(path))
    found.pop("dimension")
    return State(contacts=structured(found.pop("contacts")), **found)


def structured(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """These columns as one array with fields, read-only as they are."""
    rows = np.empty(len(columns["i"]), dtype=[(key, column.dtype, column.shape[1:]) for key, column in columns.items()])
    for key, column in columns.items():
        rows[key] = column
    rows.setflags(write=False)
    return rows


@contextlib.contextmanager
def aside(path: Path) -> Iterator[str]:
    """Name of a file beside `path`, which takes its place when all is written."""
    name = os.path.realpath(name_of(path))  # a link stays one
    part = f"{name}.{os.getpid()}.part"
    try:
        if os.path.isdir(name):
            raise IsADirectoryError(f"{name}: is a folder")
        if os.path.exists(name) and not os.path.isfile(name):
            raise OSError(f"{name}: is not a file that can be replaced")
        try:
            open(part, "wb").close()  # tells what is wrong with the folder better than HDF5 does
        except OSError as error:
            raise type(error)(f"{name}: cannot be written: {error.strerror}") from None
        yield part
        os.replace(part, name)
    finally:
        with contextlib.suppress(OSError):
            os.remove(part)


def read_series(path: Path) -> dict:
    """Reads a time series, .csv or HDF5: {column: (steps, ...)}. reports/series.md has the columns and their units.

    Raises ValueError naming the file.
    """
    name = name_of(path)
    try:
        if os.path.exists(name) and not os.path.isfile(name):
            raise ValueError("it is not a file")
        if name.endswith(".csv"):
            return _columns(name)
        import h5py

        with h5py.File(name, "r") as file:
            if found := [key for key in file if not isinstance(file[key], h5py.Dataset)]:
                raise ValueError(f"{found[0]} is a group, which a series does not have")
            return {key: file[key][()] for key in file if key != "box_at_start"}
    except (OSError, ValueError) as error:
        raise ValueError(f"{name}: no time series: {' '.join(str(error).split())}") from None


def _columns(name: str) -> dict:
    """Of a .csv with a line of names."""
    with open(name) as file:
        names, rows = file.readline().strip().split(","), file.read().splitlines()
    if names == [""]:
        raise ValueError("it is empty")
    table = np.empty((len(rows), len(names)))
    for k, row in enumerate(rows):
        numbers = row.split(",")
        if len(numbers) != len(names):
            raise ValueError(f"line {k + 2} has {len(numbers)} numbers for {len(names)} columns")
        table[k] = [float(number) for number in numbers]
    return dict(zip(names, table.T.copy()))


def read_problem(path: Path) -> dict:
    """Reads a contact problem in FCLIB's format: W, q, mu or M, H, f, w, mu (and mu_r), matrices as scipy.sparse.csc_matrix."""
    import scipy.sparse

    found = _core.read_problem(name_of(path))
    for key in ("W", "M", "H"):
        if key in found:
            parts = found[key]
            found[key] = scipy.sparse.csc_matrix((parts["data"], parts["indices"], parts["indptr"]), shape=parts["shape"])
    return found
