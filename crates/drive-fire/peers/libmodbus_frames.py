"""What libmodbus takes for the answer to a question: one line per case, `rtu ANSWER REQUEST` in hexadecimal; told as `SLAVE PDU`, or `-`.

libmodbus writes its request into a socket in which the answer lies already, and reads that.
"""

import ctypes
import ctypes.util
import socket
import sys

SLAVE = 1
# libmodbus' own errors begin here; of them the first fourteen or so are the exceptions of the specification.
FIRST_ERROR = 112345678
EXCEPTIONS = 12


def library():
    for name in (ctypes.util.find_library("modbus"), "libmodbus.so.5"):
        if name:
            return ctypes.CDLL(name, use_errno=True)
    raise SystemExit("libmodbus is not there")


def main():
    modbus = library()
    modbus.modbus_new_rtu.restype = ctypes.c_void_p
    modbus.modbus_new_rtu.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_char, ctypes.c_int, ctypes.c_int]
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    context = ctypes.c_void_p(modbus.modbus_new_rtu(b"/dev/null", 19200, b"E", 8, 1))
    modbus.modbus_set_slave(context, SLAVE)
    modbus.modbus_set_socket(context, ours.fileno())
    modbus.modbus_set_response_timeout(context, 0, 1000)
    modbus.modbus_set_byte_timeout(context, 0, 500)
    for line in sys.stdin:
        _, answer, request = line.split()
        answer, request = bytes.fromhex(answer.strip("-")), bytes.fromhex(request)
        drain(ours, theirs)
        if answer:
            theirs.send(answer)
        print(taken(modbus, context, request))


def drain(ours, theirs):
    """Nothing is left of the case before."""
    for end in (ours, theirs):
        try:
            while end.recv(4096, socket.MSG_DONTWAIT):
                pass
        except BlockingIOError:
            pass


def taken(modbus, context, request):
    function, at, count = request[0], int.from_bytes(request[1:3], "big"), int.from_bytes(request[3:5], "big")
    words = (ctypes.c_uint16 * 125)()
    ctypes.set_errno(0)
    if function == 3:
        result = modbus.modbus_read_registers(context, at, count, words)
    elif function == 4:
        result = modbus.modbus_read_input_registers(context, at, count, words)
    elif function == 6:
        result = modbus.modbus_write_register(context, at, count)
    else:
        for index in range(count):
            words[index] = int.from_bytes(request[6 + 2 * index : 8 + 2 * index], "big")
        result = modbus.modbus_write_registers(context, at, count, words)
    if result < 0:
        code = ctypes.get_errno() - FIRST_ERROR
        return f"{SLAVE} {bytes([function | 0x80, code]).hex()}" if 0 < code < EXCEPTIONS else "-"
    if function in (3, 4):
        data = b"".join(words[index].to_bytes(2, "big") for index in range(result))
        return f"{SLAVE} {(bytes([function, len(data)]) + data).hex()}"
    return f"{SLAVE} {request[:5].hex()}"


main()
