"""Finding tools in the network: by multicast on the loopback interface, and by trying addresses."""

import contextlib
import json
import pathlib
import random
import signal
import socket
import struct
import sys
import tempfile
import threading
import unittest

import support

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "peer"))
import gen2_device  # noqa: E402  (written from the facts alone)

GROUP, PORT = "239.66.77.43", 53256
ASK, ANSWER = 0x0001, 0x0082
PROFILE = support.ROOT / "profiles" / "doga-gen2.yaml"

FRAMES = gen2_device.frames()
QUESTION = FRAMES["UDP scan request, to 239.66.77.43 port 53256"]
FOUND = next(frame for name, frame in FRAMES.items() if name.startswith("UDP scan answer"))


def answer(number, serial="2401190042", model=3216, address="192.168.1.100", port=5000,
           mac=bytes.fromhex("001122334455"), in_use=0, firmware=4002, kind=3):
    """The 40 bytes, as the facts say."""
    head = struct.pack(">HH", number, ANSWER)
    return (head + serial.encode("ascii").ljust(16, b"\0") + struct.pack(">I", model) + socket.inet_aton(address)
            + struct.pack(">H", port) + mac + struct.pack(">BHB", in_use, firmware, kind))


class Responder:
    """A tool, or several, on the loopback interface. `reply(number)` gives the datagrams for a question."""

    def __init__(self, reply, port=PORT):
        self.questions = []
        self._reply = reply
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.bind((GROUP, port))
        membership = socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1")
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        self._thread.join()
        self._socket.close()

    def _serve(self):
        self._socket.settimeout(0.05)
        while not self._ended.is_set():
            try:
                question, peer = self._socket.recvfrom(2048)
            except TimeoutError:
                continue
            self.questions.append((question, peer))
            number, _ = struct.unpack(">HH", question[:4])
            for datagram in self._reply(number):
                with contextlib.suppress(OSError):
                    self._socket.sendto(datagram, peer)


class DiscoverTest(unittest.TestCase):
    maxDiff = None

    def setUp(self):
        # A port of its own for each test, so that no other responder on this computer answers.
        self.port = random.randrange(20000, 30000)
        self.folder = tempfile.TemporaryDirectory(prefix="spindle-discover-")
        self.addCleanup(self.folder.cleanup)
        text = PROFILE.read_text("utf-8")
        own = text.replace(f"port: {PORT}", f"port: {self.port}")
        self.assertNotEqual(own, text)
        path = pathlib.Path(self.folder.name)
        (path / PROFILE.name).write_text(own, "utf-8")
        self.environment = {"SPINDLE_PROFILE_PATH": f"{path}:{PROFILE.parent}"}
        self.tools = path / "tools.yaml"

    def discover(self, *arguments, status=0, environment=None):
        finished = support.run("discover", *arguments, environment=environment or self.environment)
        self.assertEqual(finished.status, status, finished)
        return finished

    def found(self, reply, *arguments, status=0):
        """What is told of the tools behind `reply`."""
        with Responder(reply, self.port):
            finished = self.discover("--interface", "lo", "--for", "500ms", "--json", *arguments, status=status)
        return finished.records("discovered"), finished.records("summary")[0]


class Multicast(DiscoverTest):
    def test_the_frames_of_the_facts(self):
        environment = {"SPINDLE_PROFILE_PATH": str(PROFILE.parent)}
        with Responder(lambda number: [struct.pack(">H", number) + FOUND[2:]]) as responder:
            finished = self.discover("--interface", "127.0.0.1", "--for", "500ms", "--json", environment=environment)
        question, peer = responder.questions[0]
        self.assertEqual(question[2:], QUESTION[2:])
        self.assertEqual(len(question), 4)
        self.assertTrue(50000 <= peer[1] <= 59999, peer)
        tool = next(one for one in finished.records("discovered") if one["serial"] == "2401190042")
        self.assertEqual(
            {key: tool[key] for key in ("found_by", "endpoint", "address", "port", "unit", "model", "tool_type",
                                        "tool_type_code", "firmware", "mac", "in_use", "profile", "name", "from",
                                        "interface", "target")},
            {"found_by": "multicast", "endpoint": "tcp://192.168.1.100:5000", "address": "192.168.1.100", "port": 5000,
             "unit": None, "model": 3216, "tool_type": "BMT", "tool_type_code": 3, "firmware": 4002,
             "mac": "00:11:22:33:44:55", "in_use": False, "profile": None, "name": None, "from": "127.0.0.1",
             "interface": "lo", "target": "tcp://192.168.1.100:5000"})

    def test_each_tool_once(self):
        same = answer(0)
        tools, summary = self.found(lambda number: [
            struct.pack(">H", number) + same[2:],
            struct.pack(">H", number) + same[2:],
            answer(number, serial="2401190043", mac=bytes(6), address="192.168.1.101", in_use=1, kind=77)])
        self.assertEqual([(tool["serial"], tool["mac"], tool["in_use"], tool["tool_type"], tool["tool_type_code"])
                          for tool in tools],
                         [("2401190042", "00:11:22:33:44:55", False, "BMT", 3), ("2401190043", None, True, None, 77)])
        self.assertEqual((summary["found"], summary["strange"], summary["exit_status"]), (2, 0, 0))

    def test_what_says_nothing_of_its_address_is_where_it_answers_from(self):
        tools, _ = self.found(lambda number: [answer(number, address="0.0.0.0", port=0)])
        self.assertEqual((tools[0]["endpoint"], tools[0]["address"], tools[0]["port"]),
                         ("tcp://127.0.0.1", "127.0.0.1", None))

    def test_hostile_answers_are_none(self):
        def reply(number):
            good = answer(number)
            return [good[:length] for length in range(40)] + [
                good + b"\0", good + bytes(9000), bytes(40), b"\xff" * 40,
                struct.pack(">H", number ^ 0x4000) + good[2:],  # another question's
                struct.pack(">HH", number, 0x0083) + good[4:],
                struct.pack(">HH", number, 0x0081) + good[4:],
                good[:4] + b"\x1b[2J" + good[8:],  # no text
                good[:4] + "wörk".encode() + good[9:],
                b"M-SEARCH * HTTP/1.1\r\n\r\n"]
        tools, summary = self.found(reply, status=1)
        self.assertEqual(tools, [])
        self.assertEqual((summary["found"], summary["exit_status"]), (0, 1))
        self.assertGreater(summary["strange"], 40)

    def test_a_flood_ends_in_time_and_is_left_out(self):
        def reply(number):
            for tool in range(30000):
                yield answer(number, serial=f"{tool:010}")
        with Responder(reply, self.port):
            finished = self.discover("--interface", "lo", "--for", "300ms", "--json")
        tools = finished.records("discovered")
        self.assertLessEqual(len(tools), 4096)
        self.assertEqual(len({tool["serial"] for tool in tools}), len(tools))
        self.assertLess(finished.paced, support.SOON)

    def test_addresses_that_no_tool_can_have(self):
        tools, summary = self.found(lambda number: [
            answer(number, address="255.255.255.255"), answer(number, serial="2", address="239.1.1.1")], status=1)
        self.assertEqual((tools, summary["found"], summary["strange"]), ([], 0, 2))

    def test_a_question_that_was_lost_is_asked_again(self):
        with Responder(lambda number: [], self.port) as responder:
            self.discover("--interface", "lo", "--for", "1500ms", "--json", status=1)
        self.assertEqual(len(responder.questions), 2)

    def test_nothing_found_says_why_it_may_be(self):
        finished = self.discover("--interface", "lo", "--for", "200ms", status=1)
        self.assertEqual(finished.stdout, "")
        for word in ("asleep", "another network", "firewall", "multicast", "discover 192.168.10.0/24"):
            self.assertIn(word, finished.said)

    def test_an_interface_that_is_not_there(self):
        finished = self.discover("--interface", "nosuch0", status=2)
        self.assertIn("'nosuch0' is no network interface", finished.said)
        self.assertIn("lo (127.0.0.1)", finished.said)

    def test_control_c_ends_it(self):
        with Responder(lambda number: [answer(number)], self.port):
            with support.Running("discover", "--interface", "lo", "--for", "5min", "--json",
                                 environment=self.environment) as running:
                self.assertEqual(json.loads(running.line())["serial"], "2401190042")
                running.send_signal(signal.SIGINT)
                finished = running.finish()
        self.assertEqual(finished.status, 130, finished)
        self.assertEqual(finished.records("summary")[0]["found"], 1)


class Writing(DiscoverTest):
    BEFORE = ("# The tools of hall 3.\ntools:\n  # By the door.\n"
              "  door: {url: \"tcp://192.168.1.100:5000\", profile: doga-bmt}  # old\n"
              "groups:\n  all: [door]\n")

    @staticmethod
    def replies(number):
        return [answer(number), answer(number, serial="2401190043", address="192.168.1.101"),
                answer(number, serial="2401190043", address="192.168.1.102")]

    def write(self, *arguments, status=0):
        with Responder(self.replies, self.port):
            return self.discover("--interface", "lo", "--for", "500ms", "--write", "--tools", self.tools, *arguments,
                                 status=status)

    def test_what_is_new_is_added(self):
        self.tools.write_text(self.BEFORE, "utf-8")
        finished = self.write("--yes", "--json")
        self.assertEqual([tool["name"] for tool in finished.records("discovered")], ["door", None, None])
        self.assertEqual(finished.records("summary")[0]["added"], ["bmt-2401190043", "bmt-2401190043-2"])
        after = self.tools.read_text("utf-8")
        for line in self.BEFORE.splitlines():
            self.assertIn(line, after.splitlines())
        listed = support.run("tools", "--tools", self.tools, "--json", environment=self.environment)
        self.assertEqual([(tool["name"], tool["endpoint"]) for tool in listed.records("tool")],
                         [("door", "tcp://192.168.1.100:5000"), ("bmt-2401190043", "tcp://192.168.1.101:5000"),
                          ("bmt-2401190043-2", "tcp://192.168.1.102:5000")])
        again = self.write("--yes", "--json")
        self.assertEqual(again.records("summary")[0]["added"], [])
        self.assertEqual(self.tools.read_text("utf-8"), after)

    def test_a_tool_that_has_moved_is_told_and_not_added_again(self):
        self.tools.write_text('tools:\n  press: {url: "tcp://10.0.0.1", serial: "2401190043"}\n', "utf-8")
        finished = self.write("--yes", "--json")
        self.assertEqual(finished.records("summary")[0]["added"], ["bmt-2401190042"])
        self.assertIn("press of", finished.said)
        self.assertIn("has its serial number 2401190043, and tcp://10.0.0.1; mend the url there", finished.said)
        self.assertNotIn("192.168.1.101", self.tools.read_text("utf-8"))

    def test_a_flood_is_not_added(self):
        self.tools.write_text(self.BEFORE, "utf-8")

        def flood(number):
            for tool in range(300):
                yield answer(number, serial=f"{tool:010}", address=f"10.0.{tool // 250}.{tool % 250 + 1}")
        with Responder(flood, self.port):
            finished = self.discover("--interface", "lo", "--for", "2s", "--write", "--yes", "--tools", self.tools,
                                     status=2)
        self.assertIn("too many to be added at once", finished.said)
        self.assertEqual(self.tools.read_text("utf-8"), self.BEFORE)

    def test_without_a_yes_nothing_is_written(self):
        self.tools.write_text(self.BEFORE, "utf-8")
        finished = self.write(status=2)
        self.assertIn("bmt-2401190043 (tcp://192.168.1.101:5000)", finished.said)
        self.assertIn("--yes", finished.said)
        self.assertEqual(self.tools.read_text("utf-8"), self.BEFORE)


class Sweep(unittest.TestCase):
    """Addresses of the loopback network are tried."""

    maxDiff = None

    def sweep(self, *arguments, status=0):
        finished = support.run("discover", *arguments)
        self.assertEqual(finished.status, status, finished)
        return finished

    def test_a_tool_is_asked_who_it_is_and_nothing_else(self):
        device = gen2_device.Gen2Device()
        self.addCleanup(device.stop)
        finished = self.sweep("127.0.0.1/32", "--port", device.port, "--json")
        tool = finished.records("discovered")[0]
        self.assertEqual((tool["found_by"], tool["endpoint"], tool["serial"], tool["firmware"], tool["profile"],
                          tool["port"], tool["unit"], tool["mac"], tool["in_use"]),
                         ("sweep", f"tcp://127.0.0.1:{device.port}", "2401190042", 4002, "doga-gen2", device.port, None,
                          None, None))
        self.assertEqual([function for function, _ in device.requests], [0x11])

    def test_a_network_with_ports_that_are_no_modbus(self):
        device = gen2_device.Gen2Device()
        self.addCleanup(device.stop)
        with socket.create_server(("127.0.0.1", 0)) as silent:
            port = silent.getsockname()[1]
            finished = self.sweep("127.0.0.0/29", "--port", f"{device.port},{port}", "--rate", "1000", "--timeout",
                                  "300ms", "--json")
        self.assertEqual([tool["address"] for tool in finished.records("discovered")], ["127.0.0.1"])
        summary = finished.records("summary")[0]
        self.assertEqual((summary["found"], summary["asked"], summary["addresses"], summary["open"]), (1, 6, 6, 1))

    def test_the_rate_is_kept(self):
        finished = self.sweep("127.0.0.0/28", "--port", "1", "--rate", "10", "--json", status=1)
        self.assertGreater(finished.seconds, 1.2)  # 14 connections, the first at once

    def test_units_behind_a_gateway(self):
        device = gen2_device.Gen2Device()
        self.addCleanup(device.stop)
        finished = self.sweep("127.0.0.1", "--port", device.port, "--units", "1-3", "--json")
        self.assertEqual([(tool["unit"], tool["endpoint"]) for tool in finished.records("discovered")],
                         [(unit, f"tcp://127.0.0.1:{device.port}?unit={unit}") for unit in (1, 2, 3)])
        # All of them are one tool.
        with tempfile.TemporaryDirectory(prefix="spindle-discover-") as folder:
            tools = pathlib.Path(folder) / "tools.yaml"
            tools.write_text("tools: {}\n", "utf-8")
            added = self.sweep("127.0.0.1", "--port", device.port, "--units", "1-3", "--write", "--yes", "--tools",
                               tools, "--json")
        self.assertEqual(len(added.records("summary")[0]["added"]), 1, added)

    def test_what_is_too_much_or_no_network(self):
        for typed, why in (("10.0.0.0/8", "16777216 addresses are more than a sweep asks"),
                           ("192.168.10/24", "this is no IPv4 network"), ("192.168.10.0/33", "this is no IPv4 network"),
                           ("239.66.77.0/24", "no tool can have such an address"), ("station3", "this is no IPv4 network"),
                           ("fe80::/64", "this is no IPv4 network")):
            finished = self.sweep(typed, status=2)
            self.assertIn(why, finished.said)
        for arguments, why in ((("--port", "502"), "--port goes with SUBNET"),
                               (("127.0.0.1", "--for", "1s"), "--for goes without SUBNET"),
                               (("127.0.0.1", "--port", "0"), "'0' does not fit"),
                               (("127.0.0.1", "--rate", "0"), "'0' does not fit")):
            self.assertIn(why, self.sweep(*arguments, status=2).stderr)

    def test_control_c_ends_it_and_says_what_was_asked(self):
        with support.Running("discover", "127.0.0.0/16", "--port", "1", "--rate", "20") as running:
            threads = pathlib.Path(f"/proc/{running.pid}/task")
            support.wait_until(lambda: len(list(threads.iterdir())) > 1, "it tries several at once")
            running.send_signal(signal.SIGINT)
            finished = running.finish()
        self.assertEqual(finished.status, 130, finished)
        self.assertIn("not asked", finished.said)
        self.assertLess(finished.paced, support.SOON)


if __name__ == "__main__":
    unittest.main()
