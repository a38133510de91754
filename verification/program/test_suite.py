"""The suite's engine, with a made-up study: what is made, what is made again, and what is told."""
import contextlib
import io
import os
import unittest.mock

from harness import ROOT, ProgramTest
from nscdd_suite import cli, jobs, program, record
from nscdd_suite.study import Plan, Study


class Letters(Study):
    name, title = "letters", "Letters"

    def jobs(self, plan):
        first = plan.add("first", [plan.folder / "a"], [["sh", "-c", f"echo a >> {plan.folder}/said; echo > {plan.folder}/a"]])
        plan.add("second", [plan.folder / "b"], [["sh", "-c", f"test -e {first} && echo b >> {plan.folder}/said && echo > {plan.folder}/b"]], needs=[first])
        plan.rows("third", lambda: [{"letter": "c"}])
        plan.add("bad", [plan.folder / "d"], [["sh", "-c", "echo this went wrong; exit 7"]])
        plan.add("after bad", [plan.folder / "e"], [["true"]], needs=[plan.folder / "d"])

    def rows(self, plan):
        return {"rows": plan.made("third")} if plan.made("third") else {}

    def provenance(self, plan):
        return {"commit": "c0ffee", "date": "2000-01-01T00:00:00Z", "machine": {"cpu": "Fabricated CPU"}}


class Engine(ProgramTest):
    def setUp(self):
        super().setUp()
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(ROOT)
        self.programs = unittest.mock.patch.object(program, "checksum", lambda: "one")
        self.programs.start()
        self.addCleanup(unittest.mock.patch.stopall)

    def run_study(self, only="first|second|third", keep=False, **how):
        """(whether all went well, what it says, the order of the jobs that wrote)"""
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            good = Letters().run(Plan(self.folder, "letters", only, command="scripts/suite run letters", keep=keep), **how)
        path = self.folder / "letters/said"
        return good, said.getvalue(), path.read_text().split() if path.exists() else []

    def test_jobs_are_made_in_order_and_once(self):
        good, said, order = self.run_study("second|third")
        self.assertTrue(good, said)
        self.assertEqual(order, ["a", "b"])
        told = record.read(self.folder / "letters.json", "letters")
        self.assertEqual((told["rows"], told["commit"], told["command"]), ([{"letter": "c"}], "c0ffee", "scripts/suite run letters"))
        good, said, order = self.run_study()
        self.assertIn("3 of 3 jobs are done already", said)
        self.assertEqual(order, ["a", "b"])
        (self.folder / "letters/b").unlink()
        self.assertEqual(self.run_study()[2], ["a", "b", "b"])
        self.assertEqual(self.run_study(anew=True)[2], ["a", "b", "b", "a", "b"])

    def test_what_another_program_made_is_made_again_and_kept_aside(self):
        self.run_study()
        unittest.mock.patch.object(program, "checksum", lambda: "another").start()
        _, said, order = self.run_study(keep=True)
        self.assertIn("3 of 3 jobs are done already", said)
        unittest.mock.patch.object(program, "checksum", lambda: "third").start()
        _, said, order = self.run_study()
        self.assertIn("letters: made by another program, now", said)
        self.assertEqual(order, ["a", "b"])
        self.assertTrue((self.folder / "letters-before/b").exists())

    def test_what_was_made_from_something_else_is_made_again(self):
        scene = self.write("scene", "a")

        class Scenes(Letters):
            def jobs(self, plan):
                copied = plan.add("copy", [plan.folder / "copy"], [["cp", str(scene), str(plan.folder / "copy")]])
                first = plan.add("first", [plan.folder / "first"], [["sh", "-c", f"head -c 1 {copied} > {plan.folder}/first"]], needs=[copied])
                plan.rows("third", lambda: [{"letter": first.read_text()}], needs=[first])

        def made(text, **how):
            scene.write_text(text)
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                self.assertTrue(Scenes().run(Plan(self.folder, "letters", **how)), said.getvalue())
            return [title for title in ("copy", "first", "third") if f"] {title} ..." in said.getvalue()], record.load(self.folder / "letters.json")["rows"]

        self.assertEqual(made("a"), (["copy", "first", "third"], [{"letter": "a"}]))
        self.assertEqual(made("a"), ([], [{"letter": "a"}]))
        self.assertEqual(made("a and more"), (["copy", "first"], [{"letter": "a"}]))  # what the third needs is the same
        self.assertEqual(made("b", keep=True), ([], [{"letter": "a"}]))
        self.assertEqual(made("b"), (["copy", "first", "third"], [{"letter": "b"}]))

    def test_nothing_of_somebody_else_is_moved_or_deleted(self):
        (self.folder / "letters").mkdir()
        mine = self.write("letters/mine.txt", "mine")
        with self.assertRaisesRegex(record.InputError, "letters: not made by the suite"):
            self.run_study()
        self.assertEqual(mine.read_text(), "mine")
        mine.unlink()
        for name in ("first", "second", "third"):  # each keeps what the one before made
            unittest.mock.patch.object(program, "checksum", lambda name=name: name).start()
            self.run_study()
        self.assertTrue((self.folder / "letters-before/b").exists() and (self.folder / "letters-before-1/b").exists())

    def test_a_list_of_jobs_writes_nothing(self):
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            self.assertEqual(cli.main(["run", "rheology", "--list", "--only", "disks-0.001", "--results", str(self.folder / "none")]), 0)
        self.assertEqual(said.getvalue().split("\n")[-2:], ["disks-0.001", ""])
        self.assertFalse((self.folder / "none").exists())

    def test_a_quick_job_replaces_no_whole_record(self):
        self.run_study()
        with self.assertRaisesRegex(record.InputError, "letters.json is of a whole job"):
            Letters().run(Plan(self.folder, "letters", quick=True))

    def test_a_job_that_makes_nothing_or_is_killed_has_failed(self):
        jobs_of = [
            jobs.Job("nothing", [self.folder / "p"], [["true"]]),
            jobs.Job("killed", [self.folder / "q"], work=lambda: program.call(["sh", "-c", "kill -9 $$"])),
        ]
        runner = jobs.Runner(jobs_of, self.folder / "logs")
        with contextlib.redirect_stdout(io.StringIO()) as said:
            runner.run_all()
        self.assertEqual(len(runner.failed()), 2)
        self.assertIn("made no", said.getvalue())

    def test_a_job_that_fails_is_told_and_others_go_on(self):
        good, said, order = self.run_study("")
        self.assertFalse(good)
        self.assertEqual(order, ["a", "b"])
        self.assertIn("FAILED (exit 7): bad", said)
        self.assertIn("| this went wrong", said)
        self.assertIn("| not run, for lack of", said)
        self.assertIn("letters: 3 of 5 jobs succeeded", said)
        failed = {job["title"]: job["exit"] for job in record.load(self.folder / "letters/job.json")["jobs"] if job["exit"]}
        self.assertEqual(failed, {"bad": 7, "after bad": 1})

    def test_a_job_that_failed_and_left_its_file_is_not_done(self):
        def jobs(study, plan):
            plan.add("disagrees", [plan.folder / "a"], [["sh", "-c", f"echo a >> {plan.folder}/said; echo > {plan.folder}/a; test -e {self.folder}/mended"]])

        with unittest.mock.patch.object(Letters, "jobs", jobs):
            self.assertEqual([self.run_study("")[0] for _ in range(2)], [False, False])
            self.write("mended", "")
            self.assertEqual([self.run_study("")[0] for _ in range(2)], [True, True])
        self.assertEqual((self.folder / "letters/said").read_text().split(), ["a", "a", "a"])

    def test_time_left_is_by_cost(self):
        self.assertEqual((jobs.left(60, 1, 4), jobs.left(5, 0, 4), jobs.clock(75)), (", about 3:00 left", "", "1:15"))

    def test_a_mistake_is_one_line(self):
        for words, problem in (
            (["run", "nothing"], "no study 'nothing'"),
            (["run", "reduced", "--only", "nowhere"], "nothing matches 'nowhere'"),
            (["report", str(self.folder), "--out", str(self.folder / "page")], "no"),
        ):
            said = io.StringIO()
            results = ["--results", str(self.folder)] if words[0] == "run" else []
            with self.subTest(words=words), contextlib.redirect_stderr(said):
                self.assertEqual(cli.main([*words, *results]), 1)
                self.assertEqual(said.getvalue().count("\n"), 1, said.getvalue())
                self.assertIn(problem, said.getvalue())


if __name__ == "__main__":
    unittest.main()
