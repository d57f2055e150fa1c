//! Registers as a person writes and reads them, the same at every face: which values one takes, and what a text means.

use drive_core::{
    Capabilities, Row,
    registers::{Factory, Range},
};

use crate::{
    failure::Failure,
    meant::{nearest, with_point},
    output,
};

/// The word for a person's text, refused here when access or range forbid it: nothing is sent then.
pub fn wanted(row: &Row, text: &str) -> Result<u16, Failure> {
    let refuse = |why: String| Failure::Input(format!("{} ({}): {why}", row.code, row.address));
    if !row.access.is_writable() {
        return Err(refuse("the register can only be read, which drived param get does".to_owned()));
    }
    let expected = || match range(row) {
        range if range.is_empty() => "a number in its unit or a hexadecimal word such as 0627h".to_owned(),
        range => range,
    };
    let word = read(row, text)
        .ok_or_else(|| refuse(format!("{text:?} is no value, expected: {}{}", expected(), example(row))))?;
    if !row.range.allows(row.unit.number(word)) {
        return Err(refuse(format!(
            "{} is not allowed, expected: {}{}",
            row.show(word),
            expected(),
            example(row)
        )));
    }
    Ok(word)
}

/// The word for a text, also for one with a decimal comma, or with unit or mnemonic in other letters.
fn read(row: &Row, text: &str) -> Option<u16> {
    let text = text.trim();
    let plain = |text: &str| {
        let exact = row.read(text);
        exact.or_else(|| {
            let mut alike =
                row.range.choices().iter().filter(|choice| choice.code.eq_ignore_ascii_case(text));
            alike.next().filter(|_| alike.next().is_none()).map(|choice| choice.value)
        })
    };
    let without_unit = || {
        let (number, unit) = text.split_at_checked(text.len().checked_sub(row.unit.symbol.len())?)?;
        let is_unit = !unit.is_empty() && unit.eq_ignore_ascii_case(row.unit.symbol);
        is_unit.then(|| number.trim_end().to_owned())
    };
    plain(text)
        .or_else(|| plain(&with_point(text)?))
        .or_else(|| without_unit().and_then(|number| plain(&number).or_else(|| plain(&with_point(&number)?))))
}

/// A value as it could be typed, where the manual prints one in a unit.
fn example(row: &Row) -> String {
    match row.factory {
        Factory::Value(word) if !row.unit.symbol.is_empty() => format!(", such as {}", brief(row, word)),
        _ => String::new(),
    }
}

/// Registers that may have been meant by a text that names none: those spelt alike, else some whose name has the word, else the
/// one behind an address that was counted as 4xxxx.
pub fn alike(rows: &'static [Row], text: &str) -> Vec<String> {
    const NAMED: usize = 3;
    let of_code = |code: &str| rows.iter().find(|row| row.code == code);
    if let Some(number) =
        text.strip_prefix('4').filter(|rest| rest.len() >= 4).and_then(|rest| rest.parse::<u16>().ok())
    {
        let behind = rows.iter().find(|row: &&Row| row.address == number);
        return behind.map(|row| format!("{} ({})", row.address, row.code)).into_iter().collect();
    }
    let word = text.to_lowercase();
    let begins = |row: &&Row| {
        let code = row.code.to_lowercase();
        code.len() > 1 && (code.starts_with(&word) || word.len() > 2 && word.starts_with(&code))
    };
    let named = |row: &&Row| {
        word.len() > 2 && row.name.to_lowercase().split_whitespace().any(|part| part.starts_with(&word))
    };
    let settable = |row: &&Row| row.access.is_writable();
    let mut found: Vec<&Row> = rows.iter().filter(begins).collect();
    if found.is_empty() {
        found = nearest(text, rows.iter().map(|row| row.code)).into_iter().filter_map(of_code).collect();
    }
    found.extend(rows.iter().filter(named).filter(settable).take(NAMED));
    let mut codes: Vec<String> = Vec::new();
    for row in found {
        if !codes.iter().any(|code| code == row.code) {
            codes.push(row.code.to_owned());
        }
    }
    codes.truncate(NAMED);
    codes
}

/// The factory setting of a row, in the unit that it has with the factory setting of what chooses that.
pub fn factory(capabilities: &Capabilities, row: &Row) -> String {
    let by = capabilities.scaled_by(row.address).map(|by| by.factory);
    let of_factory =
        |_| by.and_then(|factory| if let Factory::Value(word) = factory { Some(word) } else { None });
    match row.factory {
        Factory::None => String::new(),
        Factory::Value(word) => brief(&capabilities.in_units(row, of_factory), word),
        Factory::Described(rule) | Factory::Chosen(_, _, rule) | Factory::Percent(_, _, rule) => {
            rule.to_owned()
        }
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
        Range::Bits(bits) => format!("bits of {bits:04X}h, the others are reserved or can only be read"),
    }
}

#[cfg(test)]
mod tests {
    use drive_core::registers::{Access, Choice, Confidence, Space, Storage, Unit};

    use super::*;

    const YES_NO: &[Choice] = &[Choice::new(0, "nO", "no"), Choice::new(1, "YES", "yes")];

    const RAMP: Row = Row {
        space: Space::HoldingRegister,
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
        for text in ["3.5 s", "3.5", "3,5", "3,5 s", "3.5 S", "3,5S", "0023h"] {
            assert_eq!(wanted(&RAMP, text), Ok(35), "{text}");
        }
        let list = Row { range: Range::OneOf(YES_NO), unit: Unit::CODE, ..RAMP };
        assert_eq!(wanted(&list, "yes"), Ok(1));
        for (row, text, reason) in [
            (RAMP, "0", "0.0 s is not allowed, expected: 0.1 s to 999.9 s"),
            (RAMP, "fast", "\"fast\" is no value, expected: 0.1 s to 999.9 s, such as 3.0 s"),
            (RAMP, "3,500", "\"3,500\" is no value"),
            (Row { access: Access::Read, ..RAMP }, "3", "can only be read"),
            (Row { range: Range::OneOf(YES_NO), unit: Unit::CODE, ..RAMP }, "7", "expected: nO, YES"),
        ] {
            let Err(Failure::Input(message)) = wanted(&row, text) else { panic!("{text} was taken") };
            assert!(message.contains(reason), "{message}");
        }
    }

    #[test]
    fn whoever_misses_a_register_is_told_what_is_called_alike() {
        const ROWS: &[Row] = &[RAMP, Row { address: 3_201, code: "ETA", name: "status word", ..RAMP }];
        assert_eq!(alike(ROWS, "ACCEL"), ["ACC"]);
        assert_eq!(alike(ROWS, "acceleration"), ["ACC"]);
        assert_eq!(alike(ROWS, "49001"), ["9001 (ACC)"]);
        assert_eq!(alike(ROWS, "ETB"), ["ETA"]);
        assert_eq!(alike(ROWS, "nonsense"), [""; 0]);
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
