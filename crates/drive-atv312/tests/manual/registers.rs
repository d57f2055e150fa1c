//! Registers and lists (BBV51701 p. 16–56).

use drive_atv312::{FAULTS, ROWS};
use drive_core::{
    Row,
    registers::{Confidence, Factory, Form, Range, Storage},
};

const PRINTED: &str = include_str!("bbv51701.txt");

/// One line of the transcription.
struct Line<'a> {
    page: &'a str,
    address: u16,
    code: &'a str,
    access: &'a str,
    unit: &'a str,
    factory: &'a str,
    range: &'a str,
    values: Vec<(u16, Option<&'a str>)>,
}

fn lines() -> Vec<Line<'static>> {
    let lines = PRINTED.lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let columns: Vec<&str> = line.split('|').map(str::trim).collect();
            let &[head, unit, factory, range, values] = columns.as_slice() else { panic!("{line}") };
            let head: Vec<&str> = head.split_whitespace().collect();
            let &[page, address, code, access] = head.as_slice() else { panic!("{line}") };
            let values = values.split_whitespace().filter(|&value| value != "-").map(value).collect();
            Line { page, address: address.parse().unwrap(), code, access, unit, factory, range, values }
        })
        .collect()
}

/// `134=LI6`, `7510h=SLF`, or a number without a code.
fn value(text: &str) -> (u16, Option<&str>) {
    let (number, code) = text.split_once('=').map_or((text, None), |(number, code)| (number, Some(code)));
    let number = match number.strip_suffix('h') {
        Some(digits) => u16::from_str_radix(digits, 16).unwrap(),
        None => number.parse().unwrap(),
    };
    (number, code)
}

fn row(address: u16) -> &'static Row {
    ROWS.iter().find(|row| row.address == address).unwrap_or_else(|| panic!("no row {address}"))
}

#[test]
fn every_register_of_the_manual_is_a_row_in_the_manuals_order() {
    let lines = lines();
    let mut printed: Vec<u16> = lines.iter().map(|line| line.address).collect();
    assert_eq!(printed.len(), 236);
    // IOLR and AO1R stand twice, on p. 20 and p. 23.
    let mut seen = Vec::new();
    printed.retain(|address| {
        let first = !seen.contains(address);
        seen.push(*address);
        first
    });
    assert_eq!(printed.len(), 234);
    // The high words of the four 32-bit values (p. 18) are rows of their own.
    let high = [8608, 8610, 8612, 8615];
    let rows: Vec<u16> =
        ROWS.iter().map(|row| row.address).filter(|address| !high.contains(address)).collect();
    assert_eq!(rows, printed);
    assert_eq!(ROWS.len(), 238);
}

#[test]
fn each_row_has_the_code_the_access_and_the_page_that_are_printed() {
    for line in lines() {
        let row = row(line.address);
        assert_eq!(row.code, line.code, "W{}", line.address);
        let pages: Vec<&str> = row.source.split_whitespace().collect();
        assert!(pages.contains(&line.page), "W{}: {} instead of p. {}", line.address, row.source, line.page);
        let access = match line.access {
            // Not defined on p. 7.
            "R/WO" | "RW0" => "R/W",
            // Their outputs can be written (p. 20).
            "R" if [5240, 5261].contains(&line.address) => "R/W",
            access => access,
        };
        assert_eq!(row.access.to_string(), access, "W{} {}", line.address, line.code);
    }
}

#[test]
fn each_row_has_the_unit_that_is_printed() {
    for line in lines() {
        let unit = row(line.address).unit;
        let (symbol, decimals) = match line.unit {
            "-" => continue,
            // Printed for the factory's Inr; with another "ramps of 0.05 to 327.6 s" or "1 to 32760 s" (p. 38, 39).
            "0.1 s" if ["ACC", "dEC", "AC2", "dE2"].contains(&line.code) => ("× Inr", 0),
            "1" => ("", 0),
            // "%" and a range of 0.1 to 100 %: a count is one or the other.
            "%" if line.code == "AIV1" => ("", 0),
            "%" | "1%" => ("%", 0),
            "0.1%" => ("%", 1),
            "1 Hour" => ("h", 0),
            "1 μA" => ("µA", 0),
            text => {
                let (step, symbol) = text.split_once(' ').unwrap_or((text, ""));
                (symbol, u8::try_from(step.split_once('.').map_or(0, |(_, places)| places.len())).unwrap())
            }
        };
        assert_eq!((unit.symbol, unit.decimals), (symbol, decimals), "W{} {}", line.address, line.code);
    }
    // "Signed value", and the two inputs and references that go below 0.
    let signed: Vec<u16> = ROWS.iter().filter(|row| row.unit.signed).map(|row| row.address).collect();
    assert_eq!(signed, [8602, 8605, 8604, 8502, 3202, 5243, 8521, 8522, 8631, 8632]);
}

#[test]
fn a_ramp_is_shown_in_steps_of_inr_because_only_inr_tells_how_long_a_step_is() {
    for address in [9001, 9002, 9012, 9013] {
        assert_eq!(row(address).show(30), "30 × Inr", "W{address}");
        assert_eq!(row(address).read("3.0 s"), None, "W{address}");
        assert_eq!(row(address).read("30"), Some(30), "W{address}");
    }
}

/// p. 21 prints "1%" and no sign; p. 23 a percentage without the size of a count.
#[test]
fn a_word_is_no_percentage_where_its_sign_or_its_count_is_not_printed() {
    for address in [3205, 3211] {
        let shown = [150, 0x7FFF, 0x8000, 0xFFFF].map(|word| row(address).show(word));
        assert_eq!(shown, ["150 %", "32767 %", "8000h", "FFFFh"], "W{address}");
    }
    assert_eq!(row(5281).show(1_000), "1000");
}

#[test]
fn each_row_has_the_factory_setting_that_is_printed() {
    for line in lines() {
        let (row, code) = (row(line.address), line.code);
        match (line.factory, row.factory) {
            // Left empty on p. 35; AI1 by the table of p. 15.
            ("-", Factory::Value(1)) if code == "Fr1" => {}
            ("-", Factory::None) => {}
            (printed, Factory::Value(value)) => assert_eq!(printed.parse(), Ok(value), "{code}"),
            (printed, Factory::Described(_) | Factory::Chosen(..) | Factory::Percent(..)) => {
                assert!(printed.parse::<u16>().is_err(), "{code}");
            }
            (printed, Factory::None) => panic!("{code}: {printed}"),
        }
    }
}

#[test]
fn each_row_takes_the_range_and_the_values_that_are_printed_and_no_others() {
    for line in lines() {
        let (row, code) = (row(line.address), line.code);
        let mut printed: Vec<u16> = line.values.iter().map(|&(value, _)| value).collect();
        printed.sort_unstable();
        printed.dedup();
        let mut listed: Vec<u16> = row.range.choices().iter().map(|choice| choice.value).collect();
        listed.sort_unstable();
        // DP1 to DP4 have the "same format as LFt".
        if !code.starts_with("DP") {
            assert_eq!(listed, printed, "{code}");
        }
        for &(value, name) in &line.values {
            let choice = row.choice(value).unwrap();
            // "UpdH" is printed "UPdH" beside it; an unknown rating has no code.
            let name = name.map(|name| if name == "UpdH" { "UPdH" } else { name });
            if let Some(name) = name.filter(|&name| name != "unknown") {
                let fits = choice.code.split([' ', ',']).any(|part| part.eq_ignore_ascii_case(name));
                assert!(fits, "{code}: {value} is {} instead of {name}", choice.code);
            }
        }
        let bounds = line.range.trim_end_matches(" RPM").split_once(" to ");
        let bounds = bounds.and_then(|(from, to)| Some((from.parse::<i32>().ok()?, to.parse::<i32>().ok()?)));
        match (bounds, row.range) {
            (Some(printed), Range::Within(from, to) | Range::Described(from, to, _)) => {
                assert_eq!((from, to), printed, "{code}");
            }
            (Some(printed), range) => panic!("{code}: {printed:?} and {range:?}"),
            (None, Range::Within(..)) => panic!("{code}: {}", line.range),
            (None, _) => {}
        }
    }
}

#[test]
fn the_lists_whose_words_stand_in_prose_are_those_of_the_prose() {
    // p. 26, 25, 56, 29, 47.
    let shows = |address: u16, word: u16| row(address).show(word);
    assert_eq!(shows(3011, 6), "6 U15 (1.5 kW)");
    assert_eq!(shows(3012, 3), "3 N4 (380-500 V 3-phase)");
    assert_eq!(shows(6056, 4), "4 heartbeat");
    assert_eq!((row(3003).range.allows(9_999), row(3003).range.allows(10_000)), (true, false));
    assert_eq!((row(9643).range.allows(1), row(9643).range.allows(800)), (true, true));
    assert_eq!(shows(10003, 65_535), "65535 nO (not set)");
}

#[test]
fn what_the_modbus_manual_prints_itself_is_marked_so() {
    let printed: Vec<u16> =
        ROWS.iter().filter(|row| row.confidence == Confidence::Manual).map(|row| row.address).collect();
    let mut sorted = printed.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, [3102, 3103, 3104, 3105, 9001, 9002], "BBV52816 p. 12 and 14");
}

#[test]
fn commands_references_and_what_is_read_do_not_live_in_eeprom() {
    for row in ROWS {
        let parameter = row.access.is_writable()
            && ![8501, 8502, 8503, 8504, 8601, 8602, 5240, 5261, 7128, 8001, 8002, 3120]
                .contains(&row.address);
        assert_eq!(row.storage != Storage::Volatile, parameter, "{}", row.code);
        assert!(row.storage != Storage::Eeprom, "{}: only CMI bit 1 writes it (p. 20)", row.code);
    }
}

#[test]
fn words_of_bits_are_shown_as_bits() {
    for address in
        [8501, 8504, 8601, 3201, 8603, 3206, 3250, 3252, 5240, 7211, 7212, 7213, 7214, 8541, 8542, 8606, 3302]
    {
        assert_eq!(row(address).unit.form, Form::Bits, "W{address}");
    }
}

#[test]
fn every_fault_code_of_page_24_has_a_meaning_and_a_remedy() {
    let printed = lines().into_iter().find(|line| line.code == "LFt").unwrap().values;
    assert_eq!(printed.len(), 32);
    for (code, name) in printed {
        let entry = FAULTS.iter().find(|entry| entry.code == code);
        if code == 0 {
            assert_eq!(entry, None, "nOF is no fault");
            continue;
        }
        let entry = entry.unwrap_or_else(|| panic!("{code} is missing"));
        assert_eq!(Some(entry.mnemonic), name, "{code}");
        assert!(!entry.remedy.is_empty() && !entry.meaning.is_empty());
    }
    assert_eq!(FAULTS.len(), 31);
}
