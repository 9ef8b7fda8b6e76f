"""record against a tool whose own count is known: every number is a row or inside a gap, whatever becomes
of the recorder, and nothing is told before it is stored.
"""

import contextlib
import pathlib
import random
import resource
import signal
import sqlite3
import tempfile
import threading
import unittest

import support
from event_server import NUMBERS, EventServer

KILLS = 40 if support.is_sanitized() else 200
PROFILE = ("--profile", "doga-bm")


class Recording(support.Running):
    """A recorder whose records are read as they come."""

    def __init__(self, store, *arguments, environment=None):
        super().__init__("record", *arguments, "--store", str(store), "--tee", "--json",
                         environment=environment)
        self.told = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            if line.endswith(b"\n"):
                self.told.append(support.parse_json(line))

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self._reader.join(support.DEADLINE)
        super().__exit__()

    def records(self, kind):
        return [record for record in list(self.told) if record["type"] == kind]

    def end(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        status = support.wait_for_end(self.process)
        self._reader.join(support.DEADLINE)
        return status, self.process.stderr.read().decode()


class Store:
    """A store as a program sees it that knows nothing of ours."""

    def __init__(self, path):
        self.path = path

    def ask(self, statement, *values):
        with contextlib.closing(sqlite3.connect(f"file:{self.path}?mode=ro", uri=True)) as store:
            return store.execute(statement, values).fetchall()

    def numbers(self, serial="1021100042"):
        return self.ask("SELECT epoch, number FROM event JOIN tool ON tool.id = event.tool"
                        " WHERE serial = ? ORDER BY event.id", serial)

    def holes(self, first, last):
        """Numbers from first to last that are no row and in no gap of one epoch."""
        rows = {number for _, number in self.numbers()}
        for after, before in self.ask("SELECT after, before FROM gap WHERE after IS NOT NULL"
                                      " AND before IS NOT NULL"):
            rows.update(range(after + 1, before))
        return [number for number in range(first, last + 1) if number not in rows]

    def integrity(self):
        return self.ask("PRAGMA integrity_check")


def soon(ask):
    """What a store answers that may not be made yet; nothing while it is not."""
    with contextlib.suppress(sqlite3.OperationalError):
        return ask()
    return None


def stored(store, number, serial="1021100042"):
    return number in {n for _, n in soon(lambda: store.numbers(serial)) or ()}


class Recorded(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.path = self.folder / "events.db"
        self.store = Store(self.path)

    def wait_for(self, number, serial="1021100042"):
        support.wait_until(lambda: stored(self.store, number, serial), f"{number} is stored")

    def test_what_a_tool_tells_is_stored_and_then_told(self):
        with EventServer() as tool, Recording(self.path, tool.url, *PROFILE) as recorder:
            support.wait_until(lambda: tool.caught_up, "the recorder listens")
            for error in (0, 335, 0):
                tool.event(2 if error else 1, error)
            support.wait_until(lambda: len(recorder.records("event")) == 4, "all is told")
            events = recorder.records("event")
            self.assertEqual([event["number"] for event in events], [1961, 1962, 1963, 1964])
            self.assertEqual([event["id"] for event in events], [1, 2, 3, 4])
            self.assertEqual({(event["serial"], event["epoch"]) for event in events}, {("1021100042", 0)})
            self.assertTrue(events[0]["remembered"])
            self.assertNotIn("remembered", events[1])
            status, said = recorder.end()
        self.assertEqual(status, 0, said)
        rows = self.store.ask("SELECT number, kind, torque, a3, error, length(raw) FROM event")
        self.assertEqual(rows[2], (1963, "fastening-ng", 2730 * 10, 1446, 335, 28))
        self.assertEqual(self.store.ask("PRAGMA application_id"), [(0x53504E44,)])
        self.assertEqual(self.store.ask("SELECT name, profile FROM place"), [(tool.url, "doga-bm")])
        kinds = [kind for kind, in self.store.ask("SELECT type FROM happening ORDER BY id")]
        self.assertIn("link", kinds)

    def test_without_tee_nothing_is_printed(self):
        with EventServer() as tool, support.Running("record", tool.url, "--store", str(self.path),
                                                    *PROFILE) as recorder:
            support.wait_until(lambda: tool.caught_up, "the recorder listens")
            tool.event()
            self.wait_for(1962)
            recorder.send_signal(signal.SIGINT)
            self.assertEqual(support.wait_for_end(recorder.process), 0)
            self.assertEqual(recorder.process.stdout.read(), b"")

    def test_without_a_target_all_of_the_tools_file_is_recorded(self):
        with EventServer(serial=1) as one, EventServer(serial=2) as other:
            tools = self.folder / "tools.yaml"
            tools.write_text(f"tools:\n  a: {{url: '{one.url}', profile: doga-bm}}\n"
                             f"  b: {{url: '{other.url}', profile: doga-bm}}\n")
            with Recording(self.path, environment={"SPINDLE_TOOLS": str(tools)}) as recorder:
                for tool in (one, other):
                    support.wait_until(lambda tool=tool: tool.caught_up, "the recorder listens")
                recorder.end()

    def test_a_tools_file_of_one_tool_is_recorded_and_told(self):
        with EventServer() as tool:
            tools = self.folder / "tools.yaml"
            tools.write_text(f"tools:\n  a: {{url: '{tool.url}', profile: doga-bm}}\n")
            with Recording(self.path, environment={"SPINDLE_TOOLS": str(tools)}) as recorder:
                support.wait_until(lambda: recorder.records("event"), "the last event is told")
                status, said = recorder.end()
                self.assertEqual(status, 0, said)

    def test_a_restart_says_its_gap_and_fetches_the_last(self):
        with EventServer() as tool:
            with Recording(self.path, tool.url, *PROFILE) as recorder:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                tool.event()
                self.wait_for(1962)
                recorder.end()
            tool.miss(3)
            with Recording(self.path, tool.url, *PROFILE) as recorder:
                support.wait_until(lambda: recorder.records("event"), "the last one is fetched")
                gap = recorder.records("gap")[0]
                self.assertEqual((gap["missed"], gap["after"], gap["before"]), (2, 1962, 1965))
                event = recorder.records("event")[0]
                self.assertEqual((event["number"], event["source"]), (1965, "catch-up"))
                recorder.end()
        self.assertEqual(self.store.holes(1961, 1965), [])

    def test_kills_lose_nothing_that_was_told(self):
        chance = random.Random(12)
        told = []
        with EventServer() as tool:
            stop = threading.Event()

            def work():
                while not stop.wait(0.02):
                    tool.event()

            operator = threading.Thread(target=work, daemon=True)
            operator.start()
            for _ in range(KILLS):
                with Recording(self.path, tool.url, *PROFILE) as recorder:
                    support.wait_until(lambda: recorder.records("event"), "an event is told")
                    stop.wait(chance.random() * 0.15)
                    recorder.end(signal.SIGKILL)
                    told += [(e["epoch"], e["number"]) for e in recorder.records("event")]
            stop.set()
            operator.join()
            with Recording(self.path, tool.url, *PROFILE) as recorder:
                support.wait_until(lambda: stored(self.store, tool.number), "the last one is stored")
                recorder.end()
            rows = self.store.numbers()
            self.assertEqual(len(rows), len(set(rows)))
            self.assertEqual(set(told) - set(rows), set())
            self.assertEqual(len(told), len(set(told)), "an event was told twice")
            self.assertEqual({epoch for epoch, _ in rows}, {0})
            self.assertEqual(self.store.holes(rows[0][1], tool.number), [])
            self.assertEqual(self.store.integrity(), [("ok",)])

    def test_two_tools_of_one_serial_never_hide_each_other(self):
        with EventServer() as one, EventServer() as other, \
                Recording(self.path, one.url, other.url, *PROFILE) as recorder:
            for tool in (one, other):
                support.wait_until(lambda tool=tool: tool.caught_up, "the recorder listens")
            for _ in range(5):
                one.event()
                other.event()
            support.wait_until(lambda: len(recorder.records("event")) == 12, "all is told")
            self.assertEqual(len(recorder.records("error")), 1)
            self.assertIn("1021100042", recorder.records("error")[0]["message"])
            recorder.end()
        serials = [serial for serial, in self.store.ask("SELECT serial FROM tool ORDER BY id")]
        self.assertEqual(len(serials), 2)
        self.assertEqual(serials[0], "1021100042")
        self.assertRegex(serials[1], "^1021100042@tcp://")
        self.assertEqual(self.store.ask("SELECT count(*) FROM event GROUP BY tool"), [(6,), (6,)])

    def test_a_tool_that_was_restarted_begins_an_epoch(self):
        with EventServer(first=5000) as tool, Recording(self.path, tool.url, *PROFILE) as recorder:
            support.wait_until(lambda: tool.caught_up, "the recorder listens")
            tool.event()
            tool.number = 6
            tool.event()
            tool.event()
            support.wait_until(lambda: len(recorder.records("event")) == 4, "all is told")
            recorder.end()
        self.assertEqual(self.store.numbers(), [(0, 5000), (0, 5001), (1, 7), (1, 8)])
        self.assertEqual(self.store.ask("SELECT reason FROM epoch ORDER BY ordinal"), [("first",), ("restart",)])
        self.assertEqual(self.store.ask("SELECT epoch, missed FROM gap"), [(1, None)])

    def test_the_counter_begins_again(self):
        with EventServer(first=NUMBERS - 2) as tool, Recording(self.path, tool.url, *PROFILE) as recorder:
            support.wait_until(lambda: tool.caught_up, "the recorder listens")
            for _ in range(3):
                tool.event()
            support.wait_until(lambda: len(recorder.records("event")) == 4, "all is told")
            recorder.end()
        self.assertEqual(self.store.numbers(), [(0, 65534), (0, 65535), (1, 0), (1, 1)])
        self.assertEqual(self.store.ask("SELECT reason FROM epoch ORDER BY ordinal"), [("first",), ("wrap",)])

    def test_a_wrap_while_the_recorder_is_away_begins_an_epoch(self):
        with EventServer(first=NUMBERS - 6) as tool:
            with Recording(self.path, tool.url, *PROFILE) as recorder:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                tool.event()
                self.wait_for(NUMBERS - 5)
                recorder.end()
            tool.miss(25)
            with Recording(self.path, tool.url, *PROFILE) as recorder:
                support.wait_until(lambda: recorder.records("event"), "the last one is fetched")
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                tool.event()
                support.wait_until(lambda: len(recorder.records("event")) == 2, "it is told")
                recorder.end()
        numbers = self.store.numbers()
        self.assertEqual([number for _, number in numbers], [NUMBERS - 6, NUMBERS - 5, 20, 21])
        self.assertEqual([epoch for epoch, _ in numbers], [0, 0, 1, 1])

    def test_a_stop_while_the_link_is_down_does_not_say_that_it_listened(self):
        with EventServer() as tool:
            with Recording(self.path, tool.url, *PROFILE) as recorder:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                tool.event()
                self.wait_for(1962)
                before = self.store.ask("SELECT max(at) FROM event")[0][0]
                port = tool.port
                tool.__exit__(None, None, None)
                support.wait_until(lambda: "lost" in [r["state"] for r in recorder.records("link")],
                                   "the link is lost")
                lost = max(int(at) for at, in self.store.ask("SELECT max(at) FROM happening"))
                support.wait_until(lambda: len(recorder.records("link")) > 3, "time passes")
                recorder.end()
            self.assertGreater(port, 0)
        seen = self.store.ask("SELECT max(seen) FROM place")[0][0] or before
        self.assertLessEqual(seen, lost + 1)

    def test_a_tool_that_was_replaced_is_stored_under_its_own_name(self):
        with EventServer(serial=1) as tool:
            with Recording(self.path, tool.url, *PROFILE) as recorder:
                support.wait_until(lambda: tool.caught_up, "the recorder listens")
                tool.event()
                support.wait_until(lambda: len(recorder.records("event")) == 2, "it is told")
                with EventServer(first=77, serial=2) as other:
                    tool.tool, tool.number = other.tool, 77
                tool.cut()
                support.wait_until(lambda: tool.caught_up, "the recorder listens again")
                tool.event()
                self.wait_for(78, "2")
                recorder.end()
                gaps = [(gap["serial"], gap["missed"]) for gap in recorder.records("gap")]
                self.assertEqual(gaps, [("1", None)])
        rows = self.store.ask("SELECT serial, number FROM event JOIN tool ON tool.id = event.tool"
                              " ORDER BY event.id")
        self.assertEqual([number for serial, number in rows if serial == "1"], [1961, 1962])
        self.assertEqual([number for serial, number in rows if serial == "2"][-1], 78)

    def test_a_store_has_one_writer(self):
        with EventServer() as tool, Recording(self.path, tool.url, *PROFILE) as recorder:
            support.wait_until(lambda: tool.caught_up, "the recorder listens")
            second = support.run("record", tool.url, "--store", str(self.path), *PROFILE)
            self.assertNotEqual(second.status, 0)
            self.assertIn(str(recorder.pid), second.said)

    def test_a_full_disk_ends_nothing_and_loses_nothing(self):
        with EventServer() as tool, Recording(self.path, tool.url, *PROFILE) as recorder:
            support.wait_until(lambda: tool.caught_up, "the recorder listens")
            tool.event()
            self.wait_for(1962)
            resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
            for _ in range(20):
                tool.event()
            support.wait_until(lambda: recorder.records("error"), "the trouble is told")
            self.assertEqual(recorder.records("error")[0]["exit_status"], 74)
            resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE,
                             (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
            support.wait_until(lambda: stored(self.store, tool.number), "all is stored")
            status, said = recorder.end()
            self.assertEqual(status, 0, said)
        self.assertEqual(self.store.holes(1961, 1982), [])
        self.assertEqual(self.store.ask("SELECT count(*) FROM gap"), [(0,)])

    def test_fifty_tools_at_once(self):
        with contextlib.ExitStack() as stack:
            tools = [stack.enter_context(EventServer(serial=1000 + index)) for index in range(50)]
            recorder = stack.enter_context(
                Recording(self.path, *(tool.url for tool in tools), *PROFILE))
            for tool in tools:
                support.wait_until(lambda tool=tool: tool.caught_up, "the recorder listens")
            for _ in range(20):
                for tool in tools:
                    tool.event()
            support.wait_until(lambda: len(recorder.records("event")) == 50 * 21, "all is told")
            status = pathlib.Path(f"/proc/{recorder.pid}/status").read_text()
            peak = int(next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1])
            recorder.end()
        self.assertEqual(self.store.ask("SELECT count(*), count(DISTINCT tool) FROM event"), [(50 * 21, 50)])
        self.assertEqual(self.store.ask("SELECT count(*) FROM gap"), [(0,)])
        if not support.is_sanitized():
            self.assertLess(peak, 100 * 1024, "KiB of memory at most")

    def test_settings_are_kept_with_the_results(self):
        with support.simulator("doga-bm", "--rundown-every", "200ms") as tool, \
                Recording(self.path, tool, *PROFILE) as recorder:
            support.wait_until(
                lambda: soon(lambda: self.store.ask("SELECT count(*) FROM preset HAVING count(*) >= 15")),
                "the settings are stored")
            recorder.end()
        settings = self.store.ask("SELECT target_torque, torque_limit, max_angle FROM preset WHERE preset = 1")
        self.assertEqual(settings, [(27100, 100000, 3600)])


if __name__ == "__main__":
    unittest.main(verbosity=2)
