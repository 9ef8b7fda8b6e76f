"""On a terminal: progress of long work, and colour that helps and switches off."""

import contextlib
import re
import unittest

import support

WIPE = "\r\x1b[K"
SLOW = ("doga-bm", "--fault", "latency=60ms")
COLUMNS = 50


def screen(text):
    """The lines that stay on the terminal when the program has ended."""
    return [line.rsplit(WIPE, 1)[-1] for line in text.split("\r\n")]


def states(text):
    """What the progress line showed, one after the other."""
    return [part.split("\r\n")[0] for part in text.split(WIPE)[1:]]


class ProgressTest(unittest.TestCase):
    def backup(self, url, *more, **options):
        file = support.home().path / "backup.yaml"
        return support.run_on_terminal("backup", url, "-f", file, "--force", *more, columns=COLUMNS, **options)

    def check_gone(self, finished):
        """Nothing of it stays, and nothing else was drawn over it."""
        self.assertEqual([line for line in screen(finished.stdout) if " of " in line], [], finished)

    def test_a_backup_tells_how_far_how_fast_and_how_long(self):
        with support.simulator(*SLOW) as url:
            finished = self.backup(url)
        self.assertEqual(finished.status, 0, finished)
        shown = [state for state in states(finished.stdout) if " of " in state]
        counts = [tuple(map(int, re.search(r"reading (\d+) of (\d+)", state).groups())) for state in shown]
        self.assertEqual(counts, sorted(counts), finished)
        self.assertEqual(counts[-1][0], counts[-1][1], finished)
        self.assertTrue(all(len(state) < COLUMNS for state in shown), finished)
        paces = [state for state in shown if state.endswith(" left")]
        self.assertTrue(paces, finished)
        for state in paces:
            self.assertRegex(state, r", \d+(\.\d)?/(s|min), [1-9]\d* (s|min) left$")
        self.assertNotIn("left", shown[0], finished)
        self.check_gone(finished)
        self.assertIn("1 saved, 0 failed", screen(finished.stdout), finished)

    def test_nobody_who_does_not_want_it_sees_it(self):
        with support.simulator() as url:
            for more, environment in ((["-q"], {}), ([], {"TERM": "dumb"})):
                with self.subTest(more, **environment):
                    finished = self.backup(url, *more, environment=environment)
                    self.assertEqual(finished.status, 0, finished)
                    self.assertNotIn(WIPE, finished.stdout, finished)
                    self.assertNotIn("reading", finished.stdout, finished)
            elsewhere = support.run("backup", url, "-f", support.home().path / "backup.yaml", "--force")
            self.assertEqual((elsewhere.status, elsewhere.stderr), (0, "1 saved, 0 failed\n"), elsewhere)

    def test_records_and_the_line_do_not_mix(self):
        """Records that are printed while it goes on stand alone, each in a line of its own."""
        with support.simulator("orientalmotor-blv", "--units", "1,3", listen="rtu+tcp://127.0.0.1:0") as url:
            bus = url.split("?")[0]
            finished = support.run_on_terminal(
                "scan", bus, "--profile", "orientalmotor-blv", "--units", "1-4", "--timeout", "500ms", "--json"
            )
        self.assertEqual(finished.status, 0, finished)
        records = [support.parse_json(line) for line in screen(finished.stdout) if line]
        self.assertEqual([record["type"] for record in records], ["unit", "unit", "summary"], finished)
        self.assertIn("units asked: 3 of 4, 2 found", " ".join(states(finished.stdout)), finished)

    def test_many_tools(self):
        with contextlib.ExitStack() as stack:
            urls = [stack.enter_context(support.simulator(*SLOW)) for _ in range(3)]
            finished = support.run_on_terminal("identify", *urls)
        self.assertEqual(finished.status, 0, finished)
        shown = states(finished.stdout)
        self.assertEqual(shown[0], "tools done: 0 of 3", finished)
        self.assertIn("tools done: 3 of 3", shown, finished)
        self.check_gone(finished)


class ColourTest(unittest.TestCase):
    def is_coloured(self, terminal, environment, *options):
        run = support.run_on_terminal if terminal else support.run
        finished = run("identify", "sim:doga-bm", *options, environment=environment)
        self.assertEqual(finished.status, 0, finished)
        return "\x1b[1m" in finished.stdout

    def test_who_wants_it_gets_it(self):
        rows = (
            # On a terminal?, environment, options, coloured?
            (False, {}, [], False),
            (False, {"CLICOLOR_FORCE": "1"}, [], True),
            (False, {"CLICOLOR_FORCE": "0"}, [], False),
            (False, {"CLICOLOR_FORCE": "1", "NO_COLOR": "1"}, [], False),
            (False, {"NO_COLOR": "1"}, ["--color", "always"], True),
            (True, {}, [], True),
            (True, {"NO_COLOR": ""}, [], True),
            (True, {"NO_COLOR": "1"}, [], False),
            (True, {"TERM": "dumb"}, [], False),
            (True, {"TERM": "dumb", "CLICOLOR_FORCE": "1"}, [], True),
            (True, {"CLICOLOR_FORCE": "1"}, ["--color", "never"], False),
            (True, {}, ["--json"], False),
            (True, {}, ["-o", "csv", "--color", "always"], False),
        )
        for terminal, environment, options, coloured in rows:
            with self.subTest(terminal=terminal, options=options, **environment):
                self.assertEqual(self.is_coloured(terminal, environment, *options), coloured)

    def test_good_and_bad_are_words_too(self):
        arguments = ("--profile", "doga-bm", "--count", "4", "--color", "always")
        with support.simulator("doga-bm", "--rundown-every", "100ms", "--ng-every", "2") as url:
            finished = support.run("watch", url, *arguments)
        self.assertEqual(finished.status, 0, finished)
        green = set(re.findall("\x1b\\[32m(.*?)\x1b\\[0m", finished.stdout))
        red = set(re.findall("\x1b\\[31m(.*?)\x1b\\[0m", finished.stdout))
        self.assertTrue(green and red, finished)
        self.assertFalse(green & red, finished)
        self.assertTrue(all(word.strip() for word in green | red), finished)


if __name__ == "__main__":
    unittest.main()
