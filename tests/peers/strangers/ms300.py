#!/usr/bin/env python3
"""Delta MS300 on Modbus RTU, commissioned with 00-20=1, 00-21=2, 09-04 an RTU format."""
import time
from common import Drive, Ex, bits, main


class MS300(Drive):
    name = "MS300"
    fcs = (3, 6, 16)
    max_read = max_write = 20
    nominal, max_hz = 60.0, 60.0
    faults = {1: "ocA", 2: "ocd", 3: "ocn", 4: "GFF", 6: "ocS", 7: "ovA", 8: "ovd", 9: "ovn", 10: "ovS", 11: "LvA", 12: "Lvd",
              13: "Lvn", 14: "LvS", 15: "orP", 16: "oH1", 21: "oL", 22: "EoL1", 24: "oH3", 49: "EF external fault",
              54: "CE1", 55: "CE2", 56: "CE3", 57: "CE4", 58: "CE10 communication time-out"}

    def setup(self):
        p = self.P
        p.update(p0020=1, p0021=2, p0022=0, p0023=0, p0100=6000, p0902=3, p0903=0.0)
        self.reg(0x2000, lambda: self.cmd, self.command_word)
        self.reg(0x2001, lambda: self.ref, self.set_ref)
        self.reg(0x2002, lambda: self.ctl, self.control)
        self.reg(0x2100, lambda: self.warn << 8 | self.tripped & 0xFF)
        self.reg(0x2101, self.status)
        self.reg(0x2102, lambda: self.ref)
        self.reg(0x2103, lambda: abs(self.out_hz) * 100)
        self.reg(0x2104, lambda: self.amps * 100)
        self.reg(0x2105, lambda: 5400)
        self.reg(0x2106, lambda: abs(self.out_hz) * 66)
        self.reg(0x2107, lambda: 0)
        self.reg(0x210A, lambda: 80)
        self.reg(0x210B, lambda: 100)
        self.reg(0x210C, lambda: abs(self.out_hz) * 30)
        self.reg(0x210F, lambda: abs(self.out_hz) * 3)
        self.reg(0x211B, lambda: p["p0100"])
        self.reg(0x211F, lambda: 0x0200)                 # current has two decimals
        for a, k, lo, hi in ((0x0014, "p0020", 0, 8), (0x0015, "p0021", 0, 5), (0x0016, "p0022", 0, 1), (0x0017, "p0023", 0, 2),
                             (0x0902, "p0902", 0, 3)):
            self.par(a, k, p[k], lo, hi)
        self.reg(0x0100, lambda: p["p0100"])
        self.reg(0x010C, lambda: self.acc * 100, lambda v: setattr(self, "acc", max(v, 1) / 100))
        self.reg(0x010D, lambda: self.dec * 100, lambda v: setattr(self, "dec", max(v, 1) / 100))
        self.reg(0x0903, lambda: p["p0903"] * 10, self.set_wd)

    def set_wd(self, v):
        if v > 1000:
            raise Ex(3)
        self.P["p0903"] = v / 10

    def power_up(self):
        self.cmd = self.ref = self.ctl = self.warn = 0
        self.rev = self.bb = self.was = self.jog = False
        self.max_hz = self.P["p0100"] / 100

    def set_ref(self, v):
        if v > 59900:
            raise Ex(3)
        self.ref = min(v, self.P["p0100"])               # bounded by 01-00

    def command_word(self, v):
        self.cmd = v
        if self.local or self.P["p0021"] != 2:
            return
        d, r = v >> 4 & 3, v & 3
        rev = {0: self.rev, 1: False, 2: True, 3: not self.rev}[d]
        if rev and self.P["p0023"] == 1 or not rev and self.P["p0023"] == 2:
            rev = self.rev                               # direction forbidden by 00-23
        self.rev = rev
        if r == 1:
            self.was = self.jog = False
            self.coast() if self.P["p0022"] else self.ramp_stop()
        elif r in (2, 3) and not self.tripped:
            self.jog = r == 3
            self.was = True
            if not self.bb:
                self.run()

    def control(self, v):
        old, self.ctl = self.ctl, v
        if v & 1 and not self.tripped:
            self.trip(49, self.faults[49])
        if v & 2 and not v & 1:
            self.warn = 0
            self.reset_fault()
        self.bb = bool(v & 4)
        if self.bb:
            self.coast()
        elif old & 4 and self.was and not self.tripped:
            self.run()                                   # released: back to the former run

    def on_trip(self):
        self.was = False

    def target(self):
        f = 6.0 if self.jog else self.ref / 100 if self.P["p0020"] == 1 else 0.0
        return -f if self.rev else f

    ramp_trip = 0

    def logic(self, now):
        if self.expired(self.P["p0903"], now):
            act = int(self.P["p0902"])
            self.wd_armed = False
            if act == 0:
                self.warn = 1
            elif act == 1:
                self.ramp_stop()
                self.ramp_trip = 58
                if self.mode == "off":
                    self.stopped("stop")
            elif act == 2:
                self.trip(58, self.faults[58])

    def stopped(self, how):
        super().stopped(how)
        if self.ramp_trip:
            code, self.ramp_trip = self.ramp_trip, 0
            self.trip(code, self.faults[code])

    def status(self):
        if self.mode == "run":
            st = 3 if self.hz or self.target() else 2    # 2: run command, output 0 Hz
        else:
            st = 1 if self.running else 0
        turning = self.hz < 0 if self.hz else self.rev
        want = self.rev if self.mode == "run" else turning
        d = 3 if turning and want else 1 if turning else 2 if want else 0
        ours = not self.local
        return st | bits(b2=self.jog) | d << 3 | bits(b8=ours and self.P["p0020"] == 1, b10=ours and self.P["p0021"] == 2)

    def fed(self, fc, a, n, wrote):
        self.wd_armed, self.wd_last = True, time.monotonic()
        self.warn = 0


if __name__ == "__main__":
    main(MS300)
