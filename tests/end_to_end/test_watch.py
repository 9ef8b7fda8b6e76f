"""watch against tools that push, repeat, stumble, vanish and come back: nothing lost in silence,
nothing twice, nothing invented, and the tool left disarmed.

With SPINDLE_LONG=1 the long runs of the same kind: 10,000 events at 200 per second, and 30 seconds
of keep-alives.
"""

import contextlib
import itertools
import math
import os
import pty
import signal
import struct
import threading
import time
import unittest

import support
from event_server import ARM_REGISTER, NUMBERS, Chance, EventServer
from hostile_server import EVENT_FIRST, frame

LONG = os.environ.get("SPINDLE_LONG") == "1"
EVENTS, RATE = (10000, 200) if LONG else (2000, 1000)
SECONDS = 30 if LONG else 8
PROFILE = ("--profile", "doga-bm")
JSON = (*PROFILE, "--json")
KEEP_ALIVE, ARM_EXPIRES = 1.0, 10.0
NOT_DELAYED = 1.0  # seconds until an event is told, at least of every other one on a busy machine
QUICK = 0.75  # seconds that an end may take, farewell included; the quickest of several on a busy machine


class Watching(support.Running):
    """A watch whose records are read as they come, so that it never waits for its reader."""

    def __init__(self, *arguments):
        super().__init__("watch", *arguments)
        self.arrivals = []  # (time, record)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self._reader.join(support.DEADLINE)
        super().__exit__()

    def _read(self):
        for line in self.process.stdout:
            self.arrivals.append((time.monotonic(), support.parse_json(line)))

    def records(self, kind=None):
        return [record for _, record in list(self.arrivals) if kind in (None, record["type"])]

    def links(self):
        return [record["state"] for record in self.records("link")]

    def numbers(self):
        return [record["number"] for record in self.records("event")]

    def end(self, number=signal.SIGTERM):
        """Sends the signal; returns status, paced seconds and what was said on stderr."""
        began = support.paced()
        if number is not None:
            self.process.send_signal(number)
        status = support.wait_for_end(self.process)
        seconds = support.paced() - began
        self._reader.join(support.DEADLINE)
        return status, seconds, self.process.stderr.read().decode()


def unaccounted(records, first, last):
    """Goes through events and gaps in order; what is wrong with them, or nothing."""
    expected, missed = first, 0
    for record in records:
        if record["type"] == "gap":
            if missed or not record["missed"]:
                return f"a gap behind a gap, or an empty one, before {expected}: {record}"
            missed = record["missed"]
        elif record["type"] == "event":
            if record["number"] != (expected + missed) % NUMBERS:
                return f"{record['number']} where {expected} + {missed} missed was to come"
            expected, missed = (record["number"] + 1) % NUMBERS, 0
    if missed or expected != (last + 1) % NUMBERS:
        return f"ended before {expected}, {missed} missed, and not behind {last}"
    return ""


class CompletenessTest(unittest.TestCase):
    def test_every_event_once_and_in_order(self):
        chance = Chance(seed=3, split=0.5, glue=0.4, repeat=0.05, late_repeat=0.03)
        # The counter goes over its end on the way.
        with EventServer(chance, first=NUMBERS - EVENTS // 2) as server:
            first = server.number + 1
            with Watching(server.url, *JSON, "--count", EVENTS) as watching:
                support.wait_until(lambda: server.armed, "the watch arms the output")
                server.run(EVENTS, RATE)
                status, _, stderr = watching.end(None)
            self.assertEqual((status, stderr), (0, ""))
            expected = [(first + offset) % NUMBERS for offset in range(EVENTS)]
            self.assertEqual(watching.numbers(), expected)
            gaps = watching.records("gap")
            self.assertEqual([gap["missed"] for gap in gaps], [0])  # the end of the counter
            summary = watching.records()[-1]
            facts = {key: summary[key] for key in ("type", "events", "ok", "ng", "reconnects")}
            ng = EVENTS // 10
            self.assertEqual(
                facts,
                {"type": "summary", "events": EVENTS, "ok": EVENTS - ng, "ng": ng, "reconnects": 0},
            )
            self.assertEqual(server.full_block_reads(), [])

    def test_connections_cut_at_random(self):
        for seed in (5, 6) if not LONG else range(5, 9):
            chance = Chance(seed, split=0.5, glue=0.4, repeat=0.05, late_repeat=0.03, cut=0.004)
            with self.subTest(seed), EventServer(chance) as server:
                first = server.number + 1
                with Watching(server.url, *JSON) as watching:
                    support.wait_until(lambda: server.armed, "the watch arms the output")
                    server.run(EVENTS, RATE)
                    support.wait_until(
                        lambda: watching.numbers()[-1:] == [server.number],
                        "the last event is told, though its frame may have been cut off",
                    )
                    status, _, _ = watching.end()
                self.assertEqual(status, 143)
                self.assertGreater(server.cuts, 2)
                self.assertEqual(unaccounted(watching.records(), first, server.number), "")
                lost = watching.links().count("lost")
                self.assertEqual(watching.links().count("connected"), lost + 1)
                self.assertEqual(watching.records()[-1]["reconnects"], lost)
                print(f"seed {seed}: {lost} cuts, {len(watching.numbers())} of {EVENTS} told")

    def test_old_event_is_no_result_and_a_missed_one_is_caught_up(self):
        with EventServer() as server, Watching(server.url, *JSON) as watching:
            support.wait_until(lambda: server.armed, "the watch arms the output")
            server.miss()
            support.wait_until(lambda: watching.numbers(), "the missed event is caught up")
            server.event()
            support.wait_until(lambda: len(watching.numbers()) == 2, "the next one is pushed")
            server.miss(3)
            support.wait_until(lambda: len(watching.numbers()) == 3, "the last one is caught up")
            watching.end()
            events = watching.records("event")
            self.assertEqual(
                [(event["number"], event["source"]) for event in events],
                [(1962, "catch-up"), (1963, "push"), (1966, "catch-up")],
            )
            # Where the machine keeps the watch from its keep-alive, that is told without a number.
            counted = [gap["missed"] for gap in watching.records("gap") if gap["missed"] is not None]
            self.assertEqual(counted, [2])

    def test_counter_that_comes_to_the_last_number_again(self):
        """Twenty events happen behind a restart; the number that is found hides them."""
        for since, kind in ((20, 2), (21, 1), (30, 1)):
            with self.subTest(since), EventServer(first=20) as server:
                with Watching(server.url, *JSON) as watching:
                    support.wait_until(lambda: server.caught_up, "it is watched")
                    with server._lock:
                        server.cut()
                        server.number = 0
                        for _ in range(since - 1):
                            server.event()
                        server.event(kind)
                    support.wait_until(lambda: watching.numbers(), "the last event is told")
                    watching.end()
                self.assertEqual([gap["missed"] for gap in watching.records("gap")], [None])
                self.assertEqual([event["source"] for event in watching.records("event")], ["catch-up"])

    def test_what_a_restarted_tool_remembers_is_no_result(self):
        for also in ((), ("--output", "csv"), ("--output", "table")):
            with self.subTest(also), EventServer() as server:
                arguments = ("watch", server.url, *JSON, *also, "--count", 1)
                with support.Running(*arguments) as running:
                    support.wait_until(lambda: server.caught_up, "it is watched")
                    with server._lock:
                        server.cut()
                        server.number = 1900
                        server._store(1)
                    support.wait_until(lambda: server.cuts and server.caught_up, "it is watched again")
                    server.event()  # the only one that counts
                    finished = running.finish()
                self.assertEqual(finished.status, 0, finished)
                if not also:
                    old, new = finished.records("event")
                    self.assertEqual((old["source"], old.get("remembered")), ("catch-up", True))
                    self.assertEqual((new["source"], new.get("remembered")), ("push", None))
                    summary = finished.records()[-1]
                    counts = [summary[key] for key in ("events", "ok", "caught_up", "remembered")]
                    self.assertEqual(counts, [1, 1, 0, 1])
                else:
                    old, new = [line for line in finished.stdout.splitlines() if "fastening-ok" in line]
                    self.assertIn("catch-up", old)
                    self.assertNotRegex(old, r"\bOK\b")
                    self.assertIn("push", new)
                    self.assertRegex(new, r"\bOK\b")
                    self.assertIn("1 event, 1 OK", finished.said)

    def test_polling_without_arming(self):
        with EventServer() as server:
            arguments = (server.url, *JSON, "--no-push", "--interval", "20ms", "--count", 3)
            with Watching(*arguments) as watching:
                # The counter, the last event and the counter behind it, and then the first poll.
                support.wait_until(
                    lambda: len(server.asked(support.READ_INPUT, EVENT_FIRST)) > 3, "what was there is read"
                )
                for count in range(1, 4):
                    server.event()
                    support.wait_until(lambda: len(watching.numbers()) == count, "it is polled")
                self.assertEqual(watching.end(None)[0], 0)
            self.assertEqual([event["source"] for event in watching.records("event")], ["poll"] * 3)
            self.assertEqual(server.asked(support.WRITE_SINGLE), [])
            self.assertEqual(server.full_block_reads(), [])


def assert_disarmed(server):
    """The last that was asked; the tool may come to it when the program has ended."""
    support.wait_until(
        lambda: server.requests and server.requests[-1][1].words == (ARM_REGISTER, 0), "the output is off"
    )


class WireTest(unittest.TestCase):
    def watch_wire(self):
        """Watches for a while, and returns the pauses between keep-alives."""
        with EventServer(expires=ARM_EXPIRES) as server:
            # All of both blocks is polled too: fourteen registers each.
            names = ("event.*", "status.*", "preset.1.*")
            with Watching(server.url, *names, *JSON, "--duration", f"{SECONDS}s") as watching:
                server.run(SECONDS * 20, 20)
                status, _, _ = watching.end(None)
            self.assertEqual(status, 0)
            alive = server.asked(support.REPORT_SERVER_ID)
            self.assertGreaterEqual(len(alive), SECONDS - 1)
            armed = server.asked(support.WRITE_SINGLE, ARM_REGISTER, 1)
            between = [later - earlier for earlier, later in zip(armed, armed[1:])]
            self.assertGreaterEqual(len(armed), 1 + SECONDS // 5)
            self.assertLess(max(between, default=0), ARM_EXPIRES)
            self.assertEqual(server.full_block_reads(), [])
            assert_disarmed(server)
        return [later - earlier for earlier, later in zip(alive, alive[1:])]

    def test_keep_alive_and_arming(self):
        pauses = sorted(self.watch_wire())
        print(f"pauses between keep-alives: {pauses[0]:.3f} to {pauses[-1]:.3f} s")
        # A machine with more to do makes some of them longer; a program that is too late is so in all of them.
        quicker = pauses[:len(pauses) // 2]
        self.assertLessEqual(sum(quicker) / len(quicker), KEEP_ALIVE)

    def test_arming_goes_on_while_events_flood(self):
        with EventServer(expires=6.0) as server:
            with Watching(server.url, *JSON) as watching:
                support.wait_until(lambda: server.armed, "the watch arms the output")
                server.run(5500, 1000)
                self.assertTrue(server.armed)
                support.wait_until(lambda: len(watching.numbers()) == 5500, "all are told")
                watching.end()
            self.assertEqual(watching.records("gap"), [])


class EndingTest(unittest.TestCase):
    def test_signals(self):
        ends = []
        for number, expected in ((signal.SIGTERM, 143), (signal.SIGINT, 130)) * 2:
            with self.subTest(number), EventServer() as server:
                with Watching(server.url, *JSON) as watching:
                    support.wait_until(lambda: server.armed, "the watch arms the output")
                    server.event()
                    support.wait_until(watching.numbers, "an event is told")
                    status, seconds, stderr = watching.end(number)
                self.assertEqual((status, stderr), (expected, ""))
                self.assertLess(seconds, support.SOON)
                ends.append(seconds)
                summary = watching.records()[-1]
                self.assertEqual(
                    (summary["type"], summary["events"], summary["exit_status"]),
                    ("summary", 1, expected),
                )
                assert_disarmed(server)
        self.assertLess(min(ends), QUICK, ends)

    def test_signal_while_reconnecting(self):
        with support.refusing_port() as url, Watching(url, *JSON) as watching:
            support.wait_until(lambda: len(watching.links()) > 2, "it tries again and again")
            status, seconds, _ = watching.end()
            self.assertEqual(status, 143)
            self.assertLess(seconds, support.SOON)
            self.assertEqual(watching.records()[-1]["type"], "summary")

    def test_table_summary_is_on_stderr(self):
        with EventServer() as server, support.Running("watch", server.url, *PROFILE) as running:
            support.wait_until(lambda: server.armed, "the watch arms the output")
            server.event(2, 335)
            self.assertTrue(running.line().startswith("TIME"))
            self.assertIn("connected", running.line())
            self.assertRegex(running.line(), r"fastening-ng +1962 .* NG +push +E335 \w+")
            running.send_signal(signal.SIGINT)
            finished = running.finish()
            self.assertEqual(finished.status, 130, finished)
            self.assertIn("1 event, 0 OK, 1 NG", finished.said)
            self.assertNotIn("\x1b", finished.stdout)

    def test_second_signal_ends_at_once(self):
        def end():
            with EventServer() as server, Watching(server.url, *JSON) as watching:
                support.wait_until(lambda: server.armed, "the watch arms the output")
                with server._lock:  # the farewell gets no answer
                    watching.process.send_signal(signal.SIGINT)
                    threading.Event().wait(0.1)
                    too_late = watching.process.poll() is not None
                    status, seconds, stderr = watching.end(None if too_late else signal.SIGINT)
            if too_late:
                seconds = math.inf
            return support.Finished(watching.arguments, status, "", stderr, math.nan, seconds)

        self.assertEqual(support.quickest(end, 0.3, attempts=10).status, 130)

    def test_closed_pipe(self):
        for also in ((), ("--output", "csv"), ("--output", "table")):
            with self.subTest(also), EventServer() as server:
                reading, writing = os.pipe()
                arguments = ("watch", server.url, *JSON, *also)
                with support.Running(*arguments, stdout=writing) as running:
                    os.close(writing)
                    with os.fdopen(reading, "rb") as pipe:
                        self.assertTrue(pipe.readline())
                        support.wait_until(lambda: server.armed, "the watch arms the output")
                    # No event comes: the end of the reader is noticed all the same.
                    finished = running.finish()
                self.assertEqual((finished.status, finished.stderr), (0, ""), finished)
                assert_disarmed(server)

    def test_count_and_duration(self):
        with EventServer() as server:
            with Watching(server.url, *JSON, "--count", 2) as watching:
                support.wait_until(lambda: server.armed, "the watch arms the output")
                for _ in range(5):
                    server.event()
                self.assertEqual(watching.end(None)[0], 0)
                self.assertEqual(len(watching.numbers()), 2)
            assert_disarmed(server)
        with EventServer() as server:
            finished = support.run("watch", server.url, *JSON, "--duration", "1s")
            self.assertEqual(finished.status, 0, finished)
            self.assertLess(finished.paced, 1 + support.SOON)
            assert_disarmed(server)

    def test_idle_timeout(self):
        with EventServer() as server:
            finished = support.run("watch", server.url, *JSON, "--idle-timeout", "300ms")
            self.assertEqual(finished.status, 1, finished)
            self.assertEqual(finished.records()[-1]["exit_status"], 1)
            with Watching(server.url, *JSON, "--idle-timeout", "1500ms") as watching:
                support.wait_until(lambda: server.armed, "the watch arms the output")
                server.event()
                self.assertEqual(watching.end(None)[0], 0)

    def test_no_reconnect(self):
        with EventServer() as server, Watching(server.url, *JSON, "--no-reconnect") as watching:
            support.wait_until(lambda: server.caught_up, "nothing is asked")
            server.event()
            server.cut()
            status, _, stderr = watching.end(None)
            self.assertEqual(status, 5)
            self.assertIn("spindle: ", stderr)
            self.assertEqual(watching.numbers(), [1962])
            kinds = [record["type"] for record in watching.records()]
            self.assertEqual(kinds, ["link", "event", "link", "error", "summary"])
        with support.refusing_port() as url:
            finished = support.run("watch", url, *JSON, "--no-reconnect")
            self.assertEqual(finished.status, 4, finished)
            self.assertEqual(finished.records("link"), [])


class Unread(Watching):
    """A watch whose output is not read for a while."""

    def __init__(self, *arguments):
        self.reading = threading.Event()
        super().__init__(*arguments)

    def __exit__(self, *_):
        self.reading.set()
        super().__exit__()

    def _read(self):
        self.reading.wait()
        super()._read()


class UnreadOutputTest(unittest.TestCase):
    def test_tool_is_kept_alive_and_what_was_not_told_is_a_gap(self):
        with EventServer(expires=ARM_EXPIRES) as server:
            first = server.number + 1
            with Unread(server.url, *JSON) as watching:
                support.wait_until(lambda: server.caught_up, "it is watched")
                server.run(6000, 1000)
                self.assertTrue(server.armed)
                self.assertEqual(server.cuts, 0)
                self.assertGreaterEqual(len(server.asked(support.REPORT_SERVER_ID)), 5)
                self.assertGreaterEqual(len(server.asked(support.WRITE_SINGLE, ARM_REGISTER, 1)), 2)
                watching.reading.set()
                support.wait_until(lambda: len(watching.numbers()) > 1000, "what waited is told")
                support.wait_until(
                    lambda: server.event() or watching.numbers()[-1:] == [server.number],
                    "events are told again",
                )
                last = server.number
                status, _, _ = watching.end()
            self.assertEqual(status, 143)
            gaps = watching.records("gap")
            self.assertEqual(len(gaps), 1, gaps)
            self.assertEqual(gaps[0]["missed"], gaps[0]["dropped"])
            self.assertEqual(unaccounted(watching.records(), first, last), "")
            assert_disarmed(server)

    def test_first_signal_ends_it_with_the_tool_disarmed(self):
        for number, expected in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(number), EventServer() as server:
                with support.Running("watch", server.url, *JSON) as running:
                    support.wait_until(lambda: server.caught_up, "it is watched")
                    server.run(400, 1000)  # more than a pipe holds
                    running.send_signal(number)
                    status = support.wait_for_end(running.process)
                    text = running.process.stdout.read().decode()
                    stderr = running.process.stderr.read().decode()
                self.assertEqual(status, expected)
                self.assertIn("could not be written", stderr)
                told = text.split("\n")[:-1]  # the last line may be cut off: its end was not taken
                self.assertGreater(len([support.parse_json(line) for line in told]), 50)
                assert_disarmed(server)


class TerminalTest(unittest.TestCase):
    def test_status_line_under_the_stream(self):
        with EventServer() as server:
            pid, terminal = pty.fork()
            if pid == 0:
                program = support.binary()
                arguments = [program, "watch", server.url, *PROFILE, "--count", "2", "--color", "never"]
                os.execve(program, arguments, support.home().environment())
            shown = b""
            support.wait_until(lambda: server.armed, "the watch arms the output")
            with contextlib.suppress(OSError):  # the end of the terminal
                for kind, counts in ((1, b"1 OK  0 NG"), (2, b"1 OK  1 NG")):
                    server.event(kind)
                    while counts not in shown:
                        self.assertTrue(support.is_readable(terminal))
                        shown += os.read(terminal, 4096)
                while support.is_readable(terminal):
                    shown += os.read(terminal, 4096)
            _, status = os.waitpid(pid, 0)
            os.close(terminal)
        text = shown.decode()
        self.assertEqual(os.waitstatus_to_exitcode(status), 0, text)
        self.assertIn("preset 1  torque 2.72  OK  1 OK  0 NG", text)
        self.assertIn("preset 2  torque 2.73  NG  1 OK  1 NG", text)
        # What stays on the screen has no line of the board: each was wiped before the next record.
        lines = [line.rsplit("\r\x1b[K", 1)[-1] for line in text.split("\r\n")]
        self.assertEqual([line for line in lines if " NG" in line and "events" not in line and "push" not in line], [])


class ReconnectingTest(unittest.TestCase):
    def test_killed_simulator(self):
        with support.Running("simulate", "doga-bm", "--rundown-every", "1500ms") as first:
            url = first.line()
            with Watching(url, *JSON) as watching:
                support.wait_until(watching.numbers, "an event is told")
                first.process.kill()
                first.process.wait()
                support.wait_until(lambda: watching.links()[-2:] == ["reconnecting"] * 2, "it tries")
                arguments = ("--listen", url, "--rundown-every", "1500ms")
                with support.Running("simulate", "doga-bm", *arguments) as second:
                    second.line()
                    told = len(watching.numbers())
                    support.wait_until(lambda: watching.links()[-1] == "connected", "it is back")
                    support.wait_until(lambda: len(watching.numbers()) > told, "events go on")
                    status, _, _ = watching.end()
                self.assertEqual(status, 143)
                self.assertEqual(watching.links()[:2], ["connected", "lost"])
                attempts = [link["attempt"] for link in watching.records("link")[2:-1]]
                self.assertEqual(attempts, list(range(1, len(attempts) + 1)))

    def test_outages(self):
        """A tool that sleeps, roams, restarts or serves another client at times, and works on."""
        for outage, states, gap in (
            ("sleep=500ms@every:2s", ["connected"], None),
            ("roam=700ms@every:2s", ["lost", "connected"], None),
            ("reboot=700ms@every:2s", ["lost", "connected"], "counts its events anew"),
            ("other-client=700ms@every:2s", ["lost", "reconnecting"], None),
        ):
            work = ("--rundown-every", "1300ms", "--burst", "3", "--outage", outage)
            with self.subTest(outage), support.Running("simulate", "doga-bm", *work) as tool:
                with Watching(tool.line(), *JSON) as watching:
                    support.wait_until(lambda: len(watching.numbers()) >= 8, "events go on")
                    status, _, stderr = watching.end()
                self.assertEqual((status, stderr), (143, ""))
                told = watching.links()
                self.assertEqual([state for state in states if state not in told], [])
                if gap:
                    self.assertIn(gap, watching.records("gap")[0]["reason"])
                else:
                    numbers = watching.numbers()
                    before_first = list(
                        itertools.takewhile(lambda record: record["type"] != "event", watching.records())
                    )
                    missed = sum(record["missed"] for record in before_first if record["type"] == "gap")
                    self.assertEqual(
                        unaccounted(watching.records(), numbers[0] - missed, numbers[-1]), ""
                    )

    def test_another_tool_is_said(self):
        with EventServer() as server:
            with Watching(server.url, *JSON) as watching:
                support.wait_until(lambda: server.armed, "the watch arms the output")
                other = EventServer(serial=1021100099, first=7)
                other._listening.close()
                with server._lock:
                    server.tool, server.number = other.tool, other.number
                    server.cut()
                support.wait_until(lambda: watching.links().count("connected") == 2, "it is back")
                support.wait_until(lambda: server.armed, "the output is armed")
                server.event()
                support.wait_until(watching.numbers, "its event is told")
                watching.end()
            message = watching.records("link")[-1]["message"]
            self.assertIn("1021100042", message)
            self.assertIn("1021100099", message)
            self.assertEqual([gap["missed"] for gap in watching.records("gap")], [None])
            self.assertEqual(watching.numbers(), [8])

    def test_connection_that_never_serves_is_not_hammered(self):
        """A server that hangs up on every client is asked ever more seldom."""
        accepted = []

        class HangingUp(support.Port):
            def _meet(self, client):
                accepted.append(time.monotonic())
                client.close()

        with HangingUp() as server:
            finished = support.run("watch", server.url, *JSON, "--duration", "2s")
        self.assertEqual(finished.status, 5, finished)
        self.assertIn(len(accepted), range(2, 6))  # at 0, 0.25, 0.75, 1.75 s and a fifth less, or later

    def test_a_dead_tool_does_not_delay_another(self):
        for known in (PROFILE, ()):
            with self.subTest(known), EventServer() as server, support.full_backlog() as (dead, _):
                with Watching(dead, server.url, *known, "--json", "--connect-timeout", "60s") as watching:
                    support.wait_until(lambda: server.armed, "the other one is watched")
                    delays = []
                    for count in range(1, 21):
                        sent = support.paced()
                        server.event()
                        support.wait_until(lambda: len(watching.numbers()) == count, "it is told")
                        delays.append(support.paced() - sent)
                        self.assertLess(delays[-1], support.SOON)
                    self.assertLess(sorted(delays)[len(delays) // 2], NOT_DELAYED, delays)
                    status, seconds, _ = watching.end()
                self.assertEqual(status, 143)
                self.assertLess(seconds, support.SOON)
                self.assertEqual({event["target"] for event in watching.records("event")}, {server.url})

    def test_one_of_two_fails(self):
        with EventServer() as server, EventServer(firmware=4001) as later:
            finished = support.run("watch", server.url, later.url, *JSON, "--duration", "2s")
            self.assertEqual(finished.status, 9, finished)
            self.assertEqual([error["target"] for error in finished.records("error")], [later.url])


FAR = """
format: 1
id: far
title: "Two registers that are far apart"
link: {framing: tcp, port: 502, unit: 1, transaction: echoed, max-read: 16, max-write: 16, pairs: any,
       answer: 2s, connect: 5s, retries: 1}
parameters:
  - {name: a, register: 5000, encoding: u16, access: rw, evidence: manual, source: x, title: A}
  - {name: b, register: 5010, encoding: u16, access: rw, evidence: manual, source: x, title: B}
"""


class HangingUpServer(support.Port):
    """Registers 5000 and 5010, and nothing else: FC 11h is refused. Hangs up behind every answer, if asked."""

    def __init__(self, hangs_up=True):
        super().__init__()
        self.holding = {5000: 273, 5010: 4}
        self.accepted, self.hangs_up = 0, hangs_up

    def _serve(self, client):
        self.accepted += 1
        buffer = bytearray()
        with contextlib.suppress(OSError), client:
            while chunk := client.recv(4096):
                buffer += chunk
                for request in support.take_requests(buffer):
                    client.sendall(frame(request.transaction, *self._answer(request), unit=request.unit))
                    if self.hangs_up:
                        return

    def _answer(self, request):
        if request.function == support.READ_HOLDING and request.words[1] == 1:
            return request.function, struct.pack(">BH", 2, self.holding[request.words[0]])
        if request.function == support.WRITE_SINGLE:
            self.holding[request.words[0]] = request.words[1]
            return request.function, request.data
        return request.function | 0x80, b"\x01"


class ToolThatHangsUpTest(unittest.TestCase):
    def setUp(self):
        self.profile = support.home().path / "far.yaml"
        self.profile.write_text(FAR)

    def test_interval_is_kept(self):
        with HangingUpServer() as server:
            finished = support.run(
                *("watch", server.url, "--profile", self.profile, "a", "--json"),
                *("--interval", "5s", "--duration", "3s"),
            )
        self.assertEqual(finished.status, 0, finished)
        self.assertIn(server.accepted, (1, 2, 3))

    def test_pauses_grow(self):
        with HangingUpServer() as server:
            finished = support.run(
                *("watch", server.url, "--profile", self.profile, "a", "--json"),
                *("--interval", "20ms", "--duration", "3s"),
            )
        self.assertEqual(finished.status, 0, finished)
        self.assertIn(server.accepted, range(3, 8))  # at 0, 0, 0.25, 0.75, 1.75 s, or a fifth sooner

    def test_get_and_set(self):
        with HangingUpServer() as server:
            for value in range(1, 21):
                arguments = (server.url, "--profile", self.profile, "--json")
                finished = support.run("set", *arguments, f"a={value}", f"b={value + 1}")
                self.assertEqual(finished.status, 0, finished)
                self.assertEqual(server.holding, {5000: value, 5010: value + 1})
                finished = support.run("get", *arguments)
                self.assertEqual(finished.status, 0, finished)
                self.assertEqual([v["value"] for v in finished.records("value")], [value, value + 1])

    def test_error_without_reconnection_names_the_tool(self):
        with HangingUpServer() as server:
            finished = support.run("watch", server.url, "--profile", self.profile, "a", "--no-reconnect")
        self.assertEqual(finished.status, 5, finished)
        self.assertIn(f"spindle: {server.url}: the tool closed the connection", finished.said)


class UnknownToolTest(unittest.TestCase):
    def test_raw_registers_need_no_profile(self):
        for hangs_up in (False, True):
            with self.subTest(hangs_up), HangingUpServer(hangs_up) as server:
                finished = support.run(
                    *("watch", server.url, "@holding:5000", "--json"),
                    *("--interval", "1s", "--all", "--count", 2),
                )
                self.assertEqual(finished.status, 0, finished)
                samples = finished.records("sample")
                self.assertEqual([(s["name"], s["value"]) for s in samples], [("@holding:5000", 273)] * 2)

    def test_names_still_need_one(self):
        with HangingUpServer(hangs_up=False) as server:
            finished = support.run("watch", server.url, "@holding:5000", "status.ready", "--json")
        self.assertEqual(finished.status, 8, finished)

    def test_tool_never_reached(self):
        class Silent(support.Port):
            def _serve(self, client):
                with contextlib.suppress(OSError), client:
                    while client.recv(4096):
                        pass

        ends = (("--duration", "700ms"), ("--idle-timeout", "700ms"))
        for end in ends:
            with self.subTest(end), support.refusing_port() as url:
                finished = support.run("watch", url, *JSON, *end)
                self.assertEqual(finished.status, 4, finished)
                states = {link["state"] for link in finished.records("link")}
                self.assertEqual(states, {"connecting"})
                errors = finished.records("error")
                self.assertEqual([(e["target"], e["exit_status"]) for e in errors], [(url, 4)])
            with self.subTest(end), Silent() as server:
                finished = support.run("watch", server.url, *JSON, *end, "--timeout", "100ms")
                self.assertEqual(finished.status, 5, finished)
                self.assertEqual(finished.records()[-1]["exit_status"], 5)

    def test_one_of_two_never_reached(self):
        with EventServer() as server, support.refusing_port() as url:
            with Watching(server.url, url, *JSON, "--count", 1) as watching:
                support.wait_until(lambda: server.armed, "the other one is watched")
                support.wait_until(lambda: "connecting" in watching.links(), "it is tried")
                server.event()
                status, _, _ = watching.end(None)
            self.assertEqual(status, 9)
            self.assertEqual([error["target"] for error in watching.records("error")], [url])


class UsageTest(unittest.TestCase):
    def test_wrong_names_are_refused_without_connecting(self):
        with EventServer() as server:
            for arguments in (
                ("watch", "stationn3"),
                ("watch", server.url, "stationn3"),
                ("watch", server.url, *PROFILE, "status.redy"),
                ("watch", server.url, server.url, "tcp//127.0.0.1"),
                ("watch", server.url, "--count", "0"),
                ("watch", server.url, "--duration", "soon"),
                ("watch", server.url, "--interval", "0ms"),
                ("watch",),
            ):
                with self.subTest(arguments):
                    finished = support.run(*arguments, "--json")
                    self.assertEqual(finished.status, 2, finished)
                    self.assertEqual([r["type"] for r in finished.records()], ["error"])
            self.assertEqual(server.requests, [])

    def test_simulate_refuses_a_length_that_no_identity_has(self):
        for length in ("0", "11", "14", "255"):
            finished = support.run("simulate", "doga-bm", "--identity-bytes", length)
            self.assertEqual((finished.status, finished.stdout), (2, ""), finished)
            self.assertIn("12, 13, 17", finished.said)


class ValuesTest(unittest.TestCase):
    def test_changes_first_values_and_samples(self):
        with EventServer() as server:
            for option, expected in (
                ((), [(1, 0)]),
                (("--initial",), [(0, None), (1, 0)]),
            ):
                server.tool.inputs[3306] = 0
                count = len(expected)
                with Watching(
                    server.url, "status.ready", *JSON, "--interval", "10ms", "--count", count, *option
                ) as watching:
                    polls = len(server.asked(support.READ_INPUT, 3306))
                    support.wait_until(
                        lambda: len(server.asked(support.READ_INPUT, 3306)) > polls + 1, "it polls"
                    )
                    server.tool.inputs[3306] = 1
                    self.assertEqual(watching.end(None)[0], 0)
                changes = watching.records("change")
                self.assertEqual([(c["value"], c["previous"]) for c in changes], expected)
            finished = support.run(
                "watch", server.url, "status.ready", *JSON, "--interval", "10ms", "--count", 5, "--all"
            )
            self.assertEqual([c["value"] for c in finished.records("sample")], [1] * 5)
            self.assertEqual(finished.records("change"), [])
            summary = finished.records()[-1]
            self.assertEqual((summary["changes"], summary["samples"]), (0, 5))

    def test_refused_value_ends_with_that_error(self):
        with EventServer() as server:
            finished = support.run("watch", server.url, "p564", *JSON)
            self.assertEqual(finished.status, 6, finished)
            self.assertEqual(finished.records("error")[0]["name"], "p564")
            assert_disarmed(server)


if __name__ == "__main__":
    unittest.main()
