#!/usr/bin/env python3
"""Siemens SINAMICS G120/G120C on Modbus RTU (p2030=2): PROFIdrive words; process data watched by p2040."""
import time
from common import Ex, bits, main
from v20 import V20


class G120(V20):
    name = "G120"
    baud, parity = 19200, "E"
    faults = {1910: "F01910 fieldbus setpoint timeout", 30001: "F30001 overcurrent", 30002: "F30002 DC overvoltage",
              30003: "F30003 DC undervoltage", 30004: "F30004 overtemperature", 7011: "F07011 motor overtemperature",
              7860: "F07860 external fault", 7900: "F07900 motor blocked"}

    def setup(self):
        p = self.P
        p.update(p2000=1500.0, p1082=50.0, p1120=float(self.args.ramp), p1121=float(self.args.ramp), p1135=self.quick_s,
                 p2040=100.0, p2014=0, ilim=1500)
        self.reg(99, lambda: self.stw, self.control_word)
        self.reg(100, lambda: self.hsw, self.setpoint)
        self.reg(109, self.zsw)
        self.reg(110, lambda: self.out_hz * 30 / p["p2000"] * 0x4000)
        for a in list(range(101, 109)) + list(range(111, 119)):
            self.reg(a, lambda: 0)           # reserved or write-only: zeros, no exception
        self.reg(300, lambda: 470)           # firmware
        self.reg(319, lambda: 150)
        self.par(320, "ilim", 1500, 100, 4000, bad=4)
        for a, k in ((321, "p1120"), (322, "p1121")):
            self.reg(a, lambda k=k: p[k] * 100, lambda v, k=k: self.ramp_par(k, v))
        self.reg(323, lambda: p["p2000"], self.set_p2000)
        self.reg(339, lambda: self.goal() * 30 if self.running else 0)
        self.reg(340, lambda: self.out_hz * 30)
        self.reg(341, lambda: self.out_hz * 100)
        self.reg(342, lambda: abs(self.out_hz) * 8)
        self.reg(343, lambda: 540)
        self.reg(344, lambda: self.amps * 100)
        self.reg(345, lambda: 250 if self.running else 0)
        self.reg(346, lambda: abs(self.out_hz) * 1.5)
        self.reg(347, lambda: 12)
        self.reg(348, lambda: 0 if self.local else 1)
        for i in range(8):
            self.reg(399 + i, lambda i=i: self.hist[i])
        self.reg(407, lambda: 0)

    def set_p2000(self, v):
        if not 6 <= v <= 65000 or self.running:
            raise Ex(4)
        self.P["p2000"] = float(v)

    def target(self):
        v = self.stw
        if not v & 0x10 or not v & 0x40:
            return 0.0
        if not v & 0x20:
            return self.hz
        f = self.hsw / 0x4000 * self.P["p2000"] / 30
        return -f if v & 0x800 else f

    def logic(self, now):
        if self.expired(self.P["p2040"] / 1000, now):
            self.wd_armed = False
            self.trip(1910, self.faults[1910])
        self.step()

    def zsw(self):
        w = super().zsw()
        return w & ~(1 << 12)

    def fed(self, fc, a, n, wrote):
        if wrote and a <= 100 and a + n > 99:
            self.wd_armed, self.wd_last = True, time.monotonic()


if __name__ == "__main__":
    main(G120)
