#!/usr/bin/env python3
"""Siemens SINAMICS V20 on Modbus RTU, commissioned with P0700=5, P1000=5, P2023=2."""
from common import Drive, Ex, bits, main, s16


class V20(Drive):
    name = "V20"
    fcs = (3, 6, 16)
    ro = 4                                   # write to a read-only register: 04 (manual p111)
    faults = {1: "F1 overcurrent", 2: "F2 overvoltage", 3: "F3 undervoltage", 4: "F4 drive overtemperature",
              5: "F5 drive I2t", 11: "F11 motor overtemperature", 72: "F72 USS/MODBUS setpoint fault",
              85: "F85 external fault"}

    def setup(self):
        p = self.P
        p.update(p2000=50.0, p1082=50.0, p1120=float(self.args.ramp), p1121=float(self.args.ramp), p1135=5.0 / 3,
                 p2014=0, p2010=6, p0700=5, wdog=0, wdog_action=0, ilim=1500)
        p["p1135"] = self.quick_s
        # plain map, 40001..: single bits of the same control word
        self.par(0, "wdog", 0)
        self.par(1, "wdog_action", 0, 0, 1, bad=4)
        self.reg(2, lambda: abs(self.hsw) * 10000 / 0x4000, self.freq_pct)
        for a, bit in ((3, 3), (4, 11), (5, 0), (6, 7)):
            self.reg(a, lambda b=bit: self.stw >> b & 1, lambda v, b=bit: self.one_bit(b, v))
        self.par(9, "ilim", 1500, 100, 4000, bad=4)
        for a, k in ((10, "p1120"), (11, "p1121")):
            self.reg(a, lambda k=k: p[k] * 100, lambda v, k=k: self.ramp_par(k, v))
        self.reg(15, lambda: p["p2000"] * 100, self.set_p2000)
        for a in range(16, 23):              # 40017..40023: limits and gains of the PID controller (2012, p112)
            self.reg(a, lambda: 0)
        for base, scale in ((23, 1), (341, 1)):
            self.reg(base, lambda: self.out_hz * 100)
        self.reg(24, lambda: self.out_hz * 30)
        self.reg(25, lambda: self.amps * 100)
        self.reg(26, lambda: self.out_hz and 250)
        self.reg(27, lambda: abs(self.out_hz) * 1.5)
        self.reg(28, lambda: 12)
        self.reg(29, lambda: 540)
        # process data, 40100.. / 40110..
        self.reg(99, lambda: self.stw, self.control_word)
        self.reg(100, lambda: self.hsw, self.setpoint)
        self.reg(109, self.zsw)
        self.reg(110, lambda: self.out_hz / p["p2000"] * 0x4000)
        # 40324 reference, 4034x monitors, 40400 faults
        self.reg(323, lambda: p["p2000"] * 100, self.set_p2000)
        self.reg(343, lambda: 540)
        self.reg(344, lambda: self.amps * 100)
        for i in range(8):
            self.reg(399 + i, lambda i=i: self.hist[i])
        self.reg(407, lambda: 0)

    def power_up(self):
        self.stw, self.hsw, self.hist = 0, 0, [0] * 8
        self.inhibit, self.on = True, False
        self.acc, self.dec, self.quick_s = self.P["p1120"], self.P["p1121"], self.P["p1135"]
        self.max_hz = self.P["p1082"]

    # ---- writes
    def set_p2000(self, v):
        if not 100 <= v <= 59900:
            raise Ex(4)
        if self.running:
            raise Ex(4)
        self.P["p2000"] = v / 100

    def ramp_par(self, k, v):
        if not 0 <= v <= 65000:
            raise Ex(4)
        self.P[k] = v / 100
        self.acc, self.dec = self.P["p1120"], self.P["p1121"]

    def freq_pct(self, v):
        if v > 10000:
            raise Ex(4)
        self.hsw = round(v * 0x4000 / 10000)

    def setpoint(self, v):
        self.hsw = s16(v)

    def one_bit(self, b, v):
        if v not in (0, 1):
            raise Ex(4)
        # the plain map presets what it does not show: OFF2, OFF3, ramp, PLC control
        self.control_word((self.stw | 0x0476) & ~(1 << b) | v << b)

    def control_word(self, v):
        if not v & 0x0400:                   # no control by PLC: the telegram is ignored
            return
        old, self.stw = self.stw, v
        if v & ~old & 0x80 and self.tripped:
            if self.reset_fault() and v & 1:
                self.inhibit = True          # acknowledged with ON still set
        self.step(bool(v & ~old & 1))

    def step(self, edge=False):
        v = self.stw
        if self.local:
            return
        if self.tripped:
            self.on = False
            return
        if not v & 2:                        # OFF2: coast
            self.coast()
            self.on, self.inhibit = False, True
        elif not v & 4:                      # OFF3: quick stop
            self.quick_stop()
            self.on, self.inhibit = False, True
        elif not v & 1:                      # OFF1
            self.inhibit = False
            self.on = False
            self.ramp_stop()
        elif edge and not self.inhibit:
            self.on = True
        if self.on:
            if v & 8:
                self.run()
            else:
                self.coast()                 # pulses cancelled

    def logic(self, now):
        if self.expired(self.P["p2014"] / 1000, now):
            self.wd_armed = False
            self.trip(72, self.faults[72])
        self.step()

    def target(self):
        v = self.stw
        if not v & 0x10 or not v & 0x40:     # ramp generator off / setpoint disabled
            return 0.0
        if not v & 0x20:
            return self.hz                   # frozen
        f = self.hsw / 0x4000 * self.P["p2000"]
        return -f if v & 0x0800 else f

    def move(self, dt):
        super().move(dt)
        if self.mode == "run" and not self.local and not self.stw & 0x10:
            self.coast_to_zero()

    def coast_to_zero(self):                 # ramp output 0: the drive brakes as hard as it can
        self.hz *= 0.9

    def on_trip(self):
        self.on = False
        self.hist = [self.tripped] + self.hist[:7]

    def after_reset(self):
        self.hist = [0] + self.hist[1:] if self.hist[0] else self.hist
        self.inhibit = bool(self.stw & 1)

    def on_remote(self):
        self.inhibit, self.on = bool(self.stw & 1), False

    def zsw(self):
        v, hz = self.stw, abs(self.out_hz)
        ready = not self.tripped and not self.inhibit
        return bits(b0=ready, b1=ready and (self.on or self.running), b2=self.running, b3=self.tripped,
                    b4=v & 2, b5=v & 4, b6=self.inhibit, b8=not self.running or self.at_ref, b9=not self.local,
                    b10=hz >= self.max_hz - 0.01, b11=True, b13=True, b14=self.last_dir == "forward", b15=True)

    def write_words(self, a, vals, fc=16):
        """FC 16: a write that cannot be done answers an exception, the others are done (2019, p185)."""
        if not 1 <= len(vals) <= self.max_write:
            raise Ex(3)
        if a + len(vals) - 1 > 521 or 62 <= a < 99:
            raise Ex(2)
        bad = None
        for i, v in enumerate(vals):
            try:
                if a + i not in self.W:
                    raise Ex(4)              # zero entry or read-only
                self.W[a + i](v)
            except Ex as e:
                bad = e
        if bad:
            raise bad

    def fed(self, fc, a, n, wrote):
        if wrote and any(x in (2, 3, 4, 5, 6) or 99 <= x <= 106 for x in range(a, a + n)):
            import time
            self.wd_armed, self.wd_last = True, time.monotonic()


if __name__ == "__main__":
    main(V20)
