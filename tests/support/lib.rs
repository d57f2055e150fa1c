//! The rig that the behaviour tests share.

pub mod cable;
pub mod drives;
pub mod interrupted;
pub mod peers;
pub mod plant;
pub mod rig;
