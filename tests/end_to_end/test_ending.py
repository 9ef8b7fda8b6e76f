"""How it ends: signals during every wait, closed pipes, closed streams."""

import collections
import fcntl
import os
import resource
import signal
import subprocess
import sys
import tempfile
import termios
import threading
import unittest

import hostile_server
import support

# The contract says 100 ms. The rest is allowed for what a sanitizer does at the end.
PROMPT = 0.25
SIGNALS = ((signal.SIGINT, 130), (signal.SIGTERM, 143)) * 2
SILENT = {"on": ["identity", "read", "write", "read-back"], "reply": []}
TORQUE = "preset.1.target-torque"


def waiting_bytes(pipe):
    """How much has not been read yet."""
    return int.from_bytes(fcntl.ioctl(pipe, termios.FIONREAD, bytes(4)), sys.byteorder)


class SignalTest(unittest.TestCase):
    ends = collections.defaultdict(list)  # seconds, by what was waited for

    @classmethod
    def tearDownClass(cls):
        """What else the machine does delays one end or another; a wait that is not prompt, all of its kind."""
        quickest = {kind: min(seconds) for kind, seconds in cls.ends.items()}
        slow = {kind: seconds for kind, seconds in quickest.items() if seconds > PROMPT}
        print(f"quickest end after a signal, of the slowest wait: {1000 * max(quickest.values(), default=0):.0f} ms (paced)")
        assert not slow, slow

    def assert_ended(self, finished, status):
        self.assertEqual(finished.status, status, finished)
        self.assertLess(finished.paced, support.SOON, finished)
        self.ends[self._testMethodName].append(finished.paced)

    def interrupt(self, number, status, waits_until, *arguments):
        with support.Running(*arguments, "--json") as running:
            support.wait_until(lambda: waits_until(running), f"{arguments[0]} waits")
            running.send_signal(number)
            finished = running.finish()
        self.assert_ended(finished, status)
        return finished

    def test_while_connecting(self):
        for number, status in SIGNALS:
            with self.subTest(number), support.full_backlog() as (url, somebody_waits):
                finished = self.interrupt(
                    number, status, lambda _: somebody_waits(),
                    "get", url, "--profile", "doga-bm", TORQUE, "--connect-timeout", "60s",
                )
                self.assertEqual(finished.records()[-1]["exit_status"], status, finished)

    def test_while_waiting_for_an_answer(self):
        commands = {
            "identify": [],
            "get": ["--profile", "doga-bm", TORQUE],
            "set": ["--profile", "doga-bm", f"{TORQUE}=2.80"],
            "do": ["--profile", "doga-bm", "auto-output=1"],
            "ping": [],
        }
        for command, arguments in commands.items():
            for number, status in SIGNALS:
                with self.subTest(command, signal=number), hostile_server.HostileServer(SILENT) as server:
                    finished = self.interrupt(
                        number, status, lambda _: server.requests,
                        command, server.url, *arguments, "--timeout", "60s",
                    )
                    self.assertEqual(finished.records()[-1]["exit_status"], status, finished)

    def test_while_waiting_for_the_echo_of_a_write(self):
        row = {"on": ["write"], "reply": []}
        for number, status in SIGNALS:
            with self.subTest(number), hostile_server.HostileServer(row) as server:
                self.interrupt(
                    number, status, lambda _: server.misbehaved,
                    "set", server.url, "--profile", "doga-bm", f"{TORQUE}=2.80", "--timeout", "60s",
                )

    def test_in_a_flood_of_strays(self):
        stray = {"stray": {"transaction": 1, "function": 3, "data": "04010F03E8"}}
        row = {"on": ["identity"], "reply": [{"endless": [stray]}]}
        for number, status in SIGNALS:
            with self.subTest(number), hostile_server.HostileServer(row) as server:
                self.interrupt(
                    number, status, lambda _: server.misbehaved, "identify", server.url, "--timeout", "60s"
                )

    def test_between_two_pings(self):
        for number, status in SIGNALS:
            with self.subTest(number), hostile_server.HostileServer({}) as server:
                with support.Running(
                    "ping", server.url, "--interval", "60s", "--count", "9", "--json"
                ) as running:
                    self.assertIn('"type":"ping"', running.line())
                    running.send_signal(number)
                    finished = running.finish()
                self.assert_ended(finished, status)
                summary = finished.records("summary")
                self.assertEqual([(s["received"], s["exit_status"]) for s in summary], [(1, status)])

    def test_while_a_question_waits(self):
        """Ctrl-C at a question on a terminal: nothing is changed, and the status says why."""
        with support.Running("simulate", "doga-bm") as tool:
            url = tool.line()
            arguments = ["do", url, "select-preset=2", "--profile", "doga-bm", "--accept-unverified"]
            shown, status = support.ask_on_terminal(arguments, b"Go on? [y/N]", b"\x03")
            self.assertEqual(status, 130, shown)
            self.assertIn("\nspindle: interrupted", shown)  # not behind the question
            reading = support.run("get", url, "--profile", "doga-bm", "status.preset", "--json")
            self.assertEqual(reading.records()[0]["value"], 1)

    def test_simulate(self):
        for number, status in SIGNALS:
            with self.subTest(number):
                with support.Running("simulate", "doga-bm", "--listen", "tcp://127.0.0.1:0") as running:
                    self.assertRegex(running.line(), r"^tcp://127\.0\.0\.1:\d+$")
                    running.send_signal(number)
                    finished = running.finish()
                self.assert_ended(finished, status)
                self.assertEqual(finished.stdout, "", finished)
                self.assertRegex(finished.stderr, r"^0 connections, 0 requests\n", finished)

    def test_simulate_with_clients(self):
        with support.Running("simulate", "doga-bm", "--listen", "tcp://127.0.0.1:0", "--json") as running:
            url = support.parse_json(running.line())["endpoint"]
            self.assertEqual(support.run("get", url, TORQUE).status, 0)
            running.send_signal(signal.SIGINT)
            finished = running.finish()
        self.assertEqual(finished.status, 130, finished)
        summary = finished.records("summary")[-1]
        self.assertEqual((summary["connections"], summary["requests"]), (1, 2), finished)


class StreamTest(unittest.TestCase):
    pause = threading.Event()

    def head(self, *arguments):
        """Reads one line and closes the pipe, as head -1 does, while the program still writes."""
        reading, writing = support.small_pipe()
        with support.Running(*arguments, stdout=writing) as running:
            os.close(writing)
            with os.fdopen(reading, "rb") as pipe:
                first = pipe.readline()
            finished = running.finish()
        self.assertTrue(first.endswith(b"\n"))
        self.assertEqual((finished.status, finished.stderr), (0, ""), finished)

    def test_closed_pipe(self):
        with support.simulator() as url:
            for form in ("table", "json", "csv"):
                self.head("get", url, "--profile", "doga-bm", "preset.*", "p[1-4]??", "-o", form)
            self.head("ping", url, "--count", "100000", "--interval", "1ms", "--json")
        for form in ("table", "json", "csv"):
            self.head("list", "--profile", "doga-bm", "p[0-9]*", "-o", form)
        self.head("profile", "show", "doga-bm")

    def test_pipe_that_was_closed_before(self):
        reading, writing = os.pipe()
        os.close(reading)
        with support.Running("list", "--profile", "doga-bm", stdout=writing) as running:
            os.close(writing)
            finished = running.finish()
        self.assertEqual((finished.status, finished.stderr), (0, ""), finished)

    def test_simulate_into_a_closed_pipe(self):
        reading, writing = os.pipe()
        os.close(reading)
        with support.Running("simulate", "doga-bm", stdout=writing) as running:
            os.close(writing)
            finished = running.finish()
        self.assertEqual((finished.status, finished.stderr), (0, ""), finished)

    def check_full(self, *arguments):
        """Runs into a full disk: the sentence names what failed and why, once, and the status is no success."""
        with open("/dev/full", "wb") as full:
            with support.Running(*arguments, stdout=full) as running:
                finished = running.finish()
        self.assertEqual(finished.status, 74, finished)
        sentences = [line for line in finished.said.splitlines() if line.startswith("spindle: ")]
        self.assertEqual(len(sentences), 1, finished)
        self.assertIn("standard output cannot be written: No space left on device check", sentences[0])
        return finished

    def changes(self):
        """What became of all that was begun."""
        log = support.home().path / ".local" / "state" / "spindle" / "changes.jsonl"
        records = [support.parse_json(line) for line in log.read_text().splitlines()] if log.exists() else []
        return [record for record in records if record["result"] != "begun"]

    def test_full_disk_is_no_success(self):
        profile = ("--profile", "doga-bm")
        backup, other = (support.home().path / name for name in ("backup.yaml", "other.yaml"))
        with support.simulator("doga-bm", "--rundown-every", "300ms") as url:
            saved = support.run("backup", url, *profile, "-f", other, "--force")
            self.assertEqual(saved.status, 0, saved)
            self.assertEqual(support.run("set", url, *profile, f"{TORQUE}=2.90").status, 0)
            commands = (
                ["identify", url], ["get", url, *profile, TORQUE], ["ping", url, "-c", "1"], ["list", *profile],
                ["alarms", url, *profile], ["backup", url, *profile, "-f", backup, "--force"],
                ["backup", url, *profile, "-f", "-"], ["diff", other, url], ["watch", url, *profile],
                ["profile", "list"], ["profile", "show", "doga-bm"], ["--version"], ["--help"],
                ["simulate", "doga-bm"],
            )  # fmt: skip
            for arguments in commands:
                for form in ([], ["--json"]):
                    if form and arguments[-1] in ("-", "--help"):
                        continue
                    if not form and arguments[0] == "alarms":
                        continue  # of a tool that is well it has nothing to say on standard output
                    with self.subTest(arguments, form=form):
                        self.check_full(*arguments, *form)

    def test_full_disk_after_a_change(self):
        """What was done is on record, though the reader was gone."""
        profile = ("--profile", "doga-bm")
        with support.simulator() as url:
            for number, form in enumerate(([], ["--json"], ["-o", "csv"])):
                with self.subTest(form):
                    known = len(self.changes())
                    self.check_full("set", url, *profile, f"{TORQUE}=2.8{number}", *form)
                    new = self.changes()[known:]
                    self.assertEqual([(c["name"], str(c["new"]), c["result"]) for c in new],
                                     [(TORQUE, f"2.8{number}", "written")])

    def test_full_disk_while_a_motor_runs(self):
        profile = ("--profile", "orientalmotor-blv")
        with support.simulator("orientalmotor-blv", listen="rtu+tcp://127.0.0.1:0") as url:
            known = len(self.changes())
            run = ("remote-start", url, *profile, "--speed", "500", "--for", "300ms", "--yes")
            for form in ([], ["--json"]):
                with self.subTest(form):
                    self.check_full(*run, *form)
                    found = support.run("identify", url, *profile, "--json").records("identity")
                    self.assertIn("motor stands still", " ".join(found[0]["notes"]))
            starts = [change for change in self.changes()[known:] if change["name"] == "start"]
            self.assertEqual(len(starts), 2, starts)
            self.check_full("remote-stop", url, *profile)

    def limited(self, limit, path, mode, *arguments):
        """Runs spindle with standard output into a file that may only become so large, as on a full disk."""
        with open(path, mode) as output, tempfile.TemporaryFile() as errors:
            status = support.completed(
                [support.binary(), *arguments], stdin=subprocess.DEVNULL, stdout=output, stderr=errors,
                env=support.home().environment(), cwd=support.home().path,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)),
            ).returncode  # fmt: skip
            errors.seek(0)
            return status, errors.read().decode()

    def test_a_record_is_written_whole_or_not_at_all(self):
        names = [f"p{number}" for number in range(300, 340)]
        for form in ("json", "csv"):
            with self.subTest(form), support.simulator() as url:
                command = ("get", url, "--profile", "doga-bm", *names, "-o", form)
                whole = support.run(*command).stdout.encode()
                path = support.home().path / f"out.{form}"
                for mode, before in (("wb", b""), ("ab", b"what was there before\r\n")):
                    path.write_bytes(before)
                    # Somewhere within a line.
                    status, told = self.limited(len(before) + len(whole) // 2 + 7, path, mode, *command)
                    self.assertEqual(status, 74, told)
                    self.assertIn("standard output cannot be written", told)
                    text = path.read_bytes()
                    self.assertTrue(text.startswith(before) and text.endswith(b"\n"), text)
                    lines = text[len(before):].splitlines()
                    self.assertGreater(len(lines), 10)
                    if form == "json":
                        self.assertTrue(all(support.parse_json(line)["name"] for line in lines))
                    else:
                        behind = [line.partition(b",")[2] for line in whole.splitlines()]  # the time
                        self.assertEqual([line.partition(b",")[2] for line in lines], behind[: len(lines)])

    def test_a_line_that_was_cut_off_stays_alone(self):
        with support.simulator() as url:
            for form, cut in (("json", b'{"schema":"spindle/1","type":"va'), ("csv", b"p300,0,")):
                with self.subTest(form):
                    path = support.home().path / f"log.{form}"
                    path.write_bytes(cut)
                    for _ in range(2):
                        status, told = self.limited(1 << 20, path, "ab", "get", url, "p300", "-o", form)
                        self.assertEqual(status, 0, told)
                    lines = path.read_bytes().splitlines()
                    self.assertEqual(lines[0], cut)
                    self.assertEqual(len(lines), 3 if form == "json" else 5)
                    if form == "json":
                        self.assertEqual([support.parse_json(line)["name"] for line in lines[1:]], ["p300"] * 2)
                    else:
                        behind = [line.partition(b",")[2] for line in lines[1:]]  # the time
                        self.assertEqual(behind[:2], behind[2:])

    def test_a_slow_reader_is_waited_for(self):
        """Also where another program made the pipe non-blocking."""
        with support.simulator() as url:
            commands = (
                ("stdout", ["get", url, "--profile", "doga-bm", "p*", "--json"]),
                ("stdout", ["backup", url, "--profile", "doga-bm", "-f", "-"]),
            )
            for stream, arguments in commands:
                with self.subTest(arguments, stream=stream):
                    reading, writing = support.small_pipe()
                    os.set_blocking(writing, False)
                    streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, stream: writing}
                    with subprocess.Popen(
                        [support.binary(), *arguments], stdin=subprocess.DEVNULL, **streams,
                        env=support.home().environment(), cwd=support.home().path,
                    ) as process:  # fmt: skip
                        os.close(writing)
                        # It fills the pipe as far as whole lines fit, and then it waits.
                        support.wait_until(lambda r=reading: waiting_bytes(r) > 0, "something is said")
                        self.pause.wait(0.2)
                        got = b""
                        while chunk := os.read(reading, 1000):
                            got += chunk
                            self.pause.wait(support.POLL)
                        os.close(reading)
                        self.assertEqual(support.wait_for_end(process), 0, got[-300:])
                    self.assertGreater(len(got), 20_000)
                    self.assertTrue(got.endswith(b"\n"))
                    if "--json" in arguments and stream == "stdout":
                        self.assertEqual(len([support.parse_json(line) for line in got.splitlines()]), 225)

    def closed(self, descriptors, *arguments):
        """Runs with descriptors closed, as a daemon's parent may leave them."""
        script = 'exec "$0" "$@" ' + " ".join(f"{number}>&-" for number in descriptors)
        return support.completed(
            ["/bin/sh", "-c", script, support.binary(), *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env=support.home().environment(), cwd=support.home().path,
        )

    def test_closed_standard_input(self):
        with support.simulator() as url:
            finished = self.closed([0], "get", url, TORQUE, "--json")
            self.assertEqual(finished.returncode, 0, finished)
            self.assertEqual(support.parse_json(finished.stdout)["raw"], [271])
            asked = self.closed(
                [0], "do", url, "--profile", "doga-bm", "alarm-reset", "--accept-unverified"
            )
            self.assertEqual(asked.returncode, 2, asked)
            self.assertIn("--yes", asked.stderr)

    def test_closed_standard_error(self):
        with support.simulator() as url, support.Recorder(url) as recorder:
            finished = self.closed([2], "get", recorder.url, TORQUE, "--json", "--verbose")
            self.assertEqual(finished.returncode, 0, finished)
            self.assertEqual(support.parse_json(finished.stdout)["raw"], [271])
            # Nothing but requests went to the tool, though its socket may have taken number 2.
            self.assertEqual(len(recorder.requests), 2, recorder.requests)

    def test_closed_standard_output(self):
        with support.simulator() as url, support.Recorder(url) as recorder:
            self.closed([1], "get", recorder.url, TORQUE, "--json")
            self.assertLessEqual(len(recorder.requests), 2, recorder.requests)


if __name__ == "__main__":
    unittest.main()
