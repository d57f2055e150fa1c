#!/usr/bin/env python3
"""ABB ACS355 / ACS550 embedded Modbus, ABB Drives profile (5305 = 2 ABB DRV FULL, 0 = LIM, 1 = DCU)."""
import time
from common import Drive, Ex, bits, main, s16


class ACS355(Drive):
    name = "ACS355"
    fcs = (1, 2, 3, 4, 5, 6, 15, 16, 23)
    stop = 2
    no_run_enable = False
    faults = {1: "overcurrent", 2: "DC overvolt", 3: "device overtemp", 4: "short circ", 6: "DC undervolt", 7: "AI1 loss", 9: "mot overtemp",
              10: "panel loss", 12: "motor stall", 14: "ext fault 1", 15: "ext fault 2", 16: "earth fault", 22: "supply phase", 24: "overspeed",
              28: "serial 1 err"}
    has_read_back = True

    def setup(self):
        p = self.P
        p.update(p5305=2, p1105=self.nominal, p3018=0, p3019=3.0, p5310=103, p5311=104, p5312=0, p5313=0, p5314=0, p5315=0,
                 p5316=0, p5317=0, p2008=self.nominal, p1601=0)
        self.reg(0, lambda: self.cw, self.command_word)
        self.reg(1, lambda: self.ref1, lambda v: setattr(self, "ref1", v))
        self.reg(2, lambda: self.ref2, lambda v: setattr(self, "ref2", v))
        self.reg(3, self.sw)
        for i in range(8):
            self.reg(4 + i, lambda i=i: self.actual(int(p["p53%d" % (10 + i)])))
        self.reg(30, lambda: self.dcu, self.dcu_word)
        self.reg(31, lambda: 0, lambda v: None)
        self.reg(32, self.dcu_status)
        self.reg(33, lambda: 0)
        for i in range(16):                  # coils and inputs mirror command and status word
            self.C[i] = lambda i=i: self.cw >> i & 1
            self.CW[i] = lambda v, i=i: setattr(self, "pend", (self.cw if self.pend is None else self.pend) & ~(1 << i) | bool(v) << i)
            self.D[i] = lambda i=i: self.sw() >> i & 1
        for i in range(16, 32):
            self.C[i] = lambda: 0
            self.D[i] = lambda: 0
        # parameter group.index at group*100 + index - 1
        G = lambda g, i: g * 100 + i - 1
        mon = {(1, 1): lambda: bits(), (1, 2): lambda: self.out_hz * 30, (1, 3): lambda: abs(self.out_hz) * 10,
               (1, 4): lambda: self.amps * 10, (1, 5): lambda: 0, (1, 6): lambda: abs(self.out_hz) / 5, (1, 7): lambda: 540,
               (1, 9): lambda: abs(self.out_hz) * 8, (1, 10): lambda: 350, (4, 1): lambda: self.hist[0], (4, 12): lambda: self.hist[1],
               (4, 13): lambda: self.hist[2]}
        self.mon = mon
        for (g, i), f in mon.items():
            self.reg(G(g, i), f)
        self.par(G(53, 5), "p5305", 2, 0, 2)
        for i in range(8):
            self.par(G(53, 10 + i), "p53%d" % (10 + i), p["p53%d" % (10 + i)], 0, 199)
        if self.has_read_back:
            self.reg(G(53, 19), lambda: self.cw)
            self.reg(G(53, 20), self.sw)
        self.par(G(30, 18), "p3018", 0, 0, 3)
        self.reg(G(30, 19), lambda: p["p3019"] * 10, lambda v: p.__setitem__("p3019", v / 10))
        self.reg(G(11, 5), lambda: p["p1105"] * 10)
        self.reg(G(20, 8), lambda: p["p2008"] * 10)
        self.reg(G(22, 2), lambda: self.acc * 10, lambda v: setattr(self, "acc", max(v, 1) / 10))
        self.reg(G(22, 3), lambda: self.dec * 10, lambda v: setattr(self, "dec", max(v, 1) / 10))

    def actual(self, sel):
        f = self.mon.get((sel // 100, sel % 100))
        return f() if f else 0

    def power_up(self):
        self.cw = self.ref1 = self.ref2 = self.dcu = 0
        self.pend, self.warn, self.safe, self.lost = None, False, None, False
        self.st = "not_ready"
        if not hasattr(self, "hist"):
            self.hist = [0, 0, 0]
        self.max_hz = self.P["p2008"]

    # ---- ABB Drives profile (ACS355 manual, state diagram p319)
    def command_word(self, v):
        old = self.cw
        self.safe, self.lost = None, False
        if self.P["p5305"] == 1:
            self.cw = v
            return
        if self.P["p5305"] == 2 and not v & 0x400 and (v or self.ref1):
            return                           # FULL, bit 10 = 0: the last command word is kept
        self.cw = v
        if v & 0x80 and not old & 0x80 and self.tripped:
            if self.reset_fault():
                self.st = "inhibit"
        self.profile()

    def written_bits(self, a, n):
        if self.pend is not None:
            v, self.pend = self.pend, None
            self.command_word(v)

    def profile(self):
        v = self.cw
        if self.tripped:
            self.st = "fault"
            return
        if self.local or self.lost:
            return
        if not v & 2:                        # OFF2: coast
            self.coast()
            self.st = "inhibit" if v & 1 else "not_ready"
        elif not v & 4:                      # OFF3: ramp 2208
            self.quick_stop()
            self.st = "inhibit" if v & 1 or self.mode != "off" else "not_ready"
        elif not v & 1:                      # OFF1: ramp, then READY TO SWITCH ON
            self.ramp_stop()
            self.st = "off1" if self.mode != "off" else "ready_on"
        else:
            if self.st == "off1":
                self.st = "ready_op"         # OFF1 taken back while ramping
            if self.st == "ready_on":
                self.st = "ready_op"
            if self.st == "ready_op" and v & 8:
                self.st = "enabled"
            if self.st == "enabled":
                if v & 8:
                    self.run()
                else:                        # OPERATION INHIBITED: coast
                    self.coast()
                    self.st = "ready_op"

    def target(self):
        if self.safe is not None:
            return self.safe
        v = self.cw
        if self.P["p5305"] != 1:
            if not v & 0x40 or self.P["p5305"] == 2 and not v & 0x10:
                return 0.0                   # ramp input zero; ramp output zero (FULL only)
            if not v & 0x20:
                return self.hz if self.hz else 0.0
        f = s16(self.ref1) / 20000 * self.P["p1105"]
        if self.P["p5305"] == 1 and self.dcu & 4:
            f = -f
        return f

    # ---- DCU profile
    def dcu_word(self, v):
        old, self.dcu = self.dcu, v
        self.safe, self.lost = None, False
        if self.P["p5305"] != 1 or self.local:
            return
        if v & 0x10 and not old & 0x10:
            self.reset_fault()
        if self.tripped:
            return
        if v & 0x40:
            self.coast()
        elif v & 1:
            self.ramp_stop()
        elif v & 2:
            self.run()                       # 0 is "no operation": the last command stays

    def dcu_status(self):
        up = self.mode == "run" and abs(self.goal()) > abs(self.hz) + .05
        return bits(b0=not self.tripped, b1=True, b2=self.running, b3=self.running, b4=abs(self.hz) < .1, b5=up,
                    b6=self.running and not up and not self.at_ref, b7=self.at_ref, b10=self.goal() < 0, b11=self.hz < 0,
                    b12=self.local, b15=self.tripped)

    def sw(self):
        v, s = self.cw, self.st
        on = s in ("ready_op", "enabled")
        return bits(b0=s in ("ready_on", "ready_op", "enabled", "off1"), b1=on, b2=s == "enabled", b3=self.tripped,
                    b4=v & 2, b5=v & 4, b6=s == "inhibit", b7=self.warn, b8=s == "enabled" and self.at_ref, b9=not self.local,
                    b10=False, b12=True)

    def logic(self, now):
        act = int(self.P["p3018"])
        if act and self.expired(self.P["p3019"], now) and not self.local:
            self.wd_armed = False
            if act == 1:
                self.trip(28, self.faults[28])
            else:
                self.warn, self.lost = True, True
                self.safe = 5.0 if act == 2 else self.hz
        if self.P["p5305"] != 1:
            self.profile()

    def on_trip(self):
        self.st, self.hist = "fault", [self.tripped] + self.hist[:2]

    def after_reset(self):
        self.st, self.warn = "inhibit", False

    def on_remote(self):
        self.st = "fault" if self.tripped else "inhibit" if self.cw & 1 else "not_ready"

    def read_words(self, a, n, fc=3):
        if fc == 4:                          # 3xxxx: analogue inputs only
            if a + n > 2 or n < 1:
                raise Ex(2)
            return [0] * n
        return super().read_words(a, n, fc)

    def fed(self, fc, a, n, wrote):
        if wrote or a < 12:
            self.wd_armed, self.wd_last, self.warn = True, time.monotonic(), False


class ACS550(ACS355):
    name = "ACS550"
    has_read_back = False                    # 5318.. differ by model

    def setup(self):
        super().setup()
        self.P["p5305"] = 0                  # ABB DRV LIM


if __name__ == "__main__":
    import sys
    kinds = {"355": ACS355, "550": ACS550}
    main(kinds[sys.argv.pop(1)] if len(sys.argv) > 1 and sys.argv[1] in kinds else ACS355)
