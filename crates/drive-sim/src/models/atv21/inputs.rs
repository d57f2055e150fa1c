//! The terminals of the simulated Altivar 21 and what their functions do (§6.2 p. 12 to 16, §8.4 p. 31, §8.8 p. 38).

use drive_atv21::registers::address as at;
use drive_core::Percent;

use super::Atv21;

/// The input that releases the drive (ST, §8.6 p. 34); closed as delivered. The manual does not say which terminal it is.
const ST: &str = "ST";
/// The logic inputs: name, bit of FD06, register of the function.
const INPUTS: [(&str, u16, u16); 4] = [
    ("F", 0, at::INPUT_F_FUNCTION),
    ("R", 1, at::INPUT_R_FUNCTION),
    ("RES", 2, at::INPUT_RES_FUNCTION),
    ("VIA", 7, at::INPUT_VIA_FUNCTION),
];
/// All terminals.
pub(super) const TERMINALS: &[&str] = &["F", "R", "RES", "VIA", ST];
/// The analog inputs.
pub(super) const ANALOG_INPUTS: &[&str] = &["VIA", "VIB"];
/// The highest count of an analog input (§8.8 p. 38).
pub(super) const ANALOG: u16 = 1_023;

/// Functions of inputs. The manual prints the last four numbers; the others are those of the VF-S11.
pub(super) mod function {
    /// Runs forward.
    pub(in crate::models::atv21) const FORWARD: u16 = 2;
    /// Runs in reverse.
    pub(in crate::models::atv21) const REVERSE: u16 = 3;
    /// Resets a fault.
    pub(in crate::models::atv21) const RESET: u16 = 10;
    /// Switches to the reference of F207 (FCHG).
    pub(in crate::models::atv21) const SECOND_REFERENCE: u16 = 38;
    /// Forces local control (SC/LC).
    pub(in crate::models::atv21) const LOCAL: u16 = 48;
    /// Forced operation.
    pub(in crate::models::atv21) const FORCED_OPERATION: u16 = 52;
    /// Forced run.
    pub(in crate::models::atv21) const FORCED_RUN: u16 = 53;
}

impl Atv21 {
    /// A terminal is closed or opened. VIA counts as one only where F109 says so.
    pub(super) fn terminal(&mut self, name: &str, closed: bool) {
        let Some((_, bit, register)) = INPUTS.into_iter().find(|(input, ..)| *input == name) else {
            self.released = closed;
            return;
        };
        let inputs = self.bank.value(at::LOGIC_INPUTS);
        let changed = if closed { inputs | 1 << bit } else { inputs & !(1 << bit) };
        self.bank.set(at::LOGIC_INPUTS, changed);
        let rises = changed & !inputs != 0;
        if rises && self.bank.value(register) == function::RESET {
            self.reset();
        }
    }

    /// An analog input is on a share of its full scale.
    pub(super) fn analog(&mut self, name: &str, level: Percent) {
        let counts = level.hundredths().clamp(0, 10_000) * i32::from(ANALOG) / 10_000;
        let register = if name == "VIB" { at::ANALOG_INPUT_VIB } else { at::ANALOG_INPUT_VIA };
        self.bank.set(register, u16::try_from(counts).unwrap_or(0));
    }

    /// Follows the inputs after any change of them, of their functions or of the readings.
    pub(super) fn look_at_inputs(&mut self) {
        self.stale &= self.bank.value(at::LOGIC_INPUTS);
        let forced = self.is_on(function::FORCED_OPERATION) || self.is_on(function::FORCED_RUN);
        let stays = self.forced_run && self.readings.forced_run_stays;
        self.forced_run = self.readings.forced_runs && (forced || stays);
    }

    /// Whether an input with this function is on.
    pub(super) fn is_on(&self, function: u16) -> bool {
        self.is_on_among(self.bank.value(at::LOGIC_INPUTS), function)
    }

    /// The same for a run command, which an input that was closed at the start may not give.
    pub(super) fn runs_by(&self, function: u16) -> bool {
        self.is_on_among(self.bank.value(at::LOGIC_INPUTS) & !self.stale, function)
    }

    /// Whether the terminals have command and reference, whatever the bus says.
    pub(super) fn is_forced_local(&self) -> bool {
        let forced = self.is_on(function::FORCED_OPERATION) || self.is_on(function::FORCED_RUN);
        self.is_on(function::LOCAL) || (forced && !self.readings.forced_runs)
    }

    /// Whether an input that could give control to the terminals leaves it to the bus, for the reading in which that
    /// needs no priority.
    pub(super) fn leaves_to_bus(&self) -> bool {
        let assigned = INPUTS.iter().any(|(.., register)| self.bank.value(*register) == function::LOCAL);
        self.readings.local_off_is_bus && assigned
    }

    /// F110 is a function that is always on.
    fn is_on_among(&self, inputs: u16, function: u16) -> bool {
        let via = if self.bank.value(at::VIA_IS_LOGIC) == 0 { 1 << 7 } else { 0 };
        let mut on = INPUTS.iter().filter(|(_, bit, _)| inputs & !via & 1 << bit != 0);
        on.any(|(.., register)| self.bank.value(*register) == function)
            || self.bank.value(at::ALWAYS_FUNCTION) == function
    }
}
