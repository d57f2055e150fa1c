//! The simulated drives, one module a family, and what families share.

pub mod drivecom;
