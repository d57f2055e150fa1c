//! What waits for one receiver: pure. Of each alarm one message at most, as the alarm is now.

use std::{
    collections::{BTreeMap, VecDeque},
    time::Duration,
};

use drive_fleet::{
    Severity,
    alarms::{AlarmState, AlarmView},
};
use tokio::time::Instant;

/// How many messages wait. There are not so many alarms unless something is very wrong.
const ROOM: usize = 1_000;

/// What a receiver is told of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Wanted {
    /// This severe or more.
    pub(crate) severity: Severity,
    /// Only what comes, and comes again.
    pub(crate) only_coming: bool,
    /// So long an alarm that is about no motor waits at its coming: until its cause is known, or it follows from another.
    pub(crate) settle: Duration,
}

/// An alarm that is to be told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Message {
    pub(crate) id: String,
    pub(crate) view: AlarmView,
    /// How often it has changed since the message before it that was not told, because the receiver did not take it in time.
    pub(crate) skipped: u32,
    ready_at: Instant,
}

#[cfg(test)]
impl Message {
    pub(crate) fn new(id: &str, view: AlarmView, skipped: u32) -> Self {
        Self { id: id.to_owned(), view, skipped, ready_at: Instant::now() }
    }
}

/// What is to be done now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Next {
    /// This is posted, and with it that so many were lost.
    Post(Box<Message>, u64),
    /// Nothing before then.
    At(Instant),
    Nothing,
}

/// What a receiver has been told last of each alarm of which it has not been told the end, over the end of the program.
pub(crate) type Told = BTreeMap<u64, AlarmView>;

/// The messages for one receiver.
#[derive(Debug)]
pub(crate) struct Outbox {
    host: String,
    wanted: Wanted,
    waiting: VecDeque<Message>,
    /// It is on its way.
    posted: Option<Message>,
    /// What is on its way need not be tried again: nobody is to be told of it any more.
    is_recalled: bool,
    told: Told,
    /// Messages that there was no room for since the last that was taken.
    lost: u64,
}

impl Outbox {
    pub(crate) const fn new(host: String, wanted: Wanted, told: Told) -> Self {
        Self { host, wanted, waiting: VecDeque::new(), posted: None, is_recalled: false, told, lost: 0 }
    }

    /// All alarms that are not over, as they are: what it has been told already is not told again, and what it was told of, or what still
    /// waits for it, and is not there any more is over.
    pub(crate) fn offer_all(&mut self, all: Vec<AlarmView>, revision: u64, now: Instant) -> u64 {
        let under_way = self.posted.iter().chain(&self.waiting).map(|message| &message.view);
        // The newest of each.
        let known: BTreeMap<u64, &AlarmView> =
            self.told.values().chain(under_way).map(|view| (view.alarm.id, view)).collect();
        let is_there = |id: u64| all.iter().any(|view| view.alarm.id == id);
        let over = known.into_iter().filter(|(id, _)| !is_there(*id));
        let mut over: Vec<AlarmView> = over.map(|(_, view)| view.clone()).collect();
        over.iter_mut().for_each(|view| view.state = AlarmState::Over);
        over.into_iter().chain(all).map(|view| self.offer(view, revision, now)).sum()
    }

    /// An alarm as it is now, by a number that no other change has. Gives how many messages were lost because there was no room.
    pub(crate) fn offer(&mut self, view: AlarmView, revision: u64, now: Instant) -> u64 {
        let id = view.alarm.id;
        let at = self.waiting.iter().position(|message| message.view.alarm.id == id);
        let is_posted = self.posted.as_ref().is_some_and(|message| message.view.alarm.id == id);
        // Its cause is told for it.
        if view.state == AlarmState::Suppressed {
            _ = at.and_then(|at| self.waiting.remove(at));
            self.is_recalled |= is_posted;
            return 0;
        }
        let is_unheard_of = at.is_none() && !is_posted && !self.told.contains_key(&id);
        if view.state == AlarmState::Over && is_unheard_of || view.severity > self.wanted.severity {
            return 0;
        }
        if self.wanted.only_coming && view.state != AlarmState::Unacknowledged {
            // Nobody is called for what somebody has taken note of meanwhile.
            if !view.state.waits() {
                _ = at.and_then(|at| self.waiting.remove(at));
                self.is_recalled |= is_posted;
            }
            if view.state == AlarmState::Over {
                self.told.remove(&id);
                _ = self.posted.as_mut().filter(|_| is_posted).map(|message| message.view.state = view.state);
            }
            return 0;
        }
        self.is_recalled &= !is_posted;
        let stage = stage_of(&view);
        let message_id = self.id_of(id, revision);
        if let Some(before) = at.and_then(|at| self.waiting.get_mut(at)) {
            let is_step = stage_of(&before.view) != stage;
            before.view = view;
            if is_step {
                before.id = message_id;
                before.skipped += 1;
            }
            return 0;
        }
        let last = self.posted.as_ref().filter(|_| is_posted).map(|message| &message.view);
        if last.or(self.told.get(&id)).is_some_and(|view| stage_of(view) == stage) {
            return 0;
        }
        let settles = last.is_none() && !self.told.contains_key(&id) && !view.of_motion;
        let ready_at = if settles { now + self.wanted.settle } else { now };
        self.waiting.push_back(Message { id: message_id, view, skipped: 0, ready_at });
        self.make_room()
    }

    /// The next to be posted, which is on its way from then on: what is about a motor that may move goes first.
    pub(crate) fn next(&mut self, now: Instant) -> Next {
        let ready = |message: &Message| message.ready_at <= now;
        let urgent = self.waiting.iter().position(|message| message.view.of_motion);
        match urgent.or_else(|| self.waiting.iter().position(ready)).and_then(|at| self.waiting.remove(at)) {
            Some(message) => {
                self.posted = Some(message.clone());
                self.is_recalled = false;
                Next::Post(Box::new(message), self.lost)
            }
            None => self.waiting.iter().map(|message| message.ready_at).min().map_or(Next::Nothing, Next::At),
        }
    }

    /// The one on its way was taken, and with it that so many were lost.
    pub(crate) fn taken(&mut self, lost: u64) {
        let Some(Message { view, .. }) = self.posted.take() else { return };
        self.lost = self.lost.saturating_sub(lost);
        self.remember(view);
    }

    /// The one on its way will never be taken: nobody tries it again.
    pub(crate) fn refused(&mut self) {
        let Some(Message { view, .. }) = self.posted.take() else { return };
        self.lost += 1;
        self.remember(view);
    }

    fn remember(&mut self, view: AlarmView) {
        match view.state {
            AlarmState::Over => _ = self.told.remove(&view.alarm.id),
            _ => _ = self.told.insert(view.alarm.id, view),
        }
    }

    /// The one on its way was not taken: it waits again, unless its alarm has changed meanwhile.
    pub(crate) fn not_taken(&mut self) {
        let Some(message) = self.posted.take() else { return };
        let id = message.view.alarm.id;
        match self.waiting.iter_mut().find(|newer| newer.view.alarm.id == id) {
            Some(newer) => newer.skipped += message.skipped + 1,
            None if self.is_recalled => {}
            None => self.waiting.push_front(message),
        }
    }

    pub(crate) fn waiting(&self) -> usize {
        self.waiting.len() + usize::from(self.posted.is_some())
    }

    pub(crate) const fn told(&self) -> &Told {
        &self.told
    }

    fn id_of(&self, alarm: u64, revision: u64) -> String {
        format!("{}-{alarm}-{revision}", self.host)
    }

    /// Drops the oldest message that is about no motor.
    fn make_room(&mut self) -> u64 {
        if self.waiting.len() <= ROOM {
            return 0;
        }
        let oldest = self.waiting.iter().position(|message| !message.view.of_motion).unwrap_or_default();
        self.waiting.remove(oldest);
        self.lost += 1;
        1
    }
}

/// What of an alarm is told as a change; its words may become others without one.
fn stage_of(view: &AlarmView) -> String {
    let AlarmView { alarm, state, .. } = view;
    match (state, &alarm.shelved, &alarm.acknowledged) {
        // What comes again while it is put aside waits for the end of that.
        (AlarmState::Shelved, Some(shelved), _) => format!("{state} {}", shelved.until_unix_ms),
        (_, _, Some(seen)) => format!("{state} {} {}", alarm.count, seen.unix_ms),
        _ => format!("{state} {}", alarm.count),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::view;

    const ALL: Wanted = Wanted { severity: Severity::Warning, only_coming: false, settle: Duration::ZERO };

    fn outbox(wanted: Wanted) -> Outbox {
        Outbox::new("north".to_owned(), wanted, Told::new())
    }

    /// What is told until nothing waits, each taken at once.
    fn told(outbox: &mut Outbox) -> Vec<(u64, String, u32)> {
        let mut told = Vec::new();
        while let Next::Post(message, lost) = outbox.next(Instant::now()) {
            told.push((message.view.alarm.id, message.view.state.to_string(), message.skipped));
            outbox.taken(lost);
        }
        told
    }

    fn next(outbox: &mut Outbox) -> (Message, u64) {
        match outbox.next(Instant::now()) {
            Next::Post(message, lost) => (*message, lost),
            other => panic!("{other:?}"),
        }
    }

    fn known(told: &[(u64, &str, u32)]) -> Vec<(u64, String, u32)> {
        told.iter().map(|(id, state, skipped)| (*id, (*state).to_owned(), *skipped)).collect()
    }

    #[test]
    fn each_step_of_a_life_is_told_once_and_words_alone_are_no_step() {
        let mut outbox = outbox(ALL);
        for state in ["unacknowledged", "acknowledged", "returned", "over"] {
            outbox.offer(view(1, state), 1, Instant::now());
            let mut same = view(1, state);
            same.text.push_str(", and more is known");
            outbox.offer(same, 2, Instant::now());
            assert_eq!(told(&mut outbox), known(&[(1, state, 0)]));
        }
        assert_eq!(*outbox.told(), Told::new(), "what is over is forgotten");
    }

    #[test]
    fn what_waits_is_told_as_it_is_now_and_what_was_skipped_is_counted() {
        let mut outbox = outbox(ALL);
        outbox.offer(view(1, "unacknowledged"), 1, Instant::now());
        outbox.offer(view(2, "unacknowledged"), 2, Instant::now());
        let (first, _) = next(&mut outbox);
        assert_eq!(first.id, "north-1-1");
        outbox.offer(view(1, "returned"), 3, Instant::now());
        outbox.not_taken();
        outbox.offer(view(1, "over"), 4, Instant::now());
        assert_eq!(told(&mut outbox), known(&[(2, "unacknowledged", 0), (1, "over", 2)]));
        // One that is not taken and has not changed is the same message, at the head.
        outbox.offer(view(3, "unacknowledged"), 5, Instant::now());
        outbox.offer(view(4, "unacknowledged"), 6, Instant::now());
        let (before, _) = next(&mut outbox);
        outbox.not_taken();
        assert_eq!(next(&mut outbox).0, before);
    }

    #[test]
    fn what_follows_from_another_is_told_by_its_cause_alone() {
        let mut outbox = outbox(ALL);
        outbox.offer(view(1, "unacknowledged"), 1, Instant::now());
        outbox.offer(view(1, "suppressed"), 2, Instant::now());
        outbox.offer(view(2, "unacknowledged"), 3, Instant::now());
        assert_eq!(told(&mut outbox), known(&[(2, "unacknowledged", 0)]));
        outbox.offer(view(1, "over"), 4, Instant::now());
        assert_eq!(told(&mut outbox), [], "nobody had heard of it");
        // One that was told before it was suppressed is told when it is over.
        outbox.offer(view(3, "unacknowledged"), 5, Instant::now());
        assert_eq!(told(&mut outbox).len(), 1);
        outbox.offer(view(3, "suppressed"), 6, Instant::now());
        outbox.offer(view(3, "over"), 7, Instant::now());
        assert_eq!(told(&mut outbox), known(&[(3, "over", 0)]));
    }

    #[test]
    fn who_wants_only_what_comes_or_only_the_worst_is_told_that() {
        let mut coming = outbox(Wanted { only_coming: true, ..ALL });
        let mut again = view(1, "unacknowledged");
        again.alarm.count = 2;
        for view in [
            view(1, "unacknowledged"),
            view(1, "returned"),
            again,
            view(2, "unacknowledged"),
            view(2, "acknowledged"),
        ] {
            coming.offer(view, 1, Instant::now());
        }
        assert_eq!(told(&mut coming), known(&[(1, "unacknowledged", 1)]), "somebody has seen the second");
        coming.offer(view(1, "over"), 2, Instant::now());
        assert_eq!(*coming.told(), Told::new());
        let mut worst = outbox(Wanted { severity: Severity::Alarm, ..ALL });
        let mut warning = view(1, "unacknowledged");
        warning.severity = Severity::Warning;
        worst.offer(warning, 1, Instant::now());
        worst.offer(view(2, "unacknowledged"), 2, Instant::now());
        assert_eq!(told(&mut worst), known(&[(2, "unacknowledged", 0)]));
    }

    #[test]
    fn what_ended_while_the_receiver_was_away_is_told_as_over_and_never_as_standing() {
        // So many changes came meanwhile that they were not told one by one: what there is is offered whole.
        for is_on_its_way in [false, true] {
            let mut outbox = outbox(ALL);
            outbox.offer(view(1, "unacknowledged"), 1, Instant::now());
            outbox.offer(view(2, "unacknowledged"), 2, Instant::now());
            if is_on_its_way {
                next(&mut outbox);
            }
            outbox.offer_all(vec![view(2, "unacknowledged")], 9, Instant::now());
            outbox.not_taken();
            let mut told = told(&mut outbox);
            told.sort();
            assert_eq!(told, known(&[(1, "over", 1), (2, "unacknowledged", 0)]), "{is_on_its_way}");
            assert!(!outbox.told().contains_key(&1));
        }
    }

    #[test]
    fn who_is_only_called_is_not_called_again_for_what_somebody_has_seen_while_the_call_failed() {
        let mut outbox = outbox(Wanted { only_coming: true, ..ALL });
        for seen in ["acknowledged", "over", "suppressed"] {
            outbox.offer(view(1, "unacknowledged"), 1, Instant::now());
            next(&mut outbox);
            outbox.offer(view(1, seen), 2, Instant::now());
            outbox.not_taken();
            assert_eq!(told(&mut outbox), [], "{seen}");
            assert_eq!(*outbox.told(), Told::new());
        }
        // One whose cause went away before it is its own again, and so is the one that nobody has seen.
        outbox.offer(view(1, "unacknowledged"), 1, Instant::now());
        next(&mut outbox);
        outbox.offer(view(1, "suppressed"), 2, Instant::now());
        outbox.offer(view(1, "unacknowledged"), 3, Instant::now());
        outbox.not_taken();
        assert_eq!(told(&mut outbox), known(&[(1, "unacknowledged", 0)]));
        // What the call was taken for is over: nothing is kept of it.
        let mut outbox = self::outbox(Wanted { only_coming: true, ..ALL });
        outbox.offer(view(2, "unacknowledged"), 4, Instant::now());
        next(&mut outbox);
        outbox.offer(view(2, "over"), 5, Instant::now());
        outbox.taken(0);
        assert_eq!(*outbox.told(), Told::new());
    }

    #[test]
    fn a_full_queue_drops_the_oldest_that_is_about_no_motor_and_the_next_message_says_how_many() {
        let mut outbox = outbox(ALL);
        let mut of_motion = view(0, "unacknowledged");
        of_motion.of_motion = true;
        outbox.offer(of_motion, 0, Instant::now());
        let room = ROOM as u64;
        let lost: u64 =
            (1..room + 3).map(|id| outbox.offer(view(id, "unacknowledged"), id, Instant::now())).sum();
        assert_eq!((lost, outbox.waiting()), (3, ROOM));
        let (first, lost) = next(&mut outbox);
        assert_eq!((first.view.alarm.id, lost), (0, 3), "a motor that may move goes first");
        outbox.taken(lost);
        let mut newest = view(7_000, "unacknowledged");
        newest.of_motion = true;
        outbox.offer(newest, 7_000, Instant::now());
        assert_eq!(next(&mut outbox).0.view.alarm.id, 7_000, "also the newest");
        outbox.taken(0);
        let (second, lost) = next(&mut outbox);
        assert_eq!((second.view.alarm.id, lost), (4, 0));
        outbox.refused();
        assert_eq!(next(&mut outbox).1, 1, "what is never taken is lost too");
    }

    #[test]
    fn what_was_told_is_not_told_again_by_the_next_program_and_what_has_ended_meanwhile_is() {
        let mut outbox = outbox(ALL);
        outbox.offer_all(
            vec![view(1, "unacknowledged"), view(2, "unacknowledged"), view(3, "unacknowledged")],
            1,
            Instant::now(),
        );
        told(&mut outbox);
        outbox.offer(view(2, "over"), 2, Instant::now());
        let kept = serde_json::to_string(outbox.told()).unwrap();
        let mut next = Outbox::new("north".to_owned(), ALL, serde_json::from_str(&kept).unwrap());
        next.offer_all(
            vec![view(1, "unacknowledged"), view(3, "returned"), view(4, "unacknowledged")],
            9,
            Instant::now(),
        );
        assert_eq!(told(&mut next), known(&[(2, "over", 0), (3, "returned", 0), (4, "unacknowledged", 0)]));
        next.offer_all(Vec::new(), 10, Instant::now());
        assert_eq!(told(&mut next), known(&[(1, "over", 0), (3, "over", 0), (4, "over", 0)]));
        assert_eq!(*next.told(), Told::new());
    }

    #[test]
    fn an_alarm_waits_at_its_coming_until_its_cause_is_known_and_one_about_a_motor_does_not() {
        let settle = Duration::from_secs(2);
        let (mut outbox, start) = (outbox(Wanted { settle, ..ALL }), Instant::now());
        outbox.offer(view(1, "unacknowledged"), 1, start);
        assert_eq!(outbox.next(start), Next::At(start + settle));
        let mut explained = view(1, "unacknowledged");
        explained.text.push_str(", a short circuit");
        outbox.offer(explained.clone(), 2, start);
        let mut of_motion = view(2, "unacknowledged");
        of_motion.of_motion = true;
        outbox.offer(of_motion, 3, start);
        assert!(matches!(outbox.next(start), Next::Post(message, 0) if message.view.alarm.id == 2));
        outbox.taken(0);
        let Next::Post(message, 0) = outbox.next(start + settle) else { panic!("it is told") };
        assert_eq!((message.view, message.skipped), (explained, 0));
        outbox.taken(0);
        // What becomes of it later waits for nothing.
        outbox.offer(view(1, "acknowledged"), 4, start);
        assert!(matches!(outbox.next(start), Next::Post(..)));
    }
}
