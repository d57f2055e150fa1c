//! The subcommands of `drived` that speak of a line, one module each: what is on it, what is wrong with it, what goes over it, and what a
//! plan or a simulated line would do.

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod capture;
pub mod doctor;
pub mod explain;
pub mod families;
mod frames;
pub mod init;
pub mod plan;
pub mod poll;
pub mod replay;
pub mod scan;
pub mod sim;
mod taken;
#[cfg(test)]
mod testing;
