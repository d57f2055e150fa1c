//! A variable-speed drive from a file: any maker's, checked like a program, under the same rules of motion.
//!
//! A profile is data alone, in TOML. It answers every question that driving a motor asks, each with a value, `none` or `unknown`, and names
//! a source for each fact. [`read`] refuses what is malformed or lies, with line, reason and what to write instead; of what is right it
//! says how far the drive can be trusted by it: a [`Level`], and in words what keeps it from the next.
//!
//! ```
//! use drive_profile::{Level, shipped};
//!
//! let profile = shipped::find("v20").expect("it is shipped");
//! assert_eq!(profile.level(), Level::Motion);
//! for gap in profile.gaps() {
//!     println!("{gap}");
//! }
//! ```
//!
//! No task, no clock and no file access: a text goes in.

#![forbid(unsafe_code)]

mod check;
mod drive;
#[cfg(feature = "families")]
mod family;
pub mod format;
mod ladder;
#[cfg(feature = "sim")]
pub mod machine;
mod profile;
mod read_back;
mod requests;
mod scale;
pub mod shipped;
mod source;
mod substance;
mod written;

#[cfg(feature = "schemars")]
pub use format::schema;

pub use check::{LONGEST, Refusal, Refusals, read};
pub use drive::{Owner, ProfileDrive};
#[cfg(feature = "families")]
pub use family::definition;
pub use ladder::{Gap, Level};
pub use profile::Profile;
pub use substance::digest;
