//! Why the program ends without success, and its exit code.

use std::{io, process::ExitCode};

/// The exit codes and what they mean.
pub const EXIT_CODES: [(&str, &str); 3] = [
    ("0", "done and confirmed"),
    ("1", "a drive did not answer or did not do it"),
    ("2", "bad input or a plan that cannot work"),
];

/// Why the program ends without success: one line for a person, which says what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// What was asked for cannot be: a family, an address, a port. Exit code 2.
    #[error("{0}")]
    Input(String),
    /// A drive did not answer, refused, or did not do it. Exit code 1.
    #[error("{0}")]
    Drive(String),
    /// Our output takes nothing, as on a full disk. Exit code 1.
    #[error("the output cannot be written: {0}")]
    Output(String),
    /// Whoever read our output has gone. Nothing is said then. Exit code 1.
    #[error("nobody reads the output any more")]
    OutputClosed,
}

impl Failure {
    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(self.code())
    }

    /// The exit code as a number.
    pub const fn code(&self) -> u8 {
        match self {
            Self::Drive(_) | Self::Output(_) | Self::OutputClosed => 1,
            Self::Input(_) => 2,
        }
    }

    /// Writing to our output failed.
    pub fn output(error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::OutputClosed,
            _ => Self::Output(error.to_string()),
        }
    }
}
