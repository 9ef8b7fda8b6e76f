"""What the end-to-end tests share: running the real binary, and recording what it says on the wire.

Everything that is started here is stopped here, by its own pid. Ports are chosen by the system, and
every wait is for a condition and has a deadline.

No test judges by bare seconds: a busy machine would break it. Upper limits are seconds of `paced()`, a
clock that goes as slowly as the machine is busy; `Finished.paced` is how long a run took by it. Real
seconds (`Finished.seconds`) are for lower limits only: nothing ever makes a pause shorter.
"""

import atexit
import contextlib
import dataclasses
import decimal
import fcntl
import functools
import hashlib
import json
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import termios
import threading
import time
import tty

import frames

ROOT = pathlib.Path(__file__).resolve().parents[2]
DEADLINE = 20.0  # for what must happen at all; never waited out when things go well
SOON = 6.0  # for what takes milliseconds where a wrong way takes ten seconds and more
POLL = 0.001

READ_HOLDING, READ_INPUT, WRITE_SINGLE, WRITE_MULTIPLE, REPORT_SERVER_ID = 0x03, 0x04, 0x06, 0x10, 0x11


def binary():
    path = os.environ.get("SPINDLE")
    if not path:
        raise SystemExit("SPINDLE must name the spindle binary to test")
    return os.path.abspath(path)


@functools.cache
def is_sanitized():
    """Whether the program is the one that is built with the address sanitizer."""
    return b"__asan_init" in pathlib.Path(binary()).read_bytes()


def sanitizer_options():
    return {name: os.environ[name] for name in os.environ if name.endswith("SAN_OPTIONS")}


class PacedClock:
    """Seconds that are as long as the machine makes them.

    A thread lets spindle say its version again and again, and sleeps in between. Of what it slept the clock goes
    on by the share that this work got of the time that it took: all of it where a process never has to wait, a
    tenth where the same work takes ten times as long as its processor time. So its second lasts as long as the
    machine needs for the same work beside the test. It is never ahead of real time.

    The test files that run at the same time have one clock, or keeping time would be most of what the
    machine does: one of them works, the others read what it shows. When it ends, another one goes on.
    """

    SLEEP = 0.02  # seconds between two readings of the clock
    SHARE = 5  # the work takes one part in so many of a processor, or less
    LONGEST = 1.0  # seconds between two pieces of work
    SLOWEST = 0.02  # what is measured of a short piece of work is no more certain than this

    def __init__(self):
        name = hashlib.sha256(binary().encode()).hexdigest()[:16]
        path = pathlib.Path(tempfile.gettempdir()) / f"spindle-paced-clock-{os.getuid()}-{name}"
        self._face = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        self._works = False
        self._began = self._shown()
        self._seconds = 0.0
        self._thread = threading.Thread(target=self._go, daemon=True)
        self._thread.start()

    def seconds(self):
        if not self._thread.is_alive():
            raise AssertionError("the paced clock stands still")
        return self._seconds

    def _shown(self):
        """Nanoseconds; what no clock has ever worked on shows 0."""
        return int.from_bytes(os.pread(self._face, 8, 0), "little")

    def _show(self, seconds):
        os.pwrite(self._face, (self._shown() + int(seconds * 1e9)).to_bytes(8, "little"), 0)

    def _may_work(self):
        if not self._works:
            with contextlib.suppress(BlockingIOError):
                fcntl.flock(self._face, fcntl.LOCK_EX | fcntl.LOCK_NB)
                self._works = True
        return self._works

    def _go(self):
        pause, pauses, pace = threading.Event(), 1, None
        while True:
            # Shown in small steps: what is read twice never differs by more than the time between.
            for _ in range(pauses):
                pause.wait(self.SLEEP)
                if pace is not None:
                    self._show(self.SLEEP * pace)
                self._seconds = (self._shown() - self._began) / 1e9
            pauses = 1
            if self._may_work():
                used, taken = self._work()
                now = min(1.0, max(self.SLOWEST, used / taken))
                pace = now if pace is None else (pace + now) / 2
                pauses = max(1, round(min(used * (self.SHARE - 1), self.LONGEST) / self.SLEEP))

    @staticmethod
    def _work():
        """The known piece of work; the seconds of a processor that it used, and those that it took."""
        silent = [(os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_RDWR, 0) for number in (0, 1, 2)]
        program, environment = binary(), sanitizer_options() | {"PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8"}
        began = time.monotonic()
        pid = os.posix_spawn(program, [program, "--version"], environment, file_actions=silent)
        _, status, used = os.wait4(pid, 0)
        taken = time.monotonic() - began
        if status != 0:
            raise AssertionError(f"spindle --version ended with {os.waitstatus_to_exitcode(status)}")
        return max(used.ru_utime + used.ru_stime, 0.0005), max(taken, 0.0005)


_clock = None


def paced():
    """Seconds of the paced clock, which begins to go when it is first asked. For every upper limit."""
    global _clock
    if _clock is None:
        _clock = PacedClock()
    return _clock.seconds()


def wait_until(condition, what, deadline=DEADLINE):
    """Returns the first true value of the condition. The deadline is in seconds of the paced clock."""
    end = paced() + deadline
    pause = threading.Event()
    while True:
        value = condition()
        if value:
            return value
        if paced() > end:
            raise AssertionError(f"waited {deadline:g} s in vain: {what}")
        pause.wait(POLL)


def wait_for_end(process, deadline=DEADLINE):
    """The status with which a process ends; the deadline is in seconds of the paced clock."""
    end = paced() + deadline
    while True:
        try:
            return process.wait(max(POLL, end - paced()))
        except subprocess.TimeoutExpired:
            if paced() >= end:
                raise


def completed(command, deadline=DEADLINE, capture_output=False, check=False, **how):
    """As subprocess.run: any program, run to its end. The deadline is in seconds of the paced clock."""
    if capture_output:
        how |= {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    end = paced() + deadline
    with subprocess.Popen(command, **how) as process:
        try:
            while True:
                try:
                    stdout, stderr = process.communicate(timeout=max(POLL, end - paced()))
                    break
                except subprocess.TimeoutExpired:
                    if paced() >= end:
                        raise
        except BaseException:
            process.kill()
            raise
    if check and process.returncode:
        raise AssertionError(f"{command} ended with {process.returncode}")
    return subprocess.CompletedProcess(command, process.returncode, stdout, stderr)


def is_readable(descriptor, deadline=DEADLINE):
    """Waits until there is something to read, or the end of it; false when the deadline came first."""
    end = paced() + deadline
    while not select.select([descriptor], [], [], max(POLL, end - paced()))[0]:
        if paced() >= end:
            return False
    return True


def quickest(attempt, limit, attempts=5):
    """What the first attempt returns that takes less than `limit` seconds of the paced clock. A machine that
    has more to do slows one attempt or another; a program that is too slow is so in all of them."""
    for _ in range(attempts):
        finished = attempt()
        if finished.paced < limit:
            return finished
    raise AssertionError(f"{attempts} attempts took {limit:g} s or more each, the last: {finished}")


def first_good(attempt, is_good, attempts=3):
    """What the first good attempt returns, or the last one: for what a busy machine may spoil at times."""
    for _ in range(attempts - 1):
        outcome = attempt()
        if is_good(outcome):
            return outcome
    return attempt()


class SerialEnd:
    """The far end of a serial port that the program opens by `url`, served by a thread as long as the with
    statement lasts. A derived class says in `_serve` what happens there, until `_ended`."""

    def __init__(self):
        self._line, terminal = os.openpty()
        tty.setraw(terminal)
        self.url = f"rtu://{os.ttyname(terminal)}?unit=1"
        os.close(terminal)
        self._ended = False
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended = True
        self._thread.join()
        os.close(self._line)

    @staticmethod
    def _arrived(line):
        """What came within a moment, perhaps nothing."""
        ready, _, _ = select.select([line], [], [], 0.02)
        try:
            return os.read(line, 256) if ready else b""
        except OSError:  # the program has not opened its end, or has closed it
            time.sleep(POLL)
            return b""


# --- the program ------------------------------------------------------------------------------


class Home:
    """An empty home folder, so that no tools file or profile of the machine plays a part, and no spindle of another
    test: the number of a pseudo terminal is given again at once, and one that had the line may not have ended yet."""

    def __init__(self):
        self.path = pathlib.Path(tempfile.mkdtemp(prefix="spindle-end-to-end-"))

    def environment(self, **extra):
        own = {
            "HOME": str(self.path),
            "XDG_RUNTIME_DIR": str(self.path),
            "PATH": "/usr/bin:/bin",
            "LC_ALL": "C.UTF-8",
            "SPINDLE_PROFILE_PATH": str(ROOT / "profiles"),
        }
        return {**sanitizer_options(), **own, **extra}

    def remove(self):
        shutil.rmtree(self.path, ignore_errors=True)


@functools.cache
def home():
    """The one of this test run; it is removed when the run ends."""
    made = Home()
    atexit.register(made.remove)
    return made


def parse_json(line):
    """One JSON line with exact numbers; a repeated key is an error."""

    def unique(pairs):
        keys = [key for key, _ in pairs]
        if len(set(keys)) != len(keys):
            raise ValueError(f"repeated key in {keys}")
        return dict(pairs)

    return json.loads(line, parse_float=decimal.Decimal, object_pairs_hook=unique)


@dataclasses.dataclass
class Finished:
    arguments: list
    status: int
    stdout: str
    stderr: str
    seconds: float  # of real time: for lower limits
    paced: float  # seconds of the paced clock: for upper limits

    def sentences(self):
        """What stands on standard error, each sentence in one piece, without what there is to try."""
        told = []
        for line in self.stderr.splitlines():
            if not line.startswith("  ") or not told:
                told.append(line)
            elif not line.startswith("  try: "):
                told[-1] += " " + line.strip()
        return told

    @property
    def said(self):
        """Standard error with each sentence on one line: where a line is broken depends on what stands in it."""
        return re.sub(r"\n  +", " ", self.stderr)

    def records(self, kind=None):
        """All of standard output as JSON lines, or those of one type."""
        if self.stdout and not self.stdout.endswith("\n"):
            raise ValueError(f"the last line is cut off: {self.stdout[-80:]!r}")
        records = [parse_json(line) for line in self.stdout.split("\n")[:-1]]
        return [record for record in records if kind is None or record["type"] == kind]

    def __str__(self):
        return (
            f"spindle {' '.join(self.arguments)}\n  status {self.status} after {self.seconds:.3f} s, paced {self.paced:.3f} s\n"
            f"  stdout: {self.stdout[-2000:]!r}\n  stderr: {self.stderr[-1000:]!r}"
        )


class Running:
    """A spindle that was started and is ended by its own pid when the block is left."""

    def __init__(self, *arguments, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, environment=None):
        self.arguments = [str(argument) for argument in arguments]
        self._mark()
        self.process = subprocess.Popen(
            [binary(), *self.arguments],
            stdin=stdin,
            stdout=stdout,
            stderr=subprocess.PIPE,
            cwd=home().path,
            env=home().environment(**(environment or {})),
        )
        self._unread = b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.process.stderr):
            if stream:
                stream.close()

    @property
    def pid(self):
        return self.process.pid

    def _mark(self):
        """What it took is counted from here."""
        self._began, self._began_paced = time.monotonic(), paced()

    def line(self, deadline=DEADLINE):
        """The next line of standard output, without its end."""
        end = paced() + deadline
        while b"\n" not in self._unread:
            if not is_readable(self.process.stdout, end - paced()):
                raise AssertionError(f"no line from spindle {' '.join(self.arguments)}")
            chunk = os.read(self.process.stdout.fileno(), 65536)
            if not chunk:
                raise AssertionError(f"spindle {' '.join(self.arguments)} ended: {self.process.stderr.read()!r}")
            self._unread += chunk
        line, self._unread = self._unread.split(b"\n", 1)
        return line.decode()

    def send_signal(self, number):
        self._mark()
        self.process.send_signal(number)

    def finish(self, timeout=DEADLINE):
        """Waits for the end; the seconds count from the start or from the last signal."""
        over = threading.Event()
        killer = threading.Thread(target=self._kill_after, args=(paced() + timeout, over), daemon=True)
        killer.start()
        try:
            os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT)
            seconds, own_seconds = time.monotonic() - self._began, paced() - self._began_paced
            stdout, stderr = self.process.communicate()
        finally:
            over.set()
            killer.join()
        return Finished(
            self.arguments,
            self.process.returncode,
            (self._unread + (stdout or b"")).decode(),
            stderr.decode(),
            seconds,
            own_seconds,
        )

    def _kill_after(self, end, over):
        while not over.wait(max(POLL, end - paced())):
            if paced() >= end:
                self.process.kill()
                return


def run(*arguments, stdin=subprocess.DEVNULL, timeout=DEADLINE, environment=None):
    """Runs spindle to its end. Output is taken through files, so that nothing can block."""
    arguments = [str(argument) for argument in arguments]
    with tempfile.TemporaryFile() as stdout, tempfile.TemporaryFile() as stderr:
        began, began_paced = time.monotonic(), paced()
        process = subprocess.Popen(
            [binary(), *arguments],
            stdin=stdin,
            stdout=stdout,
            stderr=stderr,
            cwd=home().path,
            env=home().environment(**(environment or {})),
        )
        try:
            status = wait_for_end(process, timeout)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            status = None
        seconds, own_seconds = time.monotonic() - began, paced() - began_paced
        texts = []
        for stream in (stdout, stderr):
            stream.seek(0)
            texts.append(stream.read().decode("utf-8", "backslashreplace"))
    return Finished(arguments, status, *texts, seconds, own_seconds)


def talk_on_terminal(arguments, hear, columns, environment):
    """Runs spindle on a terminal of its own to its end. `hear` gets all that was shown so far whenever there
    is more, and returns what is typed next, if anything. Returns what was shown, and the status."""
    program, folder, environment = binary(), home().path, home().environment(**environment)
    pid, terminal = pty.fork()
    if pid == 0:
        fcntl.ioctl(1, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        os.chdir(folder)
        os.execve(program, [program, *arguments], environment)
    shown = b""
    with contextlib.suppress(OSError):  # the end of the terminal
        while is_readable(terminal):
            shown += os.read(terminal, 65536)
            if typed := hear(shown):
                os.write(terminal, typed)
        os.kill(pid, signal.SIGKILL)  # it neither ended nor said anything more
    _, status = os.waitpid(pid, 0)
    os.close(terminal)
    return shown.decode(), os.waitstatus_to_exitcode(status)


def run_on_terminal(*arguments, columns=120, environment=None):
    """Runs spindle on a terminal of its own to its end; standard output is all that the terminal got."""
    arguments = [str(argument) for argument in arguments]
    began, began_paced = time.monotonic(), paced()
    shown, status = talk_on_terminal(arguments, lambda _: b"", columns, {"TERM": "xterm", **(environment or {})})
    return Finished(arguments, status, shown, "", time.monotonic() - began, paced() - began_paced)


def ask_on_terminal(arguments, question, answer, meanwhile=lambda: None):
    """The same; calls `meanwhile` at its question, and types the answer. Returns text and status."""
    answers = [answer]

    def hear(shown):
        if question not in shown or not answers:
            return b""
        meanwhile()
        return answers.pop()

    return talk_on_terminal([str(argument) for argument in arguments], hear, 80, {})


@contextlib.contextmanager
def simulator(profile="doga-bm", *flags, listen="tcp://127.0.0.1:0"):
    """A simulated tool on a free port; gives its URL."""
    with Running("simulate", profile, "--listen", listen, *flags) as running:
        yield running.line()
        running.send_signal(signal.SIGTERM)
        finished = running.finish()
        if finished.status != 143:
            raise AssertionError(f"the simulator did not end as asked: {finished}")


# --- the wire ---------------------------------------------------------------------------------


class ServedLine:
    """A program that serves a serial line on a pseudo terminal at `path`, or behind a port, as long as the with
    statement lasts. `command` says how it is started, by the path of the terminal and that of its log, which
    also has its standard error."""

    def __init__(self, command):
        self._folder = tempfile.TemporaryDirectory(prefix="spindle-line-")
        folder = pathlib.Path(self._folder.name)
        self.path, self._log = folder / "line", folder / "log"
        words = [str(word) for word in command(self.path, self._log)]
        with open(self._log, "wb") as log:
            self.process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log,
                                            text=True, env=home().environment(), cwd=home().path)
        self.url = self.process.stdout.readline().strip()
        if not self.url:
            raise AssertionError(f"{words[0]} does not serve: {self.told()}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.finish()
        self._folder.cleanup()

    def kill(self):
        self.process.kill()
        wait_for_end(self.process)

    def finish(self):
        if self.process.poll() is None:
            self.process.terminate()
            wait_for_end(self.process)
        self.process.stdout.close()

    def told(self):
        """All that it wrote so far."""
        return self._log.read_text()


class SimulatedLine(ServedLine):
    """Simulated serial devices of a profile, with what they heard."""

    def __init__(self, profile, *options, where="--pty"):
        super().__init__(lambda path, _: [
            binary(), "simulate", profile, *(["--pty", path] if where == "--pty" else ["--listen", where]), "-v",
            *options])

    def requests(self):
        """Whole requests in order, without their checksums."""
        found = re.findall(r" -> ([0-9A-Fa-f ]+)\n", self.told())  # a line that is half written is none yet
        return [frame[:-2] for text in found for frame in frames.rtu_requests(bytes.fromhex(text))]

    def writes(self):
        """The registers that were written, in order."""
        return [write for request in self.requests() for write in writes_of(request)]


@dataclasses.dataclass(frozen=True)
class Write:
    unit: int
    register: int
    value: int


def writes_of(request):
    """The registers that a serial request writes, in order."""
    unit, function, register = struct.unpack_from(">BBH", request)
    if function == WRITE_SINGLE:
        return [Write(unit, register, struct.unpack_from(">H", request, 4)[0])]
    if function != WRITE_MULTIPLE:
        return []
    values = struct.unpack_from(f">{request[6] // 2}H", request, 7)
    return [Write(unit, register + index, value) for index, value in enumerate(values)]


@dataclasses.dataclass(frozen=True)
class Request:
    """One Modbus TCP request, taken apart by the length of its header."""

    bytes: bytes

    @property
    def transaction(self):
        return struct.unpack_from(">H", self.bytes)[0]

    @property
    def protocol(self):
        return struct.unpack_from(">H", self.bytes, 2)[0]

    @property
    def unit(self):
        return self.bytes[6]

    @property
    def function(self):
        return self.bytes[7]

    @property
    def data(self):
        return self.bytes[8:]

    @property
    def words(self):
        """Address and count of a read; address and value of a write."""
        return struct.unpack(">HH", self.data) if len(self.data) == 4 else ()

    def __repr__(self):
        return f"<{self.bytes.hex(' ')}>"


def take_requests(buffer):
    """Removes complete frames from the front of a bytearray."""
    requests = []
    while len(buffer) >= 6:
        total = 6 + struct.unpack_from(">H", buffer, 4)[0]
        if total < 8 or total > 260:
            raise ValueError(f"not a Modbus TCP request: {bytes(buffer[:16]).hex(' ')}")
        if len(buffer) < total:
            break
        requests.append(Request(bytes(buffer[:total])))
        del buffer[:total]
    return requests


def host_and_port(url):
    host, port = url.removeprefix("tcp://").rsplit(":", 1)
    return host.strip("[]"), int(port)


class Port:
    """A port of this machine whose clients are served, each in a thread of its own, as long as the with
    statement lasts. A derived class says in `_serve` what a client gets."""

    def __init__(self, port=0):
        self._listening = socket.create_server(("127.0.0.1", port))
        self.port = self._listening.getsockname()[1]
        self.url = f"tcp://127.0.0.1:{self.port}"
        self._connections = []
        self._threads = []
        self._accepting = threading.Thread(target=self._accept, daemon=True)

    def __enter__(self):
        self._accepting.start()
        return self

    def __exit__(self, *_):
        # First no new ones: a client that connects anew at once would be served for ever.
        with contextlib.suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)
        if self._accepting.is_alive():
            self._accepting.join(DEADLINE)
        for opened in list(self._connections):
            with contextlib.suppress(OSError):
                opened.shutdown(socket.SHUT_RDWR)
        for thread in list(self._threads):
            thread.join(DEADLINE)
        for opened in [self._listening, *self._connections]:
            opened.close()

    def _begin(self, what, *arguments):
        thread = threading.Thread(target=what, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self._listening.accept()
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._connections.append(connection)
                self._meet(connection)

    def _meet(self, connection):
        """No other client is accepted meanwhile."""
        self._begin(self._serve, connection)


class Recorder(Port):
    """Passes one client's bytes to a server and back, and keeps every request that it sees."""

    def __init__(self, url):
        super().__init__()
        self._upstream = host_and_port(url)
        self.requests = []

    def lead_to(self, url):
        """Connections from now on lead to another server."""
        self._upstream = host_and_port(url)

    def count(self, *functions):
        return sum(request.function in functions for request in self.requests)

    def _serve(self, client):
        with contextlib.suppress(OSError):
            server = socket.create_connection(self._upstream)
            self._connections.append(server)
            self._begin(self._pump, server, client, False)
            self._pump(client, server, True)

    def _pump(self, source, sink, sees_requests):
        buffer = bytearray()
        with contextlib.suppress(OSError):
            while chunk := source.recv(65536):
                if sees_requests:
                    buffer += chunk
                    self.requests += take_requests(buffer)
                sink.sendall(chunk)
            sink.shutdown(socket.SHUT_WR)


TCP_ESTABLISHED, TCP_SYN_SENT = 1, 2


def tcp_sockets():
    """The kernel's IPv4 sockets: (local port, remote port, state, unread bytes)."""
    rows = []
    with open("/proc/net/tcp", encoding="ascii") as table:
        next(table)
        for line in table:
            _, local, remote, state, queues = line.split()[:5]
            ports = [int(end.split(":")[1], 16) for end in (local, remote)]
            rows.append((*ports, int(state, 16), int(queues.split(":")[1], 16)))
    return rows


def unread_bytes(local, remote):
    """What a process has not read yet of an open loopback connection; None when that is closed.

    Asks the kernel for one socket (sock_diag(7)), which is quick however many there are.
    """
    by_family, this_socket = 20, struct.pack("=II", 0xFFFFFFFF, 0xFFFFFFFF)
    host = socket.inet_aton("127.0.0.1").ljust(16, b"\0")
    body = struct.pack("=BBBBI", socket.AF_INET, socket.IPPROTO_TCP, 0, 0, 0xFFFFFFFF)
    body += struct.pack(">HH", local, remote) + host + host + struct.pack("=I", 0) + this_socket
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 4) as diagnosis:
        diagnosis.send(struct.pack("=IHHII", 16 + len(body), by_family, 1, 0, 0) + body)
        answer = diagnosis.recv(4096)
    kind = struct.unpack_from("=H", answer, 4)[0]
    if kind != by_family or answer[17] != TCP_ESTABLISHED:
        return None
    return struct.unpack_from("=I", answer, 72)[0]


@contextlib.contextmanager
def full_backlog():
    """A port that takes no further connection: its queue is full and no program accepts."""
    with contextlib.ExitStack() as stack:
        listening = stack.enter_context(socket.socket())
        listening.bind(("127.0.0.1", 0))
        listening.listen(0)
        port = listening.getsockname()[1]
        fillers = set()

        def is_full():
            waiting = {
                local
                for local, remote, state, _ in tcp_sockets()
                if remote == port and state == TCP_SYN_SENT
            }
            if waiting & fillers:
                return True
            filler = stack.enter_context(socket.socket())
            filler.setblocking(False)
            filler.connect_ex(("127.0.0.1", port))
            fillers.add(filler.getsockname()[1])
            return False

        wait_until(is_full, "the queue of a port fills up")

        def is_client_waiting():
            return any(
                remote == port and state == TCP_SYN_SENT and local not in fillers
                for local, remote, state, _ in tcp_sockets()
            )

        yield f"tcp://127.0.0.1:{port}", is_client_waiting


@contextlib.contextmanager
def refusing_port():
    """A port that is bound, so that no other program gets it, and on which none listens."""
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))
        yield f"tcp://127.0.0.1:{bound.getsockname()[1]}"


def small_pipe():
    """A pipe that holds so little that a long output has to wait for its reader."""
    reading, writing = os.pipe()
    fcntl.fcntl(writing, fcntl.F_SETPIPE_SZ, 4096)
    return reading, writing
