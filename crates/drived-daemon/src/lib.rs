//! The daemon: the drives of a configuration with every face ([`run`]), and the same with simulated drives ([`demo`]).

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod demo;
pub mod run;
