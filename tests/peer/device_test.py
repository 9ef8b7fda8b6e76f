"""Devices that are only a page of YAML, served by pymodbus, whose own builders lay out their values."""

import json
import math
import unittest

import support
from support import HERE, spindle

support.need_module("pymodbus", "serial_asyncio")

EXAMPLES = HERE.parents[1] / "man" / "examples"


class DeviceTest(support.PeerTest):
    FRAMING = "tcp"
    PROFILE = None
    TABLES = {}

    def setUp(self):
        self.server = support.Server("/usr/bin/python3", HERE / "pymodbus_device.py", self.FRAMING,
                                     json.dumps(self.TABLES))
        self.addCleanup(self.server.stop)
        scheme = "tcp" if self.FRAMING == "tcp" else "rtu+tcp"
        self.url = f"{scheme}://127.0.0.1:{self.server.port}?unit=1"

    def ask(self, command, *arguments):
        outcome = spindle(command, self.url, "--profile", self.PROFILE, *arguments)
        self.assert_ends(outcome, 0)
        return outcome

    def values(self, *names):
        return {value["name"]: value["value"] for value in self.ask("get", *names).of_type("value")}

    def labels(self, *names):
        return {value["name"]: value["label"] for value in self.ask("get", *names).of_type("value")}


class EveryEncoding(DeviceTest):
    """The example of spindle-profile(5), which says little-endian words of all that is longer than one."""

    PROFILE = EXAMPLES / "any-device.yaml"
    TABLES = {
        "input": {0: {"f32": 230.4, "order": "little"}, 2: {"u64": 12345678901234, "order": "little"}, 6: [16384],
                  7: [652], 8: {"i32": -1234, "order": "little"}, 10: [2], 11: [0x0012, 0x3456],
                  13: [100, 0xFFFF, 0, 32767]},
        "discrete": {0: [1]},
        "coil": {15: [1], 16: [0], 17: [1]},
        "holding": {0: [0x0051], 1: [0xFE07], 2: [0x0028], 9: {"text": "line 7          "}, 19: [26, 11, 29, 13, 5, 59],
                    29: [0], 30: {"f32": 1.5, "order": "little"}, 32: {"f32": -2.5e-7, "order": "little"}},
    }

    def test_reads_them(self):
        self.assertEqual(self.values(), {
            "voltage": 230.4, "energy": 12345678901.234, "current": 10, "temperature": 25.2, "power": -123400,
            "power-exponent": 2, "counter": 123456, "samples": [1, -0.01, 0, 327.67], "running": 1, "output": 0,
            "control": 0x51, "low-half": 7, "high-half": -2, "bit-field": 5, "line": "line 7",
            "clock": "2026-11-29 13:05:59", "lock": 0, "limit.low": 1.5, "limit.high": -2.5e-7})

    def test_writes_and_pymodbus_reads(self):
        self.ask("set", "output=on", "control.mode=9", "bit-field=2", "high-half=-128", "line=a")
        self.assertEqual(self.server.stored(0), 0x0091)
        self.assertEqual(self.server.stored(1), 0x8007)
        self.assertEqual(self.server.stored(2), 0x0010)
        self.assertEqual((self.server.stored(9), self.server.stored(10)), (0x6120, 0x2020))
        coils = support.modbus_request(self.server.port, bytes((1, 0, 15, 0, 3)), 1)
        self.assertEqual(coils, bytes((1, 1, 0b111)))

    def test_unlocks_for_one_write(self):
        self.ask("set", "limit.low=0.1")
        self.assertEqual((self.server.stored(31), self.server.stored(30)), (0x3DCC, 0xCCCD))
        self.assertEqual(self.server.stored(29), 0)

    def test_raw_addresses(self):
        self.assertEqual(self.values("@coil:15..17", "@discrete:0", "@input:0/f32", "@input:0/f32-le"),
                         {"@coil:15": 1, "@coil:16": 0, "@coil:17": 1, "@discrete:0": 1, "@input:0/f32": 230.4,
                          "@input:0/f32-le": 230.4})


class NoNumber(DeviceTest):
    PROFILE = EXAMPLES / "any-device.yaml"
    TABLES = {"input": {0: [0, 0x7FC0], 7: [0x7FFF], 11: [0x000A, 0]}, "holding": {30: [0, 0x7F80], 32: [0, 0xFF80]}}

    def test_is_told(self):
        values = self.values("voltage", "temperature", "limit.low", "limit.high")
        self.assertEqual(values, dict.fromkeys(("voltage", "temperature", "limit.low", "limit.high")))


class EnergyMeter(DeviceTest):
    FRAMING = "rtu"
    PROFILE = "eastron-sdm72d-m"
    TABLES = {"input": {address: {"f32": 0} for address in [*range(0, 110, 2), 342, 384, 388, 390]} | {
        address: {"f32": value} for address, value in {
            0: 229.75, 2: 230.5, 4: 231.25, 52: -1234.5, 72: 123456.789, 342: 99999.5, 1280: 12,
            1282: 0.0625}.items()}}

    def test_is_read(self):
        values = self.values("voltage.*", "power.total", "energy.import", "energy.total", "power.import", "power.export")
        self.assertEqual([values[f"voltage.l{phase}"] for phase in (1, 2, 3)], [229.8, 230.5, 231.3])
        self.assertEqual(values["power.total"], -1234.5)
        self.assertTrue(math.isclose(values["energy.import"], 123456.789, rel_tol=2 ** -24))
        self.assertEqual(values["energy.total"], 99999.5)
        self.assertEqual((values["power.import"], values["power.export"]), (12, 0.1))


class Screwdriver(DeviceTest):
    PROFILE = "kolver-kducer"
    RESULT = [0] * 67
    RESULT[8:10] = [1, 3]
    RESULT[11:13] = [0x0012, 0xD687]
    RESULT[23] = 152
    RESULT[35] = 13
    RESULT[51:57] = [26, 11, 29, 8, 30, 1]
    TABLES = {"input": {294: [1], 295: RESULT, 370: {"text": "KDU-1A v37" + 10 * "\0"}},
              "coil": {address: [0] for address in range(32, 36)}, "holding": {7371: [0, 3]}}

    def test_result_is_read(self):
        values = self.values("result.program", "result.serial", "result.torque", "result.date", "controller.version")
        self.assertEqual(values, {"result.program": 3, "result.serial": 1234567, "result.torque": 152,
                                  "result.date": "2026-11-29 08:30:01", "controller.version": "KDU-1A v37"})
        self.assertEqual(self.labels("result.code"), {"result.code": "screw-ok"})

    def test_motor_is_stopped_by_its_coil(self):
        self.ask("do", "--yes", "stop-motor=on")
        self.assertEqual(support.modbus_request(self.server.port, bytes((1, 0, 32, 0, 4)), 1), bytes((1, 1, 0b100)))


class Inverter(DeviceTest):
    FRAMING = "rtu"
    PROFILE = "huanyang-fc01"
    TABLES = {"holding": {0x2000: [5, 0], 0x3000: [3, 0]}}

    def test_set_point_is_written_and_nothing_starts(self):
        self.ask("set", "setpoint=50.00")
        self.assertEqual(self.values("setpoint", "command"), {"setpoint": 50, "command": 5})

    def test_status_is_told(self):
        self.assertEqual(self.labels("status"), {"status": "stopped"})


class MotorOfTheNextSeries(DeviceTest):
    FRAMING = "rtu"
    PROFILE = "orientalmotor-blvr"
    TABLES = {"holding": {address: {"i32": 0} for address in range(0, 400, 2)}
              | {124: {"u32": 0x40001}, 206: {"i32": -1500}, 214: {"i32": -55}, 248: {"i32": 415}}}

    def test_is_read(self):
        values = self.values("monitor.feedback-speed", "monitor.torque", "monitor.driver-temperature", "command.input")
        self.assertEqual(values, {"monitor.feedback-speed": -1500, "monitor.torque": -5.5,
                                  "monitor.driver-temperature": 41.5, "command.input": 0x40001})


if __name__ == "__main__":
    unittest.main(verbosity=2)
