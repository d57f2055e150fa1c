//! The plant as every face of `drived` sees it: the fleet with its groups, what is commanded and what is told of it
//! ([`plant`]), a command followed to its end ([`follow`]), what the log says ([`journal`]), what a line finds wrong with
//! itself ([`findings`]), and what is counted ([`counts`]).

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod counts;
pub mod findings;
pub mod follow;
pub mod journal;
pub mod plant;
