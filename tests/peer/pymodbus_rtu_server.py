"""A Modbus RTU server on pymodbus: pymodbus_rtu_server.py PORT. Units 1 and 3; register n of unit u
holds 1000 u + n. Prints a line when it listens, serves until it is stopped."""

import asyncio
import logging
import sys

from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server.async_io import ModbusSerialServer
from pymodbus.transaction import ModbusRtuFramer

UNITS = (1, 3)
REGISTERS = 200


def unit_context(unit):
    values = [1000 * unit + register for register in range(REGISTERS)]
    return ModbusSlaveContext(hr=ModbusSequentialDataBlock(0, values), zero_mode=True)


async def serve(port):
    context = ModbusServerContext(slaves={unit: unit_context(unit) for unit in UNITS}, single=False)
    server = ModbusSerialServer(context, framer=ModbusRtuFramer, port=port, baudrate=9600, parity="N",
                                ignore_missing_slaves=True)
    await server.start()
    print("serving", flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    asyncio.run(serve(sys.argv[1]))
