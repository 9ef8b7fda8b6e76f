"""Values that a device may hold although its profile has no word for them, and what steps are worth."""

import json
import pathlib
import shutil
import signal
import unittest

import support
from register_server import Deed, RegisterServer

PROFILE = """format: 1
id: odd
title: "Values that are hard to keep"
evidence: manual
source: "x"
access: rw
link: {framing: tcp, port: 502, unit: 1, max-read: 60, max-write: 60, max-gap: 4, answer: 500ms, connect: 5s, retries: 1}
unlock: {parameter: lock, value: 1234, for: [limit]}
parameters:
  - {name: digits, register: 0, encoding: bcd, length: 4, title: "Digits"}
  - {name: clock, register: 2, encoding: date, date: bytes, title: "Clock"}
  - {name: line, register: 5, encoding: text, length: 6, title: "Line"}
  - {name: charge, register: 8, encoding: u64, scale: 20/32768, title: "Charge"}
  - {name: third, register: 12, encoding: f64, scale: 1/3, title: "Third"}
  - {name: shifted, register: 16, encoding: f32, offset: -40, title: "Shifted"}
  - {name: power, register: 20, encoding: i16, scale-from: exponent, unit: W, title: "Power"}
  - {name: exponent, register: 21, encoding: i16, title: "Exponent"}
  - {name: lock, register: 30, encoding: u16, clone: never, title: "Lock"}
  - {name: limit, register: 31, encoding: u16, title: "Limit"}
"""

GOOD = {0: 0x12, 1: 0x3456, 2: 0x1A0B, 3: 0x1E01, 4: 0x0203, 5: 0x4142, 20: 5, 21: 0}
BROKEN = GOOD | {0: 0xABCD, 1: 0x0001, 2: 0xFFFF, 3: 0xFFFF, 4: 0xFFFF, 5: 0x41FF, 6: 0x8000, 7: 1}
# Neighbours that are one number in 64 bits, and numbers that have no exact sum with an offset.
EXACT = GOOD | {8: 0xFFFF, 9: 0xFFFF, 10: 0xFFFF, 11: 0xFFFE, 12: 0x3FD5, 13: 0x5555, 14: 0x5555, 15: 0x5556,
                16: 0x0DA2, 17: 0x4260}
SETTINGS = range(22)


class ValuesTest(unittest.TestCase):
    def setUp(self):
        self.home = pathlib.Path(support.home().path)
        self.state = self.home / ".local/state/spindle"
        shutil.rmtree(self.state, ignore_errors=True)
        (self.home / "odd.yaml").write_text(PROFILE, encoding="utf-8")
        (self.home / "odd-backup.yaml").unlink(missing_ok=True)

    def serve(self, registers, on_write=None):
        return self.enterContext(RegisterServer(registers, on_write))

    def spindle(self, verb, server, *arguments):
        return support.run(verb, f"{server.url}?unit=1", *arguments, "--profile", "./odd.yaml", "--json")

    def good(self, finished):
        self.assertEqual(finished.status, 0, finished)
        return finished

    def held(self, server):
        return [server.value(register) for register in SETTINGS]

    def changes(self):
        text = (self.state / "changes.jsonl").read_text(encoding="utf-8")
        return [json.loads(line) for line in text.splitlines()]

    def test_what_is_no_value_is_overwritten_and_its_registers_recorded(self):
        server = self.serve(BROKEN)
        finished = self.good(self.spindle("set", server, "digits=42", "clock=2026-11-30", "line=new"))
        old = [record["old"] for record in finished.records("write")]
        self.assertEqual(old, ["no decimal digits: ABCD 0001", "not a date: FFFF FFFF FFFF", "not UTF-8: 41FF 8000 0001"])
        self.assertEqual([server.value(register) for register in (0, 1, 2, 3, 4)], [0, 0x42, 0x1A0B, 0x1E00, 0])
        self.assertEqual([change["old"] for change in self.changes() if change["result"] == "written"], old)

    def test_a_tool_is_put_back_to_the_last_bit(self):
        for wanted in (BROKEN, EXACT):
            with self.subTest(wanted=wanted):
                (self.home / "odd-backup.yaml").unlink(missing_ok=True)
                source = self.serve(wanted)
                self.good(self.spindle("backup", source, "-f", "odd-backup.yaml"))
                for present in (GOOD, BROKEN, EXACT, EXACT | {11: 0xFFFF, 15: 0x5557, 17: 0x4261}):
                    target = self.serve(present)
                    self.good(self.spindle("restore", target, "odd-backup.yaml", "--yes"))
                    self.assertEqual(self.held(target), self.held(source))
                    self.good(self.spindle("diff", target, "odd-backup.yaml"))
                    target.writes.clear()
                    self.good(self.spindle("restore", target, "odd-backup.yaml", "--yes"))
                    self.assertEqual(target.writes, [])

    def test_a_restore_that_fails_puts_back_what_was_no_value(self):
        self.good(self.spindle("backup", self.serve(GOOD), "-f", "odd-backup.yaml"))
        target = self.serve(BROKEN, lambda number: Deed(exception=4, acts=None) if number == 3 else Deed())
        finished = self.spindle("restore", target, "odd-backup.yaml", "--yes")
        self.assertEqual(finished.records("summary")[0]["rolled_back"], 2, finished)
        self.assertEqual(self.held(target), [BROKEN.get(register, 0) for register in SETTINGS])

    def test_a_quantity_is_restored_whatever_a_step_is_worth(self):
        source = self.serve(GOOD | {20: 50, 21: 2})
        self.good(self.spindle("backup", source, "-f", "odd-backup.yaml"))
        self.assertIn("raw: 50, value: 5000, step: 100, unit:", (self.home / "odd-backup.yaml").read_text())
        with_exponent = self.serve(GOOD | {20: 7, 21: 0})
        self.good(self.spindle("restore", with_exponent, "odd-backup.yaml", "--yes"))
        self.assertEqual([with_exponent.value(20), with_exponent.value(21)], [50, 2])
        alone = self.serve(GOOD | {20: 7, 21: 1})
        self.good(self.spindle("restore", alone, "odd-backup.yaml", "power", "--yes"))
        self.assertEqual([alone.value(20), alone.value(21)], [500, 1])
        coarse = self.serve(GOOD | {20: 7, 21: 4})
        finished = self.spindle("restore", coarse, "odd-backup.yaml", "power", "--yes", "--force")
        self.assertEqual(finished.status, 8, finished)
        self.assertEqual(coarse.writes, [])

    def test_without_its_exponent_no_steps_are_written(self):
        self.good(self.spindle("backup", self.serve(GOOD | {20: 50, 21: 2}), "-f", "odd-backup.yaml"))
        target = self.serve(GOOD | {20: 7, 21: 0}, lambda number: Deed(exception=3, acts=None))
        finished = self.spindle("restore", target, "odd-backup.yaml", "--yes", "--no-rollback")
        self.assertNotEqual(finished.status, 0, finished)
        self.assertEqual([write[1] for write in target.writes], [21])
        self.assertEqual([target.value(20), target.value(21)], [7, 0])

    def test_an_exponent_is_put_back_with_its_value(self):
        self.good(self.spindle("backup", self.serve(GOOD | {20: 50, 21: 2}), "-f", "odd-backup.yaml"))
        for exception, status in ((4, 6), (None, 8)):
            with self.subTest(exception=exception):
                target = self.serve(
                    GOOD | {20: 7, 21: 0},
                    lambda number: Deed(exception=exception, acts=None) if number == 2 else Deed(),
                )
                finished = self.spindle("restore", target, "odd-backup.yaml", "--yes")
                self.assertEqual(finished.status, status, finished)
                self.assertEqual([write[1] for write in target.writes[:2]], [21, 20])
                self.assertEqual([target.value(20), target.value(21)], [7, 0])
                self.assertEqual([error["name"] for error in finished.records("error")], ["power"])

    def test_a_value_and_the_worth_of_its_steps_are_not_set_together(self):
        server = self.serve(GOOD)
        finished = self.spindle("set", server, "power=500", "exponent=2")
        self.assertEqual(finished.status, 2, finished)
        self.assertIn("between the two writes it would be another quantity", finished.sentences()[0])
        self.assertEqual(server.writes, [])
        self.good(self.spindle("set", server, "power=500", "exponent=0"))
        self.assertEqual(server.writes, [(6, 20, [500])])

    def test_an_interrupt_leaves_no_tool_unlocked(self):
        # 1: the lock is opened, 2: the limit, which is never answered
        server = self.serve(GOOD | {30: 7}, lambda number: Deed(silent=number == 2))
        arguments = ("set", f"{server.url}?unit=1", "limit=9", "--profile", "./odd.yaml", "--timeout", "1min")
        with support.Running(*arguments) as running:
            support.wait_until(lambda: len(server.writes) == 2, "the limit is written")
            self.assertEqual(server.value(30), 1234)
            running.send_signal(signal.SIGINT)
            finished = running.finish()
        self.assertEqual(finished.status, 130, finished)
        self.assertEqual(server.value(30), 7, finished)


if __name__ == "__main__":
    unittest.main()
