"""Answers per second, exceptions and worst wait of a Modbus TCP gateway: this one or another.

Arguments: port, clients, seconds, units such as 1-30, and of which each client asks: "turn", one unit after the other; "same", all the first
one; "own", each one of its own. It asks for ETA and the three registers behind it, one request after the other. Needs nothing but Python."""

import socket
import struct
import sys
import threading
import time

port, clients, seconds = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
low, high = map(int, sys.argv[4].split("-"))
which = sys.argv[5] if len(sys.argv) > 5 else "turn"
right, codes, waits, lock = [0], {}, [], threading.Lock()


def ask_on(client):
    stream = socket.create_connection(("127.0.0.1", port), timeout=30)
    first = {"turn": client * 4, "same": 0, "own": client}[which]
    end, number, unit = time.monotonic() + seconds, 0, low + first % (high - low + 1)
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
        if which == "turn":
            unit = low + (unit - low + 1) % (high - low + 1)


threads = [threading.Thread(target=ask_on, args=(client,)) for client in range(clients)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
print(f"{right[0] / seconds:.1f} answers a second, exceptions {codes}, worst wait {max(waits) * 1000:.0f} ms")
