//! The limits of a setpoint in rpm, as the Altivar 28 and 312 hold them.

use crate::{
    access::Calls,
    error::{Result, SetpointProblem},
    port::Port,
    registers::{Register, access::Readable},
    units::Speed,
};

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
