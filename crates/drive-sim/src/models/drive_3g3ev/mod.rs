//! A simulated Omron 3G3EV (3G3EV MODBUS, sections in brackets).
//!
//! What the manual leaves open is chosen here, and any drive of the field may differ:
//! - reserved registers answer 0 ([`Drive3g3ev::refusing_reserved`]: exception 02), and 0 is in the word of inputs and
//!   in every parameter that the manual does not name;
//! - n06 to n08 hold 1, 2 and 3; what the inputs do is said by the switches of the same names, or by
//!   [`Drive3g3ev::with_fault_reset_function`], which says what number resets faults;
//! - 100 % is 60 Hz, both ramps are n20, measured to 60 Hz, n53 counts 0.1 Hz;
//! - a fault cuts the output and the motor coasts; afterwards, and after the STOP key, a run command acts again when it
//!   was 0 once;
//! - bit 1 of 0020h is the direction in which the motor turns ([`Drive3g3ev::telling_ordered_direction`]: the one that is ordered);
//! - RUN stands as long as the output feeds the motor;
//! - bit 7 of 0020h is always 1, as in the only sample (§4.2.2).

mod control;
mod model;
mod set_up;
mod switches;
#[cfg(test)]
mod tests;
mod words;

use drive_3g3ev::{
    FAULTS, ROWS, TIME_OVER,
    registers::address as at,
    words::{Errors, LinkError},
};

use self::{
    control::TERMINALS,
    set_up::SetUp,
    switches::{Readings, SWITCHES},
};
use crate::{Bank, Motor, Nameplate, Rules, Surroundings, Watchdog};

/// What is around it.
const SURROUNDINGS: Surroundings = Surroundings {
    family: "3g3ev",
    terminals: TERMINALS,
    analog_inputs: &[],
    switches: SWITCHES,
    trips: FAULTS,
    rows: ROWS,
};

/// 100 % of the reference, in hundredths of a hertz.
const MAX_FREQUENCY: u32 = 6_000;
/// Nominal current in tenths of an ampere.
const NOMINAL_CURRENT: u32 = 30;
/// Settings that the manual does not print, and that have to differ from 0.
const FACTORY: &[(u16, u16)] = &[(at::N06, 1), (at::N07, 2), (at::N08, 3), (at::N20, 30), (at::N53, 15)];
/// A simulated 3G3EV.
#[derive(Debug, Clone)]
pub struct Drive3g3ev {
    bank: Bank,
    motor: Motor,
    watchdog: Watchdog,
    rules: Rules,
    readings: Readings,
    /// The parameters of §2.1 as they were at power-up.
    set_up: SetUp,
    errors: Errors,
    link_errors: LinkError,
    /// A written value was outside its range (0022h bit 3).
    limit_exceeded: bool,
    /// The run command acts again when it was 0 once.
    locked: bool,
    /// The panel has control.
    local: bool,
    console_runs: bool,
    /// In hundredths of a hertz.
    console_reference: u32,
    terminals: u16,
    /// The inputs of n06 to n08 as they were looked at last.
    inputs_before: [bool; 3],
    /// The control has a supply, and the motor has one.
    powered: bool,
    supplied: bool,
    fault_reset: Option<u16>,
    refuses_reserved: bool,
    tells_ordered_direction: bool,
}

impl Drive3g3ev {
    /// A drive from the factory, with a light motor of its own size.
    #[must_use]
    pub fn new() -> Self {
        let mut bank = Bank::new(ROWS);
        for &(address, value) in FACTORY {
            bank.set_factory(address, value);
        }
        let set_up = SetUp::of(&bank);
        Self {
            bank,
            motor: Motor::new(Nameplate {
                nominal_frequency: MAX_FREQUENCY,
                ..Nameplate::light(NOMINAL_CURRENT)
            }),
            watchdog: Watchdog::new(set_up.detects_time_over.then_some(TIME_OVER)),
            rules: set_up.rules(),
            readings: Readings::default(),
            set_up,
            errors: Errors::empty(),
            link_errors: LinkError::empty(),
            limit_exceeded: false,
            locked: false,
            local: false,
            console_runs: false,
            console_reference: 0,
            terminals: 0,
            inputs_before: [false; 3],
            powered: true,
            supplied: true,
            fault_reset: None,
            refuses_reserved: false,
            tells_ordered_direction: false,
        }
    }

    /// This drive with a number that stands for "fault reset" in n06 to n08.
    #[must_use]
    pub fn with_fault_reset_function(self, number: u16) -> Self {
        Self { fault_reset: Some(number), ..self }
    }

    /// This drive, answering exception 02 to a read of a reserved register.
    #[must_use]
    pub fn refusing_reserved(self) -> Self {
        Self { refuses_reserved: true, ..self }
    }

    /// This drive, whose bit 1 of 0020h is the direction that is ordered also while the motor turns the other way.
    #[must_use]
    pub fn telling_ordered_direction(self) -> Self {
        Self { tells_ordered_direction: true, ..self }
    }
}

impl Default for Drive3g3ev {
    fn default() -> Self {
        Self::new()
    }
}
