"""libmodbus on both ends: spindle against its server, its client against our simulator."""

import unittest

import support
from support import PROGRAMS, spindle


SERVER = PROGRAMS / "spindle_peer_libmodbus_server"


class DogaServer(support.ServedTest):
    """libmodbus with the identity of a BM."""

    COMMAND = (SERVER, "doga")

    def test_is_identified(self):
        outcome = spindle("identify", self.url)
        self.assert_ends(outcome, 0)
        [identity] = outcome.of_type("identity")
        self.assertEqual(identity["raw"], support.DOGA_IDENTITY.hex().upper())
        self.assertEqual(identity["profile_candidates"], ["doga-bm", "doga-bmt"])

    def test_gets_names_and_raw_registers(self):
        outcome = spindle("get", self.url, "--profile", "doga-bm", "preset.4.target-torque",
                          "event.number", "event.torque", "@holding:2002", "@input:3204")
        self.assert_ends(outcome, 0)
        self.assertEqual([value["value"] for value in outcome.of_type("value")],
                         [4.02, 1962, -0.1, 2000, 65526])

    def test_gets_all_presets(self):
        outcome = spindle("get", self.url, "--profile", "doga-bm", "preset.*")
        self.assert_ends(outcome, 0)
        values = outcome.of_type("value")
        self.assertEqual(len(values), 225)
        self.assertEqual(values[-1]["raw"], [1515])

    def test_sets_and_reads_back(self):
        outcome = spindle("set", self.url, "--profile", "doga-bm", "preset.1.target-torque=2.71",
                          "preset.1.torque-limit=10.00")
        self.assert_ends(outcome, 0)
        self.assertEqual([write["result"] for write in outcome.of_type("write")], ["written"] * 2)
        self.assertEqual((self.server.stored(2), self.server.stored(3)), (271, 1000))

    def test_refuses_what_the_server_does_not_allow(self):
        outcome = spindle("set", self.url, "--profile", "doga-bm", "preset.1.target-torque=20.01")
        self.assert_error(outcome, 2, name="preset.1.target-torque")
        self.assertEqual(self.server.stored(2), 102)

    def test_pings(self):
        outcome = spindle("ping", self.url, "-c", "3", "--interval", "1ms")
        self.assert_ends(outcome, 0)
        self.assertEqual(outcome.of_type("summary")[0]["received"], 3)

    def test_tells_what_does_not_exist(self):
        self.assert_error(spindle("get", self.url, "@holding:5000"), 6, exception=2)


class StockServer(support.ServedTest):
    """libmodbus with its own identity."""

    COMMAND = (SERVER, "stock")

    def test_is_nobody_we_know(self):
        outcome = spindle("identify", self.url)
        self.assert_ends(outcome, 0)
        [identity] = outcome.of_type("identity")
        self.assertIsNone(identity["profile"])
        self.assertIn(b"LMB", bytes.fromhex(identity["raw"]))

    def test_raw_registers_can_be_read(self):
        outcome = spindle("get", self.url, "@holding:2")
        self.assert_ends(outcome, 0)
        self.assertEqual(outcome.value_of("@holding:2"), 102)

    def test_names_are_refused(self):
        self.assert_error(spindle("get", self.url, "--profile", "doga-bm", "preset.1.speed"), 8)
        self.assert_error(spindle("set", self.url, "--profile", "doga-bm", "preset.1.speed=5"), 8)
        self.assertEqual(self.server.stored(8), 108)


class Client(support.PeerTest):
    """libmodbus as a client of the simulated tool."""

    def test_finds_nothing_wrong(self):
        with support.Server(*support.SIMULATOR) as tool:
            outcome = support.run(PROGRAMS / "spindle_peer_libmodbus_client", tool.port)
        self.assert_ends(outcome, 0)
        self.assertEqual(outcome.out, "")


if __name__ == "__main__":
    unittest.main(verbosity=2)
