"""Answers per second, exceptions and worst wait of a Modbus TCP gateway: this one or another.

Arguments: port, clients, seconds, units such as 1-30. Each client asks for ETA and the three registers behind it, one request after
the other, of one unit after the other. Needs nothing but Python."""

import socket
import struct
import sys
import threading
import time

port, clients, seconds = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
low, high = map(int, sys.argv[4].split("-"))
right, codes, waits, lock = [0], {}, [], threading.Lock()


def ask_on(client):
    stream = socket.create_connection(("127.0.0.1", port), timeout=30)
    end, number, unit = time.monotonic() + seconds, 0, low + client * 4 % (high - low + 1)
    while time.monotonic() < end:
        number += 1
        asked = time.monotonic()
        stream.sendall(struct.pack(">HHHBBHH", number, 0, 6, unit, 3, 3201, 4))
        answer = stream.recv(260)
        with lock:
            waits.append(time.monotonic() - asked)
            if answer[7] == 3:
                right[0] += 1
            else:
                codes[f"{answer[8]:02X}h"] = codes.get(f"{answer[8]:02X}h", 0) + 1
        unit = low + (unit - low + 1) % (high - low + 1)


threads = [threading.Thread(target=ask_on, args=(client,)) for client in range(clients)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
print(f"{right[0] / seconds:.1f} answers a second, exceptions {codes}, worst wait {max(waits) * 1000:.0f} ms")
