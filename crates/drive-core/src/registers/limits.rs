//! What a manual prints of the values that a register takes by what others of the drive hold: as data, so that it is refused before it
//! is written.

use super::row::Row;

/// Which values some registers take, each by itself, by what others hold. These are what the drive is or what was chosen before: they
/// are not judged by it themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Limit {
    /// Which registers are limited.
    pub registers: &'static [u16],
    /// The register by which.
    pub by: u16,
    /// To what.
    pub allows: Allows,
    /// As the manual prints it, with the page.
    pub why: &'static str,
}

/// The kinds of [`Limit`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Allows {
    /// From so many to so many percent of what the other one holds, both in one unit. A bound that is no whole count is taken to the
    /// next one outside: to which the drive rounds it is printed nowhere. 0 is no rating, and limits nothing.
    Percent(i32, i32),
    /// From so many to so many counts, for each word of the other one.
    Between(&'static [(u16, i32, i32)]),
    /// The first words only while the other one holds one of the second; all others always.
    Words(&'static [u16], &'static [u16]),
    /// These bits only while the other one is assigned to nothing, which is 0.
    BitsOfUnassigned(u16),
    /// Any value, and only while the other one is assigned to nothing, which is 0.
    Unassigned,
}

/// A limit that a word does not keep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exceeded {
    /// Which limit.
    pub limit: &'static Limit,
    /// The register by which it counts.
    pub by: &'static Row,
    /// What that holds.
    pub held: u16,
    /// From and to in counts of the register that is limited, where it is a number.
    pub span: Option<(i32, i32)>,
}

impl Limit {
    /// What of it a word does not keep in one of its registers; `None` where it does. A number in the list of a register ("not set") is
    /// limited by no number, and what is not known, or is nothing that the other register can hold, limits nothing.
    #[must_use]
    pub fn exceeded(
        &'static self,
        rows: &'static [Row],
        (row, word): (&Row, u16),
        held: &dyn Fn(u16) -> Option<u16>,
    ) -> Option<Exceeded> {
        let by = rows.iter().find(|row| row.address == self.by)?;
        let known = held(self.by).filter(|known| by.range.allows(by.unit.number(*known)))?;
        let number = row.choice(word).is_none().then(|| row.unit.number(word));
        let outside = |low: i32, high: i32| {
            number.is_some_and(|number| !(low..=high).contains(&number)).then_some(Some((low, high)))
        };
        let span = match self.allows {
            Allows::Percent(least, most) => {
                let (of, whole) = (i64::from(by.unit.number(known)), 100);
                let counts = |count: i64| i32::try_from(count).unwrap_or(i32::MAX);
                let low = counts((of * i64::from(least)).div_euclid(whole));
                let high = counts((of * i64::from(most) + whole - 1).div_euclid(whole));
                if of > 0 { outside(low, high) } else { None }
            }
            Allows::Between(spans) => {
                let (_, low, high) = spans.iter().find(|(of, ..)| *of == known)?;
                outside(*low, *high)
            }
            Allows::Words(words, while_held) => {
                (words.contains(&word) && !while_held.contains(&known)).then_some(None)
            }
            Allows::BitsOfUnassigned(bits) => (known != 0 && word & bits != 0).then_some(None),
            Allows::Unassigned => (known != 0).then_some(None),
        }?;
        Some(Exceeded { limit: self, by, held: known, span })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registers::Choice;

    const NOT_SET: &[Choice] = &[Choice::new(65_535, "nO", "not set")];
    const LEVELS: &[Choice] = &[Choice::new(0, "L1", ""), Choice::new(1, "L2", "")];

    crate::registers! {
        /// A current, the drive's nominal one, a level, a word of outputs.
        pub(crate) const ROWS;

        ITH: ReadWrite(1, "ItH", "current", RamUntilSaved, Unit::scaled("A", 1), Range::OneOfOr(NOT_SET, 0, 65_534), Factory::None, Elsewhere, "test");
        INV: Read(2, "INV", "nominal", Volatile, Unit::scaled("A", 1), Range::Any, Factory::None, Elsewhere, "test");
        LAC: ReadWrite(3, "LAC", "level", RamUntilSaved, Unit::CODE, Range::OneOf(LEVELS), Factory::None, Elsewhere, "test");
        OUT: ReadWrite(4, "OUT", "outputs", Volatile, Unit::BITS, Range::Bits(0x0700), Factory::None, Elsewhere, "test");
    }

    fn span(by: u16, allows: Allows, word: u16, held: Option<u16>) -> Option<Option<(i32, i32)>> {
        let limit = Box::leak(Box::new(Limit { registers: &[1], by, allows, why: "test" }));
        limit.exceeded(ROWS, (ITH.row(), word), &|_| held).map(|exceeded| exceeded.span)
    }

    #[test]
    fn a_share_of_a_rating_limits_what_is_no_listed_value_and_a_rating_of_nothing_limits_nothing() {
        let share = |word, of| span(2, Allows::Percent(25, 150), word, of);
        // 0.25 to 1.5 times 4.1 A are 1.025 to 6.15 A.
        assert_eq!([10, 62, 65_535].map(|word| share(word, Some(41))), [None; 3]);
        assert_eq!([9, 63].map(|word| share(word, Some(41))), [Some(Some((10, 62))); 2]);
        assert_eq!([share(900, None), share(900, Some(0))], [None; 2]);
    }

    #[test]
    fn a_word_that_a_level_does_not_have_is_told_and_a_level_that_is_none_limits_nothing() {
        let word = |word, level| span(3, Allows::Words(&[160], &[1]), word, level);
        assert_eq!(word(160, Some(0)), Some(None));
        assert_eq!([word(160, Some(1)), word(2, Some(0)), word(160, Some(7)), word(160, None)], [None; 4]);
    }

    #[test]
    fn an_output_is_written_only_while_no_function_has_it_and_a_reserved_bit_never() {
        let bit = |word, held| span(2, Allows::BitsOfUnassigned(0x0100), word, held);
        assert_eq!(
            [bit(0x0100, Some(1)), bit(0x0100, Some(0)), bit(0x0200, Some(1))],
            [Some(None), None, None]
        );
        assert_eq!(
            [span(2, Allows::Unassigned, 0, Some(1)), span(2, Allows::Unassigned, 5, Some(0))],
            [Some(None), None]
        );
        let allowed = [0x0000, 0x0300, 0x0701, 0x8000].map(|word| OUT.row().range.allows(word));
        assert_eq!(allowed, [true, true, false, false]);
    }
}
