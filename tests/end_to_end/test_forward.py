"""forward to MQTT: the real binary, a real mosquitto, and listeners that know nothing of spindle."""

import collections
import json
import os
import pathlib
import signal
import sqlite3
import sys
import tempfile
import unittest

import support

try:
    from mqtt_broker import Broker, Certificates, Listener, PROGRAM, holes, object_of, retained
except ImportError:
    PROGRAM = None

PROGRAMS = pathlib.Path(os.environ.get("SPINDLE_PEER_PROGRAMS", support.ROOT / "build/dev/tests"))
LONG = 6 * support.DEADLINE  # for thousands of messages on a busy machine


def make_store(name, rows=0):
    """The sample of the peer program, or one tool "busy" that told so many results."""
    path = support.home().path / name
    command = [PROGRAMS / "spindle_peer_sample_store", path, *(["1", "2"] if rows else [])]
    support.completed(command, check=True)
    if rows > 2:
        tell_more(path, 3, rows)
    return path


def tell_more(path, first, last):
    """More results of "busy" in one transaction, as the recorder would store them."""
    with sqlite3.connect(path) as store:
        columns = [row[1] for row in store.execute("PRAGMA table_info(event)") if row[1] != "id"]
        listed = ", ".join(columns)
        one, two = store.execute(f"SELECT {listed} FROM event ORDER BY number LIMIT 2").fetchall()
        number, at, raw = (columns.index(name) for name in ("number", "at", "raw"))
        offset = next(place for place in range(0, len(one[raw]), 2) if one[raw][place:place + 2] != two[raw][place:place + 2])
        rows = []
        for value in range(first, last + 1):
            row = list(one)
            row[number], row[at] = value, one[at] + value
            row[raw] = one[raw][:offset] + value.to_bytes(2, "big") + one[raw][offset + 2:]
            rows.append(row)
        store.executemany(f"INSERT INTO event ({listed}) VALUES ({', '.join('?' * len(columns))})", rows)
    store.close()


def sinks_of(path):
    finished = support.run("store", "sinks", "--store", path, "--json")
    return {record["sink"]: record for record in finished.records("sink")}


def forwarding(sink, store, *arguments, **options):
    return support.Running("forward", sink, "--store", store, "--json", *arguments, **options)


def forward_once(sink, store, *arguments, **options):
    return support.run("forward", sink, "--store", store, "--once", *arguments, timeout=LONG, **options)


def tools_file(name, **sinks):
    path = support.home().path / name
    lines = ["tools: {busy: {url: 'tcp://127.0.0.1:1', profile: doga-bm}}", "sinks:"]
    lines += [f"  {sink}: {json.dumps(settings)}" for sink, settings in sinks.items()]
    path.write_text("\n".join([*lines, ""]))
    return path


def mqtt(url):
    """The same address as one of a broker."""
    return f"mqtt://127.0.0.1:{support.host_and_port(url)[1]}/plant"


def expected(path, first, last):
    return [f"DOGA/5/0/{number}" for number in range(first, last + 1)]


@unittest.skipUnless(PROGRAM, "mosquitto or python3-paho-mqtt is not installed")
class ForwardTest(unittest.TestCase):
    maxDiff = 2000

    def heard(self, listener, keys, what):
        support.wait_until(lambda: set(listener.keys()) >= set(keys), what, LONG)

    def ended(self, running, status=0):
        finished = running.finish(timeout=LONG)
        self.assertEqual(finished.status, status, finished)
        return finished


class DeliveryTest(ForwardTest):
    def test_a_store_that_is_not_there_yet_is_waited_for(self):
        ready = make_store("ready.db")
        store = support.home().path / "later.db"
        store.unlink(missing_ok=True)
        self.assertEqual(forward_once("mqtt://127.0.0.1:1", store).status, 3)
        with Broker() as broker, Listener(broker.port) as listener, forwarding(broker.url, store) as running:
            self.assertIn("there is no store yet", running.process.stderr.readline().decode())
            with forwarding(broker.url, store.with_name("never.db")) as vain:
                vain.process.stderr.readline()
                vain.send_signal(signal.SIGTERM)
                self.assertEqual(vain.finish().status, 0)
            ready.rename(store)
            support.wait_until(listener.keys, "what is in the store came", LONG)
            running.send_signal(signal.SIGTERM)
            self.assertEqual(running.finish().status, 0)

    def test_once_delivers_all_results_and_gaps_with_their_keys(self):
        store = make_store("once.db")
        with Broker() as broker, Listener(broker.port) as listener:
            finished = forward_once(broker.url, store)
            self.assertEqual(finished.status, 0, finished)
            told = [record for record in support.run("results", "--store", store, "--all", "--json").records()
                    if record["type"] in ("event", "gap") and "id" in record]
            results = [record for record in told if record.get("kind", "").startswith("fastening-")]
            gaps = [record for record in told if record["type"] == "gap"]
            support.wait_until(lambda: len(listener.keys()) >= len(results) + len(gaps), "all came", LONG)
            by_topic = collections.Counter(message.topic.rsplit("/", 1)[-1] for message in listener.all())
            self.assertEqual((by_topic["result"], by_topic["gap"]), (len(results), len(gaps)))
            self.assertEqual(by_topic["event"], 0)
            objects = {object_of(message)["id"]: (message, object_of(message)) for message in listener.all("result")}
            last = {}
            for record in results:
                message, sent = objects[record["id"]]
                self.assertEqual((message.qos, message.retain, message.properties.ContentType),
                                 (1, False, "application/json"))
                self.assertEqual(message.topic, f"plant/{record['target']}/result")
                if "number" in record:
                    self.assertEqual(sent["seq"], record["epoch"] * 65536 + record["number"])
                self.assertEqual(sent["previous"], last.get(record["serial"]))
                last[record["serial"]] = sent["seq"]
                for key in ("torque", "kind", "serial", "number", "raw"):
                    self.assertEqual(json.dumps(sent.get(key)), json.dumps(record.get(key), default=float), key)
                self.assertIn("collector", sent)
            self.assertEqual(len(listener.keys()), len(set(listener.keys())))
            self.assertEqual(sinks_of(store)[broker.url]["waiting"], 0)
            again = forward_once(broker.url, store)
            self.assertEqual(again.status, 0, again)
            self.assertIn("0 delivered", again.said)
            everything = tools_file("all.yaml", all={"url": broker.url, "events": "all"})
            self.assertEqual(forward_once("all", store, "--tools", everything).status, 0)
            others = [record for record in told if record["type"] == "event" and record not in results]
            support.wait_until(lambda: len(listener.all("event")) == len(others), "the other events came", LONG)

    def test_dry_run_shows_what_would_be_sent_and_changes_nothing(self):
        store = make_store("dry.db")
        finished = support.run("forward", "mqtt://127.0.0.1:1/plant", "--store", store, "--dry-run", "--json")
        self.assertEqual(finished.status, 0, finished)
        lines = finished.records()
        self.assertEqual({line["type"] for line in lines}, {"event", "gap"})
        self.assertTrue(all("collector" in line for line in lines))
        with_topics = support.run("forward", "mqtt://127.0.0.1:1/plant", "--store", store, "--dry-run").stdout
        self.assertTrue(with_topics.startswith("plant/"), with_topics[:80])
        self.assertEqual(sinks_of(store), {})

    def test_what_is_stored_meanwhile_follows_and_the_state_is_retained(self):
        store = make_store("live.db", 3)
        with Broker() as broker, Listener(broker.port) as listener:
            with forwarding(broker.url, store) as running:
                self.heard(listener, expected(store, 1, 3), "what was there came")
                tell_more(store, 4, 6)
                self.heard(listener, expected(store, 1, 6), "what came meanwhile")
                state = support.wait_until(
                    lambda: (told := retained(broker.port, "plant/busy/state")) and told.get("number") == 6 and told,
                    "the state tells the last result", LONG)
                self.assertEqual((state["type"], state["serial"], state["result"], state["seq"], state["link"]),
                                 ("state", "5", "OK", 6, "unknown"))
                online = retained(broker.port, "plant/_collector/+/status")
                self.assertEqual((online["online"], online["tools"]), (True, ["busy"]))
                running.send_signal(signal.SIGTERM)
                finished = self.ended(running)
                self.assertLess(finished.paced, LONG)
            self.assertEqual(retained(broker.port, "plant/_collector/+/status"), {"online": False})
            self.assertEqual(sinks_of(store)[broker.url]["waiting"], 0)

    def test_a_forwarder_that_is_killed_is_told_as_offline_by_its_last_will(self):
        store = make_store("will.db", 3)
        with Broker() as broker, Listener(broker.port) as listener:
            with forwarding(broker.url, store) as running:
                self.heard(listener, expected(store, 1, 3), "what was there came")
                running.send_signal(signal.SIGKILL)
                support.wait_until(lambda: [object_of(message) for message in listener.all("status")][-1:] ==
                                   [{"online": False}], "the last will came", LONG)

    def test_one_forwarder_serves_a_sink(self):
        store = make_store("one.db", 3)
        with Broker() as broker, Listener(broker.port) as listener, forwarding(broker.url, store) as running:
            self.heard(listener, expected(store, 1, 3), "what was there came")
            second = forward_once(broker.url, store)
            self.assertEqual(second.status, 74, second)
            self.assertIn(f"process {running.pid} forwards to sink", second.said)


class TroubleTest(ForwardTest):
    """Figure 8, 10 and 11 of the specification."""

    ROWS = 6_000

    def test_a_broker_that_is_away_loses_nothing(self):
        store = make_store("away.db", 1_000)
        with Broker(persistence=True) as broker, Listener(broker.port) as listener:
            with forwarding(broker.url, store) as running:
                self.heard(listener, expected(store, 1, 1_000), "what was there came")
                broker.kill(signal.SIGTERM)
                tell_more(store, 1_001, 2_000)
                support.wait_until(lambda: running.line(LONG), "an error is told")
                broker.start()
                self.heard(listener, expected(store, 1, 2_000), "what came meanwhile")
                running.send_signal(signal.SIGTERM)
                self.ended(running)
            self.assertLessEqual(len(listener.keys()) - 2_000, 100)

    def test_20_kills_of_the_forwarder_repeat_no_more_than_the_windows(self):
        window, kills = 20, 20
        store = make_store("kills.db", self.ROWS)
        with Broker() as broker, Listener(broker.port) as listener:
            for kill in range(1, kills + 1):
                with forwarding(broker.url, store, "--window", str(window)) as running:
                    goal = min(kill * self.ROWS // (kills + 5), self.ROWS)
                    support.wait_until(lambda: len(listener.keys()) >= goal, f"part {kill} came", LONG)
                    running.send_signal(signal.SIGKILL)
            finished = forward_once(broker.url, store, "--window", str(window))
            self.assertEqual(finished.status, 0, finished)
            keys = expected(store, 1, self.ROWS)
            self.heard(listener, keys, "every key came")
            self.assertEqual(set(listener.keys()), set(keys))
            self.assertLessEqual(len(listener.keys()) - self.ROWS, window * kills)
            self.assertEqual(holes(listener.all("result")), {})

    def test_catching_up_is_complete(self):
        rows = 20_000
        store = make_store("rate.db", rows)
        with Broker() as broker, Listener(broker.port) as listener:
            finished = forward_once(broker.url, store)
            self.assertEqual(finished.status, 0, finished)
            self.heard(listener, expected(store, 1, rows), "every key came")
            self.assertEqual(len(listener.keys()), rows)
            print(f"\n{rows} results in {finished.seconds:.1f} s, {rows / finished.seconds:.0f}/s", file=sys.stderr)

    def test_a_broker_that_forgets_is_seen_by_its_listener_and_filled_by_replay(self):
        store = make_store("crash.db", 300)
        with Broker() as broker:
            with Listener(broker.port) as listener:
                self.assertEqual(forward_once(broker.url, store).status, 0)
                self.heard(listener, expected(store, 1, 300), "what was there came")
                messages = listener.all("result")
            # Acknowledged for a listener that is away, and gone with the broker.
            tell_more(store, 301, 400)
            self.assertEqual(forward_once(broker.url, store).status, 0)
            broker.kill()
            broker.start()
            with Listener(broker.port) as listener:
                tell_more(store, 401, 420)
                self.assertEqual(forward_once(broker.url, store).status, 0)
                self.heard(listener, expected(store, 401, 420), "what came behind the crash")
                self.assertEqual(holes([*messages, *listener.all("result")]), {"plant/busy/result": [(300, 400)]})
                finished = forward_once(broker.url, store, "--from", "301")
                self.assertEqual(finished.status, 0, finished)
                self.heard(listener, expected(store, 301, 420), "the hole is filled")


class RefusalTest(ForwardTest):
    """Figure 9."""

    def test_a_forbidden_topic_keeps_everything_and_says_why(self):
        store = make_store("forbidden.db", 50)
        with tempfile.TemporaryDirectory() as folder:
            rules = pathlib.Path(folder) / "acl"
            rules.write_text("topic read plant/#\ntopic write plant/_collector/#\n")
            os.chmod(rules, 0o644)
            with Broker(f"acl_file {rules}") as broker, Listener(broker.port) as listener:
                once = forward_once(broker.url, store)
                self.assertEqual(once.status, 6, once)
                with forwarding(broker.url, store) as running:
                    error = json.loads(running.line(LONG))
                    self.assertEqual(error["type"], "error")
                    self.assertIn("'plant/busy/result': not authorized (135)", error["message"])
                    self.assertEqual(sinks_of(store)[broker.url]["waiting"], 50)
                    self.assertEqual(listener.keys(), [])
                    rules.write_text("topic readwrite plant/#\n")
                    broker.reload()
                    self.heard(listener, expected(store, 1, 50), "all comes once it may")
                    running.send_signal(signal.SIGTERM)
                    finished = self.ended(running)
                    self.assertEqual(finished.stderr.count("'plant/busy/result': not authorized (135)"), 1, finished)

    def test_a_sink_that_cannot_be_reached_ends_once_with_its_status(self):
        store = make_store("nowhere.db", 3)
        with support.refusing_port() as nowhere:
            finished = forward_once(mqtt(nowhere), store)
            self.assertEqual(finished.status, 4, finished)
        with Broker() as broker, Listener(broker.port) as listener, support.refusing_port() as nowhere:
            both = tools_file("both.yaml", plant={"url": [mqtt(nowhere), broker.url]})
            finished = forward_once("plant", store, "--tools", both)
            self.assertEqual(finished.status, 0, finished)
            self.heard(listener, expected(store, 1, 3), "the second broker got it")

    def test_sinks_that_make_no_sense_are_refused(self):
        store = make_store("senseless.db", 3)
        for url, words in (
            ("mqtt://me:secret@127.0.0.1/plant", "a password may not stand in a URL"),
            ("mqtt://127.0.0.1/a/+/b", "'+' or '#'"),
            ("mqtt://127.0.0.1:0/a", "the port is none of 1 to 65535"),
            ("http://127.0.0.1/a", "no URL of a sink"),
            ("plant", "there is no sink 'plant'"),
        ):
            finished = forward_once(url, store)
            self.assertEqual(finished.status, 2, finished)
            self.assertIn(words, finished.said)
            self.assertNotIn("secret", finished.said)


class EncryptionTest(ForwardTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = tempfile.TemporaryDirectory()
        cls.certificates = Certificates(cls.folder.name)
        cls.store = make_store("tls.db", 3)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()
        super().tearDownClass()

    def broker(self, server, *lines, **options):
        certificate, key = server
        return Broker(*lines, listener=(f"cafile {self.certificates.authority}", f"certfile {certificate}",
                                        f"keyfile {key}"), **options)

    def attempt(self, broker, **settings):
        url = f"mqtts://{settings.pop('host', '127.0.0.1')}:{broker.port}/plant"
        file = tools_file("tls.yaml", plant={"url": url, **settings})
        return forward_once("plant", self.store, "--tools", file, "--from", "1")

    def test_the_certificate_has_to_be_of_the_authority_and_of_the_host(self):
        ours = {"ca-file": str(self.certificates.authority)}
        with self.broker(self.certificates.server) as broker:
            self.assertEqual((good := self.attempt(broker, **ours)).status, 0, good)
            self.assertEqual((good := self.attempt(broker, host="localhost", **ours)).status, 0, good)
            wrong = self.attempt(broker, **{"ca-file": str(self.certificates.stranger)})
            self.assertEqual(wrong.status, 4, wrong)
            self.assertIn("certificate verify failed", wrong.said)
            system = self.attempt(broker)
            self.assertEqual(system.status, 4, system)
            self.assertIn("certificate verify failed", system.said)
            missing = self.attempt(broker, **{"ca-file": "not-there.pem"})
            self.assertEqual(missing.status, 3, missing)
        with self.broker(self.certificates.elsewhere) as broker:
            wrong = self.attempt(broker, **ours)
            self.assertEqual(wrong.status, 4, wrong)
            self.assertIn("host name verification failed", wrong.said)

    def test_a_client_has_to_show_its_certificate_where_the_broker_asks(self):
        certificate, key = self.certificates.client
        ours = {"ca-file": str(self.certificates.authority)}
        with self.broker(self.certificates.server, "require_certificate true") as broker:
            good = self.attempt(broker, **ours, **{"cert-file": str(certificate), "key-file": str(key)})
            self.assertEqual(good.status, 0, good)
            none = self.attempt(broker, **ours)
            self.assertIn(none.status, (4, 5), none)
            self.assertIn("certificate", none.said)

    def test_a_password_comes_from_a_file_of_its_own(self):
        folder = pathlib.Path(self.folder.name)
        passwords = folder / "passwords"
        passwords.write_text("line1:open-sesame\n")
        support.completed(["mosquitto_passwd", "-U", str(passwords)], check=True, capture_output=True)
        right, wrong = folder / "right", folder / "wrong"
        for file, text in ((right, "open-sesame\n"), (wrong, "close-sesame\n")):
            file.write_text(text)
            os.chmod(file, 0o600)
        ours = {"ca-file": str(self.certificates.authority), "user": "line1"}
        with self.broker(self.certificates.server, f"password_file {passwords}", anonymous=False) as broker:
            good = self.attempt(broker, **ours, **{"password-file": str(right)})
            self.assertEqual(good.status, 0, good)
            bad = self.attempt(broker, **ours, **{"password-file": str(wrong)})
            self.assertEqual(bad.status, 6, bad)
            self.assertIn("(135)", bad.said)
            os.chmod(right, 0o644)
            open_to_all = self.attempt(broker, **ours, **{"password-file": str(right)})
            self.assertEqual(open_to_all.status, 3, open_to_all)
            self.assertIn("a secret that all users of this computer can read", open_to_all.said)
            for finished in (good, bad, open_to_all):
                self.assertNotIn("sesame", finished.stdout + finished.stderr)


class CareTest(ForwardTest):
    def test_trim_waits_for_a_sink_until_it_is_forgotten(self):
        store = make_store("lag.db", 20)
        with support.refusing_port() as nowhere:
            url = mqtt(nowhere)
            self.assertEqual(forward_once(url, store).status, 4)
        trim = ("store", "trim", "--before", "now", "--store", store, "--yes")
        refused = support.run(*trim)
        self.assertEqual(refused.status, 2, refused)
        self.assertIn(f"store forget {url}", refused.said)
        self.assertEqual(support.run("store", "forget", url, "--store", store).status, 2)
        unknown = support.run("store", "forget", "plant", "--store", store, "--yes")
        self.assertEqual(unknown.status, 2, unknown)
        self.assertIn("'spindle store sinks'", unknown.said)
        forgotten = support.run("store", "forget", url, "--store", store, "--yes")
        self.assertEqual(forgotten.status, 0, forgotten)
        self.assertEqual(support.run(*trim).status, 0)

    def test_what_a_sink_has_not_got_is_left_out_only_when_that_is_said(self):
        store = make_store("skip.db", 20)
        with Broker() as broker, Listener(broker.port) as listener:
            with support.refusing_port() as nowhere:
                places = tools_file("places.yaml", plant={"url": [mqtt(nowhere)]})
                self.assertEqual(forward_once("plant", store, "--tools", places).status, 4)
            places = tools_file("places.yaml", plant={"url": broker.url})
            refused = forward_once("plant", store, "--tools", places, "--from", "15")
            self.assertEqual(refused.status, 2, refused)
            self.assertIn("14 events", refused.said)
            said = forward_once("plant", store, "--tools", places, "--from", "15", "--yes")
            self.assertEqual(said.status, 0, said)
            self.heard(listener, expected(store, 15, 20), "the rest came")
            self.assertEqual(set(listener.keys()), set(expected(store, 15, 20)))

    def test_counters_for_a_monitoring_system(self):
        store = make_store("count.db", 20)
        counters = support.home().path / "forward.prom"
        with Broker() as broker:
            self.assertEqual(forward_once(broker.url, store, "--metrics", counters).status, 0)
        text = counters.read_text()
        self.assertIn(f'spindle_sink_delivered_total{{sink="{broker.url}"}} 20\n', text)
        self.assertIn(f'spindle_sink_backlog{{sink="{broker.url}"}} 0\n', text)

    def test_faults_of_sinks_are_told_with_their_place(self):
        file = support.home().path / "faults.yaml"
        file.write_text("tools: {a: {url: 'tcp://127.0.0.1'}}\nsinks:\n  plant: {url: 'mqtt://a:b@c', window: 0}\n"
                        "  base: {url: 'postgresql://host/db', window: 5, colour: red}\n")
        finished = support.run("tools", "--check", "--tools", file, "--json")
        self.assertEqual(finished.status, 3, finished)
        told = {(record["line"], record["message"].split(";")[0]) for record in finished.records("finding")}
        self.assertIn((3, "a password may not stand in a URL"), told)
        self.assertIn((3, "it is 1 at least"), told)
        self.assertIn((4, "'window' is about sinks of kind mqtt"), told)
        self.assertTrue(any("colour" in message for _, message in told), told)


if __name__ == "__main__":
    unittest.main()
