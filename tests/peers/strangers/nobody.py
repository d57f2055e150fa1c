#!/usr/bin/env python3
"""Three drives that nobody makes, by what their kind is said to be: KIND split (run, direction and reset in registers of their own, as a
DURApulse GS2 has them), signed (the setpoint is the run command, its sign the direction and 0 the stop, as a DMM DYN4 has it) or
directions (a run coil for each direction, and both on or both off is a stop)."""
from common import Drive, Ex, bits, main, s16


class Nobody(Drive):
    fcs = (3, 4, 6, 16, 23)
    max_read = max_write = 16
    faults = {1: "a trip"}

    def power_up(self):
        self.speed, self.go, self.rev = 0, 0, 0

    def setup(self):
        self.reg(0x0100, self.status)
        self.reg(0x0110, lambda: round(abs(self.out_hz) * 100) >> 16)
        self.reg(0x0111, lambda: round(abs(self.out_hz) * 100))
        self.reg(0x091E, lambda: 0, self.reset)
        self.tables()

    def reset(self, v):
        if v:
            self.go = 0
            self.reset_fault()

    def status(self):
        turning_back = self.last_dir == "reverse" if self.hz else self.backwards()
        return bits(b0=self.running, b1=turning_back, b2=self.at_ref, b3=bool(self.tripped), b8=not self.local, b9=not self.local)

    def logic(self, now):
        if self.local or self.tripped:
            return
        if self.wants():
            self.run()
        else:
            self.ramp_stop()

    def on_trip(self):
        self.go = 0

    def on_remote(self):
        self.go = 0


class Split(Nobody):
    name = "split"

    def tables(self):
        self.reg(0x091A, lambda: self.speed, self.set_speed)
        self.reg(0x091B, lambda: self.go, self.set_go)
        self.reg(0x091C, lambda: self.rev, lambda v: setattr(self, "rev", v & 1))

    def set_speed(self, v):
        if v > 500:
            raise Ex(3)
        self.speed = v

    def set_go(self, v):
        if v > 1:
            raise Ex(3)
        self.go = v if not (self.tripped or self.local) else 0

    def wants(self):
        return self.go == 1

    def backwards(self):
        return bool(self.rev)

    def target(self):
        return -self.speed / 10 if self.rev else self.speed / 10


class Signed(Nobody):
    name = "signed"

    def tables(self):
        self.reg(0x000E, lambda: self.speed, self.set_speed)

    def set_speed(self, v):
        if abs(s16(v)) > 500:
            raise Ex(3)
        self.speed = v if not (self.tripped or self.local) else 0

    def on_trip(self):
        self.speed = 0

    def on_remote(self):
        self.speed = 0

    def wants(self):
        return self.speed != 0

    def backwards(self):
        return s16(self.speed) < 0

    def target(self):
        return s16(self.speed) / 10


class Directions(Nobody):
    name = "directions"
    fcs = (1, 3, 5, 6, 15, 16)
    max_coils = 8

    def power_up(self):
        self.speed, self.way = 0, {1: False, 2: False, 3: False}

    def tables(self):
        self.reg(0x0110, self.status)
        self.reg(0x091A, lambda: self.speed, self.set_speed)
        for a in (1, 2, 3):
            self.C[a] = lambda a=a: self.way[a]
            self.CW[a] = lambda v, a=a: self.put(a, v)

    def set_speed(self, v):
        if v > 500:
            raise Ex(3)
        self.speed = v

    def put(self, a, v):
        rises = v and not self.way[a]
        if a == 3:
            self.way[a] = v
            if rises:
                self.lose()
                self.reset_fault()
        else:
            self.way[a] = v and not (self.tripped or self.local)

    def lose(self):
        self.way[1] = self.way[2] = False

    def on_trip(self):
        self.lose()

    def on_remote(self):
        self.lose()

    def wants(self):
        return self.way[1] != self.way[2]

    def backwards(self):
        return self.way[2]

    def target(self):
        return -self.speed / 10 if self.way[2] else self.speed / 10


if __name__ == "__main__":
    import sys
    main({"split": Split, "signed": Signed, "directions": Directions}[sys.argv.pop(1)])
