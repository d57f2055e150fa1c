//! Commands carried through the chart: write a step, read the status, go on from what it says.

use async_trait::async_trait;

use super::{
    chart::{ChartState, DISABLE_VOLTAGE, ENABLE_OPERATION, FAULT_RESET},
    climb::{Climb, Next},
};
use crate::{
    error::{Error, ErrorKind, Refusal, Result, SlaveAddress},
    port::{Class, Effect},
    setpoint::{Command, Direction, StopMode},
    status::{State, Status},
    units::Frequency,
};

/// How often the status is read for a command to show before it counts as not confirmed. There is no clock here: the
/// line's own pace makes a time of it.
pub const CONFIRMING_READS: usize = 20;

/// After how many readings that do not show a stop it is written again.
const READS_PER_STOP: usize = 5;

/// A drive that follows the chart, as the sequences see it.
///
/// # For implementors
/// The status that [`read_status`](Self::read_status) returns **must** hold the status word, at the address
/// [`status_register`](Self::status_register), among its raw words. [`write_control`](Self::write_control) writes the control word to the
/// drive's `CMD` and nothing else.
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

    /// Reads the fast set in this class.
    async fn read_status(&mut self, class: Class) -> Result<Status>;

    /// Writes the control word in this class.
    async fn write_control(&mut self, class: Class, word: u16, effect: Effect) -> Result<()>;

    /// Why this drive is not to be started, from a fresh status: local control, a forbidden direction, settings. That
    /// it has not tripped, is in a known state and shows no output in a quick stop is checked apart. May read more of the
    /// drive.
    async fn refuses_start(&mut self, direction: Direction, status: &Status) -> Result<Option<Refusal>>;

    /// Whether the drive shows that it took the run command `word`, in the state operation enabled. May read more of
    /// the drive, and add to the status what it read.
    async fn shows_run(&mut self, word: u16, status: &mut Status) -> Result<bool>;
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
/// ladder's own cannot be told from it.
///
/// # Errors
/// [`Error::Refused`] before the run command is written: nothing starts then. [`Error::NotConfirmed`] when the drive trips
/// after it, when somebody else has commanded the drive, or when the run command does not show within
/// [`CONFIRMING_READS`] reads; one that was written stands in the drive then.
pub async fn start<D: Drivecom>(drive: &mut D, direction: Direction, word: u16) -> Result<Status> {
    let command = Command::Start(direction);
    let slave = drive.address();
    let eta = drive.status_register();
    let refused = |reason| Error::Refused { slave, command, reason };

    let mut status = drive.read_status(Class::Command).await?;
    let mut climb = may_start(drive, direction, &status).await?.map_err(refused)?;
    let mut given = false;
    // Once the run command was written, an exchange that fails says nothing of the motor.
    let failed = |error: Error, given| if given { error.after_write() } else { error };
    for _ in 0..CONFIRMING_READS {
        match chart_of(eta, &status).map(|state| climb.next(state)) {
            Some(Next::Write(ENABLE_OPERATION)) => {
                drive.write_control(Class::Command, word, Effect::Level).await?;
                given = true;
            }
            Some(Next::Write(step)) => drive.write_control(Class::Command, step, Effect::Level).await?,
            Some(Next::Wait) => {}
            Some(Next::Arrived) => {
                if drive.shows_run(word, &mut status).await.map_err(Error::after_write)? {
                    return Ok(status);
                }
            }
            Some(Next::Faulted) if !given => return Err(refused(tripped(&status))),
            Some(Next::Faulted | Next::Over) | None => break,
        }
        status = drive.read_status(Class::Command).await.map_err(|error| failed(error, given))?;
    }
    Err(Error::NotConfirmed { slave, command, status: Box::new(status), because: None })
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

/// Writes the stop `word`, whatever the drive's state, and then reads until `shows` finds it in the drive's words. Where
/// it does not show it is written again, three times at most: a run command that the way to the drive kept back may have
/// come after it.
///
/// # Errors
/// [`Error::NotConfirmed`] when it does not show within [`CONFIRMING_READS`] reads.
pub async fn stop<D: Drivecom>(
    drive: &mut D,
    mode: StopMode,
    word: u16,
    shows: impl Fn(&Status) -> bool + Send,
) -> Result<Status> {
    drive.write_control(Class::Stop, word, Effect::Level).await?;
    see_stop(drive, mode, word, shows).await.map_err(Error::after_write)
}

async fn see_stop<D: Drivecom>(
    drive: &mut D,
    mode: StopMode,
    word: u16,
    shows: impl Fn(&Status) -> bool + Send,
) -> Result<Status> {
    let mut status = drive.read_status(Class::Stop).await?;
    for read in 1..CONFIRMING_READS {
        if shows(&status) {
            return Ok(status);
        }
        if read % READS_PER_STOP == 0 {
            drive.write_control(Class::Stop, word, Effect::Level).await?;
        }
        status = drive.read_status(Class::Stop).await?;
    }
    if shows(&status) {
        return Ok(status);
    }
    let command = Command::Stop(mode);
    Err(Error::NotConfirmed { slave: drive.address(), command, status: Box::new(status), because: None })
}

/// One rising edge of the fault reset, cleared at once. A drive without a fault is left alone. Both words disable the
/// voltage, so nothing starts by a reset; and so none is sent to a drive that may still drive its motor.
///
/// # Errors
/// [`Error::Refused`] while the drive still does what the fault asks, and in a state that its manual does not explain;
/// [`Error::NotConfirmed`] when the drive still shows a fault after [`CONFIRMING_READS`] reads.
pub async fn reset_fault<D: Drivecom>(drive: &mut D) -> Result<Status> {
    let eta = drive.status_register();
    let healthy = |status: &Status| chart_of(eta, status).is_some_and(|state| !state.is_fault());
    let command = Command::ResetFaults;
    let mut status = drive.read_status(Class::Command).await?;
    let state = match chart_of(eta, &status) {
        Some(ChartState::Fault) => None,
        Some(ChartState::FaultReactionActive) => Some(State::FaultReaction),
        Some(_) => return Ok(status),
        None => Some(State::Unknown),
    };
    if let Some(state) = state {
        return Err(Error::Refused { slave: drive.address(), command, reason: Refusal::State(state) });
    }
    let edge = drive.write_control(Class::Command, FAULT_RESET, Effect::Edge).await;
    // An edge that may have arrived is cleared as well, so that the next one rises; the status tells the outcome.
    if let Err(error) = edge
        && error.kind() != ErrorKind::OutcomeUnknown
    {
        return Err(error);
    }
    drive.write_control(Class::Command, DISABLE_VOLTAGE, Effect::Level).await.map_err(Error::after_write)?;
    for _ in 0..CONFIRMING_READS {
        status = drive.read_status(Class::Command).await.map_err(Error::after_write)?;
        if healthy(&status) {
            return Ok(status);
        }
    }
    Err(Error::NotConfirmed { slave: drive.address(), command, status: Box::new(status), because: None })
}

const fn tripped(status: &Status) -> Refusal {
    match status.fault_code {
        Some(code) if code != 0 => Refusal::Fault(code),
        _ => Refusal::Tripped,
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
            }
        }
    }

    #[async_trait]
    impl Drivecom for Chart {
        const ETA: u16 = ETA;

        fn address(&self) -> SlaveAddress {
            SlaveAddress::try_from(1).unwrap()
        }

        async fn read_status(&mut self, _: Class) -> Result<Status> {
            self.reads += 1;
            if self.reads >= self.mute_from {
                return Err(Error::Port {
                    slave: self.address(),
                    exchange: crate::Exchange { function: 3, register: Some(ETA) },
                    problem: PortError::Expired,
                });
            }
            if let Some((_, eta)) = self.stopped.filter(|&(read, _)| read == self.reads) {
                self.eta = eta;
            }
            let raw = vec![RawWord { address: ETA, code: "ETA", value: self.eta }];
            Ok(Status { raw, output_frequency: self.output_frequency, ..Status::default() })
        }

        async fn write_control(&mut self, _: Class, word: u16, effect: Effect) -> Result<()> {
            assert_eq!(effect == Effect::Edge, word == FAULT_RESET);
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
                return Err(Error::Port {
                    slave: self.address(),
                    exchange: crate::Exchange { function: 6, register: Some(8501) },
                    problem: PortError::OutcomeUnknown("no answer"),
                });
            }
            Ok(())
        }

        async fn refuses_start(&mut self, _: Direction, _: &Status) -> Result<Option<Refusal>> {
            Ok(self.refuses)
        }

        async fn shows_run(&mut self, word: u16, _: &mut Status) -> Result<bool> {
            let stopping = self.stopped.is_some();
            Ok(self.written.last() == Some(&word) && !stopping)
        }
    }

    #[tokio::test]
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

    #[tokio::test]
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

    #[tokio::test]
    async fn a_drive_that_does_not_follow_is_not_confirmed() {
        let mut drive = Chart { deaf: true, ..Chart::at(0x0040) };
        let error = start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotConfirmed);
        assert_eq!(drive.written, [SHUTDOWN], "told once, and waited for");
    }

    #[tokio::test]
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

    #[tokio::test]
    async fn a_stop_that_enables_operation_on_the_way_is_not_undone_by_the_start() {
        for (read, written) in [(2, vec![SHUTDOWN]), (3, vec![SHUTDOWN, SWITCH_ON])] {
            let mut drive = Chart { stopped: Some((read, 0x0027)), ..Chart::at(0x0040) };
            let error = start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
            assert_eq!(error.kind(), ErrorKind::NotConfirmed);
            assert_eq!(drive.written, written, "the ramp stop 100Fh at the {read}th reading");
        }
    }

    #[tokio::test]
    async fn a_motor_in_its_quick_stop_is_not_let_coast_by_a_start() {
        for output_frequency in [Some(Frequency::from_hertz(3)), None] {
            let mut drive = Chart { output_frequency, ..Chart::at(0x0007) };
            let error = start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
            let reason = Refusal::State(State::QuickStop);
            assert!(matches!(error, Error::Refused { reason: told, .. } if told == reason), "{error}");
            assert!(drive.written.is_empty());
        }
    }

    #[tokio::test]
    async fn a_stop_is_written_before_anything_is_read_and_again_only_while_it_does_not_show() {
        let mut drive = Chart::at(0x0027);
        let shows = |status: &Status| chart_of(ETA, status) == Some(ChartState::QuickStopActive);
        stop(&mut drive, StopMode::Fast, QUICK_STOP, shows).await.unwrap();
        assert_eq!(drive.written, [QUICK_STOP]);

        let mut deaf = Chart { deaf: true, ..Chart::at(0x0027) };
        let error = stop(&mut deaf, StopMode::Fast, QUICK_STOP, shows).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::NotConfirmed);
        assert_eq!(deaf.written, [QUICK_STOP; 4]);
    }

    #[tokio::test]
    async fn a_stop_that_a_late_run_command_overtakes_is_written_again() {
        let shows = |status: &Status| chart_of(ETA, status) == Some(ChartState::SwitchedOn);
        let mut drive = Chart { stopped: Some((1, 0x0027)), ..Chart::at(0x0027) };
        stop(&mut drive, StopMode::Ramp, SWITCH_ON, shows).await.unwrap();
        assert_eq!((drive.eta, drive.written), (0x0023, vec![SWITCH_ON; 2]));
    }

    #[tokio::test]
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

    #[tokio::test]
    async fn no_reset_takes_the_voltage_from_a_motor_that_may_still_be_driven() {
        for (eta, state) in [(0x002F, State::FaultReaction), (0x0001, State::Unknown)] {
            let mut drive = Chart::at(eta);
            let error = reset_fault(&mut drive).await.unwrap_err();
            let reason = Refusal::State(state);
            assert!(matches!(error, Error::Refused { reason: told, .. } if told == reason), "{error}");
            assert!(drive.written.is_empty());
        }
    }

    #[tokio::test]
    async fn a_start_whose_confirmation_cannot_be_read_is_unknown_and_never_called_not_sent() {
        for (mute_from, kind) in
            [(2, ErrorKind::NotSent), (3, ErrorKind::NotSent), (4, ErrorKind::OutcomeUnknown)]
        {
            let mut drive = Chart { mute_from, ..Chart::at(0x0040) };
            let error = start(&mut drive, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
            assert_eq!(error.kind(), kind, "{:04X?}", drive.written);
        }
        let mut drive = Chart { mute_from: 1, ..Chart::at(0x0027) };
        let error = stop(&mut drive, StopMode::Fast, QUICK_STOP, |_| true).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::OutcomeUnknown);
    }
}
