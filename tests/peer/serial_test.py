"""Other people's programs on serial lines: spindle against pymodbus's RTU server behind socat, mbpoll
against our simulated line, and Wireshark's dissector over what went over it."""

import re
import time
import unittest

import support
from support import HERE, PROGRAMS, Process, spindle

support.need_program("socat", "mbpoll", "tshark", "text2pcap")
support.need_module("pymodbus", "serial", "serial_asyncio")

import tshark_test  # noqa: E402  needs what was just asked for

DRIVE = HERE.parent / "end_to_end" / "drive.yaml"


def wait_for(condition, what):
    end = time.monotonic() + support.PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError(f"waited in vain: {what}")
        time.sleep(0.01)


class Pymodbus(support.PeerTest):
    """Two pseudo terminals back to back: spindle on the one, pymodbus on the other."""

    @classmethod
    def setUpClass(cls):
        folder = support.scratch_folder()
        near, far = folder / "near", folder / "far"
        cls.cable = Process("socat", f"PTY,link={near},raw,echo=0", f"PTY,link={far},raw,echo=0")
        cls.addClassCleanup(cls.cable.stop)
        wait_for(lambda: near.exists() and far.exists(), "socat's terminals")
        cls.server = Process("/usr/bin/python3", HERE / "pymodbus_rtu_server.py", far)
        cls.addClassCleanup(cls.server.stop)
        if cls.server.first_line() != "serving":
            raise RuntimeError("pymodbus does not serve")
        cls.url = f"rtu://{near}"

    def ask(self, command, unit, *arguments):
        return spindle(command, f"{self.url}?unit={unit}", "--profile", DRIVE, *arguments)

    def test_reads_units_apart(self):
        for unit in (1, 3, 1):
            outcome = self.ask("get", unit, "@holding:7", "@holding:150")
            self.assert_ends(outcome, 0)
            self.assertEqual(outcome.value_of("@holding:7"), 1000 * unit + 7)
            self.assertEqual(outcome.value_of("@holding:150"), 1000 * unit + 150)

    def test_is_told_what_does_not_exist(self):
        self.assert_error(self.ask("get", 1, "@holding:5000"), 6, exception=2)

    def test_pings_by_loop_back(self):
        outcome = self.ask("ping", 1, "-c", "3", "--interval", "10ms")
        self.assert_ends(outcome, 0)
        self.assertEqual(len(outcome.of_type("ping")), 3)

    def test_scans(self):
        outcome = spindle("scan", self.url, "--profile", DRIVE, "--units", "1-4", "--timeout", "300ms")
        self.assert_ends(outcome, 0)
        self.assertEqual([(unit["unit"], unit["answered"]) for unit in outcome.of_type("unit")],
                         [(1, "data"), (3, "data")])

    def test_nobody_at_an_address(self):
        self.assert_error(self.ask("get", 9, "@holding:7", "--timeout", "200ms", "--retries", "0"), 5,
                          code="no_answer")

    def test_parity_that_a_terminal_drops_is_no_obstacle(self):
        for parity in ("even", "odd", "none", "even"):
            outcome = spindle("get", f"{self.url}?unit=1&parity={parity}", "--profile", DRIVE, "@holding:7")
            self.assert_ends(outcome, 0)


class SimulatedLine:
    """spindle's simulated line with a bank of registers on it, and a log of what it heard."""

    def __init__(self, *options):
        self._folder = support.scratch_folder()
        self.path = self._folder / "line"
        self._log = self._folder / "log"
        self._bank = Process(PROGRAMS / "spindle_peer_serial_bank", "--pty", self.path, "--log", self._log,
                             *options)
        self.url = self._bank.first_line()

    def stop(self):
        self._bank.stop()

    def segments(self):
        """As (direction, bytes): 'O' from the client."""
        return [("O" if way == ">" else "I", bytes.fromhex(text))
                for way, text in re.findall(r"^\d+ ([<>]) (.*)$", self._log.read_text(), re.MULTILINE)]


class Mbpoll(support.PeerTest):
    """A generic client, which keeps no gap of its own to speak of."""

    def start(self, *options):
        line = SimulatedLine(*options)
        self.addCleanup(line.stop)
        return line

    def mbpoll(self, line, *arguments, values=()):
        return support.mbpoll("rtu", "-a", "2", "-b", "9600", "-P", "none", "-t", "4", *arguments, line.path, *values)

    def test_reads_and_writes_a_line_without_gaps(self):
        line = self.start("--units", "3", "--no-gap")
        outcome = self.mbpoll(line, "-r", "100", "-c", "4")
        self.assert_ends(outcome, 0)
        self.assertEqual(support.registers(outcome), {100: 100, 101: 101, 102: 102, 103: 103})
        self.assert_ends(self.mbpoll(line, "-r", "1157", values=["1000"]), 0)
        self.assert_ends(self.mbpoll(line, "-r", "1160", values=["7", "8", "9"]), 0)
        seen = spindle("get", f"{line.url}?unit=2", "--profile", DRIVE, "@holding:1157", "@holding:1161")
        self.assertEqual([value["value"] for value in seen.of_type("value")], [1000, 8])

    def test_is_told_what_does_not_exist(self):
        outcome = self.mbpoll(self.start("--units", "2", "--no-gap"), "-r", "9000")
        self.assertIn("Illegal data address", outcome.out + outcome.err)


class Wireshark(support.PeerTest):
    """Both directions of spindle's dialogue on a line."""

    @classmethod
    def setUpClass(cls):
        line = SimulatedLine("--units", "2")
        try:
            unit = f"{line.url}?unit=2"
            cls.outcomes = [
                spindle("get", unit, "--profile", DRIVE, "operation.*"),
                spindle("get", unit, "--profile", DRIVE, "@holding:9000"),
                spindle("set", unit, "--profile", DRIVE, "operation.2.speed=1000"),
                spindle("ping", unit, "--profile", DRIVE, "-c", "2", "--interval", "1ms"),
            ]
        finally:
            line.stop()
        capture = tshark_test.rtu_capture(line.segments())
        cls.complaints = capture.complaints()
        cls.rows = capture.rows(tshark_test.RTU_FIELDS)

    def test_commands_ended_as_they_should(self):
        self.assertEqual([outcome.status for outcome in self.outcomes], [0, 6, 0, 0])

    def test_nothing_is_malformed(self):
        self.assertEqual(self.complaints, "")

    def test_every_checksum_and_unit_is_right(self):
        self.assertEqual({(row["unit"], row["crc"]) for row in self.rows}, {("2", tshark_test.CRC_GOOD)})

    def test_requests_are_what_they_should_be(self):
        functions = [row["function"] for row in self.rows]
        self.assertEqual(functions[::2], functions[1::2])  # each has its answer
        self.assertEqual({row["function"] for row in self.rows}, {"3", "8", "16"})
        reads = [(row["first"], row["count"]) for row in self.rows[:8:2]]
        self.assertEqual(reads, [("1152", "16"), ("1168", "16"), ("1184", "16"), ("1200", "16")])
        writes = [row for row in self.rows if row["function"] == "16" and "values" in row]
        self.assertEqual([(row["first"], row["values"]) for row in writes], [("1156", "0,1000")])
        refused = [row["exception"] for row in self.rows if "exception" in row]
        self.assertEqual(refused, ["2"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
