"""A tool that was started stands still in the end, also when the program is killed, and a stop is never given up
before it was sent."""

import contextlib
import json
import os
import pathlib
import signal
import subprocess
import time
import unittest

import support
import blv
import test_remote_start

SLOW = test_remote_start.SLOW
FORWARD_OR_REVERSE = 0x18
NET_IN = 0x1161  # lower half of the function of NET-IN0
FWD, STOP_MODE = 1, 19


def children_of(pid):
    return [int(child) for child in pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def is_alive(pid):
    try:
        status = pathlib.Path(f"/proc/{pid}/stat").read_text()
    except FileNotFoundError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


def private_kilobytes(pid):
    lines = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("Private_"))


def changes():
    path = pathlib.Path(support.home().environment()["HOME"]) / ".local/state/spindle/changes.jsonl"
    state = support.home().environment().get("XDG_STATE_HOME")
    if state:
        path = pathlib.Path(state) / "spindle/changes.jsonl"
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def guardians_of(target):
    return [c for c in changes() if c["command"] == "guardian" and c["target"] == target]


class KilledTest(unittest.TestCase):
    def assert_guarded(self, pid):
        (guardian,) = children_of(pid)
        own = os.getsid(pid)
        support.wait_until(lambda: os.getsid(guardian) != own, "the guardian has a session of its own")
        return guardian

    def assert_recorded(self, target):
        results = ["begun", "stopped"]
        support.wait_until(lambda: len(guardians_of(target)) == len(results), "the guardian records what it did")
        self.assertEqual([c["result"] for c in guardians_of(target)], results)

    @contextlib.contextmanager
    def bm_run(self, *options):
        with test_remote_start.Station(**SLOW) as station:
            words = ["remote-start", station.url, *test_remote_start.GO, *options]
            with support.Running(*words) as run:
                support.wait_until(station.has_started, "the tool runs")
                yield station, run

    def test_a_tool(self):
        for wait in (0, 0.05, 0.5):
            with self.subTest(wait), self.bm_run() as (station, run):
                time.sleep(wait)
                guardian = self.assert_guarded(run.pid)
                os.kill(run.pid, signal.SIGKILL)
                support.wait_until(lambda: not station.tool.running, "the guardian stops the tool")
                support.wait_until(lambda: not is_alive(guardian), "the guardian ends")
                self.assertEqual((station.writes()[0], station.writes()[-1]), (1, 0))
                self.assertEqual(station.writes().count(1), 1)
                self.assert_recorded(station.url)

    def test_a_tool_whose_stop_was_under_way(self):
        with test_remote_start.Station(deaf_to=[(test_remote_start.START, 0)], **SLOW) as station:
            with support.Running("remote-start", station.url, *test_remote_start.GO) as run:
                support.wait_until(station.has_started, "the tool runs")
                run.send_signal(signal.SIGINT)
                support.wait_until(lambda: 0 in station.writes(), "the stop is sent")
                os.kill(run.pid, signal.SIGKILL)
                station.tool.deaf_to = ()
                support.wait_until(lambda: not station.tool.running, "the guardian stops the tool")

    def test_a_motor(self):
        for where in blv.PLACES:
            for options in ([], ["--watchdog", "10s"]):  # that the driver does not stop first
                with self.subTest(where, options=options), blv.Bus(where=where) as bus:
                    words = [bus.url, *blv.PROFILE, "--speed", "500", "--accept-unverified", "--yes"]
                    with support.Running("remote-start", *words, *options) as run:
                        support.wait_until(bus.turns, "the motor turns")
                        guardian = self.assert_guarded(run.pid)
                        os.kill(run.pid, signal.SIGKILL)
                        support.wait_until(lambda g=guardian: not is_alive(g), "the guardian ends")
                    self.assertFalse(bus.commands()[-1] & FORWARD_OR_REVERSE, bus.commands())
                    values = support.run("get", bus.url, *blv.PROFILE, "monitor.feedback-speed",
                                         "alarm.present", "--json").records("value")
                    self.assertEqual(values[0]["value"], 0)
                    self.assertEqual(int(str(values[1]["value"]).rstrip("h"), 16), 0)
                    self.assert_recorded(bus.url)

    def test_what_is_told(self):
        with test_remote_start.Station(**SLOW) as station:
            told = support.home().path / "told"
            with open(told, "wb") as err:
                process = subprocess.Popen(
                    [support.binary(), "remote-start", station.url, *test_remote_start.GO, "--preset", "2"],
                    stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=err,
                    env=support.home().environment(), cwd=support.home().path)
            support.wait_until(station.has_started, "the tool runs")
            process.kill()
            support.wait_for_end(process)
            support.wait_until(lambda: "its guardian did" in told.read_text(), "the guardian tells it")
            self.assertEqual(told.read_text().count("\n"), 1)
            self.assertIn("may not be set back: select-preset=2", told.read_text())

    def test_it_costs_little_and_leaves_nothing(self):
        with self.bm_run() as (station, run):
            guardian = self.assert_guarded(run.pid)
            self.assertLess(private_kilobytes(guardian), 2048)
            for number in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT):
                os.kill(guardian, number)
            run.send_signal(signal.SIGINT)
            finished = run.finish()
            self.assertEqual(finished.status, 130, finished)
            self.assertFalse(is_alive(guardian))
            self.assertEqual(guardians_of(station.url), [])

    def test_a_simulated_tool_needs_none(self):
        with support.Running("remote-start", "sim:doga-bm", *test_remote_start.GO[2:], "--for", "1s") as run:
            time.sleep(0.2)
            self.assertEqual(children_of(run.pid), [])
            run.finish()


class SignalTest(unittest.TestCase):
    def test_every_signal_that_can_be_caught(self):
        numbers = [signal.SIGALRM, signal.SIGVTALRM, signal.SIGPROF, signal.SIGXCPU, signal.SIGIO,
                   signal.SIGPWR, signal.SIGSTKFLT, signal.SIGABRT, signal.SIGSEGV, signal.SIGBUS,
                   signal.SIGFPE, signal.SIGILL, signal.SIGTRAP, signal.SIGSYS, signal.SIGRTMIN, signal.SIGRTMAX]
        if support.is_sanitized():  # the sanitizer keeps these for itself
            numbers = [n for n in numbers if n not in (signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE)]
        for number in numbers:
            with self.subTest(number), test_remote_start.Station(**SLOW) as station:
                with support.Running("remote-start", station.url, *test_remote_start.GO, "--json") as run:
                    support.wait_until(station.has_started, "the tool runs")
                    run.send_signal(number)
                    finished = run.finish()
                self.assertEqual(finished.status, 143, finished)
                self.assertEqual(station.writes()[-1], 0, finished)
                self.assertFalse(station.tool.running, finished)
                self.assertTrue(finished.records()[-1]["stop_confirmed"], finished)

    def test_what_only_other_programs_understand_changes_nothing(self):
        with test_remote_start.Station(**SLOW) as station:
            with support.Running("remote-start", station.url, *test_remote_start.GO, "--json") as run:
                support.wait_until(station.has_started, "the tool runs")
                writes = station.writes()
                for number in (signal.SIGUSR1, signal.SIGUSR2):
                    run.send_signal(number)
                self.assertEqual(station.writes(), writes)
                run.send_signal(signal.SIGTERM)
                finished = run.finish()
            self.assertEqual(finished.status, 143, finished)
            self.assertTrue(finished.records()[-1]["stop_confirmed"], finished)

    def test_a_second_signal_says_that_the_tool_may_run(self):
        with test_remote_start.Station(deaf_to=[(test_remote_start.START, 0)], **SLOW) as station:
            with support.Running("remote-start", station.url, *test_remote_start.GO) as run:
                support.wait_until(station.has_started, "the tool runs")
                run.send_signal(signal.SIGINT)
                support.wait_until(lambda: station.writes().count(0) > 1, "the stop is sent again")
                run.send_signal(signal.SIGINT)
                finished = run.finish()
            self.assertEqual(finished.status, 130, finished)
            self.assertIn("THE TOOL MAY STILL RUN", finished.said)
            self.assertIn(station.url, finished.said)


class StopTest(unittest.TestCase):
    """remote-stop never gives up before it has sent a stop."""

    def stop(self, url, *options):
        return support.run("remote-stop", url, *options, "--json")

    def test_an_identity_that_is_not_told(self):
        replies = {
            "lost": [],
            "refused": [{"answer": {"exception": "01"}}],
        }
        for what, reply in replies.items():
            row = {"on": ["identity"], "reply": reply}
            with self.subTest(what), test_remote_start.Station(row, **SLOW) as station:
                station.tool.inputs[test_remote_start.STATUS + 7] = 1
                station.tool.ends = time.monotonic() + 600
                finished = self.stop(station.url, "--profile", "doga-bm")
                self.assertEqual(finished.status, 0, finished)
                self.assertFalse(station.tool.running, finished)

    def test_an_identity_that_gets_lost_is_asked_again(self):
        row = {"on": ["identity"], "times": 4, "reply": []}
        with test_remote_start.Station(row, **SLOW) as station:
            station.tool.inputs[test_remote_start.STATUS + 7] = 1
            station.tool.ends = time.monotonic() + 600
            finished = self.stop(station.url)
            self.assertEqual(finished.status, 0, finished)
            self.assertFalse(station.tool.running, finished)

    def test_an_identity_that_never_comes(self):
        with test_remote_start.Station({"on": ["identity"], "reply": []}, **SLOW) as station:
            finished = self.stop(station.url)
            self.assertEqual(finished.status, 5, finished)
            self.assertIn("no stop was sent", finished.said)
            self.assertIn("--profile", finished.said)
            self.assertEqual(station.writes(), [])

    def test_lines_that_lose_much(self):
        for lost in ((1, 2, 3), (2, 3, 5, 7, 8), (1, 3, 4, 6, 9, 10)):
            faults = [word for at in lost for word in ("--fault", f"lost@{at + 1}")]  # behind the start below
            with self.subTest(lost), blv.Bus(*faults) as bus:
                with blv.OtherMaster(bus) as other:
                    other.write(1, blv.COMMAND, blv.FORWARD)
                finished = self.stop(bus.url, *blv.PROFILE, "--timeout", "200ms")
                self.assertEqual(finished.status, 0, finished)
                self.assertFalse(bus.commands()[-1] & FORWARD_OR_REVERSE)


class AssignedInputsTest(unittest.TestCase):
    """The words are those of this driver, and none of them starts what stands still."""

    def test_a_stop_starts_nothing(self):
        for inputs in ({5: FWD}, {5: 2}, {5: 77}, {0: FWD, 1: 2}):
            for runs in (False, True):
                with self.subTest(inputs, runs=runs), blv.Bus() as bus:
                    with blv.OtherMaster(bus) as other:
                        for number, function in inputs.items():
                            other.write(1, NET_IN + 2 * number, function)
                        if runs:
                            other.write(1, blv.COMMAND, 0x08)
                    before = len(bus.commands())
                    finished = support.run("remote-stop", bus.url, *blv.PROFILE, "--json")
                    self.assertEqual(finished.status, 0, finished)
                    starting = sum(1 << n for n, function in inputs.items() if function in (1, 2, 77)) | 0x18
                    for word in bus.commands()[before:]:
                        self.assertFalse(word & starting, hex(word))

    def test_a_start_uses_the_inputs_of_its_driver(self):
        with blv.Bus() as bus:
            with blv.OtherMaster(bus) as other:
                other.write(1, NET_IN + 2 * 3, STOP_MODE)
                other.write(1, NET_IN + 2 * 5, FWD)
            finished = support.run("remote-start", bus.url, *blv.PROFILE, "--speed", "500", "--for", "500ms",
                                   "--accept-unverified", "--yes", "--json")
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual(bus.commands(), [0x2A, 0x0A])  # FWD is bit 5, STOP-MODE is bit 3

    def test_a_start_that_can_not_be_made(self):
        with blv.Bus() as bus:
            with blv.OtherMaster(bus) as other:
                other.write(1, NET_IN + 2 * 3, 0)
            finished = support.run("remote-start", bus.url, *blv.PROFILE, "--speed", "500",
                                   "--accept-unverified", "--yes")
            self.assertEqual(finished.status, 1, finished)
            self.assertIn("no input of this driver has function 1", finished.said)
            self.assertEqual(bus.commands(), [])


if __name__ == "__main__":
    unittest.main()
