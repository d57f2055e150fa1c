//! What was refused before the plant heard of it, told as something that happened, at whichever broker: nobody finds it else who asks
//! afterwards.

use std::{
    collections::VecDeque,
    sync::{Mutex, PoisonError},
    time::Duration,
};

use drived_plant::plant::views::NoticeView;
use serde_json::json;
use tokio::time::Instant;

use super::Refused;

/// The same is told once in this time: who sends it again and again fills no history with it,
const ONCE_IN: Duration = Duration::from_secs(60);
/// and so much in it at the most.
const TOLD: usize = 20;

/// What was told of it lately.
#[derive(Debug, Default)]
pub(super) struct Lately(Mutex<VecDeque<(Instant, String)>>);

impl Lately {
    /// What is to be told of a command of a drive that does nothing; `None`: it was told a moment ago.
    pub(super) fn of(&self, drive: &str, refused: &Refused, now: Instant) -> Option<NoticeView> {
        let Refused { action, outcome, reason, text, caller, origin, .. } = refused;
        let action = action.and_then(|action| json!(action).as_str().map(str::to_owned));
        let what = action.unwrap_or_else(|| "a command".to_owned());
        let told = format!("{drive}: {what} by {caller} from {origin}: {outcome}: {text}");
        let key = format!("{drive} {what} {caller} {reason}");
        let mut lately = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        while lately.front().is_some_and(|(at, _)| now.saturating_duration_since(*at) >= ONCE_IN) {
            lately.pop_front();
        }
        if lately.len() >= TOLD || lately.iter().any(|(_, before)| *before == key) {
            return None;
        }
        lately.push_back((now, key));
        Some(NoticeView::new("command_refused", false, told))
    }
}

#[cfg(test)]
mod tests {
    use drived_plant::plant::commands::{ActionWord, OutcomeWord};

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn what_is_refused_again_and_again_is_told_once_a_minute_and_a_flood_of_names_fills_nothing() {
        let refused = |caller: &str| Refused {
            id: None,
            action: Some(ActionWord::Start),
            outcome: OutcomeWord::Refused,
            reason: "no_right",
            text: "it has no right".to_owned(),
            caller: caller.to_owned(),
            origin: "mqtt".to_owned(),
            time_unix_ms: 0,
        };
        let (lately, began) = (Lately::default(), Instant::now());
        let told = |caller: &str, second: u64| {
            let now = began + Duration::from_secs(second);
            lately.of("pump 1", &refused(caller), now).map(|told| told.text)
        };
        let text = "pump 1: start by eye from mqtt: refused: it has no right";
        assert_eq!(told("eye", 0).as_deref(), Some(text));
        assert_eq!([told("eye", 1), told("eye", 59)], [None, None]);
        assert_eq!(told("eye", 60).as_deref(), Some(text));
        let flood = (0..1_000).filter_map(|number| told(&format!("stranger {number}"), 61)).count();
        assert!(flood < 20, "{flood}");
    }
}
