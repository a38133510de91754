"""Packings by both generators: the same checks, computed here from the file alone, and what happens without LAMMPS."""
import os
import re
import shutil
import unittest

import h5py
import numpy as np

from harness import ProgramTest

GENERATORS = ("own", "lammps")
DISKS = "dimension = 2\ngrains = 300\nspread = 0.25\nseed = 4\n"
SPHERES = "dimension = 3\ngrains = 300\nspread = 0.1\nseed = 4\n"

# What LAMMPS would write, of the grains that it was given: where they were, and all in one place.
UNMOVED = """awk 'BEGIN {print "ITEM: ATOMS id x y z radius"} NF == 7 {print $1, $5, $6, $7, $3 / 2}' grains.data > packed.dump"""
HEAPED = """awk 'BEGIN {print "ITEM: ATOMS id x y z radius"} NF == 7 {print $1, 3, 3, 0, $3 / 2}' grains.data > packed.dump"""


class Packings(ProgramTest):
    def pack(self, text, generator, name="packing", **options):
        if generator == "lammps" and not options and not shutil.which("lmp"):
            self.skipTest("lmp is not installed")
        return self.run_program("pack", self.write("pack.toml", text), "-o", self.folder / f"{name}.h5", "--quiet", "--generator", generator, **options)

    def packed(self, text, generator):
        done = self.pack(text, generator)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with h5py.File(self.folder / "packing.h5") as file:
            texts = {key: value.decode() for key, value in file.attrs.items() if key != "dim"}
            return *(file[key][...] for key in ("x", "radius", "box")), texts, done.stdout

    def with_lmp(self, script):
        """The environment in which `lmp` is this shell script."""
        folder = self.folder / "bin"
        folder.mkdir(exist_ok=True)
        (folder / "lmp").write_text(f"#!/bin/sh\n{script}\n")
        (folder / "lmp").chmod(0o755)
        return {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}

    def refused(self, message, **options):
        """One line of error; what was there before still is, and nothing else."""
        packing = self.folder / "packing.h5"
        packing.write_bytes(b"an older file")
        self.write("pack.toml", DISKS)
        before = set(self.folder.iterdir())
        done = self.pack(DISKS, "lammps", **options)
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn(message, done.stderr)
        self.assertEqual(packing.read_bytes(), b"an older file")
        self.assertEqual(set(self.folder.iterdir()), before)

    def test_no_gap_is_negative_and_solid_fractions_are_true(self):
        for generator in GENERATORS:
            for text, low, high in ((DISKS, 0.79, 0.85), (SPHERES, 0.54, 0.60)):
                with self.subTest(generator=generator, text=text):
                    x, radius, box, attributes, out = self.packed(text, generator)
                    gaps = np.linalg.norm(x[:, None] - x[None], axis=2) - (radius[:, None] + radius[None])
                    np.fill_diagonal(gaps, 1)
                    self.assertGreaterEqual(gaps.min(), 0)
                    self.assertLess(gaps.min(), 1e-3)
                    self.assertGreaterEqual((x - radius[:, None]).min(), 0)
                    self.assertGreaterEqual((box - x - radius[:, None]).min(), 0)
                    volume = (np.pi * radius**2).sum() if len(box) == 2 else (4 / 3 * np.pi * radius**3).sum()
                    fraction = volume / box.prod()
                    self.assertAlmostEqual(float(attributes["solid_fraction"]), fraction, delta=1e-6)
                    self.assertTrue(low < fraction < high, fraction)
                    self.assertAlmostEqual(radius.mean(), 0.5, delta=0.02)
                    self.assertLess(float(attributes["largest_overlap"]), 1e-3)
                    source = attributes["source"]
                    self.assertIn({"own": "by our own contact dynamics", "lammps": "by LAMMPS ("}[generator], source)
                    self.assertIn(source.removeprefix("nscdd pack "), out)
                    self.assertEqual(attributes["seed"], "4")

    def test_rattlers_and_coordination_are_true(self):
        """Contacts are pairs with a gap below 1e-4 diameters before all radii were shrunk, and the core is two diameters from the walls."""
        for generator in GENERATORS:
            with self.subTest(generator=generator):
                x, radius, box, attributes, out = self.packed(DISKS, generator)
                radius = radius / (1 - float(re.search("radii shrunk by ([0-9.e-]+)", out)[1]))
                diameter = 2 * radius.mean()
                apart = np.linalg.norm(x[:, None] - x[None], axis=2)
                touch = apart - (radius[:, None] + radius[None]) < 1e-4 * diameter
                np.fill_diagonal(touch, False)
                walls = sum((near - radius[:, None] < 1e-4 * diameter).sum(axis=1) for near in (x, box - x))
                held = np.full(len(x), True)
                while (new := held & (touch[:, held].sum(axis=1) + walls > 2)).sum() < held.sum():
                    held = new
                core = held & (x > 2 * diameter).all(axis=1) & (x < box - 2 * diameter).all(axis=1)
                self.assertAlmostEqual(float(attributes["rattlers"]), 1 - held.mean(), delta=0.02)
                self.assertAlmostEqual(float(attributes["coordination"]), touch[core][:, held].sum(axis=1).mean(), delta=0.1)

    def test_a_loose_packing_has_the_solid_fraction_asked_for(self):
        for generator in GENERATORS:
            with self.subTest(generator=generator):
                x, radius, box, *_ = self.packed(DISKS + "solid_fraction = 0.7\n", generator)
                self.assertAlmostEqual((np.pi * radius**2).sum() / box.prod(), 0.7, delta=0.01)

    def test_the_same_seed_gives_the_same_bytes(self):
        for generator in GENERATORS:
            with self.subTest(generator=generator):
                found = []
                for text in (DISKS, DISKS, DISKS.replace("seed = 4", "seed = 5")):
                    self.packed(text, generator)
                    found.append((self.folder / "packing.h5").read_bytes())
                self.assertEqual(found[0], found[1])
                self.assertNotEqual(found[0], found[2])

    def test_names_of_folders_may_have_special_characters(self):
        folder = self.folder / "it's a $HOME"
        folder.mkdir()
        done = self.pack(DISKS, "lammps", f"{folder.name}/packing")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([path.name for path in folder.iterdir()], ["packing.h5"])

    def test_without_lmp_auto_is_the_own_generator(self):
        nowhere = {**os.environ, "PATH": str(self.folder)}
        done = self.pack(DISKS, "auto", env=nowhere)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("300 grains by our own contact dynamics", done.stdout)
        self.refused("generator lammps: there is no lmp on PATH", env=nowhere)

    def test_the_specification_names_a_generator_and_the_option_another(self):
        specification = self.write("own.toml", DISKS + 'generator = "own"\n')
        failing = self.with_lmp("echo 'ERROR: never to be asked'; exit 1")
        out = self.folder / "packing.h5"
        self.assertIn("our own", self.run_program("pack", specification, "-o", out, env=failing).stdout)
        self.assertIn("never to be asked", self.run_program("pack", specification, "-o", out, "--generator", "auto", env=failing).stderr)
        bad = self.write("bad.toml", DISKS + 'generator = "lamps"\n')
        done = self.run_program("pack", bad, "-o", out)
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (1, 1))
        self.assertIn("bad.toml:5: generator", done.stderr)

    def test_a_failing_lmp_is_one_line_and_leaves_nothing(self):
        self.refused("lmp ended with exit code 3: ERROR: Lost atoms", env=self.with_lmp("echo LAMMPS; echo ERROR: Lost atoms; echo; exit 3"))
        self.refused("lmp ended with signal 9", env=self.with_lmp("kill -9 $$"))
        self.refused("without a packing", env=self.with_lmp("exit 0"))
        self.refused("is not the 300 grains", env=self.with_lmp(f"{UNMOVED}; head -n 50 packed.dump > half; mv half packed.dump"))

    def test_what_is_out_of_bounds_is_not_written(self):
        self.refused("solid fraction of the core", env=self.with_lmp(UNMOVED))
        self.refused("largest overlap", env=self.with_lmp(HEAPED))


if __name__ == "__main__":
    unittest.main()
