//! What proves that a run command of this side is in force: what each status carries of it, and what takes turns.
//!
//! 0020h, 0021h, 0023h and 002Ch stand in every status: who commands, whose reference it is, which reference is in force,
//! whether the output is off. 0001h and 0002h (another master's words) and n39, n40 and n02 take turns, one exchange behind
//! every tenth status, which is a twentieth more. 0001h and 0002h are looked at within 20 statuses, and 0001h at once where the
//! drive runs, turns or is commanded otherwise; n39 and n40 within 80, n02 too.

use drive_core::{Class, Evidence, Frequency, Ground, Output, Port, Refusal, Status, Told, Verdict};
use tokio::time::Instant;

use crate::{
    Drive3g3ev,
    refusals::{LOCAL_REFERENCE, OTHER_COMMAND, OTHER_REFERENCE, OUTPUT_OFF},
    registers::address,
    status::{is_run, state_word},
    words::{Command, DriveState},
};

/// Statuses of two exchanges each that pay for one more: a twentieth.
pub(crate) const STATUSES_PER_TURN: u16 = 10;
/// What has its turn: n39 and n40, n02, and 0001h with 0002h the other times.
const TURNS: usize = 8;

const NO_SUPPLY: Refusal = Refusal::Overridden {
    by: "a lack of voltage (bit 7 of 002Ch)",
    remedy: "switch the supply on, and start it again if it is to run",
};
const STOPPED: Refusal = Refusal::Overridden {
    by: "a stop at the drive (RUN is off in 0020h and 002Ch)",
    remedy: "see to the panel and the inputs (n06 to n08), and start it again if it is to run",
};
const OTHER_SETPOINT: Refusal = Refusal::Overridden {
    by: "another reference in 0002h than was given",
    remedy: "see who else writes to this drive",
};

/// What was last seen of what proves a run command.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Proof {
    /// 0002h as it was last read.
    reference: Option<u16>,
    /// The reference that the run rests on: as this side gave it, or found it at the start.
    agreed: Option<u16>,
    /// 0001h and 0002h are to be looked at at once.
    urgent: bool,
}

impl Proof {
    /// Of a run command of an earlier run of the program, or after a lost line: what was seen before proves nothing any more.
    pub(crate) fn of_unknown(agreed: Option<u16>) -> Self {
        Self { agreed, urgent: true, ..Self::default() }
    }

    /// What the run rests on.
    pub(crate) const fn agreed(&self) -> Option<u16> {
        self.agreed
    }

    /// A reference that was seen to stand in 0002h by this side's will.
    pub(crate) const fn agree(&mut self, reference: u16) {
        (self.agreed, self.reference) = (Some(reference), Some(reference));
    }

    /// A reference that this side has written, and in whose place another one was read: it is looked at at once, and is not taken for ours.
    pub(crate) const fn expect(&mut self, reference: u16) {
        (self.agreed, self.urgent) = (Some(reference), true);
    }

    /// Nothing is known of the reference any more.
    pub(crate) const fn disagree(&mut self) {
        (self.agreed, self.reference) = (None, None);
    }
}

/// What keeps the motor from being driven by a run command that stands.
pub(crate) fn withheld(status: &Status) -> Option<Refusal> {
    let state = state_word(status);
    let wanted = status.raw(address::REFERENCE_SEEN) != Some(0);
    if status.is_fault() {
        Some(Refusal::Tripped)
    } else if state.contains(DriveState::UNDERVOLTAGE) {
        Some(NO_SUPPLY)
    } else if state.contains(DriveState::OUTPUT_OFF) && wanted {
        Some(OUTPUT_OFF)
    } else {
        (!is_run(status)).then_some(STOPPED)
    }
}

impl<P: Port> Drive3g3ev<P> {
    /// What a reading of the fast set says of the shaft and of the run command.
    pub(crate) fn tell(&mut self, status: &mut Status) {
        let now = Instant::now();
        let counts = status.raw(address::OUTPUT_FREQUENCY);
        // In percent too: what counts is whether it is 0.
        let output = counts.map(|counts| Frequency::from_centihertz(counts.into()));
        let shown = output.map_or(Output::NotKnown, |output| self.output(status, output));
        status.motion = self.watch.see(now, shown, output);
        status.verdict = self.verdict(status);
    }

    /// What these words say of the output. The bus does not tell how the drive stops, and bit 8 of 002Ch is on at rest as
    /// well: an output that is gone was cut unless it was seen to come down by an order.
    fn output(&self, status: &Status, output: Frequency) -> Output {
        let state = state_word(status);
        let runs = is_run(status);
        let at_zero = status.raw(address::REFERENCE_SEEN) == Some(0) && output == Frequency::ZERO;
        let off = state.contains(DriveState::OUTPUT_OFF) && !(runs && at_zero);
        let ordered = self.command.is_none_or(|held| held.contains(Command::RUN));
        if status.is_fault() {
            return Output::Tripped;
        }
        if state.contains(DriveState::UNDERVOLTAGE) {
            return Output::Cut;
        }
        if runs && !off {
            let by_bus = !state.contains(DriveState::LOCAL_RUN);
            return if by_bus && !ordered { Output::Braking(output) } else { Output::Driven };
        }
        if !off && output != Frequency::ZERO {
            return Output::Braking(output);
        }
        if self.watch.shaft.was_braked() { Output::None } else { Output::Cut }
    }

    /// The verdict that a status carries, as far as is known without more exchanges.
    pub(crate) fn verdict(&self, status: &Status) -> Option<Verdict> {
        self.watch.run.verdict(&self.evidence(status))
    }

    /// The verdict of a status, which ends a run command that stands no more.
    pub(crate) fn judge(&mut self, status: &mut Status) {
        let evidence = self.evidence(status);
        status.verdict = self.watch.run.judge(&evidence);
    }

    /// Whether the motor slows down below its reference: RUN stands in a drive that a STOP at its panel brings to rest.
    pub(crate) fn is_brought_down(&self, status: &Status) -> bool {
        // In percent too: both are told in the same unit.
        let of = |at| status.raw(at).map(|counts| Frequency::from_centihertz(counts.into()));
        let both = of(address::OUTPUT_FREQUENCY).zip(of(address::REFERENCE_SEEN));
        is_run(status)
            && both.is_some_and(|(output, reference)| {
                self.watch.is_brought_down(status.direction, output, reference)
            })
    }

    fn evidence(&self, status: &Status) -> Evidence {
        let is_run = |word| Command::from_bits_retain(word).contains(Command::RUN);
        let state = state_word(status);
        let local = state.contains(DriveState::LOCAL_RUN).then_some(OTHER_COMMAND);
        Evidence {
            word: self.watch.run.word(is_run),
            command: Told::unless(local),
            output: if self.is_brought_down(status) { Told::NotTold } else { Told::unless(withheld(status)) },
            reference: self.reference_told(status, state),
        }
    }

    fn reference_told(&self, status: &Status, state: DriveState) -> Told {
        if state.contains(DriveState::LOCAL_REFERENCE) {
            return Told::No(LOCAL_REFERENCE);
        }
        let (Some(agreed), Some(seen)) = (self.proof.agreed, status.raw(address::REFERENCE_SEEN)) else {
            return Told::NotTold;
        };
        if self.proof.reference.is_some_and(|held| held != agreed) {
            return Told::No(OTHER_SETPOINT);
        }
        if !self.is_same(seen, agreed) {
            return Told::No(OTHER_REFERENCE);
        }
        Told::Yes
    }

    /// Looks at what has its turn, behind a status. What cannot be read now, a later turn tells.
    pub(crate) async fn prove(&mut self) {
        if self.watch.run.lease().is_none() {
            return;
        }
        let turn = self.watch.turns.pass(TURNS);
        if self.proof.urgent {
            self.proof.urgent = !self.look_at_orders().await;
            if turn.is_some() {
                self.watch.turns.again();
            }
            return;
        }
        match turn {
            None => {}
            Some(3) => self.look_at_settings(address::N39, &[Ground::Units, Ground::Watchdog]).await,
            Some(7) => self.look_at_settings(address::N02, &[Ground::Inputs]).await,
            Some(_) => drop(self.look_at_orders().await),
        }
    }

    /// 0001h and 0002h.
    async fn look_at_orders(&mut self) -> bool {
        let Ok([command, reference]) = self.registers.at(Class::Status).read_array(address::COMMAND).await
        else {
            return false;
        };
        self.holds(command);
        self.proof.reference = Some(reference);
        self.proof.agreed = self.proof.agreed.or(Some(reference));
        true
    }

    async fn look_at_settings(&mut self, first: u16, grounds: &[Ground]) {
        let count = u16::try_from(grounds.len()).unwrap_or(1);
        let Ok(words) = self.registers.at(Class::Status).read_words(first, count).await else { return };
        for ((register, &ground), word) in (first..).zip(grounds).zip(words) {
            if register == address::N39 {
                self.finds_unit(word);
            } else {
                self.watch.finds(register, word, ground);
            }
        }
    }
}
