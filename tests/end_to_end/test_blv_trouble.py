"""A BLV motor that was started is stopped, whatever happens to the line or the driver."""

import signal
import time
import unittest

import support
from blv import (
    BAD_FRAMES, Bus, ERROR_LIMIT, FORWARD, kill_with_guardian, LossyRun, LOST_LINE, MotorTest,
    OtherMaster, PATIENCE, PLACES, run, SpoiltStart, start, START_BITS, STOP, TIMEOUT)


class TroubleTest(MotorTest):
    def test_an_alarm_while_it_runs(self):
        with Bus() as bus, OtherMaster(bus) as other:
            other.write(1, ERROR_LIMIT, 1)
            with self.running(bus, "--json") as started:
                support.wait_until(bus.turns, "the motor turns")
                # More than one, as each may meet a frame of the program; one alone raises the alarm.
                for _ in range(3):
                    other.send(b"\x01\x03\x00\x00\x00\x00\x00\x00")
                finished = started.finish()
            self.assertIn(finished.status, (1, 5, 7), finished)
            self.assertTrue(finished.records()[-1]["stop_confirmed"], finished)
            self.assertEqual(self.values(bus.url, "alarm.present")["alarm.present"], BAD_FRAMES)
            self.assert_stopped(bus, finished)

    def test_a_driver_that_does_not_do_what_it_acknowledges(self):
        with Bus() as bus:
            # Set, and not configured: what starts a driver with three wires moves nothing here.
            self.assertEqual(run("set", bus.url, "motor.input-mode=3-wire").status, 0)
            finished = start(bus.url)
            self.assertEqual(finished.status, 8, finished)
            self.assertIn("does not run", finished.said)
            commands = bus.commands()
            self.assertEqual([c for c in commands if c & START_BITS], [START_BITS | 2], finished)
            self.assertEqual(commands[-1], STOP)  # one that no wiring takes for a start
            self.assert_stands_still(bus.url)

    def test_faults_at_the_start(self):
        for fault, status in (("lost", 5), ("exception", 6), ("half", 5), ("bad-crc", 7)):
            with self.subTest(fault), Bus() as bus:
                with SpoiltStart(bus, fault) as line:
                    finished = start(line.url, "--for", "1s", "--json")
                self.assertEqual(line.spoilt, 1, finished)
                self.assertIn("write register 125", finished.said)
                self.assertEqual(finished.status, status, finished)
                self.assertTrue(finished.records()[-1]["stop_confirmed"], finished)
                self.assert_stopped(bus, finished)

    def test_answers_that_get_lost(self):
        with Bus() as bus, LossyRun(bus) as line:
            # Where the machine makes other answers late besides, a run may end before its start.
            finished = support.first_good(
                lambda: start(line.url, "--for", "1s", "--timeout", "250ms", "--json"), lambda _: bus.has_started())
            self.assertIn(finished.status, (0, 5), finished)
            self.assertGreater(line.lost, 0, finished)
            self.assertTrue(finished.records()[-1]["stop_confirmed"], finished)
            self.assert_stop_was_sent(bus, finished)
            self.assertEqual(run("remote-stop", line.url, "--timeout", "250ms").status, 0)

    def test_an_adapter_that_is_pulled_out(self):
        for where in PLACES:
            with self.subTest(where), Bus(where=where) as bus:
                with self.running(bus, "--json") as started:
                    support.wait_until(bus.turns, "the motor turns")
                    began = support.paced()
                    bus.pull_out()
                    finished = started.finish()
                self.assertEqual(finished.status, 5, finished)
                self.assertLess(support.paced() - began, PATIENCE + support.SOON, finished)
                self.assertIn("THE TOOL MAY STILL RUN", finished.said)
                self.assertIn("stop it at the tool", finished.said)
                self.assertFalse(finished.records()[-1]["stop_confirmed"], finished)


class WatchdogTest(MotorTest):
    def test_a_program_that_is_killed(self):
        for where in PLACES:
            with self.subTest(where), Bus(where=where) as bus:
                with self.running(bus, "--watchdog", "1s", "--json") as started:
                    support.wait_until(bus.turns, "the motor turns")
                    kill_with_guardian(started.process)
                    support.wait_for_end(started.process)
                # A question feeds the watchdog, so none is asked before it has acted.
                time.sleep(1.5)
                self.assertEqual(self.values(bus.url, "alarm.present"), {"alarm.present": LOST_LINE})
                support.wait_until(lambda: self.values(bus.url, "monitor.feedback-speed") ==
                                   {"monitor.feedback-speed": 0}, "the motor stands still", 3)
                self.assertEqual(bus.commands(), [FORWARD])
                self.assert_stands_still(bus.url)
                # What the driver was found with is unknown to the next program: it says so itself.
                self.assertEqual(self.values(bus.url, "communication.timeout")["communication.timeout"], 1000)

    def test_without_it_the_motor_runs_on(self):
        """The warning that remote-start gives is true."""
        with Bus() as bus:
            with self.running(bus, "--json") as started:
                support.wait_until(bus.turns, "the motor turns")
                kill_with_guardian(started.process)
                told = started.finish().stderr
            self.assertIn("communication.timeout is off", told)
            time.sleep(1.2)
            self.assertNotEqual(self.values(bus.url, "monitor.feedback-speed")["monitor.feedback-speed"], 0)
            stopped = run("remote-stop", bus.url, "--json")
            self.assertEqual(stopped.records("action")[0]["result"], "confirmed", stopped)
            self.assert_stopped(bus)

    def test_the_setting_before_it_is_restored(self):
        for number, status in ((None, 0), (signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(number), Bus() as bus:
                # Long ones: on a busy machine it takes seconds until the next request comes.
                self.assertEqual(run("set", bus.url, "communication.timeout=10000").status, 0)
                allowed = ["--for", "300ms"] if number is None else []
                with self.running(bus, "--watchdog", "9s", "--json", *allowed) as started:
                    if number is not None:
                        started.send_signal(number)
                    finished = started.finish()
                self.assertEqual(finished.status, status, finished)
                self.assertEqual(bus.written(TIMEOUT), [10000, 9000, 10000], finished)
                self.assertEqual(self.values(bus.url, "communication.timeout")["communication.timeout"], 10000)
                self.assert_stopped(bus, finished)


if __name__ == "__main__":
    unittest.main()
