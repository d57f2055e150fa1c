//! What proves a run command of this side from status to status: what the ordinary exchanges carry, and what takes a further one,
//! never more than one behind a status.

use drive_core::{Class, Evidence, Port, Refusal, Result, RunWord, Status, Told};
use drive_drivecom::{Followed, StatusWords};

use crate::{
    Atv28,
    command::OTHER_REFERENCE,
    reading::FastWords,
    registers::{CMD, FRH, LFR, LFRD, LFT},
    setpoint::count,
    words::ControlWord,
};

/// What has its turn: `CMD` with `LFr`, and the limits.
const TURNS: [Look; 2] = [Look::Control, Look::Limits];

/// A further exchange behind a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Look {
    /// `CMD` and `LFr`.
    Control,
    /// `LFRD` and `FRHD`.
    Speeds,
    /// `HSP` and `LSP`.
    Limits,
}

impl<P: Port> Atv28<P> {
    /// The fast set for whoever watches, with what only a further exchange tells.
    pub(crate) async fn watch(&mut self) -> Result<Status> {
        let mut status = self.fast_status(Class::Status).await?;
        let words = FastWords::of_raw(&status.raw);
        let state = words.state_words();
        self.proof.doubt_anew(state.question(words.word(FRH).unwrap_or(0)));
        let needed = state.needs_command(self.command()).then_some(Look::Control);
        let things = self.proof.watch.run.lease().map_or(0, |_| TURNS.len());
        let wanted = self.wanted(&words);
        let [.., (_, elsewhere)] = wanted;
        let wanted = self.proof.goes_on(wanted, 2, elsewhere);
        if let Some(look) = self.proof.choose(needed, wanted, things, |turn| TURNS[turn]) {
            // The status is good without it.
            let _ = self.look(look).await;
            status = self.status_of(&words);
        }
        status.verdict = self.evidence(&words).and_then(|evidence| self.proof.watch.run.judge(&evidence));
        Ok(status)
    }

    fn wanted(&self, words: &FastWords) -> [(Look, bool); 3] {
        let evidence = self.evidence(words);
        let lacks = |told: fn(&Evidence) -> bool| evidence.as_ref().is_some_and(told);
        let elsewhere = evidence.is_some() && self.told_reference(words) != Told::Yes;
        let doubtful = elsewhere || lacks(|it| it.word == RunWord::NotTold || it.output != Told::Yes);
        // The limits may have been set otherwise at the drive, across the setpoint: before any other reference is blamed.
        let unlimited = evidence.is_some() && (elsewhere || self.proof.limits().is_none());
        [(Look::Control, doubtful), (Look::Limits, unlimited), (Look::Speeds, elsewhere)]
    }

    async fn look(&mut self, look: Look) -> Result<()> {
        match look {
            Look::Control => self.read_held(Class::Status).await.map(drop)?,
            Look::Limits => self.read_frequency_limits(Class::Status).await.map(drop)?,
            Look::Speeds => {
                self.proof.speeds = Some(self.read_speeds(Class::Status).await?);
            }
        }
        self.proof.looked(look);
        Ok(())
    }

    /// `CMD` and `LFr` in one exchange.
    pub(crate) async fn read_held(&mut self, class: Class) -> Result<(u16, u16)> {
        let [held, lfr] = self.registers.at(class).read_array(CMD.address()).await?;
        self.proof.was_read(held, lfr);
        Ok((held, lfr))
    }

    /// Whether the motor follows the setpoint that this side has given, or found when it gave its run command.
    fn told_reference(&self, words: &FastWords) -> Told {
        const WRITTEN_BY_ANOTHER: Refusal = Refusal::Overridden {
            by: "a reference that another master has written (LFr or LFRD)",
            remedy: "see which one it is, and give the setpoint again",
        };
        match self.proof.followed(words.reference(), count, [LFR.address(), LFRD.address()]) {
            Followed::Ours => Told::Yes,
            Followed::NotTold => Told::NotTold,
            Followed::AnotherMasters => Told::No(WRITTEN_BY_ANOTHER),
            Followed::Elsewhere => Told::No(OTHER_REFERENCE),
        }
    }

    pub(crate) fn evidence(&self, words: &FastWords) -> Option<Evidence> {
        let lease = self.proof.watch.run.lease()?;
        let mut evidence = words.state_words().evidence(lease, words.reference(), words.output());
        evidence.word = self.proof.told_word(|held| ControlWord::from_bits_retain(held).stands_for(lease));
        if evidence.reference == Told::Yes {
            evidence.reference = self.told_reference(words);
        }
        evidence.reference = self.proof.watch.told_by_turning(evidence.reference);
        if let (Told::No(Refusal::Tripped), Some(code)) = (evidence.output, words.word(LFT)) {
            evidence.output = Told::No(Refusal::Fault(code));
        }
        Some(evidence)
    }

    /// What the shaft does, as these words show it. The normal stop of the drive is a ramp (`Stt` is none of its registers).
    pub(crate) fn see_shaft(&mut self, words: &FastWords) {
        let state: StatusWords = words.state_words();
        let (braked, reacted) = (self.proof.watch.shaft.was_braked(), self.proof.has_reacted(state.chart()));
        let shown = state.output(self.command(), words.output(), true, braked, reacted);
        let at = self.registers.snapshot_time();
        self.proof.see(at, shown, words.output());
        self.proof.see_turning(at, state.turning(), words.output());
    }
}
