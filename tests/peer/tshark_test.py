"""Wireshark's dissectors judge every frame that spindle sends and that our simulated tool answers, and
the frames that spindle builds for serial lines."""

import unittest

import support
from support import PROGRAMS, Recorder, spindle

support.need_program("tshark", "text2pcap")

CLIENT_PORT = 20000
MODBUS_PORT = 502
RTU_PORT = 20001

# Everything that a dissector complains of.
COMPLAINT = "_ws.malformed || _ws.expert.severity >= warning"

FIELDS = {
    "to": "tcp.dstport",
    "transaction": "mbtcp.trans_id",
    "protocol": "mbtcp.prot_id",
    "unit": "mbtcp.unit_id",
    "function": "modbus.func_code",
    "first": "modbus.reference_num",
    "count": "modbus.word_cnt",
    "bytes": "modbus.byte_cnt",
    "data": "modbus.data",
    "exception": "modbus.exception_code",
}

RTU_FIELDS = {
    "unit": "mbrtu.unit_id",
    "crc": "mbrtu.crc16.status",
    "function": "modbus.func_code",
    "first": "modbus.reference_num",
    "count": "modbus.word_cnt",
    "bytes": "modbus.byte_cnt",
    "values": "modbus.regval_uint16",
    "data": "modbus.data",
    "sub_function": "modbus.diagnostic_code",
    "sent": "modbus.diagnostic.return_query_data.request",
    "returned": "modbus.diagnostic.return_query_data.echo",
    "exception": "modbus.exception_code",
}

# As through a serial device server: only then are requests told from answers of the same length.
RTU_OPTIONS = ["-o", "mbrtu.crc_verification:TRUE", "-o", f"mbrtu.tcp.port:{RTU_PORT}"]
CRC_GOOD = "1"


class Capture:
    """Bytes between a client and a server's port as a capture file, with made-up TCP below them."""

    def __init__(self, segments, port, options=()):
        folder = support.scratch_folder()
        self._file = folder / "frames.pcapng"
        self._options = list(options)
        text = folder / "frames.txt"
        text.write_text("".join(f"{direction}\n000000 {data.hex(' ')}\n"
                                for direction, data in segments), encoding="ascii")
        made = support.run("text2pcap", "-q", "-D", "-T", f"{port},{CLIENT_PORT}", text,
                           self._file)  # the ports are those of an inbound frame
        if made.status != 0:
            raise RuntimeError(str(made))

    def _tshark(self, *arguments):
        seen = support.run("tshark", "-r", self._file, *self._options, *arguments)
        if seen.status != 0:
            raise RuntimeError(str(seen))
        return seen.out

    def complaints(self):
        return self._tshark("-Y", COMPLAINT, "-V")

    def rows(self, fields):
        """One dictionary a frame; what a frame does not have is left out."""
        names = [word for field in fields.values() for word in ("-e", field)]
        table = self._tshark("-T", "fields", "-E", "separator=|", *names)
        return [{name: cell for name, cell in zip(fields, line.split("|")) if cell}
                for line in table.splitlines()]


def tcp_capture(segments):
    return Capture(segments, MODBUS_PORT)


def rtu_capture(segments):
    return Capture(segments, RTU_PORT, RTU_OPTIONS)


IDENTITY = {"function": "17"}


def read(first, count, function=3):
    return {"function": str(function), "first": str(first), "count": str(count)}


def write(register, value):
    return {"function": "6", "first": str(register), "data": f"{value:04x}"}


# What is typed behind the target, and the requests that it must take, in order.
SCENARIOS = {
    "identify": (["identify"], [], [IDENTITY]),
    "holding registers": (["get"], ["preset.1.target-torque", "preset.1.torque-limit"],
                          [IDENTITY, read(2, 2)]),
    "all presets": (["get"], ["preset.*"],
                    [IDENTITY, read(1, 100), read(101, 100), read(201, 25)]),
    # Never as one: its answer would look like a pushed event.
    "the last event": (["get"], ["event.*"],
                       [IDENTITY, read(3200, 13, function=4), read(3213, 1, function=4)]),
    "a write": (["set"], ["preset.2.speed=801"],
                [IDENTITY, read(23, 1), read(1023, 1), read(2023, 1), write(23, 801), read(23, 1)]),
    "auto output": (["do", "--yes"], ["auto-output=1"], [IDENTITY, write(4002, 1)]),
    "ping": (["ping"], ["-c", "3", "--interval", "1ms"], [IDENTITY] * 3),
}


class Dialogue:
    """What went over the wire while one command ran against the simulated tool."""

    def __init__(self, tool, command, arguments):
        recorder = Recorder(tool.port)
        self.outcome = spindle(*command, recorder.url, "--profile", "doga-bm", *arguments)
        capture = tcp_capture(recorder.finish())
        self.complaints = capture.complaints()
        rows = capture.rows(FIELDS)
        self.requests = [row for row in rows if row["to"] == str(MODBUS_PORT)]
        self.answers = [row for row in rows if row["to"] == str(CLIENT_PORT)]


class Tcp(support.PeerTest):
    """Both directions of spindle's own dialogue with the simulated tool."""

    maxDiff = None

    @classmethod
    def setUpClass(cls):
        with support.Server(*support.SIMULATOR) as tool:
            cls.dialogues = {name: Dialogue(tool, command, arguments)
                             for name, (command, arguments, _) in SCENARIOS.items()}
            cls.refused = Dialogue(tool, ["get"], ["@holding:564"])

    def each(self):
        for name, dialogue in self.dialogues.items():
            with self.subTest(name):
                self.assert_ends(dialogue.outcome, 0)
                yield name, dialogue

    def test_nothing_is_malformed(self):
        for _, dialogue in self.each():
            self.assertEqual(dialogue.complaints, "")

    def test_requests_are_what_they_should_be(self):
        for name, dialogue in self.each():
            expected = SCENARIOS[name][2]
            understood = [{key: row[key] for key in ("function", "first", "count", "data")
                           if key in row} for row in dialogue.requests]
            self.assertEqual(understood, expected)
            first, *others = [int(row["transaction"]) for row in dialogue.requests]
            self.assertGreaterEqual(first, 0x8000)
            after = {0xFFFF: 0x8000}
            for transaction in others:
                self.assertEqual(transaction, after.get(first, first + 1))
                first = transaction
            self.assertEqual({(row["protocol"], row["unit"]) for row in dialogue.requests},
                             {("0", "0")})

    def test_answers_belong_to_their_requests(self):
        for _, dialogue in self.each():
            self.assertEqual(len(dialogue.answers), len(dialogue.requests))
            for request, answer in zip(dialogue.requests, dialogue.answers):
                self.assertEqual(answer["transaction"], request["transaction"])
                self.assertEqual(answer["function"], request["function"])
                if "count" in request:
                    self.assertEqual(int(answer["bytes"]), 2 * int(request["count"]))
                if request["function"] == "6":
                    self.assertEqual((answer["first"], answer["data"]),
                                     (request["first"], request["data"]))

    def test_an_exception_is_one(self):
        self.assert_ends(self.refused.outcome, 6)
        self.assertEqual(self.refused.complaints, "")
        self.assertEqual(self.refused.requests[-1]["first"], "564")
        answer = self.refused.answers[-1]
        self.assertEqual((answer["function"], answer["exception"]), ("3", "2"))


# What the frames of spindle_peer_rtu_frames say, in their order.
RTU_MEANINGS = [
    read(2, 2),
    {"function": "3", "bytes": "4", "values": "271,1000"},
    read(3200, 14, function=4),
    {"function": "4", "bytes": "28", "values": ",".join(["7"] * 14)},
    read(0, 125),
    {"function": "3", "bytes": "250", "values": ",".join(["42330"] * 125)},
    write(4002, 1),
    write(4002, 1),
    {"function": "8", "sub_function": "0", "sent": "a537"},
    {"function": "8", "sub_function": "0", "returned": "a537"},
    {"function": "16", "first": "1152", "count": "2", "bytes": "4", "values": "271,1000"},
    {"function": "16", "first": "1152", "count": "2"},
    read(564, 5),
    {"function": "3", "exception": "2"},
    # With its byte count; the request of FC 17 is too short for this dissector.
    {"function": "17", "data": "0400010003"},
]


class Rtu(support.PeerTest):
    """Frames for serial lines, with their checksums."""

    maxDiff = None

    @classmethod
    def setUpClass(cls):
        lines = support.run(PROGRAMS / "spindle_peer_rtu_frames").out.splitlines()
        frames = [(line[0], bytes.fromhex(line[2:])) for line in lines]
        capture = rtu_capture(frames)
        cls.complaints = capture.complaints()
        cls.rows = capture.rows(RTU_FIELDS)

    def test_nothing_is_malformed(self):
        self.assertEqual(self.complaints, "")

    def test_every_checksum_is_good(self):
        self.assertEqual({(row.get("unit"), row.get("crc")) for row in self.rows},
                         {("3", CRC_GOOD)})

    def test_frames_mean_what_they_should(self):
        understood = [{key: value for key, value in row.items() if key not in ("unit", "crc")}
                      for row in self.rows]
        self.assertEqual(understood, RTU_MEANINGS)


class Judge(support.PeerTest):
    """The judge itself: what is wrong is found."""

    def test_a_frame_cut_short_is_found(self):
        request = bytes.fromhex("8001 0000 0004 00 03 0002")
        self.assertIn("Malformed", tcp_capture([("O", request)]).complaints())

    def test_a_wrong_checksum_is_found(self):
        frame = bytes.fromhex("03 03 00 02 00 02 64 28")
        [row] = rtu_capture([("O", frame)]).rows(RTU_FIELDS)
        self.assertNotEqual(row["crc"], CRC_GOOD)


class TraceTest(unittest.TestCase):
    """What --trace writes needs no options to be understood, on whatever port or line it was."""

    def packets(self, *arguments):
        path = support.scratch_folder() / "trace.pcapng"
        spindle(*arguments, "--trace", str(path))
        fields = ("_ws.col.Protocol", "_ws.col.Info", "frame.comment")
        options = [word for field in fields for word in ("-e", field)]
        seen = support.run("tshark", "-r", path, "-T", "fields", "-E", "separator=|", *options)
        complaints = support.run("tshark", "-r", path, "-Y", COMPLAINT)
        self.assertEqual(complaints.out, "")
        return [line.split("|") for line in seen.out.splitlines()]

    def test_tcp(self):
        packets = self.packets("get", "sim:doga-bm", "preset.1.target-torque")
        self.assertEqual({packet[0] for packet in packets}, {"Modbus/TCP"})
        told = [packet[1] for packet in packets]
        self.assertRegex(told[0], "Query: .* Report Slave ID")
        self.assertRegex(told[1], "Response: .* Report Slave ID")
        self.assertRegex(told[-1], "Response: .* Read Holding Registers")
        self.assertEqual({packet[2] for packet in packets}, {"sim:doga-bm"})

    def test_rtu(self):
        packets = self.packets("set", "sim:orientalmotor-blv", "operation.2.speed=900")
        self.assertEqual({packet[0] for packet in packets}, {"Modbus RTU"})
        told = " ".join(packet[1] for packet in packets)
        self.assertIn("Write Multiple Registers", told)
        self.assertEqual(told.count("Query"), told.count("Response"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
