//! `drived profile`: drives from files.

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

mod check;
mod list;
mod new;
mod show;
mod trial;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use drive_profile::Profile;
use drived_config::profiles;
use drived_words::failure::Failure;

/// Drives from files: list them, read one as a page, check one that is written, begin one, try one on the drive
///
/// A profile says of a drive what has to be known to read it, to stop it and to run its motor, with a source for each fact. It
/// reaches one of three levels: watch, stop, motion. Profiles of your own are read from the folder that a configuration names by
/// `profiles`, or the environment by DRIVED_PROFILES.
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    List(list::Args),
    Show(show::Args),
    Check(check::Args),
    New(new::Args),
    Try(trial::Args),
}

pub async fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::List(args) => list::run(args),
        Command::Show(args) => show::run(&args),
        Command::Check(args) => check::run(&args),
        Command::New(args) => new::run(&args),
        Command::Try(args) => trial::run(args).await,
    }
}

/// The profile of a key, or of a file: what has a dot or a slash is one.
fn named(said: &str) -> Result<(Arc<Profile>, Option<PathBuf>), Failure> {
    if said.contains(['.', '/', '\\']) {
        let file = Path::new(said);
        let profile = profiles::profile(file).map_err(|error| Failure::Input(error.to_string()))?;
        return Ok((Arc::new(profile), Some(file.to_owned())));
    }
    profiles::find(said).ok_or_else(|| {
        Failure::Input(format!("there is no profile {said:?}: drived profile list has them, or name a file, such as ./{said}.toml"))
    })
}
