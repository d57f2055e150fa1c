//! The subcommands of `drived` that ask or tell something: of a drive, of a line, of the running daemon ([`commands`]), over a
//! line of their own ([`one_drive`], [`commanded`]) or through the daemon; and what the words of a line mean ([`explain`]).

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    reason = "a crate of the program: what is public is so for its other crates, and most names say it all"
)]

pub mod commanded;
pub mod commands;
pub mod explain;
pub mod one_drive;
