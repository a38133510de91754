"""nscdd.solve and nscdd.solve_contacts: exact answers, the program's answers, errors of one line."""
import pathlib
import subprocess
import sys
import types
import unittest
import warnings

import h5py
import numpy as np
import scipy.sparse
from fclib_files import law_errors, rolling_natural_map, write_global, write_local
from harness import NSCDD, ProgramTest

sys.path.insert(0, str(pathlib.Path(NSCDD).resolve().parents[1] / "python"))
try:
    import nscdd
except ImportError as missing:
    raise unittest.SkipTest(f"the Python module is not built: {missing}")


WRONG_OPTIONS = (("tolerance", "x"), ("max_iterations", 10**10), ("max_iterations", 1.5), ("check_every", "x"), ("solver", 3))


def problem(contacts=12, dim=3, bodies=6, seed=0):
    """M, H, f, w, mu of a global problem that has an answer, all contacts being able to open."""
    rng = np.random.default_rng(seed)
    dof = bodies * dim
    m = np.diag(rng.uniform(1, 2, dof))
    h = rng.normal(size=(dof, contacts * dim)) * (rng.random((dof, contacts * dim)) < 0.6)
    return m, h, rng.normal(size=dof), np.zeros(contacts * dim) + 0.1, rng.uniform(0.1, 0.6, contacts)


class Matrices(ProgramTest):
    def test_one_contact_by_hand(self):
        for mu, tangential in ((1.0, -0.5), (0.1, -0.2)):
            answer = nscdd.solve(np.diag([1.0, 2.0]), [-2.0, 1.0], [mu])
            self.assertTrue(answer.converged)
            self.assertTrue(np.allclose(answer.impulses, [[2.0, tangential]], atol=1e-12))
            self.assertTrue(np.allclose(answer.relative_velocities, [[0, 1 + 2 * tangential]], atol=1e-12))

    def test_one_contact_that_resists_rolling_by_hand(self):
        for mu_r, couple in ((1.0, -0.75), (0.1, -0.2)):
            answer = nscdd.solve(np.diag([1.0, 2.0, 4.0]), [-2.0, 1.0, 3.0], [1.0], mu_r=[mu_r])
            self.assertTrue(np.allclose(answer.impulses, [[2.0, -0.5, couple]], atol=1e-12))
            self.assertTrue(np.allclose(answer.relative_velocities, [[0, 0, 3 + 4 * couple]], atol=1e-12))

    def test_files_with_rolling_resistance(self):
        m, h, f, w, mu = problem(dim=5, seed=2)
        delassus, q, mu_r = h.T @ np.linalg.inv(m) @ h, w + h.T @ np.linalg.inv(m) @ f, mu[::-1] / 2
        answer = nscdd.solve(delassus, q, mu, mu_r=mu_r, tolerance=1e-10)
        self.assertTrue(answer.converged)
        self.assertLess(rolling_natural_map(delassus, q, mu, mu_r, answer.impulses.ravel()), 1.001e-10)
        for path in (write_global(self.folder / "global.hdf5", m, h, f, w, mu, mu_r=mu_r), write_local(self.folder / "local.hdf5", delassus, q, mu, mu_r=mu_r)):
            parts = nscdd.read_problem(path)
            self.assertEqual(parts.pop("dimension"), 3)
            for found in (nscdd.solve(path, tolerance=1e-10), nscdd.solve(**parts, tolerance=1e-10)):
                self.assertEqual(found.impulses.shape, (len(mu), 5))
                self.assertTrue(np.allclose(found.relative_velocities, answer.relative_velocities, atol=1e-7))

    def test_global_is_the_condensed_local(self):
        for dim in (2, 3):
            m, h, f, w, mu = problem(dim=dim)
            inverse = np.linalg.inv(m)
            delassus, q = h.T @ inverse @ h, w + h.T @ inverse @ f
            for solver in ("nlgs", "newton"):
                whole = nscdd.solve(M=scipy.sparse.csr_matrix(m), H=scipy.sparse.coo_matrix(h), f=f, w=w, mu=mu, solver=solver, tolerance=1e-10)
                local = nscdd.solve(delassus, q, mu, solver=solver, tolerance=1e-10)
                for answer in (whole, local):
                    self.assertTrue(answer.converged)
                    self.assertLess(answer.errors["natural_map"], 1e-10)
                    errors = np.concatenate([np.ravel(e) for e in law_errors(delassus, q, mu, answer.impulses.ravel())])
                    self.assertLess(np.abs(errors).max(), 1e-7)
                self.assertTrue(np.allclose(whole.velocities, inverse @ (h @ whole.impulses.ravel() + f), atol=1e-12))
                self.assertTrue(np.allclose(whole.relative_velocities.ravel(), h.T @ whole.velocities + w, atol=1e-9))

    def test_files_are_solved_as_the_program_does(self):
        m, h, f, w, mu = problem()
        for path in (
            write_global(self.folder / "global.hdf5", m, h, f, w, mu),
            write_local(self.folder / "local.hdf5", h.T @ h / 2 + np.eye(len(w)) * 0.1, w + h.T @ f, mu),
        ):
            out = self.folder / "solved.hdf5"
            self.succeeds("solve-fclib", path, "-o", out)
            with h5py.File(out) as file:
                r = file["solution/r"][...]
            self.assertTrue(np.array_equal(nscdd.solve(path).impulses.ravel(), r))
            parts = nscdd.read_problem(path)
            parts.pop("dimension")
            self.assertTrue(np.array_equal(nscdd.solve(**parts).impulses.ravel(), r))

    def test_a_start_is_judged_and_gone_on_from(self):
        m, h, f, w, mu = problem()
        given = dict(M=m, H=h, f=f, w=w, mu=mu)
        answer = nscdd.solve(**given)
        judged = nscdd.solve(**given, solver="none", start=answer.impulses)
        self.assertTrue(judged.converged and np.array_equal(judged.impulses, answer.impulses))
        self.assertLessEqual(nscdd.solve(**given, start=answer.impulses).iterations, 10)

    def test_objects_of_other_codes(self):
        m, h, f, w, mu = problem()
        whole = nscdd.solve(M=m, H=h, f=f, w=w, mu=mu)
        theirs = types.SimpleNamespace(M=m, H=h, q=f, b=w, mu=mu)
        self.assertTrue(np.array_equal(nscdd.solve(theirs).impulses, whole.impulses))

    def test_problems_of_siconos(self):
        try:
            from siconos import numerics
        except ImportError as missing:
            self.skipTest(f"Siconos is not here: {missing}")
        m, h, f, w, mu = problem()
        delassus, q = h.T @ np.linalg.inv(m) @ h, w + h.T @ np.linalg.inv(m) @ f
        ours = nscdd.solve(delassus, q, mu)
        for matrix in (delassus, scipy.sparse.coo_matrix(delassus)):
            theirs = numerics.FrictionContactProblem(3, len(mu), matrix, q, mu)
            self.assertTrue(np.array_equal(nscdd.solve(theirs).impulses, ours.impulses))

    def test_errors(self):
        w, q, mu = np.eye(3), [-1.0, 0, 0], [0.5]
        for given, told in (
            (dict(W=w, q=q), "give W, q and mu"),
            (dict(W=w, q=q, mu=mu, M=w, H=w, f=q, w=q), "give W, q and mu, or M, H"),
            (dict(W=np.eye(4), q=q, mu=mu), r"W must have shape \(3, 3\), found \(4, 4\)"),
            (dict(W=w * np.nan, q=q, mu=mu), "W: row 0 must be finite, found nan"),
            (dict(W=scipy.sparse.csr_matrix(np.full((3, 3), np.inf)), q=q, mu=mu), "entries of W: row 0 must be finite, found"),
            (dict(W=w + 0j, q=q, mu=mu), "W must be real, found"),
            (dict(W=scipy.sparse.eye(3) * 1j, q=q, mu=mu), "entries of W must be real, found"),
            (dict(W={"data": [1]}, q=q, mu=mu), "W must be numbers, found a dict"),
            (dict(M=w * 0, H=w, f=q, w=q, mu=mu), "M is singular"),
            (dict(M=np.zeros((40, 40)), H=np.eye(40)[:, :3], f=np.ones(40), w=np.zeros(3), mu=[0.1]), "M is singular"),
            (dict(W=w, q=q, mu=["a"]), "mu must be a?.*number"),
            *((dict([("W", w), ("q", q), ("mu", mu), (key, bad)]), f"^{key} cannot be {bad!r}$") for key, bad in WRONG_OPTIONS),
            (dict(W=w, q=[1, 2, 3, 4], mu=mu), "4 components for 1 contacts"),
            (dict(W=-w, q=q, mu=mu), "W_NN is -1"),
            (dict(W=np.eye(4), q=[1, 2, 3, 4], mu=mu, mu_r=mu), "4 components for 1 contacts, each needs 3 or 5"),
            (dict(W=w, q=q, mu=mu, mu_r=[0.1, 0.1]), "mu_r has 2 numbers for 1 contacts"),
            (dict(W=w, q=q, mu=mu, mu_r=[-1]), "coefficient of rolling"),
            (dict(W=w, q=q, mu=mu, mu_r=mu, solver="newton"), "newton does not solve problems with rolling resistance"),
            (dict(W=w, q=q, mu=[-1]), "coefficient of friction"),
            (dict(W=w, q=q, mu=mu, solver="magic"), "solver must be one of 'auto' 'nlgs'"),
            (dict(W=w, q=q, mu=mu, tolerance=-1), "tolerance"),
            (dict(W=self.folder / "none.hdf5"), "none.hdf5"),
        ):
            with self.subTest(told), self.assertRaisesRegex(ValueError, told):
                nscdd.solve(**given)

    def test_what_is_given_is_left_as_it_was(self):
        """Also of entries that are no doubles, are not in order, or given twice."""
        for number in ("f4", "f8", "i8"):
            data = np.array([2, 10, 2, 10, 4, 30], number)
            w = scipy.sparse.csc_matrix((data, np.array([1, 0, 0, 1, 1, 2], "i4"), np.array([0, 2, 5, 6], "i4")), shape=(3, 3))
            before = w.toarray()
            first, second = (nscdd.solve(w, [-1.0, 0.3, 0], [0.2]).impulses for _ in range(2))
            self.assertTrue(np.array_equal(w.toarray(), before) and np.array_equal(first, second), number)
            self.assertTrue(np.array_equal(first, nscdd.solve(before, [-1.0, 0.3, 0], [0.2]).impulses))

    def test_no_contacts(self):
        for shape in ((0, 0), (2, 0)):
            n = shape[0]
            found = nscdd.solve(M=np.eye(n), H=np.zeros(shape), f=np.ones(n), w=[], mu=[])
            self.assertEqual((found.impulses.shape, list(found.velocities)), ((0, 3), [1] * n))
        with self.assertRaisesRegex(ValueError, "W_NN is 0"):
            nscdd.solve(M=np.zeros((0, 0)), H=np.zeros((0, 3)), f=[], w=[0.0, 0, 0], mu=[0.2])

    def test_indices_that_lead_nowhere(self):
        for kind in (scipy.sparse.csc_matrix, scipy.sparse.csr_matrix, scipy.sparse.bsr_matrix, scipy.sparse.coo_matrix):
            for part, bad in (("indices", 10**8), ("indices", -1), ("indptr", 10**8), ("indptr", -1)):
                matrix = kind(np.eye(3))
                getattr(matrix, part if kind is not scipy.sparse.coo_matrix else "row")[1] = bad
                with self.subTest(kind=kind, part=part, bad=bad), self.assertRaisesRegex(ValueError, "^solve: W: "):
                    nscdd.solve(matrix, [-1.0, 0, 0], [0.5])


class Detection(unittest.TestCase):
    def test_a_pyramid_rests(self):
        """As kernel/examples/own_detection.cpp: the walls carry the weight of a pyramid of disks in a box."""
        radius, mass, gravity, h, base = 0.5, 2.0, 9.81, 1e-3, 12
        x = np.array([((2 * k + row) * radius, radius + row * 3**0.5 * radius) for row in range(base) for k in range(base - row)])
        i, j = np.nonzero(np.triu(np.hypot(*(x[:, None] - x[None]).transpose(2, 0, 1)) < 2 * radius + 1e-3, 1))
        normals = (x[i] - x[j]) / np.linalg.norm(x[i] - x[j], axis=1)[:, None]
        gaps = np.linalg.norm(x[i] - x[j], axis=1) - 2 * radius
        for wall, (normal, gap) in enumerate((((0, 1), x[:, 1] - radius), ((1, 0), x[:, 0]), ((-1, 0), 2 * (base - 1) * radius - x[:, 0]))):
            near = np.flatnonzero(gap < 1e-3)
            i, j, gaps = np.r_[i, near], np.r_[j, np.full(len(near), -1 - wall)], np.r_[gaps, gap[near]]
            normals = np.vstack([normals, np.tile(normal, (len(near), 1))])
        free = np.tile([0, -gravity * h], (len(x), 1))
        for solver in ("nlgs", "newton"):
            answer = nscdd.solve_contacts(
                free, i, j, normals, gaps, 0.5, h=h, radii=radius, masses=mass, positions=x, solver=solver, tolerance=1e-8, max_velocity_error=1e-6
            )
            self.assertTrue(answer.converged)
            carried = answer.impulses[j < 0, 1].sum() / (len(x) * mass * gravity * h)
            self.assertAlmostEqual(carried, 1, places=6)
            self.assertLess(np.abs(answer.velocities).max(), 1e-5 * gravity * h)
        again = nscdd.solve_contacts(free, i, j, normals, gaps, 0.5, h=h, radii=radius, masses=mass, start=answer.impulses, tolerance=1e-8)
        self.assertLessEqual(again.iterations, 10)

    def test_a_sphere_slides_and_rebounds(self):
        h, g, mu, e, v = 0.01, 10.0, 0.2, 0.5, np.array([[3.0, 0, -1.0]])
        contact = dict(i=[0], j=[-1], normals=[[0, 0, 1]], gaps=[0.0], mu=mu, h=h, radii=0.5, masses=2.0)
        slid = nscdd.solve_contacts(v, **contact)
        normal = 2.0
        self.assertTrue(np.allclose(slid.impulses, [[-mu * normal, 0, normal]], atol=1e-9))
        self.assertTrue(np.allclose(slid.velocities, [[3 - mu * normal / 2, 0, 0]], atol=1e-9))
        self.assertTrue(np.allclose(slid.spins, [[0, mu * normal * 0.5 / (0.4 * 2 * 0.25), 0]], atol=1e-9))
        turned = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
        rounded = nscdd.solve_contacts(v @ turned.T, **(contact | dict(normals=np.float32(turned[:, 2:].T), j=[-(2**31) + 1])))
        self.assertTrue(rounded.converged)
        self.assertTrue(np.allclose(rounded.velocities, slid.velocities @ turned.T, atol=1e-6))
        bounced = nscdd.solve_contacts(v, **contact, bias=[-e * 1.0])
        self.assertAlmostEqual(bounced.velocities[0, 2], 0.5, places=9)
        belt = nscdd.solve_contacts(v, **contact, wall_velocities=[[3.0, 0, 0]])
        self.assertTrue(np.allclose(belt.velocities, [[3, 0, 0]], atol=1e-9))

    def test_errors(self):
        good = dict(velocities=np.zeros((2, 3)), i=[0.0], j=[1], normals=[[1, 0, 0]], gaps=[0.0], mu=0.3, h=0.01, radii=0.5, masses=1.0)
        self.assertTrue(nscdd.solve_contacts(**good).converged)
        for change, told in (
            (dict(i=[2]), "i and j must be below 2"),
            (dict(i=[0.9]), "i: row 0 must be a whole number of 32 bits, found 0.9"),
            (dict(j=np.array([2**32 - 1])), "j: row 0 must be a whole number of 32 bits, found 4294967295"),
            (dict(j=[1, 1]), r"j must have shape \(1,\), found \(2,\)"),
            (dict(h="a"), "h must be a number, found 'a'"),
            (dict(masses=0), "masses: row 0 must be > 0"),
            (dict(wall_velocities=3), "wall_velocities must have shape"),
            *((dict([(key, bad)]), f"^{key} cannot be {bad!r}$") for key, bad in WRONG_OPTIONS),
            (dict(normals=[[1, 0]]), r"normals must have shape \(1, 3\), found \(1, 2\)"),
            (dict(normals=[[2, 0, 0]]), "normals: row 0 must be of length 1"),
            (dict(radii=0, inertias=1), "radii: row 0 must be > 0"),
            (dict(radii=[[1], [1, 2]]), "radii must be numbers"),
            (dict(radii=np.ma.array([1.0, 1.0], mask=[False, True])), "radii must be numbers, some are masked"),
            (dict(i=[0, 1], j=[-1, 0], gaps=[0, 0], normals=[[1, 0, 0], [0, 0, 0]]), "normals: row 1 must be of length 1"),
            (dict(positions=[[0, 0, 0], [0, 0, np.nan]]), "positions: row 1 must be finite"),
            (dict(masses=[1, 2, 3]), r"masses must have shape \(2,\)"),
            (dict(mu=-1), "mu: row 0 must be >= 0"),
            (dict(h=0), "h must be > 0"),
            (dict(radii=0), "radii: row 0 must be > 0"),
            (dict(tolerance=-1), "tolerance"),
            (dict(toleranec=1), "unknown option 'toleranec'"),
            (dict(solver="magic"), "solver must be one of"),
        ):
            with self.subTest(told), self.assertRaisesRegex(ValueError, told), warnings.catch_warnings():
                warnings.simplefilter("error")
                nscdd.solve_contacts(**(good | change))


if __name__ == "__main__":
    unittest.main()
