//! `drive-bench`: what a line costs and keeps, measured against simulated drives that pace like a real line and record
//! every silence. Times are real, so that a busy machine shows: run it alone.

mod cpu;
mod lines;
mod rig;
mod rivals;
mod stop;
mod sweep;
mod usage;
mod utilisation;

use std::{process::ExitCode, time::Duration};

use clap::{Parser, ValueEnum};

/// What can be measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum What {
    /// Utilisation of a saturated line of 31 drives, beside the stock tokio-modbus client.
    Utilisation,
    /// The wait of a Stop behind saturated polling.
    Stop,
    /// The sweep of 28 living drives with 3 dead ones on the line.
    Sweep,
    /// Processor time of one transaction on a pty without pacing.
    Cpu,
    /// Many lines in one process.
    Lines,
}

/// Measures a line of simulated drives.
#[derive(Debug, Parser)]
#[command(about, version)]
struct Arguments {
    /// What to measure; everything when nothing is named.
    #[arg(value_enum)]
    what: Vec<What>,
    /// How long each part measures, in seconds.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=86_400))]
    seconds: u64,
    /// How many lines in one process.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u16).range(1..=4_096))]
    lines: u16,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let everything = [What::Utilisation, What::Stop, What::Sweep, What::Cpu, What::Lines];
    let what = if arguments.what.is_empty() { &everything[..] } else { &arguments.what };
    let time = Duration::from_secs(arguments.seconds);
    println!("| Measured | Value | Goal |");
    println!("|---|---|---|");
    for what in what {
        let measured = match what {
            What::Utilisation => utilisation::measure(time),
            What::Stop => stop::measure(time),
            What::Sweep => sweep::measure(time),
            What::Cpu => cpu::measure(time),
            What::Lines => lines::measure(time, arguments.lines),
        };
        match measured {
            Ok(rows) => rows.iter().for_each(|row| println!("{row}")),
            Err(error) => {
                eprintln!("drive-bench: {what:?}: {error}");
                return ExitCode::FAILURE;
            }
        }
    }
    ExitCode::SUCCESS
}

/// One row of the table.
fn row(measured: impl AsRef<str>, value: impl AsRef<str>, goal: &str) -> String {
    format!("| {} | {} | {goal} |", measured.as_ref(), value.as_ref())
}

/// Parts per million as a share.
fn share(ppm: u64) -> String {
    format!("{}.{:04}", ppm / 1_000_000, ppm % 1_000_000 / 100)
}

/// A duration in milliseconds.
fn millis(duration: Duration) -> String {
    format!("{}.{:03} ms", duration.as_millis(), duration.as_micros() % 1_000)
}

/// What may go wrong in a measurement.
type Error = Box<dyn std::error::Error + Send + Sync>;
