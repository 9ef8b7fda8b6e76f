"""The past: results and store of the real binary, on stores that a peer program writes as `record` does.

CSV is read by Python's csv, files for Q-DAS by a reader that was written from the format alone.
"""

import csv
import datetime
import fcntl
import io
import json
import os
import pathlib
import re
import signal
import sqlite3
import unittest

import support

PROGRAMS = pathlib.Path(os.environ.get("SPINDLE_PEER_PROGRAMS", support.ROOT / "build/dev/tests"))
BARCODE = '=cmd|"a,b"\n\\x1b[2J'  # as it is shown: nothing steers a terminal


def make_store(name, *numbers):
    path = support.home().path / name
    command = [PROGRAMS / "spindle_peer_sample_store", path, *map(str, numbers)]
    support.completed(command, check=True)
    return path


def results(*arguments, **options):
    return support.run("results", *arguments, **options)


class Characteristic:
    def __init__(self):
        self.keys, self.values = {}, []


def read_qdas(path):
    """Part keys and characteristics of a file in the ASCII transfer format of Q-DAS."""
    part, characteristics = {}, []
    for line in path.read_bytes().decode("latin-1").split("\r\n"):
        if not line:
            continue
        if re.match(r"K\d{4}", line):
            key, value = line.split(" ", 1)
            key, _, index = key.partition("/")
            if key.startswith("K2"):
                while len(characteristics) < int(index):
                    characteristics.append(Characteristic())
                characteristics[int(index) - 1].keys[key] = value
            else:
                part[key] = value
            continue
        for characteristic, group in zip(characteristics, line.split("\x0f"), strict=True):
            value, attribute, time = group.split("\x14")
            when = datetime.datetime.strptime(time, "%d.%m.%Y/%H:%M:%S")
            characteristic.values.append((value, int(attribute), when))
    assert int(part["K0100"]) == len(characteristics)
    return part, characteristics


class ResultsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.store = make_store("sample.db")

    def rows(self, *arguments):
        finished = results("--store", self.store, "-o", "csv", "-q", *arguments)
        self.assertEqual(finished.status, 0, finished)
        # The files of run() keep line ends as they are.
        return list(csv.DictReader(io.StringIO(finished.stdout, newline=""), strict=True))

    def test_csv_keeps_its_columns_and_what_a_barcode_holds(self):
        everything = self.rows()
        press = [row for row in everything if row["target"] == "press"]
        self.assertEqual([row["barcode"] for row in press], [BARCODE])
        self.assertEqual([row["torque_unit"] for row in press], ["cN.m"])
        self.assertTrue(all(None not in row and None not in row.values() for row in everything))
        one = self.rows("station1")
        screws = [row for row in everything if row["target"] == "station1"]
        self.assertEqual([{key: row[key] for key in one[0]} for row in screws], one)
        first = one[0]
        self.assertEqual((first["type"], first["number"], first["torque"], first["torque_unit"], first["remembered"]),
                         ("event", "1962", "2.70", "N.m", "true"))
        self.assertEqual((first["a3"], first["a3_unit"], first["fastening_time_unit"]), ("6301", "deg", "ms"))
        self.assertEqual([(row["missed"], row["after"], row["before"]) for row in one if row["type"] == "gap"],
                         [("2", "1964", "1967")])
        self.assertEqual(list(self.rows("station1", "--ng")[0]), list(first))

    def test_qdas_is_read_from_the_format_alone(self):
        folder = support.home().path / "quality"
        zone = {"TZ": "CET-1CEST,M3.5.0,M10.5.0/3"}
        finished = results("--store", self.store, "--qdas", folder, "--json", "-q", environment=zone)
        self.assertEqual(finished.status, 0, finished)
        files = {record["file"]: record for record in finished.records("qdas")}
        self.assertEqual(sorted(files), sorted(map(str, folder.iterdir())))
        old, new = (read_qdas(folder / f"station1-1021100042-preset1{end}.dfq") for end in ("", "-2"))
        part, (torque, angle) = old
        self.assertEqual((part["K1001"], part["K1002"]), ("station1", "preset 1"))
        self.assertIn("+01:00", part["K1900"])
        keys = {key: torque.keys[key] for key in ("K2002", "K2022", "K2101", "K2110", "K2111", "K2120", "K2121", "K2142")}
        self.assertEqual(keys, {"K2002": "torque", "K2022": "2", "K2101": "2.71", "K2110": "2.439", "K2111": "2.981",
                                "K2120": "1", "K2121": "1", "K2142": "N.m"})
        self.assertIn("+- 10.00 %", torque.keys["K2900"])
        self.assertEqual((angle.keys["K2142"], angle.keys.get("K2110"), angle.keys["K2111"]), ("\xb0", None, "7000"))
        # E335 came to its end, E333 did not.
        self.assertEqual([value[:2] for value in torque.values],
                         [("2.70", 0), ("2.72", 0), ("2.69", 0), ("3.10", 0), ("0.80", 255)])
        self.assertEqual(torque.values[0][2], datetime.datetime(2026, 11, 22, 9, 0, 0))
        self.assertEqual([value[0] for value in angle.values], ["6301"] * 5)
        self.assertEqual(new[1][0].keys["K2101"], "2.80")
        self.assertEqual([value[:2] for value in new[1][0].values], [("2.81", 0)])
        press = read_qdas(folder / "press-@press-preset0.dfq")
        self.assertEqual([(c.keys["K2002"], c.keys["K2142"], c.values[0][0]) for c in press[1]],
                         [("torque", "cN.m", "271.00")])

    def test_every_row_is_told_once_while_it_is_followed(self):
        store = make_store("busy.db", 1, 20)
        with support.Running("results", "--store", store, "--follow", "--json") as following:
            numbers = [json.loads(following.line())["number"] for _ in range(20)]
            for first in range(21, 101, 20):
                make_store("busy.db", first, first + 19)
            numbers += [json.loads(following.line())["number"] for _ in range(80)]
            following.send_signal(signal.SIGINT)
            finished = following.finish()
        self.assertEqual(numbers, list(range(1, 101)))
        self.assertEqual(finished.status, 130, finished)
        self.assertEqual([record["type"] for record in finished.records()], ["summary"], finished)
        self.assertEqual(finished.stderr, "", finished)

    def test_a_reader_that_leaves_ends_it_quietly(self):
        store = make_store("left.db", 1, 3)
        with support.Running("results", "--store", store, "--follow", "--json") as following:
            following.line()
            following.process.stdout.close()
            following.process.stdout = None
            finished = following.finish()
        self.assertEqual((finished.status, finished.stderr), (0, ""), finished)

    def test_a_terminal_shows_the_newest_and_the_time_of_its_user(self):
        store = make_store("long.db", 1, 150)
        zone = {"TZ": "CET-1CEST,M3.5.0,M10.5.0/3"}
        shown = support.run_on_terminal("results", "--store", store, columns=200, environment=zone)
        self.assertEqual(shown.status, 0, shown)
        self.assertIn("the newest 100 events; ", shown.stdout, shown)
        self.assertEqual(shown.stdout.count("fastening-ok"), 100, shown)
        self.assertRegex(shown.stdout, r"2026-11-22 \d\d:\d\d:\d\d\.\d{3}\+01:00")
        whole = support.run_on_terminal("results", "--since", "2026-11-22 09:00", "--store", store, columns=200,
                                        environment=zone)
        self.assertEqual(whole.stdout.count("fastening-ok"), 150, whole)
        none = support.run_on_terminal("results", "--until", "2026-11-22 09:00", "--store", store, columns=200,
                                       environment=zone)
        self.assertIn("0 events", none.stdout, none)
        piped = results("--store", store, environment=zone)
        self.assertEqual(piped.stdout.count("fastening-ok"), 150, piped)
        self.assertIn("2026-11-22T08:00:01.000Z", piped.stdout, piped)

    def test_a_store_that_is_not_there_says_what_makes_one(self):
        for arguments in (["results"], ["store", "check"], ["store", "trim", "--before", "1d", "--yes"],
                          ["store", "backup", "x.db"], ["store", "export"]):
            with self.subTest(arguments):
                finished = support.run(*arguments)
                self.assertEqual(finished.status, 3, finished)
                self.assertIn(".local/state/spindle/events.db: there is no store 'spindle record' makes one",
                              finished.said)
        self.assertFalse((support.home().path / ".local").exists())

    def test_the_usual_store_is_that_of_the_user(self):
        folder = support.home().path / "state" / "spindle"
        folder.mkdir(parents=True)
        make_store("state/spindle/events.db", 1, 2)
        finished = results("-q", environment={"XDG_STATE_HOME": str(folder.parent)})
        self.assertEqual(finished.stdout.count("fastening-ok"), 2, finished)

    def test_what_is_no_store_is_a_bad_file(self):
        path = support.home().path / "text.db"
        path.write_text("no store\n" * 1000)
        finished = results("--store", path)
        self.assertEqual(finished.status, 3, finished)
        self.assertIn(str(path), finished.said)


class CareTest(unittest.TestCase):
    def test_a_recorder_that_runs_is_named_by_trim(self):
        store = make_store("locked.db", 1, 3)
        with open(f"{store}.lock", "r+") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            lock.truncate(0)
            lock.write("4711\n")
            lock.flush()
            finished = support.run("store", "trim", "--before", "1s", "--yes", "--store", store)
            self.assertEqual(finished.status, 74, finished)
            self.assertIn("process 4711 writes it", finished.said)
            self.assertEqual(support.run("store", "check", "--store", store).status, 0)
        self.assertEqual(results("--store", store, "-q").stdout.count("fastening-ok"), 3)

    def test_a_backup_is_replaced_only_by_force_and_never_by_itself(self):
        store = make_store("original.db", 1, 3)
        copy = support.home().path / "copy.db"
        copy.write_text("precious")
        refused = support.run("store", "backup", copy, "--store", store)
        self.assertEqual((refused.status, copy.read_text()), (2, "precious"), refused)
        forced = support.run("store", "backup", copy, "--store", store, "--force")
        self.assertEqual(forced.status, 0, forced)
        self.assertEqual(results("--store", copy, "-q").stdout.count("fastening-ok"), 3)
        self.assertEqual(list(support.home().path.glob("copy.db.part*")), [])
        itself = support.run("store", "backup", store, "--store", store, "--force")
        self.assertEqual(itself.status, 2, itself)
        self.assertIn("this is the store itself", itself.said)
        self.assertEqual(results("--store", store, "-q").stdout.count("fastening-ok"), 3)

    def test_an_export_is_everything(self):
        store = make_store("exported.db")
        finished = support.run("store", "export", "--store", store)
        self.assertEqual(finished.status, 0, finished)
        with sqlite3.connect(f"file:{store}?mode=ro", uri=True) as database:
            counts = {name: database.execute(f"SELECT count(*) FROM {name}").fetchone()[0]
                      for name in ("event", "gap", "happening", "place", "epoch", "preset")}
        told = [record["type"] for record in finished.records()]
        for name in ("event", "gap", "place", "epoch", "preset"):
            self.assertEqual(told.count(name), counts.pop(name), name)
        self.assertEqual(told.count("link") + told.count("total"), counts["happening"])
        file = support.home().path / "all.jsonl"
        written = support.run("store", "export", file, "--store", store)
        self.assertEqual((written.status, written.stdout), (0, ""), written)
        self.assertEqual([json.loads(line)["type"] for line in file.read_text().splitlines()], told)


if __name__ == "__main__":
    unittest.main()
