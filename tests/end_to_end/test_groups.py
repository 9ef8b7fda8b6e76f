"""Groups: several live tools side by side, of which one is gone, one refuses, one is another product."""

import contextlib
import pathlib
import signal
import unittest

import hostile_server
import support

TORQUE = "preset.1.target-torque"
REFUSES_WRITES = {"on": ["write"], "store": "nothing", "reply": [{"answer": {"exception": "0E"}}]}
SILENT_ON_WRITES = {"on": ["write"], "reply": []}
BM, BMT = "doga-bm", "doga-bmt"


class GroupTest(unittest.TestCase):
    def setUp(self):
        self.changes = pathlib.Path(support.home().path) / ".local/state/spindle/changes.jsonl"
        self.changes.unlink(missing_ok=True)

    def group(self, **tools):
        """Writes a tools file with one group of these tools: URL, or URL and profile."""
        lines = []
        for name, what in tools.items():
            url, profile = what if isinstance(what, tuple) else (what, BM)
            lines.append(f'  {name}: {{url: "{url}", profile: {profile}}}\n')
        file = pathlib.Path(support.home().path) / "spindle.yaml"
        file.write_text(f"tools:\n{''.join(lines)}groups:\n  line: [{', '.join(tools)}]\n", "utf-8")
        self.addCleanup(file.unlink, missing_ok=True)

    def value(self, url, name=TORQUE, profile=BM):
        finished = support.run("get", url, "--profile", profile, name, "--json")
        return str(finished.records("value")[0]["value"])

    def changed(self):
        """What became of what was begun: (target, name, result)."""
        if not self.changes.exists():
            return []
        records = [support.parse_json(line) for line in self.changes.read_text("utf-8").splitlines()]
        begun = sorted((r["target"], r["name"], r["id"]) for r in records if r["result"] == "begun")
        ended = [r for r in records if r["result"] != "begun"]
        self.assertEqual(begun, sorted((r["target"], r["name"], r["id"]) for r in ended))
        return [(r["target"], r["name"], r["result"]) for r in ended]

    def enter_simulators(self, *profiles):
        return [self.enterContext(support.simulator(profile)) for profile in profiles]


class ReadingTest(GroupTest):
    def setUp(self):
        super().setUp()
        one, two, other = self.enter_simulators(BM, BM, BMT)
        gone = self.enterContext(support.refusing_port())
        self.group(one=one, gone=gone, two=two, other=(other, BMT))

    def test_get(self):
        finished = support.run("get", "@line", TORQUE, "preset.1.speed", "--json")
        self.assertEqual(finished.status, 9, finished)
        told = [(r["type"], r["target"]) for r in finished.records()]
        value = "value"
        self.assertEqual(
            told,
            [(value, "one")] * 2 + [("error", "gone")] + [(value, "two")] * 2 + [(value, "other")] * 2,
        )
        self.assertEqual(finished.records("error")[0]["exit_status"], 4)
        self.assertIn("gone (tcp://", finished.said)

    def test_get_everything(self):
        finished = support.run("get", "@line", "--json")
        self.assertEqual(finished.status, 9, finished)
        targets = [r["target"] for r in finished.records()]
        places = [targets.index(name) for name in ("one", "gone", "two", "other")]
        self.assertEqual(places, sorted(places))
        self.assertEqual(sorted(targets, key=["one", "gone", "two", "other"].index), targets)

    def test_table(self):
        finished = support.run("get", "@line", TORQUE)
        rows = [line.split() for line in finished.stdout.splitlines()]
        self.assertEqual(rows[0], ["TARGET", "NAME", "VALUE", "UNIT"])
        self.assertEqual([row[0] for row in rows[1:]], ["one", "two", "other"])

    def test_ping(self):
        finished = support.run("ping", "@line", "-c", "3", "--interval", "10ms", "--json")
        self.assertEqual(finished.status, 9, finished)
        pings = [(r["target"], r["sequence"]) for r in finished.records("ping")]
        expected = [(name, number) for name in ("one", "two", "other") for number in (1, 2, 3)]
        self.assertEqual(sorted(pings), sorted(expected))
        summaries = [(r["target"], r["sent"], r["received"], r["exit_status"]) for r in finished.records("summary")]
        self.assertEqual(
            summaries,
            [("one", 3, 3, 0), ("gone", 0, 0, 4), ("two", 3, 3, 0), ("other", 3, 3, 0), (None, 9, 9, 9)],
        )
        self.assertEqual(finished.records()[-1]["target"], None)

    def test_ping_tells_each_line_when_it_comes(self):
        with support.Running("ping", "@line", "-c", "9", "--interval", "60s") as running:
            lines = [running.line() for _ in range(4)]
            running.send_signal(signal.SIGINT)
            finished = running.finish()
        self.assertEqual(lines[0].split(), ["TARGET", "SEQUENCE", "ROUND", "TRIP"])
        self.assertEqual(sorted(line.split()[0] for line in lines[1:]), ["one", "other", "two"])
        self.assertEqual(finished.status, 130, finished)
        self.assertRegex(finished.stderr, r"(?m)^one: 1 sent, 1 received; ")
        self.assertRegex(finished.stderr, r"(?m)^4 tools: 3 sent, 3 received; ")

    def test_alarms_and_actions(self):
        finished = support.run("alarms", "@line", "--json")
        self.assertEqual(finished.status, 9, finished)
        self.assertEqual([r["target"] for r in finished.records("summary")], ["one", "two", "other", None])
        finished = support.run("do", "@line", "auto-output=off", "--yes", "--json")
        self.assertEqual(finished.status, 9, finished)
        done = [(r["target"], r["result"]) for r in finished.records("action")]
        self.assertEqual(done, [("one", "sent"), ("two", "sent"), ("other", "sent")])
        self.assertEqual((finished.records()[-1]["done"], finished.records()[-1]["failed"]), (3, 1))
        expected = [(name, "auto-output", "sent") for name in ("one", "other", "two")]
        self.assertEqual(sorted(self.changed()), expected)

    def test_all_are_gone(self):
        with support.refusing_port() as one, support.refusing_port() as two:
            self.group(one=one, two=two)
            for command in (["get", TORQUE], ["ping"], ["alarms"], ["set", f"{TORQUE}=3.00", "--yes"]):
                with self.subTest(command[0]):
                    finished = support.run(command[0], "@line", *command[1:], "--json")
                    self.assertEqual(finished.status, 4, finished)
                    self.assertEqual(sorted(r["target"] for r in finished.records("error")), ["one", "two"])


class SettingTest(GroupTest):
    def test_one_is_gone_one_refuses_one_is_another_product(self):
        one, other = self.enter_simulators(BM, BMT)
        refusing = self.enterContext(hostile_server.HostileServer(REFUSES_WRITES))
        gone = self.enterContext(support.refusing_port())
        self.group(one=one, gone=gone, refusing=refusing.url, other=(other, BMT))
        finished = support.run("set", "@line", "preset.1.speed=310", "--yes", "--json")
        self.assertEqual(finished.status, 9, finished)
        results = {r["target"]: r["result"] for r in finished.records("write")}
        self.assertEqual(results, {"one": "written", "refusing": "refused", "other": "written"})
        errors = {r["target"]: r["exit_status"] for r in finished.records("error")}
        self.assertEqual(errors, {"gone": 4, "refusing": 6})
        last = finished.records()[-1]
        self.assertEqual((last["type"], last["target"]), ("summary", None))
        counts = [last[key] for key in ("written", "unchanged", "failed", "not_tried", "exit_status")]
        self.assertEqual(counts, [2, 0, 1, 1, 9])
        self.assertEqual(self.value(one, "preset.1.speed"), "310")
        self.assertEqual(self.value(other, "preset.1.speed", BMT), "310")
        name = "preset.1.speed"
        self.assertEqual(
            sorted(self.changed()),
            [("one", name, "written"), ("other", name, "written"), ("refusing", name, "refused")],
        )

    def test_what_does_not_fit_one_is_written_to_none(self):
        one, other = self.enter_simulators(BM, BMT)
        with support.Recorder(one) as first, support.Recorder(other) as second:
            self.group(one=first.url, other=(second.url, BMT))
            for wrong, status in ((f"{TORQUE}=6.50", 2), ("preset.1.mode=XX", 2), ("event.number=1", 2)):
                with self.subTest(wrong):
                    finished = support.run("set", "@line", "preset.2.speed=900", wrong, "--yes", "--json")
                    self.assertEqual(finished.status, status, finished)
                    self.assertEqual(finished.records("error")[0]["target"], "one", finished)
                    self.assertEqual(finished.records("write"), [])
            self.assertEqual(first.count(support.WRITE_SINGLE) + second.count(support.WRITE_SINGLE), 0)
        self.assertEqual(self.changed(), [])

    def test_a_later_generation_keeps_all_from_being_written(self):
        with support.simulator() as one, support.simulator(BM, "--firmware", "4001") as later:
            self.group(one=one, later=later)
            finished = support.run("set", "@line", f"{TORQUE}=3.00", "--yes", "--json")
            self.assertEqual(finished.status, 8, finished)
            self.assertEqual([r["target"] for r in finished.records("error")], ["later"])
            self.assertEqual(self.value(one), "2.71")

    def test_a_group_is_not_set_unasked(self):
        one, two = self.enter_simulators(BM, BM)
        self.group(one=one, two=two)
        for flags in ([], ["--no-input"]):
            finished = support.run("set", "@line", f"{TORQUE}=3.00", *flags)
            self.assertEqual((finished.status, finished.stdout), (2, ""), finished)
            self.assertIn("write 2 values to 2 tools (one, two)", finished.said)
            self.assertIn("--yes", finished.said)
        self.assertEqual((self.value(one), self.value(two)), ("2.71", "2.71"))

    def test_what_is_equal_is_not_written_nor_asked_about(self):
        one, two = self.enter_simulators(BM, BM)
        self.group(one=one, two=two)
        finished = support.run("set", "@line", f"{TORQUE}=2.71", "--json")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual([r["result"] for r in finished.records("write")], ["unchanged"] * 2)

    def test_many_tools_write_one_record_of_changes(self):
        with contextlib.ExitStack() as stack:
            servers = [stack.enter_context(hostile_server.HostileServer({})) for _ in range(20)]
            self.group(**{f"tool{number}": server.url for number, server in enumerate(servers)})
            values = [f"p{number}=3500" for number in range(300, 310)]
            finished = support.run("set", "@line", *values, "--yes", "--json")
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual(len(finished.records("write")), 200)
            self.assertEqual(len(set(self.changed())), 200)
            for server in servers:
                self.assertEqual({server.tool.holding[number] for number in range(300, 310)}, {3500})


class InterruptionTest(GroupTest):
    def test_in_the_middle(self):
        """What was written, what is not known, and what was not begun: all of it is told."""
        silent = self.enterContext(hostile_server.HostileServer(SILENT_ON_WRITES))
        one, last = self.enter_simulators(BM, BM)
        self.group(one=one, silent=silent.url, last=last)
        arguments = ["set", "@line", f"{TORQUE}=2.80", "preset.2.speed=900", "--yes", "--json"]
        with support.Running(*arguments, "--jobs", "1", "--timeout", "60s") as running:
            support.wait_until(lambda: silent.misbehaved, "the second tool is written to")
            running.send_signal(signal.SIGINT)
            finished = running.finish()
        self.assertEqual(finished.status, 130, finished)
        written = [(r["target"], r["name"], r["result"]) for r in finished.records("write")]
        self.assertEqual(
            written,
            [("one", TORQUE, "written"), ("one", "preset.2.speed", "written"), ("silent", TORQUE, "unknown")],
        )
        errors = {r["target"]: r for r in finished.records("error")}
        self.assertEqual(sorted(errors), ["last", "silent"])
        self.assertEqual(errors["silent"]["name"], TORQUE)
        self.assertIn("whether it was written is not known", errors["silent"]["hint"])
        self.assertIn("nothing was sent", errors["last"]["message"])
        counts = [
            (r["target"], r["written"], r["failed"], r["not_tried"], r["exit_status"])
            for r in finished.records("summary")
        ]
        self.assertEqual(
            counts, [("one", 2, 0, 0, 0), ("silent", 0, 1, 1, 130), (None, 2, 1, 3, 130)]
        )
        self.assertEqual(self.value(last), "2.71")
        self.assertIn(("silent", TORQUE, "unknown"), self.changed())

    def test_while_reading(self):
        silent = self.enterContext(hostile_server.HostileServer({"on": ["read"], "reply": []}))
        (one,) = self.enter_simulators(BM)
        self.group(silent=silent.url, one=one)
        for command in (["get", "@line", TORQUE], ["set", "@line", f"{TORQUE}=2.80", "--yes"]):
            with self.subTest(command[0]):
                count = len(silent.requests)
                with support.Running(*command, "--json", "--timeout", "60s") as running:
                    support.wait_until(lambda: len(silent.requests) >= count + 2, "it is read from")
                    running.send_signal(signal.SIGTERM)
                    finished = running.finish()
                self.assertEqual(finished.status, 143, finished)
        self.assertIn("nothing was changed", finished.said)
        self.assertEqual(self.value(one), "2.71")
        self.assertEqual(self.changed(), [])


class QuestionTest(GroupTest):
    """What happens while the user thinks about the question."""

    def setUp(self):
        super().setUp()
        self.one, self.two = self.enter_simulators(BM, BM)
        self.recorder = self.enterContext(support.Recorder(self.two))
        gone = self.enterContext(support.refusing_port())
        self.group(one=self.one, gone=gone, two=self.recorder.url)

    def set(self, meanwhile, answer):
        return support.ask_on_terminal(["set", "@line", f"{TORQUE}=2.80"], b"Go on? [y/N]", answer, meanwhile)

    def test_yes(self):
        shown, status = self.set(lambda: None, b"y\n")
        self.assertEqual(status, 9, shown)
        self.assertRegex(shown, r"(?s)gone .*connection refused.*TARGET +NAME .*one .*2\.71 +2\.80")
        self.assertIn("write 2 values to 2 of 3 tools (one, two). Go on? [y/N]", shown)
        self.assertEqual((self.value(self.one), self.value(self.two)), ("2.80", "2.80"))

    def test_no(self):
        for answer, expected in ((b"n\n", 2), (b"\x03", 130)):
            with self.subTest(answer):
                shown, status = self.set(lambda: None, answer)
                self.assertEqual(status, expected, shown)
        self.assertEqual((self.value(self.one), self.value(self.two)), ("2.71", "2.71"))

    def test_no_line_is_held_meanwhile(self):
        """Another one may use the tools, and what he changed is not overwritten unseen."""

        def change():
            finished = support.run("set", self.two, "--profile", BM, f"{TORQUE}=3.00")
            self.assertEqual(finished.status, 0, finished)

        shown, status = self.set(change, b"y\n")
        self.assertEqual(status, 9, shown)
        told = " ".join(shown.split())
        self.assertIn("changed meanwhile from 2.71 to 3.00, so nothing was written to this tool", told)
        self.assertEqual((self.value(self.one), self.value(self.two)), ("2.80", "3.00"))

    def test_another_tool_answers_behind_the_same_address(self):
        with support.simulator(BM, "--serial", "1021100043") as stranger:
            shown, status = self.set(lambda: self.recorder.lead_to(stranger), b"y\n")
            self.assertEqual(status, 9, shown)
            self.assertIn("serial 1021100043 answers now", shown)
            self.assertEqual(self.value(stranger), "2.71")


class OneToolTest(GroupTest):
    def test_commands_that_take_one_say_what_helps(self):
        with hostile_server.HostileServer({}) as server:
            self.group(one=server.url, two=server.url)
            rows = (
                (["remote-start", "@line", "--yes"], "one tool at a time"),
                (["restore", "@line", "some.yaml"], "--dir FOLDER restores each"),
                (["diff", "@line", "some.yaml"], "--dir FOLDER compares each"),
                (["set", "@line", f"{TORQUE}=2.80", "--broadcast"], "--broadcast"),
                (["do", "@line", "auto-output=off", "--broadcast"], "--broadcast"),
            )
            for words, said in rows:
                with self.subTest(words):
                    finished = support.run(*words)
                    self.assertEqual((finished.status, finished.stdout), (2, ""), finished)
                    self.assertIn(said, finished.said)
            self.assertEqual(server.requests, [])


class SerialLineTest(GroupTest):
    def test_units_of_one_line_take_turns(self):
        port = pathlib.Path(support.home().path) / "line"
        with support.Running("simulate", "orientalmotor-blv", "--pty", port, "--units", "1-3") as bus:
            bus.line()
            blv = "orientalmotor-blv"
            self.group(**{f"drive{unit}": (f"rtu://{port}?unit={unit}", blv) for unit in (1, 2, 3)})
            finished = support.run("set", "@line", "operation.2.speed=1200", "--yes", "--json")
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual([r["result"] for r in finished.records("write")], ["written"] * 3)
            finished = support.run("get", "@line", "operation.2.speed", "--json")
            self.assertEqual([str(r["value"]) for r in finished.records("value")], ["1200"] * 3)


if __name__ == "__main__":
    unittest.main()
