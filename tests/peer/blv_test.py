"""Other people's programs against the simulated BLV driver: mbpoll and pymodbus as clients that know
nothing of it, and Wireshark's dissector over what spindle and the driver say to each other."""

import re
import unittest

import support
from support import SPINDLE, spindle

support.need_program("mbpoll", "tshark", "text2pcap")
support.need_module("pymodbus", "serial")

from pymodbus.client import ModbusSerialClient  # noqa: E402  needs what was just asked for
from pymodbus.utilities import checkCRC  # noqa: E402

import tshark_test  # noqa: E402

COMMAND = 125  # lower half of the driver input command


class Drivers(support.Process):
    """Simulated drivers on a pseudo terminal, and a log of what went over it."""

    def __init__(self, *options):
        folder = support.scratch_folder()
        self.path = folder / "line"
        self._log = folder / "log"
        with open(self._log, "wb") as log:
            super().__init__(SPINDLE, "simulate", "orientalmotor-blv", "--pty", self.path, "--units", "1-3", "-v",
                             *options, errors=log)
        if not self.first_line():
            raise RuntimeError(f"the drivers are not served: {self._log.read_text()}")

    def unit(self, number):
        return f"rtu://{self.path}?unit={number}"

    def ask(self, command, unit, *arguments):
        return spindle(command, self.unit(unit), "--profile", "orientalmotor-blv", *arguments)

    def segments(self):
        """As (direction, bytes): 'O' from the client."""
        return [("O" if way == "->" else "I", bytes.fromhex(text))
                for way, text in re.findall(r" (->|<-) ([0-9A-F ]+)$", self._log.read_text(), re.MULTILINE)]


class DriversTest(support.PeerTest):
    def start(self, *options):
        drivers = Drivers(*options)
        self.addCleanup(drivers.stop)
        return drivers

    def value(self, drivers, unit, name):
        outcome = drivers.ask("get", unit, name)
        self.assert_ends(outcome, 0)
        [found] = outcome.of_type("value")
        return found["label"] or found["value"]


class Mbpoll(DriversTest):
    """It keeps no gap of its own to speak of, so the drivers are told to hear it all the same."""

    def setUp(self):
        self.drivers = self.start("--no-gap")

    def mbpoll(self, *arguments, unit=2, values=()):
        return support.mbpoll("rtu", "-a", unit, "-b", "9600", "-P", "even", "-t", "4", *arguments,
                              self.drivers.path, *values)

    def test_reads(self):
        outcome = self.mbpoll("-r", "1152", "-c", "6")
        self.assert_ends(outcome, 0)
        self.assertEqual(support.registers(outcome), {1152: 0, 1153: 0, 1154: 0, 1155: 0, 1156: 0, 1157: 1000})

    def test_writes_one_register_and_pairs(self):
        self.assert_ends(self.mbpoll("-r", "1157", values=["1200"]), 0)  # function 06
        self.assertEqual(self.value(self.drivers, 2, "operation.2.speed"), 1200)
        self.assert_ends(self.mbpoll("-r", "1158", values=["0", "700", "0", "800"]), 0)  # function 10h
        self.assertEqual(self.value(self.drivers, 2, "operation.3.speed"), 700)
        self.assertEqual(self.value(self.drivers, 2, "operation.4.speed"), 800)
        self.assertEqual(self.value(self.drivers, 1, "operation.3.speed"), 0)
        functions = [data[1] for way, data in self.drivers.segments() if way == "O"]
        self.assertLessEqual({0x06, 0x10}, set(functions))

    def test_is_told_what_does_not_exist_or_is_out_of_range(self):
        outcome = self.mbpoll("-r", "9000")
        self.assertIn("Illegal data address", outcome.out + outcome.err)
        outcome = self.mbpoll("-r", "1157", values=["4001"])
        self.assertIn("Slave device or server failure", outcome.out + outcome.err)
        self.assertEqual(self.value(self.drivers, 2, "communication-error.last"), "8Ch")

    def test_a_motor_that_it_starts_is_stopped(self):
        self.assert_ends(self.mbpoll("-r", COMMAND, values=["42"]), 0)
        self.assertIn("MOVE", str(self.value(self.drivers, 2, "status.driver-output")))
        self.assert_ends(self.drivers.ask("remote-stop", 2), 0)
        self.assertNotIn("MOVE", str(self.value(self.drivers, 2, "status.driver-output")))
        outcome = self.mbpoll("-r", COMMAND)
        self.assertEqual(support.registers(outcome), {COMMAND: 0x22})

    def test_what_it_changed_is_found_and_put_back(self):
        file = support.scratch_folder() / "before.yaml"
        self.assert_ends(self.drivers.ask("backup", 2, "-f", file), 0)
        self.assert_ends(self.mbpoll("-r", "1157", values=["1500"]), 0)
        self.assert_ends(self.mbpoll("-r", "646", values=["0", "450"]), 0)
        different = self.drivers.ask("diff", 2, file)
        self.assert_ends(different, 1)
        self.assertEqual({row["name"] for row in different.of_type("diff")},
                         {"operation.2.speed", "motor.jog-speed"}, str(different))
        self.assert_ends(self.drivers.ask("restore", 2, file, "--yes"), 0)
        same = self.drivers.ask("diff", 2, file)
        self.assert_ends(same, 0)
        self.assertEqual(same.of_type("diff"), [])
        self.assertEqual(support.registers(self.mbpoll("-r", "1157")), {1157: 1000})
        self.assertEqual(support.registers(self.mbpoll("-r", "646", "-c", "2")), {646: 0, 647: 300})


class Pymodbus(DriversTest):
    """A client that has function 08 and broadcasts too."""

    def setUp(self):
        self.drivers = self.start("--no-gap")
        self.client = ModbusSerialClient(str(self.drivers.path), baudrate=9600, parity="N", timeout=2,
                                         broadcast_enable=True)
        self.assertTrue(self.client.connect())
        self.addCleanup(self.client.close)

    def test_reads_and_writes(self):
        self.assertEqual(self.client.read_holding_registers(1156, 2, slave=3).registers, [0, 1000])
        self.assertFalse(self.client.write_registers(1156, [0, 1100], slave=3).isError())
        self.assertFalse(self.client.write_register(1159, 600, slave=3).isError())
        self.assertEqual(self.client.read_holding_registers(1156, 4, slave=3).registers, [0, 1100, 0, 600])
        self.assertEqual(self.client.read_holding_registers(9000, 1, slave=3).exception_code, 2)

    def test_broadcasts(self):
        self.client.write_registers(1158, [0, 900], slave=0)
        for unit in (1, 2, 3):
            self.assertEqual(self.client.read_holding_registers(1158, 2, slave=unit).registers, [0, 900])


class Wireshark(support.PeerTest):
    """Both directions of a session with drivers that insist on their silence."""

    @classmethod
    def setUpClass(cls):
        drivers = Drivers()
        try:
            cls.outcomes = [
                drivers.ask("ping", 2, "-c", "2", "--interval", "1ms"),
                drivers.ask("identify", 2),
                drivers.ask("get", 2, "operation.*", "monitor.*"),
                drivers.ask("set", 2, "operation.2.speed=1200"),
                drivers.ask("get", 2, "@holding:9000"),
                drivers.ask("do", 2, "alarm-reset", "--yes"),
                drivers.ask("set", 0, "operation.5.speed=900", "--broadcast", "--yes"),
                drivers.ask("remote-stop", 0, "--broadcast"),
                drivers.ask("remote-start", 2, "--speed", "300", "--for", "200ms", "--yes"),
            ]
        finally:
            drivers.stop()
        cls.segments = drivers.segments()
        # Wireshark takes a frame for unit 0 for anything but Modbus RTU, so those are judged apart.
        dialogue = [segment for segment in cls.segments if segment[1][0] != 0]
        cls.broadcasts = [request for _, data in cls.segments if data[0] == 0 for request in support.rtu_requests(data)]
        capture = tshark_test.rtu_capture(dialogue)
        cls.complaints = capture.complaints()
        cls.rows = capture.rows(tshark_test.RTU_FIELDS)
        cls.ways = [way for way, _ in dialogue]

    def test_commands_ended_as_they_should(self):
        self.assertEqual([outcome.status for outcome in self.outcomes], [0, 0, 0, 0, 6, 0, 0, 0, 0],
                         "\n".join(map(str, self.outcomes)))

    def test_nothing_is_malformed(self):
        self.assertEqual(self.complaints, "")

    def test_every_checksum_and_unit_is_right(self):
        self.assertEqual({(row.get("unit"), row.get("crc")) for row in self.rows}, {("2", tshark_test.CRC_GOOD)})
        self.assertEqual(len(self.rows), len(self.ways))

    def test_every_request_has_its_answer(self):
        self.assertEqual(self.ways, ["O", "I"] * (len(self.ways) // 2))
        functions = [row["function"] for row in self.rows]
        self.assertEqual(functions[::2], functions[1::2])

    def test_broadcasts_have_no_answer(self):
        for data in self.broadcasts:
            self.assertTrue(checkCRC(data[:-2], int.from_bytes(data[-2:], "big")), data.hex(" "))
        self.assertEqual({way for way, data in self.segments if data[0] == 0}, {"O"})
        pairs, *stops = [data[1:-2] for data in self.broadcasts]
        self.assertEqual(pairs, bytes.fromhex("10 048A 0002 04 0000 0384"))
        self.assertEqual(set(stops), {bytes.fromhex("06 007D 0000")})

    def test_requests_are_what_they_should_be(self):
        self.assertLessEqual({"3", "6", "8", "16"}, {row["function"] for row in self.rows})
        pairs = [(row["first"], row["values"]) for way, row in zip(self.ways, self.rows)
                 if way == "O" and row["function"] == "16"]
        self.assertEqual(pairs[0], ("1156", "0,1200"))
        loopbacks = [row for row in self.rows if row["function"] == "8"]
        self.assertEqual({row["sub_function"] for row in loopbacks}, {"0"})
        self.assertEqual([row["exception"] for row in self.rows if "exception" in row], ["2"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
