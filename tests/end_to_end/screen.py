"""A terminal that a test types at and reads as a person does: tmux, with a server of its own."""

import itertools
import os
import pathlib
import shutil
import subprocess
import tempfile

import support

PROMPT = "$"
_numbers = itertools.count()


def is_there():
    return shutil.which("tmux") is not None


class Screen:
    """A shell on a terminal of so many cells, as long as the with statement lasts. `files` are those of the
    folder that it works in."""

    def __init__(self, columns=80, rows=24, files=None, environment=None):
        self._folder = tempfile.TemporaryDirectory(prefix="spindle-screen-")
        self.path = pathlib.Path(self._folder.name)
        (self.path / "bin").mkdir()
        (self.path / "bin" / "spindle").symlink_to(support.binary())
        for name, text in (files or {}).items():
            (self.path / name).write_text(text)
        self._socket = f"spindle-{os.getpid()}-{next(_numbers)}"
        home = support.home().environment(PS1=PROMPT + " ", TMUX_TMPDIR=str(self.path))
        self._environment = {**home, "PATH": f"{self.path / 'bin'}:/usr/bin:/bin", **(environment or {})}
        self._tmux("-f", "/dev/null", "new-session", "-d", "-x", columns, "-y", rows, "-c", self.path,
                   "sh", "-i")
        self._tmux("set-option", "-g", "history-limit", 10000)

    def __enter__(self):
        self.wait(lambda lines: lines and lines[-1] == PROMPT, "the shell is there")
        return self

    def __exit__(self, *_):
        self._tmux("kill-server", check=False)
        self._folder.cleanup()

    def _tmux(self, *words, check=True):
        command = ["tmux", "-u", "-L", self._socket, *map(str, words)]
        return support.completed(command, capture_output=True, check=check, stdin=subprocess.DEVNULL,
                                 env=self._environment, cwd=self.path).stdout.decode()

    def type(self, text):
        self._tmux("send-keys", "-l", text)
        self._tmux("send-keys", "Enter")

    def press(self, key):
        self._tmux("send-keys", key)

    def resize(self, columns, rows):
        self._tmux("resize-window", "-x", columns, "-y", rows)

    def lines(self, *how):
        """What stands there, from the first line to the last one that is not empty."""
        return self._tmux("capture-pane", "-p", *how).rstrip().split("\n")

    def wrapped(self):
        """Lines that were too wide for the screen, so that the terminal broke them."""
        mark = "=" * 9  # both pictures are of one moment
        both = self._tmux("capture-pane", "-p", "-S", "-", ";", "display-message", "-p", mark, ";",
                          "capture-pane", "-p", "-J", "-S", "-")
        rows, joined = ([line.rstrip() for line in part.split("\n")] for part in both.split(mark + "\n"))
        return [line for line in joined if line not in rows]

    def wait(self, condition, what):
        """What stands there once it is as it should be."""
        seen = []

        def look():
            seen[:] = self.lines()
            return condition(seen)

        try:
            support.wait_until(look, what)
        except AssertionError as failed:
            raise AssertionError(f"{failed}; the screen says:\n" + "\n".join(seen)) from None
        return list(seen)

    def run(self, text):
        """Types a command on an empty screen; what it said, once the shell waits again."""
        self._tmux("send-keys", "-l", "clear")
        self._tmux("send-keys", "Enter")
        self.wait(lambda lines: lines == [PROMPT], "the screen is empty")
        self._tmux("clear-history")
        self.type(text)
        self.wait(lambda lines: len(lines) > 1 and lines[-1] == PROMPT, f"'{text}' ends")
        return self.lines("-S", "-")[1:-1]
