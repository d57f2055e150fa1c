"""Reads one drive after another as fast as minimalmodbus does it, which keeps the silences itself.

Arguments: port, drives, first register, quantity, seconds.
"""

import sys
import time

import minimalmodbus

port, drives, first, quantity, seconds = sys.argv[1], *map(int, sys.argv[2:5]), float(sys.argv[5])
instruments = []
for address in range(1, drives + 1):
    instrument = minimalmodbus.Instrument(port, address)
    instrument.serial.baudrate = 19200
    # A pty has no parity; the silence follows from the speed alone.
    instrument.serial.timeout = 0.5
    instruments.append(instrument)
end = time.monotonic() + seconds
while time.monotonic() < end:
    for instrument in instruments:
        instrument.read_registers(first, quantity)
