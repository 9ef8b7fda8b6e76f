"""A simulated driver on a line, served by the real binary: what it does not answer it explains, and its power
can go and come back."""

import os
import pathlib
import re
import struct
import tempfile
import unittest

import support
from frames import with_checksum
from blv import Bus

PROFILE = ["--profile", "orientalmotor-blv"]
READ_SPEED = with_checksum(struct.pack(">BBHH", 1, 3, 0x0484, 2))
ANSWER_SIZE = 9

BEYOND = """format: 1
id: beyond
title: "Registers behind 1FFFh"
extends: orientalmotor-blv
parameters:
  - {name: "far.{n}", n: 0..300, stride: 64, register: 9000, encoding: u32, access: rw, evidence: manual, source: "x", title: "x"}
---
part: simulation
values: {"far.*": 1234567890}
"""


def answer_from(line, patience=support.DEADLINE):
    answer = b""
    while len(answer) < ANSWER_SIZE and support.is_readable(line, patience):
        answer += os.read(line, 64)
    return answer


class Simulator(unittest.TestCase):
    def test_what_is_not_answered_is_told_with_its_reason(self):
        with Bus(units="1", silence=True) as bus:
            line = os.open(bus.path, os.O_RDWR | os.O_NOCTTY)
            try:
                def is_told():
                    os.write(line, READ_SPEED)
                    if len(answer_from(line)) == ANSWER_SIZE:
                        os.write(line, READ_SPEED)  # without the silence that a BLV needs
                    # Where the machine kept either side waiting there was silence, and this is answered, too.
                    answer_from(line, 0.5)
                    return re.search(r"ignored 01 03 04 84 .*: \d\.\d ms of silence, 5\.5 ms needed", bus.told())

                support.wait_until(is_told, "the reason is told")
            finally:
                os.close(line)
            spoilt = support.run("ping", bus.unit(7), *PROFILE, "--count", "1", "--timeout", "300ms")
            self.assertNotEqual(spoilt.status, 0)
            support.wait_until(lambda: "there is no unit 7" in bus.told(), "the absent unit is named")

    def test_a_reboot_loses_what_was_not_saved(self):
        with Bus("--outage", "reboot=1s@every:4s", units="1") as bus:
            def speed():
                shown = support.run("get", bus.unit(1), *PROFILE, "operation.2.speed", "--json")
                values = shown.records("value")
                return values[0]["value"] if values else None

            changed = support.first_good(
                lambda: support.run("set", bus.unit(1), *PROFILE, "operation.2.speed=1234", "--yes"),
                lambda result: result.status == 0)
            self.assertEqual(changed.status, 0, changed)
            support.wait_until(lambda: speed() == 1000, "the driver has its stored speed again")

    def test_an_alarm_can_be_raised(self):
        with Bus("--alarm", "30h", "--warning", "25h", units="1,2") as bus:
            for unit in (1, 2):
                shown = support.run("get", bus.unit(unit), *PROFILE, "alarm.present", "warning.present", "--json")
                self.assertEqual([record["value"] for record in shown.records("value")], [0x30, 0x25], shown)

    def test_registers_behind_the_map_of_a_base(self):
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "beyond.yaml").write_text(BEYOND)
            environment = support.home().environment(SPINDLE_PROFILE_PATH=f"{folder}:{os.environ.get('SPINDLE_PROFILE_PATH', '')}")
            shown = support.run("get", "sim:beyond", "operation.3.speed", "far.300", "--json", environment=environment)
            self.assertEqual([record["value"] for record in shown.records("value")], [0, 1234567890], shown)


if __name__ == "__main__":
    unittest.main()
