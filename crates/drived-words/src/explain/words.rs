//! Registers and their words in words, and what has changed since they were last seen.

use std::{collections::BTreeMap, fmt::Write as _};

use drive_core::{Row, registers::Form};
use drive_drivecom::ChartState;
use drive_families::{Bit, Family};

/// What was last seen in each register of each slave.
#[derive(Debug, Default)]
pub(super) struct Words(BTreeMap<(u8, u16), u16>);

impl Words {
    /// A word in short, and its bits where they are new or have changed.
    pub(super) fn told(&mut self, family: Option<Family>, slave: u8, address: u16, word: u16) -> Told {
        let row = row(family, address);
        let bits = family.map(|family| family.bits(address)).unwrap_or_default();
        let before = self.0.insert((slave, address), word);
        let name = name(family, address);
        let short = match row {
            Some(row) => format!("{name} {}", row.show(word)),
            None => format!("{name} = {word}"),
        };
        let is_bits = row.is_some_and(|row| row.unit.form == Form::Bits) && !bits.is_empty();
        let detail = match before {
            _ if !is_bits => None,
            Some(before) if before == word => None,
            Some(before) => Some(changed(&name, &bits, before, word)),
            None => Some(format!("{name} {word:04X}h: {}", set(&bits, word))),
        };
        let state = detail.is_some().then(|| state(row, word)).flatten();
        let detail = detail.map(|detail| match state {
            Some(state) => format!("{detail} ({state})"),
            None => detail,
        });
        Told { short, detail }
    }
}

/// A word in words.
pub(super) struct Told {
    pub(super) short: String,
    pub(super) detail: Option<String>,
}

/// A register by its mnemonic, else by its number, and what it is where the manual has no more than the number.
pub(super) fn name(family: Option<Family>, address: u16) -> String {
    match row(family, address) {
        Some(row) if u16::from_str_radix(row.code.trim_end_matches('h'), 16) == Ok(address) => {
            let what = row.name.split([':', ';', ',']).next().unwrap_or(row.name);
            format!("{} ({what})", row.code)
        }
        Some(row) => row.code.to_owned(),
        None => format!("{address} ({address:04X}h)"),
    }
}

fn row(family: Option<Family>, address: u16) -> Option<&'static Row> {
    family?.capabilities().rows.iter().find(|row| row.place() == address.into())
}

/// The bits that are 1.
fn set(bits: &[Bit], word: u16) -> String {
    let names: Vec<String> = numbered(bits, word).map(|(_, name)| name).collect();
    if names.is_empty() { "no bit is 1".to_owned() } else { names.join(", ") }
}

fn changed(name: &str, bits: &[Bit], before: u16, now: u16) -> String {
    let mut text = format!("{name} {before:04X}h to {now:04X}h:");
    for (mask, bit) in numbered(bits, before ^ now) {
        let value = u8::from(now & mask != 0);
        // Writing into a String does not fail.
        let _ = write!(text, " {bit} is {value},");
    }
    text.trim_end_matches(',').to_owned()
}

/// The names of the bits of a word that are 1, those without a name by their number.
fn numbered(bits: &[Bit], word: u16) -> impl Iterator<Item = (u16, String)> {
    (0..16).map(|number| 1_u16 << number).filter(move |mask| word & mask != 0).map(|mask| {
        let named = bits.iter().find(|bit| bit.mask == mask);
        let name = named.map(|bit| bit.name.to_lowercase().replace('_', " "));
        (mask, name.unwrap_or_else(|| format!("bit {}", mask.trailing_zeros())))
    })
}

/// The state of the DRIVECOM chart, in the chart's own words (BBV51701 p. 10).
fn state(row: Option<&Row>, word: u16) -> Option<&'static str> {
    if !matches!(row?.code, "ETA" | "ETAD") {
        return None;
    }
    Some(match ChartState::of(word)? {
        ChartState::NotReadyToSwitchOn => "not ready to switch on",
        ChartState::SwitchOnDisabled => "switch on disabled",
        ChartState::ReadyToSwitchOn => "ready to switch on",
        ChartState::SwitchedOn => "switched on",
        ChartState::OperationEnabled => "operation enabled",
        ChartState::QuickStopActive => "quick stop active",
        ChartState::FaultReactionActive => "fault reaction active",
        ChartState::Fault => "fault",
    })
}
