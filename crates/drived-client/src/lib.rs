//! The subcommands that go to the running daemon, over its control socket.

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

mod connection;
mod holder;
mod names;
mod order;
pub mod own_line;
mod remote;
mod show;
mod watch;

use std::path::PathBuf;

pub use self::{
    connection::{Answer, Daemon, Way},
    holder::{explain, whose},
    names::{Target, path_of, wanted},
    order::{Told, order},
    remote::{AGAIN, GIVEN_UP_AFTER, Remote, timely},
    show::{faults, overview, registers, whole},
    watch::{Frames, Heard, watch},
};
pub use self::{remote::ANSWERED_WITHIN, show::overview_text};
use drived_words::{failure::Failure, output};

/// How a subcommand finds the daemon, and how it answers.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct DaemonArgs {
    /// The control socket of the daemon, if not where it usually is
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,
    /// A file with the token by which the daemon knows whose commands they are; without it, its socket's permissions do
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Print one JSON object, as the HTTP API has it
    #[arg(long)]
    json: bool,
}

impl DaemonArgs {
    /// Connects to the daemon.
    pub async fn connect(&self) -> Result<Daemon, Failure> {
        Daemon::connect(self.socket.as_deref(), self.token_file.as_deref()).await
    }

    /// Prints an answer: the object for a program, else what a person reads.
    pub fn say(
        &self,
        body: &impl serde::Serialize,
        text: impl FnOnce() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        if self.json { output::say_as_it_is(drived_words::json::line(body)) } else { text() }
    }

    /// The same of what is done, whether or not anybody can read that.
    pub fn say_done(
        &self,
        body: &impl serde::Serialize,
        text: impl FnOnce() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        output::done(self.say(body, text))
    }

    pub const fn is_json(&self) -> bool {
        self.json
    }
}
