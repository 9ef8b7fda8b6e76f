"""Any device on pymodbus: pymodbus_device.py tcp|rtu TABLES|NAME. TABLES is JSON, by table ('coil', 'discrete',
'input', 'holding') and by address: a list of bits or registers, or a number for the builder of pymodbus, as
{"f32": 1.5, "order": "big"}. NAME is a device that moves, of pymodbus_devices.py. 'rtu' frames over TCP. Prints
its port, serves until it is stopped."""

import asyncio
import json
import logging
import sys

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext
from pymodbus.transaction import ModbusRtuFramer, ModbusSocketFramer

from pymodbus_devices import DEVICES
from pymodbus_server import TcpServer
from pymodbus_tables import Table


def tables_of(what):
    if what in DEVICES:
        device = DEVICES[what]()
        return {"coil": getattr(device, "coils", Table()), "discrete": Table(),
                "input": getattr(device, "inputs", Table()), "holding": device.holdings}
    given = json.loads(what)
    return {name: Table(given.get(name, {})) for name in ("coil", "discrete", "input", "holding")}


async def serve(framing, tables):
    device = ModbusSlaveContext(co=tables["coil"], di=tables["discrete"], ir=tables["input"], hr=tables["holding"],
                                zero_mode=True)
    framer = {"tcp": ModbusSocketFramer, "rtu": ModbusRtuFramer}[framing]
    await TcpServer(ModbusServerContext(slaves=device, single=True), framer=framer).announce_and_serve()


if __name__ == "__main__":
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    asyncio.run(serve(sys.argv[1], tables_of(sys.argv[2])))
