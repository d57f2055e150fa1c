//! Names that somebody takes for others: with characters that nobody sees, or alike but for those that look the same (Unicode's
//! UTS 39). One that stands in a file is doubted, so that an update stops no plant; one that is new is refused.

use std::{collections::HashMap, fmt::Write as _};

use unicode_security::skeleton;

/// Whether a character is not seen, or changes how others are: by Unicode's `Default_Ignorable_Code_Point` and `Bidi_Control`, and all
/// that is for control.
fn is_unseen(character: char) -> bool {
    character.is_control()
        || matches!(character,
            '\u{AD}' | '\u{34F}' | '\u{61C}' | '\u{115F}'..='\u{1160}' | '\u{17B4}'..='\u{17B5}'
            | '\u{180B}'..='\u{180F}' | '\u{200B}'..='\u{200F}' | '\u{2028}'..='\u{202E}' | '\u{2060}'..='\u{206F}'
            | '\u{3164}' | '\u{FE00}'..='\u{FE0F}' | '\u{FEFF}' | '\u{FFA0}' | '\u{FFF0}'..='\u{FFFB}'
            | '\u{1BCA0}'..='\u{1BCA3}' | '\u{1D173}'..='\u{1D17A}' | '\u{E0000}'..='\u{E0FFF}')
}

/// What is wrong with a name by itself.
pub fn oddity(name: &str) -> Option<String> {
    let unseen = name.chars().find(|character| is_unseen(*character))?;
    Some(format!("{}: U+{:04X} in it is not seen: expected a name without", shown(name), u32::from(unseen)))
}

/// Whether somebody who reads one name may take it for the other.
pub fn are_alike(one: &str, other: &str) -> bool {
    let (one, other) = (Looks::of(one), Looks::of(other));
    one.known_by().iter().any(|look| other.taken_for().contains(look))
}

/// What is doubtful in the names of one kind, such as the drives: each by itself, and two of them together.
pub fn doubts<'a>(kind: &str, names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let (mut doubts, mut known) = (Vec::new(), HashMap::<(Case, String), &str>::new());
    for name in names {
        doubts.extend(oddity(name).map(|oddity| format!("{kind} {oddity}")));
        let looks = Looks::of(name);
        let like = looks.taken_for().iter().find_map(|look| known.get(look)).filter(|like| **like != name);
        doubts.extend(like.map(|like| {
            format!(
                "{kind} {} and {} look alike: expected names that nobody confuses",
                shown(like),
                shown(name)
            )
        }));
        for look in looks.known_by() {
            known.entry(look).or_insert(name);
        }
    }
    doubts
}

/// In which letters a name is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Case {
    Written,
    Small,
    Great,
    /// As it is written, and what is seen then in small letters: `PANEL-I` is seen as `PANEL-l`, and said as `panel-l`.
    SmallAfterwards,
}

/// How a name is seen. Looks of one case are compared with each other: in small letters `I` is no `1`, in great ones `l` is none.
struct Looks {
    written: String,
    small: String,
    great: String,
    afterwards: String,
}

impl Looks {
    /// What is not seen is left out, and spaces side by side are seen as one.
    fn of(name: &str) -> Self {
        let seen = |text: &str| {
            let seen: String = skeleton(text).filter(|character| !is_unseen(*character)).collect();
            seen.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        let written = seen(name);
        let afterwards = written.to_lowercase();
        Self { small: seen(&name.to_lowercase()), great: seen(&name.to_uppercase()), written, afterwards }
    }

    fn known_by(&self) -> [(Case, String); 4] {
        [
            (Case::Written, self.written.clone()),
            (Case::Small, self.small.clone()),
            (Case::Great, self.great.clone()),
            (Case::SmallAfterwards, self.afterwards.clone()),
        ]
    }

    /// As others are [known by](Self::known_by) for whom it is taken. Not two that are alike only afterwards: else `TANK I` and `TANK L`
    /// were.
    fn taken_for(&self) -> [(Case, String); 5] {
        [
            (Case::Written, self.written.clone()),
            (Case::Small, self.small.clone()),
            (Case::Great, self.great.clone()),
            (Case::Written, self.afterwards.clone()),
            (Case::SmallAfterwards, self.written.clone()),
        ]
    }
}

/// A name with what is not seen, and all but ASCII behind it by their numbers.
fn shown(name: &str) -> String {
    let seen: String = name.chars().filter(|character| !is_unseen(*character)).collect();
    let mut text = format!("{seen:?}");
    let mut strange =
        name.chars().filter(|character| !character.is_ascii() || character.is_control()).peekable();
    if strange.peek().is_some() {
        let numbers: Vec<String> =
            strange.take(4).map(|character| format!("U+{:04X}", u32::from(character))).collect();
        let _ = write!(text, " ({})", numbers.join(" "));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_as_plants_have_them_in_any_language_are_not_doubted() {
        let names = [
            "pump 1",
            "pump 2",
            "pump 10",
            "pump 11",
            "Lüfter Süd",
            "Lufter West",
            "pompe d’éjection n° 3",
            "αντλία 1",
            "αντλία 2",
            "ανεμιστήρας Βόρειος",
            "насос 1",
            "насос 2",
            "вентилятор юг",
            "ポンプ1",
            "泵 2",
            "مضخة ١",
            "מאוורר 7",
            "bomba de água",
            "bomba de agua 2",
            "çark",
            "İstanbul 1",
            "North/Fan-A_2",
            "Ø 40 mm",
            // A tank for every letter.
            "TANK H",
            "TANK I",
            "TANK L",
            "TANK O",
            "tank h 2",
            "tank i 2",
            "tank l 2",
            "tank o 2",
            "Tank I 3",
            "Tank L 3",
        ];
        assert_eq!(doubts("drive", names.into_iter()), Vec::<String>::new());
    }

    #[test]
    fn what_nobody_sees_is_told_by_its_number() {
        for (name, number) in [
            ("pump\u{202E}1", "U+202E"),
            ("pump\u{200B} 1", "U+200B"),
            ("pu\u{AD}mp 1", "U+00AD"),
            ("\u{FEFF}pump 1", "U+FEFF"),
            ("pump\u{7} 1", "U+0007"),
            ("pump\u{85}1", "U+0085"),
            ("pump \u{2066}1", "U+2066"),
            ("pump\u{2028}1", "U+2028"),
            ("pump\u{E0041} 1", "U+E0041"),
            ("pump\u{200D}1", "U+200D"),
            ("pump 1\u{FE0F}", "U+FE0F"),
        ] {
            let told = oddity(name).unwrap();
            assert!(told.contains(number), "{told}");
            assert!(!told.chars().any(is_unseen), "{told:?}");
        }
    }

    #[test]
    fn two_names_that_look_alike_are_told_with_what_differs() {
        for (one, other) in [
            // Cyrillic, Greek, digits and letters, full width, composed and decomposed, spaces, case.
            ("pump 1", "рump 1"),
            ("AB 1", "ΑΒ 1"),
            ("fan 10", "fan lO"),
            ("pump 1", "ｐｕｍｐ 1"),
            ("Lüfter", "Lu\u{308}fter"),
            ("pump 1", "pump\u{A0}1"),
            ("pump 1", "pump  1"),
            ("Pump 1", "pump 1"),
            ("pump 1", "pump\u{200B} 1"),
            ("modem", "rnodem"),
            // A digit and a letter that look alike in one case, the rest in another.
            ("PANEL-I", "panel-1"),
            ("PANEL-I", "panel-l"),
            ("Panel-1", "PANEL-I"),
            ("PANEL-I0", "panel-lo"),
            ("fan 0", "FAN O"),
            ("fan 0", "fan o"),
        ] {
            assert!(are_alike(other, one), "{other} {one}");
            assert!(are_alike(one, other), "{one} {other}");
            let told = doubts("drive", [one, other].into_iter());
            assert!(told.iter().any(|doubt| doubt.contains("look alike")), "{told:?}");
        }
        let told = doubts("drive", ["pump 1", "рump 1"].into_iter());
        assert_eq!(
            told,
            ["drive \"pump 1\" and \"рump 1\" (U+0440) look alike: expected names that nobody confuses"]
        );
        // A name that stands in two tables is one name.
        assert!(doubts("drive", ["pump 1", "pump 1"].into_iter()).is_empty());
    }
}
