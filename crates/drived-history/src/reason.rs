//! Why the program itself did something to a drive, as a fact: [`Reasons`]. It has no clock of its own.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::record::Record;

/// What a policy acts upon, by the names of the events that tell it.
const UPON: [&str; 7] = [
    "output_blocked",
    "reference_taken",
    "command_overridden",
    "control_taken",
    "control_elsewhere",
    "tripped",
    "lost",
];

/// An act as far as it is looked at here.
#[derive(Deserialize)]
struct Act {
    cause: By,
}

#[derive(Deserialize)]
#[serde(tag = "by", rename_all = "snake_case")]
enum By {
    Policy {
        policy: String,
    },
    #[serde(other)]
    Else,
}

/// What happened to each drive last upon which a policy acts.
#[derive(Debug, Default)]
pub(crate) struct Reasons(BTreeMap<String, String>);

impl Reasons {
    /// Looks at an event in its order; an act of the program by one of its policies gets the reason that was told before it.
    pub(crate) fn look(&mut self, record: &mut Record) {
        let Some(drive) = record.drive.clone() else { return };
        if UPON.contains(&&*record.what) {
            self.0.insert(drive, record.text.clone());
            return;
        }
        let of_act = record.body.as_ref().filter(|_| record.what == "command");
        let act: Option<Act> = of_act.and_then(|body| serde_json::from_str(body).ok());
        let Some(Act { cause: By::Policy { policy } }) = act else { return };
        // What is done at the end, by other settings or at the watchdog was asked for, and no event began it.
        let is_upon_event = !matches!(
            &*policy,
            "exit" | "removal" | "settings" | "watchdog" | "start_withdrawn" | "stop_of_before"
        );
        if let Some(reason) = self.0.get(&drive).filter(|_| is_upon_event) {
            record.text.push_str(&format!("; it was done by itself, upon this: {reason}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Kind, Moment};

    #[test]
    fn an_act_of_the_program_by_its_policy_is_kept_with_what_it_acted_upon() {
        let now = Moment { steady_ms: 0, wall_ms: 0 };
        let mut reasons = Reasons::default();
        let mut kept = |drive: &str, what: &str, text: &str, cause: serde_json::Value| {
            let mut record = Record {
                kind: Kind::Event,
                drive: Some(drive.to_owned()),
                body: Some(serde_json::json!({ "cause": cause }).to_string()),
                ..Record::of_history(now, what, text)
            };
            reasons.look(&mut record);
            record.text
        };
        let by_drive = serde_json::json!({ "by": "drive" });
        let policy = |policy: &str| serde_json::json!({ "by": "policy", "policy": policy });
        let anna = serde_json::json!({ "by": "command", "commander": "anna" });
        let taken = "reference taken: another reference decides";
        let _ = kept("pump 1", "reference_taken", taken, by_drive);
        let act = "command: withdrawal of the run command by reference taken: confirmed";
        let told = kept("pump 1", "command", act, policy("reference_taken"));
        assert_eq!(told, format!("{act}; it was done by itself, upon this: {taken}"));
        assert_eq!(kept("pump 2", "command", act, policy("reference_taken")), act, "of another drive");
        assert_eq!(kept("pump 1", "command", act, policy("exit")), act);
        assert_eq!(kept("pump 1", "command", act, anna), act);
    }
}
