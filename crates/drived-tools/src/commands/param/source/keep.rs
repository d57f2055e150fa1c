//! Everything that a backup keeps, read from a drive.

use std::collections::BTreeMap;

use chrono::{SecondsFormat, Utc};
use drive_core::{ErrorKind, Identity, registers::Place};

use super::{Source, Unread};
use crate::commands::param::file::{Backup, Entry, Head, is_kept};
use drived_words::{failure::Failure, output::Progress, values};

/// A drive that does not answer so often in a row is not asked for the rest.
const SILENT_AFTER: usize = 3;

impl Source {
    /// Reads everything that a backup keeps.
    pub async fn keep(&mut self) -> Result<Backup, Failure> {
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
        let known: BTreeMap<Place, bool> =
            entries.iter().map(|entry| (entry.row.place(), entry.held.is_ok())).collect();
        for Entry { row, held } in &mut entries {
            if let Some(by) = family.capabilities().scaled_by(row.address)
                && known.get(&by.place()) != Some(&true)
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
                let part = |part: fn(&Identity) -> &Option<String>| {
                    identity.as_ref().and_then(|identity| part(identity).clone())
                };
                Ok(Head {
                    name,
                    family,
                    line: one.config().to_string(),
                    slave: one.name.slave.number(),
                    vendor: part(|identity| &identity.vendor),
                    model: part(|identity| &identity.model),
                    firmware: part(|identity| &identity.version),
                    date,
                })
            }
            Self::OfDaemon { view, .. } => {
                let identity = values::identity(&view.snapshot.identity);
                let part =
                    |part: fn(&Identity) -> &Option<String>| identity.and_then(|all| part(all).clone());
                Ok(Head {
                    name,
                    family,
                    line: view.line.clone(),
                    slave: view.slave,
                    vendor: part(|identity| &identity.vendor),
                    model: part(|identity| &identity.model),
                    firmware: part(|identity| &identity.version),
                    date,
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use drive_families::{Family, SetUp};
    use drive_sim::Exception;

    use super::*;
    use crate::commands::param::testing::Bench;

    /// What is kept of a drive to which something happens after so many requests.
    async fn kept(after: u64, happens: impl Fn(&drive_sim::SimSlave) + Send + 'static) -> Backup {
        let mut bench = Bench::of(Family::ATV312, SetUp::Factory);
        let machine = bench.machine.clone();
        let happening = tokio::spawn(async move {
            machine.wait_for_requests(after).await;
            happens(&machine);
        });
        let backup = bench.source.keep().await.unwrap();
        happening.await.unwrap();
        let kept = Family::ATV312.capabilities().rows.iter().filter(|row| is_kept(Family::ATV312, row));
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
