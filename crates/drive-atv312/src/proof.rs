//! What proves a run command of this side from status to status, and what the shaft does: what the ordinary exchange carries,
//! and what takes a further one, never more than one behind a status.

use drive_core::{
    Class, Control, Error, Evidence, Frequency, Ground, Motion, Output, Port, Refusal, RunWord, State,
    Status, StopMode, Told, Verdict,
    drivecom::{ChartState, StatusWords, follows_frequency, follows_speed},
};
use tokio::time::Instant;

use crate::{
    Atv312,
    command::OTHER_REFERENCE,
    reading::{FastWords, Resolution},
    reference::ANALOG_INPUTS,
    registers::{ADC, AI1C, IOLR, LFR, LFRD, LRS3, SLL, TTO},
    words::{AccessLevel, ControlWord, ExtendedControl, ExtendedStatus, ExtendedStatus3},
};

/// What has its turn besides the settings' blocks: the limits, `ttO`, `SLL`.
const TURNS: usize = 3;

/// A further exchange behind a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
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
    /// A block of the settings that is not known yet.
    Setting,
    /// What has its turn.
    Turn(usize),
}

/// What was looked for since the words of a status speak against what was known, and found. Each look is taken once for the same
/// words.
#[derive(Debug, Clone, Default)]
pub(crate) struct Doubt {
    words: Option<(u16, u16, u16)>,
    looked: Vec<Look>,
    speeds: Option<(u16, u16)>,
    pub(crate) facts: Facts,
}

/// What decides a reference beside the settings.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Facts {
    /// The logic inputs.
    pub(crate) inputs: Option<u16>,
    /// Whether the second reference is selected.
    pub(crate) second: Option<bool>,
    /// The analog inputs.
    pub(crate) analog: Option<[u16; 3]>,
}

/// What a contract rests on, as it was read or set last.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Grounds {
    /// `ttO`.
    pub(crate) time_out: Option<u16>,
    /// `SLL`.
    pub(crate) reaction: Option<u16>,
    /// Bit 14 of `CMI`.
    pub(crate) unwatched: Option<bool>,
}

impl<P: Port> Atv312<P> {
    /// The fast set for whoever watches: one exchange, and a second one where these words alone do not tell the frequency,
    /// whether a run command is in force, or by whose reference the motor turns.
    pub(crate) async fn watch(&mut self) -> Result<Status, Error> {
        let mut status = self.fast_status(Class::Status).await?;
        let words = FastWords::in_status(&status);
        self.doubt_anew(&words);
        let turn = self.is_looked_after().then(|| self.turns.pass(self.turn_count())).flatten();
        let look = self.next_look(&words, &status);
        if look.is_some() && turn.is_some() {
            self.turns.again();
        }
        if let Some(look) = look.or(turn.map(Look::Turn)) {
            // The status is good without it.
            let _ = self.look(look).await;
            status = self.status_of(&words);
        }
        self.known.seen = true;
        status.verdict = self.judge(&words);
        Ok(status)
    }

    /// Whether a run command of this side stands, or a watchdog was armed.
    const fn is_looked_after(&self) -> bool {
        self.own.lease().is_some() || self.armed
    }

    const fn turn_count(&self) -> usize {
        // The control word and what stands beside it every other time.
        2 * (TURNS + self.known.settings.blocks())
    }

    /// Other words than before are another question.
    fn doubt_anew(&mut self, words: &FastWords) {
        let key = words.question();
        if self.doubt.words != Some(key) {
            self.doubt = Doubt { words: Some(key), ..Doubt::default() };
        }
    }

    fn next_look(&self, words: &FastWords, status: &Status) -> Option<Look> {
        let state = words.state_words();
        if self.needs_controls(state, status) {
            return Some(Look::Controls);
        }
        let settings = &self.known.settings;
        let mut looks = Vec::new();
        if !self.is_plausible(words) {
            looks.push(Look::Controls);
        }
        if let Some(lease) = self.own.lease() {
            let evidence = state.evidence(lease, words.reference());
            let elsewhere = self.told_reference(words) != Told::Yes;
            let blocked = evidence.output != Told::Yes;
            if self.word_of(lease) == RunWord::NotTold || elsewhere || blocked {
                looks.push(Look::Controls);
            }
            if self.known.frequencies.is_none() {
                looks.push(Look::Limits);
            }
            if elsewhere {
                looks.push(Look::Speeds);
            }
            if elsewhere && settings.level() == Some(AccessLevel::L3) && settings.switches_reference() {
                looks.push(Look::Selection);
            }
            if elsewhere && settings.has_presets() || blocked && settings.has_stop_inputs() {
                looks.push(Look::Inputs);
            }
            if elsewhere && settings.summed().iter().any(|source| ANALOG_INPUTS.contains(source)) {
                looks.push(Look::Analog);
            }
        }
        let look = looks.into_iter().find(|look| !self.doubt.looked.contains(look));
        let learns = self.known.seen && status.state == State::Running && settings.can_learn();
        look.or(learns.then_some(Look::Setting))
    }

    async fn look(&mut self, look: Look) -> Result<(), Error> {
        let class = Class::Status;
        match look {
            Look::Controls => self.read_controls(class).await.map(drop)?,
            Look::Limits => self.read_frequency_limits(class).await.map(drop)?,
            Look::Speeds => {
                let [lfrd, _, _, frhd] = self.registers.at(class).read_array(LFRD.address()).await?;
                self.doubt.speeds = Some((lfrd, frhd));
            }
            Look::Inputs => self.doubt.facts.inputs = Some(self.registers.at(class).read(IOLR).await?),
            Look::Selection => {
                let lrs3 = ExtendedStatus3::from_bits_retain(self.registers.at(class).read(LRS3).await?);
                self.doubt.facts.second = Some(lrs3.contains(ExtendedStatus3::REFERENCE_2));
            }
            Look::Analog => {
                self.doubt.facts.analog = Some(self.registers.at(class).read_array(AI1C.address()).await?);
            }
            Look::Setting => self.read_a_setting(class).await,
            Look::Turn(turn) if turn % 2 == 0 => self.read_controls(class).await.map(drop)?,
            Look::Turn(turn) => match turn / 2 {
                0 => self.read_frequency_limits(class).await.map(drop)?,
                1 => {
                    let word = self.registers.at(class).read(TTO).await?;
                    self.ground(|grounds| &mut grounds.time_out, word);
                }
                2 => {
                    let word = self.registers.at(class).read(SLL).await?;
                    self.ground(|grounds| &mut grounds.reaction, word);
                }
                block => self.read_setting_again(class, block - TURNS).await?,
            },
        }
        self.doubt.looked.push(look);
        Ok(())
    }

    /// Takes what was read of a contract's grounds, and remembers that it is otherwise than before.
    pub(crate) fn ground<T: PartialEq>(&mut self, of: fn(&mut Grounds) -> &mut Option<T>, read: T) {
        let known = of(&mut self.grounds);
        if self.armed && known.as_ref().is_some_and(|known| *known != read) {
            self.changed(Ground::Watchdog);
        }
        *of(&mut self.grounds) = Some(read);
    }

    pub(crate) fn changed(&mut self, ground: Ground) {
        if self.is_looked_after() && !self.changed.contains(&ground) {
            self.changed.push(ground);
        }
    }

    /// Whether the output is one that the reference explains, at the resolution that is known: else bit 9 of `CMI` may be another.
    fn is_plausible(&self, words: &FastWords) -> bool {
        let Some(resolution) = self.known.resolution else { return true };
        let (output, asked) = (words.output(resolution).centihertz(), words.reference().centihertz());
        let high = self.known.frequencies.map_or(asked, |((_, high), _)| high.centihertz().max(asked));
        let reached = words.state_words().eta.contains(crate::words::StatusWord::REFERENCE_REACHED);
        let turns = words.state_words().is_turning()
            && !words.state_words().eti.contains(ExtendedStatus::DECELERATING);
        // Slip is compensated by a few percent of the nominal frequency.
        let too_fast = output > high + high / 4 + 500;
        let too_slow = turns && reached && asked > output + output / 4 + 500;
        !(too_fast || too_slow)
    }

    /// What the control word that the drive was read to hold says of the lease.
    fn word_of(&self, lease: drive_core::Lease) -> RunWord {
        let told = self.held.map(|held| self.known.settings.meaning(held).stands_for(lease));
        match told {
            // What was only written is not yet seen.
            Some(RunWord::Gone) if !self.held_is_read => RunWord::NotTold,
            Some(told) => told,
            None => RunWord::NotTold,
        }
    }

    /// Whether the motor follows the setpoint that this side has given, or found when it gave its run command.
    fn told_reference(&self, words: &FastWords) -> Told {
        const WRITTEN_BY_ANOTHER: Refusal = Refusal::Overridden {
            by: "a reference that another master has written (LFr or LFRD)",
            remedy: "see which one it is, and give the setpoint again",
        };
        let settings = &self.known.settings;
        if let Some(reason) = settings.refuses_reference().filter(|_| settings.is_complete()) {
            return Told::No(reason);
        }
        let Some(((limits, _), resolution)) = self.known.frequencies.zip(self.known.resolution) else {
            return Told::NotTold;
        };
        let given = |register, word| self.given.is_none_or(|(at, given)| at != register || given == word);
        let follows = |lfr| follows_frequency(words.reference(), resolution.frequency(lfr), limits);
        let by_frequency = self.known.lfr.is_some_and(follows);
        let by_speed = self.doubt.speeds.is_some_and(|(lfrd, frhd)| follows_speed(frhd, lfrd));
        match (by_frequency, by_speed) {
            (true, _) if self.known.lfr.is_some_and(|lfr| given(LFR.address(), lfr)) => Told::Yes,
            (_, true) if self.doubt.speeds.is_some_and(|(lfrd, _)| given(LFRD.address(), lfrd)) => Told::Yes,
            _ if !self.doubt.looked.contains(&Look::Speeds) => Told::NotTold,
            (true, _) | (_, true) => Told::No(WRITTEN_BY_ANOTHER),
            (false, false) => {
                let named = settings.overrides(&self.doubt.facts, self.held.unwrap_or(0));
                Told::No(named.unwrap_or(OTHER_REFERENCE))
            }
        }
    }

    fn evidence(&self, words: &FastWords) -> Option<Evidence> {
        let lease = self.own.lease()?;
        let settings = &self.known.settings;
        let mut evidence = words.state_words().evidence(lease, words.reference());
        evidence.word = self.word_of(lease);
        if evidence.reference == Told::Yes {
            evidence.reference = self.told_reference(words);
        }
        let by_input = self.doubt.facts.inputs.and_then(|inputs| settings.stopped_by(inputs));
        match (evidence.output, by_input) {
            (Told::No(Refusal::Tripped), _) | (_, None) => {}
            (Told::No(_), Some(input)) => evidence.output = Told::No(input),
            _ => {}
        }
        Some(evidence)
    }

    /// The verdict on our run command, which ends where another word was read in its place.
    fn judge(&mut self, words: &FastWords) -> Option<Verdict> {
        let evidence = self.evidence(words)?;
        if evidence.word == RunWord::Gone && self.held == self.last_written {
            // A stop of ours that did not show at once.
            self.own.end();
            return None;
        }
        self.own.judge(&evidence)
    }

    /// The verdict for a status that a command has read: it ends nothing.
    pub(crate) fn verdict(&self, words: &FastWords) -> Option<Verdict> {
        let evidence = self.evidence(words)?;
        // While a word of this side is on its way, what stands says nothing.
        let word = if evidence.word == RunWord::Gone { RunWord::NotTold } else { evidence.word };
        let mut own = self.own;
        own.judge(&Evidence { word, ..evidence })
    }

    /// What the shaft does, as these words show it.
    pub(crate) fn see_shaft(&mut self, words: &FastWords, at: Option<Instant>) -> Motion {
        let settings = &self.known.settings;
        let command = self.held.map(|held| settings.meaning(held));
        let state = words.state_words();
        let ramps = matches!(settings.known_stop(), Some(StopMode::Ramp | StopMode::Fast));
        let frequency =
            self.known.resolution.or((words.word(crate::registers::RFR) == 0).then_some(Resolution::Normal));
        let frequency = frequency.map(|resolution| words.output(resolution));
        let at = at.unwrap_or_else(Instant::now);
        let shown = state.output(command, frequency, ramps, self.shaft.was_braked());
        // What AdC injects begins when a ramp has brought the motor to rest (p. 41).
        if shown == Output::Injection && ramps && self.injects_at_rest(command) {
            self.shaft.see(at, Output::None, Some(Frequency::ZERO));
        }
        self.shaft.see(at, shown, frequency)
    }

    /// Whether direct current can only be that of `AdC`: no bit and no input asks for another.
    fn injects_at_rest(&self, command: Option<ControlWord>) -> bool {
        let settings = &self.known.settings;
        settings.is_complete()
            && settings.word(ADC) != 0
            && !settings.injects_by_input()
            && command.is_some_and(|command| !command.contains(ControlWord::DC_INJECTION))
    }

    /// Whether only `CMD` tells what the drive does: a motor that slows down to stop looks like one that slows down to a
    /// lower setpoint, and one that stands at a setpoint of zero, or after `tLS`, like a stopped one.
    fn needs_controls(&self, words: StatusWords, status: &Status) -> bool {
        let by_bus = words.chart() == Some(ChartState::OperationEnabled) && words.control() == Control::Bus;
        let slows_down = !words.is_turning() || words.eti.contains(ExtendedStatus::DECELERATING);
        let unclear = match self.held.map(|held| self.known.settings.meaning(held)) {
            None => true,
            Some(command) => command.is_run() && slows_down,
        };
        status.output_frequency.is_none() || by_bus && unclear
    }

    /// Takes `CMI` as it was read: what a count is, and whether the drive watches its line.
    pub(crate) fn take_extended(&mut self, cmi: ExtendedControl) {
        self.ground(|grounds| &mut grounds.unwatched, cmi.contains(ExtendedControl::NO_TIMEOUT));
        let resolution = Resolution::of(cmi);
        if self.known.resolution.is_some_and(|known| known != resolution) {
            self.changed(Ground::Units);
        }
        self.known.resolution = Some(resolution);
    }
}
