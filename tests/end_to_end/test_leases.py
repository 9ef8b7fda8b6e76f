"""Several collectors that share their tools by leases in a real PostgreSQL: each tool is held by one, what one
leaves another takes in time, and the database has every event once or a gap that says it is missing.

What counts is what the database itself wrote down of every change of a lease, by its own clock.
"""

import contextlib
import json
import os
import signal
import sqlite3
import threading
import time
import unittest

import support
from event_server import EventServer

try:
    import postgres_server
    INSTALLED = postgres_server.programs() is not None
except ImportError:
    INSTALLED = False

TOOLS = 20
TTL = 5.0
TAKEOVER = 2.0  # seconds behind the end of a lease, on a machine that has nothing else to do
LONG = 2 * support.DEADLINE
HISTORY = """
CREATE TABLE history (id bigserial, tool text, holder text, fence bigint, expires timestamptz,
                      at timestamptz DEFAULT clock_timestamp());
CREATE FUNCTION note() RETURNS trigger LANGUAGE plpgsql SECURITY DEFINER AS $$
BEGIN
  INSERT INTO history (tool, holder, fence, expires) VALUES (NEW.tool, NEW.holder, NEW.fence, NEW.expires);
  RETURN NEW;
END $$;
CREATE TRIGGER note AFTER INSERT OR UPDATE ON spindle_lease FOR EACH ROW WHEN (NEW.tool NOT LIKE '@%')
EXECUTE FUNCTION note();
"""


class Collector:
    """A recorder with a store of its own, and the forwarder of that store."""

    def __init__(self, name, folder, tools, url):
        self.name = name
        self.store = folder / f"{name}.db"
        self.tools = folder / f"{name}.yaml"
        lines = ["tools:"]
        lines += [f"  {tool}: {{url: '{server.url}', profile: doga-bm}}" for tool, server in tools.items()]
        lines += ["sinks:", f"  plant: {json.dumps({'url': url, 'collector': name})}"]
        self.tools.write_text("\n".join([*lines, ""]), encoding="utf-8")
        self.running = {}

    def start(self, *verbs):
        for verb in verbs or ("record", "forward"):
            if verb == "forward":
                support.wait_until(self.has_store, "there is a store", LONG)
            words = ["--lease", "plant", "--lease-ttl", f"{TTL:g}s"] if verb == "record" else ["plant"]
            self.running[verb] = support.Running(verb, *words, "--tools", self.tools, "--store", self.store)

    def has_store(self):
        with contextlib.suppress(sqlite3.OperationalError), \
                contextlib.closing(sqlite3.connect(f"file:{self.store}?mode=ro", uri=True)) as store:
            return store.execute("SELECT count(*) FROM sqlite_schema WHERE name = 'sink'").fetchone() == (1,)
        return False

    def signal(self, number, *verbs):
        for verb in verbs or self.running:
            if self.running[verb].process.poll() is None:
                os.kill(self.running[verb].pid, number)

    def end(self):
        for running in self.running.values():
            running.__exit__()


@unittest.skipUnless(INSTALLED, "PostgreSQL or python3-psycopg2 is not installed")
class LeasesTest(unittest.TestCase):
    maxDiff = 2000

    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        self.server = self.stack.enter_context(postgres_server.Postgres())
        schema = support.run("forward", "postgresql://nowhere.invalid/x", "--print-schema").stdout
        self.server.feed(schema + HISTORY)
        self.server.ask("CREATE ROLE line1 LOGIN IN ROLE spindle_writer, spindle_collector")
        self.ask = self.server.ask

    def serve(self, count):
        return {f"tool{index:02}": self.stack.enter_context(EventServer(first=1000, serial=700000000 + index))
                for index in range(count)}

    def collector(self, name, tools):
        made = Collector(name, support.home().path, tools, self.server.url("line1"))
        self.stack.callback(made.end)
        return made

    def operate(self, tools, pause=1.0):
        """Screws, all the time, on all tools in turn."""
        stop = threading.Event()

        def work():
            while not stop.wait(pause / len(tools)):
                servers = list(tools.values())
                servers[work.turn % len(servers)].event()
                work.turn += 1

        work.turn = 0
        operator = threading.Thread(target=work, daemon=True)
        operator.start()

        def end():
            stop.set()
            operator.join()

        self.stack.callback(end)
        return end

    def holders(self):
        return dict(self.ask("SELECT tool, holder FROM spindle_lease WHERE expires > clock_timestamp()"
                             " AND left(tool, 1) <> '@'"))

    def wait_for_holders(self, names, count=TOOLS):
        """All tools are held, and by these."""
        def good():
            held = self.holders()
            return len(held) == count and set(held.values()) <= set(names) and held
        return support.wait_until(good, f"{', '.join(names)} hold all", LONG)

    def wait_for_rows(self, tools):
        """Every tool is heard by the one that holds it now."""
        numbers = {name: server.number for name, server in tools.items()}

        def good():
            rows = dict(self.ask("SELECT place, max(number) FROM spindle_event GROUP BY place"))
            return all(rows.get(name, 0) > number for name, number in numbers.items())
        support.wait_until(good, "each tool is heard", LONG)

    def now(self):
        return self.server.value("SELECT clock_timestamp()")

    # --- what the database wrote down ---

    def assert_one_holder_each(self):
        """A lease that changed its holder had ended, and every change has a number of its own."""
        rows = self.ask("SELECT tool, holder, fence, at, expires,"
                        " lag(holder) OVER w, lag(fence) OVER w, lag(expires) OVER w FROM history"
                        " WINDOW w AS (PARTITION BY tool ORDER BY id)")
        changes = 0
        for tool, holder, fence, at, _, before, fence_before, expired in rows:
            if before is None or holder == before and fence == fence_before:
                continue
            changes += 1
            self.assertEqual(fence, fence_before + 1, tool)
            self.assertLessEqual(expired, at, f"{tool} was taken from {before} before its lease ended")
        self.assertGreater(changes, 0)

    def takeovers(self, name, since):
        """Of each tool that a collector lost since then: seconds from the end of its lease to the next one's."""
        return [float(late) for late, in self.ask(
            "SELECT extract(epoch FROM at - expired) FROM (SELECT tool, holder, at, lag(holder) OVER w AS before,"
            " lag(expires) OVER w AS expired FROM history WINDOW w AS (PARTITION BY tool ORDER BY id)) AS step"
            " WHERE before = %s AND holder <> %s AND at > %s", name, name, since)]

    def assert_all_there(self, tools):
        """Every number of every tool's own count is one row or inside a gap."""
        for name, server in tools.items():
            rows = self.ask("SELECT epoch, number FROM spindle_event WHERE place = %s", name)
            self.assertEqual({epoch for epoch, _ in rows}, {0}, name)
            numbers = {number for _, number in rows}
            self.assertEqual(len(numbers), len(rows))
            for after, before in self.ask("SELECT after, before FROM spindle_gap WHERE place = %s", name):
                numbers.update(range(after + 1, before))
            self.assertEqual(set(range(min(numbers), server.number + 1)) - numbers, set(), name)

    # --- figure 13 ---

    def test_what_one_leaves_others_take_and_nothing_is_lost(self):
        tools = self.serve(TOOLS)
        ports = {server.port for server in tools.values()}
        collectors = {name: self.collector(name, tools) for name in ("one", "two", "three")}
        end = self.operate(tools)
        for collector in collectors.values():
            collector.start()
        # How they share depends on who was first, so who holds most is the one to be lost.
        left = list(collectors)

        def lose():
            shares = list(self.wait_for_holders(left).values())
            most = max(left, key=shares.count)
            left.remove(most)
            return most

        first = lose()
        self.wait_for_rows(tools)
        with self.subTest("one connection each"):
            clients = [remote for _, remote, state, _ in support.tcp_sockets()
                       if remote in ports and state == support.TCP_ESTABLISHED]
            self.assertEqual(len(clients), len(set(clients)))

        began, began_paced, since = time.monotonic(), support.paced(), self.now()
        collectors[first].signal(signal.SIGKILL)
        self.wait_for_holders(left)
        lost = self.takeovers(first, since)
        self.wait_for_rows(tools)

        second, stalled = lose(), self.now()
        third, = left
        one, two, three = (collectors[name] for name in (first, second, third))
        two.signal(signal.SIGSTOP, "record")
        self.wait_for_holders((third,))
        late = self.takeovers(second, stalled)
        self.wait_for_rows(tools)
        two.signal(signal.SIGCONT, "record")
        self.wait_for_rows(tools)
        self.assertEqual(set(self.holders().values()), {third})

        self.assertGreater(len(lost), 0)
        self.assertGreater(len(late), 0)
        # How much slower all of it went than on a machine that has nothing else to do.
        slowness = max(1.0, (time.monotonic() - began) / max(support.paced() - began_paced, support.POLL))
        self.assertLess(max(lost + late), TAKEOVER * slowness)

        end()
        self.settle(tools, three)
        three.signal(signal.SIGTERM, "record")
        self.assertEqual(support.wait_for_end(three.running["record"].process, LONG), 0)
        # Who goes gives back, and a collector that was well all the time takes it.
        self.wait_for_holders((second,))
        for collector in (two, three):
            collector.signal(signal.SIGTERM)
        for collector in (one, two, three):
            finished = support.run("forward", "plant", "--tools", collector.tools, "--store", collector.store, "--once",
                                   timeout=LONG)
            self.assertEqual(finished.status, 0, finished)
        self.assert_one_holder_each()
        self.assert_all_there(tools)
        self.assertEqual(self.ask("SELECT count(*) FROM spindle_conflict"), [(0,)])
        fences = self.ask("SELECT count(DISTINCT fence) FROM spindle_event WHERE place = 'tool00'")
        self.assertEqual(self.ask("SELECT count(*) FROM spindle_event WHERE fence IS NULL"), [(0,)])
        self.assertGreaterEqual(fences[0][0], 1)
        for collector in (one, two, three):
            checked = support.run("store", "check", "--store", collector.store, "--json")
            self.assertEqual([record["holes"] for record in checked.records("coverage") if record["holes"]], [], checked)

    def settle(self, tools, collector):
        """The last of each tool is in the database."""
        def good():
            rows = dict(self.ask("SELECT place, max(number) FROM spindle_event GROUP BY place"))
            return all(rows.get(name) == server.number for name, server in tools.items())
        support.wait_until(good, f"{collector.name} delivered the last of each tool", LONG)

    # --- without the database ---

    def test_without_the_database_what_is_held_ends_and_nothing_is_taken(self):
        tools = self.serve(2)
        one = self.collector("alone", tools)
        one.start("record")
        self.wait_for_holders(("alone",), count=2)
        for server in tools.values():
            support.wait_until(lambda server=server: server.armed, "the tool is recorded", LONG)
        self.server.stop("immediate")
        for server in tools.values():
            support.wait_until(lambda server=server: not server.armed, "the tool is left, and disarmed", LONG)
            disarmed = [request for _, request in server.requests if request.words == (4002, 0)]
            self.assertTrue(disarmed)
        self.server.start()
        self.wait_for_holders(("alone",), count=2)
        for server in tools.values():
            support.wait_until(lambda server=server: server.armed, "the tool is recorded again", LONG)
        one.signal(signal.SIGTERM, "record")
        self.assertEqual(support.wait_for_end(one.running["record"].process, LONG), 0)
        self.assertEqual(self.holders(), {})
        self.assert_one_holder_each()

    def test_who_cannot_share_is_told_so(self):
        tools = self.serve(1)
        one = self.collector("wrong", tools)
        for sink, words in (("nowhere", "no such sink"), ("mqtt://127.0.0.1", "PostgreSQL"),
                            ("postgresql://a:hunter2@127.0.0.1/x", "password")):
            with self.subTest(sink):
                finished = support.run("record", "--lease", sink, "--tools", one.tools, "--store", one.store)
                self.assertEqual(finished.status, 2, finished)
                self.assertIn(words, finished.said)
                self.assertNotIn("hunter2", finished.said)
        finished = support.run("record", "--lease", "plant", "--lease-ttl", "900ms", "--tools", one.tools)
        self.assertEqual(finished.status, 2, finished)


if __name__ == "__main__":
    unittest.main()
