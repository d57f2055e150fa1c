//! What a manual prints of the values of several registers together: as data, so that whoever writes them keeps it at every moment.

use super::row::Row;

/// What has to hold among the values of some registers at every moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Relation {
    /// What holds.
    pub holds: Holds,
    /// Among which registers.
    pub registers: &'static [u16],
    /// As the manual prints it, with the page.
    pub why: &'static str,
}

/// The kinds of [`Relation`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Holds {
    /// None is above the next one. A listed value ("not set") is no number, and is compared with nothing.
    NotAbove,
    /// All together are at most so many counts.
    SumAtMost(i32),
    /// None is assigned, which is another word than 0, without the next one.
    NotWithoutNext,
    /// No two hold the same.
    Distinct,
    /// The first, in its unit, is at most so many times the second, in its unit: so many for each word of the third.
    RatioAtMost(&'static [(u16, i32)]),
    /// The first holds one of the first words only while the second holds one of the others.
    WordsOnlyWith(&'static [u16], &'static [u16]),
}

/// A register and its word.
type Held = (&'static Row, u16);

impl Relation {
    /// The registers that break it with what is held; `None` where it holds. What is not known breaks nothing.
    #[must_use]
    pub fn broken(
        &self,
        rows: &'static [Row],
        held: &dyn Fn(u16) -> Option<u16>,
    ) -> Option<Vec<&'static Row>> {
        let rows =
            self.registers.iter().filter_map(|&address| rows.iter().find(|row| row.address == address));
        let known: Vec<Held> = rows.filter_map(|row| Some((row, held(row.address)?))).collect();
        let number = |(row, word): &Held| {
            let is_number = row.choice(*word).is_none();
            is_number.then(|| i64::from(row.unit.number(*word)))
        };
        let pair_where = |breaks: &dyn Fn(&[Held]) -> bool| {
            let pair = known.windows(2).find(|pair| breaks(pair))?;
            Some(pair.iter().map(|(row, _)| *row).collect())
        };
        match self.holds {
            Holds::NotAbove => pair_where(&|pair| {
                let (one, next) = (number(&pair[0]), number(&pair[1]));
                one.zip(next).is_some_and(|(one, next)| one > next)
            }),
            Holds::NotWithoutNext => pair_where(&|pair| pair[0].1 != 0 && pair[1].1 == 0),
            Holds::SumAtMost(most) => {
                let sum: i64 = known.iter().filter_map(number).sum();
                (sum > i64::from(most)).then(|| known.iter().map(|(row, _)| *row).collect())
            }
            Holds::RatioAtMost(most) => {
                let [one, two, by] = &*known else { return None };
                let (_, most) = most.iter().find(|(word, _)| *word == by.1)?;
                let step = |(row, _): &Held| 10_i64.pow(u32::from(row.unit.decimals));
                let (above, below) = (number(one)? * step(two), number(two)? * step(one));
                (below > 0 && above > i64::from(*most) * below).then(|| vec![one.0, two.0])
            }
            Holds::WordsOnlyWith(words, others) => {
                let [one, other] = &*known else { return None };
                (words.contains(&one.1) && !others.contains(&other.1)).then(|| vec![one.0, other.0])
            }
            Holds::Distinct => known.iter().enumerate().find_map(|(index, (row, word))| {
                let (other, _) = known.iter().skip(index + 1).find(|(_, other)| other == word)?;
                Some(vec![*row, *other])
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registers::Choice;

    const NOT_SET: &[Choice] = &[Choice::new(65_535, "nO", "not set")];

    crate::registers! {
        /// Three limits, each not above the next, and one of them that may be not set.
        pub(crate) const ROWS;

        BEN: ReadWrite(1, "bEn", "threshold", RamUntilSaved, Unit::scaled("Hz", 1), Range::OneOfOr(NOT_SET, 0, 5_000), Factory::None, Elsewhere, "test");
        LSP: ReadWrite(2, "LSP", "low", RamUntilSaved, Unit::scaled("Hz", 1), Range::Any, Factory::None, Elsewhere, "test");
        HSP: ReadWrite(3, "HSP", "high", RamUntilSaved, Unit::scaled("Hz", 1).signed(), Range::Any, Factory::None, Elsewhere, "test");
    }

    fn broken(holds: Holds, held: [Option<u16>; 3]) -> Option<Vec<&'static str>> {
        let relation = Relation { holds, registers: &[1, 2, 3], why: "test" };
        let word = |address: u16| held.get(usize::from(address) - 1).copied().flatten();
        relation.broken(ROWS, &word).map(|rows| rows.iter().map(|row| row.code).collect())
    }

    #[test]
    fn what_is_above_its_neighbour_is_named_and_what_is_not_known_or_not_set_breaks_nothing() {
        let limits = |held| broken(Holds::NotAbove, held);
        assert_eq!(limits([Some(1), Some(1), Some(500)]), None);
        assert_eq!(limits([Some(0), Some(600), Some(500)]), Some(vec!["LSP", "HSP"]));
        assert_eq!(limits([Some(65_535), Some(0), Some(0)]), None, "not set");
        assert_eq!(limits([Some(0), Some(600), None]), None);
        // The unit is signed: FFFFh is -1.
        assert_eq!(limits([None, Some(0), Some(65_535)]), Some(vec!["LSP", "HSP"]));
    }

    #[test]
    fn a_ratio_is_judged_by_the_word_that_chooses_it_and_a_word_by_the_one_it_needs() {
        // bEn and LSP count 0.1, so the ratio is that of the counts; HSP chooses.
        let ratio = |held| broken(Holds::RatioAtMost(&[(1, 7), (3, 14)]), held);
        assert_eq!(ratio([Some(140), Some(10), Some(3)]), None);
        assert_eq!(ratio([Some(141), Some(10), Some(3)]), Some(vec!["bEn", "LSP"]));
        assert_eq!(ratio([Some(141), Some(10), Some(1)]), Some(vec!["bEn", "LSP"]));
        for unknown in
            [[Some(141), Some(10), Some(0)], [Some(141), Some(10), None], [Some(1), Some(0), Some(3)]]
        {
            assert_eq!(ratio(unknown), None);
        }
        let needs = |held| broken(Holds::WordsOnlyWith(&[171], &[1]), held);
        assert_eq!(needs([Some(171), Some(0), None]), Some(vec!["bEn", "LSP"]));
        assert_eq!([needs([Some(171), Some(1), None]), needs([Some(129), Some(0), None])], [None, None]);
    }

    #[test]
    fn sums_assignments_and_equal_functions_are_told_apart() {
        assert_eq!(broken(Holds::SumAtMost(100), [None, Some(60), Some(40)]), None);
        assert_eq!(broken(Holds::SumAtMost(100), [None, Some(60), Some(41)]), Some(vec!["LSP", "HSP"]));
        assert_eq!(broken(Holds::NotWithoutNext, [Some(0), Some(0), Some(131)]), None);
        assert_eq!(broken(Holds::NotWithoutNext, [Some(132), Some(0), Some(0)]), Some(vec!["bEn", "LSP"]));
        assert_eq!(broken(Holds::Distinct, [Some(5), Some(6), Some(5)]), Some(vec!["bEn", "HSP"]));
        assert_eq!(broken(Holds::Distinct, [Some(5), Some(6), Some(7)]), None);
    }
}
