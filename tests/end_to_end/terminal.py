"""A shell in a real terminal of 80 columns, read from its screen as a person reads it: tmux(1)."""

import os
import re
import shutil
import subprocess
import tempfile
import time
import uuid

import support

COLUMNS, LINES = 80, 120
LOOK = 0.05  # seconds from one look at the screen to the next
# As some people have it: a status that is not 0 stands in the prompt.
PS1 = "PS1='$(s=$?; [ $s = 0 ] || echo \"[$s] \")$ '"
PROMPT = re.compile(r"(\[(\d+)\] )?\$")


class Terminal:
    """One terminal with a shell in `folder`, as long as the with statement lasts."""

    def __init__(self, folder, environment):
        self._folder, self._environment = folder, environment
        self._server = f"spindle-{os.getpid()}-{uuid.uuid4().hex[:8]}"
        self._sockets = tempfile.mkdtemp(prefix="spindle-tmux-")

    def __enter__(self):
        self._tmux("-f", "/dev/null", "new-session", "-d", "-x", COLUMNS, "-y", LINES, "bash --norc --noprofile -i")
        self.type(PS1)
        self.wait_for_prompt()
        return self

    def __exit__(self, *_):
        # The shell ends its jobs when its terminal is gone.
        self._tmux("kill-server", check=False)
        shutil.rmtree(self._sockets, ignore_errors=True)

    def _tmux(self, *words, check=True):
        command = ["tmux", "-L", self._server, *(str(word) for word in words)]
        environment = {**self._environment, "TMUX_TMPDIR": self._sockets, "TERM": "xterm-256color"}
        done = subprocess.run(command, capture_output=True, cwd=self._folder, env=environment,
                              stdin=subprocess.DEVNULL, check=False)
        if check and done.returncode:
            raise AssertionError(f"{command} ended with {done.returncode}: {done.stderr.decode()}")
        return done.stdout.decode()

    def screen(self):
        """The lines that are on the screen, without the empty ones below. What the edge has wrapped is one line."""
        return [line.rstrip() for line in self._tmux("capture-pane", "-p", "-J").rstrip().split("\n")]

    def key(self, name):
        """Such as C-c or Enter."""
        self._tmux("send-keys", name)

    def type(self, text):
        self._tmux("send-keys", "-l", text)
        self.key("Enter")

    def clear(self):
        """An empty screen with a prompt."""
        self.type("clear")
        self._wait(lambda lines: len(lines) == 1 and PROMPT.fullmatch(lines[0]), "an empty screen")

    def _wait(self, condition, what):
        """Waits until the lines of the screen are as the condition wants them, and returns them."""
        seen = []

        def is_there():
            time.sleep(LOOK)
            seen[:] = self.screen()
            return condition(seen)

        try:
            support.wait_until(is_there, what)
        except AssertionError as error:
            raise AssertionError(str(error) + "\n" + "\n".join(seen)) from None
        return seen

    def wait_for_text(self, pattern):
        return self._wait(lambda lines: re.search(pattern, "\n".join(lines), re.MULTILINE), f"'{pattern}' on the screen")

    def wait_for_prompt(self):
        return self._wait(lambda lines: PROMPT.fullmatch(lines[-1]), "a prompt")

    def run(self, command, answers=()):
        """Types a command, answers what it asks ((pattern, answer), …), and waits until it has ended. Returns its
        status and what it has shown."""
        self.clear()
        self.type(command)
        for question, answer in answers:
            self.wait_for_text(question)
            self.type(answer)
        lines = self.wait_for_prompt()
        return int(PROMPT.fullmatch(lines[-1])[2] or 0), "\n".join(lines[1:-1])
