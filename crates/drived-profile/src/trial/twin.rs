//! A trial on the simulated drive that is made from the same file: no person, no line, no motor.

use std::{sync::Arc, time::Duration};

use drive_bus::{Line, LineConfig};
use drive_core::{
    Direction, Drive, Error, Frequency, Percent, Result, Setpoint, SlaveAddress, Speed, StopMode,
};
use drive_families::{Family, SetUp};
use drive_profile::{Level, Profile, definition};
use drive_sim::{Observation, SimLine, SimSlave, Wiring};
use drived_words::{failure::Failure, output};
use tokio::time::{Instant, sleep};

/// Where the twin is.
const ADDRESS: u8 = 1;

/// How long the motor may take to do what was ordered: the twin's ramp takes three seconds to 50 Hz.
const PATIENCE: Duration = Duration::from_secs(15);

/// The code of its trip, where its file names none.
const TRIP: u16 = 1;

/// Drives the twin of a profile as far as its level goes, and says of each order what it came to and what the motor did.
///
/// # Errors
/// An order did not come to what it was to.
pub(super) async fn try_on_twin(profile: Profile) -> std::result::Result<(), Failure> {
    let trip = profile.fault_entries().first().map_or(TRIP, |entry| entry.code);
    let mut twin = Twin::of(&profile)?;
    output::say(
        "on the simulated twin of the file: that shows that the file agrees with itself, and not that it is true; the drive alone shows that",
    )?;
    let status = twin.drive.status().await;
    let shown = status.as_ref().map_or_else(ToString::to_string, ToString::to_string);
    twin.tell("read", &status, || format!("the drive shows {shown}"))?;
    if profile.level() == Level::Watch {
        output::say("the file reaches watch: it is read, and no more")?;
        return twin.end(&profile);
    }
    if profile.level() == Level::Motion {
        twin.runs(&profile, trip).await?;
    } else {
        let stopped = twin.drive.stop(StopMode::Ramp).await;
        twin.tell("stop", &stopped, || "it is taken at rest".to_owned())?;
        if let Some(why) = profile.keeps_from(Level::Motion) {
            output::say(format_args!("no more is tried: {why}"))?;
        }
    }
    twin.end(&profile)
}

struct Twin {
    drive: Box<dyn Drive>,
    machine: SimSlave,
    /// Orders that did not come to what they were to.
    failed: usize,
    _line: SimLine,
}

impl Twin {
    fn of(profile: &Profile) -> std::result::Result<Self, Failure> {
        let family = Family::new(definition(&Arc::new(profile.clone())));
        let settings = family.capabilities().factory;
        let simulated = SimLine::new(Wiring::rtu(settings));
        let none = || Failure::Input("it has no simulated twin".to_owned());
        let model = family.machine(SetUp::ForTheBus).ok_or_else(none)?;
        let machine =
            simulated.add_boxed(ADDRESS, model).map_err(|error| Failure::Input(error.to_string()))?;
        let line = Line::over(simulated.in_memory(), LineConfig::stream(settings));
        let slave = SlaveAddress::try_from(ADDRESS).map_err(|error| Failure::Input(error.to_string()))?;
        let drive = family.open_with(line.slave(ADDRESS), slave, &family.simulated_options());
        Ok(Self { drive, machine, failed: 0, _line: simulated })
    }

    /// Started, turned round, stopped, tripped and reset.
    async fn runs(&mut self, profile: &Profile, trip: u16) -> std::result::Result<(), Failure> {
        let setpoint = self.setpoint();
        let set = self.drive.set_setpoint(setpoint).await;
        let unseen = matches!(set, Err(Error::NotConfirmed { .. }));
        let what = format!("setpoint {setpoint}");
        if unseen {
            let said = set.as_ref().err().map(ToString::to_string).unwrap_or_default();
            output::say(format_args!("{what}: {said}"))?;
        } else {
            self.tell(&what, &set, || "confirmed".to_owned())?;
        }
        for direction in [Direction::Forward, Direction::Reverse] {
            if self.drive.run_word_for(direction).is_none() {
                output::say(format_args!("start {direction}: the file does not say how"))?;
                continue;
            }
            let started = self.drive.start(direction).await;
            let verdict = started.as_ref().ok().and_then(|status| status.verdict);
            let turned = self.until(|seen| is_turning(seen, direction)).await;
            let verdict = verdict.map_or_else(String::new, |verdict| format!(", {verdict}"));
            self.tell(&format!("start {direction}"), &started, || format!("confirmed{verdict}"))?;
            self.holds(turned, &format!("the motor does not turn {direction}"))?;
        }
        let stopped = self.drive.stop(StopMode::Ramp).await;
        self.tell("stop", &stopped, || "confirmed".to_owned())?;
        let stands = self.until(|seen| !seen.running && seen.shaft_frequency == 0).await;
        self.holds(stands, "the motor does not stand")?;
        let started = self.drive.start(Direction::Forward).await;
        self.tell("start forward", &started, || "confirmed".to_owned())?;
        self.machine.trip(trip);
        let status = self.drive.status().await;
        let told = status.as_ref().is_ok_and(drive_core::Status::is_fault);
        self.tell("trip", &status, || "it is told".to_owned())?;
        self.holds(told, "the trip is not seen: the states of the file do not show it")?;
        if profile.file().reset.given().is_some() {
            let reset = self.drive.reset_faults().await;
            self.tell("reset", &reset, || "confirmed".to_owned())?;
            sleep(Duration::from_secs(1)).await;
            let stands = !self.machine.observe().running;
            self.holds(stands, "the motor was started by the reset")?;
        }
        Ok(())
    }

    /// A fifth of what the twin turns at the most, in the unit that the drive takes.
    fn setpoint(&self) -> Setpoint {
        let claims = self.drive.capabilities();
        if claims.speed_setpoint {
            Speed::from_rpm(300).into()
        } else if claims.share_setpoint {
            Percent::from_percent(20).into()
        } else {
            Frequency::from_hertz(10).into()
        }
    }

    /// Looks at the drive until the motor is so.
    async fn until(&mut self, is_so: impl Fn(&Observation) -> bool) -> bool {
        let until = Instant::now() + PATIENCE;
        while !is_so(&self.machine.observe()) {
            if Instant::now() >= until {
                return false;
            }
            // A look that fails is told by the next order.
            self.drive.status().await.ok();
            sleep(Duration::from_millis(50)).await;
        }
        true
    }

    fn tell<T>(
        &mut self,
        what: &str,
        result: &Result<T>,
        good: impl FnOnce() -> String,
    ) -> std::result::Result<(), Failure> {
        let seen = self.machine.observe();
        let motor = match (seen.running, seen.output_frequency) {
            (false, _) => "the motor is off".to_owned(),
            (true, output) => format!("the motor has {:.2} Hz", f64::from(output) / 100.0),
        };
        match result {
            Ok(_) => output::say(format_args!("{what}: {}; {motor}", good())),
            Err(error) => {
                self.failed += 1;
                output::say(format_args!("{what}: NOT AS IT SHOULD BE: {error}; {motor}"))
            }
        }
    }

    fn holds(&mut self, is_so: bool, otherwise: &str) -> std::result::Result<(), Failure> {
        if is_so {
            return Ok(());
        }
        self.failed += 1;
        output::say(format_args!("  NOT AS IT SHOULD BE: {otherwise}"))
    }

    fn end(self, profile: &Profile) -> std::result::Result<(), Failure> {
        if self.failed > 0 {
            let number = output::counted(self.failed, "thing is", "things are");
            return Err(Failure::Drive(format!(
                "{}: {number} not as it should be: the file contradicts itself; compare the states, what a start waits for, and `seen` of the stop",
                profile.name()
            )));
        }
        if let Some(gap) = profile.gaps().iter().find(|gap| gap.keeps_from.is_some()) {
            output::say(format_args!("next question, line {}: {} ({})", gap.line, gap.question, gap.what))?;
        }
        Ok(())
    }
}

fn is_turning(seen: &Observation, direction: Direction) -> bool {
    match direction {
        Direction::Forward => seen.running && seen.output_frequency > 0,
        Direction::Reverse => seen.running && seen.output_frequency < 0,
    }
}
