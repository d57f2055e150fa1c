//! What decides instead of the bus, by the settings as they were read: another source, an input, a preset, a sum.

use drive_core::{Refusal, SelfRestart};

use super::{CD11, LI1, REFERENCE_1, REFERENCE_2, REFERENCE_BY_MODBUS, Settings};
use crate::{
    facts::{ANALOG_INPUTS, Facts, SILENT},
    registers::{ATR, DCI, FR1, FR2, FST, LFL, NST, PIF, RFC, SA2, SA3, address},
    words::{AccessLevel, ControlWord},
};

impl Settings {
    /// Why the drive, as it is set up, cannot be reversed by the control word.
    pub(crate) fn refuses_reverse(&self) -> Option<Refusal> {
        self.others().contains(ControlWord::REVERSE).then_some(Refusal::Settings(
            "a function is assigned to bit 11 of CMD, so it does not reverse: free that bit",
        ))
    }

    /// Why a reference of the bus has no effect, whatever the inputs say.
    pub(crate) fn refuses_reference(&self) -> Option<Refusal> {
        const REMEDY: &str = "set Fr1 to Mdb and rFC to Fr1";
        if self.word(PIF) != 0 {
            return Some(Refusal::Overridden {
                by: "the PI regulator (PIF)",
                remedy: "set PIF to nO, or regulate by PISP",
            });
        }
        let by_bus = [FR1, FR2].map(|channel| self.word(channel) == REFERENCE_BY_MODBUS);
        let (usable, by) = match (self.level(), self.word(RFC)) {
            (Some(AccessLevel::L3), REFERENCE_1) => {
                (by_bus[0], "the reference channel Fr1, which is not Mdb,")
            }
            (Some(AccessLevel::L3), REFERENCE_2) => {
                (by_bus[1], "the reference channel Fr2, which is not Mdb,")
            }
            (Some(AccessLevel::L3), _) => {
                (by_bus.contains(&true), "a reference channel, Fr1 or Fr2, of which none is Mdb,")
            }
            _ => (true, ""),
        };
        (!usable).then_some(Refusal::Overridden { by, remedy: REMEDY })
    }

    /// Whether `rFC` selects Fr2 for good.
    pub(crate) fn has_second_reference(&self) -> bool {
        self.level() == Some(AccessLevel::L3) && self.word(RFC) == REFERENCE_2
    }

    /// Whether `rFC` leaves the selection to an input or a bit.
    pub(crate) fn switches_reference(&self) -> bool {
        ![REFERENCE_1, REFERENCE_2].contains(&self.word(RFC))
    }

    /// Whether the reference channel that is active, by bit 0 of `LRS3`, is the bus.
    pub(crate) fn refuses_channel(&self, second: bool) -> Option<Refusal> {
        let (channel, by) = if second {
            (FR2, "the reference channel Fr2, selected by rFC (LRS3 bit 0),")
        } else {
            (FR1, "the reference channel Fr1, selected by rFC (LRS3 bit 0),")
        };
        (self.level() == Some(AccessLevel::L3) && self.word(channel) != REFERENCE_BY_MODBUS).then_some(
            Refusal::Overridden { by, remedy: "set rFC so that the channel which is Mdb is selected" },
        )
    }

    /// Whether a logic input is assigned to a stop.
    pub(crate) fn has_stop_inputs(&self) -> bool {
        self.stop_inputs().next().is_some()
    }

    /// The stop that an input asks for: the freewheel stop and the fast stop while it is 0, the injection while it is 1
    /// (p. 40 and 41).
    pub(crate) fn stopped_by(&self, inputs: u16) -> Option<Refusal> {
        let asks = |(bit, level): (u16, bool)| (inputs >> bit & 1 == 1) == level;
        self.stop_inputs().any(asks).then_some(Refusal::Overridden {
            by: "a stop by a logic input (nSt, FSt or dCI)",
            remedy: "close the input of nSt or FSt, or open that of dCI",
        })
    }

    /// The bits of the inputs that stop, and the level at which they do.
    fn stop_inputs(&self) -> impl Iterator<Item = (u16, bool)> {
        let stops = [(self.word(NST), false), (self.word(FST), false), (self.word(DCI), true)];
        let bit = |source: u16| source.checked_sub(LI1).filter(|&bit| bit < 6);
        stops.into_iter().filter_map(move |(source, level)| Some((bit(source)?, level)))
    }

    /// Whether an input or a bit of the control word is assigned to a preset speed or to jog operation.
    pub(crate) fn has_presets(&self) -> bool {
        self.presets().any(|(_, source)| source != 0)
    }

    /// The preset speed or jog operation that is selected, by the logic inputs and the held control word.
    pub(crate) fn selected_preset(&self, inputs: u16, held: u16) -> Option<Refusal> {
        let bit = |source: u16, first: u16, count: u16| source.checked_sub(first).filter(|&bit| bit < count);
        let by_input = |source| bit(source, LI1, 6).is_some_and(|bit| inputs >> bit & 1 == 1);
        let by_word = |source| bit(source, CD11, 5).is_some_and(|bit| held >> (11 + bit) & 1 == 1);
        let (function, source) = self.presets().find(|&(_, source)| by_input(source) || by_word(source))?;
        let (by, remedy) = match (function == address::JOG, by_input(source)) {
            (true, true) => ("jog operation (JOG) by its input", "open the input, or set JOG to nO"),
            (true, false) => ("jog operation (JOG) by a bit of CMD", "set JOG to nO, or to another bit"),
            (false, true) => {
                ("a preset speed (PS2 to PS16) by its input", "open the input, or set PS2 to PS16 to nO")
            }
            (false, false) => {
                ("a preset speed (PS2 to PS16) by a bit of CMD", "set PS2 to PS16 to nO, or to other bits")
            }
        };
        Some(Refusal::Overridden { by, remedy })
    }

    fn presets(&self) -> impl Iterator<Item = (u16, u16)> {
        let functions = [address::PS2, address::PS4, address::PS8, address::PS16, address::JOG];
        functions.into_iter().map(|function| (function, self.at(function).unwrap_or(0)))
    }

    /// What decides the reference instead of the bus, as far as settings and `facts` tell it: the settings, a preset speed, the
    /// other channel, a summing input.
    pub(crate) fn overrides(&self, facts: &Facts, held: u16) -> Option<Refusal> {
        const SUMMED: Refusal = Refusal::Overridden {
            by: "a summing input (SA2, AI2 as the drive leaves the factory, or SA3)",
            remedy: "set SA2 and SA3 to nO",
        };
        // Whether it does so where AI3 gives no reference, the manual leaves open: FrH may be that of the bus all the same.
        const FALLBACK: Refusal = Refusal::Overridden {
            by: "the speed to which the drive falls back (LFL), for its 4-20 mA are lost (LRS1 bit 12),",
            remedy: "see the signal at AI3, or set LFL otherwise than to LFF and rLS",
        };
        let preset = facts.inputs.and_then(|inputs| self.selected_preset(inputs, held));
        let second = facts.second.unwrap_or_else(|| self.has_second_reference());
        let channel = facts.second.and_then(|second| self.refuses_channel(second));
        // Only to reference 1 is something summed (p. 42).
        let adds = |source: &u16| match *source {
            0 => false,
            // What the potentiometer or another bus adds is not told.
            source => {
                !ANALOG_INPUTS.contains(&source)
                    || facts.analog.is_some_and(|inputs| {
                        let input = source.checked_sub(1).and_then(|input| inputs.get(usize::from(input)));
                        input.is_none_or(|input| input.cast_signed().unsigned_abs() > SILENT)
                    })
            }
        };
        let summed = (!second && self.summed().iter().any(adds)).then_some(SUMMED);
        let fallen_back = (facts.lost == Some(true) && self.falls_back()).then_some(FALLBACK);
        self.refuses_reference().or(fallen_back).or(preset).or(channel).or(summed)
    }

    /// Whether the drive goes on at another speed when the 4-20 mA are lost, the fallback speed or the one it had (`LFL`, p. 54).
    pub(crate) fn falls_back(&self) -> bool {
        const LFF: u16 = 4;
        const RLS: u16 = 5;
        [LFF, RLS].contains(&self.word(LFL))
    }

    /// What is summed to reference 1.
    pub(crate) fn summed(&self) -> [u16; 2] {
        [SA2, SA3].map(|input| self.word(input))
    }

    /// The automatic restart, where it is switched on.
    pub(crate) fn self_restart(&self) -> Option<SelfRestart> {
        (self.word(ATR) != 0).then_some(SelfRestart {
            code: "Atr",
            meaning: "resets its fault and starts the motor again by itself, for as long as tAr says",
        })
    }
}
