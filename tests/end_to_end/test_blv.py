"""A bus of simulated BLV drivers, served by the real binary on a pseudo terminal and behind a port: stops,
scans, and settings that are saved and put back."""

import unittest

import support
from blv import Bus, COMMAND, FORWARD, MotorTest, OtherMaster, PLACES, run, start, START_BITS


class StopTest(MotorTest):
    """Motors that another master has started, and that no program guards."""

    def start_two(self, bus):
        with OtherMaster(bus) as other:
            for unit in (1, 2):
                other.write(unit, COMMAND, FORWARD)
        for unit in (1, 2):
            support.wait_until(lambda u=unit: self.values(bus.unit(u), "monitor.feedback-speed")
                               ["monitor.feedback-speed"], "the motor turns")

    def test_one_of_two(self):
        with Bus() as bus:
            self.start_two(bus)
            stopped = run("remote-stop", bus.unit(1), "--json")
            self.assertEqual(stopped.status, 0, stopped)
            self.assertEqual([a["result"] for a in stopped.records("action")], ["confirmed"])
            self.assert_stands_still(bus.unit(1))
            self.assertIn("MOVE", str(self.values(bus.unit(2), "status.driver-output")))

    def test_all_units(self):
        for command in (["remote-stop"], ["do", "stop"]):
            with self.subTest(command), Bus() as bus:
                self.start_two(bus)
                refused = run(command[0], bus.unit(0), *command[1:], "--yes")
                self.assertEqual(refused.status, 2, refused)
                sent = run(command[0], bus.unit(0), *command[1:], "--broadcast", "--yes", "--json")
                self.assertEqual(sent.status, 0, sent)
                self.assertEqual([a["result"] for a in sent.records("action")], ["sent"], sent)
                for unit in (1, 2):
                    support.wait_until(lambda u=unit: "MOVE" not in str(
                        self.values(bus.unit(u), "status.driver-output")), "the motor stands still")
                    self.assert_stands_still(bus.unit(unit))
                self.assertFalse(bus.commands(unit=0)[-1] & START_BITS)

    def test_a_stop_of_several_waits_for_no_unit_that_is_not_there(self):
        with Bus(units="1") as bus:
            stopped = run("remote-stop", bus.unit(8), bus.unit(9), bus.unit(1), "--json")
            self.assertEqual(stopped.status, 9, stopped)
            self.assertEqual([r["target"] for r in stopped.records("action")], [bus.unit(1)], stopped)
            told = [tuple(request[:2]) for request in bus.requests()]
            self.assertEqual(told[:3], [(8, 6), (9, 6), (1, 6)], told)
            self.assertFalse(bus.commands()[0] & START_BITS, bus.commands())

    def test_what_is_set_for_everybody(self):
        with Bus() as bus:
            sent = run("set", bus.unit(0), "operation.5.speed=900", "--broadcast", "--yes", "--json")
            self.assertEqual(sent.status, 0, sent)
            self.assertEqual([w["result"] for w in sent.records("write")], ["sent"], sent)
            self.assertNotIn('"ok"', sent.stdout)
            for unit in (1, 2, 3):
                self.assertEqual(self.values(bus.unit(unit), "operation.5.speed"), {"operation.5.speed": 900})


class RoundTripTest(MotorTest):
    def test_backup_change_diff_restore(self):
        for where in PLACES:
            with self.subTest(where), Bus(where=where) as bus:
                file = support.home().path / f"before{PLACES.index(where)}.yaml"
                self.assertEqual(start(bus.url, "--for", "1s").status, 0)
                ran = bus.commands()
                saved = run("backup", bus.url, "-f", file)
                self.assertEqual(saved.status, 0, saved)
                changes = {"operation.4.speed": 700, "motor.jog-speed": 250, "operation.7.torque-limit": 90}
                changed = run("set", bus.url, *(f"{name}={value}" for name, value in changes.items()))
                self.assertEqual(changed.status, 0, changed)
                different = run("diff", file, bus.url, "--json")
                self.assertEqual(different.status, 1, different)
                self.assertEqual({r["name"] for r in different.records("diff")}, set(changes), different)
                restored = run("restore", bus.url, file, "--yes")
                self.assertEqual(restored.status, 0, restored)
                same = run("diff", file, bus.url, "--json")
                self.assertEqual((same.status, same.records("diff")), (0, []), same)
                self.assertEqual(bus.commands(), ran)  # no command among what is restored


class ScanTest(MotorTest):
    def test_one_driver_among_31_addresses(self):
        def scan():
            with Bus(units="17") as bus:
                url = bus.url.partition("?")[0]
                return run("scan", url, "--units", "1-31", "--timeout", "250ms", "--json"), bus.requests()

        # Each is asked once: the first by a reading, as a loop-back tells no echo of the adapter from an answer.
        all_once = list(range(1, 32))
        finished, requests = support.first_good(scan, lambda scanned: scanned[0].status == 0)
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual([r["unit"] for r in finished.records("unit")], [17])
        self.assertEqual([r[0] for r in requests], all_once)
        self.assertEqual({r[1] for r in requests[1:]}, {8})


if __name__ == "__main__":
    unittest.main()
