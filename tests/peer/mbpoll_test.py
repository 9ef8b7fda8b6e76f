"""mbpoll, a client of others, against our simulated tool."""

import unittest

import support

support.need_program("mbpoll")

PARAMETERS = ("-t", "4")
INPUTS = ("-t", "3")


class Simulator(support.ServedTest):

    def mbpoll(self, *arguments, values=()):
        return support.mbpoll("tcp", "-p", self.server.port, *arguments, "127.0.0.1", *values)

    def test_shows_the_example_of_the_manual(self):
        outcome = self.mbpoll(*PARAMETERS, "-r", "2", "-c", "2")
        self.assert_ends(outcome, 0)
        self.assertEqual(support.registers(outcome), {2: 271, 3: 1000})

    def test_shows_input_registers(self):
        outcome = self.mbpoll(*INPUTS, "-r", "3300", "-c", "14")
        self.assert_ends(outcome, 0)
        status = support.registers(outcome)
        self.assertEqual(sorted(status), list(range(3300, 3314)))
        # Preset 1 selected, ready, not running, no alarm.
        self.assertEqual([status[address] for address in (3303, 3306, 3307, 3308)], [1, 1, 0, 0])

    def test_writes_a_register(self):
        self.assert_ends(self.mbpoll(*PARAMETERS, "-r", "17", values=["310"]), 0)
        self.assertEqual(support.registers(self.mbpoll(*PARAMETERS, "-r", "17")), {17: 310})
        seen = support.spindle("get", self.url, "--profile", "doga-bm",
                               "preset.2.target-torque")
        self.assertEqual(seen.value_of("preset.2.target-torque"), 3.1)

    def test_is_told_what_does_not_exist(self):
        for table, address in ((PARAMETERS, 564), (PARAMETERS, 726), (INPUTS, 3214)):
            with self.subTest(table=table, address=address):
                outcome = self.mbpoll(*table, "-r", address)
                self.assertNotEqual(outcome.status, 0)
                self.assertIn("Illegal data address", outcome.out + outcome.err)

    def test_is_refused_a_value_above_the_maximum(self):
        outcome = self.mbpoll(*PARAMETERS, "-r", "2", values=["601"])
        self.assertNotEqual(outcome.status, 0)
        self.assertIn("Invalid exception code", outcome.out + outcome.err)  # 0E: not in libmodbus
        self.assertEqual(support.registers(self.mbpoll(*PARAMETERS, "-r", "2")), {2: 271})


if __name__ == "__main__":
    unittest.main(verbosity=2)
