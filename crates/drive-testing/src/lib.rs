//! What the tests of the drive families share, those of this house and those of others.
//!
//! - [`frames`]: the frames that a manual prints, as bytes on a wire: what a driver sends on a real line and how it reads
//!   the answer, and what a simulated drive answers.
//! - [`words`]: a drive that is nothing but words, behind a plain port: what is asked of it, and what becomes of writes.
//! - [`babble`]: a drive that answers any word to anything.
//! - [`bench`](mod@bench), [`rig`]: one simulated drive on a line in virtual time.
//! - [`truth`]: what a status says, against the machine; [`witness`]: what others tell of it, against the machine.
//! - [`referee`]: who may move a motor and what stops it, by the manuals alone.
//! - [`worlds`]: everything around a drive that may decide over its motor, and who judges what is said of it then.
//! - [`peers`]: what was not written here, and tests that cannot run without it.
//! - [`Contract`]: what every family promises of itself, for a family from anywhere to run on itself.
//!
//! This crate is for tests: its functions panic when what they check is not so.

#![forbid(unsafe_code)]

pub mod babble;
pub mod bench;
pub mod contract;
pub mod frames;
pub mod mutants;
pub mod peers;
pub mod recorder;
pub mod referee;
pub mod rig;
pub mod truth;
pub mod witness;
pub mod words;

pub use contract::Contract;
pub use contract::worlds;

/// The examples of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExamples;
