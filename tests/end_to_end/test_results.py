"""watch against a screwdriver that counts nothing: a flag says that there is a result, and reading clears
it. Nothing but watch reads the flag, and no result is lost in silence where an answer is."""

import contextlib
import struct
import threading
import unittest

import hostile_server
import support
from test_watch import Watching

PROFILE = ("--profile", support.ROOT / "tests/profiles/good/kducer.yaml")
FLAG, BLOCK, BLOCK_SIZE = 294, 295, 67
OK, PROGRAM, TORQUE, SECOND = 303, 304, 318, 351
PARAMETERS = {7371: 1, 7372: 3}


class FlagServer(support.Port):
    """Results stand in registers until the next one; each reading clears the flag."""

    def __init__(self):
        super().__init__()
        self.inputs = dict.fromkeys(range(FLAG, BLOCK + BLOCK_SIZE), 0)
        self.flag_reads = 0
        self.results = 0
        self.mute = []  # first registers of the reads that get no answer, each once
        self.is_simple = False  # silent to whatever is no read or write of registers
        self.gate = None  # what the answer of a flag that was set waits for
        self.behind_flag = []  # torques of results that come right behind a flag that was set
        self._guard = threading.RLock()

    def result(self, torque, ok=True):
        with self._guard:
            self.results += 1
            self.inputs.update({FLAG: 1, OK: int(ok), PROGRAM: 3, TORQUE: torque, SECOND: self.results})

    @property
    def is_waiting(self):
        with self._guard:
            return self.inputs[FLAG] == 1

    def _serve(self, connection):
        buffer = bytearray()
        with contextlib.suppress(OSError):
            while chunk := connection.recv(65536):
                buffer += chunk
                for request in support.take_requests(buffer):
                    self._answer(connection, request)

    def _answer(self, connection, request):
        with self._guard:
            if self.is_simple and request.function == support.REPORT_SERVER_ID:
                return
            is_taken = request.words and request.words[0] == FLAG and self.is_waiting
            function, data = self._read(request)
            if request.words and request.words[0] in self.mute:
                self.mute.remove(request.words[0])
                return
        if is_taken and self.gate:
            support.wait_until(self.gate.is_set, "the gate opens")
        connection.sendall(hostile_server.frame(request.transaction, function, data, unit=1))

    def _read(self, request):
        if request.function not in (support.READ_INPUT, support.READ_HOLDING):
            return request.function | 0x80, b"\x01"
        first, count = request.words
        table = self.inputs if request.function == support.READ_INPUT else PARAMETERS
        words = [table.get(first + at) for at in range(count)]
        if None in words:
            return request.function | 0x80, b"\x02"
        if table is self.inputs and first <= FLAG < first + count:
            self.flag_reads += 1
            was_set, self.inputs[FLAG] = self.inputs[FLAG], 0
            if was_set and self.behind_flag:
                self.result(self.behind_flag.pop(0))
        return request.function, struct.pack(f">B{count}H", 2 * count, *words)


class Results(unittest.TestCase):
    def watch(self, server, *options):
        watching = self.enterContext(Watching(server.url, *PROFILE, "--json", *options))
        support.wait_until(lambda: server.flag_reads >= 1, "the flag was looked at")
        return watching

    def torques(self, watching):
        return [record["torque"] for record in watching.records("event")]

    def wait_for(self, watching, kind, count=1):
        support.wait_until(lambda: len(watching.records(kind)) >= count, f"{count} of {kind}")

    def test_every_result_is_told_once(self):
        with FlagServer() as server:
            watching = self.watch(server)
            for count in range(20):
                server.result(100 + count, ok=count % 5 != 0)
                self.wait_for(watching, "event", count + 1)
            self.assertEqual(watching.end()[0], 143)
            self.assertEqual(self.torques(watching), list(range(100, 120)))
            self.assertEqual(watching.records("gap"), [])
            summary = watching.records("summary")[0]
            self.assertEqual((summary["ok"], summary["ng"]), (16, 4))
            told = [record["message"] for record in watching.records("link") if "cannot be known" in record["message"]]
            self.assertEqual(len(told), 1)

    def test_a_result_that_was_taken_while_another_tool_ended_the_watch(self):
        with FlagServer() as one, FlagServer() as other:
            watching = self.enterContext(Watching(one.url, other.url, *PROFILE, "--json", "--count", "1"))
            support.wait_until(lambda: one.flag_reads and other.flag_reads, "both flags were looked at")
            other.gate = threading.Event()
            other.result(200)
            support.wait_until(lambda: not other.is_waiting, "the flag is taken")
            one.result(100)
            self.wait_for(watching, "event")
            other.gate.set()
            self.assertEqual(watching.end(None)[0], 0)
            self.assertEqual(sorted(self.torques(watching)), [100, 200])
            self.assertEqual(watching.records("gap"), [])
            self.assertEqual(watching.records("summary")[0]["events"], 2)

    def test_nothing_else_reads_the_flag(self):
        with FlagServer() as server:
            server.result(100)
            for words in (["get", server.url], ["get", server.url, "result.*"], ["get", server.url, "result.ok"],
                          ["alarms", server.url], ["backup", server.url, "--file", "k.yaml"]):
                finished = support.run(*words, *PROFILE)
                self.assertEqual(finished.status, 0, finished)
            for name in ("result.new", "@input:294", "@input:293/u32"):
                finished = support.run("get", server.url, name, *PROFILE)
                self.assertEqual(finished.status, 2, finished)
            server.is_simple = True
            finished = support.run("identify", server.url, *PROFILE)
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual(server.flag_reads, 0)
            self.assertTrue(server.is_waiting)
            watching = self.watch(server, "--count", "1")
            self.wait_for(watching, "event")
            self.assertEqual(watching.records("event")[0]["source"], "catch-up")

    def test_a_result_behind_another_is_a_gap(self):
        with FlagServer() as server:
            watching = self.watch(server)
            server.behind_flag = [101]
            server.result(100)
            self.wait_for(watching, "gap")
            self.assertEqual(self.torques(watching), [101])
            self.assertEqual(watching.records("gap")[0]["missed"], 1)

    def test_the_answer_of_the_flag_is_lost(self):
        with FlagServer() as server:
            watching = self.watch(server)
            server.mute = [FLAG]
            server.result(100)
            self.wait_for(watching, "event")
            self.assertEqual(self.torques(watching), [100])
            self.assertEqual(watching.links(), ["connected"])

    def test_the_answer_of_the_result_is_lost(self):
        with FlagServer() as server:
            watching = self.watch(server, "--retries", "0")
            server.mute = [BLOCK]
            server.result(100)
            self.wait_for(watching, "gap")
            self.assertIn("could not be read", watching.records("gap")[0]["reason"])
            self.wait_for(watching, "event")
            self.assertEqual(self.torques(watching), [100])
            self.assertEqual(watching.records("event")[0]["source"], "catch-up")
            server.result(101)
            self.wait_for(watching, "event", 2)
            self.assertEqual(self.torques(watching), [100, 101])


if __name__ == "__main__":
    unittest.main()
