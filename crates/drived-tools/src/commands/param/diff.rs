//! `drived param diff`: where the parameters of two drives, of two files, or of a drive and its factory setting differ.

use std::path::Path;

use drive_core::{
    Row,
    registers::{Form, Part},
};
use drive_families::Family;
use serde_json::{Value, json};

use super::{file::Backup, source::SourceArgs};
use drived_words::{
    failure::Failure,
    output::{self, Table},
};

/// Compare the parameters of two drives, two files, a file and a drive, or one of them and the factory setting
///
/// Settings are compared, in their units; what is measured or can only be read is not. Exit code 0: no difference; 1: they
/// differ, or one lacks what the other has; 2: they cannot be compared.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Each a file, a drive, or the word factory. A file alone is compared with the drive that it names, a drive alone with
    /// its factory setting
    #[arg(value_name = "FILE|DRIVE|factory", required = true, num_args = 1..=2)]
    sides: Vec<String>,
    /// Compare also address, speed and format of the line
    #[arg(long)]
    with_communication: bool,
    #[command(flatten)]
    source: SourceArgs,
}

/// What stands for the factory setting.
const FACTORY: &str = "factory";

/// What is compared, and what a person calls it.
struct Side {
    title: String,
    backup: Backup,
}

/// What one side has for a register.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Cell {
    /// The value, and its word.
    Holds(String, u16),
    /// It could not be read.
    Unread(String),
    Lacks,
}

/// A register in which they differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    pub row: &'static Row,
    pub sides: [Cell; 2],
}

/// What two sides have in common, and what not.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Comparison {
    pub differences: Vec<Difference>,
    /// Registers that are the same.
    pub same: usize,
    /// Registers for which the manual prints no number as factory setting, and those that could not be read.
    pub unjudged: Vec<Difference>,
}

pub(super) async fn run(args: Args) -> Result<(), Failure> {
    let [left, right] = sides(&args).await.map_err(trouble)?;
    let (one, other) = (left.backup.head.family, right.backup.head.family);
    if one != other {
        return Err(Failure::Input(format!("the families {one} and {other} have no parameters in common")));
    }
    let comparison = Comparison::of(&left.backup, &right.backup, args.with_communication);
    let said = match args.source.daemon.is_json() {
        true => output::say_as_it_is(comparison.json(&left.title, &right.title)),
        false => comparison.say(&left.title, &right.title),
    };
    said.map_err(trouble)?;
    match comparison.differences.len() {
        0 => Ok(()),
        1 => Err(Failure::Drive("1 parameter differs".to_owned())),
        several => Err(Failure::Drive(format!("{several} parameters differ"))),
    }
}

/// Exit code 1 says that they differ, and nothing else.
fn trouble(failure: Failure) -> Failure {
    match failure {
        Failure::Drive(_) | Failure::Output(_) => Failure::Input(failure.to_string()),
        failure => failure,
    }
}

async fn sides(args: &Args) -> Result<[Side; 2], Failure> {
    let (first, second) = match &*args.sides {
        [only] => (only, None),
        [first, second, ..] => (first, Some(second)),
        [] => return Err(Failure::Input("nothing to compare".to_owned())),
    };
    match (is_factory(first), second.map(|second| is_factory(second))) {
        (true, Some(true)) | (true, None) => {
            Err(Failure::Input("the factory setting of what? Name a drive or a file beside it".to_owned()))
        }
        (true, Some(false)) => {
            let right = side(args, second.unwrap_or(first)).await?;
            Ok([Side::factory(right.backup.head.family), right])
        }
        (false, other) => {
            let left = side(args, first).await?;
            let right = match (second, other) {
                (Some(second), Some(false)) => side(args, second).await?,
                (None, _) if is_file(first) => {
                    let named = args.source.of_file(&left.backup.head)?;
                    Side { title: named.name(), backup: args.source.read(&named).await? }
                }
                _ => Side::factory(left.backup.head.family),
            };
            Ok([left, right])
        }
    }
}

async fn side(args: &Args, word: &str) -> Result<Side, Failure> {
    let title = word.to_owned();
    if is_file(word) {
        return Ok(Side { title, backup: Backup::read(Path::new(word))? });
    }
    Ok(Side { title, backup: args.source.read(&args.source.one(word).await?).await? })
}

impl Side {
    fn factory(family: Family) -> Self {
        Self { title: FACTORY.to_owned(), backup: Backup::of_factory(family) }
    }
}

fn is_factory(word: &str) -> bool {
    word == FACTORY
}

/// Whether a word means a file: it is one, or is written as one.
fn is_file(word: &str) -> bool {
    let path = Path::new(word);
    path.is_file() || path.extension().is_some_and(|extension| extension == "toml")
}

impl Comparison {
    /// Compares the settings of two drives of one family; those of the line itself if that is wanted.
    pub fn of(left: &Backup, right: &Backup, with_communication: bool) -> Self {
        let capabilities = left.head.family.capabilities();
        let mut comparison = Self::default();
        for row in capabilities.rows {
            match capabilities.restoring.part(row) {
                Part::Setting | Part::ByHand(_) => {}
                Part::Communication if with_communication => {}
                _ => continue,
            }
            let sides = [left, right].map(|side| cell(side, row));
            let is_factory = [left, right].iter().any(|side| is_factory(&side.head.name));
            match &sides {
                [Cell::Lacks, Cell::Lacks] => {}
                [Cell::Holds(_, one), Cell::Holds(_, other)] if is_same(left, right, row, *one, *other) => {
                    comparison.same += 1;
                }
                [Cell::Holds(..), Cell::Holds(..)] => comparison.differences.push(Difference { row, sides }),
                _ if is_factory => comparison.unjudged.push(Difference { row, sides }),
                _ => comparison.differences.push(Difference { row, sides }),
            }
        }
        comparison
    }

    fn say(&self, left: &str, right: &str) -> Result<(), Failure> {
        if self.differences.is_empty() {
            output::say(format_args!("{left} and {right}: no difference"))?;
        } else {
            let mut table = Table::new(["parameter", left, right, "what it is"]);
            for Difference { row, sides } in &self.differences {
                let [one, other] = sides.each_ref().map(Cell::text);
                table.row([row.code.to_owned(), one, other, row.name.to_owned()]);
            }
            output::say_table(table)?;
        }
        let same = output::counted(self.same, "parameter is the same", "parameters are the same");
        match self.unjudged.len() {
            0 => output::say(same),
            several => output::say(format_args!(
                "{same}; {several} not compared: the manual prints no number as their factory setting, or they could not be read"
            )),
        }
    }

    fn json(&self, left: &str, right: &str) -> Value {
        let differences = self.differences.iter().map(|Difference { row, sides: [one, other] }| {
            json!({
                "mnemonic": row.code,
                "address": row.address,
                "name": row.name,
                "left": one.json(),
                "right": other.json(),
            })
        });
        json!({
            "left": left,
            "right": right,
            "differences": differences.collect::<Vec<_>>(),
            "same": self.same,
            "not_compared": self.unjudged.len(),
        })
    }
}

fn cell(side: &Backup, row: &Row) -> Cell {
    match side.entries.iter().find(|entry| entry.row.place() == row.place()).map(|entry| &entry.held) {
        Some(Ok(word)) => Cell::Holds(side.text(row, *word), *word),
        Some(Err(why)) => Cell::Unread(why.clone()),
        None => Cell::Lacks,
    }
}

/// Whether two words mean the same: a time is the same whatever it is counted in.
fn is_same(left: &Backup, right: &Backup, row: &Row, one: u16, other: u16) -> bool {
    let (one_in, other_in) = (left.row(row).unit, right.row(row).unit);
    if one_in == other_in || one_in.form != Form::Number || one_in.symbol != other_in.symbol {
        return one == other;
    }
    let fine = one_in.decimals.max(other_in.decimals);
    let counts = |unit: drive_core::registers::Unit, word| {
        i64::from(unit.number(word)) * 10_i64.pow(u32::from(fine - unit.decimals))
    };
    counts(one_in, one) == counts(other_in, other)
}

impl Cell {
    fn text(&self) -> String {
        match self {
            Self::Holds(text, _) => text.clone(),
            Self::Unread(why) => format!("not read: {why}"),
            Self::Lacks => "does not have it".to_owned(),
        }
    }

    fn json(&self) -> Value {
        match self {
            Self::Holds(text, word) => json!({ "value": text, "raw": word }),
            Self::Unread(why) => json!({ "error": why }),
            Self::Lacks => Value::Null,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An Altivar 312 with these lines in its file.
    fn drive(name: &str, lines: &str) -> Backup {
        let head = format!("name = \"{name}\"\nfamily = \"atv312\"\nslave = 1\nline = \"l\"\ndate = \"d\"");
        Backup::parse(Path::new("x.toml"), &format!("[drive]\n{head}\n[parameters]\n{lines}")).unwrap()
    }

    fn codes(left: &Backup, right: &Backup, with_communication: bool) -> Vec<&'static str> {
        let differences = Comparison::of(left, right, with_communication).differences;
        differences.iter().map(|difference| difference.row.code).collect()
    }

    #[test]
    fn a_time_is_the_same_whatever_it_is_counted_in() {
        // BBV51701 p. 38: Inr 0 counts 0.01 s, 1 counts 0.1 s.
        let tenths = drive("a", "Inr = { raw = 1 }\nACC = { raw = 30 }\ndEC = { raw = 30 }");
        let hundredths = drive("b", "Inr = { raw = 0 }\nACC = { raw = 300 }\ndEC = { raw = 30 }");
        assert_eq!(codes(&tenths, &hundredths, false), ["Inr", "dEC"]);
        let factory = Backup::of_factory(Family::ATV312);
        assert_eq!(Comparison::of(&tenths, &factory, false).differences, []);
    }

    #[test]
    fn what_one_side_lacks_is_a_difference_and_the_line_itself_only_if_that_is_asked_for() {
        let one = drive("a", "HSP = { raw = 500 }\nLSP = { error = \"exception 2\" }\nAdd = { raw = 1 }");
        let other = drive("b", "LSP = { raw = 0 }\nAdd = { raw = 2 }");
        assert_eq!(codes(&one, &other, false), ["LSP", "HSP"]);
        assert_eq!(codes(&one, &other, true), ["LSP", "HSP", "Add"]);
        let comparison = Comparison::of(&one, &other, false);
        let texts =
            comparison.differences.iter().map(|difference| difference.sides.each_ref().map(Cell::text));
        let texts: Vec<[String; 2]> = texts.collect();
        assert_eq!(texts, [["not read: exception 2", "0.0 Hz"], ["50.0 Hz", "does not have it"]]);
        assert_eq!(codes(&one, &one, true), ["LSP"], "what was not read is not the same");
    }
}
