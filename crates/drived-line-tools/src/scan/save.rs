//! The configuration that a scan has found.

use std::{
    fmt::Write as _,
    fs::OpenOptions,
    io::Write as _,
    path::{Path, PathBuf},
};

use drive_core::SlaveAddress;

use super::{
    answer::{Answer, Likeness, described},
    found::Finds,
};
use drived_file::Config;
use drived_words::{failure::Failure, logging::escaped};

/// Where a configuration is written to.
#[derive(Debug)]
pub struct Save {
    pub file: PathBuf,
    /// What the line is called.
    pub name: String,
    /// The option that has named the file.
    pub option: &'static str,
}

impl Save {
    /// Refuses a file that is there, before anybody waits for a scan.
    pub(super) fn check(&self) -> Result<(), Failure> {
        if self.file.symlink_metadata().is_ok() { Err(self.there()) } else { Ok(()) }
    }

    fn there(&self) -> Failure {
        let (file, option) = (self.file.display(), self.option);
        Failure::Input(format!("{file} is there already, and not touched: name another by {option}"))
    }

    /// Writes a new file, and checks it as the daemon will.
    pub(super) fn write(&self, finds: &Finds, is_whole: bool) -> Result<String, Failure> {
        if !is_whole {
            return Err(Failure::Drive(
                "ended before every address was asked: no file is written".to_owned(),
            ));
        }
        let is_drive = |answer: &Answer| matches!(answer, Answer::Slave(alike) if !alike.is_empty());
        if !finds.all.iter().any(|(_, find)| is_drive(&find.answer)) {
            return Err(Failure::Drive("no drive of a known family answers: no file is written".to_owned()));
        }
        create(&self.file, &text(&self.name, finds)).map_err(|error| match error.kind() {
            // One that has come meanwhile is not touched either.
            std::io::ErrorKind::AlreadyExists => self.there(),
            _ => Failure::Input(format!("{} cannot be written: {error}", self.file.display())),
        })?;
        // What cannot work, such as two families on a line that cannot share it, is said now and not at the first start.
        Config::load_workable(&self.file)?;
        let to = self.file.display();
        Ok(format!("{to} is written: name its drives, then drived check --config {to}"))
    }
}

fn create(file: &Path, text: &str) -> std::io::Result<()> {
    OpenOptions::new().write(true).create_new(true).open(file)?.write_all(text.as_bytes())
}

/// The configuration. What a drive said stands in comments alone. A port has one speed: the settings at which fewer drives were
/// found stand in comments too.
fn text(name: &str, finds: &Finds) -> String {
    let mut lines: Vec<(String, Vec<(SlaveAddress, &Answer)>)> = Vec::new();
    for (trial, find) in &finds.all {
        let (line, found) = (finds.written(trial), (find.step.slave, &find.answer));
        match lines.iter_mut().find(|(other, _)| *other == line) {
            Some((_, finds)) => finds.push(found),
            None => lines.push((line, vec![found])),
        }
    }
    let drives = |finds: &[(SlaveAddress, &Answer)]| {
        finds.iter().filter(|(_, answer)| matches!(answer, Answer::Slave(alike) if !alike.is_empty())).count()
    };
    lines.sort_by_key(|(_, finds)| std::cmp::Reverse(drives(finds)));
    let time = chrono::Local::now().format("%Y-%m-%d %H:%M%:z");
    let mut text = format!(
        "# Written by drived on {time}, from a scan. Nothing was written to any drive.\n\
         # drived check --config FILE says what this means, drived plan --config FILE what the line will be like.\n\
         # Every drive is only read as long as it does not say control = true.\n"
    );
    for (index, (line, finds)) in lines.iter().enumerate() {
        let name = if index == 0 { name.to_owned() } else { format!("{name} {}", index + 1) };
        let section = section(&name, line, finds);
        if index == 0 {
            text.push_str(&section);
            continue;
        }
        // A string takes everything.
        let _ = write!(
            text,
            "\n# THE FOLLOWING DRIVES HAVE ANOTHER SPEED, FORMAT OR PROTOCOL than those above, and a port has one: set them to \
             the same,\n# and take the marks away and this line with its port, or give them a port of their own.\n"
        );
        for line in section.lines() {
            let _ = writeln!(text, "{}", if line.is_empty() { String::new() } else { format!("#: {line}") });
        }
    }
    text
}

/// A line and its drives.
pub(super) fn section(name: &str, line: &str, finds: &[(SlaveAddress, &Answer)]) -> String {
    let (name, port) = (quoted(name), quoted(line));
    let mut text = format!("\n[lines.{name}]\nport = {port}\n");
    for (slave, answer) in finds {
        let _ = match answer {
            Answer::Slave(alike) => match &alike[..] {
                [] => write!(text, "\n# At address {slave} answers {}.\n", described(alike)),
                [first, others @ ..] => write!(text, "{}", drive(&name, *slave, first, others)),
            },
            Answer::Damaged(_) | Answer::Two { .. } => {
                write!(text, "\n# At address {slave}: {}.\n", escaped(&answer.words()))
            }
        };
    }
    text
}

fn drive(line: &str, slave: SlaveAddress, first: &Likeness, others: &[Likeness]) -> String {
    let says = first.says().map(|says| format!(" It says it is {}.", escaped(&says))).unwrap_or_default();
    let doubt = first.doubt().map_or_else(String::new, |doubt| format!(", and {doubt}"));
    let certainty = if first.certain {
        format!("# By its own words.{says}")
    } else if others.is_empty() {
        format!("# A GUESS by its registers{doubt}: see its nameplate.{says}")
    } else {
        let others: Vec<String> = others.iter().map(|other| other.family.to_string()).collect();
        format!(
            "# A GUESS by its registers, it could be {} too{doubt}: see its nameplate.{says}",
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
