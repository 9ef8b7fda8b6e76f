"""What is typed: the default target, files of values, and changes that are taken back, with the real program."""

import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import support
from register_server import RegisterServer

PROFILE = """format: 1
id: bank
title: "A bank of registers"
link: {framing: tcp, port: 502, unit: 1, max-read: 16, max-write: 16, answer: 500ms, connect: 5s, retries: 1}
parameters:
  - {name: preset.1.a, register: 0, encoding: u16, access: rw, evidence: manual, source: "x", title: "A"}
  - {name: preset.1.b, register: 1, encoding: u16, access: rw, evidence: manual, source: "x", title: "B"}
  - {name: preset.2.a, register: 2, encoding: i16, scale: 0.1, access: rw, evidence: manual, source: "x", title: "C"}
"""


class TypingTest(unittest.TestCase):
    def setUp(self):
        self.home = pathlib.Path(support.home().path)
        self.state = self.home / ".local/state/spindle"
        shutil.rmtree(self.state, ignore_errors=True)
        (self.home / "bank.yaml").write_text(PROFILE, encoding="utf-8")
        self.server = self.enterContext(RegisterServer({0: 10, 1: 20, 2: 30}))
        self.tools = self.home / "spindle.yaml"
        self.tools.write_text(
            f'tools:\n  bench: {{url: "{self.server.url}?unit=1", profile: ./bank.yaml}}\n', encoding="utf-8"
        )
        self.addCleanup(self.tools.unlink)

    def spindle(self, *arguments, **how):
        return support.run(*arguments, **how)

    def test_a_default_target_is_kept_and_what_changes_it_has_to_be_confirmed(self):
        self.assertEqual(self.spindle("use", "bench").status, 0)
        read = self.spindle("get", "1.b", "--json")
        self.assertEqual([(r["target"], r["value"]) for r in read.records("value")], [("bench", 20)])
        refused = self.spindle("set", "1.b=21")
        self.assertEqual(refused.status, 2, refused)
        self.assertIn("bench", refused.said)
        self.assertIn("--yes", refused.said)
        self.assertEqual(self.server.writes, [])
        self.assertEqual(self.spindle("set", "1.b=21", "--yes").status, 0)
        self.assertEqual(self.server.value(1), 21)
        self.assertEqual(self.spindle("use", "-").status, 0)
        self.assertEqual(self.spindle("get", "1.b").status, 2)

    def test_words_in_brackets_arrive_as_they_are_typed(self):
        unreached = self.spindle("get", "[::1]:9", "@holding:0", "--connect-timeout", "2s")
        self.assertEqual(unreached.status, 4, unreached)
        bare = self.spindle("get", "[::1]", "@holding:0", "--connect-timeout", "2s")
        self.assertEqual(bare.status, 4, bare)
        self.assertIn("tcp://[::1]:502", bare.said)
        pair = self.spindle("set", "bench", "[1.a=11,1.b=12]")
        self.assertEqual(pair.status, 2, pair)
        self.assertIn("[1.a", pair.said)
        self.assertEqual(self.server.writes, [])

    def test_files_of_the_shell_are_no_serial_ports(self):
        self.assertEqual(self.spindle("backup", "bench", "-f", "saved.yaml").status, 0)
        self.addCleanup((self.home / "saved.yaml").unlink)
        with (self.home / "saved.yaml").open("rb") as backup:
            for word in ("/dev/stdin", "/dev/fd/0"):
                backup.seek(0)
                same = self.spindle("restore", "bench", word, stdin=backup)
                self.assertEqual(same.status, 0, same)
        self.assertEqual(self.server.writes, [])

    def test_a_backup_may_come_from_a_program_that_is_slow(self):
        self.assertEqual(self.spindle("backup", "bench", "-f", "slow.yaml").status, 0)
        self.addCleanup((self.home / "slow.yaml").unlink)
        with subprocess.Popen(
            ["sh", "-c", "sleep 0.3; cat slow.yaml"], cwd=self.home, stdout=subprocess.PIPE
        ) as slow:
            same = self.spindle("restore", "bench", "/dev/stdin", stdin=slow.stdout)
        self.assertEqual(same.status, 0, same)

    def test_a_file_of_values_may_begin_with_a_mark(self):
        values = self.home / "values.set"
        values.write_bytes(b"\xef\xbb\xbf1.a=11\r\n1.b=12\r\n")
        self.addCleanup(values.unlink)
        self.assertEqual(self.spindle("set", "bench", "-f", "values.set").status, 0)
        self.assertEqual([self.server.value(n) for n in (0, 1)], [11, 12])

    def test_the_environment_names_one_too(self):
        variable = {"SPINDLE_TARGET": "bench"}
        self.assertEqual(self.spindle("get", "1.b", environment=variable).status, 0)
        self.assertEqual(self.spindle("set", "1.b=21", environment=variable).status, 2)
        self.assertEqual(self.server.writes, [])

    def test_a_default_of_another_tools_file_is_none(self):
        self.assertEqual(self.spindle("use", "bench").status, 0)
        other = self.home / "other.yaml"
        other.write_text(self.tools.read_text(encoding="utf-8"), encoding="utf-8")
        self.addCleanup(other.unlink)
        refused = self.spindle("set", "1.b=21", "--yes", "--tools", "other.yaml")
        self.assertEqual(refused.status, 3, refused)
        self.assertEqual(self.server.writes, [])

    def test_a_default_that_others_could_have_written_is_refused(self):
        self.assertEqual(self.spindle("use", "bench").status, 0)
        os.chmod(self.state / "target", 0o666)
        self.assertEqual(self.spindle("get", "1.b").status, 3)

    def test_values_from_standard_input_with_all_their_faults(self):
        with tempfile.TemporaryFile() as lines:
            lines.write(b"# values\npreset.1.a = 11\n1.b += 5\n2.a=-0.5\n")
            lines.seek(0)
            self.assertEqual(self.spindle("set", "bench", "-f", "-", stdin=lines).status, 0)
        self.assertEqual([self.server.value(n) for n in (0, 1, 2)], [11, 25, 0x10000 - 5])
        written = len(self.server.writes)
        with tempfile.TemporaryFile() as lines:
            lines.write(b"preset.1.a=12\npreset.1.x=1\n1.b=fast\n")
            lines.seek(0)
            refused = self.spindle("set", "bench", "-f", "-", stdin=lines)
        self.assertEqual(refused.status, 2, refused)
        self.assertIn("standard input:2", refused.said)
        self.assertIn("standard input:3", refused.said)
        self.assertEqual(len(self.server.writes), written)

    def test_a_change_is_told_by_its_id_and_taken_back(self):
        changed = self.spindle("set", "bench", "preset.1.a+=5", "preset.1.b=21", "--json")
        self.assertEqual(changed.status, 0, changed)
        identity = changed.records("summary")[0]["change_id"]
        told = self.spindle("log", "bench", "--json").records("changed")
        self.assertEqual([r["id"] for r in told], [f"{identity}-1", f"{identity}-2"])
        self.assertEqual(self.spindle("undo", identity).status, 2)
        self.assertEqual((self.server.value(0), self.server.value(1)), (15, 21))
        self.assertEqual(self.spindle("undo", identity, "--yes").status, 0)
        self.assertEqual((self.server.value(0), self.server.value(1)), (10, 20))

    def test_a_value_that_was_changed_again_is_not_taken_back(self):
        self.assertEqual(self.spindle("set", "bench", "preset.1.a=15").status, 0)
        self.server.registers[0] = 16
        refused = self.spindle("undo", "--yes")
        self.assertEqual(refused.status, 8, refused)
        self.assertEqual(self.server.value(0), 16)

    def test_what_to_try_can_be_pasted(self):
        wrong = self.spindle("set", "bench", "preset.1.aa=15")
        [command] = [line.strip() for line in wrong.stderr.splitlines() if line.startswith("  try: ")]
        words = command.removeprefix("try: spindle ").split()
        self.assertEqual(words, ["set", "bench", "preset.1.a=15"])
        self.assertEqual(self.spindle(*words).status, 0)


if __name__ == "__main__":
    unittest.main()
