//! `drived param`: the registers of a family, and their content in one drive.

mod backup;
pub(crate) mod diff;
pub(crate) mod file;
mod remote;
mod restore;
pub(crate) mod source;
#[cfg(test)]
mod testing;

use drive_core::{
    Capabilities, Drive, ErrorKind, Row,
    registers::{Factory, Range, Storage},
};
use drive_families::{Family, UnknownFamily};
use serde_json::json;

use crate::{
    client::{DaemonArgs, Target},
    drive_spec::DriveName,
    failure::Failure,
    one_drive::{OneDrive, OneDriveArgs, told},
    output::{self, Table},
    plant::parameters::{ParameterView, WrittenView},
    signals::Ending,
};

/// List, read and write the registers of a drive, by mnemonic or address
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// List every register of a family: access, where it is kept, range, factory setting, source
    List {
        /// The family, such as atv312, or a drive of the running daemon
        #[arg(value_name = "FAMILY|NAME")]
        of: String,
        #[command(flatten)]
        daemon: DaemonArgs,
    },
    /// Read registers
    #[command(override_usage = "drived param get [OPTIONS] [NAME] REGISTER...")]
    Get {
        #[command(flatten)]
        one: OneDriveArgs,
        /// The drive of the running daemon, which --line and --drive stand for otherwise; and mnemonics or addresses, such as
        /// ACC, 9001 or 2329h
        #[arg(value_name = "[NAME] REGISTER", required = true)]
        words: Vec<String>,
    },
    /// Write one register and read it back
    #[command(override_usage = "drived param set [OPTIONS] [NAME] REGISTER VALUE")]
    Set {
        #[command(flatten)]
        one: OneDriveArgs,
        /// The drive of the running daemon, which --line and --drive stand for otherwise; the mnemonic or the address of the
        /// register; and a number in its unit, a hexadecimal word such as 0627h, or the mnemonic of a listed value
        #[arg(value_name = "[NAME] REGISTER VALUE", required = true, num_args = 2..=3, allow_negative_numbers = true)]
        words: Vec<String>,
        /// Then save the drive's parameters to its EEPROM, all of them, as `drived param save` does, also when the value was
        /// there already
        #[arg(long)]
        save: bool,
    },
    /// Save a drive's parameters to its EEPROM, all that are kept in RAM, by the family's command for it
    ///
    /// What was changed since the last save outlives the next power-off then, whoever changed it. An EEPROM wears out by
    /// writes: save when you have changed something, not by a timer.
    Save {
        /// A drive of the running daemon
        #[arg(value_name = "NAME", conflicts_with = "line")]
        name: Option<String>,
        #[command(flatten)]
        one: OneDriveArgs,
    },
    /// Read every register that can be read
    Dump {
        /// A drive of the running daemon
        #[arg(value_name = "NAME", conflicts_with = "line")]
        name: Option<String>,
        #[command(flatten)]
        one: OneDriveArgs,
    },
    Backup(backup::Args),
    Diff(diff::Args),
    Restore(restore::Args),
}

pub(crate) async fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::List { of, daemon } => {
            let family = family(&of, &daemon).await?;
            let capabilities = family.capabilities();
            let rows = capabilities.rows.iter().map(|row| ParameterView::unasked(capabilities, row));
            daemon.say(&json!(rows.collect::<Vec<_>>()), |_| output::say_table(list(family)))
        }
        Command::Get { one, words } if one.is_on_line() => get(&one, &words).await,
        Command::Get { one, words } => remote::get(&one, &words).await,
        Command::Set { one, words, save } => match (one.is_on_line(), &*words) {
            (true, [register, value]) => set(&one, register, value, save).await,
            (false, [name, register, value]) => remote::set(&one, name, register, value, save).await,
            (true, _) => {
                Err(Failure::Input("expected REGISTER and VALUE beside --line and --drive".to_owned()))
            }
            (false, _) => Err(Failure::Input(
                "expected NAME, REGISTER and VALUE, or --line and --drive instead of the name".to_owned(),
            )),
        },
        Command::Save { one, .. } if one.is_on_line() => save_all(&one).await,
        Command::Save { one, name } => remote::save(&one, name.as_deref()).await,
        Command::Dump { one, .. } if one.is_on_line() => dump(&one).await,
        Command::Dump { one, name } => remote::dump(&one, name.as_deref()).await,
        Command::Backup(args) => backup::run(args).await,
        Command::Diff(args) => diff::run(args).await,
        Command::Restore(args) => restore::run(args).await,
    }
}

/// A family by its name, or that of a drive of the running daemon.
async fn family(of: &str, daemon: &DaemonArgs) -> Result<Family, Failure> {
    let unknown = match of.parse() {
        Ok(family) => return Ok(family),
        Err(error) => Failure::Input(UnknownFamily::to_string(&error)),
    };
    // Where no daemon runs, it was meant for a family.
    let Ok(mut daemon) = daemon.connect().await else { return Err(unknown) };
    let state = daemon.state().await?;
    Target::find(&state, of)?;
    let mut drives = state["drives"].as_array().into_iter().flatten();
    let family =
        drives.find(|drive| drive["name"] == of).and_then(|drive| drive["family"].as_str()?.parse().ok());
    family.ok_or(unknown)
}

fn list(family: Family) -> Table {
    let mut table =
        Table::new(["register", "mnemonic", "name and range", "access, kept in", "factory", "source"]);
    let capabilities = family.capabilities();
    for row in capabilities.rows {
        table.row([
            row.address.to_string(),
            row.code.to_owned(),
            with_range(row),
            format!("{} {}", row.access, row.storage),
            factory(capabilities, row),
            row.source.to_owned(),
        ]);
    }
    table
}

async fn get(args: &OneDriveArgs, registers: &[String]) -> Result<(), Failure> {
    let family = args.name()?.family;
    let rows = registers.iter().map(|text| find(family, text)).collect::<Result<Vec<_>, _>>()?;
    if let Some(row) = rows.iter().find(|row| !row.access.is_readable()) {
        return Err(Failure::Input(format!("{} ({}) can only be written", row.code, row.address)));
    }
    let mut one = args.open().await?;
    let mut read = Vec::new();
    for row in rows {
        let word = one.drive.read_parameter(row).await.map_err(|error| one.failure(&error))?;
        let row = in_units(&mut *one.drive, row).await.map_err(|error| one.failure(&error))?;
        read.push((row, Ok(word)));
    }
    say_values(args, one.drive.capabilities(), &read)?;
    one.close().await;
    Ok(())
}

async fn set(args: &OneDriveArgs, register: &str, value: &str, save: bool) -> Result<(), Failure> {
    let name = args.name()?;
    let row = find(name.family, register)?;
    if save {
        let by = saving(name, "leave out --save")?;
        if row.storage == Storage::Volatile {
            return Err(Failure::Input(format!(
                "{name}: {} ({}) is kept in RAM only, {by} does not save it: leave out --save",
                row.code, row.address
            )));
        }
    }
    let is_scaled = name.family.capabilities().scaled_by(row.address).is_some();
    if !is_scaled {
        wanted(row, value)?;
    }
    let mut one = args.open().await?;
    let shown = in_units(&mut *one.drive, row).await.map_err(|error| one.failure(&error))?;
    let word = wanted(&shown, value)?;
    let written = told(name, &mut Ending::listen()?, one.drive.write_parameter(row, word)).await?;
    let written = written.map_err(|error| one.failure(&error))?;
    let what = if written.changed { "is now" } else { "was already" };
    let kept = match written.storage {
        Storage::Volatile => "kept in RAM, lost at power-off",
        Storage::RamUntilSaved if save => "kept in RAM until saved",
        Storage::RamUntilSaved => {
            "kept in RAM, lost at power-off unless the drive is told to save its parameters"
        }
        Storage::Eeprom => "kept in EEPROM",
        Storage::Unknown => "the manual does not say whether it is kept in RAM or EEPROM",
    };
    let later = name.family.capabilities().restoring.acts_later(row.address);
    let parameter = ParameterView::read(one.drive.capabilities(), &shown, word);
    let mut body = json!(WrittenView { parameter, changed: written.changed });
    body["acts_later"] = json!(later);
    let mut text = vec![format!("{} {} {what} {} ({kept})", one.name, row.code, shown.show(word))];
    text.extend(later.map(|needs| format!("{}: {needs}", row.code)));
    if save && written.storage == Storage::Eeprom {
        text.push("the write itself has stored it: nothing else was saved".to_owned());
    } else if save {
        match persist(&mut one).await {
            Ok((saves, told)) => {
                body["saves"] = json!(saves);
                text.push(told);
            }
            Err(failure) => {
                // What was written is told though it is not saved.
                args.daemon.say(&body, |_| text.iter().try_for_each(output::say))?;
                return Err(failure);
            }
        }
    }
    args.daemon.say(&body, |_| text.iter().try_for_each(output::say))?;
    one.close().await;
    Ok(())
}

async fn save_all(args: &OneDriveArgs) -> Result<(), Failure> {
    let name = args.name()?;
    saving(name, "each write says where its register is kept")?;
    let mut one = args.open().await?;
    let (saves, text) = persist(&mut one).await?;
    let body = json!({ "drive": name.to_string(), "action": "save", "outcome": "confirmed", "saves": saves });
    args.daemon.say(&body, |_| output::say(text))?;
    one.close().await;
    Ok(())
}

/// The command by which a family saves its parameters.
fn saving(name: DriveName, instead: &str) -> Result<&'static str, Failure> {
    let capabilities = name.family.capabilities();
    capabilities.persist.ok_or_else(|| {
        let family = capabilities.name;
        Failure::Input(format!("{name}: a {family} has no command that saves its parameters: {instead}"))
    })
}

/// Saves whatever the drive keeps in RAM; tells how often it was done, and the same in words. What an earlier run of this program,
/// another one, or a hand at the panel has changed cannot be known here, and who asks for a save wants that kept too.
async fn persist(one: &mut OneDrive) -> Result<(u32, String), Failure> {
    let (name, by) = (one.name, saving(one.name, "")?);
    one.drive.assume_changed();
    let saves = told(name, &mut Ending::listen()?, one.drive.persist()).await?;
    let saves = saves.map_err(|error| one.failure(&error))?;
    let text = format!(
        "{name} has saved its parameters to EEPROM by {by}: all that it kept in RAM, not one alone; saves counted: {saves}"
    );
    Ok((saves, text))
}

async fn dump(args: &OneDriveArgs) -> Result<(), Failure> {
    let mut one = args.open().await?;
    let capabilities = one.drive.capabilities();
    let readable: Vec<&Row> = capabilities.rows.iter().filter(|row| row.access.is_readable()).collect();
    let mut progress = output::Progress::of(format_args!("reading {}", one.name), readable.len());
    let mut read = Vec::new();
    for row in readable {
        progress.step();
        read.push(match one.drive.read_parameter(row).await {
            Ok(word) => {
                let row = in_units(&mut *one.drive, row).await.map_err(|error| one.failure(&error))?;
                (row, Ok(word))
            }
            // A drive refuses what its model or its settings do not have; the rest is still worth reading.
            Err(error) if error.kind() == ErrorKind::Exception => {
                (*row, Err("refused by the drive".to_owned()))
            }
            Err(error) => return Err(one.failure(&error)),
        });
    }
    say_values(args, capabilities, &read)?;
    one.close().await;
    Ok(())
}

/// A row in the unit that it has in this drive now, which another register may choose: read only where one does.
async fn in_units(drive: &mut dyn Drive, row: &'static Row) -> drive_core::Result<Row> {
    let capabilities = drive.capabilities();
    let word = match capabilities.scaled_by(row.address) {
        Some(by) => Some(drive.read_parameter(by).await?),
        None => None,
    };
    Ok(capabilities.in_units(row, |_| word))
}

/// Prints registers with what was read of each, or why nothing was.
fn say_values(
    args: &OneDriveArgs,
    capabilities: &Capabilities,
    read: &[(Row, Result<u16, String>)],
) -> Result<(), Failure> {
    let view = |(row, word): &(Row, Result<u16, String>)| match word {
        Ok(word) => ParameterView::read(capabilities, row, *word),
        Err(why) => ParameterView::unread(capabilities, row, why.clone()),
    };
    args.daemon.say(&json!(read.iter().map(view).collect::<Vec<_>>()), |_| {
        let mut table = value_table();
        for (row, word) in read {
            let shown = word.as_ref().map_or_else(Clone::clone, |word| row.show(*word));
            table.row(value_cells(capabilities, row, shown));
        }
        output::say_table(table)
    })
}

/// The word for a person's text, refused here when access or range forbid it: nothing is sent then.
pub(crate) fn wanted(row: &Row, text: &str) -> Result<u16, Failure> {
    let refuse = |why: String| Failure::Input(format!("{} ({}): {why}", row.code, row.address));
    if !row.access.is_writable() {
        return Err(refuse("the register can only be read".to_owned()));
    }
    let expected = || match range(row) {
        range if range.is_empty() => "a number in its unit or a hexadecimal word such as 0627h".to_owned(),
        range => range,
    };
    let word =
        row.read(text).ok_or_else(|| refuse(format!("{text:?} is no value, expected: {}", expected())))?;
    if !row.range.allows(row.unit.number(word)) {
        return Err(refuse(format!("{} is not allowed, expected: {}", row.show(word), expected())));
    }
    Ok(word)
}

fn find(family: Family, text: &str) -> Result<&'static Row, Failure> {
    Row::find(family.capabilities().rows, text).ok_or_else(|| {
        Failure::Input(format!("a {family} has no register {text:?}: see drived param list {family}"))
    })
}

fn value_table() -> Table {
    Table::new(["register", "mnemonic", "value", "name and range", "access", "factory"])
}

fn value_cells(capabilities: &Capabilities, row: &Row, value: String) -> [String; 6] {
    [
        row.address.to_string(),
        row.code.to_owned(),
        value,
        with_range(row),
        row.access.to_string(),
        factory(capabilities, row),
    ]
}

fn with_range(row: &Row) -> String {
    match range(row) {
        range if range.is_empty() => row.name.to_owned(),
        range => format!("{}: {range}", row.name),
    }
}

/// The factory setting of a row, in the unit that it has with the factory setting of what chooses that.
pub(crate) fn factory(capabilities: &Capabilities, row: &Row) -> String {
    let by = capabilities.scaled_by(row.address).map(|by| by.factory);
    let of_factory =
        |_| by.and_then(|factory| if let Factory::Value(word) = factory { Some(word) } else { None });
    match row.factory {
        Factory::None => String::new(),
        Factory::Value(word) => brief(&capabilities.in_units(row, of_factory), word),
        Factory::Described(rule) => rule.to_owned(),
    }
}

/// A word in its unit, or the mnemonic of a listed value.
pub(crate) fn brief(row: &Row, word: u16) -> String {
    row.choice(word).map_or_else(|| row.unit.show(word), |choice| choice.code.to_owned())
}

pub(crate) fn range(row: &Row) -> String {
    let span =
        |low, high| format!("{} to {}", output::in_unit(row.unit, low), output::in_unit(row.unit, high));
    let listed = || {
        let codes = row.range.choices().iter().map(|choice| choice.code);
        codes.collect::<Vec<_>>().join(", ")
    };
    match row.range {
        Range::Any => String::new(),
        Range::Within(low, high) => span(low, high),
        Range::OneOf(_) => listed(),
        Range::OneOfOr(_, low, high) => format!("{}, or {}", listed(), span(low, high)),
        Range::Described(_, _, rule) => rule.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use drive_core::registers::{Access, Choice, Confidence, Unit};

    use super::*;

    const YES_NO: &[Choice] = &[Choice::new(0, "nO", "no"), Choice::new(1, "YES", "yes")];

    const RAMP: Row = Row {
        address: 9001,
        code: "ACC",
        name: "acceleration",
        access: Access::ReadWrite,
        storage: Storage::RamUntilSaved,
        unit: Unit::scaled("s", 1),
        range: Range::Within(1, 9_999),
        factory: Factory::Value(30),
        confidence: Confidence::Manual,
        source: "p. 1",
    };

    #[test]
    fn what_range_and_access_forbid_is_refused_before_anything_is_sent() {
        assert_eq!(wanted(&RAMP, "3.5 s"), Ok(35));
        for (row, text, reason) in [
            (RAMP, "0", "0.0 s is not allowed, expected: 0.1 s to 999.9 s"),
            (RAMP, "fast", "\"fast\" is no value, expected: 0.1 s to 999.9 s"),
            (Row { access: Access::Read, ..RAMP }, "3", "can only be read"),
            (Row { range: Range::OneOf(YES_NO), unit: Unit::CODE, ..RAMP }, "7", "expected: nO, YES"),
        ] {
            let Err(Failure::Input(message)) = wanted(&row, text) else { panic!("{text} was taken") };
            assert!(message.contains(reason), "{message}");
        }
    }

    #[test]
    fn a_row_shows_its_factory_setting_and_its_range() {
        let family = &Capabilities::least("test", "Test");
        assert_eq!(
            (factory(family, &RAMP), range(&RAMP)),
            ("3.0 s".to_owned(), "0.1 s to 999.9 s".to_owned())
        );
        let list = Row { range: Range::OneOf(YES_NO), factory: Factory::Value(1), ..RAMP };
        assert_eq!((factory(family, &list), range(&list)), ("YES".to_owned(), "nO, YES".to_owned()));
    }
}
