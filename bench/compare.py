#!/usr/bin/env python3
"""Runs two commands in turn and prints how long each took and how their times compare.

usage: compare.py [-n RUNS] 'COMMAND A' 'COMMAND B'

Times are of the whole process, start and end included. The machine's speed drifts, so each ratio A/B is
that of two neighbouring runs, and what counts is the median."""

import argparse
import os
import shlex
import shutil
import statistics
import sys
import time

WARM_UP = 3


class Command:
    def __init__(self, line):
        self.words = shlex.split(line)
        self.program = shutil.which(self.words[0])
        if self.program is None:
            sys.exit(f"compare: '{self.words[0]}' is not found")
        self.wall = []
        self.cpu = []

    def run(self):
        """One run with its output thrown away; wall and processor time in milliseconds."""
        silence = [(os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)]
        begin = time.perf_counter()
        process = os.posix_spawn(self.program, self.words, os.environ, file_actions=silence)
        _, status, usage = os.wait4(process, 0)
        wall = time.perf_counter() - begin
        if status != 0:
            sys.exit(f"compare: '{shlex.join(self.words)}' failed")
        return wall * 1e3, (usage.ru_utime + usage.ru_stime) * 1e3

    def measure(self):
        wall, cpu = self.run()
        self.wall.append(wall)
        self.cpu.append(cpu)


def line(name, values):
    print(f"{name:<14}{min(values):9.2f}{statistics.median(values):9.2f}{max(values):9.2f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-n", type=int, default=100, metavar="RUNS")
    parser.add_argument("a", metavar="'COMMAND A'")
    parser.add_argument("b", metavar="'COMMAND B'")
    options = parser.parse_args()
    a, b = Command(options.a), Command(options.b)
    for _ in range(WARM_UP):
        a.run()
        b.run()
    for _ in range(options.n):
        a.measure()
        b.measure()
    print(f"{options.n} runs each    min   median      max")
    for name, command in (("A", a), ("B", b)):
        line(f"{name} wall ms", command.wall)
        line(f"{name} cpu ms", command.cpu)
    line("A/B wall", [x / y for x, y in zip(a.wall, b.wall)])
    line("A/B cpu", [x / y for x, y in zip(a.cpu, b.cpu)])


main()
