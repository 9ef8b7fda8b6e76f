#!/usr/bin/env python3
"""What it costs to ask a tool through the program that owns it: `spindle ping` on two simulated tools over
loopback, one of them held by `spindle serve`. Both are asked in turns, so that the machine is the same for both;
the round trips are those that ping itself measures.

usage: asking.py SPINDLE [ROUNDS [PINGS]]"""

import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

PROFILE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "profiles")


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def main():
    spindle = os.path.abspath(sys.argv[1])
    rounds = int(sys.argv[2]) if len(sys.argv) > 2 else 20
    pings = int(sys.argv[3]) if len(sys.argv) > 3 else 100
    with tempfile.TemporaryDirectory(prefix="spindle-bench-") as folder:
        environment = dict(os.environ, SPINDLE_PROFILE_PATH=PROFILE, XDG_RUNTIME_DIR=folder)
        started = []

        def start(*arguments):
            process = subprocess.Popen([spindle, *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                       text=True, env=environment)
            started.append(process)
            return process

        def trips(url):
            ran = subprocess.run([spindle, "ping", url, "--profile", "doga-bm", "-c", str(pings), "--interval", "1ms",
                                  "--json"], stdout=subprocess.PIPE, text=True, env=environment, check=True)
            records = [json.loads(line) for line in ran.stdout.splitlines()]
            return [float(record["round_trip_ms"]) for record in records if record["type"] == "ping"]

        try:
            direct, held = (start("simulate", "doga-bm").stdout.readline().strip() for _ in range(2))
            start("serve", held, "--profile", "doga-bm")
            while not list(pathlib.Path(folder).glob("spindle/*.sock")):
                time.sleep(0.01)
            differences, all_direct, all_asked = [], [], []
            for _ in range(rounds):
                one, other = trips(direct), trips(held)
                differences.append(statistics.median(other) - statistics.median(one))
                all_direct += one
                all_asked += other
        finally:
            for process in started:
                process.terminate()
                process.wait()
    for name, times in (("directly", all_direct), ("through the owner", all_asked)):
        print(f"{name:18}  median {statistics.median(times):.3f} ms, 90 % {percentile(times, 0.9):.3f} ms")
    print(f"more, of {rounds} pairs: median {statistics.median(differences):.3f} ms, "
          f"from {min(differences):.3f} to {max(differences):.3f} ms")


if __name__ == "__main__":
    main()
