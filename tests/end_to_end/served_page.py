"""`spindle serve` without tools, as a browser or another program meets it."""

import contextlib
import http.client
import json
import os
import pathlib
import re
import socket
import sqlite3
import threading

import support

PROGRAMS = pathlib.Path(os.environ.get("SPINDLE_PEER_PROGRAMS", support.ROOT / "build/dev/tests"))
MAKER = PROGRAMS / "spindle_peer_sample_store"


def make_store(path, *numbers):
    """The sample store; with two numbers, a tool that tells them, in one that may be there already."""
    support.completed([MAKER, path, *map(str, numbers)], check=True)


def last_ids(path):
    """The position at the end of a store, read by a program that knows nothing of ours."""
    with contextlib.closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as store:
        return "e{}.g{}.h{}".format(
            *(store.execute(f"SELECT ifnull(max(id), 0) FROM {table}").fetchone()[0] for table in ("event", "gap", "happening"))
        )


class Answer:
    def __init__(self, response):
        self.status, self.headers = response.status, response.headers
        self.text = response.read().decode()

    def json(self):
        return support.parse_json(self.text)


class Page(support.Running):
    """A page that is served on a free port of its own."""

    def __init__(self, store, *flags, listen="127.0.0.1:0", environment=None):
        super().__init__("serve", "--store", store, "--listen", listen, *flags, environment=environment)
        if not support.is_readable(self.process.stderr):
            raise AssertionError("the page is not served")
        line = self.process.stderr.readline().decode()
        found = re.search(r"http://(\S+):(\d+) ", line)
        if not found:
            raise AssertionError(f"the page is not served: {line}")
        self.host, self.port = found[1].strip("[]"), int(found[2])
        self.url = f"http://{found[1]}:{found[2]}"

    def connect(self):
        return socket.create_connection((self.host, self.port), support.DEADLINE)

    def ask(self, path="/", method="GET", headers=None, body=None, host=None):
        connection = http.client.HTTPConnection(self.host, self.port, timeout=support.DEADLINE)
        with contextlib.closing(connection):
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            connection.putheader("Host", f"127.0.0.1:{self.port}" if host is None else host)
            for name, value in (headers or {}).items():
                connection.putheader(name, value)
            if body is not None:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            return Answer(connection.getresponse())

    def state(self):
        return self.ask("/api/state").json()

    def metric(self, name):
        return float(re.search(rf"^{re.escape(name)} (\S+)$", self.ask("/metrics").text, re.MULTILINE)[1])

    def cpu_seconds(self):
        fields = pathlib.Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def threads(self):
        return len(os.listdir(f"/proc/{self.pid}/task"))


class Stream:
    """Reads server-sent events in a thread of its own, as a browser would."""

    def __init__(self, page, last=None, headers=None):
        self.events = []
        self._connection = http.client.HTTPConnection(page.host, page.port, timeout=support.DEADLINE)
        sent = {"Host": f"127.0.0.1:{page.port}", "Accept": "text/event-stream", **(headers or {})}
        if last:
            sent["Last-Event-ID"] = last
        self._connection.request("GET", "/events", headers=sent)
        self._socket = self._connection.sock  # the connection forgets it where the answer has no end
        self.response = self._connection.getresponse()
        self.status, self.is_over = self.response.status, False
        self._socket.settimeout(None)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        event = {}
        with contextlib.suppress(OSError, http.client.HTTPException, ValueError, AttributeError):
            while line := self.response.readline():
                line = line.decode().rstrip("\n")
                if not line and "data" in event:
                    self.events.append(event)
                if not line:
                    event = {}
                elif not line.startswith(":"):
                    name, _, value = line.partition(": ")
                    event[name] = value
        self.is_over = True

    def close(self):
        """Breaks off, as a network would."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._reader.join(support.DEADLINE)
        self.response.close()
        self._connection.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def of(self, kind):
        return [event for event in list(self.events) if event["event"] == kind]

    def last(self):
        """The id that a browser would send."""
        return next(event["id"] for event in reversed(list(self.events)) if "id" in event)

    def records(self):
        return [json.loads(event["data"]) for event in self.of("record")]
