"""Contact problems of other codes, solved by the kernel."""
from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from . import _core
from ._checks import array, number, points, require, single, unit, whole
from .files import read_problem


@dataclass(frozen=True)
class Answer:
    """The answer to a contact problem.

    impulses             (m, size), of solve() normal first, couples last; of solve_contacts() on i in world axes [N s]
    relative_velocities  (m, size) u of solve(), normal first, spins last [m/s]; None of solve_contacts()
    velocities           (dof) v of the global form; (n, dim) of solve_contacts(); None of the local form
    spins                (n) in 2D, (n, 3) in 3D of solve_contacts() [rad/s], else None
    errors               of solve(): natural_map as Siconos 4.4 normalises it, natural_map_velocity, unilateral, eta, cone_excess,
                         complementarity, dissipation, worst_contact; None of solve_contacts(), whose figures are in the report
    report               nscdd.SolveReport; the eta of solve() is there the largest of the first three errors
    cpu                  time of the solver of solve() [s], else None
    """

    impulses: np.ndarray
    report: _core.SolveReport
    relative_velocities: Optional[np.ndarray] = None
    velocities: Optional[np.ndarray] = None
    spins: Optional[np.ndarray] = None
    errors: Optional[dict] = None
    cpu: Optional[float] = None

    @property
    def converged(self) -> bool:
        """Whether the tolerance is reached."""
        return self.report.converged

    @property
    def iterations(self) -> int:
        """Iterations that the solver made."""
        return self.report.iterations


def solve(
    W: Any = None,
    q: Any = None,
    mu: Any = None,
    *,
    mu_r: Any = None,
    M: Any = None,
    H: Any = None,
    f: Any = None,
    w: Any = None,
    solver: str = "auto",
    tolerance: float = 1e-8,
    max_iterations: int = 200000,
    check_every: int = 10,
    start: Any = None,
) -> Answer:
    """Solves a problem with Coulomb's law at m contacts, in local or in global form, with matrices of SciPy or dense ones.

    Local:   solve(W, q, mu)           u = W r + q
    Global:  solve(M=, H=, f=, w=, mu=)  M v = H r + f,  u = H^T v + w
    W        (m size, m size), and q (m size); the first argument may also be a file in FCLIB's format
    M        (dof, dof) invertible, H (dof, m size), f (dof), w (m size)
    mu       (m); size is 2 or 3, the components of a contact are normal first, then tangential
    mu_r     (m) of rolling resistance; a contact has a couple about its tangents then, last, and size is 3 or 5
    solver   "auto" (Gauss-Seidel, then "newton" where it gets nowhere), "nlgs" (Gauss-Seidel), "newton", "spg", "apgd"
             (projected gradients), or "none": start is judged
    tolerance        on the natural map, and on that of velocities (METHOD.md, 5.7)
    max_iterations, check_every   sweeps or gradient steps
    start    (m size) impulses to begin with; 0 unless given

    At each contact u_n >= 0, r_n >= 0, u_n r_n = 0, |r_t| <= mu r_n, and r_t = -mu r_n u_t / |u_t| where it slides.
    The couple has the same law with mu_r and the spin; "newton", "spg" and "apgd" do not know it.
    The first argument may be a problem of Siconos in their place, a FrictionContactProblem or a GlobalFrictionContactProblem,
    or any object with attributes M, q, mu (and H, b; mu_r).
    """
    if isinstance(W, (str, os.PathLike)):
        parts = read_problem(W)
        W, q, M, H, f, w = (parts.get(key) for key in ("W", "q", "M", "H", "f", "w"))
        mu, mu_r = parts["mu"], parts.get("mu_r")
    elif hasattr(W, "mu") and hasattr(W, "q"):
        problem = W
        W, mu, mu_r = None, problem.mu, getattr(problem, "mu_r", None)
        if hasattr(problem, "H"):
            M, H, f, w = problem.M, problem.H, problem.q, problem.b
        else:
            W, q = problem.M, problem.q
    local = W is not None and q is not None
    if local == (M is not None and H is not None and f is not None and w is not None) or mu is None:
        raise ValueError("solve: give W, q and mu, or M, H, f, w and mu")
    free = _vector("q", q) if local else _vector("w", w)
    dim, mu, rolling = _dimension(free, mu, mu_r)
    first = _vector("start", start) if start is not None else np.empty(0)
    if start is not None and first.shape != free.shape:
        raise ValueError(f"solve: start has {first.size} numbers, the problem {free.size}")
    asked = _core.Asked(solver, tolerance, max_iterations, check_every, first)
    if local:
        found = _core.solve_matrix(dim, _csc("W", W, (free.size, free.size)), free, mu, rolling, asked)
        found["velocities"] = None
    else:
        force = _vector("f", f)
        m, h = _csc("M", M, (force.size, force.size)), _csc("H", H, (force.size, free.size))
        found = _core.solve_global(dim, m, h, force, free, mu, rolling, asked)
    return Answer(**found)


def solve_contacts(
    velocities: Any,
    i: Any,
    j: Any,
    normals: Any,
    gaps: Any,
    mu: Any,
    *,
    h: float,
    radii: Any,
    masses: Any,
    inertias: Any = None,
    spins: Any = None,
    positions: Any = None,
    wall_velocities: Any = None,
    bias: Any = None,
    start: Any = None,
    solver: str = "nlgs",
    **options: Union[int, float],
) -> Answer:
    """Solves the contact problem of a step that your own detection has found, without a matrix.

    velocities       (n, dim) that the n grains would have without contacts, at the end of the step [m/s]
    spins            (n) in 2D, (n, 3) in 3D, the same [rad/s]; 0 unless given
    radii, masses    (n) or one number [m, kg]; inertias those of solid disks or spheres unless given [kg m^2]
    positions        (n, dim) centres, for the estimate of the distance from an answer [m]
    i, j             (m) grains of each contact; j < 0 is wall -1 - j
    normals          (m, dim) unit, from j to i
    gaps             (m) [m]; what is left of a gap may close in the step
    mu               (m) or one number
    h                time step [s]
    wall_velocities  (walls, dim) [m/s]; walls rest unless given
    bias             (m) in the place of the gaps: v_n >= -bias [m/s], such as e v_n of before for restitution e
    start            (m, dim) impulses to begin with, in world axes [N s], such as those of the step before
    solver           "nlgs", "newton", "spg", "apgd"
    options          tolerance, max_iterations, window and the others of nscdd.Simulation

    Impulses of the answer are on i, in world axes; velocities and spins are those at the end of the step.
    """
    v = points("solve_contacts: velocities", velocities, finite=False)
    n, dim = v.shape
    h = number("solve_contacts: h", h, positive=True)
    i = whole("solve_contacts: i", i, (None,))
    m = i.size
    j = whole("solve_contacts: j", j, (m,))

    def shaped(name: str, values: Any, shape: tuple, positive: bool = False) -> np.ndarray:
        rows = np.full(shape, values) if single(values) and len(shape) == 1 else values
        return array(f"solve_contacts: {name}", rows, shape, positive=positive)

    if m and not (0 <= i.min() and i.max() < n and j.max() < n):
        raise ValueError(f"solve_contacts: i and j must be below {n}, and i not negative")
    radius, mass = shaped("radii", radii, (n,), positive=True), shaped("masses", masses, (n,), positive=True)
    inertia = shaped("inertias", inertias, (n,), positive=True) if inertias is not None else mass * radius**2 * (0.5 if dim == 2 else 0.4)
    gap = shaped("gaps", gaps, (m,))
    if wall_velocities is None:
        j = np.maximum(j, -1)  # all rest, one stands for them
    walls = np.zeros((int(max(0, -j.min(initial=0))), dim))
    if wall_velocities is not None:
        least, walls = len(walls), shaped("wall_velocities", wall_velocities, (None, dim))
        walls = shaped("wall_velocities", walls, (max(least, len(walls)), dim))
    spin = (n,) if dim == 2 else (n, 3)
    between = j >= 0
    lever_i = np.where(between, radius[i] + 0.5 * gap, radius[i])
    lever_j = np.where(between, radius[np.maximum(j, 0)] + 0.5 * gap, 0.0) if n else gap
    grains = {
        "velocity": v,
        "spin": shaped("spins", spins, spin) if spins is not None else np.zeros(spin),
        "inv_mass": 1 / mass,
        "inv_inertia": 1 / inertia,
        "centre": shaped("positions", positions, (n, dim)) if positions is not None else None,
        "radius": radius,
        "wall_velocity": walls,
    }
    normal, friction = shaped("normals", normals, (m, dim)), shaped("mu", mu, (m,))
    normal = unit("solve_contacts: normals", normal)
    require("solve_contacts: mu", friction >= 0, ">= 0", friction)
    contacts = {
        "i": i,
        "j": j,
        "normal": normal,
        "bias": shaped("bias", bias, (m,)) if bias is not None else np.maximum(gap, 0) / h,
        "friction": friction,
        "lever_i": lever_i,
        "lever_j": lever_j,
        "impulse": shaped("start", start, (m, dim)) if start is not None else None,
    }
    return Answer(**_core.solve_grains(dim, grains, contacts, h, solver, options))


def _vector(name: str, values: Any) -> np.ndarray:
    return array(f"solve: {name}", values, None).ravel()


def _dimension(free: np.ndarray, mu: Any, mu_r: Any):
    """Of space, and the coefficients as arrays; those of rolling are empty where there are none."""
    if single(mu):
        raise ValueError("solve: mu needs a number for each contact, which says how many there are")
    friction, rolling = _vector("mu", mu), _vector("mu_r", [] if mu_r is None else mu_r)
    if mu_r is not None and rolling.shape != friction.shape:
        raise ValueError(f"solve: mu_r has {rolling.size} numbers for {friction.size} contacts")
    if friction.size == 0 and free.size == 0:
        return 3, friction, rolling
    sizes = {2: 2, 3: 3} if mu_r is None else {3: 2, 5: 3}
    size, rest = divmod(free.size, max(friction.size, 1))
    if rest or size not in sizes:
        needed = " or ".join(map(str, sizes))
        raise ValueError(f"solve: {free.size} components for {friction.size} contacts, each needs {needed}")
    return sizes[size], friction, rolling


def _csc(name: str, matrix: Any, shape: tuple) -> dict:
    import scipy.sparse

    if type(matrix).__module__.startswith("siconos"):  # a NumericsMatrix, of any storage
        from siconos import numerics

        matrix = numerics.NM_csc(matrix)
    if scipy.sparse.issparse(matrix):
        _check_indices(name, matrix)
    else:
        matrix = array(f"solve: {name}", matrix, shape)
    csc = scipy.sparse.csc_matrix(matrix)  # which shares the arrays of one by columns
    if not csc.has_canonical_format:
        csc = csc.copy()
        csc.sum_duplicates()
    csc.data = array(f"solve: entries of {name}", csc.data, (None,))
    if csc.shape != shape:
        raise ValueError(f"solve: {name} must have shape {shape}, found {csc.shape}")
    return {"data": csc.data, "indices": csc.indices.astype(np.int32), "indptr": csc.indptr.astype(np.int32)}


def _check_indices(name: str, matrix: Any) -> None:
    """SciPy takes them on trust, and writes where they lead."""
    try:
        if matrix.format == "coo":
            type(matrix)((matrix.data, (matrix.row, matrix.col)), shape=matrix.shape)
        elif hasattr(matrix, "indptr"):
            if (np.diff(matrix.indptr) < 0).any():
                raise ValueError("index pointer must not fall")
            matrix.check_format(full_check=True)
    except ValueError as error:
        raise ValueError(f"solve: {name}: {error}") from None
