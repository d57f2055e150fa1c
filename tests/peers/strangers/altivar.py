#!/usr/bin/env python3
"""Schneider Altivar 12 / 312 / 320 on Modbus RTU: DRIVECOM (CiA 402) chart on 8501 / 3201."""
import time
from common import Drive, Ex, bits, main, s16

DIS, RDY, ON, ENA, QS, FLT = 0x40, 0x21, 0x23, 0x27, 0x07, 0x08


class ATV320(Drive):
    name = "ATV320"
    fcs = (3, 6, 16, 23, 43)
    max_read, max_write = 63, 61
    baud, parity = 19200, "E"
    mains = 0x10                             # ETA bit 4; 0 on the ATV312
    ident = {0: b"Schneider Electric", 1: b"ATV320U15N4B", 2: b"V2.9"}
    faults = {2: "EEF1", 3: "CFF", 4: "CFI", 5: "SLF1 Modbus loss", 8: "EPF1 external", 9: "OCF overcurrent", 10: "CrF", 16: "OHF drive hot",
              17: "OLF motor overload", 18: "ObF bus overvoltage", 19: "OSF mains overvoltage", 20: "OPF1", 21: "PHF", 22: "USF undervoltage",
              23: "SCF1", 24: "SOF overspeed", 32: "SCF3 earth", 33: "OPF2"}

    def setup(self):
        p = self.P
        p.update(chcf=1, fr1=164, cd1=10, tto=100, sll=1, hsp=500, lsp=0, tfr=600, shutdown=0, rsf=0, add=1, tbr=32, tfo=3)
        self.reg(8501, lambda: self.cmd, self.command_word)
        self.reg(8502, lambda: self.lfr, self.set_lfr)
        self.reg(8504, lambda: self.cmi, lambda v: setattr(self, "cmi", v))
        self.reg(8602, lambda: self.lfr * 3, lambda v: self.set_lfr(round(s16(v) / 3) & 0xFFFF))
        self.reg(3201, self.eta)
        self.reg(3202, lambda: self.out_hz * 10)
        self.reg(3203, lambda: self.goal() * 10)
        self.reg(3204, lambda: self.amps * 10)
        self.reg(3205, lambda: 300 if self.running else 0)
        self.reg(3206, lambda: bits(b1=self.tripped, b3=True, b4=self.running, b15=False))
        self.reg(3207, lambda: 4000)
        self.reg(3208, lambda: abs(self.out_hz) * 8)
        self.reg(3209, lambda: 40)
        self.reg(3210, lambda: 40)
        self.reg(3211, lambda: abs(self.out_hz))
        self.reg(3240, self.hmis)
        self.reg(8604, lambda: self.out_hz * 30)
        self.reg(8605, lambda: self.goal() * 30)
        self.reg(8606, lambda: 0x1000 if self.tripped else 0)
        self.reg(7121, lambda: self.lft)
        for i in range(8):
            self.reg(7200 + i, lambda i=i: self.past[i])
        self.par(7124, "rsf", 0)
        self.par(3103, "tfr", 600, 100, 5990, ok=self.still)
        self.par(3104, "hsp", 500, 0, 5990)
        self.par(3105, "lsp", 0, 0, 5990)
        self.par(6001, "add", 1, 0, 247)
        self.par(6003, "tbr", 32, 24, 36)
        self.par(6004, "tfo", 3, 2, 5)
        self.par(6005, "tto", 100, 1, 300)
        self.par(7010, "sll", 1, 0, 6)
        self.par(8401, "chcf", 1, 1, 3, ok=self.still)
        self.par(8413, "fr1", 164, ok=self.still)
        self.par(8423, "cd1", 10, ok=self.still)
        self.reg(9001, lambda: self.acc * 10, lambda v: setattr(self, "acc", max(v, 1) / 10))
        self.reg(9002, lambda: self.dec * 10, lambda v: setattr(self, "dec", max(v, 1) / 10))

    def still(self):
        return not self.running

    def power_up(self):
        self.cmd = self.lfr = self.cmi = 0
        self.st, self.warn = DIS, False
        if not hasattr(self, "past"):
            self.past, self.lft = [0] * 8, 0

    def set_lfr(self, v):
        self.lfr = s16(v)                    # beyond HSP it is bounded, ETA bit 11 tells

    def command_word(self, v):
        old, self.cmd = self.cmd, v
        if v & 0x80 and not old & 0x80 and self.st == FLT:
            if self.reset_fault():
                self.st = DIS
        self.chart()

    def ours(self):
        return not self.local and self.P["cd1"] == 10

    def chart(self):
        """Transitions by level, one state after the other."""
        v = self.cmd
        if self.tripped:
            self.st = FLT
            return
        if not self.ours():
            return
        if self.P["chcf"] == 3:              # I/O profile: bit 0 runs, no chart
            self.st = ENA if v & 1 else ON
            self.run() if v & 1 else self.ramp_stop()
            return
        if not v & 2:                        # disable voltage: coast
            self.coast()
            self.st = DIS
        elif not v & 4:                      # quick stop
            if self.st == ENA:
                self.quick_stop()
                self.st = QS
            elif self.st in (RDY, ON):
                self.st = DIS
        else:
            if self.st == DIS and v & 7 == 6:
                self.st = RDY
            elif self.st == RDY and v & 7 == 7:
                self.st = ON
            if self.st == ON and v & 15 == 15:
                self.st = ENA
            elif self.st == ON and v & 7 == 6:
                self.st = RDY
            if self.st == ENA:
                if v & 7 == 6 and self.P["shutdown"]:
                    self.coast()
                    self.st = RDY
                elif v & 15 != 15:           # 7 or 6: ramp; the state follows at standstill
                    self.ramp_stop()
                    if self.mode == "off":
                        self.st = ON if v & 1 else RDY
                else:
                    self.run()

    def stopped(self, how):
        super().stopped(how)
        if how == "quick":
            self.st = DIS

    def target(self):
        if self.cmd & 0x100 and self.P["chcf"] != 3:     # halt
            return 0.0
        f = self.lfr / 10 if self.P["fr1"] == 164 else 0.0
        f = min(abs(f), self.P["hsp"] / 10) * (1 if f >= 0 else -1)
        if abs(f) < self.P["lsp"] / 10:
            f = self.P["lsp"] / 10
        return -f if self.cmd & 0x800 else f

    def logic(self, now):
        self.max_hz = self.P["tfr"] / 10
        if self.expired(self.P["tto"] / 10, now) and not self.local:
            act = int(self.P["sll"])
            self.wd_armed = False
            if act == 1:
                self.trip(5, self.faults[5])
            elif act in (2, 5, 6):
                (self.quick_stop if act == 6 else self.ramp_stop)()
                self.late = act != 2
                self.cmd &= ~8
        if self.late and self.mode == "off":
            self.late = False
            self.trip(5, self.faults[5])
        self.chart()

    late = False

    def on_trip(self):
        self.st, self.lft = FLT, self.tripped
        self.past = [self.tripped] + self.past[:7]

    def after_reset(self):
        self.st = DIS                        # LFT keeps the last fault

    def on_remote(self):
        self.st, self.cmd = (FLT if self.tripped else DIS), 0

    def eta(self):
        ref = abs(self.lfr) / 10
        st = self.st if self.st in (DIS, FLT) and not self.mains else self.st | self.mains
        return st | bits(b7=self.warn, b9=self.ours(), b10=self.at_ref, b11=ref > self.P["hsp"] / 10,
                         b15=self.hz < 0 if self.hz else self.target() < 0)

    def hmis(self):
        if self.tripped:
            return 23
        if self.mode == "quick":
            return 8
        if self.mode == "stop":
            return 6
        if self.mode == "run":
            return 4 if self.at_ref else 5 if abs(self.goal()) > abs(self.hz) else 6
        return 3 if self.hz else 2

    def fed(self, fc, a, n, wrote):
        self.wd_armed, self.wd_last = True, time.monotonic()


class ATV312(ATV320):
    name, mains = "ATV312", 0
    fcs = (3, 6, 8, 16, 23, 43)
    ident = {0: b"Telemecanique", 1: b"ATV312HU15N4", 2: b"0102"}


class ATV12(ATV320):
    name = "ATV12"
    fcs = (3, 6, 16, 43)
    max_read, max_write = 29, 27
    ident = {0: b"Schneider Electric", 1: b"ATV12HU15M2", 2: b"0104"}


if __name__ == "__main__":
    import sys
    kinds = {"12": ATV12, "312": ATV312, "320": ATV320}
    main(kinds[sys.argv.pop(1)] if len(sys.argv) > 1 and sys.argv[1] in kinds else ATV320)
