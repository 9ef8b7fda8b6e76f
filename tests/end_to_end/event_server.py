"""A Modbus TCP server with the registers of a BM screwdriver whose operator works without pause.

Events are pushed to the client that armed the output, in segments cut as a seeded chance will have it:
split anywhere, glued together, repeated at once or later. It can also cut the connection. Everything
that was asked is kept with its time.
"""

import contextlib
import random
import socket
import struct
import threading
import time

import hostile_server
import support

ARM_REGISTER = 4002
NUMBERS = 0x10000


class Chance:
    """What goes wrong on the wire, and how often."""

    def __init__(self, seed=1, split=0.0, glue=0.0, repeat=0.0, late_repeat=0.0, cut=0.0):
        self.random = random.Random(seed)
        self.split, self.glue = split, glue
        self.repeat, self.late_repeat, self.cut = repeat, late_repeat, cut

    def strikes(self, probability):
        return self.random.random() < probability


class EventServer(support.Port):
    def __init__(self, chance=None, first=1961, serial=1021100042, firmware=2103, expires=10.0, port=0):
        super().__init__(port)
        self.tool = hostile_server.Tool(serial=serial, firmware=firmware)
        self.number = first
        self.requests = []  # (time, request)
        self.cuts = 0
        self.pushed = 0
        self.failures = []
        self._expires = expires
        self._chance = chance or Chance()
        self._armed_until = 0.0
        self._held = b""
        self._recent = []
        self._client = None
        self._met_at = 0  # place of the first request of this client
        self._lock = threading.RLock()
        self._store(0)

    def __exit__(self, *_):
        super().__exit__()
        self.cut()

    # --- what happens to the tool ---

    def event(self, kind=1, error=0):
        """One more event: stored, and pushed to who is armed."""
        with self._lock:
            self.number = (self.number + 1) % NUMBERS
            words = self._store(kind, error)
            if self._client is None or time.monotonic() > self._armed_until:
                return
            self._push(hostile_server.frame(1, support.READ_INPUT, words))

    def run(self, count, rate, ng_every=10):
        """Events at an even rate, however long the wire takes."""
        began = time.monotonic()
        for index in range(count):
            pause = began + index / rate - time.monotonic()
            if pause > 0:
                threading.Event().wait(pause)
            ng = (index + 1) % ng_every == 0
            self.event(2 if ng else 1, 335 if ng else 0)
        with self._lock:
            self._flush()

    def cut(self):
        with self._lock:
            self._held = b""
            self._recent = []
            self._armed_until = 0.0
            if self._client is not None:
                with contextlib.suppress(OSError):
                    self._client.shutdown(socket.SHUT_RDWR)
                self._client = None
                self.cuts += 1

    def miss(self, count=1):
        """Events that happen while no client is connected."""
        with self._lock:
            self.cut()
            for _ in range(count):
                self.event()

    @property
    def armed(self):
        with self._lock:
            return self._client is not None and time.monotonic() < self._armed_until

    @property
    def caught_up(self):
        """Armed, and what was there before is read, to the counter behind it: what comes now is pushed."""
        with self._lock:
            asked = [request for _, request in self.requests[self._met_at:]]
            arming = [request.words == (ARM_REGISTER, 1) for request in asked]
            counting = [request.words == (hostile_server.EVENT_FIRST, 1) for request in asked]
            return self.armed and any(counting[arming.index(True):])

    # --- what was asked ---

    def asked(self, function, *words):
        with self._lock:
            return [
                when
                for when, request in self.requests
                if request.function == function and request.words[: len(words)] == words
            ]

    def full_block_reads(self):
        with self._lock:
            return [
                request
                for _, request in self.requests
                if request.function == support.READ_INPUT
                and request.words[1] == hostile_server.EVENT_REGISTERS
            ]

    # --- the wire ---

    def _store(self, kind, error=0):
        number = self.number
        block = [number, 1400 + number % 97, 1 + number % 3, 271, 270 + number % 7, 1000,
                 1044, 402, 1446, 4, error, 0, kind, 403]
        first = hostile_server.EVENT_FIRST
        self.tool.inputs.update({first + offset: word for offset, word in enumerate(block)})
        return struct.pack(">B14H", 28, *block)

    def _push(self, frame):
        chance = self._chance
        self.pushed += 1
        if chance.strikes(chance.late_repeat) and self._recent:
            self._held += chance.random.choice(self._recent)
        self._held += frame * (2 if chance.strikes(chance.repeat) else 1)
        self._recent = (self._recent + [frame])[-10:]
        if chance.strikes(chance.cut):
            # Some of it may still arrive, cut anywhere.
            self._send(self._held[: chance.random.randrange(len(self._held) + 1)])
            self.cut()
        elif not chance.strikes(chance.glue):
            self._flush()

    def _flush(self):
        held, self._held = self._held, b""
        while held:
            chance = self._chance
            at = chance.random.randrange(1, len(held) + 1) if chance.strikes(chance.split) else len(held)
            self._send(held[:at])
            held = held[at:]

    def _send(self, piece):
        if self._client is None:
            return
        try:
            self._client.sendall(piece)
        except OSError:
            self._client = None

    def _meet(self, client):
        with self._lock:
            self._client = client
            self._armed_until = 0.0
            self._held = b""
            self._met_at = len(self.requests)
        super()._meet(client)

    def _serve(self, client):
        buffer = bytearray()
        with contextlib.suppress(OSError), client:
            while chunk := client.recv(65536):
                buffer += chunk
                for request in support.take_requests(buffer):
                    self._answer(client, request)
            with self._lock:
                if self._client is client:
                    self._client = None

    def _answer(self, client, request):
        with self._lock:
            self.requests.append((time.monotonic(), request))
            function, data = self.tool.answer(request, "asked")
            is_ours = self._client is client  # and no client of before, of whom something was left
            if is_ours and request.function == support.WRITE_SINGLE and request.words[0] == ARM_REGISTER:
                self._armed_until = time.monotonic() + self._expires if request.words[1] else 0.0
            if is_ours:
                self._held += hostile_server.frame(request.transaction, function, data)
                self._flush()
