"""Contact problems with rolling resistance: exported, solved, and beside the answers of Siconos' own solvers.

Siconos' test problems are not part of the repository: NSCDD_SHARED names the folder whose `rolling` has them, ../shared by
default. Where it or Siconos is missing, the tests that need it are skipped and say so.
"""
import importlib.util
import os
import pathlib
import unittest

import h5py
import numpy as np

from fclib_files import dense, rolling_natural_map, rolling_statuses, write_global, write_local
from harness import ROOT, SCENE, ProgramTest, errors_of
from test_fclib import FclibTest, needs_siconos

SHARED = pathlib.Path(os.environ.get("NSCDD_SHARED", ROOT / ".." / "shared")) / "rolling"

# Grains of several sizes on a shaken lattice, in a box.
HEAP = """name = "{name}"
dimension = {dim}
gravity = {gravity}
law = "rolling"
material = [{{ name = "glass", density = 1.0 }}]
pair = [{{ materials = ["glass", "glass"], friction = {friction}, rolling = {rolling}, restitution = {restitution} }}]
packing = {{ file = "{packing}", material = "glass" }}
step = {{ h = {h}, count = 1 }}
{walls}{cell}
"""
WALL = '[[wall]]\nname = "{side}"\nside = "{side}"\nmaterial = "glass"\n{motion}\n'

FIXED = 'motion = "fixed"'
# What happens: gravity along the last axis and the others, walls besides the floor, friction, rolling, restitution, cell.
SCENES = {
    "slope": dict(along=5, sides={}, friction=0.2, rolling=0.2, steps=(8, 11)),
    "pile": dict(along=0, sides={}, friction=0.5, rolling=0.05, steps=(6, 9)),
    "corner": dict(along=2, sides={"x-": FIXED}, friction=0.1, rolling=0.05),
    "press": dict(along=0, sides={"x-": FIXED, "x+": 'motion = "force"\nforce = 5.0'}, friction=0.3, rolling=0.05),
    "shear": dict(along=0, sides={"top": 'motion = "force"\nforce = 20.0\nvelocity = {shear}'}, friction=0.2, rolling=0.1),
    "deck": dict(along=1, sides={"x-": FIXED, "x+": 'motion = "velocity"\nvelocity = {push}'}, friction=0.2, rolling=0.2, steps=(5, 9)),
    "bounce": dict(along=0, sides={}, friction=0.4, rolling=0.03, restitution=0.4, h=0.005, steps=(40, 60)),
    "cell": dict(along=1, sides={}, friction=0.6, rolling=0.01, cell='[cell]\nperiodic = ["x"]\n'),
}
STEPS = (8, 15)


def problems():
    """Name, dimension and step."""
    return [(name, dim, step) for name, what in SCENES.items() for dim in (2, 3) for step in what.get("steps", STEPS)]


class RollingTest(FclibTest):
    def scene(self, name, dim):
        """The scene's file, with its packing beside it."""
        what = SCENES[name]
        random = np.random.default_rng(len(name) + dim)
        side = 6 if dim == 2 else 3
        cells = np.stack(np.meshgrid(*dim * [np.arange(side)]), -1).reshape(-1, dim)
        with h5py.File(self.folder / f"{name}{dim}.h5", "w") as file:
            file["x"] = 1.01 * (cells + 0.5) + random.uniform(-0.005, 0.005, cells.shape)
            file["radius"] = random.uniform(0.4, 0.5, len(cells))
            file["box"] = np.full(dim, 1.01 * side)
            file["velocity"] = random.uniform(-0.5, 0.5, cells.shape)
            file["spin"] = random.uniform(-2, 2, (len(cells), 2 * dim - 3))
        up = "xyz"[dim - 1]
        sides = {up + "-": FIXED} | {up + "+" if side == "top" else side: motion for side, motion in what["sides"].items()}
        first = [1.0] + [0.0] * (dim - 1)
        motions = {side: motion.format(shear=[2 * x for x in first], push=[-0.3 * x for x in first]) for side, motion in sides.items()}
        gravity = [what["along"]] + [0.5] * (dim - 2) + [-10]
        return self.write(
            f"{name}{dim}.toml",
            HEAP.format(
                name=name,
                dim=dim,
                gravity=gravity,
                packing=f"{name}{dim}.h5",
                friction=what["friction"],
                rolling=what["rolling"],
                restitution=what.get("restitution", 0),
                h=what.get("h", 0.02),
                walls="".join(WALL.format(side=side, motion=motion) for side, motion in motions.items()),
                cell=what.get("cell", ""),
            ),
        )

    def exported(self, name, dim, step, *options):
        out = self.folder / f"{name}{dim}-{step}.hdf5"
        self.succeeds("export-fclib", self.scene(name, dim), "--step", step, "--tolerance", "1e-10", *options, "-o", out)
        return out


class Files(RollingTest):
    def test_exports_have_the_layout_of_fclib(self):
        friction, rolling = SCENES["corner"]["friction"], SCENES["corner"]["rolling"]
        for dim, size in ((2, 3), (3, 5)):
            local, other = self.exported("corner", dim, 12), self.exported("corner", dim, 11, "--form", "global")
            with self.subTest(dim=dim), h5py.File(local) as file, h5py.File(other) as second:
                group, whole = file["fclib_local_rolling"], second["fclib_global_rolling"]
                self.assertEqual((group["spacedim"][0], whole["spacedim"][0]), (size, size))
                contacts = len(group["vectors/mu"])
                self.assertEqual(len(group["vectors/q"]), size * contacts)
                mu, mu_r = group["vectors/mu"][...], group["vectors/mu_r"][...]
                self.assertTrue((mu == friction).all() and (mu_r == rolling).all())
                w, q, r, u = dense(group["W"]), group["vectors/q"][...], file["solution/r"][...], file["solution/u"][...]
                self.assertLess(np.abs(w - w.T).max(), 1e-14 * np.abs(w).max())
                self.assertLess(np.abs(w @ r + q - u).max(), 1e-12)
                own = rolling_natural_map(w, q, mu, mu_r, r)
                self.assertLess(own, 1e-9)
                self.assertAlmostEqual(own, group["info"].attrs["solution_natural_map"], delta=1e-12)
                m, h = dense(whole["M"]), dense(whole["H"])
                v, r = second["solution/v"][...], second["solution/r"][...]
                self.assertLess(np.abs(m @ v - h @ r - whole["vectors/f"][...]).max(), 1e-12)
                self.assertLess(np.abs(h.T @ v + whole["vectors/w"][...] - second["solution/u"][...]).max(), 1e-12)
                self.assertEqual(set(whole["vectors"]), {"f", "w", "mu", "mu_r"})

    def test_a_scene_without_rolling_is_exported_with_its_bodies(self):
        scene = self.write("pair.toml", SCENE)
        for form in ("local", "global"):
            self.succeeds("export-fclib", scene, "--form", form, "--tolerance", "1e-10", "-o", self.folder / f"{form}.hdf5")
        found = [self.solve(self.folder / f"{form}.hdf5", "--tolerance", "1e-12") for form in ("local", "global")]
        for (report, _), form in zip(found, ("local", "global")):
            self.assertEqual((report["form"], report["rolling"]), (form, False))
        np.testing.assert_allclose(found[1][1]["u"], found[0][1]["u"], rtol=0, atol=1e-12)
        self.assertEqual(found[1][1]["v"].shape, (12,))

    def test_every_form_is_read_and_solved(self):
        for dim in (2, 3):
            path = self.exported("corner", dim, 12, "--form", "global")
            report, solution = self.solve(path, "--tolerance", "1e-10")
            self.validate(report)
            self.assertEqual((report["form"], report["dimension"], report["rolling"]), ("global", dim, True))
            with h5py.File(path) as file:
                group = file["fclib_global_rolling"]
                m, h = dense(group["M"]), dense(group["H"])
                f, w, mu, mu_r = (group[f"vectors/{name}"][...] for name in ("f", "w", "mu", "mu_r"))
            a, q = h.T @ np.linalg.solve(m, h), w + h.T @ np.linalg.solve(m, f)
            self.assertLess(rolling_natural_map(a, q, mu, mu_r, solution["r"]), 1.001e-10)
            for kind in ("columns", "rows", "triplets"):
                _, again = self.solve(write_local(self.folder / "local.hdf5", a, q, mu, kind, mu_r), "--tolerance", "1e-10")
                self.assertLess(np.abs(again["u"] - solution["u"]).max(), 1e-6 * np.abs(solution["u"]).max())
                _, again = self.solve(write_global(self.folder / "global.hdf5", m, h, f, w, mu, kind, mu_r), "--tolerance", "1e-10")
                self.assertLess(np.abs(again["u"] - solution["u"]).max(), 1e-6 * np.abs(solution["u"]).max())

    def test_what_cannot_be_is_refused_in_one_line(self):
        path = self.exported("pile", 2, 4)

        def refused(fragments, *arguments, change=None):
            if change is not None:
                with h5py.File(path) as file, h5py.File(self.folder / "bad.hdf5", "w") as bad:
                    file.copy("fclib_local_rolling", bad)
                    change(bad["fclib_local_rolling"])
                arguments = ("solve-fclib", self.folder / "bad.hdf5")
            done = self.run_program(*arguments)
            with self.subTest(fragments=fragments):
                self.assertEqual((done.returncode, len(errors_of(done))), (1, 1), done.stdout + done.stderr)
                for fragment in fragments:
                    self.assertIn(fragment, done.stderr)

        def spoil(name, value):
            def change(group):
                group[name][0] = value

            return change

        refused(["spacedim", "3 or 5", "found 2"], change=spoil("spacedim", 2))
        refused(["vectors/mu_r", "negative"], change=spoil("vectors/mu_r", -1))
        refused(["vectors/mu_r", "missing"], change=lambda group: group.pop("vectors/mu_r"))
        refused(["fclib_local_rolling/V", "bilateral"], change=lambda group: group.create_group("V"))
        for solver in ("newton", "spg", "apgd"):
            refused([solver, "rolling resistance"], "solve-fclib", path, "--solver", solver)
        for dim, outcome in ((3, 1), (2, 0)):  # disks do not twist
            scene = self.scene("pile", dim)
            scene.write_text(scene.read_text().replace("rolling =", "twisting = 0.01, rolling ="))
            done = self.run_program("export-fclib", scene, "--step", 4, "-o", self.folder / "out.hdf5")
            self.assertEqual((done.returncode, len(errors_of(done))), (outcome, outcome), done.stderr)
            if outcome:
                self.assertIn("pair 'glass'-'glass': FCLIB has no resistance to twisting", done.stderr)


class Agreement(RollingTest):
    def agrees(self, name, problem, ours, counts):
        """What is told of a problem; ours: impulses, one answer or several. Asserts that each and Siconos' satisfy the law, with the same velocities."""
        from nscdd_suite import siconos_solve

        size, w, q, mu, mu_r = problem
        theirs, report = siconos_solve.solve(*problem, "NSGS", 1e-9, 200000)
        w = w.toarray()
        errors = [rolling_natural_map(w, q, mu, mu_r, r) for r in (*ours, theirs)]
        u, *others = (w @ r + q for r in (theirs, *ours))
        difference = max(np.linalg.norm(v - u) for v in others) / max(np.linalg.norm(u), np.linalg.norm(q))
        with self.subTest(problem=name):
            self.assertLessEqual(max(errors), 1e-8)
            self.assertLess(difference, 1e-6)
        for status, count in rolling_statuses(w, q, mu, mu_r, ours[0]).items():
            counts[status] = counts.get(status, 0) + count
        return max(errors[:-1]), errors[-1], difference, report["iterations"]

    @needs_siconos
    def test_exports(self):
        from nscdd_suite import other_solver

        rows, counts = [], {}
        for number, (name, dim, step) in enumerate(problems()):
            path = self.exported(name, dim, step, "--form", ("global", "local")[number % 2])
            report, solution = self.solve(path, "--tolerance", "1e-9")
            with h5py.File(path) as file:
                exported = file["solution/r"][...]  # by accelerated sweeps without a matrix
            found = self.agrees(path.stem, other_solver.read(path), (solution["r"], exported), counts)
            rows.append((path.stem, report["contacts"], report["iterations"], *found))
        self.tell(rows, counts)
        self.assertGreaterEqual(len(rows), 30)
        self.assertGreater(min(counts[status] for status in ("held", "slides", "rolls", "both")), 20)

    @needs_siconos
    @unittest.skipUnless(SHARED.is_dir(), f"no problems of Siconos in {SHARED}")
    def test_problems_of_siconos(self):
        from nscdd_suite import other_solver

        rows, counts = [], {}
        for path in sorted((*SHARED.glob("*.hdf5"), *SHARED.glob("*.dat"))):
            if path.suffix == ".dat":
                problem = read_dat(path)
                if problem is None:
                    continue
                path = self.folder / (path.stem + ".hdf5")
                other_solver.write(path, *problem, np.zeros(len(problem[2])))
            report, solution = self.solve(path, "--tolerance", "1e-9")
            found = self.agrees(path.stem, other_solver.read(path), (solution["r"],), counts)
            rows.append((path.stem, report["contacts"], report["iterations"], *found))
        self.tell(rows, counts)
        self.assertGreater(len(rows), 0)

    def tell(self, rows, counts):
        for name, contacts, sweeps, own, theirs, difference, iterations in rows:
            print(
                f"{name}: {contacts} contacts, {sweeps} sweeps, natural map {own:.1e}; "
                f"Siconos {iterations} sweeps, {theirs:.1e}; velocities differ by {difference:.1e}"
            )
        worst, apart = max(row[3] for row in rows), max(row[5] for row in rows)
        print(f"{len(rows)} problems: natural map up to {worst:.1e}, velocities up to {apart:.1e} apart, contacts {counts}")


def read_dat(path):
    """A local problem of Siconos' text files with a dense W, as other_solver.read() has it; None for what is another."""
    import scipy.sparse

    numbers = path.read_text().split()
    size, contacts, storage, rows = map(int, numbers[:4])
    if storage != 0 or rows != size * contacts or int(numbers[4]) != rows:
        return None
    numbers = np.array(numbers[7:], float)  # 5 and 6 say rows and columns again
    w, q, mu, mu_r = np.split(numbers[: rows * rows + rows + 2 * contacts], np.cumsum([rows * rows, rows, contacts]))
    return size, scipy.sparse.csc_matrix(w.reshape(rows, rows, order="F")), q, mu, mu_r


if __name__ == "__main__":
    unittest.main()
