"""The tools file while several programs write it, the memory of tools, and a job for every night."""

import os
import pathlib
import shutil
import signal
import threading
import unittest

import support

BM = "doga-bm"


class Silent(support.Port):
    """Hears what it is asked, and says nothing."""

    def __init__(self):
        super().__init__()
        self.asked = threading.Event()

    def _serve(self, connection):
        while connection.recv(256):
            self.asked.set()


class ToolsTest(unittest.TestCase):
    def setUp(self):
        self.home = pathlib.Path(support.home().path)
        for folder in (".config", ".cache", "golden", "elsewhere"):
            shutil.rmtree(self.home / folder, ignore_errors=True)
        self.file = self.home / "spindle.yaml"
        self.file.unlink(missing_ok=True)
        self.addCleanup(self.file.unlink, missing_ok=True)

    def names(self):
        finished = support.run("tools", "--json")
        self.assertEqual(finished.status, 0, finished)
        return sorted(record["name"] for record in finished.records("tool"))


class AddTest(ToolsTest):
    def test_a_first_file_is_made_in_the_folder_of_the_user(self):
        self.assertEqual(support.run("tools", "init").status, 0)
        made = self.home / ".config/spindle/tools.yaml"
        text = made.read_text("utf-8")
        again = support.run("tools", "init")
        self.assertEqual(again.status, 2, again)
        self.assertEqual(made.read_text("utf-8"), text)
        url = self.enterContext(support.simulator(BM))
        added = support.run("tools", "add", "station3", url)
        self.assertEqual(added.status, 0, added)
        self.assertIn(str(made), added.said)
        self.assertIn(f'station3: {{url: "{url}", serial: ', made.read_text("utf-8"))
        self.assertEqual(support.run("get", "station3", "preset.1.speed").status, 0)

    def test_links_and_rights_stay(self):
        (self.home / "elsewhere").mkdir()
        real = self.home / "elsewhere/line1.yaml"
        real.write_text("# ours\ntools:\n  a: {url: tcp://127.0.0.1:1}\n", "utf-8")
        real.chmod(0o600)
        self.file.symlink_to(real)
        added = support.run("tools", "add", "b", "tcp://127.0.0.1:2", "--offline")
        self.assertEqual(added.status, 0, added)
        self.assertTrue(self.file.is_symlink())
        self.assertEqual(real.stat().st_mode & 0o777, 0o600)
        self.assertEqual(os.listdir(self.home / "elsewhere"), ["line1.yaml"])
        self.assertEqual(self.names(), ["a", "b"])

    def check_adding_at_once(self, count):
        names = [f"t{number}" for number in range(count)]
        running = [
            self.enterContext(support.Running("tools", "add", name, f"tcp://127.0.0.1:{1000 + place}", "--offline"))
            for place, name in enumerate(names)
        ]
        for program in running:
            self.assertEqual(support.wait_for_end(program.process), 0, program.arguments)
        self.assertEqual(self.names(), names)

    def test_several_that_add_at_once_lose_nothing(self):
        self.file.write_text("tools: {}\n", "utf-8")
        self.check_adding_at_once(8)

    def test_several_that_make_the_file_at_once_lose_nothing(self):
        self.check_adding_at_once(4)

    def test_a_file_that_other_users_can_write_is_not_added_to(self):
        text = "tools: {}\n"
        self.file.write_text(text, "utf-8")
        self.file.chmod(0o666)
        added = support.run("tools", "add", "b", "tcp://127.0.0.1:2", "--offline")
        self.assertEqual(added.status, 3, added)
        self.assertEqual(self.file.read_text("utf-8"), text)

    def test_a_folder_without_rights_is_an_error_and_no_loss(self):
        if os.geteuid() == 0:
            self.skipTest("root may write everywhere")
        folder = self.home / "elsewhere"
        folder.mkdir()
        (folder / "line1.yaml").write_text("tools: {}\n", "utf-8")
        folder.chmod(0o500)
        self.addCleanup(folder.chmod, 0o700)
        added = support.run("tools", "add", "b", "tcp://127.0.0.1:2", "--offline", "--tools", "elsewhere/line1.yaml")
        self.assertEqual(added.status, 74, added)
        self.assertEqual((folder / "line1.yaml").read_text("utf-8"), "tools: {}\n")

    def test_an_entry_with_a_fault_is_not_completed(self):
        self.file.write_text("tools:\n  good: {url: tcp://127.0.0.1:1}\n  bad: {urll: tcp://127.0.0.1:2}\n", "utf-8")
        for words in (("get", ""), ("tools", "test", "")):
            offered = [line.split("\t")[0] for line in support.run("__complete", *words).stdout.splitlines()]
            self.assertIn("good", offered)
            self.assertNotIn("bad", offered)

    def test_a_sink_with_a_fault_is_not_used(self):
        self.file.write_text(
            "tools: {}\nsinks:\n  plant: {url: mqtt://127.0.0.1:1, windw: 5}\n  other: {url: mqtt://127.0.0.1:1}\n", "utf-8"
        )
        for command in (("forward", "plant", "--dry-run"), ("record", "sim:doga-bm", "--lease", "plant")):
            finished = support.run(*command)
            self.assertEqual(finished.status, 3, finished)
            self.assertIn("spindle.yaml:3:", finished.said)

    def test_ctrl_c_while_the_tool_is_asked_writes_nothing(self):
        silent = self.enterContext(Silent())
        text = "tools: {}\n"
        self.file.write_text(text, "utf-8")
        program = self.enterContext(
            support.Running("tools", "add", "b", silent.url, "--timeout", "60s")
        )
        support.wait_until(silent.asked.is_set, "it asks")
        program.process.send_signal(signal.SIGINT)
        self.assertEqual(support.wait_for_end(program.process), 130)
        self.assertEqual(self.file.read_text("utf-8"), text)


class MemoryTest(ToolsTest):
    def seen(self):
        return self.home / ".cache/spindle/tools-seen"

    def test_where_a_tool_was_is_kept_for_this_user_alone(self):
        url = self.enterContext(support.simulator(BM))
        self.assertEqual(support.run("get", url, "preset.1.speed").status, 0)
        self.assertEqual(self.seen().stat().st_mode & 0o777, 0o600)
        port = support.host_and_port(url)[1]
        self.assertIn(f"127.0.0.1\t\t{port}\t{BM}\t", self.seen().read_text("utf-8"))
        bare = support.run("get", "127.0.0.1", "preset.1.speed", "--json")
        self.assertEqual(bare.status, 0, bare)

    def test_a_memory_that_cannot_be_used_is_none(self):
        url = self.enterContext(support.simulator(BM))
        self.assertEqual(support.run("get", url, "preset.1.speed").status, 0)
        whole = self.seen().read_bytes()

        def broken():
            self.seen().write_bytes(whole[:-3])

        def others():
            self.seen().write_bytes(whole)
            self.seen().chmod(0o666)

        def folder():
            self.seen().unlink()
            self.seen().mkdir()

        for spoil in (broken, others, folder):
            with self.subTest(spoil.__name__):
                spoil()
                finished = support.run("get", url, "preset.1.speed")
                self.assertEqual((finished.status, finished.stderr), (0, ""), finished)
                shown = support.run("get", url, "preset.1.speed", "-v")
                self.assertEqual(shown.status, 0, shown)
        self.seen().rmdir()
        self.seen().parent.rmdir()
        self.seen().parent.write_text("no folder", "utf-8")
        finished = support.run("get", url, "preset.1.speed")
        self.assertEqual((finished.status, finished.stderr), (0, ""), finished)
        self.seen().parent.unlink()

    def test_names_of_a_tool_that_was_seen_are_completed(self):
        url = self.enterContext(support.simulator(BM))
        before = support.run("__complete", "get", url, "preset.1.spee")
        self.assertNotIn("preset.1.speed", before.stdout)
        self.assertEqual(support.run("get", url, "preset.1.speed").status, 0)
        after = support.run("__complete", "get", url, "preset.1.spee")
        self.assertIn("preset.1.speed", after.stdout)


class NightTest(ToolsTest):
    def drift(self):
        finished = support.run("diff", "@line", "--dir", "golden", "--json")
        states = {r["target"]: r["state"] for r in finished.records("summary") if r["target"]}
        return finished.status, states

    def test_a_job_of_every_night(self):
        one, two = (self.enterContext(support.simulator(BM, "--serial", str(number))) for number in (41, 42))
        gone = self.enterContext(support.refusing_port())
        self.file.write_text(
            "tools:\n"
            f'  one: {{url: "{one}", profile: {BM}}}\n'
            f'  two: {{url: "{two}", profile: {BM}}}\n'
            f'  gone: {{url: "{gone}", profile: {BM}}}\n'
            "groups: {line: [one, two], all: [one, two, gone]}\n",
            "utf-8",
        )
        backup = ("backup", "@line", "--dir", "golden", "--json")
        first = support.run(*backup)
        self.assertEqual(first.status, 0, first)
        times = {path: path.stat().st_mtime_ns for path in (self.home / "golden").iterdir()}
        self.assertEqual(len(times), 2)
        second = support.run(*backup)
        self.assertEqual(second.status, 0, second)
        self.assertEqual([r["result"] for r in second.records("backup")], ["unchanged"] * 2)
        self.assertEqual(times, {path: path.stat().st_mtime_ns for path in (self.home / "golden").iterdir()})
        self.assertEqual(self.drift(), (0, {"one": "same", "two": "same"}))

        self.assertEqual(support.run("set", "two", "preset.1.speed=900").status, 0)
        self.assertEqual(self.drift(), (1, {"one": "same", "two": "different"}))
        refused = support.run(*backup)
        self.assertEqual(refused.status, 9, refused)
        self.assertIn("--force", refused.said)
        (self.home / "golden/old.yaml").write_text("", "utf-8")
        shutil.copy(self.home / "golden/one.yaml", self.home / "golden/gone.yaml")
        finished = support.run("diff", "@all", "--dir", "golden", "--json")
        self.assertEqual(finished.status, 9, finished)
        told = finished.records("summary")
        self.assertEqual(
            {r["target"]: r["state"] for r in told[:-1]}, {"one": "same", "two": "different", "gone": "failed"}
        )
        self.assertEqual(
            [told[-1][key] for key in ("tools_same", "tools_different", "tools_failed")], [1, 1, 1], finished
        )
        self.assertEqual(told[-1]["extra_files"], ["golden/old.yaml"])


if __name__ == "__main__":
    unittest.main()
