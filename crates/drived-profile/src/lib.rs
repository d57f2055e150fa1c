//! `drived profile`: drives from files.

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

mod check;
#[cfg(test)]
mod hour;
mod list;
mod named;
mod new;
mod show;
mod trial;

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
    // It says more than all others together.
    Try(Box<trial::Args>),
}

pub async fn run(command: Command) -> Result<(), Failure> {
    match command {
        Command::List(args) => list::run(args),
        Command::Show(args) => show::run(&args),
        Command::Check(args) => check::run(&args),
        Command::New(args) => new::run(&args),
        Command::Try(args) => trial::run(*args).await,
    }
}
