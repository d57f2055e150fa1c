//! A backup goes through its text unchanged, and no text does harm.

use std::path::Path;

use super::*;
use drived_words::failure::Failure;

const FILE: &str = "backup.toml";

fn parse(text: &str) -> Result<Backup, Failure> {
    Backup::parse(Path::new(FILE), text)
}

/// What the hostile files are refused with.
fn refusal(text: &str) -> String {
    match parse(text) {
        Err(Failure::Input(why)) => why,
        other => panic!("taken: {other:?}"),
    }
}

/// Pseudo-random numbers, the same in each run.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u16 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 41) as u16
    }
}

fn some_drive(numbers: &mut Numbers) -> Backup {
    let family = Family::BUILT_IN[usize::from(numbers.next()) % Family::BUILT_IN.len()];
    let names = ["pump 1", "Lüfter \"2\"", "a\\b", "tab\there\nline\u{7f}\u{85}", "", "# = [x]"];
    let mut name = || names[usize::from(numbers.next()) % names.len()].to_owned();
    let (own, line, why) = (name(), name(), name());
    let vendor = Some(name()).filter(|name| !name.is_empty());
    let capabilities = family.capabilities();
    let mut entries = Vec::new();
    for row in capabilities.rows.iter().filter(|row| is_kept(family, row)) {
        let word = match numbers.next() % 4 {
            0 => continue,
            1 => row.range.choices().first().map_or(0, |choice| choice.value),
            _ => numbers.next(),
        };
        entries.push(Entry {
            row,
            held: if numbers.next().is_multiple_of(9) { Err(why.clone()) } else { Ok(word) },
        });
    }
    let held: Vec<u16> =
        entries.iter().filter(|entry| entry.held.is_ok()).map(|entry| entry.row.address).collect();
    for entry in &mut entries {
        // As a backup keeps it: no number without its unit.
        if let Some(by) = capabilities.scaled_by(entry.row.address).filter(|by| !held.contains(&by.address)) {
            entry.held = Err(by.code.to_owned());
        }
    }
    let head = Head {
        name: own,
        family,
        line,
        slave: numbers.next().to_le_bytes()[0],
        vendor,
        model: None,
        firmware: Some("0201".to_owned()),
        date: "2026-11-22T02:30:00Z".to_owned(),
    };
    Backup { head, entries }
}

#[test]
fn every_backup_is_the_same_after_it_was_written_and_read() {
    let mut numbers = Numbers(16);
    for _ in 0..300 {
        let backup = some_drive(&mut numbers);
        let text = backup.to_string();
        assert_eq!(parse(&text).as_ref(), Ok(&backup), "{text}");
        assert_eq!(parse(&text).unwrap().to_string(), text);
    }
}

/// The head of a file of this family.
fn head(family: &str) -> String {
    format!("[drive]\nfamily = \"{family}\"\nslave = 1\nname = \"x\"\nline = \"l\"\ndate = \"d\"\n")
}

#[test]
fn a_hostile_file_is_refused_in_one_line_with_its_place() {
    let of = |line: &str| format!("{}[parameters]\n{line}\n", head("atv312"));
    let deep = format!("{}[parameters]\nACC = {}{}", head("atv312"), "[".repeat(50_000), "]".repeat(50_000));
    let tables = format!("{}[parameters]\nACC{} = 1", head("atv312"), ".a".repeat(50_000));
    for (text, reason) in [
        (String::new(), "missing field"),
        ("\u{0}\u{1b}[31m".to_owned(), "backup.toml:1"),
        ("[drive]\nfamily = 3".to_owned(), "backup.toml:2: family"),
        (format!("{}[parameters]", head("atv999")), "is not a family"),
        (format!("{}slave = 2\n[parameters]", head("atv312")), "duplicate key"),
        (
            format!("{}[parameters]", head("atv312")).replace("slave = 1", "slave = 300"),
            "backup.toml:3: slave",
        ),
        (of("NIX = { raw = 1 }"), "the family atv312 keeps no parameter \"NIX\""),
        (of("ETA = { raw = 1 }"), "keeps no parameter \"ETA\""),
        (of("CMD = { raw = 15 }"), "keeps no parameter \"CMD\""),
        (of("HSP = { raw = 70000 }"), "backup.toml:8"),
        (of("HSP = { raw = -1 }"), "backup.toml:8"),
        (of("HSP = { raw = \"50\" }"), "backup.toml:8"),
        (of("HSP = 50"), "backup.toml:8"),
        (of("HSP = { value = 50 }"), "backup.toml:8"),
        (of("HSP = { }"), "neither a value nor a raw word"),
        (of("HSP = { value = \"fast\" }"), "\"fast\" is no value"),
        (of("HSP = { value = \"50.0 Hz\", raw = 400 }"), "do not agree"),
        (of("HSP = { value = \"50.0 Hz\", error = \"x\" }"), "an error and a value"),
        (of("HSP = { raw = 500, address = 3105 }"), "has the address 3104"),
        (of("HSP = { raw = 500, adress = 3104 }"), "unknown field"),
        (of("ACC = { value = \"3.0 s\" }"), "its unit by Inr, which the file does not have"),
        (of("HSP = { raw = 1 }\nHSP = { raw = 2 }"), "duplicate key"),
        (
            format!("{}[rating]\nHSP = {{ raw = 1 }}\n[parameters]\nHSP = {{ raw = 2 }}", head("atv312")),
            "twice",
        ),
        (deep, "cannot recurse further"),
        (tables, ""),
    ] {
        let why = refusal(&text);
        assert!(why.starts_with(FILE) && why.contains(reason), "{reason}: {why}");
        assert!(!why.contains('\n') && why.len() < 400, "{why}");
    }
}

#[test]
fn a_file_that_is_no_text_or_has_no_end_is_refused() {
    let folder = std::env::temp_dir().join(format!("drived-param-file-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let huge = folder.join("huge.toml");
    std::fs::write(&huge, "#".repeat((1 << 20) + 1)).unwrap();
    let bytes = folder.join("bytes.toml");
    std::fs::write(&bytes, [0xFF, 0xFE, 0]).unwrap();
    for (path, reason) in [
        (&*huge, "larger than any backup"),
        (&*bytes, "no text"),
        (&*folder, ""),
        (Path::new("nowhere.toml"), ""),
    ] {
        let Err(Failure::Input(why)) = Backup::read(path) else { panic!("{} was taken", path.display()) };
        assert!(why.contains(reason), "{why}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn no_cut_and_no_flipped_byte_of_a_backup_panics() {
    let text = some_drive(&mut Numbers(7)).to_string().into_bytes();
    let mut numbers = Numbers(3);
    for _ in 0..400 {
        let mut bytes = text.clone();
        let at = usize::from(numbers.next()) % bytes.len();
        match numbers.next() % 3 {
            0 => bytes.truncate(at),
            1 => bytes[at] ^= numbers.next().to_le_bytes()[0],
            _ => drop(bytes.remove(at)),
        }
        // Whatever it says, it says it.
        let _ = parse(&String::from_utf8_lossy(&bytes));
    }
}

#[test]
fn a_ramp_is_kept_in_seconds_whatever_the_drive_counts_in() {
    // BBV51701 p. 38: Inr 0 counts 0.01 s, 1 counts 0.1 s, 2 counts 1 s.
    for (inr, raw, seconds) in [(0, 300, "3.00 s"), (1, 30, "3.0 s"), (2, 3, "3 s")] {
        let file =
            format!("{}[parameters]\nInr = {{ raw = {inr} }}\nACC = {{ raw = {raw} }}\n", head("atv312"));
        let backup = parse(&file).unwrap();
        let text = backup.to_string();
        let line = text.lines().find(|line| line.starts_with("ACC")).unwrap();
        assert!(line.contains(&format!("value = \"{seconds}\", raw = {raw}, factory = \"3.0 s\"")), "{line}");
        let edited = file.replace(&format!("raw = {raw}"), "value = \"7 s\"");
        let word = parse(&edited).unwrap().word(9001);
        assert_eq!(word, Some([700, 70, 7][inr]), "{edited}");
    }
}
