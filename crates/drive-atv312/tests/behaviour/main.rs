//! The drive against its simulated counterpart, over a real line in virtual time.

mod motion;
mod reading;
mod settings;
mod support;
