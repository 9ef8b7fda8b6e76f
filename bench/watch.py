#!/usr/bin/env python3
"""Measures `spindle watch --json` and `spindle record` on tools that push events over loopback.

usage: watch.py SPINDLE latency [EVENTS]      from the event's sending to the line in the pipe
       watch.py SPINDLE throughput [EVENTS]   events as fast as they can be taken
       watch.py SPINDLE tools [COUNT...]      so many tools, one event per second each
       watch.py SPINDLE record [COUNT...]     the same, stored: from the event's sending until it is durable
       watch.py SPINDLE burst [EVENTS]        events of one tool all at once, stored
       watch.py SPINDLE curves [COUNT...]     so many tools, one result per second each with two curves, stored

The tools are one process of their own, so that only spindle is measured. The times of `latency` include
this program's own part: those of a bare relay from a socket to a pipe, seen in the same run, are printed
beside them."""

import json
import os
import selectors
import socket
import sqlite3
import statistics
import struct
import subprocess
import sys
import tempfile
import time

IDENTITY = bytes.fromhex("00010001000308373CDCAA2A")  # model 3204, firmware 2103, serial 1021100074
NUMBER_REGISTER, ARM_REGISTER = 3200, 4002
PROFILE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "profiles")


def event_block(number):
    return struct.pack(">14H", number, 1421, 1, 2100, 2127, 235, 1058, 399, 1457, 3, 0, 0, 1, 0)


def event_frame(number):
    return struct.pack(">HHHBBB", 1, 0, 31, 0, 4, 28) + event_block(number)


class Tool:
    """The registers of one tool whose events are made by the measuring program."""

    def __init__(self, serial=0):
        self.identity = IDENTITY[:8] + (1021100074 + serial).to_bytes(4, "big")
        self.number = 0
        self.armed = False
        self.client = None
        self.waiting = b""

    def respond(self, function, first, word):
        if function == 17:
            return bytes([17, len(self.identity)]) + self.identity
        if function == 6:
            self.armed = self.armed or (first == ARM_REGISTER and word == 1)
            return struct.pack(">BHH", 6, first, word)
        if function == 3:
            return bytes([3, 2 * word]) + bytes(2 * word)
        block = event_block(self.number)
        from_here = 2 * (first - NUMBER_REGISTER)
        return bytes([function, 2 * word]) + block[from_here : from_here + 2 * word]

    def receive(self, data):
        self.waiting += data
        answers = b""
        while len(self.waiting) >= 8:
            transaction, _, length, unit, function = struct.unpack_from(">HHHBB", self.waiting)
            if len(self.waiting) < 6 + length:
                break
            words = struct.unpack_from(">HH", self.waiting, 8) if length >= 6 else (0, 0)
            self.waiting = self.waiting[6 + length :]
            pdu = self.respond(function, *words)
            answers += struct.pack(">HHHB", transaction, 0, len(pdu) + 1, unit) + pdu
        return answers

    def happen(self):
        self.number = (self.number + 1) % 0x10000
        return event_frame(self.number)


SAMPLES = 1000


class CurveTool(Tool):
    """One with firmware 4002, whose results have two channels of samples."""

    def __init__(self, serial=0):
        super().__init__(serial)
        self.identity = bytes.fromhex("000100010006 0FA2") + bytes((42, serial % 100, 19, serial // 100 % 100, 24)) + bytes(4)
        torques = struct.pack(f">{SAMPLES}f", *(2.5 * at / SAMPLES for at in range(SAMPLES)))
        angles = struct.pack(f">{SAMPLES}f", *(1.5 * at for at in range(SAMPLES)))
        self.samples = torques + angles

    def respond(self, function, first, word):
        if function == 17:
            return bytes([17, len(self.identity)]) + self.identity
        if function == 6:
            self.armed = self.armed or (first == 5350 and word == 1)
            return struct.pack(">BHH", 6, first, word)
        return bytes([function, 2 * word]) + bytes(2 * word)

    def happen(self):
        self.number = (self.number + 1) % 0x10000
        block = struct.pack(">BBHH6B7H", 0, 1, self.number, 2026, 5, 28, 14, 30, 45, 0, 1421, 1, 2, 3, 0, 0, 1)
        block += struct.pack(">6f5H", 2.0, 2.0625, 0, 0, 0, 0, 235, 1058, 399, 1457, 0) + bytes(16)
        block += b"WO-1234".ljust(64, b"\0") + struct.pack(">5H", 1, 4, SAMPLES, SAMPLES, 2)
        data = block.ljust(214, b"\0") + self.samples
        return struct.pack(">HHHBBH", 0, 0, 4 + len(data), 0, 0x66, len(data)) + data


class Tools:
    """Listens for each tool on a port of its own and serves them all in one thread."""

    def __init__(self, count, kind=Tool):
        self.tools = [kind(serial) for serial in range(count)]
        self.selector = selectors.DefaultSelector()
        self.ports = []
        for tool in self.tools:
            listening = socket.create_server(("127.0.0.1", 0))
            self.ports.append(listening.getsockname()[1])
            self.selector.register(listening, selectors.EVENT_READ, (tool, True))

    def serve(self, timeout):
        for key, _ in self.selector.select(timeout):
            tool, is_listening = key.data
            if is_listening:
                client, _ = key.fileobj.accept()
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                tool.client = client
                self.selector.register(client, selectors.EVENT_READ, (tool, False))
                continue
            try:
                data = key.fileobj.recv(4096)
            except ConnectionResetError:
                data = b""
            if not data:
                self.selector.unregister(key.fileobj)
                tool.client = None
                continue
            answers = tool.receive(data)
            if answers:
                key.fileobj.sendall(answers)

    def serve_until(self, condition, limit=30):
        end = time.monotonic() + limit
        while not condition():
            if time.monotonic() > end:
                sys.exit("watch.py: the watch did not come so far in time")
            self.serve(0.05)

    def settle(self):
        """Until all are armed, and their last events read."""
        self.serve_until(lambda: all(tool.armed for tool in self.tools))
        settled = time.monotonic() + 0.5
        self.serve_until(lambda: time.monotonic() > settled)

    def urls(self):
        return [f"tcp://127.0.0.1:{port}" for port in self.ports]


def start(spindle, urls, *options, stdout):
    arguments = [spindle, "watch", *urls, "--profile", "doga-bm", "--json", *options]
    environment = dict(os.environ, SPINDLE_PROFILE_PATH=PROFILE)
    return subprocess.Popen(arguments, stdout=stdout, stderr=subprocess.DEVNULL, env=environment)


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def show(name, times):
    in_ms = [value * 1e3 for value in times]
    print(
        f"{name:<8} median {statistics.median(in_ms):.3f} ms   "
        f"99 % {percentile(in_ms, 0.99):.3f} ms   longest {max(in_ms):.3f} ms"
    )


def relay_latency(events):
    """What a relay costs that does nothing: the same machine, the same measuring."""
    listening = socket.create_server(("127.0.0.1", 0))
    port = listening.getsockname()[1]
    relay = subprocess.Popen(
        ["socat", "-u", f"TCP:127.0.0.1:{port}", "STDOUT"], stdout=subprocess.PIPE
    )
    client, _ = listening.accept()
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    times = []
    for number in range(events):
        time.sleep(0.003)
        frame = event_frame(number % 0x10000)
        began = time.perf_counter()
        client.sendall(frame)
        os.read(relay.stdout.fileno(), 4096)
        times.append(time.perf_counter() - began)
    client.close()
    relay.wait()
    return times


def latency(spindle, events=2000):
    tools = Tools(1)
    tool = tools.tools[0]
    process = start(spindle, tools.urls(), stdout=subprocess.PIPE)
    tools.settle()
    output = process.stdout.fileno()
    os.read(output, 65536)  # the link record
    times = []
    for _ in range(events):
        tools.serve(0.003)
        frame = tool.happen()
        began = time.perf_counter()
        tool.client.sendall(frame)
        line = os.read(output, 65536)
        times.append(time.perf_counter() - began)
        if b'"number":%d,' % tool.number not in line:
            sys.exit(f"watch.py: not the event that was sent: {line!r}")
    process.terminate()
    tools.serve_until(lambda: process.poll() is not None)
    show("relay", relay_latency(events))
    show("spindle", times)


def throughput(spindle, events=200_000):
    tools = Tools(1)
    tool = tools.tools[0]
    chunk = 64
    with tempfile.TemporaryFile() as output:
        process = start(spindle, tools.urls(), "--count", str(events // chunk * chunk), stdout=output)
        tools.settle()
        chunks = []
        for _ in range(events // chunk):
            chunks.append((b"".join(tool.happen() for _ in range(chunk)), tool.number))
        tool.number = 0  # what its registers hold is the last event that was sent
        began = time.perf_counter()
        for frames, tool.number in chunks:
            tools.serve(0)
            tool.client.sendall(frames)
        tools.serve_until(lambda: tool.client is None)
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - began
        output.seek(0)
        lines = sum(1 for line in output if b'"type":"event"' in line)
    cpu = usage.ru_utime + usage.ru_stime
    print(
        f"{lines} events in {seconds:.2f} s: {lines / seconds:,.0f} per second; "
        f"{cpu:.2f} s of processor time: {lines / cpu:,.0f} per second of one core; status {status >> 8}"
    )


def record(spindle, urls, store, stdout):
    arguments = [spindle, "record", *urls, "--profile", "doga-bm", "--store", store, "--tee", "--json"]
    environment = dict(os.environ, SPINDLE_PROFILE_PATH=PROFILE)
    return subprocess.Popen(arguments, stdout=stdout, stderr=subprocess.DEVNULL, env=environment)


class Told:
    """When each event was told, which is when it was durable."""

    def __init__(self, process, tools):
        self.output = process.stdout.fileno()
        os.set_blocking(self.output, False)
        self.waiting = b""
        self.told = {}
        self.ports = {port: index for index, port in enumerate(tools.ports)}

    def read(self):
        try:
            self.waiting += os.read(self.output, 1 << 20)
        except BlockingIOError:
            return
        now = time.perf_counter()
        *lines, self.waiting = self.waiting.split(b"\n")
        for line in lines:
            if b'"type":"event"' not in line:
                continue
            told = json.loads(line)
            port = int(told["target"].rsplit(":", 1)[1])
            self.told[self.ports[port], told["number"]] = now


def recorded(spindle, count, seconds=20):
    tools = Tools(count)
    with tempfile.TemporaryDirectory() as folder:
        process = record(spindle, tools.urls(), os.path.join(folder, "events.db"), subprocess.PIPE)
        tools.settle()
        told = Told(process, tools)
        used, began = processor_seconds(process.pid), time.monotonic()
        sent = {}
        while (elapsed := time.monotonic() - began) < seconds:
            while len(sent) < elapsed * count:
                index = len(sent) % count
                frame = tools.tools[index].happen()
                tools.tools[index].client.sendall(frame)
                sent[index, tools.tools[index].number] = time.perf_counter()
            tools.serve(min(0.002, 1 / count))
            told.read()
        used = processor_seconds(process.pid) - used
        settled = time.monotonic() + 2
        while time.monotonic() < settled:
            tools.serve(0.01)
            told.read()
        peak = memory_mib(process.pid)
        process.terminate()
        tools.serve_until(lambda: process.poll() is not None)
    times = [told.told[event] - at for event, at in sent.items() if event in told.told]
    print(f"{count:4} tools: {100 * used / seconds:5.1f} % of a core, {peak:6.1f} MiB; "
          f"{len(times)} of {len(sent)} events durable; status {process.returncode}")
    show("durable", times)


def curves(spindle, count, seconds=20):
    tools = Tools(count, CurveTool)
    with tempfile.TemporaryDirectory() as folder:
        store = os.path.join(folder, "events.db")
        environment = dict(os.environ, SPINDLE_PROFILE_PATH=PROFILE)
        process = subprocess.Popen([spindle, "record", *tools.urls(), "--profile", "doga-gen2", "--store", store],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
        tools.settle()
        settled = time.monotonic() + 2  # the settings of all presets are read at first
        tools.serve_until(lambda: time.monotonic() > settled)
        used, sent = driven_evenly(tools, process, seconds)
        settled = time.monotonic() + 2
        tools.serve_until(lambda: time.monotonic() > settled)
        peak = memory_mib(process.pid)
        process.terminate()
        tools.serve_until(lambda: process.poll() is not None)
        reader = sqlite3.connect(f"file:{store}?mode=ro", uri=True)
        stored = reader.execute("SELECT count(*), sum(length(samples)) FROM curve").fetchone()
    print(f"{count:4} tools: {100 * used / seconds:5.1f} % of a core, {peak:6.1f} MiB; "
          f"{stored[0]} of {sent} curves stored, {stored[1] or 0} bytes of samples; status {process.returncode}")


def burst(spindle, events=10_000):
    tools = Tools(1)
    tool = tools.tools[0]
    with tempfile.TemporaryDirectory() as folder:
        store = os.path.join(folder, "events.db")
        process = record(spindle, tools.urls(), store, subprocess.DEVNULL)
        tools.settle()
        reader = sqlite3.connect(f"file:{store}?mode=ro", uri=True)
        frames = b"".join(tool.happen() for _ in range(events))
        piece = 400 * len(event_frame(0))
        began = time.perf_counter()
        while reader.execute("SELECT count(*) FROM event").fetchone()[0] < events:
            # Whole frames, and few at once: what is asked meanwhile is answered between them.
            tool.client.sendall(frames[:piece])
            frames = frames[piece:]
            tools.serve(0.001)
        seconds = time.perf_counter() - began
        process.terminate()
        tools.serve_until(lambda: process.poll() is not None)
    print(f"{events} events durable in {seconds:.2f} s: {events / seconds:,.0f} per second")


def processor_seconds(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
        fields = stat.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory_mib(pid):
    with open(f"/proc/{pid}/status", encoding="ascii") as status:
        peak = next(line for line in status if line.startswith("VmHWM"))
    return int(peak.split()[1]) / 1024


def driven_evenly(tools, process, seconds):
    """One result a second of each tool; the processor time that the program took, and how many results."""
    count = len(tools.tools)
    used, began = processor_seconds(process.pid), time.monotonic()
    sent = 0
    while (elapsed := time.monotonic() - began) < seconds:
        while sent < elapsed * count:  # evenly, one after another
            tool = tools.tools[sent % count]
            tool.client.sendall(tool.happen())
            sent += 1
        tools.serve(min(0.01, 1 / count))
    return processor_seconds(process.pid) - used, sent


def many(spindle, count, seconds=20):
    tools = Tools(count)
    with tempfile.TemporaryFile() as output:
        process = start(spindle, tools.urls(), stdout=output)
        tools.settle()
        used, sent = driven_evenly(tools, process, seconds)
        settled = time.monotonic() + 1
        tools.serve_until(lambda: time.monotonic() > settled)
        peak = memory_mib(process.pid)
        process.terminate()
        tools.serve_until(lambda: process.poll() is not None)
        output.seek(0)
        lines = output.read().splitlines()
    told = sum(1 for line in lines if b'"type":"event"' in line)
    gaps = sum(1 for line in lines if b'"type":"gap"' in line)
    lost = sum(1 for line in lines if b'"lost"' in line)
    print(
        f"{count:4} tools: {100 * used / seconds:5.1f} % of a core, {peak:6.1f} MiB; "
        f"{told} of {sent} events told, {gaps} gaps, {lost} links lost"
    )


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    spindle, what, numbers = sys.argv[1], sys.argv[2], [int(text) for text in sys.argv[3:]]
    if what == "latency":
        latency(spindle, *numbers)
    elif what == "throughput":
        throughput(spindle, *numbers)
    elif what == "tools":
        for count in numbers or (1, 50, 100, 250, 500):
            many(spindle, count)
    elif what == "record":
        for count in numbers or (50, 500):
            recorded(spindle, count)
    elif what == "curves":
        for count in numbers or (50,):
            curves(spindle, count)
    elif what == "burst":
        burst(spindle, *numbers)
    else:
        sys.exit(__doc__)


main()
