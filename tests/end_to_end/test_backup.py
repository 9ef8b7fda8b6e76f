"""Backup, diff and restore: the round trip, and files that are not what they should be."""

import contextlib
import ctypes
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
        # The identity, 24 blocks, and one question for the hole of five registers.
        self.assertEqual(len(recorder.requests), 1 + 24 + 1)

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
        self.assertEqual(status, 74, stderr)
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
        self.assertEqual(status, 74, stderr)
        self.assertIn("nothing was written", stderr)
        self.assertEqual(recorder.count(support.WRITE_SINGLE), 0)

    def test_special_files_stay_what_they_are(self):
        for path in ("/dev/full", "/dev/null", str(self.folder)):
            with self.subTest(path):
                finished = support.run("backup", self.url, *PROFILE, "-f", path, "--force")
                self.assertEqual(finished.status, 74, finished)
        self.assertTrue(os.path.exists("/dev/full"))

    def secretive_profile(self):
        path = self.path("secretive.yaml")
        pathlib.Path(path).write_text(
            "format: 1\nid: secretive\ntitle: A BM with a secret\nextends: doga-bm\nparameters:\n"
            "  - {name: pin, register: 300, encoding: u32, access: rw, secret: true, evidence: manual, source: S, title: PIN}\n",
            "utf-8",
        )
        return path

    def test_secrets_are_for_nobody_else(self):
        profile = ("--profile", self.secretive_profile())
        path = self.path("secrets.yaml")
        rights = lambda: os.stat(path).st_mode & 0o777  # noqa: E731
        usual = support.run("backup", self.url, *profile, "-f", path)
        self.assertEqual(usual.status, 0, usual)
        self.assertIn("why: left-out", pathlib.Path(path).read_text())
        os.chmod(path, 0o644)
        told = support.run("backup", self.url, *profile, "-f", path, "--include-secrets", "--force")
        self.assertEqual(told.status, 0, told)
        self.assertEqual(rights(), 0o600)
        os.unlink(path)
        told = support.run("backup", self.url, *profile, "-f", path, "--include-secrets")
        self.assertEqual((told.status, rights()), (0, 0o600), told)

    def test_a_secret_is_not_recorded_by_whatever_name_it_is_set(self):
        profile = ("--profile", self.secretive_profile())
        log = support.home().path / ".local/state/spindle/changes.jsonl"
        known = len(log.read_text().splitlines()) if log.exists() else 0
        for name in ("p300", "p301", "@holding:300", "@holding:300/u32"):
            finished = support.run("set", self.url, *profile, f"{name}=4711")
            self.assertEqual(finished.status, 0, finished)
            finished = support.run("set", self.url, *profile, f"{name}=0")
            self.assertEqual(finished.status, 0, finished)
        records = [support.parse_json(line) for line in log.read_text().splitlines()[known:]]
        self.assertGreaterEqual(len(records), 8)
        for record in records:
            self.assertEqual((record["old"], record["new"]), (None, None), record)

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
                self.assertRegex(finished.said, r"\Aspindle: [^\n]*hostile\.yaml:\d+:\d+: [^\n]+\n\Z", name)
                self.assertLess(finished.paced, 5, name)
                if "asan" in support.binary():
                    continue  # the sanitizer maps terabytes
                status, stderr = limited(resource.RLIMIT_AS, MEMORY, "diff", path, path)
                self.assertEqual(status, 3, (name, stderr))
        self.assertEqual(len(self.server.requests), self.asked, "the tool was asked for nothing")

    def test_path_tricks_in_names_of_targets(self):
        """What a URL says cannot lead the file anywhere else."""
        port = support.host_and_port(self.server.url)[1]
        for url in (f"tcp://127.0.0.1:{port}", f"tcp://localhost:{port}"):
            finished = support.run("backup", url, *PROFILE, "--dir", self.path("out"), "--json")
            self.assertEqual(finished.status, 0, finished)
            name = finished.records("backup")[0]["file"]
            self.assertRegex(name, re.escape(self.path("out")) + r"/[a-z0-9._]+\.yaml\Z")

class PermissionTest(BackupTest):
    """Where a folder or file may not be looked into, that is said, and not that nothing is there."""

    def refused(self, *arguments, **environment):
        """Runs spindle without the right of root to look everywhere."""
        with tempfile.TemporaryFile() as errors:
            status = support.completed(
                [support.binary(), *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors,
                cwd=support.home().path, env=support.home().environment(**environment), preexec_fn=obey_rights,
            ).returncode  # fmt: skip
            errors.seek(0)
            return status, errors.read().decode()

    def setUp(self):
        super().setUp()
        self.closed = self.folder / "closed"
        (self.closed / "spindle").mkdir(parents=True)
        self.addCleanup(os.chmod, self.closed, 0o700)
        saved = support.run("backup", "sim:doga-bm", "-f", self.closed / "backup.yaml")
        self.assertEqual(saved.status, 0, saved)
        (self.closed / "mine.yaml").write_text("format: 1\nid: mine\ntitle: Mine\nextends: doga-bm\n", "utf-8")
        (self.closed / "spindle/tools.yaml").write_text('tools: {station3: {url: "sim:doga-bm"}}\n', "utf-8")

    def commands(self):
        profiles = f"{self.closed}:{support.ROOT}/profiles"
        return (
            (3, ["diff", str(self.closed / "backup.yaml"), "sim:doga-bm"], {}),
            (3, ["get", "sim:doga-bm", "p300", "--profile", str(self.closed / "mine.yaml")], {}),
            (3, ["list", "--profile", "mine"], {"SPINDLE_PROFILE_PATH": profiles}),
            (3, ["identify", "station3"], {"XDG_CONFIG_HOME": str(self.closed)}),
            (3, ["identify", "station3", "--tools", str(self.closed / "spindle/tools.yaml")], {}),
            (4, ["get", f"rtu://{self.closed}/line?unit=1", "--profile", "orientalmotor-blv", "alarm.present"], {}),
            (74, ["backup", "sim:doga-bm", "-f", str(self.closed / "new.yaml")], {}),
            (74, ["backup", "sim:doga-bm", "--dir", str(self.closed / "new")], {}),
        )

    def test_what_may_be_looked_into_is_found(self):
        for status, command, environment in self.commands()[:5]:
            with self.subTest(command):
                finished = self.refused(*command, **environment)
                self.assertEqual(finished[0], 0, finished)

    def test_what_may_not_be_looked_into_is_not_called_absent(self):
        os.chmod(self.closed, 0)
        for status, command, environment in self.commands():
            with self.subTest(command):
                ended, told = self.refused(*command, **environment)
                self.assertEqual(ended, status, told)
                self.assertRegex(told, "[Pp]ermission")
                self.assertNotIn("no such", told)

    def test_a_file_that_may_not_be_read(self):
        for name in ("backup.yaml", "mine.yaml", "spindle/tools.yaml"):
            os.chmod(self.closed / name, 0)
        for status, command, environment in self.commands()[:5]:
            with self.subTest(command):
                ended, told = self.refused(*command, **environment)
                self.assertEqual(ended, status, told)
                self.assertRegex(told, "[Pp]ermission")


def obey_rights():
    """Root may read every file; a program that it starts now may not."""
    dropping, library = 24, ctypes.CDLL(None, use_errno=True)  # PR_CAPBSET_DROP
    for right in (1, 2):  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
        library.prctl(dropping, right, 0, 0, 0)


if __name__ == "__main__":
    unittest.main()
