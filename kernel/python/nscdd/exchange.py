"""Grains for other programs, and from them: ON-DEM's VTKHDF and CSV, beside packings and states of nscdd.

    python3 -m nscdd.exchange packing.h5 packing.vtkhdf                # formats by the endings: .h5, .vtkhdf, .csv
    python3 -m nscdd.exchange state.h5 state.vtkhdf --h 1e-3           # with contacts: --h is the step of their impulses
    python3 -m nscdd.exchange packing.h5 packing.vtkhdf --grid         # for VTK 9.2, as ParaView 5.11 of Debian 12 has it
    python3 -m nscdd.exchange yade.vtkhdf packing.h5                   # then: nscdd run SCENE --packing packing.h5

Numbers keep all their bits. An output that exists is replaced when the new one is complete. Exit code 1, and one line that
names file and place, where an input is wrong or an output cannot be written.
"""
from __future__ import annotations

import argparse
import contextlib
import csv
import dataclasses
import difflib
import os
import re
import sys
from typing import Any, Callable, Iterator, Mapping, Optional, Sequence

import h5py
import numpy as np

from ._checks import Path, array, axes, instance, integer, number
from ._checks import path as name_of
from ._checks import points, require, unit, whole
from .files import Packing, State, aside, load, read_packing

POINTS, SPHERES, SCENE, BOX = "VTKHDF/PointData", "ONDEM/Bodies/Sphere", "ONDEM/Scene", "ONDEM/ImposedConditions/periodic_box"
WALLS, PLANES = "ONDEM/Bodies/Walls", "ONDEM/Bodies/Planes"  # along an axis, as YADE has them; and all others
Place = Callable[[str], str]


def write_vtkhdf(
    path: Path, grains: Packing, *, h: float = 0.0, gravity: Optional[Sequence[float]] = None, density: Optional[float] = None, grid: bool = False
) -> None:
    """Writes grains, and contacts, walls, materials and the box that repeats, as ON-DEM's draft 0.1 names them.

    grains    a Packing or a State, or what has their attributes; where `box` is None it is that of read_vtkhdf()
    h         step of the contacts' impulses [s], which ON-DEM has as forces; needed where there are contacts, else 0 is written
    gravity   (dim) [m/s^2]; 0 is written unless given
    density   of all grains [kg/m^3], where `grains` has none; masses and inertias are NaN without it
    grid      an unstructured grid in place of ON-DEM's poly data, which VTK 9.2 does not read

    Raises ValueError naming what is wrong in `grains`, OSError where the file cannot be written.
    """
    state = _checked(grains, lambda field: f"write_vtkhdf: {field}")
    n, dim = state.positions.shape
    contacts = state.contacts if state.contacts is not None and len(state.contacts) else None
    h = number("write_vtkhdf: h", h, finite=False)
    if not (np.isfinite(h) and h >= 0) or (contacts is not None and h == 0):
        raise ValueError(f"write_vtkhdf: h must be > 0 and finite, the step of the contacts' impulses, found {h}")
    pulled = array("write_vtkhdf: gravity:", np.zeros(dim) if gravity is None else gravity, (dim,))
    if density is not None and state.densities is None:
        density = number("write_vtkhdf: density", density, positive=True)
        kinds = 1 if state.material is None else max(len(state.materials), int(state.material.max()) + 1)
        state = dataclasses.replace(state, densities=np.full(kinds, density))
        if state.material is None:
            state = dataclasses.replace(state, material=np.zeros(n, dtype=np.int32))
    with aside(path) as part, h5py.File(part, "w") as file:
        file.attrs.update({"file_format": "ON-DEM VTKHDF", "file_format_version": "0.1-draft", "source_code": "nscdd"})
        _write_bodies(file, state, grid)
        scene = file.create_group(SCENE)
        scene.attrs.update({"time": state.time, "timestep": h, "step": state.step, "name": state.scene, "dimension": dim})
        scene["gravity"], scene["box"] = _padded(pulled[None])[0], state.box
        scene.create_dataset("units", data=["second", "meter", "kilogram"], dtype=h5py.string_dtype())
        kinds = max(len(state.materials), 0 if state.densities is None else len(state.densities), 0 if state.material is None else state.material.max() + 1)
        for row in range(kinds):
            material = file.create_group(f"ONDEM/Materials/{row}")
            material["id"] = np.int32(row)
            material["density"] = np.nan if state.densities is None else state.densities[row]
            if state.materials:
                material["label"] = np.bytes_(state.materials[row].encode())
        if state.periodic:
            box = file.create_group(BOX)
            box.attrs["axes"] = state.periodic
            shape, gradient = np.diag(np.append(state.box, [2 * state.radii.max()])[:3]), np.zeros((3, 3))
            shape[:dim, :dim] += 0 if state.tilt is None else state.tilt
            gradient[:dim, :dim] = 0 if state.gradient is None else state.gradient
            box["shape"], box["velocity_gradient"] = shape.ravel(), gradient.ravel()
        if state.walls:
            _write_walls(file, state)
        if contacts is not None:
            _write_contacts(file, contacts, n, h)


def _write_bodies(file: h5py.File, state: State, grid: bool) -> None:
    n, dim = state.positions.shape
    r, spins = state.radii, np.zeros((n, 3))
    if state.spins is not None:
        spins[:, 3 - state.spins.reshape(n, -1).shape[1] :] = state.spins.reshape(n, -1)
    volume = 4 / 3 * np.pi * r**3 if dim == 3 else np.pi * r**2
    mass = np.full(n, np.nan) if state.densities is None else state.densities[0 if state.material is None else state.material] * volume
    inertia = np.zeros((n, 9))
    inertia[:, ::4] = (mass * r**2)[:, None] * ([0.4, 0.4, 0.4] if dim == 3 else [0.25, 0.25, 0.5])
    vtk = file.create_group("VTKHDF")
    vtk.attrs["Type"], vtk.attrs["Version"] = np.bytes_("UnstructuredGrid" if grid else "PolyData"), np.array([1 if grid else 2, 0])
    vtk["NumberOfPoints"], vtk["Points"] = np.array([n]), _padded(state.positions)
    vtk["Types"] = np.ones(n, dtype=np.uint8)  # vertices of a grid: VTK 9.1 takes poly data for one
    for kind, cells in (("", n), ("Vertices/", n), ("Lines/", 0), ("Polygons/", 0), ("Strips/", 0)):
        vtk[f"{kind}NumberOfCells"], vtk[f"{kind}NumberOfConnectivityIds"] = np.array([cells]), np.array([cells])
        vtk[f"{kind}Offsets"], vtk[f"{kind}Connectivity"] = np.arange(cells + 1), np.arange(cells)
    fields = {
        "body_id": np.arange(n, dtype=np.int32),
        "material_id": np.full(n, -1, dtype=np.int32) if state.material is None else state.material,
        "clump_id": np.full(n, -1, dtype=np.int32),
        "position": vtk["Points"],  # the same dataset under another name
        "velocity": np.zeros((n, 3)) if state.velocities is None else _padded(state.velocities),
        "orientation": np.tile([0.0, 0, 0, 1], (n, 1)),
        "angular_velocity": spins,
        "mass": mass,
        "inertia": inertia,
        "volume": volume,
        "radius": r,
    }
    if state.fixed is not None:
        fields["fixed"] = state.fixed
    points, spheres = file.create_group(POINTS), file.create_group(SPHERES)
    spheres.attrs["count"] = n
    for name, values in fields.items():
        points[name] = values
        spheres[name] = points[name]


def _write_walls(file: h5py.File, state: State) -> None:
    n = len(state.radii)
    names = list(state.walls)
    normal, velocity = (_padded(np.array([state.walls[name][key] for name in names])) for key in ("normal", "velocity"))
    offset = np.array([float(state.walls[name]["offset"]) for name in names])
    along = (np.abs(normal) == 1).any(axis=1)
    for path, rows in ((WALLS, np.flatnonzero(along)), (PLANES, np.flatnonzero(~along))):
        if not len(rows):
            continue
        group = file.create_group(path)
        group.attrs.update({"count": len(rows), "shape_type": "wall" if path == WALLS else "plane"})
        group["body_id"], group["material_id"] = (n + rows).astype(np.int32), np.full(len(rows), -1, dtype=np.int32)
        if path == WALLS:
            group["axis"] = np.abs(normal[rows]).argmax(axis=1).astype(np.int32)
            group["sense"] = normal[rows].sum(axis=1).astype(np.int32)
        group["position"] = normal[rows] * offset[rows, None]
        group["normal"], group["offset"], group["velocity"] = normal[rows], offset[rows], velocity[rows]
        group.create_dataset("name", data=[names[row] for row in rows], dtype=h5py.string_dtype())


def _write_contacts(file: h5py.File, contacts: np.ndarray, n: int, h: float) -> None:
    j, normal, pushed = contacts["j"], contacts["normal"], contacts["normal_impulse"]
    group = file.create_group("ONDEM/Interactions/intr3D")
    group.attrs["count"] = len(contacts)
    group["model"] = np.full(len(contacts), b"nonsmooth")
    group["id1"], group["id2"] = np.where(j < 0, n - 1 - j, j).astype(np.int32), contacts["i"].astype(np.int32)
    group["virtual"] = (pushed == 0).astype(np.int8)
    group["normal"], group["normal_force"] = _padded(normal), -pushed / h  # positive in traction
    group["shear_force"] = _padded((contacts["impulse"] - pushed[:, None] * normal) / h)
    group["overlap"] = -contacts["gap"]
    group["impulse"], group["normal_impulse"] = _padded(contacts["impulse"]), pushed  # a force times h may lack the last bit
    if "couple" in contacts.dtype.names:
        group["couple"] = contacts["couple"]


def read_vtkhdf(path: Path) -> State:
    """Reads spheres, and contacts, walls, materials and the box that repeats, of a file as ON-DEM's draft 0.1 names them.

    Walls are those along an axis, and those that write_vtkhdf() wrote. Other bodies, and contacts with them, are passed over.
    What the file does not have is None. `box` reaches to the grains then; where that is not above 0, it is as large as they are.
    `contacts` is None where the file has no impulses, and no time step that makes impulses of its forces. Raises ValueError
    naming file and dataset: missing, damaged, not finite, radii not above 0, clumps.
    """
    name = name_of(path)
    with _reading(name), _opened(name) as file:
        return _read_vtkhdf(name, file)


def _read_vtkhdf(name: str, file: h5py.File) -> State:
    bodies = POINTS if f"{POINTS}/radius" in file else SPHERES
    radii = _get(name, file, f"{bodies}/radius")
    n, where = len(radii), f"{bodies}/position" if f"{bodies}/position" in file else "VTKHDF/Points"
    scene = file.get(SCENE, {})
    attributes = dict(scene.attrs) if scene else {}
    dim = int(attributes.get("dimension", 3))
    if dim not in (2, 3):
        raise ValueError(f"{name}: attribute 'dimension' of '{SCENE}' must be 2 or 3, found {dim}")

    def of(field: str, *columns: int) -> Optional[np.ndarray]:
        return _get(name, file, f"{bodies}/{field}", n, *columns) if f"{bodies}/{field}" in file else None

    clump, ids = of("clump_id"), of("body_id")
    if clump is not None and (clump >= 0).any():
        raise ValueError(f"{name}: dataset '{bodies}/clump_id': row {np.argmax(clump >= 0)} is a part of a clump: grains here are single")
    positions, velocities, spins = _get(name, file, where, n, 3), of("velocity", 3), of("angular_velocity", 3)
    material, materials, densities = _read_materials(name, file, of("material_id"), bodies)
    walls = _read_walls(name, file, positions)
    rows = {int(body): row for row, body in enumerate(range(n) if ids is None else ids)}
    rows.update({body: -1 - row for row, (body, _, _) in enumerate(walls)})
    if len(rows) < n + len(walls) or len({label for _, label, _ in walls}) < len(walls):
        raise ValueError(f"{name}: dataset '{bodies}/body_id': two bodies have the same number, or two walls the same name")
    state = State(
        positions=positions[:, :dim],
        radii=radii,
        box=_get(name, file, f"{SCENE}/box", dim) if f"{SCENE}/box" in file else None,
        velocities=None if velocities is None else velocities[:, :dim],
        spins=spins if spins is None or dim == 3 else spins[:, 2],
        material=material,
        materials=materials,
        densities=densities,
        fixed=of("fixed"),
        walls={label: {key: part[:dim] if key != "offset" else part for key, part in wall.items()} for _, label, wall in walls},
        contacts=_read_contacts(name, file, rows, dim, float(attributes.get("timestep", 0))),
        step=int(attributes.get("step", 0)),
        time=float(attributes.get("time", 0)),
        scene=str(attributes.get("name", "")),
    )
    if f"{BOX}/shape" in file:
        state = dataclasses.replace(state, **_read_box(name, file, dim))
    fields = {
        "positions": where,
        "radii": f"{bodies}/radius",
        "box": f"{BOX}/shape" if f"{BOX}/shape" in file else f"{SCENE}/box",
        "velocities": f"{bodies}/velocity",
    }
    fields.update({"spins": f"{bodies}/angular_velocity", "material": f"{bodies}/material_id", "fixed": f"{bodies}/fixed"})
    fields.update({"tilt": f"{BOX}/shape", "gradient": f"{BOX}/velocity_gradient", "densities": "ONDEM/Materials/<id>/density"})
    return _checked(state, lambda field: f"{name}: dataset '{fields[field]}'" if field in fields else f"{name}: {field}")


def _read_materials(name: str, file: h5py.File, given: Optional[np.ndarray], bodies: str) -> tuple:
    """Rows of the grains' materials, their names, and their densities."""
    found = {}
    for key in file.get("ONDEM/Materials", ()):
        group = f"ONDEM/Materials/{key}"
        parts = {part: file[f"{group}/{part}"][()] if f"{group}/{part}" in file else None for part in ("id", "label", "density")}
        found[int(key if parts["id"] is None else parts["id"])] = parts
    if given is None or (given == -1).all():
        given = None
    elif found:
        rows = {number: row for row, number in enumerate(sorted(found))}
        for row, number in enumerate(given):
            if int(number) not in rows:
                raise ValueError(f"{name}: dataset '{bodies}/material_id': row {row} is {number}, which 'ONDEM/Materials' does not have")
        given = np.array([rows[int(number)] for number in given], dtype=np.int32)
    parts = [found[number] for number in sorted(found)]
    labels = [_text(part["label"]) for part in parts if part["label"] is not None]
    known = [float(part["density"]) for part in parts if part["density"] is not None and np.isfinite(part["density"])]
    return given, labels if len(labels) == len(parts) else (), np.array(known) if parts and len(known) == len(parts) else None


def _read_box(name: str, file: h5py.File, dim: int) -> dict:
    """Edges, tilt and flow of the box that repeats."""
    shape = _get(name, file, f"{BOX}/shape", 9).reshape(3, 3)[:dim, :dim]
    if np.tril(shape, -1).any():
        raise ValueError(f"{name}: dataset '{BOX}/shape' must be upper triangular: its first edge lies along x, its second in the plane of x and y")
    found = {"box": shape.diagonal().copy(), "periodic": str(file[BOX].attrs.get("axes", "xyz"[:dim]))}
    if np.triu(shape, 1).any():
        found["tilt"] = np.triu(shape, 1)
    if f"{BOX}/velocity_gradient" in file:
        gradient = _get(name, file, f"{BOX}/velocity_gradient", 9).reshape(3, 3)[:dim, :dim]
        found.update({"gradient": gradient.copy()} if gradient.any() else {})
    return found


def _read_walls(name: str, file: h5py.File, positions: np.ndarray) -> list:
    """(number of the body, name, wall) of each."""
    found: list = []
    for path in (WALLS, PLANES):
        if f"{path}/position" not in file:
            continue
        position = _get(name, file, f"{path}/position", None, 3)
        w, more = len(position), {}
        for field, columns in (("body_id", ()), ("axis", ()), ("sense", ()), ("normal", (3,)), ("velocity", (3,)), ("offset", ()), ("name", ())):
            if f"{path}/{field}" in file:
                more[field] = _get(name, file, f"{path}/{field}", w, *columns)
        for needed in ("body_id", *(() if "normal" in more else ("axis", "sense"))):
            if needed not in more:
                raise ValueError(f"{name}: dataset '{path}/{needed}' is missing")
        for row in range(w):
            if "normal" in more:
                normal = more["normal"][row]
            else:  # YADE's wall of sense 0 has two sides: that of the grains counts
                axis, sense = int(more["axis"][row]), int(more["sense"][row])
                if axis not in (0, 1, 2):
                    raise ValueError(f"{name}: dataset '{path}/axis': row {row} must be 0, 1 or 2, found {axis}")
                normal = np.eye(3)[axis] * (sense or (1 if positions[:, axis].mean() >= position[row, axis] else -1))
            offset = more["offset"][row] if "offset" in more else normal @ position[row]
            velocity = more["velocity"][row] if "velocity" in more else np.zeros(3)
            label = _text(more["name"][row]) if "name" in more else f"wall {len(found)}"
            found.append((int(more["body_id"][row]), label, {"offset": float(offset), "normal": normal.copy(), "velocity": velocity.copy()}))
    return sorted(found, key=lambda wall: wall[0])


def _read_contacts(name: str, file: h5py.File, rows: dict, dim: int, h: float) -> Optional[np.ndarray]:
    """Of all kinds together, between bodies that are `rows`: grains from 0 on, walls from -1 down."""
    root, parts = "ONDEM/Interactions", []
    for path in [root] + [f"{root}/{key}" for key in file.get(root, ())]:
        if f"{path}/id1" not in file:
            continue
        one = _get(name, file, f"{path}/id1")
        m = len(one)
        two, normal = _get(name, file, f"{path}/id2", m), _get(name, file, f"{path}/normal", m, 3)
        if f"{path}/impulse" in file and f"{path}/normal_impulse" in file:
            impulse, pushed = _get(name, file, f"{path}/impulse", m, 3), _get(name, file, f"{path}/normal_impulse", m)
        elif h > 0:
            # YADE's exporter has what pushes positive, against the schema
            pushed = _get(name, file, f"{path}/normal_force", m) * (h if _text(file.attrs.get("source_code", "")) == "YADE" else -h)
            shear = _get(name, file, f"{path}/shear_force", m, 3) if f"{path}/shear_force" in file else np.zeros((m, 3))
            impulse = pushed[:, None] * normal + shear * h
        else:
            continue
        gap = -_get(name, file, f"{path}/overlap", m) if f"{path}/overlap" in file else np.zeros(m)
        first, second = (np.array([rows.get(int(body), len(rows)) for body in bodies], dtype=np.int32) for bodies in (one, two))
        keep = (np.maximum(first, second) >= 0) & (np.maximum(first, second) < len(rows))
        turned = np.where(second < 0, -1.0, 1.0)[:, None]  # normals go from id1 to id2, forces are on id2, and i must be a grain
        part = {"i": np.where(second < 0, first, second), "j": np.where(second < 0, second, first), "normal": normal[:, :dim] * turned}
        part.update(gap=gap, impulse=impulse[:, :dim] * turned, normal_impulse=pushed)
        if f"{path}/couple" in file:
            part["couple"] = _get(name, file, f"{path}/couple", m, 3 if dim == 3 else 1)
        part["subdomain"] = np.zeros(m, dtype=np.int32)
        parts.append({field: values[keep] for field, values in part.items()})
    if not parts:
        return None
    joined = {field: np.concatenate([part[field] for part in parts]) for field in parts[0] if all(field in part for part in parts)}
    contacts = np.empty(len(joined["i"]), dtype=[(field, values.dtype, values.shape[1:]) for field, values in joined.items()])
    for field, values in joined.items():
        contacts[field] = values
    return contacts


def write_csv(path: Path, grains: Packing) -> None:
    """Writes grains as text, a row each: x,y,z,radius,vx,vy,vz,wx,wy,wz,material,fixed; of disks x,y,radius,vx,vy,w,...

    What `grains` does not have has no column. Lines that begin with # come first, for the box: `# box,1.0,1.0`, and so for
    periodic, tilt, gradient, materials and densities. Contacts, walls and time are left out. Each number has the digits that
    give its bits again. Raises ValueError naming what is wrong in `grains`, OSError where the file cannot be written.
    """
    state = _checked(grains, lambda field: f"write_csv: {field}")
    n, dim = state.positions.shape
    labels = _names("write_csv: materials", state.materials)
    columns = dict(zip("xyz", state.positions.T.tolist()), radius=state.radii.tolist())
    for prefix, values in (("v", state.velocities), ("w", state.spins)):
        if values is not None and values.ndim == 2:
            columns.update({prefix + axis: column for axis, column in zip("xyz", values.T.tolist())})
        elif values is not None:
            columns["w"] = values.tolist()
    if state.material is not None:
        columns["material"] = [labels[row] for row in state.material] if labels else state.material.tolist()
    if state.fixed is not None:
        columns["fixed"] = state.fixed.tolist()
    above = {"box": state.box, "periodic": [state.periodic] if state.periodic else None, "tilt": state.tilt, "gradient": state.gradient}
    above.update(materials=labels or None, densities=state.densities)
    with aside(path) as part, open(part, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        for key, values in above.items():
            if values is not None:
                writer.writerow([f"# {key}", *np.ravel(values).tolist()])
        writer.writerow(columns)
        writer.writerows(zip(*columns.values()))


def read_csv(path: Path) -> State:
    """Reads grains as write_csv() writes them; x, y and radius must be there, and z of spheres.

    Without a line `# box` the box is that of read_vtkhdf(). Without `# materials`, whole numbers in the column `material` are
    rows of the scene's materials, and names are numbered as they come. Other lines that begin with # are remarks, unless
    their first word is nearly one of these. Raises ValueError naming file, line and column: missing, unknown, no number, not
    finite, radii not above 0.
    """
    name = name_of(path)
    above, lines, rows = {}, [], []
    with _reading(name), open(_there(name), newline="", encoding="utf-8-sig") as file:
        reader = csv.reader(file)
        for row in reader:
            if row and row[0].lstrip().startswith("#"):
                key, values = row[0].lstrip("# ").strip(), row[1:]
                if key in ABOVE and key in above:
                    raise ValueError(f"{name}, line {reader.line_num}: '# {key}' is there twice, first in line {above[key][0]}")
                word = re.split(r"\W", key.lower())[0]
                if key not in ABOVE and (near := difflib.get_close_matches(word, ABOVE, cutoff=0.75)):
                    raise ValueError(f"{name}, line {reader.line_num}: remark '{row[0]}' is nearly '# {near[0]},...', with commas before the values")
                above[key] = (reader.line_num, values)
            elif row:
                lines.append(reader.line_num)
                rows.append(row)
    if len(rows) < 2:
        raise ValueError(f"{name}: needs a line with the names of columns, and grains below it")
    header, rows = [column.strip() for column in rows[0]], rows[1:]
    dim = 3 if "z" in header else 2
    axes, spins = "xyz"[:dim], ["wx", "wy", "wz"] if dim == 3 else ["w"]
    velocities = [f"v{axis}" for axis in axes]
    known = [*axes, "radius", *velocities, *spins, "material", "fixed"]
    groups = [group for group in (velocities, spins) if set(group) & set(header)]
    for column in (*axes, "radius", *sum(groups, [])):
        if column not in header:
            raise ValueError(f"{name}, line {lines[0]}: column '{column}' is missing")
    for k, column in enumerate(header):
        if column not in known or column in header[:k]:
            what = "is there twice" if column in known else f"is unknown, there are {', '.join(known)}"
            raise ValueError(f"{name}, line {lines[0]}: column '{column}' {what}")
    for line, row in zip(lines[1:], rows):
        if len(row) != len(header):
            raise ValueError(f"{name}, line {line}: has {len(row)} values for {len(header)} columns")

    def column(label: str, kind: Callable = float, least: float = -np.inf) -> np.ndarray:
        k = header.index(label)
        return np.array([_number(f"{name}, line {line}: column '{label}'", row[k], kind, least) for line, row in zip(lines[1:], rows)])

    def table(labels: Sequence[str]) -> Optional[np.ndarray]:
        return np.column_stack([column(label) for label in labels]) if set(labels) <= set(header) else None

    def listed(key: str, shape: Optional[tuple] = None) -> Optional[np.ndarray]:
        if key not in above:
            return None
        line, values = above[key]
        place = f"{name}, line {line}: {key}"
        numbers = np.array([_number(place, value, float) for value in values])
        if shape is not None and numbers.size != np.prod(shape):
            raise ValueError(f"{place} must have {np.prod(shape)} numbers, found {numbers.size}")
        return numbers if shape is None else numbers.reshape(shape)

    positions, radii, turning = table(axes), column("radius", least=0), table(spins)
    materials = _names(f"{name}, line {above['materials'][0]}: materials", above["materials"][1]) if "materials" in above else []
    for key, needed in (("periodic", "box"), ("tilt", "box")):
        if key in above and needed not in above:
            raise ValueError(f"{name}, line {above[key][0]}: '# {key}' needs a line '# {needed}'")
    material = None
    if "material" in header:
        texts = [row[header.index("material")].strip() for row in rows]
        if "" in texts:
            raise ValueError(f"{name}, line {lines[1:][texts.index('')]}: column 'material' is empty")
        if not materials and all(text.lstrip("-").isdigit() for text in texts):
            material = column("material", int)
        else:
            listed_before = bool(materials)
            numbers = {label: row for row, label in enumerate(materials or dict.fromkeys(texts))}
            for line, text in zip(lines[1:], texts):
                if text not in numbers:
                    raise ValueError(f"{name}, line {line}: column 'material': '{text}' is not among {', '.join(numbers)}")
            material = np.array([numbers[text] for text in texts], dtype=np.int32)
            materials = materials if listed_before else list(numbers)
    state = State(
        positions=positions,
        radii=radii,
        box=listed("box", (dim,)),
        velocities=table(velocities),
        spins=turning if turning is None or dim == 3 else turning[:, 0],
        material=material,
        materials=materials,
        densities=listed("densities"),
        periodic="".join(above["periodic"][1]) if "periodic" in above else "",
        fixed=column("fixed", int) if "fixed" in header else None,
        tilt=listed("tilt", (dim, dim)),
        gradient=listed("gradient", (dim, dim)),
    )
    return _checked(state, lambda field: f"{name}, line {above[field][0]}: {field}" if field in above else f"{name}: {field}")


def _names(place: str, labels: Sequence[str]) -> list:
    """Without blanks around them, which text does not keep."""
    names = [label.strip() for label in labels]
    if len(set(names)) < len(names) or not all(names):
        raise ValueError(f"{place} must be different names, found {list(labels)}")
    return names


def _read_h5(path: Path) -> State:
    """A state, or a packing as one."""
    name = name_of(path)
    with _reading(name), _opened(name) as file:
        is_state = "contacts" in file and "walls" in file
    return load(path) if is_state else State(**vars(read_packing(path)))


def _write_h5(path: Path, grains: Packing) -> None:
    """The packing of `grains`, as manual page 16 has it."""
    state = _checked(grains, lambda field: f"{name_of(path)}: {field}")
    n, dim = state.positions.shape
    with aside(path) as part, h5py.File(part, "w") as file:
        file.attrs.update({"dim": dim, "source": "nscdd.exchange"})
        file["x"], file["radius"], file["box"] = state.positions, state.radii, state.box
        optional = {"velocity": state.velocities, "material": state.material, "fixed": state.fixed}
        optional["spin"] = None if state.spins is None else state.spins.reshape(n, -1)
        optional["materials/name"] = np.array([label.encode() for label in state.materials]) if state.materials else None
        periodic = np.array([int(axis in state.periodic) for axis in "xyz"[:dim]], dtype=np.int32) if state.periodic else None
        if state.tilt is not None and state.tilt.any():
            optional.update({"cell/periodic": periodic, "cell/tilt": state.tilt})
        optional["periodic"] = periodic
        for key, values in optional.items():
            if values is not None:
                file[key] = values


def _checked(grains: Packing, place: Place) -> State:
    """As a State of contiguous arrays of the right shapes. Raises ValueError, with place(field) before it."""
    fields = {field.name: getattr(grains, field.name) for field in dataclasses.fields(State) if hasattr(grains, field.name)}
    if not {"positions", "radii", "box"} <= set(fields):
        raise ValueError(f"{place('grains')} must be a Packing or a State, found a {type(grains).__name__}")
    state = State(**fields)
    n, dim = points(f"{place('positions')}:", state.positions, least=1).shape
    shapes = {"positions": (n, dim), "radii": (n,), "box": (dim,), "velocities": (n, dim), "spins": (n,) if dim == 2 else (n, 3)}
    shapes.update(tilt=(dim, dim), gradient=(dim, dim), densities=(None,))
    arrays: dict = {}
    for field, shape in shapes.items():
        if getattr(state, field) is not None:
            arrays[field] = array(f"{place(field)}:", getattr(state, field), shape, positive=field in ("radii", "box", "densities"))
    if "tilt" in arrays and np.tril(arrays["tilt"]).any():
        raise ValueError(f"{place('tilt')}: must be 0 but above the diagonal: the first edge lies along x, the second in the plane of x and y")
    for field, most, told in (("material", np.inf, ">= 0"), ("fixed", 1, "0 or 1")):
        if getattr(state, field) is not None:
            arrays[field] = given = whole(f"{place(field)}:", getattr(state, field), (n,))
            require(f"{place(field)}:", (given >= 0) & (given <= most), told, given)
    for field, kind, told in (("materials", (list, tuple), "a list of names"), ("walls", (dict, type(None)), "a dictionary")):
        instance(f"{place(field)}:", getattr(state, field), kind, told)
    for label in state.materials:
        instance(f"{place('materials')}: each", label, str, "a name")
    if state.box is None:
        low, high = ((arrays["positions"] + reach).T for reach in (-arrays["radii"][:, None], arrays["radii"][:, None]))
        arrays["box"] = np.where(high.max(axis=1) > 0, high.max(axis=1), high.max(axis=1) - low.min(axis=1))
    kinds = len(state.materials) or len(arrays.get("densities", ()))
    if "densities" in arrays and len(arrays["densities"]) != kinds:
        raise ValueError(f"{place('densities')}: {len(arrays['densities'])} for {kinds} materials")
    if kinds and "material" in arrays and arrays["material"].max() >= kinds:
        row = np.argmax(arrays["material"] >= kinds)
        raise ValueError(f"{place('material')}: row {row} is {arrays['material'][row]}, of {kinds} materials")
    if state.contacts is not None:
        fields = ("normal", "gap", "impulse", "normal_impulse")
        if not {"i", "j", *fields} <= set(np.asarray(state.contacts).dtype.names or ()):
            raise ValueError(f"{place('contacts')}: must be an array with the fields i, j, {', '.join(fields)}")
        for field in fields:
            array(place(f"contacts: {field}:"), state.contacts[field], None)
        i, j = (whole(place(f"contacts: {field}:"), state.contacts[field], (None,)) for field in "ij")
        require(place("contacts: i:"), (i >= 0) & (i < n), f"a row of the {n} grains", i)
        require(place("contacts: j:"), j < n, f"below {n}, the number of grains", j)
    for label, wall in (state.walls or {}).items():
        if not isinstance(wall, Mapping) or not {"normal", "velocity", "offset"} <= set(wall):
            raise ValueError(f"{place('walls')}: '{label}' must be a dictionary with normal, velocity and offset")
        instance(f"{place('walls')}: each", label, str, "a name")
        normal = array(place(f"wall '{label}': normal:"), wall["normal"], (dim,))
        unit(place(f"wall '{label}': normal"), normal)
        array(place(f"wall '{label}': velocity:"), wall["velocity"], (dim,))
        number(place(f"wall '{label}': offset:"), wall["offset"])
    number(f"{place('time')}:", state.time)
    integer(f"{place('step')}:", state.step, 0, np.inf)
    axes(f"{place('periodic')}:", state.periodic, dim)
    return dataclasses.replace(state, **arrays)


def _get(name: str, file: h5py.File, dataset: str, *shape: Optional[int]) -> np.ndarray:
    """A dataset of this shape, in which None is any number; without a shape a list."""
    found = file.get(dataset)
    if not isinstance(found, h5py.Dataset):
        raise ValueError(f"{name}: dataset '{dataset}' is missing")
    wanted = shape or (None,)
    if len(found.shape) != len(wanted) or any(want is not None and want != has for want, has in zip(wanted, found.shape)):
        told = ", ".join("n" if want is None else str(want) for want in wanted)
        raise ValueError(f"{name}: dataset '{dataset}' must have shape ({told}), found {found.shape}")
    if found.dtype.kind == "c":
        raise ValueError(f"{name}: dataset '{dataset}' must be real numbers, found complex ones")
    with _reading(f"{name}: dataset '{dataset}'"):
        return found[()]


def _number(place: str, text: str, kind: Callable, least: float = -np.inf) -> Any:
    try:
        value = kind(text.replace("_", "?"))  # which Python takes for a space
    except ValueError:
        raise ValueError(f"{place}: '{text}' is no {'whole ' if kind is int else ''}number") from None
    if abs(value) >= (2**31 if kind is int else np.inf) or value != value:
        raise ValueError(f"{place}: must be {'a whole number of 32 bits' if kind is int else 'finite'}, found {text}")
    if value <= least:
        raise ValueError(f"{place}: must be > 0, found {text}")
    return value


def _padded(vectors: np.ndarray) -> np.ndarray:
    """(n, 2) or (n, 3) as (n, 3)."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1]))) if vectors.shape[1] < 3 else vectors


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


@contextlib.contextmanager
def _reading(name: str) -> Iterator[None]:
    """Whatever goes wrong is a ValueError that begins with the name of the file: damaged ones have many ways to."""
    try:
        yield
    except Exception as error:
        told = _line(error)
        raise ValueError(told if told.startswith(name) else f"{name}: cannot be read: {told}") from None


def _there(name: str) -> str:
    """The name of a file that can be read to its end: none of a folder or a pipe."""
    if not os.path.isfile(name):
        raise ValueError(f"{name}: is a folder or no file" if os.path.exists(name) else f"{name}: there is no such file")
    return name


def _opened(name: str) -> h5py.File:
    return h5py.File(_there(name), "r")


ABOVE = ("box", "periodic", "tilt", "gradient", "materials", "densities")  # lines of a CSV file that begin with #
READ = {".h5": _read_h5, ".vtkhdf": read_vtkhdf, ".csv": read_csv}
WRITE = {".h5": _write_h5, ".vtkhdf": write_vtkhdf, ".csv": write_csv}
LEFT_OUT = {".h5": ("contacts", "walls", "densities", "gradient"), ".csv": ("contacts", "walls")}


def _ending(name: str) -> str:
    ending = os.path.splitext(name)[1].lower()
    if ending not in READ:
        raise ValueError(f"{name}: the ending must be one of {', '.join(READ)}")
    return ending


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """The command line; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python3 -m nscdd.exchange", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", metavar="FROM", help="packing or state of nscdd (.h5), ON-DEM's VTKHDF (.vtkhdf), text (.csv)")
    parser.add_argument("target", metavar="TO", help="packing of nscdd (.h5), ON-DEM's VTKHDF (.vtkhdf), text (.csv)")
    options = parser.add_argument_group("to .vtkhdf")
    options.add_argument("--h", type=float, help="step of the contacts' impulses [s]")
    options.add_argument("--gravity", type=float, nargs="+", metavar="G", help="[m/s^2], a number for each axis")
    options.add_argument("--density", type=float, help="of all grains, where FROM has none [kg/m^3]")
    options.add_argument("--grid", action="store_true", help="an unstructured grid in place of poly data, for VTK before 9.3")
    asked = parser.parse_args(arguments)
    try:
        read, write = READ[_ending(asked.source)], WRITE[_ending(asked.target)]
        given = {key: value for key, value in vars(asked).items() if key not in ("source", "target") and value not in (None, False)}
        if given and write is not write_vtkhdf:
            raise ValueError(f"--{next(iter(given))} is for files .vtkhdf, not for {asked.target}")
        if os.path.exists(asked.target) and os.path.samefile(asked.source, asked.target):
            raise ValueError(f"{asked.target}: is read, and cannot be written too")
        state = read(asked.source)
        if write is write_vtkhdf and state.contacts is not None and len(state.contacts) and "h" not in given:
            raise ValueError(f"{asked.source}: has contacts, whose forces need the step of their impulses: give --h")
        write(asked.target, state, **given)
    except (ValueError, OSError) as error:
        print(f"nscdd.exchange: {_line(error)}", file=sys.stderr)
        return 1
    left = [what for what in LEFT_OUT.get(_ending(asked.target), ()) if (found := getattr(state, what)) is not None and len(found)]
    print(f"{asked.target}: {len(state.radii)} grains{'; left out: ' + ', '.join(left) if left else ''}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
