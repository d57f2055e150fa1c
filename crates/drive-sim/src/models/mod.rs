//! The simulated drives, one module a family, and what families share.

pub mod atv21;
pub mod atv28;
pub mod atv312;
pub mod atv58;
pub mod drive_3g3ev;
pub mod drivecom;
