//! Who has a port that cannot be opened, and what to type instead.

use std::path::{Path, PathBuf};

use super::Daemon;
use drived_plant::plant::views::{DriveView, LineView};
use drived_words::drive_spec::DriveName;

/// Says whose a port is that is in use, as far as that can be known.
pub async fn explain(port: &Path, drive: Option<DriveName>) -> Option<String> {
    let whole = port.canonicalize().unwrap_or_else(|_| port.to_owned());
    let whose = match of_daemon(&whole, drive).await {
        Some(told) => told,
        None => {
            let (pid, program) = of_system(&whole)?;
            format!("held by {program} (process {pid}): end that first")
        }
    };
    Some(format!("{} is {whose}", port.display()))
}

/// Who has a port that is in use, without what to type instead.
pub async fn whose(port: &Path) -> Option<String> {
    let whole = port.canonicalize().unwrap_or_else(|_| port.to_owned());
    if let Some(told) = of_daemon(&whole, None).await {
        return told.split_once(':').map(|(whose, _)| whose.to_owned());
    }
    of_system(&whole).map(|(pid, program)| format!("held by {program} (process {pid})"))
}

/// The daemon on the control socket, if the port is that of one of its lines.
async fn of_daemon(port: &Path, drive: Option<DriveName>) -> Option<String> {
    let mut daemon = Daemon::connect(None, None).await.ok()?;
    let state = daemon.state().await.ok()?;
    let is_it = |line: &&LineView| {
        let path = line.port.split(',').next().map(PathBuf::from);
        path.is_some_and(|path| path.canonicalize().unwrap_or(path) == port)
    };
    let line = &state.lines.iter().find(is_it)?.name;
    let whose = daemon.pid().map(|pid| format!(" (process {pid})")).unwrap_or_default();
    let named = state
        .drives
        .iter()
        .find(|known| known.line == *line && drive.is_some_and(|drive| known.slave == drive.slave.number()));
    let instead = match named.map(DriveView::name) {
        Some(name) => format!("leave out --line and --drive, and name the drive as it does, {name:?}"),
        None => "leave out --line, and name a drive as drived status lists them".to_owned(),
    };
    Some(format!("line {line} of the running daemon{whose}: {instead}"))
}

/// The process that has it open, where the system tells.
fn of_system(port: &Path) -> Option<(u32, String)> {
    let own = std::process::id();
    for entry in std::fs::read_dir("/proc").ok()?.flatten() {
        let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse::<u32>().ok()) else {
            continue;
        };
        let Ok(open) = std::fs::read_dir(entry.path().join("fd")) else { continue };
        let has_it = |file: std::fs::DirEntry| std::fs::read_link(file.path()).is_ok_and(|path| path == port);
        if pid != own && open.flatten().any(has_it) {
            let program = std::fs::read_to_string(entry.path().join("comm")).unwrap_or_default();
            return Some((pid, program.trim().to_owned()));
        }
    }
    None
}
