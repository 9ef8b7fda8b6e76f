"""Screwdrivers with firmware 4000 and later, against a device that was written from the facts alone."""

import math
import random
import re
import socket
import struct
import unittest

import gen2_device
import support
from gen2_device import Gen2Device, curve, event_block, f32, pushed
from support import SPINDLE, spindle

PASSWORD, UNIT, TARGET_1 = 3705, 3657, 2

UNASKED = (
    pushed(0x04, event_block(), transaction=1),
    pushed(0x65, event_block(number=1963)),
    curve(1, (0.0, 0.5, 1.5, 2.0625)),
    pushed(0x66, event_block(number=1964), (0.0, 0.5, 1.5, 2.0625), (0.0, 360.0, 1058.0, 1457.0)),
    curve(2, [math.nan] * 2000),
    pushed(0x04, event_block(number=1965, when=(0,) * 6)),
)


def exchange(port, request):
    """The answer of the device itself, as bytes."""
    with socket.create_connection(("127.0.0.1", port), support.PATIENCE) as connection:
        connection.sendall(request)
        header = connection.recv(6, socket.MSG_WAITALL)
        return header + connection.recv(struct.unpack(">H", header[4:])[0], socket.MSG_WAITALL)


class Gen2Test(support.PeerTest):
    def start(self, **facts):
        self.device = Gen2Device(**facts)
        self.addCleanup(self.device.stop)
        self.url = f"tcp://127.0.0.1:{self.device.port}"
        return self.device

    def setUp(self):
        self.start()

    def tearDown(self):
        # Whatever was asked for: nothing that no document names was written, and no read looked like an event.
        self.assertEqual(self.device.strange, [])
        self.assertEqual(self.device.event_reads, [])

    def ask(self, command, *arguments, status=0):
        outcome = spindle(command, self.url, *arguments)
        self.assert_ends(outcome, status)
        return outcome

    def values(self, *names):
        return {value["name"]: value["value"] for value in self.ask("get", *names).of_type("value")}

    def written(self):
        with self.device.lock:
            return list(self.device.writes)


class TheDevice(Gen2Test):
    """It sends the very frames of the file, so what is shown below is shown of these."""

    def same(self, answer, wanted):
        self.assertEqual(answer[:6], wanted[:6])
        self.assertEqual(answer[7:], wanted[7:])  # the unit is 1 in answers

    def test_answers(self):
        frames = gen2_device.frames()
        names = list(frames)
        for name in ("FC 17 request", "FC 04 identity block, address 1 x 54", "FC 03 preset 1, address 1 x 30",
                     "FC 16 target torque of preset 1 = 2.5"):
            self.same(exchange(self.device.port, frames[name]), frames[names[names.index(name) + 1]])

    def test_status(self):
        frames = gen2_device.frames()
        wanted = next(frame for name, frame in frames.items() if name.startswith("its answer: 1.25, 300 rpm"))
        self.same(exchange(self.device.port, frames["FC 04 live status, address 100 x 19"]), wanted)

    def test_commands_are_echoed_and_direction_is_not_a_deed(self):
        frames = gen2_device.frames()
        for name in ("auto output on", "run", "direction loosen", "stop"):
            self.same(exchange(self.device.port, frames[name]), frames[name])
        self.assertEqual(self.device.number(5001), 0)  # it ran, and runs down

    def test_direction_behind_a_standstill(self):
        frames = gen2_device.frames()
        exchange(self.device.port, frames["direction loosen"])
        self.same(exchange(self.device.port, frames["direction read-back"]), frames["its answer (loosen)"])

    def test_pushed_frames(self):
        frames = gen2_device.frames()
        block = event_block()
        samples = (0.0, 0.5, 1.5, 2.0625), (0.0, 360.0, 1058.0, 1457.0)
        self.assertEqual(pushed(0x04, block, transaction=1), frames["pushed event as FC 04, byte count D6"])
        self.assertEqual(pushed(0x65, block), frames["same event as FC 65"])
        self.assertEqual(pushed(0x66, block, *samples), frames["event with both curves, FC 66"])
        for channel in (1, 2):
            self.assertEqual(curve(channel, samples[channel - 1]), frames[f"curve channel {channel}, 4 samples, FC 64"])

    def test_refuses(self):
        self.assertEqual(exchange(self.device.port, bytes.fromhex("8001 0000 0006 00 06 0001 0002"))[7:],
                         bytes.fromhex("86 0E"))
        self.assertEqual(exchange(self.device.port, bytes.fromhex("8001 0000 0006 00 03 0FA0 0001"))[7:],
                         bytes.fromhex("83 02"))
        self.assertEqual(exchange(self.device.port, bytes.fromhex("8001 0000 0006 00 01 0000 0001"))[7:],
                         bytes.fromhex("81 01"))


class Identity(Gen2Test):
    def identity(self, status=0):
        return self.ask("identify", status=status).of_type("identity")[0]

    def test_says_what_it_is(self):
        told = self.identity()
        self.assertEqual((told["profile"], told["tool_model"], told["serial"], told["firmware"],
                          told["firmware_version"], told["total_fastenings"]),
                         ("doga-gen2", "BMT3216", "2401190042", 4002, "4.0.2", 12345))

    def test_all_products_of_the_profile(self):
        for product, model in ((10, "BM3224"), (19, "BMT3216"), (29, "BMT4032")):
            with self.subTest(product=product):
                self.start(product=product, model=model, serial=f"2401{product}0042")
                told = self.identity()
                self.assertEqual((told["profile"], told["tool_model"]), ("doga-gen2", model))

    def test_another_serial_in_registers(self):
        self.start(serial="2401190043")
        told = self.identity()
        self.assertEqual(told["serial"], "2401190043")
        self.assertIn("2401190042 by function 17", "; ".join(told["notes"]))

    def test_another_product(self):
        self.start(product=15, model="MDT")
        outcome = self.ask("get", "status.ready", status=8)
        self.assertEqual(outcome.of_type("value"), [])

    def test_older_firmware_has_other_registers(self):
        self.start(firmware=2103)
        outcome = self.ask("get", "status.ready", "--profile", "doga-gen2", status=8)
        self.assertIn("from 4000", outcome.out + outcome.err)

    def test_warns_of_the_first_two(self):
        for firmware, warns in ((4000, True), (4001, True), (4002, False)):
            with self.subTest(firmware=firmware):
                self.start(firmware=firmware)
                outcome = self.ask("set", "preset.1.speed=421")
                self.assertEqual("nothing public says" in outcome.err, warns)
                self.assertEqual(self.device.number(11), 421)


class Reading(Gen2Test):
    def test_status(self):
        values = self.values("status.*")
        self.assertEqual({name: values[f"status.{name}"] for name in
                          ("torque", "speed", "current", "preset", "ready", "running", "screws-remaining",
                           "temperature", "lock")},
                         {"torque": 1.25, "speed": 300, "current": 2.5, "preset": 5, "ready": 1, "running": 0,
                          "screws-remaining": 3, "temperature": 35.5, "lock": 0})

    def test_the_unit_is_what_the_tool_says(self):
        for number, unit in enumerate(("kgf.cm", "kgf.m", "N.m", "cN.m", "lbf.in", "ozf.in", "lbf.ft")):
            self.device.put(UNIT, number)
            told = self.ask("get", "preset.1.target-torque").of_type("value")[0]
            self.assertEqual((told["value"], told["unit"]), (2.5, unit))

    def test_the_last_preset_and_the_last_setting(self):
        self.device.put(901 + 1, *f32(7.75))
        self.device.put(3743, 1)
        self.assertEqual(self.values("preset.31.target-torque", "control.fl-switch-type"),
                         {"preset.31.target-torque": 7.75, "control.fl-switch-type": 1})

    def test_no_number(self):
        self.device.put(TARGET_1, *f32(math.nan))
        told = self.ask("get", "preset.1.target-torque").of_type("value")[0]
        self.assertEqual((told["value"], told["label"]), (None, "NaN"))

    def test_no_read_looks_like_an_event(self):
        """107 input registers are asked for, by a raw range and with and without a profile."""
        for url, profile in ((self.url + "?unit=1", ()), (self.url, ("--profile", "doga-gen2"))):
            outcome = spindle("get", url, "@input:0..106", *profile)
            self.assertIn(len(outcome.of_type("value")), range(90, 108))

    def test_events_between_the_answers(self):
        """Each answer has something unasked in front of it, whose shape is almost that of an answer."""
        self.device.noise = lambda number: UNASKED[number % len(UNASKED)] * (number % 3)
        names = ("preset.31.speed", "status.*", "control.torque-unit", "info.driver-model", "advanced.31.p18")
        wanted = self.values(*names)
        self.device.noise = None
        self.assertEqual(self.values(*names), wanted)

    def test_in_pieces(self):
        dice = random.Random(14)
        self.device.noise = lambda number: UNASKED[number % 4]
        self.device.pieces = (97, lambda: dice.uniform(0.010, 0.030))
        self.assertEqual(self.values("preset.2.speed", "status.speed"), {"preset.2.speed": 420, "status.speed": 300})


class Writing(Gen2Test):
    def test_a_torque_is_one_request(self):
        told = self.ask("set", "preset.1.target-torque=2.75").of_type("write")[0]
        self.assertEqual((told["old"], told["new"], told["unit"], told["result"]), (2.5, 2.75, "N.m", "written"))
        self.assertEqual(self.written(), [(TARGET_1, f32(2.75))])

    def test_a_typed_unit_is_converted_to_that_of_the_tool(self):
        self.device.put(UNIT, 3)
        self.ask("set", "preset.1.target-torque=2.75N.m")
        self.assertEqual(self.device.value(TARGET_1), 275.0)

    def test_no_unit_no_conversion(self):
        self.device.put(UNIT, 9)
        self.ask("set", "preset.1.target-torque=2.75N.m", status=2)
        self.assertEqual(self.written(), [])

    def test_the_tools_file_says_another_unit(self):
        folder = support.scratch_folder()
        tools = folder / "tools.yaml"
        tools.write_text(f"tools:\n  a: {{url: '{self.url}', torque-unit: kgf.cm}}\n", encoding="utf-8")
        tools.chmod(0o600)
        outcome = spindle("set", "a", "preset.1.target-torque=2.75", "--tools", tools)
        self.assertNotEqual(outcome.status, 0, outcome)
        self.assertIn("N.m", outcome.err + outcome.out)
        self.assertEqual(self.written(), [])

    def test_refused_by_the_tool(self):
        self.device.put(3675, 0)
        gen2_device.LIMITS[3662] = (0, 100)
        self.addCleanup(gen2_device.LIMITS.pop, 3662)
        outcome = self.ask("set", "control.torque-holding-time=101", status=6)
        self.assertIn("0E", outcome.err + outcome.out)
        self.assertEqual(self.device.number(3662), 0)

    def test_nothing_that_no_document_names(self):
        """Raw writes included, and whatever is said of the profile."""
        for register in (0, 23, 931, 999, 1037, 2395, 3652, 3690, 3744, 4002, 4003, 4100, 4500, 5002, 5351):
            for profile in ((), ("--profile", "doga-gen2"), ("--profile", "doga-bmt")):
                with self.subTest(register=register, profile=profile):
                    outcome = spindle("set", self.url, f"@holding:{register}=1", "--raw", "--yes", *profile)
                    self.assertNotEqual(outcome.status, 0, outcome)
        self.assertEqual(self.written(), [])

    def test_a_profile_that_no_tool_can_prove_opens_nothing(self):
        for profile in ("kolver-kducer", "huanyang-fc01", "eastron-sdm72d-m"):
            for assignments in (["@holding:5000=1"], ["@holding:3652=1"], ["@holding:5000=1", "@holding:12=1"]):
                with self.subTest(profile=profile, assignments=assignments):
                    outcome = spindle("set", f"{self.url}?unit=1", *assignments, "--raw", "--yes", "--profile", profile)
                    self.assert_ends(outcome, 8)
                    self.assertIn("it says that it is of profile doga-gen2", outcome.err)
        mixed = spindle("set", f"{self.url}?unit=1", "program=1", "@holding:5000=1", "--raw", "--yes",
                        "--profile", "kolver-kducer")
        self.assertNotEqual(mixed.status, 0, mixed)
        self.assertEqual(self.written(), [])

    def test_half_of_a_value_is_not_written(self):
        for register in (TARGET_1, TARGET_1 + 1):
            self.ask("set", f"@holding:{register}=1", "--raw", "--yes", status=2)
        self.assertEqual(self.written(), [])

    def test_the_commands_are_no_settings(self):
        for register in (5000, 5001, 5350):
            outcome = spindle("set", self.url, f"@holding:{register}=1", "--raw", "--yes")
            self.assertNotEqual(outcome.status, 0, outcome)
        self.assertEqual(self.written(), [])

    def test_part_of_a_documented_value_beside_an_undocumented_one(self):
        outcome = spindle("set", self.url, "@holding:22/f32=1", "--raw", "--yes")
        self.assertNotEqual(outcome.status, 0, outcome)
        self.assertEqual(self.written(), [])

    def test_older_maps_are_not_written_to_it(self):
        self.ask("set", "preset.1.target-torque=2.5", "--profile", "doga-bmt", "--yes", status=8)
        self.assertEqual(self.written(), [])

    def test_stop(self):
        self.ask("remote-stop")
        self.assertEqual(self.written(), [(5000, [0])])


class Guarded(Gen2Test):
    def test_alone(self):
        outcome = self.ask("set", "control.torque-unit=0", "preset.1.speed=400", "--yes", status=2)
        self.assertIn("written alone", outcome.err + outcome.out)
        self.assertEqual(self.written(), [])

    def test_by_its_number_too(self):
        self.ask("set", f"@holding:{UNIT}=0", "@holding:11=400", "--yes", status=2)
        self.assertEqual(self.written(), [])

    def test_asked(self):
        outcome = spindle("set", self.url, "control.torque-unit=0")
        self.assertNotEqual(outcome.status, 0, outcome)
        self.assertEqual(self.written(), [])

    def test_no_question_where_nothing_changes(self):
        self.ask("set", "control.torque-unit=2")
        self.assertEqual(self.written(), [])

    def test_tells_what_changed_along(self):
        self.device.rescales = True
        outcome = self.ask("set", "control.torque-unit=cN.m", "--yes")
        told = {one["name"]: one for one in outcome.of_type("write")}
        self.assertEqual(told["control.torque-unit"]["result"], "written")
        self.assertEqual([told["preset.31.target-torque"][key] for key in ("old", "new", "unit", "result")],
                         [2.5, 250, "cN.m", "changed-along"])
        self.assertEqual(len(told), 1 + 2 * 31)
        self.assertEqual(self.written(), [(UNIT, [3])])

    def test_tells_that_numbers_mean_something_else(self):
        outcome = self.ask("set", "control.torque-unit=kgf.cm", "--yes")
        self.assertEqual(len(outcome.of_type("write")), 1)
        self.assertIn("now in kgf.cm, not in N.m", outcome.err)


class Secret(Gen2Test):
    def test_is_not_shown(self):
        for name in ("control.password", f"@holding:{PASSWORD}", "control.*"):
            outcome = self.ask("get", name, "--profile", "doga-gen2")
            self.assertNotIn("4711", outcome.out + outcome.err)
        told = self.ask("get", "control.password").of_type("value")[0]
        self.assertEqual((told["value"], told["raw"], told["secret"]), (None, [], True))

    def test_is_shown_where_it_is_asked_for(self):
        told = self.ask("get", "control.password", "--include-secrets").of_type("value")[0]
        self.assertEqual(told["value"], 4711)

    def test_is_not_shown_when_it_is_set(self):
        outcome = self.ask("set", "control.password=1234", "--yes")
        self.assertEqual(self.device.number(PASSWORD), 1234)
        self.assertNotIn("4711", outcome.out + outcome.err)
        self.assertNotIn("1234", outcome.out + outcome.err)

    def test_no_sum_of_it_is_shown(self):
        for step in ("control.password+=1", "control.password=+5%", f"@holding:{PASSWORD}+=1"):
            outcome = self.ask("set", step, "--raw", "--dry-run", status=2)
            for number in ("4711", "4712", "4946"):
                self.assertNotIn(number, outcome.out + outcome.err)

    def test_is_not_dumped(self):
        span = ("--registers", f"{PASSWORD - 5}..{PASSWORD + 5}")
        for profile in ((), ("--profile", "doga-bm"), ("--profile", "doga-gen2"), ("--profile", "kolver-kducer")):
            for more in ((), ("--verbose",)):
                with self.subTest(profile=profile, more=more):
                    outcome = support.run(SPINDLE, "dump", f"{self.url}?unit=1", "-", *span, *profile, *more)
                    self.assert_ends(outcome, 0)
                    self.assertIn(f"from: {PASSWORD + 1}", outcome.out)
                    self.assertNotIn("4711", outcome.out + outcome.err)
                    self.assertNotIn("12 67", outcome.err)
        scanned = support.run(SPINDLE, "scan", f"{self.url}?unit=1", *span, "--verbose")
        self.assert_ends(scanned, 0)
        self.assertNotIn("4711", scanned.out + scanned.err)
        self.assertNotIn("12 67", scanned.err)
        asked = support.run(SPINDLE, "dump", f"{self.url}?unit=1", "-", *span, "--include-secrets")
        self.assertIn("4711", asked.out)

    def test_is_not_watched(self):
        self.ask("watch", "control.password", "--count", "1", status=2)


class Backups(Gen2Test):
    def setUp(self):
        super().setUp()
        self.file = support.scratch_folder() / "tool.yaml"

    def backup(self, *arguments):
        self.ask("backup", "-f", self.file, *arguments)
        return self.file.read_text(encoding="utf-8")

    def restore(self, *arguments, status=0):
        outcome = support.run(support.SPINDLE, "--json", "restore", self.url, self.file, "--yes", *arguments,
                              folder=support.scratch_folder())
        self.assert_ends(outcome, status)
        return outcome

    def test_says_whose_it_is(self):
        text = self.backup()
        self.assertIn("BMT3216", text)
        self.assertIn("4.0.2", text)
        self.assertNotIn("password: 4711", text)
        self.assertNotIn("4711", text)
        self.assertIn("4711", self.backup("--force", "--include-secrets"))

    def test_all_that_is_named_in_few_requests(self):
        before = len(self.device.requests)
        self.backup()
        # 930 + 1395 + 94 registers of at most 125 a request, and what the tool says of itself.
        self.assertLessEqual(len(self.device.requests) - before, 24)

    def test_diff_and_restore(self):
        self.backup()
        self.assertEqual(self.ask("diff", self.file).of_type("diff"), [])
        self.device.put(TARGET_1, *f32(1.0))
        self.device.put(3663, 77)
        told = {one["name"] for one in spindle("diff", self.url, self.file).of_type("diff")}
        self.assertEqual(told, {"preset.1.target-torque", "control.loosening-speed"})
        self.restore()
        self.assertEqual((self.device.value(TARGET_1), self.device.number(3663)), (2.5, 0))
        self.assertEqual(sorted(first for first, _ in self.written()), [TARGET_1, 3663])

    def test_guarded_first_and_everything_read_again(self):
        self.backup()
        self.device.put(TARGET_1, *f32(1.0))
        self.device.put(3726, *f32(50.0))
        with self.device.lock:
            self.device.requests.clear()
        self.restore()
        self.assertEqual([first for first, _ in self.written()], [3726, TARGET_1])
        with self.device.lock:
            functions = [function for function, _ in self.device.requests]
        first, second = (index for index, function in enumerate(functions) if function == 16)
        self.assertGreaterEqual(functions[first:second].count(3), 20)

    def test_what_a_guarded_one_changes_along_is_put_right(self):
        self.backup()
        self.device.put(3725, 1)
        take = self.device._take

        def crowfoot_resets(register, word):
            take(register, word)
            if register == 3725:
                self.device.holding[3663] = 999

        self.device._take = crowfoot_resets
        self.restore()
        self.assertEqual((self.device.number(3725), self.device.number(3663)), (0, 0))

    def test_never_another_unit(self):
        self.backup()
        self.device.put(UNIT, 0)
        for arguments in (("preset.*",), ("preset.*", "--force")):
            outcome = self.restore(*arguments, status=8)
            self.assertIn("kgf.cm", outcome.err + outcome.out)
            self.assertNotIn("--force", outcome.err)
            self.assertIn("control.torque-unit", outcome.err)
        self.assertEqual(self.written(), [])

    def start_in_another_unit(self, rescales):
        """A tool that was set to another unit behind its backup, and may convert its torques along."""
        self.start()
        self.backup("--force")
        self.device.rescales = rescales
        self.device.put(UNIT, 3)
        self.device.put(TARGET_1, *f32(10.0))

    def test_the_unit_is_restored_before_the_torques(self):
        for rescales in (False, True):
            with self.subTest(rescales=rescales):
                self.start_in_another_unit(rescales)
                plan = {one["name"]: one for one in self.ask("restore", self.file, "--dry-run").of_type("plan")}
                self.assertEqual([plan["preset.1.target-torque"][key] for key in ("old", "old_unit", "new", "unit")],
                                 [10, "cN.m", 2.5, "N.m"])
                outcome = self.restore()
                self.assertEqual((self.device.number(UNIT), self.device.value(TARGET_1)), (2, 2.5))
                self.assertEqual(self.written()[0][0], UNIT)
                told = {one["name"]: one for one in outcome.of_type("write")}
                self.assertEqual(told["preset.1.target-torque"]["unit"], "N.m")
                self.assertEqual(self.ask("diff", self.file).of_type("diff"), [])

    def test_a_backup_in_two_units_is_not_restored(self):
        text = self.backup()
        [line] = [line for line in text.splitlines() if "name: control.torque-unit," in line]
        edited = text.replace(line, re.sub(r"raw: 2\b", "raw: 3", line.replace("N.m", "cN.m")))
        self.assertNotEqual(edited, text)
        self.file.write_text(edited, encoding="utf-8")
        self.device.put(TARGET_1, *f32(1.0))
        for arguments in ((), ("--force",), ("control.torque-unit",)):
            self.assertIn("control.torque-unit", self.restore(*arguments, status=8).err)
        self.assertEqual(self.written(), [])

    def test_a_restore_with_the_unit_is_taken_back(self):
        for rescales in (False, True):
            with self.subTest(rescales=rescales):
                self.start_in_another_unit(rescales)
                self.device.put(3663, 77)
                folder = support.scratch_folder()
                outcome = support.run(support.SPINDLE, "--json", "restore", self.url, self.file, "--yes", folder=folder)
                change = outcome.of_type("summary")[0]["change_id"]
                self.assertEqual((self.device.number(UNIT), self.device.value(TARGET_1)), (2, 2.5))
                first = len(self.written())
                outcome = support.run(support.SPINDLE, "--json", "undo", change, "--yes", folder=folder)
                self.assert_ends(outcome, 0)
                self.assertEqual((self.device.number(UNIT), self.device.value(TARGET_1), self.device.number(3663)),
                                 (3, 10.0, 77))
                self.assertEqual(self.written()[first:][-1], (UNIT, [3]))

    def test_only_the_unit(self):
        self.backup()
        self.device.put(UNIT, 3)
        self.restore("control.torque-unit")
        self.assertEqual(self.written(), [(UNIT, [2])])

    def test_never_another_model(self):
        self.backup()
        self.start(model="BMT3264")
        for arguments in ((), ("--force",)):
            outcome = self.restore(*arguments, status=8)
            self.assertIn("BMT3264", outcome.err + outcome.out)
        self.assertEqual(self.written(), [])

    def test_never_another_generation_of_firmware(self):
        self.backup()
        self.start(firmware=5001, version=(5, 0, 1))
        self.device.put(TARGET_1, *f32(1.0))
        for arguments in ((), ("--force",)):
            outcome = self.restore(*arguments, status=8)
            self.assertIn("5.0.1", outcome.err + outcome.out)
        self.assertEqual(self.written(), [])

    def test_the_next_firmware_of_the_generation(self):
        self.backup()
        self.start(firmware=4012, version=(4, 1, 2))
        self.device.put(TARGET_1, *f32(1.0))
        self.restore()
        self.assertEqual(self.device.value(TARGET_1), 2.5)

    def test_no_number_is_never_written(self):
        self.device.put(TARGET_1, *f32(math.inf))
        self.backup()
        self.device.put(TARGET_1, *f32(1.0))
        self.restore()
        self.assertEqual(self.device.value(TARGET_1), 1.0)

    def test_a_secret_is_saved_only_where_it_is_written(self):
        self.backup()
        self.device.put(TARGET_1, *f32(1.0))
        saved = self.restore().of_type("summary")[0]["saved_state"]
        with open(saved, encoding="utf-8") as file:
            self.assertNotIn("4711", file.read())


if __name__ == "__main__":
    unittest.main()
