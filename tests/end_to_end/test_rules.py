"""Rules for the tests themselves: none of them judges by the bare seconds of a machine that may be busy."""

import pathlib
import re
import unittest

HERE = pathlib.Path(__file__).resolve().parent
FOLDERS = (HERE, HERE.parent / "peer")

# What is forbidden, and what does the same: see paced() in support.py.
RULES = (
    (r"assertLess(Equal)?\([^\n]*(\.seconds\b|monotonic|perf_counter|time\.time)", "an upper limit is one of .paced or paced()"),
    (r"\.seconds *<|monotonic\(\) *(- *\w+ *)?<|< *[^\n]*\.seconds\b", "an upper limit is one of .paced or paced()"),
    (r"subprocess\.(run|call|check_\w+)\([^)]*timeout", "support.completed() waits by the paced clock"),
    (r"\.wait\(support\.DEADLINE", "support.wait_for_end() waits by the paced clock"),
    (r"select\.select\([^\n]*DEADLINE", "support.is_readable() waits by the paced clock"),
    (r"(wait_until\([^\n]*, *|timeout=|deadline=)[0-9.]+\)", "a deadline is support.DEADLINE, or a multiple of it"),
)


def broken(text):
    """The lines that break a rule, each with what to do instead."""
    found = []
    for number, line in enumerate(text.splitlines(), 1):
        found += [f"{number}: {line.strip()}  ({instead})" for rule, instead in RULES if re.search(rule, line)]
    return found


class RulesTest(unittest.TestCase):
    maxDiff = None

    def test_no_test_judges_by_bare_seconds(self):
        found = []
        for folder in FOLDERS:
            for path in sorted([*folder.glob("test_*.py"), *folder.glob("*_test.py")]):
                if path != pathlib.Path(__file__).resolve():
                    found += [f"{path.name}:{line}" for line in broken(path.read_text("utf-8"))]
        self.assertEqual(found, [])

    def test_the_rules_find_what_they_are_made_for(self):
        for line in (
            "self.assertLess(finished.seconds, 5)",
            "self.assertLessEqual(time.monotonic() - began, support.SOON)",
            "if finished.seconds < limit:",
            'subprocess.run(["x"], timeout=20)',
            "process.wait(support.DEADLINE)",
            "select.select([fd], [], [], support.DEADLINE)",
            'support.wait_until(lambda: a, "it ends", 8)',
            "process.wait(timeout=5)",
        ):
            self.assertEqual(len(broken(line)) > 0, True, line)
        for line in (
            "self.assertGreater(finished.seconds, 0.3)",
            "self.assertLess(finished.paced, support.SOON)",
            'support.wait_until(lambda: a, "it ends")',
        ):
            self.assertEqual(broken(line), [], line)


if __name__ == "__main__":
    unittest.main()
