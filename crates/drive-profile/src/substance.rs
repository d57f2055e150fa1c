//! What of a file a trial tries: what decides how its drive is read, stopped and started.

use std::fmt::Write as _;

use ring::digest::SHA256;
use toml::{Table, Value};

/// Tables and keys that decide nothing: names, texts for people, and where a fact was read.
const SAID: &[&str] = &[
    "tried",
    "texts",
    "sources",
    "source",
    "what",
    "why",
    "key",
    "maker",
    "name",
    "format",
    "codes",
    "exceptions",
];

/// The SHA-256 of what decides, in hexadecimal digits: as many for two files that say the same in other words, numbers and order.
pub(crate) fn of(text: &str) -> String {
    let mut said = String::new();
    // A text that is none was refused before.
    table(&text.parse().unwrap_or_default(), &mut said);
    digest(&said)
}

/// The SHA-256 of a text, in hexadecimal digits: what its profile is known by.
#[must_use]
pub fn digest(text: &str) -> String {
    let digest = ring::digest::digest(&SHA256, text.as_bytes());
    digest.as_ref().iter().map(|byte| format!("{byte:02x}")).collect()
}

fn table(of: &Table, said: &mut String) {
    let mut all: Vec<_> = of.iter().filter(|(key, _)| !SAID.contains(&key.as_str())).collect();
    all.sort_by_key(|(key, _)| key.as_str());
    said.push('{');
    for (key, answer) in all {
        let _ = write!(said, "{key:?}=");
        value(answer, said);
    }
    said.push('}');
}

fn value(of: &Value, said: &mut String) {
    match of {
        Value::Table(of) => table(of, said),
        Value::Array(all) => {
            said.push('[');
            all.iter().for_each(|of| value(of, said));
            said.push(']');
        }
        Value::String(text) => {
            let _ = write!(said, "{text:?}");
        }
        Value::Integer(number) => {
            let _ = write!(said, "{number}");
        }
        Value::Boolean(yes) => {
            let _ = write!(said, "{yes}");
        }
        Value::Float(_) | Value::Datetime(_) => {
            let _ = write!(said, "{of:?}");
        }
    }
    said.push(',');
}
