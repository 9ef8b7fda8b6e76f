"""A real PostgreSQL of Debian in a temporary folder, on a port of its own of this machine, and psql.

It refuses to run as root, so all of it runs as the user postgres where the tests run as root.
"""

import contextlib
import os
import pathlib
import pwd
import shutil
import signal
import socket
import subprocess
import tempfile

import psycopg2

import support

PATIENCE = 120.0  # for a server that starts on a busy machine


def programs():
    """The folder of the newest server that is installed; None where there is none."""
    found = sorted(pathlib.Path("/usr/lib/postgresql").glob("*/bin/postgres"), key=lambda path: int(path.parts[4]))
    return found[-1].parent if found else None


def free_port():
    """One that was free a moment ago, outside of those that the system gives to clients."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Postgres:
    """One server, as long as the with statement lasts. Roles are trusted but for those that pg_hba names."""

    def __init__(self, **settings):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-postgres-"))
        self.data = self.folder / "data"
        self.log = self.folder / "log"
        self.port = free_port()
        self.settings = {"fsync": "on", "listen_addresses": "'127.0.0.1'", "port": self.port,
                         "unix_socket_directories": f"'{self.folder}'", "shared_buffers": "'16MB'",
                         "max_connections": 60, **settings}
        if os.getuid() == 0:
            owner = pwd.getpwnam("postgres")
            os.chown(self.folder, owner.pw_uid, owner.pw_gid)
            self._as_owner = ["runuser", "-u", "postgres", "--"]
        else:
            self._as_owner = []
        self.process = None

    def _run(self, program, *arguments):
        done = support.completed([*self._as_owner, str(programs() / program), *arguments], deadline=PATIENCE,
                                 capture_output=True, cwd=self.folder)
        if done.returncode:
            raise AssertionError(f"{program}: {done.stdout!r} {done.stderr!r} {self._logged()}")
        return done.stdout

    def _logged(self):
        return self.log.read_text(errors="replace")[-2000:] if self.log.exists() else ""

    def __enter__(self):
        self._run("initdb", "-D", str(self.data), "-U", "postgres", "-A", "trust", "-E", "UTF8", "--no-locale",
                  "--no-sync")
        for name, value in self.settings.items():
            self.set(name, value)
        self.start()
        return self

    def __exit__(self, *_):
        self.stop("immediate")
        shutil.rmtree(self.folder, ignore_errors=True)

    def set(self, name, value):
        with open(self.data / "postgresql.conf", "a", encoding="ascii") as file:
            file.write(f"{name} = {value}\n")

    def admit(self, *lines):
        """Puts lines in front of pg_hba.conf; the first one that fits counts."""
        path = self.data / "pg_hba.conf"
        path.write_text("\n".join(lines) + "\n" + path.read_text(encoding="utf-8"), encoding="utf-8")

    def start(self):
        self._run("pg_ctl", "-D", str(self.data), "-l", str(self.log), "-w", "-t", "100", "start")

    def stop(self, mode="fast"):
        with contextlib.suppress(AssertionError):
            self._run("pg_ctl", "-D", str(self.data), "-m", mode, "-w", "-t", "60", "stop")

    def reload(self):
        self._run("pg_ctl", "-D", str(self.data), "reload")

    def postmaster(self):
        return int((self.data / "postmaster.pid").read_text(encoding="ascii").split("\n", 1)[0])

    def kill(self):
        """kill -9 of the postmaster; its children see that and end by themselves."""
        pid = self.postmaster()
        os.kill(pid, signal.SIGKILL)
        support.wait_until(lambda: not self._lives(pid), "the postmaster is gone")
        support.wait_until(lambda: not self._children(), "its children are gone", PATIENCE)
        # Nothing may have waited for its end yet: the next one would take it for a server that runs.
        for left in (self.data / "postmaster.pid", *self.folder.glob(".s.PGSQL.*")):
            left.unlink(missing_ok=True)

    @staticmethod
    def _lives(pid):
        try:
            state = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[0]
        except OSError:
            return False
        return state != "Z"

    def _children(self):
        """Processes of this server, by the folder in which they work."""
        found = []
        for entry in pathlib.Path("/proc").iterdir():
            with contextlib.suppress(OSError):
                if entry.name.isdigit() and os.readlink(entry / "cwd") == str(self.data) and self._lives(int(entry.name)):
                    found.append(int(entry.name))
        return found

    def url(self, user="postgres", database="postgres", host="127.0.0.1", **options):
        more = "&".join(f"{key}={value}" for key, value in options.items())
        return f"postgresql://{user}@{host}:{self.port}/{database}" + (f"?{more}" if more else "")

    @contextlib.contextmanager
    def session(self, user="postgres", database="postgres"):
        connection = psycopg2.connect(host="127.0.0.1", port=self.port, user=user, dbname=database)
        connection.autocommit = True
        try:
            yield connection.cursor()
        finally:
            connection.close()

    def ask(self, statement, *values, user="postgres", database="postgres"):
        with self.session(user, database) as cursor:
            cursor.execute(statement, values or None)
            return cursor.fetchall() if cursor.description else []

    def value(self, statement, *values, **who):
        return self.ask(statement, *values, **who)[0][0]

    def feed(self, text, database="postgres", user="postgres"):
        """Through psql, as a user would."""
        done = support.completed(
            ["psql", "-h", "127.0.0.1", "-p", str(self.port), "-U", user, "-d", database, "-q", "-X", "-f", "-"],
            deadline=PATIENCE, capture_output=True, text=True, **support_input(text))
        if done.returncode:
            raise AssertionError(done.stderr)
        return done.stdout


def support_input(text):
    """An already filled file as standard input: psql reads it to its end."""
    file = tempfile.TemporaryFile()
    file.write(text.encode())
    file.seek(0)
    return {"stdin": file}


def make_certificates(folder, names=("localhost",)):
    """A certificate authority, a server's certificate for the names, and another authority, by openssl."""
    folder = pathlib.Path(folder)

    def openssl(*arguments):
        support.completed(["openssl", *map(str, arguments)], deadline=PATIENCE, check=True, cwd=folder,
                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    for authority in ("ca", "other"):
        openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
                "-subj", f"/CN={authority}", "-keyout", f"{authority}.key", "-out", f"{authority}.pem")
    openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-subj",
            f"/CN={names[0]}", "-keyout", "server.key", "-out", "server.csr")
    (folder / "names").write_text("subjectAltName=" + ",".join(f"DNS:{name}" for name in names), encoding="ascii")
    openssl("x509", "-req", "-in", "server.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-days", "2",
            "-extfile", "names", "-out", "server.pem")
    return folder
