"""Any device on pymodbus: pymodbus_device.py tcp|rtu TABLES. TABLES is JSON, by table ('coil', 'discrete',
'input', 'holding') and by address: a list of bits or registers, or a number for the builder of pymodbus, as
{"f32": 1.5, "order": "big"}. 'rtu' frames over TCP. Prints its port, serves until it is stopped."""

import asyncio
import json
import logging
import sys

from pymodbus.constants import Endian
from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext, ModbusSparseDataBlock
from pymodbus.payload import BinaryPayloadBuilder
from pymodbus.transaction import ModbusRtuFramer, ModbusSocketFramer

from pymodbus_server import TcpServer

BUILDERS = {"f32": "add_32bit_float", "f64": "add_64bit_float", "u32": "add_32bit_uint", "i32": "add_32bit_int",
            "u64": "add_64bit_uint", "i64": "add_64bit_int", "text": "add_string"}


def registers_of(value):
    if isinstance(value, list):
        return value
    [kind] = [key for key in value if key != "order"]
    words = Endian.Little if value.get("order") == "little" else Endian.Big
    builder = BinaryPayloadBuilder(byteorder=Endian.Big, wordorder=words)
    getattr(builder, BUILDERS[kind])(value[kind])
    return builder.to_registers()


def block(table):
    cells = {}
    for address, value in table.items():
        for offset, cell in enumerate(registers_of(value)):
            cells[int(address) + offset] = cell
    return ModbusSparseDataBlock(cells)


async def serve(framing, tables):
    device = ModbusSlaveContext(
        co=block(tables.get("coil", {})), di=block(tables.get("discrete", {})), ir=block(tables.get("input", {})),
        hr=block(tables.get("holding", {})), zero_mode=True)
    framer = {"tcp": ModbusSocketFramer, "rtu": ModbusRtuFramer}[framing]
    await TcpServer(ModbusServerContext(slaves=device, single=True), framer=framer).announce_and_serve()


if __name__ == "__main__":
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    asyncio.run(serve(sys.argv[1], json.loads(sys.argv[2])))
