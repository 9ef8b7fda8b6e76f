"""Backup, diff and restore: the round trip, and files that are not what they should be."""

import contextlib
import os
import pathlib
import re
import resource
import shutil
import subprocess
import tempfile
import unittest

import hostile_server
import support

PROFILE = ("--profile", "doga-bm")
MEMORY = 200_000_000  # bytes that any file must do with


def tearDownModule():
    support.remove_home()


def limited(limit, value, *arguments):
    """Runs spindle with one of its resources limited."""
    with tempfile.TemporaryFile() as stderr:
        process = subprocess.Popen(
            [support.binary(), *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=stderr,
            cwd=support.home().path,
            env=support.home().environment(),
            preexec_fn=lambda: resource.setrlimit(limit, (value, value)),
        )
        status = support.wait_for_end(process)
        stderr.seek(0)
        return status, stderr.read().decode()


class BackupTest(unittest.TestCase):
    """Files go to a folder of the test's own."""

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-backup-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return str(self.folder / name)

    def backup(self, url, name, *arguments):
        finished = support.run("backup", url, *PROFILE, "-f", self.path(name), *arguments)
        self.assertEqual(finished.status, 0, finished)
        return self.path(name)

    def restore(self, url, path, *arguments):
        return support.run("restore", url, path, *PROFILE, "--yes", "--json", *arguments)

    def assert_no_litter(self, *names):
        self.assertEqual(sorted(os.listdir(self.folder)), sorted(names))


class RoundTripTest(BackupTest):
    def setUp(self):
        super().setUp()
        self.url = self.enterContext(support.simulator())

    def write_by_other_means(self, values):
        host, port = support.host_and_port(self.url)
        mbpoll = shutil.which("mbpoll")
        if mbpoll is None:
            self.skipTest("mbpoll is not installed")
        for register, value in values.items():
            support.completed(
                [mbpoll, "-m", "tcp", "-p", str(port), "-0", "-1", "-q", "-t", "4",
                 "-r", str(register), host, str(value)],
                check=True, stdout=subprocess.DEVNULL,
            )

    def test_forty_changes(self):
        path = self.backup(self.url, "before.yaml")
        changes = {register: 7000 + register for register in range(300, 338)}
        changes.update({2: 310, 23: 810})
        self.write_by_other_means(changes)

        compared = support.run("diff", path, self.url, *PROFILE, "--json")
        self.assertEqual(compared.status, 1, compared)
        seen = {int(r["register"]): r for r in compared.records("diff")}
        self.assertEqual(sorted(seen), sorted(changes))
        self.assertEqual(str(seen[2]["a"]) + " " + str(seen[2]["b"]), "2.71 3.10")

        with support.Recorder(self.url) as recorder:
            restored = self.restore(recorder.url, path)
            self.assertEqual(restored.status, 0, restored)
            writes = [r.words[0] for r in recorder.requests if r.function == support.WRITE_SINGLE]
            self.assertEqual(writes, sorted(changes))
        self.assertEqual(support.run("diff", path, self.url, *PROFILE).status, 0)

        with support.Recorder(self.url) as recorder:
            again = self.restore(recorder.url, path)
            self.assertEqual(again.status, 0, again)
            self.assertEqual(recorder.count(support.WRITE_SINGLE), 0)

    def test_two_backups_differ_only_in_their_time(self):
        texts = [pathlib.Path(self.backup(self.url, name)).read_text() for name in ("a.yaml", "b.yaml")]
        lines = [
            (a, b) for a, b in zip(*(text.splitlines() for text in texts), strict=True) if a != b
        ]
        self.assertEqual([a.split(":")[0] for a, _ in lines], ["time"])

    def test_the_requests_of_a_full_backup(self):
        with support.Recorder(self.url) as recorder:
            self.backup(recorder.url, "a.yaml")
        # The identity, 24 blocks, and one question for each of the five registers that are said
        # not to exist.
        self.assertEqual(len(recorder.requests), 1 + 24 + 5)

    def test_nothing_is_overwritten_unasked(self):
        path = self.backup(self.url, "a.yaml")
        before = pathlib.Path(path).read_bytes()
        refused = support.run("backup", self.url, *PROFILE, "-f", path)
        self.assertEqual(refused.status, 2, refused)
        self.assertEqual(pathlib.Path(path).read_bytes(), before)
        self.backup(self.url, "a.yaml", "--force")
        self.assertNotEqual(pathlib.Path(path).read_bytes(), before)
        self.assert_no_litter("a.yaml")

    def test_a_full_disk_leaves_the_old_file(self):
        path = self.backup(self.url, "a.yaml")
        before = pathlib.Path(path).read_bytes()
        status, stderr = limited(
            resource.RLIMIT_FSIZE, 8192, "backup", self.url, *PROFILE, "-f", path, "--force"
        )
        self.assertEqual(status, 3, stderr)
        self.assertIn("cannot be written", stderr)
        self.assertEqual(pathlib.Path(path).read_bytes(), before)
        self.assert_no_litter("a.yaml")

    def test_a_full_disk_before_a_restore(self):
        path = self.backup(self.url, "a.yaml")
        self.write_by_other_means({300: 5})
        with support.Recorder(self.url) as recorder:
            status, stderr = limited(
                resource.RLIMIT_FSIZE, 8192, "restore", recorder.url, path, *PROFILE, "--yes"
            )
        self.assertEqual(status, 3, stderr)
        self.assertIn("nothing was written", stderr)
        self.assertEqual(recorder.count(support.WRITE_SINGLE), 0)

    def test_special_files_stay_what_they_are(self):
        for path in ("/dev/full", "/dev/null", str(self.folder)):
            with self.subTest(path):
                finished = support.run("backup", self.url, *PROFILE, "-f", path, "--force")
                self.assertEqual(finished.status, 3, finished)
        self.assertTrue(os.path.exists("/dev/full"))

    def test_a_link_stays_a_link(self):
        real = self.backup(self.url, "real.yaml")
        os.symlink(real, self.path("link.yaml"))
        self.backup(self.url, "link.yaml", "--force")
        self.assertTrue(os.path.islink(self.path("link.yaml")))
        self.assert_no_litter("link.yaml", "real.yaml")

    def test_standard_output(self):
        finished = support.run("backup", self.url, *PROFILE, "-f", "-")
        self.assertEqual((finished.status, finished.stderr), (0, ""), finished)
        pathlib.Path(self.path("a.yaml")).write_text(finished.stdout, encoding="utf-8")
        self.assertEqual(support.run("diff", self.path("a.yaml"), self.url, *PROFILE).status, 0)

    def test_a_group_is_saved_side_by_side(self):
        with contextlib.ExitStack() as stack:
            urls = [stack.enter_context(support.simulator()) for _ in range(3)]
            urls.append(stack.enter_context(support.refusing_port()))
            tools = "".join(
                f'  tool{n}: {{url: "{url}", profile: doga-bm}}\n' for n, url in enumerate(urls)
            )
            names = ", ".join(f"tool{n}" for n in range(len(urls)))
            config = pathlib.Path(self.path("tools"))
            config.write_text(f"tools:\n{tools}groups:\n  line: [{names}]\n", encoding="utf-8")
            finished = support.run(
                "backup", "@line", "--tools", config, "--dir", self.path("out"), "--json"
            )
        self.assertEqual(finished.status, 9, finished)
        self.assertEqual(len(finished.records("backup")), 3)
        self.assertEqual(len(finished.records("error")), 1)
        self.assertEqual(sorted(os.listdir(self.path("out"))), [f"tool{n}.yaml" for n in range(3)])
        compared = support.run("diff", self.path("out/tool0.yaml"), self.path("out/tool1.yaml"))
        self.assertEqual(compared.status, 0, compared)

    def test_every_fifth_answer_is_lost(self):
        path = self.backup(self.url, "a.yaml")
        with support.simulator("doga-bm", "--fault", "lost@every:5") as url:
            changed = support.run("set", url, *PROFILE, "--timeout", "300ms", "p300=7", "p301=8", "p302=9")
            self.assertEqual(changed.status, 0, changed)
            restored = self.restore(url, path, "--timeout", "300ms")
            self.assertEqual(restored.status, 0, restored)
            self.assertEqual([r["result"] for r in restored.records("write")], ["written"] * 3)
            compared = support.run("diff", path, url, *PROFILE, "--timeout", "300ms")
            self.assertEqual(compared.status, 0, compared)


class HostileFileTest(BackupTest):
    def setUp(self):
        super().setUp()
        self.server = self.enterContext(hostile_server.HostileServer({}))
        self.good = pathlib.Path(self.backup(self.server.url, "good.yaml")).read_text(encoding="utf-8")
        self.asked = len(self.server.requests)

    def test_hostile_files(self):
        good = self.good.encode()
        line = b"  - {name: p300, register: 300, raw: 3300, value: 3300, minimum: 300, maximum: 59700}\n"
        self.assertIn(line, good)
        deep = b"format: 1\nkind: spindle-backup\n"
        bomb = b"a: &a [x, x, x, x, x, x, x, x, x]\n" + b"".join(
            b"%c: &%c [%s]\n" % (97 + n, 97 + n, b", ".join([b"*%c" % (96 + n)] * 9)) for n in range(1, 12)
        )
        replaced = {
            "a word": b"raw: many, value: 3300",
            "a list": b"raw: [1, 2, 3], value: 3300",
            "a map": b"raw: {a: 1}, value: 3300",
            "a huge number": b"raw: 99999999999999999999999999999, value: 3300",
            "a huge value": b"value: 99999999999999999999999999999",
            "NaN": b"value: .nan",
            "infinity": b"value: .inf",
            "below the encoding": b"value: -1",
            "above the encoding": b"value: 65536",
            "both, not the same": b"raw: 3300, value: 3301",
            "neither": b"unit: rpm",
            "a duplicate key": b"raw: 3300, raw: 3300",
            "an unknown key": b"raw: 3300, vlaue: 3300",
            "a null": b"raw: ~",
        }
        files = {name: good.replace(b"raw: 3300, value: 3300", text) for name, text in replaced.items()}
        files.update({
            "empty": b"",
            "cut at a line": good[: good.index(line)],
            "cut in a line": good[: good.index(line) + 20],
            "without its last line": good[: good.index(b"end: ")],
            "a line is missing": good.replace(line, b""),
            "a line twice": good.replace(line, line + line),
            "a register twice": good.replace(line, line + line.replace(b"p300", b"p301")),
            "another format": good.replace(b"format: 1", b"format: 2"),
            "nested": deep + b"x: " + b"[" * 400_000,
            "nested maps": deep + b"x: " + b"{a: " * 200_000,
            "ten megabytes": deep + b"x: " + b"[" * 10_000_000,
            "aliases": bomb,
            "many aliases": deep + b"x: [" + b"*a, " * 200_000 + b"]\n",
            "many keys": deep + b"".join(b"k%d: 1\n" % n for n in range(60_000)),
            "many lines": deep + b"- \n" * 300_000,
            "UTF-16": good.decode().encode("utf-16"),
            "Latin-1": good.replace(b"rpm", b"\xb0/min"),
            "NUL": good.replace(b"p300", b"p3\x0000"),
            "not YAML": b"\x7fELF\x02\x01\x01" + bytes(range(256)) * 100,
            "two documents": good + b"---\n" + good,
            "a tools file": b"tools: {}\n",
        })
        for name, text in files.items():
            with self.subTest(name):
                path = self.path("hostile.yaml")
                pathlib.Path(path).write_bytes(text)
                finished = support.run("restore", self.server.url, path, *PROFILE, "--yes")
                self.assertEqual(finished.status, 3, (name, finished))
                self.assertEqual(finished.stdout, "", name)
                self.assertRegex(finished.stderr, r"\Aspindle: [^\n]*hostile\.yaml:\d+:\d+: [^\n]+\n\Z", name)
                self.assertLess(finished.paced, 5, name)
                if "asan" in support.binary():
                    continue  # the sanitizer maps terabytes
                status, stderr = limited(resource.RLIMIT_AS, MEMORY, "diff", path, path)
                self.assertEqual(status, 3, (name, stderr))
        self.assertEqual(len(self.server.requests), self.asked, "the tool was asked for nothing")

    def test_path_tricks_in_names_of_targets(self):
        """What a URL says can not lead the file anywhere else."""
        port = support.host_and_port(self.server.url)[1]
        for url in (f"tcp://127.0.0.1:{port}", f"tcp://localhost:{port}"):
            finished = support.run("backup", url, *PROFILE, "--dir", self.path("out"), "--json")
            self.assertEqual(finished.status, 0, finished)
            name = finished.records("backup")[0]["file"]
            self.assertRegex(name, re.escape(self.path("out")) + r"/[a-z0-9._]+\.yaml\Z")

if __name__ == "__main__":
    unittest.main()
