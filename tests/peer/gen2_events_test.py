"""Events and curves of screwdrivers with firmware 4000 and later, sent by a device that was written from the
facts alone."""

import json
import math
import queue
import random
import threading
import unittest

import gen2_device
import support
from gen2_device import Gen2Device, curve, event_block, pushed
from support import SPINDLE, spindle

TORQUES, ANGLES = (0.0, 0.5, 1.5, 2.0625), (0.0, 360.0, 1058.0, 1457.0)
OUTPUT = 5350


class Watch:
    """What a watch or a recorder tells, line by line, as long as it runs."""

    def __init__(self, *arguments):
        self._process = support.Process(SPINDLE, "--json", *arguments)
        self._lines = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()
        self.records = []

    def _read(self):
        for line in self._process._process.stdout:
            self._lines.put(json.loads(line))

    def until(self, holds):
        """The first record that fits, and all before it in `records`."""
        while True:
            record = self._lines.get(timeout=support.PATIENCE)
            self.records.append(record)
            if holds(record):
                return record

    def next(self, kind):
        return self.until(lambda record: record["type"] == kind)

    def of_type(self, kind):
        return [record for record in self.records if record["type"] == kind]

    def stop(self):
        self._process._process.terminate()
        self._process._process.wait(support.PATIENCE)


class EventsTest(support.PeerTest):
    def setUp(self):
        self.device = Gen2Device()
        self.addCleanup(self.device.stop)
        self.url = f"tcp://127.0.0.1:{self.device.port}"

    def tearDown(self):
        # Whatever was asked for: no read looked like an event, and nothing that no document names was written.
        self.assertEqual(self.device.event_reads, [])
        self.assertEqual(self.device.strange, [])

    def watch(self, *arguments):
        watch = Watch("watch", self.url, *arguments)
        self.addCleanup(watch.stop)
        self.armed(watch)
        return watch

    def armed(self, watch):
        watch.until(lambda record: record["type"] == "link" and record["state"] == "connected")
        while not self.device.armed:
            threading.Event().wait(0.01)
        # What comes at once may be an old event.
        threading.Event().wait(1.5)

    def send(self, *frames, size=None):
        for frame in frames:
            self.device.push(frame, size)


class Events(EventsTest):
    def test_an_event_says_all_that_it_holds(self):
        watch = self.watch()
        self.send(pushed(0x65, event_block()))
        event = watch.next("event")
        self.assertEqual((event["number"], event["kind"], event["source"], event["tool_time"], event["barcode"],
                          event["preset"], event["torque"], event["target_torque"], event["torque_unit"], event["a1"],
                          event["a2"], event["a3"], event["speed"], event["screw_count"], event["fastening_time"]),
                         (1962, "fastening-ok", "push", "2026-05-28 14:30:45", "WO-1234", 1, 2.0625, 2, "N.m", 1058, 399,
                          1457, 235, 3, 1421))
        self.assertEqual((event["steps"], event["step_at"]), (["free-rotation", "fastening", "torque-complete"], [0, 1, 3]))
        self.assertNotIn("remembered", event)

    def test_three_forms_are_one_event(self):
        watch = self.watch()
        block = event_block()
        self.send(pushed(0x04, block, transaction=1), pushed(0x65, block), pushed(0x66, block, TORQUES, ANGLES),
                  pushed(0x04, block, transaction=2), pushed(0x65, event_block(number=1963, counts=(0, 0))))
        watch.until(lambda record: record["type"] == "event" and record["number"] == 1963)
        self.assertEqual([event["number"] for event in watch.of_type("event")], [1962, 1963])
        self.assertEqual([one["number"] for one in watch.of_type("curve")], [1962])
        self.assertEqual(watch.of_type("gap"), [])

    def test_curves(self):
        watch = self.watch()
        self.send(pushed(0x65, event_block()), curve(1, TORQUES), curve(2, ANGLES))
        told = watch.next("curve")
        self.assertEqual((told["number"], told["whole"], told["sampling_ms"], told["channel_1_is"], told["channel_1_unit"],
                          told["channel_2_is"], told["channel_2_unit"]),
                         (1962, True, 5, "torque", "N.m", "angle", "deg"))
        self.assertEqual((told["channel_1"], told["channel_2"]), (list(TORQUES), list(ANGLES)))

    def test_curves_of_2000_samples_in_pieces_among_answers(self):
        watch = self.watch("status.*", "--interval", "50ms")
        torques = [number / 1000 for number in range(2000)]
        angles = [float(number) for number in range(2000)]
        for number, size in ((10, 1460), (11, 700)):
            self.send(pushed(0x66, event_block(number=number, counts=(2000, 2000)), torques, angles), size=size)
            told = watch.next("curve")
            self.assertEqual(told["number"], number)
            self.assertEqual([round(one, 3) for one in told["channel_1"]], torques)
            self.assertEqual(told["channel_2"], angles)
        self.assertEqual(watch.of_type("gap"), [])

    def test_a_number_that_is_missing_is_a_gap(self):
        watch = self.watch()
        for number in (65534, 65535, 0, 3):
            self.send(pushed(0x65, event_block(number=number, counts=(0, 0))))
        watch.until(lambda record: record["type"] == "event" and record["number"] == 3)
        self.assertEqual([gap["missed"] for gap in watch.of_type("gap")], [0, 2])

    def test_a_clock_that_is_not_set_or_wrong(self):
        watch = self.watch()
        for number, when in ((1, (0,) * 6), (2, (2026, 13, 28, 14, 30, 45)), (3, (2026, 0, 0, 0, 0, 0))):
            self.send(pushed(0x65, event_block(number=number, when=when, counts=(0, 0))))
            event = watch.next("event")
            self.assertIsNone(event.get("tool_time"))
            self.assertEqual((event["number"], event["torque"]), (number, 2.0625))

    def test_no_event_yet(self):
        watch = self.watch()
        self.send(pushed(0x65, bytes(214)), pushed(0x65, event_block(number=1, counts=(0, 0))))
        self.assertEqual(watch.next("event")["number"], 1)

    def test_the_unit_is_that_of_the_event(self):
        watch = self.watch()
        for unit, word in ((0, "kgf.cm"), (3, "cN.m"), (6, "lbf.ft")):
            self.send(pushed(0x65, event_block(number=unit, unit=unit)), curve(1, TORQUES), curve(2, ANGLES))
            self.assertEqual(watch.next("event")["torque_unit"], word)
            self.assertEqual(watch.next("curve")["channel_1_unit"], word)

    def test_what_comes_at_once_may_be_old(self):
        watch = Watch("watch", self.url)
        self.addCleanup(watch.stop)
        while not self.device.armed:
            threading.Event().wait(0.001)
        self.send(pushed(0x65, event_block(number=7, counts=(0, 0))))
        event = watch.next("event")
        self.assertTrue(event["number"] == 7 and event.get("remembered", True))

    def test_output_is_renewed(self):
        self.watch()
        threading.Event().wait(5)
        renewed = [write for write in self.device.writes if write == (OUTPUT, [1])]
        self.assertGreaterEqual(len(renewed), 2)
        self.assertEqual({register for register, _ in self.device.writes}, {OUTPUT})

    def test_lengths_that_lie(self):
        watch = self.watch()
        whole = pushed(0x66, event_block(number=5), TORQUES, ANGLES)
        wrong_count = pushed(0x66, event_block(number=6, counts=(5, 4)), TORQUES, ANGLES)
        inner = bytearray(pushed(0x65, event_block(number=7)))
        inner[9] -= 1
        no_channel = curve(3, TORQUES)
        self.send(whole, wrong_count, bytes(inner), no_channel, pushed(0x65, event_block(number=8, counts=(0, 0))))
        watch.until(lambda record: record["type"] == "event" and record["number"] == 8)
        self.assertEqual([event["number"] for event in watch.of_type("event")], [5, 8])
        self.assertEqual([one["number"] for one in watch.of_type("curve") if one["number"]], [5])
        self.assertGreaterEqual(len(watch.of_type("gap")), 1)

    def test_a_curve_that_never_ends(self):
        watch = self.watch()
        flood = curve(1, [math.nan] * 2000)
        for _ in range(16 * 1024 * 1024 // len(flood)):
            self.send(flood)
        self.send(pushed(0x65, event_block(number=9, counts=(0, 0))))
        watch.until(lambda record: record["type"] == "event" and record["number"] == 9)
        with open(f"/proc/{watch._process._process.pid}/status", encoding="ascii") as status:
            peak = next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))
        self.assertLess(peak, 500_000 if support.is_sanitized() else 100_000)  # kB

    def test_noise_of_frames_at_every_answer(self):
        dice = random.Random(1)
        block = event_block(number=20)
        kinds = (pushed(0x04, block, transaction=1), pushed(0x65, block), curve(1, TORQUES),
                 pushed(0x66, block, TORQUES, ANGLES))
        self.device.noise = lambda number: dice.choice(kinds)
        self.device.pieces = (97, lambda: dice.uniform(0, 0.002))
        outcome = spindle("get", self.url, "preset.1.target-torque", "status.torque")
        self.assert_ends(outcome, 0)
        self.assertEqual((outcome.value_of("preset.1.target-torque"), outcome.value_of("status.torque")), (2.5, 1.25))


class Stored(EventsTest):
    def setUp(self):
        super().setUp()
        self.folder = support.scratch_folder()
        self.store = self.folder / "events.db"

    def test_records_shows_draws_and_trims(self):
        recorder = Watch("record", self.url, "--store", self.store, "--tee")
        self.addCleanup(recorder.stop)
        self.armed(recorder)
        for number, status in ((1, 1), (2, 1), (3, 2)):
            self.send(pushed(0x65, event_block(number=number, status=status)), curve(1, TORQUES), curve(2, ANGLES))
            self.assertEqual(recorder.next("curve")["number"], number)
        recorder.stop()
        key = "2401190042/0/2"
        table = support.run(SPINDLE, "results", "--store", self.store, "--curve", key, "-o", "csv")
        self.assert_ends(table, 0)
        rows = table.out.splitlines()
        self.assertEqual(len(rows), 1 + len(TORQUES))
        self.assertEqual(rows[4].split(",")[1:5], ["3", "15.000", "2.0625", "1457"])
        drawn = support.run(SPINDLE, "results", "--store", self.store, "--curve", key, "-o", "svg")
        self.assert_ends(drawn, 0)
        self.assertIn("<svg", drawn.out)
        self.assertIn("torque-complete", drawn.out)
        page = self.folder / "report.html"
        self.assert_ends(support.run(SPINDLE, "report", "--store", self.store, "-f", page), 0)
        text = page.read_text(encoding="utf-8")
        self.assertIn("Torque over angle", text)
        self.assertIn("Torque over time", text)
        self.assertIn("NG 3", text)
        exported = spindle("store", "export", "--store", self.store)
        self.assertEqual([one["channel_1"] for one in exported.of_type("curve")], [list(TORQUES)] * 3)
        self.assert_ends(spindle("store", "check", "--store", self.store), 0)
        self.assert_ends(spindle("store", "trim", "--store", self.store, "--before", "2099-01-01", "--yes"), 0)
        exported = spindle("store", "export", "--store", self.store)
        self.assertEqual([one["number"] for one in exported.of_type("curve")], [3])
        self.assert_ends(spindle("store", "check", "--store", self.store), 0)


if __name__ == "__main__":
    unittest.main()
