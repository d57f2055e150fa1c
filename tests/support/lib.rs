//! The rig that the behaviour tests share.

pub mod cable;
pub mod drives;
pub mod peers;
pub mod plant;
pub mod rig;
