"""A gateway with meters behind one TCP port, and the habits of those that are cheap."""

import contextlib
import socket
import struct
import threading
import time

import support

LINGER_NOT_AT_ALL = struct.pack("ii", 1, 0)
LEAVING_TAKES = 2  # seconds at most


class Gateway(support.Port):
    """Register N of unit U holds 1000 U + N, until it is written. It handles one request after the other.

    `ids` makes the transaction id of an answer out of that of its request. `behave(unit, number)` says what
    becomes of the request with this number (from 1) to the unit: an exception code, `Late(seconds)`, SILENT,
    CLOSE or None for an answer. One that is `exclusive` throws out whoever comes while it has a client.
    """

    def __init__(self, units=(1, 2, 3), ids=lambda asked: asked, behave=lambda unit, number: None, exclusive=False):
        super().__init__()
        self.ids = ids
        self.behave = behave
        self.exclusive = exclusive
        self.requests = []  # (unit, function, first register)
        self.met = 0  # clients that were served
        self.refused = 0
        self.beside = 0  # clients that came while another one was there
        self.overlaps = 0  # requests that came before the one before was answered
        self._counts = dict.fromkeys(units, 0)
        self._written = {}
        self._leaving = threading.Condition()
        self._present = 0

    def url_of(self, unit, more=""):
        return f"{self.url}?unit={unit}{more}"

    def units_asked(self):
        return [unit for unit, *_ in self.requests]

    def drop(self):
        """Ends the connections there are."""
        for connection in list(self._connections):  # the next one may come meanwhile
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def _meet(self, connection):
        with self._leaving:
            # One that has left is not always noticed before the next one comes.
            is_free = self._leaving.wait_for(lambda: self._present == 0, LEAVING_TAKES)
            self.beside += not is_free
            if self.exclusive and not is_free:
                self.refused += 1
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, LINGER_NOT_AT_ALL)
                connection.close()
                return
            self._present += 1
            self.met += 1
        super()._meet(connection)

    def _serve(self, connection):
        buffer = bytearray()
        try:
            with contextlib.suppress(OSError):
                while chunk := connection.recv(65536):
                    buffer += chunk
                    requests = support.take_requests(buffer)
                    self.overlaps += max(len(requests) - 1, 0)
                    for request in requests:
                        if not self._handle(connection, request):
                            return
        finally:
            with self._leaving:
                self._present -= 1
                self._leaving.notify_all()
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def _handle(self, connection, request):
        self.requests.append((request.unit, request.function, request.words[0] if request.data else None))
        habit = SILENT
        if request.unit in self._counts:
            self._counts[request.unit] += 1
            habit = self.behave(request.unit, self._counts[request.unit])
        if habit is CLOSE:
            return False
        if habit is SILENT:
            return True
        answer = self._answer(request) if habit is None or isinstance(habit, Late) else None
        if answer is None:
            answer = bytes([request.function | 0x80, habit or 1])
        frame = struct.pack(">HHHB", self.ids(request.transaction), 0, len(answer) + 1, request.unit) + answer
        if isinstance(habit, Late):
            self._begin(self._send_late, connection, frame, habit.seconds)
        else:
            connection.sendall(frame)
        return True

    @staticmethod
    def _send_late(connection, frame, seconds):
        time.sleep(seconds)
        with contextlib.suppress(OSError):
            connection.sendall(frame)

    def _answer(self, request):
        if request.function in (3, 4):
            first, count = request.words[:2]
            values = [self._written.get((request.unit, first + at), 1000 * request.unit + first + at) for at in range(count)]
            return bytes([request.function, 2 * count]) + struct.pack(f">{count}H", *values)
        if request.function == 6:
            register, word = request.words[:2]
            self._written[request.unit, register] = word
            return bytes([request.function]) + request.data
        return None


class Late:
    def __init__(self, seconds):
        self.seconds = seconds


SILENT, CLOSE = object(), object()
