"""The completion scripts in real shells: what a TAB offers, offline."""

import contextlib
import os
import pathlib
import pty
import shutil
import signal
import tempfile
import threading
import unittest

import support

SCRIPTS = support.ROOT / "completions"
TOOLS = """tools:
  station3: {url: "tcp://192.168.10.23", profile: doga-bmt}
groups:
  line1: [station3]
"""

# What is typed, and candidates that must be offered; "only" if there must be no others.
CASES = (
    ("spindle remote-", "only", ["remote-start", "remote-stop"]),
    ("spindle get stat", "only", ["station3"]),
    ("spindle get @", "only", ["@line1"]),
    ("spindle get sim:", "some", ["sim:doga-bm", "sim:doga-bmt"]),
    ("spindle get station3 preset.1.tar", "only", ["preset.1.target-torque", "preset.1.target-angle"]),
    ("spindle get station3 preset.", "some", ["preset.1.", "preset.15."]),
    ("spindle set station3 preset.1.mo", "only", ["preset.1.mode="]),
    ("spindle set station3 preset.1.mode=", "only", ["preset.1.mode=TC/AM", "preset.1.mode=AC/TM"]),
    ("spindle set station3 preset.1.mode=A", "only", ["preset.1.mode=AC/TM"]),
    ("spindle do station3 dir", "only", ["direction="]),
    ("spindle do station3 direction=", "only", ["direction=forward", "direction=loosening"]),
    ("spindle get station3 --ou", "only", ["--output"]),
    ("spindle get station3 --output ", "only", ["table", "json", "csv", "svg", "wide", "value", "yaml"]),
    ("spindle -o j", "only", ["json"]),
    ("spindle list --profile doga-bm", "some", ["doga-bm", "doga-bmt"]),
    ("spindle list --profile doga-bm event.num", "only", ["event.number"]),
    ("spindle profile ch", "only", ["check"]),
    ("spindle profile check my", "some", ["my-tool.yaml"]),
    ("spindle frobnicate ", "some", []),
)


class Zsh:
    """A zsh on a terminal of its own, as it completes only for people; what it adds as a candidate is
    written down. One serves all cases: its completion system takes seconds to start on a slow disk."""

    DEADLINE = 120.0
    SET_UP = (
        "PROMPT= LISTMAX=10000",
        "autoload -Uz compinit",
        "compinit -u -D",
        f"source '{SCRIPTS}/_spindle'",
        "compadd() { local -a found; builtin compadd -O found \"$@\"; print -rl -- $found >>shown; "
        "builtin compadd \"$@\" }",
        "bindkey '^I' complete-word",
        "finish() { BUFFER=; : >|done }",
        "zle -N finish",
        "bindkey '^G' finish",
    )

    def __init__(self, folder, environment):
        self.folder = pathlib.Path(folder)
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.chdir(folder)
            os.execvpe("zsh", ["zsh", "-f", "-i"], {**environment, "TERM": "dumb"})
        # What is never read would fill the terminal in the end, and stop the shell.
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.said = b""
        self.reader.start()

    def __enter__(self):
        for line in self.SET_UP:
            self._type(f"{line}\r")
        self._finish("")
        return self

    def __exit__(self, *_):
        os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)
        self.reader.join(self.DEADLINE)
        os.close(self.terminal)

    def _read(self):
        with contextlib.suppress(OSError):  # the end of the terminal
            while chunk := os.read(self.terminal, 4096):
                self.said += chunk

    def _type(self, text):
        os.write(self.terminal, text.encode())

    def _finish(self, typed):
        """Types, and waits until the line editor has come to the key behind it. It is never left, as a
        terminal without a line editor gives other meanings to keys."""
        done = self.folder / "done"
        done.unlink(missing_ok=True)
        self._type(f"{typed}\x07")
        try:
            support.wait_until(done.exists, "zsh is done", self.DEADLINE)
        except AssertionError as error:
            raise AssertionError(f"{error}; it said {self.said!r}") from None

    def offered(self, typed):
        shown = self.folder / "shown"
        shown.write_text("")
        self._finish(f"{typed}\t")
        return sorted(set(filter(None, shown.read_text().splitlines())))


class CompletionTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="spindle-completion-")
        pathlib.Path(cls.folder, "spindle.yaml").write_text(TOOLS)
        pathlib.Path(cls.folder, "my-tool.yaml").write_text("format: 1\n")
        programs = os.path.join(cls.folder, "programs")
        os.mkdir(programs)
        os.symlink(support.binary(), os.path.join(programs, "spindle"))
        cls.environment = support.home().environment()
        cls.environment["PATH"] = f"{programs}:{cls.environment['PATH']}"

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def run_shell(self, *arguments):
        return support.completed(
            arguments,
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.splitlines()

    def check(self, offered, whole=lambda _, candidate: candidate):
        """`whole` gives the word that a candidate in the form of the shell stands for."""
        for typed, kind, expected in CASES:
            with self.subTest(typed):
                words = [whole(typed, candidate) for candidate in offered(typed)]
                if kind == "only":
                    self.assertEqual(sorted(words), sorted(expected))
                else:
                    self.assertEqual([word for word in expected if word not in words], [], words)

    def test_bash(self):
        script = f"""
            source '{SCRIPTS}/spindle.bash'
            compopt() {{ :; }}  # only a completion under way may have options
            COMP_LINE=$1 COMP_POINT=${{#1}}
            _spindle spindle "$2" ''
            printf '%s\\n' "${{COMPREPLY[@]}}"
        """

        def offered(typed):
            # What bash takes for the word: behind the last of the characters that split words.
            word = typed.rsplit(" ", 1)[1]
            for mark in "=:":
                word = word.rsplit(mark, 1)[-1]
            return self.run_shell("bash", "--norc", "-c", script, "bash", typed, word)

        def whole(typed, candidate):
            word = typed.rsplit(" ", 1)[1]
            head = word[: max(word.rfind("="), word.rfind(":")) + 1]
            return head + candidate.replace("\\", "")

        self.check(offered, whole)

    @unittest.skipUnless(shutil.which("fish"), "fish is not installed")
    def test_fish(self):
        def offered(typed):
            source = f"source '{SCRIPTS}/spindle.fish'; complete -C '{typed}'"
            lines = self.run_shell("fish", "--no-config", "-c", source)
            return [line.split("\t")[0] for line in lines]

        self.check(offered)

    @unittest.skipUnless(shutil.which("zsh"), "zsh is not installed")
    def test_zsh(self):
        with Zsh(self.folder, self.environment) as zsh:
            self.check(zsh.offered)


if __name__ == "__main__":
    unittest.main()
