//! What a person sees of drives on a terminal: a drive in one row ([`row`]), and a table that is drawn again and again
//! ([`screen`]).

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod row;
pub mod screen;
