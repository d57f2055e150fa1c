//! The rig that the behaviour tests share.

pub mod attended;
pub mod cable;
pub mod configurations;
pub mod contracts;
pub mod doubling;
pub mod drives;
pub mod interrupted;
pub mod peers;
pub mod plant;
