//! A pump station: three pumps into one pipe. Two share the flow at one setpoint, the third joins when they run near
//! their limit and leaves when they no longer do, and a pump that trips is replaced by the one that rests.
//!
//! ```console
//! $ cargo run -p examples --example pump_station                 # simulated: a day in forty seconds, and a trip
//! $ cargo run -p examples --example pump_station /dev/ttyUSB0    # Altivar 312 at 1 to 3, 19200 8E1
//! ```

use std::{error::Error, sync::Arc, time::Duration};

use drive_atv312::Atv312;
use drive_bus::{Line, LineConfig};
use drive_core::{Direction, Frequency, Reaction, SerialSettings, StopMode};
use drive_fleet::{
    DriveHandle, DriveSettings, EventKind, Fleet, FleetError, Outcome, Received, WatchdogContract,
};
use drive_sim::{SimLine, SimSlave, Wiring, models};
use futures_util::{StreamExt as _, future::BoxFuture, stream::FuturesUnordered};
use tokio::time::{interval, sleep};

const PUMPS: [&str; 3] = ["pump 1", "pump 2", "pump 3"];
/// What the pipe wants, hour by hour, in hertz of all pumps together.
const DEMAND: [u16; 10] = [56, 62, 76, 96, 108, 102, 84, 72, 60, 54];
/// Two pumps run up to this; above it the third joins.
const TWO_CARRY: u16 = 90;
const HOUR: Duration = Duration::from_secs(4);

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let port = std::env::args().nth(1);
    let config = LineConfig::serial(port.clone().unwrap_or_default(), SerialSettings::MODBUS_DEFAULT);
    let config = LineConfig { response_timeout: Duration::from_millis(200), ..config };
    let line = if port.is_some() {
        Line::open(config).await?
    } else {
        let (line, pumps) = simulated()?;
        tokio::spawn(trips_in_the_afternoon(pumps));
        line
    };
    let fleet = station(&line)?;
    for pump in fleet.drives() {
        pump.ready(Duration::from_secs(30)).await.map_err(|reason| format!("{}: {reason}", pump.name()))?;
    }
    // Heard at any moment, also while a pump comes down its ramp.
    let end = tokio::select! {
        () = run_the_day(&fleet) => "the day is over",
        _ = tokio::signal::ctrl_c() => "Ctrl-C",
    };
    println!("{end}, all stop: {}", fleet.stop_all(StopMode::Ramp).await);
    for (drive, action) in fleet.shutdown(Duration::from_secs(30)).await {
        println!("{drive}: {action}");
    }
    line.close().await;
    Ok(())
}

fn station(line: &Line) -> Result<Fleet, FleetError> {
    let mut station = Fleet::builder().line("station", line.clone());
    for (name, address) in PUMPS.into_iter().zip(1..) {
        // Should this program die, each pump stops by itself after 3 s.
        let watchdog = WatchdogContract { timeout: Duration::from_secs(3), reaction: Reaction::Ramp };
        let settings = DriveSettings { watchdog: Some(watchdog), ..DriveSettings::controlled(name) };
        station =
            station.drive("station", address, settings, |port, slave| Box::new(Atv312::new(port, slave)));
    }
    station.start()
}

/// Follows the demand until the day is over.
///
/// Nothing is awaited here but the next thing that happens: a command is on its way as soon as it is given, and what became
/// of it is one of the things that happen. So a trip is heard while another pump comes down its ramp. When this is dropped, the
/// starts that nobody has heard of are withdrawn, and the stops go on.
async fn run_the_day(fleet: &Fleet) {
    let mut events = fleet.events();
    let mut hours = DEMAND.into_iter();
    let mut clock = interval(HOUR);
    let pumps = fleet.drives().into_iter().map(|handle| Pump { handle, duty: Duty::Rests });
    let mut station =
        Station { pumps: pumps.collect(), demand: DEMAND[0], commands: FuturesUnordered::new() };
    loop {
        tokio::select! {
            _ = clock.tick() => match hours.next() {
                Some(next) => station.demand = next,
                None => return,
            },
            received = events.recv() => match received {
                Received::Event(event) if matches!(event.kind, EventKind::Tripped(_)) => {
                    println!("{} {}", event.drive, event.kind);
                    station.tripped(&event.drive);
                }
                Received::Event(_) | Received::Missed(_) => continue,
                Received::End => return,
            },
            Some(done) = station.commands.next() => if !station.is_done(done) {
                continue;
            },
        }
        station.share();
    }
}

/// What a pump is there for now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Duty {
    Rests,
    Works,
    /// It comes down its ramp, and can be started when it stands.
    Leaves,
    /// It is not started any more.
    Tripped,
}

struct Pump {
    handle: DriveHandle,
    duty: Duty,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asked {
    Setpoint,
    Start,
    Stop,
}

/// What became of a command.
type Done = (Arc<str>, Asked, Outcome);

struct Station {
    pumps: Vec<Pump>,
    demand: u16,
    /// What was asked of the pumps and is not known yet.
    commands: FuturesUnordered<BoxFuture<'static, Done>>,
}

impl Station {
    /// Shares the demand among as few healthy pumps as carry it, two at least, and rests the others.
    fn share(&mut self) {
        let wanted = if self.demand > TWO_CARRY { 3 } else { 2 };
        let can_work = |pump: &&Pump| matches!(pump.duty, Duty::Rests | Duty::Works);
        let working = self.pumps.iter().filter(can_work).count().min(wanted);
        let Some(pumps) = u16::try_from(working).ok().filter(|pumps| *pumps > 0) else {
            return println!("no pump is left");
        };
        let each = Frequency::from_hertz((self.demand / pumps).min(50));
        println!("the pipe wants {} Hz: {pumps} pumps at {each}", self.demand);
        let mut places = working;
        for pump in &mut self.pumps {
            let works = places > 0 && matches!(pump.duty, Duty::Rests | Duty::Works);
            places -= usize::from(works);
            let name = Arc::clone(pump.handle.name());
            match pump.duty {
                Duty::Works if works => {
                    let given = pump.handle.set_setpoint(each);
                    self.commands.push(Box::pin(async move { (name, Asked::Setpoint, given.await) }));
                }
                Duty::Rests if works => {
                    println!("  {name} joins");
                    pump.duty = Duty::Works;
                    let started = pump.handle.start_at(Direction::Forward, each);
                    self.commands.push(Box::pin(async move { (name, Asked::Start, started.await) }));
                }
                Duty::Works => {
                    println!("  {name} leaves");
                    pump.duty = Duty::Leaves;
                    self.commands.push(stop(pump));
                }
                Duty::Rests | Duty::Leaves | Duty::Tripped => {}
            }
        }
    }

    /// Takes what became of a command for true. Gives whether the demand is to be shared anew.
    fn is_done(&mut self, (name, asked, outcome): Done) -> bool {
        if !outcome.is_confirmed() {
            println!("  {name}: {outcome}");
        }
        let Some(pump) = self.pumps.iter_mut().find(|pump| *pump.handle.name() == name) else { return false };
        match (asked, outcome.is_confirmed(), pump.duty) {
            (Asked::Stop, true, Duty::Leaves) => {
                pump.duty = Duty::Rests;
                return true;
            }
            // It goes on being repeated; who asks again hears when it stands after all.
            (Asked::Stop, false, Duty::Leaves) => self.commands.push(stop(pump)),
            // The next hour tries again.
            (Asked::Start, false, Duty::Works) => pump.duty = Duty::Rests,
            _ => {}
        }
        false
    }

    /// Somebody has to look at a pump that has tripped.
    fn tripped(&mut self, name: &str) {
        for pump in self.pumps.iter_mut().filter(|pump| **pump.handle.name() == *name) {
            pump.duty = Duty::Tripped;
        }
    }
}

fn stop(pump: &Pump) -> BoxFuture<'static, Done> {
    let (name, stopped) = (Arc::clone(pump.handle.name()), pump.handle.stop(StopMode::Ramp));
    Box::pin(async move { (name, Asked::Stop, stopped.await) })
}

/// Three simulated pumps.
fn simulated() -> Result<(Line, Vec<SimSlave>), Box<dyn Error>> {
    let simulated = SimLine::new(Wiring::rtu(SerialSettings::MODBUS_DEFAULT));
    let mut pumps = Vec::new();
    for address in 1..=3 {
        pumps.push(simulated.add(address, models::atv312::Atv312::under_bus_control())?);
    }
    Ok((Line::over(simulated.in_memory(), LineConfig::stream(SerialSettings::MODBUS_DEFAULT)), pumps))
}

/// The first pump trips by an overcurrent.
async fn trips_in_the_afternoon(pumps: Vec<SimSlave>) {
    sleep(HOUR * 8).await;
    pumps[0].trip(OVERCURRENT);
}

/// The Altivar 312's code of an overcurrent (OCF).
const OVERCURRENT: u16 = 9;

/// The rules of the station, whichever branch of its loop is taken first: `select!` chooses by chance.
#[cfg(test)]
mod tests {
    use tokio::time::{Instant, sleep_until, timeout};

    use super::*;

    /// A trip is seen with the next status, half a second later at the most, and told to the others.
    const REACTION: Duration = Duration::from_secs(1);

    /// The trip comes in this hour, in which the third pump leaves.
    const AFTERNOON: usize = 6;

    #[tokio::test(start_paused = true)]
    async fn the_station_stays_awake_and_keeps_its_rules_in_every_run() {
        for run in 0..40 {
            let (line, machines) = simulated().unwrap();
            let fleet = station(&line).unwrap();
            for pump in fleet.drives() {
                pump.ready(Duration::from_secs(30)).await.unwrap();
            }
            let begin = Instant::now();
            let trip_at = begin + HOUR * 6 + Duration::from_millis(40) * run;
            tokio::join!(run_the_day(&fleet), async {
                for (number, demand) in DEMAND.into_iter().enumerate() {
                    if number == AFTERNOON {
                        sleep_until(trip_at).await;
                        machines[0].trip(OVERCURRENT);
                        others_carry_on(&fleet, run).await;
                    }
                    sleep_until(begin + HOUR * (u32::try_from(number).unwrap() + 1) - REACTION / 10).await;
                    assert!(number < AFTERNOON || !machines[0].observe().running, "a tripped pump rests");
                    carries(&fleet, &machines, demand, number >= AFTERNOON, run);
                }
            });
            assert!(fleet.stop_all(StopMode::Ramp).await.is_confirmed());
            assert!(machines.iter().all(|machine| !machine.observe().running));
            line.close().await;
        }
    }

    /// Soon after a trip those that are left carry on, though one of them may be on its ramp: the third pump works again, or
    /// the second does all it can.
    async fn others_carry_on(fleet: &Fleet, run: u32) {
        let [_, second, third] = PUMPS.map(|name| fleet.drive(name).unwrap());
        let all_it_can = Frequency::from_hertz(50).into();
        let carry_on = async {
            tokio::select! {
                _ = second.wait_until(|pump| pump.setpoint == Some(all_it_can)) => {}
                _ = third.wait_until(|pump| pump.started_here() && pump.stop.is_none()) => {}
            }
        };
        timeout(REACTION, carry_on).await.unwrap_or_else(|_| panic!("run {run}: nobody has noticed"));
    }

    /// At the end of an hour as few healthy pumps as carry its demand run, two at least, and each has its share.
    fn carries(fleet: &Fleet, machines: &[SimSlave], demand: u16, has_tripped: bool, run: u32) {
        let wanted = if demand > TWO_CARRY && !has_tripped { 3 } else { 2 };
        let each = Frequency::from_hertz((demand / wanted).min(50));
        let running: Vec<_> = fleet
            .drives()
            .into_iter()
            .zip(machines)
            .filter(|(_, machine)| machine.observe().running)
            .collect();
        assert_eq!(running.len(), usize::from(wanted), "run {run}, {demand} Hz");
        for (pump, _) in running {
            assert_eq!(
                pump.snapshot().setpoint,
                Some(each.into()),
                "run {run}, {demand} Hz: {}",
                pump.name()
            );
        }
    }
}
