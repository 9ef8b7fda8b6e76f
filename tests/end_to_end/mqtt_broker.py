"""A real mosquitto of Debian on a port of its own of this machine, listeners that know nothing of spindle, and
certificates made by openssl.
"""

import contextlib
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import tempfile
import threading

import paho.mqtt.client as paho
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

import support

PROGRAM = shutil.which("mosquitto", path="/usr/sbin:/usr/bin:/sbin:/bin")
RESULTS_AND_GAPS = ("result", "gap")


def free_port():
    """One that was free a moment ago."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def answers(port):
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=support.SOON):
        return True
    return False


class Broker:
    """One broker, as long as the with statement lasts. `lines` are those of its configuration."""

    def __init__(self, *lines, anonymous=True, listener=(), persistence=False):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="spindle-mosquitto-"))
        self.port = free_port()
        self.conf = self.folder / "mosquitto.conf"
        self.log = self.folder / "log"
        self.conf.write_text("\n".join([
            "user root",
            f"listener {self.port} 127.0.0.1",
            *listener,
            f"allow_anonymous {'true' if anonymous else 'false'}",
            f"persistence {'true' if persistence else 'false'}",
            f"persistence_location {self.folder}/",
            "max_queued_messages 0",
            "log_dest file " + str(self.log),
            *lines,
            "",
        ]))
        self.process = None

    @property
    def url(self):
        return f"mqtt://127.0.0.1:{self.port}/plant"

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.kill()
        shutil.rmtree(self.folder, ignore_errors=True)

    def start(self):
        with open(self.folder / "errors", "ab") as errors:
            self.process = subprocess.Popen([PROGRAM, "-c", str(self.conf)], stdin=subprocess.DEVNULL,
                                            stdout=errors, stderr=errors)
        support.wait_until(lambda: answers(self.port) or self.process.poll() is not None, "the broker listens")
        if self.process.poll() is not None:
            raise AssertionError(f"mosquitto ended: {self._said()}")

    def kill(self, number=signal.SIGKILL):
        if self.process and self.process.poll() is None:
            self.process.send_signal(number)
        if self.process:
            self.process.wait()

    def reload(self):
        """Reads access lists and passwords again."""
        self.process.send_signal(signal.SIGHUP)

    def _said(self):
        return (self.folder / "errors").read_text(errors="replace") + (
            self.log.read_text(errors="replace") if self.log.exists() else "")


class Listener:
    """What an independent client hears below the topic of a broker, with a session that outlives breaks."""

    def __init__(self, port, topic="plant/#", name="listener", **login):
        self._lock = threading.Lock()
        self.messages = []
        self._subscribed = threading.Event()
        self._client = paho.Client(client_id=name, protocol=paho.MQTTv5)
        if login:
            self._client.username_pw_set(**login)
        self._client.reconnect_delay_set(1, 1)
        self._client.on_connect = lambda client, *_: client.subscribe(topic, qos=1)
        self._client.on_subscribe = lambda *_: self._subscribed.set()
        self._client.on_message = self._hear
        lasting = Properties(PacketTypes.CONNECT)
        lasting.SessionExpiryInterval = 600
        self._client.connect("127.0.0.1", port, clean_start=False, properties=lasting)
        self._client.loop_start()

    def __enter__(self):
        support.wait_until(self._subscribed.is_set, "the listener is subscribed")
        return self

    def __exit__(self, *_):
        self._client.disconnect()
        self._client.loop_stop()

    def _hear(self, _client, _user, message):
        with self._lock:
            self.messages.append(message)

    def all(self, *whats):
        """The messages of topics that end in one of these words; none: all."""
        with self._lock:
            messages = list(self.messages)
        return [message for message in messages if not whats or message.topic.rsplit("/", 1)[-1] in whats]

    def keys(self, *whats):
        return [key_of(message) for message in self.all(*(whats or RESULTS_AND_GAPS))]


def key_of(message):
    return dict(getattr(message.properties, "UserProperty", ())).get("key")


def object_of(message):
    return json.loads(message.payload)


def retained(port, topic):
    """The payload that the broker keeps for a topic; None where it keeps none."""
    heard = threading.Event()
    payloads = []

    def hear(_client, _user, message):
        if message.retain:
            payloads.append(message.payload)
            heard.set()

    client = paho.Client(protocol=paho.MQTTv5)
    client.on_message = hear
    client.on_connect = lambda each, *_: each.subscribe(topic, qos=1)
    client.connect("127.0.0.1", port)
    client.loop_start()
    heard.wait(2)
    client.disconnect()
    client.loop_stop()
    return json.loads(payloads[0]) if payloads else None


def holes(messages):
    """The sequence numbers that a listener misses, told by each result's `previous`, by tool."""
    missing = {}
    last = {}
    for message in messages:
        told = object_of(message)
        tool = message.topic
        if tool in last and told["seq"] > last[tool] and told["previous"] != last[tool]:
            missing.setdefault(tool, []).append((last[tool], told["previous"]))
        last[tool] = max(last.get(tool, -1), told["seq"])
    return missing


class Certificates:
    """An authority, what it signed for a server at 127.0.0.1 and for a client, and another authority."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.authority = self._authority("authority")
        self.stranger = self._authority("stranger")
        self.server = self._signed("server", "IP:127.0.0.1,DNS:localhost", "serverAuth")
        self.elsewhere = self._signed("elsewhere", "DNS:other.example", "serverAuth")
        self.client = self._signed("client", "DNS:line1", "clientAuth")

    def _openssl(self, *arguments):
        support.completed(["openssl", *map(str, arguments)], capture_output=True, check=True, cwd=self.folder)

    def _authority(self, name):
        self._openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days",
                      "30", "-subj", f"/CN={name}", "-keyout", f"{name}.key", "-out", f"{name}.pem", "-addext",
                      "basicConstraints=critical,CA:TRUE")
        return self.folder / f"{name}.pem"

    def _signed(self, name, names, usage):
        self._openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-subj",
                      f"/CN={name}", "-keyout", f"{name}.key", "-out", f"{name}.csr")
        extensions = self.folder / f"{name}.ext"
        extensions.write_text(f"subjectAltName={names}\nextendedKeyUsage={usage}\n")
        self._openssl("x509", "-req", "-in", f"{name}.csr", "-CA", "authority.pem", "-CAkey", "authority.key",
                      "-CAcreateserial", "-days", "30", "-extfile", extensions, "-out", f"{name}.pem")
        os.chmod(self.folder / f"{name}.key", 0o600)
        return self.folder / f"{name}.pem", self.folder / f"{name}.key"
