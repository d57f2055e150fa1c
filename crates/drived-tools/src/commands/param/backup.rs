//! `drived param backup`: the parameters of drives into files.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::{file::Backup, source::SourceArgs};
use drived_words::{failure::Failure, output};

/// Keep a drive's parameters in a file, or those of many drives in a folder; nothing is written to a drive
///
/// A file has one line per register in the order of the family's map, so that a version control shows what has changed. A
/// register that could not be read stands there with the reason; the exit code is 1 then.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Drives, groups or lines of the running daemon; with --line drives such as atv312@1-10
    #[arg(value_name = "DRIVE|LINE", required_unless_present = "all")]
    names: Vec<String>,
    /// Every drive of the running daemon
    #[arg(long, conflicts_with = "names")]
    all: bool,
    /// The file; for several drives a folder, in which each has a file of its name
    #[arg(long, value_name = "FILE|FOLDER")]
    to: PathBuf,
    #[command(flatten)]
    source: SourceArgs,
}

pub(super) async fn run(args: Args) -> Result<(), Failure> {
    let named = args.source.named(&args.names, args.all).await?;
    let is_folder = named.len() > 1 || args.to.is_dir();
    if is_folder {
        let made = std::fs::create_dir_all(&args.to);
        made.map_err(|error| Failure::Input(format!("{}: {error}", args.to.display())))?;
    }
    let (mut told, mut failures, mut paths) = (Vec::new(), Vec::new(), Vec::new());
    for one in &named {
        let path = if is_folder { args.to.join(file_name(&one.name())) } else { args.to.clone() };
        if paths.contains(&path) {
            let path = path.display();
            return Err(Failure::Input(format!("{path} would be the file of two drives: give each its own")));
        }
        paths.push(path.clone());
        let kept = args.source.read(one).await;
        match kept.and_then(|backup| backup.save(&path).map(|()| backup)) {
            Ok(backup) => {
                let unread = unread(&backup);
                let text = said(&backup, &path, &unread);
                if !args.source.daemon.is_json() {
                    output::say(&text)?;
                }
                told.push(json!({
                    "drive": backup.head.name,
                    "file": path,
                    "read": backup.entries.len() - unread.len(),
                    "unread": unread,
                }));
                if !unread.is_empty() {
                    failures.push(Failure::Drive(format!("{}: not everything could be read", one.name())));
                }
            }
            // One drive that is away keeps nobody from keeping the others.
            Err(failure) if named.len() > 1 => {
                output::complain(format_args!("{}: {failure}", one.name()));
                failures.push(failure);
            }
            Err(failure) => return Err(failure),
        }
    }
    if args.source.daemon.is_json() {
        output::say_as_it_is(json!({ "backups": told }))?;
    }
    match (failures.len(), failures.pop()) {
        (_, None) => Ok(()),
        (1, Some(failure)) if named.len() == 1 => Err(failure),
        (several, Some(_)) => {
            Err(Failure::Drive(format!("{several} of {} drives are not kept whole", named.len())))
        }
    }
}

fn unread(backup: &Backup) -> Vec<&'static str> {
    backup.entries.iter().filter(|entry| entry.held.is_err()).map(|entry| entry.row.code).collect()
}

fn said(backup: &Backup, path: &Path, unread: &[&str]) -> String {
    let read = output::counted(backup.entries.len() - unread.len(), "parameter", "parameters");
    let text = format!("{}: {read} in {}", backup.head.name, path.display());
    match unread {
        [] => text,
        _ => format!("{text}; {} could not be read, the file says why: {}", unread.len(), unread.join(", ")),
    }
}

/// The file of a drive in a folder: its name, as far as any file system takes it.
fn file_name(name: &str) -> String {
    let is_plain = |character: &char| character.is_alphanumeric() || "-_.@ ".contains(*character);
    let plain: String =
        name.chars().map(|character| if is_plain(&character) { character } else { '_' }).collect();
    format!("{}.toml", plain.trim_start_matches('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_drive_makes_no_file_elsewhere() {
        for (name, file) in [
            ("pump 1", "pump 1.toml"),
            ("atv312@1", "atv312@1.toml"),
            ("../../etc/passwd", "_.._etc_passwd.toml"),
            ("Lüfter/2", "Lüfter_2.toml"),
        ] {
            assert_eq!(file_name(name), file);
        }
    }
}
