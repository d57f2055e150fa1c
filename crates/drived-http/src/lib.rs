//! The faces of `drived` that are served over HTTP, behind its doors: the API v1 ([`api`]), the page ([`page`]), and what a
//! metrics store scrapes ([`metrics`]).

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    rustdoc::private_intra_doc_links,
    reason = "a crate of the program: what is public is so for its other crates, who read its sources, and most names say it all"
)]

pub mod api;
pub mod metrics;
pub mod page;
