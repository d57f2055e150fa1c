//! How it is told: at once, together with others of the same fate, or as soon as more is known.

use std::{sync::Arc, time::Duration};

use tokio::time::Instant;
use tracing::Level;

use super::{Fate, Held, TOGETHER, Teller, Together, VERBS, What, When};
use crate::journal::{
    Entry,
    words::{Hertz, Span, listed},
};

impl Teller {
    /// Tells a return: by itself, unless others have come back a moment before or are expected to, with their line.
    pub(super) fn back(
        &mut self,
        now: Instant,
        drive: &Arc<str>,
        level: Level,
        after: Duration,
        said: String,
    ) {
        // Its loss is told before its return.
        self.tell_waiting(drive, Fate::Lost);
        let with_line = std::mem::take(&mut self.state(drive).with_line);
        if with_line || self.together.contains_key(&(self.line_of(drive), Fate::Back)) {
            self.share(now, drive, Fate::Back, level, after, said);
        } else {
            self.say(now, drive, level, "back", format!("back after {}, {said}", Span(after)));
            self.expect(now, drive, Fate::Back);
        }
    }

    /// Tells what was held back, with the drive's own explanation where it has given one.
    pub(super) fn release(
        &mut self,
        now: Instant,
        Held { drive, what, .. }: Held,
        explanation: Option<String>,
    ) {
        match what {
            What::Trip { when, is_new, code } => {
                let explanation = explanation.or_else(|| code.map(|code| format!("code {code}")));
                let why = explanation.map(|why| format!(": {why}")).unwrap_or_default();
                let (level, still) = if is_new { (Level::ERROR, "") } else { (Level::WARN, "still ") };
                let about = format!("tripped{why}");
                match when {
                    When::First => self.say(now, &drive, level, &about, format!("connected, tripped{why}")),
                    When::Back(after) => self.back(now, &drive, level, after, format!("{still}tripped{why}")),
                    When::Heard(None) => self.say(now, &drive, level, &about, format!("tripped{why}")),
                    When::Heard(Some(turned)) => {
                        self.say(now, &drive, level, &about, format!("tripped at {}{why}", Hertz(turned)));
                    }
                }
            }
            What::FaultCleared => {
                self.say(now, &drive, Level::INFO, "cleared", "shows no fault any more".to_owned());
            }
            What::StopUnconfirmed { since, attempts, outcome } => {
                let sent = match attempts {
                    0 => ", it was not sent".to_owned(),
                    attempts => format!(" after {attempts} attempts"),
                };
                let text =
                    format!("STOP NOT CONFIRMED for {}{sent}, the motor may turn: {outcome}", Span(since));
                self.say(now, &drive, Level::ERROR, "stop", text);
            }
        }
    }

    /// Others may share this fate within a few seconds: they are told together.
    pub(super) fn expect(&mut self, now: Instant, drive: &Arc<str>, fate: Fate) {
        let all = Together {
            until: now + TOGETHER,
            level: Level::INFO,
            longest: Duration::ZERO,
            drives: Vec::new(),
        };
        self.together.entry((self.line_of(drive), fate)).or_insert(all);
    }

    pub(super) fn share(
        &mut self,
        now: Instant,
        drive: &Arc<str>,
        fate: Fate,
        level: Level,
        time: Duration,
        said: String,
    ) {
        self.expect(now, drive, fate);
        let Some(all) = self.together.get_mut(&(self.line_of(drive), fate)) else { return };
        // The most severe level is the smallest.
        all.level = all.level.min(level);
        all.longest = all.longest.max(time);
        all.drives.push((Arc::clone(drive), said));
    }

    /// What is to be told of this drive together with others is told now: something of it that came behind is told next.
    pub(super) fn tell_waiting(&mut self, drive: &Arc<str>, fate: Fate) {
        let key = (self.line_of(drive), fate);
        if self.together.get(&key).is_some_and(|all| all.drives.iter().any(|(name, _)| name == drive)) {
            self.tell_together(key);
        }
    }

    pub(super) fn tell_together(&mut self, key: (usize, Fate)) {
        let Some(Together { level, longest, mut drives, .. }) = self.together.remove(&key) else { return };
        let (index, fate) = key;
        let Some(line) = self.lines.get(index).filter(|_| !drives.is_empty()) else { return };
        let place = |name: &Arc<str>| line.drives.iter().position(|(other, _)| other == name);
        drives.sort_by_key(|(name, _)| place(name));
        let (all, longest) = (listed(&drives, line.drives.len()), Span(longest));
        let line = line.name.as_str();
        let text = match fate {
            Fate::Connected => format!("{line}: connected: {all}"),
            Fate::Identified => format!("{line}: identified: {all}"),
            Fate::Silent => format!("{line}: never heard, for {longest}: {all}"),
            Fate::Lost => format!("{line}: also lost, no answer for up to {longest}: {all}"),
            Fate::Back => format!("{line}: back after up to {longest}: {all}"),
            Fate::AtExit => format!("{line}: at the exit: {all}"),
        };
        self.entries.push_back(Entry { level, text });
    }

    pub(super) fn hold(&mut self, until: Instant, drive: &Arc<str>, what: What) {
        self.held.push(Held { until, drive: Arc::clone(drive), what });
    }

    /// Says something of a drive, unless the same has been said often enough.
    pub(super) fn say(&mut self, now: Instant, drive: &Arc<str>, level: Level, about: &str, text: String) {
        let line = self.lines.get(self.line_of(drive)).map_or("", |line| line.name.as_str());
        let first = text.split([' ', ':']).next().unwrap_or_default();
        let separator = if VERBS.contains(&first) { " " } else { ": " };
        let text = format!("{line}: {drive}{separator}{text}");
        self.note(now, format!("{drive} {about}"), level, text);
    }

    pub(super) fn note(&mut self, now: Instant, key: String, level: Level, text: String) {
        if self.repeats.admit(now, key, level, &text) {
            self.entries.push_back(Entry { level, text });
        }
    }
}

#[cfg(test)]
mod tests {
    use drive_core::{Command, StopMode};
    use drive_fleet::{Cause, Outcome};

    use super::*;

    /// "connected: running" behind "stop: confirmed" is no order for who was called in the night.
    #[test]
    fn how_a_drive_was_found_is_told_before_what_became_of_a_command_to_it() {
        let (now, name) = (Instant::now(), Arc::<str>::from("pump 1"));
        let mut teller = Teller::new(now);
        teller.handle_members(now, "north", vec![(Arc::clone(&name), 1)]);
        for (fate, found) in [(Fate::Connected, "connected"), (Fate::Back, "back after up to 0.0 s")] {
            teller.share(now, &name, fate, Level::INFO, Duration::ZERO, "running at 30 Hz".to_owned());
            let stop = Command::Stop(StopMode::Ramp);
            teller.commanded(now, &name, &stop, "local", &Cause::Found, &Outcome::Confirmed);
            let told: Vec<String> =
                std::iter::from_fn(|| teller.poll_entry()).map(|entry| entry.text).collect();
            assert_eq!(told.len(), 2, "{told:?}");
            assert!(told[0].contains(found) && told[0].contains("running at 30 Hz"), "{told:?}");
            assert!(told[1].contains("confirmed"), "{told:?}");
        }
    }

    /// Behind a standstill of the program all are lost and back within a moment.
    #[test]
    fn a_loss_that_is_told_with_others_is_told_before_its_return() {
        let (now, names) = (Instant::now(), ["pump 1", "pump 2"].map(Arc::<str>::from));
        let mut teller = Teller::new(now);
        teller.handle_members(now, "north", names.iter().cloned().zip(1..).collect());
        teller.expect(now, &names[1], Fate::Lost);
        let after = Duration::from_secs(12);
        teller.share(now, &names[0], Fate::Lost, Level::ERROR, after, "at 20 Hz".to_owned());
        teller.back(now, &names[0], Level::INFO, after, "running at 20 Hz".to_owned());
        teller.handle_time(now + TOGETHER);
        let told: Vec<String> = std::iter::from_fn(|| teller.poll_entry()).map(|entry| entry.text).collect();
        assert_eq!(
            told,
            [
                "north: also lost, no answer for up to 12 s: pump 1 at 20 Hz",
                "north: pump 1 back after 12 s, running at 20 Hz"
            ]
        );
    }
}
