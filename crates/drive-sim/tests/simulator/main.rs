//! The simulator seen from a master and from a test, with a small drive and a master of its own.

mod ascii;
mod control;
mod dialects;
mod endpoints;
mod faults;
mod fuzz;
mod line;
mod playback;
mod support;
mod unitelway;
