#!/usr/bin/env python3
"""INVT Goodrive (GD10/20/100/200 map), commissioned with P00.01=2, P00.06=8 (Modbus)."""
import time
from common import Drive, Ex, bits, main


class Goodrive(Drive):
    name = "Goodrive"
    fcs = (3, 6, 8, 16)
    max_read = max_write = 16
    baud, parity = 19200, "E"
    ro = 7
    faults = {1: "OUt1", 2: "OUt2", 3: "OUt3", 4: "OC1 overcurrent acc", 5: "OC2 overcurrent dec", 6: "OC3 overcurrent const",
              7: "OV1 overvoltage acc", 8: "OV2 overvoltage dec", 9: "OV3 overvoltage const", 10: "UV bus undervoltage",
              11: "OL1 motor overload", 12: "OL2 inverter overload", 13: "SPI input phase", 14: "SPO output phase",
              15: "OH1 rectifier hot", 16: "OH2 IGBT hot", 17: "EF external fault", 18: "CE communication"}

    def setup(self):
        p = self.P
        p.update(p0001=2, p0002=0, p0003=5000, p0006=8, p0108=0, p1404=0.0, p1405=0)
        self.reg(0x2000, lambda: self.cmd, self.command_word)
        self.reg(0x2001, lambda: self.ref, self.set_ref)
        self.reg(0x2100, self.sw1)
        self.reg(0x2101, lambda: bits(b0=True, b6=not self.local))
        self.reg(0x2102, lambda: self.tripped)
        self.reg(0x2103, lambda: 0x010C)
        mon = (lambda: abs(self.out_hz) * 100, lambda: self.ref, lambda: 5400, lambda: abs(self.out_hz) * 8,
               lambda: self.amps * 10, lambda: abs(self.out_hz) * 30, lambda: 0, lambda: 0)
        for i, g in enumerate(mon):
            self.reg(0x3000 + i, g)
        self.reg(0x5000, lambda: self.tripped)           # compatible with older series
        for a, k, lo, hi in ((0x0001, "p0001", 0, 2), (0x0002, "p0002", 0, 3), (0x0006, "p0006", 0, 12), (0x0108, "p0108", 0, 1),
                             (0x0E05, "p1405", 0, 3)):
            self.par(a, k, p[k], lo, hi)
        self.reg(0x0003, lambda: p["p0003"], lambda v: self.not_running() or p.__setitem__("p0003", v))
        self.reg(0x000B, lambda: self.acc * 10, lambda v: self.ramp("acc", v))
        self.reg(0x000C, lambda: self.dec * 10, lambda v: self.ramp("dec", v))
        self.reg(0x0E04, lambda: p["p1404"] * 10, self.set_wd)
        for a in (0x0001, 0x0002, 0x0006, 0x0108, 0x0E05, 0x0003, 0x000B, 0x000C, 0x0E04):
            self.W[a | 0x8000] = self.W[a]               # RAM twin: write only

    def not_running(self):
        if self.running:
            raise Ex(8)

    def set_wd(self, v):
        if v > 600:
            raise Ex(3)
        self.P["p1404"] = v / 10

    def ramp(self, k, v):
        if v > 36000:
            raise Ex(3)
        setattr(self, k, max(v, 1) / 10)

    def power_up(self):
        self.cmd = self.ref = 0
        self.rev = self.jog = False
        self.max_hz = self.P["p0003"] / 100

    def set_ref(self, v):
        if v > self.P["p0003"]:
            raise Ex(3)
        self.ref = v

    def command_word(self, v):
        if not 1 <= v <= 8:
            raise Ex(3)
        self.cmd = v
        if v == 7:
            self.reset_fault()
            return
        if self.local or self.P["p0001"] != 2 or self.P["p0002"] != 0:
            return                                       # Modbus does not own the run command
        if v in (1, 2, 3, 4) and not self.tripped:
            self.rev, self.jog = v in (2, 4), v in (3, 4)
            self.run()
        elif v in (5, 8):
            if v == 5 or self.jog:
                self.coast() if self.P["p0108"] else self.ramp_stop()
        elif v == 6:
            self.coast()

    def target(self):
        f = 5.0 if self.jog else self.ref / 100 if self.P["p0006"] == 8 else 0.0
        return -f if self.rev else f

    def logic(self, now):
        if self.expired(self.P["p1404"], now):
            self.wd_armed = False
            act = int(self.P["p1405"])
            if act == 0:
                self.trip(18, self.faults[18])
            elif act == 3 or act == 2 and not self.local:
                self.ramp_stop()

    def sw1(self):
        if self.tripped:
            return 4
        if not self.running:
            return 3
        return 2 if (self.last_dir == "reverse" if self.hz else self.rev) else 1

    def fed(self, fc, a, n, wrote):
        self.wd_armed, self.wd_last = True, time.monotonic()


if __name__ == "__main__":
    main(Goodrive)
