"""Raw registers: a scan that is stopped, a tool that goes away, dumps, and tables that are none."""

import json
import os
import pathlib
import shutil
import signal
import stat
import struct
import tempfile
import threading
import unittest

import register_server
import support


class SparseServer(register_server.RegisterServer):
    """Has only the registers that it was given, and closes the connection behind so many requests."""

    def __init__(self, registers, last=None):
        super().__init__(registers)
        self.requests = []
        self.last = last
        self.enough = threading.Event()

    def _answer(self, request):
        self.requests.append(request.function)
        if len(self.requests) >= 5:
            self.enough.set()
        if self.last is not None and len(self.requests) > self.last:
            raise OSError("unplugged")
        if request.function in (3, 4):
            first, count = struct.unpack(">HH", request.data[:4])
            if not all(first + at in self.registers for at in range(count)):
                return bytes([request.function | 0x80, 2])
        return super()._answer(request)


class RegistersTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-registers-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return str(self.folder / name)

    def test_scan_finds_what_is_there_and_writes_nothing(self):
        there = {*range(3, 40), 100, *range(200, 202)}
        with SparseServer({at: at for at in there}) as server:
            finished = support.run("scan", server.url, "--registers", "0..299", "--pause", "1ms", "--json")
            self.assertEqual(finished.status, 0, finished)
            found = {at for run in finished.records("registers") for at in range(run["from"], run["to"] + 1)}
            self.assertEqual(found, there)
            self.assertEqual(set(server.requests), {3})
            self.assertEqual(server.writes, [])
            self.assertEqual(finished.records("summary")[0]["requests"], len(server.requests))

    def test_a_signal_ends_it_with_what_is_known(self):
        for number, status in ((signal.SIGINT, 130), (signal.SIGTERM, 143)):
            with self.subTest(status=status), SparseServer({at: at for at in range(0x10000)}) as server:
                with support.Running(
                    "scan", server.url, "--registers", "0..65535", "--pause", "50ms", "--json"
                ) as running:
                    support.wait_until(server.enough.is_set, "five requests")
                    running.send_signal(number)
                    finished = running.finish()
                self.assertEqual(finished.status, status, finished)
                (run,) = finished.records("registers")
                self.assertEqual(run["from"], 0, finished)
                self.assertGreaterEqual(run["count"], 16 * 4, finished)
                self.assertEqual(finished.records("summary")[0]["exit_status"], status, finished)

    def test_a_tool_that_goes_away_is_an_error_behind_what_is_known(self):
        with SparseServer({at: at for at in range(1000)}, last=3) as server:
            finished = support.run("scan", server.url, "--registers", "0..999", "--json", "--retries", "0")
        self.assertEqual(finished.status, 9, finished)
        self.assertEqual([run["count"] for run in finished.records("registers")], [48], finished)
        self.assertEqual(len(finished.records("error")), 1, finished)

    def test_dump_is_for_its_user_alone_and_compares(self):
        path = self.path("d.yaml")
        with SparseServer({at: at * 7 for at in (*range(20), 30)}) as server:
            finished = support.run("dump", server.url, path, "--registers", "0..40", "--pause", "1ms")
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual(stat.S_IMODE(os.stat(path).st_mode), 0o600)
            self.assertEqual(os.listdir(self.folder), ["d.yaml"])
            self.assertEqual(support.run("diff", server.url, path).status, 0)
            server.registers[5] = 1
            finished = support.run("diff", path, server.url, "--json")
            self.assertEqual(finished.status, 1, finished)
            (difference,) = finished.records("diff")
            self.assertEqual((difference["register"], difference["a"], difference["b"]), (5, 35, 1))
            self.assertEqual(server.writes, [])

    def test_dump_leaves_nothing_where_it_fails(self):
        with SparseServer({at: at for at in range(1000)}, last=3) as server:
            finished = support.run("dump", server.url, self.path("d.yaml"), "--registers", "0..999", "--retries", "0")
        self.assertNotEqual(finished.status, 0, finished)
        self.assertEqual(os.listdir(self.folder), [])

    def test_hostile_tables(self):
        cases = {
            "line": b"register,name\n1," + b"a" * 900_000,
            "nul": b"register,name\n1,\0\n",
            "quote": b'register,name\n1,"' + b"x\n" * 100_000,
            "rows": b"register\n" + b"1\n" * 100_000,
            "latin": b"register,unit\n1,\xb0C\n",
            "separators": b"register\n" + b"," * 500_000,
            "large": b"register\n" + b"1\n" * 3_000_000,
        }
        for name, content in cases.items():
            with self.subTest(name=name):
                table = self.folder / f"{name}.csv"
                table.write_bytes(content)
                profile = f"hostile-{name}"
                finished = support.run("profile", "new", profile, "--from", str(table), "--json")
                written = pathlib.Path(support.home().path) / f"{profile}.yaml"
                if name == "line":
                    self.assertEqual(finished.status, 0, finished)
                    self.assertLess(written.stat().st_size, 3000)
                else:
                    self.assertEqual(finished.status, 3, finished)
                    self.assertFalse(written.exists())
                    self.assertLess(len(finished.stderr), 2000)
                for line in finished.stdout.splitlines():
                    json.loads(line)

    def test_what_is_written_is_a_profile(self):
        table = self.folder / "map.csv"
        table.write_text(
            "\ufeffRegister;Name;Type;Scale;Unit;Access;Description\r\n"
            '0;Motor_Speed;UINT16;0,1;rpm;R;"Speed ""now""; {n}: # \\"\r\n'
            "1;;int16;;°C;RW;Température (max.)\r\n1;true;;;;;\r\n2;null;int32;;;rw;\r\n3;;;;;;inside\r\n"
        )
        for name, arguments in (("bare", ()), ("from-map", ("--from", str(table)))):
            finished = support.run("profile", "new", name, *arguments)
            self.assertEqual(finished.status, 0, finished)
            checked = support.run("profile", "check", f"./{name}.yaml")
            self.assertEqual(checked.status, 0, checked)
        listed = support.run("list", "--profile", "./from-map.yaml", "--json").records("parameter")
        self.assertEqual(
            [one["name"] for one in listed], ["motor-speed", "temp-rature-max", "true", "null", "inside"]
        )
        self.assertEqual(listed[0]["title"], 'Speed "now"; {n}: # \\')
        self.assertEqual(listed[1]["unit"], "°C")

    def test_a_large_table_becomes_a_profile_that_can_be_used(self):
        table = self.folder / "large.csv"
        rows = "".join(f"{at},Value {at},uint16,0.1,rpm,rw,The value of register {at}\n" for at in range(4000))
        table.write_text("register,name,type,scale,unit,access,description\n" + rows)
        finished = support.run("profile", "new", "large", "--from", str(table))
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual(support.run("profile", "check", "./large.yaml").status, 0)


if __name__ == "__main__":
    unittest.main()
