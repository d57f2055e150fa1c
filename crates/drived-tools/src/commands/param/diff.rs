//! `drived param diff`: where the parameters of two drives, of two files, or of a drive and its factory setting differ.

use std::path::Path;

use drive_core::{
    Row,
    registers::{Form, Part},
};
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
    /// Registers that have no number as factory setting of this drive, and those that could not be read.
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
            Ok([Side::factory(&right.backup), right])
        }
        (false, other) => {
            let left = side(args, first).await?;
            let right = match (second, other) {
                (Some(second), Some(false)) => side(args, second).await?,
                (None, _) if is_file(first) => {
                    let named = args.source.of_file(&left.backup.head)?;
                    Side { title: named.name(), backup: args.source.read(&named).await? }
                }
                _ => Side::factory(&left.backup),
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
    fn factory(of: &Backup) -> Self {
        Self { title: FACTORY.to_owned(), backup: Backup::of_factory(of) }
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
            let among = if self.unjudged.is_empty() { "" } else { " in what can be compared" };
            output::say(format_args!("{left} and {right}: no difference{among}"))?;
        } else {
            let mut table = Table::new(["parameter", left, right, "what it is"]);
            for Difference { row, sides } in &self.differences {
                let [one, other] = sides.each_ref().map(Cell::text);
                table.row([row.code.to_owned(), one, other, row.name.to_owned()]);
            }
            output::say_table(table)?;
        }
        output::say(output::counted(self.same, "parameter is the same", "parameters are the same"))?;
        for (why, codes) in self.not_compared() {
            let counted = output::counted(codes.len(), "is", "are");
            output::say(format_args!("{counted} not compared, {why}: {}", codes.join(", ")))?;
        }
        Ok(())
    }

    /// What is not compared, by the reason.
    fn not_compared(&self) -> Vec<(String, Vec<&'static str>)> {
        let mut reasons: Vec<(String, Vec<&'static str>)> = Vec::new();
        for difference in &self.unjudged {
            let why = difference.why_unjudged();
            match reasons.iter_mut().find(|(reason, _)| *reason == why) {
                Some((_, codes)) => codes.push(difference.row.code),
                None => reasons.push((why, vec![difference.row.code])),
            }
        }
        reasons
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
            "not_compared_because": self.not_compared().into_iter().map(|(why, codes)| {
                json!({ "why": why, "mnemonics": codes })
            }).collect::<Vec<_>>(),
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

impl Difference {
    /// Why it is not compared.
    fn why_unjudged(&self) -> String {
        let unread = self.sides.iter().find_map(|side| match side {
            Cell::Unread(why) => Some(why.clone()),
            Cell::Holds(..) | Cell::Lacks => None,
        });
        unread.unwrap_or_else(|| "it is on one side only".to_owned())
    }
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
        let factory = Backup::of_factory(&tenths);
        assert_eq!(Comparison::of(&tenths, &factory, false).differences, []);
    }

    /// What differs from the factory setting, and what is not compared with it.
    fn from_factory(lines: &str) -> (Vec<&'static str>, Vec<(String, Vec<&'static str>)>) {
        let drive = drive("a", lines);
        let mut comparison = Comparison::of(&drive, &Backup::of_factory(&drive), false);
        let is_held = |row: &Row| drive.entries.iter().any(|entry| entry.row == row);
        comparison.unjudged.retain(|unjudged| is_held(unjudged.row));
        (
            comparison.differences.iter().map(|difference| difference.row.code).collect(),
            comparison.not_compared(),
        )
    }

    /// BBV51701 p. 27 to 31: HSP, Ftd and FrS 50 Hz, with bFr = 60 60 Hz, tFr 60 and 72 Hz; p. 33, 42, 43, 45: rrS LI2, with tCC = 3C
    /// LI3 and with LOC nO, PS2 LI3 and PS4 LI4, with 3C nO, JOG nO, with 3C LI4; p. 52: IPL YES, except for M2 nO.
    #[test]
    fn a_factory_setting_that_another_register_of_the_drive_chooses_is_compared_by_that() {
        const FIFTY: &str = "bFr = { raw = 0 }\nHSP = { raw = 500 }\ntFr = { raw = 600 }\nFrS = { raw = 500 }\nFtd = { raw = 500 }";
        const SIXTY: &str =
            "HSP = { raw = 600 }\ntFr = { raw = 720 }\nFrS = { raw = 600 }\nFtd = { raw = 600 }";
        assert_eq!(from_factory(FIFTY), (vec![], vec![]));
        // bFr itself is 0 from the factory (p. 28).
        assert_eq!(from_factory(&format!("bFr = {{ raw = 1 }}\n{SIXTY}")), (vec!["bFr"], vec![]));
        let off = from_factory(&format!("bFr = {{ raw = 0 }}\n{SIXTY}"));
        assert_eq!(off, (vec!["HSP", "Ftd", "FrS", "tFr"], vec![]));
        let inputs = |tcc: u16, [rrs, ps2, ps4, jog]: [u16; 4]| {
            from_factory(&format!(
                "tCC = {{ raw = {tcc} }}\nrrS = {{ raw = {rrs} }}\nPS2 = {{ raw = {ps2} }}\nPS4 = {{ raw = {ps4} }}\nJOG = {{ raw = {jog} }}"
            ))
        };
        assert_eq!(inputs(0, [130, 131, 132, 0]), (vec![], vec![]));
        assert_eq!(inputs(0, [0, 0, 0, 132]), (vec!["rrS", "PS2", "PS4", "JOG"], vec![]));
        assert_eq!(inputs(1, [131, 0, 0, 132]), (vec!["tCC"], vec![]));
        assert_eq!(inputs(2, [0, 131, 132, 0]), (vec!["tCC"], vec![]));
        let phases = |vcal: u16, ipl: u16| {
            let head = "name = \"a\"\nfamily = \"atv312\"\nslave = 1\nline = \"l\"\ndate = \"d\"";
            let text = format!(
                "[drive]\n{head}\n[rating]\nVCAL = {{ raw = {vcal} }}\n[parameters]\nIPL = {{ raw = {ipl} }}"
            );
            let drive = Backup::parse(Path::new("x.toml"), &text).unwrap();
            codes(&drive, &Backup::of_factory(&drive), false)
        };
        assert_eq!([phases(3, 1), phases(1, 0)], [[""; 0]; 2]);
        assert_eq!([phases(3, 0), phases(1, 1)], [["IPL"]; 2]);
    }

    /// BBV51701 p. 28, 40: CLI 1.5 In and IdC 0.7 In, which are 6.15 and 2.87 A of 4.1 A; UnS by the rating, COd without one (p. 56).
    #[test]
    fn a_share_of_the_rating_is_compared_and_what_is_no_number_is_named_with_its_reason() {
        let rated = |inv: &str, cli: u16, idc: u16| {
            let lines = format!(
                "CLI = {{ raw = {cli} }}\nIdC = {{ raw = {idc} }}\nUnS = {{ raw = 400 }}\nHSP = {{ raw = 420 }}"
            );
            from_factory(&format!("{lines}\n{inv}"))
        };
        let rating = "INV = { raw = 41 }";
        let (by_rating, by_bfr) = (
            ("the manual has a rule: by the drive's rating".to_owned(), vec!["UnS"]),
            ("it depends on bFr, which is not known".to_owned(), vec!["HSP"]),
        );
        for cli in [61, 62] {
            let unjudged = vec![by_bfr.clone(), by_rating.clone()];
            assert_eq!(rated(rating, cli, 29), (vec![], unjudged));
        }
        assert_eq!(rated(rating, 50, 20).0, ["CLI", "IdC"]);
        let (differences, unjudged) = rated("", 61, 29);
        assert_eq!(differences, [""; 0]);
        assert!(
            unjudged.contains(&("it depends on INV, which is not known".to_owned(), vec!["CLI", "IdC"])),
            "{unjudged:?}"
        );
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
