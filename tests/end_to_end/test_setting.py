"""Setting parameters: everything is checked first, only what differs is written, all is proved."""

import unittest

import hostile_server
import support

TORQUE = "preset.1.target-torque"


class SettingTest(unittest.TestCase):
    def setUp(self):
        self.url = self.enterContext(support.simulator())
        self.recorder = self.enterContext(support.Recorder(self.url))

    def set(self, *arguments):
        return support.run("set", self.recorder.url, "--profile", "doga-bm", *arguments)

    def writes(self):
        return [r.words for r in self.recorder.requests if r.function == support.WRITE_SINGLE]

    def value(self, name):
        finished = support.run("get", self.url, "--profile", "doga-bm", name, "--json")
        return str(finished.records("value")[0]["value"])

    def test_the_tools_own_maximum_refuses(self):
        finished = self.set(f"{TORQUE}=9.99")
        self.assertEqual(finished.status, 2, finished)
        self.assertEqual(finished.stdout, "")
        self.assertEqual(
            finished.sentences(),
            [
                "spindle: preset.1.target-torque: 9.99 is above 6.00, the maximum that the tool itself "
                "reports (register 2002)"
            ],
        )
        self.assertEqual(self.writes(), [])

    def test_the_tools_own_minimum_refuses(self):
        finished = self.set("preset.1.speed=10", "--json")
        self.assertEqual(finished.status, 2, finished)
        error = finished.records("error")[-1]
        self.assertIn("below 50", error["message"])
        self.assertIn("1008", error["message"])
        self.assertEqual(self.writes(), [])

    def test_one_wrong_value_keeps_all_from_being_written(self):
        for wrong in (f"{TORQUE}=9.99", "event.number=1", "preset.1.mode=XX", "preset.99.mode=1"):
            with self.subTest(wrong):
                finished = self.set("preset.2.target-torque=3.10", wrong)
                self.assertEqual(finished.status, 2, finished)
        self.assertEqual(self.writes(), [])

    def test_only_what_differs_is_written(self):
        finished = self.set(f"{TORQUE}=2.80", "preset.1.torque-limit=10.00", "preset.2.speed=810", "--json")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual(self.writes(), [(2, 280), (23, 810)])
        results = [(r["name"], str(r["old"]), str(r["new"]), r["result"]) for r in finished.records("write")]
        self.assertEqual(
            results,
            [
                (TORQUE, "2.71", "2.80", "written"),
                ("preset.1.torque-limit", "10.00", "10.00", "unchanged"),
                ("preset.2.speed", "800", "810", "written"),
            ],
        )
        summary = finished.records("summary")
        self.assertEqual([(s["written"], s["unchanged"], s["exit_status"]) for s in summary], [(2, 1, 0)])
        self.assertEqual(self.value(TORQUE), "2.80")

    def test_equal_values_are_not_written(self):
        finished = self.set(f"{TORQUE}=2.71", "preset.1.mode=TC/AM", "--json")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual([r["result"] for r in finished.records("write")], ["unchanged"] * 2)
        self.assertEqual(self.writes(), [])

    def test_a_second_run_writes_nothing(self):
        self.assertEqual(self.set(f"{TORQUE}=2.90").status, 0)
        self.assertEqual(self.set(f"{TORQUE}=2.90").status, 0)
        self.assertEqual(self.writes(), [(2, 290)])

    def test_dry_run_writes_nothing(self):
        finished = self.set(f"{TORQUE}=2.80", "preset.1.mode=AC/TM", "--dry-run", "--json")
        self.assertEqual(finished.status, 0, finished)
        plans = [(r["name"], str(r["old"]), str(r["new"])) for r in finished.records("plan")]
        self.assertEqual(plans, [(TORQUE, "2.71", "2.80"), ("preset.1.mode", "0", "1")])
        self.assertEqual(self.writes(), [])
        self.assertEqual(self.value(TORQUE), "2.71")

    def test_dry_run_refuses_what_a_real_run_would(self):
        self.assertEqual(self.set(f"{TORQUE}=9.99", "--dry-run").status, 2)

    def test_every_write_is_read_back(self):
        self.assertEqual(self.set(f"{TORQUE}=2.80").status, 0)
        functions = [r.function for r in self.recorder.requests]
        at = functions.index(support.WRITE_SINGLE)
        self.assertEqual(self.recorder.requests[at + 1].function, support.READ_HOLDING)
        self.assertEqual(self.recorder.requests[at + 1].words, (2, 1))


class BadStoreTest(unittest.TestCase):
    """The simulated tool's own faults must be caught as well."""

    def test_simulated_faults(self):
        for fault, result in (("ignore-write", "mismatch"), ("store-other", "coerced")):
            with self.subTest(fault), support.simulator("doga-bm", "--fault", f"{fault}@every:1") as url:
                finished = support.run("set", url, "--profile", "doga-bm", f"{TORQUE}=2.80", "--json")
                self.assertEqual(finished.status, 8, finished)
                self.assertEqual([r["result"] for r in finished.records("write")], [result])

    def test_the_first_failure_ends_it(self):
        row = {"on": ["write"], "skip": 1, "store": "nothing", "reply": [{"answer": {"exception": "0E"}}]}
        with hostile_server.HostileServer(row) as server:
            finished = support.run(
                "set", server.url, "--profile", "doga-bm", "p300=3500", "p301=3500", "p302=3500", "--json"
            )
            self.assertEqual(finished.status, 9, finished)
            self.assertEqual([r["result"] for r in finished.records("write")], ["written", "refused"])
            self.assertEqual([server.tool.holding[n] for n in (300, 301, 302)], [3500, 3301, 3302])


if __name__ == "__main__":
    unittest.main()
