"""A Modbus TCP server on pymodbus: pymodbus_server.py doga|stock. Prints its port, serves until it is
stopped. 'doga' answers FC 17 as 60427 §3.4 says, 'stock' as pymodbus does by itself."""

import asyncio
import logging
import socket
import struct
import sys

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext, ModbusSparseDataBlock
from pymodbus.device import ModbusDeviceIdentification
from pymodbus.other_message import ReportSlaveIdRequest, ReportSlaveIdResponse
from pymodbus.server.async_io import ModbusTcpServer

PRESETS = 15
FIELDS = 15
LARGEST = 725


class DogaIdentity(ReportSlaveIdResponse):
    """Without the run indicator that pymodbus puts behind the identity."""

    def encode(self):
        return struct.pack(">B", len(self.identifier)) + self.identifier


class DogaIdentityRequest(ReportSlaveIdRequest):
    """id, controller, model 3, firmware 2103, serial."""

    def execute(self, context=None):
        return DogaIdentity(struct.pack(">HHHHI", 1, 1, 3, 2103, 1021100042))


def holding_registers():
    """Presets with the limits that the tool keeps of each, and one parameter far from them. Field k of
    preset n holds 100 n + k and may go from 0 to 2000; field 1, the mode, holds 0 and may go to 1."""
    registers = {LARGEST: 7}
    for preset in range(1, PRESETS + 1):
        for field in range(1, FIELDS + 1):
            address = FIELDS * (preset - 1) + field
            registers[address] = 0 if field == 1 else 100 * preset + field
            registers[1000 + address] = 0
            registers[2000 + address] = 1 if field == 1 else 2000
    return registers


def input_registers():
    """The event of the manual's tables, with a torque below zero, and a live status."""
    event = [1962, 1421, 1, 2100, 0xFFF6, 235, 1058, 399, 1457, 3, 0, 1, 2, 12]
    status = [0xFF9C, 850, 17, 3, 1, 0, 1, 0, 332, 1, 5, 6, 7, 31]
    registers = {3100: 11, 3101: 12}
    registers.update({3200 + offset: value for offset, value in enumerate(event)})
    registers.update({3300 + offset: value for offset, value in enumerate(status)})
    return registers


class TcpServer(ModbusTcpServer):
    """Says where it listens as soon as it does."""

    async def announce_and_serve(self):
        listener = socket.create_server(("127.0.0.1", 0))
        self.server = await self.loop.create_server(lambda: self.handler(self), sock=listener)
        print(listener.getsockname()[1], flush=True)
        await self.server.serve_forever()


async def serve(identity):
    device = ModbusSlaveContext(
        hr=ModbusSparseDataBlock(holding_registers()),
        ir=ModbusSparseDataBlock(input_registers()), zero_mode=True)
    stock = ModbusDeviceIdentification(
        info_name={"VendorName": "Pymodbus", "ProductCode": "PM", "MajorMinorRevision": "3.0"})
    server = TcpServer(ModbusServerContext(slaves=device, single=True), identity=stock)
    if identity == "doga":
        server.decoder.register(DogaIdentityRequest)
    await server.announce_and_serve()


if __name__ == "__main__":
    # It calls every exception response and every client that leaves an error.
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    asyncio.run(serve(sys.argv[1]))
