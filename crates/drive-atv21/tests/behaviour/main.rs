//! The driver against the simulated drive, over a real line, in virtual time.

mod motion;
mod reading;
mod settings;
mod support;
