//! The words that the drive computes (§5.2), and the mistakes in its settings that it shows (§5.3).

use drive_3g3ev::{
    registers::address as at,
    words::{Command, DriveState, Errors, LinkState, Outputs, Signals},
};

use super::{Drive3g3ev, MAX_FREQUENCY, control::Source};
use crate::Bank;

/// Bit 7 of 0020h, "unused", is 1 in the sample (§4.2.2).
const SAMPLE_BIT: u16 = 1 << 7;
/// Supply, and the V/f curve's voltage at the highest frequency, in volts.
const SUPPLY: u32 = 230;
/// The supply rectified, in volts.
const DC_VOLTAGE: u16 = 325;
/// An output that 0009h commands (§5.1).
const BY_BUS: u16 = 15;

impl Drive3g3ev {
    /// A register that the drive computes; `None` for one that is kept.
    pub(super) fn computed(&self, address: u16) -> Option<u16> {
        Some(match address {
            at::SIGNALS => self.signals().bits() | SAMPLE_BIT,
            at::ERRORS => self.errors.bits(),
            at::LINK => self.link_state().bits(),
            at::REFERENCE_SEEN => self.set_up.word(self.reference()),
            at::OUTPUT_FREQUENCY => self.set_up.word(self.output()),
            at::CURRENT => u16::try_from(self.motor.current()).unwrap_or(u16::MAX),
            at::OUTPUT_VOLTAGE => self.voltage(),
            at::INPUT_TERMINALS => self.terminals,
            at::STATE => self.state().bits(),
            at::OUTPUT_CONTACTS => self.contacts().bits(),
            at::DC_BUS if !self.supplied || self.errors.contains(Errors::UV1) => 0,
            at::DC_BUS => DC_VOLTAGE,
            at::LINK_ERROR => self.link_errors.bits(),
            _ => return None,
        })
    }

    /// Whether the drive would take a run command: no fault, and nothing in its settings that it complains of.
    pub(super) fn is_ready(&self) -> bool {
        self.errors.is_empty() && !has_mistake(&self.bank) && !self.reverse_refused()
    }

    /// OP6: reverse was ordered and n05 forbids it.
    fn reverse_refused(&self) -> bool {
        self.ordered() == Some(true) && self.bank.value(at::N05) == 1
    }

    /// The direction that is asked for at standstill, with or without a run command.
    fn reverse_selected(&self) -> bool {
        match self.run_source() {
            Source::Bus => self.command().contains(Command::REVERSE),
            Source::Terminals | Source::Console => self.ordered() == Some(true),
        }
    }

    fn signals(&self) -> Signals {
        let turning = self.motor.output_frequency();
        let ordered = turning == 0 || self.tells_ordered_direction;
        let reverse = if ordered { self.reverse_selected() } else { turning < 0 };
        let contacts = self.contacts();
        let mut signals = Signals::empty();
        signals.set(Signals::RUN, self.motor.is_fed());
        signals.set(Signals::REVERSE, reverse);
        signals.set(Signals::READY, self.is_ready());
        signals.set(Signals::FAULT, !self.errors.is_empty());
        signals.set(Signals::DATA_ERROR, has_mistake(&self.bank) || self.reverse_refused());
        signals.set(Signals::OUTPUT_1, contacts.contains(Outputs::OUTPUT_1));
        signals.set(Signals::OUTPUT_2, contacts.contains(Outputs::OUTPUT_2));
        signals
    }

    fn state(&self) -> DriveState {
        let level = u32::from(self.bank.value(at::N53)) * 10;
        let mut state = DriveState::empty();
        state.set(DriveState::RUN, self.motor.is_fed());
        state.set(DriveState::ZERO_SPEED, self.output() == 0);
        state.set(DriveState::AT_REFERENCE, self.runs() && self.motor.is_at_target());
        state.set(DriveState::BELOW_N53, self.output() <= level);
        state.set(DriveState::ABOVE_N53, self.output() >= level);
        state.set(DriveState::READY, self.is_ready());
        state.set(DriveState::UNDERVOLTAGE, !self.supplied || self.errors.contains(Errors::UV1));
        state.set(DriveState::OUTPUT_OFF, !self.motor.is_fed());
        state.set(DriveState::LOCAL_REFERENCE, self.reference_source() != Source::Bus);
        state.set(DriveState::LOCAL_RUN, self.run_source() != Source::Bus);
        state.set(DriveState::OVERTORQUE, self.errors.contains(Errors::OL3));
        state.set(DriveState::MAJOR_FAULT, !self.errors.is_empty());
        state.set(DriveState::LINK_FAULT, self.errors.contains(Errors::BUS));
        state
    }

    fn link_state(&self) -> LinkState {
        if self.limit_exceeded { LinkState::LIMIT_EXCEEDED } else { LinkState::empty() }
    }

    /// The outputs that 0009h commands.
    fn contacts(&self) -> Outputs {
        let ordered = Outputs::from_bits_retain(self.bank.value(at::OUTPUTS));
        let mut contacts = Outputs::empty();
        for (output, function) in [(Outputs::OUTPUT_1, at::N09), (Outputs::OUTPUT_2, at::N10)] {
            let by_bus = self.bank.value(function) == BY_BUS;
            contacts.set(output, by_bus && ordered.contains(output));
        }
        contacts
    }

    /// The output frequency in hundredths of a hertz, without a sign: the direction is a bit.
    fn output(&self) -> u32 {
        self.motor.output_frequency().unsigned_abs()
    }

    fn voltage(&self) -> u16 {
        let volts = SUPPLY * self.output() / MAX_FREQUENCY;
        u16::try_from(volts).unwrap_or(u16::MAX)
    }
}

/// OP1, OP4 and OP5. OP2 and OP3 hang on rules and ratings that the manual does not give.
fn has_mistake(bank: &Bank) -> bool {
    let [n06, n07, n08] = [at::N06, at::N07, at::N08].map(|register| bank.value(register));
    let equal_inputs = n06 == n07 || n07 == n08 || n06 == n08;
    let limits = bank.value(at::N41) < bank.value(at::N42);
    let skips = [at::N56, at::N57, at::N58].map(|register| bank.value(register));
    equal_inputs || limits || !skips.is_sorted_by(|higher, lower| higher >= lower)
}
