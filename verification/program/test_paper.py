"""The paper's tables and figures at their smallest: what is counted, simulated and measured, and a job that is gone on with."""
import json
import math
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import h5py
import jsonschema

from harness import NSCDD, ROOT, ProgramTest, run_suite
from nscdd_suite import cli, jobs, program
from nscdd_suite.studies import studies
from nscdd_suite.studies.paper import Paper, items, rows
from nscdd_suite.study import Plan


def asked(only="", folder="results"):
    return items.Asked(Plan(pathlib.Path(folder), "paper", only))


class Items(unittest.TestCase):
    def test_full_size_is_that_of_the_paper(self):
        plan = asked()
        runs = [what for _, what, _ in plan.runs if what["method"] == "paper" and not what["variation"]]
        splittings = {(what["scene"], what["scheme"], what["subdomains"]): what["partition"] for what in runs}
        for scheme in ("ccs", "dcs"):
            self.assertEqual([splittings["isotropic", scheme, n] for n in (3, 4, 8)], ["grid 3x1x1", "grid 2x2x1", "grid 2x2x2"])
        for scene in ("biaxial", "triaxial"):
            for multiplicity in ("minimal", "predicted"):
                self.assertIn(
                    48, {what["subdomains"] for what in runs if (what["scene"], what["scheme"], what["multiplicity"]) == (scene, "dcs", multiplicity)}
                )

    def test_fig_2_is_a_picture_of_table_1(self):
        with tempfile.TemporaryDirectory() as folder:
            titles = []
            for only in ("fig2", "table1", "table1,fig3", ""):
                plan = Plan(pathlib.Path(folder), "paper", only)
                Paper().jobs(plan)
                titles.append({job.title for job in Paper().choose(plan)})
        self.assertEqual(titles[0], titles[1])
        self.assertTrue(titles[1] < titles[2] < titles[3] == {job.title for job in plan.jobs})

    def test_no_row_is_asked_for_twice(self):
        plan = asked()
        for kind, made in (("runs", plan.runs), ("windows", plan.windows), ("agreement", plan.compared)):
            identities = [tuple(row[1].get(name) for name in rows.IDENTITY[kind]) for row in made]
            self.assertEqual(len(identities), len(set(identities)), kind)

    def test_larger_is_a_million_spheres_on_the_number_nearest_to_a_hundred(self):
        self.assertEqual(64_000 * math.prod(items.TILES), 1_024_000)
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            plan = asked(folder=folder)
            made = {what["subdomains"]: what["platform"] for _, what in plan.windows if what["scene"] == "million"}
            self.assertEqual(made, {1: "node48", 64: "cluster", 128: "cluster"})
            self.assertEqual({what["subdomains"] for _, what, _ in plan.runs if what["scene"] == "million"}, set(made))
            with h5py.File(folder / "one.h5", "w") as one:
                one["x"], one["radius"], one["box"] = [[0.5, 1, 2]], [0.5], [1, 2, 4]
            tiling = next(job for job in plan.plan.jobs if job.title == "packing million").commands[0]
            subprocess.run([*tiling[:3], folder / "one.h5", folder / "many.h5", *tiling[5:]], check=True, env=program.environment())
            with h5py.File(folder / "many.h5") as many:
                self.assertEqual((len(many["x"]), list(many["box"]), list(many["x"][-1])), (16, [4, 4, 8], [3.5, 3, 6]))

    def test_a_grid_has_as_many_cells_as_subdomains(self):
        for _, what, _ in items.table_of_runs():
            if what.partition.startswith("grid "):
                cells = [int(c) for c in what.partition[5:].split("x")]
                self.assertEqual(len(cells), 2 if what.scene == "biaxial" else 3)
                self.assertEqual(math.prod(cells), what.subdomains)

    def test_factors_of_a_platform_are_multiplied(self):
        plain = program.simulated(48)
        words = program.simulated(48, latency=2)
        self.assertEqual(words[:-1], plain)
        self.assertTrue(words[-1].startswith("--cfg=smpi/lat-factor:"))


class Reproduce(unittest.TestCase):
    def test_what_it_does_not_know_starts_no_job(self):
        for arguments in (("--none",), ("--only",), ("--full", "--list"), ("--only", "peers", "more")):
            done = subprocess.run([ROOT / "scripts/reproduce", *arguments], capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stdout), (2, ""), arguments)
            self.assertRegex(done.stderr, r"^reproduce: [^\n]*\n$")
        for arguments in (("--only", "nope"), ("--only", "peers, nope")):
            done = subprocess.run([ROOT / "scripts/reproduce", *arguments], capture_output=True, text=True)
            self.assertEqual((done.returncode, "suite: no study 'nope'" in done.stderr), (1, True), done.stderr)

    def test_studies_and_parts_by_name(self):
        self.assertEqual(set(studies()) - set(cli.asked(["all"])), {"bits", "million", "python_solve", "python_step", "step_cost"})
        self.assertEqual(list(cli.asked(["hard", "all"]))[0], "hard")
        self.assertEqual(cli.asked(["table1", "hard", "fig2"]), {"paper": ("table1", "fig2"), "hard": ()})
        self.assertEqual(cli.asked(["table1", "paper", "fig3"]), {"paper": ()})


class Order(ProgramTest):
    def job(self, name, needs=(), command="true", alone=False, fine=(0,)):
        out = str(self.folder / name)
        return jobs.Job(
            name,
            [out],
            [["sh", "-c", f"{command} && echo {name} >> {self.folder}/order && touch {out}"]],
            needs=[self.folder / need for need in needs],
            alone=alone,
            fine=fine,
        )

    def run_jobs(self, *all_jobs):
        runner = jobs.Runner(all_jobs, self.folder)
        runner.run_all()
        made = (self.folder / "order").read_text().split() if (self.folder / "order").exists() else []
        return made, [record["title"] for record in runner.failed()]

    def test_a_job_waits_for_what_it_needs_and_others_do_not(self):
        made, failed = self.run_jobs(
            self.job("slow", command="sleep 1"), self.job("after", ["slow"]), self.job("free"), self.job("measured", alone=True), self.job("last")
        )
        self.assertEqual((made, failed), (["free", "slow", "after", "measured", "last"], []))

    def test_what_needs_a_failed_job_is_not_run(self):
        made, failed = self.run_jobs(self.job("bad", command="false"), self.job("after", ["bad"]), self.job("other"))
        self.assertEqual((made, sorted(failed)), (["other"], ["after", "bad"]))

    def test_other_exit_codes_may_be_no_failure(self):
        self.assertEqual(self.run_jobs(self.job("capped", command=f"touch {self.folder}/capped; exit 3", fine=(0, 3)))[1], [])


@unittest.skipUnless(shutil.which("smpirun") and pathlib.Path(f"{NSCDD}_simulated").exists(), "smpirun or nscdd_simulated is not there")
class Quick(ProgramTest):
    def run_study(self, *arguments):
        return run_suite("run", "paper", "--quick", "--results", self.folder, *arguments)

    def test_table_1(self):
        done = self.run_study("--only", "table1,fig1")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        record = json.loads((self.folder / "paper.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/paper.schema.json").read_text()))
        self.assertTrue(record["quick"])
        runs = {(row["scheme"], row["subdomains"]): row for row in record["runs"] if row["scene"] == "isotropic"}
        self.assertEqual(set(runs), {("nlgs", 1), *((scheme, n) for scheme in ("ccs", "dcs") for n in (3, 4, 8))})
        for row in runs.values():
            self.assertEqual(len(row["iterations"]), row["steps"])
            self.assertEqual((row["unconverged_steps"], row["residual_max"] <= row["tolerance"]), (0, True))
            self.assertEqual(row["iterations"], runs["dcs" if row["scheme"] == "ccs" else row["scheme"], row["subdomains"]]["iterations"])
        simulated = {(row["scheme"], row["subdomains"], row["slower"]): row for row in record["windows"]}
        self.assertEqual(len(simulated), 2 * len(runs))
        self.assertLess(simulated["dcs", 4, 1]["seconds_per_iteration"], simulated["dcs", 4, 3]["seconds_per_iteration"])
        self.assertEqual(simulated["nlgs", 1, 1]["mpi_share"], 0)
        for (scheme, n, _), row in simulated.items():
            sent = {name for name, one in row["operations"].items() if one["messages"]}
            self.assertEqual(sent, {"ccs": {"gather", "scatter", "reduction"}, "dcs": {"exchange", "reduction"}}[scheme] if n > 1 else set())
            self.assertAlmostEqual(sum(one["wait_share"] + one["transfer_share"] for one in row["operations"].values()), row["mpi_share"])
        for row in record["agreement"]:
            self.assertTrue(all(part["ok"] for part in row["rows"]), row)
        self.assertTrue((self.folder / "paper/quick/fig1-network.h5").exists())

        again = self.run_study("--only", "table1,fig1")
        self.assertIn("0 of 0 jobs", again.stdout)

    def test_the_network_alone_makes_a_page(self):
        done = self.run_study("--only", "fig1")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        record = json.loads((self.folder / "paper.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/paper.schema.json").read_text()))
        done = run_suite("report", self.folder, "--out", self.folder / "page")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertTrue((self.folder / "page/paper-fig1.svg").exists())

    def test_an_item_that_is_not_known_is_named(self):
        done = self.run_study("--only", "table2")
        self.assertEqual(
            (done.returncode, done.stderr),
            (
                1,
                "paper: --only table2: expected some of packings, fig1, table1, table1-windows, fig3, fig4, beyond, larger, variations, "
                "interface, chance, choices\n",
            ),
        )

    def test_packings_alone_make_no_record(self):
        done = self.run_study("--only", "packings")
        self.assertEqual((done.returncode, (self.folder / "paper.json").exists()), (0, False), done.stdout + done.stderr)

    def test_rows_are_added_to_an_earlier_record(self):
        done = self.run_study("--only", "interface")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        first = json.loads((self.folder / "paper.json").read_text())
        grains = {row["multiplicity"]: row["interface_grains"] for row in first["runs"] if (row["scene"], row["subdomains"]) == ("triaxial", 8)}
        self.assertGreater(grains["predicted"], grains["minimal"])
        self.assertEqual({row["multiplicity"] for row in first["windows"]}, {"minimal", "predicted"})
        shutil.rmtree(self.folder / "paper")
        done = self.run_study("--only", "chance")
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        record = json.loads((self.folder / "paper.json").read_text())
        jsonschema.validate(record, json.loads((ROOT / "reports/paper.schema.json").read_text()))
        self.assertEqual([len(record[kind]) for kind in ("windows", "agreement")], [len(first[kind]) for kind in ("windows", "agreement")])
        self.assertEqual({row["perturbed"] for row in record["runs"]}, {0, 1, 2})
        self.assertEqual(len(record["runs"]), len(first["runs"]) + 8)
        self.assertEqual([command.split()[-1] for command in record["command"].split("; ")], ["interface", "chance"])
        self.assertTrue(all("nscdd_suite.perturbed" in row["start"][-1] for row in record["runs"] if row["perturbed"]))


if __name__ == "__main__":
    unittest.main()
