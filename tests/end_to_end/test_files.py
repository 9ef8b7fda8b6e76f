"""What stands in files that decide about tools: whose they are, and that no text can eat the machine."""

import os
import resource
import unittest

import support

STRANGER = 12345  # no user of any machine
MEMORY = 256 << 20  # bytes of address space; the program needs a tenth
HOSTILE = {
    "a comma": " ,x]a,x]",
    "JSON with a comma behind it": '{"format": 1, "tools": {}},\n',
    "quoted CSV": '"name","value"\n"a","b"\n',
    "brackets": "[" * 1_000_000,
    "many values": "[" + "a," * 500_000 + "]",
    "many documents": "---\n" * 250_000,
    "many tags": "".join(f"%TAG !a{n}! b\n" for n in range(60_000)),
}
TOOLS = """tools:
  station: {url: "sim:doga-bm", profile: ./line.yaml}
"""
PROFILE = """format: 1
id: line
title: "BM of the line"
extends: doga-bm
"""


class FilesTest(unittest.TestCase):
    def setUp(self):
        self.folder = support.home().path
        self.tools = self.folder / "spindle.yaml"
        self.profile = self.folder / "line.yaml"

    def tearDown(self):
        for path in self.folder.iterdir():
            if path.is_file() or path.is_symlink():
                path.unlink()

    def run_bounded(self, *arguments):
        limit = None if support.is_sanitized() else (lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)))
        return support.completed(
            [support.binary(), *arguments],
            capture_output=True,
            cwd=self.folder,
            env=support.home().environment(),
            preexec_fn=limit,
        )


class BoundedTest(FilesTest):
    def test_no_text_takes_more_than_its_share(self):
        for what, text in HOSTILE.items():
            self.tools.write_text(text)
            other = self.folder / "other.yaml"
            other.write_text(text)
            for arguments in (
                ("get", "station", "preset.1.speed"),
                ("profile", "check", "other.yaml"),
                ("get", "sim:doga-bm", "--profile", "./other.yaml", "preset.1.speed"),
                ("restore", "sim:doga-bm", "other.yaml", "--dry-run"),
                ("diff", "./other.yaml", "sim:doga-bm", "--profile", "doga-bm"),
                ("tools", "--check"),
                ("remote-stop", "station"),
            ):
                with self.subTest(what=what, arguments=arguments):
                    ended = self.run_bounded(*arguments)
                    self.assertIn(ended.returncode, (2, 3), ended.stderr[-500:])
                    self.assertNotIn(b"internal", ended.stderr)

    def test_a_stop_that_has_a_url_reads_no_tools_file(self):
        os.mkfifo(self.tools)
        try:
            for arguments in (
                ("remote-stop", "sim:doga-bm"),
                ("get", "sim:doga-bm", "preset.1.speed"),
            ):
                self.assertEqual(self.run_bounded(*arguments).returncode, 0, arguments)
        finally:
            self.tools.unlink()
        self.tools.write_text(HOSTILE["a comma"])
        self.assertEqual(self.run_bounded("remote-stop", "sim:doga-bm").returncode, 0)


class WhoseFileTest(FilesTest):
    def setUp(self):
        super().setUp()
        self.tools.write_text(TOOLS)
        self.profile.write_text(PROFILE)
        for path in (self.tools, self.profile):
            path.chmod(0o644)

    def get(self, **environment):
        return support.run("get", "station", "preset.1.speed", environment=environment)

    def refused(self, finished, path, why):
        self.assertEqual(finished.status, 3, finished)
        self.assertIn(path, finished.said)
        self.assertIn("it is not read", finished.said)
        self.assertIn(why, finished.said)

    def test_one_s_own_files_are_read(self):
        self.assertEqual(self.get().status, 0, self.get())

    def test_a_file_that_others_can_write_is_not_read(self):
        for path in (self.tools, self.profile):
            with self.subTest(path=path):
                path.chmod(0o646)
                self.refused(self.get(), path.name, f"chmod o-w ./{path.name}")
                self.refused(self.get(SPINDLE_TRUST="root"), path.name, "chmod")
                path.chmod(0o644)
                self.assertEqual(self.get().status, 0)

    @unittest.skipIf(os.geteuid() != 0, "only root can give a file away")
    def test_the_file_of_another_user_is_not_read(self):
        for path in (self.tools, self.profile):
            with self.subTest(path=path):
                os.chown(path, STRANGER, STRANGER)
                self.refused(self.get(), path.name, f"SPINDLE_TRUST={STRANGER}")
                self.assertEqual(self.get(SPINDLE_TRUST=f"anna,{STRANGER}").status, 0)
                self.refused(self.get(SPINDLE_TRUST="anna"), path.name, "it belongs to")
                os.chown(path, 0, 0)

    @unittest.skipIf(os.geteuid() != 0, "only root can give a file away")
    def test_neither_is_what_a_profile_extends_nor_what_a_link_of_theirs_leads_to(self):
        base = self.folder / "doga-bm.yaml"
        base.write_text('format: 1\nid: doga-bm\ntitle: "Mine"\nextends: doga-common\n')
        os.chown(base, STRANGER, STRANGER)
        self.refused(self.get(), "doga-bm.yaml", "it belongs to")
        base.unlink()
        real = self.folder / "real.yaml"
        self.tools.rename(real)
        self.tools.symlink_to(real)
        self.assertEqual(self.get().status, 0)
        os.chown(self.tools, STRANGER, STRANGER, follow_symlinks=False)
        self.refused(self.get(), "spindle.yaml", "it belongs to")

    @unittest.skipIf(os.geteuid() != 0, "only root can give a file away")
    def test_a_url_needs_no_file_and_completion_stays_silent(self):
        os.chown(self.tools, STRANGER, STRANGER)
        self.assertEqual(support.run("get", "sim:doga-bm", "preset.1.speed").status, 0)
        stopped = support.run("remote-stop", "station")
        self.assertEqual(stopped.status, 2, stopped)
        self.assertIn("spindle.yaml: it is not read, because it belongs to", stopped.said)
        completed = support.run("__complete", "get", "")
        self.assertEqual((completed.status, completed.stderr), (0, ""))
        self.assertNotIn("station", completed.stdout)

    def test_a_relative_profile_belongs_to_the_folder_of_the_tools_file(self):
        below = self.folder / "below"
        below.mkdir()
        try:
            (below / "tools.yaml").write_text(TOOLS.replace("line.yaml", "own.yaml"))
            (below / "own.yaml").write_text(PROFILE.replace("id: line", "id: own"))
            finished = support.run("get", "station", "preset.1.speed", "--tools", "below/tools.yaml")
            self.assertEqual(finished.status, 0, finished)
            checked = support.run("tools", "--check", "--tools", "below/tools.yaml")
            self.assertEqual(checked.status, 0, checked)
        finally:
            for path in below.iterdir():
                path.unlink()
            below.rmdir()


if __name__ == "__main__":
    unittest.main()
