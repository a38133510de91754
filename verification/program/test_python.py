"""The Python module nscdd beside the program: the same bits, arrays that stay what they were, errors of one line."""
import contextlib
import copy
import gc
import json
import os
import pathlib
import pickle
import shutil
import subprocess
import sys
import threading
import types
import unittest
import unittest.mock
import warnings

import numpy as np
from harness import MPIRUN, NSCDD, ROOT, SCENE, ProgramTest

MODULE = pathlib.Path(NSCDD).resolve().parents[1] / "python"
sys.path.insert(0, str(MODULE))
try:
    import nscdd
except ImportError as missing:
    raise unittest.SkipTest(f"the Python module is not built: {missing}")

GLASS = dict(density=1.0, friction=0.3, gravity=(0, 0, -10), h=0.001)
FLOOR = nscdd.Wall(normal=(0, 0, 1), through=(0, 0, 0), name="floor")
PAIR = np.array([[0, 0, 0.5], [0.3, 0.1, 1.5]])


def heap(n=60, dim=3, **options):
    """Grains above a floor, at places that no grid has."""
    rng = np.random.default_rng(4)
    side = int(np.ceil(n ** (1 / dim)))
    x = np.stack(np.meshgrid(*[np.arange(side)] * dim), axis=-1).reshape(-1, dim)[:n] * 1.02 + 0.5
    up = np.eye(dim)[-1]
    walls = [nscdd.Wall(normal=up, through=0 * up, name="floor")]
    given = dict(density=1.0, friction=0.3, gravity=-10 * up, h=0.005, walls=walls)
    return nscdd.Simulation(x, rng.uniform(0.4, 0.5, n), **(given | options))


def same(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


class Program(ProgramTest):
    def pack(self):
        self.write("spec.toml", 'dimension = 2\ngrains = 60\nradius = 0.5\nspread = 0.2\nseed = 3\ngenerator = "own"\n')
        path = self.folder / "packing.h5"
        self.succeeds("pack", self.folder / "spec.toml", "-o", path)
        return path

    def state_of_run(self, scene, *options):
        path = self.folder / "state.h5"
        self.succeeds("run", scene, "--state", path, *options)
        return nscdd.load(path)

    def compare(self, state, simulation):
        for key in ("positions", "velocities", "radii"):
            self.assertTrue(same(getattr(state, key), getattr(simulation, key)), key)
        self.assertTrue(same(state.spins, simulation.spins))
        self.assertTrue(same(state.contacts, simulation.contacts))
        self.assertEqual(state.time, simulation.time)
        self.assertEqual(state.step, simulation.steps)

    def test_bits_of_a_scene_file_and_of_arrays(self):
        state = self.state_of_run(self.write("scene.toml", SCENE))
        read = nscdd.read(self.folder / "scene.toml")
        self.assertTrue(read.run().converged)
        self.compare(state, read)
        made = nscdd.Simulation(PAIR, 0.5, walls=[FLOOR], **GLASS)
        made.run(5)
        self.compare(state, made)

    def test_bits_on_subdomains_and_threads(self):
        packing = self.pack()
        scene = ROOT / "cases/reduced/network.toml"
        options = ["--packing", packing, "--steps", 6, "--subdomains", 4, "--scheme", "dcs", "--tolerance", 1e-3]
        state = self.state_of_run(scene, *options)
        for threads in (1, 2):
            simulation = nscdd.read(scene, packing=packing, subdomains=4, threads=threads, scheme="dcs", tolerance=1e-3)
            simulation.run(6)
            self.compare(state, simulation)
        self.assertEqual(set(simulation.subdomains), {0, 1, 2, 3})

    def test_goes_on_from_states_of_either(self):
        packing, scene = self.pack(), ROOT / "cases/reduced/network.toml"
        whole = self.state_of_run(scene, "--packing", packing, "--steps", 6)
        begun = nscdd.read(scene, packing=packing)
        begun.run(3)
        begun.save(self.folder / "half.h5")
        gone_on = nscdd.read(scene, state=self.folder / "half.h5")
        self.assertEqual((gone_on.steps, gone_on.time), (3, begun.time))
        gone_on.run(3)
        self.compare(whole, gone_on)
        self.compare(self.state_of_run(scene, "--from", self.folder / "half.h5", "--steps", 3), gone_on)

    def test_a_scene_of_arrays_goes_on_from_its_state(self):
        walls = dict(walls=[FLOOR], **GLASS)
        whole = nscdd.Simulation(PAIR, 0.5, **walls)
        whole.run(3)
        whole.save(self.folder / "half.h5")
        whole.run(3)
        rest = nscdd.Simulation(state=self.folder / "half.h5", **walls)
        rest.run(3)
        self.assertTrue(same(whole.positions, rest.positions) and same(whole.contacts, rest.contacts))
        for given in (dict(positions=PAIR, radii=0.5), dict(material=["grains"] * 2), dict(box=(1, 1, 1))):
            with self.assertRaisesRegex(ValueError, "material and box come from the state"):
                nscdd.Simulation(state=self.folder / "half.h5", **given, **walls)

    def test_materials_of_a_state_go_by_their_names(self):
        made = nscdd.Simulation(PAIR, 0.5, materials={"light": 1.0, "heavy": 100.0}, material=["light", "heavy"], h=0.01)
        made.save(self.folder / "mixed.h5")
        for names, masses in ((("heavy", "light"), made.masses), (("other", "one"), made.masses), (("light", "other"), made.masses)):
            materials = dict(zip(names, (100.0, 1.0) if names[0] == "heavy" else (1.0, 100.0)))
            again = nscdd.Simulation(state=self.folder / "mixed.h5", materials=materials, h=0.01)
            self.assertEqual(list(again.masses), list(masses))
        with self.assertRaisesRegex(ValueError, "mixed.h5: material 'light' is number 1, Simulation has it as number 2: give them in one order"):
            nscdd.Simulation(state=self.folder / "mixed.h5", materials={"other": 1.0, "light": 100.0}, h=0.01)

    def test_what_a_state_says_otherwise_is_refused(self):
        side = nscdd.Wall(normal=(1, 0, 0), through=(-5, 0, 0), name="side")
        nscdd.Simulation(PAIR, 0.5, walls=[FLOOR, side], spins=np.ones((2, 3)), **GLASS).save(self.folder / "two.h5")
        again = dict(state=self.folder / "two.h5", density=1.0, h=0.001)
        with self.assertRaisesRegex(ValueError, "two.h5: wall 'floor' is number 1, Simulation has it as number 2"):
            nscdd.Simulation(walls=[side, FLOOR], **again)
        with self.assertRaisesRegex(ValueError, "Simulation: wall 'other' has another normal than 'side' of the state"):
            nscdd.Simulation(walls=[FLOOR, nscdd.Wall(normal=(0, 1, 0), through=(0, 0, 0), name="other")], **again)
        with self.assertRaisesRegex(ValueError, "two.h5: grains turn, Simulation has the law .frictionless., which does not see it"):
            nscdd.Simulation(walls=[FLOOR, side], law="frictionless", **again)
        turning = nscdd.Simulation(walls=[FLOOR, side], **again)
        self.assertTrue(same(turning.spins, np.ones((2, 3))))
        with self.assertWarnsRegex(UserWarning, "no step was made since the state was read"):
            turning.save(self.folder / "three.h5")

    def test_a_scene_of_arrays_is_written_for_the_program(self):
        (self.folder / "there").mkdir()
        stl = "solid\nfacet normal 0 0 1\nouter loop\nvertex -9 -9 0\nvertex 9 -9 0\nvertex 0 9 0\nendloop\nendfacet\nendsolid\n"
        self.write("floor.stl", stl)
        for things in (dict(walls=[FLOOR]), dict(obstacles=[nscdd.Obstacle(stl=self.folder / "floor.stl", name="floor")])):
            made = nscdd.Simulation(
                PAIR, 0.5, max_iterations=500, scheme="dcs", subdomains=2,
                tables={"fix": [{"low": [5] * 3, "high": [6] * 3}], "solver": {"tolerance": 1e-6}}, **things, **GLASS
            )  # fmt: skip
            made.run(2)
            made.save(self.folder / "begun.h5")
            made.write_scene(self.folder / "there/scene.toml")
            made.run(4)
            options = ("--from", self.folder / "begun.h5", "--adopt", "--steps", 4, "--scheme", "dcs", "--subdomains", 2)
            self.compare(self.state_of_run(self.folder / "there/scene.toml", *options), made)
        lines = (self.folder / "there/scene.toml").read_text().splitlines()
        self.assertLess({"tolerance", "max_iterations"}, {line.split(" = ")[0].strip() for line in lines})
        self.assertEqual(lines[0], "# goes on by: nscdd run scene.toml --from STATE --adopt --scheme dcs --subdomains 2")
        with self.assertRaisesRegex(ValueError, "the scene is in .*scene.toml already"):
            nscdd.read(self.folder / "there/scene.toml", state=self.folder / "begun.h5", adopt=True).write_scene(self.folder / "again.toml")

    def test_a_written_scene_has_what_walls_were_given(self):
        box = dict(box=(1, 1), density=1.0, h=0.01, tolerance=1e-8)
        sides = [nscdd.Wall(side=face) for face in ("x-", "x+", "y-")]
        for made, change in ((dict(force=2.0), dict(force=5.0)), (dict(pressure=2.0), dict(pressure=5.0)), ({}, dict(velocity=[0.0, -0.01]))):
            pushed = nscdd.Simulation([[0.5, 0.45]], 0.4, walls=[*sides, nscdd.Wall(side="y+", name="top", **made)], **box)
            pushed.run(2)
            for key, value in change.items():
                setattr(pushed.walls["top"], key, value)
            with self.assertWarnsRegex(UserWarning, f"does not have the {next(iter(change))} that wall 'top' was given"):
                pushed.save(self.folder / "begun.h5")
            pushed.write_scene(self.folder / "pushed.toml")
            pushed.run(4)
            state = self.state_of_run(self.folder / "pushed.toml", "--from", self.folder / "begun.h5", "--adopt", "--steps", 4)
            self.compare(state, pushed)
            self.assertEqual(state.walls["top"]["offset"], pushed.walls["top"].offset)
            self.assertTrue(same(state.walls["top"]["velocity"], pushed.walls["top"].velocity))
            self.assertNotEqual(state.walls["top"]["offset"], 1)

    def test_a_written_scene_names_files_as_they_were_when_it_was_made(self):
        self.write("path.txt", "0 0 0\n1 0 1\n")
        here = os.getcwd()
        try:
            os.chdir(self.folder)
            made = nscdd.Simulation([[0.5, 0.5]], 0.2, density=1.0, h=0.01, walls=[nscdd.Wall((0, 1), (0, 0), motion={"motion": "table", "file": "path.txt"})])
        finally:
            os.chdir(here)
        (self.folder / "there").mkdir()
        made.write_scene(self.folder / "there/scene.toml")
        self.assertRegex((self.folder / "there/scene.toml").read_text(), r"file = ['\"]\.\./path.txt['\"]")
        made.write_scene(self.folder / "there/scene.toml")  # where one is already
        os.symlink(self.folder / "there/scene.toml", self.folder / "link.toml")
        made.write_scene(self.folder / "link.toml")
        made.write_scene(self.folder / "two words\n.toml")
        line = (self.folder / "two words\n.toml").read_text().splitlines()[0]
        self.assertEqual(line, r"# goes on by: nscdd run 'two words\n.toml' --from STATE --adopt --scheme nlgs --subdomains 1")
        os.remove(self.folder / "two words\n.toml")
        self.assertTrue((self.folder / "link.toml").is_symlink())
        os.remove(self.folder / "link.toml")
        os.mkfifo(self.folder / "pipe")
        with self.assertRaisesRegex(OSError, "pipe: is not a file that can be replaced"):
            made.write_scene(self.folder / "pipe")
        with self.assertRaisesRegex(ValueError, "pipe: no time series: it is not a file"):
            nscdd.read_series(self.folder / "pipe")
        os.remove(self.folder / "pipe")
        for path, told in ((self.folder / "there", "there: is a folder"), (self.folder / "none/scene.toml", "scene.toml: cannot be written: No such")):
            with self.assertRaisesRegex(OSError, told):
                made.write_scene(path)
        self.assertEqual(sorted(path.name for path in self.folder.rglob("*")), ["path.txt", "scene.toml", "there"])

    def test_a_state_without_grains(self):
        gone = heap(3, tables={"remove": [{"low": [-9] * 3, "high": [9] * 3}]})
        gone.run(1)
        self.assertEqual(len(gone), 0)
        gone.save(self.folder / "gone.h5")
        state = nscdd.load(self.folder / "gone.h5")
        self.assertEqual((state.positions.shape, state.velocities.shape, state.radii.shape, len(state.contacts)), ((0, 3), (0, 3), (0,), 0))

    def test_a_state_has_fixed_grains_and_the_tilt_of_a_cell(self):
        fixed = dict(tables={"fix": [{"low": [-1, -1, 0], "high": [1, 1, 1]}]}, **GLASS)
        whole = nscdd.Simulation(PAIR, 0.5, **fixed)
        whole.velocities, whole.spins = np.ones((2, 3)), np.ones((2, 3))
        self.assertEqual((list(whole.velocities[0]), list(whole.spins[0])), ([0] * 3, [0] * 3))
        whole.run(3)
        self.assertTrue(np.array_equal(whole.positions[0], PAIR[0]))
        whole.save(self.folder / "fixed.h5")
        self.assertEqual(list(nscdd.load(self.folder / "fixed.h5").fixed), [1, 0])
        self.assertEqual(list(np.isinf(nscdd.Simulation(state=self.folder / "fixed.h5", **fixed).masses)), [True, False])
        sheared = nscdd.Cell((3, 3, 3), gradient=[[0, 1.0, 0], [0, 0, 0], [0, 0, 0]])
        with self.assertRaisesRegex(ValueError, "grain 0: mass must be positive"):
            nscdd.Simulation(PAIR, 0.5, masses=[-np.inf, 1], **GLASS)
        for how in (fixed, dict(masses=[np.inf, 1], **GLASS)):
            with self.assertRaisesRegex(ValueError, "a grain is fixed, which a .cell. with a gradient"):
                nscdd.Simulation(PAIR, 0.5, cell=sheared, **how)
        flows = nscdd.Simulation(PAIR, 0.5, cell=sheared, **(GLASS | {"gravity": None}))
        flows.run(10)
        flows.save(self.folder / "tilt.h5")
        self.assertGreater(flows.cell["tilt"][0, 1], 0.02)
        self.assertTrue(same(nscdd.load(self.folder / "tilt.h5").tilt, flows.cell["tilt"]))

    def test_series_that_are_none(self):
        self.assertEqual(list(nscdd.read_series(self.write("good.csv", "step,time\n1,0.5\n"))["time"]), [0.5])
        heap(3).save(self.folder / "state.h5")
        for name, text, told in (
            ("none.csv", None, "No such file"),
            ("empty.csv", "", "it is empty"),
            ("short.csv", "step,time\n1\n", "line 2 has 1 numbers for 2 columns"),
            ("text.csv", "step,time\n1,a\n", "could not convert"),
            ("none.h5", None, ""),
            ("state.h5", None, "is a group"),
        ):
            path = self.folder / name if text is None else self.write(name, text)
            with self.subTest(name), self.assertRaisesRegex(ValueError, f"{name}: no time series: .*{told}") as raised:
                nscdd.read_series(path)
            self.assertNotIn("\n", str(raised.exception))

    def test_what_a_state_does_not_have_is_told(self):
        path = self.folder / "state.h5"
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            heap(3).save(path)
        pushed = heap(3)
        pushed.forces, pushed.torques = np.ones((3, 3)), np.zeros((3, 3))
        released = heap(3, tables={"grain": [{"position": [9, 9, 9], "radius": 0.5, "material": "grains", "force": [1, 0, 0]}]})
        released.forces = np.zeros((4, 3))
        for simulation, lost in ((heap(3, masses=[1, 2, 3]), "masses"), (pushed, "forces"), (released, "forces")):
            with self.assertWarnsRegex(UserWarning, f"a state does not have {lost}: give them again"):
                simulation.save(path)

    def test_what_cannot_be_written_is_an_error_of_the_system(self):
        simulation, path = heap(3), self.folder / "none/a.h5"
        with self.assertRaisesRegex(OSError, "a.h5: cannot write: the folder .* does not exist"):
            simulation.save(path)
        for series, frames in (([path], None), ([], path)):
            with self.assertRaisesRegex(OSError, "a.h5: cannot write: the folder .* does not exist"), simulation.record(*series, frames=frames):
                simulation.step()

    def test_series_and_frames_are_those_of_the_program(self):
        scene = self.write("scene.toml", SCENE)
        self.succeeds("run", scene, "--series", self.folder / "a.csv", "--series", self.folder / "a.h5", "--frames", self.folder / "af.h5")
        simulation = nscdd.read(scene)
        with simulation.record(self.folder / "b.csv", self.folder / "b.h5", frames=self.folder / "bf.h5"):
            simulation.run()
        self.assertEqual((self.folder / "a.csv").read_bytes(), (self.folder / "b.csv").read_bytes())
        csv, hdf5 = nscdd.read_series(self.folder / "b.csv"), nscdd.read_series(self.folder / "b.h5")
        self.assertTrue(np.array_equal(csv["step"], [1, 2, 3, 4, 5]) and np.array_equal(hdf5["step"], csv["step"]))
        self.assertTrue(np.array_equal(hdf5["time"], csv["time"]))
        import h5py

        with h5py.File(self.folder / "af.h5") as a, h5py.File(self.folder / "bf.h5") as b:
            self.assertEqual(list(a), list(b))

    def test_rows_that_were_recorded_are_kept_where_a_callback_raises(self):
        def fail(simulation, report):
            if simulation.steps == 3:
                raise KeyError("enough")

        simulation = nscdd.Simulation(PAIR, 0.5, walls=[FLOOR], **GLASS)
        with self.assertRaisesRegex(KeyError, "enough"), simulation.record(self.folder / "rows.csv"):
            simulation.run(10, fail)
        self.assertEqual(len(nscdd.read_series(self.folder / "rows.csv")["step"]), 3)

    def test_packings_go_out_and_come_back(self):
        x, r = np.random.default_rng(0).random((4, 2)), np.full(4, 0.1)
        nscdd.write_packing(self.folder / "p.h5", x, r, (1, 1), periodic="x")
        back = nscdd.read_packing(self.folder / "p.h5")
        self.assertTrue(same(back.positions, x) and same(back.radii, r))
        self.assertEqual(back.periodic, "x")
        for change, told in (
            (dict(radii=-r), "radii: row 0 must be > 0, found -0.1"),
            (dict(positions=x * np.nan), "positions: row 0 must be finite, found nan"),
            (dict(positions=x[:0], radii=[]), "positions must have shape .*, n > 0, found"),
            (dict(radii=r[1:]), r"radii must have shape \(4,\), found \(3,\)"),
            (dict(box=(1, -1)), "box: row 1 must be > 0, found -1"),
            (dict(periodic="XY"), "periodic must be some of 'xy', found 'XY'"),
            (dict(periodic="xz"), "periodic must be some of 'xy', found 'xz'"),
            (dict(path=3), "a file must be given by its name, found 3"),
        ):
            with self.subTest(told), self.assertRaisesRegex(ValueError, told):
                nscdd.write_packing(**(dict(path=self.folder / "p2.h5", positions=x, radii=r, box=(1, 1)) | change))
        with self.assertRaisesRegex(ValueError, "p2.h5"):
            nscdd.read_packing(self.folder / "p2.h5")

    def test_a_scene_with_a_mistake_tells_file_and_line(self):
        scene = self.write("scene.toml", SCENE.replace("radius = 0.5", "radius = -1", 1))
        told = self.run_program("run", scene).stderr.strip().removeprefix("nscdd: ")
        with self.assertRaises(ValueError) as raised:
            nscdd.read(scene)
        self.assertEqual(str(raised.exception), told)

    def test_examples(self):
        packing = self.folder / "box.h5"
        self.write("spec.toml", 'dimension = 3\ngrains = 100\nradius = 0.5\nspread = 0.1\nseed = 3\ngenerator = "own"\n')
        self.succeeds("pack", self.folder / "spec.toml", "-o", packing)
        environment = os.environ | {"PYTHONPATH": str(MODULE), "MPLBACKEND": "agg"}
        for name, lines, arguments, says in (
            ("triaxial", 25, [packing, "10"], "strain 0.0.*axial .*iterations"),
            ("brazil_nut", 30, [self.folder / "nut.png", "0.5"], "the nut is at"),
        ):
            path = ROOT / f"kernel/python/examples/{name}.py"
            self.assertLessEqual(len(path.read_text().splitlines()), lines)
            done = subprocess.run([sys.executable, path, *arguments], env=environment, capture_output=True, text=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stdout, says)


class Installed(ProgramTest):
    @unittest.skipUnless(shutil.which("cmake") and (MODULE.parent / "cmake_install.cmake").exists(), "there is no build to install from")
    def test_it_is_installed_and_imported(self):
        done = subprocess.run(["cmake", "--install", MODULE.parent, "--component", "python", "--prefix", self.folder], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        place = self.folder / "lib/python3/dist-packages"
        program = "import nscdd; print(nscdd.__file__); print(nscdd.Simulation([[0, 0]], 1, density=1, h=1).step())"
        environment = os.environ | {"PYTHONPATH": str(place)}
        done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, cwd=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(done.stdout.startswith(str(place)), done.stdout)


class Notebook(unittest.TestCase):
    def test_it_runs(self):
        """Cell by cell, each of which draws into a figure of its own; a notebook's server is not needed for that."""
        cells = json.loads((ROOT / "manual/17-python.ipynb").read_text())["cells"]
        self.assertFalse(any(cell.get("outputs") for cell in cells), "it is kept without what it prints")
        code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
        program = "\nplt.figure()\n".join(code) + "\nprint(sum(bool(plt.figure(n).axes) for n in plt.get_fignums()), 'pictures')"
        environment = os.environ | {"PYTHONPATH": str(MODULE), "MPLBACKEND": "agg"}
        done = subprocess.run([sys.executable, "-W", "error", "-c", program], env=environment, capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, "(?s)of the weight.*3 pictures")


class Arrays(unittest.TestCase):
    def test_shapes_and_order(self):
        for dim in (2, 3):
            simulation = heap(dim=dim)
            before = simulation.positions
            simulation.run(40)
            n = len(simulation)
            self.assertEqual(simulation.positions.shape, (n, dim))
            self.assertEqual(simulation.spins.shape, (n,) if dim == 2 else (n, 3))
            self.assertLess(np.abs(simulation.positions - before).max(), 0.5, "rows are still of the same grains")
            contacts = simulation.contacts
            self.assertTrue((np.diff(contacts["i"]) >= 0).all() and (contacts["j"] < n).all())
            on_grains = np.zeros((n, dim))
            np.add.at(on_grains, contacts["i"], contacts["impulse"])
            between = contacts[contacts["j"] >= 0]
            np.add.at(on_grains, between["j"], -between["impulse"])
            weight = simulation.masses * -10 * simulation.h
            change = simulation.masses[:, None] * (simulation.velocities - self.velocities_before(simulation, dim))
            change[:, -1] -= weight
            self.assertLess(np.abs(on_grains - change).max(), 1e-12 + 1e-9 * np.abs(on_grains).max())

    @staticmethod
    def velocities_before(simulation, dim):
        """Of the last step: the same scene, a step less."""
        again = heap(dim=dim)
        again.run(simulation.steps - 1)
        return again.velocities

    def test_arrays_are_read_only_and_of_their_moment(self):
        simulation = heap()
        positions, copy_of = simulation.positions, simulation.positions.copy()
        self.assertIs(simulation.positions, positions)
        simulation.run(20)
        frictionless = heap(3, friction=0.0)
        for array in (positions, simulation.contacts, simulation.forces, simulation.torques, frictionless.torques):
            with self.assertRaisesRegex(ValueError, "read-only"):
                array[0] = 1
        self.assertTrue(same(positions, copy_of))
        self.assertFalse(same(positions, simulation.positions))

    def test_a_view_has_no_copy_and_keeps_its_memory(self):
        simulation = heap()
        simulation.step()
        view, other = simulation.view(), simulation.view()
        self.assertEqual(view.__array_interface__["data"], other.__array_interface__["data"])
        order = np.argsort(view["id"])
        self.assertTrue(same(view["position"][order], simulation.positions))
        self.assertTrue(same(view["spin"][order], simulation.spins))
        self.assertTrue(np.array_equal(view["mass"][order], simulation.masses))
        with self.assertRaisesRegex(ValueError, "read-only"):
            view["position"][0] = 0
        kept, speeds = view.copy(), view["velocity"][:, 2]
        simulation.run(30)  # broad phases among them, which make new lists
        self.assertTrue(np.array_equal(view, kept))
        last = simulation.view()
        self.assertFalse(np.array_equal(last["position"], kept["position"]))
        kept_last = last.copy()
        del simulation, view, other
        gc.collect()
        self.assertTrue(np.array_equal(last, kept_last))
        self.assertTrue(np.array_equal(speeds, kept["velocity"][:, 2]))

    def test_a_view_of_contacts_has_what_the_copies_have(self):
        for dimension, friction in ((2, 0.3), (3, 0.3), (3, 0.0)):
            simulation = heap(dimension, friction=friction)
            simulation.run(60)
            ids, contacts = simulation.view()["id"], simulation.contacts
            pairs, at_walls = simulation.view("contacts"), simulation.view("wall_contacts")
            i, j = np.r_[ids[pairs["i"]], ids[at_walls["i"]]], np.r_[ids[pairs["j"]], -1 - at_walls["j"]]
            order = np.lexsort((j, i))
            self.assertGreater(min(len(pairs), len(at_walls)), 0)
            self.assertTrue(same(i[order], contacts["i"]) and same(j[order], contacts["j"]))
            for key in ("normal", "impulse" if friction else "normal_impulse"):
                self.assertTrue(same(np.concatenate([pairs[key], at_walls[key]])[order], contacts[key]))
            kept = pairs.copy(), at_walls.copy()
            simulation.run(20)
            self.assertTrue(np.array_equal(pairs, kept[0]) and np.array_equal(at_walls, kept[1]))
        with self.assertRaisesRegex(ValueError, "view: one of grains, contacts, wall_contacts, not 'walls'"):
            simulation.view("walls")
        with self.assertRaisesRegex(ValueError, "read-only"):
            pairs["impulse" if friction else "normal_impulse"] = 0

    def test_who_looks_does_not_change_what_comes(self):
        plain, seen, views = heap(), heap(), []
        for _ in range(25):
            plain.step()
            seen.step()
            views += [seen.view(), seen.view("contacts"), seen.view("wall_contacts")]
        self.assertTrue(same(plain.positions, seen.positions) and same(plain.contacts, seen.contacts))

    def test_a_scene_of_arrays_reads_no_memory_that_is_free(self):
        scene = "import numpy as np, nscdd; cell = nscdd.Cell(size=[3.3, 3.3], gradient=np.eye(2, k=1) / 2)"
        scene += "; print(nscdd.Simulation([[0.5, 0.5], [1.6, 0.5]], 0.4, density=1.0, h=0.01, friction=0.5, cell=cell).cell['gradient'])"
        where = {"PYTHONMALLOC": "debug", "PYTHONPATH": str(pathlib.Path(nscdd.__file__).parents[1])}  # overwrites what is free
        done = subprocess.run([sys.executable, "-c", scene], env=os.environ | where, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout.split()), (0, ["[[0.", "0.5]", "[0.", "0.", "]]"]), done.stderr)

    def test_several_subdomains_have_no_view(self):
        with self.assertRaisesRegex(ValueError, "take copies by id"):
            heap(subdomains=2).view()

    def test_materials_by_name_and_number(self):
        options = dict(materials={"a": 1.0, "b": 3.0}, density=None)
        named = heap(3, material=["a", "b", "a"], **options)
        self.assertEqual(list(named.materials), [0, 1, 0])
        for numbers in ([0, 1, 0], [0.0, 1.0, 0.0], np.array([0, 1, 0], dtype=np.uint8)):
            self.assertEqual(list(heap(3, material=numbers, **options).masses), list(named.masses))
        for numbers in ([0, 0.5, 0], np.array([0, 2**32, 0])):
            with self.assertRaisesRegex(ValueError, "Simulation: material: row 1 must be a whole number of 32 bits, found "):
                heap(3, material=numbers, **options)
        with self.assertRaisesRegex(ValueError, "grain 1: 'c' is not among the materials a, b"):
            heap(3, material=["a", "c", "a"], **options)


class Walls(unittest.TestCase):
    def test_velocity_is_written_between_steps(self):
        simulation = nscdd.Simulation([[0.0, 0.5]], 0.5, density=1.0, h=0.01, walls=[nscdd.Wall((0, 1), offset=0.0, velocity=(0, 0), name="floor")])
        for step in range(50):
            simulation.walls["floor"].velocity = (0, 0.1 if step < 25 else 0.3)
            simulation.step()
        self.assertAlmostEqual(simulation.walls[0].offset, 25 * 0.001 + 25 * 0.003, places=12)
        # half a step with the velocity of before, at each of the two jumps
        self.assertAlmostEqual(simulation.positions[0, 1] - simulation.walls[0].offset, 0.5 - 0.5 * 0.01 * (0.1 + 0.2), places=12)
        self.assertAlmostEqual(simulation.velocities[0, 1], 0.3, places=9)

    def test_force_and_pressure(self):
        sides = [nscdd.Wall(side=face) for face in ("x-", "x+", "y-")]
        for push, change in ((dict(force=2.0), "force"), (dict(pressure=2.0), "pressure")):
            top = nscdd.Wall(side="y+", name="top", mass=1.0, **push)
            simulation = nscdd.Simulation([[0.5, 0.5]], 0.5, density=1.0, box=(1, 1), h=0.01, walls=[*sides, top], tolerance=1e-8)
            simulation.step()
            self.assertAlmostEqual(simulation.measures()["wall_force"][3, 1], 2.0, places=6)
            self.assertEqual(getattr(simulation.walls["top"], change), 2.0)
            setattr(simulation.walls["top"], change, 5.0)
            simulation.step()
            self.assertAlmostEqual(simulation.measures()["wall_force"][3, 1], 5.0, places=6)

    def test_a_motion_of_a_scene_file(self):
        shakes = {"motion": "oscillating", "amplitude": 0.1, "frequency": 0.5}
        simulation = nscdd.Simulation([[0.0, 1.5]], 0.5, density=1.0, h=0.01, walls=[nscdd.Wall((0, 1), (0, 0), motion=shakes, name="floor")])
        simulation.run(50)
        self.assertAlmostEqual(simulation.walls[0].offset, 0.1 * np.sin(np.pi * 0.5), places=12)
        with self.assertRaisesRegex(ValueError, "wall 'floor': its motion is a function of time"):
            simulation.walls[0].velocity = (0, 1)

    def test_a_cell_repeats(self):
        simulation = nscdd.Simulation([[0.5, 0.5]], 0.2, density=1.0, friction=0.1, cell=nscdd.Cell(size=(1, 1), gradient=((0, 0.5), (0, 0))), h=0.01)
        simulation.run(10)
        self.assertEqual(simulation.cell["periodic"], ["x", "y"])
        self.assertAlmostEqual(simulation.cell["tilt"][0, 1], 0.05)


class Motion(unittest.TestCase):
    def test_masses_and_forces(self):
        x, masses, forces = [[0.0, 0.0], [5.0, 0.0]], [2.0, 3.0], [[1.0, 0.0], [0.0, 6.0]]
        simulation = nscdd.Simulation(x, 0.5, density=1.0, friction=0.1, masses=masses, h=0.01, gravity=(0, -1))
        self.assertEqual(list(simulation.masses), masses)
        simulation.forces = forces
        simulation.torques = [0.25, 0.0]
        self.assertTrue(np.array_equal(simulation.forces, forces) and np.array_equal(simulation.torques, [0.25, 0]))
        simulation.run(10)
        self.assertTrue(np.allclose(simulation.velocities, [[0.05, -0.1], [0, 0.1]], atol=1e-14))
        self.assertTrue(np.allclose(simulation.spins, [0.1 * 0.25 / (0.5 * 2 * 0.25), 0], atol=1e-14))
        view = simulation.view()
        speeds = view["velocity"].copy()
        simulation.velocities = [[0, 0], [1, 2]]
        self.assertTrue(np.array_equal(view["velocity"], speeds), "a view keeps its values")
        self.assertTrue(np.array_equal(simulation.velocities, [[0, 0], [1, 2]]))
        self.assertEqual(simulation.spins[1], 0)
        with self.assertRaisesRegex(ValueError, "forces must have shape"):
            simulation.forces = [1, 2]
        with self.assertRaisesRegex(ValueError, "must be finite"):
            simulation.forces = np.full((2, 2), np.nan)

    def test_velocities_of_copies_on_subdomains(self):
        alone, divided = heap(), heap(subdomains=4, tolerance=1e-9)
        alone = heap(tolerance=1e-9)
        for simulation in (alone, divided):
            simulation.velocities = np.random.default_rng(2).normal(size=(60, 3))
            simulation.forces = np.random.default_rng(3).normal(size=(60, 3))
            simulation.run(5)
        self.assertLess(np.abs(alone.positions - divided.positions).max(), 1e-4)

    def test_a_law_of_scene_files(self):
        """Two spheres that a pull of less than their cohesion does not part."""
        for pull, parted in ((0.9, False), (1.1, True)):
            pair = nscdd.Simulation([[0.0, 0, 0], [1.0, 0, 0]], 0.5, density=1.0, friction=0.3, cohesion=1.0, range=1e-3, h=0.01)
            pair.forces = [[-pull, 0, 0], [pull, 0, 0]]
            pair.run(20)
            self.assertEqual(np.ptp(pair.positions[:, 0]) > 1.0005, parted)

    def test_a_ball_rolls_on_a_plate_unless_it_resists(self):
        plate = nscdd.Obstacle(points=[[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], faces=[[0, 1, 2, 3]])
        for rolling, moves in ((0.049, True), (0.051, False)):  # of a radius of 0.5, on a slope of 1 in 10
            ball = nscdd.Simulation(
                [[0, 0, 0.5]], 0.5, density=1.0, friction=0.5, rolling=rolling, gravity=(1, 0, -10), obstacles=[plate], h=0.01, tolerance=1e-10
            )
            ball.run(50)
            self.assertEqual(ball.velocities[0, 0] > 1e-3, moves)
        with self.assertRaisesRegex(ValueError, "obstacle 'obstacle 0'"):
            nscdd.Simulation([[0, 0, 0.5]], 0.5, density=1.0, obstacles=[nscdd.Obstacle(points=[[0, 0, 0]])], h=0.01)

    def test_numbers_of_numpy_are_numbers(self):
        def end(kind, mapping=dict):
            simulation = nscdd.Simulation(
                PAIR, 0.5, density=kind(2500.5), friction=kind(0.3), h=kind(0.0015), walls=[FLOOR], gravity=(kind(0.5), 0, kind(-9.5)),
                tables=mapping({"stop": mapping({"time": kind(0.5)})}),
            )  # fmt: skip
            simulation.run(30)
            return simulation.positions

        for kind in (np.array, np.float64, np.longdouble, lambda x: np.array(x, dtype=np.longdouble)):
            self.assertTrue(same(end(kind, types.MappingProxyType), end(float)))
        self.assertFalse(same(end(np.float32), end(float)))

    def test_what_a_pair_does_not_say_is_that_of_all(self):
        for pair, speed in (({"friction": 0.1}, 0.8), ({"restitution": 0.5}, 0.5)):
            ball = nscdd.Simulation([[0, 0, 0.5]], 0.5, materials={"a": 1.0}, restitution=0.8, pairs={("a", "a"): pair}, walls=[FLOOR], h=0.01)
            ball.velocities = [[0, 0, -1.0]]
            ball.step()
            self.assertAlmostEqual(ball.velocities[0, 2], speed)

    def test_it_chooses_a_step(self):
        ball = nscdd.Simulation([[0, 0, 1.0]], 0.5, density=1.0, gravity=(0, 0, -10), walls=[FLOOR], h="auto")
        self.assertTrue(0 < ball.h < 0.05)

    def test_without_friction_grains_do_not_turn(self):
        simulation = nscdd.Simulation([[0.0, 0.0]], 0.5, density=1.0, h=0.01)
        self.assertEqual(list(simulation.torques), [0])
        with self.assertRaisesRegex(ValueError, "spins need friction"):
            simulation.spins = [1.0]


MPI_SCRIPT = """
import sys
import numpy as np
from mpi4py import MPI
sys.path.insert(0, sys.argv[1])
import nscdd
x = np.stack(np.meshgrid(*[np.arange(4)] * 3), axis=-1).reshape(-1, 3) * 1.02 + 0.5
scene = dict(density=1.0, friction=0.3, gravity=(0, 0, -10), h=0.005, walls=[nscdd.Wall((0, 0, 1), (0, 0, 0))], subdomains=4)
over = nscdd.Simulation(x, 0.45, masses=np.linspace(1, 2, 64), comm=MPI.COMM_WORLD, threads=2, **scene)
report = over.run(20)
rank = MPI.COMM_WORLD.Get_rank()

def push(simulation):
    for turn, what in enumerate(("velocities", "spins", "forces", "torques", "velocities", "forces")):
        setattr(simulation, what, np.random.default_rng(turn).normal(size=(64, 3)))
    return simulation.run(3)

report = push(over)
positions, contacts, measures = over.positions, over.contacts, over.measures()
if rank == 0:
    within = nscdd.Simulation(x, 0.45, masses=np.linspace(1, 2, 64), **scene)
    within.run(20)
    assert push(within).iterations == report.iterations
    assert within.positions.tobytes() == positions.tobytes() and within.contacts.tobytes() == contacts.tobytes()
    assert within.measures()["kinetic_energy"] == measures["kinetic_energy"]
    print("the same bits")
else:
    assert len(positions) == 0 and report.converged
pair = MPI.COMM_SELF.Create_intercomm(0, MPI.COMM_WORLD, 1 - rank)
for comm, radius in ((MPI.COMM_WORLD, -1), (MPI.COMM_NULL, 0.45), (pair, 0.45)):
    try:
        nscdd.Simulation(x, radius, comm=comm, **scene)
    except ValueError as error:
        said = MPI.COMM_WORLD.gather(str(error))
        if rank == 0:
            print(said)
"""


class OverMpi(ProgramTest):
    def test_processes_have_the_bits_of_one(self):
        try:
            import mpi4py  # noqa: F401
        except ImportError:
            self.skipTest("there is no mpi4py")
        if not list(MODULE.glob("nscdd/_mpi*.so")):
            self.skipTest("the module is built without MPI")
        script = self.write("script.py", MPI_SCRIPT)
        done = subprocess.run([MPIRUN, "-np", "2", sys.executable, script, MODULE], capture_output=True, text=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertIn("the same bits", done.stdout)
        self.assertEqual(done.stdout.count("grain 0: radius must be positive and finite"), 2, done.stdout)
        self.assertEqual(done.stdout.count("comm: must be a communicator of mpi4py, of one group and not COMM_NULL, found "), 4, done.stdout)

    def test_what_is_no_communicator(self):
        with self.assertRaisesRegex(ValueError, "comm: (must be a communicator of mpi4py, .* found 1|this build of nscdd has no MPI)"):
            nscdd.Simulation(PAIR, 0.5, comm=1, **GLASS)


class Errors(unittest.TestCase):
    def test_one_line_each(self):
        for change, told in (
            (dict(radii=[0.5]), r"Simulation: radii must have shape \(2,\), found \(1,\)"),
            (dict(positions=[[0, 0, 0, 0]]), r"positions must have shape \(n, 2\) or \(n, 3\), found \(1, 4\)"),
            (dict(radii=[0.5, -1]), "grain 1: radius must be positive and finite"),
            (dict(positions=PAIR * np.nan), "grain 0: position must be finite"),
            (dict(density=-1), "Simulation: material 'grains': density must be"),
            (dict(density=None), "give density, or materials"),
            (dict(friction=-0.1), "friction must be"),
            (dict(gravity=(0, -10)), "Simulation: gravity must"),
            (dict(h=0), "step: h must be > 0, found 0"),
            (dict(scheme="magic"), "scheme must be one of 'nlgs'"),
            (dict(scheme="nlgs", subdomains=2), "^scheme nlgs is sequential: give ccs or dcs"),
            (dict(threads=2, subdomains=1), "threads: subdomains are dealt to them|threads 2"),
            (dict(toleranec=1), "unknown key 'toleranec'"),
            (dict(fricton=0.3), r"Simulation: unknown keyword 'fricton' \(did you mean 'friction'\?\)"),
            (dict(radius=0.3), r"Simulation: unknown keyword 'radius' \(did you mean 'radii'\?\)"),
            (dict(tolerance=-1), "tolerance must be"),
            (dict(scheme="newton", window=1), "^window is of sweeps"),
            (dict(walls=[nscdd.Wall((0, 0, 2), (0, 0, 0))]), "wall 'wall 0': normal must have length 1, found 2"),
            (dict(walls=[nscdd.Wall(side="x-")]), "wall 'wall 0': side 'x-' needs the box of a 3D packing"),
            (dict(walls=[nscdd.Wall((0, 0, 1), (0, 0, 0), force=1, pressure=1)]), "a force or a pressure pushes it"),
            (dict(walls=["floor"]), "walls: each must be an nscdd.Wall, found 'floor'"),
            (dict(walls=nscdd.Wall(side="z-")), "walls must be a list of nscdd.Wall, found a Wall"),
            (dict(obstacles="x"), "obstacles must be a list of nscdd.Obstacle, found a str"),
            (dict(obstacles=[{"points": 1}]), "obstacles: each must be an nscdd.Obstacle, found a dict"),
            (dict(obstacles=[nscdd.Obstacle(cylinder=3)]), "obstacle 'obstacle 0': cylinder must be a dictionary with centre and radius, found 3"),
            (dict(obstacles=[nscdd.Obstacle(stl=3)]), "obstacle 'obstacle 0': stl must be the name of a file, found 3"),
            *((dict(threads=bad), r"threads must be a whole number in \[1, 2147483647\], found ") for bad in ("auto", 1.5, np.nan, True, 10**20, 0)),
            (dict(tables={"obstakle": [{}]}), "unknown key 'obstakle'"),
            (dict(tables={"packing": {"file": "none.h5"}}), "tables: .packing. is of scene files"),
            *((dict(box=bad), "Simulation: box: row 0 must be (> 0|finite), found ") for bad in ((-1, 1, 1), (np.nan, 1, 1), (0, 0, 0))),
            *((dict(imbalance=bad, subdomains=2), r"imbalance must be a number in \[1, 1000000\], found ") for bad in (np.nan, 0.5)),
            *(
                (dict([(key, bad)]), f"^{key} cannot be {bad!r}")
                for key, bad in (("scheme", 3), ("grid", "ab"), ("imbalance", "a"), ("max_iterations", 10**30))
            ),
            (dict(gravity=[None] * 3), r"gravity cannot be \[None, None, None\]"),
            *((dict(radii=bad), "Simulation: radii must be numbers") for bad in ("a", True, [[1], [1, 2]])),
            (dict(velocities=PAIR + 1j), "Simulation: velocities must be real"),
            (dict(cell={"size": (1, 1, 1)}), "cell must be an nscdd.Cell, found a dict"),
            (dict(cell=nscdd.Cell(stress=3)), "cell: stress must be a dictionary, found 3"),
            (dict(density=None, materials=["a"]), "materials must be a dictionary {name: density}, found a list"),
            (dict(pairs=["a"]), "pairs must be a dictionary .*, found a list"),
            (dict(pairs={"ab": {}}), "pairs has the key 'ab', it needs two names"),
            (dict(pairs={("a", "b"): 3}), r"pairs: \('a', 'b'\) must be a dictionary, found 3"),
            *((dict([(key, 3)]), f"Simulation: {key} must be a dictionary, found 3") for key in ("stop", "tables")),
            (dict(walls=[nscdd.Wall((0, 0, 1), motion=3)]), "wall 'wall 0': motion must be a dictionary, found 3"),
            (dict(friction=np.array([0.3, 0.2])), "friction must be a number"),
            (dict(state="a\0b.h5", positions=None, radii=None), r"a file: 'a.x00b.h5' is not a name in UTF-8"),
            (dict(walls=[nscdd.Wall((0, 0, 1), offset="a")]), "wall 'wall 0': offset must be a number, found 'a'"),
        ):
            given = {"positions": PAIR, "radii": 0.5, "walls": [FLOOR], **GLASS} | change
            with self.subTest(told), self.assertRaisesRegex(ValueError, told) as raised:
                nscdd.Simulation(given.pop("positions"), given.pop("radii"), **given)
            self.assertNotIn("\n", str(raised.exception))

    def test_a_refused_step(self):
        simulation = nscdd.Simulation([[0.0, 0.0], [0.5, 0.0]], 0.5, density=1.0, h=0.01)
        for _ in range(2):
            with self.assertRaisesRegex(nscdd.StepRefused, "^step 1: grain . and grain . overlap by") as raised:
                simulation.step()
        self.assertEqual({raised.exception.i, raised.exception.j}, {0, 1})
        self.assertIsInstance(raised.exception, RuntimeError)
        fast = heap(3)
        fast.velocities = np.full((3, 3), 1e308)
        with self.assertRaisesRegex(nscdd.StepRefused, "^step 1: .*no longer finite"):
            fast.step()

    def test_walls_refuse_what_does_not_move_them(self):
        simulation = nscdd.Simulation(PAIR, 0.5, walls=[FLOOR], **GLASS)
        with self.assertRaisesRegex(ValueError, "wall 'floor': no force drives it"):
            simulation.walls[0].force = 1
        with self.assertRaisesRegex(ValueError, "wall 'floor': velocity needs 3 numbers"):
            simulation.walls[0].velocity = (1, 2)
        for what, bad in (("force", None), ("force", True), ("pressure", "a"), ("velocity", "a")):
            with self.assertRaisesRegex(ValueError, f"wall 'floor': {what} must be (a number|numbers), found {bad!r}$"):
                setattr(simulation.walls[0], what, bad)
        with self.assertRaisesRegex(KeyError, "no wall 'roof' among floor"):
            simulation.walls["roof"]

    def test_a_misspelt_attribute_is_none(self):
        simulation = heap(3)
        for thing, name in ((simulation, "gravity"), (simulation, "force"), (simulation.walls[0], "pressur"), (simulation.walls, "floor")):
            with self.assertRaisesRegex(AttributeError, f"no attribute '{name}'"):
                setattr(thing, name, 1)

    def test_counts_of_steps(self):
        simulation = heap(3)
        simulation.run(np.array(1))
        for bad in (-1, 1.5, "a"):
            with self.assertRaisesRegex(ValueError, f"run: n must be a whole number .*, found {bad!r}$"):
                simulation.run(bad)
        for bad in (0, -1, 1.5, 10**20):
            with self.assertRaisesRegex(ValueError, f"record: every must be a whole number .*, found {bad!r}$"), simulation.record(every=bad):
                pass
        with self.assertRaisesRegex(ValueError, "run: give a number of steps"):
            simulation.run()
        for twice in (dict(frames="a.h5"), dict(frames="./a.h5")):
            with self.assertRaisesRegex(ValueError, "record: .*a.h5 is given twice"), simulation.record("a.h5", **twice):
                pass
        with self.assertRaisesRegex(ValueError, "read: adopt is of a state to go on from: give state"):
            nscdd.read("scene.toml", adopt=True)

    def test_it_says_no_to_pickle_and_copy(self):
        simulation = nscdd.Simulation(PAIR, 0.5, walls=[FLOOR], **GLASS)
        for kept in (simulation, simulation.walls, simulation.walls[0]):
            for copying in (pickle.dumps, copy.copy, copy.deepcopy):
                with self.assertRaisesRegex(TypeError, f"a {type(kept).__name__} cannot be pickled or copied: save"):
                    copying(kept)


class Threads(unittest.TestCase):
    def test_two_simulations_in_two_threads(self):
        alone = heap(200)
        alone.run(40)
        simulations = [heap(200), heap(200, subdomains=2, threads=2)]
        threads = [threading.Thread(target=simulation.run, args=(40,)) for simulation in simulations]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertTrue(same(simulations[0].positions, alone.positions))
        self.assertEqual(simulations[1].steps, 40)

    def test_one_simulation_is_not_for_two_threads(self):
        simulation, refused, stop = heap(1000), [], threading.Event()

        def look():
            while not stop.is_set():
                try:
                    simulation.positions
                except RuntimeError as error:
                    refused.append(str(error))

        thread = threading.Thread(target=look)
        thread.start()
        runs = 0
        while not refused and (runs := runs + 1) <= 100:  # the thread may begin late
            simulation.run(30)
        stop.set()
        thread.join()
        self.assertTrue(refused, "the GIL is released within a step")
        self.assertEqual(set(refused), {"Simulation: another thread is within step()"})

    def test_a_callback_ends_a_run_by_true_or_by_an_exception(self):
        simulation = heap(10)
        simulation.run(100, lambda s, report: s.steps == 4)
        self.assertEqual(simulation.steps, 4)

        def interrupt(s, report):
            raise KeyboardInterrupt

        with self.assertRaises(KeyboardInterrupt):
            simulation.run(100, interrupt)
        self.assertEqual(simulation.steps, 5)
        simulation.run(5)
        self.assertEqual(simulation.steps, 10)

    def test_a_stop_of_scene_files_ends_a_run(self):
        simulation = heap(10, stop={"time": 0.02})
        simulation.run(100)
        self.assertEqual((simulation.steps, simulation.stopped_by), (4, "time"))
        simulation = heap(10, stop={"time": 0.02})
        simulation.run()
        self.assertEqual((simulation.steps, simulation.stopped_by), (4, "time"))
        self.assertIsNone(heap(10).stopped_by)

    @unittest.skipUnless(hasattr(os, "fork"), "there is no fork")
    def test_after_a_fork(self):
        one, two = heap(10), heap(10, subdomains=2, threads=2)
        child = os.fork()
        if child == 0:
            code = 1
            with contextlib.suppress(BaseException):
                one.run(3)
                try:
                    two.step()
                except RuntimeError as error:
                    code = 0 if "threads have stayed behind" in str(error) and one.steps == 3 else 2
                two = heap(10, subdomains=2, threads=2)  # and the other one goes
                two.step()
            os._exit(code)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)
        two.step()


class Documented(unittest.TestCase):
    def test_every_public_name_has_a_text(self):
        for name in nscdd.__all__:
            thing = getattr(nscdd, name)
            self.assertTrue(thing.__doc__ and "Alias for" not in thing.__doc__, name)
            for member, value in vars(thing).items() if isinstance(thing, type) else ():
                if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                    self.assertTrue(value.__doc__, f"{name}.{member}")


if __name__ == "__main__":
    unittest.main()
