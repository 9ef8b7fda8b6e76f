"""A bank of holding registers over Modbus TCP that acknowledges, refuses, keeps silent and acts late as told."""

import contextlib
import struct
import threading
import time

import support


class RegisterServer(support.Port):
    """`on_write` says what becomes of a write: it gets the number of the write (from 1) and returns a Deed."""

    def __init__(self, registers, on_write=None):
        super().__init__()
        self.registers = dict(registers)
        self.on_write = on_write or (lambda number: Deed())
        self.writes = []  # (function, first register, words)
        self.heard_write = threading.Event()
        self._pending = []
        self._guard = threading.Lock()

    def value(self, register):
        with self._guard:
            self._act()
            return self.registers.get(register, 0)

    def _act(self):
        now = time.monotonic()
        for entry in [entry for entry in self._pending if entry[0] <= now]:
            self._pending.remove(entry)
            self.registers.update(entry[1])

    def _serve(self, connection):
        buffer = bytearray()
        with contextlib.suppress(OSError):
            while chunk := connection.recv(65536):
                buffer += chunk
                for request in support.take_requests(buffer):
                    answer = self._answer(request)
                    if answer is not None:
                        connection.sendall(
                            struct.pack(">HHHB", request.transaction, 0, len(answer) + 1, request.unit) + answer
                        )

    def _answer(self, request):
        with self._guard:
            self._act()
            if request.function in (3, 4):
                first, count = request.words
                words = [self.registers.get(first + at, 0) for at in range(count)]
                return bytes([request.function, 2 * count]) + struct.pack(f">{count}H", *words)
            if request.function == 6:
                first, words = request.words[0], [request.words[1]]
            elif request.function == 16:
                first, count = struct.unpack(">HH", request.data[:4])
                words = list(struct.unpack(f">{count}H", request.data[5:]))
            else:
                return bytes([request.function | 0x80, 1])
            self.writes.append((request.function, first, words))
            deed = self.on_write(len(self.writes))
            if deed.acts is not None:
                change = {first + at: word for at, word in enumerate(words)}
                self._pending.append((time.monotonic() + deed.acts, change))
                self._act()
            self.heard_write.set()
            if deed.silent:
                return None
            if deed.exception is not None:
                return bytes([request.function | 0x80, deed.exception])
            return bytes([request.function]) + request.data[:4]


class Deed:
    def __init__(self, exception=None, acts=0.0, silent=False):
        self.exception = exception
        self.acts = acts  # seconds after it was sent; None: never
        self.silent = silent
