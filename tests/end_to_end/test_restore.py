"""Restores that are ended at every stage: the tool is put back, or the next run finishes the job."""

import os
import pathlib
import shutil
import signal
import socket
import unittest

import hostile_server
import support
from test_backup import PROFILE, BackupTest

PLAN = range(300, 320)  # the registers of a plan of twenty writes


class TrappedServer(hostile_server.HostileServer):
    """Does something when a given write has reached the tool and its answer is still to come."""

    def __init__(self):
        super().__init__({})
        self.arm(0, None)

    def arm(self, at, deed):
        self.writes = []
        self.saw_all = 0
        self._at = at
        self._deed = deed

    def _handle(self, connection, request):
        if request.function == support.WRITE_SINGLE:
            self.writes.append(request.words)
            if len(self.writes) == self._at:
                with self._lock:
                    self.requests.append(request)
                    reply = hostile_server.Reply(request, *self.tool.answer(request, "asked"))
                self._deed(connection)
                self._send_parts(connection, reply, [{"answer": {}}], "glued")
                return
        super()._handle(connection, request)

    def values(self):
        return [self.tool.holding[register] for register in PLAN]


class FaultTest(BackupTest):
    """A fault after the k-th write for every k of a plan of twenty."""

    def setUp(self):
        super().setUp()
        self.server = self.enterContext(TrappedServer())
        self.path_of_backup = self.backup(self.server.url, "wanted.yaml")
        self.wanted = self.server.values()
        self.before = [value + 100 for value in self.wanted]
        self.state = pathlib.Path(support.home().path) / ".local/state/spindle"
        shutil.rmtree(self.state, ignore_errors=True)

    def spoil(self):
        self.server.tool.holding.update(zip(PLAN, self.before))
        shutil.rmtree(self.state, ignore_errors=True)

    def start(self):
        return support.Running(
            "restore", self.server.url, self.path_of_backup, *PROFILE, "--yes", "--json",
            "--timeout", "2s",
        )

    def assert_saved(self, k):
        """The state before the first write is there, whole, and right."""
        saved = list((self.state / "backups").iterdir())
        self.assertEqual(len(saved), 1, (k, saved))
        now = self.server.values()
        self.server.tool.holding.update(zip(PLAN, self.before))
        compared = support.run("diff", str(saved[0]), self.server.url, *PROFILE)
        self.server.tool.holding.update(zip(PLAN, now))
        self.assertEqual(compared.status, 0, (k, compared))

    def assert_next_run_finishes(self, k, left):
        self.server.arm(0, None)
        finished = self.restore(self.server.url, self.path_of_backup)
        self.assertEqual(finished.status, 0, (k, finished))
        self.assertEqual(len(self.server.writes), left, (k, self.server.writes))
        self.assertEqual(self.server.values(), self.wanted, k)

    def end_by(self, deed, k):
        """Runs a restore that meets `deed` at its k-th write."""
        self.spoil()
        with self.start() as running:
            self.server.arm(k, lambda connection: deed(running, connection))
            return running.finish()

    def test_signals(self):
        everywhere, ends_and_middle = range(1, len(PLAN) + 1), (1, len(PLAN) // 2, len(PLAN))
        # The program goes the same way for both, so the second one need not be sent everywhere.
        for number, status, places in ((signal.SIGINT, 130, everywhere), (signal.SIGTERM, 143, ends_and_middle)):
            for k in places:
                with self.subTest(number, k=k):
                    finished = self.end_by(lambda running, _: running.send_signal(number), k)
                    self.assertEqual(finished.status, status, finished)
                    self.assertEqual(self.server.values(), self.before, finished)
                    summary = finished.records("summary")[-1]
                    self.assertEqual(summary["exit_status"], status, finished)
                    self.assertEqual(summary["rolled_back"], k, finished)
                    self.assert_saved(k)
                    self.assert_next_run_finishes(k, len(PLAN))

    def test_kill(self):
        def kill(running, connection):
            running.send_signal(signal.SIGKILL)
            os.waitid(os.P_PID, running.pid, os.WEXITED | os.WNOWAIT)

        for k in range(1, len(PLAN) + 1):
            with self.subTest(k=k):
                finished = self.end_by(kill, k)
                self.assertEqual(finished.status, -signal.SIGKILL, finished)
                self.assertEqual(self.server.values(), self.wanted[:k] + self.before[k:])
                self.assert_saved(k)
                self.assert_next_run_finishes(k, len(PLAN) - k)

    def test_cut_connection(self):
        def cut(_, connection):
            connection.shutdown(socket.SHUT_RDWR)
            raise hostile_server.Gone

        for k in range(1, len(PLAN) + 1):
            with self.subTest(k=k):
                finished = self.end_by(cut, k)
                self.assertEqual(finished.status, 5, finished)
                self.assertEqual(self.server.values(), self.before, finished)
                self.assertEqual(finished.records("summary")[-1]["rolled_back"], k, finished)
                self.assert_saved(k)
                self.assert_next_run_finishes(k, len(PLAN))

    def test_a_tool_that_is_gone_for_good(self):
        def vanish(_, connection):
            self.server._listening.shutdown(socket.SHUT_RDWR)
            connection.shutdown(socket.SHUT_RDWR)
            raise hostile_server.Gone

        finished = self.end_by(vanish, 3)
        self.assertEqual(finished.status, 5, finished)
        errors = [e for e in finished.records("error") if "COULD NOT BE PUT BACK" in e["message"]]
        self.assertEqual([int(e["register"]) for e in errors], [302, 301, 300], finished)
        saved = next((self.state / "backups").iterdir())
        for error in errors:
            self.assertIn(f"spindle restore {self.server.url} {saved}", error["hint"])
            self.assertIn(self.path_of_backup, error["hint"])

    def test_another_tool_at_the_same_address_is_not_written(self):
        def swap(_, connection):
            self.server.tool.identity = hostile_server.Tool(serial=1021100043).identity
            connection.shutdown(socket.SHUT_RDWR)
            raise hostile_server.Gone

        finished = self.end_by(swap, 3)
        self.assertEqual(finished.status, 5, finished)
        self.assertEqual(len(self.server.writes), 3, finished)
        self.assertIn("another tool answers there now", finished.said)

    def test_changes_are_recorded(self):
        self.spoil()
        self.server.arm(0, None)
        self.assertEqual(self.restore(self.server.url, self.path_of_backup).status, 0)
        lines = (self.state / "changes.jsonl").read_text(encoding="utf-8").splitlines()
        records = [support.parse_json(line) for line in lines]
        begun, changes = records[::2], records[1::2]
        self.assertEqual({c["result"] for c in begun}, {"begun"})
        self.assertEqual([c["id"] for c in begun], [c["id"] for c in changes])
        self.assertEqual({c["result"] for c in changes}, {"written"})
        self.assertEqual([c["name"] for c in changes], [f"p{n}" for n in PLAN])
        self.assertEqual({c["command"] for c in changes}, {"restore"})
        self.assertEqual([c["new"] for c in changes], self.wanted)

    def test_a_log_that_can_not_be_written_is_a_warning(self):
        self.state.parent.mkdir(parents=True, exist_ok=True)
        self.state.write_text("in the way", encoding="utf-8")
        self.addCleanup(self.state.unlink)
        finished = support.run("set", self.server.url, *PROFILE, "p300=4000", "p301=4001")
        self.assertEqual(finished.status, 0, finished)
        self.assertEqual(finished.stderr.count("changes are not recorded"), 1, finished)


if __name__ == "__main__":
    unittest.main()
