//! Reading, and what the words say of the shaft and of the run command of this side.
//!
//! `CTL` to `CUR` stand in a row: one exchange holds all that proves a run command, and nothing has to take turns.

use drive_core::{
    Class, Control, Current, Direction, Evidence, Fault, Faults, Frequency, Measurements, Output, Port,
    RawWord, Refusal, Result, State, Status, Told,
};
use tokio::time::Instant;

use crate::{
    FAULTS, Fan1,
    registers::{ControlWord, ROWS, StatusWord, address as at},
};

/// `CTL` to `CUR`.
const FAST: usize = 6;

pub(crate) const PANEL: Refusal = Refusal::Overridden {
    by: "the panel (bit 4 of STA)",
    remedy: "give command and reference back to the bus at the panel",
};
const OTHER_REFERENCE: Refusal = Refusal::Overridden {
    by: "another reference in REF than was given",
    remedy: "see who else writes to this drive",
};
const NO_SUPPLY: Refusal = Refusal::Overridden {
    by: "a lack of supply (bit 0 of STA)",
    remedy: "switch the supply on, and start it again if it is to run",
};
const HELD_BACK: Refusal = Refusal::Overridden {
    by: "a stop at the drive, or a run command that was not 0 since a fault (bit 1 of STA)",
    remedy: "start it again if it is to run",
};

impl<P: Port> Fan1<P> {
    /// One exchange. What it says of the run command ends nothing: see [`judge`](Self::judge).
    pub(crate) async fn read_status(&mut self, class: Class) -> Result<Status> {
        self.registers.begin_snapshot();
        let words: [u16; FAST] = self.registers.at(class).read_array(at::CONTROL).await?;
        let raw = ROWS.iter().zip(words);
        let raw = raw.map(|(row, value)| RawWord { address: row.address, code: row.code, value }).collect();
        let [control, reference, status, output, fault, current] = words;
        let word = StatusWord::from_bits_retain(status);
        self.watch.run.reads(control);
        let reverse = word.contains(StatusWord::REVERSE);
        let mut status = Status {
            state: state(word, output),
            direction: Some(if reverse { Direction::Reverse } else { Direction::Forward }),
            output_frequency: Some(Frequency::from_decihertz(output)),
            current: Some(Current::from_deciamperes(current.into())),
            reference: remote(word).then(|| Frequency::from_decihertz(reference)),
            at_reference: remote(word).then_some(output == reference),
            fault_code: word.contains(StatusWord::FAULT).then_some(fault).filter(|&code| code != 0),
            control: Some(if remote(word) { Control::Bus } else { Control::Panel }),
            raw,
            at: self.registers.snapshot_time(),
            ..Status::default()
        };
        let shown = self.output(word, status.output_frequency.unwrap_or(Frequency::ZERO));
        status.motion = self.watch.shaft.see(Instant::now(), shown, status.output_frequency);
        status.verdict = self.watch.run.verdict(&self.evidence(&status));
        Ok(status)
    }

    /// The verdict of a status for its own sake, which ends a run command that stands no more.
    pub(crate) fn judge(&mut self, status: &mut Status) {
        if self.watch.run.lease().is_some() {
            // Of a run command of an earlier run of the program nobody knows what it rested on.
            self.agreed = self.agreed.or(status.raw(at::REFERENCE));
        }
        let evidence = self.evidence(status);
        status.verdict = self.watch.run.judge(&evidence);
    }

    /// An output that is gone was cut unless it was seen to come down.
    fn output(&self, word: StatusWord, output: Frequency) -> Output {
        if word.contains(StatusWord::FAULT) || !word.contains(StatusWord::READY) {
            Output::Cut
        } else if word.contains(StatusWord::RUNNING) {
            Output::Driven
        } else if output != Frequency::ZERO {
            Output::Braking(output)
        } else if self.watch.shaft.was_braked() {
            Output::None
        } else {
            Output::Cut
        }
    }

    pub(crate) fn evidence(&self, status: &Status) -> Evidence {
        let is_run = |word| ControlWord::from_bits_retain(word).contains(ControlWord::RUN);
        let panel = (!remote(word(status))).then_some(PANEL);
        let other = (self.agreed != status.raw(at::REFERENCE)).then_some(OTHER_REFERENCE);
        Evidence {
            word: self.watch.run.word(is_run),
            command: Told::unless(panel),
            output: Told::unless(withheld(status)),
            reference: match self.agreed {
                Some(_) => Told::unless(panel.or(other)),
                None => Told::NotTold,
            },
        }
    }

    /// One exchange; a status holds all that the drive measures.
    pub(crate) async fn read_measurements(&mut self) -> Result<Measurements> {
        let Status { at, reference, raw, .. } = self.read_status(Class::Background).await?;
        Ok(Measurements { at, reference: reference.map(Into::into), raw, ..Measurements::default() })
    }

    /// The drive keeps no history.
    pub(crate) async fn read_faults(&mut self) -> Result<Faults> {
        let status = self.read_status(Class::Background).await?;
        let code = status.raw(at::FAULT).filter(|_| status.is_fault());
        Ok(Faults {
            tripped: status.is_fault(),
            present: code.map(|code| Fault::lookup(FAULTS, code)).into_iter().collect(),
            ..Faults::default()
        })
    }
}

/// What keeps the motor from being driven by a run command that stands.
pub(crate) fn withheld(status: &Status) -> Option<Refusal> {
    let word = word(status);
    if word.contains(StatusWord::FAULT) {
        Some(Refusal::Tripped)
    } else if !word.contains(StatusWord::READY) {
        Some(NO_SUPPLY)
    } else {
        (!word.contains(StatusWord::RUNNING)).then_some(HELD_BACK)
    }
}

pub(crate) fn word(status: &Status) -> StatusWord {
    StatusWord::from_bits_retain(status.raw(at::STATUS).unwrap_or(0))
}

pub(crate) const fn remote(word: StatusWord) -> bool {
    word.contains(StatusWord::REMOTE)
}

const fn state(word: StatusWord, output: u16) -> State {
    if word.contains(StatusWord::FAULT) {
        State::Fault
    } else if !word.contains(StatusWord::READY) {
        State::NotReady
    } else if word.contains(StatusWord::RUNNING) {
        State::Running
    } else if output != 0 {
        State::Stopping
    } else {
        State::Ready
    }
}
