"""Others on a serial line: another program on the same port, another master on the bus, several clients of one
device server, and answers that come twice. No value may be shown that the register does not have."""

import collections
import contextlib
import os
import pty
import random
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
import tty
import unittest

import frames
import support

CHARACTER = 11 / 9600  # seconds on the line
TURNAROUND = 0.003
PERIOD = 0.09
CALLS = 12

PROFILE = ["--profile", "orientalmotor-blv"]
SPEED = 206  # what the other master asks for; the shape of a 32-bit value, as alarm.present has it

# Asks as many programs do: without a lock, and without looking whose answer it reads.
OTHER_PROGRAM = """
import os, sys, time, tty
line = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
tty.setraw(line)
print("ready", flush=True)
while True:
    os.write(line, bytes.fromhex(sys.argv[2]))
    time.sleep(float(sys.argv[3]))
    try:
        os.read(line, 256)
    except BlockingIOError:
        pass
"""


QUERY = frames.with_checksum(struct.pack(">BBHH", 1, 3, SPEED, 2))


def number_at(register):
    """Small, and another one in every register of a 32-bit value."""
    return 0 if register % 2 == 0 else register * 7 % 251


class Device:
    """Unit 1: takes requests as they come and answers one after the other, each in the time of the line."""

    def __init__(self, say, copies=None):
        self._say = say
        self._copies = copies
        self._requests = collections.deque()
        self._more = threading.Condition()
        self._ended = False
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def hear(self, frame):
        with self._more:
            self._requests.append(frame)
            self._more.notify()

    def end(self):
        with self._more:
            self._ended = True
            self._more.notify()
        self._thread.join(support.DEADLINE)

    def take_frames(self, buffer):
        """Requests of 8 bytes; there are no others here."""
        while len(buffer) >= 8:
            frame = bytes(buffer[:8])
            if frames.with_checksum(frame[:-2]) == frame:
                self.hear(frame)
                del buffer[:8]
            else:
                del buffer[:1]

    @staticmethod
    def _answer(frame):
        unit, function, first, count = struct.unpack(">BBHH", frame[:6])
        if unit != 1:
            return b""
        if function == 3:
            values = [number_at(register) for register in range(first, first + count)]
            return frames.with_checksum(struct.pack(f">BBB{count}H", unit, function, 2 * count, *values))
        return frame if function == 8 else frames.with_checksum(bytes([unit, function | 0x80, 1]))

    def _serve(self):
        while True:
            with self._more:
                self._more.wait_for(lambda: self._requests or self._ended)
                if self._ended:
                    return
                frame = self._requests.popleft()
            answer = self._answer(frame)
            time.sleep((len(frame) + len(answer)) * CHARACTER + TURNAROUND)
            self._say(answer)
            if self._copies:
                threading.Timer(random.uniform(*self._copies), self._say, [answer]).start()


@contextlib.contextmanager
def port(copies=None, heard_every=None):
    """A port with the device behind it; with `heard_every` another master is on its bus."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    ended = threading.Event()

    def say(frame):
        with contextlib.suppress(OSError):
            os.write(master, frame)

    device = Device(say, copies)

    def listen():
        buffer = bytearray()
        while not ended.is_set():
            if support.select.select([master], [], [], 0.05)[0]:
                buffer += os.read(master, 4096)
                device.take_frames(buffer)

    def poll():
        while not ended.wait(heard_every):
            say(QUERY)
            device.hear(QUERY)

    threads = [threading.Thread(target=listen)]
    if heard_every:
        threads.append(threading.Thread(target=poll))
    for thread in threads:
        thread.start()
    try:
        yield os.ttyname(slave)
    finally:
        ended.set()
        for thread in threads:
            thread.join()
        device.end()
        os.close(slave)
        os.close(master)


class DeviceServer(support.Port):
    """Passes what any client says to the line, and what the device says to all clients."""

    def __init__(self):
        super().__init__()
        self._device = Device(self._say_to_all)
        self.url = f"rtu+tcp://127.0.0.1:{self.port}?unit=1"

    def __exit__(self, *arguments):
        self._device.end()
        super().__exit__(*arguments)

    def _say_to_all(self, frame):
        for client in list(self._connections):
            with contextlib.suppress(OSError):
                client.sendall(frame)

    def _serve(self, client):
        buffer = bytearray()
        with contextlib.suppress(OSError):
            while chunk := client.recv(4096):
                buffer += chunk
                self._device.take_frames(buffer)


@contextlib.contextmanager
def other_client(server):
    """Polls through the device server."""
    ended = threading.Event()
    with socket.create_connection(("127.0.0.1", server.port)) as client:

        def poll():
            while not ended.wait(PERIOD):
                client.sendall(QUERY)

        def discard():
            with contextlib.suppress(OSError):
                while client.recv(4096):
                    pass

        threads = [threading.Thread(target=poll), threading.Thread(target=discard, daemon=True)]
        for thread in threads:
            thread.start()
        try:
            yield
        finally:
            ended.set()
            threads[0].join()


class OtherMasters(unittest.TestCase):
    def ask(self, url, told, calls=CALLS):
        """Asks for a 32-bit value and for a single register without a profile. What is shown has to be right, and
        half of it has to be shown. Half of the calls say what is wrong with the line: a short one may end before
        another master asks again."""
        shown = warned = 0
        for call in range(2 * calls):
            raw = call % 2 == 1
            target = ["@holding:129"] if raw else ["alarm.present", *PROFILE]
            finished = support.run("get", url, *target, "--json", "--retries", "3")
            for record in finished.records("value"):
                self.assertEqual(int(record["value"]), number_at(129), finished)
                shown += 1
            if finished.status == 0:
                self.assertTrue(finished.records("value"), finished)
            warned += all(sentence in finished.said for sentence in told)
            if not told:
                self.assertEqual((finished.status, finished.stderr), (0, ""), finished)
        self.assertGreaterEqual(shown, calls)
        self.assertGreaterEqual(warned, calls)

    def test_a_line_of_ones_own(self):
        with port() as path:
            self.ask(f"rtu://{path}?unit=1", [])
        with DeviceServer() as server:
            self.ask(server.url, [])

    def test_another_program_on_the_port(self):
        with port() as path:
            arguments = [sys.executable, "-c", OTHER_PROGRAM, path, QUERY.hex(), str(PERIOD)]
            with subprocess.Popen(arguments, stdout=subprocess.PIPE) as other:
                try:
                    other.stdout.readline()
                    self.ask(f"rtu://{path}?unit=1",
                             [f"(process {other.pid}) has this line open, too", "another master is on this line"])
                finally:
                    other.kill()

    def test_another_master_on_the_bus(self):
        with port(heard_every=PERIOD) as path:
            self.ask(f"rtu://{path}?unit=1", ["another master is on this line"])

    def test_another_client_of_the_device_server(self):
        with DeviceServer() as server, other_client(server):
            self.ask(server.url, ["another master is on this line"])

    def test_answers_that_come_twice(self):
        with port(copies=(0.005, 0.04)) as path:
            for _ in range(4):
                finished = support.run("get", f"rtu://{path}?unit=1", "operation.*.speed", "alarm.*", "--json",
                                       *PROFILE, "--retries", "3")
                values = finished.records("value")
                for record in values:
                    first = record["register"]
                    self.assertEqual(record["raw"], [number_at(first), number_at(first + 1)][: len(record["raw"])],
                                     finished)
                self.assertTrue(values, finished)

    def test_two_of_this_program_at_one_device_server(self):
        with DeviceServer() as server:
            with support.Running("watch", server.url, "alarm.present", "--json", *PROFILE) as watching:
                watching.line()
                # Both ask through the one that has the line.
                asked = support.run("get", server.url, "alarm.present", *PROFILE)
                self.assertEqual(asked.status, 0, asked)
                stop = support.run("remote-stop", server.url, *PROFILE)
                self.assertNotIn("has this line open", stop.said)
                watching.send_signal(signal.SIGINT)
                watching.finish()
            support.wait_until(
                lambda: support.run("get", server.url, "alarm.present", *PROFILE).status == 0, "the line is free")


if __name__ == "__main__":
    unittest.main()
