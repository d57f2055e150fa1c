//! The subcommands of `drived` that speak with a drive or with the running daemon ([`commands`]): over a line of their own
//! ([`one_drive`], [`commanded`]) or through the daemon.

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod commanded;
pub mod commands;
pub mod one_drive;
