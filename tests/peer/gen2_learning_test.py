"""What no document says of screwdrivers with firmware 4000 and later, found out on a device that was written from the
facts alone: where the last event can be read, and which registers are commands. Nothing is written but what arms the
events."""

import itertools
import pathlib
import signal
import tempfile
import threading
import unittest

import support
from gen2_device import Gen2Device, event_block
from support import SPINDLE, spindle

OUTPUT, PRESET, ALARM, LOCK = 5350, 105, 111, 118
# 5000, 5001 and 5350 are known; the rest of the block is there, and nothing in it is named.
COMMANDS = range(5000, 5400)


class Person(threading.Thread):
    """Does one thing after the other on the tool, with pauses, once the program is ready, until told to end."""

    def __init__(self, deeds, pause=1.2, is_ready=lambda: True):
        super().__init__(daemon=True)
        self._deeds, self._pause, self._is_ready = deeds, pause, is_ready
        self._ended = threading.Event()

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self.join()

    def run(self):
        while not self._is_ready():
            if self._ended.wait(0.05):
                return
        for deed in self._deeds:
            if self._ended.wait(self._pause):
                return
            deed()


class LearningTest(support.PeerTest):
    def setUp(self):
        self.device = Gen2Device()
        self.addCleanup(self.device.stop)
        self.url = f"tcp://127.0.0.1:{self.device.port}"
        for register in COMMANDS:
            self.device.holding.setdefault(register, 0)
        self.folder = tempfile.TemporaryDirectory(prefix="spindle-learning-")
        self.addCleanup(self.folder.cleanup)
        self.file = pathlib.Path(self.folder.name) / "my-bmt.yaml"

    def tearDown(self):
        self.assertEqual(self.device.event_reads, [])
        self.assertEqual(self.device.strange, [])
        self.assertEqual({(register, word) for register, words in self.device.writes for word in words}
                         - {(OUTPUT, 0), (OUTPUT, 1)}, set())

    def check(self, path):
        outcome = spindle("profile", "check", str(path))
        self.assert_ends(outcome, 0)


class FindEventBlock(LearningTest):
    def find(self, *arguments, events=None, status=0):
        numbers = itertools.count(100)
        deeds = events or (lambda: self.device.happen(event_block(number=next(numbers)))
                           for _ in itertools.count())
        with Person(deeds, pause=0.7):
            outcome = spindle("do", self.url, "find-event-block", *arguments)
        self.assert_ends(outcome, status)
        return outcome

    def test_it_is_found_although_events_go_on(self):
        self.device.event_places = [5300]
        block = self.find().of_type("block")[0]
        self.assertEqual((block["search"], block["table"], block["register"], block["count"]),
                         ("find-event-block", "input", 5300, 107))
        self.assertIn("first: 5300  # evidence: verified", block["profile"])
        self.assertEqual(self.device.writes[0], (OUTPUT, [1]))
        self.assertEqual(self.device.writes[-1], (OUTPUT, [0]))

    def test_its_lines_are_a_profile_that_reads_the_event(self):
        self.device.event_places = [5300]
        text = self.find().of_type("block")[0]["profile"]
        path = pathlib.Path(self.folder.name) / "my-tool.yaml"
        path.write_text(text, "utf-8")
        self.check(path)
        self.device.happen(event_block(number=777))
        outcome = spindle("get", self.url, "event.number", "event.torque", "--profile", str(path))
        self.assert_ends(outcome, 0)
        self.assertEqual([value["value"] for value in outcome.of_type("value")], [777, 2.0625])

    def test_what_it_shows_people_can_be_saved_as_it_stands(self):
        self.device.event_places = [5300]
        numbers = itertools.count(100)
        with Person((lambda: self.device.happen(event_block(number=next(numbers))) for _ in itertools.count()), pause=0.7):
            outcome = support.run(SPINDLE, "do", self.url, "find-event-block")
        self.assert_ends(outcome, 0)
        path = pathlib.Path(self.folder.name) / "my-tool.yaml"
        path.write_text(outcome.out, "utf-8")
        self.check(path)
        self.assertIn("\n  first: 5300", outcome.out)
        self.assertIn("serial 2401190042, firmware 4002", outcome.out)

    def test_in_two_parts_where_108_are_refused(self):
        self.device.event_places = [6400]
        self.device.longest_read = 107
        block = self.find().of_type("block")[0]
        self.assertEqual(block["register"], 6400)

    def test_in_every_form_of_a_pushed_event(self):
        for form in (0x04, 0x65):
            self.device.event_places = [400]
            deeds = (lambda: self.device.happen(event_block(number=5), form) for _ in itertools.count())
            self.assertEqual(self.find(events=deeds).of_type("block")[0]["register"], 400)

    def test_nothing_is_found(self):
        outcome = self.find(status=1)
        self.assertEqual(outcome.of_type("block"), [])
        summary = outcome.of_type("summary")[0]
        self.assertEqual((summary["places"], summary["similar"], summary["exit_status"]), ([], [], 1))
        self.assertGreater(summary["asked"], 600)

    def test_what_only_looks_like_it_is_not_taken_for_it(self):
        one = event_block(number=9, torque=2.5)
        other = event_block(number=9, torque=1.5)  # the same number and time
        self.device.hold(other, [900])
        outcome = self.find(events=(lambda: self.device.happen(one, places=[]) for _ in itertools.count()), status=1)
        self.assertEqual(outcome.of_type("block"), [])
        self.assertIn(900, outcome.of_type("summary")[0]["similar"])

    def test_of_two_places_another_event_tells_them_apart(self):
        numbers = itertools.count(1)

        def happen():
            number = next(numbers)
            # A history behind the last event keeps the first one.
            self.device.happen(event_block(number=number), places=[1200, 1400] if number == 1 else [1200])

        deeds = itertools.chain([happen], (lambda: None for _ in range(60)), (happen for _ in itertools.count()))
        block = self.find(events=deeds).of_type("block")[0]
        self.assertEqual(block["register"], 1200)

    def test_a_tool_that_goes_is_an_error_and_not_an_answer(self):
        deeds = [lambda: self.device.happen(event_block(number=3)), lambda: None, self.device.stop]
        with Person(deeds, pause=0.7):
            outcome = spindle("do", self.url, "find-event-block")
        self.assertIn(outcome.status, (4, 5), outcome)
        self.assertEqual(outcome.of_type("block"), [])


class Learn(LearningTest):
    def is_watched(self):
        """Whether a single register of the status was read, as it is while registers are followed."""
        with self.device.lock:
            return any(function == 4 and data[2:] == b"\0\x01" for function, data in self.device.requests)

    def learn(self, what, deeds, *arguments, status=0, pause=2.5):
        with Person(deeds, pause, self.is_watched):
            outcome = spindle("learn", self.url, what, *arguments)
        self.assert_ends(outcome, status)
        return outcome

    def presets(self, *mirrors):
        for preset in itertools.cycle((3, 7, 1, 12, 4)):
            yield lambda preset=preset: self.device.show(PRESET, preset, *mirrors)

    def test_one_register_follows_and_is_written_to_a_profile(self):
        self.device.show(PRESET, 5, 5010)
        self.device.holding[5011] = 5  # the same by chance
        outcome = self.learn("select-preset", self.presets(5010), "-f", str(self.file))
        self.assertEqual([(one["action"], one["register"], one["evidence"], one["confirm"])
                          for one in outcome.of_type("action")],
                         [("select-preset", 5010, "verified", "status.preset")])
        summary = outcome.of_type("summary")[0]
        self.assertEqual((summary["how"], summary["candidates"], summary["numbers"][0], len(summary["numbers"])),
                         ("one", [5010], 5, 4))
        self.check(self.file)
        listed = spindle("do", self.url, "--profile", str(self.file))
        action = next(one for one in listed.of_type("action") if one["action"] == "select-preset")
        self.assertEqual((action["register"], action["evidence"], action["hazard"], action["confirm"]),
                         (5010, "verified", "unclear", "status.preset"))
        self.assertEqual(self.device.writes, [])
        # A file that is there is never written over.
        again = spindle("learn", self.url, "select-preset", "-f", str(self.file))
        self.assert_ends(again, 2)

    def test_what_cannot_be_written_is_shown(self):
        self.device.show(PRESET, 5, 5010)
        nowhere = pathlib.Path(self.folder.name) / "none" / "my-bmt.yaml"
        early = spindle("learn", self.url, "select-preset", "-f", str(nowhere))
        self.assert_ends(early, 2)
        self.assertIn("there is no folder", early.err)

        def vanish():
            self.folder.cleanup()
            self.device.show(PRESET, 7, 5010)

        deeds = itertools.chain([vanish], self.presets(5010))
        with Person(deeds, 2.5, self.is_watched):
            outcome = support.run(SPINDLE, "learn", self.url, "select-preset", "-f", str(self.file))
        self.assert_ends(outcome, 74)
        self.assertIn("\nextends: doga-gen2\n", outcome.out)
        self.assertIn("register: 5010", outcome.out)

    def test_a_profile_that_would_not_be_found_is_refused_before_anything_is_done(self):
        base = pathlib.Path(self.folder.name) / "bases" / "my-base.yaml"
        base.parent.mkdir()
        base.write_text("format: 1\nid: my-base\nextends: doga-gen2\ntitle: \"One of ours\"\n", "utf-8")
        outcome = spindle("learn", self.url, "lock", "--profile", str(base), "-f", str(self.file))
        self.assert_ends(outcome, 2)
        self.assertIn(f"found only beside {base}", " ".join(outcome.err.split()))

    def test_none_follows(self):
        outcome = self.learn("select-preset", self.presets(), "-f", str(self.file), status=1)
        self.assertEqual(outcome.of_type("action"), [])
        self.assertEqual(outcome.of_type("summary")[0]["how"], "none")
        self.assertFalse(self.file.exists())

    def test_several_follow(self):
        outcome = self.learn("select-preset", self.presets(5010, 5020), "-f", str(self.file), "--changes", "2",
                             status=1)
        self.assertEqual(outcome.of_type("action"), [])
        summary = outcome.of_type("summary")[0]
        self.assertEqual((summary["how"], summary["candidates"]), ("several", [5010, 5020]))
        self.assertFalse(self.file.exists())

    def test_lock(self):
        deeds = (lambda lock=lock: self.device.show(LOCK, lock, 5033) for lock in itertools.cycle((1, 0)))
        outcome = self.learn("lock", deeds, "-f", str(self.file))
        self.assertEqual(outcome.of_type("action")[0]["register"], 5033)
        self.check(self.file)

    def test_alarm_reset(self):
        def alarm():
            self.device.show(ALARM, 336)

        def reset():
            with self.device.lock:
                self.device.put(5044, 1)
                self.device.show(ALARM, 0)
            threading.Event().wait(1.5)
            self.device.put(5044, 0)

        outcome = self.learn("alarm-reset", itertools.cycle((alarm, reset)), "--changes", "2", "-f", str(self.file))
        learned = outcome.of_type("action")[0]
        self.assertEqual((learned["register"], learned["values"]), (5044, "1"))
        self.check(self.file)

    def test_known_registers_are_not_looked_at(self):
        # 5001 is the direction, whatever it shows.
        outcome = self.learn("select-preset", self.presets(5001), status=1)
        self.assertEqual(outcome.of_type("summary")[0]["how"], "none")

    def test_nothing_changes(self):
        outcome = self.learn("lock", [], "--idle-timeout", "1s", "-f", str(self.file), status=1)
        self.assertEqual(outcome.of_type("summary")[0]["how"], "idle")
        self.assertFalse(self.file.exists())

    def test_a_tool_that_shows_nothing(self):
        for register in (*COMMANDS, ):
            self.device.holding.pop(register, None)
        outcome = self.learn("lock", [], status=1)
        self.assertEqual(outcome.of_type("summary")[0]["how"], "unreadable")

    def test_a_tool_that_goes(self):
        outcome = spindle("identify", self.url)
        self.assert_ends(outcome, 0)
        with Person([self.device.stop]):
            outcome = spindle("learn", self.url, "lock", "-f", str(self.file))
        self.assertIn(outcome.status, (4, 5), outcome)
        self.assertFalse(self.file.exists())

    def test_control_c_ends_it_well(self):
        process = support.Process(SPINDLE, "--json", "learn", self.url, "lock", "-f", str(self.file))
        while not any(function == 3 for function, _ in list(self.device.requests)):
            threading.Event().wait(0.01)
        self.addCleanup(process._process.stdout.close)
        process._process.send_signal(signal.SIGINT)
        self.assertEqual(process._process.wait(support.PATIENCE), 130)
        self.assertFalse(self.file.exists())


if __name__ == "__main__":
    unittest.main()
