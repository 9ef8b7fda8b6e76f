"""What spindle 0.1.0 wrote is read, restored and gone on with: written_by_0.1/."""

import contextlib
import csv
import pathlib
import re
import shutil
import sqlite3
import tempfile
import unittest

import support

OLD = pathlib.Path(__file__).resolve().parent / "written_by_0.1"
NEWEST = 3  # version of a store; docs/promises.md
SERIALS = ("1021100041", "1021100042")


class UpgradeTest(unittest.TestCase):
    maxDiff = None

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="spindle-upgrade-")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def copy(self, name):
        target = self.folder / name
        shutil.copyfile(OLD / name, target)
        target.chmod(0o644)
        return target

    def run_well(self, *arguments, status=0, **options):
        finished = support.run(*arguments, **options)
        self.assertEqual(finished.status, status, finished)
        return finished

    @staticmethod
    def version(store):
        with contextlib.closing(sqlite3.connect(f"file:{store}?mode=ro", uri=True)) as opened:
            return opened.execute("PRAGMA user_version").fetchone()[0]

    def rows_of(self, store):
        """(target, serial, number, kind, torque) of each result."""
        records = self.run_well("results", "--store", store, "--json").records("event")
        return [(record["target"], record["serial"], record["number"], record["kind"], record["torque"])
                for record in records]

    # ---- the store ----

    def test_a_store_is_read_as_it_was(self):
        store = self.copy("store.db")
        self.assertEqual(self.version(store), 1)
        with open(OLD / "results.csv", newline="") as file:
            told = [(row["target"], row["serial"], int(row["number"]), row["kind"], row["torque"])
                    for row in csv.DictReader(file) if row["type"] == "event"]
        self.assertEqual(len(told), 26)
        self.assertEqual([(*row[:4], str(row[4])) for row in self.rows_of(store)], told)
        self.assertEqual(len(self.run_well("results", "--store", store, "--json").records("gap")), 2)
        checked = self.run_well("store", "check", "--store", store)
        self.assertIn("26 rows, 8 numbers in gaps, 0 holes, the store is whole", checked.said)
        self.run_well("report", "--store", store)
        self.assertEqual(self.version(store), 1, "reading has changed it")

    def test_a_store_is_gone_on_with(self):
        store = self.copy("store.db")
        before = self.rows_of(store)
        with support.simulator("doga-bm", "--serial", SERIALS[0], "--rundown-every", "100ms") as url:
            self.run_well("record", url, "--profile", "doga-bm", "--store", store, "--count", "2")
        self.assertEqual(self.version(store), NEWEST)
        after = self.rows_of(store)
        self.assertEqual(after[:len(before)], before)
        self.assertGreaterEqual(len(after), len(before) + 2)
        self.assertEqual({row[1] for row in after[len(before):]}, {SERIALS[0]})
        self.run_well("store", "check", "--store", store)

    # ---- backups and dumps ----

    def test_a_backup_of_a_screwdriver_is_restored(self):
        backup = self.copy("backup-bm.yaml")
        with support.simulator("doga-bm", "--serial", SERIALS[0]) as url:
            tools = self.folder / "here.yaml"
            tools.write_text(f'tools:\n  here: {{url: "{url}", profile: doga-bm, torque-unit: "N.m"}}\n')
            tool = ("here", "--tools", tools)
            self.run_well("diff", backup, *tool, status=1)
            restored = self.run_well("restore", "here", backup, "--tools", tools, "--yes")
            self.assertIn("2 written", restored.said)
            value = self.run_well("get", *tool, "preset.1.target-torque", "--json").records("value")[0]
            self.assertEqual(str(value["value"]), "2.90")
            self.run_well("diff", backup, *tool)
            self.run_well("diff", self.copy("dump.yaml"), *tool)

    def test_a_backup_of_a_driver_is_restored(self):
        backup = self.copy("backup-blv.yaml")
        with support.simulator("orientalmotor-blv", "--units", "1", listen="rtu+tcp://127.0.0.1:0") as url:
            tool = (url, "--profile", "orientalmotor-blv")
            restored = self.run_well("restore", url, backup, "--profile", "orientalmotor-blv", "--yes")
            self.assertIn("2 written", restored.said)
            self.run_well("diff", backup, *tool)

    # ---- what is newer ----

    def test_a_newer_file_is_refused(self):
        """With status 3, and nothing of it is read."""
        for name, arguments in (("backup-bm.yaml", ("diff", "{}", "sim:doga-bm")),
                                ("dump.yaml", ("diff", "{}", "sim:doga-bm")),
                                ("my-driver.yaml", ("profile", "check", "{}"))):
            with self.subTest(name):
                file = self.copy(name)
                text = file.read_text()
                self.assertEqual(len(re.findall(r"(?m)^format: 1$", text)), 1)
                file.write_text(re.sub(r"(?m)^format: 1$", "format: 2", text))
                finished = self.run_well(*(word.format(file) for word in arguments), status=3)
                self.assertIn("format", finished.said + finished.stdout)
        store = self.copy("store.db")
        with contextlib.closing(sqlite3.connect(store)) as opened:
            opened.execute(f"PRAGMA user_version = {NEWEST + 1}")
        for arguments in (("results",), ("record", "sim:doga-bm")):
            finished = self.run_well(*arguments, "--store", store, status=3)
            self.assertIn(f"is a store of version {NEWEST + 1}", finished.said)

    # ---- what users write, and the record of changes ----

    def test_a_tools_file_and_profiles_are_taken(self):
        tools = self.run_well("tools", "--tools", self.copy("tools.yaml"), "--json").records("tool")
        self.assertEqual([tool["name"] for tool in tools][:3], ["station1", "station2", "conveyor1"])
        for name in ("bm-line1.yaml", "my-driver.yaml"):
            self.run_well("profile", "check", self.copy(name))

    def test_the_record_of_changes_is_gone_on_with(self):
        state = self.folder / "spindle"
        state.mkdir()
        record = state / "changes.jsonl"
        record.write_bytes((OLD / "changes.jsonl").read_bytes())
        environment = {"XDG_STATE_HOME": str(self.folder)}
        told = self.run_well("log", "--json", environment=environment)
        self.assertEqual([line["new"] for line in told.records("changed") if line["target"] == "station1"
                          and line["name"] == "preset.1.target-torque" and line["result"] == "written"][-1:],
                         [support.parse_json("2.90")])
        with support.simulator() as url:
            self.run_well("set", url, "--profile", "doga-bm", "preset.1.speed=900", environment=environment)
        lines = record.read_bytes()
        self.assertTrue(lines.startswith((OLD / "changes.jsonl").read_bytes()), "what was recorded was changed")
        keys = [set(support.parse_json(line)) for line in lines.decode().splitlines()]
        for more in keys[10:]:
            self.assertLessEqual(keys[0], more, "a key is gone")


if __name__ == "__main__":
    unittest.main()
