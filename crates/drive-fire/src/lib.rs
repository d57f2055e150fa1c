//! Attacks on everything that stands: worlds, faults, schedules and bytes that nobody thought of, generated, counted, and each with a
//! line that replays it. The README says what each part does and what it has found.
//!
//! A part is worth what it finds of the defects that were planted for it: [`report::Plant`].

#![forbid(unsafe_code)]

pub mod all;
mod child;
pub mod differential;
pub mod fuzz;
pub mod matrix;
pub mod model;
pub mod mutation;
pub mod program;
pub mod report;
pub mod sbom;
pub mod soak;
