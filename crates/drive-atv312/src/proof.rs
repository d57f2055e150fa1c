//! What proves a run command of this side from status to status, and what the shaft does: what the ordinary exchange carries,
//! and what takes a further one, never more than one behind a status.

use drive_core::{
    Class, Error, Evidence, Frequency, Ground, Output, Port, Refusal, RunWord, State, Status, StopMode, Told,
};
use drive_drivecom::Followed;

use crate::{
    Atv312,
    facts::{ANALOG_INPUTS, BEYOND_LIMIT, Facts, OTHER_REFERENCE},
    reading::{FastWords, Resolution},
    registers::{ADC, AI1C, CMI, FRH, INH, IOLR, LFR, LFRD, LRS1, LRS3, RFR, SLL, TTO},
    words::{AccessLevel, ControlWord, ExtendedControl, ExtendedStatus, ExtendedStatus1, ExtendedStatus3},
};

/// What has its turn besides the settings' blocks: the limits, `ttO`, `SLL`, what inhibits faults, the two ramps.
const TURNS: usize = 6;

/// A further exchange behind a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Look {
    /// `CMD`, `LFr`, `PISP`, `CMI`.
    Controls,
    /// `LFRD` and `FRHD`.
    Speeds,
    /// `tFr`, `HSP`, `LSP`.
    Limits,
    /// `IOLR`.
    Inputs,
    /// `LRS3`.
    Selection,
    /// `AI1C` to `AI3C`.
    Analog,
    /// `LRS1`.
    Signal,
    /// A block of the settings that is not known yet.
    Setting,
    /// What is not known yet of the ramp.
    Ramp,
    /// What has its turn.
    Turn(usize),
}

impl<P: Port> Atv312<P> {
    /// The fast set for whoever watches: one exchange, and a second one where these words alone do not tell the frequency,
    /// whether a run command is in force, or by whose reference the motor turns.
    pub(crate) async fn watch(&mut self) -> Result<Status, Error> {
        let mut status = self.fast_status(Class::Status).await?;
        let words = FastWords::in_status(&status);
        if self.proof.doubt_anew(words.state_words().question(words.word(FRH))) {
            self.facts = Facts::default();
        }
        // A frequency that is not told without `CMI` is needed like the word.
        let untold = status.output_frequency.is_none();
        let needed = (untold || words.state_words().needs_command(self.command())).then_some(Look::Controls);
        let (wanted, things) = (self.wanted(&words, &status), self.turn_count());
        let [_, _, (_, elsewhere), ..] = wanted;
        let wanted = self.proof.goes_on(wanted, 2, elsewhere);
        if let Some(look) = self.proof.choose(needed, wanted, things, Look::Turn) {
            let was_told = self.command().is_some();
            // The status is good without it.
            let _ = self.look(look).await;
            // The word that was read tells a stop along the ramp from a run.
            if !was_told && self.command().is_some() {
                self.see_shaft(&words);
            }
            status = self.status_of(&words);
        }
        self.known.seen = true;
        status.verdict = self.evidence(&words).and_then(|evidence| self.proof.watch.run.judge(&evidence));
        Ok(status)
    }

    const fn turn_count(&self) -> usize {
        if self.proof.watch.is_kept() { self.beat() * (TURNS + self.known.settings.blocks()) } else { 0 }
    }

    /// The control word and what stands beside it every other time, or every third where an input may inhibit faults, which has as many.
    const fn beat(&self) -> usize {
        if self.known.inhibits.is_some() { 3 } else { 2 }
    }

    fn wanted(&self, words: &FastWords, status: &Status) -> [(Look, bool); 9] {
        let settings = &self.known.settings;
        let evidence = self.evidence(words);
        let elsewhere = evidence.is_some() && self.told_reference(words) != Told::Yes;
        let blocked = evidence.is_some_and(|evidence| evidence.output != Told::Yes);
        let unread = evidence.is_some_and(|evidence| evidence.word == RunWord::NotTold);
        let switched = settings.level() == Some(AccessLevel::L3) && settings.switches_reference();
        let sums = settings.summed().iter().any(|source| ANALOG_INPUTS.contains(source));
        let learns = self.known.seen && status.state == State::Running && settings.can_learn();
        [
            (Look::Controls, !self.is_plausible(words) || unread || elsewhere || blocked),
            // They may have been set otherwise at the drive, across the setpoint: before any other reference is blamed.
            (Look::Limits, evidence.is_some() && (elsewhere || self.proof.limits().is_none())),
            (Look::Speeds, elsewhere),
            (Look::Selection, elsewhere && switched),
            (Look::Inputs, elsewhere && settings.has_presets() || blocked && settings.has_stop_inputs()),
            (Look::Analog, elsewhere && sums),
            (Look::Signal, elsewhere && settings.falls_back()),
            (Look::Setting, learns),
            (Look::Ramp, evidence.is_some() && self.known.ramp.can_learn()),
        ]
    }

    async fn look(&mut self, look: Look) -> Result<(), Error> {
        let class = Class::Status;
        match look {
            Look::Controls => self.read_controls(class).await.map(drop)?,
            Look::Limits => self.read_frequency_limits(class).await.map(drop)?,
            Look::Speeds => {
                let [lfrd, _, _, frhd] = self.registers.at(class).read_array(LFRD.address()).await?;
                self.proof.speeds = Some((lfrd, frhd));
            }
            Look::Inputs => self.facts.inputs = Some(self.registers.at(class).read(IOLR).await?),
            Look::Selection => {
                let lrs3 = ExtendedStatus3::from_bits_retain(self.registers.at(class).read(LRS3).await?);
                self.facts.second = Some(lrs3.contains(ExtendedStatus3::REFERENCE_2));
            }
            Look::Analog => {
                self.facts.analog = Some(self.registers.at(class).read_array(AI1C.address()).await?);
            }
            Look::Signal => {
                let lrs1 = ExtendedStatus1::from_bits_retain(self.registers.at(class).read(LRS1).await?);
                self.facts.lost = Some(lrs1.contains(ExtendedStatus1::SIGNAL_LOST));
            }
            Look::Setting => self.read_a_setting(class).await,
            Look::Ramp => self.read_ramp(class).await?,
            Look::Turn(turn) if turn % self.beat() == 0 => self.read_controls(class).await.map(drop)?,
            Look::Turn(turn) if turn % self.beat() == 2 => self.read_inhibition(class).await?,
            Look::Turn(turn) => match turn / self.beat() {
                0 => self.read_frequency_limits(class).await.map(drop)?,
                1 => {
                    let word = self.registers.at(class).read(TTO).await?;
                    self.proof.watch.finds(TTO.address(), word, Ground::Watchdog);
                }
                2 => {
                    let word = self.registers.at(class).read(SLL).await?;
                    self.proof.watch.finds(SLL.address(), word, Ground::Watchdog);
                }
                3 => {
                    let word = self.learn_inhibition(class).await?;
                    self.proof.watch.finds(INH.address(), word, Ground::Watchdog);
                }
                4 => self.read_second_ramp(class).await?,
                5 => self.read_ramp_time(class).await?,
                block => self.read_setting_again(class, block - TURNS).await?,
            },
        }
        // One after the other.
        if !matches!(look, Look::Setting | Look::Ramp) {
            self.proof.looked(look);
        }
        Ok(())
    }

    /// The input that inhibits every fault.
    async fn read_inhibition(&mut self, class: Class) -> Result<(), Error> {
        if let Some(input) = self.known.inhibits {
            let is_closed = self.registers.at(class).read(IOLR).await? >> input & 1;
            self.proof.watch.finds(IOLR.address(), is_closed, Ground::Watchdog);
        }
        Ok(())
    }

    /// Whether the output is one that the reference explains, at the resolution that is known: else bit 9 of `CMI` may be another.
    fn is_plausible(&self, words: &FastWords) -> bool {
        let Some(resolution) = self.known.resolution else { return true };
        let (output, asked) = (words.output(resolution).centihertz(), words.reference().centihertz());
        let limits = self.proof.limits().flatten();
        let high = limits.map_or(asked, |(_, high)| high.centihertz().max(asked));
        let reached = words.state_words().eta.contains(crate::words::StatusWord::REFERENCE_REACHED);
        let turns = words.state_words().is_turning()
            && !words.state_words().eti.contains(ExtendedStatus::DECELERATING);
        // Slip is compensated by a few percent of the nominal frequency.
        // With the other resolution the same word is 5.5 times as much, or as little: a quarter and 5 Hz lie between
        // the two.
        let too_fast = output > high + high / 4 + 500;
        let too_slow = turns && reached && asked > output + output / 4 + 500;
        !(too_fast || too_slow)
    }

    /// Whether the motor follows the setpoint that this side has given, or found when it gave its run command.
    fn told_reference(&self, words: &FastWords) -> Told {
        const WRITTEN_BY_ANOTHER: Refusal = Refusal::Overridden {
            by: "a reference that another master has written (LFr or LFRD)",
            remedy: "see which one it is, and give the setpoint again",
        };
        const COUNTED_OTHERWISE: Refusal = Refusal::Overridden {
            by: "another count of the reference (CMI bit 9 was changed since the setpoint was given)",
            remedy: "see who has changed it, and give the setpoint again",
        };
        let settings = &self.known.settings;
        if let Some(reason) = settings.refuses_reference().filter(|_| settings.is_complete()) {
            return Told::No(reason);
        }
        let Some(resolution) = self.known.resolution else { return Told::NotTold };
        let count = |lfr| resolution.frequency(lfr);
        match self.proof.followed(words.reference(), count, [LFR.address(), LFRD.address()]) {
            Followed::Ours => Told::Yes,
            Followed::NotTold => Told::NotTold,
            Followed::AnotherMasters if self.recounted => Told::No(COUNTED_OTHERWISE),
            Followed::AnotherMasters => Told::No(WRITTEN_BY_ANOTHER),
            Followed::Elsewhere => {
                let named = settings.overrides(&self.facts, self.proof.held().unwrap_or(0));
                let is_beyond =
                    words.state_words().eta.contains(crate::words::StatusWord::REFERENCE_EXCEEDED);
                let unnamed = match (self.recounted, is_beyond) {
                    (true, _) => COUNTED_OTHERWISE,
                    (false, true) => BEYOND_LIMIT,
                    (false, false) => OTHER_REFERENCE,
                };
                Told::No(named.unwrap_or(unnamed))
            }
        }
    }

    pub(crate) fn evidence(&self, words: &FastWords) -> Option<Evidence> {
        let lease = self.proof.watch.run.lease()?;
        let settings = &self.known.settings;
        let mut evidence = words.state_words().evidence(lease, words.reference(), self.output(words));
        evidence.word = self.proof.told_word(|held| settings.meaning(held).stands_for(lease));
        if evidence.reference == Told::Yes {
            evidence.reference = self.told_reference(words);
        }
        evidence.reference = self.proof.watch.told_by_turning(evidence.reference);
        let by_input = self.facts.inputs.and_then(|inputs| settings.stopped_by(inputs));
        match (evidence.output, by_input) {
            (Told::No(Refusal::Tripped), _) | (_, None) => {}
            (Told::No(_), Some(input)) => evidence.output = Told::No(input),
            _ => {}
        }
        Some(evidence)
    }

    /// The output, where it is told what a count of it is. Zero is zero by any count.
    pub(crate) fn output(&self, words: &FastWords) -> Option<Frequency> {
        let resolution = self.known.resolution.or((words.word(RFR) == 0).then_some(Resolution::Normal));
        resolution.map(|resolution| words.output(resolution))
    }

    /// What the shaft does, as these words show it.
    pub(crate) fn see_shaft(&mut self, words: &FastWords) {
        let command = self.command();
        let ramps = matches!(self.known.settings.known_stop(), Some(StopMode::Ramp | StopMode::Fast));
        let frequency = self.output(words);
        let at = self.registers.snapshot_time();
        let state = words.state_words();
        let (braked, reacted) = (self.proof.watch.shaft.was_braked(), self.proof.has_reacted(state.chart()));
        let shown = state.output(command, frequency, ramps, braked, reacted);
        // What AdC injects begins when a ramp has brought the motor to rest (p. 41).
        if shown == Output::Injection && ramps && self.injects_at_rest(command) {
            self.proof.see(at, Output::None, Some(Frequency::ZERO));
        }
        self.proof.see(at, shown, frequency);
        self.proof.see_turning(at, state.turning(), frequency);
    }

    /// Whether direct current can only be that of `AdC`: no bit and no input asks for another.
    fn injects_at_rest(&self, command: Option<ControlWord>) -> bool {
        let settings = &self.known.settings;
        settings.is_complete()
            && settings.word(ADC) != 0
            && !settings.injects_by_input()
            && command.is_some_and(|command| !command.contains(ControlWord::DC_INJECTION))
    }

    /// Takes `CMI` as it was read: what a count is, and whether the drive watches its line.
    pub(crate) fn take_extended(&mut self, cmi: ExtendedControl) {
        let unwatched = (cmi & ExtendedControl::NO_TIMEOUT).bits();
        self.proof.watch.finds(CMI.address(), unwatched, Ground::Watchdog);
        let resolution = Resolution::of(cmi);
        if let Some(before) = self.counted.replace(resolution).filter(|before| *before != resolution) {
            self.proof.watch.changes(Ground::Units);
            // Both registers of the reference: at high resolution the second is a frequency, too.
            for register in [LFR.address(), LFRD.address()] {
                self.proof.recount(register, |word| resolution.recounted(word, before));
            }
            self.recounted = true;
        }
        self.known.resolution = Some(resolution);
    }
}
