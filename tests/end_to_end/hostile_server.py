"""A Modbus TCP server with the registers of a BM screwdriver and one bad habit.

It is written from the tool's description, and shares nothing with the program's own simulated tool.
The habit is data: a row of hostile_table.json says to which requests it applies, and what is sent
instead of the plain answer. The language of the rows is described in `Reply`.
"""

import contextlib
import dataclasses
import decimal
import socket
import struct
import threading
import time
import traceback

import support

EVENT_REGISTERS = 14
EVENT_FIRST = 3200
FILLER = 0xEEEE
# Words of a pushed event; none of them stands in any register, so a leak shows.
PUSHED = [0xA500 + number for number in range(EVENT_REGISTERS)]


class Tool:
    """The tool behind the wire: registers, limits, identity. Answers requests correctly."""

    def __init__(self, firmware=2103, model=3, serial=1021100042, identity=None):
        self.identity = (
            bytes.fromhex(identity)
            if identity is not None
            else struct.pack(">HHHHI", 1, 1, model, firmware, serial)
        )
        self.holding = {}
        for number in range(1, 726):
            if 564 <= number <= 568:
                continue
            self.holding[number] = 3000 + number
            if number < 725:
                self.holding[1000 + number] = number
                self.holding[2000 + number] = 60000 - number
        for mode in range(1, 226, 15):
            self.holding.update({mode: 0, 1000 + mode: 0, 2000 + mode: 1})
        self.holding.update({2: 271, 1002: 10, 2002: 600, 3: 1000, 1003: 20, 2003: 10000})
        self.inputs = {3100 + number: 40 + number for number in range(2)}
        event = [1961, 1386, 1, 271, 0x10000 - 273, 1000, 1044, 402, 1446, 4, 0, 0, 1, 403]
        status = [0x10000 - 12, 17, 18, 3, 1, 0, 1, 0, 0, 1, 22, 23, 24, 25]
        for first, words in ((EVENT_FIRST, event), (3300, status)):
            self.inputs.update({first + offset: word for offset, word in enumerate(words)})
        # Far apart and single, so that each costs a request of its own.
        self.holding.update({5000 + 10 * number: 7000 + number for number in range(60)})
        self.actions = {}

    def table(self, name):
        return self.holding if name == "holding" else self.inputs

    def value(self, name, table, register):
        """What a record must say about a register, by the tool's description."""
        word = self.table(table)[register]
        raw = name.startswith(("@", "p")) and not name.startswith("preset.")
        if name.endswith("/i16") or (table == "input" and register in (3204, 3300)):
            word = (word ^ 0x8000) - 0x8000
        scaled = register in (3203, 3204, 3300) if table == "input" else register % 15 in (2, 3, 7)
        return decimal.Decimal(word).scaleb(0 if raw or not scaled else -2)

    def answer(self, request, store):
        """The right answer's function and data; `store` says what a write leaves behind."""
        function, data = request.function, request.data
        if function == support.REPORT_SERVER_ID and not data:
            return function, bytes([len(self.identity)]) + self.identity
        if len(data) != 4:
            return function | 0x80, b"\x03"
        first, word = request.words
        if function in (support.READ_HOLDING, support.READ_INPUT):
            return self._read(function, first, word)
        if function == support.WRITE_SINGLE:
            return self._write(first, word, data, store)
        return function | 0x80, b"\x01"

    def _read(self, function, first, count):
        registers = self.holding if function == support.READ_HOLDING else self.inputs
        if not 1 <= count <= 125:
            return function | 0x80, b"\x03"
        try:
            words = [registers[first + offset] for offset in range(count)]
        except KeyError:
            return function | 0x80, b"\x02"
        return function, bytes([2 * count]) + struct.pack(f">{count}H", *words)

    def _write(self, register, value, data, store):
        function = support.WRITE_SINGLE
        if 4000 <= register <= 4005:
            self.actions[register] = value
            return function, data
        if register not in self.holding or not 1 <= register <= 725:
            return function | 0x80, b"\x02"
        low, high = self.holding.get(1000 + register, 0), self.holding.get(2000 + register, 0xFFFF)
        if not low <= value <= high:
            return function | 0x80, b"\x0e"
        if store != "nothing":
            self.holding[register] = value + (1 if store == "next" else 0)
        return function, data


def frame(transaction, function, data, protocol=0, unit=0, length=None, tail=b""):
    size = 2 + len(data) + len(tail) if length is None else length
    return struct.pack(">HHHBB", transaction, protocol, size, unit, function) + data + tail


class Gone(Exception):
    """The connection has ended; nothing more is to be sent on it."""


class Reply:
    """Makes the bytes that a row sends for one request.

    A reply is a list of parts, each an object with one key:
      answer   the right answer, with what the object changes of it: transaction_offset, protocol,
               length, length_offset, tail (hex), unit, function, exception (hex data), count_offset
               (of the byte count alone), registers (so many more, consistently), data (hex),
               echo_value_offset, echo_address_offset, filler (all registers replaced)
      push     an event frame; transaction: a number or "pending"
      stray    another frame: transaction, function, data (hex)
      raw      bytes (hex)
      half     the first half of the right answer
      hold     an answer (changed as above), kept back and sent before the answer to the next
               request; with "past_repetition": before that to the next other request
      wait_ms  a pause
      endless  a list of parts that is sent every millisecond until the client is gone
      close, reset  end the connection
    No part: silence.
    """

    def __init__(self, request, function, data):
        self.request = request
        self.function = function
        self.data = data

    def _transaction(self, given):
        return self.request.transaction if given == "pending" else given

    def bytes_of(self, part):
        (kind, facts), = part.items()
        return getattr(self, f"_{kind}")(facts)

    def _answer(self, facts):
        function, data = self.function, bytearray(self.data)
        if "exception" in facts:
            function, data = self.request.function | 0x80, bytearray.fromhex(facts["exception"])
        if "data" in facts:
            data = bytearray.fromhex(facts["data"])
        if "registers" in facts:
            more = facts["registers"]
            data[0] += 2 * more
            data = data + struct.pack(">H", FILLER) * more if more > 0 else data[: 2 * more]
        if facts.get("filler"):
            data[1:] = struct.pack(">H", FILLER) * ((len(data) - 1) // 2)
        if "count_offset" in facts:
            data[0] += facts["count_offset"]
        for offset, at in (("echo_address_offset", 0), ("echo_value_offset", 2)):
            if offset in facts:
                word = struct.unpack_from(">H", data, at)[0]
                struct.pack_into(">H", data, at, (word + facts[offset]) & 0xFFFF)
        tail = bytes.fromhex(facts.get("tail", ""))
        length = facts.get("length")
        if "length_offset" in facts:
            length = 2 + len(data) + facts["length_offset"]
        return frame(
            (self.request.transaction + facts.get("transaction_offset", 0)) & 0xFFFF,
            facts.get("function", function),
            bytes(data),
            facts.get("protocol", 0),
            facts.get("unit", 0),
            length,
            tail,
        )

    def _push(self, facts):
        words = struct.pack(f">B{EVENT_REGISTERS}H", 2 * EVENT_REGISTERS, *PUSHED)
        return frame(self._transaction(facts["transaction"]), support.READ_INPUT, words)

    def _stray(self, facts):
        return frame(
            self._transaction(facts["transaction"]), facts["function"], bytes.fromhex(facts["data"])
        )

    def _raw(self, facts):
        return bytes.fromhex(facts)

    def _half(self, _):
        whole = self._answer({})
        return whole[: len(whole) // 2]


@dataclasses.dataclass(frozen=True)
class Held:
    """An answer that is kept back."""

    request: support.Request
    bytes: bytes
    past_repetition: bool


class HostileServer(support.Port):
    """Serves one tool with the habit of one row, and remembers all that was asked."""

    def __init__(self, row):
        super().__init__()
        self.row = row
        self.tool = Tool(**row.get("tool", {}))
        self.requests = []
        self.faults_of_client = []
        self.own_faults = []
        self.misbehaved = 0
        self.cuts = {}
        self._matched = 0
        self._held = []
        self._lock = threading.Lock()
        self._stopping = threading.Event()

    def __enter__(self):
        return self if self.row.get("accept") == "never" else super().__enter__()

    def __exit__(self, *_):
        self._stopping.set()
        super().__exit__()

    def _serve(self, connection):
        try:
            self._answer_all(connection)
        except Exception:  # a fault of the table or of this server must not pass for silence
            self.own_faults.append(traceback.format_exc())

    def _answer_all(self, connection):
        buffer = bytearray()
        with contextlib.suppress(OSError, Gone):
            while chunk := connection.recv(65536):
                buffer += chunk
                try:
                    requests = support.take_requests(buffer)
                except ValueError as error:
                    self.faults_of_client.append(str(error))
                    return
                for request in requests:
                    self._handle(connection, request)

    def _kind(self, request):
        if request.function == support.REPORT_SERVER_ID:
            return "identity"
        if request.function == support.WRITE_SINGLE:
            return "write"
        wrote = any(earlier.function == support.WRITE_SINGLE for earlier in self.requests)
        return "read-back" if wrote else "read"

    def _is_bad_for(self, kind):
        if kind not in self.row.get("on", []):
            return False
        self._matched += 1
        skipped = self.row.get("skip", 0)
        times = self.row.get("times", "always")
        return self._matched > skipped and (times == "always" or self._matched <= skipped + times)

    def _handle(self, connection, request):
        with self._lock:
            bad = self._is_bad_for(self._kind(request))
            self.requests.append(request)
            store = self.row.get("store", "asked") if bad else "asked"
            reply = Reply(request, *self.tool.answer(request, store))
            self.misbehaved += bad
            late = [held for held in self._held if self._is_due(held, request)]
            self._held = [held for held in self._held if held not in late]
        parts = self.row.get("reply", [{"answer": {}}]) if bad else [{"answer": {}}]
        parts = [{"raw": held.bytes.hex()} for held in late] + parts
        self._send_parts(connection, reply, parts, self.row.get("cut", "glued") if bad else "glued")

    @staticmethod
    def _is_due(held, request):
        is_repetition = request.bytes[7:] == held.request.bytes[7:]
        return not (held.past_repetition and is_repetition)

    def _send_parts(self, connection, reply, parts, cut):
        frames = []
        for part in parts:
            (kind, facts), = part.items()
            if kind == "hold":
                past_repetition = facts.get("past_repetition", False)
                self._held.append(Held(reply.request, reply.bytes_of({"answer": facts}), past_repetition))
            elif kind in ("wait_ms", "endless", "close", "reset"):
                self._send_pieces(connection, self._pieces(reply, frames, cut))
                frames = []
                self._act(connection, reply, kind, facts)
            else:
                frames.append(reply.bytes_of(part))
        self._send_pieces(connection, self._pieces(reply, frames, cut))

    def _act(self, connection, reply, kind, facts):
        if kind == "wait_ms":
            self._stopping.wait(facts / 1000)
            return
        if kind == "endless":
            block = b"".join(reply.bytes_of(part) for part in facts)
            while not self._stopping.wait(support.POLL):
                connection.sendall(block)
            raise Gone
        if kind == "reset":
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            connection.close()
            raise Gone
        connection.shutdown(socket.SHUT_RDWR)
        raise Gone

    def _pieces(self, reply, frames, cut):
        """How the bytes are cut into segments."""
        whole = b"".join(frames)
        if cut == "frames":
            return frames
        if cut == "bytes":
            return [whole[at : at + 1] for at in range(len(whole))]
        if cut == "inside-first":
            middle = len(frames[0]) // 2
            return [whole[:middle], whole[middle:]]
        if cut == "every" and len(whole) > 1:
            done = self.cuts.setdefault(reply.request.function, [])
            at = 1 + len(done) % (len(whole) - 1)
            done.append((at, len(whole)))
            return [whole[:at], whole[at:]]
        return [whole]

    def _send_pieces(self, connection, pieces):
        pause = self.row.get("pause_ms", 0) / 1000
        for number, piece in enumerate(pieces):
            if number > 0:
                self._wait_until_read(connection)
                if pause:
                    self._stopping.wait(pause)
            if piece:
                connection.sendall(piece)

    def _wait_until_read(self, connection):
        """Returns when the client has taken all that was sent, so that a segment ends there."""
        ours, theirs = connection.getsockname()[1], connection.getpeername()[1]
        end = time.monotonic() + support.DEADLINE
        while not self._stopping.is_set() and time.monotonic() < end:
            unread = support.unread_bytes(theirs, ours)
            if unread is None:
                raise Gone
            if unread == 0:
                return
            self._stopping.wait(support.POLL / 2)
        raise Gone
