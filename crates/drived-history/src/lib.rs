//! The black box of a plant: what the daemon knows, kept for years in one SQLite file, and asked.
//!
//! The [writing half](mod@write) is fed by the fleet's snapshots and by the event stream, through an [inbox](write::inbox) that takes or refuses
//! at once: no line, no stop and no answer waits for a disk. The [reading half](read) opens the file beside a daemon that writes it, or
//! without one.

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

mod asked;
mod captured;
mod chunk;
mod clocks;
pub mod column;
pub mod config;
pub mod curve;
mod departure;
mod doubt;
mod errors;
mod face;
pub mod forecast;
pub mod forward;
mod gone;
mod listen;
mod maintenance;
pub mod outages;
mod past;
pub mod quantity;
pub mod read;
mod reason;
pub mod record;
mod stop_key;
pub mod store;
pub mod story;
pub mod tracker;
mod untold;
pub mod write;

pub use self::face::{FACE, config_of};

#[cfg(test)]
mod tests;
