#!/usr/bin/env python3
"""LS iG5A on Modbus RTU (drv=3, Frq=7): command code at 0006, setpoint at 0005, wire = printed number - 1."""
import time
from common import Drive, Ex, bits, main


class IG5A(Drive):
    name = "iG5A"
    fcs = (3, 4, 6, 16)
    max_read = max_write = 8
    nominal, max_hz = 60.0, 60.0
    ro = 0x14
    shift = 1
    # trip N: N is the bit of 000F
    faults = {0: "OCT overcurrent", 1: "OVT overvoltage", 2: "EXT-A", 3: "EST (BX)", 4: "COL", 5: "GFT ground", 6: "OHT inverter hot", 7: "ETH motor hot",
              8: "OLT overload", 9: "HW-diag", 10: "EXT-B", 11: "EEP", 12: "FAN", 13: "PO phase open", 14: "IOLT", 15: "LVT low voltage"}

    def setup(self):
        p = self.P
        p.update(drv=3, frq=7, fmax=6000, i62=0, i63=1.0, lock_all=1)
        A = lambda printed: printed - self.shift
        if not self.shift:
            self.reg(0, lambda: 0x000A)
        self.reg(A(1), lambda: 2)            # 1.5 kW
        self.reg(A(2), lambda: 1)            # 400 V class
        self.reg(A(3), lambda: 0x0023)
        self.reg(A(4), lambda: self.unlock, self.set_unlock)
        self.reg(A(5), lambda: self.ref, lambda v: self.gated(self.set_ref, v))
        self.reg(A(6), lambda: self.cmd, lambda v: self.gated(self.command_word, v))
        self.reg(A(7), lambda: self.acc * 10, lambda v: self.gated(self.ramp, v, "acc"))
        self.reg(A(8), lambda: self.dec * 10, lambda v: self.gated(self.ramp, v, "dec"))
        self.reg(A(9), lambda: self.amps * 10)
        self.reg(A(0xA), lambda: abs(self.out_hz) * 100)
        self.reg(A(0xB), lambda: abs(self.out_hz) * 6.6)
        self.reg(A(0xC), lambda: 540)
        self.reg(A(0xD), lambda: abs(self.out_hz) * 3)
        self.reg(A(0xE), self.status)
        self.reg(A(0xF), lambda: 1 << self.tripped - 1 if self.tripped else 0)
        self.reg(A(0x10), lambda: 0)
        self.reg(A(0x11), lambda: 0)
        self.reg(A(0x15), lambda: abs(self.out_hz) * 30)

    def power_up(self):
        self.unlock = self.cmd = self.ref = 0
        self.rev = False
        self.max_hz = self.P["fmax"] / 100

    def gated(self, put, v, *k):
        if not self.unlock and (self.P["lock_all"] or k):
            raise Ex(0x14)                   # write disabled: 0004 is 0
        put(v, *k)

    def set_unlock(self, v):
        if v > 1:
            raise Ex(3)
        self.unlock = v

    def set_ref(self, v):
        if v > self.P["fmax"]:
            raise Ex(3)
        self.ref = v

    def ramp(self, v, k):
        if v > 60000:
            raise Ex(3)
        setattr(self, k, max(v, 1) / 10)

    def command_word(self, v):
        old, self.cmd = self.cmd, v
        if v & 8 and not old & 8:
            self.reset_fault()
        if v & 16 and not old & 16 and self.P["drv"] == 3:
            self.trip(4, self.faults[3])     # instant cut off
        if self.local or self.P["drv"] != 3:
            return
        if v & 1:
            self.ramp_stop()
        elif v & 6 and not self.tripped and v & 6 != 6:
            self.rev = bool(v & 4)
            self.run()

    def command(self, line):
        w = line.split()
        if w and w[0] == "trip":             # bits are stored + 1, for bit 0 is a trip too
            self.stay = "stay" in w
            self.trip(int(w[1], 0) + 1, self.fault_name(int(w[1], 0)))
        else:
            super().command(line)

    def target(self):
        f = self.ref / 100 if self.P["frq"] == 7 else 0.0
        return -f if self.rev else f

    def logic(self, now):
        if self.P["i62"] and self.expired(self.P["i63"], now) and not self.local:
            self.wd_armed = False
            self.coast() if self.P["i62"] == 1 else self.ramp_stop()

    def status(self):
        up = self.mode == "run" and abs(self.goal()) > abs(self.hz) + .05 and self.goal() * self.hz >= 0
        down = self.running and not up and not self.at_ref
        rev = self.hz < 0 if self.hz else self.rev
        ours = not self.local
        return bits(b0=not self.running, b1=self.running and not rev, b2=self.running and rev, b3=self.tripped, b4=up, b5=down,
                    b6=self.at_ref, b8=self.mode == "stop", b11=self.mode == "run" and not self.rev, b12=self.mode == "run" and self.rev,
                    b13=ours and self.P["drv"] == 3, b14=ours and self.P["frq"] == 7)

    def fed(self, fc, a, n, wrote):
        self.wd_armed, self.wd_last = True, time.monotonic()


class Unshifted(IG5A):
    shift = 0


if __name__ == "__main__":
    import sys
    main(Unshifted if len(sys.argv) > 1 and sys.argv[1] == "unshifted" and sys.argv.pop(1) else IG5A)
