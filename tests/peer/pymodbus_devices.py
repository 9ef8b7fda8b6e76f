"""Devices that move, as models on pymodbus. They are written from public documents, which each of them names,
and from nothing of spindle. Time passes in them by how often they are looked at, not by a clock, so that a
session with them is the same on a slow machine.

A device has the tables that it answers for: coils, inputs, holdings."""

from pymodbus_tables import Table


class Shaft:
    """Turns as fast as it is told: half of the way at the first look, all of it at the second."""

    def __init__(self):
        self.speed = 0
        self._target = 0

    def look(self, target):
        self.speed = target if target == self._target else int((self.speed + target) / 2)
        self._target = target

    def brake(self):
        self.speed = self._target = 0


class Screwdriver:
    """Kolver K-Ducer, whose operator drives a screw behind every look that finds no new result. As the maker's
    client has it, github.com/kolver/nuget-kolver.kducer: KDucer.cs (input register 294 is 1 when there is a new
    result, and reading clears it; 67 registers from 295 are the result, 10 from 370 the version; coil 34 stops
    the motor; holding registers 7371 and 7372 are sequence and program), KducerTighteningResult.cs (the result)."""

    FLAG, RESULT, STOP_MOTOR, PROGRAM = 294, 295, 34, 7372
    SCREWS = ({"ok": 1, "torque": 152, "peak": 153, "angle": 720, "code": 13, "time": 812, "count": 1},
              {"ok": 0, "torque": 88, "peak": 91, "angle": 402, "code": 31, "time": 611, "count": 1},
              {"ok": 1, "torque": 149, "peak": 151, "angle": 715, "code": 13, "time": 807, "count": 2})

    def __init__(self):
        self._driven = 0
        self.inputs = Table({self.FLAG: [0], self.RESULT: [0] * 67, 370: {"text": "KDU-1A vM.00.38".ljust(20, "\0")}},
                            after_read=self._was_read)
        self.coils = Table({address: [0] for address in range(32, 36)})
        self.holdings = Table({7371: [0], self.PROGRAM: [3]})
        self._drive()
        self.inputs.put(self.FLAG, [0])

    def _was_read(self, addresses):
        if self.FLAG not in addresses:
            return
        if self.inputs.values[self.FLAG]:
            self.inputs.put(self.FLAG, [0])
        elif not self.coils.values[self.STOP_MOTOR]:
            self._drive()

    def _drive(self):
        screw = self.SCREWS[self._driven % len(self.SCREWS)]
        result = self.inputs
        result.put(295, {"text": f"LOT-{4711 + self._driven}".ljust(16, "\0")})
        result.put(303, [screw["ok"], self.holdings.values[self.PROGRAM], 3])
        result.put(306, {"u32": 1234567})
        result.put(310, [150, 600, screw["time"], screw["count"], 4, 0, 0, 0, screw["torque"], screw["peak"]])
        result.put(323, [screw["angle"]])
        result.put(330, [screw["code"]])
        result.put(331, {"text": "lid, four M4".ljust(30, "\0")})
        result.put(346, [26, 11, 29, 8, 30, self._driven])
        result.put(self.FLAG, [1])
        self._driven += 1


class Inverter:
    """Huanyang FC01. As a user had it run, github.com/grblHAL/Plugins_spindle, issue 17: 2000h takes 1, 2 or 5
    for forward, reverse and stop, 2001h the frequency in 0.01 Hz, 3001h shows it, 3000h says 1, 2 or 3. That it
    says so until the output is down to 0 is made up."""

    COMMAND, FREQUENCY, STATUS, OUTPUT = 0x2000, 0x2001, 0x3000, 0x3001
    STOPPED = 3

    def __init__(self):
        self._shaft = Shaft()
        self.holdings = Table({self.COMMAND: [5], self.FREQUENCY: [0], self.STATUS: [self.STOPPED], self.OUTPUT: [0]},
                              before_read=self._before_read, before_write=self._before_write)

    def _before_read(self, addresses):
        if self.STATUS not in addresses:
            return
        command = self.holdings.values[self.COMMAND]
        runs = command in (1, 2)
        self._shaft.look(self.holdings.values[self.FREQUENCY] if runs else 0)
        if runs:
            self.holdings.put(self.STATUS, [command])
        elif self._shaft.speed == 0:
            self.holdings.put(self.STATUS, [self.STOPPED])
        self.holdings.put(self.OUTPUT, [self._shaft.speed])

    def _before_write(self, cells):
        if cells.keys() & {self.STATUS, self.OUTPUT} or cells.get(self.COMMAND, 5) not in (1, 2, 5):
            raise ValueError("not to be written")


class MotorDriver:
    """What the drivers of Oriental Motor have in common: 32-bit values, high word first; alarms from 80h, the
    communication errors from ACh; maintenance commands that act as they go from 0 to 1, and bit 8 of the status
    while the driver is busy with one; exception 04 whose reason is in ACh: 8Dh for what is not possible now.
    HM-5114 p.15, p.21-22; HP-5142 p.241, p.253, p.329-332."""

    STATUS, ALARM, ERROR = 126, 128, 172
    ALARM_RESET, CLEAR_HISTORY, CONFIGURE, LOAD, SAVE = 385, 389, 397, 401, 403
    BUSY = 1 << 8
    OVERLOAD, NOT_NOW = 0x30, 0x8D

    def __init__(self, registers, values):
        self._shaft = Shaft()
        self._busy = 0  # looks at the status
        self.holdings = Table({address: [0] for address in registers}, before_read=self._before_read,
                              before_write=self._before_write, after_write=self._after_write)
        for address, value in {**values, 48: -1, self.ALARM: self.OVERLOAD, 130: self.OVERLOAD, 132: 0x25}.items():
            self.holdings.put(address, {"i32": value})

    def _before_read(self, addresses):
        if self.STATUS not in addresses:
            return
        if self.alarm or self.speed_asked() is None:
            self._shaft.brake()
        else:
            self._shaft.look(self.speed_asked())
        busy = self.BUSY if self._busy else 0
        self._busy = max(0, self._busy - 1)
        self.holdings.put(self.STATUS, {"u32": self.status(self._shaft.speed) | busy})
        self.holdings.put(200, {"i32": 0 if self.alarm else self.speed_asked() or 0})
        self.holdings.put(206, {"i32": self._shaft.speed})
        load, turning = self.LOAD
        self.holdings.put(load, {"i32": turning if self._shaft.speed else 0})

    def _before_write(self, cells):
        if cells.get(self.CONFIGURE) == 1 and (self.alarm or self._shaft.speed):
            self.holdings.put(self.ERROR, {"u32": self.NOT_NOW})
            self.holdings.put(174, {"u32": self.NOT_NOW})
            raise ValueError("not possible now")
        self._before = dict(self.holdings.values)

    def _after_write(self, addresses):
        begun = {address for address in addresses
                 if self.holdings.values[address] == 1 and self._before.get(address) == 0}
        if self.ALARM_RESET in begun:
            self.holdings.put(self.ALARM, {"u32": 0})
        if self.CLEAR_HISTORY in begun:
            self.holdings.put(130, [0] * 20)
        if begun & {self.CLEAR_HISTORY, self.CONFIGURE, self.LOAD, self.SAVE}:
            self._busy = 2

    @property
    def alarm(self):
        return self.holdings.number(self.ALARM)


class BlvR(MotorDriver):
    """BLV series R type, HP-5142: one command word of 32 bits in 7Ch and status in 7Eh (p.252-253). S-ON has to
    be there for a run; STOP, QSTOP and FREE forbid one. Operation data from 1800h, 64 registers each (p.351)."""

    LOAD = 216, 180  # where, and how much while it turns
    S_ON, QSTOP, STOP, FREE, FW_SPD, RV_SPD = (1 << bit for bit in (0, 4, 5, 6, 18, 19))

    def __init__(self):
        fields = (*range(6144, 6150), *range(6154, 6160))
        operations = [address + 64 * number for number in range(8) for address in fields]
        values = {6148: 500, 248: 415, 250: 380, 196: -1, 446: 4, 4992: -1, 4994: 5, 4998: 1, 5004: 3, 5006: 30}
        for number in range(8):
            values.update({6154 + 64 * number: 10000, 6156 + 64 * number: 1000, 6158 + 64 * number: 1000})
        super().__init__([48, 49, *range(88, 106), *range(114, 150), *range(172, 220), *range(246, 256),
                          *range(384, 406), 446, 447, *range(4992, 5012), *operations], values)

    @property
    def command(self):
        return self.holdings.number(124)

    def speed_asked(self):
        """None: at once, without a ramp."""
        command = self.command
        if not command & self.S_ON or command & self.FREE or command & self.QSTOP:
            return None
        direction = {self.FW_SPD: 1, self.RV_SPD: -1}.get(command & (self.FW_SPD | self.RV_SPD), 0)
        if command & self.STOP or not direction:
            return 0
        return direction * self.holdings.number(6148 + 64 * (command >> 24 & 0xFF))

    def status(self, speed):
        command = self.command
        bits = {0: command & self.S_ON, 5: command & self.STOP, 6: command & self.FREE, 7: self.alarm,
                11: command & self.S_ON and not speed, 13: speed, 14: speed and speed == self.speed_asked()}
        return sum(1 << bit for bit, on in bits.items() if on)


class Blh(MotorDriver):
    """BLH, RS-485 type: command words and operation data as those of BLV (HM-5114 p.19-20, p.24-25; BLH manual
    p.77, p.79), in 2-wire mode. Bits of 7Dh: 0 to 2 the operation data, 3 FWD, 4 REV, 5 deceleration instead of a
    stop at once. The speed of operation data 0 and 1 comes from outside while 10E2h is 0. Its own are the timeout
    at 138Ah and the temperature at F8h, as in BLV-R."""

    LOAD = 264, 18

    def __init__(self):
        values = {1152 + 2 * number: 0 for number in range(8)}
        values.update({address + 2 * number: 5 for number in range(8) for address in (1536, 1664)})
        values.update({1792 + 2 * number: 200 for number in range(8)})
        values.update({1156: 1000, 248: 352, 268: 600, 646: 300, 900: 1, 4430: 200, 4610: 3, 5126: 1, 5130: 100})
        values.update({4448: 48, 4450: 49, 4452: 50, 4454: 1, 4456: 2, 4458: 19, 4462: 20, 4494: 65})
        super().__init__([48, 49, *range(124, 208), *range(212, 214), *range(248, 280), *range(384, 406), 646, 647, 840,
                          841, 900, 901, *range(1152, 1168), *range(1536, 1552), *range(1664, 1680),
                          *range(1792, 1808), *range(4138, 4182), *range(4224, 4270), *range(4322, 4324),
                          *range(4352, 4364), *range(4430, 4432), *range(4448, 4512), 4610, 4611, 5002,
                          5003, *range(5126, 5132)], values)

    @property
    def command(self):
        return self.holdings.number(124)

    def speed_asked(self):
        """None: at once, without a ramp."""
        command = self.command
        direction = {0b01: 1, 0b10: -1}.get(command >> 3 & 0b11, 0)
        if not direction:
            return 0 if command & 1 << 5 else None
        data = command & 0b111
        analog = data < 2 and self.holdings.number(4322) == 0
        return direction * self.holdings.number(268 if analog else 1152 + 2 * data)

    def status(self, speed):
        bits = {7: self.alarm, 13: speed, 14: speed and speed == self.speed_asked()}
        return self.command & 0b111111 | sum(1 << bit for bit, on in bits.items() if on)


DEVICES = {device.__name__: device for device in (Screwdriver, Inverter, BlvR, Blh)}
