"""The gallery: its scenes and what stands beside them, its measures on made-up results, its page of the manual, and pictures."""
import json
import math
import re
import tomllib
import unittest

import h5py
import numpy as np

from harness import ROOT, ProgramTest, run_suite
from nscdd_suite.page import picture
from nscdd_suite.page.load import Record, Results
from nscdd_suite.page.tables import number
from nscdd_suite.record import InputError
from nscdd_suite.studies import gallery
from nscdd_suite.studies.gallery import SCENES, Gallery, measures, section
from PIL import Image

PAGE = (ROOT / "manual/18-gallery.md").read_text()
RECORD = json.loads((ROOT / "reports/results/gallery.json").read_text())


def longer_side(path):
    with Image.open(path) as image:
        return max(image.size)


class Scenes(unittest.TestCase):
    def test_each_has_a_scene_of_a_screen_a_packing_and_a_published_number(self):
        published, cases = gallery.published(), ROOT / "cases/gallery"
        self.assertEqual(set(SCENES), {path.stem for path in cases.glob("*.toml")} - {"published"})
        self.assertEqual((set(SCENES), set(SCENES)), (set(published), {path.stem for path in (cases / "packings").glob("*.toml")}))
        for name in SCENES:
            self.assertLessEqual(len(gallery.case(name).splitlines()), 60, name)
            self.assertEqual(set(published[name]), {"title", "quantity", "law", "source", "rule"}, name)

    def test_further_runs_differ_from_their_scene_in_what_is_said(self):
        wide = tomllib.loads(gallery.changed("silo", SCENES["silo"].more["16"]))
        ends = [part["points"] for part in wide["obstacle"]]
        self.assertEqual(ends[1][0][0] - ends[0][1][0], 16)
        for name, scene in SCENES.items():
            for changes in scene.more.values():
                self.assertNotEqual(gallery.changed(name, changes), gallery.case(name))
        with self.assertRaisesRegex(InputError, "silo.toml: 'nowhere' is there 0 times, not once"):
            gallery.changed("silo", (("nowhere", ""),))


class Measures(ProgramTest):
    def series(self, name, **columns):
        rows = zip(*columns.values())
        self.write(f"{name}.csv", "\n".join([",".join(columns), *(",".join(map(str, row)) for row in rows)]) + "\n")
        return self.folder / name

    def found(self, measure, *arguments):
        """(ours, whether it is within what is allowed)"""
        ours, low, high, law, *_ = measure(*arguments)
        self.assertTrue(low <= law <= high)
        return ours, low <= ours <= high

    def silo(self, power):
        packing = self.folder / "silo-packing.h5"
        with h5py.File(packing, "w") as file:
            file["radius"] = np.full(1000, 0.5)
        time = np.arange(1, 101)
        for width, name in ((10, "silo"), (8, "silo-8"), (12, "silo-12"), (16, "silo-16")):
            mass = np.minimum(0.1 * (width - 1.4) ** power * time, math.pi * 250)
            self.series(name, time=time, mass_removed=mass)
        return self.found(measures.silo, self.folder / "silo", packing)

    def test_the_power_of_an_orifice(self):
        ours, within = self.silo(1.5)
        self.assertAlmostEqual(ours, 1.5, delta=1e-9)
        self.assertTrue(within)
        self.assertFalse(self.silo(1.0)[1] or self.silo(2.0)[1])

    def shearbox(self, ratio):
        """Most of the force is on the bottom; before it is steady it is another."""
        columns = {"time": range(9)}
        for part, share in (("bottom", 0.9), ("lower left", 0.0), ("lower right", 0.1)):
            columns[f"obstacle_force_{part}_x"] = [share] * 3 + [share * ratio] * 6
            columns[f"obstacle_force_{part}_y"] = [-share] * 9
        return self.found(measures.shearbox, self.series("shearbox", **columns), None)

    def test_the_angle_of_a_shear_box(self):
        ours, within = self.shearbox(0.3)
        self.assertAlmostEqual(math.tan(math.radians(ours)), 0.3, delta=1e-12)
        self.assertTrue(within)
        self.assertFalse(self.shearbox(0.2)[1] or self.shearbox(0.4)[1])

    def bed(self, name, slopes):
        """Frames of one grain in a drum about (2, 3), and of a rim."""
        with h5py.File(self.folder / f"{name}.frames.h5", "w") as file:
            for step, slope in enumerate(np.radians(slopes)):
                file[f"step_{step:010}/grains/x"] = [[2 + 5 * math.sin(slope), 3 - 5 * math.cos(slope), 0]]
                file[f"step_{step:010}/grains/radius"] = [0.5]
                file[f"step_{step:010}/walls/points"] = [[-8, 3, 0], [2, 13, 0], [12, 3, 0], [2, -7, 0]]

    def drum(self, highest):
        rise = np.concatenate([np.linspace(20, top, 9) for top in (highest - 1, highest, highest + 1)] + [[20]])
        for name, slopes in (("drum", rise), ("drum-0.03", [30] * 5), ("drum-0.3", [0, 40, 40])):
            self.bed(name, slopes)
        return self.found(measures.drum, self.folder / "drum", None)

    def test_the_slope_of_avalanches(self):
        ours, within = self.drum(30)
        self.assertAlmostEqual(ours, 30, delta=1e-9)
        self.assertTrue(within)
        self.assertFalse(self.drum(25)[1] or self.drum(35)[1])
        note = measures.drum(self.folder / "drum", None)[4]
        self.assertIn("3 avalanches", note)
        self.assertIn("30.0 at 0.03; 40.0 at 0.3", note)
        self.bed("drum", [30] * 9)
        self.assertTrue(math.isnan(measures.drum(self.folder / "drum", None)[0]), "without an avalanche there is no slope of one")


class Suite(ProgramTest):
    def test_quick_runs_make_a_record_pictures_and_a_section(self):
        done = run_suite("run", "gallery", "--quick", "--results", self.folder, "--only", "silo|vibrated")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        record = json.loads((self.folder / "gallery.json").read_text())
        self.assertEqual([row["scene"] for row in record["rows"]], ["silo", "vibrated"])
        for name in ("silo", "vibrated"):
            self.assertAlmostEqual(longer_side(self.folder / f"gallery/quick/{name}.png"), 480, delta=48, msg=name)
        self.assertIn("cannot be told", self.section(record))

    def section(self, record):
        return "".join(part if isinstance(part, str) else part.html() for part in Gallery().section(Results("", {"gallery": [Record(record)]}), self.folder))

    def test_the_section_says_what_is_not_within(self):
        self.assertNotIn("not within", self.section(RECORD))
        rows = [row | {"ours": 2.0, "within": False} if row["scene"] == "silo" else row for row in RECORD["rows"]]
        self.assertIn('<td class="bad">not within</td>', self.section(RECORD | {"rows": rows}))
        self.assertTrue(Gallery().passes(RECORD))
        self.assertFalse(Gallery().passes(RECORD | {"rows": rows}))
        self.assertIn(
            "silo: power of the width of the orifice, less 1.4 diameters, with which disks leave: 2, published 1.5, NOT WITHIN 1.35 to 1.65",
            list(Gallery().told(RECORD | {"rows": rows})),
        )


class Page(unittest.TestCase):
    def test_numbers_are_those_of_the_record(self):
        self.assertEqual({row["scene"] for row in RECORD["rows"]}, set(SCENES))
        for row in RECORD["rows"]:
            line = re.search(rf"^\| \[{row['scene']}\]\(#.*$", PAGE, re.M)[0].replace("\u00b0", "")
            ours, published, allowed, verdict = (cell.strip() for cell in line.split("|")[2:6])
            self.assertEqual((ours, published), (number(row["ours"]), number(row["published"])), line)
            self.assertEqual(allowed, " to ".join(map(number, row["allowed"].values())), line)
            self.assertEqual(verdict, "within" if row["within"] else "not within", line)

    def test_each_scene_has_a_small_picture_and_its_command(self):
        for name in SCENES:
            self.assertIn(f"(pictures/{name}.png)", PAGE)
            self.assertIn(f"`scripts/suite run gallery --only {name}`", PAGE)
            self.assertLess((ROOT / f"manual/pictures/{name}.png").stat().st_size, 60_000, name)


class Pictures(ProgramTest):
    def test_a_picture_is_as_large_as_asked_and_of_its_frame(self):
        scene = self.write("scene.toml", (ROOT / "cases/hard/column-10-2d.toml").read_text())
        frames = self.folder / "frames.h5"
        self.succeeds("run", scene, "--quiet", "--steps", 4, "--frame-every", 2, "--frames", frames)
        for size in (200, 500):
            picture.draw(frames, self.folder / "out.png", None, "speed", 10, size)
            self.assertAlmostEqual(longer_side(self.folder / "out.png"), size, delta=0.1 * size)
        with self.assertRaisesRegex(InputError, "frames.h5 has 2 frames, counted from 0: there is no frame 2"):
            picture.draw(frames, self.folder / "out.png", 2, "speed", 10)


if __name__ == "__main__":
    unittest.main()
