"""Contact problems go to other codes and come back: FCLIB files written, read, solved, and judged by others.

The judges are not part of the repository: NSCDD_SHARED names the folder that has them, ../shared by default. Where it,
Siconos or libfclib is missing, the tests that need it are skipped and say so.
"""
import ctypes
import importlib.util
import json
import math
import os
import pathlib
import subprocess
import sys
import unittest

import h5py
import jsonschema
import numpy as np

from fclib_files import dense, law_errors, write_global, write_local
from harness import SCENE, ProgramTest
from nscdd_suite import program

ROOT = pathlib.Path(__file__).resolve().parents[2]
SHARED = pathlib.Path(os.environ.get("NSCDD_SHARED", ROOT / ".." / "shared"))
JUDGE, PUBLISHED = SHARED / "judge", SHARED / "fclib"

# A heap that slides into a corner, under a plate that presses from the right.
HEAP = """name = "heap"
dimension = {dim}
gravity = {gravity}

[packing]
file = "packing.h5"
material = "glass"

[[material]]
name = "glass"
density = 1.0

[[pair]]
materials = ["glass", "glass"]
friction = {mu}
{walls}
[step]
h = 0.02
count = 1
"""
WALL = """
[[wall]]
name = "{side}"
side = "{side}"
material = "glass"
motion = {motion}
"""

# Sweeps of plain NLGS from zero in the file's order until the natural map is 1e-4, 1e-6 and 1e-8.
SWEEPS = {
    "LMGC_100_PR_PerioBox-i00361-60-03000": (1, 3, 34),
    "Confeti-ex13-Fc3D-SBM": (1, 5, 22),
    "Capsules-i97-269": (8, 89, 2423),
    "KaplasTower-i1061-4": (203, 609, 1033),
    "G_Spheres-i099-356-679": (93, 161, 229),
}

# Our names for what check_fclib.py measures.
MEASURES = {
    "natmap_siconos44": "natural_map",
    "natmap_rho_velocity_rel": "natural_map_velocity",
    "natmap_rho_impulse_rel": "natural_map_impulse",
    "cone_rn_min": "least_normal_impulse",
    "cone_excess_max": "cone_excess",
    "signorini_un_min": "least_normal_velocity",
    "compl_un_rn_max": "complementarity",
    "max_dissipation_gap_max": "dissipation",
}


def judge(name, *arguments):
    done = subprocess.run([sys.executable, JUDGE / name, *map(str, arguments)], capture_output=True, text=True, timeout=300)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return json.loads(done.stdout)


def needs_judge(test):
    there = (JUDGE / "check_fclib.py").exists() and PUBLISHED.is_dir()
    test = unittest.skipUnless(importlib.util.find_spec("scipy"), "scipy, which the judge uses, is not installed")(test)
    return unittest.skipUnless(there, f"no judge in {SHARED}")(test)


def needs_siconos(test):
    return unittest.skipUnless(importlib.util.find_spec("siconos"), "Siconos is not installed (scripts/setup --siconos)")(test)


def load_libfclib():
    try:
        library = ctypes.CDLL("libfclib.so.0")
    except OSError:
        return None
    library.fclib_read_local.restype = library.fclib_read_solution.restype = ctypes.c_void_p
    library.fclib_merit_local.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p]
    library.fclib_merit_local.restype = ctypes.c_double
    return library


class FclibTest(ProgramTest):
    def export(self, dim, *options, mu=0.3, motion='"force"\nforce = 50.0'):
        random = np.random.default_rng(dim)
        side = 8 if dim == 2 else 4
        cells = np.stack(np.meshgrid(*dim * [np.arange(side)]), -1).reshape(-1, dim)
        with h5py.File(self.folder / "packing.h5", "w") as file:
            file["x"] = 1.02 * (cells + 0.5) + random.uniform(-0.005, 0.005, cells.shape)
            file["radius"] = random.uniform(0.45, 0.5, len(cells))
            file["box"] = np.full(dim, 1.02 * side)
        names = "xyz"[:dim]
        walls = "".join(WALL.format(side=axis + "-", motion='"fixed"') for axis in names)
        walls += WALL.format(side="x+", motion=motion)
        scene = self.write("heap.toml", HEAP.format(dim=dim, gravity=[2] * (dim - 1) + [-10], mu=mu, walls=walls))
        out = self.folder / f"heap{dim}.hdf5"
        self.succeeds("export-fclib", scene, "--step", 15, *options, "-o", out)
        return out

    def solve(self, path, *options, code=0):
        """JSON, and the arrays of /solution."""
        out, report = self.folder / "out.hdf5", self.folder / "out.json"
        done = self.run_program("solve-fclib", path, *options, "-o", out, "--json", report)
        self.assertEqual(done.returncode, code, done.stderr)
        with h5py.File(out) as file:
            return json.loads(report.read_text()), {key: data[...] for key, data in file["solution"].items()}

    def validate(self, report):
        jsonschema.validate(report, json.loads((ROOT / "reports/fclib.schema.json").read_text()))


class Files(FclibTest):
    def random_problem(self, dim, contacts=13):
        """M, H, f, w, mu of bodies that contacts couple in pairs: M block diagonal, H not square, blocks of W full."""
        random = np.random.default_rng(7 + dim)
        bodies, dof = 8, 3 * (dim - 1)
        m = np.zeros((bodies * dof, bodies * dof))
        h = np.zeros((bodies * dof, contacts * dim))
        for body in range(bodies):
            a = random.normal(size=(dof, dof))
            m[body * dof : (body + 1) * dof, body * dof : (body + 1) * dof] = a @ a.T + np.eye(dof)
        for contact in range(contacts):
            for body in random.choice(bodies, 2, replace=False):
                h[body * dof : (body + 1) * dof, contact * dim : (contact + 1) * dim] = random.normal(size=(dof, dim))
        w = random.normal(size=contacts * dim)
        w[::dim] -= 4  # towards each other, so that most contacts act
        return m, h, random.normal(size=len(m)), w, random.uniform(0, 0.8, contacts)

    def condensed(self, m, h, f, w, mu):
        return h.T @ np.linalg.solve(m, h), w + h.T @ np.linalg.solve(m, f), mu

    def test_export_has_the_layout_and_a_solution(self):
        for dim in (2, 3):
            with self.subTest(dim=dim), h5py.File(self.export(dim, "--tolerance", "1e-9")) as file:
                local = file["fclib_local"]
                for name in ("spacedim", "W/m", "W/n", "W/nz", "W/nzmax"):
                    self.assertEqual((local[name].dtype, local[name].shape), (np.int32, (1,)), name)
                for name in ("W/p", "W/i"):
                    self.assertEqual(local[name].dtype, np.int32, name)
                for name in ("W/x", "vectors/q", "vectors/mu"):
                    self.assertEqual(local[name].dtype, np.float64, name)
                self.assertEqual((local["spacedim"][0], local["W/nz"][0]), (dim, -1))
                self.assertEqual(local["W/nzmax"][0], len(local["W/x"]))
                for name in ("title", "description", "math_info"):
                    self.assertEqual(local[f"info/{name}"].shape, ())
                    self.assertFalse(h5py.check_string_dtype(local[f"info/{name}"].dtype).length is None)

                w, q, mu = dense(local["W"]), local["vectors/q"][...], local["vectors/mu"][...]
                self.assertGreater(len(mu), 60)
                self.assertTrue((mu == 0.3).all())
                self.assertLess(np.abs(w - w.T).max(), 1e-14 * np.abs(w).max())
                self.assertGreater(np.linalg.eigvalsh(w)[0], -1e-13 * np.abs(w).max())
                r, u = file["solution/r"][...], file["solution/u"][...]
                self.assertLess(np.abs(w @ r + q - u).max(), 1e-12)
                self.assertLess(law_errors(w, q, mu, r).max(), 1e-7)
                self.assertGreater(law_errors(w, q, mu, 0 * r).max(), 1e-2)
                errors = local["info"].attrs
                self.assertLess(errors["solution_eta"], 1e-9)
                self.assertTrue(0 < errors["solution_natural_map"] < 1e-7)

    def test_an_export_is_solved_again(self):
        for dim in (2, 3):
            path = self.export(dim, "--tolerance", "1e-9")
            report, solution = self.solve(path, "--tolerance", "1e-9")
            self.validate(report)
            with self.subTest(dim=dim), h5py.File(path) as file, h5py.File(self.folder / "out.hdf5") as out:
                u = file["solution/u"][...]
                self.assertLess(np.linalg.norm(solution["u"] - u), 1e-4 * np.linalg.norm(u))
                np.testing.assert_array_equal(out["fclib_local/W/x"][...], file["fclib_local/W/x"][...])
                self.assertEqual(out["fclib_local/info/title"][()], file["fclib_local/info/title"][()])
                self.assertEqual(out["fclib_local/info"].attrs["solution_natural_map"], report["measures"]["natural_map"])

    def test_projected_gradients_solve_an_export_to_the_same_velocities(self):
        for dim in (2, 3):
            path = self.export(dim, "--tolerance", "1e-9")
            with h5py.File(path) as file:
                u = file["solution/u"][...]
            for solver, tolerance in (("spg", 1e-9), ("apgd", 1e-5)):
                report, solution = self.solve(path, "--solver", solver, "--tolerance", tolerance)
                jsonschema.validate(report, json.loads((ROOT / "reports/fclib.schema.json").read_text()))
                with self.subTest(dim=dim, solver=solver):
                    self.assertLess(np.linalg.norm(solution["u"] - u), 1e5 * tolerance * np.linalg.norm(u))

    def test_a_file_s_own_solution_is_judged(self):
        path = self.export(3, "--tolerance", "1e-9")
        with h5py.File(path) as file:
            own = file["fclib_local/info"].attrs["solution_natural_map"]
        report, _ = self.solve(path, "--solver", "none", "--tolerance", 2 * own)
        self.assertEqual((report["iterations"], report["measures"]["natural_map"]), (0, own))
        with h5py.File(path, "r+") as file:
            file["solution/r"][4] += 1
        report, _ = self.solve(path, "--solver", "none", "--tolerance", 2 * own, code=3)
        self.assertGreater(report["measures"]["natural_map"], 1e-3)
        with h5py.File(path, "r+") as file:
            del file["solution/r"]
        done = self.run_program("solve-fclib", path, "--solver", "none")
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (1, 1))
        self.assertIn("solution/r", done.stderr)

    def test_a_frictionless_scene_has_all_components_without_friction(self):
        with h5py.File(self.export(3, mu=0.0)) as file:
            self.assertEqual(np.abs(file["fclib_local/vectors/mu"][...]).max(), 0)
            r = file["solution/r"][...].reshape(-1, 3)
            self.assertEqual(np.abs(r[:, 1:]).max(), 0)
            self.assertGreater(r[:, 0].max(), 0)

    def test_every_kind_of_matrix_is_the_same_problem(self):
        for dim in (2, 3):
            problem = self.random_problem(dim)
            m, h, f, _, mu = problem
            w, q, mu = self.condensed(*problem)
            found = {}
            for kind in ("columns", "rows", "triplets", "header"):
                if kind != "header":  # of a square matrix i = row is always meant; this W is symmetric anyway
                    _, local = self.solve(write_local(self.folder / "local.hdf5", w, q, mu, kind), "--tolerance", "1e-12")
                    found["local", kind] = local["r"]
                report, both = self.solve(write_global(self.folder / "global.hdf5", *problem, kind), "--tolerance", "1e-12")
                self.assertEqual(report["form"], "global")
                self.assertLess(np.abs(m @ both["v"] - h @ both["r"] - f).max(), 1e-10)
                found["global", kind] = both["r"]
            for name, r in found.items():
                with self.subTest(dim=dim, name=name):
                    self.assertLess(law_errors(w, q, mu, r).max(), 1e-9)
                    self.assertGreater((r[::dim] > 0).sum(), 6)
                    np.testing.assert_allclose(r, found["local", "columns"], rtol=0, atol=1e-8 * np.abs(r).max())

    def test_a_problem_that_is_not_symmetric_keeps_its_rows(self):
        w, q, mu = self.condensed(*self.random_problem(3))
        w[0, 5] += 0.1 * w[0, 0]
        for kind in ("columns", "rows", "triplets"):
            _, solution = self.solve(write_local(self.folder / "local.hdf5", w, q, mu, kind))
            self.assertLess(np.abs(w @ solution["r"] + q - solution["u"]).max(), 1e-12 * np.abs(q).max())

    def test_bad_files_are_refused_in_one_line(self):
        problem = self.random_problem(3)
        w, q, mu = self.condensed(*problem)

        def refused(fragments, change, form="local"):
            path = self.folder / "bad.hdf5"
            write_local(path, w, q, mu) if form == "local" else write_global(path, *problem)
            with h5py.File(path, "r+") as file:
                change(file, file[f"fclib_{form}"])
            done = self.run_program("solve-fclib", path, "-o", self.folder / "none.hdf5")
            with self.subTest(fragments=fragments):
                self.assertEqual(done.returncode, 1, done.stdout)
                self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
                for fragment in ("bad.hdf5", *fragments):
                    self.assertIn(fragment, done.stderr)
                self.assertFalse((self.folder / "none.hdf5").exists())

        def put(name, value):
            def change(_, group):
                del group[name]
                group[name] = value

            return change

        def spoil(name, index, value):
            def change(_, group):
                group[name][index] = value

            return change

        refused(["neither"], lambda file, _: file.move("fclib_local", "something"))
        refused(["fclib_local/vectors/q", "missing"], lambda _, group: group.pop("vectors/q"))
        refused(["fclib_local/vectors/q", "shape"], put("vectors/q", np.ones(5)))
        refused(["fclib_local/vectors/q", "finite"], spoil("vectors/q", 3, np.nan))
        refused(["fclib_local/vectors/mu", "negative"], spoil("vectors/mu", 0, -0.1))
        refused(["fclib_local/vectors/mu_r", "fclib_local_rolling"], lambda _, group: group.create_dataset("vectors/mu_r", data=np.ones(1)))
        refused(["fclib_local/vectors/mu", "no contacts"], put("vectors/mu", np.zeros(0)))
        refused(["fclib_local/spacedim", "4"], spoil("spacedim", 0, 4))
        refused(["fclib_local/W/nz", "-3"], spoil("W/nz", 0, -3))
        refused(["fclib_local/W/p", "rise"], spoil("W/p", 1, -1))
        refused(["fclib_local/W/i", "outside"], spoil("W/i", 0, 10**6))
        refused(["fclib_local/W/x", "entries"], put("W/x", np.ones(4)))
        refused(["fclib_local/W/x", "finite"], spoil("W/x", 4, np.inf))
        refused(["fclib_local/V", "bilateral"], lambda _, group: group.create_group("V"))
        os.mkfifo(self.folder / "fifo")
        for link in (h5py.ExternalLink("fifo", "/x"), h5py.SoftLink("/fclib_local/W/x")):
            refused(["fclib_local/vectors/q", "link"], put("vectors/q", link))
            refused(["fclib_local/V", "link"], lambda _, group: group.__setitem__("V", link))
            refused(["fclib_local", "of another file"], lambda _, group: group.__setitem__("info/more", link))
        refused(["contact 0", "W_NN"], spoil("W/x", 0, 0.0))
        refused(["fclib_global/H", "must be"], spoil("H/m", 0, 1000), "global")
        refused(["M is singular"], spoil("M/x", slice(None), 0.0), "global")
        self.write("bad.hdf5", "no HDF5")
        done = self.run_program("solve-fclib", self.folder / "bad.hdf5")
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (1, 1))

    def test_the_cap_is_reported_and_the_answer_written(self):
        path = write_local(self.folder / "local.hdf5", *self.condensed(*self.random_problem(3)))
        for options in (("--check-every", 1), (), ("--solver", "spg")):  # fewer than there are between two tests as well
            report, _ = self.solve(path, "--tolerance", "1e-14", "--max-sweeps", 2, *options, code=3)
            self.assertEqual((report["iterations"], report["converged"]), (2, False))
            self.assertGreater(report["measures"]["natural_map"], 1e-14)

    def test_newton_takes_no_options_of_sweeps(self):
        path = write_local(self.folder / "local.hdf5", *self.condensed(*self.random_problem(3)))
        for option in ("--max-sweeps", "--check-every"):
            done = self.run_program("solve-fclib", path, "--solver", "newton", option, 5)
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn(option, done.stderr)
        report, _ = self.solve(path, "--solver", "newton")
        self.assertNotIn("check_every", report)
        self.validate(report)

    def test_a_problem_that_zero_impulses_solve(self):
        w, q, mu = self.condensed(*self.random_problem(3))
        path = write_local(self.folder / "open.hdf5", w, np.abs(q), mu)
        for solver in ("nlgs", "newton"):
            report, solution = self.solve(path, "--solver", solver)
            self.validate(report)
            self.assertTrue(report["converged"])
            self.assertEqual(np.abs(solution["r"]).max(), 0)

    def test_a_step_without_contacts_is_refused(self):
        scene = self.write("scene.toml", SCENE.replace("[0, 0, 0.5]", "[0, 0, 5]").replace("[0.3, 0.1, 1.5]", "[0, 0, 9]"))
        done = self.run_program("export-fclib", scene, "-o", self.folder / "none.hdf5")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no contacts", done.stderr)

    def test_auto_goes_on_by_newtons_method(self):
        path = self.folder / "column.hdf5"
        self.succeeds("export-fclib", ROOT / "cases/hard/column-1000-2d.toml", "--step", 1, "-o", path)
        self.solve(path, "--solver", "nlgs", "--tolerance", "1e-12", "--max-sweeps", 10000, code=3)
        report, _ = self.solve(path, "--tolerance", "1e-12")
        self.assertEqual(report["solver"], "auto")
        self.assertLess(report["iterations"], 2000)
        self.validate(report)
        few, _ = self.solve(path, "--tolerance", "1e-12", "--max-sweeps", 50, code=3)  # a cap of sweeps is kept
        self.assertEqual(few["iterations"], 50)
        beyond, _ = self.solve(path, "--tolerance", "1e-18", "--max-sweeps", 1100, code=3)  # Newton's steps end it
        self.assertGreater(beyond["iterations"], 1100)

    def test_what_has_no_answer_is_not_solved(self):
        """Two contacts on one body close from both sides: impulses grow without end, and beside them any velocity is round-off."""
        path = write_local(self.folder / "squeezed.hdf5", np.kron([[1, -1], [-1, 1]], np.eye(3)), [-1, 0, 0, -1, 0, 0], [0, 0])
        for solver in ("auto", "newton", "nlgs"):
            report, _ = self.solve(path, "--solver", solver, code=3)
            self.assertGreater(report["measures"]["unilateral"], 0.1)

    def test_large_friction_hides_no_penetration(self):
        """Of impulses zero the natural map is 1/mu."""
        path = write_local(self.folder / "rough.hdf5", np.eye(3), [-1, 1, 0], [1e10])
        for solver in ("auto", "newton"):
            report, _ = self.solve(path, "--solver", solver)
            np.testing.assert_allclose(report["measures"]["unilateral"], 0, atol=1e-8)

    def test_auto_solves_what_newton_solves(self):
        """Twelve bodies whose masses span up to eight decades: from swept impulses Newton's method fails on some."""
        for seed in range(8):
            random = np.random.default_rng(300 + seed)
            masses, random = 10.0 ** random.uniform(-4, 4, 12), np.random.default_rng(50 + seed)
            h = np.zeros((180, 36))
            for contact in range(60):
                i, j = (slice(3 * body, 3 * body + 3) for body in random.choice(12, 2, replace=False))
                axes, rows = np.linalg.qr(random.normal(size=(3, 3)))[0], slice(3 * contact, 3 * contact + 3)
                h[rows, i], h[rows, j] = axes, -axes
            q, mu = h @ random.normal(size=36), random.uniform(0, 1, 60)
            path = write_local(self.folder / "masses.hdf5", h @ np.diag(np.repeat(1 / masses, 3)) @ h.T, q, mu)
            with self.subTest(seed=seed):
                self.assertLess(self.solve(path)[0]["iterations"], 20000)

    @unittest.skipUnless(load_libfclib(), "libfclib is not installed (scripts/setup --siconos)")
    def test_libfclib_reads_an_export_and_finds_our_error(self):
        path = str(self.export(3, "--tolerance", "1e-6"))
        library = load_libfclib()
        problem, solution = library.fclib_read_local(path.encode()), library.fclib_read_solution(path.encode())
        self.assertTrue(problem and solution)
        with h5py.File(path) as file:
            norms = {name: np.linalg.norm(file[name][...]) for name in ("fclib_local/vectors/q", "solution/r", "solution/u")}
            natural_map = file["fclib_local/info"].attrs["solution_natural_map"] * max(norms.values())
        merit = library.fclib_merit_local(problem, 0, solution) * (1 + np.sqrt(norms["fclib_local/vectors/q"]))
        self.assertLess(abs(merit / natural_map - 1), 1e-6)


@needs_judge
class Judged(FclibTest):
    def agrees(self, path, *options):
        report = self.folder / "out.json"
        self.run_program("solve-fclib", path, *options, "-o", self.folder / "out.hdf5", "--json", report)
        ours = json.loads(report.read_text())["measures"]
        theirs = judge("check_fclib.py", path, self.folder / "out.hdf5")
        compared = {name: (theirs[name], ours[own]) for name, own in MEASURES.items() if name in theirs}
        self.assertGreaterEqual(len(compared), 6)
        for name, (value, own) in compared.items():
            with self.subTest(file=path.name, measure=name):
                self.assertLess(abs(own - value), 1e-10)
        self.assertLess(theirs["u_equation_rel"], 1e-12)

    def test_measures_of_published_problems(self):
        for path in sorted(PUBLISHED.glob("*.hdf5")):
            self.agrees(path, "--max-sweeps", 50)  # far from solved: the measures are far from zero

    def test_published_problems_are_solved(self):
        for path in sorted(PUBLISHED.glob("*.hdf5")):
            with self.subTest(file=path.name):
                self.assertLess(self.solve(path, "--tolerance", "1e-10")[0]["measures"]["natural_map"], 1e-10)

    def test_measures_of_exports(self):
        for dim, mu in ((2, 0.3), (3, 0.3), (3, 0.0)):
            path = self.export(dim, "--tolerance", "1e-4", mu=mu)
            with h5py.File(path) as file:
                own = file["fclib_local/info"].attrs["solution_natural_map"]
            self.assertLess(abs(judge("check_fclib.py", path)["natmap_siconos44"] - own), 1e-10)
            self.agrees(path, "--max-sweeps", 20)

    def test_sweeps_on_published_problems(self):
        """The natural map is small enough, for the first time, after as many sweeps as listed, within 15 %."""

        def natural_map(name, sweeps):
            report = self.folder / "out.json"
            self.run_program("solve-fclib", PUBLISHED / f"{name}.hdf5", "--solver", "nlgs", "--tolerance", 1e-12, "--max-sweeps", sweeps, "--json", report)
            return json.loads(report.read_text())["measures"]["natural_map"]

        for name, listed in SWEEPS.items():
            for tolerance, expected in zip((1e-4, 1e-6, 1e-8), listed):
                with self.subTest(file=name, tolerance=tolerance):
                    self.assertLessEqual(natural_map(name, math.floor(1.15 * expected)), tolerance)
                    if expected > 1:
                        self.assertGreater(natural_map(name, math.ceil(0.85 * expected) - 1), tolerance)

    def test_newton_solves_every_published_problem(self):
        files = sorted(PUBLISHED.glob("*.hdf5"))
        self.assertGreaterEqual(len(files), 9)
        for path in files:
            report, _ = self.solve(path, "--solver", "newton", "--tolerance", "1e-9")
            error = judge("check_fclib.py", path, self.folder / "out.hdf5")["natmap_siconos44"]
            print(f"{path.name}: {report['iterations']} Newton steps, natural map {error:.1e}")
            with self.subTest(file=path.name):
                self.assertLessEqual(error, 1.001e-9)

    def test_problems_of_siconos_are_solved(self):
        for name in SWEEPS:
            path = PUBLISHED / f"{name}.hdf5"
            self.solve(path, "--tolerance", "1e-8")
            with self.subTest(file=name):
                self.assertLessEqual(judge("check_fclib.py", path, self.folder / "out.hdf5")["natmap_siconos44"], 1.001e-8)


@needs_siconos
@needs_judge
class Siconos(FclibTest):
    def test_siconos_solves_an_export_to_the_same_velocities(self):
        for dim in (2, 3):
            path, theirs = self.export(dim, "--tolerance", "1e-9"), self.folder / "siconos.hdf5"
            report = judge("solve_fclib.py", path, "--tol", "1e-9", "--save", theirs)
            self.assertTrue(report["converged"], report)
            with h5py.File(path) as a, h5py.File(theirs) as b:
                ours, others = a["solution/u"][...], b["solution/u"][...]
            difference = np.linalg.norm(ours - others) / np.linalg.norm(ours)
            print(f"{dim}D: Siconos {report['iterations']} sweeps, velocities differ by {difference:.2g}")
            with self.subTest(dim=dim):
                self.assertLess(difference, 1e-4)
                self.assertLessEqual(judge("check_fclib.py", path, theirs)["natmap_siconos44"], 1.001e-9)


@unittest.skipUnless(importlib.util.find_spec("pinocchio"), "Pinocchio is not installed")
class Pinocchio(FclibTest):
    def test_pinocchio_solves_an_export_to_the_same_velocities(self):
        path, theirs = self.export(3, "--tolerance", "1e-9"), self.folder / "pinocchio.hdf5"
        told = program.call(program.python("pinocchio_solve", path, "--tolerance", "1e-12", "--max-iterations", 50000, "-o", theirs)).stdout
        with h5py.File(path) as a, h5py.File(theirs) as b:
            ours, others = a["solution/u"][...], b["solution/u"][...]
        difference = np.linalg.norm(ours - others) / np.linalg.norm(ours)
        print(f"Pinocchio {json.loads(told)['iterations']} iterations, velocities differ by {difference:.2g}")
        self.assertLess(difference, 1e-4)


if __name__ == "__main__":
    unittest.main()
