//! The log of a bad quarter of an hour, on ten simulated drives in virtual time.

use std::sync::{Mutex, PoisonError};

use drive_bus::LineConfig;
use drive_core::{Direction, Frequency, Reaction, SerialSettings, SlaveAddress, StopMode};
use drive_families::{Family, Options, SetUp, simulated};
use drive_fleet::{Commanders, DriveSettings, Fleet, Outcome, WatchdogContract};
use drive_sim::{Fault, SimLine, Wiring};
use drive_testing::witness::Witnesses;
use tokio::{
    io::{AsyncWriteExt, DuplexStream, copy_bidirectional, duplex},
    sync::watch,
    time::sleep_until,
};

use super::*;

/// How many drives the line has.
const DRIVES: u8 = 10;

/// A plug between the line and its port, which can be pulled.
struct Plug(watch::Sender<bool>);

impl Plug {
    fn pull(&self) {
        self.0.send_replace(false);
    }

    fn put(&self) {
        self.0.send_replace(true);
    }

    /// A stream to the simulated line while the plug is in.
    fn stream(plugged: &watch::Receiver<bool>, simulated: &SimLine) -> std::io::Result<DuplexStream> {
        if !*plugged.borrow() {
            return Err(std::io::Error::new(std::io::ErrorKind::NotFound, "No such device"));
        }
        let (ours, mut theirs) = duplex(4_096);
        let (mut line, mut plugged) = (simulated.in_memory(), plugged.clone());
        tokio::spawn(async move {
            tokio::select! {
                _ = copy_bidirectional(&mut theirs, &mut line) => {}
                _ = plugged.wait_for(|plugged| !plugged) => {}
            }
            let _ = theirs.shutdown().await;
        });
        Ok(ours)
    }
}

/// The lines of the log with their times since the start.
#[derive(Clone, Default)]
struct Told(Arc<Mutex<Vec<(Duration, Entry)>>>);

impl Told {
    fn all(&self) -> Vec<(Duration, Entry)> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn text(&self) -> String {
        let line = |(at, entry): &(Duration, Entry)| {
            let (seconds, tenths) = (at.as_secs(), at.subsec_millis() / 100);
            format!("{:02}:{:02}.{tenths} {:<5} {}\n", seconds / 60, seconds % 60, entry.level, entry.text)
        };
        self.all().iter().map(line).collect()
    }

    /// Exactly one line, at this level, has all these parts.
    #[track_caller]
    fn assert_once(&self, level: Level, parts: &[&str]) {
        let all = self.all();
        let with = |entry: &Entry| parts.iter().all(|part| entry.text.contains(part));
        let found: Vec<_> = all.iter().filter(|(_, entry)| with(entry)).map(|(_, entry)| entry).collect();
        assert!(matches!(found[..], [one] if one.level == level), "{parts:?}: {found:?} in\n{}", self.text());
    }
}

#[tokio::test(start_paused = true)]
async fn the_log_of_a_bad_quarter_of_an_hour_is_read_in_a_minute() {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let simulated = SimLine::new(Wiring::rtu(settings));
    let (plug, plugged) = watch::channel(true);
    let plug = Plug(plug);
    let mut machines = Vec::new();
    for address in 1..=DRIVES {
        let model = simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap();
        machines.push(simulated.add_boxed(address, model).unwrap());
    }
    let port = simulated.clone();
    let line = Line::over_reopened(
        move || std::future::ready(Plug::stream(&plugged, &port)),
        LineConfig { response_timeout: Duration::from_millis(200), ..LineConfig::stream(settings) },
    );
    let mut builder = Fleet::builder().line("north", line.clone());
    for address in 1..=DRIVES {
        let mut settings = DriveSettings::controlled(format!("pump {address}"));
        settings.commanders = Commanders::Only(vec!["operator".to_owned()]);
        // Pump 3 stops by itself when it hears nothing for ten seconds.
        settings.watchdog = (address == 3)
            .then_some(WatchdogContract { timeout: Duration::from_secs(10), reaction: Reaction::Ramp });
        builder = builder.drive("north", address, settings, |port, slave: SlaveAddress| {
            Family::ATV312.open_with(port, slave, &Options::default())
        });
    }
    let fleet = builder.start().unwrap();
    let _witnesses = Witnesses::of_fleet(&fleet, [("north", &simulated)]);
    let (start, told) = (Instant::now(), Told::default());
    let drives = fleet.drives();
    let heard = told.clone();
    let journal = tokio::spawn(keep(fleet.clone(), fleet.events(), move |entry| {
        heard.0.lock().unwrap_or_else(PoisonError::into_inner).push((start.elapsed(), entry));
    }));
    let at = |minutes: u64, seconds: u64| sleep_until(start + Duration::from_secs(minutes * 60 + seconds));
    let by = |commander: &str, address: usize| drives[address - 1].commanded_by(commander);

    at(0, 20).await;
    for address in 1..=6 {
        let pump = by("operator", address);
        assert_eq!(pump.set_setpoint(Frequency::from_hertz(30)).await, Outcome::Confirmed);
        assert!(pump.start(Direction::Forward).await.is_confirmed());
    }
    at(1, 0).await;
    // Half of the pumps are behind a terminal that comes loose.
    machines[2..7].iter().for_each(drive_sim::SimSlave::mute);
    at(1, 21).await;
    machines[2..7].iter().for_each(drive_sim::SimSlave::unmute);
    at(2, 30).await;
    machines[0].trip(9);
    at(3, 0).await;
    assert_eq!(by("operator", 1).reset_faults().await, Outcome::Confirmed);
    assert_eq!(by("operator", 1).set_setpoint(Frequency::from_hertz(30)).await, Outcome::Confirmed);
    assert!(by("operator", 1).start(Direction::Forward).await.is_confirmed());
    at(3, 30).await;
    machines[6].power(false);
    at(5, 0).await;
    plug.pull();
    at(5, 8).await;
    plug.put();
    at(6, 0).await;
    for address in [1, 2] {
        let pump = by("operator", address);
        assert_eq!(pump.reset_faults().await, Outcome::Confirmed);
        assert_eq!(pump.set_setpoint(Frequency::from_hertz(30)).await, Outcome::Confirmed);
        assert!(pump.start(Direction::Forward).await.is_confirmed());
    }
    at(7, 0).await;
    simulated.set_fault(Fault::Flipped, 100_000);
    at(8, 0).await;
    simulated.set_fault(Fault::Flipped, 0);
    at(9, 0).await;
    for _ in 0..60 {
        assert!(matches!(by("scada", 8).start(Direction::Forward).await, Outcome::Refused(_)));
        tokio::time::sleep(Duration::from_millis(990)).await;
    }
    at(10, 30).await;
    machines[1].mute();
    let stop = by("operator", 2);
    let stop = tokio::spawn(async move { stop.stop(StopMode::Ramp).await });
    at(11, 30).await;
    machines[1].unmute();
    assert!(!stop.await.unwrap().is_confirmed());
    at(13, 30).await;
    machines[6].power(true);
    at(14, 30).await;
    let _ = fleet.shutdown(Duration::from_secs(30)).await;
    drop((fleet, drives));
    journal.await.unwrap();

    let text = told.text();
    eprintln!("{text}");
    // What somebody who was called at night wants to know, each once.
    for (level, parts) in [
        (Level::INFO, &["north: connected: all 10 disabled, the shaft may coast"][..]),
        (Level::INFO, &["north: identified: all 10 TELEMECANIQUE ATV312HU15N4"]),
        (Level::INFO, &["north: pump 6: start forward by operator: confirmed"]),
        // The terminal that came loose: the first at once, the others together.
        (Level::WARN, &["pump 7 lost with output off: no answer for 2.9 s"]),
        (
            Level::ERROR,
            &["north: also lost, no answer for up to ", "pump 3, pump 4, pump 5, pump 6 at 30 Hz"],
        ),
        (
            Level::ERROR,
            &["north: back after up to 2", "pump 3 tripped: SLF, ", "by its communication watchdog"],
        ),
        (Level::ERROR, &["north: pump 7 back after 2", " s, tripped: SLF, "]),
        // A trip with its mnemonic, and its reset.
        (Level::ERROR, &["north: pump 1 tripped at 30 Hz: OCF, "]),
        // Dead for ten minutes.
        (Level::WARN, &["north: pump 7 lost while tripped: no answer for "]),
        (Level::INFO, &["north: pump 7 back after 10 min", "the shaft may coast"]),
        // The port: one line for the line and all that hangs on it, one for its return, one for what the drives did.
        (
            Level::ERROR,
            &[
                "line north lost: ",
                "No such device",
                "pump 1, pump 2 at 30 Hz",
                "pump 8, pump 9, pump 10 with output off",
            ],
        ),
        (Level::INFO, &["line north back after "]),
        (Level::ERROR, &["north: back after up to ", "pump 1", " running at 30 Hz", " tripped: SLF"]),
        // A noisy minute.
        (
            Level::WARN,
            &["line north: ", " answers damaged and ", " missing in the last minute, most of pump "],
        ),
        // Sixty refusals in a minute: three lines and a count.
        (
            Level::WARN,
            &[
                "pump 8: start forward by scada: refused: ",
                "may not command this drive (again 57 times in the last minute)",
            ],
        ),
        // A stop that cannot be confirmed, and that is confirmed at last.
        (
            Level::ERROR,
            &["north: pump 2: STOP NOT CONFIRMED, the motor may turn: ", "by operator: outcome unknown"],
        ),
        (Level::INFO, &["north: pump 2: stop confirmed after "]),
        (Level::INFO, &["north: at the exit: ", "pump 1 stopped", " left as before"]),
    ] {
        told.assert_once(level, parts);
    }
    // A line is read in two seconds; those of the commands, which say who did what, are not the trouble.
    let all = told.all();
    let trouble = all.iter().filter(|(_, entry)| !entry.text.contains(" by operator: confirmed")).count();
    assert!(trouble <= 30, "{trouble} lines:\n{text}");
    for (_, one) in &all {
        let same = all.iter().filter(|(_, other)| other.text == one.text).count();
        assert!(same <= 3, "{same} times {:?}", one.text);
    }
}

#[tokio::test(start_paused = true)]
async fn a_drive_that_a_reload_adds_is_told_of_by_its_line_and_name() {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let simulated = SimLine::new(Wiring::rtu(settings));
    for address in [1, 2] {
        simulated.add_boxed(address, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap();
    }
    let line = Line::over(simulated.in_memory(), LineConfig::stream(settings));
    let open = |port: drive_bus::Slave, slave: SlaveAddress| {
        Family::ATV312.open_with(port, slave, &Options::default())
    };
    let builder = Fleet::builder().line("north", line);
    let fleet = builder.drive("north", 1, DriveSettings::watched("pump 1"), open).start().unwrap();
    let (start, told) = (Instant::now(), Told::default());
    let heard = told.clone();
    let journal = tokio::spawn(keep(fleet.clone(), fleet.events(), move |entry| {
        heard.0.lock().unwrap_or_else(PoisonError::into_inner).push((start.elapsed(), entry));
    }));
    sleep_until(start + Duration::from_secs(10)).await;
    fleet.extend(|fleet| fleet.drive("north", 2, DriveSettings::watched("pump 2"), open)).unwrap();
    sleep_until(start + Duration::from_secs(20)).await;
    let _ = fleet.shutdown(Duration::from_secs(5)).await;
    journal.await.unwrap();
    told.assert_once(Level::INFO, &["north: connected: pump 2 disabled, the shaft may coast"]);
}

#[tokio::test(start_paused = true)]
async fn who_is_called_otherwise_or_is_on_a_line_that_is_has_not_been_away() {
    let settings = SerialSettings::MODBUS_DEFAULT;
    let simulated = SimLine::new(Wiring::rtu(settings));
    let machines = [1, 2].map(|address| {
        simulated.add_boxed(address, simulated::model(Family::ATV312, SetUp::ForTheBus).unwrap()).unwrap()
    });
    let open = |port: drive_bus::Slave, slave: SlaveAddress| {
        Family::ATV312.open_with(port, slave, &Options::default())
    };
    let line = || Line::over(simulated.in_memory(), LineConfig::stream(settings));
    let builder = Fleet::builder().line("north", line());
    let builder = builder.drive("north", 1, DriveSettings::watched("pump 1"), open);
    let fleet = builder.drive("north", 2, DriveSettings::watched("pump 2"), open).start().unwrap();
    let (start, told) = (Instant::now(), Told::default());
    let heard = told.clone();
    let journal = tokio::spawn(keep(fleet.clone(), fleet.events(), move |entry| {
        heard.0.lock().unwrap_or_else(PoisonError::into_inner).push((start.elapsed(), entry));
    }));
    let at = |seconds: u64| sleep_until(start + Duration::from_secs(seconds));
    at(10).await;
    // Lost by one name and heard again by the other: that is a return.
    machines[1].mute();
    at(40).await;
    fleet.rename("pump 2", DriveSettings::watched("fan")).unwrap();
    at(50).await;
    machines[1].unmute();
    at(120).await;
    // The line is called otherwise: its drives are taken out and come again.
    let _ = fleet.remove(&["pump 1", "fan"], Duration::from_secs(5)).await;
    fleet.remove_line("north").unwrap().close().await;
    let again = |builder: drive_fleet::FleetBuilder| {
        let builder = builder.line("hall", line());
        builder.drive("hall", 1, DriveSettings::watched("pump 1"), open)
    };
    fleet.extend(again).unwrap();
    at(140).await;
    let _ = fleet.shutdown(Duration::from_secs(5)).await;
    journal.await.unwrap();
    told.assert_once(Level::INFO, &["connected: pump 1 disabled"]);
    // By its own watchdog it has tripped meanwhile.
    told.assert_once(Level::ERROR, &["north: fan back after "]);
    told.assert_once(Level::ERROR, &[" back after "]);
}
