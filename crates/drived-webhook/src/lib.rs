//! Tells the alarms of a plant to whoever takes a POST over HTTP: a pager, a chat, a mail bridge, a program of one's own.
//!
//! What is told is an alarm **as it is now**, whenever it has come, come again, returned, or somebody has done something about it. What
//! a receiver has not taken yet is replaced by what is so since; so a queue never holds more than one message of each alarm, and a
//! receiver that was away for a night gets what is so in the morning. What each has been told outlives the program.

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod config;
mod counters;
mod face;
mod memory;
mod message;
mod outbox;
mod post;
mod sending;
mod signature;
mod template;
#[cfg(test)]
mod tests;

pub use self::face::FACE;
