//! What proves a run command of this side from status to status, and what the shaft does, the same for each family of the
//! chart: the control word that the drive holds, the reference that it follows, and the one further exchange behind a status.

use std::time::Duration;

use tokio::time::Instant;

use super::{
    chart::ChartState,
    limits::{follows_frequency, follows_speed, is_speed},
};
use drive_core::{
    Class, Direction, Effect, Error, ErrorKind, Frequency, Ground, Lease, Motion, Output, Port, Registers,
    Result, RunWord, Speed, Watch,
    registers::{Register, access::Writable},
};

/// How long the limits of a setpoint are taken for those of the drive without being read again: somebody at the keypad may
/// change them.
const LIMITS_HOLD: Duration = Duration::from_secs(10);

/// How long `FrH`, a word that monitors, may take to show the reference that the drive follows already: no manual prints a time.
const SHOWN_WITHIN: Duration = Duration::from_secs(1);

/// How many setpoints are kept of which nobody has seen whether they arrived, until one is confirmed; the oldest goes first.
const MAY_STAND: usize = 8;

/// A low and a high limit.
pub type Limits = (Frequency, Frequency);

/// What of a drive's fast words is another question when it is another.
pub type Question = (u16, u16, u16);

/// Whose reference the motor follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Followed {
    /// The setpoint that this side has given, or found when it gave its run command.
    Ours,
    /// One that another master has written.
    AnotherMasters,
    /// None of the bus.
    Elsewhere,
    /// Nothing tells yet.
    NotTold,
}

/// What is known of a run command of this side, and of the shaft. `L` are the family's further exchanges.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Proof<L> {
    /// The run command of this side, the shaft, turns and grounds.
    pub watch: Watch,
    /// What the shaft did at the last status.
    pub motion: Motion,
    /// The register and the word of the setpoint that is to be in force.
    given: Option<(u16, u16)>,
    /// Those that were written since and may stand instead, or come late: their answer was lost, or nobody waited for it.
    may_stand: Vec<(u16, u16)>,
    /// The first reference of the bus, `LFr`, as it was read or written last.
    pub reference: Option<u16>,
    /// `LFRD` and `FRHD`, once they were looked for behind the present words.
    pub speeds: Option<(u16, u16)>,
    /// The control word that the drive was last seen to hold: read, or written and confirmed.
    held: Option<u16>,
    /// The limits of a setpoint, where the drive has any, and when they were read.
    limits: Option<(Option<Limits>, Instant)>,
    question: Option<Question>,
    looked: Vec<L>,
    /// The looks that were taken since the reference is not told to be the bus's, behind whatever words; `None`: it is.
    since_elsewhere: Option<Vec<L>>,
    /// Since when `FrH` is another reference than the one that is followed, behind the control word that was written last.
    lags_since: Option<Instant>,
    /// The status before showed the reaction to a fault.
    reacted: bool,
}

impl<L> Default for Proof<L> {
    fn default() -> Self {
        Self {
            watch: Watch::default(),
            motion: Motion::NotKnown,
            given: None,
            may_stand: Vec::new(),
            reference: None,
            speeds: None,
            held: None,
            limits: None,
            question: None,
            looked: Vec::new(),
            since_elsewhere: None,
            lags_since: None,
            reacted: false,
        }
    }
}

impl<L: Copy + PartialEq> Proof<L> {
    /// What was read may be another drive's from now on. The run command, the shaft and the setpoint of a run stay.
    pub fn forget(&mut self) {
        self.watch.lose_sight();
        (self.held, self.reference, self.limits, self.question) = (None, None, None, None);
        if self.watch.run.lease().is_none() {
            self.given = None;
            self.may_stand.clear();
        }
    }

    /// Takes a run command of an earlier run of the program. What the drive holds is read with the next status.
    pub const fn adopt(&mut self, lease: Lease) {
        self.watch.adopt(lease);
        self.held = None;
    }

    /// The control word that the drive was last seen to hold.
    #[must_use]
    pub const fn held(&self) -> Option<u16> {
        self.held
    }

    /// The drive was read to hold this control word and this reference.
    pub const fn was_read(&mut self, word: u16, reference: u16) {
        self.watch.run.reads(word);
        (self.held, self.reference) = (Some(word), Some(reference));
    }

    /// Writes the control word to its register in this class, and remembers it as the one that the drive holds; while the outcome is not known,
    /// none is.
    ///
    /// # Errors
    /// Those of [`Registers`].
    pub async fn write_control<P: Port>(
        &mut self,
        registers: &mut Registers<P>,
        cmd: Register<impl Writable>,
        (class, word, effect): (Class, u16, Effect),
    ) -> Result<()> {
        self.is_writing(word);
        let mut calls = registers.at(class);
        match (class, effect) {
            // What a stop has done is read as a command.
            (Class::Stop, _) => calls.write_word(cmd.address(), word).await?,
            (_, Effect::Edge) => calls.edge().write(cmd, word).await?,
            (_, Effect::Level) => calls.write(cmd, word).await?,
        }
        self.held = Some(word);
        Ok(())
    }

    /// A control word is about to be written: what the drive holds is not known until it has confirmed it.
    pub const fn is_writing(&mut self, word: u16) {
        self.watch.run.sends(word);
        (self.held, self.lags_since) = (None, None);
    }

    /// The drive follows this speed of the bus. Whether `FrH` is another reference, by the high limit that it tells in hertz and among its
    /// `speeds`, and may only be late: what it shows then is that of before, and a run command in force at that was not confirmed.
    ///
    /// # Errors
    /// That of the speeds; a drive that refuses them tells none.
    pub fn frh_lags(
        &mut self,
        frh: Frequency,
        lfrd: u16,
        hsp: Option<Frequency>,
        speeds: Result<(Speed, Speed)>,
    ) -> Result<bool> {
        let smal = match speeds {
            Ok((_, smal)) => Some(smal),
            Err(Error::Exception { .. }) => None,
            Err(error) => return Err(error),
        };
        let is_told = hsp.zip(smal).is_some_and(|limits| is_speed(frh, lfrd, limits));
        Ok(!is_told && self.lags_since.get_or_insert_with(Instant::now).elapsed() < SHOWN_WITHIN)
    }

    /// What the drive holds is not known any more, unless `it_can` still hold it.
    pub fn holds_if(&mut self, it_can: impl FnOnce(u16) -> bool) {
        self.held = self.held.filter(|&word| it_can(word));
        if self.held.is_none() {
            self.watch.run.unread();
        }
    }

    /// What the control word that the drive holds says of a lease, by `stands`. One that was only written tells of no other.
    #[must_use]
    pub fn told_word(&self, stands: impl FnOnce(u16) -> RunWord) -> RunWord {
        let is_read = self.watch.run.held().is_some();
        match self.held.map(stands) {
            None => RunWord::NotTold,
            Some(RunWord::Gone) if !is_read => RunWord::NotTold,
            Some(told) => told,
        }
    }

    /// A setpoint is about to be written: a call that is dropped from here on leaves it in the drive, or the one before.
    pub fn is_giving(&mut self, register: u16, word: u16) {
        if self.may_stand.len() == MAY_STAND {
            self.may_stand.remove(0);
        }
        self.may_stand.push((register, word));
    }

    /// What became of the write of a setpoint: it is the one that is to be in force, or never arrived, or may stand.
    ///
    /// # Errors
    /// Those of the write.
    pub fn gave(&mut self, register: u16, word: u16, is_first: bool, written: Result<()>) -> Result<()> {
        match &written {
            Ok(()) => {
                self.is_to_follow((register, word));
                if is_first {
                    self.reference = Some(word);
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::Exception | ErrorKind::NotSent) => {
                self.may_stand.pop();
            }
            Err(_) => {}
        }
        written
    }

    /// The setpoint that is to be in force from now on, written or found: its register and its word.
    pub fn is_to_follow(&mut self, setpoint: (u16, u16)) {
        self.given = Some(setpoint);
        self.may_stand.clear();
    }

    /// A count of `register` is another one from now on: what was given there would be this word now, which the drive does not hold.
    pub fn recount(&mut self, register: u16, recounted: impl Fn(u16) -> u16) {
        let setpoints = self.given.iter_mut().chain(&mut self.may_stand);
        for (_, word) in setpoints.filter(|(given, _)| *given == register) {
            *word = recounted(*word);
        }
    }

    /// The setpoint that is to be in force, its register and its word.
    #[must_use]
    pub const fn given(&self) -> Option<(u16, u16)> {
        self.given
    }

    /// Whether this side has given this setpoint, as far as nothing speaks against that.
    #[must_use]
    pub fn may_be_ours(&self, setpoint: (u16, u16)) -> bool {
        self.given.is_none_or(|given| given == setpoint) || self.may_stand.contains(&setpoint)
    }

    /// Whose reference the motor follows, by `FrH`, with what a `count` of `LFr` is and the registers of `LFr` and `LFRD`.
    #[must_use]
    pub fn followed(
        &self,
        frh: Frequency,
        count: impl Fn(u16) -> Frequency,
        [first, second]: [u16; 2],
    ) -> Followed {
        let Some((limits, _)) = self.limits else { return Followed::NotTold };
        let follows = |&lfr: &u16| {
            let asked = count(lfr);
            follows_frequency(frh, asked, limits.unwrap_or((asked, asked)))
        };
        let by_first = self.reference.filter(follows);
        let by_second = self.speeds.filter(|&(lfrd, frhd)| follows_speed(frhd, lfrd)).map(|(lfrd, _)| lfrd);
        let followed = [by_first.map(|word| (first, word)), by_second.map(|word| (second, word))];
        let ours = followed.into_iter().flatten().any(|setpoint| self.may_be_ours(setpoint));
        match by_first.or(by_second) {
            Some(_) if ours => Followed::Ours,
            _ if self.speeds.is_none() => Followed::NotTold,
            Some(_) => Followed::AnotherMasters,
            None => Followed::Elsewhere,
        }
    }

    /// The limits of a setpoint as far as they were read; the inner `None`: the drive tells none.
    #[must_use]
    pub fn limits(&self) -> Option<Option<Limits>> {
        self.limits.map(|(limits, _)| limits)
    }

    /// The same where they were read lately.
    #[must_use]
    pub fn fresh_limits(&self) -> Option<Option<Limits>> {
        self.limits.filter(|(_, at)| at.elapsed() < LIMITS_HOLD).map(|(limits, _)| limits)
    }

    /// At what a motor turns that is asked for this by the reference before the ramp: within the limits, as far as they were read. Whether
    /// `FrH` is kept between them no manual says.
    #[must_use]
    pub fn turns_at(&self, frh: Frequency) -> Frequency {
        self.limits().flatten().map_or(frh, |(low, high)| frh.max(low).min(high))
    }

    /// Takes the limits as they were just read. Whether they are others than before, which is a ground that has changed.
    pub fn take_limits(&mut self, limits: Option<Limits>) -> bool {
        let before = self.limits.replace((limits, Instant::now()));
        let are_others = before.is_some_and(|(before, _)| before != limits);
        if are_others {
            self.watch.changes(Ground::Limits);
        }
        are_others
    }

    /// The limits may be others: they are read again when they are needed.
    pub const fn doubt_limits(&mut self) {
        self.limits = None;
    }

    /// Other words than before are another question: each look is taken once for the same. Whether it is another.
    pub fn doubt_anew(&mut self, question: Question) -> bool {
        let is_another = self.question != Some(question);
        if is_another {
            (self.question, self.speeds) = (Some(question), None);
            self.looked.clear();
        }
        is_another
    }

    /// Whether this look was taken behind these words.
    #[must_use]
    pub fn has_looked(&self, look: &L) -> bool {
        self.looked.contains(look)
    }

    /// What is wanted behind a status by which the reference is `elsewhere`, or not told to be the bus's, from the first look on that was not
    /// taken since it is, to the one that decides at the latest: a reference that never stands still, such as that of an analog input, is
    /// another question each time, and would get the first look alone for ever.
    pub fn goes_on<const N: usize>(
        &mut self,
        mut wanted: [(L, bool); N],
        decides: usize,
        elsewhere: bool,
    ) -> [(L, bool); N] {
        let taken = elsewhere.then(|| self.since_elsewhere.take().unwrap_or_default());
        let was_taken = |(look, _): &&(L, bool)| taken.iter().flatten().any(|taken| taken == look);
        let passed = wanted.iter().take(decides).take_while(was_taken).count();
        wanted.rotate_left(passed);
        self.since_elsewhere = taken;
        wanted
    }

    /// This look was taken.
    pub fn looked(&mut self, look: L) {
        if let Some(taken) = self.since_elsewhere.as_mut().filter(|taken| !taken.contains(&look)) {
            taken.push(look);
        }
        self.looked.push(look);
    }

    /// The one further exchange behind a status: the one that it cannot be told without, `needed`, the first of `wanted` that was
    /// not looked for yet behind these words, or what has its turn of so many `things`; 0: nothing has. What is needed behind each
    /// status leaves the others their turn all the same, once the drive is known to hold a word, and each that is wanted every other
    /// time: a motor that stands by a reference of zero from elsewhere would never be asked whose it is.
    pub fn choose(
        &mut self,
        needed: Option<L>,
        wanted: impl IntoIterator<Item = (L, bool)>,
        things: usize,
        turned: impl FnOnce(usize) -> L,
    ) -> Option<L> {
        let turn = if things == 0 { None } else { self.watch.turns.pass(things) };
        let open = |(look, is_wanted): (L, bool)| (is_wanted && !self.looked.contains(&look)).then_some(look);
        let look = match needed {
            Some(_) if turn.is_some() && self.held.is_some() => None,
            Some(needed) if self.held.is_some() && self.looked.contains(&needed) => {
                let instead = wanted.into_iter().find_map(open);
                self.looked.retain(|look| instead.is_none() || *look != needed);
                instead.or(Some(needed))
            }
            Some(_) => needed,
            None => wanted.into_iter().find_map(open),
        };
        if look.is_some() && turn.is_some() {
            self.watch.turns.again();
        }
        look.or(turn.map(turned))
    }

    /// Whether the status before showed a motor that the reaction to a fault brought down; `chart` is what this one shows.
    pub fn has_reacted(&mut self, chart: Option<ChartState>) -> bool {
        let reacts = chart == Some(ChartState::FaultReactionActive);
        std::mem::replace(&mut self.reacted, reacts) && self.watch.shaft.was_braked()
    }

    /// What the shaft does, by what a status shows of the output.
    pub fn see(&mut self, at: Option<Instant>, shown: Output, frequency: Option<Frequency>) {
        self.motion = self.watch.see(at.unwrap_or_else(Instant::now), shown, frequency);
    }

    /// Which way a status shows the motor to be driven, and whether it says that the motor comes down.
    pub fn see_turning(
        &mut self,
        at: Option<Instant>,
        (direction, comes_down): (Option<Direction>, Option<bool>),
        frequency: Option<Frequency>,
    ) {
        let output = frequency.unwrap_or_default();
        self.watch.see_turning(at.unwrap_or_else(Instant::now), direction, output, comes_down);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RUN: Lease = Lease::new(Direction::Forward, 0x000F);

    fn gone(_: u16) -> RunWord {
        RunWord::Gone
    }

    #[test]
    fn a_word_that_was_only_written_tells_of_no_lease_that_has_gone() {
        let mut proof = Proof::<u8>::default();
        proof.is_writing(0x0007);
        proof.held = Some(0x0007);
        assert_eq!(proof.told_word(gone), RunWord::NotTold);
        proof.was_read(0x0007, 0);
        assert_eq!(proof.told_word(gone), RunWord::Gone);
    }

    #[test]
    fn a_word_that_the_drive_cannot_hold_any_more_was_not_read_either() {
        let mut proof = Proof::<u8>::default();
        proof.was_read(0x000F, 200);
        proof.holds_if(|_| true);
        assert_eq!((proof.held(), proof.watch.run.held()), (Some(0x000F), Some(0x000F)));
        proof.holds_if(|_| false);
        assert_eq!((proof.held(), proof.watch.run.held()), (None, None));
    }

    #[test]
    fn the_setpoint_of_a_run_outlives_a_lost_line_and_that_of_no_run_does_not() {
        for (lease, kept) in [(Some(RUN), Some((401, 200))), (None, None)] {
            let mut proof = Proof::<u8>::default();
            lease.into_iter().for_each(|lease| proof.adopt(lease));
            proof.gave(401, 200, true, Ok(())).unwrap();
            proof.forget();
            assert_eq!((proof.given(), proof.reference), (kept, None));
        }
    }

    #[test]
    fn what_every_status_needs_leaves_the_others_their_turn_and_one_that_was_lost_comes_again() {
        let mut proof = Proof::<u8>::default();
        proof.was_read(0x000F, 0);
        let looks: Vec<_> = (0..40).map(|_| proof.choose(Some(9), [], 2, |turn| turn as u8)).collect();
        assert_eq!(looks.iter().filter(|look| **look != Some(9)).count(), 2, "{looks:?}");
        // What is wanted beside it has every other status, once each.
        let mut proof = Proof::<u8>::default();
        proof.was_read(0x000F, 0);
        let looks: Vec<_> = (0..6)
            .filter_map(|_| proof.choose(Some(9), [(7, true), (8, true)], 0, |turn| turn as u8))
            .collect();
        assert_eq!(looks, [9; 6], "what was not answered is asked again");
        let mut looks = Vec::new();
        while looks.len() < 7 {
            let look =
                proof.choose(Some(9), [(7, true), (8, true)], 0, |turn| turn as u8).expect("one is needed");
            proof.looked(look);
            looks.push(look);
        }
        assert_eq!(looks, [9, 7, 9, 8, 9, 9, 9]);
        // What is wanted at the same moment goes first, and the turn comes with the next status.
        let mut proof = Proof::<u8>::default();
        for _ in 0..19 {
            assert_eq!(proof.choose(None, [], 2, |turn| turn as u8), None);
        }
        assert_eq!(proof.choose(None, [(7, true)], 2, |turn| turn as u8), Some(7));
        assert_eq!(proof.choose(None, [], 2, |turn| turn as u8), Some(0));
    }

    #[test]
    fn only_a_motor_that_was_seen_to_be_braked_by_the_reaction_has_reacted() {
        let mut proof = Proof::<u8>::default();
        assert!(!proof.has_reacted(Some(ChartState::FaultReactionActive)));
        assert!(!proof.has_reacted(Some(ChartState::Fault)), "nobody saw it brake");
        proof.watch.shaft.see(Instant::now(), Output::Braking(Frequency::from_hertz(9)), None);
        assert!(!proof.has_reacted(Some(ChartState::FaultReactionActive)), "not yet");
        assert!(proof.has_reacted(Some(ChartState::Fault)));
    }
}
