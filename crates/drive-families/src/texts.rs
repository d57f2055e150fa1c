//! How the values of options are written.

use std::time::Duration;

pub(crate) const WORD: &str = "the number of a word such as 458 or 01CAh";
pub(crate) const WORD_OR_NONE: &str = "the number of a word such as 451 or 01C3h, or none";
pub(crate) const MASK: &str = "a mask such as 0800h, or none";

pub(crate) fn word(text: &str) -> Option<u16> {
    match text.strip_suffix(['h', 'H']) {
        Some(digits) => u16::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

pub(crate) fn two_words(text: &str) -> Option<(u16, u16)> {
    let (low, high) = text.split_once(',')?;
    Some((word(low.trim())?, word(high.trim())?))
}

pub(crate) fn or_none<T>(text: &str, read: fn(&str) -> Option<T>) -> Option<Option<T>> {
    if text == "none" { Some(None) } else { read(text).map(Some) }
}

/// A mask of 0 stands for a bit that the drive does not have.
pub(crate) fn mask(text: &str) -> Option<u16> {
    or_none(text, word).map(Option::unwrap_or_default)
}

pub(crate) fn time(text: &str) -> Option<Duration> {
    let (number, unit): (_, fn(u64) -> Duration) = match text.strip_suffix("ms") {
        Some(number) => (number, Duration::from_millis),
        None => (text.strip_suffix('s')?, Duration::from_secs),
    };
    number.trim_end().parse().ok().map(|number: u32| unit(number.into()))
}
