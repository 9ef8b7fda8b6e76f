"""Every misbehaviour of hostile_table.json against every command that it can reach.

Whatever a server does, a command ends in time with the right value or with a clear error, and a
wrong value is never printed.
"""

import struct
import collections
import concurrent.futures
import contextlib
import decimal
import json
import pathlib
import re
import unittest

import hostile_server
import support

TABLE = json.loads(pathlib.Path(__file__).with_name("hostile_table.json").read_text("utf-8"))
TIMEOUT_MS = 500
CONNECT_TIMEOUT = 1.0
SIDE_BY_SIDE = 8
AGAIN = 3
SUMMARISED = {"set", "do", "ping"}
NEW_TORQUE = 280
CODES = {
    2: "usage",
    4: "unreachable",
    5: "no_answer",
    6: "refused",
    7: "malformed",
    8: "mismatch",
}

CODES_OF = {name: status for status, name in CODES.items()}


def expanded(argument, url):
    """'p{300..359}=1' stands for sixty arguments."""
    if argument == "URL":
        return [url]
    found = re.fullmatch(r"(.*)\{(\d+)\.\.(\d+)\}(.*)", argument)
    if not found:
        return [argument]
    before, first, last, behind = found.groups()
    numbers = range(int(first), int(last) + 1)
    return [f"{before}{number:0{len(first)}}{behind}" for number in numbers]


class Ordeal:
    """One command against one row: what was said, asked and stored."""

    def __init__(self, row, command):
        self.row = row
        self.command = command
        self.verb = command.split("-")[0]

    def run(self):
        with contextlib.ExitStack() as stack:
            self.server = stack.enter_context(hostile_server.HostileServer(self.row))
            self.before = hostile_server.Tool(**self.row.get("tool", {}))
            url = self.server.url
            if self.row.get("accept") == "full":
                url, _ = stack.enter_context(support.full_backlog())
            arguments = [
                word for given in TABLE["commands"][self.command] for word in expanded(given, url)
            ]
            timeout = f"{self.row.get('timeout_ms', TIMEOUT_MS)}ms"
            self.finished = support.run(*arguments, "--timeout", timeout, *TABLE["options"])
            self.requests = list(self.server.requests)
        return self


class Judge:
    """Collects everything that is wrong with the outcome of one ordeal."""

    def __init__(self, ordeal, expected):
        self.ordeal = ordeal
        self.expected = expected
        self.faults = []
        self.records = []
        self.too_long = False

    def may_be_late(self):
        """Whether an answer was missed where one was to come, or the end took too long."""
        missed = '"code":"no_answer"' in self.ordeal.finished.stdout and CODES_OF["no_answer"] not in self.expected
        return missed or self.too_long

    def judge(self):
        self.check_status_and_time()
        self.check_wire()
        self.check_output()
        return self.faults

    def demand(self, condition, fault):
        if not condition:
            self.faults.append(fault)
        return condition

    # - how it ended

    def check_status_and_time(self):
        finished, row = self.ordeal.finished, self.ordeal.row
        self.demand(
            finished.status in self.expected, f"status {finished.status}, not of {self.expected}"
        )
        allowed = row.get("waits", 2) * row.get("timeout_ms", TIMEOUT_MS) / 1000 + support.SOON
        if row.get("accept") == "full":
            allowed = CONNECT_TIMEOUT + support.SOON
        self.too_long = finished.paced > allowed
        self.demand(not self.too_long, f"{finished.paced:.2f} s, allowed {allowed:.2f} s")
        said = [line for line in finished.stderr.split("\n") if line.startswith("spindle: ")]
        if finished.status == 0:
            self.demand(not said, f"success with an error sentence {said}")
        else:
            self.demand(said, "a failure without a sentence on standard error")

    # - what was sent

    def check_wire(self):
        server, requests = self.ordeal.server, self.ordeal.requests
        self.demand(not server.faults_of_client, f"sent no Modbus: {server.faults_of_client}")
        # A read goes out once more as it was, on a connection of its own, where the first one was closed.
        sent = collections.Counter(request.bytes for request in requests)
        reads = (0x03, 0x04, 0x11)
        for request in requests:
            most = 2 if request.function in reads else 1
            self.demand(sent[request.bytes] <= most, f"sent {sent[request.bytes]} times: {request}")
        ids = [struct.unpack_from(">H", frame)[0] for frame in sent]
        self.demand(len(set(ids)) == len(ids), f"transaction ids repeat: {ids}")
        for request in requests:
            plain = request.protocol == 0 and request.unit == 0 and request.transaction >= 0x8000
            self.demand(plain, f"an unusual header: {request}")
            known = request.function in (0x03, 0x04, 0x06, 0x11)
            self.demand(known, f"an unknown function: {request}")
            event_like = request.function == 0x04 and request.words[1] == 14
            self.demand(not event_like, f"a read whose answer looks like an event: {request}")
        self.check_writes([request.words for request in requests if request.function == 0x06])
        self.check_cuts()

    def check_writes(self, writes):
        command = self.ordeal.command
        if command == "do":
            self.demand(writes in ([], [(4002, 1)]), f"an action was sent as {writes}")
        elif command == "set":
            lost = "store" in self.ordeal.row or self.ordeal.row.get("result") is None
            allowed = 2 if lost else 1
            right = all(words == (2, NEW_TORQUE) for words in writes)
            self.demand(right and len(writes) <= allowed, f"writes {writes}")
        elif command != "set-many":
            self.demand(not writes, f"{command} wrote {writes}")

    def check_cuts(self):
        """Where answers were to be cut everywhere, they have been."""
        if self.ordeal.row.get("cut") != "every":
            return
        wanted = {"get-many": 0x03, "set-many": 0x06, "ping-many": 0x11}[self.ordeal.command]
        sizes = {size for _, size in self.ordeal.server.cuts[wanted]}
        done = {at for at, _ in self.ordeal.server.cuts[wanted]}
        self.demand(len(sizes) == 1, f"answers of different sizes {sizes}")
        self.demand(done >= set(range(1, min(sizes))), f"not cut at every byte: {sorted(done)}")

    # - what was printed

    def check_output(self):
        try:
            self.records = self.ordeal.finished.records()
        except (ValueError, KeyError) as error:
            self.faults.append(f"standard output is not JSON lines: {error}")
            return
        for record in self.records:
            head = list(record)[:4] == ["schema", "type", "time", "target"]
            self.demand(head and record["schema"] == "spindle/1", f"an unusual head: {record}")
            check = getattr(self, f"check_{record['type']}", None)
            if self.demand(check, f"a record of type {record['type']}"):
                check(record)
        self.check_last()
        self.check_completeness()

    def check_last(self):
        status = self.ordeal.finished.status
        if not self.demand(self.records, "nothing on standard output"):
            return
        last = self.records[-1]
        summaries = [record for record in self.records if record["type"] == "summary"]
        if summaries:
            alone = len(summaries) == 1 and last["type"] == "summary"
            self.demand(alone and self.ordeal.verb in SUMMARISED, f"summaries {summaries}")
            self.demand(last.get("exit_status") == status, f"the summary says {last}")
        elif status == 0:
            self.demand(self.ordeal.verb not in SUMMARISED, "no summary at the end")
        else:
            errors = [record for record in self.records if record["type"] == "error"]
            told = errors and (errors[-1]["exit_status"] == status or status == 9)
            self.demand(told, "the error does not bear the exit status")

    def check_completeness(self):
        """Success means that all that was asked for stands there."""
        if self.ordeal.finished.status != 0:
            return
        counts = {}
        for record in self.records:
            counts[record["type"]] = counts.get(record["type"], 0) + 1
        wanted = {
            "get": {"value": 4},
            "get-unnamed": {"value": 2},
            "get-raw": {"value": 2},
            "get-events": {"value": 28},
            "get-many": {"value": 60},
            "set": {"write": 1, "summary": 1},
            "set-many": {"write": 60, "summary": 1},
            "identify": {"identity": 1},
            "ping": {"ping": 2, "summary": 1},
            "ping-many": {"ping": 60, "summary": 1},
            "do": {"action": 1, "summary": 1},
        }[self.ordeal.command]
        self.demand(counts == wanted, f"records {counts}, not {wanted}")

    def check_value(self, record):
        tool, table, register = self.ordeal.before, record["table"], record["register"]
        word = tool.table(table)[register]
        self.demand(record["raw"] == [word], f"WRONG VALUE {record}, the tool has {word}")
        right = tool.value(record["name"], table, register)
        self.demand(
            decimal.Decimal(record["value"]) == right, f"WRONG VALUE {record}, the tool has {right}"
        )
        for side, offset in (("minimum", 1000), ("maximum", 2000)):
            limit = record.get(side)
            if limit is not None:
                word = tool.holding.get(register + offset) if table == "holding" else None
                right = word is not None and decimal.Decimal(word).scaleb(-2)
                self.demand(decimal.Decimal(limit) == right, f"WRONG LIMIT {side} {record}")

    def check_identity(self, record):
        raw = self.ordeal.before.identity
        self.demand(record["raw"] == raw.hex().upper(), f"WRONG IDENTITY {record}")
        firmware = int.from_bytes(raw[6:8], "big")
        if record["profile"] is not None or record["firmware"] is not None:
            self.demand(record["firmware"] == firmware, f"WRONG FIRMWARE {record}")
        fits = 12 <= len(raw) and 0 < firmware < 4000 and int.from_bytes(raw[4:6], "big") <= 10
        candidates = record["profile_candidates"]
        self.demand(("doga-bm" in candidates) == fits, f"WRONG PROFILE {record}")
        self.demand(fits or (record["profile"] is None and record["notes"]), f"no note: {record}")
        if len(raw) == 12 and fits:
            serial = str(int.from_bytes(raw[8:12], "big"))
            self.demand(record["serial"] == serial, f"WRONG SERIAL {record}")

    def check_write(self, record):
        register = record["register"]
        asked = NEW_TORQUE if self.ordeal.command == "set" else 4000
        scale = -2 if self.ordeal.command == "set" else 0
        before = decimal.Decimal(self.ordeal.before.holding[register]).scaleb(scale)
        now = decimal.Decimal(self.ordeal.server.tool.holding[register]).scaleb(scale)
        wanted = decimal.Decimal(asked).scaleb(scale)
        result = record["result"]
        self.demand(decimal.Decimal(record["old"]) == before, f"WRONG OLD VALUE {record}")
        known = result != "unknown"
        self.demand(not known or decimal.Decimal(record["new"]) == now, f"WRONG NEW VALUE {record}, is {now}")
        right = {
            "unknown": self.ordeal.finished.status != 0 and "reading it back failed" in self.ordeal.finished.said
            or "is not known" in self.ordeal.finished.said,
            "written": now == wanted,
            "unchanged": now == before == wanted,
            "mismatch": now == before != wanted,
            "coerced": now not in (before, wanted),
            "refused": now == before,
        }.get(result, False)
        self.demand(right, f"WRONG RESULT {record}: asked {wanted}, was {before}, is {now}")
        named = self.ordeal.row.get("result", result)
        self.demand(result == named, f"result {result}, not {named}")

    def check_action(self, record):
        done = self.ordeal.server.tool.actions.get(4002) == 1
        right = record["action"] == "auto-output" and record["value"] == 1
        self.demand(right and done, f"WRONG ACTION {record}")

    def check_ping(self, record):
        self.demand(record["round_trip_ms"] >= 0, f"WRONG TIME {record}")

    def check_summary(self, record):
        if self.ordeal.verb == "ping":
            pings = sum(other["type"] == "ping" for other in self.records)
            self.demand(record["received"] == pings, f"WRONG COUNT {record}, pings {pings}")

    def check_error(self, record):
        self.demand(
            CODES.get(record["exit_status"]) == record["code"], f"code and status differ: {record}"
        )
        self.demand("\n" not in record["message"] and record["message"], f"message {record}")
        exception = self.ordeal.row.get("exception")
        if exception is not None:
            self.demand(record.get("exception") == exception, f"WRONG EXCEPTION {record}")


def ordeals():
    for row in TABLE["rows"]:
        for commands, statuses in row["expect"].items():
            for command in commands.split():
                yield row, command, statuses


class TableTest(unittest.TestCase):
    def test_rows_are_told_apart_and_reach_known_commands(self):
        names = [row["name"] for row in TABLE["rows"]]
        self.assertEqual(len(set(names)), len(names))
        for row, command, statuses in ordeals():
            self.assertIn(command, TABLE["commands"], row["name"])
            self.assertTrue(statuses, row["name"])


class HostileTest(unittest.TestCase):
    """Its tests are made from the rows below. They run side by side: most of their time is waiting."""

    @classmethod
    def setUpClass(cls):
        cls.pool = concurrent.futures.ThreadPoolExecutor(SIDE_BY_SIDE)
        cls.ordeals = {
            (row["name"], command): cls.pool.submit(Ordeal(row, command).run)
            for row, command, _ in ordeals()
        }

    @classmethod
    def tearDownClass(cls):
        cls.pool.shutdown(cancel_futures=True)

    def judged(self, row, command, statuses):
        """An ordeal, and what is wrong with it. An answer that a busy machine holds up past its timeout is none
        for the program: then it is put to it again, without others beside it, also where it ended before the row was
        reached. A wrong value is never tried away."""
        ordeal = self.ordeals[row["name"], command].result()
        for _ in range(AGAIN):
            judge = Judge(ordeal, statuses)
            faults = judge.judge()
            if any(fault.startswith("WRONG") for fault in faults):
                break
            if self.is_reached(row, ordeal) and (not faults or not judge.may_be_late()):
                break
            ordeal = Ordeal(row, command).run()
        return ordeal, Judge(ordeal, statuses).judge()

    @staticmethod
    def is_reached(row, ordeal):
        return not row.get("on") or ordeal.server.misbehaved > 0

    def judge(self, row):
        for commands, statuses in row["expect"].items():
            for command in commands.split():
                ordeal, faults = self.judged(row, command, statuses)
                with self.subTest(command=command):
                    self.assertFalse(ordeal.server.own_faults, "\n".join(ordeal.server.own_faults))
                    self.assertTrue(self.is_reached(row, ordeal), f"the row was not reached: {ordeal.finished}")
                    told = "\n  ".join(faults)
                    self.assertFalse(
                        faults, f"\n  {told}\n{ordeal.finished}\n  asked: {ordeal.requests[:12]}"
                    )


def add_tests():
    for row in TABLE["rows"]:
        name = "test_" + re.sub(r"\W+", "_", row["name"]).strip("_")
        setattr(HostileTest, name, lambda self, row=row: self.judge(row))


add_tests()

if __name__ == "__main__":
    unittest.main()
