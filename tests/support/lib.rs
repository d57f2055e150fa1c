//! The rig that the behaviour tests share.

pub mod cable;
pub mod configurations;
pub mod drives;
pub mod interrupted;
pub mod peers;
pub mod plant;
pub mod rig;
pub mod scene;
