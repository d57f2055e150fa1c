//! An object that somebody sends, read strictly: two values of one key, a key that nobody knows and a `null` are refused by the name
//! of the key, at every door. What names a stop without being one is said to be neither stop nor start, so that nobody believes
//! that the motor stops.

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::object::Object;

/// Whether a text is the word of a stop, in whatever letters and in whatever quotes or ends of a text it stands.
#[must_use]
pub fn is_stop(text: &str) -> bool {
    let around = |char: char| char.is_whitespace() || char.is_control() || char == '"';
    text.trim_matches(around).eq_ignore_ascii_case("stop")
}

/// Whether a key names what is asked for.
#[must_use]
pub fn is_action(key: &str) -> bool {
    key.trim().eq_ignore_ascii_case("action")
}

/// Why it cannot be understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Unclear {
    #[error("it is no JSON: {0}")]
    NoJson(String),
    #[error("{0}")]
    Malformed(String),
    /// It names a stop beside something else, or where something else is asked for.
    #[error("{0}: this is no stop and no start")]
    Ambiguous(String),
}

/// A body whose address says what it asks for; nothing stands for an object without members.
///
/// # Errors
/// Why it is none of these.
pub fn body<T: DeserializeOwned>(text: &[u8]) -> Result<T, Unclear> {
    let text = if text.trim_ascii().is_empty() { b"{}" } else { text };
    let object = object(text)?;
    unambiguous(&object)?;
    let members = strict(object)?;
    serde_json::from_value(Value::Object(members)).map_err(|error| Unclear::Malformed(error.to_string()))
}

/// Reads an object.
///
/// # Errors
/// It is none.
pub fn object(text: &[u8]) -> Result<Object, Unclear> {
    match Object::read(text) {
        Ok(Some(object)) => Ok(object),
        Ok(None) => {
            let what = if text.trim_ascii() == b"null" { ", and not null" } else { "" };
            Err(Unclear::Malformed(format!("expected an object in JSON{what}")))
        }
        Err(error) => Err(Unclear::NoJson(error.to_string())),
    }
}

/// Refuses what names a stop and is none.
///
/// # Errors
/// It names one.
pub fn unambiguous(object: &Object) -> Result<(), Unclear> {
    for (key, value) in object.members() {
        if is_stop(key) {
            return Err(Unclear::Ambiguous(format!("{key} is no key of a command")));
        }
        if is_action(key) && value.as_str().is_some_and(is_stop) {
            let text = format!("its action is {value} where something else is asked for as well");
            return Err(Unclear::Ambiguous(text));
        }
    }
    Ok(())
}

/// Its members, of which each stands there once and has a value.
///
/// # Errors
/// One stands there twice, or is `null`.
pub fn strict(object: Object) -> Result<Map<String, Value>, Unclear> {
    if let Some(key) = object.twice() {
        return Err(Unclear::Malformed(format!("{key} stands there twice")));
    }
    if let Some(key) = object.null() {
        return Err(Unclear::Malformed(format!("{key}: null is no value: leave the key out")));
    }
    Ok(object.into_members())
}
