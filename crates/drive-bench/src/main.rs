//! `drive-bench`: what a line costs and keeps, measured against simulated drives that pace like a real line and record
//! every silence. See the README for what each row means.

#![forbid(unsafe_code)]

mod awake;
mod cpu;
mod dead;
mod doors;
mod far_end;
mod faults;
mod first_look;
mod fleet;
mod growth;
mod ledger;
mod lines;
mod machine;
mod masters;
mod parts;
mod peers;
mod plot;
mod queued;
mod report;
mod rig;
mod simulator;
mod spinning;
mod stop;
mod strangers;
mod usage;
mod utilisation;
mod virtual_line;

use std::{ffi::OsString, path::PathBuf, process::ExitCode, time::Duration};

use clap::{Parser, ValueEnum};

use crate::report::{Report, Unit};

/// What can be measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Section {
    /// Utilisation and silences of a saturated line of 31 drives, beside the masters of others.
    Utilisation,
    /// Where the time of a saturated line goes that is neither an exchange nor a silence.
    Parts,
    /// The wait of a Stop behind saturated polling.
    Stop,
    /// The sweep of 28 living drives with 3 dead ones on the line.
    Dead,
    /// Processor time of one transaction on a pty without pacing.
    Cpu,
    /// Many lines in one process, on ptys.
    Lines,
    /// From one line to a thousand in one process, the drives in the same process.
    Growth,
    /// A whole plant over a thousand lines of 31 drives: memory, processor, ages, a stop of all of them.
    Fleet,
    /// Wrong values accepted as right, over every fault of the simulator.
    Faults,
    /// A gateway with a dead drive behind it, connections that replay or go mute, a process that stands still.
    Strangers,
    /// The wait of a stop at each door of the daemon while somebody attacks another; wants `drived` built beside this program.
    Doors,
    /// The same while a thousand read, ten thousand commands a second are offered, 256 clients of a gateway ask; and what these get.
    Loads,
    /// When the page's stop is usable and its first value there, near and far; wants `drived` built beside this program, and Chromium.
    FirstLook,
}

const EVERYTHING: [Section; 10] = [
    Section::Utilisation,
    Section::Parts,
    Section::Stop,
    Section::Dead,
    Section::Cpu,
    Section::Lines,
    Section::Growth,
    Section::Fleet,
    Section::Faults,
    Section::Strangers,
];

/// Measures a line of simulated drives.
#[derive(Debug, Parser)]
#[command(about, version)]
struct Arguments {
    /// What to measure; everything when nothing is named.
    #[arg(value_enum)]
    sections: Vec<Section>,
    /// One JSON object a row instead of the table.
    #[arg(long)]
    json: bool,
    /// How long each measurement in real time lasts, in seconds.
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u64).range(1..=86_400))]
    seconds: u64,
    /// How many transactions each measurement in virtual time has.
    #[arg(long, default_value_t = 100_000, value_parser = clap::value_parser!(u64).range(100..=1_000_000_000))]
    transactions: u64,
    /// How many lines in one process.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u16).range(1..=2_048))]
    lines: u16,
    /// Up to how many lines the growth, and a whole plant, is measured.
    #[arg(long, default_value_t = 1_000, value_parser = clap::value_parser!(u16).range(1..=4_096))]
    most_lines: u16,
    /// Where to draw the growth, as an SVG.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    doors: doors::Wanted,
    /// The seed of the faults.
    #[arg(long, default_value_t = 2_026)]
    seed: u64,
    /// Use a processor whenever nobody else wants it, until the standard input ends.
    #[arg(long, hide = true)]
    keep_awake: bool,
    /// Be another program, for as long as the process lives that has started this one.
    #[arg(long, hide = true, value_name = "PROGRAM", num_args = 1.., allow_hyphen_values = true)]
    with_me: Vec<OsString>,
    /// Be the simulator of another process, which says on the standard input what it wants.
    #[arg(long, hide = true, value_name = "PLANT")]
    simulate: Option<String>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if arguments.keep_awake {
        awake::spin();
        return ExitCode::SUCCESS;
    }
    if !arguments.with_me.is_empty() {
        eprintln!("drive-bench: {}", doors::plant::become_one_that_ends_with_me(&arguments.with_me));
        return ExitCode::FAILURE;
    }
    if let Some(plant) = &arguments.simulate {
        return match simulator::serve(plant) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("drive-bench: simulator: {error}");
                ExitCode::FAILURE
            }
        };
    }
    let sections = if arguments.sections.is_empty() { &EVERYTHING[..] } else { &arguments.sections };
    let mut report = Report::new(arguments.json);
    for section in sections {
        let measured = usage::Machine::now().and_then(|before| {
            measure(&mut report, *section, &arguments)?;
            let name =
                section.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned());
            let others = before.others_since()?;
            report.note(&name, "processors that other programs used meanwhile", Unit::Times, others);
            Ok(())
        });
        if let Err(error) = measured {
            eprintln!("drive-bench: {section:?}: {error}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

fn measure(report: &mut Report, section: Section, arguments: &Arguments) -> Result<(), Error> {
    let time = Duration::from_secs(arguments.seconds);
    match section {
        Section::Utilisation => utilisation::measure(report, time, arguments.transactions),
        Section::Parts => parts::measure(report, time),
        Section::Stop => stop::measure(report, time, arguments.transactions),
        Section::Dead => dead::measure(report, time),
        Section::Cpu => cpu::measure(report, time),
        Section::Lines => lines::measure(report, time, arguments.lines),
        Section::Growth => growth::measure(report, time, arguments.most_lines, arguments.plot.as_deref()),
        Section::Fleet => fleet::measure(report, time, arguments.most_lines),
        Section::Doors => doors::measure(report, &arguments.doors),
        Section::Loads => doors::measure_loads(report, &arguments.doors),
        Section::FirstLook => first_look::measure(report),
        Section::Faults => faults::measure(report, arguments.seed, arguments.transactions),
        Section::Strangers => strangers::measure(report),
    }
}

/// What may go wrong in a measurement.
type Error = Box<dyn std::error::Error + Send + Sync>;
