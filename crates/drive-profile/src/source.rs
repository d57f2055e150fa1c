//! Where a fact stands in its file, and what its sources are worth.

use std::ops::Range;

use crate::format::Spanned;

use crate::format::{File, Mark};

/// The line in which a place of a text stands, from 1.
pub(crate) fn line(text: &str, span: &Range<usize>) -> usize {
    let before = text.get(..span.start.min(text.len())).unwrap_or(text);
    before.bytes().filter(|byte| *byte == b'\n').count() + 1
}

/// Where a question stands in a text, by its key or as a table of its own.
pub(crate) fn asked(text: &str, key: &str) -> Option<usize> {
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        let is_key = line.strip_prefix(key).is_some_and(|rest| rest.trim_start().starts_with('='));
        if is_key || line.trim_end() == format!("[{key}]") {
            return Some(at);
        }
        at += line.len();
    }
    None
}

/// The names in a text of sources.
pub(crate) fn names(source: &str) -> impl Iterator<Item = &str> {
    source.split_whitespace()
}

/// The grade of a fact: that of the weakest source that it names.
pub(crate) fn grade(file: &File, source: &Spanned<String>) -> Mark {
    let marks =
        names(source.get_ref()).map(|name| file.sources.get(name).map_or(Mark::W, |of| of.get_ref().mark));
    marks.max().unwrap_or(Mark::W)
}
