"""A motor that was started is stopped, whatever happens to the program, the link or the tool."""

import contextlib
import os
import signal
import socket
import subprocess
import threading
import time
import unittest

import hostile_server
import support

PROMPT = 1.0  # for what takes milliseconds on a machine that has nothing else to do
PATIENCE = 10.0  # for how long a stop is tried
ARM, START, SELECT, TURN = 4002, 4003, 4004, 4005
EVENT, ALARM_DATA, STATUS = 3200, 3100, 3300
OK, NG, ERROR, OTHER = 1, 2, 6, 0
GO = ["--profile", "doga-bm", "--accept-unverified", "--yes"]


class MovingTool(hostile_server.Tool):
    """A tool that turns, written from its description and not from the program's simulation."""

    def __init__(self, outcome=OK, lasts=0.15, deaf_to=(), alarm=0, **facts):
        super().__init__(**facts)
        self.outcome, self.lasts, self.deaf_to = outcome, lasts, deaf_to
        self.ends = None
        self.inputs.update({STATUS + 7: 0, STATUS + 8: alarm, STATUS + 9: 0, EVENT: 1961})

    @property
    def running(self):
        return self.inputs[STATUS + 7] == 1

    def answer(self, request, store):
        if self.running and time.monotonic() >= self.ends:
            self.finish(self.outcome)
        return super().answer(request, store)

    def finish(self, outcome):
        error = {OK: 0, NG: 335, ERROR: 118, OTHER: 0}[outcome]
        self.inputs.update({STATUS + 7: 0, EVENT + 10: error, EVENT + 12: outcome})
        self.inputs[EVENT] += 1
        if outcome == ERROR:
            self.inputs[STATUS + 8] = error

    def _write(self, register, value, data, store):
        if register in self.deaf_to or (register, value) in self.deaf_to:
            return support.WRITE_SINGLE, data
        if register == START and value == 1:
            self.inputs[STATUS + 7] = 1
            self.ends = time.monotonic() + self.lasts
        elif register == START and self.running:
            self.finish(NG)
        elif register == SELECT:
            self.inputs[STATUS + 3] = value
        elif register == TURN:
            self.inputs[STATUS + 9] = value
        elif register == 4000:
            self.inputs[STATUS + 8] = 0
        return super()._write(register, value, data, store)


class Station(hostile_server.HostileServer):
    """A moving tool on a port, whose connections can be cut."""

    def __init__(self, row=None, **tool):
        super().__init__(row or {})
        self.tool = MovingTool(**tool)

    def writes(self, register=START):
        """Values in the order in which they came, without what only keeps the output armed."""
        words = [r.words for r in list(self.requests) if r.function == support.WRITE_SINGLE]
        return [value for address, value in words if address == register]

    def has_started(self):
        return self.tool.running

    def cut(self, for_good=False):
        if for_good:
            self._listening.shutdown(socket.SHUT_RDWR)
            self._listening.close()
        for connection in list(self._connections):
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def __exit__(self, *exception):
        with contextlib.suppress(OSError):
            super().__exit__(*exception)


SLOW = {"lasts": 60.0}  # runs until it is stopped


class RemoteStartTest(unittest.TestCase):
    def assert_stopped(self, station, finished=None):
        self.assertEqual(station.writes()[:1], [1], finished)
        self.assertEqual(station.writes().count(1), 1, finished)
        self.assertEqual(station.writes()[-1], 0, finished)
        self.assertFalse(station.tool.running, finished)
        self.assertEqual((station.own_faults, station.faults_of_client), ([], []), finished)

    def assert_untouched(self, station, finished=None):
        """Nothing was written at all, or nothing but what selects."""
        self.assertEqual(station.writes(START), [], finished)
        self.assertFalse(station.tool.running, finished)

    @contextlib.contextmanager
    def running(self, station, *options, **how):
        """A remote start whose tool turns."""
        with support.Running("remote-start", station.url, *GO, *options, **how) as run:
            support.wait_until(station.has_started, "the tool runs")
            yield run

    def start(self, station, *options):
        return support.run("remote-start", station.url, *GO, "--json", *options)


class ResultTest(RemoteStartTest):
    def test_results(self):
        for outcome, kind, status in ((OK, "fastening-ok", 0), (NG, "fastening-ng", 1), (ERROR, "error", 1), (OTHER, "other", 1)):
            with self.subTest(kind), Station(outcome=outcome) as station:
                finished = self.start(station)
                self.assertEqual(finished.status, status, finished)
                self.assertEqual([e["kind"] for e in finished.records("event")], [kind], finished)
                summary = finished.records()[-1]
                self.assertEqual((summary["type"], summary["result"]), ("summary", kind), finished)
                self.assertEqual((summary["stop_confirmed"], summary["exit_status"]), (True, status))
                self.assert_stopped(station, finished)
                # Left as it was found: the output is off again, after the stop.
                self.assertEqual(station.writes(ARM)[-1], 0, finished)

    def test_the_simulators_own_log(self):
        with support.Running("simulate", "doga-bm", "-v") as simulator:
            url = simulator.line()
            finished = support.run("remote-start", url, *GO)
            simulator.send_signal(signal.SIGTERM)
            log = simulator.finish().stderr.upper().replace(" ", "")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual(log.count("060FA30001"), 2, log)  # the request and its echo
        self.assertGreaterEqual(log.count("060FA30000"), 2, log)
        self.assertGreater(log.rindex("060FA30000"), log.rindex("060FA30001"), log)

    def test_the_time_allowed(self):
        def start():
            with Station(**SLOW) as station:
                finished = self.start(station, "--for", "300ms")
                self.assertEqual(finished.status, 1, finished)
                self.assertEqual(finished.records()[-1]["result"], "fastening-ng", finished)
                self.assertGreater(finished.seconds, 0.3)
                self.assert_stopped(station, finished)
                return finished

        support.quickest(start, 0.3 + PROMPT)

    def test_the_time_allowed_holds_for_a_patient_user_too(self):
        # The tool does the start and falls silent; the user would wait a minute for its answer.
        def start():
            row = {"on": ["write"], "skip": 1, "times": 1, "reply": []}
            with Station(row, **SLOW) as station:
                finished = self.start(station, "--for", "300ms", "--timeout", "60s", "--retries", "9")
                self.assertEqual(finished.status, 5, finished)
                self.assert_stopped(station, finished)
                return finished

        support.quickest(start, 0.3 + PROMPT)

    def test_a_start_that_is_only_echoed(self):
        with Station(deaf_to=[START]) as station:
            finished = self.start(station, "--timeout", "300ms")
            self.assertEqual(finished.status, 8, finished)
            self.assertIn("does not run", finished.said)
            self.assert_stopped(station, finished)

    def test_a_start_that_is_refused(self):
        row = {"on": ["write"], "skip": 1, "times": 1, "store": "nothing", "reply": [{"answer": {"exception": "03"}}]}
        with Station(row) as station:
            station.tool.deaf_to = [(START, 1)]
            finished = self.start(station)
            self.assertEqual(finished.status, 6, finished)
            self.assert_stopped(station, finished)

    def test_people_see_the_same(self):
        with Station(outcome=NG) as station:
            finished = support.run("remote-start", station.url, *GO)
        self.assertRegex(finished.stdout, r"fastening-ng .* NG +[a-z-]+ +E335 ")
        self.assertRegex(finished.stderr, r"\ANG; the tool stands still \(change [0-9a-f]{8}\)\n\Z", finished)


class ClosedStreamTest(RemoteStartTest):
    """With a standard stream closed, no socket takes its number and hears what is meant for people."""

    def test_closed_from_the_beginning(self):
        for closed in ("<&-", ">&-", "2>&-", "<&- >&-", "<&- 2>&-", ">&- 2>&-", "<&- >&- 2>&-"):
            for command in (["remote-start", *GO[2:], "--for", "200ms"], ["remote-stop"]):
                with self.subTest(closed, command=command[0]), Station(**SLOW) as station:
                    words = [support.binary(), *command, station.url, *GO[:2], "--verbose"]
                    support.completed(
                        ["sh", "-c", f'exec "$@" {closed}', "sh", *words],
                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                        env=support.home().environment(), cwd=support.home().path,
                    )
                    expected = [1, 0] if command[0] == "remote-start" else [0]
                    support.wait_until(lambda s=station: s.writes(), "it is commanded")
                    self.assertEqual((station.writes()[0], station.writes()[-1]), (expected[0], 0))
                    self.assertEqual(station.writes().count(1), expected.count(1))
                    self.assertEqual((station.own_faults, station.faults_of_client), ([], []))
                    self.assertFalse(station.tool.running)


class EndingTest(RemoteStartTest):
    def test_signals(self):
        # Ctrl-Z too: a suspended program would stop no motor.
        endings = (
            (signal.SIGINT, 130),
            (signal.SIGTERM, 143),
            (signal.SIGHUP, 143),
            (signal.SIGQUIT, 143),
            (signal.SIGTSTP, 130),
        )
        seconds = []
        for number, status in endings:
            for form in ("--json", "--verbose"):
                with self.subTest(number, form=form), Station(**SLOW) as station:
                    with self.running(station, form) as run:
                        run.send_signal(number)
                        finished = run.finish()
                    self.assertEqual(finished.status, status, finished)
                    self.assertLess(finished.paced, support.SOON, finished)
                    seconds.append(finished.paced)
                    self.assert_stopped(station, finished)
        self.assertLess(min(seconds), PROMPT + 0.5, seconds)

    def test_a_signal_before_the_start_is_acknowledged(self):
        row = {"on": ["write"], "skip": 1, "times": 1, "reply": []}
        with Station(row, **SLOW) as station:
            with self.running(station, "--timeout", "60s") as run:
                run.send_signal(signal.SIGINT)
                finished = run.finish()
            self.assertEqual(finished.status, 130, finished)
            self.assert_stopped(station, finished)

    def test_several_signals_at_once(self):
        for _ in range(5):
            with Station(**SLOW) as station:
                with self.running(station) as run:
                    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                        os.kill(run.pid, number)
                    finished = run.finish()
                self.assertIn(finished.status, (130, 143), finished)
                self.assert_stopped(station, finished)

    def test_nobody_takes_what_is_told(self):
        """A pager that shows its first page, or a terminal halted with Ctrl-S."""
        with Station(**SLOW) as station, contextlib.ExitStack() as stack:
            reading, writing = support.small_pipe()
            stack.callback(os.close, reading)
            process = subprocess.Popen(
                [support.binary(), "remote-start", station.url, *GO, "--verbose", "--for", "3s"],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=writing,
                env=support.home().environment(), cwd=support.home().path,
            )
            stack.callback(process.wait)
            stack.callback(process.kill)
            os.close(writing)
            support.wait_until(lambda: 0 in station.writes(), "the tool is stopped after the time allowed")
            support.wait_until(lambda: not station.tool.running, "the tool stands still")

    def test_a_second_signal_ends_at_once(self):
        with Station(deaf_to=[(START, 0)], **SLOW) as station:
            with self.running(station) as run:
                run.send_signal(signal.SIGINT)
                support.wait_until(lambda: 0 in station.writes(), "the stop is sent")
                # What follows at once is the same wish.
                run.send_signal(signal.SIGTERM)
                support.wait_until(lambda: station.writes().count(0) > 1, "the stop is sent again")
                run.send_signal(signal.SIGINT)
                finished = run.finish()
            self.assertEqual(finished.status, 130, finished)
            self.assertLess(finished.paced, support.SOON, finished)
            self.assertEqual(station.writes().count(1), 1)

    def test_a_reader_that_was_never_there(self):
        for form in ("table", "json", "csv"):
            with self.subTest(form), Station(**SLOW) as station:
                reading, writing = os.pipe()
                os.close(reading)
                with support.Running("remote-start", station.url, *GO, "-o", form, stdout=writing) as run:
                    os.close(writing)
                    finished = run.finish()
                self.assertEqual(finished.status, 1, finished)
                self.assertIn("has no reader", finished.said)
                self.assert_stopped(station, finished)

    def test_a_reader_that_goes(self):
        with Station(**SLOW) as station:
            reading, writing = os.pipe()
            with self.running(station, "--json", stdout=writing) as run:
                os.close(writing)
                os.close(reading)
                finished = run.finish()
            self.assertEqual(finished.status, 1, finished)  # no screw was tightened
            self.assertIn("has no reader", finished.said)
            self.assert_stopped(station, finished)

    def test_cut_while_it_runs(self):
        for options in ([], ["--verbose"]):
            with self.subTest(options), Station(**SLOW) as station:
                with self.running(station, *options) as run:
                    station.cut()
                    finished = run.finish()
                self.assertEqual(finished.status, 5, finished)
                self.assertIn("closed the connection", finished.said)
                # Found on the new connection: what the stop left behind.
                self.assertIn("E335", finished.stdout, finished)
                self.assert_stopped(station, finished)

    def test_cut_at_the_start(self):
        for store, what in (("asked", "heard"), ("nothing", "not heard")):
            row = {"on": ["write"], "skip": 1, "times": 1, "reply": [{"close": {}}], "store": store}
            with self.subTest(what), Station(row, **SLOW) as station:
                finished = self.start(station)
                self.assertEqual(finished.status, 5, finished)
                self.assert_stopped(station, finished)

    def test_cut_at_the_stop(self):
        row = {"on": ["write"], "skip": 2, "times": 1, "reply": [{"reset": {}}]}
        with Station(row, outcome=OK) as station:
            finished = self.start(station)
            self.assertEqual(finished.status, 0, finished)
            self.assert_stopped(station, finished)

    def test_what_can_not_be_stopped_is_said(self):
        """Each takes its ten seconds, so they run side by side. One has no reader any more."""
        with contextlib.ExitStack() as stack:
            enter = stack.enter_context
            dead, deaf, mute, unread = (
                enter(Station(**SLOW)),
                enter(Station(deaf_to=[(START, 0)], **SLOW)),
                enter(Station({"on": ["write"], "skip": 2, "reply": []}, deaf_to=[(START, 0)], **SLOW)),
                enter(Station(deaf_to=[(START, 0)], **SLOW)),
            )
            reading, writing = os.pipe()
            runs = [
                enter(self.running(dead, "--json", "--connect-timeout", "60s")),
                enter(self.running(deaf, "--for", "200ms")),
                enter(self.running(mute, "--for", "200ms", "-o", "csv")),
                enter(self.running(unread, "-o", "csv", stdout=writing)),
            ]
            os.close(writing)
            os.close(reading)  # the last one's records are not read any more
            dead.cut(for_good=True)
            finished = [run.finish() for run in runs]
        for one in finished:
            self.assertEqual(one.status, 5, one)
            self.assertRegex(one.said, r"THE TOOL MAY STILL RUN: the stop was tried for \d+ s \(\d+ times\)")
            self.assertIn("stop it at the tool", one.said)
            self.assertGreater(one.seconds, PATIENCE - 1)
            self.assertLess(one.paced, PATIENCE + support.SOON)
        self.assertIn("still says that it runs", finished[1].stderr)
        errors = finished[0].records("error")
        self.assertIn("THE TOOL MAY STILL RUN", errors[-1]["message"])
        self.assertEqual(finished[0].records()[-1]["stop_confirmed"], False)
        for station in (dead, deaf, mute, unread):
            self.assertEqual(station.writes().count(1), 1)
        for station in (deaf, mute, unread):
            self.assertGreaterEqual(station.writes().count(0), 4)

    def test_one_client_at_a_time(self):
        """A tool that serves no other client until the silent connection is ended."""
        with Station(**SLOW) as station, Single(station.url) as single:
            with support.Running("remote-start", single.url, *GO, "--json") as run:
                support.wait_until(station.has_started, "the tool runs")
                single.freeze()
                finished = run.finish()
            self.assertEqual(finished.status, 5, finished)
            self.assertEqual(finished.records()[-1]["stop_confirmed"], True, finished)
            self.assert_stopped(station, finished)


class Single(support.Port):
    """Passes one client at a time to a server; freeze() lets the present one wait in vain."""

    def __init__(self, url):
        super().__init__()
        self._upstream = support.host_and_port(url)
        self._frozen = threading.Event()

    def freeze(self):
        self._frozen.set()

    def _meet(self, client):
        with client, socket.create_connection(self._upstream) as server:
            self._pass_on(client, server)
        self._frozen.clear()

    def _pass_on(self, client, server):
        with contextlib.suppress(OSError):
            while request := client.recv(65536):
                if self._frozen.is_set():
                    continue
                server.sendall(request)
                client.sendall(server.recv(65536))


class BeforeTest(RemoteStartTest):
    def test_evidence(self):
        with Station() as station:
            finished = support.run("remote-start", station.url, "--profile", "doga-bm", "--yes", "--json")
            self.assertEqual(finished.status, 2, finished)
            self.assertIn("--accept-unverified", finished.said)
            self.assertIn("sibling", finished.said)
            self.assertEqual(station.requests, [])

    def test_verified_in_the_tools_file(self):
        with Station() as station:
            tools = support.home().path / "tools.yaml"
            tools.write_text(
                f'tools:\n  mine: {{url: "{station.url}", profile: doga-bm, verified: [start]}}\n'
            )
            finished = support.run("remote-start", "mine", "--tools", tools, "--yes", "--preset", "2")
            self.assertEqual(finished.status, 2, finished)
            self.assertIn("select-preset", finished.said)
            self.assert_untouched(station)
            finished = support.run("remote-start", "mine", "--tools", tools, "--yes")
            self.assertEqual(finished.status, 0, finished)
            self.assert_stopped(station, finished)

    def test_not_confirmed(self):
        with Station() as station:
            for option in ([], ["--no-input"]):
                finished = support.run(
                    "remote-start", station.url, "--profile", "doga-bm", "--accept-unverified", *option
                )
                self.assertEqual(finished.status, 2, finished)
                self.assertIn("--yes", finished.said)
            self.assertEqual(station.requests, [])

    def test_selections(self):
        with Station() as station:
            finished = self.start(station, "--preset", "5", "--direction", "loosening")
            self.assertEqual(finished.status, 0, finished)
            # Behind the run both are set back to what the tool showed before.
            self.assertEqual((station.writes(SELECT), station.writes(TURN)), ([5, 3], [1, 0]))
            order = [r.words[0] for r in station.requests if r.function == support.WRITE_SINGLE]
            self.assertLess(order.index(TURN), order.index(START))
            self.assert_stopped(station, finished)

    def test_the_tool_is_left_as_it_was_found(self):
        def interrupt(run, _):
            run.send_signal(signal.SIGINT)

        def cut(_, station):
            station.cut()

        for end, status in ((interrupt, 130), (cut, 5)):
            with self.subTest(end.__name__), Station(**SLOW) as station:
                with self.running(station, "--preset", "5", "--direction", "loosening", "--json") as run:
                    end(run, station)
                    finished = run.finish()
                self.assertEqual(finished.status, status, finished)
                self.assertEqual((station.writes(SELECT), station.writes(TURN)), ([5, 3], [1, 0]))
                order = [r.words for r in station.requests if r.function == support.WRITE_SINGLE]
                self.assertLess(order.index((START, 0)), order.index((TURN, 0)), "not before the stop")
                self.assertIsNone(finished.records()[-1]["left"], finished)
                self.assert_stopped(station, finished)

    def test_what_was_selected_before_a_start_that_fails(self):
        with Station(deaf_to=[TURN]) as station:
            finished = self.start(station, "--preset", "5", "--direction", "loosening", "--timeout", "200ms")
            self.assertEqual(finished.status, 8, finished)
            self.assertEqual(station.writes(SELECT), [5, 3])
            self.assert_untouched(station, finished)

    def test_what_can_not_be_set_back_is_said(self):
        with Station(deaf_to=[(TURN, 0)]) as station:
            finished = self.start(station, "--direction", "loosening", "--timeout", "200ms", "--quiet")
            self.assertEqual(finished.records()[-1]["left"], {"direction": "forward"}, finished)
            self.assertEqual(len(finished.sentences()), 1, finished)
            self.assertIn("not set back: direction: set to loosening, before it was forward", finished.said)
            self.assert_stopped(station, finished)

    def test_what_may_not_be_set_back_while_it_may_run(self):
        with Station(deaf_to=[(START, 0)], **SLOW) as station:
            finished = self.start(station, "--direction", "loosening", "--for", "200ms")
            self.assertEqual(finished.status, 5, finished)
            self.assertEqual(finished.records()[-1]["left"], {"direction": "forward"}, finished)
            self.assertEqual(station.writes(TURN), [1])

    def test_a_selection_that_does_not_take(self):
        for register, option in ((SELECT, ["--preset", "5"]), (TURN, ["--direction", "loosening"])):
            with self.subTest(option), Station(deaf_to=[register]) as station:
                finished = self.start(station, *option, "--timeout", "200ms")
                self.assertEqual(finished.status, 8, finished)
                self.assert_untouched(station, finished)

    def test_a_tool_that_is_not_ready(self):
        for facts, words in (({"alarm": 118}, "has an alarm"), ({}, "runs already")):
            with self.subTest(words), Station(**facts, **SLOW) as station:
                if not facts:
                    station.tool.inputs[STATUS + 7] = 1
                    station.tool.ends = time.monotonic() + 60
                finished = self.start(station, "--preset", "5")
                self.assertEqual(finished.status, 1, finished)
                self.assertIn(words, finished.said)
                writes = [r for r in station.requests if r.function == support.WRITE_SINGLE]
                self.assertEqual(writes, [], finished)

    def test_later_firmware(self):
        sure = ["--accept-unverified", "--yes"]
        for command, options in (("remote-start", sure), ("remote-stop", []), ("alarms", [*sure, "--reset"])):
            for profile in ([], ["--profile", "doga-bm"]):
                with self.subTest(command, profile=profile), Station(firmware=4001) as station:
                    finished = support.run(command, station.url, *options, *profile)
                    self.assertEqual(finished.status, 8, finished)
                    self.assertIn("4001", finished.said)
                    self.assertEqual({r.function for r in station.requests}, {support.REPORT_SERVER_ID})


class RemoteStopTest(RemoteStartTest):
    def test_a_running_tool(self):
        with Station(**SLOW) as station:
            with self.running(station, "--json") as run:
                stopped = support.run("remote-stop", station.url, "--profile", "doga-bm", "--json")
                finished = run.finish()
            self.assertEqual(stopped.status, 0, stopped)
            self.assertEqual([a["result"] for a in stopped.records("action")], ["confirmed"])
            self.assertEqual(finished.status, 1, finished)
            self.assert_stopped(station, finished)

    def test_side_by_side(self):
        """A tool that cannot be reached does not keep the others waiting."""
        with contextlib.ExitStack() as stack:
            stations = [stack.enter_context(Station(**SLOW)) for _ in range(3)]
            url, somebody_waits = stack.enter_context(support.full_backlog())
            urls = [stations[0].url, url, *(station.url for station in stations[1:])]
            run = stack.enter_context(
                support.Running(
                    "remote-stop", *urls, "--profile", "doga-bm", "--connect-timeout", "6s", "--json"
                )
            )
            support.wait_until(somebody_waits, "a connection is tried")
            for station in stations:
                support.wait_until(lambda s=station: s.writes() == [0], "the others are stopped")
            self.assertIsNone(run.process.poll())
            finished = run.finish()
        self.assertEqual(finished.status, 9, finished)
        confirmed = [a["target"] for a in finished.records("action") if a["result"] == "confirmed"]
        self.assertEqual(confirmed, [station.url for station in stations])
        self.assertEqual([e["target"] for e in finished.records("error")], [url])
        summary = finished.records()[-1]
        self.assertEqual((summary["stopped"], summary["failed"]), (3, 1))

    def test_a_stop_is_repeated(self):
        with Station({"on": ["write"], "times": 1, "store": "nothing", "reply": []}) as station:
            finished = support.run(
                "remote-stop", station.url, "--profile", "doga-bm", "--timeout", "200ms"
            )
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual(station.writes(), [0, 0])

    def test_a_tool_that_runs_on(self):
        with Station(deaf_to=[START], **SLOW) as station:
            station.tool.inputs[STATUS + 7] = 1
            station.tool.ends = time.monotonic() + 60
            finished = support.run("remote-stop", station.url, "--profile", "doga-bm", "--timeout", "200ms")
        self.assertEqual(finished.status, 8, finished)
        self.assertIn("not-confirmed", finished.stdout)
        self.assertIn("stop it at the tool", finished.said)


class AlarmsTest(RemoteStartTest):
    def test_a_present_alarm(self):
        with Station(alarm=118) as station:
            station.tool.inputs.update({EVENT + 10: 118, EVENT + 12: ERROR})
            finished = support.run("alarms", station.url, "--json")
            self.assertEqual(finished.status, 0, finished)
            alarms = {(a["list"], a["index"]): a for a in finished.records("alarm")}
            self.assertEqual(
                {key: alarm["code"] for key, alarm in alarms.items()},
                {("present", 1): 118, ("last-event", 1): 118, ("alarm-data", 1): 40, ("alarm-data", 2): 41},
            )
            self.assertTrue(alarms["present", 1]["text"] and alarms["present", 1]["remedy"], finished)
            self.assertIsNone(alarms["alarm-data", 1]["text"])
            self.assertEqual(finished.records()[-1]["present"], 1)
            table = support.run("alarms", station.url)
            self.assertIn(alarms["present", 1]["remedy"], table.stdout)
            self.assertEqual(table.stderr, "alarm 118 is present\n")
            self.assertEqual(station.writes(4000), [])

    def test_reset(self):
        with Station(alarm=118) as station:
            refused = support.run("alarms", station.url, "--reset", "--yes")
            self.assertEqual(refused.status, 2, refused)
            self.assertIn("--accept-unverified", refused.said)
            unconfirmed = support.run("alarms", station.url, "--reset", "--accept-unverified")
            self.assertEqual(unconfirmed.status, 2, unconfirmed)
            self.assertIn("--yes", unconfirmed.said)
            self.assertEqual(station.writes(4000), [])
            finished = support.run("alarms", station.url, "--reset", "--accept-unverified", "--yes", "--json")
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual([a["result"] for a in finished.records("action")], ["confirmed"])
            self.assertEqual(station.writes(4000), [1])
            self.assertEqual(station.tool.inputs[STATUS + 8], 0)

    def test_a_reset_that_does_not_take(self):
        with Station(alarm=118, deaf_to=[4000]) as station:
            finished = support.run(
                "alarms", station.url, "--reset", "--accept-unverified", "--yes", "--timeout", "200ms"
            )
            self.assertEqual(finished.status, 8, finished)
            self.assertIn("the alarm was not reset", finished.said)


if __name__ == "__main__":
    unittest.main()
