//! What a message says, read strictly: whoever asks for motion says one thing, and a stop is one whatever else it says.
//!
//! What is refused of everything that is no stop: [`drived_words::strict`].

use std::time::Duration;

use drive_core::StopMode;
use drive_fleet::StopOrder;
use drived_words::{
    object::Object,
    strict::{Unclear, is_action, is_stop, object, strict, unambiguous},
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
    /// An object with its `action` beside the body of the API. What begins as an object that stops is a
    /// stop also where it does not come to its end.
    pub fn of(text: &[u8]) -> Self {
        let shown = || Value::from(String::from_utf8_lossy(text));
        if is_stop(&String::from_utf8_lossy(text)) {
            return Self::plain(Action::Stop(StopMode::Ramp.into()), shown());
        }
        let (object, unclear) = match object(text) {
            Ok(object) => (object, None),
            Err(unclear) => (Object::begun(text), Some(unclear)),
        };
        let names_stop = |action: &Value| action.as_str().is_some_and(is_stop);
        let mut actions = object.members().filter(|(key, _)| is_action(key)).peekable();
        if actions.peek().is_some() && actions.all(|(_, action)| names_stop(action)) {
            let stop = Self::stop(&object);
            return Self { body: if unclear.is_some() { shown() } else { stop.body }, ..stop };
        }
        if let Some(unclear) = unclear {
            return Self::unclear(unambiguous(&object).err().unwrap_or(unclear), shown());
        }
        let id = object.one("id").and_then(Value::as_str).filter(|id| is_id(id)).map(str::to_owned);
        let action = object.one("action").and_then(|action| serde_json::from_value(action.clone()).ok());
        Self { body: object.shown(), action, id, asked: asked(&object) }
    }

    /// What came where everything is a stop: a mode that is said once is taken, and else it is the ramp.
    pub fn stopping(text: &[u8]) -> Self {
        let begun = || Some(Object::begun(text)).filter(|begun| begun.members().next().is_some());
        if let Some(object) = object(text).ok().or_else(begun) {
            return Self::stop(&object);
        }
        let text = String::from_utf8_lossy(text);
        let mode = mode(&Value::from(text.trim())).unwrap_or(StopMode::Ramp);
        Self::plain(Action::Stop(mode.into()), Value::from(text))
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
            assert_eq!(Said::of(text.as_bytes()).stops(), Some(expected.into()), "{text}");
        }
        for text in ["", "{", "null", "whatever", r#"{"action": "start"}"#, "\u{0}"] {
            assert_eq!(Said::stopping(text.as_bytes()).stops(), Some(StopMode::Ramp.into()), "{text}");
        }
        assert_eq!(Said::stopping(b"freewheel").stops(), Some(StopMode::Freewheel.into()));
        assert_eq!(Said::stopping(br#"{"mode": "freewheel""#).stops(), Some(StopMode::Freewheel.into()));
    }

    /// As a controller writes it whose buffer was too short, whose texts end with a nought, or who knows capitals only.
    #[test]
    fn a_stop_is_one_in_any_letters_and_also_where_it_is_cut_off_or_goes_on_behind_its_end() {
        for (text, expected) in [
            (&b"STOP"[..], StopMode::Ramp),
            (b" Stop\r\n\0", StopMode::Ramp),
            (br#""stop""#, StopMode::Ramp),
            (br#"{"action": "STOP"}"#, StopMode::Ramp),
            (br#"{"ACTION": "STOP"}"#, StopMode::Ramp),
            (br#"{"action": "stop", "action": "Stop"}"#, StopMode::Ramp),
            (br#"{"action": "stop""#, StopMode::Ramp),
            (br#"{"action": "stop", "mode": "nonsense", "foo": 1"#, StopMode::Ramp),
            (br#"{"action": "stop", "mode": "fast", "setpoint": {"frequ"#, StopMode::Fast),
            (br#"{"mode": "fast", "action": "stop" "id": "a"}"#, StopMode::Fast),
            (br#"{"action": "stop", "mode": "free"#, StopMode::Ramp),
            (br#"{"action": "stop"}x"#, StopMode::Ramp),
            (b"{\"id\": \"\xFF\", \"action\": \"stop\"}", StopMode::Ramp),
        ] {
            assert_eq!(Said::of(text).stops(), Some(expected.into()), "{}", text.escape_ascii());
        }
    }

    #[test]
    fn what_names_a_stop_beside_another_action_is_neither_and_what_is_cut_off_starts_nothing() {
        for (text, is_ambiguous) in [
            (r#"{"action": "stop", "action": "start"}"#, true),
            (r#"{"action": "stop", "action": "start""#, true),
            (r#"{"action": "start", "ACTION": "stop"}"#, true),
            (r#"{"action": "start", "stop": true"#, true),
            (r#"{"action": "stop", "action": null"#, true),
            (r#"{"action": "start""#, false),
            (r#"{"action": "start"}x"#, false),
            (r#"{"action": "start", "id": "stop"#, false),
            (r#"{"action": "sto"#, false),
            ("stopped", false),
            (r#"["stop"]"#, false),
        ] {
            let asked = Said::of(text.as_bytes()).asked;
            match (asked, is_ambiguous) {
                (Err(Unclear::Ambiguous(_)), true)
                | (Err(Unclear::NoJson(_) | Unclear::Malformed(_)), false) => {}
                (asked, _) => panic!("{text}: {asked:?}"),
            }
        }
        // One that is no text would be a start by what stands in place of what nobody can read.
        assert!(Said::of(b"{\"action\": \"start\", \"id\": \"\xFF\"}").asked.is_err());
    }

    #[test]
    fn what_is_left_of_a_start_is_none_and_a_stop_is_one_from_its_action_on() {
        let start = br#"{"action": "start", "setpoint": {"frequency_hz": 20}}"#;
        assert!(Said::of(start).asked.is_ok());
        for cut in 0..start.len() {
            assert!(Said::of(&start[..cut]).asked.is_err(), "{cut}");
        }
        for behind in ["}", "x", "\0", ",", "{}", r#"{"action": "start"}"#, r#"{"action": "stop"}"#] {
            let text = [start, behind.as_bytes()].concat();
            assert!(Said::of(&text).asked.is_err(), "{behind}");
        }
        let stop = br#"{"action": "stop", "setpoint": {"frequency_hz": 20}}"#;
        for cut in 0..stop.len() {
            assert_eq!(
                Said::of(&stop[..cut]).stops().is_some(),
                cut >= r#"{"action": "stop""#.len(),
                "{cut}"
            );
        }
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
            assert_eq!(Said::stopping(text.as_bytes()).stops(), Some(expected), "{text}");
        }
        let text = r#"{"action": "stop", "mode": "dc_injection", "injection_ms": 250}"#;
        assert_eq!(Said::of(text.as_bytes()).stops(), Some(StopOrder::injecting(Duration::from_millis(250))));
    }

    #[test]
    fn nobody_knows_the_id_of_what_has_two() {
        let said = Said::of(br#"{"action": "stop", "id": "a", "id": "b"}"#);
        assert_eq!((said.stops(), said.id), (Some(StopMode::Ramp.into()), None));
    }
}
