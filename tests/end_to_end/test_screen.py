"""What a person sees: tables that fit, times of the own zone, and the board of watch at the bottom."""

import contextlib
import re
import sys
import unittest

import support
from screen import PROMPT, Screen, is_there

WORKING = ("--rundown-every", "300ms", "--ng-every", "3")


def boards(lines):
    """The lines that say where a tool stands."""
    return [line for line in lines if re.search(r"\d+ OK +\d+ NG$", line)]


class TableTest(unittest.TestCase):
    def test_no_row_is_wider_than_the_screen(self):
        for columns in (80, 60):
            for command in ("spindle list doga-bm", "spindle list orientalmotor-blv 'operation.2.*'",
                            "spindle get sim:doga-bm", "spindle identify sim:doga-bm",
                            "spindle profile list -q", "spindle do sim:doga-bm -q"):
                with self.subTest(command, columns=columns), Screen(columns, 200) as screen:
                    shown = screen.run(command)
                    self.assertGreater(len(shown), 1, shown)
                    table = [line for line in screen.wrapped() if not line.startswith(("told once", "spindle:"))]
                    self.assertEqual(table, [], "\n".join(shown))

    def test_a_preset_is_listed_once_with_its_range_and_meaning(self):
        with Screen(100, 100) as screen:
            shown = screen.run("spindle list doga-bm")
            speeds = [line for line in shown if re.search(r"preset\.\S+\.speed ", line)]
            self.assertEqual(len(speeds), 1, shown)
            self.assertRegex(speeds[0], r"^preset\.1-15\.speed .*rpm.* Speed$")
            one = screen.run("spindle list doga-bm 'preset.3.*'")
            self.assertTrue(any(line.startswith("preset.3.speed") for line in one), one)

    def test_all_columns_are_there_where_they_are_wanted(self):
        with Screen(60) as screen:
            shown = screen.run("spindle get sim:doga-bm preset.1.speed -o wide | cat")
            self.assertRegex(" ".join(shown), r"TIME +TARGET +NAME +VALUE +UNIT +RAW +LABEL")

    def test_a_value_for_a_script(self):
        with Screen() as screen:
            shown = screen.run('echo "[$(spindle get sim:doga-bm preset.1.speed -o value)]"')
            self.assertEqual(shown, ["[1000]"])
            shown = screen.run("spindle get sim:doga-bm p2 --columns name,raw -o value")
            self.assertEqual(shown[0].split(), ["p2", "271"])
            shown = screen.run("spindle get sim:doga-bm p2 --columns nmae")
            self.assertIn("'nmae' is no column here did you mean 'name'?", " ".join(" ".join(shown).split()))

    def test_a_tool_that_is_well_has_one_line_of_alarms(self):
        with Screen() as screen:
            self.assertEqual(screen.run("spindle alarms sim:doga-bm"), ["no alarm present"])

    def test_times_are_those_of_the_user(self):
        with Screen(120, environment={"TZ": "XYZ-05:30"}) as screen:
            shown = screen.run("spindle watch sim:doga-bm --count 1")
            self.assertRegex(shown[1], r"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{3}\+05:30  link\b")
            piped = screen.run("spindle watch sim:doga-bm --count 1 | cat")
            self.assertRegex(piped[1], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z  link\b")


class BoardTest(unittest.TestCase):
    def test_events_scroll_above_a_line_for_the_tool(self):
        with support.simulator("doga-bm", *WORKING) as url, Screen() as screen:
            screen.type(f"clear; spindle watch {url} --profile doga-bm")
            shown = screen.wait(lambda lines: boards(lines) and not re.search(r" 0 NG$", lines[-1]),
                                "a result that is not good")
            self.assertRegex(shown[-1], rf"^{url}  connected .* preset 1 .* \d+ OK  \d+ NG$")
            self.assertEqual(len(boards(shown)), 1, shown)
            self.assertRegex(shown[0], r"^TIME +KIND ")
            events = [line for line in shown if re.search(r" fastening-(ok|ng) .* (OK|NG)", line)]
            self.assertGreaterEqual(len(events), 3, shown)
            self.assertEqual(screen.wrapped(), [])
            screen.press("C-c")
            ended = screen.wait(lambda lines: lines[-1] == PROMPT, "it ends")
            self.assertEqual(boards(ended), [], ended)
            self.assertRegex(ended[-2], r"^\d+ events, \d+ OK, \d+ NG, ")
            self.assertFalse([line for line in ended if "^C" in line], ended)
            screen.type("echo $?")
            screen.wait(lambda lines: lines[-2:] == ["130", PROMPT], "its status")

    def test_a_screen_that_gets_another_size(self):
        with support.simulator("doga-bm", *WORKING) as url, Screen(100, 30) as screen:
            screen.type(f"clear; spindle watch {url} --profile doga-bm")
            screen.wait(lambda lines: re.search(r" [1-9]\d* OK +\d+ NG$", lines[-1]), "a result")
            for columns, rows in ((60, 20), (80, 24)):
                screen.resize(columns, rows)
                screen.wait(lambda lines: len(boards(lines)) == 1 and boards(lines[-1:]) and
                            all(len(line) <= columns for line in lines), f"it fits {columns} x {rows}")
            screen.press("C-c")
            screen.wait(lambda lines: lines[-1] == PROMPT and not boards(lines), "it ends")

    def test_more_tools_than_lines(self):
        with contextlib.ExitStack() as stack:
            urls = [stack.enter_context(support.simulator()) for _ in range(5)]
            names = [f"station{number}" for number in range(5)]
            tools = [f'  {name}: {{url: "{url}", profile: doga-bm}}\n' for name, url in zip(names, urls)]
            text = "tools:\n" + "".join(tools) + f"groups:\n  line: [{', '.join(names)}]\n"
            screen = stack.enter_context(Screen(80, 7, files={"spindle.yaml": text}))
            screen.type("clear; spindle watch @line")
            shown = screen.wait(lambda lines: lines[-1] == "and 2 more: 2 connected, 0 NG" and
                                sum("  connected  " in line for line in boards(lines)) == 3, "all are connected")
            self.assertRegex(shown[-2], r"^station2 +connected +0 OK +0 NG$")
            self.assertEqual(len(boards(shown)), 3, shown)
            screen.resize(80, 24)
            screen.wait(lambda lines: len(boards(lines)) == 5, "all have a line")
            screen.press("C-c")
            screen.wait(lambda lines: lines[-1] == PROMPT and not boards(lines), "it ends")

    def test_a_link_that_is_lost_is_said(self):
        with Screen() as screen:
            with support.simulator() as url:
                screen.type(f"clear; spindle watch {url} --profile doga-bm")
                screen.wait(lambda lines: re.match(rf"{url} +connected ", lines[-1]), "it is connected")
            screen.wait(lambda lines: re.match(rf"{url} +reconnecting \(\d+\) ", lines[-1]), "the tool is gone")
            screen.press("C-c")
            screen.wait(lambda lines: lines[-1] == PROMPT, "it ends")

    def test_a_terminal_that_can_only_write_has_no_board(self):
        with support.simulator("doga-bm", *WORKING) as url:
            arguments = ("watch", url, "--profile", "doga-bm", "--count", "3")
            for more, environment in ((), {"TERM": "dumb"}), (("--json",), {}):
                with self.subTest(more):
                    finished = support.run_on_terminal(*arguments, *more, environment=environment)
                    self.assertEqual(finished.status, 0, finished)
                    self.assertEqual(boards(finished.stdout.split("\r\n")), [], finished)
                    self.assertFalse(environment and "\x1b" in finished.stdout, finished)


if __name__ == "__main__":
    if not is_there():
        print("tmux is not there")
        sys.exit(77)
    unittest.main()
