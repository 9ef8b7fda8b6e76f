"""Drives that are run by one command register, from a profile alone: a motor that was started is stopped,
whatever happens to the program or the line."""

import contextlib
import os
import pathlib
import re
import signal
import struct
import subprocess
import tempfile
import unittest

import support

PROFILES = pathlib.Path(__file__).resolve().parent.parent / "profiles" / "good"
PLACES = ("--pty", "rtu+tcp://127.0.0.1:0")
WRITE_SINGLE, WRITE_MULTIPLE = 0x06, 0x10


def tearDownModule():
    support.remove_home()


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


class Line:
    """A simulated drive, with what the simulator heard."""

    def __init__(self, drive, *options, where="--pty"):
        self.drive = drive
        self.profile = PROFILES / f"{drive.name}.yaml"
        self._folder = tempfile.TemporaryDirectory(prefix="spindle-drive-")
        folder = pathlib.Path(self._folder.name)
        self._log = folder / "log"
        place = ["--pty", folder / "line"] if where == "--pty" else ["--listen", where]
        arguments = ["simulate", self.profile, *place, "-v", *options]
        with open(self._log, "wb") as log:
            self.process = subprocess.Popen(
                [support.binary(), *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=log, text=True, env=support.home().environment(), cwd=support.home().path)
        self.url = self.process.stdout.readline().strip()
        if not self.url:
            raise AssertionError(f"the simulator does not serve: {self._log.read_text()}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.terminate()
            support.wait_for_end(self.process)
        self.process.stdout.close()
        self._folder.cleanup()

    def commands(self):
        """What was written to the command register, in order."""
        found = []
        for text in re.findall(r" -> ([0-9A-Fa-f ]+)$", self._log.read_text(), re.MULTILINE):
            request = bytes.fromhex(text)[:-2]
            _, function, register = struct.unpack_from(">BBH", request)
            if register != self.drive.command:
                continue
            if function == WRITE_SINGLE:
                found.append(struct.unpack_from(">H", request, 4)[0])
            if function == WRITE_MULTIPLE:
                found.append(int.from_bytes(request[7:7 + 2 * self.drive.width], "big"))
        return found

    def has_started(self):
        return any(command in self.drive.starts for command in self.commands())

    def arguments_of_start(self, *options):
        return ["remote-start", self.url, "--profile", str(self.profile), "--yes", *self.drive.speed, *options]

    def values(self, *names):
        finished = support.run("get", self.url, "--profile", str(self.profile), *names, "--json")
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
