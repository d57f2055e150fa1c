"""A Modbus master that was not written here: minimalmodbus.

Arguments: port, mode (rtu or ascii), address, then steps: r:REGISTER:COUNT reads, w:REGISTER:WORD writes with function
06, m:REGISTER:WORD,WORD writes with function 16. Prints the outcome of each step on a line of its own.
"""

import sys

import minimalmodbus

port, mode, address, *steps = sys.argv[1:]
drive = minimalmodbus.Instrument(port, int(address), mode=mode)
drive.serial.baudrate = 19200
drive.serial.timeout = 2.0
for step in steps:
    kind, register, argument = step.split(":")
    try:
        if kind == "r":
            print(*drive.read_registers(int(register), int(argument)), flush=True)
        elif kind == "w":
            drive.write_register(int(register), int(argument), functioncode=6)
            print("written", flush=True)
        else:
            drive.write_registers(int(register), [int(word) for word in argument.split(",")])
            print("written", flush=True)
    except minimalmodbus.ModbusException as error:
        print(type(error).__name__, flush=True)
