#!/usr/bin/env python3
"""Toshiba VF-S15 / VF-S11 on Modbus RTU (F829=1), commands by FA00 with priority bits (works setting CMOd=0)."""
import time
from common import Drive, Ex, bits, main


class VFS15(Drive):
    name = "VF-S15"
    fcs = (3, 6, 16, 23, 43)
    max_read = 1
    boot_s = 1.0
    parity = "E"
    max_hz = 50.0
    ident = {0: b"TOSHIBA", 1: b"VFS15-2037PM", 2: b"0100"}
    faults = {1: "OC1", 2: "OC2", 3: "OC3", 4: "OCL", 5: "OCA", 8: "EPHI", 9: "EPHO", 10: "OP1", 11: "OP2", 12: "OP3", 13: "OL1",
              14: "OL2", 16: "OH overheat", 17: "E emergency stop", 18: "EEP1", 24: "Err5 communication", 29: "UC", 30: "UP1"}

    def setup(self):
        p = self.P
        p.update(cmod=0, fmod=0, f803=0, f804=0, fh=8000, ul=5000, f870=0, f871=0, f875=0, f876=0, f877=0, f878=0, f879=0)
        self.reg(0xFA00, lambda: self.cmd, self.command_word)
        self.reg(0xFA01, lambda: self.ref, self.set_ref)
        self.reg(0xFD00, lambda: abs(self.out_hz) * 100)
        self.reg(0xFD01, self.status)
        self.reg(0xFD02, lambda: abs(self.target()) * 100)
        self.reg(0xFD03, lambda: self.amps / self.rated_a * 10000)
        self.reg(0xFD04, lambda: 10000)
        self.reg(0xFD05, lambda: abs(self.out_hz) / self.nominal * 10000)
        self.reg(0xFC90, lambda: self.tripped)
        self.reg(0xFC91, lambda: 0)
        self.reg(0xFE45, lambda: 1 if self.local else 2 if self.ours() else int(p["cmod"]))
        self.reg(0xFE46, lambda: 3 if self.local else 4 if self.freq_ours() else int(p["fmod"]))
        for i in range(4):
            self.reg(0xFE10 + i, lambda i=i: self.past[i])
        for a, k, lo, hi in ((0x0003, "cmod", 0, 4), (0x0004, "fmod", 0, 14), (0x0803, "f803", 0, 1000), (0x0804, "f804", 0, 2),
                             (0x0870, "f870", 0, 5), (0x0871, "f871", 0, 5), (0x0875, "f875", 0, 17), (0x0876, "f876", 0, 17),
                             (0x0877, "f877", 0, 17), (0x0878, "f878", 0, 17), (0x0879, "f879", 0, 17)):
            self.par(a, k, p[k], lo, hi)
        self.reg(0x0009, lambda: self.acc * 10, lambda v: self.ramp("acc", v))
        self.reg(0x0010, lambda: self.dec * 10, lambda v: self.ramp("dec", v))
        self.reg(0x0011, lambda: p["fh"])
        self.reg(0x0012, lambda: p["ul"])

    def ramp(self, k, v):
        if v > 36000:
            raise Ex(3)
        setattr(self, k, max(v, 1) / 10)

    def power_up(self):
        self.cmd = self.ref = 0
        self.emoff = False
        if not hasattr(self, "past"):
            self.past = [0] * 4
        self.max_hz = self.P["ul"] / 100

    def ours(self):
        return bool(self.cmd & 0x8000) or self.P["cmod"] == 2

    def freq_ours(self):
        return bool(self.cmd & 0x4000) or self.P["fmod"] == 4

    def set_ref(self, v):
        if v > self.P["fh"]:
            raise Ex(3)
        self.ref = v

    def command_word(self, v):
        old, self.cmd = self.cmd, v
        now = time.monotonic()
        if v & 0x1000:                                   # emergency stop: even without bit 15
            self.tripped or self.trip(17, self.faults[17])
            self.tripped = self.tripped or 17
        if v & 0x2000 and not old & 0x2000 and self.tripped and not v & 0x1000:
            if self.reset_fault():                       # the drive starts anew, the words are forgotten
                self.power_up()
                self.deaf_until = now + 2.0              # and this write gets no answer

    def on_trip(self):
        self.past = [self.tripped] + self.past[:3]

    def target(self):
        f = self.ref / 100 if self.freq_ours() else 0.0
        if self.cmd & 0x100:
            f = 5.0
        return -f if self.cmd & 0x200 else f

    def logic(self, now):
        if self.expired(self.P["f803"] / 10 if self.name == "VF-S15" else self.P["f803"], now):
            self.wd_armed = False
            act = int(self.P["f804"])
            if act == 1 or self.name == "VF-S11":
                self.trip(24, self.faults[24])
            elif act == 2:
                self.ramp_stop()
                self.late = True
        if self.late and self.mode == "off":
            self.late = False
            self.trip(24, self.faults[24])
        if self.local or self.tripped or self.late:
            return
        v = self.cmd
        if self.ours() and v & 0x0800:
            self.coast()
        elif self.ours() and v & 0x0500:                 # run, or jog with run
            self.run()
        elif self.mode == "run":
            self.ramp_stop()                             # run bit off, or command back to the terminals

    late = False

    def status(self):
        v, ok = self.cmd, not self.tripped
        rev = self.hz < 0 if self.hz else bool(v & 0x200)
        return bits(b0=self.tripped, b1=self.tripped, b7=False, b8=v & 0x100, b9=rev, b10=self.running,
                    b11=self.ours() and v & 0x0800, b12=self.tripped == 17, b13=ok, b14=ok and not v & 0x0800)

    def fed(self, fc, a, n, wrote):
        self.wd_armed, self.wd_last = True, time.monotonic()

    # ---- one word at a time; 1870h writes F870/F871's words, 1875h reads F875..F879's
    def block_w(self, k):
        return {1: 0xFA00, 3: 0xFA01}.get(int(self.P[k]))

    def read_words(self, a, n, fc=3):
        if a == 0x1875 and 2 <= n <= 5:
            src = {1: 0xFD01, 2: 0xFD00, 3: 0xFD03, 4: 0xFD05, 5: 0xFC91}
            return [int(self.R[src[int(self.P["f87%d" % (5 + i)])]]()) & 0xFFFF if int(self.P["f87%d" % (5 + i)]) in src else 0
                    for i in range(n)]
        return super().read_words(a, n, fc)

    def write_words(self, a, vals, fc=16):
        if a == 0x1870 and len(vals) == 2:
            for k, v in zip(("f870", "f871"), vals):
                if self.block_w(k):
                    self.W[self.block_w(k)](v)
            return
        if len(vals) != 1:
            raise Ex(3)
        super().write_words(a, vals, fc)


class VFS11(VFS15):
    name = "VF-S11"
    fcs = (3, 6)


if __name__ == "__main__":
    import sys
    cls = VFS15
    if len(sys.argv) > 1 and sys.argv[1] in ("s11", "s15"):
        cls = VFS11 if sys.argv.pop(1) == "s11" else VFS15
    main(cls)
