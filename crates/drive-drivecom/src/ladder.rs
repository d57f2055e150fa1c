//! Commands carried through the chart: write a step, read the status, go on from what it says.

use std::time::Duration;

use async_trait::async_trait;

use super::{
    chart::{ChartState, DISABLE_VOLTAGE, ENABLE_OPERATION, FAULT_RESET},
    climb::{Climb, Next},
    words::{ControlWord, RunShown},
};
use drive_core::{
    Class, Command, Confirming, Control, Direction, Effect, Error, ErrorKind, ExceptionMeaning, Frequency,
    Lease, OwnRun, Refusal, Result, Setpoint, SlaveAddress, State, Status, StopMode, Stopped, Withdrawn,
};

/// After how many readings that do not show a stop it is written again: half a second apart, once the readings have found
/// their longest pause.
const READS_PER_STOP: usize = 5;

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

    /// A word that commands the motor was written, or may be: see [`Registers::owe_judgement`](drive_core::Registers::owe_judgement).
    fn owes_judgement(&mut self);

    /// A status behind a stop that does not show yet, and how the last write of it ended.
    fn tell_follower<T>(&self, status: &Status, written: &Result<T>);

    /// Why this drive is not to be started, from a fresh status: local control, a forbidden direction, settings. That
    /// it has not tripped, is in a known state and shows no output in a quick stop is checked apart. May read more of the
    /// drive.
    ///
    /// A sign that somebody else left in the reference would turn the direction round. The `setpoint` that is to be given first,
    /// if there is one, takes it away where no motor is driven by it, and leaves it else.
    async fn refuses_start(
        &mut self,
        direction: Direction,
        setpoint: Option<Setpoint>,
        status: &Status,
    ) -> Result<Option<Refusal>>;

    /// Whether the run command `word` is in force, in the state operation enabled: the drive holds it, the bus is its
    /// active source of commands and of the reference, and the motor is driven that way. May read more of the drive, and
    /// add to the status what it read.
    async fn shows_run(&mut self, word: u16, status: &mut Status) -> Result<RunShown>;

    /// What keeps a run command that was given from being in force, where the drive tells it. May read more of the drive.
    async fn prevents_run(&mut self, status: &Status) -> Option<Refusal>;

    /// How much longer than [`CONFIRMED_WITHIN`](drive_core::CONFIRMED_WITHIN) a motor may take to turn by a run command that the drive
    /// holds, as its settings say: a brake that is released first. May read more of the drive.
    async fn turns_late(&mut self) -> Duration {
        Duration::ZERO
    }

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

    /// Reads what the stop word depends on, where that was not known or may be otherwise by now, once a stop is on the wire that does not
    /// show or has left the drive to somebody else. The stop that has to be written then: another word, or other bits around the same.
    async fn corrected_stop(&mut self, _asked: StopMode, _sent: StopWord) -> Option<StopWord> {
        None
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
/// [`CONFIRMED_WITHIN`](drive_core::CONFIRMED_WITHIN) and what its brake [takes](Drivecom::turns_late); one that was written stands in the
/// drive then.
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
    let mut climb = climb_from(drive, direction, None, &status).await?.map_err(refused)?;
    let mut confirming = Confirming::begin();
    let (mut given, mut is_late) = (false, false);
    let mut shown = RunShown::NotYet;
    let because = loop {
        let waits = match chart_of(eta, &status).map(|state| climb.next(state)) {
            Some(Next::Write(step)) => {
                let run = step == ENABLE_OPERATION;
                given |= run;
                let step = if run { word } else { step };
                if run {
                    // The lease is there before the word is on its way: a call that is dropped here leaves somebody
                    // who withdraws it.
                    let word = drive.as_written(word);
                    drive.own_run().give(Lease::new(direction, word));
                }
                let written = drive.write_control(Class::Command, step, Effect::Level).await;
                if run {
                    keep_lease(drive.own_run(), &written);
                    drive.owes_judgement();
                }
                match written {
                    Err(error) if means(&error, ExceptionMeaning::Busy) => {
                        climb.forget_written();
                        true
                    }
                    Err(error) if !means(&error, ExceptionMeaning::Accepted) => return Err(error),
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
            let because = drive.prevents_run(&status).await;
            let more = if given && !is_late && because.is_none() {
                drive.turns_late().await
            } else {
                Duration::ZERO
            };
            if more.is_zero() {
                break because;
            }
            (is_late, confirming) = (true, Confirming::within(more));
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
        Err(error) if matches!(error.kind(), ErrorKind::Exception | ErrorKind::NotSent) => {
            own.was_not_written();
        }
        Err(_) => {}
    }
}

/// Whether [`start`] would refuse this direction, once the setpoint was given where there is one. Nothing is written.
///
/// # Errors
/// [`Error::Refused`], as of the start.
pub async fn may_start<D: Drivecom>(
    drive: &mut D,
    direction: Direction,
    setpoint: Option<Setpoint>,
) -> Result<()> {
    let (slave, command) = (drive.address(), Command::Start(direction));
    let status = drive.read_status(Class::Command).await?;
    // A setpoint changes no speed of a motor that nothing drives: what is not seen at once is judged by its start, and only once.
    let is_the_buses = status.control.is_none_or(|control| control == Control::Bus);
    if setpoint.is_some() && status.motion.is_undriven() && status.state != State::Fault && is_the_buses {
        return Ok(());
    }
    let climb = climb_from(drive, direction, setpoint, &status).await?;
    climb.map(drop).map_err(|reason| Error::Refused { slave, command, reason })
}

/// A climb from where the drive stands, or why there is none.
async fn climb_from<D: Drivecom>(
    drive: &mut D,
    direction: Direction,
    setpoint: Option<Setpoint>,
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
    if let Some(reason) = drive.refuses_start(direction, setpoint, status).await? {
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
/// [`Error::NotConfirmed`] when it does not show within [`CONFIRMED_WITHIN`](drive_core::CONFIRMED_WITHIN), and at once where
/// the status shows that no word of the bus stops this motor. What the last write ended in, where that was no confirmation.
pub async fn stop<D: Drivecom>(drive: &mut D, mode: StopMode) -> Result<Stopped> {
    let mut stop = drive.stop_word(mode);
    let before = drive.last_control().filter(|&control| control != Control::Bus);
    let mut written = write_stop(drive, &stop).await?;
    drive.owes_judgement();
    let mut corrected = false;
    let mut confirming = Confirming::begin();
    let mut reads = 0;
    loop {
        let status = drive.read_status(Class::Command).await.map_err(Error::after_write)?;
        reads += 1;
        // A motor that stands at a setpoint of zero shows a stop that never arrived, and one that slows down for another reason one
        // that was acknowledged only.
        let shown = drive.shows_stop(&stop, &status)
            && match &written {
                Err(_) => false,
                Ok(Taken::Confirmed) => true,
                Ok(Taken::Acknowledged) => {
                    let held = drive.read_control().await.map_err(Error::after_write)?;
                    !drive.is_run(held)
                }
            };
        let elsewhere = status.control.is_some_and(|control| control != Control::Bus);
        // One that the drive has not taken is written again before anything is read for it.
        if !corrected && (elsewhere || !shown && written.is_ok()) {
            corrected = true;
            if let Some(other) = drive.corrected_stop(mode, stop).await {
                stop = other;
                written = write_stop(drive, &stop).await.map_err(Error::after_write)?;
                continue;
            }
        }
        if shown {
            drive.own_run().end();
            let taken_from = before.filter(|_| status.control == Some(Control::Bus));
            return Ok(Stopped { taken_from, ..stopped(stop, status) });
        }
        drive.tell_follower(&status, &written);
        let defies = drive.defies_stop(&status);
        if defies.is_some() || !confirming.again().await {
            // What the last write ended in says more than that nothing shows.
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

/// What the drive said to the write of a stop.
enum Taken {
    /// It has taken it.
    Confirmed,
    /// It takes it later (exception 05h), or so it says: the word that it holds shows whether it has.
    Acknowledged,
}

/// Writes a stop. What says that it did not arrive, or leaves it open, is for the reading behind it to judge; only what kept
/// it from being sent ends the stop.
async fn write_stop<D: Drivecom>(drive: &mut D, stop: &StopWord) -> Result<Result<Taken>> {
    match drive.write_control(Class::Stop, stop.word, Effect::Level).await {
        Err(error) if means(&error, ExceptionMeaning::Accepted) => Ok(Ok(Taken::Acknowledged)),
        Err(error) if error.kind() == ErrorKind::NotSent => Err(error),
        written => Ok(written.map(|()| Taken::Confirmed)),
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
/// [`Error::NotConfirmed`] when the drive still shows a fault after [`CONFIRMED_WITHIN`](drive_core::CONFIRMED_WITHIN).
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

fn means(error: &Error, what: ExceptionMeaning) -> bool {
    matches!(error, Error::Exception { meaning, .. } if *meaning == what)
}

#[cfg(test)]
mod tests;
