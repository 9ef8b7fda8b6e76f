"""Changes that are taken back, by what the record of changes says of them."""

import json
import pathlib
import shutil
import unittest

import support
from register_server import Deed, RegisterServer

PROFILE = """format: 1
id: bank
title: "A bank of registers"
link: {framing: tcp, port: 502, unit: 1, max-read: 16, max-write: 16, answer: 500ms, connect: 5s, retries: 1}
parameters:
  - {name: a, register: 0, encoding: u16, access: rw, evidence: manual, source: "x", title: "A"}
  - {name: b, register: 1, encoding: u16, access: rw, evidence: manual, source: "x", title: "B"}
  - {name: t, register: 2, encoding: u16, scale: 0.1, unit: torque, access: rw, evidence: manual, source: "x", title: "T"}
  - {name: m, register: 3, encoding: u16, labels: {0: slow, 1: fast}, access: rw, evidence: manual, source: "x", title: "M"}
"""

TELLS_UNIT = """torque-unit: u
parameters:
  - {name: u, register: 3, encoding: u16, labels: {0: N.m, 1: kgf.cm}, access: r, evidence: manual, source: "x", title: "U"}
"""


class UndoTest(unittest.TestCase):
    def setUp(self):
        self.home = pathlib.Path(support.home().path)
        self.state = self.home / ".local/state/spindle"
        shutil.rmtree(self.state, ignore_errors=True)
        (self.home / "bank.yaml").write_text(PROFILE, encoding="utf-8")
        self.servers = [self.enterContext(RegisterServer({0: 10, 1: 20, 2: 30, 3: 0})) for _ in range(2)]
        self.server = self.servers[0]
        self.tools = self.home / "spindle.yaml"
        self.has_torques_in("N.m")
        self.addCleanup(self.tools.unlink)

    def has_torques_in(self, unit):
        lines = "".join(
            f'  bench{n}: {{url: "{server.url}?unit=1", profile: ./bank.yaml, torque-unit: {unit}}}\n'
            for n, server in enumerate(self.servers, 1)
        )
        self.tools.write_text(f"tools:\n{lines}groups:\n  line: [bench1, bench2]\n", encoding="utf-8")

    def spindle(self, *arguments, status=0):
        outcome = support.run(*arguments, "--json")
        self.assertEqual(outcome.status, status, outcome)
        return outcome

    def set(self, *arguments):
        summary = self.spindle("set", *arguments, "--yes").records("summary")[-1]
        return summary["change_id"]

    def values(self, register):
        return [server.value(register) for server in self.servers]

    def records(self, *records):
        """Adds lines to the record of changes, as another command would."""
        self.state.mkdir(parents=True, exist_ok=True)
        with open(self.state / "changes.jsonl", "a", encoding="utf-8") as file:
            for record in records:
                line = {
                    "schema": "spindle/1", "type": "changed", "time": "2026-11-22T10:15:30.123Z", "user": "anna",
                    "command": "set", "target": "bench1", "serial": None, "name": "a", "register": 0, "old": 9,
                    "new": 10, "result": "written", "id": "aaaa0001-1", "unit": None,
                } | record
                file.write(json.dumps(line, separators=(",", ":")) + "\n")

    def test_step_by_step(self):
        for value in (11, 12, 13):
            self.set("bench1", f"a={value}")
        for value in (12, 11, 10):
            self.spindle("undo", "--yes")
            self.assertEqual(self.server.value(0), value)
        self.assertIn("nothing", self.spindle("undo", "--yes", status=2).said)
        undone = [r["undoes"] for r in self.spindle("log").records("changed")]
        self.assertEqual([one is None for one in undone], [True] * 3 + [False] * 3)

    def test_an_undo_is_taken_back_by_its_id(self):
        self.set("bench1", "a=11")
        again = self.spindle("undo", "--yes").records("summary")[0]["change_id"]
        self.spindle("undo", again, "--yes")
        self.assertEqual(self.server.value(0), 11)
        self.spindle("undo", "--yes")
        self.assertEqual(self.server.value(0), 10)

    def test_one_value_of_a_command(self):
        change = self.set("bench1", "a=11", "b=21")
        self.spindle("undo", f"{change}-1", "--yes")
        self.assertEqual((self.server.value(0), self.server.value(1)), (10, 21))
        self.spindle("undo", "--yes")
        self.assertEqual(self.server.value(1), 20)

    def test_a_group_is_taken_back_as_a_whole(self):
        self.servers[1].registers[0] = 15
        for arguments in ((), (self.set,)):
            change = self.set("@line", "a=11", "b=21")
            self.assertEqual(self.values(0), [11, 11])
            self.spindle("undo", *([change] if arguments else []), "--yes")
            self.assertEqual(self.values(0) + self.values(1), [10, 15, 20, 20])
        change = self.set("@line", "a=11")
        self.spindle("undo", f"{change}-2", "--yes")
        self.assertEqual(self.values(0), [11, 15])
        self.spindle("undo", "--yes")
        self.assertEqual(self.values(0), [10, 15])

    def test_a_torque_in_another_unit_is_left(self):
        change = self.set("bench1", "t=4")
        self.assertEqual(self.spindle("log").records("changed")[0]["unit"], "N.m")
        self.has_torques_in("kgf.cm")
        refused = self.spindle("undo", change, "--yes", status=8)
        self.assertIn("N.m", refused.said)
        self.assertIn("kgf.cm", refused.said)
        self.assertEqual(self.server.value(2), 40)
        self.has_torques_in("N.m")
        self.spindle("undo", change, "--yes")
        self.assertEqual(self.server.value(2), 30)

    def test_a_torque_whose_unit_was_not_recorded(self):
        self.records({"name": "t", "register": 2, "old": 2.5, "new": 3.0})
        # A tool that says itself what its torques are in may say another unit by now.
        text = PROFILE.partition("  - {name: m,")[0].replace("parameters:\n", TELLS_UNIT)
        self.assertIn("torque-unit: u", text)
        (self.home / "bank.yaml").write_text(text, encoding="utf-8")
        self.spindle("undo", "--yes", status=8)
        self.assertEqual(self.server.writes, [])
        # One that does not say it has the same unit for ever.
        (self.home / "bank.yaml").write_text(PROFILE, encoding="utf-8")
        self.spindle("undo", "--yes")
        self.assertEqual(self.server.value(2), 25)

    def test_labels_are_recorded(self):
        self.set("bench1", "m=fast")
        told = support.run("log").stdout
        self.assertIn("slow", told)
        self.assertIn("fast", told)

    def test_what_may_have_been_written(self):
        for result in ("mismatch", "unknown", "begun"):
            for old, new, now in ((9, 10, 10), (10, 11, 10), (8, 9, 10)):
                with self.subTest(result=result, old=old, new=new):
                    shutil.rmtree(self.state, ignore_errors=True)
                    self.server.registers[0] = 10
                    self.records({"result": result, "id": "bbbb0001-1", "old": old, "new": new})
                    undone = self.spindle("undo", "bbbb0001", "--yes", status=0 if now in (old, new) else 8)
                    self.assertEqual(self.server.value(0), old if now == new else 10)
                    if now in (old, new):
                        self.assertIn("not known", undone.said)

    def test_a_change_that_was_refused_is_not_unknown(self):
        self.records({"result": "refused", "id": "bbbb0001-1"})
        refused = self.spindle("undo", "bbbb0001", "--yes", status=2)
        self.assertNotIn("has no change", refused.said)
        self.assertIn("refused", refused.said)

    def test_what_was_rolled_back_is_passed_over(self):
        self.records({"id": "aaaa0001-1"}, {"id": "bbbb0001-1", "old": 10, "new": 12},
                     {"id": "bbbb0001-2", "old": 12, "new": 10, "result": "rolled-back"})
        self.spindle("undo", "--yes")
        self.assertEqual(self.server.value(0), 9)

    def test_two_commands_with_one_id(self):
        first, second = {"id": "cccc0001-1"}, {"id": "cccc0001-1", "target": "bench2", "name": "b", "old": 1, "new": 20}
        self.records(first | {"result": "begun"}, second | {"result": "begun"}, first, second)
        told = self.spindle("log").records("changed")
        self.assertEqual([(r["target"], r["result"]) for r in told], [("bench1", "written"), ("bench2", "written")])
        refused = self.spindle("undo", "cccc0001", "--yes", status=2)
        self.assertIn("bench1", refused.said)
        self.assertIn("bench2", refused.said)
        self.assertEqual([server.writes for server in self.servers], [[], []])

    def test_a_tool_that_says_no_serial(self):
        self.records({"serial": "1021100042"})
        self.assertIn("1021100042", self.spindle("undo", "--yes", status=8).said)
        self.assertEqual(self.server.writes, [])

    def test_a_write_of_which_nothing_is_known(self):
        self.server.on_write = lambda number: Deed(silent=True)
        support.run("set", "bench1", "a=55", "--timeout", "200ms")
        self.server.on_write = lambda number: Deed()
        self.spindle("undo", "--yes")
        self.assertEqual(self.server.value(0), 10)


if __name__ == "__main__":
    unittest.main()
