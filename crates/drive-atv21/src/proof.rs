//! What proves that a run command of this side is in force: what each status carries of it, and what takes turns.
//!
//! FD01 and FE45 stand in every status. FA00 (another master's word), FE46 and FE02 (the reference in force) and the settings
//! that a run rests on take turns: one more exchange for every ten of the statuses, so every third status has one, and every
//! fifth where the read block is used. Of four turns one is each of FE46's, FE02's and FA00's, so each is looked at within 12
//! statuses (20 with the block); the fourth is that of a setting: each within 120 (200). Where the output moves away from the
//! reference, or does not come nearer to it, FE46 and FE02 are looked at in the next two.

use std::time::Duration;

use drive_core::{
    Class, Evidence, Frequency, Ground, Output, Port, RawWord, Refusal, State, Status, Told, Verdict,
    registers::{Register, access::ReadWrite},
};
use tokio::time::Instant;

use crate::{
    Atv21,
    control::{DECIDE, commanded_by_other, is_falling, not_in_force, source, status_word},
    in_effect::ReadBlock,
    refusals::{OTHER_REFERENCE, ST_OFF},
    registers as map,
    setpoint::{Reference, is_same},
    words::{CommandSource, CommandWord, ReferenceSource, StatusWord},
};

/// Statuses that pay for one exchange more, a tenth of theirs at the most: of four exchanges each, and of two with the block.
pub(crate) const STATUSES_PER_TURN: u16 = 3;
const STATUSES_PER_TURN_WITH_BLOCK: u16 = 5;
/// How far the output may be from the reference, in hundredths of a hertz: slip compensation, a jump frequency.
const NEAR: u16 = 200;
/// How long the output may come no nearer to the reference. The longest ramp, 3200 s to 80 Hz, does 0.25 Hz meanwhile.
const PATIENCE: Duration = Duration::from_secs(10);
/// The settings that take turns: the watchdog, the limit, who commands and what the inputs do.
const SETTINGS: [Register<ReadWrite>; 10] = [
    map::TIME_OUT,
    map::TIME_OUT_REACTION,
    map::UPPER_LIMIT,
    DECIDE[0],
    DECIDE[1],
    map::ALWAYS_FUNCTION,
    map::INPUT_F_FUNCTION,
    map::INPUT_R_FUNCTION,
    map::INPUT_RES_FUNCTION,
    map::INPUT_VIA_FUNCTION,
];

const BRAKED: Refusal = Refusal::Overridden {
    by: "a DC injection that the bus has not ordered (FD01 bit 7)",
    remedy: "see to the input or the setting that holds it",
};
const NO_SUPPLY: Refusal = Refusal::Overridden {
    by: "a main circuit without its voltage (MOFF, FD01 bit 3)",
    remedy: "switch its supply on, and start it again if it is to run",
};
const EMERGENCY: Refusal = Refusal::Overridden {
    by: "an emergency stop (FD01 bit 12)",
    remedy: "see who has given it, and reset it",
};
const NO_STANDBY: Refusal = Refusal::Overridden {
    by: "a stop by the drive itself, at its lower limit or by a lack of supply (FD01 bit 14 is off)",
    remedy: "see to its alarms (FC91)",
};
const STOPPED: Refusal = Refusal::Overridden {
    by: "a stop at the drive (FD01 bits 10 and 13 do not show that it runs)",
    remedy: "see to the keypad and the inputs, and start it again if it is to run",
};
const NOT_FOLLOWED: Refusal = Refusal::Overridden {
    by: "something behind the reference (FD00 comes no nearer to FE02)",
    remedy: "see to the PID control (FA00 bit 5), the lower limit, the jump frequencies and an overload",
};

/// What was last seen of what proves a run command.
#[derive(Debug, Clone, Default)]
pub(crate) struct Proof {
    /// FE46.
    pub(crate) source: Option<ReferenceSource>,
    /// The reference that the run rests on: FA01 or FA13 as this side gave it or found it at the start.
    pub(crate) agreed: Option<Reference>,
    /// What stands for it now: FE02 for FA01, FA13 for itself.
    pub(crate) reference: Option<u16>,
    approach: Approach,
    descent: Descent,
    /// How many of FE46 and FE02 are to be looked at whatever was paid.
    urgent: usize,
}

impl Proof {
    /// For a run command of an earlier run of the program.
    pub(crate) fn of_unknown() -> Self {
        Self { urgent: 2, ..Self::default() }
    }

    /// After a lost line: what was seen before proves nothing any more. What the run rests on stays.
    pub(crate) fn forget(&mut self) {
        (self.source, self.reference) = (None, None);
        (self.approach, self.urgent) = (Approach::default(), 2);
    }

    /// A reference that was seen to be in force.
    pub(crate) fn agree(&mut self, reference: Reference, shown: u16) {
        (self.agreed, self.reference) = (Some(reference), Some(shown));
        (self.source, self.approach) = (Some(ReferenceSource::Serial), Approach::default());
    }

    /// A reference that this side has written, and in whose place another one was read: it is looked at at once, and is not taken for ours.
    pub(crate) const fn expect(&mut self, reference: Reference) {
        (self.agreed, self.urgent) = (Some(reference), 2);
    }

    /// Nothing is known of the reference any more.
    pub(crate) fn disagree(&mut self) {
        (self.agreed, self.reference, self.approach) = (None, None, Approach::default());
    }
}

/// Whether the output comes nearer to the reference.
#[derive(Debug, Clone, Copy, Default)]
struct Approach {
    nearest: Option<(u16, Instant)>,
    stuck: bool,
}

impl Approach {
    /// What a status shows at `now`. True: it moves away, or has come no nearer for too long.
    fn see(&mut self, now: Instant, output: u16, reference: u16) -> bool {
        let distance = output.abs_diff(reference);
        match self.nearest {
            _ if distance <= NEAR => *self = Self { nearest: Some((distance, now)), stuck: false },
            Some((nearest, since)) if distance >= nearest => {
                if distance > nearest.saturating_add(NEAR) {
                    self.nearest = Some((distance, now));
                    return true;
                }
                let was_stuck = self.stuck;
                self.stuck = now.saturating_duration_since(since) >= PATIENCE;
                return self.stuck && !was_stuck;
            }
            _ => *self = Self { nearest: Some((distance, now)), stuck: false },
        }
        false
    }
}

/// Without a lower output for so long a motor is not coming down: the longest ramp that the drive has lowers FD00 twice in it.
const SINKS: Duration = Duration::from_secs(1);

/// Whether the output sinks, from look to look.
#[derive(Debug, Clone, Copy, Default)]
struct Descent {
    last: Option<Frequency>,
    sank: Option<Instant>,
}

impl Descent {
    fn see(&mut self, now: Instant, output: Option<Frequency>) -> bool {
        if is_falling(self.last, output) {
            self.sank = Some(now);
        } else if is_falling(output, self.last) {
            self.sank = None;
        }
        self.last = output;
        self.sank.is_some_and(|sank| now.saturating_duration_since(sank) < SINKS)
    }
}

/// What FD01 says of the output, for the shaft.
fn output(word: StatusWord, frequency: Option<Frequency>, was_braked: bool) -> Output {
    let cut = StatusWord::FREEWHEEL | StatusWord::UNDERVOLTAGE | StatusWord::EMERGENCY_STOP;
    let turns = frequency.is_some_and(|frequency| frequency != Frequency::ZERO);
    // A trip may stop along a ramp (F603 = 1), or cut the output of a motor that was coming down.
    if word.contains(StatusWord::TRIPPED) {
        return if was_braked { Output::Gone } else { Output::Tripped };
    }
    if word.intersects(cut) || !word.contains(StatusWord::STANDBY) {
        return Output::Cut;
    }
    if word.contains(StatusWord::DC_BRAKING) {
        return Output::Injection;
    }
    match frequency {
        _ if word.contains(StatusWord::RUN) && (turns || word.contains(StatusWord::STANDBY_RUN)) => {
            Output::Driven
        }
        _ if word.contains(StatusWord::RUN) => Output::NotKnown,
        Some(frequency) if turns => Output::Braking(frequency),
        Some(_) => Output::None,
        None => Output::NotKnown,
    }
}

/// What keeps the motor from being driven by a run command that stands.
pub(crate) fn withheld(word: StatusWord) -> Option<Refusal> {
    [
        (StatusWord::TRIPPED, Refusal::Tripped),
        (StatusWord::EMERGENCY_STOP, EMERGENCY),
        (StatusWord::UNDERVOLTAGE, NO_SUPPLY),
        (StatusWord::FREEWHEEL, ST_OFF),
        (StatusWord::DC_BRAKING, BRAKED),
    ]
    .into_iter()
    .find_map(|(bit, refusal)| word.contains(bit).then_some(refusal))
    .or_else(|| (!word.contains(StatusWord::STANDBY)).then_some(NO_STANDBY))
    .or_else(|| (!word.contains(StatusWord::RUN | StatusWord::STANDBY_RUN)).then_some(STOPPED))
}

impl<P: Port> Atv21<P> {
    /// What a reading of the fast set says of the shaft and of the run command.
    pub(crate) fn tell(&mut self, status: &mut Status) {
        let (now, was_braked) = (Instant::now(), self.watch.shaft.was_braked());
        let mut shown = output(status_word(status), status.output_frequency, was_braked);
        let sinks = self.proof.descent.see(now, status.output_frequency);
        // Whether "run" in FD01 ends with the order or with the motion the manual leaves open.
        let is_withdrawn = self.held.is_some_and(|held| !held.contains(CommandWord::RUN));
        if let (Output::Driven, Some(frequency)) = (shown, status.output_frequency)
            && sinks
            && is_withdrawn
            && commanded_by_other(status).is_none()
        {
            shown = Output::Braking(frequency);
            if status.state == State::Running {
                status.state = State::Stopping;
            }
        }
        status.motion = self.watch.see(now, shown, status.output_frequency);
        status.verdict = self.verdict(status);
    }

    /// What is known of the run command with this status.
    fn evidence(&self, status: &Status) -> Evidence {
        let Some(lease) = self.watch.run.lease() else { return Evidence::default() };
        let run = CommandWord::from_bits_retain(lease.word);
        let is_run = |word| CommandWord::from_bits_retain(word).contains(CommandWord::RUN);
        Evidence {
            word: self.watch.run.word(is_run),
            command: Told::unless(commanded_by_other(status)),
            output: Told::unless(withheld(status_word(status))),
            reference: self.reference_told(run),
        }
    }

    fn reference_told(&self, run: CommandWord) -> Told {
        let Some(source) = self.proof.source else { return Told::NotTold };
        if let Some(other) = not_in_force(run, source) {
            return Told::No(other);
        }
        match (self.proof.agreed, self.proof.reference) {
            _ if run.preset_speed() != 0 => Told::Yes,
            (Some((_, agreed)), Some(shown)) if !is_same(agreed, shown) => Told::No(OTHER_REFERENCE),
            (Some(_), Some(_)) if self.proof.approach.stuck => Told::No(NOT_FOLLOWED),
            (Some(_), Some(_)) => Told::Yes,
            _ => Told::NotTold,
        }
    }

    /// Looks at what has its turn, behind a status.
    pub(crate) async fn prove(&mut self, status: &mut Status) {
        if self.watch.is_kept() {
            let by_block = matches!(self.read_block, ReadBlock::Shown(_));
            let every = if by_block { STATUSES_PER_TURN_WITH_BLOCK } else { STATUSES_PER_TURN };
            self.watch.turns.set_every(every);
            self.watch_approach(status);
            self.look_in_turn(status).await;
        }
    }

    /// The verdict of a status, which ends a run command that stands no more.
    pub(crate) fn judge(&mut self, status: &mut Status) {
        let evidence = self.evidence(status);
        status.verdict = self.watch.run.judge(&evidence);
    }

    /// The verdict of a status that is read for a command.
    pub(crate) fn verdict(&self, status: &Status) -> Option<Verdict> {
        self.watch.run.verdict(&self.evidence(status))
    }

    fn watch_approach(&mut self, status: &Status) {
        let runs = status_word(status).contains(StatusWord::RUN | StatusWord::STANDBY_RUN);
        let by_bus = source(status) == CommandSource::Serial;
        // A motor that is turned round moves away from its reference first.
        let directed = self.watch.run.lease().is_some_and(|lease| status.direction == Some(lease.direction));
        let output = status.raw(map::OUTPUT_FREQUENCY.address());
        let reference = self.proof.agreed.filter(|(register, _)| register.address() == FREQUENCY);
        match (output, reference) {
            (Some(output), Some((_, reference))) if runs && by_bus && directed => {
                if self.proof.approach.see(Instant::now(), output, reference) {
                    self.proof.urgent = 2;
                }
            }
            _ => self.proof.approach = Approach::default(),
        }
    }

    /// Reads what has its turn, if one is paid or it is urgent. What cannot be read now, a later turn tells.
    async fn look_in_turn(&mut self, status: &mut Status) {
        let leased = self.watch.run.lease().is_some();
        let things = if leased { 4 * SETTINGS.len() } else { SETTINGS.len() };
        let turn = self.watch.turns.pass(things);
        if leased && self.proof.urgent > 0 {
            let seen = match self.proof.urgent {
                2 => self.look_at_source(status).await,
                _ => self.look_at_shown(status).await,
            };
            self.proof.urgent -= usize::from(seen);
            if turn.is_some() {
                self.watch.turns.again();
            }
            return;
        }
        match turn {
            None => {}
            Some(setting) if !leased => self.look_at_setting(setting, status).await,
            Some(turn) => match turn % 4 {
                0 => drop(self.look_at_source(status).await),
                1 => drop(self.look_at_shown(status).await),
                2 => {
                    if self.command_word(Class::Status).await.is_err() {
                        self.watch.run.unread();
                    }
                }
                _ => self.look_at_setting(turn / 4, status).await,
            },
        }
    }

    async fn look_at_source(&mut self, status: &mut Status) -> bool {
        let Some(word) = self.look(map::REFERENCE_SOURCE.address(), "FE46", status).await else {
            return false;
        };
        self.proof.source = Some(word.into());
        true
    }

    /// FE02, FA13 for a run by it; of a run whose reference is not known, as after a restart of the program, FA01 or FA13.
    async fn look_at_shown(&mut self, status: &mut Status) -> bool {
        let Some((register, _)) = self.proof.agreed else {
            return self.adopt_reference(status).await;
        };
        let (address, code) = if register.address() == FREQUENCY {
            (map::REFERENCE_BEFORE_RAMP.address(), "FE02")
        } else {
            (register.address(), register.row().code)
        };
        let Some(word) = self.look(address, code, status).await else { return false };
        if register.address() == FREQUENCY {
            status.reference = Some(Frequency::from_centihertz(word.into()));
        }
        if register.address() != FREQUENCY && self.proof.agreed.is_some_and(|(_, agreed)| agreed == 0) {
            self.proof.agreed = Some((register, word));
        }
        self.proof.reference = Some(word);
        true
    }

    async fn adopt_reference(&mut self, status: &mut Status) -> bool {
        let frequency = map::FREQUENCY_REFERENCE;
        let Some(word) = self.look(frequency.address(), "FA01", status).await else { return false };
        // One that is run by FA13 has 0 here: its frequency is not compared.
        let reference = if word == 0 { (map::SPEED_REFERENCE, word) } else { (frequency, word) };
        self.proof.agreed = Some(reference);
        false
    }

    async fn look_at_setting(&mut self, index: usize, status: &mut Status) {
        let Some(register) = SETTINGS.get(index).copied() else { return };
        let Some(word) = self.look(register.address(), register.row().code, status).await else { return };
        let ground = match index {
            0 | 1 => Ground::Watchdog,
            2 => Ground::Limits,
            _ => Ground::Inputs,
        };
        self.watch.finds(register.address(), word, ground);
        match (index, &mut self.modes) {
            (2, _) => self.upper_limit = Some(Frequency::from_centihertz(word.into())),
            (3, Some([command, _])) => *command = Some(word),
            (4, Some([_, reference])) => *reference = Some(word),
            _ => {}
        }
    }

    /// One register beside the fast set; its word is kept among the status's.
    async fn look(&mut self, address: u16, code: &'static str, status: &mut Status) -> Option<u16> {
        let mut calls = self.registers.at(Class::Status);
        let value = self.absent.word(&mut calls, address).await.ok()??;
        status.raw.push(RawWord { address, code, value });
        Some(value)
    }
}

const FREQUENCY: u16 = map::FREQUENCY_REFERENCE.address();
