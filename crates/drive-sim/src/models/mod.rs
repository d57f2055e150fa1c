//! The simulated drives, one module a family.
