//! `drive-fire`: the attacks, one part or all of them.

#![forbid(unsafe_code)]

use std::{
    cell::Cell,
    env, fs, io,
    path::{Path, PathBuf},
    process::{self, ExitCode},
    thread,
    time::{Duration, Instant},
};

use clap::{Parser, Subcommand};
use drive_fire::{
    all, differential, fuzz,
    matrix::{self, story},
    model, mutation, program,
    report::{self, Told},
    sbom, soak,
};
use drive_testing::peers;

/// Attacks everything that stands, and says what was tried and what was found: by one part, or, where none is named, by all of them in
/// turn, one round or, with --minutes, round after round until they are over.
#[derive(Debug, Parser)]
struct Arguments {
    #[command(subcommand)]
    part: Option<Part>,
    /// Where the random numbers begin: the same seed, the same attack.
    #[arg(long, global = true, default_value_t = 1)]
    seed: u64,
    /// It ends after so many minutes, wherever it is.
    #[arg(long, global = true)]
    minutes: Option<u64>,
}

#[derive(Debug, Subcommand)]
enum Part {
    /// The fault matrix.
    Matrix {
        /// So many cells of each of its planes.
        #[arg(long, default_value_t = 500)]
        of_each: u64,
        /// One plane alone, by the letter of its cells: W, F, E, A, P.
        #[arg(long)]
        plane: Option<char>,
        /// One cell alone, as a find names it.
        #[arg(long)]
        cell: Option<String>,
        /// How many cells there are, and which cannot exist.
        #[arg(long)]
        census: bool,
        /// Against its planted defects, or one of them by its name; those in the line need `--features plants`.
        #[arg(long, num_args = 0..=1, default_missing_value = "")]
        plants: Option<String>,
    },
    /// Whatever takes bytes or text from outside.
    Fuzz {
        /// For so many seconds each.
        #[arg(long, default_value_t = 5)]
        seconds: u64,
        /// One target alone.
        #[arg(long)]
        target: Option<String>,
        /// One execution of it alone, as a find names it.
        #[arg(long, requires = "target")]
        execution: Option<u64>,
        /// One execution by the bytes of a file, whoever has chosen them.
        #[arg(long, requires = "target", conflicts_with = "execution")]
        bytes: Option<PathBuf>,
        /// Writes the bytes of 256 executions of it into this folder, for a fuzzer that coverage guides to begin with.
        #[arg(long, requires = "target", conflicts_with_all = ["execution", "bytes"])]
        corpus: Option<PathBuf>,
        /// Against its planted defects, or those that orders of events to one target are to find; those in the line and the fleet need
        /// `--features plants`.
        #[arg(long)]
        plants: bool,
        /// Each wrong line of the line and the fleet is hunted by so many orders of events.
        #[arg(long, default_value_t = fuzz::ORDERS)]
        orders: u64,
    },
    /// The built program from outside: its doors, and files that were changed.
    Program {
        /// Which; beside this one unless it is said.
        #[arg(long)]
        program: Option<PathBuf>,
        /// For so many seconds each target.
        #[arg(long, default_value_t = 20)]
        seconds: u64,
        /// One target alone, with `--execution`.
        #[arg(long, requires = "execution")]
        target: Option<String>,
        /// One execution alone, as a find names it.
        #[arg(long, requires = "target")]
        execution: Option<u64>,
        /// Whether what a wrong program would say is taken for wrong; with `--features plants` wrong lines in the program as well, all or
        /// those of a target, or one by its name.
        #[arg(long, num_args = 0..=1, default_missing_value = "")]
        plants: Option<String>,
        /// Its gateway beside this mbusd, for so many seconds.
        #[arg(long)]
        mbusd: Option<PathBuf>,
        /// Over ptys in real time, commanded all the time while its host misbehaves, for so many seconds or `--minutes`.
        #[arg(long, conflicts_with_all = ["target", "mbusd"])]
        ptys: bool,
    },
    /// Who accepts what: ours and somebody else.
    Differential {
        /// Who else.
        #[arg(long, value_enum, default_value = "pymodbus")]
        peer: differential::Peer,
        /// So many answers.
        #[arg(long, default_value_t = 100_000)]
        answers: u64,
        /// A Python that has pymodbus; for libmodbus any.
        #[arg(long, default_value = "python3")]
        python: std::path::PathBuf,
    },
    /// Random worlds, judged and shrunk.
    Worlds {
        /// So many stories.
        #[arg(long, default_value_t = 500)]
        stories: u64,
        /// One story alone, as a find names it.
        #[arg(long)]
        story: Option<String>,
        /// Against the planted defects of the matrix, or one of them by its name.
        #[arg(long, num_args = 0..=1, default_missing_value = "")]
        plants: Option<String>,
    },
    /// Mutants that a variable chooses, against the tests that own the promises they break.
    Mutants {
        /// Looks for a test by which each dies, and prints the list as it is to be: of one crate or one mutant, or of all.
        #[arg(long, num_args = 0..=1, default_missing_value = "")]
        hunt: Option<String>,
    },
    /// Days of a plant in virtual time.
    Soak {
        /// So many hours.
        #[arg(long, default_value_t = 24)]
        hours: u64,
        /// So many lines.
        #[arg(long, default_value_t = 8)]
        lines: usize,
        /// So many drives on each.
        #[arg(long, default_value_t = 31)]
        drives: u8,
        /// Commanded, and asked while it stands, so many times as seldom: a month of a large plant in an hour or two.
        #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=120))]
        calm: u32,
        /// A small one against each planted defect, or one of them by its name; those in the line and the fleet need `--features plants`.
        #[arg(long, num_args = 0..=1, default_missing_value = "")]
        plants: Option<String>,
    },
    /// The tests that could not run for want of something, when they were run last.
    Skipped,
    /// What a program is built of, as CycloneDX 1.5.
    Sbom {
        /// Its package.
        #[arg(long, default_value = "drived")]
        package: String,
    },
    /// Small cases explored to the end: the master of a line, a gateway, the lease, identities.
    Model {
        /// Which; all of them where none is named.
        name: Option<String>,
        /// Every sequence of so many steps.
        #[arg(long, default_value_t = 4)]
        depth: usize,
        /// One sequence alone, as a find names it.
        #[arg(long, requires = "setting")]
        steps: Option<String>,
        /// In which world.
        #[arg(long, requires = "name")]
        setting: Option<String>,
        /// Against the planted defects; those in the line need `--features plants`.
        #[arg(long)]
        plants: bool,
    },
}

/// The repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A cell that goes round in virtual time is named, and ends the program.
#[allow(clippy::disallowed_methods, reason = "a thread of its own, beside the runtime that may be stuck")]
fn end_what_is_stuck() {
    thread::spawn(|| {
        loop {
            thread::sleep(Duration::from_secs(5));
            if let Some(what) = report::stuck(Duration::from_secs(300)) {
                eprintln!("FOUND it does not end: {what}");
                process::exit(2);
            }
        }
    });
}

fn ended(result: io::Result<()>) -> ExitCode {
    let Err(error) = result else { return ExitCode::SUCCESS };
    eprintln!("{error}");
    ExitCode::FAILURE
}

fn found_nothing(told: &[Told]) -> ExitCode {
    if told.iter().all(|told| told.finds.is_empty()) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// What is given to the judge, and where the program has them its wrong lines.
fn program_plants(
    program: Option<&Path>,
    only: Option<&str>,
    go_on: impl FnMut() -> bool,
) -> io::Result<Vec<Told>> {
    let mut told = if only.is_none() {
        vec![program::find_plants(), program::find_plants_on_ptys()]
    } else {
        Vec::new()
    };
    if cfg!(feature = "plants") {
        let beside = || Ok(env::current_exe()?.with_file_name("drived"));
        let program = program.map_or_else(beside, |path: &Path| Ok::<_, io::Error>(path.to_owned()))?;
        told.push(program::find_plants_in(&program, only, go_on));
    }
    Ok(told)
}

fn main() -> ExitCode {
    let Arguments { part, seed, minutes } = Arguments::parse();
    let end = minutes.map(|minutes| Instant::now() + Duration::from_secs(60 * minutes));
    let go_on = move || end.is_none_or(|end| Instant::now() < end);
    end_what_is_stuck();
    let Some(part) = part else {
        let summary = all::run(seed, end, |line| println!("{}", line.trim_end()));
        print!("\n{summary}");
        return if summary.found() == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    };
    let told: Vec<Told> = match part {
        Part::Matrix { cell: Some(name), .. } => {
            let Some(cell) = matrix::Cell::named(&name) else {
                eprintln!("{name} is no cell: a letter of W, F, E, A, P, a colon and a number");
                return ExitCode::FAILURE;
            };
            println!("{cell}");
            if let Some(why) = cell.cannot_exist() {
                println!("it cannot exist: {why}");
            }
            println!("{:#?}", matrix::live(&cell, &*matrix::open(&cell)));
            return ExitCode::SUCCESS;
        }
        Part::Matrix { census: true, .. } => {
            matrix::census(3_000_000).iter().for_each(|line| println!("{line}"));
            return ExitCode::SUCCESS;
        }
        Part::Matrix { plants: Some(only), of_each, .. } => {
            let only = Some(&*only).filter(|only| !only.is_empty());
            vec![matrix::find_plants(seed, of_each as usize, only)]
        }
        Part::Matrix { of_each, plane, .. } => vec![matrix::run(seed, of_each, plane, go_on)],
        Part::Fuzz { target, execution, bytes, corpus, seconds, plants, orders } => {
            let only = target.as_deref().and_then(fuzz::Target::named);
            if target.is_some() && only.is_none() {
                eprintln!("it is none of {:?}", fuzz::Target::ALL);
                return ExitCode::FAILURE;
            }
            if plants {
                let told = fuzz::hunts(seed, orders, only);
                told.iter().for_each(|told| print!("{told}"));
                return found_nothing(&told);
            }
            if let Some((target, folder)) = only.zip(corpus) {
                return ended(target.write_corpus(seed, 256, &folder));
            }
            let once = match (only, execution, bytes.map(fs::read).transpose()) {
                (_, _, Err(error)) => return ended(Err(error)),
                (Some(target), Some(number), _) => Some(target.execute(number)),
                (Some(target), None, Ok(Some(bytes))) => Some(target.execute_on(&bytes)),
                _ => None,
            };
            if let Some(held) = once {
                println!("{held:?}");
                return ended(held.map_err(io::Error::other));
            }
            let targets = only.map_or(fuzz::Target::ALL.to_vec(), |only| vec![only]);
            vec![fuzz::run(&targets, seed, Duration::from_secs(seconds), go_on)]
        }
        Part::Program { plants: Some(only), program, .. } => {
            let only = Some(&*only).filter(|only| !only.is_empty());
            match program_plants(program.as_deref(), only, go_on) {
                Ok(told) => told,
                Err(error) => return ended(Err(error)),
            }
        }
        Part::Program { program, seconds, target, execution, mbusd, ptys, .. } => {
            let known =
                |name: &String| program::Target::ALL.into_iter().find(|known| format!("{known:?}") == *name);
            let only = target.as_ref().and_then(known).zip(execution);
            if target.is_some() && only.is_none() {
                eprintln!("it is none of {:?}", program::Target::ALL);
                return ExitCode::FAILURE;
            }
            let beside = || Ok(env::current_exe()?.with_file_name("drived"));
            let told = program.map_or_else(beside, Ok).and_then(|path| match mbusd {
                None if ptys => {
                    let end = end.unwrap_or_else(|| Instant::now() + Duration::from_secs(seconds));
                    program::on_ptys(&path, seed, || Instant::now() < end)
                }
                Some(mbusd) => program::beside_mbusd(&path, &mbusd, seed, Duration::from_secs(seconds)),
                None => {
                    let first = Cell::new(program::Target::ALL[0]);
                    let of_each = Duration::from_secs(seconds);
                    let round = program::Round { of_each, share: Duration::MAX, first: &first };
                    program::run(&path, seed, &round, only, go_on)
                }
            });
            match told {
                Ok(told) => vec![told],
                Err(error) => return ended(Err(error)),
            }
        }
        Part::Differential { peer, answers, python } => match differential::run(&python, peer, seed, answers)
        {
            Ok(told) => vec![told],
            Err(error) => {
                eprintln!("{}: {error}", python.display());
                return ExitCode::FAILURE;
            }
        },
        Part::Worlds { story: Some(line), .. } => {
            let Some(story) = story::Story::read(&line) else {
                eprintln!("{line} is no story");
                return ExitCode::FAILURE;
            };
            println!("{}", story.in_words());
            println!("{:#?}", matrix::tell(&story, &*matrix::drive_of(story.subject.family())));
            return ExitCode::SUCCESS;
        }
        Part::Worlds { plants: Some(only), stories, .. } => {
            let only = Some(&*only).filter(|only| !only.is_empty());
            vec![matrix::find_plants_by_stories(seed, stories as usize, only)]
        }
        Part::Worlds { stories, .. } => vec![story::run(seed, stories, go_on)],
        Part::Mutants { hunt: Some(only) } => {
            return ended(mutation::hunt(&root(), Some(&*only).filter(|only| !only.is_empty())));
        }
        Part::Mutants { hunt: None } => match mutation::run(&root(), 0, go_on) {
            Ok(told) => vec![told],
            Err(error) => return ended(Err(error)),
        },
        Part::Soak { plants: Some(only), .. } => {
            vec![soak::find_plants(seed, Some(&*only).filter(|only| !only.is_empty()))]
        }
        Part::Soak { hours, lines, drives, calm, .. } => {
            vec![soak::run(
                seed,
                soak::Size { lines, drives, time: Duration::from_secs(3_600 * hours), calm },
                go_on,
            )]
        }
        Part::Skipped => {
            let skipped = peers::skipped();
            skipped.iter().for_each(|line| println!("{line}"));
            println!("{} tests could not run", skipped.len());
            return ExitCode::SUCCESS;
        }
        Part::Sbom { package } => {
            return ended(sbom::bill(&root(), &package).map(|bill| println!("{bill:#}")));
        }
        Part::Model { name, depth, steps, setting, plants } => {
            let named = name.map(|name| model::Model::named(&name).ok_or(name)).transpose();
            let models = match named {
                Ok(model) => model.map_or(model::ALL.to_vec(), |model| vec![model]),
                Err(name) => {
                    eprintln!("{name} is none of {:?}", model::ALL);
                    return ExitCode::FAILURE;
                }
            };
            if let (Some(code), Some(setting), [model]) = (steps, setting, &models[..]) {
                println!("{:?}", model.again(&setting, &code));
                return ExitCode::SUCCESS;
            }
            let explore = |model| match plants {
                true => model::find_plants(model, depth),
                false => model::run(model, depth, go_on),
            };
            models.into_iter().map(explore).collect()
        }
    };
    told.iter().for_each(|told| print!("{told}"));
    found_nothing(&told)
}
