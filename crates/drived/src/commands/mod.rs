//! The subcommands that speak of the whole program, one module each.

pub(crate) mod audit;
pub(crate) mod check;
pub(crate) mod completions;
pub(crate) mod export;
pub(crate) mod names;
pub(crate) mod token;
