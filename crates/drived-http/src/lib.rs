//! The faces of `drived` that are served over HTTP, behind its doors: the API v1 ([`api`]), the page ([`page`]), and what a
//! metrics store scrapes ([`metrics`]).

#![forbid(unsafe_code)]
#![allow(
    missing_docs,
    missing_copy_implementations,
    reason = "a crate of the program: what is public is so for its other crates, and most names say it all"
)]

pub mod api;
pub mod metrics;
pub mod page;
