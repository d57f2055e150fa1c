//! Commands carried through the chart: write a step, read the status, go on from what it says.

use async_trait::async_trait;

use super::{
    chart::{ChartState, DISABLE_VOLTAGE, ENABLE_OPERATION, FAULT_RESET},
    climb::{Climb, Next},
    words::ControlWord,
};
use crate::{
    address::SlaveAddress,
    confirm::Confirming,
    error::{Error, ErrorKind, Result},
    lease::Lease,
    own_run::OwnRun,
    port::{Class, Effect},
    refusal::Refusal,
    setpoint::{Command, Direction, StopMode},
    state::{Control, State},
    status::Status,
    stopped::Stopped,
    units::Frequency,
    withdrawn::Withdrawn,
};

/// After how many readings that do not show a stop it is written again: half a second apart, once the readings have found
/// their longest pause.
const READS_PER_STOP: usize = 5;

/// Exception 05: the drive has taken the request and will be long over it.
const ACKNOWLEDGED: u8 = 0x05;
/// Exception 06: the drive is busy and has not taken it.
const BUSY: u8 = 0x06;

/// How a run command shows in a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunShown {
    /// It is in force.
    InForce,
    /// It is in force, and the motor still turns in the other direction: it comes down first.
    TurningRound,
    /// It is not in force, or not yet.
    NotYet,
}

/// What is written to stop, and how the motor is stopped by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StopWord {
    /// The control word.
    pub word: u16,
    /// The mode.
    pub mode: StopMode,
    /// Why it is another mode than the one that was asked for.
    pub instead: Option<&'static str>,
}

/// A drive that follows the chart, as the sequences see it.
///
/// # For implementors
/// The status that [`read_status`](Self::read_status) returns **must** hold the status word, at the address
/// [`status_register`](Self::status_register), among its raw words. [`write_control`](Self::write_control) writes the control
/// word to the drive's `CMD` and nothing else; bits that have another meaning in this drive it keeps as they are.
#[async_trait]
pub trait Drivecom: Send {
    /// The address of the status word in the family's map.
    const ETA: u16;

    /// The address of the status word in [`Status::raw`]: the family's, unless this drive was told another.
    fn status_register(&self) -> u16 {
        Self::ETA
    }

    /// The slave, for errors.
    fn address(&self) -> SlaveAddress;

    /// The run command of this side. The sequences here keep it: given before it is written, ended when a stop or a reset in
    /// its place was seen.
    fn own_run(&mut self) -> &mut OwnRun;

    /// The control word as [`write_control`](Self::write_control) writes it, with the bits that have another meaning.
    fn as_written(&self, word: u16) -> u16 {
        word
    }

    /// Reads the fast set in this class.
    async fn read_status(&mut self, class: Class) -> Result<Status>;

    /// Writes the control word in this class.
    async fn write_control(&mut self, class: Class, word: u16, effect: Effect) -> Result<()>;

    /// A word that commands the motor was written, or may be: see [`Registers::owe_judgement`](crate::Registers::owe_judgement).
    fn owes_judgement(&mut self);

    /// Why this drive is not to be started, from a fresh status: local control, a forbidden direction, settings. That
    /// it has not tripped, is in a known state and shows no output in a quick stop is checked apart. May read more of the
    /// drive.
    async fn refuses_start(&mut self, direction: Direction, status: &Status) -> Result<Option<Refusal>>;

    /// Whether the run command `word` is in force, in the state operation enabled: the drive holds it, the bus is its
    /// active source of commands and of the reference, and the motor is driven that way. May read more of the drive, and
    /// add to the status what it read.
    async fn shows_run(&mut self, word: u16, status: &mut Status) -> Result<RunShown>;

    /// What keeps a run command that was given from being in force, where the drive tells it. May read more of the drive.
    async fn prevents_run(&mut self, status: &Status) -> Option<Refusal>;

    /// Why the present fault is not to be reset: a run command of somebody else that the reset would let act. May read more
    /// of the drive.
    async fn refuses_reset(&mut self, status: &Status) -> Result<Option<Refusal>> {
        let _ = status;
        Ok(None)
    }

    /// The control word that the drive holds, read as a command.
    async fn read_control(&mut self) -> Result<u16>;

    /// Whether a control word that the drive holds is a run command.
    fn is_run(&self, held: u16) -> bool {
        ControlWord::from_bits_retain(held).is_run()
    }

    /// The word that ends the run command which the drive holds, and nothing else; or why there is none.
    fn withdrawal(&self, held: u16, status: &Status) -> Result<u16, &'static str>;

    /// Writes it: the word as it stands.
    async fn write_withdrawal(&mut self, word: u16) -> Result<()> {
        self.write_control(Class::Command, word, Effect::Level).await
    }

    /// Who commanded the drive when it was last read, where it tells that.
    fn last_control(&self) -> Option<Control> {
        None
    }

    /// What stops this drive, from what is known of it: nothing is read.
    fn stop_word(&self, mode: StopMode) -> StopWord;

    /// Reads what the stop word depends on, where that was not known, once a stop is on the wire that does not show or has
    /// left the drive to somebody else. Whether it has to be written again, with other bits around it.
    async fn corrects_stop(&mut self) -> bool {
        false
    }

    /// Whether the status shows that no run command acts after this stop.
    fn shows_stop(&self, stop: &StopWord, status: &Status) -> bool;

    /// Why no word of the bus stops this motor, where the status shows that for certain.
    fn defies_stop(&self, status: &Status) -> Option<Refusal>;
}

/// The state of the chart in a status; `None` for a pattern that the manual's table does not have.
fn chart_of(eta: u16, status: &Status) -> Option<ChartState> {
    status.raw(eta).and_then(ChartState::of)
}

/// Climbs to operation enabled and gives the run command `word`, which must hold the bits of
/// [`ENABLE_OPERATION`]; the direction and the family's other bits stand above them.
///
/// Every word is written once, and a drive that lags behind is waited for. A drive that falls back, or skips a rung, was
/// commanded by somebody else, at its panel or from another master: the start ends there. A stop whose word is one of the
/// ladder's own cannot be told from it. A word that the drive is too busy to take is given again.
///
/// A running motor that is to turn the other way comes down first: the status shows the new direction, or, after the time
/// in which a command has to show, the old one in which it still turns.
///
/// # Errors
/// [`Error::Refused`] before the run command is written: nothing starts then. [`Error::NotConfirmed`] when the drive trips
/// after it, when somebody else has commanded the drive, or when the run command is not in force within
/// [`CONFIRMED_WITHIN`](crate::CONFIRMED_WITHIN); one that was written stands in the drive then.
pub async fn start<D: Drivecom>(drive: &mut D, direction: Direction, word: u16) -> Result<Status> {
    const SOMEBODY: Refusal = Refusal::Overridden {
        by: "a command of somebody else, at the drive, its inputs or another master,",
        remedy: "see who has commanded it, and start again",
    };
    let command = Command::Start(direction);
    let slave = drive.address();
    let eta = drive.status_register();
    let refused = |reason| Error::Refused { slave, command, reason };

    let mut status = drive.read_status(Class::Command).await?;
    let mut climb = may_start(drive, direction, &status).await?.map_err(refused)?;
    let mut confirming = Confirming::begin();
    let mut given = false;
    let mut shown = RunShown::NotYet;
    let because = loop {
        let waits = match chart_of(eta, &status).map(|state| climb.next(state)) {
            Some(Next::Write(step)) => {
                let run = step == ENABLE_OPERATION;
                given |= run;
                let step = if run { word } else { step };
                if run {
                    let word = drive.as_written(word);
                    drive.own_run().give(Lease::new(direction, word));
                }
                let written = drive.write_control(Class::Command, step, Effect::Level).await;
                if run {
                    keep_lease(drive.own_run(), &written);
                    drive.owes_judgement();
                }
                match written {
                    Err(error) if exception(&error) == Some(BUSY) => {
                        climb.forget_written();
                        true
                    }
                    Err(error) if exception(&error) != Some(ACKNOWLEDGED) => return Err(error),
                    _ => {
                        confirming = Confirming::begin();
                        false
                    }
                }
            }
            Some(Next::Wait) => true,
            Some(Next::Arrived) => {
                shown = drive.shows_run(word, &mut status).await.map_err(Error::after_write)?;
                if shown == RunShown::InForce {
                    return Ok(status);
                }
                true
            }
            Some(Next::Faulted) if !given => return Err(refused(tripped(&status))),
            Some(Next::Faulted) => break Some(tripped(&status)),
            Some(Next::Over) => break Some(SOMEBODY),
            None => break None,
        };
        if waits && !confirming.again().await {
            if shown == RunShown::TurningRound {
                return Ok(status);
            }
            break drive.prevents_run(&status).await;
        }
        let read = drive.read_status(Class::Command).await;
        // Once the run command was written, an exchange that fails says nothing of the motor.
        status = read.map_err(|error| if given { error.after_write() } else { error })?;
    };
    Err(Error::NotConfirmed { slave, command, status: Box::new(status), because })
}

/// What became of the write of a run command, for its lease. A drive that has only acknowledged it may take it later.
fn keep_lease(own: &mut OwnRun, written: &Result<()>) {
    match written {
        Ok(()) => own.was_written(),
        Err(error) if exception(error) == Some(ACKNOWLEDGED) => {}
        Err(error) if matches!(error.kind(), ErrorKind::Exception | ErrorKind::NotSent) => {
            own.was_not_written();
        }
        Err(_) => {}
    }
}

/// A climb from where the drive stands, or why there is none.
async fn may_start<D: Drivecom>(
    drive: &mut D,
    direction: Direction,
    status: &Status,
) -> Result<Result<Climb, Refusal>> {
    let state = chart_of(drive.status_register(), status);
    // What the chart forbids is told before settings are read: a tripped drive says that it has tripped.
    let climb = match state {
        None => return Ok(Err(Refusal::State(State::Unknown))),
        Some(state) if state.is_fault() => return Ok(Err(tripped(status))),
        Some(state) => Climb::from(state),
    };
    let Some(climb) = climb else { return Ok(Err(Refusal::State(State::NotReady))) };
    if let Some(reason) = drive.refuses_start(direction, status).await? {
        return Ok(Err(reason));
    }
    // The way out of a quick stop disables the voltage: a motor that still turns, or of which nothing says that it does
    // not, would coast out of its fastest stop.
    if state == Some(ChartState::QuickStopActive) && status.output_frequency != Some(Frequency::ZERO) {
        return Ok(Err(Refusal::State(State::QuickStop)));
    }
    Ok(Ok(climb))
}

/// Writes the stop word, whatever the drive's state, before anything is read; then reads, as a command, until the drive
/// shows it, and writes it again meanwhile, half a second apart: a run command that the way to the drive kept back may have
/// come after it.
///
/// # Errors
/// [`Error::NotConfirmed`] when it does not show within [`CONFIRMED_WITHIN`](crate::CONFIRMED_WITHIN), and at once where
/// the status shows that no word of the bus stops this motor. What the last write ended in, where that was no confirmation.
pub async fn stop<D: Drivecom>(drive: &mut D, mode: StopMode) -> Result<Stopped> {
    let stop = drive.stop_word(mode);
    let before = drive.last_control().filter(|&control| control != Control::Bus);
    let mut written = write_stop(drive, &stop).await?;
    drive.owes_judgement();
    let mut corrected = false;
    let mut confirming = Confirming::begin();
    let mut reads = 0;
    loop {
        let status = drive.read_status(Class::Command).await.map_err(Error::after_write)?;
        reads += 1;
        // A motor that stands at a setpoint of zero shows a stop that never arrived.
        let shown = written.is_ok() && drive.shows_stop(&stop, &status);
        let elsewhere = status.control.is_some_and(|control| control != Control::Bus);
        if !corrected && (elsewhere || !shown) {
            corrected = true;
            if drive.corrects_stop().await {
                written = write_stop(drive, &stop).await.map_err(Error::after_write)?;
                continue;
            }
        }
        if shown {
            drive.own_run().end();
            let taken_from = before.filter(|_| status.control == Some(Control::Bus));
            return Ok(Stopped { taken_from, ..stopped(stop, status) });
        }
        let defies = drive.defies_stop(&status);
        if defies.is_some() || !confirming.again().await {
            written?;
            let somebody = status.control.filter(|&control| control != Control::Bus);
            let because = defies.or(somebody.map(Refusal::NotInControl));
            let (slave, command) = (drive.address(), Command::Stop(mode));
            return Err(Error::NotConfirmed { slave, command, status: Box::new(status), because });
        }
        // One that did not arrive is written again sooner, for as long as that costs the line little.
        if reads % READS_PER_STOP == 0 || written.is_err() && reads < READS_PER_STOP {
            written = write_stop(drive, &stop).await.map_err(Error::after_write)?;
        }
    }
}

/// Writes a stop. What says that it did not arrive, or leaves it open, is for the reading behind it to judge; only what kept
/// it from being sent ends the stop.
async fn write_stop<D: Drivecom>(drive: &mut D, stop: &StopWord) -> Result<Result<()>> {
    match drive.write_control(Class::Stop, stop.word, Effect::Level).await {
        Err(error) if exception(&error) == Some(ACKNOWLEDGED) => Ok(Ok(())),
        Err(error) if error.kind() == ErrorKind::NotSent => Err(error),
        written => Ok(written),
    }
}

/// A quick stop that is under way is not turned into a slower one.
fn stopped(StopWord { mode, instead, .. }: StopWord, status: Status) -> Stopped {
    match mode {
        StopMode::Ramp | StopMode::DcInjection if status.state == State::QuickStop => {
            let instead = Some("a quick stop is under way, which no other stop replaces");
            Stopped { instead, ..Stopped::by(StopMode::Fast, status) }
        }
        _ => Stopped { instead, ..Stopped::by(mode, status) },
    }
}

/// Ends the run command of this side, and nothing else. A word whose answer was lost may still be on its way: the withdrawal goes
/// out behind it.
///
/// # Errors
/// [`Error::Unsupported`] where no word does only that; [`Error::NotConfirmed`] when the run command still stands.
pub async fn withdraw<D: Drivecom>(drive: &mut D) -> Result<Withdrawn> {
    let held = drive.read_control().await?;
    let status = drive.read_status(Class::Command).await?;
    let may_come = drive.own_run().lease().is_some() && !drive.own_run().has_arrived();
    if !drive.is_run(held) && !may_come {
        drive.own_run().end();
        return Ok(Withdrawn::Nothing(Status { verdict: None, ..status }));
    }
    let unsupported = |reason| Error::Unsupported { what: "withdrawal of the run command", reason };
    let word = drive.withdrawal(held, &status).map_err(unsupported)?;
    drive.write_withdrawal(word).await?;
    drive.owes_judgement();
    let held = drive.read_control().await.map_err(Error::after_write)?;
    let status = drive.read_status(Class::Command).await.map_err(Error::after_write)?;
    if drive.is_run(held) {
        let (slave, command) = (drive.address(), Command::Withdraw);
        return Err(Error::NotConfirmed { slave, command, status: Box::new(status), because: None });
    }
    drive.own_run().end();
    Ok(Withdrawn::Ended(Status { verdict: None, ..status }))
}

/// One rising edge of the fault reset, cleared at once. A drive without a fault is left alone. Both words disable the
/// voltage, so nothing of this side starts by a reset; and so none is sent to a drive that may still drive its motor.
///
/// # Errors
/// [`Error::Refused`] while the drive still does what the fault asks, in a state that its manual does not explain, and where
/// a run command of somebody else would act then;
/// [`Error::NotConfirmed`] when the drive still shows a fault after [`CONFIRMED_WITHIN`](crate::CONFIRMED_WITHIN).
pub async fn reset_fault<D: Drivecom>(drive: &mut D) -> Result<Status> {
    let eta = drive.status_register();
    let healthy = |status: &Status| chart_of(eta, status).is_some_and(|state| !state.is_fault());
    let command = Command::ResetFaults;
    let mut status = drive.read_status(Class::Command).await?;
    let refusal = match chart_of(eta, &status) {
        Some(ChartState::Fault) => drive.refuses_reset(&status).await?,
        Some(ChartState::FaultReactionActive) => Some(Refusal::State(State::FaultReaction)),
        Some(_) => return Ok(status),
        None => Some(Refusal::State(State::Unknown)),
    };
    if let Some(reason) = refusal {
        return Err(Error::Refused { slave: drive.address(), command, reason });
    }
    let edge = drive.write_control(Class::Command, FAULT_RESET, Effect::Edge).await;
    // An edge that may have arrived is cleared as well, so that the next one rises; the status tells the outcome.
    if let Err(error) = edge
        && error.kind() != ErrorKind::OutcomeUnknown
        && exception(&error) != Some(ACKNOWLEDGED)
    {
        return Err(error);
    }
    drive.write_control(Class::Command, DISABLE_VOLTAGE, Effect::Level).await.map_err(Error::after_write)?;
    drive.owes_judgement();
    let mut confirming = Confirming::begin();
    loop {
        status = drive.read_status(Class::Command).await.map_err(Error::after_write)?;
        if healthy(&status) {
            drive.own_run().end();
            return Ok(status);
        }
        if !confirming.again().await {
            let because = Some(tripped(&status));
            return Err(Error::NotConfirmed {
                slave: drive.address(),
                command,
                status: Box::new(status),
                because,
            });
        }
    }
}

const fn tripped(status: &Status) -> Refusal {
    match status.fault_code {
        Some(code) if code != 0 => Refusal::Fault(code),
        _ => Refusal::Tripped,
    }
}

const fn exception(error: &Error) -> Option<u8> {
    match error {
        Error::Exception { code, .. } => Some(*code),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        drivecom::{QUICK_STOP, SHUTDOWN, SWITCH_ON},
        port::PortError,
        status::RawWord,
    };

    use super::*;

    const ETA: u16 = 3201;

    /// The chart from the drive's side, one status word per state.
    #[derive(Debug)]
    struct Chart {
        eta: u16,
        written: Vec<u16>,
        refuses: Option<Refusal>,
        deaf: bool,
        loses_edge: bool,
        output_frequency: Option<Frequency>,
        /// The status word that somebody else's stop leaves, and at which reading of the status it comes.
        stopped: Option<(usize, u16)>,
        reads: usize,
        /// The first reading that the line does not carry any more.
        mute_from: usize,
        /// The exceptions that the next writes end in, none of them carried out but the one behind 05.
        exceptions: Vec<u8>,
        classes: Vec<Class>,
        own: OwnRun,
        /// The lease at each write.
        leases: Vec<Option<Lease>>,
        /// The control word that it holds, whatever is written.
        keeps: Option<u16>,
    }

    impl Chart {
        fn at(eta: u16) -> Self {
            Self {
                eta,
                written: Vec::new(),
                refuses: None,
                deaf: false,
                loses_edge: false,
                output_frequency: Some(Frequency::ZERO),
                stopped: None,
                reads: 0,
                mute_from: usize::MAX,
                exceptions: Vec::new(),
                classes: Vec::new(),
                own: OwnRun::new(),
                leases: Vec::new(),
                keeps: None,
            }
        }

        fn exchange_failed(&self, problem: PortError) -> Error {
            let exchange = crate::Exchange { function: 6, register: Some(8501) };
            Error::Port { slave: self.address(), exchange, problem }
        }
    }

    #[async_trait]
    impl Drivecom for Chart {
        const ETA: u16 = ETA;

        fn address(&self) -> SlaveAddress {
            SlaveAddress::try_from(1).unwrap()
        }

        fn own_run(&mut self) -> &mut OwnRun {
            &mut self.own
        }

        fn owes_judgement(&mut self) {}

        async fn read_status(&mut self, class: Class) -> Result<Status> {
            self.classes.push(class);
            self.reads += 1;
            if self.reads >= self.mute_from {
                return Err(self.exchange_failed(PortError::Expired));
            }
            if let Some((_, eta)) = self.stopped.filter(|&(read, _)| read == self.reads) {
                self.eta = eta;
            }
            let raw = vec![RawWord { address: ETA, code: "ETA", value: self.eta }];
            Ok(Status { raw, output_frequency: self.output_frequency, ..Status::default() })
        }

        async fn write_control(&mut self, class: Class, word: u16, effect: Effect) -> Result<()> {
            assert_eq!(effect == Effect::Edge, word == FAULT_RESET);
            self.classes.push(class);
            self.leases.push(self.own.lease());
            let exception = (!self.exceptions.is_empty()).then(|| self.exceptions.remove(0));
            let refused = exception.map(|code| Error::Exception {
                slave: self.address(),
                exchange: crate::Exchange { function: 6, register: Some(8501) },
                code,
                meaning: crate::ExceptionMeaning::Unknown,
            });
            if let Some(error) = refused.as_ref().filter(|_| exception != Some(ACKNOWLEDGED)) {
                return Err(error.clone());
            }
            let rises = word & !self.written.last().copied().unwrap_or(0) & FAULT_RESET != 0;
            self.written.push(word);
            if !self.deaf {
                self.eta = match (self.eta, word) {
                    (0x0008, _) if rises => 0x0040,
                    (0x0008, _) => 0x0008,
                    (_, DISABLE_VOLTAGE) => 0x0040,
                    (0x0040 | 0x0027, SHUTDOWN) => 0x0021,
                    (0x0021 | 0x0027, SWITCH_ON) => 0x0023,
                    (0x0023 | 0x0027, run) if run & ENABLE_OPERATION == ENABLE_OPERATION => 0x0027,
                    (0x0027, QUICK_STOP) => 0x0007,
                    (eta, _) => eta,
                };
            }
            if effect == Effect::Edge && self.loses_edge {
                return Err(self.exchange_failed(PortError::OutcomeUnknown("no answer")));
            }
            refused.map_or(Ok(()), Err)
        }

        async fn refuses_start(&mut self, _: Direction, _: &Status) -> Result<Option<Refusal>> {
            Ok(self.refuses)
        }

        async fn shows_run(&mut self, word: u16, _: &mut Status) -> Result<RunShown> {
            let stopping = self.stopped.is_some();
            let in_force = self.written.last() == Some(&word) && !stopping;
            Ok(if in_force { RunShown::InForce } else { RunShown::NotYet })
        }

        async fn prevents_run(&mut self, _: &Status) -> Option<Refusal> {
            None
        }

        async fn read_control(&mut self) -> Result<u16> {
            Ok(self.keeps.or(self.written.last().copied()).unwrap_or(0))
        }

        fn withdrawal(&self, _: u16, _: &Status) -> Result<u16, &'static str> {
            Ok(SWITCH_ON)
        }

        fn stop_word(&self, mode: StopMode) -> StopWord {
            let word = if mode == StopMode::Fast { QUICK_STOP } else { SWITCH_ON };
            StopWord { word, mode, instead: None }
        }

        fn shows_stop(&self, stop: &StopWord, status: &Status) -> bool {
            let shown =
                if stop.word == QUICK_STOP { ChartState::QuickStopActive } else { ChartState::SwitchedOn };
            chart_of(ETA, status) == Some(shown)
        }

        fn defies_stop(&self, status: &Status) -> Option<Refusal> {
            status.control.map(Refusal::NotInControl)
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_start_climbs_every_rung_from_where_the_drive_stands() {
        for (eta, written) in [
            (0x0040, vec![SHUTDOWN, SWITCH_ON, ENABLE_OPERATION]),
            (0x0023, vec![ENABLE_OPERATION]),
            (0x0027, vec![ENABLE_OPERATION]),
            (0x0007, vec![DISABLE_VOLTAGE, SHUTDOWN, SWITCH_ON, ENABLE_OPERATION]),
        ] {
            let mut drive = Chart::at(eta);
            start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap();
            assert_eq!(drive.written, written, "{eta:04X}h");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_stop_that_the_drive_refuses_is_not_confirmed_by_a_motor_that_stands_anyway() {
        let mut drive = Chart { exceptions: vec![4; 100], ..Chart::at(0x0023) };
        let refused = stop(&mut drive, StopMode::Ramp).await.unwrap_err();
        assert!(matches!(refused, Error::Exception { code: 4, .. }), "{refused}");
        assert!(drive.written.is_empty(), "{:?}", drive.written);
    }

    #[tokio::test(start_paused = true)]
    async fn a_withdrawal_is_not_confirmed_while_the_drive_holds_the_run_command() {
        let lease = Lease::new(Direction::Forward, ENABLE_OPERATION);
        let mut drive = Chart { keeps: Some(ENABLE_OPERATION), ..Chart::at(0x0027) };
        drive.own.give(lease);
        drive.own.was_written();
        let kept = withdraw(&mut drive).await.unwrap_err();
        assert!(matches!(kept, Error::NotConfirmed { command: Command::Withdraw, .. }), "{kept}");
        assert_eq!((drive.written, drive.own.lease()), (vec![SWITCH_ON], Some(lease)));
    }

    #[tokio::test(start_paused = true)]
    async fn a_lease_begins_before_its_run_command_is_written_and_ends_with_a_stop_that_was_seen() {
        let mut drive = Chart::at(0x0040);
        start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap();
        let lease = Some(Lease::new(Direction::Forward, ENABLE_OPERATION));
        assert_eq!(drive.leases, [None, None, lease]);
        let mut deaf = Chart { deaf: true, ..drive };
        stop(&mut deaf, StopMode::Fast).await.unwrap_err();
        assert_eq!(deaf.own.lease(), lease, "a stop that does not show ends nothing");
        deaf.deaf = false;
        stop(&mut deaf, StopMode::Fast).await.unwrap();
        assert_eq!(deaf.own.lease(), None);
    }

    #[tokio::test(start_paused = true)]
    async fn a_run_command_that_the_drive_refuses_makes_no_lease_and_one_that_nobody_knows_of_does() {
        let mut refused = Chart { exceptions: vec![4], ..Chart::at(0x0023) };
        start(&mut refused, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
        assert_eq!(refused.own.lease(), None);
        let mut unseen = Chart { mute_from: 2, ..Chart::at(0x0023) };
        start(&mut unseen, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
        assert!(unseen.own.lease().is_some());
    }

    #[tokio::test(start_paused = true)]
    async fn a_refused_start_writes_nothing() {
        for (eta, refuses, reason) in [
            (0x0008, None, Refusal::Tripped),
            (0x0001, None, Refusal::State(State::Unknown)),
            (0x0020, None, Refusal::State(State::NotReady)),
            (0x0040, Some(Refusal::DirectionForbidden), Refusal::DirectionForbidden),
        ] {
            let mut drive = Chart { refuses, ..Chart::at(eta) };
            let error = start(&mut drive, Direction::Reverse, ENABLE_OPERATION).await.unwrap_err();
            assert!(matches!(error, Error::Refused { reason: told, .. } if told == reason), "{error}");
            assert!(drive.written.is_empty());
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_drive_that_does_not_follow_is_not_confirmed() {
        let mut drive = Chart { deaf: true, ..Chart::at(0x0040) };
        let error = start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotConfirmed);
        assert_eq!(drive.written, [SHUTDOWN], "told once, and waited for");
    }

    #[tokio::test(start_paused = true)]
    async fn a_stop_by_somebody_else_is_never_undone_by_a_start_that_waits_for_its_confirmation() {
        let ladder = [SHUTDOWN, SWITCH_ON, ENABLE_OPERATION];
        // At the STOP key, by a quick stop, by another master's 0006h and 0007h, at power-off, and by a fault.
        for left in [0x0040, 0x0007, 0x0021, 0x0023, 0x0020, 0x0001, 0x0008] {
            for (read, written) in [(3, 2), (4, 3), (5, 3), (8, 3)] {
                let before_switched_on = read == 3 && [0x0021, 0x0023].contains(&left);
                if before_switched_on {
                    continue;
                }
                let mut drive = Chart { stopped: Some((read, left)), ..Chart::at(0x0040) };
                let error = start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
                // A trip refuses the start only where the run command was not yet given.
                let refused = left == 0x0008 && written < 3;
                let kind = if refused { ErrorKind::Refused } else { ErrorKind::NotConfirmed };
                assert_eq!(error.kind(), kind, "{left:04X}h at the {read}th reading");
                assert_eq!(drive.written, ladder[..written], "{left:04X}h at the {read}th reading");
            }
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_stop_that_enables_operation_on_the_way_is_not_undone_by_the_start() {
        for (read, written) in [(2, vec![SHUTDOWN]), (3, vec![SHUTDOWN, SWITCH_ON])] {
            let mut drive = Chart { stopped: Some((read, 0x0027)), ..Chart::at(0x0040) };
            let error = start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
            assert_eq!(error.kind(), ErrorKind::NotConfirmed);
            assert_eq!(drive.written, written, "the ramp stop 100Fh at the {read}th reading");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_motor_in_its_quick_stop_is_not_let_coast_by_a_start() {
        for output_frequency in [Some(Frequency::from_hertz(3)), None] {
            let mut drive = Chart { output_frequency, ..Chart::at(0x0007) };
            let error = start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
            let reason = Refusal::State(State::QuickStop);
            assert!(matches!(error, Error::Refused { reason: told, .. } if told == reason), "{error}");
            assert!(drive.written.is_empty());
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_stop_is_written_before_anything_is_read_and_again_half_a_second_apart_while_it_does_not_show()
    {
        let mut drive = Chart::at(0x0027);
        let stopped = stop(&mut drive, StopMode::Fast).await.unwrap();
        assert_eq!((stopped.mode, stopped.instead), (StopMode::Fast, None));
        assert_eq!(
            (&*drive.written, &*drive.classes),
            (&[QUICK_STOP][..], &[Class::Stop, Class::Command][..])
        );

        let mut deaf = Chart { deaf: true, ..Chart::at(0x0027) };
        let begun = tokio::time::Instant::now();
        let error = stop(&mut deaf, StopMode::Fast).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotConfirmed);
        assert_eq!(deaf.written, [QUICK_STOP; 5]);
        assert!(begun.elapsed() <= crate::CONFIRMED_WITHIN);
        let top = deaf.classes.iter().filter(|&&class| class == Class::Stop).count();
        assert_eq!(top, 5, "only the writes travel as stops");
    }

    #[tokio::test(start_paused = true)]
    async fn a_stop_that_a_late_run_command_overtakes_is_written_again() {
        let mut drive = Chart { stopped: Some((1, 0x0027)), ..Chart::at(0x0027) };
        stop(&mut drive, StopMode::Ramp).await.unwrap();
        assert_eq!((drive.eta, drive.written), (0x0023, vec![SWITCH_ON; 2]));
    }

    #[tokio::test(start_paused = true)]
    async fn a_stop_goes_on_behind_exceptions_and_lasts_for_its_time() {
        for (exceptions, written) in [(vec![5], 1), (vec![6], 1), (vec![6, 4, 6], 1)] {
            let mut drive = Chart { exceptions, ..Chart::at(0x0027) };
            stop(&mut drive, StopMode::Fast).await.unwrap();
            assert_eq!((drive.eta, drive.written.len()), (0x0007, written));
        }
        let mut busy = Chart { exceptions: vec![6; 100], ..Chart::at(0x0027) };
        let begun = tokio::time::Instant::now();
        let error = stop(&mut busy, StopMode::Fast).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Exception);
        assert!(begun.elapsed() > crate::CONFIRMED_WITHIN / 2);
    }

    #[tokio::test(start_paused = true)]
    async fn a_ramp_behind_a_quick_stop_is_told_as_the_fast_stop_that_it_is() {
        let status = Status { state: State::QuickStop, ..Status::default() };
        let word = StopWord { word: 0x100F, mode: StopMode::Ramp, instead: None };
        assert_eq!(stopped(word, status).mode, StopMode::Fast);
    }

    #[tokio::test(start_paused = true)]
    async fn a_start_asks_a_busy_drive_again_and_takes_an_acknowledgement_for_no_refusal() {
        let ladder = [SHUTDOWN, SWITCH_ON, ENABLE_OPERATION];
        for exceptions in [vec![6, 6], vec![5, 5, 5], vec![6, 5, 6, 5]] {
            let mut drive = Chart { exceptions, ..Chart::at(0x0040) };
            start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap();
            assert_eq!(drive.written, ladder);
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_reset_is_one_edge_that_is_cleared_also_when_its_answer_was_lost() {
        for loses_edge in [false, true] {
            let mut drive = Chart { loses_edge, ..Chart::at(0x0008) };
            reset_fault(&mut drive).await.unwrap();
            assert_eq!(drive.written, [FAULT_RESET, DISABLE_VOLTAGE]);
        }
        let mut healthy = Chart::at(0x0023);
        reset_fault(&mut healthy).await.unwrap();
        assert!(healthy.written.is_empty(), "a drive without a fault is left alone");
    }

    #[tokio::test(start_paused = true)]
    async fn no_reset_takes_the_voltage_from_a_motor_that_may_still_be_driven() {
        for (eta, state) in [(0x002F, State::FaultReaction), (0x0001, State::Unknown)] {
            let mut drive = Chart::at(eta);
            let error = reset_fault(&mut drive).await.unwrap_err();
            let reason = Refusal::State(state);
            assert!(matches!(error, Error::Refused { reason: told, .. } if told == reason), "{error}");
            assert!(drive.written.is_empty());
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_start_whose_confirmation_cannot_be_read_is_unknown_and_never_called_not_sent() {
        for (mute_from, kind) in
            [(2, ErrorKind::NotSent), (3, ErrorKind::NotSent), (4, ErrorKind::OutcomeUnknown)]
        {
            let mut drive = Chart { mute_from, ..Chart::at(0x0040) };
            let error = start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
            assert_eq!(error.kind(), kind, "{:04X?}", drive.written);
        }
        let mut drive = Chart { mute_from: 1, ..Chart::at(0x0027) };
        let error = stop(&mut drive, StopMode::Fast).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::OutcomeUnknown);
    }
}
