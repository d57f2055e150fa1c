//! The families of this workspace.

pub(crate) mod atv21;
pub(crate) mod atv28;
pub(crate) mod atv312;
pub(crate) mod atv58;
pub(crate) mod omron_3g3ev;
