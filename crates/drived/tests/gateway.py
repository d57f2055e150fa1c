"""One client of a gateway by pymodbus: reads ETA of each drive again and again, and says what it got.

Arguments: port, first address, how many drives, rounds. Prints one line: right answers, 0Bh of the last address, others."""

import sys

from pymodbus.client import ModbusTcpClient

port, first, drives, rounds = map(int, sys.argv[1:5])
# pymodbus calls the unit "slave" up to 3.9 and "device_id" from 3.10 on.
import inspect

keyword = "device_id"
if keyword not in inspect.signature(ModbusTcpClient.read_holding_registers).parameters:
    keyword = "slave"
client = ModbusTcpClient("127.0.0.1", port=port, timeout=3, retries=0)
assert client.connect()
right, silent, others = 0, 0, []
for number in range(rounds):
    unit = first + number % drives
    answer = client.read_holding_registers(3201, count=4, **{keyword: unit})
    if not answer.isError() and len(answer.registers) == 4:
        right += 1
    elif answer.isError() and getattr(answer, "exception_code", 0) == 0x0B and unit == 31:
        silent += 1
    else:
        others.append(f"unit {unit}: {answer}")
client.close()
print(right, silent, others)
