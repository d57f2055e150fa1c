//! The text as such: its length, its form, its keys, and that no question is left out.

use super::{LONGEST, Refusal};
use crate::{format::File, source::line};

/// How deep tables may stand in each other.
const DEEPEST: usize = 16;

pub(super) fn parse(text: &str) -> Result<File, Refusal> {
    if text.len() > LONGEST {
        return Err(Refusal {
            line: 1,
            reason: format!("the file is longer than {LONGEST} bytes"),
            write: "one drive in a file".to_owned(),
        });
    }
    if let Some(deep) = too_deep(text) {
        return Err(Refusal {
            line: deep,
            reason: "tables or lists stand too deep in each other".to_owned(),
            write: "what the format has, which is nowhere so deep".to_owned(),
        });
    }
    toml::from_str(text).map_err(|error| refusal(text, &error))
}

/// The line in which brackets stand too deep in each other, in whatever they stand: a parser may follow each by a call.
fn too_deep(text: &str) -> Option<usize> {
    text.lines()
        .zip(1..)
        .scan(0_usize, |open, (content, number)| {
            for byte in content.bytes() {
                match byte {
                    b'[' | b'{' => *open += 1,
                    b']' | b'}' => *open = open.saturating_sub(1),
                    _ => {}
                }
                if *open > DEEPEST {
                    return Some(Some(number));
                }
            }
            Some(None)
        })
        .flatten()
        .next()
}

/// What the parser says, in the words of whoever writes a profile.
fn refusal(text: &str, error: &toml::de::Error) -> Refusal {
    let message = error.message();
    let line = line(text, &error.span().unwrap_or(0..0));
    let quoted = |begin: &str| message.strip_prefix(begin)?.split('`').nth(1);
    let (reason, write) = if let Some(question) = quoted("missing field ") {
        (
            format!("the question `{question}` is left in silence"),
            format!(
                "{question} = what the manual says, \"none\" where there is none, \"unknown\" where nobody knows"
            ),
        )
    } else if let Some(key) = quoted("unknown field ") {
        let instead = message.split_once("expected ").map_or("a key of the format", |(_, instead)| instead);
        (format!("`{key}` is no key of the format"), format!("{instead}, or nothing"))
    } else {
        (message.lines().collect::<Vec<_>>().join(" "), "what the format has in this place".to_owned())
    };
    Refusal { line, reason, write }
}
