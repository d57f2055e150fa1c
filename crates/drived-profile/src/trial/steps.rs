//! The steps, from what moves nothing to what starts the motor.

use std::time::Duration;

use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Drive, Frequency, Motion, Status, StopMode};
use drive_families::Options;
use drive_fleet::{DriveHandle, Order, Until};
use drive_profile::format::Reached;
use tokio::time::{Instant, sleep};

use drived_client::own_line::{open_drive, wait_at_most, words};
use drived_tools::commanded::{Commanded, Stop};
use drived_words::{
    drive_spec::DriveName,
    failure::Failure,
    output::{self, Table},
    signals::Ending,
};

use super::console::{Console, asked_to_end};

/// How long a person has until what he does at the panel shows.
const AT_THE_PANEL: Duration = Duration::from_secs(60);

/// From one look to the next.
const LOOK: Duration = Duration::from_millis(250);

/// How far from the setpoint an output may be that is at it, and above which it is not the one that was given.
const NEAR: Frequency = Frequency::from_hertz(1);
const ABOVE: Frequency = Frequency::from_hertz(2);
/// How long it stays there before anybody is asked.
const STAYS_FOR: Duration = Duration::from_secs(3);

/// A drive on its line, and what its owner says of it.
pub(super) struct Steps {
    pub name: DriveName,
    pub line: Line,
    pub config: LineConfig,
    pub options: Options,
    /// The speed of the start.
    pub lowest: Frequency,
}

impl Steps {
    /// Climbs as far as the profile lets, and notes what was seen. How far it came.
    ///
    /// # Errors
    /// A step was not right, or the drive does not answer: nothing further is done.
    pub(super) async fn climb(
        &self,
        console: &mut Console,
        seen: &mut Vec<String>,
    ) -> Result<Reached, Failure> {
        seen.push(self.read_all(console).await?);
        seen.push(self.watch_a_start(console).await?);
        let stops = !self.name.family.capabilities().stop_modes.is_empty();
        if !stops {
            console.say("the profile knows no stop: the trial ends here, with what was read")?;
            return Ok(Reached::Read);
        }
        // What listens to Ctrl-C while the drive is commanded ends its being the end of the program: so each question hears it from here.
        console.hear(Ending::listen_on_terminal()?);
        let (stopped, reached) = self.test_the_stop(console).await?;
        seen.push(stopped);
        match self.start_slowly(console).await? {
            Some(started) => {
                seen.push(started);
                Ok(Reached::Started)
            }
            None => Ok(reached),
        }
    }

    /// 1. Everything that can be read, for a person who compares it with the panel.
    async fn read_all(&self, console: &mut Console) -> Result<String, Failure> {
        console.say("1. Everything is read. Nothing is written.")?;
        let mut drive = self.drive();
        let status = drive.status().await.map_err(|error| self.failed(&error))?;
        console.say(format_args!("the drive shows {status}"))?;
        let (mut refused, mut read) = (0, Table::texts());
        let rows = drive.capabilities().rows;
        for row in rows {
            if !row.access.is_readable() {
                continue;
            }
            match drive.read_parameter(row).await {
                Ok(word) => read.row([format!("  {}", row.code), row.show(word), row.name.to_owned()]),
                Err(error) => {
                    refused += 1;
                    read.row([format!("  {}", row.code), "-".to_owned(), error.to_string()]);
                }
            }
        }
        output::say_table(read)?;
        self.agreed(console, "Does the panel show the same values, those of speed and current first?")
            .await?;
        Ok(match refused {
            0 => format!("all {} registers were read and agree with the panel", rows.len()),
            refused => format!(
                "what was read agrees with the panel; {refused} of {} registers were refused",
                rows.len()
            ),
        })
    }

    /// 2. A start from the panel, so that the states of the profile are seen before anything is written.
    async fn watch_a_start(&self, console: &mut Console) -> Result<String, Failure> {
        console.say("")?;
        console
            .ask("2. Start the motor slowly at the panel, where that can be done safely; then press Enter")
            .await?;
        let mut drive = self.drive();
        let running =
            self.until(console, &mut *drive, "started", |status| status.motion == Motion::Driven).await?;
        console.say(format_args!("the drive shows {running}"))?;
        self.agreed(console, "Does the panel show the same speed, and does the motor turn that way?").await?;
        console.ask("Stop it at the panel; then press Enter").await?;
        let rests = |status: &Status| status.motion.is_undriven() || status.motion == Motion::Held;
        let stands = self.until(console, &mut *drive, "stopped", rests).await?;
        console.say(format_args!("the drive shows {stands}"))?;
        self.agreed(console, "Does the motor stand?").await?;
        Ok("a start and a stop from the panel were seen in the states".to_owned())
    }

    /// 3. The stop, on a motor that somebody else has started.
    async fn test_the_stop(&self, console: &mut Console) -> Result<(String, Reached), Failure> {
        console.say("")?;
        console
            .ask(
                "3. Give the command to the bus at the drive, and start the motor slowly by whatever starts it then (another \
                 master, a terminal); or leave it at rest. Then press Enter: a stop is sent",
            )
            .await?;
        let mut drive = self.drive();
        let turned = drive.status().await.map_err(|error| self.failed(&error))?.motion == Motion::Driven;
        let mut one = self.commanded()?;
        let Stop { modes, status, .. } = one.stop(StopMode::Ramp).await?;
        console.say(format_args!("the stop is confirmed ({modes}): the drive shows {status}"))?;
        self.agreed(console, "Does the motor stand?").await?;
        Ok(match turned {
            true => ("a stop over the bus stopped a turning motor".to_owned(), Reached::Stopped),
            false => ("a stop over the bus was taken by a drive at rest".to_owned(), Reached::Read),
        })
    }

    /// 4. A start at the lowest speed, where the profile reaches motion.
    async fn start_slowly(&self, console: &mut Console) -> Result<Option<String>, Failure> {
        let key = self.name.family.capabilities().key;
        console.say("")?;
        let confirmed = console
            .ask(format_args!(
                "4. The motor is started by this program at {}. UNCOUPLE IT from its machine, see that nobody is near, and that \
                 the emergency stop works. Type {key} when that is so; anything else ends the trial here",
                self.lowest
            ))
            .await?;
        if confirmed != key {
            console.say("the motor is not started; what was seen so far is kept")?;
            return Ok(None);
        }
        let mut one = self.commanded()?;
        let order = Order::Start {
            direction: Direction::Forward,
            setpoint: Some(self.lowest.into()),
            until: Until::InForce,
        };
        let started = one.start(async |drive| drive.order(order).await).await;
        let (started, status) = match started {
            Ok(started) => started,
            Err(failure) => {
                let _ = one.stop(StopMode::Ramp).await;
                return Err(failure);
            }
        };
        // The motor runs by this program: nothing leads from here but by the stop, neither a terminal that is gone nor Ctrl-C.
        let said = console.say(format_args!("{started}: the drive shows {status}"));
        let drive = one.handle();
        let question =
            format!("Does the panel show {}, and does the motor turn that slowly, forward?", self.lowest);
        let looks = async {
            self.comes_to_it(&drive).await?;
            console.agrees(&question).await
        };
        let turns = tokio::select! {
            biased;
            () = one.asked_to_end() => Err(asked_to_end()),
            output = self.runs_away(&drive) => Err(self.is_not_it(output)),
            turns = looks => turns,
        };
        let Stop { status, .. } = one.stop(StopMode::Ramp).await?;
        said?;
        console.say(format_args!("stopped: the drive shows {status}"))?;
        if !turns? {
            return Err(not_right());
        }
        self.agreed(console, "Does the motor stand?").await?;
        Ok(Some(format!(
            "a start at {} turned the uncoupled motor forward, and a stop stopped it",
            self.lowest
        )))
    }

    /// The motor comes to the setpoint, as far as the drive tells its output. A scale of the profile that is not the drive's shows here
    /// and nowhere before: what was written reads back by the same scale.
    async fn comes_to_it(&self, drive: &DriveHandle) -> Result<(), Failure> {
        let (until, mut there_since) = (Instant::now() + AT_THE_PANEL, None);
        while let Some(output) = output_of(drive) {
            if Instant::now() >= until {
                return Err(self.is_not_it(output));
            }
            let is_there = output >= self.lowest.saturating_sub(NEAR);
            there_since = is_there.then(|| there_since.unwrap_or_else(Instant::now));
            // One that goes on passes it within that.
            if there_since.is_some_and(|since| since.elapsed() >= STAYS_FOR) {
                break;
            }
            sleep(LOOK).await;
        }
        Ok(())
    }

    /// Ends when the motor turns faster than it may by what was given.
    async fn runs_away(&self, drive: &DriveHandle) -> Frequency {
        loop {
            if let Some(output) =
                output_of(drive).filter(|output| *output > self.lowest.saturating_add(ABOVE))
            {
                return output;
            }
            sleep(LOOK).await;
        }
    }

    fn is_not_it(&self, output: Frequency) -> Failure {
        Failure::Drive(format!(
            "the output is {output} at a setpoint of {}: the scale of the one or the other is not this drive's. The motor was stopped, the \
             trial ends here, and nothing is signed. Mend the profile, and try it anew",
            self.lowest
        ))
    }

    fn drive(&self) -> Box<dyn Drive> {
        let mut drive = open_drive(&self.line, self.name, &self.options);
        wait_at_most(&mut *drive);
        drive
    }

    fn commanded(&self) -> Result<Commanded, Failure> {
        Commanded::over(self.name, self.line.clone(), self.config.clone(), &self.options, Vec::new())
    }

    /// Looks until a status is so; whoever was too early has it looked at again.
    async fn until(
        &self,
        console: &mut Console,
        drive: &mut dyn Drive,
        what: &str,
        is_so: impl Fn(&Status) -> bool,
    ) -> Result<Status, Failure> {
        let mut until = Instant::now() + AT_THE_PANEL;
        loop {
            let status = drive.status().await.map_err(|error| self.failed(&error))?;
            if is_so(&status) {
                return Ok(status);
            }
            if Instant::now() >= until {
                let why = format!(
                    "{}: it did not show within {AT_THE_PANEL:?}; the drive shows {status}: the states of the profile are not those \
                     of this drive, or it was not {what}",
                    self.name
                );
                let again = "Press Enter to have it looked at again; anything else ends the trial";
                if !console.ask(format_args!("{why}. {again}")).await?.is_empty() {
                    return Err(Failure::Drive(why));
                }
                until = Instant::now() + AT_THE_PANEL;
            }
            sleep(LOOK).await;
        }
    }

    async fn agreed(&self, console: &mut Console, question: &str) -> Result<(), Failure> {
        if console.agrees(question).await? { Ok(()) } else { Err(not_right()) }
    }

    fn failed(&self, error: &drive_core::Error) -> Failure {
        Failure::Drive(words(self.name, &self.config, error))
    }
}

fn output_of(drive: &DriveHandle) -> Option<Frequency> {
    drive.snapshot().status.as_ref().and_then(|status| status.value.output_frequency)
}

fn not_right() -> Failure {
    Failure::Drive(
        "what the profile says is not what this drive does: the trial ends here, and nothing is signed. Mend the profile, and try it anew"
            .to_owned(),
    )
}
