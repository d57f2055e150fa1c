//! What a message says, read strictly: whoever asks for motion says one thing, and a stop is one whatever else it says.
//!
//! What is refused of everything that is no stop: [`drived_words::strict`].

use std::time::Duration;

use drive_core::StopMode;
use drive_fleet::StopOrder;
use drived_words::{
    object::Object,
    strict::{STOP, Unclear, object, strict, unambiguous},
};
use serde_json::Value;

use super::{
    Action, ActionWord, Expects,
    body::{Asked, is_id},
};

/// A message, as far as it can be understood.
#[derive(Debug, Clone)]
pub struct Said {
    /// For the audit log.
    pub body: Value,
    /// What it names, whether or not it can be understood.
    pub action: Option<ActionWord>,
    pub id: Option<String>,
    pub asked: Result<Asked, Unclear>,
}

impl Said {
    /// An object with its `action` beside the body of the API.
    pub fn of(text: &str) -> Self {
        if text.trim() == STOP {
            return Self::plain(Action::Stop(StopMode::Ramp.into()), Value::from(text));
        }
        let object = match object(text.as_bytes()) {
            Ok(object) => object,
            Err(unclear) => return Self::unclear(unclear, Value::from(text)),
        };
        let actions: Vec<&Value> = object.all("action").collect();
        let (body, id) = (object.shown(), object.one("id").and_then(Value::as_str));
        let id = id.filter(|id| is_id(id)).map(str::to_owned);
        if !actions.is_empty() && actions.iter().all(|action| **action == STOP) {
            return Self { id, ..Self::stop(&object) };
        }
        let action = object.one("action").and_then(|action| serde_json::from_value(action.clone()).ok());
        Self { body, action, id, asked: asked(&object) }
    }

    /// What came where everything is a stop: a mode that is said once is taken, and else it is the ramp.
    pub fn stopping(text: &str) -> Self {
        match object(text.as_bytes()) {
            Ok(object) => Self::stop(&object),
            Err(_) => Self::plain(
                Action::Stop(mode(&Value::from(text.trim())).unwrap_or(StopMode::Ramp).into()),
                Value::from(text),
            ),
        }
    }

    fn stop(object: &Object) -> Self {
        let mode = object.one("mode").and_then(mode).unwrap_or(StopMode::Ramp);
        let injection = object.one("injection_ms").and_then(Value::as_u64).map(Duration::from_millis);
        let injection = injection.filter(|time| mode == StopMode::DcInjection && !time.is_zero());
        let order = StopOrder { mode, injection };
        let id = object.one("id").and_then(Value::as_str).filter(|id| is_id(id)).map(str::to_owned);
        let mut stop = Self { id, ..Self::plain(Action::Stop(order), object.shown()) };
        // What cannot be understood of it keeps nobody from being stopped.
        let expects = object.one("expects").and_then(|shown| serde_json::from_value(shown.clone()).ok());
        if let Ok(asked) = &mut stop.asked {
            asked.expects = expects;
        }
        stop
    }

    /// What is asked for without an object.
    pub fn plain(action: Action, body: Value) -> Self {
        let asked = Asked { id: None, expires_in_ms: None, issued_unix_ms: None, expects: None, action };
        Self { body, action: Some(action.word()), id: None, asked: Ok(asked) }
    }

    /// What cannot be understood.
    pub const fn unclear(unclear: Unclear, body: Value) -> Self {
        Self { body, action: None, id: None, asked: Err(unclear) }
    }

    /// What whoever asks was shown.
    pub fn expects(&self) -> Option<Expects> {
        self.asked.as_ref().ok().and_then(|asked| asked.expects.clone())
    }

    /// How it stops, if it is a stop.
    pub fn stops(&self) -> Option<StopOrder> {
        match &self.asked {
            Ok(Asked { action: Action::Stop(order), .. }) => Some(*order),
            _ => None,
        }
    }
}

/// What an object that is no stop asks for.
fn asked(object: &Object) -> Result<Asked, Unclear> {
    unambiguous(object)?;
    let mut members = strict(object.clone())?;
    let Some(Value::String(action)) = members.remove("action") else {
        return Err(Unclear::Malformed("expected \"action\"".to_owned()));
    };
    if members.get("issued_unix_ms").is_some_and(|issued| !issued.is_u64()) {
        return Err(Unclear::Malformed("issued_unix_ms: expected milliseconds since 1970".to_owned()));
    }
    Asked::named(&action, members).map_err(Unclear::Malformed)
}

fn mode(value: &Value) -> Option<StopMode> {
    serde_json::from_value(value.clone()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_is_one_whatever_else_it_says_and_by_the_mode_that_it_says_once() {
        for (text, expected) in [
            ("stop", StopMode::Ramp),
            (r#"{"action": "stop", "mode": "fast"}"#, StopMode::Fast),
            (r#"{"action": "stop", "mode": "fast", "mode": "freewheel"}"#, StopMode::Ramp),
            (r#"{"action": "stop", "start": true, "setpoint": 50}"#, StopMode::Ramp),
        ] {
            assert_eq!(Said::of(text).stops(), Some(expected.into()), "{text}");
        }
        for text in ["", "{", "null", "whatever", r#"{"action": "start"}"#, "\u{0}"] {
            assert_eq!(Said::stopping(text).stops(), Some(StopMode::Ramp.into()), "{text}");
        }
        assert_eq!(Said::stopping("freewheel").stops(), Some(StopMode::Freewheel.into()));
    }

    #[test]
    fn a_stop_says_for_how_long_direct_current_is_held_and_is_a_stop_whatever_it_says_of_that() {
        let (dc, ramp) = (StopMode::DcInjection, StopMode::Ramp);
        for (text, expected) in [
            (
                r#"{"mode": "dc_injection", "injection_ms": 3000}"#,
                StopOrder::injecting(Duration::from_secs(3)),
            ),
            (r#"{"mode": "dc_injection"}"#, dc.into()),
            (r#"{"mode": "dc_injection", "injection_ms": 0}"#, dc.into()),
            (r#"{"mode": "dc_injection", "injection_ms": "long"}"#, dc.into()),
            (r#"{"mode": "dc_injection", "injection_ms": 1, "injection_ms": 2}"#, dc.into()),
            (r#"{"injection_ms": 3000}"#, ramp.into()),
        ] {
            assert_eq!(Said::stopping(text).stops(), Some(expected), "{text}");
        }
        let text = r#"{"action": "stop", "mode": "dc_injection", "injection_ms": 250}"#;
        assert_eq!(Said::of(text).stops(), Some(StopOrder::injecting(Duration::from_millis(250))));
    }

    #[test]
    fn nobody_knows_the_id_of_what_has_two() {
        let said = Said::of(r#"{"action": "stop", "id": "a", "id": "b"}"#);
        assert_eq!((said.stops(), said.id), (Some(StopMode::Ramp.into()), None));
    }
}
