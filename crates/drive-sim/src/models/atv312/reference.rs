//! The reference in force (p. 23, 33, 35–37, 42–47, 54, 55).

use drive_atv312::registers::address::*;

use super::routing::{Giver, MODBUS_REFERENCE, POTENTIOMETER, Routing, TERMINAL_REFERENCE};

/// All of an analog input, or of the PI regulator's range, in hundredths of a percent.
const FULL: i32 = 10_000;
/// Below this the 4–20 mA are lost, in tenths of a milliampere: `CrL3` up to 3 mA cannot show a loss (p. 54).
const LOST: u16 = 30;

impl Routing<'_> {
    /// The reference in hundredths of a hertz, negative in reverse, before LSP and HSP. `bus` is what the bus has
    /// written, `output` the present output frequency.
    pub(super) fn reference(&self, bus: i32, output: i32) -> i32 {
        if self.is_forced_local() {
            // PI, summing "etc. are not active" (p. 55).
            return self.channel(self.local_channel(), bus);
        }
        match (self.level_3(), self.giver()) {
            (false, Giver::RemoteTerminal) => self.channel(TERMINAL_REFERENCE, bus),
            (false, Giver::Modbus) if self.readings.bus_as_reference_1 => {
                self.first(MODBUS_REFERENCE, bus, output)
            }
            (false, Giver::Modbus) => bus,
            _ if !self.by_reference_2() => self.first(self.bank.value(FR1), bus, output),
            _ => {
                let preset = self.preset().filter(|_| self.readings.presets_on_both);
                preset.unwrap_or_else(|| self.channel(self.bank.value(FR2), bus))
            }
        }
    }

    /// Whether the 4–20 mA at AI3 are lost (p. 22, 54).
    pub(super) fn is_signal_lost(&self) -> bool {
        self.bank.value(CRL3) > LOST && self.around.analog(3) < i32::from(LOST) * 50
    }

    /// An analog input in hundredths of a percent of the reference's span; AI3 between `CrL3` and `CrH3` (p. 33).
    pub(super) fn share(&self, input: u16) -> i32 {
        match input {
            3 => {
                let [low, high] = [CRL3, CRH3].map(|limit| i32::from(self.bank.value(limit)) * 50);
                let span = if low == high { 1 } else { high - low };
                ((self.around.analog(3) - low) * FULL / span).clamp(0, FULL)
            }
            POTENTIOMETER => self.around.analog(4),
            _ => self.around.analog(usize::from(input)),
        }
    }

    /// A reference channel: an input from LSP to HSP (p. 27), or what a bus or terminal has given. The +/- speed
    /// stays at 0 here.
    fn channel(&self, channel: u16, bus: i32) -> i32 {
        let [low, high] = [LSP, HSP].map(|speed| i32::from(self.bank.value(speed)) * 10);
        match channel {
            1..=3 | POTENTIOMETER => {
                let share = self.share(channel);
                (low + share.abs() * (high - low) / FULL) * if share < 0 { -1 } else { 1 }
            }
            TERMINAL_REFERENCE if self.readings.terminal_shares_reference => bus,
            TERMINAL_REFERENCE => self.around.key_reference,
            MODBUS_REFERENCE => bus,
            _ => 0,
        }
    }

    /// The first reference with what replaces it or is added to it: the PI regulator, preset speeds, which have
    /// priority over analog references (p. 14), and the summing inputs.
    fn first(&self, channel: u16, bus: i32, output: i32) -> i32 {
        if self.bank.value(PIF) != 0 {
            return self.regulated(channel, bus, output);
        }
        let high = i32::from(self.bank.value(HSP)) * 10;
        let summand = |sa| match self.bank.value(sa) {
            0 => 0,
            input @ (1..=3 | POTENTIOMETER) => self.share(input) * high / FULL,
            other => self.channel(other, bus),
        };
        self.preset().unwrap_or_else(|| self.channel(channel, bus) + summand(SA2) + summand(SA3))
    }

    /// The preset speed that inputs or bits choose (p. 42–44).
    fn preset(&self) -> Option<i32> {
        let choice = self.chosen([PS2, PS4, PS8, PS16]);
        (choice > 0).then(|| i32::from(self.bank.value(SP2 - 1 + choice)) * 10)
    }

    /// A number in binary from functions, the lowest first.
    fn chosen<const N: usize>(&self, functions: [u16; N]) -> u16 {
        (0..).zip(functions).map(|(bit, function)| u16::from(self.function(function)) << bit).sum()
    }

    /// What the PI regulator ends at while feedback and reference stay as they are: one limit or the other, and where
    /// it is without an error. Its gains are left out, the ramps are not (p. 45–47).
    fn regulated(&self, channel: u16, bus: i32, output: i32) -> i32 {
        let [low, high] = [LSP, HSP].map(|speed| i32::from(self.bank.value(speed)) * 10);
        let feedback = self.share(self.bank.value(PIF)) * i32::from(self.bank.value(FBS)) / 10;
        let asked = match (self.chosen([PR2, PR4]), self.bank.value(PII), channel) {
            (preset @ 1.., _, _) => i32::from(self.bank.value(RP2 - 1 + preset)) * 10,
            (_, 1, _) => i32::from(self.bank.value(RPI)) * 10,
            (_, _, MODBUS_REFERENCE) => i32::from(self.bank.value(PISP)) * 10,
            (_, _, 1..=3 | POTENTIOMETER) => self.share(channel),
            _ => self.channel(channel, bus) * FULL / high.max(1),
        };
        let error = (asked - feedback) * if self.bank.value(PIC) == 1 { -1 } else { 1 };
        match error {
            1.. => high,
            0 => output,
            _ => low,
        }
    }
}
