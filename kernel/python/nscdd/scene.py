"""What a scene is made of beside its grains: walls, a cell, materials. Each becomes a table as scene files have it."""
from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Mapping, Optional, Sequence, Union

import numpy as np

from ._checks import array, instance, number, unit

Vector = Sequence[float]


@dataclass(frozen=True, eq=False)
class Wall:
    """A plane that bounds the sample, with one side that grains do not enter.

    normal    (dim) unit vector into the sample
    through   (dim) a point of the plane [m]; or offset, normal . (any point of it) [m]
    side      "x-" to "z+" in their place: a face of the box that Simulation is given
    velocity  (dim) prescribed [m/s]; of a wall that is pushed the part within its plane alone
    force     pushes the wall along its normal, positive into the sample [N]
    pressure  the same per area that the face has at the moment [Pa]; needs walls with `side` on all faces of the box
    mass      of a wall that is pushed [kg]; that of all grains unless given
    material  its name; the first material unless given
    motion    other keys of a [[wall]], such as {"motion": "oscillating", "amplitude": 0.01, "frequency": 20}
    name      for messages and `sim.walls[name]`; "wall 0" and so on unless given

    A wall without velocity, force and pressure is at rest.
    """

    normal: Optional[Vector] = None
    through: Optional[Vector] = None
    side: Optional[str] = None
    offset: Optional[float] = None
    velocity: Optional[Vector] = None
    force: Optional[float] = None
    pressure: Optional[float] = None
    mass: Optional[float] = None
    material: Optional[str] = None
    name: Optional[str] = None
    motion: Optional[Mapping[str, Any]] = None

    def table(self, row: int, material: str) -> dict:
        """The wall as a table [[wall]] of a scene file."""
        name = self.name if self.name is not None else f"wall {row}"
        normal, through = self.normal, self.through
        if isinstance(normal, np.ndarray) and normal.dtype == np.float32:
            normal = unit(f"wall '{name}': normal", array(f"wall '{name}': normal", normal, (None,)))
        if self.offset is not None:
            if through is not None or self.normal is None:
                raise ValueError(f"wall '{name}': offset needs normal, and stands in the place of through")
            through = number(f"wall '{name}': offset", self.offset) * array(f"wall '{name}': normal", normal, (None,))
        if self.force is not None and self.pressure is not None:
            raise ValueError(f"wall '{name}': a force or a pressure pushes it, not both")
        pushed = "force" if self.force is not None else "pressure" if self.pressure is not None else None
        return {
            "name": name,
            "normal": normal,
            "through": through,
            "side": self.side,
            "material": self.material if self.material is not None else material,
            "motion": pushed or ("velocity" if self.velocity is not None else "fixed"),
            "velocity": self.velocity,
            "force": self.force,
            "pressure": self.pressure,
            "mass": self.mass,
            **_motion(f"wall '{name}'", self.motion),
        }


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A line (2D), a mesh (3D) or a cylinder (a circle in 2D) that grains meet on both sides, at the closest point.

    points            (n, dim) corners [m]; in 2D joined one after the other, and to the first one if closed
    faces             in 3D: a list of rows of points for each face
    stl, scale, shift in 3D, in the place of points: a file; a corner is at scale times that of the file, plus shift
    cylinder          {"centre": (dim), "radius": R}, in 3D also "axis" and, unless it is endless, "length"
    velocity          (dim) [m/s]; at rest unless given
    motion            keys of another motion, such as {"motion": "rotating", "rate": 0.5}
    material, name    as of a Wall
    """

    points: Any = None
    faces: Optional[Sequence[Sequence[int]]] = None
    closed: Optional[bool] = None
    stl: Any = None
    scale: Optional[float] = None
    shift: Optional[Vector] = None
    cylinder: Optional[Mapping[str, Any]] = None
    velocity: Optional[Vector] = None
    motion: Optional[Mapping[str, Any]] = None
    material: Optional[str] = None
    name: Optional[str] = None

    def table(self, row: int, material: str) -> dict:
        """The obstacle as a table [[obstacle]] of a scene file."""
        name = self.name if self.name is not None else f"obstacle {row}"
        for key, value, kinds, told in (
            ("cylinder", self.cylinder, Mapping, "a dictionary with centre and radius"),
            ("stl", self.stl, (str, os.PathLike), "the name of a file"),
        ):
            if value is not None:
                instance(f"obstacle '{name}': {key}", value, kinds, told)
        own = {
            "name": name,
            "material": self.material if self.material is not None else material,
            "motion": "velocity" if self.velocity is not None else "fixed",
            "stl": os.fspath(self.stl) if self.stl is not None else None,
            "cylinder": dict(self.cylinder) if self.cylinder is not None else None,
        }
        plain = ("points", "faces", "closed", "scale", "shift", "velocity")
        return {**own, **{key: getattr(self, key) for key in plain}, **_motion(f"obstacle '{name}'", self.motion)}


@dataclass(frozen=True, eq=False)
class Cell:
    """A box that repeats along some axes; it begins at 0.

    size      sides along these axes [m]
    periodic  the axes, such as "xy"; all of them unless given
    gradient  (dim, dim) velocity gradient of a flow [1/s]; row: what moves, column: along what
    stress    {"x": value, ...} drives the side along an axis, positive in compression [Pa]
    mass      of each side that a stress drives [kg]; 6 times that of all grains unless given
    """

    size: Optional[Vector] = None
    periodic: Optional[str] = None
    gradient: Optional[Sequence[Vector]] = None
    stress: Optional[Mapping[str, float]] = None
    mass: Optional[float] = None

    def table(self, dimension: int) -> dict:
        """The cell as the table [cell] of a scene file."""
        axes = "xyz"[:dimension] if self.periodic is None else instance("cell: periodic", self.periodic, (str, list, tuple), "names of axes")
        stress = None if self.stress is None else dict(instance("cell: stress", self.stress, Mapping, "a dictionary"))
        return {"periodic": list(axes), "size": self.size, "gradient": self.gradient, "stress": stress, "mass": self.mass}


Pairs = Mapping[tuple, Mapping[str, float]]


def _motion(thing: str, keys: Optional[Mapping[str, Any]]) -> Mapping[str, Any]:
    return {} if keys is None else instance(f"{thing}: motion", keys, Mapping, "a dictionary")


def material_tables(density: Union[None, float], materials: Optional[Mapping[str, float]]) -> list:
    """[[material]] of a scene file."""
    if (density is None) == (materials is None):
        raise ValueError("Simulation: give density, or materials as {name: density}")
    named = {"grains": density} if materials is None else instance("Simulation: materials", materials, Mapping, "a dictionary {name: density}")
    if not named:
        raise ValueError("Simulation: materials must have one at least")
    return [{"name": name, "density": value} for name, value in named.items()]


def checked_pairs(pairs: Optional[Pairs]) -> Pairs:
    """The pairs that are given."""
    if pairs is None:
        return {}
    for pair, values in instance("Simulation: pairs", pairs, Mapping, "a dictionary {(name, name): {key: value}}").items():
        if not isinstance(pair, (tuple, frozenset)) or len(pair) != 2:
            raise ValueError(f"Simulation: pairs has the key {pair!r}, it needs two names of materials")
        instance(f"Simulation: pairs: {tuple(pair)}", values, Mapping, "a dictionary")
    return pairs


def pair_tables(names: Sequence[str], others: Mapping[str, Optional[float]], pairs: Pairs) -> list:
    """[[pair]] of a scene file: those given, and all others. What a pair does not say is the same for all."""
    tables = [{"materials": list(pair), **others, **values} for pair, values in pairs.items()]
    given = set(map(frozenset, pairs))
    for k, a in enumerate(names):
        for b in names[k:]:
            if frozenset((a, b)) not in given:
                tables.append({"materials": [a, b], **others})
    return tables
