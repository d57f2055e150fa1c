//! What is told at `/metrics`: every metric in one table ([`table`]), and the samples of a scrape ([`samples`]), to which whatever
//! counts something adds its own.

pub mod samples;
pub mod table;

pub use self::{
    samples::{Samples, Source},
    table::Id,
};
