"""Units behind one gateway: one connection for all of them, and answers whose transaction ids say nothing."""

import itertools
import pathlib
import random
import shutil
import signal
import tempfile
import unittest

import support
from gateway_server import CLOSE, SILENT, Gateway, Late

METER = """\
format: 1
id: meter
title: "A meter"
link: {framing: tcp, answer: 300ms, retries: 1%s}
evidence: manual
source: "made up"
parameters:
  - {name: voltage, register: 10, encoding: u16, access: r, title: Voltage}
  - {name: current, register: 20, encoding: u16, access: r, title: Current}
  - {name: limit, register: 30, encoding: u16, access: rw, title: Limit}
"""
NAMES = ("one", "two", "three")
PATIENCE = 60  # seconds of the paced clock for a watch to tell enough
REGISTER = "@input:303"  # one that the product has
VALUES = {"voltage": 10, "current": 20, "limit": 30}


class GatewayTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-gateways-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.meter()

    def meter(self, link=""):
        (self.folder / "meter.yaml").write_text(METER % link, "utf-8")

    def gateway(self, more="&timeout=9s", keys="", **how):
        """A gateway, and a tools file with its three units as the group `line`. Only where a test is about silence
        the time for an answer is short: a machine may be busy for a while."""
        gateway = self.enterContext(Gateway(**how))
        lines = [
            f'  {name}: {{url: "{gateway.url_of(unit, more)}", profile: meter.yaml{keys}}}\n'
            for unit, name in enumerate(NAMES, 1)
        ]
        (self.folder / "tools.yaml").write_text(
            f"tools:\n{''.join(lines)}groups:\n  line: [{', '.join(NAMES)}]\n", "utf-8"
        )
        return gateway

    def run_tool(self, *arguments):
        return support.run(*arguments, "--tools", self.folder / "tools.yaml")

    def check_values(self, records, names=NAMES):
        """Every value is that of its own unit and register."""
        self.assertTrue(records)
        for record in records:
            unit = NAMES.index(record["target"]) + 1
            self.assertEqual(record["value"], 1000 * unit + VALUES[record["name"]], record)
        self.assertEqual({record["target"] for record in records}, set(names))

    def check_shared(self, gateway):
        self.assertEqual((gateway.met, gateway.refused, gateway.overlaps), (1, 0, 0))

    def watch(self, *arguments):
        return support.Running("watch", "@line", "voltage", "--tools", self.folder / "tools.yaml", "--json",
                               "--interval", "20ms", "--all", *arguments)

    @staticmethod
    def read_until(watching, is_enough):
        """The records up to the one with which those so far are enough."""
        records = []
        end = support.paced() + PATIENCE
        while not is_enough(records):
            records.append(support.parse_json(watching.line()))
            if support.paced() > end:
                raise AssertionError(f"{len(records)} records are not enough, the last: {records[-3:]}")
        return records


def samples(records, name):
    return [record for record in records if record["type"] == "sample" and record["target"] == name]


def links(records, name):
    return [record["state"] for record in records if record["type"] == "link" and record["target"] == name]


def has_all(count):
    return lambda records: all(len(samples(records, name)) >= count for name in NAMES)


class SharingTest(GatewayTest):
    def test_get(self):
        for exclusive in (False, True):
            with self.subTest(exclusive=exclusive):
                gateway = self.gateway(exclusive=exclusive)
                finished = self.run_tool("get", "@line", "--json")
                self.assertEqual(finished.status, 0, finished)
                self.check_values(finished.records("value"))
                self.assertEqual(len(finished.records("value")), 9)
                self.check_shared(gateway)

    def test_units_of_urls_without_a_profile(self):
        gateway = self.gateway(exclusive=True)
        urls = {gateway.url_of(unit): unit for unit in (1, 2, 3)}
        finished = self.run_tool("watch", *urls, "@holding:10", "--all", "--count", 30, "--interval", "20ms", "--json")
        self.assertEqual(finished.status, 0, finished)
        for record in finished.records("sample"):
            self.assertEqual(record["value"], 1000 * urls[record["target"]] + 10)
        self.assertEqual({record["target"] for record in finished.records("sample")}, set(urls))
        self.check_shared(gateway)

    def test_backup(self):
        gateway = self.gateway(exclusive=True)
        finished = self.run_tool("backup", "@line", "--dir", self.folder / "saved", "--json")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual(len(list((self.folder / "saved").iterdir())), 3)
        for unit, name in enumerate(NAMES, 1):
            (saved,) = (self.folder / "saved").glob(f"{name}*")
            self.assertIn(f"{1000 * unit + 30}", saved.read_text("utf-8"))
        self.check_shared(gateway)

    def test_watch(self):
        for exclusive in (False, True):
            with self.subTest(exclusive=exclusive):
                gateway = self.gateway(exclusive=exclusive)
                with self.watch() as watching:
                    records = self.read_until(watching, has_all(10))
                    self.check_values([record for record in records if record["type"] == "sample"])
                    watching.send_signal(signal.SIGINT)
                    watching.finish()
                self.check_shared(gateway)
                runs = [unit for unit, _ in itertools.groupby(gateway.units_asked())]
                self.assertGreater(len(runs), 15, "the units take turns")

    def test_what_changes_tools_goes_from_one_to_the_next(self):
        # Each is slow enough for the next one to come meanwhile.
        gateway = self.gateway(behave=lambda unit, number: Late(3.0) if number == 1 else None, more="&timeout=5s")
        finished = self.run_tool("set", "@line", "limit=77", "--yes", "--json")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual((gateway.beside, gateway.overlaps), (0, 0))
        read = self.run_tool("get", "@line", "limit", "--json")
        self.assertEqual([record["value"] for record in read.records("value")], [77, 77, 77])

    def test_a_unit_that_is_not_there_is_an_error_of_its_own(self):
        for what in (SILENT, 0x0A, 0x0B):
            with self.subTest(what=what):
                gateway = self.gateway(
                    "", behave=lambda unit, _, what=what: what if unit == 2 else None, exclusive=True
                )
                finished = self.run_tool("get", "@line", "voltage", "--json")
                self.check_values(finished.records("value"), ("one", "three"))
                self.assertEqual([record["target"] for record in finished.records("error")], ["two"], finished)
                self.check_shared(gateway)

    def test_a_watch_of_a_unit_that_is_not_there_disturbs_no_other(self):
        for what in (0x0A, 0x0B):
            with self.subTest(what=what):
                behave = lambda unit, number, what=what: what if unit == 2 and number > 3 else None
                gateway = self.gateway(behave=behave, exclusive=True)
                with self.watch() as watching:
                    records = self.read_until(watching, lambda so_far: len(links(so_far, "two")) >= 3)
                    seen = len(records)
                    records += self.read_until(
                        watching, lambda more: all(len(samples(more, name)) >= 10 for name in ("one", "three"))
                    )
                    watching.send_signal(signal.SIGINT)
                    watching.finish()
                self.assertIn("lost", links(records[:seen], "two"))
                for name in ("one", "three"):
                    self.assertEqual(links(records, name), ["connected"])
                self.check_shared(gateway)

    def test_when_no_unit_is_there_the_connection_stays(self):
        gateway = self.gateway(behave=lambda unit, number: 0x0B if number > 3 else None, exclusive=True)
        with self.watch() as watching:
            self.read_until(watching, lambda so_far: all(links(so_far, name).count("lost") >= 2 for name in NAMES))
            watching.send_signal(signal.SIGINT)
            watching.finish()
        self.check_shared(gateway)

    def test_a_lost_connection_is_told_of_each_and_made_again_once(self):
        gateway = self.gateway(exclusive=True)
        with self.watch() as watching:
            records = self.read_until(watching, has_all(5))
            gateway.drop()
            records += self.read_until(
                watching, lambda more: all("connected" in links(more, name) for name in NAMES) and has_all(5)(more)
            )
            watching.send_signal(signal.SIGINT)
            watching.finish()
        for name in NAMES:
            self.assertEqual(links(records, name).count("lost"), 1, [r for r in records if r["type"] == "link"])
            self.assertEqual(links(records, name)[-1], "connected")
        self.assertEqual(gateway.met, 2)

    def test_a_gateway_that_hangs_up_behind_one_unit_is_connected_to_again(self):
        gateway = self.gateway(behave=lambda unit, _: CLOSE if unit == 2 else None)
        finished = self.run_tool("get", "@line", "voltage", "--json")
        self.check_values(finished.records("value"), ("one", "three"))
        self.assertEqual([record["target"] for record in finished.records("error")], ["two"], finished)

    def test_timeout_and_retries_are_those_of_each_unit(self):
        gateway = self.enterContext(Gateway(behave=lambda unit, _: None if unit == 3 else SILENT))
        (self.folder / "tools.yaml").write_text(
            "tools:\n"
            f'  one: {{url: "{gateway.url_of(1)}", profile: meter.yaml, timeout: 50ms, retries: 4}}\n'
            f'  two: {{url: "{gateway.url_of(2, "&timeout=700ms&retries=0")}", profile: meter.yaml}}\n'
            f'  three: {{url: "{gateway.url_of(3)}", profile: meter.yaml}}\n'
            "groups: {line: [one, two, three]}\n",
            "utf-8",
        )
        finished = self.run_tool("get", "@line", "voltage", "--json")
        self.assertEqual(gateway.units_asked(), [1] * 5 + [2] + [3])
        errors = {record["target"]: record["message"] for record in finished.records("error")}
        self.assertIn("within 50ms", errors["one"])
        self.assertIn("within 700ms", errors["two"])
        self.assertEqual(gateway.met, 1)


class TransactionTest(GatewayTest):
    def test_without_the_key_the_error_names_it(self):
        self.gateway("", ids=lambda asked: 0)
        finished = self.run_tool("get", "one", "voltage")
        self.assertEqual(finished.status, 5, finished)
        self.assertIn("the answer has transaction id 0000 instead of", finished.said)
        self.assertIn("transaction=ignored", finished.said)

    def test_url_tools_file_and_profile_have_the_key(self):
        off = {"zero": lambda asked: 0, "one more": lambda asked: (asked + 1) % 0x10000}
        for name, ids in off.items():
            for place in ("url", "tools", "profile"):
                with self.subTest(ids=name, place=place):
                    self.meter(", transaction: ignored" if place == "profile" else "")
                    more = "&timeout=9s" + ("&transaction=ignored" if place == "url" else "")
                    keys = ", transaction: ignored" if place == "tools" else ""
                    gateway = self.gateway(more, keys, ids=ids)
                    finished = self.run_tool("get", "@line", "--json")
                    self.assertEqual(finished.status, 0, finished)
                    self.check_values(finished.records("value"))
                    self.check_shared(gateway)

    def test_late_answers_are_no_values(self):
        chance = random.Random(11)

        def behave(unit, number):
            return Late(chance.choice((0.12, 0.2, 0.29, 0.45))) if chance.random() < 0.2 else None

        self.gateway("&transaction=ignored&timeout=100ms&retries=2", ids=lambda asked: 7, behave=behave)
        values = []
        for _ in range(4):
            finished = self.run_tool("get", "@line", "--json")
            values += finished.records("value")
        for record in values:
            unit = NAMES.index(record["target"]) + 1
            self.assertEqual(record["value"], 1000 * unit + VALUES[record["name"]], record)
        self.assertTrue(values)

    def test_late_answers_are_no_samples(self):
        def behave(unit, number):
            return Late(0.25) if number % 7 == 0 else None

        gateway = self.gateway("&transaction=ignored&timeout=100ms", ids=lambda asked: 0, behave=behave)
        with self.watch("current", "limit") as watching:
            records = self.read_until(watching, has_all(20))
            watching.send_signal(signal.SIGINT)
            watching.finish()
        self.check_values([record for record in records if record["type"] == "sample"])
        self.assertEqual(gateway.met, 1)

    def test_the_simulator_does_the_same(self):
        with support.simulator("kolver-kducer", "--fault", "fixed-transaction=9") as url:
            refused = support.run("get", url, "--profile", "kolver-kducer", REGISTER)
            self.assertEqual(refused.status, 5, refused)
            self.assertIn("transaction id 0009 instead of", refused.said)
            read = support.run("get", f"{url}?transaction=ignored", "--profile", "kolver-kducer", REGISTER)
            self.assertEqual(read.status, 0, read)


if __name__ == "__main__":
    unittest.main()
