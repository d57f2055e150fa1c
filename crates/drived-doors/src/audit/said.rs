//! What of a request is kept: enough to know what was asked, never a secret, and never more than a little.

use serde_json::{Value, json};

use drived_config::kept::sha256;

/// A body that is longer is kept by its length and its SHA-256.
const WHOLE: usize = 512;
/// Words that are longer are cut.
const LONGEST: usize = 300;
/// How a token of ours begins, and how much of one is enough to know it.
const TOKEN: &str = "drv_";
/// Keys whose values nobody shall read.
const SECRETS: [&str; 4] = ["token", "password", "passwd", "secret"];
const MASK: &str = "…";

/// The body of a request, as it is kept.
pub fn bounded(body: &[u8]) -> Option<Value> {
    if body.trim_ascii().is_empty() {
        return None;
    }
    let value = if body.len() <= WHOLE { serde_json::from_slice(body).ok() } else { None };
    Some(match value {
        Some(value) => without_secrets(value),
        None => json!({ "bytes": body.len(), "sha256": sha256(body) }),
    })
}

/// Words without the tokens in them, which somebody has put where they do not belong.
pub(super) fn masked(text: &str) -> String {
    let mut told = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once(TOKEN) {
        told.push_str(before);
        told.push_str(TOKEN);
        rest = after.trim_start_matches(|character: char| character.is_ascii_alphanumeric());
        if rest.len() < after.len() {
            told.push_str(MASK);
        }
    }
    told.push_str(rest);
    if let Some((at, _)) = told.char_indices().nth(LONGEST) {
        told.truncate(at);
        told.push_str(MASK);
    }
    told
}

fn without_secrets(value: Value) -> Value {
    match value {
        Value::String(text) => masked(&text).into(),
        Value::Array(values) => values.into_iter().map(without_secrets).collect(),
        Value::Object(members) => {
            let member = |(key, value): (String, Value)| {
                let is_secret = SECRETS.iter().any(|secret| key.to_ascii_lowercase().contains(secret));
                (masked(&key), if is_secret { MASK.into() } else { without_secrets(value) })
            };
            members.into_iter().map(member).collect()
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_little_is_kept_as_it_is_and_much_by_its_hash() {
        assert_eq!(
            bounded(br#" {"setpoint":{"frequency_hz":30.0}}"#),
            Some(json!({"setpoint": {"frequency_hz": 30.0}}))
        );
        assert_eq!(bounded(b" "), None);
        // printf %1024s '' | tr ' ' x | sha256sum
        let told = bounded("x".repeat(1_024).as_bytes()).unwrap();
        assert_eq!(told["bytes"], 1_024);
        assert_eq!(told["sha256"], "49abd65bbf7f7e40c7055093ed2e3fd75f2f602f2c5fcf955c213e3135eb03f7");
        assert_eq!(bounded(b"no json").unwrap()["bytes"], 7);
    }

    #[test]
    fn no_token_and_no_password_is_kept_wherever_it_was_sent() {
        assert_eq!(masked("POST /a/drv_00ff?x=drv_Abc9&y=1"), "POST /a/drv_…?x=drv_…&y=1");
        assert_eq!(masked("drv_ is how they begin"), "drv_ is how they begin");
        let body = br#"{"Token":"mine","deep":[{"db_password":7,"text":"is drv_0f"}]}"#;
        assert_eq!(
            bounded(body),
            Some(json!({"Token": "…", "deep": [{"db_password": "…", "text": "is drv_…"}]}))
        );
        assert_eq!(masked(&"ä".repeat(400)).chars().count(), 301);
    }
}
