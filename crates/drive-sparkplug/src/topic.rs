//! Names and topics: `spBv1.0/group/TYPE/edge node/device`.

use std::fmt;

const NAMESPACE: &str = "spBv1.0";
/// An id is a level of a topic: a name, not a text.
const LONGEST_ID: usize = 1_000;

/// The name of a group, an edge node, a device or a host: UTF-8 without `+`, `/` and `#`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id(String);

/// Why a text is no [`Id`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{text:?} cannot be an id of Sparkplug: {why}")]
pub struct IdError {
    text: String,
    why: &'static str,
}

impl Id {
    /// A text as an id.
    ///
    /// # Errors
    /// It is empty, longer than a thousand bytes, or has a character that a level of a topic cannot have.
    pub fn new(text: impl Into<String>) -> Result<Self, IdError> {
        let text = text.into();
        let why = if text.is_empty() {
            "expected at least one character"
        } else if text.len() > LONGEST_ID {
            "expected a thousand bytes at the most"
        } else if text.contains(['+', '/', '#']) {
            "expected a name without + / #"
        } else if text.chars().any(char::is_control) {
            "expected a name without control characters"
        } else {
            return Ok(Self(text));
        };
        Err(IdError { text, why })
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether the two differ in nothing but case, which the specification advises against.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        self.0.to_lowercase() == other.0.to_lowercase()
    }
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// What a message of an edge node or of a device is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verb {
    Birth,
    Data,
    Death,
    Command,
}

/// The name of an edge node: unique in its plant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeName {
    /// Its group.
    pub group: Id,
    /// Its own name, unique in the group.
    pub edge_node: Id,
}

impl NodeName {
    pub(crate) fn topic(&self, verb: Verb, device: Option<&Id>) -> String {
        let verb = match verb {
            Verb::Birth => "BIRTH",
            Verb::Data => "DATA",
            Verb::Death => "DEATH",
            Verb::Command => "CMD",
        };
        let Self { group, edge_node } = self;
        match device {
            None => format!("{NAMESPACE}/{group}/N{verb}/{edge_node}"),
            Some(device) => format!("{NAMESPACE}/{group}/D{verb}/{edge_node}/{device}"),
        }
    }
}

/// The topic on which a host says that it is there.
pub(crate) fn state_topic(host: &Id) -> String {
    format!("{NAMESPACE}/STATE/{host}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_is_one_level_of_a_topic() {
        for wrong in ["", "a/b", "a+", "#", "a\0", "a\nb", &"x".repeat(1_001)] {
            assert!(Id::new(wrong).is_err(), "{wrong:?}");
        }
        for right in ["pump 1", "Lüfter", "泵", "a.b-c_d", "$x"] {
            assert!(Id::new(right).is_ok(), "{right:?}");
        }
        let error = Id::new("a/b").unwrap_err();
        assert_eq!(error.to_string(), r#""a/b" cannot be an id of Sparkplug: expected a name without + / #"#);
    }
}
