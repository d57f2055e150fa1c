//! The limits of a setpoint in rpm, as the Altivar 28 and 312 hold them, and whether the drive follows a setpoint.

use drive_core::{
    Calls, Frequency, Port, Result, SetpointProblem, Speed, access::Readable, registers::Register,
};

/// The word `FrH` counts tenths of a hertz, whatever the reference counts.
const FRH_STEP: u32 = 10;
/// Two rounded images of one speed, of which one was a frequency of 0.1 Hz on the way, differ by no more rpm than that.
const SPEED_STEP: u16 = 3;

/// Whether the reference before the ramp, `FrH`, is what the bus asks for: as it is, or kept between the limits. No manual says which of
/// the two it is where `LSP` or `HSP` is set across a setpoint (BBV51701 p. 21: "frequency reference before ramp").
#[must_use]
pub fn follows_frequency(frh: Frequency, asked: Frequency, (low, high): (Frequency, Frequency)) -> bool {
    let is = |asked: Frequency| frh.centihertz().abs_diff(asked.centihertz()) <= FRH_STEP;
    is(asked) || is(asked.max(low).min(high))
}

/// Whether the speed reference at the ramp's input, `FRHD`, is the one that the bus asks for, `LFRD`. An `LFRD` of zero is
/// also that of a drive which was never given a speed, and shows nothing.
#[must_use]
pub const fn follows_speed(frhd: u16, lfrd: u16) -> bool {
    let [follows, asked] = [frhd.cast_signed().unsigned_abs(), lfrd.cast_signed().unsigned_abs()];
    asked != 0 && follows.abs_diff(asked) <= SPEED_STEP
}

/// Whether the reference before the ramp, `FrH`, is this speed, by the high limit that the drive tells in both units: `HSP`, and `SMAL` in
/// rpm. Of a drive that tells none it is not known to be.
#[must_use]
pub(crate) fn is_speed(frh: Frequency, speed: u16, (hsp, smal): (Frequency, Speed)) -> bool {
    let [frh, hsp] = [frh, hsp].map(|frequency| u64::from(frequency.centihertz()));
    let [speed, smal] = [u64::from(speed.cast_signed().unsigned_abs()), u64::from(smal.rpm())];
    // One is what the reference of the bus and its image at the ramp differ by, another what both units do.
    let step = 2 * u64::from(SPEED_STEP) * hsp + u64::from(FRH_STEP) * smal;
    hsp != 0 && smal != 0 && (frh * smal).abs_diff(speed * hsp) <= step
}

/// Reads `SMIL` and `SMAL`, which are `LSP` and `HSP` in rpm: four words from `smil` on, each limit with its low word
/// first (BBV51701 p. 18).
///
/// # Errors
/// Those of [`Calls`].
pub async fn speed_limits<P: Port>(
    calls: &mut Calls<'_, P>,
    smil: Register<impl Readable>,
) -> Result<(Speed, Speed)> {
    let [smil_low, smil_high, smal_low, smal_high] = calls.read_array(smil.address()).await?;
    let speed = |low, high| Speed::from_rpm(u32::from(high) << 16 | u32::from(low));
    Ok((speed(smil_low, smil_high), speed(smal_low, smal_high)))
}

/// The word of `LFRD` for a speed; the register is signed.
///
/// # Errors
/// [`SetpointProblem`] for a speed outside the limits or beyond the register.
pub fn speed_word(speed: Speed, (low, high): (Speed, Speed)) -> Result<u16, SetpointProblem> {
    if !(low..=high).contains(&speed) {
        return Err(SetpointProblem::OutsideSpeedLimits { low, high });
    }
    i16::try_from(speed.rpm()).map(i16::cast_unsigned).map_err(|_| SetpointProblem::TooLarge)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reference_of_somebody_else_is_told_from_that_of_the_bus() {
        let hertz = Frequency::from_hertz;
        let limits = (hertz(10), hertz(50));
        assert!(follows_frequency(hertz(30), hertz(30), limits));
        assert!(follows_frequency(hertz(10), hertz(0), limits), "kept at LSP");
        assert!(!follows_frequency(hertz(50), hertz(30), limits));
        assert!(!follows_frequency(Frequency::from_centihertz(3_020), hertz(30), limits));
        assert!(follows_speed((-898_i16).cast_unsigned(), 900));
        assert!(!follows_speed(300, 900));
        assert!(!follows_speed(0, 0));
    }

    #[test]
    fn a_frequency_is_known_to_be_a_speed_by_the_high_limit_alone() {
        let hertz = Frequency::from_hertz;
        let high = (hertz(50), Speed::from_rpm(1_420));
        assert!(is_speed(hertz(20), 568, high) && is_speed(hertz(20), (-566_i16).cast_unsigned(), high));
        assert!(!is_speed(hertz(0), 568, high), "it was at rest before");
        assert!(!is_speed(hertz(40), 284, high), "that of before");
        assert!(!is_speed(hertz(20), 568, (hertz(50), Speed::from_rpm(0))));
        assert!(!is_speed(hertz(0), 0, (hertz(0), Speed::from_rpm(0))));
    }

    #[test]
    fn a_speed_is_its_own_word_within_the_limits_and_the_sign() {
        let limits = |low, high| (Speed::from_rpm(low), Speed::from_rpm(high));
        assert_eq!(speed_word(Speed::from_rpm(1_500), limits(0, 1_500)), Ok(1_500));
        assert_eq!(speed_word(Speed::from_rpm(32_768), limits(0, 60_000)), Err(SetpointProblem::TooLarge));
        let (low, high) = limits(100, 1_500);
        let outside = Err(SetpointProblem::OutsideSpeedLimits { low, high });
        for rpm in [99, 1_501, 70_000] {
            assert_eq!(speed_word(Speed::from_rpm(rpm), (low, high)), outside, "{rpm}");
        }
    }
}
