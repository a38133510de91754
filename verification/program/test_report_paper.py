"""The section of the page on the paper, on a made-up record: no value here was ever counted, simulated or measured."""
import contextlib
import copy
import io
import json
import re
import shlex
import tempfile
import unittest
from pathlib import Path

import h5py
import harness
import numpy as np
from nscdd_suite import cli
from nscdd_suite.page import style
from nscdd_suite.studies.paper import figures as paper_figures
from nscdd_suite.studies.paper import Paper as Study
from nscdd_suite.studies.paper import network
from nscdd_suite.studies.paper import rows as paper_rows
from nscdd_suite.studies.paper import tables as paper_tables
from nscdd_suite.studies.paper.data import Paper
from nscdd_suite.studies.paper.made_up import COUNTS, paper, run, window, write_network
from nscdd_suite.studies.paper.verdicts import AGREES, DIFFERS, UNTOLD, verdicts
from nscdd_suite.study import Plan


class Case(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder, self.out = Path(temporary.name, "results"), Path(temporary.name, "out")
        (self.folder / "paper").mkdir(parents=True)
        write_network(self.folder / "paper/fig1-network.h5")

    def report(self, record):
        (self.folder / "paper.json").write_text(json.dumps(record))
        errors = io.StringIO()
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(errors):
            code = cli.main(["report", str(self.folder), "--out", str(self.out)])
        return code, errors.getvalue()

    def page(self):
        return (self.out / "index.html").read_text()

    def assert_one_line(self, record, *words):
        code, errors = self.report(record)
        self.assertEqual((code, len(errors.strip().splitlines())), (1, 1), errors)
        for word in words:
            self.assertIn(word, errors)
        self.assertFalse((self.out / "index.html").exists())


class Page(Case):
    def test_sections_appear_with_their_marks(self):
        self.assertEqual(self.report(paper()), (0, ""))
        page = self.page()
        for title in (
            "Share of time in MPI (Table 1 of the paper)",
            "Real ranks",
            "Multiplicities before and after the narrow phase (Fig. 1 of",
            "Biaxial test: speed-up and iterations (Fig. 3",
            "Triaxial test: speed-up and iterations (Fig. 4",
            "Minimal and predicted interface",
            "One draw or another",
            "Biaxial test: partitions, methods",
            "Triaxial test, every simulated point",
            "Whole runs",
            "Packings",
            "Variations",
            "Agreement of one step",
        ):
            self.assertRegex(page, r"<figcaption><b>(Table|Fig\.) 1\.\d+\. " + re.escape(title))
        self.assertNotIn('id="paper-fig-2"', page)  # its state is not there
        self.assertLess(page.index('id="verdicts"'), page.index('aria-label="Contents"'))
        for anchor in re.findall('href="#([^"]*)"', page):
            self.assertIn(f'id="{anchor}"', page)
        marks = dict(re.findall(r'<figcaption><b>[^<]*?\. ([^<]*)\.</b> <span class="tag (\w+)">', page))
        self.assertEqual(marks["Share of time in MPI (Table 1 of the paper)"], "simulated")
        self.assertEqual(marks["Real ranks"], "measured")
        self.assertEqual(marks["Whole runs"], "counted")
        self.assertIn(
            '<td class="faint">31.3</td><td class="faint">14.0</td><td class="strong">30.0</td><td>25.0</td><td>5.0</td>'
            '<td class="strong">14.0</td><td>9.0</td><td>5.0</td>',
            page,
        )
        summary = json.loads((self.out / "summary.json").read_text())["statements"]
        self.assertEqual([one["verdict"] for one in summary].count(AGREES), 18)
        self.assertEqual([one["verdict"] for one in summary].count(UNTOLD), 2)

    def test_times_of_a_busy_machine_make_no_speed_up(self):
        record = paper()
        for row in record["measured"]:
            row["cores"] = 1.0 if row["scheme"] == "nlgs" or row["scene"] == "triaxial" else 0.9
        rows = {(row["scene"], row["scheme"]): speed_up for row, speed_up in Paper(record).measured()}
        self.assertEqual((rows["triaxial", "dcs"], rows["biaxial", "dcs"]), (2.0, None))
        self.assertEqual(paper_tables.measured(Paper(record)).count("busy: 90 % of a core"), len({scene for scene, _ in rows} - {"triaxial"}))

    def test_another_packing_is_told(self):
        accepted = json.loads((harness.ROOT / "cases/packings/accepted.json").read_text())
        self.assertEqual(set(accepted), {"isotropic", "biaxial", "triaxial"})
        rows = [{"scene": scene, **row} for scene, row in accepted.items()]
        self.assertEqual(list(paper_rows.other_packings(rows)), [])
        self.assertEqual(list(paper_rows.other_packings([rows[0] | {"checksum": "other", "grains": 300}])), [])  # a quick one
        self.assertEqual(
            list(paper_rows.other_packings([rows[0] | {"checksum": "other", "source": "another LAMMPS"}])),
            [
                f"packing of {rows[0]['scene']}, made by another LAMMPS: not the accepted one, which was made by {rows[0]['source']}; "
                "counts are not those of the record"
            ],
        )
        self.assertIn("not the accepted one; counts", *paper_rows.other_packings([rows[0] | {"checksum": "other"}]))

    def test_axes_say_what_is_simulated_and_counted(self):
        figure, _ = paper_figures.draw_scene(Paper(paper()), "biaxial", False)
        self.assertEqual([re.findall("SIMULATED|counted|measured", axis.get_ylabel()) for axis in figure.axes], [["SIMULATED"], ["counted"]])
        style.plt.close(figure)

    def test_ideal_speed_up_is_the_number_of_processes_on_every_axis(self):
        figures = [paper_figures.draw_scene(Paper(paper()), "biaxial", False)[0], paper_figures.draw_beyond(Paper(paper()), "triaxial")]
        drawn = 0
        for figure in figures:
            figure.canvas.draw()
            for axis in figure.axes:
                for line in axis.lines:
                    if line.get_label() != "ideal":
                        continue
                    drawn += 1
                    seen = axis.transData.transform(line.get_xydata())  # as on the page, where points are joined by straight lines
                    for n in np.linspace(1, line.get_xdata().max(), 7):
                        here = axis.transData.transform((n, n))
                        at = np.interp(here[0], *seen.T)
                        self.assertAlmostEqual(axis.transData.inverted().transform((here[0], at))[1] / n, 1, delta=0.01)
            style.plt.close(figure)
        self.assertGreaterEqual(drawn, 3)

    def test_at_most_eight_curves(self):
        figure = paper_figures.draw_beyond(Paper(paper()), "triaxial")
        self.assertLessEqual(max(len(axis.lines) for axis in figure.axes), 8)
        style.plt.close(figure)

    def test_quick_record_is_told(self):
        self.report(paper(quick=True))
        self.assertIn("its verdicts say nothing of the paper", self.page())

    def test_bound_exceeded_fails_the_page(self):
        record = paper()
        record["agreement"][0]["rows"][0].update(value=0.5)
        code, errors = self.report(record)
        self.assertEqual(code, 1)
        self.assertIn("paper: triaxial dcs grid 2x2x2, one step: velocities 0.5 exceeds 0.03", errors)

    def test_steps_not_converged_fail_the_page_but_in_variations(self):
        record = paper()
        next(run for run in record["runs"] if run["variation"])["unconverged_steps"] = 1
        self.assertEqual(self.report(record)[0], 0)
        record["runs"][0]["unconverged_steps"] = 1
        self.assertIn("not converged in 1 of 2 steps", self.report(record)[1])

    def test_a_record_of_several_commits_says_so(self):
        record = paper(commits=["old", "new-dirty"], commit="new-dirty")
        for entry in (entry for kind in ("packings", "runs", "agreement", "windows", "measured") for entry in record[kind]):
            entry["commit"] = "old"
        record["windows"][0]["commit"] = "new-dirty"
        self.assertEqual(self.report(record), (0, ""))
        self.assertIn("<b>Rows of 2 commits:</b> new-dirty, old.", self.page())
        self.assertRegex(self.page(), r"Packings\.</b>[\s\S]*?commit old\.")

    def test_commands_that_made_the_start_stand_before_the_run(self):
        record = paper()
        record["runs"][0]["start"] = ["nscdd run FABRICATED START"]
        self.report(record)
        page = self.page()
        self.assertLess(page.index("FABRICATED START"), page.index("nscdd run FABRICATED isotropic nlgs"))

    def test_what_is_not_there_is_left_out(self):
        empty = {key: [] for key in ("packings", "runs", "windows", "measured", "agreement")}
        self.assertEqual(self.report(paper(**empty)), (0, ""))
        self.assertEqual(
            re.findall("<figcaption><b>([^<]*)", self.page()), ["Fig. 1.1. Multiplicities before and after the narrow phase (Fig. 1 of the paper)."]
        )


class Verdicts(unittest.TestCase):
    def judge(self, record, counts=COUNTS):
        return {one.statement: one for one in verdicts(Paper(record), counts)}

    def one(self, words, *arguments):
        return next(one for statement, one in self.judge(*arguments).items() if words in statement)

    def test_each_flips_when_its_numbers_are_made_worse(self):
        def windows(change, **which):
            def apply(record):
                for entry in record["windows"]:
                    if all(entry[key] == value for key, value in which.items()):
                        entry.update(change(entry))

            return apply

        def runs(change, **which):
            def apply(record):
                for entry in record["runs"]:
                    if all(entry[key] == value for key, value in which.items()) and not entry["variation"]:
                        entry.update(change(entry))

            return apply

        def times(factor):
            return lambda entry: {"seconds_per_iteration": factor * entry["seconds_per_iteration"]}

        def sent(operation, **more):
            return lambda entry: {"operations": entry["operations"] | {operation: entry["operations"][operation] | more}}

        def longer(entry):
            return {"iterations": [2 * k for k in entry["iterations"]]}

        cases = (
            ("DCS spends a smaller share", windows(lambda _: {"mpi_share": 0.7}, scheme="dcs", subdomains=4)),
            ("Order of magnitude, present cores", windows(lambda _: {"mpi_share": 0.01}, scene="isotropic", scheme="ccs", slower=1)),
            ("Order of magnitude, cores three times", windows(lambda _: {"mpi_share": 0.9}, scheme="dcs", slower=3)),
            ("does not depend on the communication", runs(longer, scene="triaxial", scheme="ccs", subdomains=8)),
            ("nearly constant", runs(longer, scene="biaxial", subdomains=48)),
            ("does not change drastically", windows(times(2), scene="biaxial", scheme="ccs", subdomains=8)),
            ("very poor efficiency", windows(times(0.02), scheme="ccs", subdomains=48)),
            ("good quantitative behaviour", windows(times(3), scene="triaxial", scheme="dcs", subdomains=48)),
            ("About a hundred", windows(times(10), scene="million", subdomains=128)),
            ("avoids collective", windows(sent("reduction", messages=6), scheme="dcs", subdomains=4)),
            ("especially expensive", windows(sent("gather", wait_share=0.9), scheme="ccs", subdomains=8, slower=3)),
            ("the share in MPI of CCS grows", windows(lambda _: {"mpi_share": 0.3}, scheme="ccs", subdomains=8)),
            ("partially in parallel", windows(lambda _: {"wait_share": 0.01}, scheme="ccs", subdomains=8)),
            ("hardest mechanical", runs(longer, scene="isotropic", scheme="nlgs")),
            ("other hardware", windows(times(1.3), scene="triaxial", scheme="dcs", latency=0.5)),
            ("contact unknowns", runs(lambda _: {"unknowns_mean": 1e6}, scene="triaxial", scheme="nlgs")),
        )
        for words, worsen in cases:
            with self.subTest(words):
                self.assertEqual(self.one(words, paper()).verdict, AGREES)
                record = copy.deepcopy(paper())
                worsen(record)
                found = self.one(words, record)
                self.assertEqual(found.verdict, DIFFERS)
                self.assertTrue(found.why and found.rule and found.finding)
        self.assertEqual(self.one("minimal interface", paper(), COUNTS | {"not_boundary": 0}).verdict, DIFFERS)

    def test_predicted_interface_agrees_if_steps_keep_their_bounds_and_more_is_sent(self):
        words = "Gluing predicted grains"
        self.assertEqual(self.one(words, paper()).verdict, AGREES)
        record = paper()
        record["agreement"][1]["rows"][0]["ok"] = False
        self.assertEqual(self.one(words, record).verdict, DIFFERS)
        record = paper()
        next(run for run in record["runs"] if run.get("multiplicity") == "predicted")["bytes_per_iteration"] = 1
        self.assertEqual(self.one(words, record).verdict, DIFFERS)

    def test_what_chance_makes_is_no_difference(self):
        record = paper()
        for entry in record["runs"]:
            if entry["scene"] == "biaxial" and entry["subdomains"] == 48:
                entry["iterations"] = [1180, 1180]  # 18 % above NLGS
        self.assertEqual(self.one("nearly constant", record).verdict, DIFFERS)
        next(run for run in record["runs"] if run.get("perturbed") == 3 and run["scheme"] == "dcs")["iterations"] = [1200, 1200]
        self.assertEqual(self.one("nearly constant", record).verdict, AGREES)

    def test_records_made_before_say_that_it_was_not_run(self):
        record = paper()
        record["runs"] = [run for run in record["runs"] if not run.get("perturbed") and run.get("multiplicity") != "predicted" and run["scene"] != "million"]
        for entry in record["windows"]:
            entry.pop("operations", None)
        for words in ("nearly constant", "Gluing predicted grains", "avoids collective", "especially expensive", "About a hundred"):
            found = self.one(words, record)
            self.assertEqual(found.verdict, UNTOLD)
            self.assertIn("not run", found.why)

    def test_schemes_of_two_commits_are_not_compared(self):
        record = paper()
        for entry in record["runs"]:
            entry["commit"] = entry["scheme"]
        self.assertEqual(self.one("does not depend on the communication", record).verdict, UNTOLD)

    def test_predicted_runs_are_in_no_other_curve(self):
        data, wide = Paper(paper()), Paper(paper(), "predicted")
        self.assertAlmostEqual(data.curve("triaxial", "paper", "dcs", "grid")[8].seconds, 135e-6)
        self.assertEqual([(n, point.seconds) for n, point in wide.curve("triaxial", "paper", "dcs", "grid").items()], [(8, 150e-6)])

    def test_a_hundred_processors_are_judged_by_a_million_spheres_on_the_nearest_number(self):
        record = paper()
        record["runs"].append(run("million", "dcs", "bisection", 64))
        record["windows"].append(window("million", "dcs", "bisection", 64, platform="cluster"))
        for entry in record["windows"]:
            if (entry["scene"], entry["subdomains"]) == ("triaxial", 128):
                entry["seconds_per_iteration"] *= 10
        self.assertEqual(self.one("About a hundred", record).verdict, AGREES)  # whatever the smaller problem does
        for entry in record["windows"]:
            if (entry["scene"], entry["subdomains"]) == ("million", 128):
                entry["seconds_per_iteration"] *= 10
        found = self.one("About a hundred", record)
        self.assertEqual(found.verdict, DIFFERS)
        for words in (" on 64 (efficiency", " on 128 (efficiency", "on which the statement is not"):
            self.assertIn(words, found.finding)

    def test_collective_messages_of_dcs_are_named(self):
        record = paper()
        for entry in record["windows"]:
            if entry["subdomains"] > 1:
                entry["operations"]["reduction"]["messages"] = 12
        found = self.one("avoids collective", record)
        self.assertEqual(found.verdict, DIFFERS)
        for words in ("DCS 12 of 14 on 3", "CCS 16 of 16 on 3"):
            self.assertIn(words, found.finding)
        self.assertIn("are of: reduction.", found.why)
        self.assertIn("CCS gathers and scatters besides", found.why)

    def test_how_slow_and_how_exact_a_run_was_stands_in_the_table_of_scenes(self):
        record = paper()
        next(run for run in record["runs"] if run["scene"] == "triaxial").update(inertial_number=3.1e-4, largest_overlap=2e-5)
        triaxial = next(row for row in paper_tables.scenes(Paper(record)).split("<tr>") if ">triaxial<" in row)
        cells = re.findall("<td[^>]*>(.*?)</td>", triaxial)
        self.assertEqual((cells[0], cells[6], cells[7]), ("triaxial", "3.1\u202f\u00d7\u202f10\u207b\u2074", "2\u202f\u00d7\u202f10\u207b\u2075"))

    def test_without_numbers_nothing_can_be_told(self):
        empty = paper(**{key: [] for key in ("runs", "windows")})
        for one in self.judge(empty, None).values():
            self.assertEqual(one.verdict, UNTOLD, one.statement)

    def test_speed_up_is_at_equal_error(self):
        record = paper()
        point = Paper(record).curve("triaxial", "paper", "dcs", "grid")[8]
        self.assertAlmostEqual(point.iteration_efficiency, 1e-3 / (8 * 135e-6))
        self.assertAlmostEqual(point.speed_up, 1e-3 / 135e-6 * 1200 / 1228)
        self.assertAlmostEqual(point.low, 1e-3 / 145e-6 * 1200 / 1228)
        self.assertEqual(point.high, point.speed_up)

    def test_of_several_splittings_the_line_takes_that_of_fewest_shared_grains(self):
        record = paper()
        record["runs"].append(run("biaxial", "dcs", "grid 8x1", 8) | {"interface_grains": 9e3})
        record["windows"].append(window("biaxial", "dcs", "grid 8x1", 8))
        data = Paper(record)
        self.assertEqual(data.curve("biaxial", "paper", "dcs", "grid")[8].partition, "grid 4x2")
        self.assertEqual(len([p for p in data.points("biaxial", "paper", "dcs", "grid") if p.n == 8]), 2)

    def test_sequential_iteration_takes_the_same_on_the_cluster(self):
        record = paper()
        with_own = Paper(record).curve("triaxial", "paper", "dcs", "metis", "cluster")[8].speed_up
        record["windows"] = [w for w in record["windows"] if (w["platform"], w["subdomains"]) != ("cluster", 1)]
        self.assertEqual(Paper(record).curve("triaxial", "paper", "dcs", "metis", "cluster")[8].speed_up, with_own)

    def test_variation_is_compared_with_the_scene_as_it_is(self):
        cells = re.findall("<td[^>]*>(.*?)</td>", paper_tables.variations(Paper(paper())))
        self.assertEqual((cells[1], cells[10]), ("h = 0.1", "1"))

    def test_variation_of_few_steps_is_compared_with_as_many_or_with_its_own_start(self):
        record = paper()
        record["runs"][0] |= {"iterations": [100, 300]}  # isotropic, NLGS
        few = run("isotropic", "nlgs", "none", 1, variation="h = 0.1", steps=1, contacts=[1])
        data = Paper(record)
        self.assertEqual(data.unvaried(few), 100)
        end = few | {"variation": "h = 0.1, from the end"}
        self.assertIsNone(data.unvaried(end))
        record["runs"].append(end | {"variation": "as it is, from the end", "iterations": [50]})
        self.assertEqual(data.unvaried(end), 50)


class Network(Case):
    def test_wrong_predictions_are_found(self):
        drawn = network.predict(self.folder / "paper/fig1-network.h5")
        self.assertEqual(list(drawn["predicted"]), [2, 1, 2, 1])  # the edge of the upper two is of subdomain 1, that of the left two of 0
        found = network.counts(drawn)
        self.assertEqual((found["candidates"], found["wrong"], found["not_boundary"]), (4, 1, 1))

    def test_a_grid_owns_points_as_the_kernel_says(self):
        grid = np.array([[2, 2], [0, 0], [2.0, 1.0]])
        self.assertEqual(list(network.owners(grid, np.array([[0.5, 0.2], [1.5, 0.2], [0.5, 0.5], [2.5, 0.7]]))), [0, 1, 2, 3])

    def test_damaged_state_is_one_line(self):
        path = self.folder / "paper/fig1-network.h5"
        with h5py.File(path, "a") as file:
            del file["rough/skin"]
        self.assert_one_line(paper(), "fig1-network.h5", "broad phase")


class Rows(unittest.TestCase):
    """What the study writes down."""

    def test_rows_replace_the_same_rows_of_an_earlier_record(self):
        earlier = paper(commits=["fabricated"])
        again = run("biaxial", "nlgs", "none", 1) | {"iterations": [1, 1], "commit": "new", "multiplicity": "minimal", "perturbed": 0}
        later = paper(
            runs=[again, again | {"perturbed": 9}], windows=[], measured=[], agreement=[], packings=[], command="scripts/suite run paper --only chance"
        )
        merged = paper_rows.merge(earlier, later)
        self.assertEqual([entry["iterations"] for entry in merged["runs"] if Paper.key(entry) == Paper.key(again) and not entry.get("perturbed")], [[1, 1]])
        self.assertEqual(len(merged["runs"]), len(earlier["runs"]) + 1)
        self.assertEqual(merged["windows"], earlier["windows"])
        self.assertEqual(merged["commits"], ["new"])
        self.assertEqual(merged["command"], "scripts/suite run paper FABRICATED; scripts/suite run paper --only chance")
        with self.assertRaisesRegex(ValueError, "quick"):
            paper_rows.merge(earlier, later | {"quick": True})
        elsewhere = later | {"machine": later["machine"] | {"cpu": "another"}}
        self.assertEqual(paper_rows.merge(earlier, elsewhere | {"measured": []})["machine"], earlier["machine"])
        self.assertEqual(len(paper_rows.merge(earlier, elsewhere | {"measured": []})["counted_on"]), 2)
        for refused in (elsewhere | {"measured": earlier["measured"]}, later | {"machine": later["machine"] | {"fused": False}}):
            with self.assertRaises(ValueError):
                paper_rows.merge(earlier, refused)

    def test_commands_of_bands_have_the_factors_that_were_run(self):
        told = {
            "seconds_per_iteration": 1e-3,
            "per_iteration": {"wait": {"mean": 1e-4}, "transfer": {"mean": 1e-4}},
            "commit": "fabricated",
            "command": "nscdd_simulated window FABRICATED.toml",
        }
        with tempfile.TemporaryDirectory() as name:
            path = Path(name, "window.json")
            path.write_text(json.dumps(told))
            rows = [
                paper_rows.window_row(path, {"subdomains": 48, "platform": "node48", "latency": latency, "bandwidth": bandwidth})
                for latency, bandwidth in ((1, 1), (2, 1), (1, 0.5))
            ]
            plan = Plan(Path(name), "paper")
            plan.folder.mkdir()
            Study().jobs(plan)
        plain, latency, bandwidth = (made["command"] for made in rows)
        self.assertNotIn("--cfg", plain)
        self.assertIn("--cfg=smpi/lat-factor:0:2", latency)
        self.assertIn("--cfg=smpi/bw-factor:0:0.5", bandwidth)
        run = next(job.commands[0] for job in plan.jobs if job.outputs[0].endswith("biaxial-paper-dcs-grid-4x12-48-node48-1-2-1-0.json"))
        words = shlex.split(latency)
        self.assertEqual(words[:-3], run[: len(words) - 3])


class Input(Case):
    def test_malformed_records_are_one_line(self):
        record = paper()
        record["windows"][3]["mpi_share"] = 1.5
        self.assert_one_line(record, "paper.json", "windows/3/mpi_share", "1.5")
        record = paper()
        record["runs"][2]["iterations"] = [1]
        self.assert_one_line(record, "paper.json", "runs/2/iterations", "1 entries for 2 steps")
        record = paper()
        del record["platform"]
        self.assert_one_line(record, "paper.json", "'platform'")


if __name__ == "__main__":
    unittest.main()
