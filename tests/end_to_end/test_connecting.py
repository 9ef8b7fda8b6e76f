"""Reaching tools: refused, unreachable, IPv6, names, several clients, several tools."""

import concurrent.futures
import contextlib
import socket
import unittest

import hostile_server
import support
from register_server import RegisterServer

TORQUE = "preset.1.target-torque"


def has_ipv6():
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET6) as probe:
        probe.bind(("::1", 0))
        return True
    return False


class UnreachableTest(unittest.TestCase):
    def check(self, url, words, *options):
        for command in (["identify", url], ["get", url, TORQUE], ["set", url, f"{TORQUE}=2.80"], ["ping", url]):
            with self.subTest(command[0]):
                finished = support.run(*command, *options, "--json")
                self.assertEqual(finished.status, 4, finished)
                errors = finished.records("error")
                self.assertEqual([(e["code"], e["exit_status"]) for e in errors], [("unreachable", 4)])
                self.assertIn(words, errors[0]["message"])
                self.assertEqual(len(finished.sentences()), 1, finished)

    def test_refused(self):
        with support.refusing_port() as url:
            self.check(url, "refused")

    def test_no_connection_in_time(self):
        with support.full_backlog() as (url, _):
            self.check(url, "200ms", "--connect-timeout", "200ms")

    def test_name_that_does_not_exist(self):
        # RFC 6761: no resolver ever resolves it.
        self.check("tcp://tool.invalid", "tool.invalid")


class Gateway(RegisterServer):
    """Units behind one address; for the others it says itself that it does not reach them."""

    def __init__(self, absent):
        super().__init__({})
        self.absent = absent  # exception of the units that are not there

    def _answer(self, request):
        if request.unit in (2, 7):
            return super()._answer(request)
        exception = self.absent[request.unit % len(self.absent)]
        return bytes([request.function | 0x80, exception])


class GatewayTest(unittest.TestCase):
    def test_units_that_it_does_not_reach_are_not_found(self):
        for absent in ((0x0A,), (0x0B,), (0x0A, 0x0B)):
            with self.subTest(absent), Gateway(absent) as gateway:
                finished = support.run("scan", gateway.url, "--units", "1-9", "--json")
                self.assertEqual(finished.status, 0, finished)
                self.assertEqual([r["unit"] for r in finished.records("unit")], [2, 7], finished)

    def test_units_that_refuse_are_found(self):
        with Gateway((0x02,)) as gateway:
            finished = support.run("scan", gateway.url, "--units", "1-3", "--json")
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual([r["unit"] for r in finished.records("unit")], [1, 2, 3], finished)


@unittest.skipUnless(has_ipv6(), "no IPv6 loopback on this machine")
class Ipv6Test(unittest.TestCase):
    def test_served_and_reached(self):
        with support.simulator("doga-bm", listen="tcp://[::1]:0") as url:
            self.assertRegex(url, r"^tcp://\[::1\]:\d+$")
            finished = support.run("get", url, TORQUE, "--json")
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual(finished.records("value")[0]["raw"], [271])

    def test_refused(self):
        with socket.socket(socket.AF_INET6) as bound:
            bound.bind(("::1", 0))
            finished = support.run("identify", f"tcp://[::1]:{bound.getsockname()[1]}")
        self.assertEqual(finished.status, 4, finished)
        self.assertIn("[::1]", finished.said)


class NameTest(unittest.TestCase):
    def test_localhost(self):
        with support.simulator() as url:
            _, port = support.host_and_port(url)
            finished = support.run("get", f"tcp://localhost:{port}", TORQUE, "--json")
            self.assertEqual(finished.status, 0, finished)

    def test_tool_from_a_tools_file(self):
        with support.simulator() as url:
            file = support.home().path / "station.yaml"
            file.write_text(
                f'tools:\n  station3: {{url: "{url}", profile: doga-bm, torque-unit: "N.m"}}\n'
                "groups:\n  line1: [station3]\n",
                "utf-8",
            )
            finished = support.run("get", "station3", TORQUE, "--tools", file, "--json")
            self.assertEqual(finished.status, 0, finished)
            record = finished.records("value")[0]
            self.assertEqual((record["target"], record["unit"]), ("station3", "N.m"))
            finished = support.run("identify", "@line1", environment={"SPINDLE_TOOLS": str(file)})
            self.assertEqual(finished.status, 0, finished)
            finished = support.run("identify", "sttaion3", "--tools", file)
            self.assertEqual(finished.status, 2, finished)
            self.assertIn("station3", finished.said)


class SeveralTest(unittest.TestCase):
    def test_several_clients_at_once(self):
        with support.simulator() as url, concurrent.futures.ThreadPoolExecutor(6) as pool:
            jobs = [
                pool.submit(support.run, "get", url, f"preset.{number}.target-torque", "--json")
                for number in range(1, 16)
            ]
            torques = [271, 120, 150, 180, 200, 220, 240, 300, 320, 350, 380, 400, 450, 500, 550]
            for job, torque in zip(jobs, torques):
                finished = job.result()
                self.assertEqual(finished.status, 0, finished)
                self.assertEqual(finished.records("value")[0]["raw"], [torque])

    def test_clients_of_one_tool_see_one_tool(self):
        with support.simulator() as url:
            self.assertEqual(support.run("set", url, f"{TORQUE}=2.80").status, 0)
            value = support.run("get", url, TORQUE, "--json").records("value")[0]
            self.assertEqual(value["raw"], [280])

    def test_a_client_that_keeps_its_connection_does_not_hold_up_others(self):
        with support.simulator() as url, socket.create_connection(support.host_and_port(url)) as idle:
            idle.sendall(b"\x80")  # the beginning of a request, and never more
            self.assertEqual(support.run("get", url, TORQUE).status, 0)

    def test_two_tools_side_by_side_with_one_dead(self):
        dead_row = {"on": ["identity"], "reply": []}
        with support.simulator() as url, hostile_server.HostileServer(dead_row) as dead:
            for targets in ([url, dead.url], [dead.url, url]):
                with self.subTest(targets):
                    finished = support.run("identify", *targets, "--timeout", "300ms", "--json")
                    self.assertEqual(finished.status, 9, finished)
                    told = {r["target"]: r["type"] for r in finished.records()}
                    self.assertEqual(told, {url: "identity", dead.url: "error"})

    def test_tools_are_asked_at_the_same_time(self):
        dead_row = {"on": ["identity"], "reply": []}
        with contextlib.ExitStack() as stack:
            dead = [stack.enter_context(hostile_server.HostileServer(dead_row)) for _ in range(5)]
            finished = support.run(
                "identify", *[server.url for server in dead], "--timeout", "2s", "--retries", "0", "--json"
            )
            self.assertEqual(finished.status, 5, finished)
            self.assertEqual(len(finished.records("error")), 5)
            self.assertLess(finished.paced, 2 + support.SOON, finished)


class GenerationTest(unittest.TestCase):
    """Firmware 4000 and later has another register map: only raw registers are read."""

    def setUp(self):
        self.url = self.enterContext(support.simulator("doga-bm", "--firmware", "4001"))
        self.recorder = self.enterContext(support.Recorder(self.url))

    def test_identify_says_so(self):
        finished = support.run("identify", self.recorder.url, "--json")
        self.assertEqual(finished.status, 0, finished)
        record = finished.records("identity")[0]
        self.assertEqual((record["firmware"], record["profile"]), (4001, None))
        self.assertEqual(record["profile_candidates"], [])
        self.assertTrue(any("4001" in note for note in record["notes"]), record)

    def test_names_are_refused(self):
        for profile in ([], ["--profile", "doga-bm"]):
            for command in (
                ["get", self.recorder.url, TORQUE],
                ["get", self.recorder.url, "@holding:2", TORQUE],
                ["set", self.recorder.url, f"{TORQUE}=2.80"],
                ["set", self.recorder.url, "@holding:2=280"],
                ["do", self.recorder.url, "auto-output=1"],
            ):
                with self.subTest(command, profile=profile):
                    finished = support.run(*command, *profile)
                    self.assertEqual((finished.status, finished.stdout), (8, ""), finished)
                    self.assertIn("4001", finished.said)
        functions = {request.function for request in self.recorder.requests}
        self.assertEqual(functions, {support.REPORT_SERVER_ID})

    def test_raw_registers_are_read(self):
        for profile in ([], ["--profile", "doga-bm"]):
            finished = support.run("get", self.recorder.url, "@holding:2", *profile, "--json")
            self.assertEqual(finished.status, 0, finished)
            self.assertEqual(finished.records("value")[0]["raw"], [271])


class SimulatorTest(unittest.TestCase):
    def test_port_in_use(self):
        with support.simulator() as url:
            finished = support.run("simulate", "doga-bm", "--listen", url)
            self.assertEqual((finished.status, finished.stdout), (4, ""), finished)
            self.assertIn(url.rsplit(":", 1)[1], finished.said)

    def test_identities_of_all_lengths(self):
        for size in (12, 13, 17):
            with self.subTest(size), support.simulator("doga-bm", "--identity-bytes", str(size)) as url:
                finished = support.run("identify", url, "--json")
                self.assertEqual(finished.status, 0, finished)
                record = finished.records("identity")[0]
                self.assertEqual(len(record["raw"]), 2 * size)
                self.assertIn("doga-bm", record["profile_candidates"])


if __name__ == "__main__":
    unittest.main()
