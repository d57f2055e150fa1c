//! Texts of any content: good profiles that were damaged. Each is refused, with a line that it has, or is a profile that keeps what the
//! checker promises. `PROPTEST_CASES` makes more of them.

use drive_profile::{format::Answer, read, shipped};
use proptest::prelude::*;

/// What is done to a text.
#[derive(Debug, Clone)]
enum Damage {
    /// A line is gone.
    Cut(usize),
    /// A line stands twice.
    Double(usize),
    /// Two lines are exchanged.
    Swap(usize, usize),
    /// A character is another.
    Letter(usize, char),
    /// A number is another.
    Number(usize, i64),
    /// A word in quotes is another.
    Word(usize, &'static str),
    /// The text ends there.
    End(usize),
}

const WORDS: &[&str] = &[
    "none",
    "unknown",
    "",
    "write",
    "read",
    "run",
    "wait",
    "coil",
    "input_register",
    "low_first",
    "owner",
    "CMD",
    "STW",
    "%",
    "Hz",
];

fn damage() -> impl Strategy<Value = Damage> {
    let place = any::<usize>();
    let number = prop_oneof![any::<i64>(), -1_i64..20, Just(65_535), Just(65_536), Just(i64::MAX)];
    prop_oneof![
        place.prop_map(Damage::Cut),
        place.prop_map(Damage::Double),
        (place, any::<usize>()).prop_map(|(one, other)| Damage::Swap(one, other)),
        (place, any::<char>()).prop_map(|(at, letter)| Damage::Letter(at, letter)),
        (place, number).prop_map(|(at, number)| Damage::Number(at, number)),
        (place, prop::sample::select(WORDS)).prop_map(|(at, word)| Damage::Word(at, word)),
        place.prop_map(Damage::End),
    ]
}

fn damaged(text: &str, damage: &Damage) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    let count = lines.len().max(1);
    match *damage {
        Damage::Cut(at) if !lines.is_empty() => {
            lines.remove(at % count);
        }
        Damage::Double(at) if !lines.is_empty() => lines.insert(at % count, lines[at % count]),
        Damage::Swap(one, other) if !lines.is_empty() => lines.swap(one % count, other % count),
        Damage::Letter(at, letter) => {
            let mut letters: Vec<char> = text.chars().collect();
            let count = letters.len().max(1);
            if let Some(place) = letters.get_mut(at % count) {
                *place = letter;
            }
            return letters.into_iter().collect();
        }
        Damage::Number(at, number) => {
            return parts(
                text,
                at,
                |c| c.is_ascii_alphanumeric(),
                |part| part.starts_with(|c: char| c.is_ascii_digit()),
                &number.to_string(),
            );
        }
        Damage::Word(at, word) => {
            return parts(text, at, |c| c != '"' && c != '\n', |part| !part.is_empty(), word);
        }
        Damage::End(at) => return text.chars().take(at % (text.chars().count() + 1)).collect(),
        _ => {}
    }
    lines.join("\n")
}

/// The text with one of the parts that are of such characters, and count, replaced.
fn parts(
    text: &str,
    at: usize,
    of: impl Fn(char) -> bool,
    counts: impl Fn(&str) -> bool,
    by: &str,
) -> String {
    let mut found = Vec::new();
    let mut begun = None;
    for (index, letter) in text.char_indices().chain([(text.len(), '\n')]) {
        match (begun, of(letter) && index < text.len()) {
            (None, true) => begun = Some(index),
            (Some(from), false) => {
                if counts(&text[from..index]) {
                    found.push(from..index);
                }
                begun = None;
            }
            _ => {}
        }
    }
    let Some(range) = found.get(at % found.len().max(1)).cloned() else { return text.to_owned() };
    let mut text = text.to_owned();
    text.replace_range(range, by);
    text
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_damaged_profile_is_refused_or_keeps_what_the_checker_promises(
        which in 0..shipped::TEXTS.len(),
        damages in prop::collection::vec(damage(), 1..4),
    ) {
        let text = damages.iter().fold(shipped::TEXTS[which].1.to_owned(), |text, damage| damaged(&text, damage));
        match read(&text) {
            Ok(profile) => {
                let stop = &profile.file().stop;
                for stop in [&stop.ramp, &stop.fast, &stop.freewheel, &stop.dc_injection] {
                    if let Answer::Given(stop) = stop {
                        prop_assert_eq!(stop.get_ref().steps.len(), 1);
                        prop_assert!(stop.get_ref().steps[0].get_ref().write.is_some());
                    }
                }
            }
            Err(refusals) => {
                prop_assert!((1..=100).contains(&refusals.0.len()));
                for refusal in &refusals.0 {
                    prop_assert!(refusal.line >= 1 && refusal.line <= text.lines().count().max(1) + 1, "{}", refusal);
                }
            }
        }
    }

    #[test]
    fn any_text_at_all_is_refused(text in "\\PC{0,400}") {
        prop_assert!(read(&text).is_err());
    }
}
