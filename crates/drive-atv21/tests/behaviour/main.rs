//! The driver against the simulated drive, over a real line, in virtual time.

mod in_force;
mod lease;
mod motion;
mod reading;
mod settings;
mod support;
mod torn;
