//! Why a fleet cannot be.

use drive_core::{LineMismatch, SlaveAddress, SlaveAddressError};

use crate::plan::PlanProblem;

/// Why a fleet cannot be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FleetError {
    /// Two drives or two lines have one name.
    #[error("{0:?}: the name is taken")]
    NameTaken(String),
    /// A line is there already, under another name: its slaves would be commanded twice.
    #[error("{line:?} is the line {other:?}")]
    LineTaken {
        /// The second name.
        line: String,
        /// The first.
        other: String,
    },
    /// The fleet has no drive of this name.
    #[error("there is no drive {0:?}")]
    NoSuchDrive(String),
    /// The fleet has shut down.
    #[error("the fleet has shut down")]
    ShutDown,
    /// A drive names a line that is not there.
    #[error("{drive}: there is no line {line:?}")]
    NoSuchLine {
        /// The drive.
        drive: String,
        /// The line that it names.
        line: String,
    },
    /// A drive's address is none.
    #[error("{drive}: {problem}")]
    NoAddress {
        /// The drive.
        drive: String,
        /// Why.
        problem: SlaveAddressError,
    },
    /// What was made for an address talks to another one.
    #[error("{drive}: registered at address {slave}, and made for address {made_for}")]
    OtherAddress {
        /// The drive.
        drive: String,
        /// Where it is registered.
        slave: SlaveAddress,
        /// Where it talks to.
        made_for: SlaveAddress,
    },
    /// Two drives of one line have one address.
    #[error("{drive}: address {slave} of line {line:?} is taken")]
    AddressTaken {
        /// The second drive.
        drive: String,
        /// The line.
        line: String,
        /// The address.
        slave: SlaveAddress,
    },
    /// The drive cannot live on its line.
    #[error("{drive}: {problem}")]
    Mismatch {
        /// The drive.
        drive: String,
        /// Why.
        problem: LineMismatch,
    },
    /// A setting of the drive contradicts another one or its family.
    #[error("{drive}: {problem}")]
    Setting {
        /// The drive.
        drive: String,
        /// Which and why.
        problem: SettingProblem,
    },
    /// The drives of a line want more than it gives.
    #[error("line {line:?}: {problem}")]
    Plan {
        /// The line.
        line: String,
        /// The arithmetic.
        problem: PlanProblem,
    },
}

/// A setting that contradicts another one or the family.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
#[non_exhaustive]
pub struct SettingProblem {
    /// The field of [`DriveSettings`](crate::DriveSettings).
    pub setting: &'static str,
    /// One sentence: why, and what was expected.
    pub reason: String,
}
