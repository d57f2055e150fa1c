//! `drived token`: who may command over HTTP.

use std::path::{Path, PathBuf};

use serde_json::json;

use drived_client::Daemon;
use drived_doors::{
    config::DoorsConfig,
    {
        Caller, LINKS, MadeLink, MadeToken, RemovedToken, Rights, Role, Scope, TOKENS, TokensView, added,
        audit::{self, Kind, Record},
        of_days, of_hours, replaced,
        tokens::{TokenView, Tokens},
    },
};
use drived_file::Config;
use drived_words::{
    failure::Failure,
    moment,
    output::{self, JsonArgs, Table},
};

/// Add, list, replace and remove the tokens of those who command over HTTP
///
/// A running daemon does it itself, over its control socket. Where none runs, the file that the configuration names is changed,
/// which the next daemon reads.
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
        /// The drives that it may command, again for each; all of them unless drives or groups are said. A stop is of all
        #[arg(long = "drive", value_name = "NAME")]
        drives: Vec<String>,
        /// The groups whose drives it may command, again for each
        #[arg(long = "group", value_name = "NAME")]
        groups: Vec<String>,
        /// For how many days it is good; for ever unless it is said
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=3_660))]
        days: Option<u32>,
        #[command(flatten)]
        place: PlaceArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
    /// Make a link by which a browser is known at the page of the running daemon, without a token that is typed: good once, for ten
    /// minutes; the session it begins lasts twelve hours
    Link {
        /// By whose name and rights: a token, which is made when the link is used if there is none
        #[arg(value_name = "NAME")]
        name: String,
        /// What a token that is made may; one that is there keeps its role
        #[arg(long, value_enum)]
        role: Option<Role>,
        /// For how many days a token that is made is good
        #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=3_660))]
        days: u32,
        #[command(flatten)]
        place: PlaceArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
    /// List the tokens by their names
    List {
        #[command(flatten)]
        place: PlaceArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
    /// Replace a token by another of the same name and role, and print it, once
    Rotate {
        /// Whose it is
        #[arg(value_name = "NAME")]
        name: String,
        /// How many hours the one before it is good for yet, so that it can be replaced where it is used
        #[arg(long, value_name = "N", default_value_t = 24, value_parser = clap::value_parser!(u32).range(0..=8_760))]
        hours: u32,
        #[command(flatten)]
        place: PlaceArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
    /// Remove a token: whoever uses it is refused from now on
    Remove {
        /// Whose it is
        #[arg(value_name = "NAME")]
        name: String,
        #[command(flatten)]
        place: PlaceArgs,
        #[command(flatten)]
        json: JsonArgs,
    },
}

/// Whose tokens they are.
#[derive(Debug, clap::Args)]
pub(crate) struct PlaceArgs {
    #[command(flatten)]
    config: ConfigArgs,
    /// The control socket of the daemon, if not where the configuration says or where it usually is
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,
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
        let config =
            Config::load_or_empty(&self.config).map_err(|error| Failure::Input(error.to_string()))?;
        Ok(config.doors)
    }

    /// A scope, whose drives and groups are all there: one that is misspelt would be for nothing.
    fn known(&self, scope: Option<Scope>) -> Result<Option<Scope>, Failure> {
        let Some(scope) = scope else { return Ok(None) };
        let config = Config::load_or_empty(&self.config).map_err(input)?;
        let drives = config.lines.iter().flat_map(|line| &line.drives).map(|drive| &drive.settings.name);
        let groups = config.groups.iter().map(|group| &group.name);
        let missing =
            |wanted: &[String], there: Vec<&String>| wanted.iter().find(|one| !there.contains(one)).cloned();
        let drive = missing(&scope.drives, drives.collect()).map(|name| format!("drive {name:?}"));
        let group = missing(&scope.groups, groups.collect()).map(|name| format!("group {name:?}"));
        match drive.or(group) {
            Some(missing) => {
                Err(Failure::Input(format!("there is no {missing} in {}", self.config.display())))
            }
            None => Ok(Some(scope)),
        }
    }

    /// One of the files that are kept.
    pub(crate) fn named(&self, key: &str, file: Option<PathBuf>) -> Result<PathBuf, Failure> {
        let config = self.config.display();
        file.ok_or_else(|| {
            let expected = format!("expected {key} = \"FILE\", or state = \"FOLDER\"");
            Failure::Input(format!("{config} names no place where it is kept: {expected}"))
        })
    }
}

pub(crate) async fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::Add { name, role, drives, groups, days, place, json } => {
            let scope = place.config.known(Scope::of(drives, groups))?;
            let made: MadeToken = match open(&place).await? {
                Way::Daemon(mut daemon) => {
                    let mut asked = json!({ "name": name, "role": role.name() });
                    if let Some(days) = days {
                        asked["days"] = days.into();
                    }
                    if let Some(scope) = &scope {
                        asked["scope"] = json!(scope);
                    }
                    daemon.post(TOKENS, &asked).await?.done()?
                }
                Way::Files(files) => files.add(&name, (role, scope), days)?,
            };
            json.say(|| json!(made), || output::say_as_it_is(&made.token))
        }
        Command::Rotate { name, hours, place, json } => {
            let made: MadeToken = match open(&place).await? {
                Way::Daemon(mut daemon) => {
                    daemon.put(&format!("{TOKENS}/{name}"), &json!({ "hours": hours })).await?.done()?
                }
                Way::Files(files) => files.rotate(&name, hours)?,
            };
            json.say(|| json!(made), || output::say_as_it_is(&made.token))
        }
        Command::Link { name, role, days, place, json } => {
            let Way::Daemon(mut daemon) = open(&place).await? else {
                return Err(Failure::Input(
                    "no daemon runs: a link is to the page of one that does".to_owned(),
                ));
            };
            let mut asked = json!({ "name": name, "days": days });
            if let Some(role) = role {
                asked["role"] = role.name().into();
            }
            let made: MadeLink = daemon.post(LINKS, &asked).await?.done()?;
            json.say(|| json!(made), || output::say_as_it_is(&made.link))
        }
        Command::List { place, json } => {
            let tokens = match open(&place).await? {
                Way::Daemon(mut daemon) => daemon.get(TOKENS).await?.done::<TokensView>()?.tokens,
                Way::Files(Files { tokens, .. }) => tokens.views().map_err(input)?,
            };
            list(&tokens, json)
        }
        Command::Remove { name, place, json } => {
            match open(&place).await? {
                Way::Daemon(mut daemon) => {
                    daemon.delete(&format!("{TOKENS}/{name}")).await?.done::<RemovedToken>()?;
                }
                Way::Files(files) => files.remove(&name)?,
            }
            let object = || json!({ "name": name, "removed": true });
            json.say(object, || output::say(format_args!("{name} is removed")))
        }
    }
}

fn input(error: impl std::fmt::Display) -> Failure {
    Failure::Input(error.to_string())
}

/// Who changes them.
enum Way {
    /// The daemon whose tokens they are.
    Daemon(Daemon),
    /// This program: no daemon runs.
    Files(Files),
}

struct Files {
    tokens: Tokens,
    audit: Option<PathBuf>,
}

async fn open(place: &PlaceArgs) -> Result<Way, Failure> {
    let DoorsConfig { state, socket, .. } = place.config.doors()?;
    let socket = place.socket.clone().or_else(|| socket.and_then(|socket| socket.path));
    if let Ok(mut daemon) = Daemon::connect(socket.as_deref(), None).await {
        let theirs = daemon.get(TOKENS).await?.done::<TokensView>();
        let own = state.tokens.as_deref().filter(|_| state.has_tokens);
        // Where the configuration does not say it, the daemon has it from its own environment.
        let is_it = |theirs: &Path| own.is_none_or(|own| whole(own) == whole(theirs));
        if theirs.is_ok_and(|theirs| is_it(&theirs.file)) {
            return Ok(Way::Daemon(daemon));
        }
    }
    let file = place.config.named("tokens", state.tokens)?;
    Ok(Way::Files(Files { tokens: Tokens::open(&file).map_err(input)?, audit: state.audit }))
}

/// A file by the one way to its folder.
fn whole(file: &Path) -> PathBuf {
    let folder = file.parent().and_then(|folder| folder.canonicalize().ok());
    match (folder, file.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => file.to_owned(),
    }
}

impl Files {
    fn add(
        &self,
        name: &str,
        (role, scope): (Role, Option<Scope>),
        days: Option<u32>,
    ) -> Result<MadeToken, Failure> {
        let token = self.tokens.add(name, (role, scope.clone()), days.map(of_days)).map_err(input)?;
        if let Err(failure) = tell(self.audit.as_deref(), added(name, role, scope.as_ref())) {
            self.tokens.remove(name).map_err(input)?;
            return Err(failure);
        }
        Ok(MadeToken { name: name.to_owned(), role, scope, token })
    }

    fn rotate(&self, name: &str, hours: u32) -> Result<MadeToken, Failure> {
        let (token, secret) = self.tokens.rotate(name, of_hours(hours)).map_err(input)?;
        tell(self.audit.as_deref(), replaced(name, hours))?;
        Ok(MadeToken::of(token, secret))
    }

    fn remove(&self, name: &str) -> Result<(), Failure> {
        self.tokens.remove(name).map_err(input)?;
        // What is closed stays closed, whatever the log says.
        tell(self.audit.as_deref(), format!("token {name} removed"))
    }
}

fn list(tokens: &[TokenView], json: JsonArgs) -> Result<(), Failure> {
    if json.is_json() {
        return tokens.iter().try_for_each(|token| output::say_as_it_is(json!(token)));
    }
    if tokens.is_empty() {
        return output::say("there is no token: drived token add NAME --role ROLE");
    }
    let mut table = Table::new(["name", "role", "for", "made", "ends"]);
    for token in tokens {
        let time = |unix_s: u64| {
            moment::told_here(i64::try_from(unix_s).ok()?.checked_mul(1_000)?, "%Y-%m-%d %H:%M")
        };
        let made = output::or_dash(time(token.made_unix_s));
        let ends =
            token.expires_unix_s.map_or_else(|| "never".to_owned(), |ends| output::or_dash(time(ends)));
        let scope = token.scope.as_ref().map_or_else(|| "every drive".to_owned(), ToString::to_string);
        table.row([token.name.clone(), token.role.name().to_owned(), scope, made, ends]);
    }
    output::say_table(table)
}

/// Writes a change into the audit log, if there is one.
fn tell(audit: Option<&Path>, what: String) -> Result<(), Failure> {
    let Some(audit) = audit else { return Ok(()) };
    let caller = Caller::new("local", origin(), Rights::ALL);
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
