//! What every family keeps of a drive from status to status: [`Watch`].

use std::{collections::BTreeMap, time::Duration};

use tokio::time::Instant;

use crate::{
    lease::{Ground, Lease},
    motion::{Motion, Output, Shaft},
    own_run::{OwnRun, Told},
    refusal::Refusal,
    setpoint::Direction,
    turns::Turns,
    units::Frequency,
};

/// A motor that turns against the run command and has not come down for so long does not turn round: the slowest ramp, 999.9 s from 50 Hz,
/// takes a tenth of a hertz in two seconds.
const TURNS_ROUND: Duration = Duration::from_secs(3);

/// The run command of this side, the shaft, and what a contract rests on: looked at with every status, and what no ordinary
/// status carries by [`Turns`]. [`watched_by!`](crate::watched_by) tells it as a [`Drive`](crate::Drive) has to.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Watch {
    /// The run command of this side that stands, or may.
    pub run: OwnRun,
    /// The shaft.
    pub shaft: Shaft,
    /// Whose turn it is.
    pub turns: Turns,
    /// Settings that a contract rests on, by register, as they were last read or written.
    settings: BTreeMap<u16, u16>,
    /// What was found otherwise, and not told yet.
    changed: Vec<Ground>,
    armed: bool,
    /// By what the last look showed a run to have ended: a trip, or direct current.
    ended_by: Option<Output>,
    against: Option<Against>,
}

/// A motor that turns against the run command.
#[derive(Debug, Clone, Copy)]
struct Against {
    /// The lowest output at which it was seen to, and when.
    lowest: Frequency,
    at: Instant,
    /// When it was looked at last: a process that stood still since has not seen it go on.
    seen: Instant,
    /// The drive says itself that it is not on its way down.
    stays: bool,
}

impl Watch {
    /// Of a family whose [`Turns`] come behind every so many statuses.
    #[must_use]
    pub fn every(statuses: u16) -> Self {
        Self { turns: Turns::every(statuses), ..Self::default() }
    }

    /// Whether anything rests on this drive: a run command of this side that stands, or a watchdog that it has armed.
    #[must_use]
    pub const fn is_kept(&self) -> bool {
        self.run.lease().is_some() || self.armed
    }

    /// What the shaft does, by what a look at the drive shows: see [`Shaft::see`].
    ///
    /// A motor that was last seen at rest, holds a run command of this side and has tripped by this look, or is being injected into,
    /// may have turned between the two: it is not told at rest. Nor is one that was given a run command and was let coast between them.
    pub fn see(&mut self, at: Instant, shown: Output, frequency: Option<Frequency>) -> Motion {
        let ends_a_run = matches!(shown, Output::Tripped | Output::Injection);
        let ended = self.run.lease().is_some() && ends_a_run && self.ended_by != Some(shown);
        let given = self.run.is_looked_at();
        if ended || given && self.shaft.was_let_go() && shown == Output::Cut {
            self.shaft.may_turn();
        }
        self.ended_by = Some(shown).filter(|_| ends_a_run);
        self.shaft.see(at, shown, frequency)
    }

    /// Whether the status that was [seen](Self::see) last shows a motor that slows down although its reference asks for more than its
    /// `output`, or is the first one and does not tell: by a stop that the drive does not name, or before it speeds up again. A run
    /// command that stands in a drive which runs is not shown to be obeyed then. One that is turned round comes down first.
    #[must_use]
    pub fn is_brought_down(
        &self,
        direction: Option<Direction>,
        output: Frequency,
        reference: Frequency,
    ) -> bool {
        let may_fall = self.shaft.falls() || self.shaft.is_seen_first();
        may_fall && output < reference && !self.is_against(direction)
    }

    /// Whether this is not the direction of the run command of this side.
    fn is_against(&self, direction: Option<Direction>) -> bool {
        self.run.lease().is_some_and(|lease| direction.is_some_and(|seen| seen != lease.direction))
    }

    /// Which way a status shows the motor to turn, at which output; `None`: it stands, or that is not told. And whether the drive says
    /// itself that the motor comes down, or does not, where it says so.
    pub fn see_turning(
        &mut self,
        at: Instant,
        direction: Option<Direction>,
        output: Frequency,
        comes_down: Option<bool>,
    ) {
        let before = self.against.filter(|before| before.lowest <= output && comes_down != Some(true));
        let stays = comes_down == Some(false);
        let now = || {
            before.map_or(Against { lowest: output, at, seen: at, stays }, |before| Against {
                seen: at,
                stays,
                ..before
            })
        };
        self.against = self.is_against(direction).then(now);
    }

    /// What is told of the reference by the way in which the motor was [seen](Self::see_turning) to turn, where its words tell `reference`:
    /// behind a change of direction it comes down along its ramp; whoever does not is turned by another's sign. **No family judges that
    /// itself.**
    #[must_use]
    pub fn told_by_turning(&self, reference: Told) -> Told {
        const AGAINST: Refusal = Refusal::Overridden {
            by: "whoever turns the motor the other way, the sign of a reference, an input or a key,",
            remedy: "see which one it is, and start again",
        };
        match (reference, self.against) {
            (Told::Yes | Told::NotTold, Some(Against { at, seen, stays, .. }))
                if stays || seen.saturating_duration_since(at) > TURNS_ROUND =>
            {
                Told::No(AGAINST)
            }
            (Told::Yes, Some(_)) => Told::NotTold,
            (told, _) => told,
        }
    }

    /// Whether this side has armed the drive's communication watchdog.
    pub const fn set_armed(&mut self, armed: bool) {
        self.armed = armed;
    }

    /// Whether this side has armed the drive's communication watchdog.
    #[must_use]
    pub const fn is_armed(&self) -> bool {
        self.armed
    }

    /// A setting was read or written for its own sake: what is found later is held against it.
    pub fn knows(&mut self, register: u16, word: u16) {
        self.settings.insert(register, word);
    }

    /// A setting whose turn it was. One that is otherwise than it was known to be is a `ground` that has changed: true.
    pub fn finds(&mut self, register: u16, word: u16, ground: Ground) -> bool {
        let changed = self.settings.insert(register, word).is_some_and(|known| known != word);
        if changed {
            self.changes(ground);
        }
        changed
    }

    /// Something that a contract rests on is otherwise than it was. It is told once, and only while anything rests on it.
    pub fn changes(&mut self, ground: Ground) {
        if self.is_kept() && !self.changed.contains(&ground) {
            self.changed.push(ground);
        }
    }

    /// What is told of it: see [`Drive::take_changed`](crate::Drive::take_changed).
    pub fn take_changed(&mut self) -> Option<Ground> {
        (!self.changed.is_empty()).then(|| self.changed.remove(0))
    }

    /// What is known of the settings may be otherwise by this side's own doing.
    pub fn forget_settings(&mut self) {
        self.settings.clear();
    }

    /// The line was lost: what was read proves nothing any more, and the shaft is as one that was never seen. The run command stays.
    pub fn lose_sight(&mut self) {
        self.run.unread();
        self.shaft.lose_sight();
        self.against = None;
        self.forget_settings();
    }

    /// See [`Drive::adopt`](crate::Drive::adopt).
    pub const fn adopt(&mut self, lease: Lease) {
        self.run.adopt(lease);
    }
}

/// The methods of a [`Drive`](crate::Drive) that its [`Watch`] answers, for its implementation.
#[macro_export]
macro_rules! watched_by {
    ($($watch:ident).+) => {
        fn lease(&self) -> Option<$crate::Lease> {
            self.$($watch).+.run.lease()
        }

        fn take_changed(&mut self) -> Option<$crate::Ground> {
            self.$($watch).+.take_changed()
        }

        fn set_coast_time(&mut self, time: Option<std::time::Duration>) {
            self.$($watch).+.shaft.set_coast_time(time);
        }

        fn set_injection_time(&mut self, time: Option<std::time::Duration>) {
            self.$($watch).+.shaft.set_injection_time(time);
        }
    };
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::setpoint::StopMode;

    #[test]
    fn a_ground_is_told_once_when_it_is_found_otherwise_and_only_while_anything_rests_on_it() {
        let mut watch = Watch::default();
        watch.knows(7, 30);
        assert!(watch.finds(7, 31, Ground::Limits));
        assert_eq!(watch.take_changed(), None, "nothing rests on it");
        watch.set_armed(true);
        assert!(!watch.finds(8, 1, Ground::Watchdog), "it was not known before");
        assert!(watch.finds(8, 0, Ground::Watchdog) && watch.finds(7, 30, Ground::Limits));
        assert!(watch.finds(8, 2, Ground::Watchdog));
        let told: Vec<_> = std::iter::from_fn(|| watch.take_changed()).collect();
        assert_eq!(told, [Ground::Watchdog, Ground::Limits]);
    }

    #[test]
    fn a_lost_line_leaves_the_run_command_and_no_setting_that_is_held_against_a_later_one() {
        let mut watch = Watch::every(3);
        watch.run.give(Lease::new(Direction::Forward, 1));
        watch.run.reads(1);
        watch.knows(7, 30);
        watch.lose_sight();
        assert!(watch.is_kept() && watch.run.held().is_none());
        assert!(!watch.finds(7, 31, Ground::Limits));
    }

    /// A run command was given to a motor at rest; at the next look the drive has tripped, with the shaft at whatever speed it had
    /// reached.
    #[tokio::test(start_paused = true)]
    async fn a_motor_that_was_given_a_run_command_and_has_tripped_by_the_next_look_may_coast() {
        let (now, zero) = (Instant::now(), Some(Frequency::ZERO));
        let mut watch = Watch::default();
        assert_eq!(watch.see(now, Output::Stands, zero), Motion::AtRest);
        assert_eq!(
            watch.see(now, Output::Tripped, zero),
            Motion::AtRest,
            "nobody has given it a run command"
        );
        assert_eq!(watch.see(now, Output::None, zero), Motion::AtRest);
        watch.run.give(Lease::new(Direction::Forward, 1));
        assert_eq!(watch.see(now, Output::None, zero), Motion::AtRest);
        assert_eq!(watch.see(now, Output::Tripped, zero), Motion::Coasting);
        // It goes on to be tripped: its owner's coast time runs from the first look.
        watch.shaft.set_coast_time(Some(Duration::from_secs(9)));
        assert_eq!(watch.see(now + Duration::from_secs(9), Output::Tripped, zero), Motion::AtRest);
        assert_eq!(watch.see(now + Duration::from_secs(10), Output::Tripped, zero), Motion::AtRest);
    }

    /// An Altivar 58 carried out its start and answered by an exception, and was let coast before its next status.
    #[tokio::test(start_paused = true)]
    async fn a_motor_that_was_started_and_let_coast_between_two_looks_may_coast() {
        let (now, zero) = (Instant::now(), Some(Frequency::ZERO));
        let mut rests = Watch::default();
        assert_eq!(rests.see(now, Output::Stands, zero), Motion::AtRest);
        let mut refused = rests.clone();
        refused.run.give(Lease::new(Direction::Forward, 1));
        assert_eq!(refused.see(now, Output::Cut, zero), Motion::AtRest, "the drive is locked");
        for mut watch in [rests.clone(), refused] {
            watch.shaft.is_stopped_by(StopMode::Freewheel);
            assert_eq!(watch.see(now, Output::Cut, zero), Motion::AtRest, "nothing was started since");
        }
        rests.run.give(Lease::new(Direction::Forward, 1));
        rests.run.end();
        rests.shaft.is_stopped_by(StopMode::Freewheel);
        assert_eq!(rests.see(now, Output::Cut, zero), Motion::Coasting);
    }

    /// A motor at rest was started, nobody could look for four seconds, and a stop by direct current was given: at the next look it flows.
    #[tokio::test(start_paused = true)]
    async fn a_motor_that_may_have_run_unseen_is_not_held_at_once_by_a_current() {
        let (now, zero) = (Instant::now(), Some(Frequency::ZERO));
        let mut watch = Watch::default();
        assert_eq!(watch.see(now, Output::Stands, zero), Motion::AtRest);
        assert_eq!(
            watch.see(now, Output::Injection, zero),
            Motion::Held,
            "nobody has given it a run command"
        );
        watch.run.give(Lease::new(Direction::Forward, 1));
        assert_eq!(watch.see(now, Output::Stands, zero), Motion::AtRest);
        assert_eq!(watch.see(now, Output::Injection, zero), Motion::Braking);
        watch.run.end();
        assert_eq!(watch.see(now + crate::INJECTION_TIME, Output::Injection, zero), Motion::Held);
        assert_eq!(watch.see(now + crate::INJECTION_TIME, Output::Injection, zero), Motion::Held);
    }

    #[tokio::test(start_paused = true)]
    async fn a_motor_that_turns_the_other_way_and_does_not_come_down_is_turned_by_another() {
        let (begun, hertz) = (Instant::now(), Frequency::from_hertz);
        let mut watch = Watch::default();
        watch.run.give(Lease::new(Direction::Forward, 1));
        let mut told = vec![];
        for (at, direction, output, comes_down) in [
            (0, Some(Direction::Forward), 30, None),
            // It was told to turn round, and comes down; then it does not any more.
            (1, Some(Direction::Reverse), 30, None),
            (5, Some(Direction::Reverse), 20, None),
            (6, Some(Direction::Reverse), 20, None),
            (9, Some(Direction::Reverse), 20, None),
            (10, None, 0, None),
            // A drive that says so is believed at once, and one that says that it slows down is, however slowly that goes.
            (11, Some(Direction::Reverse), 20, Some(false)),
            (12, Some(Direction::Reverse), 20, Some(true)),
            (16, Some(Direction::Reverse), 20, Some(true)),
            (18, Some(Direction::Reverse), 20, None),
            (20, Some(Direction::Reverse), 20, None),
        ] {
            tokio::time::sleep_until(begun + Duration::from_secs(at)).await;
            watch.see_turning(Instant::now(), direction, hertz(output), comes_down);
            told.push(match watch.told_by_turning(Told::Yes) {
                Told::Yes => "yes",
                Told::NotTold => "not told",
                Told::No(_) => "no",
            });
        }
        let first = ["yes", "not told", "not told", "not told", "no", "yes"];
        assert_eq!(told, [&first[..], &["no", "not told", "not told", "not told", "no"]].concat());
    }

    /// A panel's STOP brings a motor down whose drive runs until it stands.
    #[tokio::test(start_paused = true)]
    async fn a_motor_that_slows_down_below_its_reference_is_brought_down_unless_it_is_turned_round() {
        let (begun, hertz) = (Instant::now(), Frequency::from_hertz);
        let mut watch = Watch::default();
        watch.run.give(Lease::new(Direction::Forward, 1));
        watch.see(begun, Output::Driven, Some(hertz(10)));
        for (at, output, forward, reverse) in
            [(1, 20, false, false), (2, 30, false, false), (3, 25, true, false), (4, 25, false, false)]
        {
            watch.see(begun + Duration::from_secs(at), Output::Driven, Some(hertz(output)));
            for (direction, told) in [(Direction::Forward, forward), (Direction::Reverse, reverse)] {
                let is = |reference| watch.is_brought_down(Some(direction), hertz(output), hertz(reference));
                assert_eq!((is(30), is(25)), (told, false), "{output} Hz, {direction}");
            }
        }
    }

    /// An Omron 3G3EV that its panel was stopping, at the first look behind a lost line: its words are those of one that runs up.
    #[tokio::test(start_paused = true)]
    async fn a_motor_below_its_reference_is_not_shown_to_obey_by_the_first_look_behind_a_lost_line() {
        let (begun, hertz) = (Instant::now(), Frequency::from_hertz);
        let mut watch = Watch::default();
        watch.run.give(Lease::new(Direction::Forward, 1));
        let see = |watch: &mut Watch, at, output| {
            watch.see(begun + Duration::from_secs(at), Output::Driven, Some(hertz(output)));
            watch.is_brought_down(Some(Direction::Forward), hertz(output), hertz(30))
        };
        assert!(see(&mut watch, 1, 10) && !see(&mut watch, 2, 20));
        watch.lose_sight();
        assert!(see(&mut watch, 9, 10) && see(&mut watch, 10, 5) && !see(&mut watch, 11, 6));
        watch.lose_sight();
        assert!(!see(&mut watch, 19, 30), "it is where its reference is");
    }

    /// It was being brought down, the line was lost, and at the next look there is no output: by the ramp, or cut.
    #[tokio::test(start_paused = true)]
    async fn a_motor_that_came_down_out_of_sight_is_not_told_at_rest() {
        let (mut watch, now) = (Watch::default(), Instant::now());
        watch.shaft.see(now, Output::Braking(Frequency::from_hertz(30)), None);
        watch.lose_sight();
        assert_eq!(watch.shaft.see(now, Output::None, Some(Frequency::ZERO)), Motion::Coasting);
    }
}
