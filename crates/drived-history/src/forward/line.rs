//! The line protocol of Influx: what is known of a drive at its moments, one line each.

use std::{collections::BTreeMap, fmt::Write as _};

use crate::quantity::Quantity;

/// What is known of a drive, by moments.
#[derive(Debug, Default)]
pub(super) struct Lines(BTreeMap<i64, String>);

impl Lines {
    /// A value.
    pub(super) fn add(&mut self, at: i64, quantity: Quantity, count: i64) {
        let fields = self.fields(at);
        let _ = match quantity.is_number() {
            true => write!(fields, "{quantity}={}", quantity.value(count as f64)),
            // A word or bits: its number.
            false => write!(fields, "{quantity}={count}i"),
        };
    }

    /// From here on something is known of the drive, or nothing any more.
    pub(super) fn known(&mut self, at: i64, is_known: bool) {
        let fields = self.fields(at);
        let _ = write!(fields, "known={}i", i32::from(is_known));
    }

    fn fields(&mut self, at: i64) -> &mut String {
        let fields = self.0.entry(at).or_default();
        if !fields.is_empty() {
            fields.push(',');
        }
        fields
    }

    /// As text.
    pub(super) fn of_drive(&self, drive: &str) -> String {
        let drive = escaped(drive);
        let mut text = String::new();
        for (at, fields) in &self.0 {
            let _ = writeln!(text, "drive,drive={drive} {fields} {at}");
        }
        text
    }
}

/// The value of a tag, in which commas, equal signs, spaces and backslashes are escaped and no line ends.
fn escaped(value: &str) -> String {
    let mut text = String::with_capacity(value.len());
    for character in value.chars() {
        match character {
            ',' | '=' | ' ' | '\\' => text.extend(['\\', character]),
            character if character.is_control() => text.push('_'),
            character => text.push(character),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_as_the_documents_of_influx_have_them() {
        let mut lines = Lines::default();
        lines.known(1_000, true);
        lines.add(1_000, Quantity::OUTPUT_FREQUENCY, 2_995);
        lines.add(1_000, Quantity::STATE, 3);
        lines.add(2_000, Quantity::word(3_201), 0x0237);
        let text = "drive,drive=pump\\ 1\\,\\ north known=1i,output_frequency_hz=29.95,state=3i 1000\n\
                    drive,drive=pump\\ 1\\,\\ north word_3201=567i 2000\n";
        assert_eq!(lines.of_drive("pump 1, north"), text);
    }
}
