"""The suite's engine, with a made-up study: what is made, what is made again, and what is told."""
import contextlib
import fcntl
import functools
import io
import os
import sys
import types
import unittest.mock

from harness import ROOT, ProgramTest
from nscdd_suite import cli, jobs, program, record
from nscdd_suite.jobs import chosen
from nscdd_suite.measure import Budget
from nscdd_suite.studies import studies
from nscdd_suite.study import Plan, Study


def work(*arguments, **how):
    """Of a job that is never run."""


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

    def inputs(self, work, *arguments, **how):
        """Digest of what a job of Python is made from, by its source as it is now."""
        jobs.source.cache_clear()
        return jobs.Job("made", [self.folder / "out"], work=functools.partial(work, *arguments), folder=self.folder / "letters", **how).inputs()

    def test_a_job_of_python_is_of_its_arguments_and_the_files_that_they_name(self):
        scene, own = self.write("scene.toml", "a"), self.folder / "letters/own"
        arguments = ([scene, 1], own, Plan(self.folder, "letters"), Budget(), types.SimpleNamespace(path=scene, sweeps=1))
        first = self.inputs(work, *arguments)
        own.parent.mkdir()
        own.write_text("what it makes itself")
        same = Plan(self.folder, "letters", only="x", command="x", keep=True)
        self.assertEqual(self.inputs(work, *arguments[:2], same, *arguments[3:]), first)
        for place, other in ((0, [scene, 2]), (2, Plan(self.folder, "letters", quick=True)), (3, Budget(3)), (4, types.SimpleNamespace(path=scene, sweeps=2))):
            self.assertNotEqual(self.inputs(work, *arguments[:place], other, *arguments[place + 1 :]), first, other)
        scene.write_text("b")
        self.assertNotEqual(self.inputs(work, *arguments), first)

    def test_a_job_of_python_is_of_the_source_of_its_study(self):
        (self.folder / "studies/one").mkdir(parents=True)
        files = {name: self.write(name, "") for name in ("shared.py", "cli.py", "studies/one/exact.py", "studies/one/cases.toml", "studies/one/captions.toml")}
        module = types.ModuleType("one")
        module.__file__ = str(self.write("studies/one/__init__.py", "def work(): pass"))
        exec("def work(): pass", vars(module))
        with unittest.mock.patch.dict(sys.modules, one=module), unittest.mock.patch.object(jobs, "SUITE", self.folder):
            for name, path in files.items():
                before = self.inputs(module.work)
                path.write_text("# changed")
                (self.assertEqual if name.endswith(("cli.py", "captions.toml")) else self.assertNotEqual)(self.inputs(module.work), before, name)

    def test_a_command_that_is_a_module_of_the_suite_reads_its_source(self):
        for module in ("tiling", "studies.python_step"):
            (source,) = (path for path in jobs.Job("made", [self.folder / "out"], [program.python(module, 2)]).read if path.endswith(".py"))
            self.assertTrue(os.path.isfile(source) and not os.access(source, os.X_OK), source)

    def test_jobs_of_studies_read_the_files_of_their_cases(self):
        plan = Plan(self.folder, "hard")
        studies()["hard"].jobs(plan)
        self.assertIn("cases/hard/column-10-2d.toml", next(job.read for job in plan.jobs if job.title == "column-10-2d nlgs"))

    def test_times_of_another_processor_are_made_again(self):
        timed, counted = ((lambda alone=alone: self.inputs(work, alone=alone)) for alone in (True, False))
        before = timed(), counted()
        with unittest.mock.patch.object(jobs, "processor", lambda: "another"):
            self.assertNotEqual(timed(), before[0])
            self.assertEqual(counted(), before[1])

    def test_a_failure_stays_until_its_job_succeeds(self):
        def jobs(study, plan):
            plan.add("fails", [plan.folder / "a"], [["sh", "-c", f"echo > {plan.folder}/a; test -e {self.folder}/mended"]])
            plan.rows("third", lambda: [{"letter": "c"}])

        def failures(only):
            self.run_study(only)
            return [job["title"] for job in record.load(self.folder / "letters/job.json")["jobs"] if job["exit"]]

        with unittest.mock.patch.object(Letters, "jobs", jobs):
            self.assertEqual([failures("fails"), failures("third"), failures("third")], [["fails"]] * 3)
            self.write("mended", "")
            self.assertEqual([failures("fails"), failures("third")], [[], []])

    def test_a_record_made_in_parts_has_the_command_of_the_whole(self):
        def jobs(study, plan):
            plan.rows("third", lambda: [{"letter": "c"}])
            plan.rows("fourth", lambda: [{"letter": "d"}])

        def command(only, **how):
            with contextlib.redirect_stdout(io.StringIO()):
                Letters().run(Plan(self.folder, "letters", only, command=f"as typed {only}", **how))
            return record.read(self.folder / "letters.json", "letters")["command"]

        with unittest.mock.patch.object(Letters, "jobs", jobs):
            self.assertEqual([command("third"), command("fourth")], ["as typed third", "scripts/suite run letters"])
            self.assertEqual(command("third", keep=True), "scripts/suite run letters --keep")
            with unittest.mock.patch.object(Letters, "choose", lambda study, plan: chosen(plan.jobs, plan.only or "third")):
                self.assertEqual(command("fourth"), "as typed fourth")  # a run without --only would leave it out

    def test_another_run_in_the_same_folder_is_refused(self):
        with (self.folder / ".lock").open("a") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            with self.assertRaisesRegex(record.InputError, f"another run is at work in {self.folder}: "):
                self.run_study()
        self.assertTrue(self.run_study()[0])

    def test_what_matches_nothing_moves_nothing(self):
        self.run_study()
        unittest.mock.patch.object(program, "checksum", lambda: "another").start()
        with self.assertRaisesRegex(record.InputError, "nothing matches 'zzzz'"):
            self.run_study("zzzz")
        self.assertTrue((self.folder / "letters/b").exists())
        self.assertFalse((self.folder / "letters-before").exists())

    def test_a_record_for_lack_of_a_file_comes_after_the_summary(self):
        self.run_study()
        said = io.StringIO()
        with unittest.mock.patch.object(Letters, "rows", lambda study, plan: {"rows": (plan.folder / "d").read_text()}), contextlib.redirect_stderr(said):
            good, told, _ = self.run_study("^bad")
        self.assertFalse(good)
        self.assertTrue(told.endswith("letters: 0 of 1 jobs succeeded in 0:00\n  failed: bad\n"), told)
        self.assertRegex(said.getvalue(), r"^letters: .*letters.json is not written: .*No such file.*\n$")

    def test_studies_that_lack_a_tool_are_left_out(self):
        ran, errors = [], io.StringIO()
        with (
            unittest.mock.patch("shutil.which", lambda tool: None),
            unittest.mock.patch.object(program, "missing", lambda: None),
            unittest.mock.patch.object(Study, "run", lambda study, plan, anew: ran.append(study.name) is None),
            contextlib.redirect_stderr(errors),
        ):
            self.assertEqual(cli.main(["run", "million", "hard", "--results", str(self.folder)]), 1)
        self.assertEqual(ran, ["hard"])
        self.assertEqual(errors.getvalue(), "suite: left out: million, for lack of mpirun: scripts/setup installs it\n")

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
            (["run", "table1", "--only", "x"], "--only is for whole studies"),
            (["times", 'sh -c "', "true"], "times: not a command: No closing quotation"),
            (["report", str(self.folder), "--out", str(self.folder / "page")], "no"),
        ):
            said = io.StringIO()
            results = ["--results", str(self.folder)] if words[0] == "run" else []
            with self.subTest(words=words), contextlib.redirect_stderr(said):
                self.assertEqual(cli.main([*words, *results]), 1)
                self.assertEqual(said.getvalue().count("\n"), 1, said.getvalue())
                self.assertIn(problem, said.getvalue())

    def test_a_picture_that_cannot_be_drawn_is_one_line(self):
        for name in ("pvpython", "xvfb-run"):
            self.write(name, "#!/bin/sh\necho Traceback >&2; echo no such frame >&2; exit 3\n").chmod(0o755)
        frames, said = self.write("frames.pvd", ""), io.StringIO()
        with unittest.mock.patch.dict(os.environ, PATH=f"{self.folder}:{os.environ['PATH']}"), contextlib.redirect_stderr(said):
            self.assertEqual(cli.main(["picture", str(frames)]), 1)
        self.assertEqual(said.getvalue(), f"picture: {frames}: pvpython: exit code 3: no such frame\n")


if __name__ == "__main__":
    unittest.main()
