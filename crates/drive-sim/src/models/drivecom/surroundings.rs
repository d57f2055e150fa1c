//! What is around a drive of this chart: inputs, keys, supply.

use crate::{Panel, world::Act};

/// The names of the logic inputs, in the order of their bits; the last says whether the remote terminal is plugged in,
/// and is closed from the start.
pub(in crate::models) const TERMINALS: &[&str] = &["LI1", "LI2", "LI3", "LI4", "LI5", "LI6", REMOTE_TERMINAL];
/// The name of the plug of the remote terminal.
pub(in crate::models) const REMOTE_TERMINAL: &str = "HMI";
/// The analog inputs: 0–10 V, ±10 V, 0–20 mA, the potentiometer (BBV51701 p. 23).
pub(in crate::models) const ANALOG_INPUTS: &[&str] = &["AI1", "AI2", "AI3", "AIV1"];

/// Inputs, keys and supply as they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::models) struct Around {
    /// The logic inputs, LI1 in bit 0.
    pub(in crate::models) inputs: u16,
    /// The analog inputs in hundredths of a percent, in the order of [`ANALOG_INPUTS`].
    analog: [i32; 4],
    /// Whether the remote terminal is plugged in.
    pub(in crate::models) remote_terminal: bool,
    /// Whether somebody forces local control.
    pub(in crate::models) forced_local: bool,
    /// Whether the RUN key was pressed after the STOP key.
    pub(in crate::models) key_run: bool,
    /// The reference of the remote terminal in hundredths of a hertz.
    pub(in crate::models) key_reference: i32,
    /// Whether the power stage is supplied.
    pub(in crate::models) motor_supply: bool,
}

impl Default for Around {
    fn default() -> Self {
        Self {
            inputs: 0,
            analog: [0; 4],
            remote_terminal: true,
            forced_local: false,
            key_run: false,
            key_reference: 0,
            motor_supply: true,
        }
    }
}

impl Around {
    /// Takes what happens; a reading is the drive's to take.
    pub(in crate::models) fn act(&mut self, act: Act) {
        let place = |names: &[&str], name| names.iter().position(|known| *known == name);
        match act {
            Act::Terminal(REMOTE_TERMINAL, plugged) => self.remote_terminal = plugged,
            Act::Terminal(name, closed) => {
                if let Some(bit) = place(TERMINALS, name) {
                    self.inputs = self.inputs & !(1 << bit) | u16::from(closed) << bit;
                }
            }
            Act::Analog(name, level) => {
                let input = place(ANALOG_INPUTS, name).and_then(|place| self.analog.get_mut(place));
                if let Some(input) = input {
                    *input = level.hundredths();
                }
            }
            Act::MotorSupply(on) => self.motor_supply = on,
            Act::Reading(..) => {}
        }
    }

    /// Takes what is done at the panel, as far as it is kept.
    pub(in crate::models) fn panel(&mut self, action: Panel) {
        match action {
            Panel::TakeControl => self.forced_local = true,
            Panel::ReleaseControl => self.forced_local = false,
            Panel::Run => self.key_run = true,
            Panel::Stop => self.key_run = false,
            Panel::Reference(frequency) => {
                self.key_reference = i32::try_from(frequency.centihertz()).unwrap_or(i32::MAX);
            }
            Panel::Reset => {}
        }
    }

    /// What a loss of supply takes away: keys are not pressed any more.
    pub(in crate::models) const fn power_up(&mut self) {
        (self.forced_local, self.key_run) = (false, false);
    }

    /// Whether a logic input is on, by its number from 1.
    pub(in crate::models) const fn is_on(&self, number: u16) -> bool {
        self.inputs & 1 << (number - 1) != 0
    }

    /// An analog input by its number from 1 (4: the potentiometer), in hundredths of a percent of its full scale;
    /// only AI2 goes below 0.
    pub(in crate::models) fn analog(&self, number: usize) -> i32 {
        let level = number.checked_sub(1).and_then(|place| self.analog.get(place)).copied().unwrap_or(0);
        level.clamp(if number == 2 { -10_000 } else { 0 }, 10_000)
    }
}
