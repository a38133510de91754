"""Bad input gives one clear line and a non-zero exit on every rank, without a hang, and leaves old results alone."""
import json
import os
import resource
import subprocess
import unittest
import unittest.mock

import h5py
import numpy as np

from harness import MPIRUN, NSCDD, PACKED, SCENE, ProgramTest


class Refusals(ProgramTest):
    def refused(self, fragments, *arguments, ranks=0):
        """Exit 1 and exactly one line of ours, with all fragments in it."""
        done = self.run_program(*arguments, ranks=ranks)
        lines = [line for line in done.stderr.splitlines() if line.startswith("nscdd:") and not line.startswith("nscdd: note:")]
        with self.subTest(fragments=fragments, ranks=ranks):
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertEqual(len(lines), 1, done.stderr)
            for fragment in fragments:
                self.assertIn(fragment, lines[0])
            self.assertEqual(done.stdout, "")

    def scene(self, old="", new="", text=SCENE):
        self.assertIn(old, text)
        return self.write("scene.toml", text.replace(old, new, 1))

    def packing(self, x=((1.0, 1.0, 0.5), (3.0, 1.0, 0.5)), radius=(0.5, 0.5)):
        with h5py.File(self.folder / "packing.h5", "w") as file:
            file.create_dataset("x", data=np.array(x), compression="gzip")
            file.create_dataset("radius", data=np.array(radius), compression="gzip")
            file["box"] = np.array((4.0, 4.0, 4.0))
        return self.write("scene.toml", PACKED)


class BadScene(Refusals):
    def test_refused(self):
        for old, new, *fragments in (
            ("[step]\n", "[step]\nsteps = 5\n", "steps"),
            ("radius = 0.5", "radius = -0.5", "[[grain]] 0: radius", "-0.5"),
            ("density = 1.0", "density = 0.0", "density"),
            ("position = [0, 0, 0.5]", "position = [0, nan, 0.5]", "[[grain]] 0: position"),
            ("[0.3, 0.1, 1.5]", "[0, 0, 1.35]", "grain 0", "grain 1", "overlap"),
            ("[0.3, 0.1, 1.5]", "[0, 0, 0.5]", "grain 0", "grain 1", "overlap"),
            ("[0.3, 0.1, 1.5]", "[1e308, 0, 1.5]", "grain 1: position"),
            ("[0, 0, 0.5]", "[-1e308, 0, 0.5]", "grain 0: position"),
            ('name = "pair"', 'name = "pa\\u001b[31mir"', "name must have no control characters"),
            ('name = "pair"', 'name = "pa\\nir"', "name must have no control characters"),
            ('name = "floor"', 'name = "fl\\u009boor"', "name must have no control characters"),
            ("[step]", "[solver]\nwindow = 9\n[step]", "solver: window must be <= 8, found 9"),
            ("[[material]]", '[[material]]\nname = "m"\ndensity = 1\n' * 1001 + "[[material]]", "material", "1000 times at most"),
        ):
            self.refused(["scene.toml" if "grain" not in fragments[0] else "", *fragments], "run", self.scene(old, new), "--scheme", "dcs")

    def test_keys_of_many_dots(self):
        """The parser makes a table of each part, one in another."""
        long = ".".join(["a"] * 200_000)
        quoted = ".".join(['"="', "'#'"] * 100_000)
        for line in (
            f"{long} = 1",
            f"[{long}]",
            f"{quoted} = 1",
            f"x = '''it's''''\n{long} = 1",
            f'x = {{y = """a"""", {long} = 1}}',
            f'x = "\\\\" \n{long} = 1',
        ):
            self.refused(["scene.toml", "a key has more than 8 dots"], "run", self.scene("[[material]]", line + "\n[[material]]"))
        for line in ('"a.b.c.d.e.f.g.h.i.j.k" = 1', "# a.b.c.d.e.f.g.h.i.j.k", "x = [0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5]"):
            done = self.run_program("run", self.scene("[[material]]", line + "\n[[material]]"))
            self.assertNotIn("dots", done.stderr)

    def test_more_materials_than_a_table_of_pairs_holds(self):
        many = "".join(f'[[material]]\nname = "m{k}"\ndensity = 1\n' for k in range(65_535))
        self.refused(["material must be given 1000 times at most, found 65536"], "run", self.scene("[[material]]", many + "[[material]]"))

    def test_not_a_file(self):
        os.mkfifo(self.folder / "fifo.toml")
        self.refused(["nowhere.toml", "No such file"], "run", self.folder / "nowhere.toml")
        self.refused(["is a folder"], "run", self.folder)
        self.refused(["fifo.toml", "is a FIFO, not a file"], "run", self.folder / "fifo.toml")

    def test_a_path_with_control_characters_stays_on_one_line(self):
        self.refused(["no?where.toml"], "run", self.folder / "no\nwhere.toml")

    def test_a_scene_is_no_specification(self):
        self.refused(["scene.toml", "material is of a scene, which `nscdd run` reads"], "pack", self.scene(), "-o", self.folder / "out.h5")

    def test_a_specification_of_vast_grains(self):
        for radius in ("1e300", "1e-300"):
            spec = self.write("pack.toml", f"dimension = 3\ngrains = 10\nradius = {radius}\n")
            self.refused(["pack.toml:3: radius must be in [1e-50, 1e+50]"], "pack", spec, "-o", self.folder / "out.h5")


class BadOptions(Refusals):
    def test_numbers_that_are_none(self):
        for option, value in (
            ("--tolerance", "nan"),
            ("--tolerance", "inf"),
            ("--tolerance", "-1"),
            ("--tolerance", "1e-4x"),
            ("--relaxation", "nan"),
            ("--relaxation", "2"),
            ("--relaxation", "0"),
        ):
            done = self.run_program("run", self.scene(), option, value)
            self.assertEqual(done.returncode, 1, (option, value))
            self.assertIn(f"{option}: must be a", done.stderr)
        done = self.run_program("run", self.scene(), "--scheme", "dcs", "-n", 2, "--imbalance", "nan")
        self.assertEqual((done.returncode, "--imbalance: must be a number in [1, 1000000]" in done.stderr), (1, True))
        for command in (("export-fclib", self.scene(), "-o", self.folder / "out.h5"), ("solve-fclib", self.folder / "none.h5")):
            self.assertIn("--tolerance: must be a", self.run_program(*command, "--tolerance", "nan").stderr)

    def test_an_unknown_command_and_a_packing_that_is_not_there_are_named(self):
        hdf5 = self.folder / "scene.h5"
        hdf5.write_bytes(b"\x89HDF\r\n")
        for words, said in (
            (("run", self.scene(), "--tolerence", 1), "--tolerence was not expected (did you mean '--tolerance'?); see run --help"),
            (("run", hdf5), "scene.h5: is an HDF5 file, and no text (TOML)"),
            (("rnu",), "unknown command 'rnu' (did you mean 'run'?)"),
            (("run", self.scene(), "--packing", self.folder / "none.h5"), "--packing asks for this packing"),
        ):
            done = self.run_program(*words)
            self.assertEqual((done.returncode, said in done.stderr), (1, True), done.stderr)

    def test_combinations(self):
        scene = self.scene()
        for arguments, fragment in (
            (("--scheme", "dcs", "--subdomains", 2, "--threads", 3), "--threads"),
            (("--threads", "many"), "--threads 'many': expected auto or a whole number"),
            (("--threads", 0), "--threads '0': expected auto"),
            (("--scheme", "dcs", "--subdomains", 4, "--grid", "3x1x1"), "--grid 3x1x1"),
            (("--scheme", "dcs", "--grid", "641x6700417x1"), "--grid 641x6700417x1: 4294967297 cells for 1"),
            (("--scheme", "dcs", "--grid", "65536x65536x65536"), "281474976710656 cells for 1"),
            (("--scheme", "newton", "--window", 2), "--window is of sweeps, which --scheme newton does not make"),
            (("--scheme", "spg", "--method", "paper"), "--method is of sweeps, which --scheme spg does not make"),
            (("--scheme", "apgd", "--relaxation", 1.5), "--relaxation is of sweeps, which --scheme apgd does not make"),
            (("--scheme", "newton", "--sweeps", 2), "--sweeps is of sweeps, which --scheme newton does not make"),
        ):
            self.refused([fragment], "run", scene, *arguments)

    def test_the_cap_is_kept(self):
        """Also where it is less than the iterations between two tests."""
        scene = self.write("scene.toml", SCENE.replace("count = 5", "count = 150") + "\n[solver]\ntolerance = 1e-14\n")
        for scheme in (("nlgs",), ("dcs", "--subdomains", 2), ("spg",), ("apgd",)):
            for check in ((), ("--check-every", 1_000_000_000), ("--check-every", 2)):
                done = self.run_program("run", scene, "--scheme", *scheme, *check, "--max-iterations", 3)
                self.assertEqual(done.returncode, 3, done.stderr)
                self.assertIn("without reaching", done.stderr)
                self.assertIn("after 3 iterations at most", done.stderr)

    def test_a_batch_job_is_not_a_launcher(self):
        with unittest.mock.patch.dict(os.environ, SLURM_NTASKS="1"):
            self.succeeds("run", self.scene(), "--scheme", "dcs", "-n", 8)


class BadPacking(Refusals):
    def test_good_packing(self):  # so that the refusals below are for the reason given
        self.succeeds("run", self.packing(), "--scheme", "dcs", "-n", 2)

    def test_values(self):
        self.refused(["packing.h5", "x"], "run", self.packing(x=((1, np.nan, 1), (3, 1, 1))))
        self.refused(["packing.h5", "radius"], "run", self.packing(radius=(0.5, -0.5)))
        self.refused(["grain 1: position"], "run", self.packing(x=((1, 1, 1), (1e308, -1e308, 1))))

    def test_not_a_whole_file(self):
        scene = self.packing()
        path = self.folder / "packing.h5"
        path.write_bytes(path.read_bytes()[:1000])
        self.refused(["packing.h5"], "run", scene)
        path.unlink()
        os.mkfifo(path)
        self.refused(["packing.h5", "is a FIFO, not a file"], "run", scene)

    def test_data_of_other_files(self):
        """A link to a FIFO would be waited for; any file of the reader's could get into results."""
        scene = self.packing()
        os.mkfifo(self.folder / "fifo.h5")
        secret = self.write("secret", "0123456789abcdef" * 3)
        with h5py.File(self.folder / "other.h5", "w") as other:
            other["x"] = np.array(((1.0, 1.0, 0.5), (3.0, 1.0, 0.5)))

        def external_storage(file):
            space = h5py.h5s.create_simple((2, 3))
            creation = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
            creation.set_external(str(secret).encode(), 0, 48)
            h5py.h5d.create(file.id, b"x", h5py.h5t.NATIVE_DOUBLE, space, creation)

        def virtual(source):
            def make(file):
                layout = h5py.VirtualLayout(shape=(2, 3), dtype="f8", maxshape=(None, 3))
                layout[: h5py.h5s.UNLIMITED :, :] = h5py.VirtualSource(str(source), "x", shape=(2, 3), maxshape=(None, 3))[: h5py.h5s.UNLIMITED :, :]
                file.create_virtual_dataset("x", layout)

            return make

        def link(to):
            return lambda file: file.__setitem__("x", to)

        def soft_to_external(file):
            file["there"] = h5py.ExternalLink("fifo.h5", "/")
            file["x"] = h5py.SoftLink("/there/x")

        for make, fragment in (
            (link(h5py.ExternalLink("fifo.h5", "/x")), "link"),
            (link(h5py.ExternalLink("other.h5", "/x")), "link"),
            (link(h5py.SoftLink("/radius")), "link"),
            (soft_to_external, "link"),
            (external_storage, "stored in another file"),
            (virtual("other.h5"), "stored in another file"),
            (virtual("fifo.h5"), "stored in another file"),
        ):
            self.packing()
            with h5py.File(self.folder / "packing.h5", "r+") as file:
                del file["x"]
                make(file)
            self.refused(["packing.h5: dataset 'x'", fragment], "run", scene)

    def test_many_coincident_grains(self):
        """All pairs of them would take gigabytes."""
        many = 20_000
        scene = self.packing(x=np.zeros((many, 3)) + (1, 1, 0.5), radius=np.full(many, 0.5))
        self.refused(["overlap by 200 %"], "run", scene, "--scheme", "dcs", "-n", 2)
        self.assertLess(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, 1_000_000)  # kB

    def test_many_grains_that_move_far(self):
        """Within a step all 2 million pairs could meet."""
        places = 1.1 * np.stack(np.meshgrid(*[np.arange(13.0)] * 3), -1).reshape(-1, 3)[:2000] + 0.5
        self.packing(x=places, radius=np.full(2000, 0.5))
        scene = self.write("scene.toml", PACKED.replace("-10]", "-1e9]"))
        self.refused(["more than 1500000 pairs of grains are closer than", "take a smaller step"], "run", scene, "--scheme", "dcs", "-n", 2)


class BadState(Refusals):
    def test_refused(self):
        path = self.folder / "state.h5"
        scene = self.scene()
        self.succeeds("run", scene, "--state", path)
        sound = path.read_bytes()
        for key, value, fragment in (
            ("step", np.int64(2**63 - 1), "attribute 'step': must lie in [0, "),
            ("step", np.int64(-1), "attribute 'step'"),
            ("time", np.nan, "attribute 'time': must be finite"),
        ):
            path.write_bytes(sound)
            with h5py.File(path, "r+") as state:
                state.attrs[key] = value
            self.refused(["state.h5", fragment], "run", scene, "--from", path)
        path.write_bytes(sound)
        more = SCENE[SCENE.index("[[grain]]") : SCENE.index("[[wall]]")]
        scene = self.scene("[[wall]]", more + "[[wall]]")
        for options in ((), ("--adopt",)):
            self.refused(["state.h5", "2 grains", "has 4"], "run", scene, "--from", path, *options)


class Numbers(Refusals):
    def test_ranges(self):
        """As people say them."""
        for value in ("0", "-3", "x", "1.5", "99999999999"):
            self.refused(["--steps: must be a whole number, at least 1", f"found {value}"], "run", self.scene(), "--steps", value)
        self.refused(["--window: must be a whole number, at least 0 and at most "], "run", self.scene(), "--window", -1)

    def test_subdomains(self):
        """A number that no memory holds is refused at once; what they take grows with their number, not with its square."""
        most = "must be a whole number, at least 1 and at most 65536, found 1000000000"
        self.refused([most], "run", self.scene(), "--scheme", "dcs", "-n", 1_000_000_000)
        for scheme in ("dcs", "ccs"):
            self.succeeds("run", self.scene(), "--scheme", scheme, "--steps", 1, "-n", 10_000, "--quiet", "--json", self.folder / "out.json")
            self.assertLess(json.loads((self.folder / "out.json").read_text())["peak_memory"]["largest"], 1e9, scheme)


class OnAllRanks(Refusals):
    """What each rank finds, what one of them alone finds, and what only their number makes wrong."""

    def test_refused(self):
        scene = self.scene()
        self.refused(["nowhere.toml"], "run", self.folder / "nowhere.toml", "--scheme", "dcs", ranks=2)
        self.refused(["no-folder"], "run", scene, "--scheme", "dcs", "--json", self.folder / "no-folder" / "out.json", ranks=2)
        self.refused(["--subdomains 1"], "run", scene, "--scheme", "dcs", "--subdomains", 1, ranks=2)
        self.refused(["--threads 2", "for 2 processes"], "run", scene, "--scheme", "dcs", "-n", 3, "--threads", 2, ranks=2)
        self.refused(["nlgs is sequential"], "run", scene, "--scheme", "nlgs", ranks=2)

    def test_options_that_are_wrong_before_mpi_is_used(self):
        self.refused(["--wrong was not expected"], "run", self.scene(), "--wrong", ranks=3)
        self.refused(["--scheme: foo not in"], "run", self.scene(), "--scheme", "foo", ranks=3)
        self.refused(["A subcommand is required"], ranks=3)
        right = [NSCDD, "run", self.scene(), "--scheme", "dcs"]  # and one rank alone has a wrong one
        done = subprocess.run([str(word) for word in (MPIRUN, "-np", 2, *right, ":", "-np", 1, *right, "--wrong")], capture_output=True, text=True, timeout=60)
        said = [line for line in done.stderr.splitlines() if line.startswith("nscdd: ")]
        self.assertEqual((done.returncode, said), (1, ["nscdd: --wrong was not expected; see run --help"]))

    def test_help_is_printed_once(self):
        for asked in (("--help",), ("run", "--help"), ("--version",)):
            self.assertEqual(self.succeeds(*asked, ranks=3).stdout, self.succeeds(*asked).stdout)

    def test_commands_of_one_process(self):
        """Each of three ranks would do the work, and write the same file."""
        scene, out = self.scene(), self.folder / "out"
        specification = self.write("pack.toml", "dimension = 2\ngrains = 20\ngenerator = 'own'\n")
        for name, *arguments in (
            ("pack", specification, "-o", out),
            ("compare", scene, scene, "--json", out),
            ("export-fclib", scene, "-o", out),
            ("solve-fclib", scene),
            ("calibrate", scene, "-o", out),
            ("scale", scene, "--ranks", 1, "--platform", scene, "--costs", scene, "--json", out),
        ):
            self.refused([f"{name} is of one process, and 3 were started: start it without mpirun"], name, *arguments, ranks=3)
        self.assertFalse(out.exists())
        self.succeeds("pack", specification, "-o", out, "--quiet", ranks=1)
        self.assertTrue(out.exists())

    def test_rows_that_one_rank_reads(self):
        """They are named by their number in the file."""
        places = np.stack((1.1 * np.arange(30) + 1, np.ones(30), np.full(30, 0.5)), -1)
        for row, ranks in ((2, 3), (25, 3), (29, 4)):
            bad = places.copy()
            bad[row, 1] = np.nan
            self.refused(
                [f"packing.h5: dataset 'x': row {row} is not finite, found nan"],
                "run",
                self.packing(x=bad, radius=np.full(30, 0.5)),
                "--scheme",
                "dcs",
                ranks=ranks,
            )
        scene, state = self.packing(x=places, radius=np.full(30, 0.5)), self.folder / "state.h5"
        self.succeeds("run", scene, "--scheme", "dcs", "--state", state, "--quiet", ranks=3)
        with h5py.File(state, "r+") as file:
            file["material"][28] = 7
        self.refused(["state.h5: dataset 'material': row 28 must lie in [0, 0], found 7"], "run", scene, "--scheme", "dcs", "--from", state, ranks=3)

    def told_by(self, *starts):
        words = [word for start in starts for word in (":", *start)][1:]
        done = subprocess.run([MPIRUN, *map(str, words)], capture_output=True, text=True, timeout=60)
        return done.returncode, [line for line in done.stderr.splitlines() if line.startswith("nscdd: ")]

    def test_ranks_of_different_runs(self):
        """They would wait for each other without end."""
        first = [NSCDD, "run", self.scene(), "--quiet", "--scheme", "dcs"]
        out = self.folder / "out"
        for other in (
            [*first[:-1], "ccs"],
            [*first, "--series", f"{out}.csv"],
            [*first, "--repeat", 2],
            [*first, "--within-node", "messages"],
            [*first, "--checkpoint", f"{out}.h5"],
            [NSCDD, "--help"],
            [NSCDD, "run", "--help"],
            [NSCDD, "--version"],
        ):
            with self.subTest(other=other[1:]):
                self.assertEqual(self.told_by(["-np", 1, *first], ["-np", 1, *other]), (1, ["nscdd: ranks were started with different scenes or options"]))
                self.assertEqual(self.told_by(["-np", 1, *other], ["-np", 1, *first])[0], 1)
        self.assertEqual([path.name for path in self.folder.iterdir()], ["scene.toml"])

    def test_ranks_that_read_different_files(self):
        """One name, and another content where the second rank is."""
        scene, folder = self.scene(), self.folder / "other"
        folder.mkdir()
        (folder / "scene.toml").write_text(scene.read_text().replace("friction = 0.3", "friction = 0.4"))
        command = ["-np", "1", NSCDD, "run", "scene.toml", "--scheme", "dcs", "--quiet"]
        here, there = ["-wdir", self.folder, *command], ["-wdir", folder, *command]
        different = "nscdd: ranks were started with different contents of {}"
        self.assertEqual(self.told_by(here, there), (1, [different.format("the scene, scene.toml")]))
        self.succeeds("run", scene, "--quiet", "--scheme", "dcs", "--state", self.folder / "state.h5", ranks=2)
        self.succeeds("run", scene, "--quiet", "--scheme", "dcs", "--steps", 1, "--state", folder / "state.h5", ranks=2)
        (folder / "scene.toml").write_text(scene.read_text())
        self.assertEqual(self.told_by([*here, "--from", "state.h5"], [*there, "--from", "state.h5"]), (1, [different.format("--from, state.h5")]))

    def test_overlap_on_one_rank(self):
        scene = self.packing(x=np.concatenate((np.zeros((50, 3)) + (1, 1, 0.5), [(3, 1, 0.5)])), radius=np.full(51, 0.5))
        self.refused(["overlap by 200 %"], "run", scene, "--scheme", "dcs", ranks=2)

    def test_more_subdomains_than_contacts_is_valid(self):
        scene = self.scene()
        self.succeeds("run", scene, "--scheme", "dcs", "--subdomains", 16)
        self.succeeds("run", scene, "--scheme", "ccs", ranks=4)


if __name__ == "__main__":
    unittest.main()
