//! `drived names`: which number each drive has for those who know drives by numbers.

use std::path::PathBuf;

use serde_json::{Value, json};

use drived_config::{
    kept::Kept,
    names::{self, Configured, Known, Table},
};
use drived_file::Config;
use drived_words::{
    failure::Failure,
    output::{self, JsonArgs},
};

/// Show and change the numbers of the drives, by which a SCADA finds them in the virtual unit of a gateway
///
/// A drive gets a number when it is first configured and keeps it, whatever comes, goes or is called otherwise; that of a drive that is
/// gone is given to no other before it is forgotten. They stand in names.json of the state folder. A running daemon has what is changed
/// here after `drived reload`.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// List the drives with their numbers
    List {
        #[command(flatten)]
        place: PlaceArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
    /// Give a drive another number, which no other has
    Give {
        /// The drive
        #[arg(value_name = "NAME")]
        name: String,
        /// The number, from 0
        #[arg(value_name = "NUMBER")]
        number: u16,
        #[command(flatten)]
        place: PlaceArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
    /// Forget a drive that is gone, so that its number is free
    Forget {
        /// The drive
        #[arg(value_name = "NAME")]
        name: String,
        #[command(flatten)]
        place: PlaceArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
    /// Number all drives anew, as the configuration has them; what was kept is put aside
    Renew {
        #[command(flatten)]
        place: PlaceArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
}

/// Where they are kept.
#[derive(Debug, clap::Args)]
pub(crate) struct PlaceArgs {
    /// The configuration, whose state folder keeps them
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
}

impl PlaceArgs {
    fn config(&self) -> Result<Config, Failure> {
        Config::load_workable(&self.config)
    }
}

pub(crate) fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::List { place, json } => {
            let table = numbered(&place.config()?)?;
            json.say(|| object(&table), || say(&table))
        }
        Command::Give { name, number, place, json } => {
            let config = place.config()?;
            if configured(&config).drives.iter().any(|drive| drive.name == name && drive.slot.is_some()) {
                let why = format!("the configuration gives {name} its slot: change it there");
                return Err(Failure::Input(why));
            }
            let (table, ()) = change(&config, |table| table.give(&name, number))?;
            let told = || {
                output::say(format_args!(
                    "{name} has the number {number}; drived reload tells a running daemon"
                ))
            };
            json.say(|| object(&table), told)
        }
        Command::Forget { name, place, json } => {
            let (table, number) = change(&place.config()?, |table| table.forget(&name))?;
            let free = number.map(|number| format!("; {number} is free")).unwrap_or_default();
            json.say(|| object(&table), || output::say(format_args!("{name} is forgotten{free}")))
        }
        Command::Renew { place, json } => {
            let config = place.config()?;
            let renewed = names::renewed(&file(&config)?, &configured(&config));
            let (table, aside) = renewed.map_err(Failure::Input)?;
            let told = || {
                if let Some(aside) = &aside {
                    output::say(format_args!("what was kept is in {}", aside.display()))?;
                }
                say(&table)
            };
            json.say(|| object(&table), told)
        }
    }
}

/// The numbers for a program.
fn object(table: &Table) -> Value {
    let of = |all: &[Known]| {
        let one = |known: &Known| {
            let mut said = json!({
                "name": known.name, "id": known.id, "topic": known.topic, "place": known.place, "gone": known.gone
            });
            if let Some(slot) = known.slot {
                said["number"] = slot.into();
            }
            said
        };
        all.iter().map(one).collect::<Vec<_>>()
    };
    json!({ "drives": of(&table.drives), "lines": of(&table.lines), "groups": of(&table.groups) })
}

fn configured(config: &Config) -> Configured {
    names::configured(&config.lines, &config.groups)
}

fn say(table: &Table) -> Result<(), Failure> {
    let mut rows = output::Table::new(["number", "drive", "id", "topic", "where", ""]);
    for known in &table.drives {
        let gone = if known.gone { "gone" } else { "" };
        let number = known.slot.map(|slot| slot.to_string()).unwrap_or_default();
        let (name, id, topic) = (known.name.clone(), known.id.clone(), known.topic.clone());
        rows.row([number, name, id, topic, known.place.clone(), gone.to_owned()]);
    }
    output::say_table(rows)
}

/// The numbers that the drives of a configuration have, or will have when its daemon starts. Nothing is written.
///
/// # Errors
/// What is kept cannot be read.
pub(crate) fn numbered(config: &Config) -> Result<Table, Failure> {
    let mut table = match &config.doors.state.folder {
        Some(folder) => names::read(&Kept::at(&names::file_in(folder))).map_err(Failure::Input)?,
        None => Table::default(),
    };
    table.take_up(&configured(config));
    table.drives.sort_by_key(|known| known.slot);
    Ok(table)
}

/// Changes what is kept, with the drives of the configuration in it.
fn change<T>(
    config: &Config,
    change: impl FnOnce(&mut Table) -> Result<T, String>,
) -> Result<(Table, T), Failure> {
    let changed = names::changed(&file(config)?, |table| {
        table.take_up(&configured(config));
        change(table)
    });
    changed.map_err(Failure::Input)
}

fn file(config: &Config) -> Result<Kept, Failure> {
    let folder = config.doors.state.folder.as_ref().ok_or_else(|| {
        Failure::Input(
            "no state folder keeps numbers: name one in the configuration, state = \"FOLDER\"".to_owned(),
        )
    })?;
    Ok(Kept::at(&names::file_in(folder)))
}
