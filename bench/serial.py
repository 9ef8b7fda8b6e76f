#!/usr/bin/env python3
"""How long spindle takes on a serial line, against what the line itself takes: serial.py BUILD [-n N]

BUILD is a build folder. A bus of registers, and then the simulated BLV driver, is served on a pseudo
terminal that plays wire time, gaps and the 10 ms that a BLV driver waits before it answers; its log says
when bytes came and went.
"""

import argparse
import datetime
import os
import pathlib
import re
import statistics
import subprocess
import tempfile
import time

CHARACTER_BITS = 11  # start, eight data, parity, stop
DELAY = 0.010
REGISTERS = 64
AT_ONCE = 16
ROOT = pathlib.Path(__file__).resolve().parent.parent
PROFILE = ROOT / "tests" / "end_to_end" / "drive.yaml"


class Line:
    """A program that serves a line on a pseudo terminal, and the log of what went over it."""

    def __init__(self, folder, command, **streams):
        self._log = folder / "log"
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **streams)
        self.url = self._process.stdout.readline().strip()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait(10)
        self._process.stdout.close()

    def heard(self):
        """(seconds, '>' or '<', bytes) in order; complete once the program has ended."""
        lines = re.findall(self.LOGGED, self._log.read_text(), re.MULTILINE)
        return [(self.seconds(at), way.strip("-"), bytes.fromhex(text)) for at, way, text in lines]


class Bus(Line):
    LOGGED = r"^(\d+) ([<>]) (.*)$"

    def __init__(self, build, folder, baud, gap):
        super().__init__(folder, [
            build / "tests" / "spindle_peer_serial_bank", "--pty", folder / "line", "--baud", str(baud),
            "--gap", str(round(gap * 1e6)), "--delay", str(round(DELAY * 1e6)), "--log", folder / "log"])

    @staticmethod
    def seconds(at):
        return int(at) / 1e9


class Driver(Line):
    """The simulated BLV driver. Its log counts milliseconds, which is enough for what takes hundreds."""

    LOGGED = r"^(\S+)Z client \d+ (->|<-) ([0-9A-F ]+)$"

    def __init__(self, program, folder, baud):
        with open(folder / "log", "wb") as log:
            super().__init__(folder, [
                program, "simulate", "orientalmotor-blv", "--pty", folder / "line", "--baud", str(baud), "-v"],
                stderr=log)

    @staticmethod
    def seconds(at):
        return datetime.datetime.fromisoformat(at).timestamp()


def needed_for(heard, baud, gap):
    """What the line itself takes for these frames: wire time, gaps and the driver's delays."""
    exchanges = sum(way == ">" for _, way, _ in heard)
    wire = sum(len(data) for _, _, data in heard) * CHARACTER_BITS / baud
    return exchanges, wire + exchanges * (gap + DELAY) + (exchanges - 1) * gap


def ask_driver(program, baud, gap, command, *arguments):
    """As read_all, of one command to the simulated driver; and how many requests it took."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        with Driver(program, folder, baud) as driver:
            began = time.monotonic()
            subprocess.run([program, command, driver.url, "--profile", "orientalmotor-blv", *arguments], check=True,
                           cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            whole = time.monotonic() - began
        heard = driver.heard()
    exchanges, needed = needed_for(heard, baud, gap)
    return heard[-1][0] - heard[0][0], whole, needed, exchanges


def read_all(program, build, baud, gap):
    """Seconds from the first byte of the first query to the last of the last answer, and of the whole
    program; and what the line needs for it."""
    with tempfile.TemporaryDirectory() as folder:
        with Bus(build, pathlib.Path(folder), baud, gap) as bus:
            began = time.monotonic()
            subprocess.run([program, "get", f"{bus.url}?unit=1&baud={baud}", "--profile", PROFILE, "operation.*"],
                           check=True, stdout=subprocess.DEVNULL)
            whole = time.monotonic() - began
        heard = bus.heard()
    exchanges, needed = needed_for(heard, baud, gap)
    if exchanges != REGISTERS // AT_ONCE:
        raise SystemExit(f"{exchanges} requests for {REGISTERS} registers")
    return heard[-1][0] - heard[0][0], whole, needed


def tell(what, baud, runs):
    ratios = [line / needed for line, _, needed, *_ in runs]
    print(f"{what} at {baud} baud: the line needs {runs[0][2] * 1e3:.1f} ms, "
          f"spindle took {statistics.median(run[0] for run in runs) * 1e3:.1f} ms "
          f"({statistics.median(ratios):.3f} x, at best {min(ratios):.3f} x), "
          f"start and end of the program included {statistics.median(run[1] for run in runs) * 1e3:.1f} ms", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("-n", type=int, default=15, help="how often (default 15)")
    options = parser.parse_args()
    build = options.build.resolve()
    program = build / "spindle"
    os.environ["SPINDLE_PROFILE_PATH"] = str(ROOT / "profiles")
    for baud, gap in ((9600, 0.0055), (115200, 0.0035)):
        runs = [read_all(program, build, baud, gap) for _ in range(options.n)]
        tell(f"{REGISTERS} registers", baud, runs)
        for what, *command in (("all operation data of the simulated BLV", "get", "operation.*"),
                               ("a whole backup of the simulated BLV", "backup", "-f", "backup.yaml")):
            runs = [ask_driver(program, baud, gap, *command) for _ in range(options.n)]
            tell(f"{what}, {runs[0][3]} requests,", baud, runs)
    with tempfile.TemporaryDirectory() as folder, Bus(build, pathlib.Path(folder), 9600, 0.0055) as bus:
        timeout = 0.050
        began = time.monotonic()
        subprocess.run([program, "scan", bus.url, "--profile", PROFILE, "--timeout", "50ms"], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        took = time.monotonic() - began
        allowed = 31 * (8 * CHARACTER_BITS / 9600 + 0.0055 + timeout)
        print(f"scan of 31 addresses with one driver at 9600 baud, --timeout 50ms: {took:.3f} s of {allowed:.3f} s "
              f"allowed")


if __name__ == "__main__":
    main()
