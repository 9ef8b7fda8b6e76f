"""The page spindle-plant(7), as a newcomer types it: from two simulated tools to a row in PostgreSQL, a message on
MQTT and a page in a browser. Ports are others, and packages are not installed.
"""

import os
import pathlib
import re
import subprocess
import tempfile
import unittest
import urllib.request

import mqtt_broker
import postgres_server
import support

ROOT = pathlib.Path(__file__).resolve().parents[2]
MANUAL = ROOT / "man" / "spindle-plant.7.in"
EXAMPLE = "/usr/share/doc/spindle/examples/plant.yaml"
# What is for a computer that the tests do not have to themselves.
NOT_HERE = ("apt-get ", "systemctl ", "spindle store sinks --store /var/lib/")


def typed(text):
    """The commands of the page, each with the lines that belong to it."""
    commands = []
    for block in re.findall(r"^\.Bd -literal\n(.*?)^\.Ed$", text, re.MULTILINE | re.DOTALL):
        for line in block.splitlines():
            line = line.replace("\\e", "\\")
            if line.startswith("# "):
                commands.append(line[2:])
            elif commands and not line.startswith("@"):
                commands[-1] += "\n" + line
    return commands


class Shell:
    """One bash, in which a command after the other is typed."""

    END = "--- the end of"

    def __init__(self, folder, environment):
        self.count = 0
        self.errors = open(folder / "errors", "w+b")
        self.process = subprocess.Popen(["bash"], cwd=folder, env=environment, stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=self.errors, bufsize=0)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.type('kill $(jobs -p) 2>/dev/null; wait')
        self.process.stdin.close()
        support.wait_for_end(self.process)
        self.process.stdout.close()
        self.errors.close()

    def type(self, command):
        """What it prints, and its status. What goes on in the background prints elsewhere."""
        self.count += 1
        end = f"{self.END} {self.count}"
        if command.rstrip().endswith("&"):
            command = command.rstrip()[:-1] + ">/dev/null &"
        self.process.stdin.write(f"{command}\necho \"{end} $?\"\n".encode())
        said = b""
        while not (found := re.search(rb"(?:^|\n)" + end.encode() + rb" (\d+)\n$", said)):
            chunk = os.read(self.process.stdout.fileno(), 65536)
            if not chunk:
                raise AssertionError(f"bash ended: {self.complaints()}")
            said += chunk
        return said[: found.start()].decode(), int(found.group(1))

    def complaints(self):
        self.errors.flush()
        return pathlib.Path(self.errors.name).read_text(errors="replace")


@unittest.skipUnless(postgres_server.programs() and mqtt_broker.PROGRAM, "needs PostgreSQL and mosquitto")
class Plant(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "bin").mkdir()
        (self.folder / "bin" / "spindle").symlink_to(os.environ["SPINDLE"])

    def here(self, command, ports):
        """The same command on this machine."""
        command = command.replace(f"cp {EXAMPLE} .", "true")
        if os.getuid() != 0:
            command = command.replace("runuser -u postgres -- ", "")
        for there, port in ports.items():
            command = command.replace(there, re.sub(r"\d+$", "", there) + str(port))
        command = command.replace("mosquitto_sub -h 127.0.0.1", f"mosquitto_sub -h 127.0.0.1 -p {self.broker.port}")
        return command.replace("spindle serve --store plant.db",
                               f"spindle serve --store plant.db --listen 127.0.0.1:{self.page}")

    def until(self, shell, command, wanted):
        said = ""

        def is_there():
            nonlocal said
            said, status = shell.type(command)
            return status == 0 and re.search(wanted, said)

        try:
            support.wait_until(is_there, f"'{command}' shows {wanted}")
        except AssertionError as trouble:
            raise AssertionError(f"{trouble}\n{said}\n{shell.complaints()}") from trouble
        return said

    def do(self, shell, command):
        """Types it, and waits for what a newcomer waits for."""
        if command.startswith("spindle results"):
            self.until(shell, command, r"station[12].*fastening")
        elif "SELECT" in command:
            rows = self.until(shell, command, r"station[12] +\| +\d+ \| fastening")
            self.assertRegex(rows, r"\| +2\.\d{4} \| N\.m")
        elif command.startswith("mosquitto_sub"):
            said, status = shell.type(command)
            self.assertEqual((status, len(said.splitlines())), (0, 5), shell.complaints())
            self.assertRegex(said, r'acme/line1/station[12]/result \{"schema":"spindle/1","type":"event"')
        else:
            said, status = shell.type(command)
            self.assertEqual(status, 0, f"{command}\n{said}\n{shell.complaints()}")

    def test_every_command_of_the_page(self):
        commands = [line for line in typed(MANUAL.read_text()) if not line.startswith(NOT_HERE)]
        self.assertGreater(len(commands), 12)
        with postgres_server.Postgres() as database, mqtt_broker.Broker() as self.broker:
            database.admit("host all spindle_writer 127.0.0.1/32 scram-sha-256")
            database.reload()
            tools = [postgres_server.free_port() for _ in range(2)]
            self.page = postgres_server.free_port()
            ports = {"127.0.0.1:5001": tools[0], "127.0.0.1:5002": tools[1]}
            text = (ROOT / "man" / "examples" / "plant.yaml").read_text()
            text = text.replace("127.0.0.1/plant", f"127.0.0.1:{database.port}/plant")
            text = text.replace("127.0.0.1/acme", f"127.0.0.1:{self.broker.port}/acme")
            (self.folder / "plant.yaml").write_text(self.here(text, ports))
            environment = {**os.environ, "PATH": f"{self.folder / 'bin'}:{os.environ['PATH']}:/usr/sbin:/sbin",
                           "PGHOST": str(database.folder), "PGPORT": str(database.port), "HOME": str(self.folder),
                           "PGUSER": "postgres", "XDG_RUNTIME_DIR": str(self.folder)}
            with Shell(self.folder, environment) as shell:
                for command in commands:
                    self.do(shell, self.here(command, ports))
                self.until_page_shows("station1", "station2")

    def until_page_shows(self, *names):
        def shows():
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{self.page}/", timeout=support.DEADLINE) as answer:
                    text = answer.read().decode()
            except OSError:
                return False
            return all(name in text for name in names)

        support.wait_until(shows, "the page shows the tools")


if __name__ == "__main__":
    unittest.main(verbosity=2)
