"""The page of a folder of results, on made-up ones: no value here was ever measured."""
import contextlib
import io
import json
import re
import tempfile
import unittest
from pathlib import Path

import h5py
import harness  # noqa: F401  (sets the path of nscdd_suite)
import numpy as np
from nscdd_suite import cli
from nscdd_suite.page import packings, tables
from nscdd_suite.page.load import load
from nscdd_suite.studies.acceleration import section as acceleration_section
from nscdd_suite.studies.acceleration.made_up import acceleration
from nscdd_suite.studies.accuracy import figures
from nscdd_suite.studies.accuracy.levels import at_level
from nscdd_suite.studies.accuracy.made_up import accuracy
from nscdd_suite.studies.bits import section as same_bits
from nscdd_suite.studies.bits.made_up import bits
from nscdd_suite.studies.hard import section as hard_cases
from nscdd_suite.studies.hard.made_up import hard
from nscdd_suite.studies.peers import section as peers
from nscdd_suite.studies.problems.made_up import problems
from nscdd_suite.studies.problems.section import said
from nscdd_suite.studies.reduced import section as of_runs
from nscdd_suite.studies.reduced.made_up import compare, fabricate
from nscdd_suite.studies.reduced.runs import Runs
from nscdd_suite.studies.rheology.made_up import rheology
from nscdd_suite.studies.velocity_error import section as velocity
from nscdd_suite.studies.velocity_error.made_up import velocity_error
from nscdd_suite.studies.wild import section as random_scenes
from nscdd_suite.studies.wild.made_up import wild


def counted(**changed):
    """Two of three counted numbers are those of the record."""
    made = {"schema": "nscdd.counted/1", "records": ["hard"], "same": 2, "of": 3, "not_in_the_record": 0, "missing": 0}
    made |= {"differ": [{"name": "hard: column nlgs: iterations", "now": 11, "record": 10}]}
    return made | changed


class Case(unittest.TestCase):
    scenes = ("column",)  # not one of the paper's: nothing is drawn, which is quick
    records = {"hard": hard}

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder, self.out = Path(temporary.name, "results"), Path(temporary.name, "out")
        self.folder.mkdir()
        for scene in self.scenes:
            fabricate(self.folder, scene, {"network": 2, "isotropic": 8}.get(scene))
        for name, made_up in self.records.items():
            (self.folder / f"{name}.json").write_text(json.dumps(made_up()))

    def report(self):
        """Exit code, and what went to the error stream."""
        errors = io.StringIO()
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(errors):
            code = cli.main(["report", str(self.folder), "--out", str(self.out)])
        return code, errors.getvalue()

    def page(self):
        return (self.out / "index.html").read_text()

    def summary(self):
        return json.loads((self.out / "summary.json").read_text())

    def change(self, name, **fields):
        path = self.folder / name
        path.write_text(json.dumps({**json.loads(path.read_text()), **fields}))

    def assert_one_line(self, *words):
        code, errors = self.report()
        self.assertEqual(code, 1)
        self.assertEqual(len(errors.strip().splitlines()), 1, errors)
        for word in words:
            self.assertIn(word, errors)
        self.assertFalse((self.out / "index.html").exists())

    def assert_fails_with(self, text):
        code, errors = self.report()
        self.assertEqual(code, 1)
        self.assertIn(text, errors)
        self.assertIn("verdict bad", self.page())
        self.assertIn(text, self.page())
        self.assertFalse(self.summary()["passes"])


class Page(Case):
    scenes = ("network", "biaxial", "isotropic", "triaxial")
    records = {"hard": hard, "accuracy": accuracy, "acceleration": acceleration, "velocity_error": velocity_error, "wild": wild, "bits": bits}
    records |= {"rheology": rheology, "problems": problems}

    def test_good_results_pass_with_all_captions_in_one_file(self):
        self.assertEqual(self.report(), (0, ""))
        page = self.page()
        blocks = {
            "Share of time in MPI",
            "What an iteration exchanges",
            "Partition and multiplicity",
            "Subdomains and multiplicity of spheres",
            "Biaxial compression of disks: speed-up",
            "Triaxial compression of spheres: speed-up",
            "Iterations of each step",
            "Agreement with the reference",
            "All runs",
            "Shear in a cell under stress",
            "Homogeneous shear",
            "Hard cases by family",
            "Iterations of columns",
            "Error against step size",
            "Scenes of the work-precision curves",
            "CPU time of the solver [s] against \u03b7",
            "All solvers at",
            "Distance of NLGS",
            "CPU time beside Siconos",
            "Performance profiles, CPU time",
            "Performance profiles on problems of other codes",
            "Problems of other codes",
            "What acceleration saves",
            "Hard cases that cost more",
            "Distance against \u03b7",
            "The distance over each measure",
            "What a measure must be",
            "Iterations to a velocity error",
            "The same bits by several compilers",
        }
        for title in blocks:
            self.assertRegex(page, r"<figcaption><b>(Table|Fig\.) \d+\.\d+\. " + re.escape(title))
        for anchor in re.findall('href="#([^"]*)"', page):
            self.assertIn(f'id="{anchor}"', page)
        self.assertIn("verdict good", page)
        self.assertIn("paper<br>(55\u2009000 spheres, 48-core machine)", page)
        for caption in page.split("<figcaption>")[1:]:
            caption = caption.split("</figcaption>")[0]
            self.assertRegex(caption, r'</b> <span class="tag (measured|counted|computed)">')
            self.assertIn("Fabricated CPU, 2 cores; commit fabricated.", caption)
        self.assertNotIn("Not in these results", page)
        self.assertNotIn("The paper, table by table", page)  # it has no record here: test_report_paper.py
        self.assertIn("first are NLGS on 50 %, Siconos NSGS on 50 %. Beside other codes alone auto is first on 50 %.", page)
        self.assertIn("Left out: 4, 8 subdomains", page)
        self.assertEqual([row["subdomains"] for row in self.summary()["mpi_share"]], [1, 2])

        self.assertNotRegex(page, r"<link|<script|https?://(?!doi.org)")
        names = {path.name for path in self.out.iterdir()}
        self.assertEqual(names, {"index.html", "summary.json", "artifact.md", *re.findall('src="([^"]*)"', page)})
        labels = re.findall(r"<figcaption><b>((?:Table|Fig\.) [\d.]*\d)", page)
        appendix = (self.out / "artifact.md").read_text()
        self.assertEqual(re.findall(r"^\| \[([^]]*)\]", appendix, re.M), labels)
        self.assertLessEqual({"network.svg", "spheres.png", "biaxial-reduced.svg", "histories.svg", "velocity-error.svg"}, names)

    def test_nothing_is_first_beside_codes_that_took_no_part(self):
        ours = [row for row in problems()["rows"] if not row["solver"].startswith("Siconos")]
        self.assertEqual(said(ours, 1e-4), "At 0.0001 first are NLGS on 100 %.")

    def test_damaged_state_is_one_line(self):
        path = self.folder / "network-dcs-in-process-2.h5"
        path.write_bytes(path.read_bytes()[:500])
        self.assert_one_line("network-dcs-in-process-2.h5", "not a state file")

    def test_grid_is_found_in_the_state(self):
        path = self.folder / "network-dcs-in-process-2.h5"
        self.assertEqual(list(map(list, packings.read_state(path)["grid"])), [[2, 1], [0, 0], [8, 8]])
        with h5py.File(path, "r+") as file:
            file["rough/kind"][0] = b"tree"
        self.assertIsNone(packings.read_state(path)["grid"])


class Verdict(Case):
    def test_good(self):
        self.assertEqual(self.report(), (0, ""))
        self.assertTrue(self.summary()["passes"])

    def test_disagreement_fails(self):
        self.change("column-dcs-mpi-2.compare.json", **compare("column", "dcs", 2, "mpi", value=0.5))
        self.assert_fails_with("column-dcs-mpi-2: velocity 0.5 exceeds 0.01")

    def test_row_called_ok_beyond_its_bound_fails(self):
        rows = [{"quantity": "velocity", "value": None, "bound": 1e-2, "ok": True}]
        self.change("column-dcs-mpi-2.compare.json", rows=rows)
        self.assert_fails_with("velocity not finite exceeds 0.01")

    def test_unconverged_run_fails(self):
        self.change("column-ccs-mpi-1.json", converged=False, unconverged_steps=2)
        self.assert_fails_with("column-ccs-mpi-1: not converged in 2 of 3 steps")

    def test_residual_above_tolerance_fails(self):
        self.change("column-ccs-mpi-1.json", residual=[1e-5, 2e-4, 1e-5])
        self.assert_fails_with("its residual 0.0002 exceeds 0.0001")

    def test_failed_job_fails(self):
        record = {"schema": "nscdd.job/1", "jobs": [{"title": "isotropic packing", "exit": 3}]}
        (self.folder / "job.json").write_text(json.dumps(record))
        self.assert_fails_with("job failed (exit 3): isotropic packing")

    def test_hard_case_out_of_its_bound_fails(self):
        for changed in ({"error": 2e-3}, {"error": None, "found": None, "note": "exit code 1"}, {"ok": False}):
            (self.folder / "hard.json").write_text(json.dumps(hard(**changed)))
            self.assert_fails_with("hard case column-10-3d by nlgs: impulse")
            self.assertIn("<details open><summary>column: 11 of 12 rows", self.page())

    def test_cost_at_equal_error_lies_on_the_curve(self):
        rows = [row for row in accuracy()["runs"] if row["solver"] == "NLGS"]
        self.assertAlmostEqual(at_level(rows, 1e-4), 4.0)
        self.assertAlmostEqual(at_level(rows, 10**-4.5), np.sqrt(20.0))
        self.assertEqual(at_level(rows, 0.5), 1.0)
        self.assertIsNone(at_level(rows, 1e-9))
        self.assertIn(">30<", figures.siconos_table(accuracy()))
        self.assertIsNone(figures.siconos_table(accuracy(runs=rows)))
        self.assertEqual(re.findall("<td>(.*?)</td>", figures.distance_table(accuracy()))[1:], ["0.01", "0.001", "10⁻⁵"])

    def test_at_most_eight_solvers_are_drawn_and_all_are_in_the_table(self):
        rows = [row | {"solver": f"variant {k}"} for k in range(20) for row in accuracy()["runs"] if row["solver"] == "NLGS"]
        record = accuracy(runs=[*accuracy()["runs"], *rows])
        self.assertEqual(figures.chosen(record), ["NLGS", "Siconos NSGS"])
        record = accuracy(runs=rows)
        figure = figures.draw_curves(record, figures.chosen(record), "cpu", "eta")
        self.assertEqual(len([line for line in figure.axes[0].lines if len(line.get_xdata())]), 8)
        self.assertEqual(figures.solver_table(record).count("<td>variant"), 20)
        figures.plt.close(figure)

    def test_formulas_are_set_as_symbols(self):
        self.assertEqual(
            tables.symbols("|V - V_ref|_M / |V_free|_M^2"),
            "|<i>V</i> \u2212 <i>V</i><sub>ref</sub>|<sub><i>M</i></sub> / " "|<i>V</i><sub>free</sub>|<sub><i>M</i></sub>\u00b2",
        )
        self.assertEqual(tables.symbols("stress, |s - s_ref| / |s_ref|"), "stress, |<i>s</i> \u2212 <i>s</i><sub>ref</sub>| / |<i>s</i><sub>ref</sub>|")
        self.assertEqual(tables.symbols("residual eta, <= 1e-4 or the reference's"), "residual \u03b7, \u2264 10\u207b\u2074 or the reference&#x27;s")
        self.assertEqual(tables.symbols("|V* - V_free|_M in 2 s"), "|<i>V</i>* \u2212 <i>V</i><sub>free</sub>|<sub><i>M</i></sub> in 2 s")

    def test_runs_are_sorted_by_number(self):
        html = of_runs.agreement_table([compare("column", "dcs", n, "in-process") for n in (16, 2, 3, 1)])
        self.assertEqual(re.findall(r"<td>[^<]*dcs[^<]*?(\d+)</td>", html), ["1", "2", "3", "16"])

    def test_solvers_without_a_point_are_not_called_drawn(self):
        record = accuracy()
        for row in record["runs"]:
            row["sweeps"] = row["sweeps"] if row["solver"] == "NLGS" else None
        self.assertEqual(figures.drawn(record, figures.chosen(record), "sweeps", "eta"), ["NLGS"])

    def test_a_level_that_is_not_reached_has_no_column(self):
        record = velocity_error()
        self.assertEqual(velocity.unreached(velocity.certainty(record)[1]), [])
        for row in record["rows"]:
            if row["family"] == "reduced":
                row.update(eta=1.0, velocity_error=1.0)
        levels, iterations = velocity.certainty(record)
        self.assertEqual(velocity.unreached(iterations), ["NLGS, cold", "NLGS, auto, cold"])
        self.assertNotIn("NLGS", velocity.level_table(levels, iterations))

    def test_lost_grains_are_told_in_words(self):
        self.assertEqual(
            peers.wrong({"why": "ERROR: Lost atoms: original 8000 current 435 (src/thermo.cpp:439)"}), "unstable: 7\u202f565 of 8\u202f000 grains left the box"
        )

    def test_one_step_and_whole_run_are_told_apart(self):
        whole = compare("column", "dcs", 2, "mpi") | {"steps": 50, "last_step": 50}
        html = of_runs.agreement_table([whole, whole | {"steps": 1, "last_step": 51}])
        self.assertIn("whole run, 50 steps", html)
        self.assertIn("one step, from the reference", html)

    def test_savings_are_ratios_of_both_methods(self):
        cells = re.findall("<td>(.*?)</td>", acceleration_section.saved(acceleration()))
        self.assertEqual(cells[4:12], ["1", "100", "25", "0.25", "1", "0.1", "0.025", "0.25"])
        self.assertEqual(cells[16:21], ["8", "200", "50", "0.25", "2"])

    def test_hard_cases_that_cost_more_are_listed(self):
        cells = re.findall("<td>(.*?)</td>", acceleration_section.hard_costs(acceleration()))
        self.assertEqual(cells, ["dear", "2", "3", "40", "20", "4", "5", "1.25"])
        (self.folder / "acceleration.json").write_text(json.dumps(acceleration()))
        self.assertEqual(self.report(), (0, ""))
        self.assertIn("Of 3, accelerated ones cost less in 1, the same within 5 % in 1, more in 1", self.page())

    def test_energy_gained_is_told_with_the_exit_code(self):
        rows = hard()["rows"][-2:]
        html = hard_cases.family_table(rows, hard_cases.schemes_of(rows))
        self.assertIn("2\u202f\u00d7\u202f10\u207b\u2079<br>", html)
        self.assertRegex(html, "<td[^>]*>3\u202f\u00d7\u202f10\u207b\u2078<br>.*?<br><i>exit code 3</i></td>")
        self.assertEqual(html.count("exit code"), 1)
        rows[-1].update(found=2e-6, error=2e-6)
        self.assertIn('<td class="bad">', hard_cases.family_table(rows, hard_cases.schemes_of(rows)))
        rows[-1] = {key: value for key, value in rows[-1].items() if key != "exit"} | {"found": None, "error": None, "note": "exit code 1"}
        html = hard_cases.family_table(rows, hard_cases.schemes_of(rows))
        self.assertIn('<td class="bad">not finite', html)
        self.assertIn("nlgs: exit code 1</p>", html)

    def test_a_measure_is_judged_by_its_worst_iterate(self):
        record = velocity_error()
        record["rows"][-1].update(distance=0.2)  # at eta = 1e-6, velocity error = 5e-4
        cells = re.findall("<td>(.*?)</td>", velocity.ratio_table(record))
        self.assertEqual(cells[:11], ["packings", "1", "6", "10", "100", "1\u202f000", "0.82", "2", "2", "2", "0.00"])
        self.assertEqual(cells[-2], "400")
        self.assertEqual(velocity.level(record["rows"], "velocity_error", 0.1), 5e-4)
        self.assertEqual(velocity.level(record["rows"], "eta", 0.2), None)
        curve = [row for row in record["rows"] if (row["family"], row["method"]) == ("reduced", "NLGS")]
        self.assertAlmostEqual(at_level(curve, 1e-4, "iterations", "eta"), 20)
        self.assertAlmostEqual(at_level(curve, 1e-5, "iterations", "eta"), np.sqrt(20 * 30))
        self.assertEqual(at_level(curve, 1.0, "iterations", "eta"), 10)
        self.assertIsNone(at_level(curve, 1e-7, "iterations", "eta"))
        self.assertIn("<td>1.5</td>", velocity.cost_table(record))

    def test_random_scenes_come_worst_first(self):
        record = wild()
        infinite = dict(record["rows"][0]["distance"], largest=None)
        record["rows"].append(record["rows"][0] | {"name": "nlgs", "distance": infinite})
        html = random_scenes.spread_table(record, "solver")
        self.assertEqual(re.findall("<tr><td>(.*?)</td>", html), ["nlgs", "dcs", "all"])
        self.assertIn('<td class="bad">1</td>', html)
        self.assertIn("<td>infinite</td>", html)
        self.assertIn("<td>dcs on 4</td>", random_scenes.worst_table(record))

    def test_profile_counts_what_is_solved(self):
        rows = [row for row in accuracy()["profiles"] if row["set"] == "hard"]
        self.assertEqual(figures.profile(rows, "cpu"), ({"NLGS": [1.0, 1.0], "SPG": [4.0]}, 2))
        self.assertEqual(figures.profile(figures.of([*rows, rows[0] | {"tolerance": 1e-6}], tolerance=1e-6), "cpu"), ({"NLGS": [1.0]}, 1))

    def test_hard_cases_alone_make_a_report(self):
        for path in self.folder.iterdir():
            if path.name != "hard.json":
                path.unlink()
        self.assertEqual(self.report(), (0, ""))
        self.assertIn("All 15 rows of the hard cases are within their bounds", self.page())
        self.assertEqual(self.summary()["hard_rows"], 15)

    def test_links_to_records_are_of_those_beside_the_page(self):
        for out, link in (("page", "[record](../results/hard.json)"), ("results/page", "[record](../hard.json)"), ("elsewhere/page", "record hard.json |")):
            self.out = self.folder.parent / out
            self.assertEqual(self.report(), (0, ""))
            self.assertIn(f"counted numbers of the {link}", (self.out / "artifact.md").read_text())

    def test_solved_exchange_files_are_passed_over(self):
        (self.folder / "solved.json").write_text('{"schema": "nscdd.fclib/1"}')
        self.assertEqual(self.report(), (0, ""))

    def test_unchecked_runs_are_named(self):
        (self.folder / "column-dcs-mpi-2.compare.json").unlink()
        self.assertEqual(self.report()[0], 0)
        self.assertIn("1 not compared with a reference:</b> column-dcs-mpi-2", self.page())


class Input(Case):
    def test_truncated_json_is_one_line(self):
        path = self.folder / "column-dcs-mpi-2.json"
        path.write_text(path.read_text()[:300])
        self.assert_one_line("column-dcs-mpi-2.json", "not valid JSON")

    def test_wrong_field_is_one_line(self):
        self.change("column-dcs-mpi-2.json", subdomains="two")
        self.assert_one_line("column-dcs-mpi-2.json", "subdomains", "'two'")

    def test_wrong_number_of_steps_is_one_line(self):
        self.change("column-dcs-mpi-2.json", iterations=[1])
        self.assert_one_line("column-dcs-mpi-2.json", "1 entries for 3 steps")

    def test_damaged_speed_against_error_is_one_line(self):
        (self.folder / "accuracy.json").write_text(json.dumps(accuracy(runs=[{"scene": "dense"}])))
        self.assert_one_line("accuracy.json", "runs")

    def test_damaged_acceleration_is_one_line(self):
        (self.folder / "acceleration.json").write_text(json.dumps(acceleration(rows=[{}])))
        self.assert_one_line("acceleration.json", "rows")

    def test_damaged_velocity_error_is_one_line(self):
        (self.folder / "velocity_error.json").write_text(json.dumps(velocity_error(rows=[{}])))
        self.assert_one_line("velocity_error.json", "rows")

    def test_damaged_random_scenes_are_one_line(self):
        (self.folder / "wild.json").write_text(json.dumps(wild(rows=[{}])))
        self.assert_one_line("wild.json", "rows")

    def test_counts_beside_the_record(self):
        (self.folder / "counted.json").write_text(json.dumps(counted()))
        self.assertEqual(self.report(), (0, ""))
        self.assertIn("2 of 3 counted numbers are those of the record.</b><ul><li>hard: column nlgs: iterations: 11, in the record 10</li></ul>", self.page())
        (self.folder / "counted.json").write_text(json.dumps(counted(missing=1234)))
        self.assertEqual(self.report(), (0, ""))
        self.assertIn("of the record. 1\u202f234 of the record are not in these results.</b>", self.page())
        (self.folder / "counted.json").write_text(json.dumps(counted(same=3, differ=[])))
        self.assertEqual(self.report(), (0, ""))
        self.assertIn('good"><b>3 of 3 counted numbers are those of the record.</b></div>', self.page())

    def test_nothing_to_compare_is_not_good(self):
        (self.folder / "counted.json").write_text(json.dumps(counted(records=[], same=0, of=0, differ=[])))
        self.assertEqual(self.report(), (0, ""))
        self.assertIn('open"><b>0 of 0 counted numbers are those of the record.</b></div>', self.page())

    def test_damaged_counts_are_one_line(self):
        (self.folder / "counted.json").write_text(json.dumps(counted(same=-1)))
        self.assert_one_line("counted.json", "same")

    def test_other_bits_are_bad(self):
        self.assertEqual(re.findall('<td class="bad">(.*?)</td>', same_bits.table(bits())), ["00cc", "1", "19 of 20"])
        (self.folder / "bits.json").write_text(json.dumps(bits(rows=[{}])))
        self.assert_one_line("bits.json", "rows")

    def test_damaged_hard_cases_are_one_line(self):
        self.change("hard.json", rows=[])
        self.assert_one_line("hard.json", "rows")

    def test_damaged_job_record_is_one_line(self):
        (self.folder / "job.json").write_text('{"schema": "nscdd.job/1"}')
        self.assert_one_line("job.json", "jobs")

    def test_a_record_without_a_schema_that_lacks_something_is_one_line(self):
        for record, lacks in ((problems, "rows"), (problems, "machine"), (rheology, "machine"), (problems, {"rows": [{}]})):
            told = record() | lacks if isinstance(lacks, dict) else {key: value for key, value in record().items() if key != lacks}
            path = self.folder / f"{record.__name__}.json"
            path.write_text(json.dumps(told))
            self.assert_one_line(path.name, "not a whole record")
            path.unlink()

    def test_no_folder_and_no_place_for_the_page_are_one_line(self):
        file = self.folder / "hard.json"
        for self.folder, self.out, problem in (
            (self.folder / "nosuch", self.out, "nosuch: no such folder"),
            (file, self.out, "hard.json: no such folder"),
            (self.folder, file, "hard.json: expected a folder, found a file"),
        ):
            self.assert_one_line(problem)

    def test_empty_folder_is_one_line(self):
        for path in self.folder.iterdir():
            path.unlink()
        self.assert_one_line("no run JSON")

    def test_one_run_alone_has_a_page_of_what_it_is(self):
        for path in self.folder.iterdir():
            if path.name != "column-dcs-in-process-2.json":
                path.unlink()
        self.assertEqual(self.report()[0], 0)
        self.assertEqual(len(re.findall("<h2 id", self.page())), 1)
        self.assertNotIn("Not in these results", self.page())
        self.assertIn("The run converged; agreement was not checked", self.page())
        appendix = (self.out / "artifact.md").read_text()
        self.assertNotIn("scripts/suite run reduced", appendix)
        self.assertIn(" | in its caption |  | ", appendix)

    def test_a_kind_of_file_that_is_not_ours_is_one_line(self):
        (self.folder / "other.json").write_text('{"schema": "other.run/1"}')
        self.assert_one_line("other.json", "unknown schema 'other.run/1'")

    def test_runs_of_a_study_are_those_of_its_folder(self):
        record = {"schema": "nscdd.reduced/1", "command": "FABRICATED", **{key: hard()[key] for key in ("commit", "date", "machine")}, "runs": {}}
        (self.folder / "reduced").mkdir()
        for path in self.folder.glob("column*"):
            path.rename(self.folder / "reduced" / path.name)
        (self.folder / "reduced.json").write_text(json.dumps(record))
        (self.folder / "reduced/made-by.json").write_text("{}")
        (self.folder / "reduced/job.json").write_text(json.dumps({"schema": "nscdd.job/1", "jobs": [{"title": "lost", "exit": 1}]}))
        code, errors = self.report()
        self.assertEqual((code, errors), (1, "report: job failed (exit 1): lost\n"))
        self.assertEqual(self.summary()["runs"], 13)

    def test_a_study_without_a_section_has_a_table_of_its_rows(self):
        rows = [{"scene": scene, "iterations": 3, "simulated": {"seconds_per_iteration": 1e-3, "command": "nscdd FABRICATED"}} for scene in ("a", "b")]
        record = {key: hard()[key] for key in ("commit", "date", "machine", "command")} | {"schema": "nscdd.partitions/1", "rows": rows}
        (self.folder / "partitions.json").write_text(json.dumps(record))
        self.assertEqual(self.report()[0], 0)
        table = re.search('<table aria-label="Ways to divide space: rows">.*?</figure>', self.page(), re.S)[0]
        self.assertEqual(re.findall("<td>(.*?)</td>", table), ["a", "b"])
        self.assertIn("In all rows: iterations 3; simulated, seconds per iteration 0.001.", table)
        self.assertIn("SIMULATED", table)
        self.assertIn("Rows from <code>nscdd FABRICATED</code>", table)


class Measured(Case):
    def test_times_of_more_ranks_than_cores_are_left_out(self):
        runs = Runs(load(self.folder))
        self.assertTrue(runs.select(transport="mpi", subdomains=4))
        speed, used = runs.speed_ups("column")
        self.assertEqual(speed, {"ccs": {1: 1.0, 2: 2.0}, "dcs": {1: 1.0, 2: 2.0}})
        self.assertEqual({r["transport"] for r in used}, {"mpi", "sequential"})

    def test_times_of_a_busy_machine_are_marked_and_not_drawn(self):
        shares = {"least": 0.5, "mean": 0.75, "largest": 1.0}
        busy = {**dict.fromkeys(("cores", "switches", "running", "cores_allowed"), shares), "believed": False}
        self.change("column-dcs-mpi-2.json", load=busy)
        speed, _ = Runs(load(self.folder)).speed_ups("column")
        self.assertEqual(speed, {"ccs": {1: 1.0, 2: 2.0}, "dcs": {1: 1.0}})
        self.report()
        self.assertEqual(self.page().count("machine busy"), 1)
        self.change("column-nlgs.json", load=busy)  # the reference
        self.assertEqual(Runs(load(self.folder)).speed_ups("column"), ({}, []))

    def test_cores_are_checked_even_if_the_run_says_measured(self):
        self.change("column-dcs-mpi-4.json", ranks_measured=True)
        self.assertEqual(sorted(Runs(load(self.folder)).timed("column", "dcs")), [1, 2])

    def test_speed_up_needs_the_same_problem(self):
        self.change("column-nlgs.json", tolerance=1e-6)
        self.assertEqual(Runs(load(self.folder)).speed_ups("column"), ({}, []))

    def test_counts_keep_to_one_interval_between_checks(self):
        for n in (1, 2, 4):
            self.change(f"column-dcs-mpi-{n}.json", check_every=10)
        self.assertEqual(sorted(Runs(load(self.folder)).counted("column", "dcs")), [1, 2, 8])


if __name__ == "__main__":
    unittest.main()
