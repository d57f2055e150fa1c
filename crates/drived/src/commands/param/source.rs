//! The drives whose parameters are kept, compared and restored: on a line, or of the running daemon.

use std::collections::BTreeMap;

use chrono::{SecondsFormat, Utc};
use drive_core::{ErrorKind, Row, SlaveAddress};
use drive_families::Family;
use serde_json::{Value, json};

use super::file::{Backup, Entry, Head, is_kept};
use crate::{
    client::{Daemon, DaemonArgs, Target, path_of},
    drive_options::OptionArgs,
    drive_spec::{self, DriveName, DriveSpec},
    failure::Failure,
    line_spec::{self, LineSpec},
    one_drive::{OneDrive, may_have_written},
    output::Progress,
};

/// A drive that does not answer so often in a row is not asked for the rest.
const SILENT_AFTER: usize = 3;

/// Where the drives are.
#[derive(Debug, clap::Args)]
pub(crate) struct SourceArgs {
    // The text has brackets that a doc comment would take for links.
    #[arg(long, value_name = "LINE", conflicts_with_all = ["socket", "token_file"], help = line_spec::HELP)]
    line: Option<LineSpec>,
    #[command(flatten)]
    options: OptionArgs,
    #[command(flatten)]
    pub(super) daemon: DaemonArgs,
}

/// One drive, not yet opened.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Named {
    OnLine(DriveName),
    OfDaemon(String),
}

/// One drive that can be asked.
pub(crate) enum Source {
    OnLine(Box<OneDrive>),
    OfDaemon { daemon: Box<Daemon>, view: Value },
}

/// Why a register could not be read.
pub(super) enum Unread {
    /// The drive answers, and not this.
    Refused(String),
    /// It does not answer.
    Silent(String),
}

/// Why a register was not written.
pub(super) enum Unwritten {
    /// It holds what it held.
    Refused(String),
    /// Nobody knows what it holds.
    Unknown(String),
}

impl SourceArgs {
    /// The drives that these words name: on a line `FAMILY@ADDRESSES`, else drives, groups and lines of the daemon, or all of
    /// its drives.
    pub(super) async fn named(&self, words: &[String], all: bool) -> Result<Vec<Named>, Failure> {
        if self.line.is_some() {
            if all {
                return Err(Failure::Input("--all is for the drives of the running daemon".to_owned()));
            }
            let specs = words.iter().map(|word| word.parse::<DriveSpec>());
            let specs = specs.collect::<Result<Vec<_>, _>>();
            let specs = specs.map_err(|error| Failure::Input(error.to_string()))?;
            let names = drive_spec::on_one_line(&specs).map_err(|error| Failure::Input(error.to_string()))?;
            return Ok(names.into_iter().map(Named::OnLine).collect());
        }
        let state = self.daemon.connect().await?.state().await?;
        let drives = || state["drives"].as_array().into_iter().flatten();
        let mut named = Vec::new();
        let mut add = |is_wanted: &dyn Fn(&Value) -> bool| {
            for name in drives().filter(|drive| is_wanted(drive)).filter_map(|drive| drive["name"].as_str()) {
                let one = Named::OfDaemon(name.to_owned());
                if !named.contains(&one) {
                    named.push(one);
                }
            }
        };
        if all {
            add(&|_| true);
        }
        for word in words {
            match Target::find(&state, word) {
                Ok(target) => {
                    add(&|drive| drive["name"].as_str().is_some_and(|name| target.has(&state, name)));
                }
                Err(_) if drives().any(|drive| drive["line"] == **word) => {
                    add(&|drive| drive["line"] == **word);
                }
                Err(failure) => return Err(failure),
            }
        }
        Ok(named)
    }

    /// The one drive that a word names.
    pub(super) async fn one(&self, word: &str) -> Result<Named, Failure> {
        let mut named = self.named(&[word.to_owned()], false).await?;
        match (named.pop(), named.is_empty()) {
            (Some(one), true) => Ok(one),
            _ => Err(Failure::Input(format!("{word} names several drives: name one"))),
        }
    }

    /// The drive that a file names: by its name in the running daemon, or by its address on the line.
    pub(super) fn of_file(&self, head: &Head) -> Result<Named, Failure> {
        if self.line.is_none() {
            return Ok(Named::OfDaemon(head.name.clone()));
        }
        let slave = SlaveAddress::try_from(head.slave).map_err(|error| Failure::Input(error.to_string()))?;
        Ok(Named::OnLine(DriveName { family: head.family, slave }))
    }

    /// Reads everything that a backup of a drive keeps.
    pub(super) async fn read(&self, named: &Named) -> Result<Backup, Failure> {
        let mut source = self.open(named).await?;
        let backup = source.keep().await;
        source.close().await;
        let backup = backup?;
        match backup.nothing_read() {
            Some(why) => Err(Failure::Drive(format!("{}: {why}", named.name()))),
            None => Ok(backup),
        }
    }

    /// Opens a drive. Nothing is written by it.
    pub(super) async fn open(&self, named: &Named) -> Result<Source, Failure> {
        match (named, &self.line) {
            (Named::OnLine(name), Some(line)) => {
                Ok(Source::OnLine(Box::new(OneDrive::open(line, &self.options, *name).await?)))
            }
            (Named::OnLine(_), None) => Err(crate::one_drive::unnamed()),
            (Named::OfDaemon(name), _) => {
                let mut daemon = self.daemon.connect().await?;
                let view = daemon.get(&path_of(&["drives", name])).await?.done()?;
                Ok(Source::OfDaemon { daemon: Box::new(daemon), view })
            }
        }
    }
}

impl Named {
    /// What a person calls it.
    pub(super) fn name(&self) -> String {
        match self {
            Self::OnLine(name) => name.to_string(),
            Self::OfDaemon(name) => name.clone(),
        }
    }
}

impl Source {
    pub(super) fn family(&self) -> Result<Family, Failure> {
        match self {
            Self::OnLine(one) => Ok(one.name.family),
            Self::OfDaemon { view, .. } => {
                let key = view["family"].as_str().unwrap_or_default();
                key.parse().map_err(|error| Failure::Input(format!("the daemon's drive: {error}")))
            }
        }
    }

    pub(super) fn name(&self) -> String {
        match self {
            Self::OnLine(one) => one.name.to_string(),
            Self::OfDaemon { view, .. } => view["name"].as_str().unwrap_or_default().to_owned(),
        }
    }

    /// Reads one register, when its turn comes.
    pub(super) async fn read(&mut self, row: &'static Row) -> Result<u16, Unread> {
        match self {
            Self::OnLine(one) => one.drive.read_parameter(row).await.map_err(|error| match error.kind() {
                ErrorKind::NoAnswer | ErrorKind::NotSent => Unread::Silent(error.to_string()),
                _ => Unread::Refused(error.to_string()),
            }),
            Self::OfDaemon { daemon, view } => {
                let name = view["name"].as_str().unwrap_or_default();
                let path = path_of(&["drives", name, "parameters", &row.address.to_string()]);
                let answer = daemon.get(&path).await;
                let answer = answer.map_err(|failure| Unread::Silent(failure.to_string()))?;
                let word = answer.body["raw"].as_u64().and_then(|raw| u16::try_from(raw).ok());
                word.filter(|_| answer.status.is_success()).ok_or_else(|| {
                    let why = answer.failure().to_string();
                    if answer.body["reason"] == "drive" { Unread::Refused(why) } else { Unread::Silent(why) }
                })
            }
        }
    }

    /// Writes one register at standstill, and reads it back.
    pub(super) async fn write(&mut self, row: &'static Row, word: u16) -> Result<(), Unwritten> {
        match self {
            Self::OnLine(one) => {
                match one.drive.status().await {
                    Ok(status) if status.is_standstill() => {}
                    Ok(status) => {
                        let why =
                            format!("parameters are restored at standstill, and the drive shows {status}");
                        return Err(Unwritten::Refused(why));
                    }
                    Err(error) => return Err(Unwritten::Refused(error.to_string())),
                }
                match one.drive.write_parameter(row, word).await {
                    Ok(_) => Ok(()),
                    Err(error) if may_have_written(&error) => Err(Unwritten::Unknown(error.to_string())),
                    Err(error) => Err(Unwritten::Refused(error.to_string())),
                }
            }
            Self::OfDaemon { daemon, view } => {
                let name = view["name"].as_str().unwrap_or_default();
                let path = path_of(&["drives", name, "parameters", &row.address.to_string()]);
                let body = json!({ "value": format!("0x{word:04X}"), "only_at_standstill": true });
                let answer = daemon.put(&path, &body).await;
                let answer = answer.map_err(|failure| Unwritten::Unknown(failure.to_string()))?;
                match answer.status {
                    status if status.is_success() => Ok(()),
                    status if status.is_client_error() => {
                        Err(Unwritten::Refused(answer.failure().to_string()))
                    }
                    _ => Err(Unwritten::Unknown(answer.failure().to_string())),
                }
            }
        }
    }

    /// Saves the drive's parameters to its EEPROM, whoever changed them. Says how often that was done, where it is known.
    pub(super) async fn save(&mut self) -> Result<String, Failure> {
        match self {
            Self::OnLine(one) => {
                one.drive.assume_changed();
                let saves = one.drive.persist().await.map_err(|error| one.failure(&error))?;
                Ok(format!("; saves counted: {saves}"))
            }
            Self::OfDaemon { daemon, view } => {
                let name = view["name"].as_str().unwrap_or_default();
                let answer =
                    daemon.post(&(path_of(&["drives", name, "save"]) + "?wait=30s"), &json!({})).await?;
                match answer.body["outcome"].as_str() {
                    Some("confirmed") => Ok(String::new()),
                    _ => Err(answer.failure()),
                }
            }
        }
    }

    /// Reads everything that a backup keeps.
    pub(crate) async fn keep(&mut self) -> Result<Backup, Failure> {
        let head = self.head().await?;
        let family = head.family;
        let rows = family.capabilities().rows.iter();
        let rows: Vec<_> = rows.filter(|row| is_kept(family, row)).collect();
        let mut progress = Progress::of(&head.name, rows.len());
        let mut entries = Vec::new();
        let mut silent = 0;
        for row in rows {
            progress.step();
            let held = if silent >= SILENT_AFTER {
                Err("not asked: the drive did not answer any more".to_owned())
            } else {
                self.read(row).await.map_err(|unread| match unread {
                    Unread::Refused(why) => why,
                    Unread::Silent(why) => {
                        silent += 1;
                        why
                    }
                })
            };
            if held.is_ok() {
                silent = 0;
            }
            entries.push(Entry { row, held });
        }
        // A number without its unit would be restored as another one.
        let known: BTreeMap<u16, bool> =
            entries.iter().map(|entry| (entry.row.address, entry.held.is_ok())).collect();
        for Entry { row, held } in &mut entries {
            if let Some(by) = family.capabilities().scaled_by(row.address)
                && known.get(&by.address) != Some(&true)
                && held.is_ok()
            {
                *held = Err(format!("its unit is that of {}, which could not be read", by.code));
            }
        }
        Ok(Backup { head, entries })
    }

    async fn head(&mut self) -> Result<Head, Failure> {
        let (name, family) = (self.name(), self.family()?);
        let date = Utc::now().to_rfc3339_opts(SecondsFormat::Secs, true);
        match self {
            Self::OnLine(one) => {
                // What a family cannot say is left out.
                let identity = match one.drive.identify().await {
                    Ok(identity) => Some(identity),
                    Err(error) if error.kind() == ErrorKind::NoAnswer => return Err(one.failure(&error)),
                    Err(_) => None,
                };
                let part = |part: fn(&drive_core::Identity) -> &Option<String>| {
                    identity.as_ref().and_then(|identity| part(identity).clone())
                };
                Ok(Head {
                    name,
                    family,
                    line: line_spec::written(one.config()),
                    slave: one.name.slave.number(),
                    vendor: part(|identity| &identity.vendor),
                    model: part(|identity| &identity.model),
                    firmware: part(|identity| &identity.version),
                    date,
                })
            }
            Self::OfDaemon { view, .. } => {
                let text = |value: &Value| value.as_str().map(str::to_owned);
                let identity = &view["identity"];
                Ok(Head {
                    name,
                    family,
                    line: text(&view["line"]).unwrap_or_default(),
                    slave: view["slave"]
                        .as_u64()
                        .and_then(|slave| u8::try_from(slave).ok())
                        .unwrap_or_default(),
                    vendor: text(&identity["vendor"]),
                    model: text(&identity["model"]),
                    firmware: text(&identity["firmware"]),
                    date,
                })
            }
        }
    }

    /// Lets the drive go.
    pub(super) async fn close(self) {
        if let Self::OnLine(one) = self {
            one.close().await;
        }
    }
}

#[cfg(test)]
mod tests {
    use drive_sim::Exception;

    use super::*;
    use crate::{commands::param::testing::Bench, simulated::SetUp};

    /// What is kept of a drive to which something happens after so many requests.
    async fn kept(after: u64, happens: impl Fn(&drive_sim::SimSlave) + Send + 'static) -> Backup {
        let mut bench = Bench::of(Family::Atv312, SetUp::Factory);
        let machine = bench.machine.clone();
        let happening = tokio::spawn(async move {
            machine.wait_for_requests(after).await;
            happens(&machine);
        });
        let backup = bench.source.keep().await.unwrap();
        happening.await.unwrap();
        let kept = Family::Atv312.capabilities().rows.iter().filter(|row| is_kept(Family::Atv312, row));
        assert!(kept.eq(backup.entries.iter().map(|entry| entry.row)), "nothing is left out");
        backup
    }

    fn unread(backup: &Backup) -> Vec<&Entry> {
        backup.entries.iter().filter(|entry| entry.held.is_err()).collect()
    }

    #[tokio::test(start_paused = true)]
    async fn what_a_drive_refuses_to_tell_stands_in_its_file_with_the_reason() {
        let backup = kept(60, |machine| machine.refuse_next(Exception::ILLEGAL_ADDRESS)).await;
        let [entry] = *unread(&backup) else { panic!("{:?}", unread(&backup)) };
        assert!(entry.held.as_ref().is_err_and(|why| why.contains("exception")), "{entry:?}");
        let line = format!("{} = {{ error = \"", entry.row.code);
        assert!(backup.to_string().lines().any(|text| text.starts_with(&line)), "{backup}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_drive_that_falls_silent_is_kept_as_far_as_it_has_answered_and_not_asked_without_end() {
        let begun = tokio::time::Instant::now();
        let backup = kept(60, drive_sim::SimSlave::mute).await;
        let unread = unread(&backup);
        assert!((80..130).contains(&unread.len()), "{}", unread.len());
        assert!(unread.last().unwrap().held.as_ref().is_err_and(|why| why.starts_with("not asked")));
        // Nobody waits for each of a hundred time-outs.
        assert!(begun.elapsed() < std::time::Duration::from_secs(30), "{:?}", begun.elapsed());
        let ramps = ["ACC", "dEC", "AC2", "dE2"];
        assert!(ramps.iter().all(|code| unread.iter().any(|entry| entry.row.code == *code)));
    }
}
