//! Who commands, by which channel the reference comes, and what the inputs ask: from the registers and what is around
//! the drive.

use drive_atv312::{registers::address::*, words::ExtendedControl};

use crate::{
    Bank,
    models::drivecom::{Around, Commander, Readings, Run, RunInputs, StopInputs, Wiring},
};

/// Access level L3 in `LAC`.
pub(super) const L3: u16 = 2;
/// The other bus, in `Fr1`, `Fr2`.
const CAN_OPEN_REFERENCE: u16 = 167;
/// The remote terminal, in `Fr1`, `Fr2`, `SA2`, `SA3`, `FLOC`.
pub(super) const TERMINAL_REFERENCE: u16 = 163;
/// Modbus, in `Fr1`, `Fr2`, `SA2`, `SA3`.
pub(super) const MODBUS_REFERENCE: u16 = 164;
/// The potentiometer, in `Fr1`, `Fr2`, `SA2`, `SA3`, `FLOC`.
pub(super) const POTENTIOMETER: u16 = 16;
/// +/- speed by the jog dial, in `Fr1`, `Fr2`.
const JOG_DIAL: u16 = 161;
/// `CHCF`: command and reference by channels of their own.
const SEPARATE: u16 = 2;

/// Who gives the run command, in the terms of this family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Giver {
    Terminals,
    Keypad,
    RemoteTerminal,
    Modbus,
    CanOpen,
}

/// What routing looks at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Routing<'a> {
    pub(super) bank: &'a Bank,
    pub(super) around: &'a Around,
    pub(super) readings: &'a Readings,
    /// Whether the bus commands at L1 and L2.
    pub(super) commanded: bool,
}

impl Routing<'_> {
    pub(super) fn level_3(&self) -> bool {
        self.bank.value(LAC) == L3
    }

    /// Forced local control, by its input (p. 55) or by somebody at the machine.
    pub(super) fn is_forced_local(&self) -> bool {
        self.around.forced_local || self.is_on(self.bank.value(FLO))
    }

    /// The reference of forced local control (p. 55): `FLOC` is active at L3 only.
    pub(super) fn local_channel(&self) -> u16 {
        if self.level_3() {
            self.bank.value(FLOC)
        } else if self.bank.value(LCC_KEYS) == 1 {
            TERMINAL_REFERENCE
        } else {
            1
        }
    }

    pub(super) fn giver(&self) -> Giver {
        let with_reference = |channel| match channel {
            MODBUS_REFERENCE => Giver::Modbus,
            TERMINAL_REFERENCE => Giver::RemoteTerminal,
            CAN_OPEN_REFERENCE => Giver::CanOpen,
            POTENTIOMETER | JOG_DIAL => Giver::Keypad,
            _ => self.wired(),
        };
        if self.is_forced_local() {
            return with_reference(self.local_channel());
        }
        if !self.level_3() {
            return match (self.bank.value(LCC_KEYS), self.commanded) {
                (1, _) => Giver::RemoteTerminal,
                (_, true) => Giver::Modbus,
                _ => self.wired(),
            };
        }
        if self.bank.value(CHCF) != SEPARATE {
            return with_reference(self.reference_channel());
        }
        match self.bank.value(if self.by_command_2() { CD2 } else { CD1 }) {
            2 => Giver::Keypad,
            3 => Giver::RemoteTerminal,
            10 => Giver::Modbus,
            20 => Giver::CanOpen,
            _ => Giver::Terminals,
        }
    }

    /// `tCC` = LOC has no effect at L3 (p. 33).
    fn wired(&self) -> Giver {
        if self.bank.value(TCC) == 2 && !self.level_3() { Giver::Keypad } else { Giver::Terminals }
    }

    pub(super) fn commander(&self) -> Commander {
        match self.giver() {
            Giver::Modbus => Commander::Bus,
            Giver::RemoteTerminal => Commander::RemoteTerminal,
            Giver::CanOpen => Commander::CanOpen,
            Giver::Terminals | Giver::Keypad => Commander::Terminals,
        }
    }

    /// Whether the reference comes by `Fr2` (p. 36).
    pub(super) fn by_reference_2(&self) -> bool {
        let switch = self.bank.value(RFC);
        switch == 97 || self.is_on(switch)
    }

    /// Whether the command comes by channel 2: with `CHCF` = SIM the one of the reference (p. 36, 37).
    pub(super) fn by_command_2(&self) -> bool {
        if self.bank.value(CHCF) != SEPARATE || !self.level_3() {
            return self.by_reference_2();
        }
        let switch = self.bank.value(CCS);
        switch == 99 || self.is_on(switch)
    }

    pub(super) fn reference_channel(&self) -> u16 {
        self.bank.value(if self.by_reference_2() { FR2 } else { FR1 })
    }

    /// Whether `AC2` and `dE2` are in force (p. 20, 39). The threshold `Frt` is left out.
    pub(super) fn second_ramps(&self) -> bool {
        let switched =
            ExtendedControl::from_bits_retain(self.bank.value(CMI)).contains(ExtendedControl::RAMP_SWITCH);
        // "This function remains active regardless of the control channel."
        switched || self.is_on(self.bank.value(RPS))
    }

    /// Whether a function is on that only a bus in control can switch by its bits; an input always can.
    pub(super) fn function(&self, function: u16) -> bool {
        let assigned = self.bank.value(function);
        self.is_on(assigned) && (assigned < 171 || self.giver() == Giver::Modbus)
    }

    /// Whether the bit or input of `EtF` reports an external fault (p. 52).
    pub(super) fn external_fault(&self) -> bool {
        let assigned = self.bank.value(ETF);
        let by_word = ExtendedControl::from_bits_retain(self.bank.value(CMI));
        by_word.contains(ExtendedControl::EXTERNAL_FAULT)
            || assigned != 0 && self.is_on(assigned) == (self.bank.value(LET) == 1)
    }

    /// Stops by inputs, whoever commands (p. 8, 40, 41): freewheel, fast stop and the stop of 3-wire control act
    /// while their input is off, the injection while it is on.
    pub(super) fn stops(&self) -> StopInputs {
        let is_off = |function| {
            let assigned = self.bank.value(function);
            (129..=134).contains(&assigned) && !self.is_on(assigned)
        };
        let injects = self.bank.value(DCI);
        StopInputs {
            fast: is_off(FST),
            injection: (129..=134).contains(&injects) && self.is_on(injects),
            lock: is_off(NST) || self.bank.value(TCC) == 1 && !self.around.is_on(1),
        }
    }

    /// How the inputs give a run command (p. 33): 2-wire LI1 runs forward, 3-wire LI1 stops and LI2 runs forward.
    pub(super) fn wiring(&self) -> (Wiring, RunInputs) {
        let reverse = self.is_on(self.bank.value(RRS));
        let [first, second] = [1, 2].map(|number| self.around.is_on(number));
        if self.bank.value(TCC) == 1 {
            return (Wiring::ThreeWire, RunInputs { forward: second, reverse, stop: first });
        }
        let wiring = match self.bank.value(TCT) {
            0 => Wiring::Level,
            2 => Wiring::ForwardFirst,
            _ => Wiring::Transition,
        };
        (wiring, RunInputs { forward: first, reverse, stop: true })
    }

    /// The run command that is given, with the terminals' own; `rOt` says where the RUN key turns (p. 38).
    pub(super) fn run(&self, terminals: Option<Run>) -> Option<Run> {
        match self.giver() {
            Giver::Terminals => terminals,
            Giver::Keypad | Giver::RemoteTerminal => {
                let run = if self.bank.value(ROT) == 1 { Run::Reverse } else { Run::Forward };
                self.around.key_run.then_some(run)
            }
            Giver::Modbus | Giver::CanOpen => None,
        }
    }

    /// Whether what a function is assigned to is at 1: a logic input (129–134), or a bit of the control word
    /// (Cd11–Cd15 are 171–175, C111–C115 are 187–191).
    pub(super) fn is_on(&self, assigned: u16) -> bool {
        let bit = |bit: u16| self.bank.value(CMD) & 1 << bit != 0;
        match assigned {
            129..=134 => self.around.is_on(assigned - 128),
            171..=175 => bit(assigned - 160),
            187..=191 => bit(assigned - 176),
            _ => false,
        }
    }
}
