//! The lease, explored to the end: what one side gives, loses, withdraws and reads, what others write meanwhile, and what the drive holds.
//! A drive takes what is written in the order in which it was sent; a word may be on its way while it is read.

use drive_core::{Direction, Evidence, Lease, OwnRun, RunWord, Told as Part, Verdict};

use super::{Held, Model, names};

/// As it is explored.
pub(crate) const MODEL: Model = Model {
    name: "lease",
    part: "model of the lease",
    against_plants: "model of the lease, against planted defects",
    settings: &["Drive"],
    steps: || names(&Step::ALL),
    lives: |_, steps, defect| {
        let mut world = World::new(defect.map(|defect| DEFECTS[defect]));
        steps.iter().try_for_each(|step| world.take(Step::ALL[*step]))
    },
    defects: || names(&DEFECTS),
    lines: false,
};

/// Run commands of DRIVECOM (BBV51701 p. 20): forward and reverse of this side, and one that only somebody else gives.
const FORWARD: u16 = 0x000F;
const REVERSE: u16 = 0x080F;
const ANOTHERS: u16 = 0x100F;
/// A shutdown, which this side sends as its stop; what another stop and a power cycle leave.
const STOP: u16 = 0x0006;
const NOTHING: u16 = 0x0000;

/// One step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// A run forward is given, taken and confirmed.
    Run,
    /// One in reverse.
    Reverse,
    /// A run is given and refused: it was not carried out.
    RunDenied,
    /// A run is taken, and its confirmation is lost.
    RunUnanswered,
    /// A run is on its way when its time is over.
    RunLate,
    /// A stop is taken and confirmed.
    Stop,
    /// A stop is lost.
    StopLost,
    /// A stop is on its way when its time is over.
    StopLate,
    /// What is on its way arrives.
    Arrives,
    /// The drive is read.
    Read,
    /// The line is lost: what was read proves nothing any more.
    Lost,
    /// Somebody else gives a run command.
    AnotherRuns,
    /// Somebody else stops it, or its supply goes and comes back.
    AnotherStops,
}

impl Step {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::Run,
        Self::Reverse,
        Self::RunDenied,
        Self::RunUnanswered,
        Self::RunLate,
        Self::Stop,
        Self::StopLost,
        Self::StopLate,
        Self::Arrives,
        Self::Read,
        Self::Lost,
        Self::AnotherRuns,
        Self::AnotherStops,
    ];
}

/// A wrong way of keeping it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Defect {
    LostTakenForDenied,
    DeniedTakenForLost,
    LostLineEndsIt,
    StopSentEndsIt,
    LateIsNeverExpected,
    AnyRunIsOurs,
    OldReadingProves,
    WrittenIsInForce,
    NothingEndsIt,
    DeniedEndsTheOneBefore,
}

const DEFECTS: [Defect; 10] = [
    Defect::LostTakenForDenied,
    Defect::DeniedTakenForLost,
    Defect::LostLineEndsIt,
    Defect::StopSentEndsIt,
    Defect::LateIsNeverExpected,
    Defect::AnyRunIsOurs,
    Defect::OldReadingProves,
    Defect::WrittenIsInForce,
    Defect::NothingEndsIt,
    Defect::DeniedEndsTheOneBefore,
];

struct World {
    own: OwnRun,
    defect: Option<Defect>,
    /// What the drive holds, and whether this side has put it there.
    holds: u16,
    is_ours: bool,
    on_its_way: Option<u16>,
    /// The last run of this side that the drive cannot have refused.
    given: Vec<u16>,
}

impl World {
    const fn new(defect: Option<Defect>) -> Self {
        Self {
            own: OwnRun::new(),
            defect,
            holds: NOTHING,
            is_ours: false,
            on_its_way: None,
            given: Vec::new(),
        }
    }

    fn has(&self, defect: Defect) -> bool {
        self.defect == Some(defect)
    }

    fn takes(&mut self, word: u16) {
        (self.holds, self.is_ours) = (word, true);
    }

    /// What was sent before arrives before.
    fn sends(&mut self, word: u16) {
        if let Some(before) = self.on_its_way.take() {
            self.takes(before);
        }
        self.own.sends(word);
    }

    fn gives(&mut self, word: u16) {
        let direction = if word == REVERSE { Direction::Reverse } else { Direction::Forward };
        self.own.give(Lease::new(direction, word));
        self.sends(word);
    }

    fn take(&mut self, step: Step) -> Held {
        match step {
            Step::Run | Step::Reverse => {
                let word = if step == Step::Run { FORWARD } else { REVERSE };
                self.gives(word);
                self.takes(word);
                self.own.was_written();
                self.given.push(word);
            }
            Step::RunDenied => {
                self.gives(FORWARD);
                if !self.has(Defect::DeniedTakenForLost) {
                    self.own.was_not_written();
                }
                if self.has(Defect::DeniedEndsTheOneBefore) {
                    self.own.end();
                }
            }
            Step::RunUnanswered => {
                self.gives(FORWARD);
                self.takes(FORWARD);
                self.given.push(FORWARD);
                if self.has(Defect::LostTakenForDenied) {
                    self.own.was_not_written();
                }
            }
            Step::RunLate => {
                self.gives(FORWARD);
                // Where the same word of ours stands already nothing tells whether this one has come.
                let stands = self.is_ours && self.holds == FORWARD;
                self.on_its_way = (!stands).then_some(FORWARD);
                self.given.push(FORWARD);
            }
            Step::Stop | Step::StopLost | Step::StopLate => {
                self.sends(STOP);
                if self.has(Defect::StopSentEndsIt) {
                    self.own.end();
                }
                match step {
                    Step::Stop => self.takes(STOP),
                    Step::StopLate => self.on_its_way = Some(STOP),
                    _ => {}
                }
            }
            Step::Arrives => {
                if let Some(word) = self.on_its_way.take() {
                    self.takes(word);
                }
            }
            Step::Read => self.read()?,
            Step::Lost => {
                self.own.unread();
                if self.has(Defect::LostLineEndsIt) {
                    self.own.end();
                }
            }
            Step::AnotherRuns => (self.holds, self.is_ours) = (ANOTHERS, false),
            Step::AnotherStops => (self.holds, self.is_ours) = (NOTHING, false),
        }
        let ours_stands = self.is_ours && is_run(self.holds);
        if ours_stands && self.own.lease().is_none() {
            return Err("a run command of ours that stands in the drive has a lease");
        }
        match self.own.lease() {
            Some(lease) if !self.given.contains(&lease.word) => {
                Err("nobody has a lease of what was never written")
            }
            _ => Ok(()),
        }
    }

    fn read(&mut self) -> Held {
        // The drive follows whatever run command it holds.
        let lease = self.own.lease();
        if !self.has(Defect::OldReadingProves) || self.own.held().is_none() {
            self.own.reads(self.holds);
        }
        let word = match self.own.word(is_run) {
            RunWord::Another if self.has(Defect::AnyRunIsOurs) => RunWord::Stands,
            _ if self.has(Defect::WrittenIsInForce) && self.own.has_arrived() => RunWord::Stands,
            word => word,
        };
        let output =
            if is_run(self.holds) || self.has(Defect::WrittenIsInForce) { Part::Yes } else { Part::NotTold };
        let evidence = Evidence { word, command: Part::Yes, output, reference: Part::Yes };
        let verdict = self.own.judge(&evidence);
        if let Some(lease) = lease.filter(|_| self.has(Defect::NothingEndsIt)) {
            self.own.adopt(lease);
        }
        if let Some(lease) =
            lease.filter(|_| self.has(Defect::LateIsNeverExpected) && word != RunWord::Stands)
        {
            let _ = lease;
            self.own.end();
        }
        let stands = lease.is_some_and(|lease| lease.word == self.holds) && self.is_ours;
        if verdict == Some(Verdict::InForce) && !stands {
            return Err("in force is what stands in the drive, and nothing else");
        }
        if stands && verdict != Some(Verdict::InForce) {
            return Err("what stands in the drive and acts is in force");
        }
        // Once it was seen to stand no more, and nothing is on its way, nobody has a lease of it for ever.
        let is_over = self.on_its_way.is_none() && !stands;
        let was_seen = lease.is_none() || self.own.has_arrived();
        if is_over && was_seen && self.own.lease().is_some() {
            return Err("a lease of what was seen to arrive and to go has ended");
        }
        Ok(())
    }
}

const fn is_run(word: u16) -> bool {
    word & 0x000F == 0x000F
}
