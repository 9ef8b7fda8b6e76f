#!/usr/bin/env python3
"""Counts the instructions of short commands (valgrind --tool=callgrind), against what is recorded.

usage: instructions.py BUILD [--record]

Unlike times, counts hardly differ from run to run, so growth is seen on a busy machine as well. They
differ between compilers and libraries: record anew, and compare, on one machine. --record writes
instructions.txt."""

import argparse
import os
import pathlib
import re
import shlex
import signal
import subprocess
import sys
import tempfile

RECORD = pathlib.Path(__file__).with_name("instructions.txt")
# What is counted; URL stands for a simulated tool.
COMMANDS = (
    "get URL --profile doga-bm preset.1.target-torque preset.1.torque-limit",
    "get URL preset.1.target-torque preset.1.torque-limit",
    "get URL @holding:2 @holding:3",
    "get URL --profile doga-bm preset.* --json",
    "identify URL",
    "get sim:doga-bm preset.1.target-torque",
    "identify sim:doga-bm",
    "list --profile orientalmotor-blv",
    "--version",
    "--help",
    "__complete get --profile doga-bm URL preset.1.",
    "__complete set --profile doga-bm URL preset.1.mode=",
)


def count(program, arguments, folder, environment):
    counts = pathlib.Path(folder, "counts")
    # The simulated tool answers at once; valgrind does not.
    process = subprocess.run(
        ["valgrind", "--tool=callgrind", f"--callgrind-out-file={counts}", program, *arguments],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=environment, cwd=folder, check=False)
    collected = re.search(r"Collected : (\d+)", process.stderr)
    if process.returncode != 0 or collected is None:
        sys.exit(f"instructions: '{shlex.join(arguments)}' failed:\n{process.stderr}")
    return int(collected[1])


def recorded():
    if not RECORD.exists():
        return {}
    rows = (line.split(None, 1) for line in RECORD.read_text().splitlines() if not line.startswith("#"))
    return {command: int(number.replace(",", "")) for number, command in rows}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--record", action="store_true")
    options = parser.parse_args()
    program = str((options.build / "spindle").resolve())
    before, rows = recorded(), []
    with tempfile.TemporaryDirectory() as folder:
        environment = {"PATH": os.environ["PATH"], "HOME": folder}
        tool = subprocess.Popen(
            [program, "simulate", "doga-bm", "--listen", "tcp://127.0.0.1:0"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment)
        try:
            url = tool.stdout.readline().strip()
            for command in COMMANDS:
                number = count(program, command.replace("URL", url).split(), folder, environment)
                rows.append(f"{number:>11,}  {command}")
                ratio = f"  {number / before[command]:.3f} x" if command in before else ""
                print(rows[-1] + ratio, flush=True)
        finally:
            tool.send_signal(signal.SIGTERM)
            tool.wait()
    if options.record:
        version = subprocess.run(["g++", "-dumpfullversion"], capture_output=True, text=True, check=True).stdout.strip()
        head = f"# g++ {version}, release build: instructions of the whole process"
        RECORD.write_text("\n".join([head, *rows]) + "\n")


main()
