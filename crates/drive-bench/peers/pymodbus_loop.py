"""Reads one drive after another as fast as pymodbus's blocking client does it, which keeps the silences itself.

Arguments: port, drives, first register, quantity, seconds.
"""

import sys
import time

from pymodbus.client import ModbusSerialClient

port, drives, first, quantity, seconds = sys.argv[1], *map(int, sys.argv[2:5]), float(sys.argv[5])
# A pty has no parity; the silence follows from the speed, eight data bits and one stop bit.
client = ModbusSerialClient(port, baudrate=19200, timeout=0.5)
if not client.connect():
    sys.exit(f"no connection to {port}")
end = time.monotonic() + seconds
while time.monotonic() < end:
    for address in range(1, drives + 1):
        try:
            answer = client.read_holding_registers(first, count=quantity, device_id=address)
        except TypeError:  # before 3.10
            answer = client.read_holding_registers(first, count=quantity, slave=address)
        if answer.isError():
            sys.exit(f"drive {address}: {answer}")
