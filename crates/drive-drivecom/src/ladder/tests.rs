//! The ladder on a chart from the drive's side.

use drive_core::{PortError, RawWord};

use crate::{QUICK_STOP, SHUTDOWN, SWITCH_ON};

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
    /// Behind a run command its motor turns from here on, and its settings say that it takes so much longer.
    turns: Option<(tokio::time::Instant, Duration)>,
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
            turns: None,
        }
    }

    fn exchange_failed(&self, problem: PortError) -> Error {
        let exchange = drive_core::Exchange { function: 6, register: Some(8501) };
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

    fn tell_follower<T>(&self, _: &Status, _: &Result<T>) {}

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
            exchange: drive_core::Exchange { function: 6, register: Some(8501) },
            code,
            meaning: drive_core::ExceptionMeaning::standard(code),
        });
        // What a drive has acknowledged (05h) it carries out.
        if let Some(error) = refused.as_ref().filter(|_| exception != Some(5)) {
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

    async fn refuses_start(
        &mut self,
        _: Direction,
        _: Option<Setpoint>,
        _: &Status,
    ) -> Result<Option<Refusal>> {
        Ok(self.refuses)
    }

    async fn shows_run(&mut self, word: u16, _: &mut Status) -> Result<RunShown> {
        let stopping = self.stopped.is_some();
        let turns = self.turns.is_none_or(|(from, _)| from <= tokio::time::Instant::now());
        let in_force = self.written.last() == Some(&word) && !stopping && turns;
        Ok(if in_force { RunShown::InForce } else { RunShown::NotYet })
    }

    async fn prevents_run(&mut self, _: &Status) -> Option<Refusal> {
        None
    }

    async fn turns_late(&mut self) -> Duration {
        self.turns.map_or(Duration::ZERO, |(_, late)| late)
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
    for denied in [1, 2, 3] {
        let mut refused = Chart { exceptions: vec![denied], ..Chart::at(0x0023) };
        let error = start(&mut refused, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
        assert_eq!((error.kind(), refused.own.lease()), (ErrorKind::Exception, None), "{denied}");
    }
    // 04 is printed as "started but cannot complete" (Altivar 28, 58, 312); behind the others stands no word of the drive's.
    for open in [4, 8, 0x0B] {
        let mut begun = Chart { exceptions: vec![open], ..Chart::at(0x0023) };
        let error = start(&mut begun, Direction::Forward, ENABLE_OPERATION).await.unwrap_err();
        assert_eq!(error.kind(), ErrorKind::OutcomeUnknown, "{open}");
        assert!(begun.own.lease().is_some(), "{open}");
    }
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

/// A brake is released before the motor turns: 2.5 s here, beside the two in which every motor has to.
#[tokio::test(start_paused = true)]
async fn a_motor_that_turns_late_is_waited_for_as_long_as_its_settings_say_and_no_longer() {
    for (turns_after, late, is_started) in
        [(1_000, 0, true), (4_000, 0, false), (4_000, 2_500, true), (6_000, 2_500, false)]
    {
        let from = tokio::time::Instant::now() + Duration::from_millis(turns_after);
        let mut drive = Chart { turns: Some((from, Duration::from_millis(late))), ..Chart::at(0x0023) };
        let started = start(&mut drive, Direction::Forward, ENABLE_OPERATION).await;
        let kind = started.err().map(|error| error.kind());
        let wanted = (!is_started).then_some(ErrorKind::NotConfirmed);
        assert_eq!(kind, wanted, "{turns_after} ms of {late} ms");
        assert_eq!(drive.written, [ENABLE_OPERATION], "written once");
    }
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
async fn a_stop_is_written_before_anything_is_read_and_again_half_a_second_apart_while_it_does_not_show() {
    let mut drive = Chart::at(0x0027);
    let stopped = stop(&mut drive, StopMode::Fast).await.unwrap();
    assert_eq!((stopped.mode, stopped.instead), (StopMode::Fast, None));
    assert_eq!((&*drive.written, &*drive.classes), (&[QUICK_STOP][..], &[Class::Stop, Class::Command][..]));

    let mut deaf = Chart { deaf: true, ..Chart::at(0x0027) };
    let begun = tokio::time::Instant::now();
    let error = stop(&mut deaf, StopMode::Fast).await.unwrap_err();
    assert_eq!(error.kind(), ErrorKind::NotConfirmed);
    assert_eq!(deaf.written, [QUICK_STOP; 5]);
    assert!(begun.elapsed() <= drive_core::CONFIRMED_WITHIN);
    let top = deaf.classes.iter().filter(|&&class| class == Class::Stop).count();
    assert_eq!(top, 5, "only the writes travel as stops");
}

#[tokio::test(start_paused = true)]
async fn a_stop_that_a_late_run_command_overtakes_is_written_again() {
    let mut drive = Chart { stopped: Some((1, 0x0027)), ..Chart::at(0x0027) };
    stop(&mut drive, StopMode::Ramp).await.unwrap();
    assert_eq!((drive.eta, drive.written), (0x0023, vec![SWITCH_ON; 2]));
}

/// Exception 05h says that the drive works on it. One that never takes the word, and shows what a stop looks like for another reason,
/// goes on to hold the run command.
#[tokio::test(start_paused = true)]
async fn a_stop_that_is_acknowledged_is_confirmed_only_where_the_drive_holds_no_run_command() {
    let mut holds = Chart { exceptions: vec![5; 100], keeps: Some(ENABLE_OPERATION), ..Chart::at(0x0023) };
    let told = stop(&mut holds, StopMode::Ramp).await.unwrap_err();
    assert!(matches!(told, Error::NotConfirmed { command: Command::Stop(_), .. }), "{told}");
    assert!(holds.written.len() > 1, "it is written again");
    let mut takes = Chart { exceptions: vec![5], ..Chart::at(0x0027) };
    assert!(stop(&mut takes, StopMode::Ramp).await.is_ok());
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
    assert!(begun.elapsed() > drive_core::CONFIRMED_WITHIN / 2);
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
