"""What became of a write: it is read back, told, recorded before and after, and put back whole."""

import json
import pathlib
import shutil
import signal
import unittest

import support
from register_server import Deed, RegisterServer

PROFILE = """format: 1
id: bank
title: "A bank of registers"
link: {framing: tcp, port: 502, unit: 1, max-read: 16, max-write: %d, pairs: %s, answer: 500ms, connect: 5s, retries: 1}
parameters:
  - {name: a, register: 0, encoding: u16, access: rw, evidence: manual, source: "x", title: "A"}
  - {name: b, register: 1, encoding: u16, access: rw, evidence: manual, source: "x", title: "B"}
  - {name: w, register: 2, encoding: u32, access: rw, evidence: manual, source: "x", title: "W"}
"""


class ChangesTest(unittest.TestCase):
    def setUp(self):
        self.home = pathlib.Path(support.home().path)
        self.state = self.home / ".local/state/spindle"
        shutil.rmtree(self.state, ignore_errors=True)
        self.profile(max_write=16)

    def profile(self, max_write, pairs="any"):
        (self.home / "bank.yaml").write_text(PROFILE % (max_write, pairs), encoding="utf-8")

    def serve(self, on_write=None, registers=None):
        return self.enterContext(RegisterServer(registers or {0: 10, 1: 20}, on_write))

    def spindle(self, verb, server, *arguments):
        return support.run(verb, f"{server.url}?unit=1", *arguments, "--profile", "./bank.yaml", "--json")

    def records(self):
        text = (self.state / "changes.jsonl").read_text(encoding="utf-8")
        return [json.loads(line) for line in text.splitlines()]

    def words(self):
        return [(r["result"], r["name"], r["old"], r["new"]) for r in self.records()]

    def test_what_the_device_holds_counts_whatever_it_answered(self):
        for exception, acts, status, result, new, writes in (
            (5, 0.0, 0, "written", 55, 1),
            (11, 0.0, 0, "written", 55, 1),
            (10, 0.0, 0, "written", 55, 1),
            (5, None, 6, "mismatch", 10, 1),
            (10, None, 6, "refused", 10, 1),
            (3, None, 6, "refused", 10, 1),
        ):
            with self.subTest(exception=exception, acts=acts):
                shutil.rmtree(self.state, ignore_errors=True)
                server = self.serve(lambda number: Deed(exception=exception, acts=acts) if number == 1 else Deed())
                finished = self.spindle("set", server, "a=55")
                self.assertEqual(finished.status, status, finished)
                [record] = finished.records("write")
                self.assertEqual((record["result"], record["new"]), (result, new))
                self.assertEqual(server.value(0), new)
                self.assertEqual(len(server.writes), writes)
                self.assertEqual(self.words(), [("begun", "a", 10, 55), (result, "a", 10, new)])

    def test_a_busy_device_is_asked_again(self):
        server = self.serve(lambda number: Deed(exception=6, acts=None) if number < 3 else Deed())
        finished = self.spindle("set", server, "a=55")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual(len(server.writes), 3)

    def test_a_value_that_acts_late_is_waited_for(self):
        server = self.serve(lambda number: Deed(acts=0.3))
        finished = self.spindle("set", server, "a=55")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual(finished.records("write")[0]["result"], "written")

    def test_a_restore_that_fails_puts_back_all_that_was_sent(self):
        server = self.serve()
        self.assertEqual(self.spindle("backup", server, "-f", "bank-backup.yaml", "--force").status, 0)
        server.registers.update({0: 110, 1: 120})
        # the first acts after it was given up, the second is refused
        server.on_write = lambda number: Deed(acts=0.8) if number == 1 else Deed()
        finished = self.spindle("restore", server, "bank-backup.yaml", "--yes")
        self.assertEqual(finished.status, 8, finished)
        self.assertEqual(finished.records("summary")[0]["rolled_back"], 1)
        self.assertEqual((server.value(0), server.value(1)), (110, 120))
        self.assertEqual(self.words()[-1], ("rolled-back", "a", 110, 110))

    def test_a_restore_believes_the_device_and_not_its_exception(self):
        server = self.serve()
        self.assertEqual(self.spindle("backup", server, "-f", "bank-backup.yaml", "--force").status, 0)
        server.registers.update({0: 110, 1: 120})
        server.on_write = lambda number: Deed(exception=5)
        finished = self.spindle("restore", server, "bank-backup.yaml", "--yes")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual((server.value(0), server.value(1)), (10, 20))

    def test_a_device_that_takes_one_register_gets_one(self):
        self.profile(max_write=1)
        server = self.serve()
        finished = self.spindle("set", server, "w=70000")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual(server.writes, [(6, 2, [1]), (6, 3, [4464])])

    def test_a_pair_that_is_never_split_is_not_written_in_two(self):
        self.profile(max_write=1, pairs="even")
        server = self.serve()
        finished = self.spindle("set", server, "w=70000")
        self.assertEqual(finished.status, 2, finished)
        self.assertEqual(server.writes, [])

    def test_plans_have_one_shape(self):
        server = self.serve()
        self.assertEqual(self.spindle("backup", server, "-f", "bank-backup.yaml", "--force").status, 0)
        server.registers[0] = 110
        [restoring] = self.spindle("restore", server, "bank-backup.yaml", "--dry-run").records("plan")
        [setting] = self.spindle("set", server, "a=10", "--dry-run").records("plan")
        self.assertEqual(list(restoring), list(setting))
        restoring["time"] = setting["time"] = None
        self.assertEqual(restoring, setting)

    def killed_between_write_and_answer(self, server, *arguments):
        with support.Running(*arguments, "--profile", "./bank.yaml", "--timeout", "1min") as running:
            support.wait_until(server.heard_write.is_set, "the write is heard")
            running.send_signal(signal.SIGKILL)
            running.finish()

    def test_a_killed_write_stands_in_the_record(self):
        server = self.serve(lambda number: Deed(silent=True))
        self.killed_between_write_and_answer(server, "set", f"{server.url}?unit=1", "a=55")
        self.assertEqual(server.value(0), 55)
        [record] = self.records()
        self.assertEqual((record["result"], record["old"], record["new"]), ("begun", 10, 55))
        server.on_write = lambda number: Deed()
        self.assertEqual(self.spindle("set", server, "b=21").status, 0)
        ended = {r["id"] for r in self.records() if r["result"] != "begun"}
        self.assertEqual([r["name"] for r in self.records() if r["id"] not in ended], ["a"])

    def test_a_killed_restore_stands_in_the_record(self):
        server = self.serve()
        self.assertEqual(self.spindle("backup", server, "-f", "bank-backup.yaml", "--force").status, 0)
        server.registers.update({0: 110, 1: 120})
        server.on_write = lambda number: Deed(silent=number == 2)
        server.heard_write.clear()
        with support.Running(
            "restore", f"{server.url}?unit=1", "bank-backup.yaml", "--yes", "--profile", "./bank.yaml",
            "--timeout", "1min",
        ) as running:
            support.wait_until(lambda: len(server.writes) == 2, "the second write")
            running.send_signal(signal.SIGKILL)
            running.finish()
        self.assertEqual(
            self.words(), [("begun", "a", 110, 10), ("written", "a", 110, 10), ("begun", "b", 120, 20)]
        )

    def test_a_line_that_a_crash_cut_off_spoils_no_other(self):
        self.state.mkdir(parents=True)
        (self.state / "changes.jsonl").write_text('{"schema":"spindle/1","type":"chan', encoding="utf-8")
        server = self.serve()
        self.assertEqual(self.spindle("set", server, "a=55").status, 0)
        lines = (self.state / "changes.jsonl").read_text(encoding="utf-8").splitlines()
        self.assertEqual([json.loads(line)["result"] for line in lines[1:]], ["begun", "written"])


if __name__ == "__main__":
    unittest.main()
