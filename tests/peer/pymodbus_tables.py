"""Tables of registers and bits for pymodbus, and values that its own builders lay out."""

from pymodbus.constants import Endian
from pymodbus.datastore import ModbusSparseDataBlock
from pymodbus.payload import BinaryPayloadBuilder

BUILDERS = {"f32": "add_32bit_float", "f64": "add_64bit_float", "u32": "add_32bit_uint", "i32": "add_32bit_int",
            "u64": "add_64bit_uint", "i64": "add_64bit_int", "text": "add_string"}


def registers_of(value):
    """Of a list of registers or bits, or of a number for the builder: {"f32": 1.5, "order": "big"}."""
    if isinstance(value, list):
        return value
    [kind] = [key for key in value if key != "order"]
    words = Endian.Little if value.get("order") == "little" else Endian.Big
    builder = BinaryPayloadBuilder(byteorder=Endian.Big, wordorder=words)
    getattr(builder, BUILDERS[kind])(value[kind])
    return builder.to_registers()


class Table(ModbusSparseDataBlock):
    """A table that tells the device behind it what a master does: before_read(addresses), after_read(addresses),
    before_write(cells), after_write(addresses). What before_write raises is exception 04 on the line. The device
    itself uses put() and number()."""

    def __init__(self, cells=(), **hooks):
        super().__init__({})
        self._hooks = hooks
        for address, value in dict(cells).items():
            self.put(int(address), value)

    def put(self, address, value):
        self.values.update(enumerate(registers_of(value), address))

    def number(self, address):
        """Of 32 bits, the high word first."""
        return int.from_bytes(b"".join(self.values[address + word].to_bytes(2, "big") for word in (0, 1)), "big",
                              signed=True)

    def getValues(self, address, count=1):
        addresses = range(address, address + count)
        self._tell("before_read", addresses)
        values = super().getValues(address, count)
        self._tell("after_read", addresses)
        return values

    def setValues(self, address, values):
        self._tell("before_write", dict(enumerate(values, address)))
        super().setValues(address, values)
        self._tell("after_write", range(address, address + len(values)))

    def _tell(self, hook, what):
        if hook in self._hooks:
            self._hooks[hook](what)
