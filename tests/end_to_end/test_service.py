"""record as a service: what its manager is told, how it follows its tools file, and how it ends.

The service manager is a datagram socket, as sd_notify(3) describes it; the tools are servers that count who
connects to them.
"""

import contextlib
import os
import pathlib
import re
import resource
import select
import signal
import socket
import sqlite3
import subprocess
import tempfile
import threading
import time
import unittest

import prometheus_text
import support
from event_server import ARM_REGISTER, EventServer
from gateway_server import Gateway

PERIOD = 0.4  # seconds that the manager waits for a sign of life
PROFILE = "doga-bm"
ARM, DISARM = (ARM_REGISTER, 1), (ARM_REGISTER, 0)


class CountedServer(EventServer):
    """An EventServer that knows how often a client connected, and whether one is there."""

    def __init__(self, **how):
        super().__init__(**how)
        self.met = 0
        self.present = 0

    def _meet(self, client):
        self.met += 1
        super()._meet(client)

    def _serve(self, client):
        self.present += 1
        super()._serve(client)
        self.present -= 1

    @property
    def disarmed(self):
        return len(self.asked(support.WRITE_SINGLE, *DISARM))


class Manager:
    """The end of sd_notify that a service manager has."""

    def __init__(self, address):
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(address)
        self._ending = threading.Event()
        self.messages = []
        self._thread = threading.Thread(target=self._read, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ending.set()
        self._thread.join()
        self._socket.close()

    def _read(self):
        while not self._ending.is_set():
            if select.select([self._socket], [], [], 0.02)[0]:
                self.messages.append(self._socket.recv(4096).decode())

    def count(self, message):
        return list(self.messages).count(message)

    def said(self, pattern):
        return [message for message in list(self.messages) if re.search(pattern, message)]

    def without(self, *patterns):
        return [message for message in list(self.messages) if not any(re.match(each, message) for each in patterns)]


class Service:
    """A recorder under a manager. Its standard error is kept as it comes."""

    def __init__(self, *arguments, environment=None, journal=False):
        reading, writing = os.pipe()
        own = dict(environment or {})
        if journal:
            about = os.fstat(writing)
            own["JOURNAL_STREAM"] = f"{about.st_dev}:{about.st_ino}"
        self.process = subprocess.Popen(
            [support.binary(), "record", *(str(argument) for argument in arguments)], stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=writing, cwd=support.home().path,
            env=support.home().environment(**own))
        os.close(writing)
        self._stream = os.fdopen(reading, "rb")
        self.told = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._stream:
            self.told.append(line.decode().rstrip("\n"))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        support.wait_for_end(self.process)
        self._reader.join(support.DEADLINE)
        self._stream.close()

    @property
    def pid(self):
        return self.process.pid

    def says(self, words):
        return [line for line in list(self.told) if words in line]

    def wait_for(self, words, times=1):
        support.wait_until(lambda: len(self.says(words)) >= times, f"{words!r} in {self.told}")

    def send(self, number):
        self.process.send_signal(number)

    def end(self, number=signal.SIGTERM):
        self.send(number)
        status = support.wait_for_end(self.process)
        self._reader.join(support.DEADLINE)
        return status


class ServiceTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.store = self.folder / "events.db"
        self.tools_file = self.folder / "tools.yaml"

    def write_tools(self, tools, groups=""):
        """{name: url} or {name: (url, more keys)}; an editor that writes a file makes it anew."""
        lines = ["tools:"]
        for name, entry in tools.items():
            url, more = entry if isinstance(entry, tuple) else (entry, "")
            profile = "" if "profile" in more else f", profile: {PROFILE}"
            lines.append(f"  {name}: {{url: \"{url}\"{profile}{more}}}")
        text = "\n".join(lines) + "\n" + groups
        made = self.folder / "tools.new"
        made.write_text(text)
        made.replace(self.tools_file)

    def service(self, *arguments, **how):
        return Service(*arguments, "--store", self.store, "--tools", self.tools_file, **how)

    def numbers(self, serial):
        with contextlib.closing(sqlite3.connect(f"file:{self.store}?mode=ro", uri=True)) as store:
            return [number for number, in store.execute(
                "SELECT number FROM event JOIN tool ON tool.id = event.tool WHERE serial = ? ORDER BY event.id",
                (str(serial),))]

    def wait_until_stored(self, number, serial):
        def is_stored():
            with contextlib.suppress(sqlite3.OperationalError):
                return number in self.numbers(serial)

        support.wait_until(is_stored, f"{number} of {serial} is stored")


class NotifyTest(ServiceTest):
    def manager(self):
        return Manager(str(self.folder / "notify"))

    def environment(self, period=PERIOD, **more):
        return {"NOTIFY_SOCKET": str(self.folder / "notify"), "WATCHDOG_USEC": str(int(period * 1e6)), **more}

    def test_what_the_manager_is_told_from_start_to_end(self):
        with self.manager() as manager, CountedServer() as tool, support.refusing_port() as deaf:
            self.write_tools({"station1": tool.url, "station2": deaf})
            with self.service(environment=self.environment()) as service:
                support.wait_until(lambda: manager.count("READY=1"), "it is ready")
                service.wait_for("station2: no link")
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                tool.event()
                support.wait_until(lambda: manager.said("^STATUS=1 of 2 connected, 1 result, backlog 0$"),
                                   "its status is told")
                support.wait_until(lambda: manager.count("WATCHDOG=1") > 3, "it lives")
                before = time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000
                service.send(signal.SIGHUP)
                support.wait_until(lambda: manager.count("READY=1") == 2, "it is ready again")
                after = time.clock_gettime_ns(time.CLOCK_MONOTONIC) // 1000
                self.assertEqual(service.end(), 0, service.told)
            story = manager.without("STATUS=", "WATCHDOG=1$")
        self.assertEqual([message.split("\n")[0] for message in story],
                         ["READY=1", "RELOADING=1", "READY=1", "STOPPING=1"])
        stamp = int(re.fullmatch(r"RELOADING=1\nMONOTONIC_USEC=(\d+)", story[1])[1])
        self.assertTrue(before <= stamp <= after, (before, stamp, after))

    def test_it_is_ready_when_all_were_tried_and_not_before(self):
        with self.manager() as manager, support.full_backlog() as (silent, is_waiting):
            self.write_tools({"station1": silent})
            with self.service("--connect-timeout", "2s", environment=self.environment()) as service:
                support.wait_until(is_waiting, "it connects")
                self.assertEqual(manager.count("READY=1"), 0)
                support.wait_until(lambda: manager.count("READY=1"), "the attempt came to nothing")
                service.wait_for("station1: no link")
                support.wait_until(lambda: manager.said("^STATUS=0 of 1 connected, 0 results, backlog 0$"),
                                   "its status is told")
                self.assertEqual(service.end(), 0)

    def test_a_name_of_the_abstract_namespace(self):
        name = f"spindle-test-{os.getpid()}"
        with Manager(f"\0{name}") as manager, CountedServer() as tool:
            self.write_tools({"station1": tool.url})
            with self.service(environment={"NOTIFY_SOCKET": f"@{name}"}) as service:
                support.wait_until(lambda: manager.count("READY=1"), "it is ready")
                service.end()
            self.assertEqual(manager.count("WATCHDOG=1"), 0, "none was asked for")

    def test_the_watchdog_of_another_process(self):
        with self.manager() as manager, CountedServer() as tool:
            self.write_tools({"station1": tool.url})
            with self.service(environment=self.environment(WATCHDOG_PID="1")) as service:
                support.wait_until(lambda: manager.count("READY=1"), "it is ready")
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                tool.event()
                self.wait_until_stored(1962, 1021100042)
                service.end()
            self.assertEqual(manager.count("WATCHDOG=1"), 0)

    def test_commits_that_hang_feed_nothing(self):
        with self.manager() as manager, CountedServer() as tool:
            self.write_tools({"station1": tool.url})
            with self.service(environment=self.environment()) as service:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                self.wait_until_stored(1961, 1021100042)
                with contextlib.closing(sqlite3.connect(self.store, isolation_level=None)) as other:
                    other.execute("BEGIN IMMEDIATE")  # another program keeps the store locked
                    tool.event()
                    self.assert_unfed(manager)
                    self.assertEqual(manager.said("^WATCHDOG_USEC="), [], "it hangs, and nothing failed")
                    other.execute("ROLLBACK")
                self.wait_until_stored(1962, 1021100042)
                fed = manager.count("WATCHDOG=1")
                support.wait_until(lambda: manager.count("WATCHDOG=1") > fed, "it is fed again")
                self.assertEqual(service.end(), 0, service.told)

    def test_commits_that_fail_feed_nothing_and_what_waits_is_kept(self):
        with self.manager() as manager, CountedServer() as tool:
            self.write_tools({"station1": tool.url})
            with self.service(environment=self.environment()) as service:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                self.wait_until_stored(1961, 1021100042)
                resource.prlimit(service.pid, resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
                for _ in range(20):
                    tool.event()
                # A restart would lose what waits in memory, so the manager is asked for patience.
                support.wait_until(lambda: manager.said("^WATCHDOG_USEC=3600000000$"), "it asks for time")
                self.assert_unfed(manager)
                resource.prlimit(service.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
                self.wait_until_stored(1981, 1021100042)
                support.wait_until(lambda: manager.said(f"^WATCHDOG_USEC={int(PERIOD * 1e6)}$"), "it is as before")
                fed = manager.count("WATCHDOG=1")
                support.wait_until(lambda: manager.count("WATCHDOG=1") > fed, "it is fed again")
                self.assertEqual(service.end(), 0, service.told)
        self.assertEqual(self.numbers(1021100042), list(range(1961, 1982)))

    def assert_unfed(self, manager):
        """One sign of life may have been on its way."""
        time.sleep(PERIOD)
        fed = manager.count("WATCHDOG=1")
        time.sleep(4 * PERIOD)
        self.assertEqual(manager.count("WATCHDOG=1"), fed)


class ReloadTest(ServiceTest):
    def setUp(self):
        super().setUp()
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        self.a, self.b, self.c = (self.stack.enter_context(CountedServer(serial=serial)) for serial in (11, 22, 33))

    def reload(self, service, words="looked up again"):
        told = len(service.says(words))
        service.send(signal.SIGHUP)
        service.wait_for(words, told + 1)

    def listens(self, *tools):
        for tool in tools:
            support.wait_until(lambda tool=tool: tool.caught_up, "the recorder listens")

    def assert_untouched(self, *tools):
        for tool in tools:
            self.assertEqual((tool.met, tool.present, tool.disarmed), (1, 1, 0))

    def test_a_faulty_file_changes_nothing_and_says_so(self):
        self.write_tools({"a": self.a.url, "b": self.b.url})
        with self.service() as service:
            self.listens(self.a, self.b)
            faulty = ("tools: [", "tools:\n  a: {address: 1}\n", "tools: {}\n", "tools:\n  a: {url: \"ftp://x\"}\n",
                      "tools:\n  a: {url: \"tcp://x\", profile: no-such}\n", None)
            for text in faulty:
                with self.subTest(text):
                    if text is None:
                        self.tools_file.unlink()
                    else:
                        self.tools_file.write_text(text)
                    self.reload(service, "the tools are recorded as before")
            self.assert_untouched(self.a, self.b)
            self.a.event()
            self.wait_until_stored(1962, 11)
            self.assertEqual(service.end(), 0, service.told)

    def test_tools_are_added_and_the_others_not_touched(self):
        self.write_tools({"a": self.a.url})
        with self.service() as service:
            self.listens(self.a)
            self.write_tools({"a": self.a.url, "b": self.b.url, "c": self.c.url})
            self.reload(service)
            self.assertIn("2 added, 1 as before", service.says("looked up again")[-1])
            self.listens(self.b, self.c)
            for tool in (self.a, self.b, self.c):
                tool.event()
            for serial in (11, 22, 33):
                self.wait_until_stored(1962, serial)
            self.assert_untouched(self.a, self.b, self.c)
            self.assertEqual(service.end(), 0, service.told)
        self.assertEqual([tool.disarmed for tool in (self.a, self.b, self.c)], [1, 1, 1])

    def test_tools_that_are_removed_are_disarmed_and_left(self):
        self.write_tools({"a": self.a.url, "b": self.b.url})
        with self.service() as service:
            self.listens(self.a, self.b)
            self.b.event()
            self.wait_until_stored(1962, 22)
            self.write_tools({"a": self.a.url})
            self.reload(service)
            support.wait_until(lambda: self.b.present == 0, "it is left")
            self.assertEqual((self.b.met, self.b.disarmed), (1, 1))
            self.assert_untouched(self.a)
            # The same tool comes back, and goes on behind its last event.
            self.b.event()
            self.b.event()
            self.write_tools({"a": self.a.url, "b": self.b.url})
            self.reload(service)
            self.listens(self.b)
            self.wait_until_stored(1964, 22)
            self.assertEqual(service.end(), 0, service.told)
        self.assertEqual(self.numbers(22), [1961, 1962, 1964])
        with contextlib.closing(sqlite3.connect(self.store)) as store:
            self.assertEqual(store.execute("SELECT after, before, missed FROM gap").fetchall(), [(1962, 1964, 1)])
            links = store.execute("SELECT json FROM happening WHERE type = 'link' ORDER BY id").fetchall()
        self.assertEqual(sum("not recorded here any more" in json for json, in links), 1)

    def test_tools_whose_entry_changed_are_left_and_begun(self):
        self.write_tools({"a": self.a.url, "b": self.b.url})
        with self.service() as service:
            self.listens(self.a, self.b)
            self.write_tools({"a": (self.a.url, ", timeout: 3s"), "b": self.b.url})
            self.reload(service)
            self.assertIn("1 changed, 1 as before", service.says("looked up again")[-1])
            support.wait_until(lambda: self.a.met == 2, "it is connected anew")
            self.assertEqual(self.a.disarmed, 1)
            self.listens(self.a)
            self.a.event()
            self.wait_until_stored(1962, 11)
            self.assert_untouched(self.b)
            self.assertEqual(service.end(), 0, service.told)
        self.assertEqual(self.numbers(11), [1961, 1962])

    def test_a_tool_that_gets_another_name_stays_the_same_tool(self):
        self.write_tools({"a": self.a.url})
        with self.service() as service:
            self.listens(self.a)
            self.write_tools({"renamed": self.a.url})
            self.reload(service)
            support.wait_until(lambda: self.a.met == 2, "it is connected anew")
            self.listens(self.a)
            self.a.event()
            self.wait_until_stored(1962, 11)
            self.assertEqual(service.end(), 0, service.told)
        with contextlib.closing(sqlite3.connect(self.store)) as store:
            self.assertEqual(store.execute("SELECT serial FROM tool").fetchall(), [("11",)])
            self.assertEqual(store.execute("SELECT name FROM place ORDER BY id").fetchall(), [("a",), ("renamed",)])

    def test_named_targets_are_looked_up_again(self):
        self.write_tools({"a": self.a.url, "b": self.b.url, "c": self.c.url}, "groups: {line: [a, b]}\n")
        with self.service("@line") as service:
            self.listens(self.a, self.b)
            self.write_tools({"a": self.a.url, "b": self.b.url, "c": self.c.url}, "groups: {line: [b, c]}\n")
            self.reload(service)
            self.listens(self.c)
            support.wait_until(lambda: self.a.present == 0, "it is left")
            self.assert_untouched(self.b, self.c)
            self.assertEqual(service.end(), 0, service.told)

    def test_units_of_a_gateway_come_and_go_on_one_connection(self):
        profile = self.folder / "meter.yaml"
        profile.write_text(
            "format: 1\nid: meter\ntitle: \"A meter\"\nmaker: made up\nseries: meter\nevidence: manual\n"
            "source: \"made up\"\naccess: r\nnumbering: modicon\nlink: {framing: tcp}\n"
            "parameters:\n  - {name: level, register: 40005, encoding: u16, title: \"Level\"}\nwatch: [level]\n")
        with Gateway() as gateway:
            def entry(unit):
                return gateway.url_of(unit), f", profile: {profile}"

            self.write_tools({"one": entry(1), "a": self.a.url})
            with self.service() as service:
                self.listens(self.a)
                support.wait_until(lambda: gateway.units_asked().count(1) > 2, "one unit is polled")
                self.write_tools({"one": entry(1), "two": entry(2), "a": self.a.url})
                self.reload(service)
                support.wait_until(lambda: gateway.units_asked().count(2) > 2, "another unit is polled, too")
                self.write_tools({"two": entry(2), "a": self.a.url})
                self.reload(service)
                asked = len(gateway.requests)
                support.wait_until(lambda: set(gateway.units_asked()[asked:][-9:]) == {2}, "one is left")
                self.assertEqual((gateway.met, gateway.beside, gateway.overlaps), (1, 0, 0))
                self.assert_untouched(self.a)
                self.assertEqual(service.end(), 0, service.told)


class EndTest(ServiceTest):
    def test_a_wish_to_end_leaves_tools_disarmed(self):
        with CountedServer() as tool:
            self.write_tools({"station1": tool.url})
            with self.service() as service:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                for _ in range(5):
                    tool.event()
                began = support.paced()
                self.assertEqual(service.end(), 0, service.told)
                self.assertLess(support.paced() - began, support.DEADLINE)
            self.assertEqual(tool.disarmed, 1)
            self.assertFalse(tool.armed)
        self.assertEqual(self.numbers(1021100042), list(range(1961, 1967)))

    def test_signals_for_other_programs_change_nothing(self):
        with CountedServer() as tool:
            self.write_tools({"station1": tool.url})
            with self.service() as service:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                for number in (signal.SIGUSR1, signal.SIGUSR2):
                    service.send(number)
                tool.event()
                self.wait_until_stored(1962, 1021100042)
                self.assertEqual((tool.met, tool.disarmed), (1, 0))
                self.assertEqual(service.end(), 0, service.told)
            with support.Running("watch", tool.url, "--profile", PROFILE, "--json") as watching:
                support.wait_until(lambda: tool.caught_up, "the watch listens")
                for number in (signal.SIGUSR1, signal.SIGUSR2):
                    watching.send_signal(number)
                tool.event()
                support.wait_until(lambda: '"number":1963' in watching.line(), "it goes on")
                watching.send_signal(signal.SIGHUP)
                self.assertEqual(watching.finish().status, 143, "a terminal that closes ends a watch")


class JournalTest(ServiceTest):
    def test_lines_for_the_journal_say_how_important_they_are(self):
        with CountedServer() as tool:
            self.write_tools({"station1": tool.url})
            with self.service(journal=True) as service:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                self.tools_file.write_text("tools: [")
                service.send(signal.SIGHUP)
                service.wait_for("recorded as before")
                service.end()
        self.assertEqual([line for line in service.told if not re.match("<[3-6]>", line)], [])
        self.assertEqual([line[:3] for line in service.says("station1: connected")], ["<5>"])
        self.assertEqual([line[:12] for line in service.says("recorded as before")], ["<3>spindle: "])
        self.assertEqual(service.told[-1][:3], "<6>", "the summary")

    def test_other_readers_get_plain_lines(self):
        with CountedServer() as tool:
            self.write_tools({"station1": tool.url})
            with self.service(environment={"JOURNAL_STREAM": "1:2"}) as service:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                service.end()
        self.assertEqual([line for line in service.told if line.startswith("<")], [])

    def test_a_link_that_flaps_is_told_once_a_minute_at_most(self):
        with CountedServer() as tool, CountedServer(serial=2) as other:
            self.write_tools({"station1": tool.url, "station2": other.url})
            began = time.monotonic()
            with self.service() as service:
                support.wait_until(lambda: tool.caught_up and other.caught_up, "the recorder listens")
                for _ in range(4):
                    tool.cut()
                    support.wait_until(lambda: tool.caught_up, "the recorder listens again")
                minutes = int((time.monotonic() - began) / 60) + 1
                service.end()
            self.assertGreaterEqual(tool.met, 5)
        self.assertTrue(1 <= len(service.says("station1: ")) <= minutes, service.told)
        self.assertEqual(len(service.says("station2: ")), 1)


class MetricsTest(ServiceTest):
    def test_counters_are_those_of_the_store(self):
        path = self.folder / "spindle.prom"
        with CountedServer() as tool, support.refusing_port() as deaf:
            self.write_tools({"station1": tool.url, "station2": deaf})
            with self.service("--metrics", path) as service:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                for error in (0, 335, 0):
                    tool.event(2 if error else 1, error)
                self.wait_until_stored(1964, 1021100042)
                support.wait_until(path.exists, "a file is written while it runs")
                tool.miss(3)
                self.wait_until_stored(1967, 1021100042)
                self.assertEqual(service.end(), 0, service.told)
        with contextlib.closing(sqlite3.connect(self.store)) as store:
            counted = dict(store.execute(
                "SELECT preset || ' ' || kind, count(*) FROM event WHERE kind LIKE 'fastening-%' GROUP BY 1"))
            last = store.execute("SELECT max(at) FROM event").fetchone()[0]
        families = prometheus_text.parse(path.read_text())
        results = {f"{labels['preset']} fastening-{labels['result']}": value
                   for _, labels, value in families["spindle_results_total"].samples}
        self.assertEqual(results, counted)
        self.assertEqual(families["spindle_missed_results_total"].value(tool="station1"), 2)
        self.assertEqual([(labels["tool"], value) for _, labels, value in families["spindle_gaps_total"].samples],
                         [("station1", 1)])
        self.assertEqual(families["spindle_link_up"].value(tool="station1"), 0)
        self.assertEqual(families["spindle_link_up"].value(tool="station2"), 0)
        self.assertEqual(families["spindle_last_result_timestamp_seconds"].value(tool="station1"), last / 1000)
        self.assertGreater(families["spindle_store_commit_seconds"].count(), 0)
        self.assertGreater(families["spindle_store_bytes"].value(), 4096)
        self.assertEqual(families["spindle_store_pending"].value(), 0)
        self.assertEqual(len(families["spindle_build_info"].samples), 1)

    def test_sinks_are_told_by_what_the_store_knows_of_them(self):
        path = self.folder / "spindle.prom"
        with CountedServer() as tool:
            self.write_tools({"station1": tool.url})
            with self.service() as service:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                for _ in range(4):
                    tool.event()
                self.wait_until_stored(1965, 1021100042)
                service.end()
            with contextlib.closing(sqlite3.connect(self.store)) as store:
                store.execute("INSERT INTO sink (name, cursor, url, moved)"
                              " VALUES ('plant', 2, 'postgresql://x', 0), ('live', 5, 'mqtts://x', 0)")
                store.commit()
                waits = store.execute("SELECT at FROM event WHERE id = 3").fetchone()[0] / 1000
            with self.service("--metrics", path) as service:
                support.wait_until(path.exists, "it is written")
                service.end()
        families = prometheus_text.parse(path.read_text())
        backlog = families["spindle_sink_backlog"]
        self.assertEqual((backlog.value(sink="plant"), backlog.value(sink="live")), (3, 0))
        oldest = families["spindle_sink_oldest_seconds"]
        self.assertEqual(oldest.value(sink="live"), 0)
        self.assertTrue(0 < oldest.value(sink="plant") <= time.time() - waits)

    def test_a_file_that_cannot_be_written_is_told_once_and_ends_nothing(self):
        with CountedServer() as tool:
            self.write_tools({"station1": tool.url})
            with self.service("--metrics", self.folder / "nowhere" / "x.prom") as service:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                tool.event()
                self.wait_until_stored(1962, 1021100042)
                service.end()
            self.assertEqual(len(service.says("x.prom")), 1, service.told)


if __name__ == "__main__":
    unittest.main(verbosity=2)
