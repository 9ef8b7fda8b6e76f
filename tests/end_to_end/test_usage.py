"""Wrong requests: one clear line, status 2 or 3, nothing on standard output, nothing written."""

import pathlib
import unittest

import hostile_server
import support

GET = ["get", "URL", "--profile", "doga-bm"]
SET = ["set", "URL", "--profile", "doga-bm"]
DO = ["do", "URL", "--profile", "doga-bm"]
TORQUE = "preset.1.target-torque"

# What is given, what the sentence must name, and what it must suggest.
WRONG = [
    (["-q"], "no command", "--help"),
    (["identfy", "sim:doga-bm"], "identfy", "identify"),
    (["frobnicate"], "frobnicate", "--help"),
    (["profile"], "profile", "--help"),
    (["profile", "shw", "doga-bm"], "shw", "show"),
    (["profile", "show"], "PROFILE", "--help"),
    (["profile", "show", "doga-bx"], "doga-bx", "doga-bm"),
    (["identify"], "TARGET", "--help"),
    (["get"], "TARGET", "--help"),
    (["set", "URL"], "NAME=VALUE", "--help"),
    (["ping"], "TARGET", "--help"),
    (["use", "URL", "more"], "more", "--help"),
    (["simulate"], "PROFILE", "--help"),
    (["list"], "profile", "spindle list doga-bm"),
    ([*GET, TORQUE, "--frobnicate"], "--frobnicate", "--help"),
    ([*GET, TORQUE, "--limit"], "--limit", "--limits"),
    ([*GET, TORQUE, "--timout", "1s"], "--timout", "--timeout"),
    ([*GET, TORQUE, "-Z"], "-Z", "--help"),
    ([*GET, TORQUE, "--timeout", "5"], "--timeout", "500ms"),
    ([*GET, TORQUE, "--timeout", "0s"], "--timeout", "500ms"),
    ([*GET, TORQUE, "--connect-timeout", "soon"], "--connect-timeout", "500ms"),
    ([*GET, TORQUE, "--retries", "-1"], "--retries", "100"),
    ([*GET, TORQUE, "--retries", "many"], "--retries", "100"),
    ([*GET, TORQUE, "-o", "xml"], "xml", "json"),
    ([*GET, TORQUE, "--color", "blue"], "blue", "never"),
    ([*GET, TORQUE, "--limits=sometimes"], "--limits", "value"),
    (["ping", "URL", "--count", "0"], "--count", "1"),
    (["ping", "URL", "--interval", "often"], "--interval", "500ms"),
    (["get", "nowhere", TORQUE], "nowhere", "tcp://"),
    (["identify", "@nogroup"], "@nogroup", "tcp://"),
    (["get", "", TORQUE], "TARGET", "--help"),
    (["get", "tcp://", TORQUE], "host", "tcp://HOST"),
    (["get", "tcp://:5000", TORQUE], "host", "tcp://HOST"),
    (["get", "tcp://127.0.0.1:99999", TORQUE], "99999", "65535"),
    (["get", "tcp://127.0.0.1:0", TORQUE], "'0'", "65535"),
    (["get", "tcp://127.0.0.1:port", TORQUE], "port", "65535"),
    (["get", "tcp://127.0.0.1?unit=256", TORQUE], "256", "255"),
    (["get", "tcp://127.0.0.1?unit=1&unit=2", TORQUE], "unit", ""),
    (["get", "tcp://127.0.0.1?baud=9600", TORQUE], "baud", ""),
    (["get", "tcp://[::1", TORQUE], "[::1", ""),
    (["get", "tpc://127.0.0.1", TORQUE], "tpc", "tcp"),
    (["get", "http://127.0.0.1", TORQUE], "http", "tcp://"),
    (["get", "sim:doga-bx", TORQUE], "doga-bx", "doga-bm"),
    (["get", "URL", "--profile", "doga-bx", TORQUE], "doga-bx", "doga-bm"),
    ([*GET, "preset.1.target-torqe"], "preset.1.target-torqe", TORQUE),
    ([*GET, "preset.16.mode"], "preset.16.mode", ""),
    ([*GET, "nothing*"], "nothing*", "spindle list"),
    ([*GET, TORQUE, "p0"], "p0", "p725"),
    ([*GET, "p726"], "p726", "p725"),
    ([*GET, "@holding:65536"], "@holding:65536", "@holding:2"),
    ([*GET, "@coils:1"], "@coils:1", "@holding:2"),
    ([*GET, "@coil:1/u32"], "@coil:1/u32", "@coil:5"),
    ([*GET, "@input:3204/f16"], "@input:3204/f16", "i16"),
    ([*SET, TORQUE], TORQUE, "="),
    ([*SET, "=2.80"], "=2.80", "="),
    ([*SET, "preset.1.target-torqe=2.80"], "preset.1.target-torqe", TORQUE),
    ([*SET, f"{TORQUE}="], TORQUE, ""),
    ([*SET, f"{TORQUE}=much"], "much", ""),
    ([*SET, f"{TORQUE}=nan"], "nan", ""),
    ([*SET, f"{TORQUE}=-1"], "-1", ""),
    ([*SET, f"{TORQUE}=700"], "700", ""),
    ([*SET, f"{TORQUE}=2.80", "p2=280"], "p2", "twice"),
    ([*SET, "preset.1.mode=TC"], "TC", "TC/AM"),
    ([*SET, "preset.1.mode=7"], "7", "TC/AM"),
    ([*SET, "event.number=1"], "event.number", "read-only"),
    ([*SET, "@input:3200=1"], "@input:3200", ""),
    ([*SET, "@holding:4003=1"], "4003", "spindle do"),
    ([*SET, "@holding:4500=1"], "4500", ""),
    ([*SET, "@holding:1002=1"], "1002", ""),
    ([*DO, "strt"], "strt", "start"),
    ([*DO, "auto-output"], "auto-output", "=VALUE"),
    ([*DO, "auto-output=2"], "'2'", "on (1)"),
    ([*DO, "alarm-reset=1"], "alarm-reset", "alone"),
    ([*DO, "select-preset=16", "--accept-unverified"], "'16'", "15"),
    ([*DO, "select-preset=3"], "select-preset", "--accept-unverified"),
    ([*DO, "start", "--yes"], "start", "remote-start"),
    ([*DO, "start", "--accept-unverified", "--yes"], "start", "guard"),
    ([*DO, "select-preset=3", "--accept-unverified"], "select-preset", "--yes"),
    ([*DO, "select-preset=3", "--accept-unverified", "--no-input"], "select-preset", "--yes"),
    ([*DO, "auto-output=1", "lock=1"], "lock", "--accept-unverified"),
    (["simulate", "doga-bx"], "doga-bx", "doga-bm"),
    (["simulate", "doga-bm", "--fault", "nonsense"], "nonsense", ""),
    (["simulate", "doga-bm", "--fault", "late"], "late", "500ms"),
    (["simulate", "doga-bm", "--listen", "tcp://127.0.0.1:99999"], "99999", "65535"),
    (["simulate", "doga-bm", "--listen", "rtu:///dev/ttyS0"], "rtu:///dev/ttyS0", "tcp://"),
    (["simulate", "doga-bm", "--firmware", "70000"], "--firmware", "65535"),
]


class UsageTest(unittest.TestCase):
    def check_sentence(self, finished, named, suggested):
        lines = finished.sentences()
        self.assertEqual(len(lines), 1, finished)
        self.assertTrue(lines[0].startswith("spindle: "), finished)
        self.assertIn(named, lines[0], finished)
        self.assertIn(suggested, " ".join(finished.stderr.split()), finished)

    def test_wrong_requests(self):
        with hostile_server.HostileServer({}) as server:
            for words, named, suggested in WRONG:
                arguments = [server.url if word == "URL" else word for word in words]
                with self.subTest(words):
                    finished = support.run(*arguments)
                    self.assertEqual((finished.status, finished.stdout), (2, ""), finished)
                    self.check_sentence(finished, named, suggested)
            # Nothing was sent either: all of it can be known before.
            self.assertEqual(server.requests, [])

    def test_wrong_requests_as_json(self):
        with hostile_server.HostileServer({}) as server:
            for words, named, suggested in WRONG:
                if "-o" in words:
                    continue
                arguments = [server.url if word == "URL" else word for word in words]
                with self.subTest(words):
                    finished = support.run(*arguments, "--json")
                    self.assertEqual(finished.status, 2, finished)
                    records = finished.records()
                    kinds = [(r["type"], r["code"], r["exit_status"]) for r in records]
                    self.assertEqual(kinds, [("error", "usage", 2)], finished)
                    self.check_sentence(finished, named, suggested)
                    # What is outside a range names the limit; everything else says what would help.
                    message, hint = records[0]["message"], records[0]["hint"]
                    names_a_limit = any(word in message for word in (" above ", " below ", " between "))
                    self.assertTrue(hint or names_a_limit, finished)

    def test_options_without_their_value(self):
        for option in ("--timeout", "--profile", "--output", "-o", "--tools", "--retries", "--color"):
            with self.subTest(option):
                finished = support.run("get", "sim:doga-bm", TORQUE, option)
                self.assertEqual((finished.status, finished.stdout), (2, ""), finished)
                self.check_sentence(finished, option, "")

    def test_foreign_bytes_do_not_reach_the_terminal(self):
        for word in ("\x1b[31mred", "two\nlines", "tab\there", "\u202ereversed"):
            with self.subTest(repr(word)):
                finished = support.run("get", "sim:doga-bm", word)
                self.assertEqual((finished.status, finished.stdout), (2, ""), finished)
                self.assertEqual(len(finished.sentences()), 1, finished)
                self.assertNotIn("\x1b", finished.said)

    def test_help_and_version_are_data(self):
        for arguments in (["--help"], ["-h"], ["get", "--help"], ["profile", "show", "--help"], ["--version"]):
            with self.subTest(arguments):
                finished = support.run(*arguments)
                self.assertEqual((finished.status, finished.stderr), (0, ""), finished)
                self.assertIn("spindle", finished.stdout)


class BadFileTest(unittest.TestCase):
    def test_bad_profiles(self):
        # One in ten: what is found in each of them is shown in profile_store_test.
        files = sorted((support.ROOT / "tests" / "profiles" / "bad").glob("*.yaml"))[::10]
        self.assertGreater(len(files), 10, "no bad profiles to try")
        for file in files:
            with self.subTest(file.name):
                finished = support.run("profile", "check", file, "--json")
                self.assertEqual(finished.status, 3, finished)
                self.assertTrue(finished.records("error"), finished)
                self.assertIn(file.name, finished.said)

    def test_a_bad_profile_is_used_for_nothing(self):
        files = sorted((support.ROOT / "tests" / "profiles" / "bad").glob("*.yaml"))[:5]
        with hostile_server.HostileServer({}) as server:
            for file in files:
                for command in (["get", server.url, "p2"], ["set", server.url, "p2=280"], ["list"]):
                    with self.subTest(file.name, command=command[0]):
                        finished = support.run(*command, "--profile", file)
                        self.assertEqual((finished.status, finished.stdout), (3, ""), finished)
                        self.assertRegex(finished.said, rf"{file.name}:\d+:\d+: ")
            self.assertEqual(server.requests, [])

    def test_missing_and_unreadable_files(self):
        folder = support.home().path
        for option, name in (("--profile", "missing.yaml"), ("--tools", "missing.yaml")):
            with self.subTest(option):
                finished = support.run("get", "sim:doga-bm", TORQUE, option, folder / name)
                self.assertEqual((finished.status, finished.stdout), (3, ""), finished)
                self.assertIn(name, finished.said)

    def test_bad_tools_files(self):
        texts = (
            "tools: [",
            "tools: {a: {}}",
            "tools: {a: {url: 'tpc://x'}}",
            "toolz: {}",
            "groups: {g: [b]}",
            "\x00",
        )
        for number, text in enumerate(texts):
            file = pathlib.Path(support.home().path) / f"tools-{number}.yaml"
            file.write_text(text, "utf-8")
            with self.subTest(text):
                finished = support.run("identify", "a", "--tools", file)
                self.assertEqual((finished.status, finished.stdout), (3, ""), finished)

    def test_shipped_profiles_are_valid(self):
        for profile in ("doga-bm", "doga-bmt"):
            finished = support.run("profile", "check", support.ROOT / "profiles" / f"{profile}.yaml")
            self.assertEqual(finished.status, 0, finished)


if __name__ == "__main__":
    unittest.main()
