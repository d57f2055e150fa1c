//! Registers as a person writes and reads them, the same at every face: which values one takes, and what a text means.

use drive_core::{
    Capabilities, Row,
    registers::{Factory, Range},
};

use crate::{failure::Failure, output};

/// The word for a person's text, refused here when access or range forbid it: nothing is sent then.
pub fn wanted(row: &Row, text: &str) -> Result<u16, Failure> {
    let refuse = |why: String| Failure::Input(format!("{} ({}): {why}", row.code, row.address));
    if !row.access.is_writable() {
        return Err(refuse("the register can only be read".to_owned()));
    }
    let expected = || match range(row) {
        range if range.is_empty() => "a number in its unit or a hexadecimal word such as 0627h".to_owned(),
        range => range,
    };
    let word =
        row.read(text).ok_or_else(|| refuse(format!("{text:?} is no value, expected: {}", expected())))?;
    if !row.range.allows(row.unit.number(word)) {
        return Err(refuse(format!("{} is not allowed, expected: {}", row.show(word), expected())));
    }
    Ok(word)
}

/// The factory setting of a row, in the unit that it has with the factory setting of what chooses that.
pub fn factory(capabilities: &Capabilities, row: &Row) -> String {
    let by = capabilities.scaled_by(row.address).map(|by| by.factory);
    let of_factory =
        |_| by.and_then(|factory| if let Factory::Value(word) = factory { Some(word) } else { None });
    match row.factory {
        Factory::None => String::new(),
        Factory::Value(word) => brief(&capabilities.in_units(row, of_factory), word),
        Factory::Described(rule) => rule.to_owned(),
    }
}

/// A word in its unit, or the mnemonic of a listed value.
pub fn brief(row: &Row, word: u16) -> String {
    row.choice(word).map_or_else(|| row.unit.show(word), |choice| choice.code.to_owned())
}

/// Which values a register takes; empty where the manual says nothing.
pub fn range(row: &Row) -> String {
    let span =
        |low, high| format!("{} to {}", output::in_unit(row.unit, low), output::in_unit(row.unit, high));
    let listed = || {
        let codes = row.range.choices().iter().map(|choice| choice.code);
        codes.collect::<Vec<_>>().join(", ")
    };
    match row.range {
        Range::Any => String::new(),
        Range::Within(low, high) => span(low, high),
        Range::OneOf(_) => listed(),
        Range::OneOfOr(_, low, high) => format!("{}, or {}", listed(), span(low, high)),
        Range::Described(_, _, rule) => rule.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use drive_core::registers::{Access, Choice, Confidence, Storage, Unit};

    use super::*;

    const YES_NO: &[Choice] = &[Choice::new(0, "nO", "no"), Choice::new(1, "YES", "yes")];

    const RAMP: Row = Row {
        address: 9001,
        code: "ACC",
        name: "acceleration",
        access: Access::ReadWrite,
        storage: Storage::RamUntilSaved,
        unit: Unit::scaled("s", 1),
        range: Range::Within(1, 9_999),
        factory: Factory::Value(30),
        confidence: Confidence::Manual,
        source: "p. 1",
    };

    #[test]
    fn what_range_and_access_forbid_is_refused_before_anything_is_sent() {
        assert_eq!(wanted(&RAMP, "3.5 s"), Ok(35));
        for (row, text, reason) in [
            (RAMP, "0", "0.0 s is not allowed, expected: 0.1 s to 999.9 s"),
            (RAMP, "fast", "\"fast\" is no value, expected: 0.1 s to 999.9 s"),
            (Row { access: Access::Read, ..RAMP }, "3", "can only be read"),
            (Row { range: Range::OneOf(YES_NO), unit: Unit::CODE, ..RAMP }, "7", "expected: nO, YES"),
        ] {
            let Err(Failure::Input(message)) = wanted(&row, text) else { panic!("{text} was taken") };
            assert!(message.contains(reason), "{message}");
        }
    }

    #[test]
    fn a_row_shows_its_factory_setting_and_its_range() {
        let family = &Capabilities::least("test", "Test");
        assert_eq!(
            (factory(family, &RAMP), range(&RAMP)),
            ("3.0 s".to_owned(), "0.1 s to 999.9 s".to_owned())
        );
        let list = Row { range: Range::OneOf(YES_NO), factory: Factory::Value(1), ..RAMP };
        assert_eq!((factory(family, &list), range(&list)), ("YES".to_owned(), "nO, YES".to_owned()));
    }
}
