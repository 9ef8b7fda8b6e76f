"""A bus of simulated BLV drivers, served by the real binary on a pseudo terminal and behind a port: a
motor that was started is stopped, whatever happens to the program, the line or the driver."""

import contextlib
import dataclasses
import os
import pathlib
import re
import selectors
import signal
import struct
import subprocess
import tempfile
import time
import unittest

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


def tearDownModule():
    support.remove_home()


def with_checksum(frame):
    crc = 0xFFFF
    for byte in frame:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
    return frame + struct.pack("<H", crc)


@dataclasses.dataclass(frozen=True)
class Write:
    unit: int
    register: int
    value: int


def writes_of(frame):
    """The registers that a request writes, in order."""
    unit, function, register = struct.unpack_from(">BBH", frame)
    if function == WRITE_SINGLE:
        return [Write(unit, register, struct.unpack_from(">H", frame, 4)[0])]
    if function != WRITE_MULTIPLE:
        return []
    values = struct.unpack_from(f">{frame[6] // 2}H", frame, 7)
    return [Write(unit, register + index, value) for index, value in enumerate(values)]


class Bus:
    """Simulated drivers on a pseudo terminal or behind a port, with what the simulator heard.

    They hear frames also without silence before them, unless `silence` is asked for: a simulator that the
    machine keeps from listening for some milliseconds sees none where there was enough. That the program
    keeps it is shown in test_serial_line."""

    def __init__(self, *options, units="1-3", where="--pty", silence=False):
        self._folder = tempfile.TemporaryDirectory(prefix="spindle-blv-")
        folder = pathlib.Path(self._folder.name)
        self.path = folder / "line"
        self._log = folder / "log"
        place = ["--pty", self.path] if where == "--pty" else ["--listen", where]
        arguments = ["simulate", "orientalmotor-blv", *place, "--units", units, "-v",
                     *([] if silence else ["--no-gap"]), *options]
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

    def pull_out(self):
        """The name of the line goes too: a terminal that the system made for somebody else could soon
        stand behind it."""
        self.path.unlink(missing_ok=True)
        self.process.kill()
        support.wait_for_end(self.process)

    def unit(self, number):
        return re.sub(r"unit=\d+", f"unit={number}", self.url)

    def told(self):
        return self._log.read_text()

    def requests(self):
        """Whole requests in order, without their checksums."""
        found = re.findall(r" -> ([0-9A-Fa-f ]+)$", self._log.read_text(), re.MULTILINE)
        return [frame[:-2] for text in found for frame in support.rtu_requests(bytes.fromhex(text))]

    def commands(self, unit=1):
        """What was written to the command register of a unit, in order."""
        return [write.value for request in self.requests() for write in writes_of(request)
                if (write.unit, write.register) == (unit, COMMAND)]

    def written(self, register):
        return [write.value for request in self.requests() for write in writes_of(request)
                if write.register == register]

    def has_started(self):
        return any(command & START_BITS for command in self.commands())

    def turns(self):
        """The motor was started, and has been looked at a few times since."""
        requests = self.requests()
        starts = [index for index, request in enumerate(requests) if starts_a_motor(request)]
        return starts and len(requests) > starts[0] + 6


class OtherMaster:
    """Somebody else on the line, who writes frames by hand. Opened before anybody locks the port."""

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
        request = with_checksum(struct.pack(">BBHH", unit, WRITE_SINGLE, register, value))
        self.send(request)
        answer = b""
        while len(answer) < len(request):
            if not self._selector.select(support.DEADLINE):
                raise AssertionError(f"unit {unit} does not answer: {answer.hex(' ')}")
            answer += os.read(self._line, 256)
        if answer != request:
            raise AssertionError(f"not the echo of {request.hex(' ')}: {answer.hex(' ')}")


def starts_a_motor(request):
    return any(write.register == COMMAND and write.value & START_BITS for write in writes_of(request))


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
            if len(frame) > 3 and with_checksum(frame[:-2]) == frame:
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
        "exception": lambda answer: with_checksum(bytes([answer[0], answer[1] | 0x80, 0x04])),
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
            self.assertIn("85h", finished.stderr)
            self.assertEqual(finished.records()[-1]["result"], "alarm", finished)
            self.assertIn("alarm", [event["kind"] for event in finished.records("event")])
            self.assert_stopped(bus, finished)

    def test_a_signal_while_the_watchdog_is_set(self):
        """The motor was not started yet; the driver would stop with an alarm when nobody asks any more."""
        for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(number), Bus() as bus:
                with support.Running(*arguments_of_start(bus.url, "--watchdog", "1s", "--json")) as started:
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
                self.assertIn("has no reader", finished.stderr)
                self.assert_stopped(bus, finished)

    def test_the_driver_is_left_as_it_was_found(self):
        names = ("operation.2.speed", "operation.2.deceleration-time", "communication.timeout")
        with Bus() as bus:
            before = self.values(bus.url, *names)
            with self.running(bus, "--watchdog", "2s", "--json") as started:
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
            finished = start(bus.url, "--for", "300ms", "--watchdog", "2s")
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
                support.wait_until(lambda: bus.has_started() and STOP in bus.commands(), "the motor is stopped")
                told = b""
                while chunk := os.read(reading, 65536):
                    told += chunk
                os.close(reading)
                finished = started.finish()
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
            self.assertIn("has no reader", finished.stderr)
            self.assert_stopped(bus, finished)

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
            self.assertIn("does not run", finished.stderr)
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
                self.assertIn("write register 125", finished.stderr)
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
                self.assertIn("THE TOOL MAY STILL RUN", finished.stderr)
                self.assertIn("stop it at the tool", finished.stderr)
                self.assertFalse(finished.records()[-1]["stop_confirmed"], finished)


def kill_with_guardian(process):
    """What is left is the driver alone, as when the computer fails."""
    for child in pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
        os.kill(int(child), signal.SIGKILL)
    process.kill()


class WatchdogTest(MotorTest):
    def test_a_program_that_is_killed(self):
        for where in PLACES:
            with self.subTest(where), Bus(where=where) as bus:
                with self.running(bus, "--watchdog", "1s", "--json") as started:
                    support.wait_until(bus.turns, "the motor turns")
                    kill_with_guardian(started.process)
                    support.wait_for_end(started.process)
                # Whoever asks feeds the watchdog, so nobody asks before it has acted.
                time.sleep(1.5)
                self.assertEqual(self.values(bus.url, "alarm.present"), {"alarm.present": LOST_LINE})
                support.wait_until(lambda: self.values(bus.url, "monitor.feedback-speed") ==
                                   {"monitor.feedback-speed": 0}, "the motor stands still", 3)
                self.assertEqual(bus.commands(), [FORWARD])
                self.assert_stands_still(bus.url)
                # What the driver was found with is unknown to whoever comes next: it says so itself.
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
                self.assertEqual(run("set", bus.url, "communication.timeout=5000").status, 0)
                allowed = ["--for", "300ms"] if number is None else []
                with self.running(bus, "--watchdog", "1s", "--json", *allowed) as started:
                    if number is not None:
                        started.send_signal(number)
                    finished = started.finish()
                self.assertEqual(finished.status, status, finished)
                self.assertEqual(bus.written(TIMEOUT), [5000, 1000, 5000], finished)
                self.assertEqual(self.values(bus.url, "communication.timeout")["communication.timeout"], 5000)
                self.assert_stopped(bus, finished)


class StopTest(MotorTest):
    """Motors that somebody else has started, and that nobody guards."""

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

    def test_everybody(self):
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
