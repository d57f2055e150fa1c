//! What holds at `drived` before a drive is spoken to: what a configuration is made of ([`config`]), who may do what
//! ([`rights`]), the drives that come from files ([`profiles`]), the name of the host ([`host`]), and what is kept in files ([`kept`]), such
//! as the records of each drive ([`records`]) and its number ([`names`]).

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod config;
pub mod host;
pub mod kept;
pub mod names;
pub mod places;
pub mod profiles;
pub mod records;
pub mod rights;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
