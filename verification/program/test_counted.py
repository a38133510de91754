"""`scripts/suite counted`: made-up results beside made-up records."""
import contextlib
import io
import json
import pathlib
import unittest.mock

from harness import ProgramTest
from nscdd_suite import counted
from nscdd_suite.record import InputError

RUN = {"iterations": 22, "contacts": 10, "answer": "00aa"}
ROW = {"case": "column", "scheme": "nlgs", "quantity": "height", "iterations": 7, "steps": 2, "found": 1.25, "answer": "00bb", "ok": True}


class Counted(ProgramTest):
    def setUp(self):
        super().setUp()
        self.results, self.records = self.folder / "results", self.folder / "reports" / "results"
        self.results.mkdir()
        self.records.mkdir(parents=True)
        self.write_run()
        self.write_hard()

    def write_run(self, others=None, **changed):
        runs = {"pack-nlgs": RUN | changed} | (others or {})
        (self.results / "reduced.json").write_text(json.dumps({"schema": "nscdd.reduced/1", "date": "2000-01-01T00:00:00Z", "runs": runs}))

    def write_hard(self, **changed):
        (self.results / "hard.json").write_text(json.dumps({"schema": "nscdd.hard/1", "rows": [ROW | changed]}))

    def counted(self, keep=False):
        """(what it says, results/counted.json, None where results become the records)"""
        with unittest.mock.patch.object(counted, "RECORDS", self.records):
            said = "\n".join(counted.compare(self.results, keep)) + "\n"
        told = self.results / "counted.json"
        self.assertEqual(told.exists(), not keep)  # a record says nothing beside itself
        return said, None if keep else json.loads(told.read_text())

    def test_without_records_nothing_is_compared_and_it_says_so(self):
        said, told = self.counted()
        self.assertIn("reduced.json is not there: nothing to compare reduced with", said)
        self.assertIn("0 of 0 counted numbers are those of the record (none)", said)
        self.assertEqual(told["of"], 0)

    def test_the_same_again_is_all_the_same_whatever_the_times(self):
        self.counted(True)
        record = json.loads((self.results / "reduced.json").read_text())
        (self.results / "reduced.json").write_text(json.dumps(record | {"date": "2001-01-01T00:00:00Z", "machine": {"cpu": "Another", "cores": 1}}))
        said, told = self.counted()
        self.assertIn("7 of 7 counted numbers are those of the record (reduced, hard)\n", said)
        self.assertEqual((told["same"], told["of"], told["differ"]), (7, 7, []))

    def test_quick_results_have_no_number_of_the_record(self):
        self.counted(True)
        (self.results / "hard.json").unlink()
        told = json.dumps({"schema": "nscdd.reduced/1", "date": "2000-01-01T00:00:00Z", "quick": True, "runs": {"other": RUN}})
        (self.results / "reduced.json").write_text(told)
        self.assertTrue(self.counted()[0].endswith("in these results; results of --quick have none of the record's\n"))

    def test_each_number_that_differs_is_named(self):
        self.counted(True)
        self.write_run(iterations=23, answer="00ab")
        self.write_hard(found=1.2500000000000002)
        said, told = self.counted()
        self.assertIn("reduced: pack-nlgs: iterations: 23, in the record 22", said)
        self.assertIn("4 of 7 counted numbers", said)
        self.assertEqual(
            [entry["name"] for entry in told["differ"]], ["reduced: pack-nlgs: iterations", "reduced: pack-nlgs: answer", "hard: column nlgs height: found"]
        )

    def test_a_run_that_the_record_lacks_is_told(self):
        self.counted(True)
        self.write_run({"other-nlgs": RUN})
        said, told = self.counted()
        self.assertIn("7 of 7 counted numbers are those of the record (reduced, hard); 3 more are not in it", said)
        self.assertEqual(told["not_in_the_record"], 3)

    def test_a_run_that_was_not_made_is_told(self):
        self.write_run({"other-nlgs": RUN})
        self.counted(True)
        self.write_run()
        said, told = self.counted()
        self.assertIn("7 of 7 counted numbers are those of the record (reduced, hard); 3 of it are not in these results", said)
        self.assertEqual(told["missing"], 3)

    def test_a_quick_or_partial_record_replaces_no_whole_one(self):
        self.counted(True)
        before = (self.records / "hard.json").read_text()
        record = json.loads(before)
        for changed in (record | {"quick": True}, record | {"rows": []}):
            (self.results / "hard.json").write_text(json.dumps(changed))
            with self.assertRaisesRegex(InputError, "hard.json is quick, or lacks numbers"):
                self.counted(True)
            self.assertEqual((self.records / "hard.json").read_text(), before)

    def assert_refused(self, name, problem):
        with self.assertRaisesRegex(InputError, f"{name}: .*{problem}"):
            self.counted()
        self.assertFalse((self.results / "counted.json").exists())

    def test_a_folder_without_results_is_one_line(self):
        for path in self.results.iterdir():
            path.unlink()
        self.assert_refused("results", "no records")
        self.results.rmdir()
        self.assert_refused("results", "no such folder")

    def test_damaged_results_and_records_are_one_line(self):
        for path in (self.results / "reduced.json", self.results / "hard.json", self.records / "hard.json"):
            before = path.read_text() if path.exists() else None
            for text, problem in (('{"schema": "nscdd', "truncated"), ("[1]", "schema")):
                with self.subTest(path=path.name, text=text):
                    path.write_text(text)
                    self.assert_refused(path.name, problem)
            path.unlink() if before is None else path.write_text(before)

    def test_a_record_of_another_kind_is_one_line(self):
        (self.results / "hard.json").write_text(json.dumps({"schema": "nscdd.paper/1", "runs": []}))
        self.assert_refused("hard.json", "schema is nscdd.paper/1")
        (self.results / "hard.json").write_text(json.dumps({"schema": "nscdd.hard/1"}))
        self.assert_refused("hard.json", "rows")

    def test_a_quick_record_is_not_compared_with_a_whole_one(self):
        self.counted(True)
        self.write_hard(iterations=1)
        record = json.loads((self.results / "hard.json").read_text())
        (self.results / "hard.json").write_text(json.dumps(record | {"quick": True}))
        said, told = self.counted()
        self.assertEqual((told["same"], told["not_in_the_record"], told["missing"], told["differ"]), (3, 4, 4, []))

    def test_numbers_within_a_row_and_rows_within_a_part_are_compared(self):
        def write(nscdd, theirs, iterations):
            (self.results / "acceleration.json").write_text(
                json.dumps(
                    {
                        "schema": "nscdd.acceleration/1",
                        "rows": [],
                        "hard": [{"scene": "chain", "steps": 5, "paper": {"iterations": nscdd}, "auto": {"iterations": 3}}],
                    }
                )
            )
            (self.results / "peers.json").write_text(
                json.dumps(
                    {
                        "schema": "nscdd.peers/1",
                        "settle": {"ours": []},
                        "siconos": [
                            {"scene": "s", "solver": "Siconos NSGS", "arguments": "", "tolerance": 0.1, "iterations": theirs, "eta": 0.5},
                            {"scene": "s", "solver": "NLGS", "arguments": "", "tolerance": 0.1, "iterations": 4, "eta": 0.25},
                        ],
                    }
                )
            )
            (self.results / "scale-node.json").write_text(
                json.dumps({"schema": "nscdd.scale/1", "points": [{"scheme": "dcs", "ranks": 2, "iterations": iterations, "contacts": [9.0]}]})
            )

        write(10, 20, [6, 7])
        self.counted(True)
        write(11, 21, [6, 8])
        said, told = self.counted()
        self.assertEqual(
            [(entry["name"], entry["now"], entry["record"]) for entry in told["differ"]],
            [("acceleration: chain: paper.iterations", 11, 10), ("scale-node: dcs 2: iterations", 14, 13)],
        )
        self.assertEqual((told["of"], told["missing"], told["not_in_the_record"]), (14, 0, 0))


if __name__ == "__main__":
    unittest.main()
