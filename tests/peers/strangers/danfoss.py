#!/usr/bin/env python3
"""Danfoss VLT FC 102 / FC 202 / FC 51 on Modbus RTU, FC profile: coils and registers at once."""
import time
from common import Drive, Ex, bits, main, s16


class FC(Drive):
    name = "FC102"
    fcs = (1, 3, 5, 6, 15, 16, 11, 17)
    parity = "E"
    model = 102
    guard_default = 60.0
    faults = {2: "alarm 2 live zero", 4: "alarm 4 mains phase loss", 7: "alarm 7 DC overvoltage",
              8: "alarm 8 DC undervoltage", 9: "alarm 9 inverter overloaded", 10: "alarm 10 motor ETR",
              11: "alarm 11 motor thermistor", 12: "alarm 12 torque limit", 13: "alarm 13 overcurrent",
              14: "alarm 14 earth fault", 16: "alarm 16 short circuit", 17: "alarm 17 control word time-out",
              29: "alarm 29 heat sink", 38: "alarm 38 internal fault"}
    # bit of 16-90 alarm word for a fault number (HVAC programming guide)
    word_bit = {29: 1, 14: 2, 17: 4, 13: 5, 12: 6, 11: 7, 10: 8, 9: 9, 8: 10, 7: 11, 16: 12, 4: 14, 38: 23, 2: 16}

    def setup(self):
        p = self.P
        p.update(p802=1, p803=self.guard_default, p804=0, p810=0, p303=self.nominal, p341=float(self.args.ramp),
                 p342=float(self.args.ramp), p381=self.args.ramp / 3, p419=65.0, p310=0.0, p801=0)
        for i in range(16):
            self.C[i] = lambda i=i: self.ctw >> i & 1
            self.CW[i] = lambda v, i=i: self.coil_in(i, v)
            self.C[16 + i] = lambda i=i: self.ref >> i & 1
            self.CW[16 + i] = lambda v, i=i: self.coil_ref(i, v)
            self.C[32 + i] = lambda i=i: self.stw() >> i & 1
            self.C[48 + i] = lambda i=i: int(self.mav()) >> i & 1
        self.C[64] = lambda: self.store
        self.CW[64] = lambda v: setattr(self, "store", v)
        self.reg(49999, lambda: self.ctw, lambda v: setattr(self, "pend", v))
        self.reg(50009, lambda: self.ref, lambda v: setattr(self, "ref", v))
        self.reg(50199, self.stw)
        self.reg(50209, self.mav)
        if self.model != 51:                 # second window of the newer guides
            self.reg(2809, lambda: self.ctw, lambda v: setattr(self, "pend", v))
            self.reg(2810, lambda: self.ref, lambda v: setattr(self, "ref", v))
            self.reg(2909, self.stw)
            self.reg(2910, self.mav)
        self.reg(6, lambda: self.last_err)   # doc 7: last error from the parameter data base
        P = lambda n: n * 10 - 1             # parameter n at register n*10
        self.reg(P(802), lambda: p["p802"])
        self.reg32(P(803), lambda: p["p803"] * 10, lambda v: self.guard(v))
        self.par(P(804), "p804", 0, 0, 5)
        self.reg(P(810), lambda: p["p810"])
        self.reg32(P(303), lambda: p["p303"] * 1000)
        self.reg32(P(341), lambda: self.acc * 100, lambda v: self.ramp("acc", v))
        self.reg32(P(342), lambda: self.dec * 100, lambda v: self.ramp("dec", v))
        self.reg(P(1600), lambda: self.ctw)
        self.reg32(P(1601), lambda: self.percent() * p["p303"] * 10)
        self.reg(P(1602), lambda: self.percent() * 1000)
        self.reg(P(1603), self.stw)
        self.reg32(P(1610), lambda: abs(self.out_hz) * 15)
        self.reg(P(1612), lambda: abs(self.out_hz) * 80)
        self.reg(P(1613), lambda: abs(self.out_hz) * 10)
        self.reg32(P(1614), lambda: self.amps * 100)
        self.reg32(P(1617), lambda: self.out_hz * 30)
        self.reg(P(1630), lambda: 540)
        self.reg(P(1634), lambda: 35)
        self.reg32(P(1690), lambda: 1 << self.word_bit.get(self.tripped, 0) if self.tripped else 0)
        self.reg(P(1530), lambda: self.last_fault)

    def reg32(self, a, get, put=None):
        g = lambda: int(round(get())) & 0xFFFFFFFF
        self.reg(a, lambda: g() >> 16, put and (lambda v: setattr(self, "hi", v)))
        self.reg(a + 1, lambda: g() & 0xFFFF, put and (lambda v: put(self.hi << 16 | v)))

    def guard(self, v):
        if not 5 <= v <= 180000:
            raise Ex(3)
        self.P["p803"] = v / 10

    def ramp(self, k, v):
        if not 1 <= v <= 360000:
            raise Ex(3)
        setattr(self, k, v / 100)

    hi = 0

    def power_up(self):
        self.ctw, self.pend, self.ref, self.coils = 0, None, 0, 0
        self.store, self.last_err, self.warn, self.timed_out = False, 0, False, False
        self.last_fault = getattr(self, "last_fault", 0)
        self.acc, self.dec, self.quick_s = self.P["p341"], self.P["p342"], self.P["p381"]
        self.max_hz, self.need_edge, self.override = self.P["p419"], False, None

    # ---- the control word, by coils or by a register
    def coil_in(self, i, v):
        base = self.coils if self.pend is None else self.pend
        self.pend = base & ~(1 << i) | bool(v) << i

    def coil_ref(self, i, v):
        self.ref = self.ref & ~(1 << i) | bool(v) << i

    def take(self):
        if self.pend is None:
            return
        v, self.pend = self.pend, None
        self.coils = v                       # what the coils show stays, obeyed or not
        if not v & 0x0400:                   # bit 10: data not valid, the word is ignored
            return
        self.wd_armed, self.wd_last = True, time.monotonic()
        if self.timed_out and self.P["p804"] not in (5,):
            self.timed_out, self.override = False, None
        old, self.ctw = self.ctw, v
        if v & 0x80 and not old & 0x80 and self.tripped:
            self.reset_fault()

    def written(self, a, n):
        self.take()

    written_bits = written

    def fed(self, fc, a, n, wrote): pass     # only a valid control word feeds (take)

    def after_reset(self):
        self.timed_out, self.override, self.warn = False, None, False

    def on_trip(self):
        self.last_fault = self.tripped

    def percent(self):
        return s16(self.ref) / 0x4000

    def target(self):
        if self.override is not None:
            return self.override
        v = self.ctw
        if not v & 0x20:
            return self.hz                   # freeze
        if v & 0x100:
            f = 5.0                          # jog 3-11
        else:
            f = self.percent() * self.P["p303"]
            if v & 3:
                f = 0.0                      # preset references 3-10: 0 at the works
        return -f if v & 0x8000 else f

    def logic(self, now):
        if self.expired(self.P["p803"], now) and self.P["p804"] and not self.timed_out and not self.local:
            self.timed_out, self.warn = True, True
            act = int(self.P["p804"])
            self.override = {1: self.hz, 3: 5.0, 4: self.max_hz}.get(act)
            if act == 2:
                self.ramp_stop()
            if act == 5:
                self.ramp_stop()
                self.trip_at_rest = True
        if self.timed_out and self.override is None:
            if self.mode == "off" and getattr(self, "trip_at_rest", False):
                self.trip_at_rest = False
                self.trip(17, self.faults[17])
            return
        if self.local or self.tripped or self.timed_out:
            return
        v = self.ctw
        if not v & 0x0400:
            return                           # no valid word since power-up
        if not v & 8:
            self.coast()
        elif not v & 4:                      # DC brake and stop
            self.quick_stop()
        elif not v & 0x10:
            self.quick_stop()
        elif v & 0x40 or v & 0x100:
            self.run()
        elif self.mode == "run":
            self.ramp_stop()

    def stw(self):
        v, ok = self.ctw, not self.tripped
        coasted = not v & 8 and not self.local
        return bits(b0=ok, b1=ok, b2=ok and not coasted, b3=self.tripped, b6=self.tripped in (14, 16, 38),
                    b7=self.warn, b8=self.running and abs(self.hz - self.goal()) < 0.05 and self.mode == "run",
                    b9=not self.local, b10=abs(self.hz) <= self.max_hz, b11=self.running)

    def mav(self):
        return max(-32768, min(32767, round(self.out_hz / self.P["p303"] * 0x4000)))

    def reset_fault(self):
        if self.tripped in (14, 16, 38):     # trip lock: only after the mains has been off
            return False
        return super().reset_fault()

    def other(self, fc, pdu):
        from pymodbus.pdu.other_message import GetCommEventCounterResponse, ReportDeviceIdResponse
        if fc == 11:
            return GetCommEventCounterResponse(count=0)
        r = ReportDeviceIdResponse(identifier=("FC %d" % self.model).encode(), status=True)
        return r


class FC202(FC):
    name, model = "FC202", 202


class FC51(FC):
    name, model = "FC51", 51
    guard_default = 1.0                      # Micro Drive, parameter 8-03 (doubt, see README)


if __name__ == "__main__":
    import sys
    kind = "102"
    if len(sys.argv) > 1 and sys.argv[1] in ("102", "202", "51"):
        kind = sys.argv.pop(1)
    main({"102": FC, "202": FC202, "51": FC51}[kind])
