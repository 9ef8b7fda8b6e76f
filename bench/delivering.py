#!/usr/bin/python3
"""How fast `spindle forward` catches up: a store with many results, a real PostgreSQL and a real mosquitto of this
machine, `--once` to each of them in turns. Rows per second of real time, which the server needs, too, and per second of
spindle's own processor time; and the same rows sent by psql with COPY from a file of text, in the same round.

usage: delivering.py BUILD [ROWS [ROUNDS]]        such as: bench/delivering.py build/release 100000 3"""

import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]


def timed(command, environment):
    """Seconds that it took, and those of a processor that it used."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    ran = subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                         stderr=subprocess.PIPE, text=True)
    if ran.returncode:
        raise SystemExit(f"{command} ended with {ran.returncode}: {ran.stderr}")
    seconds, after = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return seconds, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    rows = int(sys.argv[2]) if len(sys.argv) > 2 else 100_000
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 3
    os.environ["SPINDLE"] = str(build / "spindle")
    sys.path.insert(0, str(ROOT / "tests" / "end_to_end"))
    import mqtt_broker
    import postgres_server

    with tempfile.TemporaryDirectory(prefix="spindle-bench-") as folder:
        folder = pathlib.Path(folder)
        environment = dict(os.environ, SPINDLE_PROFILE_PATH=str(ROOT / "profiles"), XDG_STATE_HOME=str(folder))
        subprocess.run([build / "tests" / "spindle_peer_report_store", folder / "events.db", str(rows)], check=True)

        def deliver(sink):
            return timed([build / "spindle", "forward", sink, "--store", folder / "events.db", "--once", "--quiet",
                          "--from", "2000-01-01", "--yes"], environment)

        seen = {"PostgreSQL": [], "psql COPY": [], "MQTT": []}
        with postgres_server.Postgres() as server, mqtt_broker.Broker() as broker:
            printed = subprocess.run([build / "spindle", "forward", server.url(), "--print-schema"], env=environment,
                                     check=True, stdout=subprocess.PIPE, text=True)
            for _ in range(rounds):
                server.ask("DROP DATABASE IF EXISTS plant")
                server.ask("CREATE DATABASE plant")
                server.feed(printed.stdout, database="plant")
                seen["PostgreSQL"].append(deliver(server.url(database="plant")))
                told = server.value("SELECT count(*) FROM spindle_event", database="plant")
                assert told == rows, f"{told} of {rows} rows arrived"
                psql = ["psql", "-X", "-q", "-h", "127.0.0.1", "-p", str(server.port), "-U", "postgres", "-d", "plant", "-c"]
                file = folder / "rows"
                timed([*psql, f"\\copy spindle_event TO '{file}'"], environment)
                server.ask("TRUNCATE spindle_event", database="plant")
                seen["psql COPY"].append(timed([*psql, f"\\copy spindle_event FROM '{file}'"], environment))
                seen["MQTT"].append(deliver(broker.url))
    for name, times in seen.items():
        real, own = (statistics.median(each) for each in zip(*times))
        print(f"{name:12} {rows / real:9,.0f} rows/s of real time, {rows / own:9,.0f} of own processor time "
              f"({', '.join(f'{one:.2f} s' for one, _ in times)})")


if __name__ == "__main__":
    main()
