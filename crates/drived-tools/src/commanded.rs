//! The one drive that a subcommand commands: a fleet of one, so that it is commanded by the same rules as a plant's.

use std::{fmt, time::Duration};

use drive_bus::{Endpoint, Line, LineConfig};
use drive_core::{CONFIRMED_WITHIN, Error, ErrorKind, Frequency, Motion, PortError, Status, StopMode};
use drive_families::Options;
use drive_fleet::{
    DriveHandle, DriveSettings, Event, EventKind, Events, Fleet, LastSeen, Link, Outcome, PendingStop,
    Periods, Received, Refused, Snapshot, Started, StopModes, StopOrder, Timed, Times, Unknown,
};
use tokio::time::{Instant, MissedTickBehavior, interval_at, timeout};

use drived_client::{self as client, own_line};
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

/// What happens within this time is told at once.
const TOGETHER: Duration = Duration::from_millis(50);

/// From one status to the next, so that the motor is watched while it is commanded.
const PERIOD: Duration = Duration::from_millis(500);

/// How long a motor is looked after that was started again behind its stop, once it stands: whoever starts it by a cycle does so again
/// within it, unless the cycle is longer, which nobody can know.
pub const LOOKED_AFTER: Duration = Duration::from_secs(5);

/// How a motor was stopped.
#[derive(Debug)]
pub struct Stop {
    pub modes: StopModes,
    /// At standstill.
    pub status: Status,
    /// How often a run command came behind the stop after the drive had taken it.
    pub restarts: u32,
}

/// What is known of a stop that goes on.
#[derive(Debug, Default)]
struct Course {
    last: Option<PendingStop>,
    restarts: u32,
}

/// What is new of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum News {
    Taken,
    /// The drive is in operation again, though it had taken it.
    Restarted,
    Alarm,
}

impl Course {
    fn is_taken(&self) -> bool {
        self.last.is_some_and(|last| last.taken)
    }

    fn look(&mut self, now: PendingStop) -> impl Iterator<Item = News> + use<> {
        let before = self.last.replace(now);
        let was = |is: &dyn Fn(&PendingStop) -> bool| before.as_ref().is_some_and(is);
        let was_taken = was(&|stop| stop.taken);
        let restarts = before.map_or(0, |before| now.undone_since(&before));
        self.restarts += restarts;
        let news = [
            (restarts > 0).then_some(News::Restarted),
            (now.alarm && !was(&|stop| stop.alarm)).then_some(News::Alarm),
            (now.taken && !was_taken).then_some(News::Taken),
        ];
        news.into_iter().flatten()
    }
}

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
    #[cfg(test)]
    said: Vec<(Instant, String)>,
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
            #[cfg(test)]
            said: Vec::new(),
        })
    }

    /// The drive, for whoever looks at it while it is commanded.
    pub fn handle(&self) -> DriveHandle {
        self.handle.clone()
    }

    /// What is known of the drive now.
    pub fn status(&self) -> Status {
        let snapshot = self.handle.snapshot();
        snapshot.status.as_ref().map(|status| Status::clone(&status.value)).unwrap_or_default()
    }

    /// What it shows behind a command that is confirmed now: what it showed before says nothing of that. Where it says nothing more in time
    /// the last is all there is.
    pub async fn status_behind(&self) -> Status {
        let now = Instant::now();
        let is_younger = |snapshot: &Snapshot| snapshot.status.as_ref().is_some_and(|status| status.at > now);
        timeout(CONFIRMED_WITHIN, self.handle.wait_until(is_younger)).await.ok();
        self.status()
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
        let Stop { status, .. } = self.stop(StopMode::Ramp).await.map_err(|failure| {
            Failure::Drive(format!("{failure}; it was to be stopped again, because {why}"))
        })?;
        Err(Failure::Drive(format!(
            "{}: {why}, so it was stopped again: the drive shows {status}",
            self.name
        )))
    }

    /// Waits until the program is asked to end, for whoever waits for something else beside it while the motor runs. Safe to drop.
    pub async fn asked_to_end(&mut self) {
        self.ending.asked().await;
    }

    /// Stops the motor and tells how that goes.
    ///
    /// A verdict comes in its time, whatever line and port do. Whoever asks the program to end gives up the stop of a motor that
    /// somebody else has started, and not that of one that was started here: whatever was asked before, this stop is its answer.
    ///
    /// A motor that was started again behind the stop is looked after once it stands, and one that is started time and again is no motor
    /// that was stopped.
    pub async fn stop(&mut self, order: impl Into<StopOrder>) -> Result<Stop, Failure> {
        let order = order.into();
        let mut restarts = 0;
        loop {
            let (modes, status) = self.stopped(order, &mut restarts).await?;
            if restarts > 1 {
                return Err(Failure::Drive(format!(
                    "{}: a run command came {restarts} times behind the stop{}, and the motor may run again: end it where it is given, \
                     such as at another master of the line, or use the emergency stop; the drive shows {status}",
                    self.name,
                    self.of_whom()
                )));
            }
            if restarts == 0 || !self.runs_again().await {
                return Ok(Stop { modes, status, restarts });
            }
            restarts += 1;
            self.say_restarted(&self.status());
        }
    }

    /// Whether the motor, which stands, is started within the time for which it is looked after.
    async fn runs_again(&mut self) -> bool {
        // It stood: whatever its words call a motor that has an output again, somebody has started it.
        let drives = self.handle.wait_until(|snapshot| {
            snapshot.status.as_ref().is_some_and(|Timed { value, .. }| {
                value.motion == Motion::Driven
                    || value.motion == Motion::Braking
                        && value.output_frequency.is_some_and(|output| output != Frequency::ZERO)
            })
        });
        tokio::select! {
            driven = timeout(LOOKED_AFTER, drives) => driven.is_ok(),
            () = self.ending.asked() => false,
        }
    }

    /// Whose the run commands behind a stop are.
    const fn of_whom(&self) -> &'static str {
        match self.has_started {
            true => ", from somebody else or kept back on its way",
            false => " from somebody else",
        }
    }

    async fn stopped(
        &mut self,
        order: StopOrder,
        restarts: &mut u32,
    ) -> Result<(StopModes, Status), Failure> {
        let name = self.name;
        let stop = self.handle.stop(order);
        let mut watch = self.handle.watch();
        let began = Instant::now();
        let mut seconds = interval_at(began + SECOND, SECOND);
        seconds.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let mut course = Course::default();
        let mut is_told_why = false;
        while self.has_started && timeout(Duration::ZERO, self.ending.asked()).await.is_ok() {}
        let outcome = 'stop: loop {
            tokio::select! {
                biased;
                outcome = stop.finished() => break outcome,
                () = self.ending.asked(), if course.is_taken() || !self.has_started => {
                    return Err(Failure::Drive(match course.is_taken() {
                        true => format!(
                            "{name}: asked to end while the motor came to its stop: the drive showed {}", self.status()
                        ),
                        false => format!("{UNCONFIRMED}. {name}: asked to end before it was confirmed"),
                    }));
                }
                Ok(()) = watch.changed() => {
                    let Some(pending) = watch.look().stop else { continue };
                    if let Some(why) = self.away().filter(|_| !is_told_why && pending.attempts == 0) {
                        is_told_why = true;
                        let whose = self.whose().await.map_or_else(String::new, |whose| format!("; {whose}"));
                        self.say(format_args!("{name}: the stop cannot be sent yet: {why}{whose}"));
                    }
                    let status = self.status();
                    for news in course.look(pending) {
                        match news {
                            News::Restarted => self.say_restarted(&status),
                            News::Alarm => {
                                // Where the stop ends with it, its verdict is the alarm.
                                if let Ok(outcome) = timeout(TOGETHER, stop.finished()).await {
                                    break 'stop outcome;
                                }
                                self.complain(format_args!(
                                    "{UNCONFIRMED}. {name}: the drive shows {status}; it is waited for all the same"
                                ));
                            }
                            News::Taken => {
                                self.tell_what_it_took().await;
                                // One that has tripped drives nothing, and does no stop by any mode.
                                match status.is_fault() {
                                    true => self.say(format_args!("{name} has taken the stop: the drive shows {status}")),
                                    false => self.say(format_args!(
                                        "{name} is stopping ({} stop): the drive shows {status}", pending.mode
                                    )),
                                }
                            }
                        }
                    }
                }
                _ = seconds.tick(), if !course.is_taken() => {
                    let waited = began.elapsed().as_secs();
                    let stop = self.handle.snapshot().stop;
                    let sent = stop.map_or_else(|| "not sent yet".to_owned(), |stop| stop.sent());
                    let why = self.away().map_or_else(String::new, |why| format!(" ({why})"));
                    self.say(format_args!("{name} has not confirmed the stop after {waited} s, {sent}{why}: it goes on"));
                }
            }
        };
        *restarts += course.restarts;
        self.tell_what_it_took().await;
        match outcome {
            Outcome::Stopped(modes) => Ok((modes, self.status())),
            outcome @ Outcome::NotConfirmed(_) if course.is_taken() => {
                Err(Failure::Drive(format!("{name} has taken the stop and does not stand: {outcome}")))
            }
            outcome => Err(Failure::Drive(format!("{UNCONFIRMED}. {}", self.failure(&outcome)))),
        }
    }

    fn say_restarted(&mut self, status: &Status) {
        let (name, whose) = (self.name, self.of_whom());
        self.say(format_args!(
            "{name}: a run command{whose} came behind the stop: the drive shows {status}, and it is sent again"
        ));
    }

    /// Why nothing can be sent, while the port of the line is away.
    fn away(&self) -> Option<String> {
        self.line.stats().port_away().map(str::to_owned)
    }

    /// Whose the port is, where somebody else has it. Whoever waits for a stop is told in time, or not.
    async fn whose(&self) -> Option<String> {
        let Endpoint::Serial(path) = &self.config.endpoint else { return None };
        timeout(SECOND, client::explain(path, Some(self.name))).await.ok().flatten()
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
                let name = self.name;
                self.say(format_args!("{name}: {kind}"));
            }
        }
    }

    fn say(&mut self, text: fmt::Arguments<'_>) {
        if self.is_quiet {
            return self.complain(text);
        }
        #[cfg(test)]
        self.said.push((Instant::now(), text.to_string()));
        // A reader who went away ends no stop.
        let _ = output::say(text);
    }

    fn complain(&mut self, text: fmt::Arguments<'_>) {
        #[cfg(test)]
        self.said.push((Instant::now(), text.to_string()));
        output::complain(text);
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
    use std::sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    };

    use drive_core::{Direction, SerialSettings, SlaveAddress, State};
    use drive_families::{Family, SetUp, simulated};
    use drive_sim::{Cast, Exception, Model, Observation, Panel, Rules, SimLine, SimSlave, Wiring};
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

    /// A drive whose motor its load holds: it does what it is told, and no ramp goes on.
    struct HeldByItsLoad(Box<dyn Model>, Arc<AtomicBool>);

    impl Model for HeldByItsLoad {
        fn rules(&self) -> &Rules {
            self.0.rules()
        }
        fn read(&mut self, address: u16) -> Result<u16, Exception> {
            self.0.read(address)
        }
        fn write(&mut self, address: u16, value: u16, cast: Cast) -> Result<(), Exception> {
            self.0.write(address, value, cast)
        }
        fn advance(&mut self, elapsed: Duration) {
            if !self.1.load(Ordering::Relaxed) {
                self.0.advance(elapsed);
            }
        }
        fn power(&mut self, on: bool) {
            self.0.power(on);
        }
        fn trip(&mut self, code: u16) {
            self.0.trip(code);
        }
        fn set_load(&mut self, percent: u16) {
            self.0.set_load(percent);
        }
        fn panel(&mut self, action: Panel) {
            self.0.panel(action);
        }
        fn observe(&self) -> Observation {
            self.0.observe()
        }
        fn peek(&self, address: u16) -> Option<u16> {
            self.0.peek(address)
        }
        fn poke(&mut self, address: u16, value: u16) -> bool {
            self.0.poke(address, value)
        }
        fn other(&mut self, request: &[u8]) -> Result<Vec<u8>, Exception> {
            self.0.other(request)
        }
    }

    /// An Altivar 312 whose motor runs, seen by whoever has not started it; and whether its load holds the motor.
    async fn running_312() -> (Commanded, SimSlave, Arc<AtomicBool>) {
        let settings: SerialSettings = Family::ATV312.capabilities().factory;
        let simulated = SimLine::new(Wiring::rtu(settings));
        let is_held = Arc::new(AtomicBool::new(false));
        let model = simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap();
        let machine = simulated.add_boxed(1, Box::new(HeldByItsLoad(model, Arc::clone(&is_held)))).unwrap();
        let config = LineConfig { offline_after: 0, ..LineConfig::stream(settings) };
        let line = Line::over(simulated.in_memory(), config.clone());
        let name = DriveName { family: Family::ATV312, slave: SlaveAddress::try_from(1).unwrap() };
        let mut one = Commanded::over(name, line, config, &simulated::options(), Vec::new()).unwrap();
        let setpoint = Frequency::from_hertz(20);
        assert!(one.command(async |drive| drive.set_setpoint(setpoint).await).await.unwrap().is_confirmed());
        one.start(async |drive| drive.start(Direction::Forward).await).await.unwrap();
        machine.wait_until(|seen| seen.output_frequency == 2_000).await;
        one.has_started = false;
        (one, machine, is_held)
    }

    fn times(one: &Commanded, what: &str) -> Vec<Instant> {
        one.said.iter().filter(|(_, text)| text.contains(what)).map(|(at, _)| *at).collect()
    }

    /// Another master climbs the chart and starts the motor: 0006h, 0007h, 000Fh (BBV51701, "CMD"), after a second and so often, with so
    /// much between.
    fn start_by_another(machine: &SimSlave, often: u32, every: Duration) {
        let machine = machine.clone();
        tokio::spawn(async move {
            sleep(SECOND).await;
            for _ in 0..often {
                for word in [0x0006, 0x0007, 0x000F] {
                    machine.written_by_another(8_501, word).unwrap();
                }
                sleep(every).await;
            }
        });
    }

    #[tokio::test(start_paused = true)]
    async fn a_motor_that_its_load_holds_though_the_drive_has_taken_the_stop_is_an_alarm_after_ten_seconds() {
        let (mut one, _machine, is_held) = running_312().await;
        is_held.store(true, Ordering::Relaxed);
        let began = Instant::now();
        let failure = one.stop(StopMode::Ramp).await.unwrap_err().to_string();
        assert!(failure.contains("has taken the stop and does not stand"), "{failure}");
        let [at] = times(&one, UNCONFIRMED)[..] else { panic!("{:?}", one.said) };
        let after = at - began;
        assert!((10 * SECOND..11 * SECOND).contains(&after), "{after:?}");
    }

    /// A serial port that is not there: at once, and with each second.
    #[tokio::test(start_paused = true)]
    async fn a_stop_that_cannot_be_sent_says_why_while_it_goes_on() {
        let family = Family::ATV312;
        let config = LineConfig::serial("/dev/no-such-port", family.capabilities().factory);
        let line = Line::start(config.clone()).unwrap();
        let name = DriveName { family, slave: SlaveAddress::try_from(1).unwrap() };
        let mut one = Commanded::over(name, line, config, &simulated::options(), Vec::new()).unwrap();
        let failure = one.stop(StopMode::Ramp).await.unwrap_err().to_string();
        assert!(failure.starts_with(UNCONFIRMED), "{failure}");
        const WHY: &str = "there is no serial port /dev/no-such-port";
        assert_eq!(times(&one, &format!("the stop cannot be sent yet: {WHY}")).len(), 1, "{:?}", one.said);
        assert_eq!(times(&one, UNCONFIRMED), [], "its verdict says so, and nothing before: {:?}", one.said);
        let seconds = times(&one, "has not confirmed the stop").len();
        assert!(seconds > 0, "{:?}", one.said);
        assert_eq!(
            times(&one, &format!("not sent yet ({WHY}): it goes on")).len(),
            seconds,
            "{:?}",
            one.said
        );
    }

    #[tokio::test(start_paused = true)]
    async fn a_run_command_that_comes_behind_a_stop_is_told_and_so_it_is_in_the_verdict() {
        let (mut one, machine, _) = running_312().await;
        start_by_another(&machine, 1, SECOND);
        let stop = one.stop(StopMode::Ramp).await.unwrap();
        assert_eq!((stop.restarts, times(&one, "a run command from somebody else").len()), (1, 1));
        assert!(!machine.observe().running);
    }

    /// A programmable controller that writes its run word by its cycle.
    #[tokio::test(start_paused = true)]
    async fn a_motor_that_somebody_else_starts_again_and_again_behind_its_stop_is_not_told_as_stopped() {
        for every in [SECOND, 3 * SECOND] {
            let (mut one, machine, _) = running_312().await;
            // ACC of 0.1 s (BBV51701): at its reference before the next status, it is not seen to speed up.
            assert!(machine.poke(9_001, 1));
            start_by_another(&machine, 60, every);
            let failure = one.stop(StopMode::Ramp).await.unwrap_err().to_string();
            assert!(failure.contains("run command"), "{every:?}: {failure}");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn direct_current_that_is_ended_at_standstill_is_no_run_command_of_somebody_else() {
        let (mut one, _machine, _) = running_312().await;
        let stop = one.stop(StopMode::DcInjection).await.unwrap();
        assert_eq!((stop.restarts, times(&one, "a run command").len()), (0, 0), "{:?}", one.said);
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
