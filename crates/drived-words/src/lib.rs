//! The words of `drived`: what a person writes on the command line, read, and what a person and a program read of it.
//!
//! - What is given: a drive ([`drive_spec`]), its options ([`drive_options`]), a line ([`line_spec`]), a time ([`duration`]), a moment ([`moment`]),
//!   and an object that a program sends ([`strict`], [`object`]).
//! - What is told: results and tables ([`output`]), objects ([`json`]), measurements ([`values`]), parameters
//!   ([`registers`], and what has to hold among them, [`way`]), frames of a line in words ([`explain`]), and the [log](`logging`).
//! - How it ends: what went wrong ([`failure`]) being asked to end ([`signals`]) and letting a port go
//!   ([`closing`]).

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod closing;
pub mod drive_options;
pub mod drive_spec;
pub mod duration;
pub mod explain;
pub mod failure;
pub mod json;
pub mod line_spec;
pub mod logging;
pub mod meant;
pub mod moment;
pub mod object;
pub mod output;
pub mod ports;
pub mod registers;
pub mod signals;
pub mod strict;
pub mod values;
pub mod way;
