"""docs/promises.md: what scripts rely on is still there. promised.json has what was promised with 1.0.0 and since.

SPINDLE_UPDATE=1 adds to that file what is new, once it is to be released; nothing ever leaves it.
"""

import json
import os
import pathlib
import re
import unittest

import support

PROMISED = pathlib.Path(__file__).resolve().parent / "promised.json"
SCHEMA = support.ROOT / "share" / "spindle-1.schema.json"
# Commands whose options depend on the product.
PRODUCTS = {"remote-start": ("sim:doga-bm", "sim:orientalmotor-blv"), "simulate": ("doga-bm", "orientalmotor-blv")}


def candidates(*words):
    """What TAB offers behind these words."""
    finished = support.run("__complete", *words)
    if finished.status != 0:
        raise AssertionError(finished)
    return [line.split("\t")[0] for line in finished.stdout.splitlines()[1:]]


def commands():
    """The long options of each command, as TAB offers them."""
    found = {}
    waiting = [(command,) for command in candidates("")]
    while waiting:
        command = waiting.pop()
        below = [] if len(command) > 1 else [word for word in candidates(*command, "")
                                             if re.fullmatch("[a-z]+", word) and command[0] in ("profile", "store")]
        waiting += [(*command, word) for word in below]
        found[" ".join(command)] = sorted({option for product in PRODUCTS.get(command[0], (None,))
                                           for option in candidates(*command, *([product] if product else []), "--")})
    return found


def records():
    """Of each type of record its keys, and those that are always there."""
    schema = json.loads(SCHEMA.read_text())
    return {name: {"keys": sorted(schema["$defs"][name]["properties"]),
                   "always": sorted(schema["$defs"][name]["required"])}
            for name in schema["properties"]["type"]["enum"]}


def environment():
    page = (support.ROOT / "man" / "spindle.1.in").read_text()
    section = page[page.index("\n.Sh ENVIRONMENT\n"):page.index("\n.Sh FILES\n")]
    return sorted({name for line in re.findall(r"^\.It Ev (.*)$", section, re.MULTILINE) for name in line.split(" , ")})


def lost(promised, found, place=""):
    """What was promised and is not there."""
    if isinstance(promised, dict):
        return [fault for key, value in promised.items()
                for fault in (lost(value, found[key], f"{place} {key}") if key in found else [f"{place} {key}"])]
    return [f"{place} {word}" for word in promised if word not in found]


class PromisesTest(unittest.TestCase):
    maxDiff = None

    def test_nothing_that_was_promised_is_gone(self):
        found = {"commands": commands(), "records": records(), "environment": environment()}
        promised = json.loads(PROMISED.read_text()) if PROMISED.exists() else {}
        self.assertEqual(lost(promised, found), [])
        if "SPINDLE_UPDATE" in os.environ:
            text = json.dumps(found, indent=1, sort_keys=True)
            lists = re.compile(r"\[[^][]*\]")
            PROMISED.write_text(lists.sub(lambda words: re.sub(r"\s+", " ", words[0]), text) + "\n")
        self.assertGreater(len(promised["commands"]), 25)

    def test_what_is_lost_is_found(self):
        found = {"a": {"keys": ["x", "y"]}, "b": ["z"]}
        self.assertEqual(lost({"a": {"keys": ["x"]}}, found), [])
        self.assertEqual(lost({"a": {"keys": ["w"]}, "c": []}, found), [" a keys w", " c"])

    def test_files_have_the_versions_that_are_promised(self):
        page = (support.ROOT / "docs" / "promises.md").read_text()
        self.assertIn("| backup, dump | `format: 1` |", page)
        self.assertIn("| profile | `format: 1` |", page)
        backup = support.home().path / "promised.yaml"
        store = support.home().path / "promised.db"
        with support.simulator("doga-bm", "--rundown-every", "100ms") as url:
            tool = (url, "--profile", "doga-bm")
            self.assertEqual(support.run("backup", *tool, "-f", backup, "--force").status, 0)
            self.assertEqual(support.run("record", *tool, "--store", store, "--count", "1").status, 0)
        self.assertIn("\nformat: 1\n", backup.read_text())
        version = int.from_bytes(store.read_bytes()[60:64], "big")  # user_version of an SQLite file
        self.assertIn(f"| store of results | {version} |", page)
        self.assertIn("profile format 1", support.run("--version").stdout)


if __name__ == "__main__":
    unittest.main()
