//! `drived poll`: reads the status of many drives on one line again and again.

mod json;
mod link;
mod summary;

use std::{
    collections::BTreeMap,
    time::{Duration, SystemTime},
};

use drive_bus::{Line, Stats};
use drive_core::{Drive, Error, ErrorKind, PortError, Status};
use drive_fleet::FEED_PART;
use tokio::{sync::mpsc, task::JoinSet, time};

use self::summary::Summary;
use drived_client::own_line;
use drived_plant::findings;
use drived_words::{
    drive_options::OptionArgs,
    drive_spec::{self, DriveName, DriveSpec},
    duration::Time,
    failure::Failure,
    line_spec::{self, LineSpec},
    output,
    signals::Ending,
};

/// Readings that may wait for a slow reader of our output; then the polls wait too.
const WAITING: usize = 1_024;

/// After how long a drive of which nothing was heard is named: longer than the attempts of one poll.
const UNHEARD: Duration = Duration::from_secs(2);

/// How long a drive is left alone when the line did not even send its poll.
const NOT_SENT_PAUSE: Duration = Duration::from_millis(100);

/// Poll the status of many drives on one line, and say how well it went; nothing is written
///
/// Between two polls each drive gets a frame for its communication watchdog, where that needs one. A drive's line is printed when what it says has changed. The summary counts the exchanges of the line, repeated ones
/// included. Exit code 1 when a drive has not answered once, however short the time was.
#[derive(Debug, clap::Args)]
pub struct Args {
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", help = line_spec::HELP)]
    line: LineSpec,
    /// Drives, such as atv312@1-10,12; may be given several times
    #[arg(long = "drive", value_name = "FAMILY@ADDRESSES", required = true)]
    drives: Vec<DriveSpec>,
    #[command(flatten)]
    options: OptionArgs,
    /// Time between two polls of one drive; 0: as fast as the line allows
    #[arg(long, value_name = "TIME", default_value = "1s")]
    period: Time,
    /// End after so many seconds instead of at Ctrl-C
    #[arg(long, value_name = "N")]
    seconds: Option<u32>,
    /// Print one JSON object per status and one for the summary
    #[arg(long)]
    json: bool,
}

/// What one poll of one drive brought.
struct Reading {
    name: DriveName,
    at: SystemTime,
    outcome: Result<Status, Error>,
}

pub async fn run(args: Args) -> Result<(), Failure> {
    let names = drive_spec::on_one_line(&args.drives).map_err(|error| Failure::Input(error.to_string()))?;
    let options = args.options.of(&names)?;
    let config = args.line.config(&names).map_err(|error| Failure::Input(error.to_string()))?;
    let mut ending = Ending::listen()?;
    let line = own_line::open_line(config.clone()).await?;

    let (readings, mut incoming) = mpsc::channel(WAITING);
    let mut polls = JoinSet::new();
    for &name in &names {
        let drive = own_line::open_drive(&line, name, &options);
        polls.spawn(poll(name, drive, args.period.0, readings.clone()));
    }
    let until = args.seconds.map(|seconds| time::Instant::now() + Duration::from_secs(u64::from(seconds)));
    let mut book = Book::default();
    let mut look = time::interval_at(time::Instant::now() + UNHEARD, UNHEARD);
    loop {
        tokio::select! {
            () = ending.asked() => break,
            () = reached(until) => break,
            _ = look.tick() => {
                for (name, text) in book.unheard(&names, &line.stats()) {
                    if !args.json {
                        output::say(format_args!("{name:<12} {text}"))?;
                    }
                }
            }
            Some(reading) = incoming.recv() => {
                if args.json {
                    output::say_as_it_is(json::reading(&reading))?;
                } else if let Some(text) = book.news(&reading) {
                    output::say(format_args!("{:<12} {text}", reading.name))?;
                }
                book.note(&reading);
            }
        }
    }
    let proposal = line_spec::proposal(&config, &line.stats());
    let (findings, why) = (findings::told(&line, &names), book.why(&line, &names));
    polls.shutdown().await;
    link::read_counters(&line, &names, &config).await;
    let stats = line.stats();
    own_line::close(&line).await;
    let summary = Summary::new(&names, &book.answered, &stats, &config);
    if args.json {
        output::say_as_it_is(json::summary(&summary))?;
    } else {
        output::say_table(summary.table())?;
        output::say(summary.of_line())?;
        for text in link::told(&summary).chain(findings).chain(proposal) {
            output::say(text)?;
        }
    }
    book.verdict(&names, &why)
}

async fn reached(until: Option<time::Instant>) {
    match until {
        Some(until) => time::sleep_until(until).await,
        None => std::future::pending().await,
    }
}

/// Polls one drive until nobody listens any more, and feeds its communication watchdog in between. Each drive has its own
/// loop, so that a mute one delays only itself.
async fn poll(name: DriveName, mut drive: Box<dyn Drive>, period: Duration, readings: mpsc::Sender<Reading>) {
    let mut due = time::Instant::now();
    let capability = drive.watchdog_capability();
    let mut watchdog = capability.and_then(|watchdog| watchdog.fixed());
    let mut is_read = capability.is_none_or(|watchdog| period * FEED_PART <= watchdog.min);
    loop {
        let outcome = drive.status().await;
        if outcome.is_ok() && !is_read {
            // As it is found it is fed; where nobody can read it there is nothing to feed but what the family always has.
            let found = drive.watchdog().await;
            is_read = !matches!(found, Err(Error::Port { .. }));
            watchdog = found.ok().and_then(|found| found.timeout).or(watchdog);
        }
        let pause = match &outcome {
            Err(Error::Port { problem: PortError::Offline { retry_in }, .. }) => {
                (*retry_in).max(NOT_SENT_PAUSE)
            }
            Err(error) if error.kind() == ErrorKind::NotSent => NOT_SENT_PAUSE,
            _ => Duration::ZERO,
        };
        let read = outcome.as_ref().ok().and_then(|status| status.at);
        let age = read.map(|read| read.elapsed()).unwrap_or_default();
        if readings.send(Reading { name, at: SystemTime::now() - age, outcome }).await.is_err() {
            return;
        }
        // A poll that took longer than the period is followed by the next at once, and none is made up for.
        due = (due + period).max(time::Instant::now() + pause);
        while let Some(feed_at) = watchdog.map(|time| time::Instant::now() + time / FEED_PART)
            && feed_at < due
        {
            time::sleep_until(feed_at).await;
            // Whether it was heard the next status tells.
            let _ = drive.keep_alive().await;
        }
        time::sleep_until(due).await;
    }
}

/// What the readings have told so far.
#[derive(Default)]
struct Book {
    /// What was printed last, and whether that was a failure.
    last: BTreeMap<DriveName, (String, bool)>,
    answered: BTreeMap<DriveName, u64>,
}

impl Book {
    /// What a person wants to know of a reading: nothing, when it says what the last one said. A drive that fails is told
    /// once, in whatever ways it goes on failing.
    fn news(&mut self, reading: &Reading) -> Option<String> {
        let (text, failed) = match &reading.outcome {
            Ok(status) => (status.to_string(), false),
            Err(error) => (error.to_string(), true),
        };
        match self.last.get(&reading.name) {
            Some((_, true)) if failed => return None,
            Some((last, _)) if *last == text => return None,
            _ => {}
        }
        self.last.insert(reading.name, (text.clone(), failed));
        Some(text)
    }

    /// The drives of which nothing is known yet, each once, and why.
    fn unheard(&mut self, names: &[DriveName], stats: &Stats) -> Vec<(DriveName, String)> {
        let owed = stats.far_end.map_or(0, |far_end| far_end.owed);
        let unheard: Vec<DriveName> =
            names.iter().copied().filter(|name| !self.last.contains_key(name)).collect();
        let told = unheard.into_iter().map(|name| {
            let asked = stats.slaves.get(&name.slave.number()).map_or(0, |slave| slave.sent);
            let text = match (asked, owed) {
                (_, 1..) => "no answer yet: a gateway may still be waiting for another drive (gateway=none where there is none)",
                (0, 0) => "not asked yet: its line has no time for it",
                (_, 0) => "no answer yet",
            };
            self.last.insert(name, (text.to_owned(), false));
            (name, text.to_owned())
        });
        told.collect()
    }

    fn note(&mut self, reading: &Reading) {
        if reading.outcome.is_ok() {
            *self.answered.entry(reading.name).or_default() += 1;
        }
    }

    /// Why drives do not answer, as far as their line has found that.
    fn why(&self, line: &Line, names: &[DriveName]) -> Vec<String> {
        let silent = names.iter().filter(|name| !self.answered.contains_key(name));
        silent.filter_map(|name| findings::why(line, *name)).collect()
    }

    fn verdict(&self, names: &[DriveName], why: &[String]) -> Result<(), Failure> {
        let silent = names.iter().filter(|name| !self.answered.contains_key(name));
        let silent: Vec<String> = silent.map(ToString::to_string).collect();
        if silent.is_empty() {
            return Ok(());
        }
        let next = match why {
            [] => "see that it is switched on, wired, and set to this address, speed and format".to_owned(),
            [why, ..] => why.clone(),
        };
        Err(Failure::Drive(format!("no status from {}: {next}", silent.join(", "))))
    }
}

#[cfg(test)]
mod tests {
    use drive_bus::{LineConfig, Protocol, protocol::AsciiSettings};
    use drive_core::{Reaction, SlaveAddress};
    use drive_families::{Family, Options, SetUp, simulated};
    use drive_sim::{LinkHabits, SimLine, Wiring};
    use tokio::time::sleep;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_poll_that_is_rarer_than_a_watchdog_wants_feeds_it_in_between() {
        let ascii = Protocol::Ascii(AsciiSettings::default());
        for (family, protocol, wired) in [
            (Family::ATV58, ascii, drive_sim::Protocol::Ascii),
            (Family::ATV58, Protocol::Rtu, drive_sim::Protocol::Rtu),
            (Family::ATV312, Protocol::Rtu, drive_sim::Protocol::Rtu),
            (Family::OMRON_3G3EV, Protocol::Rtu, drive_sim::Protocol::Rtu),
        ] {
            let settings = family.capabilities().factory;
            let simulated = SimLine::new(Wiring { protocol: wired, ..Wiring::rtu(settings) });
            let machine =
                simulated.add_boxed(1, simulated::model(family, SetUp::ForTheBus).unwrap()).unwrap();
            let config = LineConfig { protocol, ..LineConfig::stream(settings) };
            let line = Line::over(simulated.in_memory(), config);
            let name = DriveName { family, slave: SlaveAddress::try_from(1).unwrap() };
            let mut drive = own_line::open_drive(&line, name, &Options::default());
            // What the bus cannot set is as it is.
            let _ = drive.arm_watchdog(Duration::from_secs(2), Reaction::Trip).await;
            let (readings, mut incoming) = mpsc::channel(WAITING);
            let period = Duration::from_secs(25);
            let polls = tokio::spawn(poll(name, drive, period, readings));
            sleep(8 * period).await;
            assert_eq!(machine.observe().trip, None, "{family} {protocol:?}");
            let mut read = 0;
            while incoming.try_recv().is_ok_and(|reading| reading.outcome.is_ok()) {
                read += 1;
            }
            assert_eq!(read, 8, "{family} {protocol:?}");
            polls.abort();
            sleep(2 * period).await;
            assert!(machine.observe().trip.is_some(), "{family} {protocol:?}: nobody feeds it any more");
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_drive_that_acknowledges_too_late_is_told_so_with_the_setting_and_not_to_be_switched_on() {
        let settings = "19200 8O1".parse().unwrap();
        let wiring = Wiring { protocol: drive_sim::Protocol::UniTelway, ..Wiring::rtu(settings) };
        let simulated = SimLine::new(wiring);
        let machine =
            simulated.add_boxed(4, simulated::model(Family::ATV58, SetUp::ForTheBus).unwrap()).unwrap();
        // The manual of the card prints no time for an acknowledgement: any is lawful.
        let acknowledges_after = Some(Duration::from_millis(150));
        machine.set_link_habits(LinkHabits { acknowledges_after, ..LinkHabits::default() });
        let config = LineConfig { protocol: "unitelway".parse().unwrap(), ..LineConfig::stream(settings) };
        let line = Line::over(simulated.in_memory(), config);
        let name = DriveName { family: Family::ATV58, slave: SlaveAddress::try_from(4).unwrap() };
        let drive = own_line::open_drive(&line, name, &Options::default());
        let (readings, mut incoming) = mpsc::channel(WAITING);
        let polls = tokio::spawn(poll(name, drive, Duration::from_secs(1), readings));
        sleep(Duration::from_secs(15)).await;
        let mut book = Book::default();
        while let Ok(reading) = incoming.try_recv() {
            book.note(&reading);
        }
        polls.abort();
        let why = book.why(&line, &[name]);
        let told = book.verdict(&[name], &why).unwrap_err().to_string();
        assert!(told.contains("link-timeout=200ms") && !told.contains("switched on"), "{told}");
    }
}
