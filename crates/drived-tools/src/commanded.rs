//! The one drive that a subcommand commands: a fleet of one, so that it is commanded by the same rules as a plant's.

use std::{fmt, time::Duration};

use drive_bus::{Line, LineConfig};
use drive_core::{Error, ErrorKind, PortError, Status, StopMode};
use drive_families::Options;
use drive_fleet::{
    DriveHandle, DriveSettings, Event, EventKind, Events, Fleet, LastSeen, Link, Outcome, Periods, Received,
    Refused, Started, StopModes, StopOrder, Times, Unknown,
};
use tokio::time::{Instant, interval_at, timeout};

use drived_client::own_line;
use drived_words::{drive_spec::DriveName, failure::Failure, output, signals::Ending};

/// What whoever waits for a stop has to know.
pub const UNCONFIRMED: &str = "STOP NOT CONFIRMED, the motor may turn: use the emergency stop";

/// How long a drive may take to answer for the first time, over a line that is disturbed or comes and goes.
const CONNECTED_WITHIN: Duration = Duration::from_secs(5);

/// How long a command may take to show: a drive that restarts by its reset is mute for a while.
const RESTART: Duration = Duration::from_secs(10);

/// From the call of a stop until its lack of a confirmation is an alarm.
const STOP_TIME: Duration = Duration::from_secs(5);

/// Between two words about a stop that is not confirmed.
const SECOND: Duration = Duration::from_secs(1);

/// From one status to the next, so that the motor is watched while it is commanded.
const PERIOD: Duration = Duration::from_millis(500);

/// The fleet of one drive.
pub struct Commanded {
    pub name: DriveName,
    handle: DriveHandle,
    events: Events,
    config: LineConfig,
    line: Line,
    ending: Ending,
    /// Whether it was to start the motor: its stop is not given up before it is taken, or its time is over.
    has_started: bool,
    /// Nobody is told on stdout how it goes, because that is for an object.
    pub is_quiet: bool,
}

impl Commanded {
    /// A drive on an open line. `accepted`: the settings by which it may start again by itself.
    pub fn over(
        name: DriveName,
        line: Line,
        config: LineConfig,
        options: &Options,
        accepted: Vec<String>,
    ) -> Result<Self, Failure> {
        // A terminal that is gone asks as Ctrl-C does: a motor that was started is stopped before the program ends.
        let ending = Ending::listen_on_terminal()?;
        let settings = DriveSettings {
            accept_self_restart: accepted,
            periods: Periods { running: PERIOD, rest: PERIOD, slow: Duration::ZERO, ..Periods::default() },
            times: Times {
                lifetime: CONNECTED_WITHIN,
                effect: RESTART,
                stop_alarm: STOP_TIME,
                ..Times::default()
            },
            ..DriveSettings::controlled(name.to_string())
        };
        let input = |error: &dyn fmt::Display| Failure::Input(error.to_string());
        let builder = Fleet::builder().line("line", line.clone()).whatever_the_plan();
        let fleet = builder
            .drive("line", name.slave.number(), settings, |port, slave| {
                name.family.open_with(port, slave, options)
            })
            .start()
            .map_err(|error| input(&error))?;
        let Some(handle) = fleet.drives().pop() else { return Err(input(&"the fleet has no drive")) };
        Ok(Self {
            name,
            handle,
            events: fleet.events(),
            config,
            line,
            ending,
            has_started: false,
            is_quiet: false,
        })
    }

    /// What is known of the drive now.
    pub fn status(&self) -> Status {
        let snapshot = self.handle.snapshot();
        snapshot.status.as_ref().map(|status| Status::clone(&status.value)).unwrap_or_default()
    }

    /// Waits until the drive has answered, and then for what becomes of a command.
    pub async fn command(
        &mut self,
        command: impl AsyncFn(DriveHandle) -> Outcome,
    ) -> Result<Outcome, Failure> {
        self.connected().await?;
        own_line::told(self.name, &mut self.ending, undisturbed(&self.handle, command)).await
    }

    /// The same for a start: whoever asks the program to end before it is confirmed wants a motor that stands.
    pub async fn start(
        &mut self,
        command: impl AsyncFn(DriveHandle) -> Outcome,
    ) -> Result<(Started, Status), Failure> {
        self.connected().await?;
        self.has_started = true;
        let outcome = tokio::select! {
            biased;
            outcome = undisturbed(&self.handle, command) => Some(outcome),
            () = self.ending.asked() => None,
        };
        let why = match outcome {
            Some(Outcome::Started(started)) => return Ok((started, self.status())),
            Some(outcome @ (Outcome::Refused(_) | Outcome::Expired)) => return Err(self.failure(&outcome)),
            Some(outcome) => format!("the start is {outcome}"),
            None => "asked to end before the start was confirmed".to_owned(),
        };
        let (_, stopped) = self.stop(StopMode::Ramp).await.map_err(|failure| {
            Failure::Drive(format!("{failure}; it was to be stopped again, because {why}"))
        })?;
        Err(Failure::Drive(format!(
            "{}: {why}, so it was stopped again: the drive shows {stopped}",
            self.name
        )))
    }

    /// Waits until the program is asked to end, for whoever waits for something else beside it while the motor runs. Safe to drop.
    pub async fn asked_to_end(&mut self) {
        self.ending.asked().await;
    }

    /// Stops the motor and tells how that goes. Gives how it was stopped, and the status at standstill.
    ///
    /// A verdict comes in its time, whatever line and port do. Whoever asks the program to end gives up the stop of a motor that
    /// somebody else has started, and not that of one that was started here: whatever was asked before, this stop is its answer.
    pub async fn stop(&mut self, order: impl Into<StopOrder>) -> Result<(StopModes, Status), Failure> {
        let name = self.name;
        let stop = self.handle.stop(order);
        let mut watch = self.handle.watch();
        let mut seconds = interval_at(Instant::now() + SECOND, SECOND);
        let (mut waited, mut taken, mut is_alarm) = (0, false, false);
        while self.has_started && timeout(Duration::ZERO, self.ending.asked()).await.is_ok() {}
        let outcome = loop {
            tokio::select! {
                biased;
                outcome = stop.finished() => break outcome,
                () = self.ending.asked(), if taken || !self.has_started => {
                    return Err(Failure::Drive(match taken {
                        true => format!(
                            "{name}: asked to end while the motor came to its stop: the drive showed {}", self.status()
                        ),
                        false => format!("{UNCONFIRMED}. {name}: asked to end before it was confirmed"),
                    }));
                }
                Ok(()) = watch.changed() => {
                    let Some(pending) = watch.look().stop else { continue };
                    let was_taken = std::mem::replace(&mut taken, pending.taken);
                    let first = pending.taken && !was_taken;
                    if was_taken && !pending.taken {
                        let _ = self.say(format_args!(
                            "{name}: a run command came behind the stop: the drive shows {}, and it is sent again", self.status()
                        ));
                    }
                    if pending.alarm && !std::mem::replace(&mut is_alarm, pending.alarm) {
                        output::complain(format_args!(
                            "{UNCONFIRMED}. {name}: the drive shows {}; it is waited for all the same", self.status()
                        ));
                    }
                    if first {
                        self.tell_what_it_took().await;
                        // A reader who went away ends no stop.
                        let _ = self.say(format_args!(
                            "{name} is stopping ({} stop): the drive shows {}", pending.mode, self.status()
                        ));
                    }
                }
                _ = seconds.tick(), if !taken => {
                    waited += 1;
                    let sent = match self.handle.snapshot().stop.map_or(0, |stop| stop.attempts) {
                        0 => "not sent yet".to_owned(),
                        1 => "sent 1 time".to_owned(),
                        times => format!("sent {times} times"),
                    };
                    let _ = self.say(format_args!(
                        "{name} has not confirmed the stop after {waited} s, {sent}: it goes on"
                    ));
                }
            }
        };
        self.tell_what_it_took().await;
        match outcome {
            Outcome::Stopped(modes) => Ok((modes, self.status())),
            outcome @ Outcome::NotConfirmed(_) if taken => {
                Err(Failure::Drive(format!("{name} has taken the stop and does not stand: {outcome}")))
            }
            outcome => Err(Failure::Drive(format!("{UNCONFIRMED}. {}", self.failure(&outcome)))),
        }
    }

    /// Whether nothing can be sent.
    pub fn is_unsent(&self) -> bool {
        self.handle.snapshot().error.as_ref().is_some_and(|error| error.kind() == ErrorKind::NotSent)
    }

    /// Tells what a stop has taken besides: another mode's place, or the command from somebody else.
    async fn tell_what_it_took(&mut self) {
        while let Ok(Received::Event(Event { kind, .. })) = timeout(Duration::ZERO, self.events.recv()).await
        {
            if matches!(kind, EventKind::StopModeReplaced { .. } | EventKind::StopTookCommand(_)) {
                let _ = self.say(format_args!("{}: {kind}", self.name));
            }
        }
    }

    fn say(&self, text: fmt::Arguments<'_>) -> Result<(), Failure> {
        match self.is_quiet {
            true => output::complain(text),
            false => output::say(text)?,
        }
        Ok(())
    }

    async fn connected(&mut self) -> Result<(), Failure> {
        let answered = self.handle.wait_until(|snapshot| {
            snapshot.link == Link::Connected
                || snapshot
                    .error
                    .as_ref()
                    .is_some_and(|error| error.kind() != ErrorKind::NotSent && !is_disturbed(error))
        });
        let snapshot = tokio::select! {
            snapshot = timeout(CONNECTED_WITHIN, answered) => snapshot.unwrap_or_else(|_| self.handle.snapshot()),
            () = self.ending.asked() => {
                return Err(Failure::Drive(format!("{}: asked to end, and nothing was sent", self.name)));
            }
        };
        if snapshot.link == Link::Connected {
            return Ok(());
        }
        Err(Failure::Drive(match &snapshot.error {
            Some(error) => own_line::words(self.name, &self.config, error),
            None => format!("{} does not answer", self.name),
        }))
    }

    /// What a person reads of a command that is not confirmed.
    pub fn failure(&self, outcome: &Outcome) -> Failure {
        let (name, config) = (self.name, &self.config);
        Failure::Drive(match outcome {
            Outcome::Refused(Refused::Drive(error)) => own_line::words(name, config, error),
            Outcome::OutcomeUnknown(Unknown { error: Some(error), last, .. }) => {
                format!("{}{}", own_line::words(name, config, error), seen(last.as_ref()))
            }
            outcome => format!("{name}: {outcome}"),
        })
    }

    /// Closes the port, if it lets itself be closed.
    pub async fn close(self) {
        own_line::close(&self.line).await;
    }
}

/// What becomes of a command. One that is refused because an answer was damaged, or in doubt because this host was away for a
/// moment, is given again for as long as a drive has to answer: nothing was sent.
async fn undisturbed(handle: &DriveHandle, command: impl AsyncFn(DriveHandle) -> Outcome) -> Outcome {
    let until = Instant::now() + CONNECTED_WITHIN;
    loop {
        match command(handle.clone()).await {
            Outcome::Refused(Refused::Drive(error)) if is_disturbed(&error) && Instant::now() < until => {}
            outcome => return outcome,
        }
    }
}

/// Whether somebody answered, and not so that it can be believed.
const fn is_disturbed(error: &Error) -> bool {
    matches!(error, Error::Port { problem: PortError::Damaged(_) | PortError::Mismatch(_), .. })
}

fn seen(last: Option<&LastSeen>) -> String {
    last.map_or_else(String::new, |last| format!("; it was last seen {last}"))
}

#[cfg(test)]
mod tests {
    use drive_core::{Direction, Frequency, SerialSettings, SlaveAddress, State};
    use drive_families::{Family, SetUp, simulated};
    use drive_sim::{SimLine, Wiring};
    use drive_testing::witness::Witnesses;
    use tokio::time::sleep;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_start_that_is_given_up_at_any_moment_leaves_no_motor_running() {
        for family in Family::BUILT_IN {
            let mut taken_back = 0;
            for after in (0..1_500).step_by(50).map(Duration::from_millis) {
                let settings: SerialSettings = family.capabilities().factory;
                let simulated = SimLine::new(Wiring::rtu(settings));
                let machine =
                    simulated.add_boxed(1, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap();
                let config = LineConfig { offline_after: 0, ..LineConfig::stream(settings) };
                let line = Line::over(simulated.in_memory(), config.clone());
                let name = DriveName { family, slave: SlaveAddress::try_from(1).unwrap() };
                let options = simulated::options();
                let mut one = Commanded::over(name, line, config, &options, Vec::new()).unwrap();
                let mut witnesses = Witnesses::default();
                witnesses.attend_drive(&machine, &one.handle);
                let setpoint = Frequency::from_hertz(20);
                let held = one.command(async |drive| drive.set_setpoint(setpoint).await).await.unwrap();
                assert!(held.is_confirmed(), "{family}: {held}");
                one.ending.at(Instant::now() + after);
                let started = one.start(async |drive| drive.start(Direction::Forward).await).await;
                taken_back += usize::from(
                    started
                        .as_ref()
                        .is_err_and(|failure| failure.to_string().contains("so it was stopped again")),
                );
                sleep(Duration::from_secs(10)).await;
                assert_eq!(
                    machine.observe().running,
                    started.is_ok(),
                    "{family} after {after:?}: {started:?}"
                );
            }
            assert!(taken_back > 0, "{family}");
        }
    }

    /// Ctrl-C while the motor runs, once and again: the stop that answers it is sent and waited for.
    #[tokio::test(start_paused = true)]
    async fn the_stop_of_a_motor_that_was_started_here_is_waited_for_whatever_was_asked() {
        let family = Family::BUILT_IN[0];
        for line_is_lost in [false, true] {
            let settings: SerialSettings = family.capabilities().factory;
            let simulated = SimLine::new(Wiring::rtu(settings));
            let machine =
                simulated.add_boxed(1, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap();
            let config = LineConfig { offline_after: 0, ..LineConfig::stream(settings) };
            let line = Line::over(simulated.in_memory(), config.clone());
            let name = DriveName { family, slave: SlaveAddress::try_from(1).unwrap() };
            let mut one = Commanded::over(name, line, config, &simulated::options(), Vec::new()).unwrap();
            let setpoint = Frequency::from_hertz(20);
            let held = one.command(async |drive| drive.set_setpoint(setpoint).await).await.unwrap();
            assert!(held.is_confirmed(), "{held}");
            one.start(async |drive| drive.start(Direction::Forward).await).await.unwrap();
            one.ending.at(Instant::now() + SECOND);
            one.asked_to_end().await;
            // Before the stop is begun, or while it is not taken.
            one.ending.at(Instant::now() + if line_is_lost { SECOND } else { Duration::ZERO });
            if line_is_lost {
                machine.mute();
                let back = machine.clone();
                tokio::spawn(async move {
                    sleep(2 * SECOND).await;
                    back.unmute();
                });
            }
            let stopped = one.stop(StopMode::Ramp).await;
            let told = stopped.map_or_else(|failure| failure.to_string(), |_| String::new());
            assert!(!told.contains(UNCONFIRMED), "{told}");
            assert!(line_is_lost || told.is_empty(), "{told}");
            sleep(Duration::from_secs(10)).await;
            assert!(!machine.observe().running);
        }
    }

    #[tokio::test(start_paused = true)]
    async fn the_trip_of_every_family_is_read_as_a_fault_and_reset() {
        for family in Family::BUILT_IN {
            let settings = family.capabilities().factory;
            let wire = SimLine::new(Wiring::rtu(settings));
            let config = LineConfig { offline_after: 0, ..LineConfig::stream(settings) };
            let machine = wire.add_boxed(1, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap();
            let line = Line::over(wire.in_memory(), config.clone());
            let slave = SlaveAddress::try_from(1).unwrap();
            let mut drive = family.open_with(line.slave(1), slave, &simulated::options());
            assert!(!drive.status().await.unwrap().is_fault(), "{family}");
            machine.trip(family.simulated_trip().unwrap());
            assert_eq!(drive.status().await.unwrap().state, State::Fault, "{family}");
            assert_eq!(drive.faults().await.unwrap().present.len(), 1, "{family}");
            let name = DriveName { family, slave };
            let mut one = Commanded::over(name, line, config, &simulated::options(), Vec::new()).unwrap();
            // Where any word of the bus takes the command, a stop takes it: a reset is no way to.
            one.stop(drive_core::StopMode::Ramp).await.unwrap();
            let outcome = one.command(async |drive| drive.reset_faults().await).await.unwrap();
            assert!(outcome.is_confirmed() && !one.status().is_fault(), "{family}: {outcome}");
        }
    }
}
