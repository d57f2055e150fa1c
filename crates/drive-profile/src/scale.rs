//! Counts and what they are worth.

/// So many counts in hundredths of their unit, rounded to the nearest.
pub(crate) fn hundredths(counts: i64, numerator: i64, denominator: i64) -> i64 {
    let (counts, numerator, denominator) =
        (i128::from(counts), i128::from(numerator), i128::from(denominator));
    let doubled = 2 * 100 * counts * numerator / denominator;
    i64::try_from((doubled + doubled.signum()) / 2).unwrap_or(i64::MAX)
}

/// The counts that stand for so many hundredths: the nearest, and only where they are worth that again.
pub(crate) fn counts(value: i64, numerator: i64, denominator: i64) -> Option<i64> {
    let (wide, numerator_wide, denominator_wide) =
        (i128::from(value), i128::from(numerator), i128::from(denominator));
    let doubled = 2 * wide * denominator_wide / (100 * numerator_wide);
    let nearest = i64::try_from((doubled + doubled.signum()) / 2).ok()?;
    (hundredths(nearest, numerator, denominator) == value).then_some(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_the_nearest_count_that_is_worth_it_again_and_no_other() {
        // 4000h counts are 100 %.
        assert_eq!(counts(6_000, 100, 16_384), Some(9_830));
        assert_eq!(counts(10_000, 100, 16_384), Some(16_384));
        // Tenths hold no hundredths.
        assert_eq!((counts(3_000, 1, 10), counts(3_005, 1, 10)), (Some(300), None));
        assert_eq!(hundredths(-9_830, 100, 16_384), -6_000);
    }
}
