"""forward to PostgreSQL: the real binary and a real server, judged by psql, psycopg2 and Python's sqlite3.

0 lost and 0 twice, whatever is killed; nothing rounded; what cannot become a row is told and kept.
"""

import contextlib
import decimal
import json
import os
import pathlib
import random
import signal
import sqlite3
import stat
import subprocess
import unittest

import support

try:
    import postgres_server
    from postgres_server import Postgres
    INSTALLED = postgres_server.programs() is not None
except ImportError:
    INSTALLED = False

PROGRAMS = pathlib.Path(os.environ.get("SPINDLE_PEER_PROGRAMS", support.ROOT / "build/dev/tests"))
LONG = 12 * support.DEADLINE  # for thousands of rows, and a server that recovers, on a busy machine
ROWS = 20_000
KILLS = 5
PASSWORD = "hunter2 with a space"


def make_store(name, rows):
    path = support.home().path / name
    path.unlink(missing_ok=True)
    support.completed([PROGRAMS / "spindle_peer_report_store", path, *([str(rows)] if rows else [])],
                      deadline=LONG, check=True)
    return path


def tools_file(name, **sinks):
    path = support.home().path / name
    lines = ["tools: {nothing: {url: 'tcp://127.0.0.1:1', profile: doga-bm}}", "sinks:"]
    lines += [f"  {sink}: {json.dumps(settings)}" for sink, settings in sinks.items()]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


def asked(path, statement, *values):
    with contextlib.closing(sqlite3.connect(path)) as store, store:
        return store.execute(statement, values).fetchall()


def once(sink, store, *arguments, **options):
    return support.run("forward", sink, "--store", store, "--once", *arguments, timeout=LONG, **options)


@unittest.skipUnless(INSTALLED, "PostgreSQL or python3-psycopg2 is not installed")
class ForwardPostgresTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.certificates = postgres_server.make_certificates(support.home().path)
        cls.server = Postgres(ssl="on", ssl_cert_file="'../server.pem'", ssl_key_file="'../server.key'")
        for name in ("server.pem", "server.key"):
            copy = cls.server.folder / name
            copy.write_bytes((cls.certificates / name).read_bytes())
            copy.chmod(stat.S_IRUSR | stat.S_IWUSR)
            if os.getuid() == 0:
                owner = cls.server.folder.stat()
                os.chown(copy, owner.st_uid, owner.st_gid)
        cls.addClassCleanup(cls.server.__exit__)
        cls.server.__enter__()
        cls.server.admit("host all secret 127.0.0.1/32 scram-sha-256")
        cls.server.reload()
        cls.server.ask("CREATE DATABASE plant")
        printed = support.run("forward", "postgresql://nowhere.invalid/x", "--print-schema",
                              "--store", "/nonexistent/events.db")
        assert printed.status == 0, printed
        cls.schema = printed.stdout
        cls.server.feed(cls.schema, database="plant")
        cls.server.ask("CREATE ROLE line1 LOGIN IN ROLE spindle_writer")
        cls.server.ask(f"CREATE ROLE secret LOGIN PASSWORD '{PASSWORD}' IN ROLE spindle_writer")
        cls.databases = 0

    def setUp(self):
        type(self).databases += 1
        self.database = f"plant{self.databases}"
        self.server.ask(f"CREATE DATABASE {self.database} TEMPLATE plant")

    def url(self, user="line1", **options):
        return self.server.url(user, self.database, **options)

    def ask(self, statement, *values, **who):
        return self.server.ask(statement, *values, database=self.database, **who)

    def assert_complete(self, path):
        """Every row of the store once, and no other."""
        wanted = asked(path, "SELECT maker, serial, epoch, number, raw FROM event JOIN tool ON tool.id = event.tool")
        rows = self.ask("SELECT maker, serial, epoch, number, raw FROM spindle_event")
        self.assertEqual(len(rows), len(wanted))
        self.assertEqual({(*row[:4], bytes(row[4])) for row in rows}, set(wanted))

    # --- what arrives ---

    def test_every_value_arrives_exactly_and_once(self):
        store = make_store("shift.db", 0)
        for _ in range(2):
            finished = once(self.url(), store)
            self.assertEqual(finished.status, 0, finished)
        # A sink of another name begins at the beginning.
        again = tools_file("again.yaml", again={"url": self.url(), "collector": "other"})
        finished = once("again", store, "--tools", again)
        self.assertEqual(finished.status, 0, finished)
        self.assert_complete(store)
        wanted = asked(store, "SELECT serial, epoch, number, event.at, place.name, kind, torque, target_torque, a3, error,"
                       " preset, remembered FROM event JOIN tool ON tool.id = event.tool"
                       " JOIN place ON place.id = event.place ORDER BY event.id")
        rows = self.ask("SELECT serial, epoch, number, (extract(epoch FROM at) * 1000)::bigint, place, kind,"
                        " torque, target_torque, a3, error, preset, remembered, payload, seq, torque_unit, collector"
                        " FROM spindle_event ORDER BY collector_id")
        told = {record["id"]: record for record in support.run("results", "--store", store, "--json").records("event")}
        self.assertGreater(len(rows), 100)
        scale = decimal.Decimal(10_000)
        for row, want in zip(rows, wanted, strict=True):
            exact = [None if steps is None else steps / scale for steps in want[6:8]]
            self.assertEqual(row[:12], (*want[:6], *exact, *want[8:11], bool(want[11])))
            payload = row[12]
            self.assertEqual((payload["number"], payload["epoch"], payload["serial"]), (row[2], row[1], row[0]))
            self.assertEqual(payload["torque"], float(told[payload["id"]]["torque"]))
            self.assertEqual(row[13], row[1] * 65536 + row[2])
            self.assertNotEqual(row[15], "other")
        gaps = asked(store, "SELECT after, before, missed, reason FROM gap ORDER BY id")
        self.assertEqual(self.ask("SELECT after, before, missed, reason FROM spindle_gap ORDER BY collector_id"), gaps)

    def test_the_writer_can_insert_and_nothing_else(self):
        store = make_store("role.db", 10)
        self.assertEqual(once(self.url(), store).status, 0)
        for statement in ("UPDATE spindle_event SET torque = 1", "DELETE FROM spindle_event",
                          "TRUNCATE spindle_gap", "DROP TABLE spindle_event", "UPDATE spindle_lease SET fence = 0"):
            with self.assertRaises(postgres_server.psycopg2.errors.InsufficientPrivilege, msg=statement):
                self.ask(statement, user="line1")

    def test_another_event_of_the_same_key_is_kept_and_told(self):
        store = make_store("conflict.db", 100)
        self.assertEqual(once(self.url(), store).status, 0)
        number, = asked(store, "SELECT number FROM event ORDER BY id LIMIT 1 OFFSET 40")[0]
        self.ask("UPDATE spindle_event SET raw = '\\x01' WHERE number = %s", number)
        for times in (1, 2):
            finished = once(self.url(), store, "--from", "1", "--yes", "--json")
            self.assertEqual(finished.status, 0, finished)
            # What is known is told once.
            self.assertEqual("spindle_conflict" in finished.stdout + finished.stderr, times == 1, finished)
        kept = self.ask("SELECT key, what, raw FROM spindle_conflict")
        self.assertEqual(len(kept), 1)
        self.assertTrue(kept[0][0].endswith(f"/{number}"), kept)
        raw, = asked(store, "SELECT raw FROM event WHERE number = ?", number)[0]
        self.assertEqual(bytes(kept[0][2]), raw)
        self.assertEqual(self.ask("SELECT count(*) FROM spindle_event"), [(100,)])

    def test_texts_that_no_database_keeps_stop_nothing(self):
        store = make_store("poison.db", 1000)
        ids = [row for row, in asked(store, "SELECT id FROM event ORDER BY id")]
        for place, barcode in ((10, b"A\0B"), (500, b"\xff\xfe"), (999, "Pr\u00fcfung \u4e2d".encode())):
            asked(store, "UPDATE event SET barcode = CAST(? AS TEXT) WHERE id = ?", barcode, ids[place])
        finished = once(self.url(), store)
        self.assertEqual(finished.status, 0, finished)
        self.assert_complete(store)
        marked = dict(self.ask("SELECT barcode, remark IS NOT NULL FROM spindle_event WHERE barcode IS NOT NULL"))
        self.assertEqual(marked, {"A\\x00B": True, "\\xFF\\xFE": True, "Pr\u00fcfung \u4e2d": False})

    def test_a_row_that_the_database_refuses_is_put_aside(self):
        store = make_store("refused.db", 1000)
        number, = asked(store, "SELECT number FROM event ORDER BY id LIMIT 1 OFFSET 700")[0]
        self.ask(f"ALTER TABLE spindle_event ADD CONSTRAINT own CHECK (number <> {number})")
        finished = once(self.url(), store, "--json")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual(self.ask("SELECT count(*) FROM spindle_event"), [(999,)])
        kept = self.ask("SELECT key, reason, payload::json->>'number' FROM spindle_conflict")
        self.assertEqual([(row[0].rsplit("/", 1)[1], row[2]) for row in kept], [(str(number), str(number))])
        self.assertIn("own", kept[0][1])
        self.assertIn("spindle_conflict", finished.stdout + finished.stderr)

    # --- what is wrong ---

    def assert_refused(self, finished, status, *words):
        self.assertEqual(finished.status, status, finished)
        for word in words:
            self.assertIn(word, finished.said)
        self.assertNotIn("hunter2", finished.said + finished.stdout)

    def test_a_wrong_schema_is_named(self):
        store = make_store("schema.db", 10)
        for change, *words in (("DROP TABLE spindle_conflict", "spindle_conflict"),
                               ("ALTER TABLE spindle_gap DROP COLUMN reason CASCADE", "spindle_gap", "reason"),
                               ("ALTER TABLE spindle_event ALTER torque TYPE numeric(10,2)", "torque", "numeric(10,2)"),
                               ("ALTER TABLE spindle_event DROP CONSTRAINT spindle_event_pkey", "key"),
                               ("ALTER TABLE spindle_event ADD COLUMN own int NOT NULL", "own")):
            with self.subTest(change):
                self.setUp()
                self.ask(change)
                self.assert_refused(once(self.url(), store), 8, *words)
                self.assertEqual(self.ask("SELECT count(*) FROM spindle_event"), [(0,)])

    def test_who_is_refused_and_who_is_not_there_is_told_apart(self):
        store = make_store("refusals.db", 10)
        self.server.ask("CREATE ROLE stranger LOGIN")
        self.assert_refused(once(self.url("stranger"), store), 6, "spindle_event")
        with support.refusing_port() as closed:
            port = closed.rsplit(":", 1)[1]
            self.assert_refused(once(f"postgresql://line1@127.0.0.1:{port}/plant", store), 4, "refused")
        password = support.home().path / "password"
        for text, status in (("hunter2 wrong", 6), (PASSWORD, 0)):
            password.write_text(text + "\n", encoding="utf-8")
            password.chmod(0o600)
            tools = tools_file("secret.yaml", plant={"url": self.url("secret"), "password-file": str(password)})
            finished = once("plant", store, "--tools", tools)
            self.assert_refused(finished, status)
        self.assert_refused(once(self.url("secret"), store), 6, "password")
        known = support.home().path / "pgpass"
        known.write_text(f"127.0.0.1:{self.server.port}:*:secret:{PASSWORD}\n", encoding="utf-8")
        known.chmod(0o600)
        finished = once(self.url("secret"), store, "--from", "1", "--yes", environment={"PGPASSFILE": str(known)})
        self.assert_refused(finished, 0)
        finished = once(f"postgresql://line1:hunter2@127.0.0.1:{self.server.port}/plant", store)
        self.assert_refused(finished, 2, "password")

    def test_the_server_has_to_be_the_one_that_is_meant(self):
        store = make_store("tls.db", 10)
        ca = self.certificates / "ca.pem"

        def encrypted(host="localhost", ca_file=ca):
            url = self.url(host=host, sslmode="verify-full")
            tools = tools_file("tls.yaml", plant={"url": url, "ca-file": str(ca_file)})
            return once("plant", store, "--from", "1", "--yes", "--tools", tools)

        self.assert_refused(encrypted(), 0)
        self.assert_refused(encrypted(ca_file=self.certificates / "other.pem"), 8, "certificate")
        self.assert_refused(encrypted(host="127.0.0.1"), 8, "certificate")
        self.assertEqual(self.ask("SELECT count(*) FROM spindle_event"), [(10,)])

    # --- what happens meanwhile ---

    def test_a_server_that_restarts_gets_the_rest(self):
        store = make_store("restart.db", 50)
        with support.Running("forward", self.url(), "--store", store, "--json") as forwarder:
            arrived = "SELECT count(*) FROM spindle_event"
            support.wait_until(lambda: self.ask(arrived) == [(50,)], "all arrived", LONG)
            self.server.stop()
            asked(store, "INSERT INTO event (tool, epoch, number, place, at, source, kind, raw)"
                  " SELECT tool, epoch, number + 1, place, at + 1, source, kind, raw FROM event ORDER BY id DESC LIMIT 1")
            self.server.start()
            support.wait_until(lambda: self.ask(arrived) == [(51,)], "the rest arrived", LONG)
            forwarder.send_signal(signal.SIGTERM)
            self.assertIn(support.wait_for_end(forwarder.process), (0, 143))

    def test_a_server_that_stands_still_keeps_no_forwarder(self):
        store = make_store("still.db", 10)
        with support.Running("forward", self.url(), "--store", store, "--json") as forwarder:
            support.wait_until(lambda: self.ask("SELECT count(*) FROM spindle_event") == [(10,)], "all arrived", LONG)
            backend = self.server.value("SELECT pid FROM pg_stat_activity WHERE usename = 'line1' AND datname = %s",
                                        self.database)
            os.kill(backend, signal.SIGSTOP)
            try:
                asked(store, "INSERT INTO event (tool, epoch, number, place, at, source, kind, raw)"
                      " SELECT tool, epoch, number + 1, place, at + 1, source, kind, raw FROM event ORDER BY id DESC LIMIT 1")
                support.wait_until(lambda: support.unread_bytes(self.server.port, self._client_port(backend)),
                                   "a statement waits for the server", LONG)
                forwarder.send_signal(signal.SIGTERM)
                finished = forwarder.finish()
                self.assertIn(finished.status, (0, 143), finished)
                self.assertLess(finished.paced, support.SOON, finished)
            finally:
                os.kill(backend, signal.SIGCONT)

    def _client_port(self, backend):
        return self.server.value("SELECT client_port FROM pg_stat_activity WHERE pid = %s", backend)

    def test_kills_of_both_lose_nothing_and_write_nothing_twice(self):
        store = make_store("kills.db", ROWS)
        chance = random.Random(12)
        arrived = "SELECT count(*) FROM spindle_event"

        def count():
            with contextlib.suppress(postgres_server.psycopg2.OperationalError):
                return self.ask(arrived)[0][0]
            return -1

        victims = ["forwarder", "server"] * KILLS
        goals = sorted(chance.randrange(1, ROWS - 1000) for _ in victims)
        tools = tools_file("kills.yaml", plant={"url": self.url(), "batch": 50})
        running = None
        try:
            for victim, goal in zip(victims, goals, strict=True):
                if running is None:
                    running = subprocess.Popen([support.binary(), "forward", "plant", "--tools", tools, "--store", store],
                                               env=support.home().environment(), stdin=subprocess.DEVNULL,
                                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                support.wait_until(lambda goal=goal: count() >= goal, f"{goal} rows arrived", LONG)
                if victim == "server":
                    self.server.kill()
                    self.server.start()
                else:
                    running.kill()
                    running.wait()
                    running = None
            self.assertLess(count(), ROWS, "the last kill came too late to mean anything")
        finally:
            if running is not None:
                running.terminate()
                support.wait_for_end(running)
        finished = once("plant", store, "--tools", tools)
        self.assertEqual(finished.status, 0, finished)
        self.assert_complete(store)
        self.assertEqual(self.ask("SELECT count(*) FROM spindle_conflict"), [(0,)])


if __name__ == "__main__":
    unittest.main()
