"""Reading many parameters: all of them, exactly, in few requests. Counted on the wire."""

import decimal
import re
import unittest

import support

HOLES = range(564, 569)


class ReadingTest(unittest.TestCase):
    def read(self, *arguments, flags=(), expected=0):
        with support.simulator("doga-bm", *flags) as url, support.Recorder(url) as recorder:
            finished = support.run("get", recorder.url, "--profile", "doga-bm", *arguments, "--json")
            self.assertEqual(finished.status, expected, finished)
            return finished.records("value"), finished.records("error"), list(recorder.requests)

    def test_all_presets_in_four_requests_beside_the_identity(self):
        values, errors, requests = self.read("preset.*")
        self.assertEqual(errors, [])
        self.assertEqual(sorted(value["register"] for value in values), list(range(1, 226)))
        self.assertEqual(len({value["name"] for value in values}), 225)
        reads = [request for request in requests if request.function != support.REPORT_SERVER_ID]
        self.assertLessEqual(len(reads), 4, requests)
        self.assertEqual(len(requests) - len(reads), 1, requests)

    def test_decimals_are_exact_to_the_digit(self):
        with support.simulator() as url:
            finished = support.run("get", url, "--profile", "doga-bm", "preset.*", "--json")
        for line, record in zip(finished.stdout.splitlines(), finished.records("value")):
            word = decimal.Decimal(record["raw"][0])
            scaled = record["register"] % 15 in (2, 3, 7)
            right = word.scaleb(-2) if scaled else word
            written = re.search(r'"value":(-?[0-9.]+)[,}]', line).group(1)
            self.assertEqual(written, str(right), line)
        torque = next(r for r in finished.records("value") if r["name"] == "preset.1.target-torque")
        self.assertEqual(str(torque["value"]), "2.71")

    def test_the_whole_parameter_space_with_limits(self):
        values, errors, requests = self.read("p[0-9]*", "--limits", expected=9)
        self.assertEqual(
            [value["register"] for value in values],
            [number for number in range(1, 726) if number not in HOLES],
        )
        self.assertEqual([error["register"] for error in errors], list(HOLES))
        for value in values:
            limited = value["register"] < 725
            self.assertEqual(value["minimum"] is not None, limited, value)
            self.assertEqual(value["maximum"] is not None, limited, value)
        reads = [request for request in requests if request.function == support.READ_HOLDING]
        # What is said not to exist is asked for as one, and its limits never.
        holes = [r for r in reads if r.words[0] in HOLES and r.words[0] + r.words[1] <= HOLES.stop]
        self.assertEqual([tuple(r.words[:2]) for r in holes], [(HOLES.start, len(HOLES))])
        self.assertLessEqual(len(reads), 26)
        self.assertLessEqual(len(reads) - len(holes), 24, f"{len(reads)} reads in all")
        touching = [r for r in reads if self.touches_a_hole(*r.words)]
        self.assertEqual(touching, holes)
        self.assertTrue(all(request.words[1] <= 100 for request in reads), reads)

    @staticmethod
    def touches_a_hole(first, count):
        wanted = range(first, first + count)
        return any(table + hole in wanted for table in (0, 1000, 2000) for hole in HOLES)

    def test_events_are_never_read_in_one_piece(self):
        values, _, requests = self.read("event.*", "status.*", "alarm.*")
        self.assertEqual(len(values), 30)
        counts = [request.words[1] for request in requests if request.function == support.READ_INPUT]
        self.assertNotIn(14, counts)
        self.assertEqual(sum(counts), 30)

    def test_without_names_everything_that_the_profile_names(self):
        values, errors, _ = self.read()
        self.assertEqual(errors, [])
        self.assertEqual(len(values), 225 + 14 + 14 + 2)

    def test_table_and_csv_say_the_same_as_json(self):
        with support.simulator() as url:
            names = ["preset.1.target-torque", "preset.1.mode"]
            table, csv = (
                support.run("get", url, *names, "-o", form).stdout for form in ("table", "csv")
            )
        self.assertRegex(table, r"^NAME +VALUE +UNIT *\npreset\.1\.target-torque +2\.71")
        self.assertRegex(csv.replace("\r", ""), r"^time,target,name,value,unit,raw,label\n[^,]+,[^,]+,preset\.1\.target-torque,2\.71,,271,")


if __name__ == "__main__":
    unittest.main()
