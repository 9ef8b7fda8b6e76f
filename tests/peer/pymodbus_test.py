"""spindle against a server on pymodbus: identity, names, limits, writes, exceptions."""

import unittest

import support
from support import HERE, spindle

support.need_module("pymodbus", "serial_asyncio")


SERVER = ("/usr/bin/python3", HERE / "pymodbus_server.py")


class DogaTool(support.ServedTest):
    """The register map of the manual with the manual's identity."""

    COMMAND = (*SERVER, "doga")

    def test_is_identified(self):
        outcome = spindle("identify", self.url)
        self.assert_ends(outcome, 0)
        [identity] = outcome.of_type("identity")
        self.assertEqual(identity["firmware"], 2103)
        self.assertEqual(identity["tool_model"], "3204")
        self.assertEqual(identity["serial"], "1021100042")
        self.assertEqual(identity["raw"], support.DOGA_IDENTITY.hex().upper())
        # Twelve bytes do not tell BM from BMT.
        self.assertIsNone(identity["profile"])
        self.assertEqual(identity["profile_candidates"], ["doga-bm", "doga-bmt"])

    def test_gets_names_without_a_profile_named(self):
        outcome = spindle("get", self.url, "preset.2.target-torque", "preset.15.torque-compensation")
        self.assert_ends(outcome, 0)
        self.assertEqual(outcome.value_of("preset.2.target-torque"), 2.02)
        self.assertEqual(outcome.value_of("preset.15.torque-compensation"), 1515)

    def test_gets_all_presets(self):
        outcome = spindle("get", self.url, "--profile", "doga-bm", "preset.*")
        self.assert_ends(outcome, 0)
        raw = {value["register"]: value["raw"] for value in outcome.of_type("value")}
        expected = {15 * (preset - 1) + field: [0 if field == 1 else 100 * preset + field]
                    for preset in range(1, 16) for field in range(1, 16)}
        self.assertEqual(raw, expected)

    def test_gets_input_registers_signed_and_labelled(self):
        outcome = spindle("get", self.url, "--profile", "doga-bm", "event.*", "status.*")
        self.assert_ends(outcome, 0)
        self.assertEqual(outcome.value_of("event.number"), 1962)
        self.assertEqual(outcome.value_of("event.torque"), -0.1)
        self.assertEqual(outcome.value_of("event.snug-angle"), 12)
        self.assertEqual(outcome.value_of("status.torque"), -1)
        self.assertEqual(outcome.value_of("status.alarm"), 332)
        labels = {value["name"]: value.get("label") for value in outcome.of_type("value")}
        self.assertEqual(labels["event.status"], "fastening NG")
        self.assertEqual(labels["status.direction"], "loosening")

    def test_gets_parameters_by_number(self):
        outcome = spindle("get", self.url, "--profile", "doga-bm", "p2", "p17", "p725")
        self.assert_ends(outcome, 0)
        self.assertEqual([value["value"] for value in outcome.of_type("value")], [102, 202, 7])

    def test_shows_the_limits_that_the_server_keeps(self):
        outcome = spindle("get", self.url, "--profile", "doga-bm", "--limits", "preset.3.speed")
        self.assert_ends(outcome, 0)
        [value] = outcome.of_type("value")
        self.assertEqual((value["minimum"], value["value"], value["maximum"]), (0, 308, 2000))

    def test_sets_and_reads_back(self):
        outcome = spindle("set", self.url, "--profile", "doga-bm", "preset.2.target-torque=3.10",
                          "preset.2.speed=208")
        self.assert_ends(outcome, 0)
        writes = {write["name"]: write for write in outcome.of_type("write")}
        changed = writes["preset.2.target-torque"]
        self.assertEqual((changed["old"], changed["new"], changed["result"]), (2.02, 3.1, "written"))
        self.assertEqual(writes["preset.2.speed"]["result"], "unchanged")
        self.assertEqual(self.server.stored(17), 310)
        self.assertEqual(self.server.stored(23), 208)

    def test_refuses_what_the_server_does_not_allow(self):
        outcome = spindle("set", self.url, "--profile", "doga-bm", "preset.2.speed=900",
                          "preset.2.target-torque=20.01")
        error = self.assert_error(outcome, 2, name="preset.2.target-torque")
        self.assertIn("2017", error["message"])
        self.assertEqual((self.server.stored(17), self.server.stored(23)), (202, 208))

    def test_pings(self):
        outcome = spindle("ping", self.url, "-c", "5", "--interval", "1ms")
        self.assert_ends(outcome, 0)
        [summary] = outcome.of_type("summary")
        self.assertEqual((summary["sent"], summary["received"]), (5, 5))

    def test_tells_what_does_not_exist(self):
        self.assert_error(spindle("get", self.url, "@holding:3000"), 6, exception=2)
        self.assert_error(spindle("get", self.url, "--profile", "doga-bm", "p300"), 6, exception=2,
                          name="p300")

    def test_gets_what_exists_beside_what_does_not(self):
        outcome = spindle("get", self.url, "--profile", "doga-bm", "p224", "p226", "p225")
        self.assert_ends(outcome, 9)
        self.assertEqual(outcome.value_of("p224"), 1514)
        self.assertEqual(outcome.value_of("p225"), 1515)
        [error] = outcome.of_type("error")
        self.assertEqual((error["name"], error["exception"]), ("p226", 2))

    def test_tells_that_an_action_is_refused(self):
        outcome = spindle("do", self.url, "--profile", "doga-bm", "--yes", "auto-output=1")
        self.assert_error(outcome, 6, exception=2)


class StockServer(support.ServedTest):
    """pymodbus as it answers FC 17 by itself: not a tool of ours."""

    COMMAND = (*SERVER, "stock")

    def test_is_nobody_we_know(self):
        outcome = spindle("identify", self.url)
        self.assert_ends(outcome, 0)
        [identity] = outcome.of_type("identity")
        self.assertIsNone(identity["profile"])
        self.assertEqual(identity["profile_candidates"], [])
        self.assertEqual(identity["raw"], (b"Pymodbus-PM-3.0" + b"\xff").hex().upper())

    def test_raw_registers_can_be_read(self):
        outcome = spindle("get", self.url, "@holding:2", "@input:3204/i16")
        self.assert_ends(outcome, 0)
        self.assertEqual(outcome.value_of("@holding:2"), 102)
        self.assertEqual(outcome.value_of("@input:3204/i16"), -10)

    def test_names_are_refused(self):
        self.assert_error(
            spindle("get", self.url, "--profile", "doga-bm", "preset.1.target-torque"), 8)

    def test_nothing_is_written(self):
        outcome = spindle("set", self.url, "--profile", "doga-bm", "preset.1.target-torque=1.50")
        self.assert_error(outcome, 8)
        self.assertEqual(self.server.stored(2), 102)


if __name__ == "__main__":
    unittest.main(verbosity=2)
