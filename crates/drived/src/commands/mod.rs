//! The subcommands that speak of the whole program, one module each.

pub(crate) mod audit;
pub(crate) mod check;
pub(crate) mod completions;
pub(crate) mod export;
#[cfg(feature = "history")]
pub(crate) mod history;
pub(crate) mod names;
#[cfg(feature = "history")]
mod plot;
pub(crate) mod token;
#[cfg(feature = "history")]
pub(crate) mod why;
