//! The fault register. The bits of `CMD` and `ETA` are those of the chart, [`drive_drivecom`]; what the drive has
//! beyond them is a setting, [`Atv58Map`](crate::Atv58Map).
//!
//! The card's manual writes 6 to `CMD` (VVDED397054 p. 21/45), which is DRIVECOM's "shutdown", and a user's report has 7
//! for stop and 15 for run, so the drive follows the chart that the Altivar 28 and 312 follow too (BBV51701 p. 10–13,
//! 19, 21).

/// The fault register `FLT` (W483): 16 fault bits whose meanings are not public, kept as their numbers, which the manual
/// writes as `W483,2` (VVDED397054 p. 10/34).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct FaultRegister(pub u16);

impl FaultRegister {
    /// The numbers of the bits that are set, the lowest first.
    pub fn bits(self) -> impl Iterator<Item = u16> {
        (0..16).filter(move |bit| self.0 >> bit & 1 == 1)
    }
}
