//! A report in French: its own words, and those of the program as the page says them. What a drive, its manual's list of
//! parameters or its owner says stays as it was said.

mod phrases;
mod words;

use std::{borrow::Cow, collections::HashMap};

use drived_http::page::french as page;
use drived_plant::plant::views::LineDetailView;

use self::{phrases::PHRASES, words::WORDS};
use super::line::cannot_be_told_from;

/// A document whose own words are French: headings, labels, heads of tables, and what is marked as the program's; and whose
/// numbers are written with a comma.
/// `found` has the French of [what the lines found](found), whose sentences are made of figures.
pub(super) fn translated(html: &str, found: &HashMap<String, String>) -> String {
    let mut text = String::with_capacity(html.len() + html.len() / 8);
    for part in parts(html) {
        match part {
            Part::Tag(tag) => text.push_str(tag),
            Part::Ours(said) => {
                let plain = unescaped(said);
                let told = found.get(&*plain).map(|told| Cow::from(told.as_str()));
                match told.or_else(|| french(&plain)) {
                    Some(french) => text.push_str(&escaped(&spaced(&french))),
                    None => text.push_str(said),
                }
            }
            Part::Others(said) => match unescaped(said) {
                plain if is_number(&plain) => text.push_str(&escaped(&number(&plain))),
                // What stands between two of our texts.
                _ if said.starts_with(": ") || said.starts_with("; ") => {
                    text.push(NO_BREAK);
                    text.push_str(said);
                }
                _ => text.push_str(said),
            },
        }
    }
    text.replacen("<html lang=\"en\">", "<html lang=\"fr\">", 1)
}

/// What lines found wrong with themselves, as the report says it and in French.
pub(super) fn found<'a>(lines: impl IntoIterator<Item = &'a LineDetailView>) -> HashMap<String, String> {
    let mut all = HashMap::new();
    for told in lines.into_iter().flat_map(|detail| &detail.line.findings) {
        let Some(french) = page::finding(told) else { continue };
        all.insert(told.text.clone(), french.text);
        all.extend(told.next.iter().cloned().zip(french.next.into_iter().map(str::to_owned)));
        if let (Some(what), Some(alike)) = (&told.cannot_be_told_from, french.alike) {
            all.insert(cannot_be_told_from(what), alike);
        }
    }
    all
}

/// What of a document is the program's own and has no French words: nothing, in a document of known parts.
#[cfg(test)]
pub(super) fn untranslated(html: &str, found: &HashMap<String, String>) -> Vec<String> {
    let ours = parts(html).filter_map(|part| match part {
        Part::Ours(said) if !said.is_empty() => Some(unescaped(said).into_owned()),
        _ => None,
    });
    ours.filter(|said| !found.contains_key(said) && french(said).is_none()).collect()
}

/// A tag, or what stands between two of them.
enum Part<'a> {
    Tag(&'a str),
    /// Words of the program.
    Ours(&'a str),
    /// Words of somebody else, and numbers.
    Others(&'a str),
}

/// The elements whose text is the program's own.
const OURS: [&str; 9] = [
    "<h2>",
    "<h2 class=\"new\">",
    "<h4>",
    "<th scope=\"row\">",
    "<th scope=\"col\">",
    "<th scope=\"col\" class=\"number\">",
    "<span class=\"own\">",
    "<summary>",
    "<title class=\"own\">",
];

fn parts(html: &str) -> impl Iterator<Item = Part<'_>> {
    let mut is_ours = false;
    html.split_inclusive('>').flat_map(move |part| {
        let (said, tag) = part.split_at(part.find('<').unwrap_or(part.len()));
        let said = if is_ours { Part::Ours(said) } else { Part::Others(said) };
        is_ours = OURS.contains(&tag);
        [said, Part::Tag(tag)]
    })
}

/// The French of what the program says: a word or sentence of the report or of the page, or a phrase with its figures.
fn french(english: &str) -> Option<Cow<'static, str>> {
    let own = WORDS.iter().find(|(known, _)| *known == english).map(|(_, french)| *french);
    if let Some(whole) = own.or_else(|| page::sentence(english)) {
        return Some(whole.into());
    }
    if let Some(word) = page::word(english) {
        return Some(inside(word).into());
    }
    if is_number(english) {
        return Some(number(english).into());
    }
    let phrase = PHRASES.iter().find_map(|(pattern, french)| Some(put(&held(pattern, english)?, french)));
    let phrase = phrase.or_else(|| several(english, "; ", " ; ")).or_else(|| several(english, ", ", ", "));
    phrase.map(Cow::from)
}

/// Several sentences in one text, each with its French.
fn several(english: &str, between: &str, french_between: &str) -> Option<String> {
    let all = english.contains(between).then(|| english.split(between).map(french))?;
    Some(all.collect::<Option<Vec<_>>>()?.join(french_between))
}

/// What stands in the places of a pattern, in French: in `{}` a number, in `{w}` what has French words, in `{s}` what has or
/// stays, in `{r}` what stays as it is.
fn held(pattern: &str, english: &str) -> Option<Vec<String>> {
    let mut pieces = pattern.split('{');
    let mut rest = english.strip_prefix(pieces.next()?)?;
    let mut pieces = pieces.peekable();
    let mut held = Vec::new();
    while let Some(piece) = pieces.next() {
        let (kind, behind) = piece.split_once('}')?;
        let (value, after) = match (pieces.peek(), behind) {
            (None, _) => (rest.strip_suffix(behind)?, ""),
            (Some(_), _) => rest.split_once(behind)?,
        };
        rest = after;
        held.push(match kind {
            "" if value.contains(|one: char| one.is_ascii_digit() || one == '–') => number(value),
            "w" => french(value)?.into_owned(),
            "s" => french(value).map_or_else(|| number(value), Cow::into_owned),
            "r" => value.to_owned(),
            _ => return None,
        });
    }
    (rest.is_empty() || held.is_empty())
        .then_some(held)
        .filter(|held| held.iter().all(|value| !value.is_empty()))
}

/// The French of a pattern with what it holds: `{0}`, `{1}` …
fn put(held: &[String], french: &str) -> String {
    held.iter()
        .enumerate()
        .fold(french.to_owned(), |text, (index, value)| text.replace(&format!("{{{index}}}"), value))
}

/// A space at which no line ends.
const NO_BREAK: char = '\u{a0}';

/// No line begins with a sign that has a space before it.
fn spaced(french: &str) -> String {
    [':', ';', '»'].into_iter().fold(french.replace("« ", "«\u{a0}"), |text, sign| {
        text.replace(&format!(" {sign}"), &format!("{NO_BREAK}{sign}"))
    })
}

/// A word as it stands inside a sentence.
fn inside(word: &str) -> String {
    let mut letters = word.chars();
    match (letters.next(), letters.clone().next()) {
        (Some(first), Some(second)) if second.is_lowercase() => first.to_lowercase().chain(letters).collect(),
        _ => word.to_owned(),
    }
}

/// The units behind a number; without one it may be a version.
const UNITS: [&str; 16] =
    ["ms", "s", "min", "h", "d", "Hz", "A", "V", "%", "rpm", "tr/min", "kW", "kWh", "Wh", "W", "Nm"];

/// Whether a text is a number with its unit, and nothing else.
fn is_number(text: &str) -> bool {
    let text = text.trim_start_matches(['<', '>', ' ', NO_BREAK, '-', '−']);
    text.split_once([' ', NO_BREAK]).is_some_and(|(number, unit)| {
        UNITS.contains(&unit)
            && number.starts_with(|one: char| one.is_ascii_digit())
            && number.chars().all(|one| one.is_ascii_digit() || ['.', ','].contains(&one))
    })
}

/// Numbers as they are written in French.
fn number(text: &str) -> String {
    let bytes = text.as_bytes();
    let is_digit = |at: Option<usize>| at.and_then(|at| bytes.get(at)).is_some_and(u8::is_ascii_digit);
    let comma = |(at, one): (usize, char)| match one {
        '.' if is_digit(at.checked_sub(1)) && is_digit(at.checked_add(1)) => ',',
        one => one,
    };
    let text: String = text.char_indices().map(comma).collect();
    let text = text.replace(" rpm", " tr/min");
    if is_number(&text) { text.replace(' ', "\u{a0}") } else { text }
}

const ESCAPES: [(&str, &str); 4] = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&amp;", "&")];

fn unescaped(said: &str) -> Cow<'_, str> {
    if !said.contains('&') {
        return said.into();
    }
    ESCAPES.iter().fold(said.to_owned(), |text, (written, meant)| text.replace(written, meant)).into()
}

fn escaped(text: &str) -> String {
    ESCAPES.iter().rev().fold(text.to_owned(), |text, (written, meant)| text.replace(meant, written))
}
