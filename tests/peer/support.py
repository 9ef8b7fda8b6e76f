"""What the peer tests share: running spindle, servers on free ports, and a recording proxy."""

import importlib.util
import json
import os
import pathlib
import re
import select
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import unittest

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "end_to_end"))
from frames import rtu_requests  # noqa: E402, F401  shared with the end-to-end tests

# ctest sets these (tests/CMakeLists.txt).
SPINDLE = os.environ["SPINDLE"]
PROGRAMS = pathlib.Path(os.environ["SPINDLE_PEER_PROGRAMS"])
HERE = pathlib.Path(__file__).resolve().parent

SKIPPED = 77  # SKIP_RETURN_CODE of ctest
PATIENCE = 300  # seconds; only a test that has already failed ever waits so long

# The profile's firmware limit, models and layout (60427 §3.4): id 1, controller 1, model 3 (3204),
# firmware 2103, serial 1021100042.
DOGA_IDENTITY = bytes.fromhex("0001 0001 0003 0837 3CDCC00A")

_scratch = tempfile.TemporaryDirectory()


def is_sanitized():
    """Whether the program is the one that is built with the address sanitizer, which frees memory late."""
    return b"__asan_init" in pathlib.Path(SPINDLE).read_bytes()


def scratch_folder():
    """A new folder that is gone when the tests end."""
    return pathlib.Path(tempfile.mkdtemp(dir=_scratch.name))


def need(peer, present):
    """Skips the whole test when the other side is not installed."""
    if not present:
        print(f"skipped: {peer} is not installed; ./check installs it")
        sys.exit(SKIPPED)


def need_program(*names):
    for name in names:
        need(name, shutil.which(name))


def need_module(*names):
    for name in names:
        need(f"python3-{name.replace('_', '-')}", importlib.util.find_spec(name))


class Outcome:
    """What one run of a program gave."""

    def __init__(self, run):
        self.status = run.returncode
        self.out = run.stdout
        self.err = run.stderr

    @property
    def records(self):
        return [json.loads(line) for line in self.out.splitlines()]

    def of_type(self, kind):
        return [record for record in self.records if record["type"] == kind]

    def value_of(self, name):
        found = [record["value"] for record in self.of_type("value") if record["name"] == name]
        return found[0] if len(found) == 1 else found

    def __str__(self):
        return f"status {self.status}\n{self.out}{self.err}"


def run(*arguments, folder=_scratch.name):
    """Any program, in surroundings that the user's own files do not reach."""
    surroundings = dict(os.environ, LC_ALL="C.UTF-8", HOME=str(folder))
    for name in ("SPINDLE_TOOLS", "XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_DATA_HOME"):
        surroundings.pop(name, None)
    done = subprocess.run(
        [str(argument) for argument in arguments], cwd=folder, env=surroundings,
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=PATIENCE, check=False)
    return Outcome(done)


def spindle(*arguments):
    return run(SPINDLE, "--json", *arguments)


class Process:
    """A program that runs until it is stopped, by its own pid."""

    def __init__(self, *command, errors=None):
        self._process = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL,
                                         stdout=subprocess.PIPE, stderr=errors, text=True)

    def first_line(self):
        return self._process.stdout.readline().strip()

    def stop(self):
        self._process.terminate()
        self._process.wait(PATIENCE)
        self._process.stdout.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()


class Server(Process):
    """A program that prints where it listens: a port, or a URL that ends in one."""

    def __init__(self, *command):
        super().__init__(*command)
        line = self.first_line()
        if not line:
            raise RuntimeError(f"{command[0]} does not say where it listens")
        self.port = int(line.rpartition(":")[2])
        self.url = f"tcp://127.0.0.1:{self.port}"

    def stored(self, address):
        """What it holds, read without spindle."""
        answer = modbus_request(self.port, struct.pack(">BHH", 3, address, 1))
        return struct.unpack(">BBH", answer)[2]


SIMULATOR = (SPINDLE, "simulate", "doga-bm", "--quiet")


def mbpoll(mode, *arguments):
    """Addresses from 0, once, without its banner."""
    return run("mbpoll", "-m", mode, "-0", "-1", "-q", *arguments)


def registers(polled):
    """Of lines such as '[2]: \\t271' or '[2]: \\t65535 (-1)'."""
    return {int(address): int(value)
            for address, value in re.findall(r"\[(\d+)\]:\s+(\d+)", polled.out)}


class Recorder:
    """A TCP proxy that keeps what goes through it, as (direction, bytes) in order: 'O' from the
    client, 'I' to it. One connection at a time."""

    def __init__(self, port):
        self._segments = []
        self._upstream = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self):
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return  # finish() has closed it
            with client, socket.create_connection(("127.0.0.1", self._upstream)) as server:
                while self._relay(client, server):
                    pass

    def _relay(self, client, server):
        """Whether both ends are still there."""
        readable, _, _ = select.select([client, server], [], [])
        for source in readable:
            data = source.recv(65536)
            if not data:
                return False
            self._segments.append(("O" if source is client else "I", data))
            (server if source is client else client).sendall(data)
        return True

    def finish(self):
        """Everything that was recorded, once the last connection has ended."""
        self._listener.shutdown(socket.SHUT_RDWR)
        self._thread.join(PATIENCE)
        self._listener.close()
        return self._segments


def modbus_request(port, pdu, unit=0):
    """One request on a connection of its own; the PDU of the answer. Bytes only, without a library."""
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as line:
        line.sendall(struct.pack(">HHHB", 0x4711, 0, len(pdu) + 1, unit) + pdu)
        header = _exactly(line, 7)
        return _exactly(line, struct.unpack(">H", header[4:6])[0] - 1)


def _exactly(line, count):
    data = b""
    while len(data) < count:
        piece = line.recv(count - len(data))
        if not piece:
            raise ConnectionError("the server closed the connection")
        data += piece
    return data


class PeerTest(unittest.TestCase):
    """Common expectations."""

    longMessage = True

    def assert_ends(self, outcome, status):
        self.assertEqual(outcome.status, status, str(outcome))

    def assert_error(self, outcome, status, **members):
        self.assert_ends(outcome, status)
        errors = outcome.of_type("error")
        self.assertEqual(len(errors), 1, str(outcome))
        for key, value in members.items():
            self.assertEqual(errors[0].get(key), value, f"{key} in {errors[0]}")
        return errors[0]


class ServedTest(PeerTest):
    """Each test has a server of its own, which COMMAND starts."""

    COMMAND = SIMULATOR

    def setUp(self):
        self.server = Server(*self.COMMAND)
        self.addCleanup(self.server.stop)
        self.url = self.server.url
