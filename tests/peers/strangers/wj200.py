#!/usr/bin/env python3
"""Hitachi WJ200 on Modbus RTU, commissioned with A001=03, A002=03: coils, level-held commands."""
import time
from common import Drive, Ex, bits, main


class WJ200(Drive):
    name = "WJ200"
    fcs = (1, 3, 5, 6, 8, 15, 16, 23)
    max_read = max_write = 16
    max_coils = 32
    faults = {1: "E01 overcurrent const", 2: "E02 overcurrent dec", 3: "E03 overcurrent acc", 4: "E04 overcurrent",
              5: "E05 overload", 7: "E07 overvoltage", 8: "E08 EEPROM", 9: "E09 undervoltage", 11: "E11 CPU",
              12: "E12 external trip", 14: "E14 ground fault", 15: "E15 input overvoltage", 21: "E21 temperature",
              30: "E30 driver", 35: "E35 thermistor", 41: "E41 Modbus communication error"}

    def setup(self):
        p = self.P
        p.update(a001=3, a002=3, a003=5000, a004=5000, c076=2, c077=0.0, b091=0)
        self.wc = {0: "run", 1: "dir", 2: "ext", 3: "rst"}
        for a, k in self.wc.items():
            self.C[a] = lambda k=k: self.cmd[k]
            self.CW[a] = lambda v, k=k: self.put_coil(k, v)
        for a in range(6, 13):               # intelligent inputs 1..7
            self.C[a] = lambda a=a: self.inp.get(a, False)
            self.CW[a] = lambda v, a=a: self.inp.__setitem__(a, v)
        # printed list of the manual, B-24, less one; 0x27 ZS is "output 0 Hz", not "shaft stands"
        st = {0x0E: lambda: self.running, 0x0F: lambda: self.reverse(), 0x10: lambda: not self.tripped,
              0x12: lambda: self.running, 0x13: lambda: self.at_ref, 0x17: lambda: self.tripped, 0x18: lambda: self.at_ref,
              0x27: lambda: abs(self.out_hz) < 0.01}
        for a in range(0x0E, 0x2C):
            self.C[a] = st.get(a, lambda: False)
        # holding registers, frame address = printed number - 1
        self.reg(0, lambda: self.ref >> 16, lambda v: self.set_ref(v << 16 | self.ref & 0xFFFF))
        self.reg(1, lambda: self.ref, lambda v: self.set_ref(self.ref & 0xFFFF0000 | v))
        self.reg(2, self.state_a)
        self.reg(3, lambda: 2 if self.tripped else 1 if self.running else 0)
        self.reg(4, self.state_c)
        self.reg(0x10, lambda: self.count)
        for n in range(3):
            for i in range(10):
                self.reg(0x11 + 10 * n + i, lambda n=n, i=i: self.rec[n][i])
        self.reg(0x1000, lambda: 0)
        self.reg(0x1001, lambda: abs(self.out_hz) * 100)
        self.reg(0x1002, lambda: self.amps * 100)
        self.reg(0x1003, lambda: 0 if not self.running else 2 if self.reverse() else 1)
        self.reg(0x1018, lambda: 350)
        self.reg(0x1025, lambda: 540)        # d102 DC bus
        self.reg(0x1102, lambda: 0)
        self.reg(0x1103, lambda: self.acc * 100, lambda v: self.ramp("acc", v))
        self.reg(0x1104, lambda: 0)
        self.reg(0x1105, lambda: self.dec * 100, lambda v: self.ramp("dec", v))
        self.par(0x1200, "a001", 3, 0, 10, bad=0x21, ok=lambda: True)
        self.par(0x1201, "a002", 3, 1, 4, bad=0x21, ok=lambda: True)
        # coils as words
        self.reg(0x1E00, self.word_1e01)
        self.reg(0x1F00, lambda: self.cmd["run"] << 1 | self.cmd["dir"] << 2 | self.cmd["ext"] << 3
                 | self.cmd["rst"] << 4, self.word_1f01)

    def power_up(self):
        self.cmd = dict(run=False, dir=False, ext=False, rst=False)
        self.inp, self.ref = {}, 0
        if not hasattr(self, "rec"):
            self.rec, self.count = [[0] * 10 for _ in range(3)], 0

    def set_ref(self, v):
        if v > 40000:                        # 400.00 Hz is the type's limit
            raise Ex(0x21)
        self.ref = v

    def ramp(self, k, v):
        if not 1 <= v <= 65535:
            raise Ex(0x21)
        setattr(self, k, v / 100)

    def put_coil(self, k, v):
        old, self.cmd[k] = self.cmd[k], v
        if k == "ext" and v and not old:
            self.trip(12, self.faults[12])
        if k == "rst" and v and not old:
            if self.tripped:
                if self.reset_fault():
                    self.ready_at = time.monotonic() + 1.0   # starts anew; no answers for about 1 s

    def word_1f01(self, v):
        for b, k in ((1, "run"), (2, "dir"), (3, "ext"), (4, "rst")):
            self.put_coil(k, bool(v >> b & 1))

    def on_trip(self):
        self.count += 1
        self.rec = [[self.tripped, 0, 0, round(abs(self.hz) * 100), round(self.rated_a * 100), 540, 0, 1, 0, 1]] + self.rec[:2]

    def logic(self, now):
        if self.expired(self.P["c077"], now):
            self.wd_armed = False
            act = int(self.P["c076"])
            if act == 0:
                self.trip(41, self.faults[41])
            elif act == 1:
                self.ramp_stop()
                self.late_trip = True
            elif act == 3:
                self.coast(); self.cmd["run"] = False
            elif act == 4:
                self.ramp_stop(); self.cmd["run"] = False
        if self.local or self.tripped:
            return
        if self.cmd["rst"]:                  # RS held: output off (C102 = 00)
            self.coast()
        elif self.late():
            pass
        elif self.cmd["run"] and self.P["a002"] == 3:
            # level: a run coil still set at the reset of a trip starts the motor again (manual's warning)
            self.run()
        elif self.mode == "run":
            self.ramp_stop()

    late_trip = False

    def late(self):
        if self.late_trip and self.mode == "off":
            self.late_trip = False
            self.trip(41, self.faults[41])
        return self.late_trip

    def target(self):
        f = self.ref / 100 if self.P["a001"] == 3 else 0.0
        return -f if self.cmd["dir"] else f

    def reverse(self):
        return (self.last_dir == "reverse") if self.running and self.hz else self.cmd["dir"]

    def state_a(self):
        return 8 if self.tripped else 3 if self.running else 2

    def state_c(self):
        if not self.running:
            return 1
        return 3 if self.at_ref else 4 if self.mode == "run" and abs(self.goal()) > abs(self.hz) else 2

    def word_1e01(self):
        return bits(b0=self.reverse(), b1=not self.tripped, b3=self.running, b4=self.at_ref, b8=self.tripped)

    def fed(self, fc, a, n, wrote):
        self.wd_armed, self.wd_last = True, time.monotonic()

    def read_bits(self, a, n, fc=1):
        """Coils beyond the defined range are sent as 0 (WJ-C1, 11-2-2)."""
        if not 1 <= n <= self.max_coils:
            raise Ex(3)
        if a not in self.C and a > 0x58:
            raise Ex(2)
        return [bool(self.C[i]()) if i in self.C else False for i in range(a, a + n)]


if __name__ == "__main__":
    main(WJ200)
