"""What pymodbus takes for an answer: lines of a protocol and the bytes that come, in hexadecimal; for each the slave and the PDU, or -."""

import logging
import sys

from pymodbus.framer import FramerAscii, FramerRTU
from pymodbus.pdu import DecodePDU

logging.disable(logging.CRITICAL)
framers = {"rtu": FramerRTU, "ascii": FramerAscii}

for line in sys.stdin:
    protocol, text = (line.split() + [""])[:2]
    framer = framers[protocol](DecodePDU(False))
    try:
        _, slave, _, pdu = framer.decode(bytes.fromhex(text))
    except Exception:  # It is asked about anything.
        pdu = b""
    print(f"{slave} {pdu.hex()}" if pdu else "-", flush=False)
