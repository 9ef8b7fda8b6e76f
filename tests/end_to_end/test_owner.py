"""One program holds a tool or a line, and others ask through it: no value is wrong, no event is lost, nothing
is disturbed by an asker, and an owner that ends is told as such."""

import contextlib
import functools
import os
import shutil
import signal
import socket
import struct
import threading
import time
import unittest

import support
from asking import Asker, Folder, Told, is_stopped, threads_of
from blv import Bus
from event_server import ARM_REGISTER, Chance, EventServer
from hostile_server import EVENT_FIRST
from test_remote_start import GO, SLOW, START, Station

PROFILE = ["--profile", "doga-bm"]
BLV = ["--profile", "orientalmotor-blv"]
LONG = os.environ.get("SPINDLE_LONG") == "1"
ASKERS, REQUESTS = (20, 2000) if LONG else (20, 150)
EVENTS, RATE = (5000, 100) if LONG else (400, 200)


class Watching:
    """A watch that owns a tool, with what it told, read as it comes."""

    def __init__(self, folder, *arguments):
        self.running = folder.running(*arguments, "--json")
        self._records = []
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.running.process.poll() is None:
            self.running.process.kill()
        self._thread.join(support.DEADLINE)
        self.running.__exit__()

    @property
    def pid(self):
        return self.running.pid

    def _read(self):
        for line in self.running.process.stdout:
            self._records.append(support.parse_json(line))

    def records(self, kind):
        return [record for record in list(self._records) if record["type"] == kind]

    def numbers(self):
        return [record["number"] for record in self.records("event")]


@contextlib.contextmanager
def owned(server, folder, *options):
    """A watch that has the tool, and can be asked."""
    with Watching(folder, "watch", server.url, *PROFILE, *options) as watching:
        support.wait_until(lambda: server.caught_up, "the watch arms the output")
        support.wait_until(folder.sockets, "the watch can be asked")
        yield watching


class AskingTest(unittest.TestCase):
    def test_other_commands_ask_through_a_watch(self):
        with EventServer() as server, Folder() as folder, owned(server, folder) as watching:
            first = server.number + 1
            connections = len(server._connections)
            server.run(5, 100)
            got = folder.run("get", server.url, *PROFILE, "p2", "@holding:3", "--json")
            self.assertEqual(got.status, 0, got)
            self.assertEqual([record["raw"] for record in got.records("value")], [[271], [1000]])
            # Another spelling of the same place, and no profile.
            named = folder.run("identify", server.url.replace("127.0.0.1", "localhost"), "--json")
            self.assertEqual(named.status, 0, named)
            self.assertEqual(named.records("identity")[0]["serial"], "1021100042")
            written = folder.run("set", server.url, *PROFILE, "p2=272", "--yes", "--json")
            self.assertEqual(written.status, 0, written)
            self.assertEqual(server.tool.holding[2], 272)
            alarms = folder.run("alarms", server.url, *PROFILE, "--json")
            self.assertEqual(alarms.status, 0, alarms)
            server.run(5, 100)
            support.wait_until(lambda: len(watching.numbers()) >= 10, "every event is told")
            self.assertEqual(watching.numbers(), list(range(first, first + 10)))
            self.assertEqual(watching.records("gap"), [])
            self.assertEqual(len(server._connections), connections)
            self.assertTrue(server.armed)

    def test_two_watches_hear_the_same(self):
        with EventServer() as server, Folder() as folder, owned(server, folder) as owner:
            with Watching(folder, "watch", server.url, *PROFILE, "--count", "20") as asker:
                support.wait_until(lambda: asker.records("link"), "the second watch is connected")
                armings = len(server.asked(support.WRITE_SINGLE, ARM_REGISTER))
                support.wait_until(lambda: len(server.asked(support.WRITE_SINGLE, ARM_REGISTER)) > 1 or armings > 1,
                                   "it arms the output, too")
                first = server.number + 1
                server.run(20, 100)
                support.wait_until(lambda: asker.running.process.poll() is not None, "it has counted all")
            support.wait_until(lambda: len(owner.numbers()) >= 20, "the first one told all")
            self.assertEqual(asker.numbers(), list(range(first, first + 20)))
            self.assertEqual(owner.numbers()[-20:], list(range(first, first + 20)))
            # The end of the second one leaves the output armed for the first.
            self.assertEqual(server.asked(support.WRITE_SINGLE, ARM_REGISTER, 0), [])
            server.run(3, 100)
            support.wait_until(lambda: owner.numbers()[-1:] == [server.number], "events still come")
            self.assertEqual(owner.records("gap"), [])

    def test_many_askers_get_right_values_and_cost_no_event(self):
        chance = Chance(seed=4, split=0.3, glue=0.2)
        with EventServer(chance) as server, Folder() as folder, owned(server, folder) as watching:
            first = server.number + 1
            wrong = []

            def ask(number):
                with Asker(folder.sockets()[0]) as asker:
                    for index in range(REQUESTS):
                        register, count = 4 + (37 * number + index) % 500, 1 + index % 20
                        wanted = [server.tool.holding.get(register + at) for at in range(count)]
                        if None in wanted:
                            continue
                        got = asker.read(register, count)
                        if got != wanted:
                            wrong.append((register, got, wanted))

            threads = [threading.Thread(target=ask, args=(number,)) for number in range(ASKERS)]
            for thread in threads:
                thread.start()
            server.run(EVENTS, RATE)
            for thread in threads:
                thread.join()
            self.assertEqual(wrong, [])
            support.wait_until(lambda: watching.numbers()[-1:] == [server.number], "the last event is told",
                               2 * support.DEADLINE)
            self.assertEqual(watching.numbers(), list(range(first, first + EVENTS)))
            self.assertEqual(watching.records("gap"), [])
            self.assertEqual(server.cuts, 0)

    def test_no_thread_more_while_none_asks(self):
        with contextlib.ExitStack() as stack:
            servers = [stack.enter_context(EventServer(serial=1021100042 + index)) for index in range(4)]
            folder = stack.enter_context(Folder())
            urls = [server.url for server in servers]
            watching = stack.enter_context(Watching(folder, "watch", *urls, *PROFILE))
            support.wait_until(lambda: len(folder.sockets()) == 4, "all can be asked")
            alone = threads_of(watching.pid)
            self.assertLessEqual(alone, 4 + 3)  # of the tools; main, what writes, and one that accepts for all
            with Asker(folder.sockets()[0]) as asker:
                asker.read(4, 1)
                self.assertEqual(threads_of(watching.pid), alone + 1)
            support.wait_until(lambda: threads_of(watching.pid) == alone, "the thread of the asker ends")

    def test_an_event_shaped_read_is_no_event_and_gets_its_own_answer(self):
        with EventServer() as server, Folder() as folder, owned(server, folder) as watching:
            with Asker(folder.sockets()[0]) as asker:
                wanted = [server.tool.inputs[3300 + at] for at in range(14)]
                for _ in range(20):
                    server.event()
                    self.assertEqual(asker.read(3300, 14, support.READ_INPUT), wanted)
            support.wait_until(lambda: len(watching.numbers()) == 20, "every event is told")
            self.assertEqual(watching.records("gap"), [])


class TroubleTest(unittest.TestCase):
    def test_an_asker_that_is_killed_disturbs_none(self):
        with EventServer() as server, Folder() as folder, owned(server, folder) as watching:
            for _ in range(5):
                asker = Asker(folder.sockets()[0])
                asker.send(support.READ_HOLDING, struct.pack(">HH", 4, 100))
                asker.socket.close()
            with folder.running("ping", server.url, *PROFILE, "-c", "1000", "--json") as ping:
                support.wait_until(lambda: ping.line(), "the ping runs")
                ping.process.kill()
            first = server.number + 1
            server.run(5, 100)
            support.wait_until(lambda: len(watching.numbers()) == 5, "events are told as before")
            self.assertEqual(watching.numbers(), list(range(first, first + 5)))
            self.assertEqual(folder.run("get", server.url, *PROFILE, "p2").status, 0)

    def test_no_answer_is_told_as_if_it_was_asked_directly(self):
        with EventServer() as server, Folder() as folder:
            def silent(request, store):
                if request.words == (5000, 1):
                    return None
                return type(server.tool).answer(server.tool, request, store)

            server.tool.answer = silent
            answer = server._answer

            def unless_silent(client, request):
                if request.words != (5000, 1):
                    answer(client, request)

            server._answer = unless_silent
            arguments = ["get", server.url, *PROFILE, "@holding:5000", "--timeout", "200ms", "--retries", "1"]
            direct = folder.run(*arguments)
            self.assertEqual(direct.status, 5, direct)
            with owned(server, folder):
                asked = folder.run(*arguments)
                self.assertEqual((asked.status, asked.stderr), (direct.status, direct.stderr), asked)

    def test_waiting_for_a_turn_is_no_timeout(self):
        with EventServer() as server, Folder() as folder:
            answer = server._answer

            def slowly(client, request):
                if request.words == (5000, 1):
                    time.sleep(0.2)
                answer(client, request)

            server._answer = slowly
            with owned(server, folder):
                arguments = ["get", server.url, *PROFILE, "@holding:5000", "--timeout", "500ms", "--retries", "0"]
                with contextlib.ExitStack() as stack:
                    askers = [stack.enter_context(folder.running(*arguments)) for _ in range(8)]
                    for asker in askers:
                        finished = asker.finish()
                        self.assertEqual(finished.status, 0, finished)

    def test_an_owner_that_is_killed_is_told_and_leaves_nothing_in_the_way(self):
        with EventServer() as server, Folder() as folder:
            with owned(server, folder) as watching:
                with Asker(folder.sockets()[0]) as asker:
                    asker.read(4, 1)
                    os.kill(watching.pid, signal.SIGKILL)
                    with self.assertRaises((EOFError, OSError)):
                        asker.read(4, 1)
                        asker.read(4, 1)
            self.assertEqual(len(folder.sockets()), 1)  # it could not be removed
            direct = folder.run("get", server.url, *PROFILE, "p2")
            self.assertEqual(direct.status, 0, direct)
            with owned(server, folder):
                with Asker(folder.sockets()[0]) as asker:
                    self.assertEqual(asker.read(2, 1), [271])

    @contextlib.contextmanager
    def mute_owner(self, verb, *arguments):
        """An asker that waits for the answer to a read of register 2, the owner, and what ends the silence."""
        with EventServer() as server, Folder() as folder:
            answer, silent = server._answer, threading.Event()
            silent.set()

            def unless_silent(client, request):
                if silent.is_set() and request.function == support.READ_HOLDING and request.words[0] == 2:
                    server.requests.append((time.monotonic(), request))
                else:
                    answer(client, request)

            server._answer = unless_silent
            with owned(server, folder) as watching:
                with folder.running(verb, server.url, *PROFILE, *arguments, "--timeout", "30s") as asker:
                    reads = functools.partial(server.asked, support.READ_HOLDING, 2)
                    support.wait_until(reads, "it is asked")
                    yield asker, watching, silent

    def test_a_waiting_asker_is_told_who_ended(self):
        with self.mute_owner("watch", "@holding:2", "--no-push", "--no-reconnect") as (asker, watching, _):
            os.kill(watching.pid, signal.SIGKILL)
            finished = asker.finish()
            self.assertEqual(finished.status, 5, finished)
            self.assertIn(f"the spindle that has the line ended (process {watching.pid})", finished.said)

    def test_a_read_goes_on_directly(self):
        with self.mute_owner("get", "@holding:2", "--json") as (asker, watching, silent):
            silent.clear()
            os.kill(watching.pid, signal.SIGKILL)
            finished = asker.finish()
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual(finished.records("value")[0]["raw"], [271])

    def test_an_orderly_end_leaves_no_socket_and_a_disarmed_tool(self):
        with EventServer() as server, Folder() as folder:
            with owned(server, folder) as watching, Asker(folder.sockets()[0]) as asker:
                asker.read(4, 1)
                watching.running.process.send_signal(signal.SIGTERM)
                self.assertEqual(support.wait_for_end(watching.running.process), 143)
                self.assertEqual(folder.sockets(), [])
                self.assertEqual(len(server.asked(support.WRITE_SINGLE, ARM_REGISTER, 0)), 1)

    def test_an_owner_that_is_stopped_keeps_none_waiting(self):
        with EventServer() as server, Folder() as folder, owned(server, folder) as watching:
            os.kill(watching.pid, signal.SIGSTOP)
            support.wait_until(lambda: is_stopped(watching.pid), "the owner is stopped")
            finished = folder.run("get", server.url, *PROFILE, "p2")
            self.assertEqual(finished.status, 0, finished)  # directly
            os.kill(watching.pid, signal.SIGCONT)

    def test_a_lost_link_is_told_soon(self):
        with EventServer() as server, Folder() as folder, owned(server, folder):
            url = server.url
            server._listening.shutdown(socket.SHUT_RDWR)
            server.cut()
            finished = support.quickest(lambda: folder.run("get", url, *PROFILE, "p2", "--connect-timeout", "20s"),
                                        support.SOON)
            self.assertIn(finished.status, (4, 5), finished)
            self.assertIn("has no link to the tool", finished.said)

    def test_a_folder_that_others_can_write_is_not_used(self):
        with EventServer() as server, Folder(mode=0o777) as folder:
            # The user's own folder elsewhere is used instead, as ever.
            with Watching(folder, "watch", server.url, *PROFILE):
                support.wait_until(lambda: server.caught_up, "the watch arms the output")
                self.assertEqual(folder.sockets(), [])
        with EventServer() as server, Folder() as folder, owned(server, folder):
            folder.path.joinpath("spindle").chmod(0o777)
            connections = len(server._connections)
            self.assertEqual(folder.run("get", server.url, *PROFILE, "p2").status, 0)
            self.assertEqual(len(server._connections), connections + 1)  # directly
            folder.path.joinpath("spindle").chmod(0o700)

    def test_only_the_user_can_connect(self):
        with EventServer() as server, Folder() as folder, owned(server, folder):
            self.assertEqual(folder.sockets()[0].stat().st_mode & 0o777, 0o600)
            self.assertEqual(folder.path.joinpath("spindle").stat().st_mode & 0o777, 0o700)


class SerialTest(unittest.TestCase):
    def test_units_of_a_line_are_asked_through_its_owner(self):
        for where in ("--pty", "rtu+tcp://127.0.0.1:0"):
            with self.subTest(where), Bus(where=where) as bus, Folder() as folder:
                with Watching(folder, "watch", bus.unit(1), *BLV) as watching:
                    support.wait_until(folder.sockets, "the line can be asked")
                    for unit in (1, 2):
                        direct = folder.run("get", bus.unit(unit), *BLV, "operation.2.speed", "--json")
                        self.assertEqual(direct.status, 0, direct)
                    set_two = folder.run("set", bus.unit(2), *BLV, "operation.2.speed=300", "--yes", "--json")
                    self.assertEqual(set_two.status, 0, set_two)
                    missing = folder.run("get", bus.unit(9), *BLV, "operation.2.speed", "--timeout", "100ms")
                    self.assertEqual(missing.status, 5, missing)
                    self.assertIsNone(watching.running.process.poll())

    def test_a_motor_is_stopped_through_the_program_that_runs_it(self):
        for where in ("--pty", "rtu+tcp://127.0.0.1:0"):
            with self.subTest(where), Bus(where=where) as bus, Folder() as folder:
                start = ["remote-start", bus.unit(1), *BLV, "--speed", "500", "--yes", "--accept-unverified", "--json"]
                with folder.running(*start) as run:
                    support.wait_until(bus.has_started, "the motor is started")
                    values = folder.run("get", bus.unit(1), *BLV, "operation.2.speed", "--json")
                    self.assertEqual(values.status, 0, values)
                    stopped = folder.run("remote-stop", bus.unit(1), *BLV, "--json")
                    self.assertEqual(stopped.status, 0, stopped)
                    self.assertEqual(stopped.records("action")[0]["result"], "confirmed", stopped)
                    finished = run.finish()
                self.assertEqual(finished.status, 1, finished)
                self.assertIn("not by this program", finished.said)


class StopTest(unittest.TestCase):
    def test_a_tool_is_stopped_through_the_program_that_runs_it(self):
        with Station(**SLOW) as station, Folder() as folder:
            with folder.running("remote-start", station.url, *GO, "--json") as run:
                support.wait_until(station.has_started, "the tool runs")
                connections = len(station._connections)
                shown = folder.run("get", station.url, *PROFILE, "p2")
                self.assertEqual(shown.status, 0, shown)
                stopped = folder.run("remote-stop", station.url, *PROFILE, "--json")
                self.assertEqual(stopped.status, 0, stopped)
                self.assertFalse(station.tool.running)
                self.assertEqual(len(station._connections), connections)
                run.finish()

    def test_a_stop_does_not_wait_for_an_owner_that_is_stopped(self):
        with Station(**SLOW) as station, Folder() as folder:
            with folder.running("remote-start", station.url, *GO, "--json") as run:
                support.wait_until(station.has_started, "the tool runs")
                run.process.send_signal(signal.SIGSTOP)
                support.wait_until(lambda: is_stopped(run.pid), "the owner is stopped")
                stopped = folder.run("remote-stop", station.url, *PROFILE, "--json")
                self.assertEqual(stopped.status, 0, stopped)
                self.assertFalse(station.tool.running)
                run.process.send_signal(signal.SIGCONT)
                run.finish()

    def test_the_guardian_stops_what_an_owner_with_askers_left(self):
        with Station(**SLOW) as station, Folder() as folder:
            with folder.running("remote-start", station.url, *GO, "--json") as run:
                support.wait_until(station.has_started, "the tool runs")
                with Asker(folder.sockets()[0]) as asker:
                    asker.read(4, 1)
                    os.kill(run.pid, signal.SIGKILL)
                    support.wait_until(lambda: not station.tool.running, "the guardian stops the tool")
            self.assertEqual(station.writes(START).count(1), 1)

    def test_its_own_stop_goes_before_askers(self):
        with Station(**SLOW) as station, Folder() as folder:
            with folder.running("remote-start", station.url, *GO, "--json") as run, contextlib.ExitStack() as stack:
                support.wait_until(station.has_started, "the tool runs")
                for _ in range(10):
                    asker = stack.enter_context(Asker(folder.sockets()[0]))
                    for _ in range(50):
                        asker.send(support.READ_HOLDING, struct.pack(">HH", 4, 100))
                run.process.send_signal(signal.SIGINT)
                finished = run.finish()
            self.assertEqual(finished.status, 130, finished)
            self.assertFalse(station.tool.running)


class HoldingTest(unittest.TestCase):
    def test_serve_holds_a_tool_and_asks_nothing_of_it_but_what_keeps_it(self):
        with EventServer() as server, Folder() as folder, folder.running("serve", server.url, *PROFILE) as serving:
            support.wait_until(folder.sockets, "the tool can be asked")
            got = folder.run("get", server.url, *PROFILE, "p2", "--json")
            self.assertEqual(got.records("value")[0]["raw"], [271], got)
            self.assertEqual(server.asked(support.WRITE_SINGLE), [])
            server.cut()
            support.wait_until(lambda: folder.run("get", server.url, *PROFILE, "p2").status == 0,
                               "it is connected again")
            serving.process.send_signal(signal.SIGTERM)
            finished = serving.finish()
            self.assertEqual((finished.status, finished.stdout), (0, ""), finished)

    def test_events_reach_a_watch_that_asks_through_it(self):
        with EventServer() as server, Folder() as folder, folder.running("serve", server.url, *PROFILE):
            support.wait_until(folder.sockets, "the tool can be asked")
            with Watching(folder, "watch", server.url, *PROFILE) as watching:
                support.wait_until(lambda: server.caught_up, "the watch arms the output")
                first = server.number + 1
                server.run(20, 100)
                support.wait_until(lambda: len(watching.numbers()) >= 20, "every event is told")
                self.assertEqual(watching.numbers(), list(range(first, first + 20)))


class GatewayTest(unittest.TestCase):
    @contextlib.contextmanager
    def gateway(self, server, *options):
        with Folder() as folder, folder.running("serve", server.url, *PROFILE, "--listen", "0", *options) as serving:
            told = Told(serving)
            port = told.port()
            support.wait_until(folder.sockets, "the tool is connected")
            yield port

    def test_reads_pass_and_writes_do_not(self):
        with EventServer() as server, self.gateway(server) as port, Asker(port) as asker:
            self.assertEqual(asker.read(2, 2), [271, 1000])
            self.assertEqual(asker.ask(support.REPORT_SERVER_ID, b"")[0], support.REPORT_SERVER_ID)
            self.assertEqual(asker.write(2, 272), (support.WRITE_SINGLE | 0x80, b"\x01"))
            self.assertEqual(asker.ask(0x08, struct.pack(">HH", 1, 0)), (0x88, b"\x01"))
            self.assertEqual(server.tool.holding[2], 271)
            self.assertEqual(server.asked(support.WRITE_SINGLE), [])

    def test_writes_pass_where_they_are_allowed(self):
        with EventServer() as server, self.gateway(server, "--allow-write") as port, Asker(port) as asker:
            self.assertEqual(asker.write(2, 272)[0], support.WRITE_SINGLE)
            self.assertEqual(asker.read(2, 1), [272])
            self.assertEqual(server.tool.holding[2], 272)

    def test_what_is_no_modbus_is_hung_up_on_and_disturbs_none(self):
        with EventServer() as server, self.gateway(server) as port, Asker(port) as good:
            for bad in (b"GET / HTTP/1.1\r\n\r\n", bytes.fromhex("0001 0001 0006 01 03 0004 0001"),
                        bytes.fromhex("0001 0000 ffff 01 03")):
                with Asker(port) as asker:
                    asker.socket.sendall(bad)
                    self.assertEqual(asker.socket.recv(100), b"", bad)
                self.assertEqual(good.read(2, 1), [271])
            with Asker(port) as slow:
                slow.socket.sendall(bytes.fromhex("0001 0000 0006 01"))
                self.assertEqual(good.read(2, 1), [271])
                slow.socket.sendall(bytes.fromhex("03 0002 0001"))
                slow._id = 1
                self.assertEqual(slow.receive(), (3, struct.pack(">BH", 2, 271)))

    def test_at_most_so_many_clients(self):
        with EventServer() as server, self.gateway(server) as port, contextlib.ExitStack() as stack:
            askers = [stack.enter_context(Asker(port)) for _ in range(64)]
            for asker in askers:
                self.assertEqual(asker.read(2, 1), [271])
            with Asker(port) as one_too_many:
                with contextlib.suppress(OSError):
                    one_too_many.send(support.READ_HOLDING, struct.pack(">HH", 2, 1))
                    self.assertEqual(one_too_many.socket.recv(100), b"")
            self.assertEqual(askers[0].read(2, 1), [271])

    def test_a_lost_link_and_a_silent_tool_are_told_apart(self):
        with EventServer() as server, self.gateway(server) as port, Asker(port) as asker:
            self.assertEqual(asker.read(2, 1), [271])
            answer = server._answer
            server._answer = lambda client, request: None
            self.assertEqual(asker.ask(support.READ_HOLDING, struct.pack(">HH", 2, 1)), (0x83, b"\x0b"))
            server._answer = answer
            server._listening.shutdown(socket.SHUT_RDWR)
            server.cut()
            support.wait_until(
                lambda: asker.ask(support.READ_HOLDING, struct.pack(">HH", 2, 1)) == (0x83, b"\x0a"), "the link is lost")

    def test_other_programs(self):
        with EventServer() as server, self.gateway(server) as port:
            if shutil.which("mbpoll"):
                polled = support.completed(["mbpoll", "-m", "tcp", "-p", str(port), "-0", "-r", "2", "-c", "2", "-1",
                                            "-t", "4", "127.0.0.1"], capture_output=True, text=True)
                self.assertEqual(polled.returncode, 0, polled)
                self.assertIn("271", polled.stdout)
                self.assertIn("1000", polled.stdout)
            try:
                from pymodbus.client import ModbusTcpClient
            except ImportError:
                try:
                    from pymodbus.client.sync import ModbusTcpClient
                except ImportError:
                    self.skipTest("pymodbus is not there")
            client = ModbusTcpClient("127.0.0.1", port=port)
            self.assertTrue(client.connect())
            try:
                server.event()
                answer = client.read_holding_registers(2, 2, slave=1)
                self.assertEqual(answer.registers, [271, 1000])
                self.assertTrue(client.write_register(2, 272, slave=1).isError())
            finally:
                client.close()

    def test_units_pass_through(self):
        with Bus() as bus, Folder() as folder:
            with folder.running("serve", bus.unit(1), *BLV, "--listen", "127.0.0.1:0") as serving:
                port = Told(serving).port()
                support.wait_until(folder.sockets, "the line is open")
                with Asker(port) as asker:
                    for unit in (1, 2, 3):
                        asker.read(0x0480, 2, unit=unit)
                    self.assertEqual(asker.ask(support.READ_HOLDING, struct.pack(">HH", 0x0480, 2), 9)[1], b"\x0b")
                    self.assertEqual(asker.write(125, 0)[1], b"\x01")
                serving.process.send_signal(signal.SIGTERM)
                serving.process.wait()
            self.assertEqual(bus.writes(), [])

    def test_what_can_not_be_listened_on_is_said(self):
        with EventServer() as one, EventServer() as two, Folder() as folder:
            several = folder.run("serve", one.url, two.url, *PROFILE, "--listen", "0")
            self.assertEqual(several.status, 2, several)
            self.assertIn("2 lines", several.said)
            for text in ("x", "127.0.0.1", "1:2:3", "70000", ":"):
                wrong = folder.run("serve", one.url, *PROFILE, "--listen", text)
                self.assertEqual(wrong.status, 2, wrong)


if __name__ == "__main__":
    unittest.main()
