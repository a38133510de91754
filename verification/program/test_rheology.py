"""Homogeneous shear: what LAMMPS is given, what is made of its means, and the study without it. Nothing is run."""
import math
import shutil
import tempfile
import unittest
from pathlib import Path
from unittest import mock

import h5py
import numpy as np

from harness import ROOT
from nscdd_suite.study import Plan
from nscdd_suite.studies.rheology import Rheology, angles, lade_duncan, lammps, law, mean


class Lammps(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def state(self, dim):
        """Two grains in a cell of sides 4 and 5, tilted by 1; the second is beyond its top."""
        x = np.array([[1.0, 1.0], [2.0, 6.0]]) if dim == 2 else np.array([[1.0, 1.0, 1.0], [2.0, 1.0, 6.0]])
        tilt = np.zeros((dim, dim))
        tilt[0, -1] = 1.0
        with h5py.File(self.folder / "one.h5", "w") as file:
            file["x"], file["radius"], file["velocity"], file["cell/tilt"] = x, [0.5, 0.6], np.full((2, dim), 0.25), tilt
            file["spin"] = np.array([0.1, 0.2]) if dim == 2 else np.full((2, 3), 0.1)
            file["cell/size"] = [4.0, 5.0] if dim == 2 else [4.0, 4.0, 5.0]

    def start(self, dim):
        self.state(dim)
        grains, fraction = lammps.write_start(self.folder / "one.h5", 0.1, self.folder / "one.data")
        lines = (self.folder / "one.data").read_text().splitlines()
        at = [lines.index("Atoms # sphere"), lines.index("Velocities")]
        return grains, fraction, *(np.array([line.split() for line in lines[k + 2 : k + 4]], float) for k in at)

    def test_disks_have_their_mass_and_the_velocity_of_the_flow_where_they_lie(self):
        grains, fraction, atoms, velocities = self.start(2)
        self.assertEqual((grains, fraction), (2, math.pi * (0.5**2 + 0.6**2) / 20))
        np.testing.assert_allclose(atoms[:, 4:], [[1, 1, 0], [1, 1, 0]], atol=1e-12)
        np.testing.assert_allclose(4 / 3 * math.pi * (atoms[:, 2] / 2) ** 3 * atoms[:, 3], math.pi * np.array([0.5, 0.6]) ** 2)
        np.testing.assert_allclose(velocities[:, 1:], [[0.35, 0.25, 0, 0, 0, 0.1], [0.35, 0.25, 0, 0, 0, 0.2]])

    def test_spheres(self):
        _, fraction, atoms, velocities = self.start(3)
        self.assertAlmostEqual(fraction, 4 / 3 * math.pi * (0.5**3 + 0.6**3) / 80)
        np.testing.assert_allclose(atoms[:, 2:], [[1, 1, 1, 1, 1], [1.2, 1, 1, 1, 1]], atol=1e-12)
        np.testing.assert_allclose(velocities[:, 1:], [[0.35, 0.25, 0.25, 0.1, 0.1, 0.1]] * 2)

    def test_a_ratio_that_is_constant_has_no_error_however_the_pressure_varies(self):
        for scene, dim, normal, shear in (("disks", 2, 2, 4), ("spheres", 3, 3, 5)):
            self.state(dim)
            means = np.zeros((lammps.MEANS, 13))
            means[:, normal] = 4 + np.sin(np.arange(lammps.MEANS))
            means[:, shear], means[:, normal + 6] = -0.3 * means[:, normal], 0.01 * means[:, normal]
            with mock.patch.object(lammps, "call", lambda command, fine, out: np.savetxt(out, means)):
                row = lammps.by_lammps(scene, 0.01, self.folder / "one", 2.0, mean, law)
            self.assertAlmostEqual(row["mu"], 0.3)
            self.assertAlmostEqual(row["mu_error"], 0)
            self.assertAlmostEqual(row["motion_over_normal_stress"], 0.01, delta=1e-3)
            self.assertAlmostEqual(row["inertial_number"], 0.005 * (math.sqrt(math.pi / 4) if dim == 2 else 1), delta=1e-4)
            self.assertTrue((ROOT / "cases/rheology/shear.lmp").exists() and "cases/rheology/shear.lmp" in row["command"])

    def test_angles_of_shear_and_of_triaxial_compression(self):
        sheared = np.eye(3)
        sheared[0, 2] = sheared[2, 0] = -0.357
        found = angles(sheared)
        self.assertAlmostEqual(found["angle"], math.degrees(math.asin(0.357)))
        self.assertAlmostEqual(found["angle_triaxial"], lade_duncan(0.357))
        self.assertAlmostEqual(angles(np.diag([1.0, 1.0, 2.0]))["angle_triaxial"], math.degrees(math.asin(1 / 3)))

    def test_without_it_the_study_says_so(self):
        for there in (None, "lmp"):
            plan = Plan(self.folder, "rheology", quick=True)
            with mock.patch("shutil.which", lambda name: there), mock.patch("builtins.print"):
                Rheology().jobs(plan)
            self.assertEqual(plan.left_out, [] if there else ["LAMMPS: lmp is not installed"])
            self.assertEqual(sum(job.title.startswith("lammps ") for job in plan.jobs), 10 if there else 0)


if __name__ == "__main__":
    unittest.main()
