"""A serial line: the real binary and a bus of units on a pseudo terminal that is as strict about silence
as a motor driver."""

import contextlib
import os
import pathlib
import re
import select
import signal
import struct
import threading
import time
import unittest

import frames
import support

PROGRAMS = pathlib.Path(os.environ.get("SPINDLE_PEER_PROGRAMS", support.ROOT / "build/dev/tests"))
BANK = PROGRAMS / "spindle_peer_serial_bank"
MIX = PROGRAMS / "spindle_peer_serial_mix"
DRIVE = pathlib.Path(__file__).resolve().parent / "drive.yaml"

BITS = 11  # start, eight data, parity, stop


class Bus(support.ServedLine):
    """Units on a pseudo terminal (or a port), with a log of all that went over the line. They want silence
    before a frame only where the test is about that: a bus that the machine keeps from listening hears none
    where there was enough."""

    def __init__(self, *options, where="--pty", silence=False):
        super().__init__(lambda path, log: [
            BANK, *(["--pty", path] if where == "--pty" else [where]), "--log", log,
            *([] if silence else ["--no-gap"]), *options])

    def heard(self):
        """Once it has ended: (nanoseconds, '>' or '<', bytes) in order."""
        found = re.findall(r"^(\d+) ([<>]) (.*)$", self.told(), re.MULTILINE)
        heard = [(int(at), way, bytes.fromhex(text)) for at, way, text in found]
        return [(at, way, frame) for at, way, data in heard
                for frame in (frames.rtu_requests(data) if way == ">" else [data])]

    def is_open_in(self, pid):
        line = os.path.realpath(self.path)
        with contextlib.suppress(OSError):  # files are opened and closed meanwhile
            return any(os.readlink(entry) == line for entry in pathlib.Path(f"/proc/{pid}/fd").iterdir())
        return False

    def bad_frames(self):
        return int(re.search(r"^bad (\d+)$", self.told(), re.MULTILINE)[1])


def mean_of_quickest(times):
    """Of the tenth that took the least. A busy machine lets either side sleep most of the times, and makes none
    shorter; a client that waits for too long does so in each of them."""
    quickest = sorted(times)[:max(1, len(times) // 10)]
    return sum(quickest) / len(quickest)


def run(*arguments):
    return support.run(*arguments, "--profile", str(DRIVE), "--json")


class SlowUnit(support.SerialEnd):
    """A unit that is late at first: it says what it owes when it is asked again, and is deaf while it speaks,
    as on a line of two wires. Its registers hold their numbers."""

    def __init__(self):
        super().__init__()
        self._owed = []
        self._owes = True

    def answers_late(self):
        self._owes = False

    def _serve(self):
        request = b""
        while not self._ended:
            request += self._arrived(self._line)
            if len(request) < 8:
                continue
            frame, request = request[:8], b""
            if self._owes:
                self._owed = [frame]
                continue
            for owed in self._owed:
                os.write(self._line, self._answer(owed))
                time.sleep(0.05)
            os.write(self._line, self._answer(frame))
            if self._owed and select.select([self._line], [], [], 0)[0]:
                os.read(self._line, 256)
            self._owed = []

    @staticmethod
    def _answer(frame):
        if frame[1] == 8:
            return frame
        first, count = struct.unpack_from(">HH", frame, 2)
        values = struct.pack(f">{count}H", *range(first, first + count))
        return frames.with_checksum(bytes([frame[0], frame[1], 2 * count]) + values)


class DialogueTest(unittest.TestCase):
    def test_values_on_a_terminal_and_behind_a_device_server(self):
        for where in ("--pty", "--port"):
            with self.subTest(where), Bus("--units", 2, where=where) as bus:
                for unit in (1, 2):
                    url = f"{bus.url}?unit={unit}"
                    written = run("set", url, f"operation.3.speed={unit}00")
                    self.assertEqual(written.status, 0, written)
                for unit in (1, 2):
                    finished = run("get", f"{bus.url}?unit={unit}", "operation.3.speed", "@holding:7")
                    self.assertEqual(finished.status, 0, finished)
                    self.assertEqual([r["value"] for r in finished.records("value")], [unit * 100, 7])

    def test_scan_finds_who_is_there_in_time(self):
        def scan():
            with Bus("--units", 1) as bus:
                finished = run("scan", bus.url, "--timeout", "250ms")
                bus.finish()
                loopbacks = [(at, data[0]) for at, way, data in bus.heard() if way == ">" and data[1] == 8]
                return finished, bus.bad_frames(), loopbacks

        finished, bad_frames, loopbacks = support.first_good(scan, lambda scanned: scanned[0].status == 0)
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual(bad_frames, 0, finished)
        self.assertEqual([(r["unit"], r["answered"]) for r in finished.records("unit")], [(1, "data")])
        summary = finished.records("summary")[0]
        self.assertEqual((summary["asked"], summary["found"]), (31, 1))
        self.assertEqual([unit for _, unit in loopbacks], list(range(1, 32)))
        # As in GapTest: what the machine does besides makes no step shorter.
        request = 8 * BITS / 9600
        steps = [(after - before) / 1e9 for (before, _), (after, _) in zip(loopbacks, loopbacks[1:])]
        self.assertLessEqual(mean_of_quickest(steps), request + 0.0055 + 0.250 + 0.003)

    def test_scan_that_finds_nobody(self):
        with Bus() as bus:
            finished = run("scan", bus.url, "--units", "5-7", "--timeout", "20ms")
            self.assertEqual(finished.status, 1, finished)
            self.assertEqual(finished.records("summary")[0]["found"], 0)

    def test_another_rate_is_no_answer_and_a_rate_without_name_an_error(self):
        with Bus("--baud", 9600) as bus:
            wrong = run("get", f"{bus.url}?unit=1&baud=19200", "@holding:7", "--timeout", "100ms", "--retries", "0")
            self.assertEqual(wrong.status, 5, wrong)
            nameless = run("get", f"{bus.url}?unit=1&baud=14400", "@holding:7")
            self.assertEqual(nameless.status, 4, nameless)
            self.assertIn("14400 baud", nameless.said)
            right = run("get", f"{bus.url}?unit=1", "@holding:7")
            self.assertEqual(right.status, 0, right)

    def test_a_late_answer_is_never_the_next_value(self):
        with Bus("--fault", "late=300ms@every:3") as bus:
            for start in range(20, 32):
                names = [f"@holding:{start + 40 * step}" for step in range(4)]
                finished = run("get", f"{bus.url}?unit=1", *names, "--timeout", "200ms", "--retries", "2")
                for record in finished.records("value"):
                    self.assertEqual(record["value"], record["register"], finished)

    def test_the_late_answer_to_a_program_that_ended_is_never_a_value(self):
        for profile in (["--profile", str(DRIVE)], []):
            with self.subTest(profile), SlowUnit() as unit:
                # Its answer may come for twice as long as it was waited for: long enough for the others to start.
                gave_up = support.run("get", unit.url, "@holding:7", *profile, "--timeout", "5s", "--retries", "0",
                                      "--json")
                self.assertEqual(gave_up.status, 5, gave_up)
                unit.answers_late()
                for _ in range(3):
                    finished = support.run("get", unit.url, "@holding:24", "@holding:64", *profile, "--timeout", "400ms",
                                           "--json")
                    for record in finished.records("value"):
                        self.assertEqual(record["value"], record["register"], finished)
                self.assertEqual(finished.status, 0, finished)

    def test_trouble_on_the_line_never_gives_a_wrong_value(self):
        for fault in ("noise@every:2", "bad-crc@every:2", "foreign", "half@every:2", "split=3", "echo", "repeated",
                      "garbage@every:2", "wrong-unit@every:2", "wrong-length@every:2", "lost@every:2"):
            with self.subTest(fault), Bus("--baud", 115200, "--gap", 3500, "--fault", fault) as bus:
                url = f"{bus.url}?unit=1&baud=115200"
                finished = run("get", url, "@holding:7", "@holding:99", "--timeout", "100ms", "--retries", "3")
                for record in finished.records("value"):
                    self.assertEqual(record["value"], record["register"], finished)
                self.assertIn(finished.status, (0, 5, 7), finished)
                if "@" not in fault:
                    self.assertEqual(finished.status, 0, finished)
                if finished.status:
                    self.assertEqual(len(finished.records("error")), 1, finished)


class PortTest(unittest.TestCase):
    def test_a_port_in_use_by_a_watch_is_asked_through_it(self):
        with Bus() as bus:
            holder = support.Running("watch", f"{bus.url}?unit=1", "@holding:7", "--profile", str(DRIVE), "--json")
            with holder:
                support.wait_until(lambda: holder.line(), "the first record of watch")
                second = run("ping", f"{bus.url}?unit=1", "-c", "1")
                self.assertEqual(second.status, 0, second)
                holder.process.send_signal(signal.SIGINT)
                self.assertEqual(support.wait_for_end(holder.process), 130)
            free = run("ping", f"{bus.url}?unit=1", "-c", "1")
            self.assertEqual(free.status, 0, free)

    def test_a_port_in_use_by_what_cannot_be_asked_names_its_holder(self):
        with Bus("--fault", "lost") as bus:
            arguments = ("get", f"{bus.url}?unit=1", "@holding:7", "--profile", str(DRIVE), "--timeout", "20s")
            with support.Running(*arguments) as holder:
                support.wait_until(lambda: bus.is_open_in(holder.pid), "the port is open")
                second = run("ping", f"{bus.url}?unit=1", "-c", "1")
                self.assertEqual(second.status, 4, second)
                self.assertRegex(second.said, rf"in use by spindle \(process {holder.pid}\)")
                holder.process.send_signal(signal.SIGINT)
                self.assertEqual(support.wait_for_end(holder.process), 130)

    def test_an_adapter_that_is_pulled_out(self):
        with Bus("--fault", "close@2") as bus:
            finished = run("ping", f"{bus.url}?unit=1&echo=false", "-c", "5", "--interval", "10ms")
            self.assertEqual(finished.status, 9, finished)
            self.assertIn("the serial port is gone", finished.said)
            again = run("ping", f"{bus.url}?unit=1", "-c", "1")
            self.assertEqual(again.status, 4, again)
            self.assertIn("there is no", again.said)

    def test_an_adapter_that_vanishes_while_an_answer_is_waited_for(self):
        with Bus("--fault", "lost") as bus:
            arguments = ("get", f"{bus.url}?unit=1", "@holding:7", "--profile", str(DRIVE), "--json", "--timeout", "10s")
            with support.Running(*arguments) as waiting:
                support.wait_until(lambda: bus.is_open_in(waiting.pid), "the port is open")
                time.sleep(0.3)
                bus.kill()
                finished = waiting.finish()
            self.assertEqual(finished.status, 5, finished)
            self.assertIn("the serial port is gone", finished.said)
            self.assertLess(finished.paced, support.SOON)

    def test_ctrl_c_ends_a_wait_at_once(self):
        with Bus("--fault", "lost") as bus:
            with support.Running("get", f"{bus.url}?unit=1", "@holding:7", "--profile", str(DRIVE), "--timeout",
                                 "20s") as waiting:
                support.wait_until(lambda: bus.is_open_in(waiting.pid), "the port is open")
                time.sleep(0.3)
                began = support.paced()
                waiting.process.send_signal(signal.SIGINT)
                self.assertEqual(support.wait_for_end(waiting.process), 130)
                self.assertLess(support.paced() - began, support.SOON)

    def test_a_killed_client_leaves_a_line_that_the_next_can_open(self):
        with Bus() as bus:
            for _ in range(3):
                with support.Running("watch", f"{bus.url}?unit=1", "@holding:7", "--profile", str(DRIVE),
                                     "--json") as killed:
                    support.wait_until(lambda: killed.line(), "the first record of watch")
                    killed.process.kill()
                    support.wait_for_end(killed.process)
                finished = run("get", f"{bus.url}?unit=1", "@holding:7")
                self.assertEqual(finished.status, 0, finished)

    def test_units_of_one_line_take_turns(self):
        with Bus("--units", 3) as bus:
            tools = bus.path.parent / "tools.yaml"
            names = "".join(f'  d{unit}: {{url: "{bus.url}?unit={unit}", profile: {DRIVE}}}\n' for unit in (1, 2, 3))
            tools.write_text(f"tools:\n{names}groups:\n  all: [d1, d2, d3]\n", encoding="ascii")
            finished = support.run("identify", "@all", "--tools", str(tools), "--json")
            self.assertNotIn("in use", finished.said)
            asked = {record["target"] for record in finished.records() if "target" in record}
            self.assertEqual(asked, {"d1", "d2", "d3"}, finished)
            bus.finish()
            self.assertEqual(bus.bad_frames(), 0)

    def watch(self, bus, units, *arguments):
        """A watch of several units in a process of its own."""
        urls = [f"{bus.url}{'&' if '?' in bus.url else '?'}unit={unit}" for unit in units]
        return support.Running("watch", *urls, "@holding:2", *arguments, "--profile", str(DRIVE), "--json")

    def test_units_of_one_line_are_watched_together(self):
        for where in ("--pty", "--port"):
            with self.subTest(where), Bus("--units", 3, where=where) as bus:
                with self.watch(bus, (1, 2, 3), "--all", "--interval", "50ms", "--count", 30) as watching:
                    watched = watching.finish()
                self.assertEqual(watched.status, 0, watched)
                self.assertEqual({link["state"] for link in watched.records("link")}, {"connected"}, watched)
                told = [record["target"][-1] for record in watched.records("sample")]
                self.assertEqual(len(told), 30)
                for unit in "123":
                    self.assertGreaterEqual(told.count(unit), 5, watched)
                bus.finish()
                self.assertEqual(bus.bad_frames(), 0)

    def test_a_unit_that_is_not_there_keeps_nobody_from_the_others(self):
        with Bus("--units", 1) as bus:
            with self.watch(bus, (1, 9), "--all", "--timeout", "400ms", "--duration", "6s") as watching:
                watched = watching.finish()
            self.assertEqual(watched.status, 9, watched)  # the other one was never reached
            self.assertEqual({record["target"][-1] for record in watched.records("sample")}, {"1"}, watched)
            self.assertGreaterEqual(len(watched.records("sample")), 3, watched)
            links = {(link["target"][-1], link["state"]) for link in watched.records("link")}
            self.assertLessEqual({("1", "connected"), ("9", "connecting")}, links, watched)
            self.assertNotIn(("9", "connected"), links, watched)

    def test_a_line_that_is_gone_is_gone_for_all_its_units(self):
        with Bus("--units", 2) as bus:
            with self.watch(bus, (1, 2), "--no-reconnect") as watching:
                for _ in range(2):
                    self.assertIn('"connected"', watching.line())
                bus.kill()
                watched = watching.finish()
            self.assertEqual(watched.status, 5, watched)
            lost = [link["target"][-1] for link in watched.records("link") if link["state"] == "lost"]
            self.assertEqual(sorted(lost), ["1", "2"], watched)

    def test_ctrl_c_ends_all_units_of_a_line(self):
        with Bus("--units", 2, "--fault", "lost") as bus:
            with self.watch(bus, (1, 2), "--timeout", "20s") as watching:
                support.wait_until(lambda: bus.is_open_in(watching.pid), "the port is open")
                watching.send_signal(signal.SIGINT)
                watched = watching.finish()
            self.assertEqual(watched.status, 130, watched)
            self.assertEqual(watched.records()[-1]["type"], "summary", watched)
            self.assertLess(watched.paced, support.SOON, watched)


class GapTest(unittest.TestCase):
    """A thousand requests of every kind, judged by the log of a server that is deaf to short gaps."""

    COUNT = 1000

    def judge(self, baud, gap):
        def mix():
            with Bus("--baud", baud, "--gap", round(gap * 1e6), "--delay", 1000, silence=True) as bus:
                mixed = support.completed(
                    [str(MIX), str(bus.path), str(baud), str(round(gap * 1e6)), str(self.COUNT)],
                    deadline=10 * support.DEADLINE, capture_output=True, text=True)
                bus.finish()
                return mixed.stdout.strip(), bus.bad_frames(), bus.heard()

        # A client that keeps no silence fails each time; a bus that cannot listen in time now and then.
        all_answered = f"{self.COUNT} answered"
        said, bad_frames, heard = support.first_good(mix, lambda mixed: mixed[0] == all_answered and mixed[1] == 0)
        self.assertEqual(said, all_answered, f"{baud} baud")
        self.assertEqual(bad_frames, 0)
        self.assertEqual(sum(way == ">" for _, way, _ in heard), self.COUNT)
        gaps = [(at - before) / 1e9 for (before, _, _), (at, way, _) in zip(heard, heard[1:]) if way == ">"]
        self.assertGreaterEqual(min(gaps), gap, f"{baud} baud")
        self.assertLessEqual(mean_of_quickest(gaps), gap + 0.001, f"{baud} baud")

    def test_at_both_rates(self):
        failures = []

        def judge(*line):
            try:
                self.judge(*line)
            except Exception as failure:  # told by the thread that waits
                failures.append(failure)

        lines = [threading.Thread(target=judge, args=line) for line in ((9600, 0.0055), (115200, 0.0035))]
        for line in lines:
            line.start()
        for line in lines:
            line.join()
        if failures:
            raise failures[0]


if __name__ == "__main__":
    unittest.main()
