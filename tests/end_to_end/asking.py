"""Programs that hold a line, and others that ask through them."""

import contextlib
import os
import pathlib
import shutil
import socket
import struct
import tempfile
import threading

import support


class Folder:
    """A folder for the sockets of the programs of one test."""

    def __init__(self, mode=0o700):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="spindle-run-"))
        self.path.chmod(mode)
        self.environment = {"XDG_RUNTIME_DIR": str(self.path)}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.path, ignore_errors=True)

    def sockets(self):
        return sorted(self.path.glob("spindle/*.sock"))

    def run(self, *arguments, **how):
        return support.run(*arguments, environment=self.environment, **how)

    def running(self, *arguments):
        return support.Running(*arguments, environment=self.environment)


class Told:
    """What a program says on standard error, read as it comes."""

    def __init__(self, running):
        self._lines = []
        self._thread = threading.Thread(target=self._read, args=(running.process.stderr,), daemon=True)
        self._thread.start()

    def _read(self, stream):
        with contextlib.suppress(ValueError):
            for line in stream:
                self._lines.append(line.decode())

    def text(self):
        return "".join(list(self._lines))

    def port(self):
        """The port of the gateway, once it is told."""
        def told():
            for line in list(self._lines):
                if "listening on " in line:
                    return int(line.split("listening on ")[1].split(",")[0].rsplit(":", 1)[1])
            return None

        return support.wait_until(told, "the gateway says where it listens")


class Asker:
    """Another program that asks in plain frames of Modbus TCP: through a port, or through the socket of a
    line, where each packet is one frame."""

    def __init__(self, where):
        if isinstance(where, int):
            self.socket = socket.create_connection(("127.0.0.1", where))
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        else:
            self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            self.socket.connect(str(where))
        self.socket.settimeout(3 * support.DEADLINE)
        self._id = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, function, data, unit=1):
        self._id = (self._id + 1) % 0x10000
        self.socket.sendall(struct.pack(">HHHBB", self._id, 0, len(data) + 2, unit, function) + data)

    def receive(self):
        """Function and data of the next answer, which has the id of the last request."""
        buffer = b""
        while len(buffer) < 8 or len(buffer) < 6 + struct.unpack_from(">H", buffer, 4)[0]:
            chunk = self.socket.recv(4096)
            if not chunk:
                raise EOFError("the owner hung up")
            buffer += chunk
        transaction, protocol, length, _, function = struct.unpack_from(">HHHBB", buffer)
        if (transaction, protocol, len(buffer)) != (self._id, 0, 6 + length):
            raise AssertionError(f"asked with id {self._id}, answered: {buffer.hex(' ')}")
        return function, buffer[8:]

    def ask(self, function, data, unit=1):
        self.send(function, data, unit)
        return self.receive()

    def read(self, first, count, function=support.READ_HOLDING, unit=1):
        answered, data = self.ask(function, struct.pack(">HH", first, count), unit)
        if answered != function:
            raise AssertionError(f"exception {data.hex()}")
        return list(struct.unpack(f">{count}H", data[1:]))

    def write(self, register, value, unit=1):
        return self.ask(support.WRITE_SINGLE, struct.pack(">HH", register, value), unit)


def is_stopped(pid):
    """Whether a signal has stopped the process."""
    text = pathlib.Path(f"/proc/{pid}/stat").read_text("ascii")
    return text.rsplit(")", 1)[1].split()[0] == "T"


def threads_of(pid):
    return len(os.listdir(f"/proc/{pid}/task"))
