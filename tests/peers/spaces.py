"""A drive that stands still, with a register, a coil and two inputs of one address: pymodbus' own server, Modbus TCP, by the words of
crates/drive-profile/tests/data/spaces.toml alone. Argument: the port. Prints one line when it serves; ends with its standard input.
"""

import asyncio
import sys

from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice


def bits(address, value):
    return SimData(address, values=[value], datatype=DataType.BITS)


def words(address, *values):
    return SimData(address, values=list(values), datatype=DataType.REGISTERS)


async def main() -> None:
    port = int(sys.argv[1])
    # Coils, discrete inputs, holding registers, input registers.
    blocks = (
        [bits(0x0200, False)],
        [bits(0x0200, True)],
        [words(0x0110, 0, 0), words(0x0200, 30), words(0x091A, 0, 0, 0, 0, 0)],
        [words(0x0100, 0x0300), words(0x0200, 3250)],
    )
    server = ModbusTcpServer(SimDevice(3, blocks), address=("127.0.0.1", port))
    await server.serve_forever(background=True)
    print("serving", flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    await server.shutdown()


asyncio.run(main())
