"""The page of `spindle serve` as programs meet it: streams without holes, who may see it, and clients that
behave badly."""

import contextlib
import json
import pathlib
import re
import shutil
import signal
import socket
import tempfile
import unittest

import support
from served_page import Page, Stream, last_ids, make_store

TOKEN = "an-example-of-a-token+/=0123"
STREAMS = 48


class Served(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-page-"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.store = self.folder / "events.db"

    def serve(self, *flags, **options):
        page = Page(self.store, *flags, **options)
        self.addCleanup(page.__exit__)
        return page

    def stream(self, page, last=None, **options):
        stream = Stream(page, last, **options)
        self.addCleanup(stream.close)
        return stream

    def joined(self, page, count, last=None):
        """Streams that were told what is the case."""
        streams = [self.stream(page, last) for _ in range(count)]
        for stream in streams:
            support.wait_until(lambda s=stream: s.of("view"), "a stream begins")
        return streams


class StreamsTest(Served):
    def test_forty_streams_that_are_cut_miss_nothing_and_get_nothing_twice(self):
        make_store(self.store, 1, 5)
        page = self.serve()
        streams = self.joined(page, 40)
        told = [[] for _ in streams]
        for first in range(6, 46, 10):
            make_store(self.store, first, first + 9)
            if first == 16:
                for at, stream in enumerate(streams):
                    stream.close()
                    told[at] += stream.of("record")
                    last = stream.last()
                    make_store(self.store, 1000 + at, 1000 + at) if at % 10 == 0 else None
                    streams[at] = self.stream(page, last)
        make_store(self.store, 2000, 2000)
        end = last_ids(self.store)
        for at, stream in enumerate(streams):
            support.wait_until(lambda s=stream: s.events and s.last() == end, "a stream is at the end")
            records = [json.loads(event["data"]) for event in told[at] + stream.of("record")]
            self.assertEqual([record["id"] for record in records], list(range(6, int(end[1:].split(".")[0]) + 1)))
        for stream in streams:
            stream.close()
        support.wait_until(lambda: page.metric("spindle_page_streams") == 0, "the streams are freed")

    def test_ids_go_over_events_gaps_and_happenings(self):
        make_store(self.store)
        page = self.serve()
        everything = support.run("results", "--store", self.store, "--json")
        self.assertEqual(everything.status, 0, everything)
        kinds = ("event", "gap")
        wanted = [record for record in everything.records() if record["type"] in kinds]
        end = last_ids(self.store)
        for cut in range(0, 6):
            # As far as a listener got that was cut off: from there on, and no further.
            stream = self.joined(page, 1, "e0.g0.h0")[0]
            support.wait_until(lambda s=stream: s.last() == end, "all was told")
            events = stream.of("record")
            rest = self.joined(page, 1, events[cut * 2]["id"])[0]
            support.wait_until(lambda s=rest: s.last() == end, "the rest was told")
            self.assertEqual(rest.of("record"), events[cut * 2 + 1:])
            stream.close()
            rest.close()
        told = [support.parse_json(event["data"]) for event in events]
        self.assertEqual([record["type"] for record in told if record["type"] not in kinds], ["link", "total", "total"])
        key = lambda record: (record["type"], record.get("id", 0), record["time"])  # noqa: E731
        self.assertEqual(sorted((r for r in told if r["type"] in kinds), key=key), sorted(wanted, key=key))

    def test_what_came_while_the_page_itself_was_away_is_told(self):
        make_store(self.store, 1, 5)
        first = self.serve()
        last = self.joined(first, 1)[0].last()
        first.send_signal(signal.SIGKILL)
        first.finish()
        make_store(self.store, 6, 9)
        rest = self.joined(self.serve(), 1, last)[0]
        self.assertEqual([record["number"] for record in rest.records()], [6, 7, 8, 9])

    def test_an_id_of_another_store_shows_what_is_the_case(self):
        make_store(self.store, 1, 5)
        page = self.serve()
        for last in ("e99.g0.h0", "nonsense", "e1.g2"):
            stream = self.joined(page, 1, last)[0]
            self.assertEqual(stream.last(), "e5.g0.h0")
            self.assertEqual(stream.records(), [])

    def test_the_49th_stream_is_refused_and_all_else_is_answered(self):
        make_store(self.store, 1, 5)
        page = self.serve()
        streams = self.joined(page, STREAMS)
        with Stream(page) as refused:
            self.assertEqual(refused.status, 503)
            self.assertEqual(refused.response.headers["Retry-After"], "5")
        self.assertEqual(page.ask("/").status, 200)
        threads = page.threads()
        streams.pop().close()
        support.wait_until(lambda: page.metric("spindle_page_streams") == STREAMS - 1, "one stream is freed")
        self.joined(page, 1)
        self.assertLessEqual(page.threads(), threads)

    def test_it_ends_at_once_with_streams_that_are_open(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            with self.subTest(number):
                make_store(self.store, 1, 2)
                page = self.serve()
                streams = self.joined(page, 10)
                with contextlib.closing(page.connect()) as silent, contextlib.closing(page.connect()) as deaf:
                    deaf.sendall(f"GET /events HTTP/1.1\r\nHost: 127.0.0.1:{page.port}\r\n\r\n".encode())
                    silent.sendall(b"GET / HT")
                    page.send_signal(number)
                    finished = page.finish()
                self.assertEqual((finished.status, finished.stderr), (0, ""))
                self.assertLess(finished.paced, support.SOON)
                for stream in streams:
                    support.wait_until(lambda s=stream: s.is_over, "the stream ends")

    def test_forty_idle_streams_cost_next_to_nothing(self):
        make_store(self.store, 1, 5)
        page = self.serve()
        streams = self.joined(page, 40)
        before = page.cpu_seconds()
        began = len(streams[0].of("now"))
        support.wait_until(lambda: len(streams[0].of("now")) >= began + 2, "two heartbeats", 4 * support.DEADLINE)
        # Some ten seconds passed; a twentieth of a processor would be half a second.
        self.assertLess(page.cpu_seconds() - before, 1)

    def test_a_heartbeat_says_when_the_store_was_read(self):
        make_store(self.store, 1, 5)
        stream = self.joined(self.serve(), 1)[0]
        support.wait_until(lambda: stream.of("now"), "a heartbeat", 2 * support.DEADLINE)
        self.assertRegex(stream.of("now")[0]["data"], r'^"\d\d:\d\d:\d\d"$')


class StoreTest(Served):
    def test_a_store_that_comes_later_is_shown_then(self):
        page = self.serve()
        self.assertIn("There is no store yet", page.ask("/").text)
        self.assertEqual(page.state()["tools"], [])
        stream = self.joined(page, 1)[0]
        make_store(self.store)
        support.wait_until(lambda: any("station1" in event["data"] for event in stream.of("view")), "it is shown")
        self.assertIn("left out: ", page.ask("/").text)

    def test_a_store_that_is_replaced_is_read_from_its_beginning(self):
        make_store(self.store, 1, 5)
        page = self.serve()
        stream = self.joined(page, 1)[0]
        for path in self.folder.glob("events.db*"):
            path.unlink()
        support.wait_until(lambda: "is gone" in page.ask("/").text, "it is gone")
        self.assertEqual(page.metric("spindle_store_readable"), 0)
        make_store(self.store, 1, 8)
        support.wait_until(lambda: stream.of("record") and stream.last() == last_ids(self.store), "it is read")
        numbers = [record["number"] for record in stream.records()]
        self.assertEqual(numbers, list(range(1, 9)))
        # What is read is told at once, and that it could be read behind all of it.
        support.wait_until(lambda: page.metric("spindle_store_readable") == 1, "it can be read")

    def test_a_file_that_is_no_store_is_said_to_be_none(self):
        self.store.write_text("no store")
        page = self.serve()
        self.assertIn("The store cannot be read", page.ask("/").text)
        self.assertEqual(page.metric("spindle_store_readable"), 0)

    def test_a_recorder_and_its_end_are_seen(self):
        page = self.serve()
        with support.simulator("doga-bm", "--rundown-every", "300ms", "--ng-every", "3") as url:
            with support.Running("record", url, "--profile", "doga-bm", "--store", self.store) as recorder:
                tool = support.wait_until(
                    lambda: next((t for t in page.state()["tools"] if t["ok"] > 2 and t["ng"] > 1), None),
                    "results are counted", 3 * support.DEADLINE)
                self.assertEqual((tool["link"], tool["preset"]), ("connected", 1))
                state = page.state()
                self.assertEqual((state["recorder"], state["problem"]), ("running", None))
                self.assertEqual(page.metric("spindle_recorder_up"), 1)
                # What the page counts is what the command counts.
                recorder.send_signal(signal.SIGTERM)
                recorder.finish()
        support.wait_until(lambda: page.state()["recorder"] == "stopped", "its end is seen")
        tool = page.state()["tools"][0]
        self.assertEqual(tool["link"], "unknown")
        done = support.run("results", "--store", self.store, "--json", "--since", "today")
        kinds = [record["kind"] for record in done.records("event") if not record.get("remembered")]
        self.assertEqual((kinds.count("fastening-ok"), kinds.count("fastening-ng")), (tool["ok"], tool["ng"]))
        self.assertIn("Nothing is recorded now", page.ask("/").text)

    def test_a_recorder_can_start_however_often_the_page_looks(self):
        make_store(self.store, 1, 1)
        pages = [self.serve() for _ in range(3)]
        for number in range(2, 12):
            make_store(self.store, number, number)  # fails where the lock is taken
        self.assertEqual(len(pages), 3)


class AccessTest(Served):
    def setUp(self):
        super().setUp()
        make_store(self.store)

    def token_file(self, text=TOKEN + "\n", mode=0o600):
        path = self.folder / "token"
        path.write_text(text)
        path.chmod(mode)
        return path

    def test_paths_are_a_table_and_methods_two(self):
        page = self.serve()
        for path in ("/", "/style.css", "/app.js", "/icon.svg", "/api/state", "/metrics"):
            answer = page.ask(path)
            self.assertEqual(answer.status, 200, path)
            head = page.ask(path, "HEAD")
            self.assertEqual((head.status, head.text), (200, ""), path)
            policy = answer.headers["Content-Security-Policy"]
            self.assertIn("default-src 'none'", policy)
            self.assertNotIn("unsafe", policy)
            self.assertEqual(answer.headers["X-Content-Type-Options"], "nosniff")
        head = page.ask("/events", "HEAD")
        self.assertEqual((head.status, head.headers["Content-Type"]), (200, "text/event-stream"))
        for path in ("/../etc/passwd", "/%2e%2e/etc/passwd", "//", "/index.html", "/events/", "/style.css/x"):
            self.assertEqual(page.ask(path).status, 404, path)
        for method in ("POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "CONNECT", "BREW"):
            answer = page.ask("/", method, body=b"x" * 100_000)
            self.assertEqual((answer.status, answer.headers["Allow"]), (405, "GET, HEAD"), method)

    def test_other_names_for_this_computer_are_refused(self):
        page = self.serve()
        for host in (f"localhost:{page.port}", "127.0.0.1", f"[::1]:{page.port}"):
            self.assertEqual(page.ask(host=host).status, 200, host)
        for host in (f"evil.example:{page.port}", "127.0.0.1.evil.example", ""):
            for path in ("/", "/events", "/api/state", "/metrics"):
                self.assertEqual(page.ask(path, host=host).status, 421, host)

    def test_a_token_is_asked_for_everywhere(self):
        page = self.serve("--token-file", self.token_file())
        for path in ("/", "/events", "/api/state", "/metrics", "/app.js"):
            answer = page.ask(path)
            self.assertEqual(answer.status, 401, path)
            self.assertNotIn("station1", answer.text)
        wrong = ({"Authorization": "Bearer " + TOKEN[:-1]}, {"Authorization": "Basic " + TOKEN},
                 {"Cookie": "spindle="}, {"Cookie": "other=" + TOKEN}, {"Authorization": TOKEN})  # fmt: skip
        for headers in wrong:
            self.assertEqual(page.ask(headers=headers).status, 401, headers)
        self.assertEqual(page.ask("/?token=" + TOKEN[:-1]).status, 401)
        self.assertEqual(page.ask(headers={"Authorization": "Bearer " + TOKEN}).status, 200)
        once = page.ask("/?token=" + TOKEN)
        self.assertEqual((once.status, once.headers["Location"]), (303, "/"))
        cookie = once.headers["Set-Cookie"]
        self.assertIn("HttpOnly", cookie)
        self.assertIn("SameSite=Strict", cookie)
        answer = page.ask(headers={"Cookie": cookie.split(";")[0]})
        self.assertEqual(answer.status, 200)
        self.assertNotIn(TOKEN, answer.text)

    def test_a_token_that_is_no_secret_is_refused(self):
        for text, mode in ((TOKEN, 0o644), (TOKEN, 0o620), ("short", 0o600), (TOKEN + " " + TOKEN, 0o600), ("", 0o600)):
            done = support.run("serve", "--store", self.store, "--token-file", self.token_file(text, mode))
            self.assertEqual(done.status, 3, done)
            self.assertNotIn(TOKEN, done.said)

    def test_other_computers_need_a_token(self):
        done = support.run("serve", "--store", self.store, "--listen", "0.0.0.0:0")
        self.assertEqual(done.status, 2, done)
        self.assertIn("--token-file", done.said)
        page = self.serve("--token-file", self.token_file(), listen="0.0.0.0:0")
        page.host = "127.0.0.1"
        self.assertEqual(page.ask(host="plant.example").status, 401)
        self.assertEqual(page.ask(host="plant.example", headers={"Authorization": "Bearer " + TOKEN}).status, 200)

    def test_a_port_that_is_taken_is_told(self):
        page = self.serve()
        done = support.run("serve", "--store", self.store, "--listen", f"127.0.0.1:{page.port}")
        self.assertEqual(done.status, 4, done)
        self.assertIn("another program listens there", done.said)

    def test_usage(self):
        for flags in (("--shift", "6"), ("--listen", "example.org:80"), ("--listen", "8470")):
            done = support.run("serve", "--store", self.store, *flags)
            self.assertEqual(done.status, 2, done)


class BadClientsTest(Served):
    def setUp(self):
        super().setUp()
        make_store(self.store)

    def test_clients_that_say_nothing_or_take_nothing_hold_up_no_other(self):
        page = self.serve()
        with contextlib.ExitStack() as open_ones:
            for number in range(300):
                client = open_ones.enter_context(contextlib.closing(page.connect()))
                if number % 3 == 1:
                    client.sendall(b"GET / HTTP/1.1\r\nHost: 127")
                elif number % 3 == 2:
                    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
                    client.sendall(f"GET /app.js HTTP/1.1\r\nHost: 127.0.0.1:{page.port}\r\n\r\n".encode())
                if number % 50 == 0:
                    began = support.paced()
                    self.assertEqual(page.ask().status, 200)
                    self.assertLess(support.paced() - began, support.SOON)

    def test_heads_that_are_too_long_or_strange(self):
        page = self.serve()
        local = f"127.0.0.1:{page.port}"

        def say(text):
            with contextlib.closing(page.connect()) as client:
                with contextlib.suppress(OSError):
                    client.sendall(text.encode())
                answer = b""
                with contextlib.suppress(ConnectionResetError):
                    while chunk := client.recv(4096):
                        answer += chunk
                return int((re.match(rb"HTTP/1.1 (\d+)", answer) or [0, b"0"])[1])

        self.assertEqual(say(f"GET / HTTP/1.1\r\nHost: {local}\r\nX: {'x' * 20_000}\r\n\r\n"), 431)
        self.assertEqual(say("GET /" + "x" * 100_000), 431)
        self.assertEqual(say(f"GET / HTTP/1.1\r\nHost: {local}\r\n\r\nGET / HTTP/1.1\r\n\r\n"), 200)
        many = "bytes=" + ",".join("0-0" for _ in range(1800))
        self.assertIn(say(f"GET / HTTP/1.1\r\nHost: {local}\r\nRange: {many}\r\n\r\n"), (200, 416))
        self.assertEqual(say(f"GET / HTTP/1.1\r\nHost: {local}\r\nRange: bytes=0-5\r\n\r\n"), 200)
        for strange in ("GET\r\n\r\n", "\r\n\r\n", "GET / HTTP/9\r\n\r\n", "\x16\x03\x01\x02\r\n\r\n", "GET / HTTP/1.1\r\n\r\n"):
            self.assertNotIn(say(strange), (200, 500), strange)
        self.assertEqual(page.ask().status, 200)

    def test_names_and_barcodes_are_texts(self):
        page = self.serve()
        self.assertNotIn("<script>", page.ask().text.replace('<script src="/app.js" defer></script>', ""))
        for line in page.ask("/metrics").text.splitlines():
            self.assertRegex(line, r"^(#.*|[a-z_]+(\{.*\})? [0-9.]+)$")


if __name__ == "__main__":
    unittest.main()
