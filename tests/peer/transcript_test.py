"""Sessions with the shipped profiles, each against a device on pymodbus: transcripts/*.transcript.

  # TEXT                      a comment; behind what was printed, after an empty line
  %serve tcp|rtu NAME         a device of pymodbus_devices.py; TOOL is its URL from here on
  %serve tcp|rtu ... %end     the same of tables, as JSON for pymodbus_device.py
  %write REGISTER VALUE...    another master writes holding registers
  %file NAME ... %end         a file in the folder where the session takes place
  $ spindle ARGUMENTS         followed by what it prints; lines on stderr begin with "! ", a status other than 0
                              follows as "[2]"
  $ cat FILE                  the same of a file of that folder

What differs from run to run is written as a pattern: times, round trips, the port, the user's
folder, and what changes with the version. With SPINDLE_UPDATE=1 the files are rewritten with what was really printed."""

import difflib
import os
import re
import shlex
import unittest

import support
from support import HERE, SPINDLE

support.need_module("pymodbus", "serial_asyncio")

from pymodbus.client import ModbusTcpClient  # noqa: E402  needs what was just asked for
from pymodbus.transaction import ModbusRtuFramer, ModbusSocketFramer  # noqa: E402

FOLDER = HERE / "transcripts"

PATTERNS = (
    (re.compile(r"\(change [0-9a-f]{8}\)"), "(change ID)"),
    (re.compile(r'"change_id":"[0-9a-f]{8}"'), '"change_id":"ID"'),
    (re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z"), "YYYY-MM-DDThh:mm:ss.mmmZ"),
    (re.compile(r"\d{4}-\d\d-\d\dT\d{6}\.\d{3}Z"), "YYYY-MM-DDThhmmss.mmmZ"),
    (re.compile(r"\b\d+(\.\d+)? ms$"), "N ms"),
    (re.compile(r'"missed_intervals":\d+'), '"missed_intervals":N'),
    (re.compile(r'^spindle: "[\d.]+"'), 'spindle: "VERSION"'),
    (re.compile(r'fingerprint: "[0-9a-f]+"'), 'fingerprint: "FINGERPRINT"'),
)


class Session:
    """One transcript as it is run: a folder, and a device as soon as there is one."""

    def __init__(self):
        self.folder = support.scratch_folder()
        self._device = None

    def serve(self, framing, what):
        self._framer = {"tcp": ModbusSocketFramer, "rtu": ModbusRtuFramer}[framing]
        self._device = support.Server("/usr/bin/python3", HERE / "pymodbus_device.py", framing, what)
        scheme = {"tcp": "tcp", "rtu": "rtu+tcp"}[framing]
        # As patient as a test is, whatever the profile says of a tool that is not on a busy machine.
        self._url = f"{scheme}://127.0.0.1:{self._device.port}?unit=1&timeout={support.PATIENCE}s"

    def write(self, register, *values):
        master = ModbusTcpClient("127.0.0.1", port=self._device.port, framer=self._framer, timeout=support.PATIENCE)
        try:
            answer = master.write_registers(int(register, 0), [int(value, 0) for value in values], slave=1)
            assert not answer.isError(), answer
        finally:
            master.close()

    def file(self, name, text):
        (self.folder / name).write_text(self._with_url(text))

    def run(self, command):
        """The lines that stand below it."""
        program, *arguments = shlex.split(self._with_url(command))
        program = {"spindle": SPINDLE, "cat": "cat"}[program]
        outcome = support.run(program, *arguments, folder=self.folder)
        # How long the address is decides where a sentence goes on in the next line.
        sentences = re.sub(r"\n  +", " ", outcome.err)
        lines = outcome.out.splitlines() + [f"! {line}" for line in sentences.splitlines()]
        if outcome.status:
            lines.append(f"[{outcome.status}]")
        return [self._normal(line) for line in lines]

    def stop(self):
        if self._device:
            self._device.stop()

    def _with_url(self, text):
        return text.replace("TOOL", self._url) if self._device else text

    def _normal(self, line):
        as_wide = "TOOL".ljust(len(self._url))
        line = line.replace(self._url + "  ", as_wide + "  ").replace(self._url, "TOOL")
        line = line.replace(str(self.folder), "$HOME")
        for pattern, replacement in PATTERNS:
            line = pattern.sub(replacement, line)
        return line


def written_by_hand(lines):
    """Without what the commands printed: up to an empty line with a comment, a command or a directive behind it."""
    kept = []
    printed = False
    for line, following in zip(lines, [*lines[1:], "# the end"]):
        ends = line.startswith(("$ ", "%")) or (not line and following.startswith(("#", "$ ", "%")))
        printed = printed and not ends
        if not printed:
            kept.append(line)
        printed = printed or line.startswith("$ ")
    return kept


def rerun(session, lines):
    """The transcript as it should read."""
    result = []
    rest = iter(written_by_hand(lines))
    for line in rest:
        result.append(line)
        if line.startswith("$ "):
            result += session.run(line[2:])
        elif line.startswith("%"):
            result += obey(session, line.split(), rest)
    return result


def obey(session, words, rest):
    """A directive; the lines that belong to it."""
    directive, *words = words
    if directive == "%write":
        session.write(*words)
        return []
    if directive == "%serve" and len(words) == 2:
        session.serve(*words)
        return []
    body = list(iter(rest.__next__, "%end"))
    {"%serve": session.serve, "%file": session.file}[directive](*words, "\n".join(body) + "\n")
    return [*body, "%end"]


class TranscriptTest(support.PeerTest):
    """One test a file, which is added below."""

    def check(self, path):
        expected = path.read_text().splitlines()
        session = Session()
        try:
            found = rerun(session, expected)
        finally:
            session.stop()
        if os.environ.get("SPINDLE_UPDATE") == "1":
            path.write_text("\n".join(found) + "\n")
        elif found != expected:
            self.fail("\n".join(difflib.unified_diff(expected, found, path.name, "now", lineterm="")))


for transcript in sorted(FOLDER.glob("*.transcript")):
    setattr(TranscriptTest, "test_" + transcript.stem.replace("-", "_"),
            lambda self, path=transcript: self.check(path))


if __name__ == "__main__":
    unittest.main(verbosity=2)
