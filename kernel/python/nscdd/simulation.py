"""A simulation whose steps the caller makes."""
from __future__ import annotations

import atexit
import contextlib
import difflib
import inspect
import itertools
import math
import os
import shlex
import warnings
import weakref
from collections.abc import Iterable
from collections.abc import Sequence as AbstractSequence
from typing import Any, Callable, Iterator, Mapping, Optional, Sequence, Union

import numpy as np

from . import _core
from ._checks import Path, array, found, instance, integer, number, single
from ._checks import path as name_of
from ._checks import points, whole
from .files import aside, structured
from .scene import Cell, Obstacle, Pairs, Vector, Wall, checked_pairs, material_tables, pair_tables

Callback = Callable[["Simulation", _core.StepReport], Any]
PARTS = ("partition", "grid", "imbalance", "interface", "multiplicity")  # options of how subdomains are made and joined


class _Kept:
    """What is of a simulation, and of no other process and no copy."""

    __slots__ = ()

    def __reduce__(self):
        raise TypeError(f"a {type(self).__name__} cannot be pickled or copied: save() the simulation, and go on by Simulation(state=...)")


class LiveWall(_Kept):
    """A wall of a simulation as it is now. Velocity, force and pressure may be set between two steps."""

    __slots__ = ("_live", "_number", "_unsaved", "__weakref__")

    def __init__(self, live: _core.Live, number: int, unsaved: dict):
        self._live, self._number, self._unsaved = live, number, unsaved

    @property
    def name(self) -> str:
        """Its name."""
        return self._live.wall(self._number)["name"]

    @property
    def normal(self) -> np.ndarray:
        """(dim) unit vector into the sample."""
        return self._live.wall(self._number)["normal"]

    @property
    def offset(self) -> float:
        """normal . (any point of the plane), now [m]."""
        return self._live.wall(self._number)["offset"]

    @property
    def mass(self) -> float:
        """Of a wall that is pushed [kg], else 0."""
        return self._live.wall(self._number)["mass"]

    @property
    def velocity(self) -> np.ndarray:
        """(dim) velocity now [m/s]. Set it to prescribe another; of a wall that is pushed, one within its plane."""
        return self._live.wall(self._number)["velocity"]

    @velocity.setter
    def velocity(self, value: Vector) -> None:
        self._set("velocity", self._live.set_wall_velocity, array(f"wall '{self.name}': velocity", value, (None,), finite=False))

    @property
    def force(self) -> float:
        """Along the normal, positive into the sample [N]; 0 of a wall that is not pushed."""
        return self._live.wall(self._number)["force"]

    @force.setter
    def force(self, value: float) -> None:
        self._set("force", self._live.set_wall_force, number(f"wall '{self.name}': force", value, finite=False))

    @property
    def pressure(self) -> float:
        """Of a wall that was made with one [Pa], else 0."""
        return self._live.wall_pressure(self._number)

    @pressure.setter
    def pressure(self, value: float) -> None:
        self._set("pressure", self._live.set_wall_pressure, number(f"wall '{self.name}': pressure", value, finite=False))

    def _set(self, what: str, setter: Callable, value: Any) -> None:
        setter(self._number, value)
        self._unsaved[f"the {what} that wall '{self.name}' was given"] = True

    def __repr__(self) -> str:
        return f"LiveWall({self.name!r}, offset={self.offset:.6g})"


class Walls(_Kept, AbstractSequence):
    """The walls of a simulation, by number or by name."""

    __slots__ = ("_walls", "__weakref__")

    def __init__(self, live: _core.Live, unsaved: dict):
        self._walls = [LiveWall(live, row, unsaved) for row in range(live.wall_count())]

    def __len__(self) -> int:
        return len(self._walls)

    def __getitem__(self, key):
        if not isinstance(key, str):
            return self._walls[key]
        for wall in self._walls:
            if wall.name == key:
                return wall
        raise KeyError(f"no wall '{key}' among {', '.join(wall.name for wall in self._walls) or 'none'}")


class Simulation(_Kept):
    """Grains, walls and materials, and the steps of their motion by the scheme of Moreau and Jean.

    positions          (n, 2) centres of disks or (n, 3) of spheres [m]
    radii              (n), or one number [m]
    velocities, spins  (n, dim) [m/s]; (n) in 2D, (n, 3) in 3D [rad/s]; at rest unless given
    density            of all grains [kg/m^3], of disks [kg/m^2]; or materials, {name: density}
    masses             (n) in the place of those by density [kg], infinite of a fixed grain; inertias follow. States do not have
                       them: give them again
    material           (n) of each grain, by name or number in materials; the first unless given
    friction, restitution, cohesion [N], range [m], rolling [m], twisting [m]
                       of all contacts; of a pair of materials, what pairs say: {(name, name): {"friction": 0.5}}
    law                "frictionless", "coulomb", "cohesive" or "rolling", as in scene files; by the coefficients unless given
    walls, obstacles   nscdd.Wall each, nscdd.Obstacle each
    cell               nscdd.Cell
    box                (dim) faces of walls with `side` are at 0 and there [m]
    gravity            (dim) [m/s^2]
    h, theta           time step [s], or "auto", which chooses it as in a scene file (the attribute h has it); share of it
                       after the detection of contacts
    state              file of save() to go on from, in the place of all that says where grains are; materials go by their names,
                       or by their order where a name is not among those given
    scheme             "nlgs", "newton", "spg", "apgd" on one subdomain, "dcs" or "ccs" on any number; "nlgs" on one and "dcs"
                       on more unless given
    subdomains, threads
                       into which space is divided, and of a process, which they are dealt to. Numbers do not depend on threads
    comm               a communicator of mpi4py, or None. All its processes then make the same calls with the same arguments;
                       grains and contacts come to its first process, and are empty on the others. One subdomain a thread of
                       each process unless subdomains says more
    partition, grid, imbalance, interface, multiplicity
                       as the options of `nscdd run` have it
    stop               {"time": 2.0} and other keys of [stop] in a scene file, which end run()
    tables             further tables of a scene file but [packing], such as {"grain": [{...}]}
    method, tolerance, max_iterations, check_every, window, sweeps, relaxation, max_velocity_error, max_energy_gain,
    max_penetration, max_gap_error, max_distance, max_newton_contacts
                       of the solver, the keys of [solver] in a scene file

    Arrays that are handed out are of the moment, by ascending id, and read-only: a step makes new ones, and those that you
    keep stay what they were. view() shows grains and contacts where the kernel has them, without a copy.

    One thread at a time may use a simulation; two simulations may be used by two threads. step() releases the GIL.
    """

    __slots__ = ("_live", "_walls", "_comm", "_given", "_begun", "_unsaved", "__weakref__")

    def __init__(
        self,
        positions: Optional[np.ndarray] = None,
        radii: Union[None, float, np.ndarray] = None,
        *,
        velocities: Optional[np.ndarray] = None,
        spins: Optional[np.ndarray] = None,
        density: Optional[float] = None,
        materials: Optional[Mapping[str, float]] = None,
        masses: Optional[np.ndarray] = None,
        material: Union[None, Sequence[str], np.ndarray] = None,
        friction: float = 0.0,
        restitution: float = 0.0,
        cohesion: Optional[float] = None,
        range: Optional[float] = None,
        rolling: Optional[float] = None,
        twisting: Optional[float] = None,
        pairs: Optional[Pairs] = None,
        walls: Sequence[Wall] = (),
        obstacles: Sequence[Obstacle] = (),
        cell: Optional[Cell] = None,
        box: Optional[Vector] = None,
        gravity: Optional[Vector] = None,
        h: Union[float, str],
        theta: float = 0.5,
        broad_phase_every: int = 10,
        law: Optional[str] = None,
        name: str = "nscdd",
        state: Optional[Path] = None,
        stop: Optional[Mapping[str, float]] = None,
        tables: Optional[Mapping[str, Any]] = None,
        scheme: Optional[str] = None,
        subdomains: Optional[int] = None,
        threads: int = 1,
        comm: Any = None,
        partition: Optional[str] = None,
        grid: Optional[Sequence[int]] = None,
        imbalance: Optional[float] = None,
        interface: Optional[str] = None,
        multiplicity: Optional[str] = None,
        **solver: Any,
    ):
        _refuse_slips(Simulation, solver)
        if state is not None:
            if any(given is not None for given in (positions, radii, velocities, spins, material, box)):
                raise ValueError("Simulation: positions, radii, velocities, spins, material and box come from the state")
            before = _core.read_state(name_of(state))
            dimension = before["dimension"]
            x, r, more = np.empty((0, dimension)), np.empty(0), {"spins": before["spins"]}
        else:
            x, r, more = _grains(positions, radii, velocities, spins)
            before, dimension = {"walls": {}}, x.shape[1]
        substances, pairs = material_tables(density, materials), checked_pairs(pairs)
        if cell is not None:
            instance("Simulation: cell", cell, Cell, "an nscdd.Cell")
        names = [table["name"] for table in substances]
        turns = more.get("spins") is not None and bool(np.any(more["spins"]))
        others = {
            "friction": None if single(friction) and friction == 0 else friction,
            "cohesion": cohesion,
            "range": range,
            "rolling": rolling,
            "twisting": twisting,
        }
        scene = {
            "name": name,
            "dimension": dimension,
            "gravity": gravity,
            "law": law if law is not None else _law(others, pairs, turns or _flows(cell)),
            "material": substances,
            "pair": pair_tables(names, {**others, "restitution": restitution}, pairs),
            "wall": [wall.table(k, names[0]) for k, wall in enumerate(_all("walls", Wall, walls))],
            "obstacle": [obstacle.table(k, names[0]) for k, obstacle in enumerate(_all("obstacles", Obstacle, obstacles))],
            "cell": cell.table(dimension) if cell is not None else None,
            "stop": None if stop is None else dict(instance("Simulation: stop", stop, Mapping, "a dictionary")),
            "step": {"h": h, "theta": theta, "broad_phase_every": broad_phase_every},
            **instance("Simulation: tables", {} if tables is None else tables, Mapping, "a dictionary"),
        }
        if "packing" in scene:
            raise ValueError("Simulation: tables: [packing] is of scene files, which read() reads; here grains are arrays")
        if state is not None:
            more = {}
        if material is not None:
            more["material"] = _material_rows(material, names, len(r))
        if box is not None:
            more["box"] = array("Simulation: box", box, (dimension,), positive=True)
        if masses is not None:
            more["masses"] = array("Simulation: masses", masses, (None if state is not None else len(r),), finite=False)
        options = _options(locals())
        self._set(_core.from_arrays(scene, "Simulation", x, r, more, options, _over_mpi(comm, options)), comm, options)
        self._unsaved["masses"] = masses is not None
        for wall, (name, was) in zip(self._walls, before["walls"].items()):
            if np.abs(wall.normal - was["normal"]).max() > 1e-9:
                raise ValueError(f"Simulation: wall '{wall.name}' has another normal than '{name}' of the state")

    def _set(self, live: _core.Live, comm: Any, options: Mapping[str, Any]) -> None:
        self._unsaved: dict = {}  # whether there is what states do not have
        self._live, self._walls, self._comm, self._given = live, Walls(live, self._unsaved), comm, options
        self._begun = live.steps()
        if comm is not None:
            _over_processes.add(live)

    # ---- steps

    def step(self) -> _core.StepReport:
        """Makes one step of h and returns its report.

        Raises StepRefused, a RuntimeError, where grains overlap too much or would pass through each other; `i`, `j` (walls
        -1 - j) and a step `h` that would do are attributes of it. Such a simulation makes no further step.
        """
        return self._live.step()

    def run(self, n: Optional[int] = None, callback: Optional[Callback] = None) -> Optional[_core.StepReport]:
        """Makes n steps, and returns the last report. Without n it makes as many as the scene file says, or goes on to what
        `stop` says.

        callback(simulation, report) is called after each step; it may return True to end the run. Its exceptions end the
        run too, between two steps, and so does Ctrl-C: all can go on from there. [stop] of a scene ends it as in the program.
        """
        report = None
        if n is None and (n := self._live.count() or None) is None and not self._live.may_stop():
            raise ValueError("run: give a number of steps: the scene has neither a count nor a stop")
        for _ in itertools.count() if n is None else range(integer("run: n", n, 0, math.inf)):
            report = self._live.step()
            if (callback is not None and callback(self, report)) or self._live.stopped_by():
                break
        return report

    @property
    def stopped_by(self) -> Optional[str]:
        """Key of [stop] that the last step has met, such as "strain"; None where it has met none."""
        return self._live.stopped_by() or None

    @property
    def time(self) -> float:
        """Since the start of the scene [s]."""
        return self._live.time()

    @property
    def steps(self) -> int:
        """Steps made since the start of the scene."""
        return self._live.steps()

    @property
    def h(self) -> float:
        """Time step [s]."""
        return self._live.h()

    # ---- grains

    @property
    def dimension(self) -> int:
        """2 of disks, 3 of spheres."""
        return self._live.dimension()

    def __len__(self) -> int:
        return self._live.grain_count()

    @property
    def ids(self) -> np.ndarray:
        """(n) ascending: those of the rows of all other arrays. They are 0 to n-1 unless grains come and go."""
        return self._live.rows()["ids"]

    @property
    def positions(self) -> np.ndarray:
        """(n, dim) centres [m]."""
        return self._live.rows()["positions"]

    @property
    def velocities(self) -> np.ndarray:
        """(n, dim) [m/s]. Set it to give the grains others, between two steps; fixed ones keep theirs, 0."""
        return self._live.rows()["velocities"]

    @velocities.setter
    def velocities(self, values: np.ndarray) -> None:
        self._live.set_velocities(self._motion("velocities", values, self._everywhere(self.spins)))

    @property
    def spins(self) -> np.ndarray:
        """(n) in 2D, (n, 3) in 3D [rad/s]; 0 without friction. Set it to give the grains others, between two steps."""
        return self._live.rows()["spins"]

    @spins.setter
    def spins(self, values: np.ndarray) -> None:
        self._live.set_velocities(self._motion("spins", self._everywhere(self.velocities), values))

    @property
    def forces(self) -> np.ndarray:
        """(n, dim) external force on each grain besides gravity [N]. Set it between two steps; it stays until it is set anew.

        So another code, of a fluid say, can act on the grains.
        """
        return self._live.loads()[:, : self.dimension]

    @forces.setter
    def forces(self, values: np.ndarray) -> None:
        self._live.set_loads(self._motion("forces", values, self._everywhere(self.torques)))
        self._unsaved["forces"] = np.any(values) or self._live.has_own_loads()

    @property
    def torques(self) -> np.ndarray:
        """(n) in 2D, (n, 3) in 3D external torque [N m], as forces; 0 without friction."""
        loads = self._live.loads()
        if loads.shape[1] == self.dimension:
            return np.broadcast_to(0.0, len(loads) if self.dimension == 2 else (len(loads), 3))  # read-only, as all arrays
        return loads[:, 2] if self.dimension == 2 else loads[:, 3:]

    @torques.setter
    def torques(self, values: np.ndarray) -> None:
        self._live.set_loads(self._motion("torques", self._everywhere(self.forces), values))
        self._unsaved["torques"] = np.any(values) or self._live.has_own_loads()

    def _everywhere(self, rows: np.ndarray) -> np.ndarray:
        """What the first process has."""
        return rows if self._comm is None else self._comm.bcast(rows)

    def _motion(self, name: str, linear: Any, angular: Any) -> np.ndarray:
        """Both in one array of rows, as the kernel has them."""
        n, dimension = len(self), self.dimension
        linear = array(f"Simulation: {name}", linear, (n, dimension), finite=False)
        angular = array(f"Simulation: {name}", angular, (n,) if dimension == 2 else (n, 3), finite=False)
        if self._live.law() != "frictionless":
            return np.column_stack([linear, angular])
        if np.any(angular):
            raise ValueError(f"Simulation: {name} need friction, grains do not turn without")
        return linear

    @property
    def radii(self) -> np.ndarray:
        """(n) [m]."""
        return self._live.rows()["radii"]

    @property
    def masses(self) -> np.ndarray:
        """(n) [kg]."""
        return self._live.rows()["masses"]

    @property
    def materials(self) -> np.ndarray:
        """(n) number of each grain's material, in the order in which materials were given."""
        return self._live.rows()["materials"]

    @property
    def subdomains(self) -> np.ndarray:
        """(n) subdomain that speaks for each grain."""
        return self._live.rows()["subdomains"]

    @property
    def multiplicities(self) -> np.ndarray:
        """(n) number of subdomains in which the grain had contacts in the last step."""
        return self._live.rows()["multiplicities"]

    def view(self, of: str = "grains") -> np.ndarray:
        """What the kernel has, where it has it, without a copy: a structured array of one subdomain.

        "grains"         id, material, radius, mass, inertia, position, velocity and, with friction, spin
        "contacts"       of the last step, between grains: i, j, normal, impulse, couple as in `contacts`, but i and j are rows
                         of view(). Without friction, normal_impulse stands for impulse
        "wall_contacts"  the same, where j is the number of a wall; from the number of walls on, j is some facet of an
                         obstacle, numbered anew in each step: `contacts` says which

        Rows are in the kernel's order, which a step may change. The array is read-only and safe. Where you still have it
        when the next step begins, it keeps its memory and its values, and the simulation goes on in a copy of it.
        """
        ways = {"grains": self._live.grains_in_place, "contacts": self._live.contacts_in_place, "wall_contacts": self._live.wall_contacts_in_place}
        if not isinstance(of, str) or of not in ways:
            raise ValueError(f"view: one of {', '.join(ways)}, not {of!r}")
        return ways[of]()

    # ---- contacts and sums

    @property
    def contacts(self) -> np.ndarray:
        """Contacts of the last step, a structured array by ascending i, then j.

        i, j            ids; j < 0 is wall -1 - j
        normal          (dim) unit, from j to i
        gap             now [m], negative where they overlap
        impulse         (dim) on i, in world axes [N s]; over h it is the mean force of the step
        normal_impulse  along the normal [N s]
        couple          (3), or (1) in 2D, on i [N m s]; with the law "rolling"
        subdomain       that has the contact
        """
        return structured(self._live.contacts())

    def measures(self) -> dict:
        """Sums over the scene after the last step.

        kinetic_energy [J], momentum (dim), angular_momentum, box (dim) [m], stress (dim, dim) of the contacts over the volume
        of the box, positive in compression [Pa] (NaN without a box), solid_fraction, wall_force (walls, dim) by the grains
        [N], fabric (dim, dim), contacts_carrying, coordination, rattlers (a share), largest_overlap [m].
        """
        return self._live.measures()

    # ---- walls and cell

    @property
    def walls(self) -> Walls:
        """Walls by number or name; their velocity, force and pressure may be set between two steps."""
        return self._walls

    @property
    def cell(self) -> dict:
        """The cell now: axes `periodic`, `size` (dim) [m], `tilt` (dim, dim) [m], `gradient` (dim, dim) [1/s]."""
        return self._live.cell()

    # ---- files

    def save(self, path: Path) -> None:
        """Writes the state, as `nscdd run --state` does: HDF5, and an .xdmf beside it for ParaView.

        `Simulation(state=path, ...)`, `nscdd.read(scene, state=path)` and `nscdd run --from` go on from it to the last bit.
        A state has neither `masses` that were given, nor `forces` and `torques`, nor what walls were given between steps, nor
        contacts before the first step after a state was read: a warning says so where there is any of it.
        """
        self._live.save(name_of(path))
        if "state" in self._given and self._live.steps() == self._begun:
            warnings.warn("save: no step was made since the state was read, so its contacts are not in the new one: copy the file", stacklevel=2)
        if lost := [name for name, there in self._unsaved.items() if there]:
            warnings.warn(f"save: a state does not have {', '.join(lost)}: give them again to who goes on from {name_of(path)}", stacklevel=2)

    def write_scene(self, path: Path) -> None:
        """Writes the scene as a file of the program, without its grains, which save() writes.

            sim.save("pile.h5"), sim.write_scene("pile.toml")

        `nscdd run pile.toml --from pile.h5 --adopt --steps 100`, with the scheme and the subdomains of this simulation, goes on
        with the same bits as sim.run(100); the first line of the file is that command. Walls have the velocity, force or pressure
        of now. Files of obstacles and motions are named from the folder of the scene. A scene that read() has read is in its
        file already. What save() warns of is not there either, but for walls.
        """
        name, failure = name_of(path), None
        text = self._live.scene_text(os.path.dirname(name) or ".")
        if self._comm is None or self._comm.rank == 0:
            try:
                with aside(name) as part, open(part, "w") as file:
                    command = shlex.join(["nscdd", "run", os.path.basename(name), "--from", "STATE", "--adopt", *self._as_options()])
                    file.write("# goes on by: " + command.replace("\n", "\\n") + f"\n{text}")
            except OSError as error:
                failure = error
        if failure := self._everywhere(failure):
            raise failure

    def _as_options(self) -> list:
        """Those of `nscdd run` that are not of the scene."""
        given = {"scheme": self._live.scheme(), "subdomains": self._live.subdomains()}
        given.update((name, self._given[name]) for name in PARTS if name in self._given)
        texts = {name: "x".join(map(str, value)) if name == "grid" else str(value) for name, value in given.items()}
        return [word for name, text in texts.items() for word in (f"--{name}", text)]

    @contextlib.contextmanager
    def record(self, *series: Path, frames: Optional[Path] = None, every: int = 1) -> Iterator["Simulation"]:
        """Writes a row of each step within `with` into time series (.h5 or .csv), and every so many steps a frame.

            with sim.record("series.csv", frames="frames.h5", every=10):
                sim.run(1000)

        Files take their places at the end of the block, also where an exception ends it. reports/series.md has the columns.
        """
        rows, pictures = [name_of(path) for path in series], [] if frames is None else [name_of(frames)]
        names = [os.path.realpath(name) for name in rows + pictures]
        if twice := [name for k, name in enumerate(names) if name in names[:k]]:
            raise ValueError(f"record: {twice[0]} is given twice")
        self._live.record(rows, pictures, integer("record: every", every, 1))
        try:
            yield self
        finally:
            self._live.stop()

    # ----

    def __repr__(self) -> str:
        return f"<nscdd.Simulation '{self._live.name()}': {len(self)} grains in {self.dimension}D, {self._live.scheme()}, step {self.steps}>"


def read(
    scene: Path,
    *,
    packing: Optional[Path] = None,
    state: Optional[Path] = None,
    adopt: bool = False,
    scheme: Optional[str] = None,
    subdomains: Optional[int] = None,
    threads: int = 1,
    comm: Any = None,
    partition: Optional[str] = None,
    grid: Optional[Sequence[int]] = None,
    imbalance: Optional[float] = None,
    interface: Optional[str] = None,
    multiplicity: Optional[str] = None,
    **solver: Any,
) -> Simulation:
    """Makes the Simulation of a scene file (TOML) of the program; numbers are those of `nscdd run`, to the last bit.

    packing  file of grains, in the place of the scene's own
    state    file to go on from; with adopt=True one of another scene
    The other options are those of Simulation, and take the place of what the scene says.
    """
    _refuse_slips(read, solver)
    if adopt and state is None:
        raise ValueError("read: adopt is of a state to go on from: give state")
    options = _options(locals())
    simulation = Simulation.__new__(Simulation)
    simulation._set(_core.from_file(name_of(scene), options, _over_mpi(comm, options)), comm, options)
    return simulation


_over_processes: weakref.WeakSet = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    """Before mpi4py ends MPI, which communicators must not outlive."""
    for live in list(_over_processes):
        live.close()


def _over_mpi(comm: Any, options: dict) -> Any:
    """What the extension is to know of a communicator of mpi4py; sets the number of subdomains."""
    if comm is None:
        return None
    try:
        from . import _mpi
    except ImportError as missing:
        raise ValueError(f"comm: this build of nscdd has no MPI ({missing})") from None
    if not hasattr(comm, "Is_inter") or not comm or comm.Is_inter():  # COMM_NULL is false
        raise ValueError(f"comm: must be a communicator of mpi4py, of one group and not COMM_NULL, found {found(comm)}")
    threads = options.get("threads", 1)
    options.setdefault("subdomains", comm.Get_size() * threads)
    if options["subdomains"] < comm.Get_size() * threads:
        each = "" if threads == 1 else f" of {threads} threads"
        raise ValueError(f"subdomains: {options['subdomains']} for {comm.Get_size()} processes{each}, which need one each")
    return _mpi.make(comm.py2f(), options["subdomains"], threads)


def _options(given: Mapping[str, Any]) -> dict:
    """What the extension is to know of how steps are solved."""
    names = ("scheme", "subdomains", "threads", *PARTS, "solver", "adopt")
    options = {name: given[name] for name in names if given.get(name) is not None}
    for name in ("subdomains", "threads"):
        integer(name, options.get(name, 1), 1)
    options.update({name: name_of(given[name]) for name in ("packing", "state") if given.get(name) is not None})
    return options


def _refuse_slips(of: Callable, solver: Mapping[str, Any]) -> None:
    """Of the keywords that are left for the solver, those that are nearly another of the arguments."""
    for name in solver:
        if near := difflib.get_close_matches(name, inspect.signature(of).parameters, n=1, cutoff=0.7):
            raise ValueError(f"{of.__name__}: unknown keyword '{name}' (did you mean '{near[0]}'?)")


def _grains(positions, radii, velocities, spins):
    if positions is None or radii is None:
        raise ValueError("Simulation: give positions and radii, or a state")
    x = points("Simulation: positions", positions, finite=False)  # which the kernel sees to
    n, dimension = x.shape
    shapes = {"radii": (n,), "velocities": (n, dimension), "spins": (n,) if dimension == 2 else (n, 3)}
    given = {"radii": np.full(n, radii) if single(radii) else radii, "velocities": velocities, "spins": spins}
    more = {name: array(f"Simulation: {name}", rows, shapes[name], finite=False) for name, rows in given.items() if rows is not None}
    return x, more.pop("radii"), more


def _all(name: str, kind: type, values: Any) -> list:
    """A list of what are all of this class."""
    told = f"nscdd.{kind.__name__}"
    if isinstance(values, (kind, str)) or not isinstance(values, Iterable):
        raise ValueError(f"Simulation: {name} must be a list of {told}, found a {type(values).__name__}")
    return [instance(f"Simulation: {name}: each", value, kind, f"an {told}") for value in values]


def _law(others: Mapping[str, Optional[float]], pairs: Pairs, turns: bool) -> str:
    """The simplest law that has these coefficients."""
    keys = {key for key, value in others.items() if value is not None}.union(*pairs.values())
    for law, marks in {"cohesive": {"cohesion", "range"}, "rolling": {"rolling", "twisting"}, "coulomb": {"friction"}}.items():
        if keys & marks or (turns and law == "coulomb"):
            return law
    return "frictionless"


def _flows(cell: Optional[Cell]) -> bool:
    return cell is not None and (cell.gradient is not None or cell.stress is not None)


def _material_rows(material: Any, names: Sequence[str], n: int) -> np.ndarray:
    given = np.asarray(material)
    if given.shape != (n,):
        raise ValueError(f"Simulation: material must have shape ({n},), found {given.shape}")
    if given.dtype.kind in "iuf":
        return whole("Simulation: material", given, (n,))
    rows = {name: row for row, name in enumerate(names)}
    for k, name in enumerate(given):
        if name not in rows:
            raise ValueError(f"Simulation: grain {k}: '{name}' is not among the materials {', '.join(names)}")
    return np.array([rows[name] for name in given], dtype=np.int32)
