#!/usr/bin/env python3
"""Yaskawa A1000 on MEMOBUS/Modbus RTU, commissioned with b1-01=2, b1-02=2 (H5-12=0: FWD and REV bits)."""
import time
from common import Drive, Ex, bits, main


class A1000(Drive):
    name = "A1000"
    fcs = (3, 8, 16)
    max_read = max_write = 16
    slave = 1
    nominal, max_hz = 60.0, 60.0
    faults = {2: "Uv1", 3: "Uv2", 4: "Uv3", 6: "GF ground fault", 7: "oC overcurrent", 8: "ov overvoltage", 9: "oH heatsink", 10: "oH1",
              11: "oL1 motor overload", 12: "oL2 drive overload", 27: "PF", 28: "LF", 33: "CE MEMOBUS communication error",
              39: "EF0 external fault"}

    def setup(self):
        p = self.P
        p.update(b101=2, b102=2, b103=0, b107=0, e104=6000, h504=3, h505=1, h509=2.0, h512=0)
        self.reg(0x0001, lambda: self.cmd, self.command_word)
        self.reg(0x0002, lambda: self.ref, self.set_ref)
        for a in range(0x0003, 0x000A):
            self.reg(a, lambda a=a: self.misc.get(a, 1000 if a == 3 else 0), lambda v, a=a: self.misc.__setitem__(a, v))
        self.reg(0x0020, lambda: bits(b0=self.running, b1=self.reverse(), b2=self.ready(), b3=self.tripped, b14=self.com_ref(), b15=self.com_ctrl()))
        self.reg(0x0021, lambda: {7: 1, 6: 1, 8: 2, 12: 4, 9: 8, 10: 8, 39: 0x40, 11: 0x100, 2: 0x2000}.get(self.tripped, 0x80 if self.tripped else 0))
        self.reg(0x0022, lambda: 0)
        self.reg(0x0023, lambda: abs(self.goal()) * 100 if self.running else self.ref)
        self.reg(0x0024, lambda: abs(self.out_hz) * 100)
        self.reg(0x0025, lambda: abs(self.out_hz) * 66)
        self.reg(0x0026, lambda: self.amps * 100)
        self.reg(0x0027, lambda: abs(self.out_hz) * 3)
        self.reg(0x0028, lambda: 0)
        self.reg(0x0029, lambda: 0)
        self.reg(0x002A, lambda: bits(b2=self.ef_both, b9=self.ce))
        self.reg(0x002B, lambda: 0)
        self.reg(0x002C, lambda: bits(b0=self.running, b1=self.zero(), b2=self.at_ref, b6=self.ready(), b9=not self.com_ref(),
                                      b10=not self.com_ctrl(), b14=self.tripped, b15=self.ce or self.tripped == 33))
        self.reg(0x002D, lambda: bits(b0=self.running, b7=self.tripped))
        self.reg(0x0031, lambda: 540)
        self.reg(0x0034, lambda: 0x4130)                 # "A0"
        self.reg(0x0035, lambda: 0x0041)
        self.reg(0x003D, lambda: 0x40 if self.ce else 0)
        self.reg(0x003E, lambda: abs(self.out_hz) * 30)
        self.reg(0x003F, lambda: abs(self.out_hz) / (p["e104"] / 100) * 10000)
        u1 = {0x40: lambda: self.ref, 0x41: lambda: self.out_hz * 100, 0x42: lambda: self.amps / self.rated_a * 8192, 0x43: lambda: 0,
              0x44: lambda: self.out_hz * 30, 0x45: lambda: abs(self.out_hz) * 66, 0x46: lambda: 540, 0x47: lambda: 0, 0x48: lambda: 0,
              0x49: lambda: 0, 0x4A: lambda: 0}
        for a, g in u1.items():
            self.reg(a, g)
        self.reg(0x004B, lambda: bits(b0=self.running, b1=self.zero(), b2=self.reverse(), b4=self.at_ref, b5=self.ready(), b6=self.ce,
                                      b7=self.tripped, b14=self.com_ref(), b15=self.com_ctrl()))
        self.reg(0x007F, lambda: 0x14 if self.ce else 0)
        self.reg(0x0080, lambda: self.tripped)
        self.reg(0x0081, lambda: self.past)
        for a, k, lo, hi in ((0x0180, "b101", 0, 4), (0x0181, "b102", 0, 3), (0x0182, "b103", 0, 3), (0x0428, "h504", 0, 3), (0x0429, "h505", 0, 1),
                             (0x043D, "h512", 0, 1)):
            self.reg(a, lambda k=k: p[k], lambda v, k=k, lo=lo, hi=hi: self.put(k, v, lo, hi))
        self.reg(0x0303, lambda: p["e104"])
        self.reg(0x0435, lambda: p["h509"] * 10, lambda v: self.put("h509", v / 10, 0, 10))
        self.reg(0x0200, lambda: self.acc * 10, lambda v: self.ramp("acc", v))
        self.reg(0x0201, lambda: self.dec * 10, lambda v: self.ramp("dec", v))
        self.W[0x0900] = self.W[0x0910] = lambda v: v == 0 or self.bad()   # enter: write only, reading gives 02

    def bad(self):
        raise Ex(0x21)

    def put(self, k, v, lo, hi):
        if not lo <= v <= hi:
            raise Ex(0x21)
        if self.running:
            raise Ex(0x22)
        self.P[k] = v

    def ramp(self, k, v):
        if v > 60000:
            raise Ex(0x21)
        setattr(self, k, max(v, 1) / 10)

    def power_up(self):
        self.cmd = self.ref = 0
        self.misc, self.ce, self.ef_both, self.cycle = {}, False, False, False
        self.past = getattr(self, "past", 0)
        self.max_hz = self.P["e104"] / 100

    def set_ref(self, v):
        if v > self.P["e104"]:
            raise Ex(0x21)
        self.ref = v

    def com_ref(self):
        return not self.local and self.P["b101"] == 2

    def com_ctrl(self):
        return not self.local and self.P["b102"] == 2

    def wants(self):
        """(run, reverse) asked for by the word, None if both directions are asked."""
        f, r = self.cmd & 1, self.cmd >> 1 & 1
        if self.P["h512"] == 1:
            return bool(f), bool(r)
        return (None, False) if f and r else (bool(f or r), bool(r))

    def command_word(self, v):
        old, self.cmd = self.cmd, v
        if v & 4 and not self.tripped:
            self.trip(39, self.faults[39])
        if v & 8 and not old & 8 and self.tripped and not v & 3 and not v & 4:
            self.reset_fault()               # refused while a run command is present
        if not v & 3:
            self.cycle = False

    def on_trip(self):
        self.past, self.cycle = self.tripped, True

    def on_remote(self):
        self.cycle = self.P["b107"] == 0     # run must be taken away and given again

    def target(self):
        run, rev = self.wants()
        f = self.ref / 100 if self.com_ref() else 0.0
        return -f if rev else f

    def logic(self, now):
        if self.P["h505"] and self.expired(self.P["h509"], now) and (self.com_ctrl() or self.com_ref()) and not self.ce:
            act = int(self.P["h504"])
            if act == 3:
                self.ce = True               # alarm only, goes on running
            elif act == 1:
                self.trip(33, self.faults[33])
            else:
                self.wd_armed, self.late = False, True
                (self.quick_stop if act == 2 else self.ramp_stop)()
        if self.late and self.mode == "off":
            self.late = False
            self.trip(33, self.faults[33])
        if not self.com_ctrl() or self.tripped or self.late:
            return
        run, rev = self.wants()
        self.ef_both = run is None
        if run and not self.cycle:
            self.run()
        elif self.mode == "run":
            self.coast() if self.P["b103"] == 1 else self.ramp_stop()

    late = False

    def ready(self):
        return not self.tripped

    def zero(self):
        return abs(self.out_hz) < 0.5

    def reverse(self):
        return self.out_hz < 0 or self.running and not self.out_hz and self.goal() < 0

    def fed(self, fc, a, n, wrote):
        self.wd_armed, self.wd_last, self.ce = True, time.monotonic(), False


if __name__ == "__main__":
    main(A1000)
