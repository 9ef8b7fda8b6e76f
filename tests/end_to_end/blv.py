"""Simulated BLV drivers on a line, what is said to them, and a motor that is run."""

import contextlib
import os
import pathlib
import re
import selectors
import signal
import struct
import time
import unittest

import frames
import support

PROFILE = ["--profile", "orientalmotor-blv"]
PROMPT = 2.5  # for what takes a few tenths of a second on a machine that has nothing else to do
PATIENCE = 10.0  # for how long a stop is tried

WRITE_SINGLE, WRITE_MULTIPLE = 0x06, 0x10
COMMAND = 125  # 007Dh, lower half of the driver input command
START_BITS = 0x18  # FWD and REV of two wires
FORWARD, STOP = 0x2A, 0x22  # of operation data 2: FWD, and only STOP-MODE, which decelerates
TIMEOUT, ERROR_LIMIT = 4609, 4611
LOST_LINE, BAD_FRAMES = "85h", "84h"


class Bus(support.SimulatedLine):
    """Simulated drivers, with what the simulator heard.

    They hear frames also without silence before them, unless `silence` is asked for: a simulator that the
    machine keeps from listening for some milliseconds sees none where there was enough. That the program
    keeps it is shown in test_serial_line."""

    def __init__(self, *options, units="1-3", where="--pty", silence=False):
        super().__init__("orientalmotor-blv", "--units", units, *([] if silence else ["--no-gap"]), *options,
                         where=where)

    def pull_out(self):
        """The name of the line goes too: a terminal that the system made for another program could soon
        stand behind it."""
        self.path.unlink(missing_ok=True)
        self.kill()

    def unit(self, number):
        return re.sub(r"unit=\d+", f"unit={number}", self.url)

    def commands(self, unit=1):
        """What was written to the command register of a unit, in order."""
        return [write.value for write in self.writes() if (write.unit, write.register) == (unit, COMMAND)]

    def written(self, register):
        return [write.value for write in self.writes() if write.register == register]

    def has_started(self):
        return any(command & START_BITS for command in self.commands())

    def turns(self):
        """The motor was started, and has been looked at a few times since."""
        requests = self.requests()
        starts = [index for index, request in enumerate(requests) if starts_a_motor(request)]
        return starts and len(requests) > starts[0] + 6


class OtherMaster:
    """Another master on the line, which writes frames by hand. Opened before a program locks the port."""

    SILENCE = 0.010

    def __init__(self, bus):
        self._line = os.open(bus.path, os.O_RDWR | os.O_NOCTTY)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._line, selectors.EVENT_READ)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._selector.close()
        os.close(self._line)

    def send(self, frame):
        time.sleep(self.SILENCE)
        os.write(self._line, frame)

    def write(self, unit, register, value):
        """Writes with function 06 and takes the echo; registers of 32 bits by their lower half."""
        request = frames.with_checksum(struct.pack(">BBHH", unit, WRITE_SINGLE, register, value))
        self.send(request)
        answer = b""
        while len(answer) < len(request):
            if not self._selector.select(support.DEADLINE):
                raise AssertionError(f"unit {unit} does not answer: {answer.hex(' ')}")
            answer += os.read(self._line, 256)
        if answer != request:
            raise AssertionError(f"not the echo of {request.hex(' ')}: {answer.hex(' ')}")


def starts_a_motor(request):
    return any(write.register == COMMAND and write.value & START_BITS for write in support.writes_of(request))


class Line(support.SerialEnd):
    """A line between the program and a bus that carries everything, but not each answer as it is.

    A fault that the simulator counts would not do: how many requests go before the start depends on how
    soon answers come, as the first ones are proved.
    """

    def __init__(self, bus):
        super().__init__()
        self._drivers = os.open(bus.path, os.O_RDWR | os.O_NOCTTY)

    def __exit__(self, *_):
        super().__exit__()
        os.close(self._drivers)

    def _frame(self, line):
        """The next whole frame, or nothing once the line is not needed any more."""
        frame = b""
        while not self._ended:
            frame += self._arrived(line)
            if len(frame) > 3 and frames.with_checksum(frame[:-2]) == frame:
                return frame
        return b""

    def _serve(self):
        while request := self._frame(self._line):
            os.write(self._drivers, request)
            if answer := self._frame(self._drivers):
                os.write(self._line, self._carried(request, answer))

    def _carried(self, request, answer):
        """What of an answer reaches the program."""
        raise NotImplementedError


class SpoiltStart(Line):
    """Spoils the answer to a start."""

    FAULTS = {
        "lost": lambda answer: b"",
        "exception": lambda answer: frames.with_checksum(bytes([answer[0], answer[1] | 0x80, 0x04])),
        "half": lambda answer: answer[:len(answer) // 2],
        "bad-crc": lambda answer: answer[:-1] + bytes([answer[-1] ^ 0xFF]),
    }

    def __init__(self, bus, fault):
        super().__init__(bus)
        self._spoil = self.FAULTS[fault]
        self.spoilt = 0

    def _carried(self, request, answer):
        if not starts_a_motor(request):
            return answer
        self.spoilt += 1
        return self._spoil(answer)


class LossyRun(Line):
    """Loses every fifth answer once a motor was started."""

    def __init__(self, bus):
        super().__init__(bus)
        self._answers = 0
        self.lost = 0

    def _carried(self, request, answer):
        if self._answers > 0 or starts_a_motor(request):
            self._answers += 1
        if self._answers % 5 != 4:
            return answer
        self.lost += 1
        return b""


def run(command, url, *arguments, **how):
    return support.run(command, url, *PROFILE, *arguments, **how)


def arguments_of_start(url, *options):
    return ["remote-start", url, *PROFILE, "--yes", "--speed", "500", "--deceleration", "0.2", *options]


def start(url, *options):
    return support.run(*arguments_of_start(url, *options))


class MotorTest(unittest.TestCase):
    def values(self, url, *names):
        """As they are shown: labels where there are any."""
        finished = run("get", url, *names, "--json")
        self.assertEqual(finished.status, 0, finished)
        return {record["name"]: record["label"] or record["value"] for record in finished.records("value")}

    def assert_stands_still(self, url):
        values = self.values(url, "monitor.feedback-speed", "status.driver-output")
        self.assertEqual(values["monitor.feedback-speed"], 0)
        self.assertNotIn("MOVE", str(values["status.driver-output"]))

    def assert_stop_was_sent(self, bus, finished=None):
        """Started exactly once, and after that nothing but stops."""
        commands = bus.commands()
        starts = [index for index, command in enumerate(commands) if command & START_BITS]
        self.assertEqual(len(starts), 1, (commands, finished))
        self.assertEqual(commands[starts[0]], FORWARD)
        self.assertIn(STOP, commands[starts[0] + 1:], (commands, finished))

    def assert_stopped(self, bus, finished=None):
        self.assert_stop_was_sent(bus, finished)
        self.assert_stands_still(bus.url)

    @contextlib.contextmanager
    def running(self, bus, *options, **how):
        """A remote start whose motor turns."""
        with support.Running(*arguments_of_start(bus.url, *options), **how) as started:
            support.wait_until(lambda: bus.has_started() or started.process.poll() is not None, "the motor is started")
            self.assertIsNone(started.process.poll(), f"it ended before it started the motor: {bus.told()}")
            yield started


PLACES = ("--pty", "rtu+tcp://127.0.0.1:0")


def kill_with_guardian(process):
    """What is left is the driver alone, as when the computer fails."""
    for child in pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
        os.kill(int(child), signal.SIGKILL)
    process.kill()
