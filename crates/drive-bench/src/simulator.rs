//! The simulator as a process of its own: what it costs is not the master's, and it never waits for the master.
//!
//! It serves lines on ptys, says their paths on its standard output, and then answers one [`Order`] a line with one
//! line of JSON. The end of its standard input is its end.

use std::{
    env::temp_dir,
    io::{self, BufRead, Write},
    path::PathBuf,
    process,
    time::Duration,
};

use drive_core::serial::SerialSettings;
use drive_sim::{LineStats, SimLine, Wiring, models::atv312::Atv312};
use serde::{Deserialize, Serialize};
use tokio::time::Instant;

use crate::{Error, usage};

/// The slave's time to answer in every measurement on a paced line.
pub(crate) const TURNAROUND: Duration = Duration::from_millis(5);

/// The lines that are wanted.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Plant {
    pub(crate) lines: u16,
    /// On each line, from address 1 on.
    pub(crate) drives: u8,
    /// Characters and turnaround take no time.
    pub(crate) unpaced: bool,
}

/// What the measuring process wants.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) enum Order {
    /// The numbers of each line since they were last taken.
    Take,
    /// The requests of each line that its drives remember, in the order of their first bits.
    Log,
    /// These drives of one line go mute.
    Mute { line: usize, drives: Vec<u8> },
}

/// The numbers of one line.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct Counted {
    pub(crate) requests: u64,
    /// The shortest time that the exchanges can take.
    pub(crate) ideal: Duration,
    /// From the first bit of the first request to t3.5 after the last character.
    pub(crate) taken: Duration,
    /// By how much the simulator delivered its answers late, in all.
    pub(crate) late: Duration,
    pub(crate) shortest_silence: Option<Duration>,
    /// Silences shorter than t3.5, pauses inside a frame, collisions.
    pub(crate) violations: u64,
}

impl Counted {
    pub(crate) fn of(stats: &LineStats, t3_5: Duration) -> Self {
        let span = stats.first.zip(stats.last).map(|(first, last)| last.saturating_duration_since(first));
        Self {
            requests: stats.requests,
            ideal: stats.ideal,
            taken: span.unwrap_or_default() + t3_5,
            late: stats.lag,
            shortest_silence: stats.shortest_silence,
            violations: stats.violations,
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.requests += other.requests;
        self.ideal += other.ideal;
        self.taken += other.taken;
        self.late += other.late;
        self.shortest_silence = self.shortest_silence.into_iter().chain(other.shortest_silence).min();
        self.violations += other.violations;
    }

    /// The shortest time that the exchanges can take, by the time that they took.
    pub(crate) fn utilisation(&self) -> f64 {
        self.ideal.as_secs_f64() / self.taken.as_secs_f64()
    }

    /// The same without the simulator's own lateness.
    pub(crate) fn own_utilisation(&self) -> f64 {
        self.ideal.as_secs_f64() / self.taken.saturating_sub(self.late).as_secs_f64()
    }
}

/// One request that a drive took.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Logged {
    /// When its first bit was on the wire, on the clock that all processes share.
    pub(crate) at: Duration,
    pub(crate) function: u8,
}

/// What the simulator answers to any order.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Report {
    /// Only when the lines have just been made.
    pub(crate) ports: Vec<PathBuf>,
    pub(crate) counted: Vec<Counted>,
    pub(crate) logs: Vec<Vec<Logged>>,
    /// Processor time of the simulator so far.
    pub(crate) processor_time: Duration,
}

/// A line of ATV312 under bus control.
pub(crate) fn populated(drives: u8, unpaced: bool) -> Result<SimLine, Error> {
    let line = SimLine::new(Wiring { unpaced, ..Wiring::rtu(SerialSettings::MODBUS_DEFAULT) });
    for address in 1..=drives {
        let turnaround = if unpaced { Duration::ZERO } else { TURNAROUND };
        line.add(address, Atv312::under_bus_control())?.set_turnaround(Some(turnaround));
    }
    Ok(line)
}

/// Is the simulator, until the standard input ends.
pub(crate) fn serve(plant: &str) -> Result<(), Error> {
    let plant: Plant = serde_json::from_str(plant)?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let _inside = runtime.enter();
    let mut lines = Vec::new();
    let mut served = Vec::new();
    let mut ports = Vec::new();
    for number in 0..plant.lines {
        let line = populated(plant.drives, plant.unpaced)?;
        let port = temp_dir().join(format!("drive-bench-{}-{number}", process::id()));
        served.push(line.serve_pty(&port)?);
        lines.push(line);
        ports.push(port);
    }
    answer(&Report { ports, ..Report::default() })?;
    for order in io::stdin().lock().lines() {
        let mut report = Report::default();
        match serde_json::from_str(&order?)? {
            Order::Take => {
                let t3_5 = SerialSettings::MODBUS_DEFAULT.t3_5();
                report.counted = lines.iter().map(|line| Counted::of(&line.take_stats(), t3_5)).collect();
            }
            Order::Log => report.logs = lines.iter().map(log).collect(),
            Order::Mute { line, drives } => {
                let line = lines.get(line).ok_or("no such line")?;
                for drive in drives {
                    line.slave(drive).ok_or("no such drive")?.mute();
                }
            }
        }
        report.processor_time = usage::processor_time();
        answer(&report)?;
    }
    Ok(())
}

fn answer(report: &Report) -> Result<(), Error> {
    let mut out = io::stdout().lock();
    serde_json::to_writer(&mut out, report)?;
    out.write_all(b"\n")?;
    Ok(out.flush()?)
}

/// How many requests a simulated drive remembers.
const REMEMBERED: usize = 256;

fn log(line: &SimLine) -> Vec<Logged> {
    let (now, clock) = (Instant::now(), usage::monotonic());
    let settings = line.wiring().settings;
    let mut log = Vec::new();
    let mut complete_from = Duration::ZERO;
    for drive in line.slaves() {
        let received = drive.received();
        let requests = received.iter().map(|request| {
            let ended = clock.saturating_sub(now.saturating_duration_since(request.at));
            // What is noted is the last bit of the frame: address, PDU, CRC.
            let at = ended.saturating_sub(settings.characters(request.pdu.len() + 3));
            Logged { at, function: request.pdu.first().copied().unwrap_or_default() }
        });
        let known = log.len();
        log.extend(requests);
        if received.len() == REMEMBERED
            && let Some(first) = log.get(known)
        {
            complete_from = complete_from.max(first.at);
        }
    }
    log.retain(|request| request.at >= complete_from);
    log.sort_unstable_by_key(|request| request.at);
    log
}
