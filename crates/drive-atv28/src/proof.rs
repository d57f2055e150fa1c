//! What proves a run command of this side from status to status, and what the shaft does: what the ordinary exchanges carry, and
//! what takes a further one, never more than one behind a status.

use drive_core::{
    Class, Control, Evidence, Frequency, Ground, Motion, Port, Refusal, Result, RunWord, Status, Told,
    Verdict,
    drivecom::{ChartState, StatusWords, follows_frequency, follows_speed},
};
use tokio::time::Instant;

use crate::{
    Atv28,
    command::OTHER_REFERENCE,
    reading::FastWords,
    registers::{CMD, FRH, LFR, LFRD, LFT},
    words::{ControlWord, ExtendedStatus, StatusWord},
};

/// What has its turn: `CMD` with `LFr`, and the limits.
const TURNS: usize = 2;

/// A further exchange behind a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    /// `CMD` and `LFr`.
    Control,
    /// `LFRD` and `FRHD`.
    Speeds,
    /// `HSP` and `LSP`.
    Limits,
}

/// What was looked for since the words of a status speak against what was known, and found.
#[derive(Debug, Clone, Default)]
pub(crate) struct Doubt {
    words: Option<(u16, u16, u16)>,
    looked: Vec<Look>,
    speeds: Option<(u16, u16)>,
}

impl<P: Port> Atv28<P> {
    /// The fast set for whoever watches, with what only a further exchange tells.
    pub(crate) async fn watch(&mut self) -> Result<Status> {
        let mut status = self.fast_status(Class::Status).await?;
        let words = FastWords::of_raw(&status.raw);
        let key = words.question();
        if self.doubt.words != Some(key) {
            self.doubt = Doubt { words: Some(key), ..Doubt::default() };
        }
        let turn = self.own.lease().and_then(|_| self.turns.pass(TURNS));
        let look = self.next_look(&words);
        if look.is_some() && turn.is_some() {
            self.turns.again();
        }
        let turned = turn.map(|turn| if turn == 0 { Look::Control } else { Look::Limits });
        if let Some(look) = look.or(turned) {
            // The status is good without it.
            let _ = self.look(look).await;
            status = self.status_of(&words);
        }
        status.verdict = self.judge(&words);
        Ok(status)
    }

    fn next_look(&self, words: &FastWords) -> Option<Look> {
        let state = words.state_words();
        if self.needs_control(state) {
            return Some(Look::Control);
        }
        let lease = self.own.lease()?;
        let elsewhere = self.told_reference(words) != Told::Yes;
        let blocked = state.evidence(lease, words.reference()).output != Told::Yes;
        let looks = [
            (Look::Control, self.word_of(lease) == RunWord::NotTold || elsewhere || blocked),
            (Look::Limits, self.limits.frequency.is_none()),
            (Look::Speeds, elsewhere),
        ];
        let wanted = |(look, is_wanted): (Look, bool)| is_wanted.then_some(look);
        looks.into_iter().filter_map(wanted).find(|look| !self.doubt.looked.contains(look))
    }

    async fn look(&mut self, look: Look) -> Result<()> {
        match look {
            Look::Control => self.read_held(Class::Status).await.map(drop)?,
            Look::Limits => self.read_frequency_limits(Class::Status).await.map(drop)?,
            Look::Speeds => {
                let [lfrd, frhd] = self.registers.at(Class::Status).read_array(LFRD.address()).await?;
                self.doubt.speeds = Some((lfrd, frhd));
            }
        }
        self.doubt.looked.push(look);
        Ok(())
    }

    /// `CMD` and `LFr` in one exchange.
    pub(crate) async fn read_held(&mut self, class: Class) -> Result<(u16, u16)> {
        let [held, lfr] = self.registers.at(class).read_array(CMD.address()).await?;
        (self.command, self.command_is_read) = (Some(ControlWord::from_bits_retain(held)), true);
        self.lfr = Some(lfr);
        Ok((held, lfr))
    }

    /// A motor that slows down to stop looks like one that slows down to a lower setpoint, and one that stands at a setpoint
    /// of zero, or after `tLS`, like a stopped one.
    fn needs_control(&self, words: StatusWords) -> bool {
        let by_bus = words.chart() == Some(ChartState::OperationEnabled) && words.control() == Control::Bus;
        let slows_down = !words.is_turning() || words.eti.contains(ExtendedStatus::DECELERATING);
        by_bus && self.command.is_none_or(|command| command.is_run() && slows_down)
    }

    fn word_of(&self, lease: drive_core::Lease) -> RunWord {
        match self.command.map(|command| command.stands_for(lease)) {
            // What was only written is not yet seen.
            Some(RunWord::Gone) if !self.command_is_read => RunWord::NotTold,
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
        let Some((limits, _)) = self.limits.frequency else { return Told::NotTold };
        let given = |register, word| self.given.is_none_or(|(at, given)| at != register || given == word);
        let follows = |&lfr: &u16| {
            let asked = Frequency::from_decihertz(lfr.cast_signed().unsigned_abs());
            follows_frequency(words.reference(), asked, limits)
        };
        let by_frequency = self.lfr.filter(follows);
        let by_speed = self.doubt.speeds.filter(|&(lfrd, frhd)| follows_speed(frhd, lfrd));
        match (by_frequency, by_speed) {
            (Some(lfr), _) if given(LFR.address(), lfr) => Told::Yes,
            (_, Some((lfrd, _))) if given(LFRD.address(), lfrd) => Told::Yes,
            _ if !self.doubt.looked.contains(&Look::Speeds) => Told::NotTold,
            (None, None) => Told::No(OTHER_REFERENCE),
            _ => Told::No(WRITTEN_BY_ANOTHER),
        }
    }

    fn evidence(&self, words: &FastWords) -> Option<Evidence> {
        let lease = self.own.lease()?;
        let mut evidence = words.state_words().evidence(lease, words.reference());
        evidence.word = self.word_of(lease);
        if evidence.reference == Told::Yes {
            evidence.reference = self.told_reference(words);
        }
        if evidence.output == Told::No(Refusal::Tripped) {
            evidence.output = Told::No(Refusal::Fault(words.word(LFT)));
        }
        Some(evidence)
    }

    /// The verdict on our run command, which ends where another word was read in its place.
    fn judge(&mut self, words: &FastWords) -> Option<Verdict> {
        let evidence = self.evidence(words)?;
        if evidence.word == RunWord::Gone && self.command == self.last_written {
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

    /// What the shaft does, as these words show it. The normal stop of the drive is a ramp (`Stt` is none of its registers).
    pub(crate) fn see_shaft(&mut self, words: &FastWords, at: Option<Instant>) -> Motion {
        let output = Some(words.output());
        let shown = words.state_words().output(self.command, output, true, self.shaft.was_braked());
        self.shaft.see(at.unwrap_or_else(Instant::now), shown, output)
    }

    pub(crate) fn changed(&mut self, ground: Ground) {
        if self.own.lease().is_some() && !self.changed.contains(&ground) {
            self.changed.push(ground);
        }
    }
}

impl FastWords {
    /// What of these words is another question when it is another: not the alarm, and not how far a ramp is.
    fn question(&self) -> (u16, u16, u16) {
        let passing = ExtendedStatus::TRANSIENT
            | ExtendedStatus::MOTOR_THERMAL_ALARM
            | ExtendedStatus::BRAKING_ALARM
            | ExtendedStatus::CURRENT_LIMIT;
        let StatusWords { eta, eti } = self.state_words();
        ((eta - StatusWord::ALARM).bits(), (eti - passing).bits(), self.word(FRH))
    }
}
