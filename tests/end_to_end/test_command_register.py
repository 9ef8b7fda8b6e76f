"""Drives that are run by one command register, from a profile alone: a motor that was started is stopped,
whatever happens to the program or the line."""

import contextlib
import os
import pathlib
import signal
import struct
import unittest

import support

PROFILES = pathlib.Path(__file__).resolve().parent.parent / "profiles" / "good"
PLACES = ("--pty", "rtu+tcp://127.0.0.1:0")


class Vfd:
    """A frequency inverter: 1 turns it, 5 stops it."""

    name = "fc01-vfd"
    command, width = 0x2000, 1
    starts, stop = (1, 2), 5
    speed = ["--speed", "25.50"]
    set_point = "setpoint"

    @staticmethod
    def is_still(values):
        return values["status"] == "stopped" and values["output"] == 0

    shown = ("status", "output")


class Held:
    """A drive that has to be held before it turns, with commands of 32 bits and a stop of its own."""

    name = "held-drive"
    command, width = 0x007C, 2
    starts, stop = (0x00040001, 0x00080001), 1
    speed = ["--speed", "500"]
    set_point = "speed"

    @staticmethod
    def is_still(values):
        return values["command-speed"] == 0 and "MOVE" not in str(values["status"])

    shown = ("status", "command-speed")


class Line(support.SimulatedLine):
    """A simulated drive, with what the simulator heard."""

    def __init__(self, drive, *options, where="--pty"):
        self.drive = drive
        self.profile = PROFILES / f"{drive.name}.yaml"
        super().__init__(self.profile, *options, where=where)

    def commands(self):
        """What was written to the command register, in order; of two registers the higher word first."""
        words = [write.value for write in self.writes()
                 if 0 <= write.register - self.drive.command < self.drive.width]
        pairs = zip(*[iter(words)] * self.drive.width)
        return [int.from_bytes(struct.pack(f">{len(pair)}H", *pair), "big") for pair in pairs]

    def has_started(self):
        return any(command in self.drive.starts for command in self.commands())

    def arguments_of_start(self, *options):
        return ["remote-start", self.url, "--profile", str(self.profile), "--yes", *self.drive.speed, *options]

    def values(self, *names):
        """Read as soon as the guardian has left the line."""
        def read():
            finished = support.run("get", self.url, "--profile", str(self.profile), *names, "--json")
            return None if "in use by guardian" in finished.said else finished

        finished = support.wait_until(read, "the guardian leaves the line")
        if finished.status != 0:
            raise AssertionError(finished)
        return {record["name"]: record["label"] or record["value"] for record in finished.records("value")}

    @contextlib.contextmanager
    def running(self, *options, **how):
        with support.Running(*self.arguments_of_start(*options), **how) as started:
            support.wait_until(self.has_started, "the motor is started")
            yield started


class CommandRegisterTest(unittest.TestCase):
    def assert_stopped(self, line, finished=None):
        """Started exactly once, and behind that nothing but stops."""
        commands = line.commands()
        starts = [index for index, command in enumerate(commands) if command in line.drive.starts]
        self.assertEqual(len(starts), 1, (commands, finished))
        self.assertIn(line.drive.stop, commands[starts[0] + 1:], (commands, finished))
        values = line.values(*line.drive.shown)
        self.assertTrue(line.drive.is_still(values), (values, finished))

    def test_the_time_allowed(self):
        for drive in (Vfd, Held):
            for where in PLACES:
                with self.subTest(drive.name, where=where), Line(drive, where=where) as line:
                    before = line.values(drive.set_point)
                    finished = support.run(*line.arguments_of_start("--for", "500ms", "--json"))
                    self.assertEqual(finished.status, 0, finished)
                    summary = finished.records()[-1]
                    self.assertEqual((summary["result"], summary["stop_confirmed"]), ("ran", True))
                    self.assert_stopped(line, finished)
                    self.assertEqual(line.values(drive.set_point), before)

    def test_signals(self):
        for drive in (Vfd, Held):
            for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 143)):
                with self.subTest(drive.name, number=number), Line(drive) as line:
                    with line.running("--json") as started:
                        started.send_signal(number)
                        finished = started.finish()
                    self.assertEqual(finished.status, status, finished)
                    self.assertTrue(finished.records()[-1]["stop_confirmed"], finished)
                    self.assert_stopped(line, finished)

    def test_a_program_that_is_killed(self):
        for drive in (Vfd, Held):
            for where in PLACES:
                with self.subTest(drive.name, where=where), Line(drive, where=where) as line:
                    with line.running() as started:
                        os.kill(started.pid, signal.SIGKILL)
                        finished = started.finish()
                    support.wait_until(lambda: self.is_still(line), "the guardian stops the motor")
                    self.assert_stopped(line, finished)

    def test_answers_that_get_lost(self):
        for drive in (Vfd, Held):
            for fault in ("lost@every:7", "late=700ms@every:9", "bad-crc@every:7"):
                with self.subTest(drive.name, fault=fault), Line(drive, "--fault", fault) as line:
                    finished = support.run(*line.arguments_of_start("--for", "500ms", "--json"))
                    if line.has_started():
                        self.assertTrue(finished.records()[-1]["stop_confirmed"], finished)
                    support.wait_until(lambda: self.is_still(line), "the motor stands still")

    @staticmethod
    def is_still(line):
        finished = support.run("get", line.url, "--profile", str(line.profile), *line.drive.shown, "--json")
        if finished.status != 0:
            return False
        values = {record["name"]: record["label"] or record["value"] for record in finished.records("value")}
        return line.drive.is_still(values)


if __name__ == "__main__":
    unittest.main()
