"""Grains for other programs and back: ON-DEM's VTKHDF, CSV, YADE, VTK. All numbers keep their bits; what is wrong is told in one line."""
import dataclasses
import os
import pathlib
import shutil
import subprocess
import sys
import unittest

import h5py
import numpy as np
from harness import NSCDD, ROOT, SCENE, ProgramTest

MODULE = pathlib.Path(NSCDD).resolve().parents[1] / "python"
sys.path.insert(0, str(MODULE))
try:
    import nscdd
    from nscdd import exchange
except ImportError as missing:
    raise unittest.SkipTest(f"the Python module is not built: {missing}")

from test_series import READ_VTK, pictures

YADE_BITS = pathlib.Path(__file__).resolve().with_name("yade_bits.py")
POINTS = "VTKHDF/PointData"


def packing(dim=3, **more):
    """Grains with all that a packing may have, and no round number."""
    rng = np.random.default_rng(dim)
    n = 12
    given = dict(
        positions=rng.random((n, dim)),
        radii=rng.uniform(1e-3, 1e-2, n) / 3,
        box=np.full(dim, 1 / 0.7),
        velocities=rng.standard_normal((n, dim)) * 1e-200,
        spins=rng.standard_normal((n, 3) if dim == 3 else n),
        material=np.arange(n, dtype=np.int32) % 2,
        materials=["glass, blue", "stål"],
        densities=np.array([2500.1, 7800.3]),
        fixed=np.array([1] + [0] * (n - 1), dtype=np.int32),
        time=0.1,
        step=7,
        scene="a scene",
        walls={},
    )
    return nscdd.State(**(given | more))


def same(a, b):
    if a is None or b is None:
        return a is b
    a, b = np.asarray(a), np.asarray(b)
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


class ExchangeTest(ProgramTest):
    def equal(self, a, b, *fields):
        for field in fields or ("positions", "radii", "box", "velocities", "spins", "material", "densities", "fixed", "tilt", "gradient"):
            self.assertTrue(same(getattr(a, field), getattr(b, field)), f"{field}: {getattr(a, field)} {getattr(b, field)}")
        self.assertEqual((list(a.materials), a.periodic), (list(b.materials), b.periodic))

    def equal_contacts(self, a, b):
        self.assertEqual(a.contacts.dtype.names, b.contacts.dtype.names)
        for field in set(a.contacts.dtype.names) - {"subdomain"}:
            self.assertTrue(same(a.contacts[field], b.contacts[field]), field)

    def convert(self, *arguments, code=0):
        """What is printed; of a failure the line on stderr."""
        environment = os.environ | {"PYTHONPATH": str(MODULE)}
        command = [sys.executable, "-m", "nscdd.exchange", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=60, cwd=self.folder)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertEqual(len((done.stderr if code == 1 else done.stdout).splitlines()), 1 if code < 2 else 0, done.stdout + done.stderr)
        return done.stderr if code else done.stdout


class Files(ExchangeTest):
    def test_all_of_a_packing_comes_back(self):
        flow = dict(periodic="xyz", tilt=np.triu(np.full((3, 3), 0.1), 1), gradient=np.eye(3)[::-1] * 0.3)
        for case in (
            packing(),
            packing(2),
            packing(**flow),
            packing(2, periodic="x"),
            packing(material=None, materials=(), densities=None),
            packing(material=None),
        ):
            bare = dataclasses.replace(case, densities=None, materials=())  # materials are rows of the scene's then
            for state in (case, bare):
                for write, read in ((nscdd.write_vtkhdf, nscdd.read_vtkhdf), (nscdd.write_csv, nscdd.read_csv)):
                    path = self.folder / f"{write.__name__}.file"
                    write(path, state)
                    self.equal(state, read(path))
        found = nscdd.read_vtkhdf(self.folder / "write_vtkhdf.file")
        self.assertEqual((found.time, found.step, found.scene), (0.1, 7, "a scene"))

    def test_a_bare_packing(self):
        state = nscdd.Packing(positions=[[0, 0, -0.5], [1, 2, -3]], radii=[0.25, 0.5], box=None)
        for write, read in ((nscdd.write_vtkhdf, nscdd.read_vtkhdf), (nscdd.write_csv, nscdd.read_csv)):
            write(self.folder / "bare", state)
            found = read(self.folder / "bare")
            np.testing.assert_array_equal(found.positions, state.positions)
            np.testing.assert_array_equal(found.box, [1.5, 2.5, 3.25], "up to the grains; where they are below 0, around them")
            self.assertIsNone(found.material)

    def state(self, scene=SCENE, *more):
        path = self.folder / "state.h5"
        self.succeeds("run", self.write("scene.toml", scene), "--state", path, *more)
        return nscdd.load(path)

    def test_contacts_and_walls_of_a_run_come_back(self):
        oblique = SCENE.replace("normal = [0, 0, 1]\nthrough = [0, 0, 0]", "normal = [0.6, 0, 0.8]\nthrough = [0, 0, -0.125]")
        for scene in (SCENE, oblique):
            state = self.state(scene)
            self.assertGreater(len(state.contacts), 0)
            nscdd.write_vtkhdf(self.folder / "a.vtkhdf", state, h=1e-3, gravity=(0, 0, -10))
            found = nscdd.read_vtkhdf(self.folder / "a.vtkhdf")
            self.equal(state, found)
            self.equal_contacts(state, found)
            self.assertEqual(list(found.walls), ["floor"])
            for key, value in state.walls["floor"].items():
                self.assertTrue(same(found.walls["floor"][key], value), key)

    def test_names_and_signs_are_those_of_the_schema(self):
        state = self.state()
        nscdd.write_vtkhdf(self.folder / "a.vtkhdf", state, h=1e-3, gravity=(0, 0, -10))
        with h5py.File(self.folder / "a.vtkhdf") as file:
            self.assertEqual((file.attrs["file_format"], file.attrs["file_format_version"]), ("ON-DEM VTKHDF", "0.1-draft"))
            shapes = {name: values.shape[1:] for name, values in file[POINTS].items()}
            self.assertEqual({key for key, shape in shapes.items() if shape == ()}, {"body_id", "material_id", "clump_id", "mass", "volume", "radius"})
            self.assertEqual({key for key, shape in shapes.items() if shape == (3,)}, {"position", "velocity", "angular_velocity"})
            self.assertEqual((shapes["orientation"], shapes["inertia"]), ((4,), (9,)))
            self.assertEqual(set(file["ONDEM/Bodies/Sphere"]), set(shapes))
            np.testing.assert_allclose(file[f"{POINTS}/mass"], np.pi / 6, rtol=1e-15)
            np.testing.assert_allclose(file[f"{POINTS}/inertia"][0], np.eye(3).ravel() * np.pi / 60, rtol=1e-15)
            np.testing.assert_array_equal(file[f"{POINTS}/orientation"], [[0, 0, 0, 1]] * 2)
            self.assertEqual((file["ONDEM/Scene"].attrs["time"], file["ONDEM/Scene"].attrs["timestep"]), (state.time, 1e-3))
            np.testing.assert_array_equal(file["ONDEM/Scene/gravity"], [0, 0, -10])
            self.assertEqual([text.decode() for text in file["ONDEM/Scene/units"]], ["second", "meter", "kilogram"])
            self.assertEqual((file["ONDEM/Materials/0/label"][()], file["ONDEM/Materials/0/density"][()]), (b"glass", 1.0))
            contacts, floor = file["ONDEM/Interactions/intr3D"], file["ONDEM/Bodies/Walls"]
            self.assertEqual((list(floor["body_id"]), list(floor["axis"]), list(floor["sense"])), ([2], [2], [1]))
            on_floor = list(contacts["id1"]).index(2)
            np.testing.assert_array_equal(contacts["normal"][on_floor], [0, 0, 1], "from id1 to id2")
            self.assertAlmostEqual(contacts["normal_force"][on_floor], -state.contacts["normal_impulse"][on_floor] / 1e-3, msg="it pushes")
            self.assertLess(contacts["normal_force"][on_floor], 0, "positive in traction")

    def test_files_of_yades_exporter(self):
        """As it writes them: fields of points, contacts of one kind, walls of two sides, positive forces where grains push."""
        with h5py.File(self.folder / "yade.vtkhdf", "w") as file:
            file.attrs["source_code"] = "YADE"
            points = file.create_group(POINTS)
            points["position"], points["radius"] = [[0, 0, 1.0], [0, 0, 3.0]], [1.0, 1.0]
            points["body_id"], points["material_id"], points["clump_id"] = [4, 9], [5, 5], [-1, -1]
            points["velocity"] = points["angular_velocity"] = np.ones((2, 3))
            scene = file.create_group("ONDEM/Scene")
            scene.attrs.update({"time": 1.5, "timestep": 0.5})
            material = file.create_group("ONDEM/Materials/5")
            material["id"], material["density"], material["label"] = 5, 2600.0, np.bytes_("glass")
            walls = file.create_group("ONDEM/Bodies/Walls")
            walls["body_id"], walls["material_id"], walls["axis"], walls["sense"], walls["position"] = [0], [5], [2], [0], [[7.0, 7, 0]]
            contacts = file.create_group("ONDEM/Interactions")
            contacts["id1"], contacts["id2"], contacts["normal"] = [4, 9, 4], [9, 0, 77], [[0, 0, 1.0], [0, 0, -1.0], [1.0, 0, 0]]
            contacts["normal_force"], contacts["shear_force"] = [2.0, 0, 0], [[0.5, 0, 0], [0, 0, 0], [0, 0, 0]]
            contacts["overlap"] = [0.25, 0, 0]
        found = nscdd.read_vtkhdf(self.folder / "yade.vtkhdf")
        self.assertEqual((list(found.material), found.materials, list(found.densities), found.time), ([0, 0], ["glass"], [2600.0], 1.5))
        np.testing.assert_array_equal(found.walls["wall 0"]["normal"], [0, 0, 1], "into the side of the grains")
        self.assertEqual(found.walls["wall 0"]["offset"], 0)
        np.testing.assert_array_equal(found.contacts["i"], [1, 1])
        np.testing.assert_array_equal(found.contacts["j"], [0, -1], "body 77 is none of ours")
        np.testing.assert_array_equal(found.contacts["normal"], [[0, 0, 1], [0, 0, 1]])
        np.testing.assert_array_equal(found.contacts["impulse"][0], [0.25, 0, 1])
        np.testing.assert_array_equal(found.contacts["gap"], [-0.25, 0])

    def test_the_other_place_of_bodies(self):
        """The newer of ON-DEM's layouts has the fields below /ONDEM/Bodies/Sphere, and other bodies among the points."""
        state = packing()
        nscdd.write_vtkhdf(self.folder / "a.vtkhdf", state)
        with h5py.File(self.folder / "a.vtkhdf", "r+") as file:
            del file[POINTS]
        self.equal(state, nscdd.read_vtkhdf(self.folder / "a.vtkhdf"))

    def test_csv_by_hand(self):
        path = self.write("by_hand.csv", "# from a spreadsheet\nradius, x , y,material\n0.5,1,2,glass\n\n.25,1e-3,-2,steel\n")
        found = nscdd.read_csv(path)
        np.testing.assert_array_equal(found.positions, [[1, 2], [1e-3, -2]])
        np.testing.assert_array_equal(found.radii, [0.5, 0.25])
        self.assertEqual((found.materials, list(found.material)), (["glass", "steel"], [0, 1]))
        self.assertIsNone(found.velocities)
        nscdd.write_csv(path, packing(materials=[" glass", "steel "]))
        self.assertEqual(nscdd.read_csv(path).materials, ["glass", "steel"])
        self.assertIn("# materials,glass,steel\n", path.read_text())


class Commands(ExchangeTest):
    def test_the_program_runs_what_comes_back(self):
        self.write("spec.toml", 'dimension = 2\ngrains = 60\nradius = 0.5\nspread = 0.2\nseed = 3\ngenerator = "own"\n')
        self.succeeds("pack", self.folder / "spec.toml", "-o", self.folder / "a.h5")
        scene = ROOT / "cases/reduced/network.toml"
        run = ("run", scene, "--steps", 5, "--packing")
        self.succeeds(*run, self.folder / "a.h5", "--state", self.folder / "of-a.h5")
        told = self.convert("of-a.h5", "b.vtkhdf", "--h", 0.1)
        self.assertEqual(told, "b.vtkhdf: 60 grains\n")
        self.equal_contacts(nscdd.load(self.folder / "of-a.h5"), nscdd.read_vtkhdf(self.folder / "b.vtkhdf"))
        self.assertIn("left out: contacts, walls", self.convert("b.vtkhdf", "c.csv"))
        self.convert("c.csv", "d.vtkhdf", "--gravity", 0, -10, "--grid")
        self.convert("d.vtkhdf", "e.h5")
        self.equal(
            nscdd.load(self.folder / "of-a.h5"), nscdd.read_packing(self.folder / "e.h5"), "positions", "radii", "box", "velocities", "spins", "material"
        )
        self.convert("a.h5", "a.csv")
        self.convert("a.csv", "f.h5")
        self.succeeds(*run, self.folder / "f.h5", "--state", self.folder / "of-f.h5")
        self.equal(nscdd.load(self.folder / "of-a.h5"), nscdd.load(self.folder / "of-f.h5"))

    def test_a_packing_with_all_that_one_may_have(self):
        exchange._write_h5(self.folder / "a.h5", packing(periodic="xyz", tilt=np.triu(np.full((3, 3), 0.1), 1)))
        self.convert("a.h5", "b.vtkhdf")
        self.convert("b.vtkhdf", "c.h5")
        a, c = (nscdd.read_packing(self.folder / name) for name in ("a.h5", "c.h5"))
        self.equal(a, c, "positions", "radii", "box", "velocities", "spins", "material", "fixed", "tilt")

    def test_help_has_examples(self):
        environment = os.environ | {"PYTHONPATH": str(MODULE)}
        done = subprocess.run([sys.executable, "-m", "nscdd.exchange", "--help"], capture_output=True, text=True, env=environment)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("packing.h5 packing.vtkhdf", done.stdout)

    def test_old_outputs_stay_whole(self):
        state = packing()
        nscdd.write_vtkhdf(self.folder / "a.vtkhdf", state)
        (self.folder / "old.csv").write_text("old")
        with h5py.File(self.folder / "a.vtkhdf", "r+") as file:
            file[f"{POINTS}/radius"][3] = -1
        told = self.convert("a.vtkhdf", "old.csv", code=1)
        self.assertEqual(told, f"nscdd.exchange: a.vtkhdf: dataset '{POINTS}/radius': row 3 must be > 0, found -1.0\n")
        self.assertEqual((self.folder / "old.csv").read_text(), "old")
        with self.assertRaisesRegex(RuntimeError, "half"), exchange.aside(self.folder / "old.csv") as part:
            pathlib.Path(part).write_text("new, of which half")
            raise RuntimeError("half")
        self.assertEqual(((self.folder / "old.csv").read_text(), sorted(path.name for path in self.folder.iterdir())), ("old", ["a.vtkhdf", "old.csv"]))

    def test_what_is_refused(self):
        nscdd.write_csv(self.folder / "a.csv", packing())
        nscdd.write_vtkhdf(self.folder / "a.vtkhdf", packing())
        (self.folder / "cut.vtkhdf").write_bytes((self.folder / "a.vtkhdf").read_bytes()[:5000])
        (self.folder / "cut.h5").write_bytes((self.folder / "a.vtkhdf").read_bytes()[:5000])
        self.write("text.vtkhdf", "text")
        self.succeeds("run", self.write("scene.toml", SCENE), "--state", self.folder / "state.h5")
        (self.folder / "folder.csv").mkdir()
        os.mkfifo(self.folder / "pipe.csv")
        for arguments, says in (
            (("none.vtkhdf", "b.csv"), "none.vtkhdf: there is no such file"),
            (("none.h5", "b.csv"), "none.h5: there is no such file"),
            (("none.csv", "b.h5"), "none.csv: there is no such file"),
            (("folder.csv", "b.h5"), "folder.csv: is a folder or no file"),
            (("pipe.csv", "b.h5"), "pipe.csv: is a folder or no file"),
            (("a.csv", "b.vtu"), "b.vtu: the ending must be one of .h5, .vtkhdf, .csv"),
            (("a.toml", "b.csv"), "a.toml: the ending must be one of"),
            (("cut.vtkhdf", "b.csv"), "cut.vtkhdf: cannot be read: .*truncated"),
            (("cut.h5", "b.csv"), "cut.h5: cannot be read: .*truncated"),
            (("text.vtkhdf", "b.csv"), "text.vtkhdf: cannot be read: "),
            (("a.vtkhdf", "a.vtkhdf"), "a.vtkhdf: is read, and cannot be written too"),
            (("a.vtkhdf", "none/b.csv"), "none/b.csv: cannot be written: No such file or directory"),
            (("a.vtkhdf", "folder.csv"), "folder.csv: is a folder"),
            (("state.h5", "b.vtkhdf"), "state.h5: has contacts, .*: give --h"),
            (("state.h5", "b.vtkhdf", "--h", "-1"), "h must be > 0 and finite"),
            (("a.csv", "b.h5", "--grid"), "--grid is for files .vtkhdf, not for b.h5"),
            (("a.csv", "b.vtkhdf", "--gravity", "1", "2"), r"gravity: must have shape \(3,\), found \(2,\)"),
        ):
            with self.subTest(arguments=arguments):
                self.assertRegex(self.convert(*arguments, code=1), f"^nscdd.exchange: .*{says}")
        self.assertEqual([path.name for path in self.folder.iterdir() if path.name.startswith("b.") or ".part" in path.name], [])


class Refusals(ExchangeTest):
    def test_csv(self):
        good = "x,y,z,radius\n1,2,3,0.5\n4,5,6,0.5\n"
        for bad, says in (
            (good.replace("radius", "r"), "line 1: column 'radius' is missing"),
            (good.replace("z", "height"), "line 1: column 'height' is unknown, there are x, y, radius"),
            (good.replace("z", "x"), "line 1: column 'x' is there twice"),
            ("x,y,radius,vx\n1,2,3,4\n", "line 1: column 'vy' is missing"),
            (good.replace("5,6", "5"), "line 3: has 3 values for 4 columns"),
            (good.replace("5,6", "nan,6"), "line 3: column 'y': must be finite, found nan"),
            (good.replace("5,6", "five,6"), "line 3: column 'y': 'five' is no number"),
            (good.replace("5,6", "5_0,6"), "line 3: column 'y': '5_0' is no number"),
            (good.replace("3,0.5", "3,-0.5"), "line 2: column 'radius': must be > 0, found -0.5"),
            ("# box,1,2\n" + good, "line 1: box must have 3 numbers, found 2"),
            ("# box,1,2,-3\n" + good, "line 1: box: row 2 must be > 0, found -3"),
            ("# box,1,2,3\n# periodic,w\n" + good, "line 2: periodic: must be some of 'xyz', found 'w'"),
            ("# periodic,x\n" + good, "line 1: '# periodic' needs a line '# box'"),
            ("# box,1,2,3\n# box,1,2,4\n" + good, "line 2: '# box' is there twice, first in line 1"),
            ("# materials,a,a\n" + good, "line 1: materials must be different names, found ['a', 'a']"),
            ("# materials,\n" + good, "line 1: materials must be different names, found ['']"),
            ("x,y,radius,material\n1,2,3,\n", "line 2: column 'material' is empty"),
            ("x,y,radius\n1,2,1e400\n", "line 2: column 'radius': must be finite, found 1e400"),
            ("# materials,a\nx,y,radius,material\n1,2,3,b\n", "line 3: column 'material': 'b' is not among a"),
            ("x,y,radius,material\n1,2,3,-1\n", "material: row 0 must be >= 0, found -1"),
            ("x,y,radius,fixed\n1,2,3,2\n", "fixed: row 0 must be 0 or 1, found 2"),
            ("x,y,radius,fixed\n1,2,3,0.5\n", "line 2: column 'fixed': '0.5' is no whole number"),
            *((f"x,y,radius,material\n1,2,3,{big}\n", "line 2: column 'material': must be a whole number of 32 bits") for big in (2**32, 10**22)),
            *(
                (f"{remark}\n{good}", f"line 1: remark '{remark.split(',')[0]}' is nearly '# ")
                for remark in ("# box 1 1 1", "# box: 1,1,1", "# Box,1,1,1", "# period,x")
            ),
            ("", "needs a line with the names of columns"),
            ("x,y,radius\n", "and grains below it"),
            ("\0\1", "bad.csv"),
        ):
            with self.subTest(says=says), self.assertRaises(ValueError) as raised:
                nscdd.read_csv(self.write("bad.csv", bad))
            self.assertIn(says, str(raised.exception))
            self.assertTrue(str(raised.exception).startswith(str(self.folder / "bad.csv")), raised.exception)

    def test_vtkhdf(self):
        state = packing(periodic="xyz")

        def replaced(dataset, values):
            def change(file):
                del file[dataset]
                if values is not None:
                    file[dataset] = values

            return change

        n = len(state.radii)
        box = "ONDEM/ImposedConditions/periodic_box/shape"
        for change, says in (
            (replaced(f"{POINTS}/velocity", np.full((n, 3), np.nan)), f"dataset '{POINTS}/velocity': row 0 must be finite, found nan"),
            (replaced(f"{POINTS}/velocity", np.zeros((n, 2))), f"dataset '{POINTS}/velocity' must have shape (12, 3), found (12, 2)"),
            (replaced(f"{POINTS}/radius", [1j] * n), f"dataset '{POINTS}/radius' must be real numbers, found complex ones"),
            (replaced(f"{POINTS}/radius", [b"a"] * n), f"dataset '{POINTS}/radius': must be numbers"),
            (replaced(f"{POINTS}/clump_id", [-1] * (n - 1) + [2]), f"dataset '{POINTS}/clump_id': row 11 is a part of a clump"),
            (replaced(f"{POINTS}/body_id", [1] * n), f"dataset '{POINTS}/body_id': two bodies have the same number"),
            (replaced(f"{POINTS}/material_id", [0, 7] + [0] * (n - 2)), f"dataset '{POINTS}/material_id': row 1 is 7"),
            (replaced(f"{POINTS}/position", None), None),  # those of VTKHDF/Points
            (replaced(box, np.ones(9)), f"dataset '{box}' must be upper triangular"),
            (replaced(box, np.eye(3).ravel() * [1, 1, 1, 1, 1, 1, 1, 1, -1]), f"dataset '{box}': row 2 must be > 0"),
            (replaced("VTKHDF", None), None),
            (replaced("ONDEM/Scene", [1]), None),
        ):
            with self.subTest(says=says):
                nscdd.write_vtkhdf(self.folder / "a.vtkhdf", state)
                with h5py.File(self.folder / "a.vtkhdf", "r+") as file:
                    change(file)
                if says is None:
                    nscdd.read_vtkhdf(self.folder / "a.vtkhdf")
                    continue
                with self.assertRaises(ValueError) as raised:
                    nscdd.read_vtkhdf(self.folder / "a.vtkhdf")
                self.assertTrue(str(raised.exception).startswith(f"{self.folder / 'a.vtkhdf'}: {says}"), raised.exception)
        with self.assertRaisesRegex(ValueError, "radius' is missing"), h5py.File(self.folder / "empty.vtkhdf", "w"):
            pass
            nscdd.read_vtkhdf(self.folder / "empty.vtkhdf")

    def test_a_file_cut_anywhere(self):
        nscdd.write_vtkhdf(self.folder / "a.vtkhdf", packing(periodic="xyz"))
        whole = (self.folder / "a.vtkhdf").read_bytes()
        for length in np.linspace(0, len(whole) - 1, 60).astype(int):
            path = self.folder / "b.vtkhdf"
            path.write_bytes(whole[:length])
            with self.assertRaises(ValueError) as raised:
                nscdd.read_vtkhdf(path)
            self.assertRegex(str(raised.exception), f"^{path}: cannot be read: .*$")

    def test_what_is_given(self):
        for wrong, says in (
            (dict(radii=-packing().radii), "radii: row 0 must be > 0"),
            (dict(positions=np.zeros((12, 4))), "positions: must have shape"),
            (dict(positions=np.zeros((0, 3)), radii=[]), "n > 0"),
            (dict(velocities=np.full((12, 3), np.inf)), "velocities: row 0 must be finite"),
            (dict(spins=np.zeros(12)), "spins: must have shape"),
            (dict(material=np.full(12, 2)), "material: row 0 is 2, of 2 materials"),
            (dict(material=np.full(12, 0.5)), "material: row 0 must be a whole number of 32 bits, found 0.5"),
            (dict(material=np.full(12, 2**32)), "material: row 0 must be a whole number of 32 bits, found 4294967296"),
            (dict(tilt=np.full((3, 3), 0.1), periodic="xyz"), "tilt: must be 0 but above the diagonal"),
            (dict(contacts=[3]), "contacts: must be an array with the fields i, j"),
            (dict(walls=3), "walls: must be a dictionary, found 3"),
            (dict(materials=[3]), "materials: each must be a name, found 3"),
            (dict(periodic="xw"), "periodic: must be some of 'xyz', found 'xw'"),
            (dict(densities=[1.0]), "densities: 1 for 2 materials"),
            (dict(time=np.nan), "time must be finite, found nan"),
        ):
            for write in (nscdd.write_vtkhdf, nscdd.write_csv):
                with self.subTest(says=says), self.assertRaises(ValueError) as raised:
                    write(self.folder / "out", packing(**wrong))
                self.assertTrue(str(raised.exception).startswith(f"{write.__name__}: "), raised.exception)
                self.assertIn(says, str(raised.exception))
                with self.assertRaisesRegex(ValueError, f"{write.__name__}: grains must be a Packing or a State, found a int"):
                    write(self.folder / "out", 3)
        for h in ("a", None):
            with self.assertRaisesRegex(ValueError, "h must be a number, found"):
                nscdd.write_vtkhdf(self.folder / "out", packing(), h=h)
        with self.assertRaisesRegex(ValueError, "write_csv: materials must be different names, found"):
            nscdd.write_csv(self.folder / "out", packing(materials=["glass", " glass"]))
        self.assertEqual(list(self.folder.iterdir()), [])


class Vtk(ExchangeTest):
    def test_vtk_reads_all_arrays(self):
        state = packing()
        for grid in (True, False):
            path = self.folder / f"{grid}.vtkhdf"
            nscdd.write_vtkhdf(path, state, grid=grid)
            found = pictures(path, self.folder / "found.npz") if grid else self.poly_data(path)
            if found is None:
                self.skipTest("no VTK is there that reads VTKHDF")
            found = {name.split("/", 1)[1]: values for name, values in found.items()}
            np.testing.assert_array_equal(found["points"], state.positions)
            np.testing.assert_array_equal(found["cells"], np.arange(len(state.radii)))
            with h5py.File(path) as file:
                self.assertEqual({name for name in found if name.startswith("point/")}, {f"point/{name}" for name in file[POINTS]})
                for name, values in file[POINTS].items():
                    self.assertEqual(found[f"point/{name}"].tobytes(), values[()].tobytes(), name)

    def poly_data(self, path):
        """VTK 9.1 takes it for a grid, 9.2 for nothing, later ones for poly data."""
        try:
            from vtkmodules.vtkCommonCore import vtkVersion
        except ImportError:
            return None
        if vtkVersion.GetVTKVersion().startswith("9.2."):
            self.skipTest("VTK 9.2 reads no poly data from VTKHDF")
        out = self.folder / "poly.npz"
        done = subprocess.run([sys.executable, READ_VTK, path, out], capture_output=True, text=True, timeout=300)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("rror", done.stderr)
        with np.load(out) as file:
            return {name: file[name] for name in file}


@unittest.skipUnless(shutil.which("yade"), "YADE is not there: scripts/setup --yade installs it")
class Yade(ExchangeTest):
    def in_yade(self, *arguments):
        environment = os.environ | {"PYTHONPATH": f"{MODULE}:{ROOT / 'kernel/python/examples'}"}
        command = ["yade", "-x", "-n", "-j1", YADE_BITS, *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300, cwd=self.folder)
        self.assertNotIn("Traceback", done.stdout + done.stderr)
        with np.load(arguments[2]) as file:
            return {name: file[name] for name in file}

    def test_a_packing_of_yade_goes_in_and_back(self):
        for kind in ("open", "periodic"):
            with self.subTest(kind=kind):
                there = self.in_yade("make", self.folder / "a.vtkhdf", self.folder / "a.npz", kind)
                state = nscdd.read_vtkhdf(self.folder / "a.vtkhdf")
                for field in ("positions", "radii", "velocities", "spins"):
                    self.assertTrue(same(getattr(state, field), there[field]), field)
                self.assertTrue(same(state.densities[state.material], there["densities"]))
                self.assertEqual(np.count_nonzero(there["velocities"] == np.round(there["velocities"], 6)), 0, "no number is round")
                for by in ("h5", "csv"):
                    self.convert("a.vtkhdf", f"b.{by}")
                    self.convert(f"b.{by}", "c.vtkhdf")
                    back = self.in_yade("back", self.folder / "c.vtkhdf", self.folder / "c.npz")
                    for field in set(there) - ({"densities"} if by == "h5" else set()):  # a packing has none
                        self.assertTrue(same(back[field], there[field]), f"{field} by .{by}")


if __name__ == "__main__":
    unittest.main()
