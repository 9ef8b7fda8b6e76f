"""mbpoll, a client of others, against our simulated tool."""

import re
import unittest

import support

support.need_program("mbpoll")

PARAMETERS = ("-t", "4")
INPUTS = ("-t", "3")


def mbpoll(tool, *arguments, values=()):
    """Addresses from 0, once, without its banner."""
    return support.run("mbpoll", "-m", "tcp", "-p", tool.port, "-0", "-1", "-q", *arguments,
                       "127.0.0.1", *values)


def registers(outcome):
    """Of lines such as '[2]: \\t271' or '[2]: \\t65535 (-1)'."""
    return {int(address): int(value)
            for address, value in re.findall(r"\[(\d+)\]:\s+(\d+)", outcome.out)}


class Simulator(support.PeerTest):

    def setUp(self):
        self.tool = support.simulator()
        self.addCleanup(self.tool.stop)

    def test_shows_the_example_of_the_manual(self):
        outcome = mbpoll(self.tool, *PARAMETERS, "-r", "2", "-c", "2")
        self.assert_ends(outcome, 0)
        self.assertEqual(registers(outcome), {2: 271, 3: 1000})

    def test_shows_input_registers(self):
        outcome = mbpoll(self.tool, *INPUTS, "-r", "3300", "-c", "14")
        self.assert_ends(outcome, 0)
        status = registers(outcome)
        self.assertEqual(sorted(status), list(range(3300, 3314)))
        # Preset 1 selected, ready, not running, no alarm.
        self.assertEqual([status[address] for address in (3303, 3306, 3307, 3308)], [1, 1, 0, 0])

    def test_writes_a_register(self):
        self.assert_ends(mbpoll(self.tool, *PARAMETERS, "-r", "17", values=["310"]), 0)
        self.assertEqual(registers(mbpoll(self.tool, *PARAMETERS, "-r", "17")), {17: 310})
        seen = support.spindle("get", self.tool.url, "--profile", "doga-bm",
                               "preset.2.target-torque")
        self.assertEqual(seen.value_of("preset.2.target-torque"), 3.1)

    def test_is_told_what_does_not_exist(self):
        for table, address in ((PARAMETERS, 564), (PARAMETERS, 726), (INPUTS, 3214)):
            with self.subTest(table=table, address=address):
                outcome = mbpoll(self.tool, *table, "-r", address)
                self.assertNotEqual(outcome.status, 0)
                self.assertIn("Illegal data address", outcome.out + outcome.err)

    def test_is_refused_a_value_above_the_maximum(self):
        outcome = mbpoll(self.tool, *PARAMETERS, "-r", "2", values=["601"])
        self.assertNotEqual(outcome.status, 0)
        self.assertIn("Invalid exception code", outcome.out + outcome.err)  # 0E: not in libmodbus
        self.assertEqual(registers(mbpoll(self.tool, *PARAMETERS, "-r", "2")), {2: 271})


if __name__ == "__main__":
    unittest.main(verbosity=2)
