//! `drived token`: who may command over HTTP.

use std::path::{Path, PathBuf};

use serde_json::json;

use crate::{
    config::{Config, DoorsConfig},
    doors::{
        Caller, Rights, Role,
        audit::{self, Kind, Record},
        tokens::Tokens,
    },
    failure::Failure,
    output::{self, JsonArgs, Table},
};

/// Add, list and remove the tokens of those who command over HTTP
///
/// The file of the tokens is named by `tokens` in the configuration. A running daemon takes each change at once.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Make a token and print it, once: only its SHA-256 is kept
    Add {
        /// Whose it is: 1 to 64 letters, digits, - and _; `commanders` of a drive name it
        #[arg(value_name = "NAME")]
        name: String,
        /// What it is for
        #[arg(long, value_enum)]
        role: Role,
        #[command(flatten)]
        config: ConfigArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
    /// List the tokens by their names
    List {
        #[command(flatten)]
        config: ConfigArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
    /// Remove a token: whoever uses it is refused from now on
    Remove {
        /// Whose it is
        #[arg(value_name = "NAME")]
        name: String,
        #[command(flatten)]
        config: ConfigArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
}

/// `--config` of those who need its files.
#[derive(Debug, clap::Args)]
pub(crate) struct ConfigArgs {
    /// The configuration, in TOML
    #[arg(long, value_name = "FILE", default_value = "drives.toml")]
    config: PathBuf,
}

impl ConfigArgs {
    /// What the file says of the doors.
    pub(crate) fn doors(&self) -> Result<DoorsConfig, Failure> {
        let config = Config::load(&self.config).map_err(|error| Failure::Input(error.to_string()))?;
        Ok(config.doors)
    }

    /// One of the files that it may name.
    pub(crate) fn named(&self, key: &str, file: Option<PathBuf>) -> Result<PathBuf, Failure> {
        let config = self.config.display();
        file.ok_or_else(|| {
            Failure::Input(format!("{config} names no file for it: expected {key} = \"FILE\""))
        })
    }
}

pub(crate) fn run(command: Command) -> Result<(), Failure> {
    let input = |error: &dyn std::fmt::Display| Failure::Input(error.to_string());
    match command {
        Command::Add { name, role, config, json } => {
            let (tokens, audit) = open(&config)?;
            let secret = tokens.add(&name, role).map_err(|error| input(&error))?;
            let what = format!("token {name} added, role {}", role.name());
            if let Err(failure) = tell(audit.as_deref(), what) {
                tokens.remove(&name).map_err(|error| input(&error))?;
                return Err(failure);
            }
            let object = || json!({ "name": name, "role": role.name(), "token": secret });
            json.say(object, || output::say_as_it_is(&secret))
        }
        Command::List { config, json } => list(&open(&config)?.0, json),
        Command::Remove { name, config, json } => {
            let (tokens, audit) = open(&config)?;
            tokens.remove(&name).map_err(|error| input(&error))?;
            // What is closed stays closed, whatever the log says.
            tell(audit.as_deref(), format!("token {name} removed"))?;
            let object = || json!({ "name": name, "removed": true });
            json.say(object, || output::say(format_args!("{name} is removed")))
        }
    }
}

fn open(config: &ConfigArgs) -> Result<(Tokens, Option<PathBuf>), Failure> {
    let doors = config.doors()?;
    let file = config.named("tokens", doors.tokens)?;
    let tokens = Tokens::open(&file).map_err(|error| Failure::Input(error.to_string()))?;
    Ok((tokens, doors.audit))
}

fn list(tokens: &Tokens, json: JsonArgs) -> Result<(), Failure> {
    let all = tokens.all().map_err(|error| Failure::Input(error.to_string()))?;
    if json.is_json() {
        return all.iter().try_for_each(|token| {
            let object = json!({ "name": token.name, "role": token.role.name(), "made_unix_s": token.made });
            output::say_as_it_is(object)
        });
    }
    if all.is_empty() {
        return output::say("there is no token: drived token add NAME --role ROLE");
    }
    let mut table = Table::new(["name", "role", "made"]);
    for token in all {
        let made = i64::try_from(token.made).ok().and_then(|made| chrono::DateTime::from_timestamp(made, 0));
        let made =
            output::or_dash(made.map(|made| made.with_timezone(&chrono::Local).format("%Y-%m-%d %H:%M")));
        table.row([token.name, token.role.name().to_owned(), made]);
    }
    output::say_table(table)
}

/// Writes a change into the audit log, if there is one.
fn tell(audit: Option<&Path>, what: String) -> Result<(), Failure> {
    let Some(audit) = audit else { return Ok(()) };
    let caller = Caller { name: "local".to_owned(), origin: origin(), rights: Rights::ALL };
    let written = audit::write_one(audit, &Record::new(Kind::Token, &caller, what));
    written.map_err(|error| {
        Failure::Input(format!("the audit log {} cannot be written: {error}", audit.display()))
    })
}

/// The user of this program.
fn origin() -> String {
    #[cfg(unix)]
    if let Ok(known) = std::fs::metadata("/proc/self") {
        return format!("command line uid {}", std::os::unix::fs::MetadataExt::uid(&known));
    }
    "command line".to_owned()
}
