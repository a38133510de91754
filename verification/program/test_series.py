"""Time series and frames: equal to what NumPy computes from the state, on any number of subdomains, and readable where they are read."""
import csv
import fcntl
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import time
import unittest
import xml.etree.ElementTree

import h5py
import numpy as np

from harness import NSCDD, PACKED, SCENE, ProgramTest

REDUCED = pathlib.Path(__file__).resolve().parents[2] / "cases/reduced"
READ_VTK = pathlib.Path(__file__).resolve().with_name("read_vtk.py")
SIDES = 'motion = "pressure"\npressure = 1.0'


def read_h5(path):
    with h5py.File(path) as file:
        attributes = {name: {key: text.decode() for key, text in item.attrs.items()} for name, item in file.items()}
        return {name: item[...] for name, item in file.items()}, attributes, dict(file.attrs)


def read_csv(path):
    with open(path, newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, float)


def observables(path, h):
    """Of the state of a last step, by their definitions alone."""
    with h5py.File(path) as file:
        x, radius, velocity, spin = (file[name][...] for name in ("x", "radius", "velocity", "spin"))
        density = file["materials/density"][...][file["material"][...]]
        i, j, normal, impulse, pushes = (file[f"contacts/{name}"][...] for name in ("i", "j", "normal", "impulse", "normal_impulse"))
        offset, wall_normal, box = (file[name][...] for name in ("walls/offset", "walls/normal", "box"))
    dim, n = x.shape[1], len(x)
    size = np.pi * radius**2 if dim == 2 else 4 / 3 * np.pi * radius**3
    mass, wall, carries = density * size, j < 0, pushes > 0
    inertia = (0.5 if dim == 2 else 0.4) * mass * radius**2
    w = np.where(wall, -1 - j, 0)
    distance = np.einsum("cd,cd->c", wall_normal[w], x[i]) - offset[w]
    branch = np.where(wall[:, None], distance[:, None] * wall_normal[w], x[i] - x[np.where(wall, 0, j)])
    force, volume = impulse / h, box.prod()
    stress = np.einsum("ci,cj->ij", force[carries], branch[carries]) / volume
    touched = np.union1d(i[carries], j[carries & ~wall])
    of_walls = np.array([(force[j == -1 - k] @ wall_normal[k]).sum() for k in range(len(offset))])
    by_walls = [of_walls[np.abs(wall_normal[:, d]) == 1].mean() / (volume / box[d]) for d in range(dim)]
    return {
        "box": box,
        "stress_contacts": stress,
        "stress_walls": by_walls,
        "wall_normal_force": of_walls,
        "wall_force": np.array([-force[j == -1 - k].sum(0) for k in range(len(offset))]),
        "solid_fraction": size.sum() / volume,
        "coordination": (2 * carries.sum() - (carries & wall).sum()) / len(touched),
        "rattlers": 1 - len(touched) / n,
        "fabric": np.einsum("ci,cj->ij", normal[carries], normal[carries]) / carries.sum(),
        "kinetic_energy": 0.5 * (mass @ (velocity**2).sum(1) + inertia @ (spin**2).sum(1)),
        "contacts": len(i),
        "contacts_carrying": carries.sum(),
    }, {"pressure": np.trace(stress) / dim, "diameter": 2 * radius.mean(), "density": mass.sum() / size.sum()}


class SeriesTest(ProgramTest):
    def pack(self, name, dimension, grains):
        path = self.folder / f"{name}.h5"
        if not path.exists():
            text = f"dimension = {dimension}\ngrains = {grains}\nspread = 0.25\nseed = 4\n"
            self.succeeds("pack", self.write(f"{name}-packing.toml", text), "-o", path, "--quiet")
        return path

    def biaxial(self):
        return ("run", REDUCED / "biaxial.toml", "--packing", self.pack("disks", 2, 60), "--quiet")

    def triaxial(self):
        return ("run", REDUCED / "triaxial.toml", "--packing", self.pack("spheres", 3, 60), "--quiet")

    def series(self, *command, ranks=0, name="series"):
        path, state = self.folder / f"{name}.h5", self.folder / f"{name}-state.h5"
        done = self.run_program(*command, "--series", path, "--series", path.with_suffix(".csv"), "--state", state, ranks=ranks)
        self.assertIn(done.returncode, (0, 3), done.stderr)
        return read_h5(path)


class Series(SeriesTest):
    def test_the_last_row_is_that_of_the_state(self):
        for command, more in (
            (self.biaxial(), ("--scheme", "nlgs")),
            (self.biaxial(), ("--scheme", "dcs", "-n", 8)),
            (self.triaxial(), ("--scheme", "dcs", "-n", 8)),
        ):
            with self.subTest(command=command, more=more):
                columns, attributes, head = self.series(*command, *more, "--steps", 30)
                expected, others = observables(self.folder / "series-state.h5", head["h"])
                for name, value in expected.items():
                    np.testing.assert_allclose(columns[name][-1], value, rtol=1e-9, atol=1e-12, err_msg=name)
                rate = np.abs(np.diff(columns["strain"], axis=0)[-1]).max() / head["h"]
                inertial = rate * others["diameter"] * np.sqrt(others["density"] / others["pressure"])
                np.testing.assert_allclose(columns["inertial_number"][-1], inertial, rtol=1e-9)
                self.assertEqual(attributes["stress_contacts"]["unit"], "N/m" if head["dim"] == 2 else "Pa")
                self.assertTrue(all({"unit", "meaning", "columns"} <= keys.keys() for name, keys in attributes.items() if name != "box_at_start"))

    def test_csv_is_hdf5(self):
        columns, attributes, _ = self.series(*self.biaxial(), "--steps", 20)
        header, rows = read_csv(self.folder / "series.csv")
        self.assertEqual(rows.shape, (20, len(header)))
        columns.pop("box_at_start")
        for name, values in columns.items():
            own = [header.index(column) for column in attributes[name]["columns"].split(",")]
            np.testing.assert_array_equal(rows[:, own], values.reshape(20, -1), name)
        self.assertEqual(sum(values[0].size for values in columns.values()), len(header))
        np.testing.assert_array_equal(columns["step"], np.arange(1, 21))
        for name in ("strain_x", "stress_contacts_xy", "wall_normal_force_top", "work_walls_total", "energy_error"):
            self.assertIn(name, header)

    def test_strain_is_the_motion_of_the_walls(self):
        columns, _, head = self.series(*self.triaxial(), "--steps", 20)
        height = columns["box_at_start"][2] - 0.01 * head["h"] * np.arange(1, 21)
        np.testing.assert_allclose(columns["box"][:, 2], height, rtol=1e-12)
        np.testing.assert_allclose(columns["strain"][:, 2], np.log(columns["box_at_start"][2] / height), rtol=1e-9)
        np.testing.assert_allclose(columns["strain"], np.log(columns["box_at_start"] / columns["box"]), rtol=1e-9, atol=1e-15)

    def test_walls_and_contacts_agree_on_the_stress_at_rest(self):
        """Under a pressure of 1 on all sides, once the packing has come to rest."""
        for name, command, motion in (("biaxial", self.biaxial(), "velocity = [0, -0.02]"), ("triaxial", self.triaxial(), "velocity = [0, 0, -0.01]")):
            text = (REDUCED / f"{name}.toml").read_text()
            scene = self.write(f"{name}.toml", text.replace(f'motion = "velocity"\n{motion}', SIDES))
            self.assertNotEqual(scene.read_text(), text)
            columns, _, head = self.series("run", scene, *command[2:], "--method", "auto", "--steps", 400)
            dim = head["dim"]
            by_contacts = np.diagonal(columns["stress_contacts"], axis1=1, axis2=2)[-50:].mean(0)
            with self.subTest(name=name):
                np.testing.assert_allclose(by_contacts, columns["stress_walls"][-50:].mean(0), rtol=0.03)
                np.testing.assert_allclose(columns["stress_walls"][-50:].mean(0), np.ones(dim), rtol=0.03)

    def test_the_energy_balance_closes(self):
        text = PACKED.replace("friction = 0.3", "friction = 0.3\nrestitution = 0.5").replace("packing.h5", "spheres.h5")
        self.pack("spheres", 3, 60)
        for command in (
            (*self.biaxial(), "--steps", 60),
            (*self.triaxial(), "--scheme", "dcs", "-n", 4, "--steps", 60),
            ("run", self.write("falls.toml", text), "--steps", 200, "--quiet"),
        ):
            with self.subTest(command=command):
                columns, _, head = self.series(*command)
                self.assertLessEqual(columns["energy_error"].max(), head["energy_tolerance"])
                for name in ("work_external", "work_walls", "dissipated_impact", "dissipated_friction"):
                    np.testing.assert_allclose(columns[f"{name}_total"], np.cumsum(columns[name]), rtol=1e-9, atol=1e-15, err_msg=name)
                kinetic = columns["kinetic_energy"] + columns["kinetic_energy_walls"]  # at rest before
                balance = (
                    columns["work_external_total"] + columns["work_walls_total"] - columns["dissipated_impact_total"] - columns["dissipated_friction_total"]
                )
                np.testing.assert_allclose(kinetic, balance, rtol=1e-6, atol=1e-12)
                self.assertGreaterEqual(columns["dissipated_friction_total"][-1], 0)
                self.assertGreater(columns["dissipated_impact_total"][-1], 0)

    def test_any_subdomains_and_ranks(self):
        options = ("--scheme", "dcs", "--tolerance", 1e-9, "--max-velocity-error", 1e-5, "--method", "auto", "--steps", 10)
        one, _, _ = self.series(*self.biaxial(), *options, "-n", 1, name="one")
        eight, _, _ = self.series(*self.biaxial(), *options, "-n", 8, name="eight")
        for name in ("strain", "stress_contacts", "stress_walls", "solid_fraction", "kinetic_energy", "fabric", "work_walls_total", "time"):
            np.testing.assert_allclose(eight[name], one[name], rtol=1e-3, atol=1e-3 * np.abs(one[name]).max(), err_msg=name)
        self.series(*self.biaxial(), *options, "-n", 2, name="two")
        self.series(*self.biaxial(), *options, name="mpi", ranks=2)
        for ending in (".csv", ".h5"):
            self.assertEqual((self.folder / f"two{ending}").read_bytes(), (self.folder / f"mpi{ending}").read_bytes())

    def test_a_run_that_goes_on_begins_its_own_series(self):
        whole, _, _ = self.series(*self.biaxial(), "--steps", 20, name="whole")
        first, _, _ = self.series(*self.biaxial(), "--steps", 12, name="first")
        rest, _, _ = self.series(*self.biaxial(), "--steps", 8, "--from", self.folder / "first-state.h5", name="rest")
        for name in ("step", "time", "stress_contacts", "fabric", "kinetic_energy", "work_walls", "iterations"):
            np.testing.assert_array_equal(np.concatenate((first[name], rest[name])), whole[name], name)
        for name in ("strain", "work_walls_total", "dissipated_friction_total"):
            np.testing.assert_allclose(first[name][-1] + rest[name], whole[name][12:], rtol=1e-9, atol=1e-14, err_msg=name)

    def test_without_walls_on_all_sides(self):
        columns, _, _ = self.series("run", self.write("scene.toml", SCENE), "--quiet")
        for name in ("box", "strain", "stress_contacts", "stress_walls", "solid_fraction", "inertial_number"):
            self.assertTrue(np.isnan(columns[name]).any(), name)
        self.assertTrue(np.isfinite(columns["wall_normal_force"]).all())


class Stopped(SeriesTest):
    def test_a_run_that_is_stopped_keeps_its_rows_and_frames(self):
        names = {name: self.folder / name for name in ("run.csv", "run.h5", "frames.h5", "checkpoint.h5")}
        command = (
            NSCDD,
            *self.biaxial(),
            "--steps",
            1_000_000,
            "--series",
            names["run.csv"],
            "--series",
            names["run.h5"],
            "--frames",
            names["frames.h5"],
            "--frame-every",
            2,
            "--checkpoint",
            names["checkpoint.h5"],
        )
        with subprocess.Popen([str(part) for part in command], stderr=subprocess.PIPE, text=True) as run:
            for _ in range(2000):  # rows are in the file beside its place
                if sum(len(path.read_text().splitlines()) for path in self.folder.glob("run.csv.*.part")) > 5:
                    break
                time.sleep(0.02)
            run.send_signal(signal.SIGUSR1)
            _, told = run.communicate(timeout=60)
        self.assertEqual(run.returncode, 4, told)
        with h5py.File(names["checkpoint.h5"]) as file:
            last = int(file.attrs["step"])
        self.assertGreater(last, 3)
        np.testing.assert_array_equal(read_csv(names["run.csv"])[1][:, 0], np.arange(1, last + 1))
        self.assertEqual(read_h5(names["run.h5"])[0]["step"][-1], last)
        with h5py.File(names["frames.h5"]) as file:
            self.assertEqual([frame.attrs["step"] for frame in file.values()], list(range(2, last + 1, 2)))
        self.assertEqual(list(self.folder.glob("*.part")), [])


class Targets(SeriesTest):
    def refused(self, fragment, *arguments):
        endless = self.write("scene.toml", SCENE.replace("count = 5", "count = 2147483647"))
        done = self.run_program("run", endless, *arguments, timeout=20)
        lines = [line for line in done.stderr.splitlines() if line.startswith("nscdd:") and "warning" not in line]
        self.assertEqual((done.returncode, len(lines)), (1, 1), done.stderr)
        self.assertIn(fragment, lines[0])

    def test_refusals(self):
        out, folder = self.folder / "out.h5", self.folder / "none"
        for fragment, *arguments in (
            ("expected a name that ends in .h5, .hdf5 or .csv", "--series", self.folder / "out.txt"),
            ("the folder", "--series", folder / "out.csv"),
            ("the folder", "--frames", folder / "out.h5"),
            ("--series is the same file as the scene", "--series", self.linked("scene.csv")),
            ("--series is the same file as --series", "--series", out, "--series", out),
            ("--series is the same file as --state", "--series", out, "--state", out),
            ("--frames is the same file as --series", "--series", out, "--frames", out),
            ("expected a name that ends in .pvd, .h5 or .hdf5", "--frames", self.folder / "out.xdmf"),
            ("the .walls.pvd beside --frames is the same file as --json", "--frames", self.folder / "a.pvd", "--json", self.folder / "a.walls.pvd"),
            ("--frames is the same file as --frames", "--frames", out, "--frames", out),
            ("--frame-every is of frames", "--frame-every", 5),
            ("--frame-every 5: the run makes steps 1 to 4", "--frames", out, "--frame-every", 5, "--steps", 4),
        ):
            with self.subTest(fragment=fragment):
                self.refused(fragment, *arguments)
        self.assertEqual({path.name for path in self.folder.iterdir()}, {"scene.toml", "scene.csv"})

    def linked(self, name):
        path = self.folder / name
        path.symlink_to("scene.toml")
        return path

    def test_old_files_stay_where_a_run_fails(self):
        text = SCENE.replace("[0.3, 0.1, 1.5]", "[0.3, 0.1, 0.6]")  # grains overlap by far
        old = [self.write(name, "old") for name in ("out.csv", "out.h5", "frames.h5")]
        done = self.run_program("run", self.write("scene.toml", text), "--series", old[0], "--series", old[1], "--frames", old[2], "--quiet")
        self.assertEqual(done.returncode, 1)
        self.assertEqual([path.read_text() for path in old], ["old"] * 3)
        self.assertEqual(len(list(self.folder.iterdir())), 4)

    def test_where_the_disk_is_full(self):
        """Old files stay, but for frames: there are those that there was room for."""

        def small_disk():
            resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))

        for name, *options in (("out.csv", "--series"), ("out.h5", "--series"), ("frames.h5", "--frame-every", 2, "--frames")):
            old = self.write(name, "old")
            full = (1, [f"nscdd: {old}: cannot write: File too large"])
            for ranks in (0, 2):  # more ranks than cores take minutes beside other programs
                if ranks == 0:
                    done = self.run_program(*self.biaxial(), "--steps", 200, *options, old, preexec_fn=small_disk)
                    told = done.returncode, [line for line in done.stderr.splitlines() if line.startswith("nscdd:")]
                else:
                    told = self.run_on_small_disk(*self.biaxial(), "--scheme", "dcs", "--steps", 200, *options, old, ranks=ranks, kib=60)
                with self.subTest("all ranks stop, whichever had the error", name=name, ranks=ranks):
                    self.assertEqual(told, full)
                    self.assertEqual(list(self.folder.glob("*.part")), [])
                    if "--frames" in options:
                        with h5py.File(old) as file:
                            self.assertIn("step_0000000002/grains/x", file)
                    else:
                        self.assertEqual(old.read_text(), "old")


def pictures(path, out):
    """What VTK's readers find, by pvpython where it is there; None where no reader is."""
    for python in filter(None, (shutil.which("pvpython"), sys.executable)):
        done = subprocess.run([python, READ_VTK, path, out], capture_output=True, text=True, timeout=300)
        if done.returncode != 77:
            if done.returncode != 0 or "rror" in done.stderr or "nrecognized" in done.stderr:
                raise AssertionError(done.stderr)
            with np.load(out) as file:
                return {name: file[name] for name in file}
    return None


class Frames(SeriesTest):
    def run_frames(self, *command, every=5, steps=10, ranks=0, name="frames"):
        path, state = self.folder / f"{name}.h5", self.folder / f"{name}-state.h5"
        done = self.run_program(*command, "--frames", path, "--frame-every", every, "--steps", steps, "--state", state, ranks=ranks)
        self.assertIn(done.returncode, (0, 3), done.stderr)
        return path, state

    def check_last(self, path, state, times):
        with h5py.File(path) as frames, h5py.File(state) as end:
            dim, h = end["x"].shape[1], end.attrs["time"] / end.attrs["step"]
            np.testing.assert_allclose([frame.attrs["time"] for frame in frames.values()], times, rtol=1e-12)
            last = list(frames.values())[-1]
            self.assertEqual(last.attrs["time"], end.attrs["time"])
            grains, contacts = last["grains"], last["contacts"]
            for name in ("x", "velocity"):
                np.testing.assert_array_equal(grains[name][:, :dim], end[name])
                self.assertFalse(grains[name][:, dim:].any())
            np.testing.assert_array_equal(grains["spin"][:, 2:] if dim == 2 else grains["spin"], end["spin"])
            np.testing.assert_array_equal(grains["id"], np.arange(len(end["x"])))
            for name in ("radius", "subdomain", "multiplicity"):
                np.testing.assert_array_equal(grains[name], end[name])
            for name in ("gap", "subdomain"):
                np.testing.assert_array_equal(contacts[name], end[f"contacts/{name}"])
            np.testing.assert_allclose(contacts["force"][:, :dim], end["contacts/impulse"][...] / h, rtol=1e-12)
            np.testing.assert_allclose(contacts["normal_force"], end["contacts/normal_impulse"][...] / h, rtol=1e-12)
            i, j, ends = end["contacts/i"][...], end["contacts/j"][...], contacts["ends"][...].reshape(-1, 2, 3)
            np.testing.assert_array_equal(contacts["grains"], np.stack((i, j), 1))
            np.testing.assert_array_equal(ends[:, 0, :dim], end["x"][...][i])
            np.testing.assert_allclose(ends[j >= 0, 1, :dim], end["x"][...][j[j >= 0]], rtol=1e-12, atol=1e-12)
            wall, foot = -1 - j[j < 0], ends[j < 0, 1, :dim]
            np.testing.assert_allclose(np.einsum("cd,cd->c", end["walls/normal"][...][wall], foot), end["walls/offset"][...][wall], atol=1e-12)

    def test_frames_are_the_states(self):
        for command in ((*self.biaxial(), "--scheme", "nlgs"), (*self.triaxial(), "--scheme", "dcs", "-n", 4)):
            with self.subTest(command=command):
                self.check_last(*self.run_frames(*command), 0.02 * np.array((5, 10)))

    def test_ranks_and_more_grains_than_come_at_once(self):
        grid = np.stack(np.meshgrid(np.arange(140), np.arange(125), indexing="ij"), -1).reshape(-1, 2) + 0.5
        with h5py.File(self.folder / "many.h5", "w") as file:  # 17,500 disks, that touch
            file["x"], file["radius"], file["box"] = grid, np.full(len(grid), 0.5), [140.0, 125]
        command = ("run", REDUCED / "biaxial.toml", "--packing", self.folder / "many.h5", "--quiet", "--scheme", "dcs", "--max-iterations", 20)
        own = self.run_frames(*command, "-n", 2, every=1, steps=2, name="own")
        self.check_last(*own, (0.02, 0.04))
        over_mpi = self.run_frames(*command, every=1, steps=2, ranks=2, name="mpi")
        self.assertEqual(own[0].read_bytes(), over_mpi[0].read_bytes())

    def test_after_a_step_that_is_refused(self):
        """Series, frames and state are those of a run that ends before it."""
        text = SCENE.replace("[0, 0, -10]", "[0, 0, 0]").replace("friction = 0.3", "restitution = 0.5")
        scene = self.write("fast.toml", text.replace("[0.3, 0.1, 1.5]", "[0, 0, 7.51]\nvelocity = [0, 0, -2000]"))
        out = {name: [self.folder / f"{name}.{end}" for end in ("csv", "h5", "state.h5")] for name in ("refused", "stopped")}
        ends = {}
        for name, files in out.items():
            done = self.run_program(
                "run", scene, "--quiet", "--series", files[0], "--frames", files[1], "--state", files[2], *(("--steps", 2) if name == "stopped" else ())
            )
            ends[name] = done.returncode
            self.assertEqual(list(self.folder.glob("*.part")), [])
        self.assertEqual(ends, {"refused": 1, "stopped": 0})
        for refused, stopped in zip(*out.values()):
            self.assertEqual(refused.read_bytes(), stopped.read_bytes().replace(b"stopped", b"refused"), refused)

    def test_they_are_read_while_the_run_goes_on(self):
        path = self.folder / "frames.h5"
        command = (NSCDD, "run", self.write("scene.toml", SCENE), "--quiet", "--steps", 1_000_000, "--frames", path)
        for end in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
            path.unlink(missing_ok=True)
            with subprocess.Popen([str(part) for part in command], stderr=subprocess.PIPE, text=True) as run:
                try:
                    seen = 0
                    while seen < 8:
                        self.assertIsNone(run.poll())
                        if path.exists():
                            with h5py.File(path) as file:
                                steps = [int(frame.attrs["step"]) for frame in file.values()]
                                file.visititems(lambda name, item: item[...] if isinstance(item, h5py.Dataset) else None)
                            self.assertEqual(steps, list(range(1, len(steps) + 1)))
                            self.assertGreaterEqual(len(steps), seen)
                            seen = len(steps)
                    run.send_signal(end)
                    run.communicate(timeout=60)
                finally:
                    run.kill()
            self.assertEqual(run.returncode, -end)
            with h5py.File(path) as file:
                file.visititems(lambda name, item: item[...] if isinstance(item, h5py.Dataset) else None)
                self.assertEqual([frame.attrs["step"] for frame in file.values()], list(range(1, len(file) + 1)))

    def test_who_has_opened_or_linked_the_file_keeps_what_it_was(self):
        """The library locks a file a moment after it has opened it: until then it must not be written on. Between two frames: a name that is given
        while one takes its place may come too late."""
        with self.write("lease", "").open("r+") as file:
            try:
                fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_WRLCK)
            except OSError as error:
                self.skipTest(f"no leases in {self.folder}: {error}")
        path = self.folder / "frames.h5"
        command = (NSCDD, "run", self.write("scene.toml", SCENE), "--quiet", "--steps", 100_000_000, "--frames", path, "--frame-every", 2000)
        with subprocess.Popen([str(part) for part in command], stderr=subprocess.DEVNULL) as run:
            try:
                for number in range(4):
                    while not path.exists():
                        self.assertIsNone(run.poll())
                    before = path.stat().st_mtime_ns
                    while path.stat().st_mtime_ns == before:
                        self.assertIsNone(run.poll())
                    if number % 2 == 0:
                        file = os.open(path, os.O_RDONLY)
                        self.addCleanup(os.close, file)
                    else:
                        file = self.folder / f"linked-{number}.h5"
                        os.link(path, file)
                    size, later = os.stat(file).st_size, set()
                    while len(later) < 6:
                        self.assertIsNone(run.poll())
                        later.add(path.stat().st_mtime_ns)
                    self.assertEqual(os.stat(file).st_size, size)
            finally:
                run.kill()

    def test_a_run_that_goes_on_keeps_the_rhythm(self):
        _, state = self.run_frames(*self.biaxial(), steps=8)
        path, _ = self.run_frames(*self.biaxial(), "--from", state, steps=8, name="rest")
        with h5py.File(path) as file:
            self.assertEqual([frame.attrs["step"] for frame in file.values()], [10, 15])

    def test_paraview_reads_all_arrays(self):
        """Also steps without a contact: in free fall there are none at first."""
        falls = self.write(
            "falls.toml", SCENE.replace("0, 0, 0.5]", "0, 0, 0.52]").replace("[0.3, 0.1, 1.5]", "[0.3, 0.1, 2.5]").replace("h = 0.001", "h = 0.01")
        )
        for command in ((*self.biaxial(), "--scheme", "dcs", "-n", 2), self.triaxial(), ("run", falls, "--quiet")):
            for old in self.folder.glob("vtk*"):
                shutil.rmtree(old) if old.is_dir() else old.unlink()
            path, state = self.run_frames(*command, "--frames", self.folder / "vtk.pvd")
            with self.subTest(command=command), h5py.File(path) as frames:
                listed = [self.listed(f"vtk{part}.pvd") for part in ("", ".contacts", ".walls")]
                for files in listed:
                    np.testing.assert_array_equal([time for time, _ in files], [frame.attrs["time"] for frame in frames.values()])
                for frame, grains, contacts, walls in zip(frames.values(), *listed):
                    self.check_grains(frame["grains"], self.read(grains[1]))
                    self.check_contacts(frame["contacts"], frame["grains/radius"][...].min(), self.read(contacts[1]))
                    self.check_walls(frame["walls"], self.read(walls[1]))
                self.check_state(state)

    def listed(self, name):
        entries = xml.etree.ElementTree.parse(self.folder / name).iter("DataSet")
        return [(float(entry.get("timestep")), self.folder / entry.get("file")) for entry in entries]

    def read(self, path):
        """What each reader finds, which is the same."""
        found = pictures(path, self.folder / "found.npz")
        if found is None:
            self.skipTest("neither pvpython nor VTK's Python is there")
        by_reader = {name: {} for name in sorted({name.split("/")[0] for name in found})}
        for name, values in found.items():
            by_reader[name.split("/")[0]][name.split("/", 1)[1]] = values
        first, *others = by_reader.values()
        for other in others:
            self.assertEqual(sorted(other), sorted(first))
            for name in first:
                np.testing.assert_array_equal(other[name], first[name], name)
        return first

    def check_grains(self, grains, found):
        for name in ("id", "velocity", "spin", "radius", "subdomain", "multiplicity"):
            np.testing.assert_array_equal(found[f"point/{name}"], grains[name])
        np.testing.assert_array_equal(found["points"], grains["x"])
        np.testing.assert_array_equal(found["cells"], grains["id"])

    def check_contacts(self, contacts, least, found):
        for name in ("force", "normal_force", "gap", "subdomain", "grains"):
            np.testing.assert_array_equal(found[f"cell/{name}"].reshape(contacts[name].shape), contacts[name])
        force = contacts["normal_force"][...]
        np.testing.assert_array_equal(found["points"], contacts["ends"])
        np.testing.assert_array_equal(found["cells"], np.arange(2 * len(force)))
        np.testing.assert_array_equal(found["point/normal_force"], np.repeat(force, 2))
        share = np.abs(force) / max(force.max(initial=0), 1e-300)
        np.testing.assert_allclose(found["point/radius"], np.repeat(0.5 * least * np.sqrt(share), 2), rtol=1e-12)

    def check_walls(self, walls, found):
        self.assertEqual(len(found["cell/wall"]), len(walls["wall"]))
        np.testing.assert_array_equal(found["points"], walls["points"])

    def check_state(self, path):
        found = self.read(path.with_suffix(".xdmf"))
        with h5py.File(path) as end:
            dim = end["x"].shape[1]
            np.testing.assert_array_equal(found["points"][:, :dim], end["x"])
            np.testing.assert_array_equal(found["cells"], np.arange(len(end["x"])))
            np.testing.assert_array_equal(found["point/velocity"][:, :dim], end["velocity"])
            self.assertEqual(found["point/velocity"].shape[1], 3)
            for name in ("radius", "subdomain", "multiplicity"):
                np.testing.assert_array_equal(found[f"point/{name}"], end[name])

    def test_walls_and_cell_are_drawn_as_far_as_the_scene_reaches(self):
        path, state = self.run_frames(*self.triaxial())
        with h5py.File(path) as frames, h5py.File(state) as end:
            walls = list(frames.values())[-1]["walls"]
            np.testing.assert_array_equal(walls["wall"], range(6))
            np.testing.assert_array_equal(walls["corners"], [4] * 6)
            normal, offset, box = (end[name][...] for name in ("walls/normal", "walls/offset", "box"))
            for corners, n, at in zip(walls["points"][...].reshape(6, 4, 3), normal, offset):
                np.testing.assert_allclose(corners @ n, at, atol=1e-12)
                area = np.linalg.norm(np.cross(corners[1] - corners[0], corners[3] - corners[0]))
                self.assertAlmostEqual(area, box.prod() / np.abs(box @ n), delta=1e-3 * area)

    def test_frames_of_vtk_are_the_same_over_ranks_and_those_that_are_there_stay_whole(self):
        for name, ranks in (("own", 0), ("mpi", 2)):
            how = ("--scheme", "dcs", *(() if ranks else ("-n", 2)))
            done = self.run_program(*self.biaxial(), *how, "--steps", 4, "--frames", self.folder / f"{name}.pvd", "--frame-every", 2, ranks=ranks)
            self.assertIn(done.returncode, (0, 3), done.stderr)
        own, over_mpi = (sorted((self.folder / name).iterdir()) for name in ("own", "mpi"))
        self.assertEqual([path.name for path in own], [path.name for path in over_mpi])
        self.assertEqual(len(own), 6)
        for a, b in zip(own, over_mpi):
            self.assertEqual(a.read_bytes(), b.read_bytes())
        self.assertEqual(list(self.folder.rglob("*.part")), [])


class Log(SeriesTest):
    def test_lines_of_the_log_are_those_of_the_series(self):
        series, log = self.folder / "run.csv", self.folder / "run.log"
        for _ in range(2):
            done = self.run_program(*self.biaxial()[:-1], "--steps", 10, "--series", series, "--log", log, "--log-every", 4)
            self.assertIn(done.returncode, (0, 3), done.stderr)
        header, rows = read_csv(series)
        told = log.read_text().splitlines()
        self.assertEqual([line for line in done.stderr.splitlines() if "nscdd" not in line], told[len(told) // 2 :])
        for half in (told[: len(told) // 2], told[len(told) // 2 :]):
            self.assertEqual(half[0].split(), "step time iterations eta contacts kinetic energy stress left".split())
            lines = np.array([line.split()[:7] for line in half[1:]], float)
            np.testing.assert_array_equal(lines[:, 0], [4, 8, 10])
            of = lambda name: rows[:, header.index(name)][[3, 7, 9]]
            mean = 0.5 * (of("stress_contacts_xx") + of("stress_contacts_yy"))
            for column, expected in zip(lines.T[1:], (of("time"), of("iterations"), of("residual"), of("contacts"), of("kinetic_energy"), mean)):
                np.testing.assert_allclose(column, expected, rtol=0.06)

    def test_by_itself_a_log_has_a_hundred_lines(self):
        log = self.folder / "run.log"
        self.run_program("run", self.write("scene.toml", SCENE), "--quiet", "--steps", 500, "--log", log)
        self.assertEqual(len(log.read_text().splitlines()), 101)


if __name__ == "__main__":
    unittest.main()
