"""A Modbus slave that was not written here: pymodbus serving holding registers on a serial port.

Arguments: port, address, framer (rtu or ascii), first register, then the words.
Prints one line when it serves. Ends with its standard input.
"""

import asyncio
import sys

from pymodbus import FramerType
from pymodbus.pdu.device import ModbusDeviceIdentification
from pymodbus.server import ModbusSerialServer
from pymodbus.simulator import DataType, SimData, SimDevice


async def main() -> None:
    port, address, framer, first, *words = sys.argv[1:]
    identity = ModbusDeviceIdentification(
        info_name={"VendorName": "Telemecanique", "ProductCode": "ATV31HU09M3S232", "MajorMinorRevision": "0201"}
    )
    registers = SimData(int(first), values=[int(word) for word in words], datatype=DataType.REGISTERS)
    server = ModbusSerialServer(
        SimDevice(int(address), registers, identity=identity),
        framer=FramerType(framer),
        identity=identity,
        port=port,
        baudrate=19200,
    )
    await server.serve_forever(background=True)
    print("serving", flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    await server.shutdown()


asyncio.run(main())
