"""A BLV motor that was started is stopped, however the program ends."""

import contextlib
import os
import signal
import time
import unittest

import support
from blv import (
    arguments_of_start, Bus, MotorTest, PLACES, PROMPT, run, start, START_BITS, STOP, TIMEOUT,
    WRITE_MULTIPLE)


class EndingTest(MotorTest):
    def test_the_time_allowed(self):
        for where in PLACES:
            with self.subTest(where), Bus(where=where) as bus:
                finished = start(bus.url, "--for", "400ms", "--json")
                self.assertEqual(finished.status, 0, finished)
                summary = finished.records()[-1]
                self.assertEqual((summary["result"], summary["stop_confirmed"]), ("ran", True))
                self.assertGreater(finished.seconds, 0.4)
                self.assert_stopped(bus, finished)

    def test_what_happens_is_told_while_it_runs(self):
        for form in ("table", "json", "csv"):
            with self.subTest(form), Bus() as bus, self.running(bus, "-o", form) as started:
                while "started" not in started.line():
                    pass
                # Nothing but the signal ends this run, so it still goes on.
                self.assertEqual([c for c in bus.commands() if not c & START_BITS], [])
                started.send_signal(signal.SIGINT)
                finished = started.finish()
                self.assertEqual(finished.status, 130, finished)
                self.assertIn("stopped", finished.stdout)
                self.assertNotIn("started", finished.stdout)

    def test_a_program_that_is_held_up_longer_than_the_watchdog_allows(self):
        with Bus() as bus:
            with self.running(bus, "--watchdog", "500ms", "--for", "1s", "--json") as started:
                support.wait_until(bus.turns, "the motor turns")
                os.kill(started.pid, signal.SIGSTOP)
                time.sleep(2)  # the driver stops by itself, and the time allowed is over
                os.kill(started.pid, signal.SIGCONT)
                finished = started.finish()
            self.assertEqual(finished.status, 1, finished)
            self.assertIn("85h", finished.said)
            self.assertEqual(finished.records()[-1]["result"], "alarm", finished)
            self.assertIn("alarm", [event["kind"] for event in finished.records("event")])
            self.assert_stopped(bus, finished)

    def test_a_signal_while_the_watchdog_is_set(self):
        """The motor was not started yet; the driver would stop with an alarm when no master asks any more."""
        for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(number), Bus() as bus:
                with support.Running(*arguments_of_start(bus.url, "--watchdog", "9s", "--json")) as started:
                    support.wait_until(lambda: bus.written(TIMEOUT), "the watchdog is set")
                    started.send_signal(number)
                    finished = started.finish()
                self.assertEqual(finished.status, status, finished)
                self.assertEqual(bus.written(TIMEOUT)[-1], 0, finished)
                self.assert_stands_still(bus.url)
                self.assertEqual(self.values(bus.url, "communication.timeout"), {"communication.timeout": 0})

    def test_signals(self):
        # Ctrl-Z too: a suspended program would stop no motor.
        endings = ((signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 143), (signal.SIGTSTP, 130))
        seconds = []
        for where in PLACES:
            for number, status in endings:
                with self.subTest(number, where=where), Bus(where=where) as bus:
                    with self.running(bus, "--json") as started:
                        started.send_signal(number)
                        finished = started.finish()
                    self.assertEqual(finished.status, status, finished)
                    self.assertLess(finished.paced, support.SOON, finished)
                    seconds.append(finished.paced)
                    self.assertTrue(finished.records()[-1]["stop_confirmed"], finished)
                    self.assert_stopped(bus, finished)
        self.assertLess(min(seconds), PROMPT, seconds)

    def test_a_reader_that_goes(self):
        for where in PLACES:
            with self.subTest(where), Bus(where=where) as bus:
                reading, writing = os.pipe()
                with self.running(bus, "--json", stdout=writing) as started:
                    os.close(writing)
                    support.wait_until(bus.turns, "the motor turns")
                    os.close(reading)
                    finished = started.finish()
                self.assertEqual(finished.status, 1, finished)
                self.assertIn("has no reader", finished.said)
                self.assert_stopped(bus, finished)

    def test_the_driver_is_left_as_it_was_found(self):
        names = ("operation.2.speed", "operation.2.deceleration-time", "communication.timeout")
        with Bus() as bus:
            before = self.values(bus.url, *names)
            with self.running(bus, "--watchdog", "9s", "--json") as started:
                support.wait_until(bus.turns, "the motor turns")
                started.send_signal(signal.SIGINT)
                finished = started.finish()
            self.assertEqual(finished.status, 130, finished)
            self.assertIsNone(finished.records()[-1]["left"], finished)
            self.assertEqual(self.values(bus.url, *names), before)
            self.assert_stopped(bus, finished)

    def test_the_children_of_a_group_are_left_alone(self):
        with Bus(units="1-2") as bus:
            child = bus.unit(2)
            self.assertEqual(run("do", child, "group=1").status, 0)
            before = self.values(child, "operation.2.speed", "operation.2.deceleration-time", "command.driver-input")
            heard = len(bus.requests())
            finished = start(bus.url, "--for", "300ms", "--watchdog", "9s")
            self.assertEqual(finished.status, 0, finished)
            functions = {request[1] for request in bus.requests()[heard:]}
            self.assertNotIn(WRITE_MULTIPLE, functions)  # the only function that reaches a group
            self.assertEqual(
                self.values(child, "operation.2.speed", "operation.2.deceleration-time", "command.driver-input"),
                before)

    def test_a_reader_that_takes_nothing(self):
        """A pipe that is full from the beginning: what is told waits, and the stop does not."""
        with Bus() as bus:
            reading, writing = support.small_pipe()
            os.set_blocking(writing, False)
            with contextlib.suppress(BlockingIOError):
                while os.write(writing, b" " * 4096):
                    pass
            os.set_blocking(writing, True)
            with support.Running(*arguments_of_start(bus.url, "--for", "500ms", "--json"), stdout=writing) as started:
                os.close(writing)
                is_stopped = lambda: bus.has_started() and STOP in bus.commands()  # noqa: E731
                support.wait_until(lambda: is_stopped() or started.process.poll() is not None, "the motor is stopped")
                was_stopped = is_stopped()
                told = b""
                while chunk := os.read(reading, 65536):
                    told += chunk
                os.close(reading)
                finished = started.finish()
            self.assertTrue(was_stopped, finished)
            self.assertEqual(finished.status, 0, finished)
            self.assertIn(b'"result":"ran"', told)
            self.assert_stopped(bus, finished)

    def test_a_reader_that_was_never_there(self):
        with Bus() as bus:
            reading, writing = os.pipe()
            os.close(reading)
            with support.Running(*arguments_of_start(bus.url), stdout=writing) as started:
                os.close(writing)
                finished = started.finish()
            self.assertEqual(finished.status, 1, finished)
            self.assertIn("has no reader", finished.said)
            self.assert_stopped(bus, finished)


if __name__ == "__main__":
    unittest.main()
