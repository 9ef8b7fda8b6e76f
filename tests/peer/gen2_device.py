"""A screwdriver with firmware 4000 or later, over Modbus TCP: written from the facts about its registers and
frames (gen2_frames.txt), and from nothing of spindle's.

As a program it prints the port that it listens on and serves until it is ended. Tests take the class, which
remembers every request."""

import contextlib
import pathlib
import random
import socket
import struct
import sys
import threading
import time

FRAMES = pathlib.Path(__file__).with_name("gen2_frames.txt")

PRESETS = (1, 30, 31)  # first register, registers of one, how many
ADVANCED = (1000, 45, 31)
CONTROL = range(3650, 3750)
RUN, DIRECTION, OUTPUT = 5000, 5001, 5350
RUN_DOWN = 0.25  # seconds until the spindle stands still behind a stop

EVENT_WORDS = 107  # of the event block; an answer to a read of so many input registers looks like an event

# Factors of newton metres by the number of the unit.
PER_NEWTON_METRE = {0: 10.1971621, 1: 0.101971621, 2: 1.0, 3: 100.0, 4: 8.85074579, 5: 141.611932, 6: 0.737562149}

# Settings with limits of their own; 0Eh answers what is outside.
LIMITS = {3650: (1, 15), 3657: (0, 6), 3675: (0, 1), 3685: (0, 1), 3705: (0, 9999), 3718: (0, 1), 3725: (0, 1)}
PRESET_LIMITS = {0: (0, 1), 19: (0, 200), 20: (0, 1), 21: (0, 1)}  # by offset
PRESET_TORQUES = (1, 3, 8)  # offsets of the first register


def frames():
    """Named frames of the file, as bytes."""
    lines = [line for line in FRAMES.read_text(encoding="utf-8").splitlines() if line and not line.startswith("#")]
    return {lines[at].split("\t")[1]: bytes.fromhex(lines[at + 1]) for at in range(0, len(lines), 2)}


def f32(value):
    """High word first."""
    return list(struct.unpack(">HH", struct.pack(">f", value)))


def text(words, characters):
    return list(struct.unpack(f">{words}H", characters.encode("ascii").ljust(2 * words, b"\0")))


def float_of(words):
    return struct.unpack(">f", struct.pack(">HH", *words))[0]


class Refused(Exception):
    def __init__(self, code):
        super().__init__(code)
        self.code = code


class Gen2Device:
    """One tool. Its registers are `input` and `holding`; `requests` has every request as (function, data)."""

    def __init__(self, firmware=4002, version=(4, 0, 2), product=19, model="BMT3216", serial="2401190042"):
        self.lock = threading.RLock()
        self.sending = threading.Lock()  # a frame goes out whole, however many pieces it takes
        self.requests = []
        self.writes = []  # (register, words) as they came
        self.strange = []  # writes to registers that no document names
        self.event_reads = []  # reads whose answer would look like an event
        self.noise = None  # bytes to send before each answer, by its number
        self.pieces = None  # most bytes of one segment, and the pause behind it
        self.rescales = False  # whether another torque unit changes the numbers along
        self.event_places = []  # first input registers of blocks that hold the last event; no document knows any
        self.longest_read = 125
        self.firmware, self.product = firmware, product
        self.armed = False
        self.runs_down_until = 0.0
        self.input, self.holding = {}, {}
        self._fill(version, model, serial)
        self.pairs = self._pairs()
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.connections = []
        self.answers = 0
        threading.Thread(target=self._accept, daemon=True).start()

    def stop(self):
        self.listener.close()
        with self.lock:
            for connection in self.connections:
                try:
                    connection.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass

    # ---- registers ----

    def _fill(self, version, model, serial):
        def put(table, first, words):
            for at, word in enumerate(words):
                table[first + at] = word

        put(self.input, 0, [0] * 100)
        put(self.input, 1, [1, 216, *text(16, model), *text(5, serial), 1, *text(16, model[:3]), *text(5, serial)])
        put(self.input, 46, [*version, *struct.unpack(">HH", struct.pack(">I", 20240115)), 0])
        put(self.input, 52, [0x0011, 0x2233, 0x4455])
        put(self.input, 100, [*f32(1.25), 300, *f32(2.5), 5, 0, 0, 0, 1, 0, 0, 0, 3, 3, 1, *f32(35.5), 0])
        first, stride, count = PRESETS
        for number in range(count):
            at = first + stride * number
            put(self.holding, at, [0, *f32(2.5), *f32(3.0), 0, 0, 900, *f32(0.5), 420, 180, 600, 20, 35, 80, 90, 101,
                                   99, 12, 0, 1, *[0] * 8])
        first, stride, count = ADVANCED
        put(self.holding, first, [0] * stride * count)
        put(self.holding, CONTROL.start, [0] * len(CONTROL))
        put(self.holding, 3650, [1, 216])
        put(self.holding, 3657, [2])
        put(self.holding, 3660, [100])
        put(self.holding, 3668, [*f32(10.0), *f32(10.0), *f32(0.5)])
        put(self.holding, 3682, [6])
        put(self.holding, 3705, [4711, 1, *f32(3.0)])
        put(self.holding, 3726, [*f32(100.0), 100])
        put(self.holding, 3740, [0, 7])
        put(self.holding, DIRECTION, [0])

    @staticmethod
    def _pairs():
        """First registers of values of 32 bits."""
        pairs = set()
        first, stride, count = PRESETS
        for number in range(count):
            pairs |= {first + stride * number + offset for offset in PRESET_TORQUES}
        first, stride, count = ADVANCED
        for number in range(count):
            pairs |= {first + stride * number + 1 + 2 * p for p in range(18)} | {first + stride * number + 40}
        return pairs | {3664, 3666, 3668, 3670, 3672, 3707, 3726, 3729, 3732, 3740}

    def value(self, register):
        """A floating-point number in holding registers."""
        with self.lock:
            return float_of((self.holding[register], self.holding[register + 1]))

    def number(self, register):
        with self.lock:
            return self.holding[register]

    def put(self, register, *words):
        with self.lock:
            for at, word in enumerate(words):
                self.holding[register + at] = word

    # ---- requests ----

    def _identity(self):
        serial = bytes((42, 0, self.product, 1, 24))
        return struct.pack(">HHHH", 1, 1, 6, self.firmware) + serial + struct.pack(">I", 12345)

    def _read(self, table, first, count):
        if not 1 <= count <= self.longest_read:
            raise Refused(3)
        if any(first + at not in table for at in range(count)):
            raise Refused(2)
        return b"".join(struct.pack(">H", table[first + at]) for at in range(count))

    def _check(self, register, word):
        first, stride, count = PRESETS
        low, high = LIMITS.get(register, (0, 0xFFFF))
        if first <= register < first + stride * count:
            low, high = PRESET_LIMITS.get((register - first) % stride, (0, 0xFFFF))
        if not low <= word <= high:
            raise Refused(0x0E)

    def _write(self, first, words):
        self.writes.append((first, words))
        for at, word in enumerate(words):
            register = first + at
            if register in (RUN, OUTPUT):
                continue
            if register not in self.holding:
                self.strange.append(register)
                raise Refused(2)
            self._check(register, word)
        for at, word in enumerate(words):
            self._take(first + at, word)

    def _take(self, register, word):
        if register == OUTPUT:
            self.armed = word == 1
        elif register == RUN:
            was_running = self.input[110] == 1
            self.input[110] = 1 if word == 1 else 0
            if was_running and word == 0:
                self.runs_down_until = time.monotonic() + RUN_DOWN
        elif register == DIRECTION:
            # Echoed, and not taken while the spindle still turns.
            if self.input[110] == 0 and time.monotonic() >= self.runs_down_until:
                self.holding[DIRECTION] = self.input[112] = word
        else:
            if register == 3657 and self.rescales:
                self._rescale(self.holding[3657], word)
            self.holding[register] = word

    def _rescale(self, old, new):
        factor = PER_NEWTON_METRE[new] / PER_NEWTON_METRE[old]
        first, stride, count = PRESETS
        for number in range(count):
            for offset in (1, 8):
                at = first + stride * number + offset
                self.holding[at], self.holding[at + 1] = f32(self.value(at) * factor)

    def answer(self, function, data):
        """The data of the answer behind the function code."""
        with self.lock:
            self.requests.append((function, data))
            if function == 0x11:
                if data:
                    raise Refused(3)
                identity = self._identity()
                return bytes((len(identity),)) + identity
            if function in (3, 4):
                first, count = struct.unpack(">HH", data)
                if function == 4 and count == EVENT_WORDS:
                    self.event_reads.append(first)
                words = self._read(self.holding if function == 3 else self.input, first, count)
                return bytes((len(words),)) + words
            if function == 6:
                register, word = struct.unpack(">HH", data)
                self._write(register, [word])
                return data
            if function == 16:
                first, count, size = struct.unpack(">HHB", data[:5])
                if not 1 <= count <= 123 or size != 2 * count or len(data) != 5 + size:
                    raise Refused(3)
                self._write(first, list(struct.unpack(f">{count}H", data[5:])))
                return data[:4]
            raise Refused(1)

    # ---- the wire ----

    def _accept(self):
        while True:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with self.lock:
                self.connections.append(connection)
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    @staticmethod
    def _exactly(connection, count):
        got = b""
        while len(got) < count:
            more = connection.recv(count - len(got))
            if not more:
                return None
            got += more
        return got

    def _serve(self, connection):
        with connection:
            try:
                while (header := self._exactly(connection, 6)) is not None:
                    transaction, protocol, length = struct.unpack(">HHH", header)
                    body = self._exactly(connection, length)
                    if body is None or protocol != 0 or length < 2:
                        return
                    self._reply(connection, transaction, body)
            except OSError:
                return

    def _reply(self, connection, transaction, body):
        function = body[1]
        try:
            pdu = bytes((function,)) + self.answer(function, body[2:])
        except Refused as refused:
            pdu = bytes((function | 0x80, refused.code))
        with self.lock:
            self.answers += 1
            noise = self.noise(self.answers) if self.noise else b""
        # Answers have unit 1, whatever was asked.
        self._send(connection, noise + struct.pack(">HHHB", transaction, 0, len(pdu) + 1, 1) + pdu)

    def _send(self, connection, data):
        size, pause = self.pieces or (len(data), lambda: 0)
        self._send_in_pieces(connection, data, size, pause)

    def _send_in_pieces(self, connection, data, size, pause):
        with self.sending:
            for at in range(0, len(data), size):
                connection.sendall(data[at:at + size])
                time.sleep(pause())

    def push(self, data, size=None):
        """To all that are connected; in pieces with pauses where a size is given."""
        with self.lock:
            connections = list(self.connections)
        for connection in connections:
            with contextlib.suppress(OSError):
                pause = (lambda: random.uniform(0.010, 0.030)) if size else (lambda: 0)
                self._send_in_pieces(connection, data, size or len(data), pause)


    def happen(self, block, form=0x65, places=None):
        """An event: it stands at its places (or some of them), and is pushed where a client armed that."""
        self.hold(block, self.event_places if places is None else places)
        with self.lock:
            armed = self.armed
        if armed:
            self.push(pushed(form, block))

    def hold(self, block, places):
        """An event stands there, and nothing is pushed."""
        with self.lock:
            for place in places:
                for at, word in enumerate(struct.unpack(f">{EVENT_WORDS}H", block)):
                    self.input[place + at] = word
                self.input.setdefault(place + EVENT_WORDS, 0)

    def show(self, register, word, *mirrors):
        """The user does something on the tool: its status says it, and so do holding registers."""
        with self.lock:
            self.input[register] = word
            for mirror in mirrors:
                self.holding[mirror] = word


# ---- frames that come unasked ----


def event_block(number=1962, status=1, preset=1, torque=2.0625, unit=2, counts=(4, 4), when=(2026, 5, 28, 14, 30, 45),
                steps=((4, 0), (5, 1), (10, 3))):
    """The 214 bytes, whatever carries them."""
    block = struct.pack(">BBHH6BHHHHHHH", 0, 1, number, *when, 12, 1421, preset, unit, 3, 0, 0, status)
    block += struct.pack(">6f", 2.0, torque, 0, 0, 0, 0)
    block += struct.pack(">5H", 235, 1058, 399, 1457, 0) + bytes(14) + struct.pack(">H", 0)
    block += b"WO-1234".ljust(64, b"\0") + struct.pack(">5H", 1, 4, *counts, 5)
    block += b"".join(struct.pack(">HH", *step) for step in steps).ljust(64, b"\0")
    assert len(block) == 2 * EVENT_WORDS
    return block


def pushed(form, block, first=(), second=(), transaction=0):
    """The frame of function 04, 65h or 66h (with the samples of both channels)."""
    if form == 0x04:
        body = bytes((form, len(block))) + block
    else:
        data = block + (b"".join(struct.pack(">f", one) for one in (*first, *second)) if form == 0x66 else b"")
        body = bytes((form,)) + struct.pack(">H", len(data)) + data
    return struct.pack(">HHHB", transaction, 0, len(body) + 1, 0) + body


def curve(channel, samples, transaction=0):
    """The frame of function 64h."""
    data = struct.pack(">HH", channel, len(samples)) + b"".join(struct.pack(">f", one) for one in samples)
    body = b"\x64" + struct.pack(">H", len(data)) + data
    return struct.pack(">HHHB", transaction, 0, len(body) + 1, 0) + body


def main():
    device = Gen2Device()
    print(device.port, flush=True)
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        sys.exit(0)


if __name__ == "__main__":
    main()
