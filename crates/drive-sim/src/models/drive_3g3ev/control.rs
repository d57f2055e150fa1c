//! Who commands the simulated 3G3EV, by which reference, and what its inputs do (§2.1, §5.1, §5.2).

use std::time::Duration;

use drive_3g3ev::{
    registers::address as at,
    words::{BroadcastCommand, Command, Errors, LinkError},
};

use super::{Drive3g3ev, MAX_FREQUENCY, switches::Function};
use crate::{Panel, Ramp, Ramps};

/// The terminals, in the order of the bits of 002Bh: run forward and reverse, and the inputs of n06 to n08. The manual
/// prints neither names nor bits; these names are those of the terminal strip.
pub(super) const TERMINALS: &[&str] = &["SF", "SR", "S1", "S2", "S3"];
/// Bits of the terminals.
const FORWARD: u16 = 1 << 0;
const REVERSE: u16 = 1 << 1;
/// The preset speed that an input can select, in hundredths of a hertz.
const PRESET: u32 = 1_000;
/// The inputs with the register that holds their function.
const INPUTS: [(Command, u16); 3] =
    [(Command::INPUT_1, at::N06), (Command::INPUT_2, at::N07), (Command::INPUT_3, at::N08)];

/// Who gives run commands, or the reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Console,
    Terminals,
    Bus,
}

impl Drive3g3ev {
    pub(super) fn command(&self) -> Command {
        Command::from_bits_retain(self.bank.value(at::COMMAND))
    }

    /// 0001h to all drives: bits 4 and 5 have their own meaning (§5.1).
    pub(super) fn obey_broadcast(&mut self, word: u16) {
        let command = BroadcastCommand::from_bits_retain(word);
        let run = Command::RUN | Command::REVERSE;
        self.bank.set(at::COMMAND, word & run.bits());
        self.look_at_inputs();
        if command.contains(BroadcastCommand::EXTERNAL_FAULT) {
            self.fault(Errors::EF);
        } else if command.contains(BroadcastCommand::FAULT_RESET) {
            self.reset();
        }
    }

    /// Follows the inputs: bits 4 to 6 of 0001h, and the terminals beside them.
    pub(super) fn look_at_inputs(&mut self) {
        if !self.command().contains(Command::RUN) {
            self.locked = false;
        }
        let on = self.inputs_on();
        let before = std::mem::replace(&mut self.inputs_before, on);
        let rises = |function| {
            let functions = self.functions().into_iter().zip(on).zip(before);
            functions.into_iter().any(|((has, on), before)| has == function && on && !before)
        };
        if rises(Function::FaultReset) {
            self.reset();
        }
        if self.is_on(Function::ExternalFault) && !self.errors.contains(Errors::EF) {
            self.fault(Errors::EF);
        }
    }

    pub(super) fn fault(&mut self, errors: Errors) {
        self.errors |= errors;
        self.lock();
        self.motor.freewheel();
    }

    /// A run command that stands acts again when it was 0 once.
    fn lock(&mut self) {
        self.locked = self.command().contains(Command::RUN);
    }

    /// Clears the faults whose cause is gone.
    pub(super) fn reset(&mut self) {
        if self.readings.run_blocks_reset
            && self.run_source() == Source::Bus
            && self.command().contains(Command::RUN)
        {
            return;
        }
        let mut stays = Errors::empty();
        stays.set(Errors::UV1, !self.supplied);
        stays.set(Errors::EF, self.is_on(Function::ExternalFault));
        self.errors &= stays;
        self.link_errors = LinkError::empty();
        self.locked &= !(self.readings.runs_after_reset && self.errors.is_empty());
    }

    /// The supply of the motor comes or goes.
    pub(super) fn supply(&mut self, on: bool) {
        self.supplied = on;
        if !on {
            self.fault(Errors::UV1);
        } else if self.readings.undervoltage_clears {
            self.errors.remove(Errors::UV1);
            self.locked &= !self.errors.is_empty();
        }
    }

    /// Somebody is at the console.
    pub(super) fn console(&mut self, action: Panel) {
        match action {
            Panel::TakeControl => self.local = true,
            Panel::ReleaseControl => {
                (self.local, self.console_runs) = (false, false);
                if !self.readings.runs_when_remote {
                    self.lock();
                }
            }
            Panel::Stop => {
                self.console_runs = false;
                self.lock();
            }
            Panel::Run => self.console_runs = self.run_source() == Source::Console,
            Panel::Reset => self.reset(),
            Panel::Reference(frequency) => self.console_reference = frequency.centihertz().min(MAX_FREQUENCY),
        }
    }

    /// Steers the motor for what is ordered now.
    pub(super) fn steer(&mut self) {
        if !self.powered || !self.errors.is_empty() || self.is_on(Function::BaseBlock) {
            self.motor.freewheel();
        } else if self.runs() {
            self.motor.run(self.target(), self.ramps());
        } else {
            self.motor.ramp_to_rest(self.ramps().deceleration);
        }
    }

    /// Whether a run command acts.
    pub(super) fn runs(&self) -> bool {
        self.ordered().is_some() && self.is_ready()
    }

    /// The run command of whoever gives it: whether it is in reverse.
    pub(super) fn ordered(&self) -> Option<bool> {
        match self.run_source() {
            Source::Bus => {
                let command = self.command();
                (command.contains(Command::RUN) && !self.locked).then(|| command.contains(Command::REVERSE))
            }
            Source::Terminals => match [FORWARD, REVERSE].map(|terminal| self.terminals & terminal != 0) {
                [true, false] => Some(false),
                [false, true] => Some(true),
                _ => None,
            },
            Source::Console => self.console_runs.then_some(false),
        }
    }

    /// n02, as it was at power-up (§2.1 and its note 3).
    pub(super) fn run_source(&self) -> Source {
        match self.set_up.mode {
            _ if self.is_local() => Source::Console,
            2 | 5 => Source::Bus,
            1 | 4 => Source::Terminals,
            _ => Source::Console,
        }
    }

    /// Whose reference it is: the bus's or the console's.
    pub(super) fn reference_source(&self) -> Source {
        match self.set_up.mode {
            _ if self.is_local() => Source::Console,
            4 | 5 => Source::Bus,
            3 if self.readings.n02_3_is_bus => Source::Bus,
            _ => Source::Console,
        }
    }

    pub(super) fn is_local(&self) -> bool {
        self.local || self.is_on(Function::Local)
    }

    /// The frequency that is ordered, in hundredths of a hertz, negative in reverse.
    pub(super) fn target(&self) -> i32 {
        let frequency = i32::try_from(self.reference()).unwrap_or(0);
        if self.ordered() == Some(true) { -frequency } else { frequency }
    }

    /// The reference in force, in hundredths of a hertz: tenths are all that the drive keeps (§2.1, note 1).
    pub(super) fn reference(&self) -> u32 {
        match self.reference_source() {
            _ if self.is_on(Function::PresetSpeed) => PRESET,
            Source::Bus => self.set_up.frequency(self.bank.value(at::REFERENCE)) / 10 * 10,
            Source::Console | Source::Terminals => self.console_reference,
        }
    }

    pub(super) fn ramps(&self) -> Ramps {
        let time = Duration::from_millis(u64::from(self.bank.value(at::N20)) * 100);
        let ramp = Ramp { full_scale: MAX_FREQUENCY, time };
        Ramps { acceleration: ramp, deceleration: ramp }
    }

    /// Whether an input with this function is on.
    fn is_on(&self, function: Function) -> bool {
        self.functions().into_iter().zip(self.inputs_on()).any(|(has, on)| has == function && on)
    }

    /// What the inputs of n06 to n08 are for.
    fn functions(&self) -> [Function; 3] {
        let mut functions = self.readings.inputs;
        for (function, (_, register)) in functions.iter_mut().zip(INPUTS) {
            if self.fault_reset == Some(self.bank.value(register)) {
                *function = Function::FaultReset;
            }
        }
        functions
    }

    /// Whether the inputs of n06 to n08 are on, by the bus or by the terminal.
    fn inputs_on(&self) -> [bool; 3] {
        let (command, mut terminal) = (self.command(), REVERSE);
        INPUTS.map(|(input, _)| {
            terminal <<= 1;
            command.contains(input) || self.terminals & terminal != 0
        })
    }
}
