//! `drived init`: a first configuration, from a scan of a line.

use std::{
    fmt::Write as _,
    fs::OpenOptions,
    io::Write as _,
    path::{Path, PathBuf},
};

use drive_core::SlaveAddress;

use super::scan::{self, Answer, Found, Likeness};
use crate::{config::Config, failure::Failure, line_spec, logging::escaped, output};

/// Write a commented configuration from a scan of a line; nothing is written to any drive
///
/// Who answers is read as `drived scan` does. Every drive of it is only read by `drived run` until somebody sets
/// `control = true`. What is guessed stands there as a guess. Scan while the motors stand. Exit code 1 when nobody
/// answers, 2 when the file is there already.
#[derive(Debug, clap::Args)]
#[group(skip)]
pub(crate) struct Args {
    #[command(flatten)]
    scan: scan::Args,
    /// The file to write; one that is there is not touched
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    to: PathBuf,
    /// What the line is called
    #[arg(long, value_name = "NAME", default_value = "main")]
    name: String,
}

pub(crate) async fn run(args: Args) -> Result<(), Failure> {
    if args.to.symlink_metadata().is_ok() {
        return Err(there(&args.to));
    }
    let (mut found, mut answers) = (Found::default(), Vec::new());
    let (config, all) = scan::over(&args.scan, |slave, answer| {
        answers.push((slave, answer.clone()));
        found.note(slave, answer)
    })
    .await?;
    if !all {
        return Err(Failure::Drive("ended before every address was asked: no file is written".to_owned()));
    }
    let line = line_spec::written(&config);
    if !answers.iter().any(|(_, answer)| matches!(answer, Answer::Slave(alike) if !alike.is_empty())) {
        found.conclude(answers.len(), &line)?;
        return Err(Failure::Drive("no drive of a known family answers: no file is written".to_owned()));
    }
    write(&args.to, &text(&args.name, &line, &answers))?;
    // What cannot work, such as two families on a line that cannot share it, is said now and not at the first start.
    Config::load_workable(&args.to)?;
    let to = args.to.display();
    output::say(format_args!("{to} is written: name its drives, then drived check --config {to}"))
}

fn there(file: &Path) -> Failure {
    let file = file.display();
    Failure::Input(format!("{file} is there already, and not touched: name another by --to"))
}

/// Writes a new file. One that has come meanwhile is not touched either.
fn write(file: &Path, text: &str) -> Result<(), Failure> {
    let mut options = OpenOptions::new();
    let written =
        options.write(true).create_new(true).open(file).and_then(|mut file| file.write_all(text.as_bytes()));
    written.map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => there(file),
        _ => Failure::Input(format!("{} cannot be written: {error}", file.display())),
    })
}

/// The configuration. What a drive said stands in comments alone.
fn text(name: &str, line: &str, answers: &[(SlaveAddress, Answer)]) -> String {
    let (name, port) = (quoted(name), quoted(line));
    let time = chrono::Local::now().format("%Y-%m-%d %H:%M%:z");
    let mut text = format!(
        "# Written by drived init on {time}, from a scan of {}. Nothing was written to any drive.\n\
         # drived check --config FILE says what this means, drived plan --config FILE what the line will be like.\n\
         # Every drive is only read as long as it does not say control = true.\n\n\
         [lines.{name}]\nport = {port}\n",
        escaped(line)
    );
    for (slave, answer) in answers {
        // A string takes everything.
        let _ = match answer {
            Answer::Silence => Ok(()),
            Answer::Damaged(why) => {
                write!(text, "\n# At address {slave} something cannot be understood: {}.\n", escaped(why))
            }
            Answer::Slave(alike) => match &alike[..] {
                [] => write!(text, "\n# At address {slave} answers {}.\n", scan::describe(alike)),
                [first, others @ ..] => write!(text, "{}", drive(&name, *slave, first, others)),
            },
        };
    }
    text
}

fn drive(line: &str, slave: SlaveAddress, first: &Likeness, others: &[Likeness]) -> String {
    let says =
        first.says.as_ref().map(|says| format!(" It says it is {}.", escaped(says))).unwrap_or_default();
    let certainty = if first.certain {
        format!("# By its own words.{says}")
    } else if others.is_empty() {
        format!("# A GUESS by its registers: see its nameplate.{says}")
    } else {
        let others: Vec<String> = others.iter().map(|other| other.family.to_string()).collect();
        format!(
            "# A GUESS by its registers, it could be {} too: see its nameplate.{says}",
            others.join(" or ")
        )
    };
    format!(
        "\n{certainty}\n[[drives]]\nline = {line}\ndrive = \"{}@{slave}\"\nname = \"drive {slave}\"\n\
         # Commands may be given to it from here on, and its policies act:\n# control = true\n",
        first.family
    )
}

/// A text as a value or a key of TOML.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
