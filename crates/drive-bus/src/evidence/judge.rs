//! From the evidence to what is wrong. Pure. The bounds are chosen so that a line which loses or damages one question in a hundred
//! has no finding.

use std::time::Duration;

use tokio::time::Instant;

use super::{
    Evidence, Lately,
    findings::{Alike, Certainty, Defect, Finding},
};

/// So few are chance, whatever share they are.
const FEW: u32 = 3;

/// So many damaged answers as long as whole ones are no chance.
const MANY: u32 = 8;

/// So many whole answers of others say that the line is sound.
const ENOUGH: u32 = 20;

/// So many questions in a row in vain, to one that has answered so often.
const SILENT: u32 = 6;
const ANSWERED: u32 = 5;

/// Those that fell silent within this have done it together.
const TOGETHER: Duration = Duration::from_secs(5);

/// So long after another master was heard he may still be there.
const SHARED: Duration = Duration::from_secs(60);

/// What the line knows besides.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known {
    pub(crate) now: Instant,
    pub(crate) is_unitelway: bool,
}

impl Evidence {
    /// Everything that is wrong by what came lately.
    pub(crate) fn findings(&self, known: Known) -> Vec<Finding> {
        let mut findings: Vec<Finding> =
            [self.faster(), self.number_zero(), self.second_master()].into_iter().flatten().collect();
        if findings.is_empty()
            && let Some(silent) = self.fell_silent(known.now)
        {
            return vec![silent];
        }
        let is_shared = self.requests.is_some_and(|(.., last)| known.now < last + SHARED);
        let judged = self
            .slaves
            .iter()
            .filter_map(|(slave, lately)| lately.judged(*slave, known, self.others_are_whole(lately)));
        findings.extend(judged.filter(|finding| !(is_shared && finding.is_of_two())));
        findings
    }

    fn total(&self, of: fn(&Lately) -> u32) -> u32 {
        self.slaves.values().map(|lately| of(lately)).fold(0, u32::saturating_add)
    }

    /// Whether the answers of all others but this one come whole: then noise is not what damages its.
    fn others_are_whole(&self, of: &Lately) -> bool {
        let (asked, damaged) = (self.total(|lately| lately.questions), self.total(|lately| lately.damaged));
        let in_time = self.total(Lately::in_time).saturating_sub(of.in_time());
        in_time >= ENOUGH && damaged.saturating_sub(of.damaged) * 20 <= asked.saturating_sub(of.questions)
    }

    fn faster(&self) -> Option<Finding> {
        let early = self.total(|lately| lately.early);
        let in_time = self.total(Lately::in_time);
        let certainty = Certainty::CannotBeToldFrom(Alike::SpeedTooLow);
        (early >= FEW && in_time == 0).then(|| line(Defect::FarEndFaster, (early, early), certainty))
    }

    fn number_zero(&self) -> Option<Finding> {
        let zero = self.number_zero;
        let is_it = zero >= FEW && self.total(Lately::in_time) * 10 <= zero;
        is_it.then(|| line(Defect::NumberZero, (zero, zero), Certainty::Certain))
    }

    fn second_master(&self) -> Option<Finding> {
        let (count, first, last) = self.requests.filter(|(count, ..)| *count >= 2)?;
        let every = last.saturating_duration_since(first) / (count - 1);
        let every = Some(every).filter(|every| !every.is_zero());
        Some(line(Defect::SecondMaster(every), (count, count), Certainty::Certain))
    }

    /// All that have answered fell silent together.
    fn fell_silent(&self, now: Instant) -> Option<Finding> {
        let there = self.slaves.values().filter(|lately| lately.in_time() >= ANSWERED);
        let since: Vec<(u32, Instant)> = there.map(|lately| lately.silent_since).collect::<Option<_>>()?;
        let (first, last) = (since.iter().map(|(_, at)| *at).min()?, since.iter().map(|(_, at)| *at).max()?);
        let questions = since.iter().fold(0, |sum: u32, (times, _)| sum.saturating_add(*times));
        let is_it =
            since.iter().all(|(times, _)| *times > 0) && questions >= SILENT && last - first <= TOGETHER;
        let defect = Defect::FellSilent(now.saturating_duration_since(last));
        is_it.then(|| line(defect, (questions, questions), Certainty::Certain))
    }
}

fn line(defect: Defect, share: (u32, u32), certainty: Certainty) -> Finding {
    Finding { defect, slave: None, share, certainty }
}

impl Lately {
    fn refused_in_all(&self) -> u32 {
        self.exceptions.iter().map(|(_, count)| *count).sum()
    }

    /// Answers that came when they should.
    fn in_time(&self) -> u32 {
        self.whole + self.refused_in_all()
    }

    fn judged(&self, slave: u8, known: Known, others_are_whole: bool) -> Option<Finding> {
        let spoken = self.questions - self.silent.min(self.questions);
        let found = |defect, part, of, certainty| {
            Some(Finding { defect, slave: Some(slave), share: (part, of), certainty })
        };
        let is_most = |part: u32, of: u32| part >= FEW && part * 2 >= of;
        if is_most(self.without_first, spoken) {
            return found(Defect::FirstByteCut, self.without_first, spoken, Certainty::Certain);
        }
        if is_most(self.without_last, spoken) {
            return found(Defect::LastByteCut, self.without_last, spoken, Certainty::Certain);
        }
        if known.is_unitelway && self.acknowledged >= FEW && self.acknowledged > self.in_time() {
            let certainty = Certainty::CannotBeToldFrom(Alike::NeverReplies);
            return found(Defect::LinkTimeout, self.acknowledged, self.questions, certainty);
        }
        if self.late_with_next > FEW && self.late_with_next * 5 >= self.late * 4 && self.late > self.in_time()
        {
            return found(Defect::OneAnswerBehind, self.late_with_next, self.late, Certainty::Certain);
        }
        if self.contradicted >= FEW && self.contradicted * 20 >= self.questions {
            let certainty = Certainty::CannotBeToldFrom(Alike::OldAnswers);
            return found(Defect::TwoAtOneAddress, self.contradicted, self.questions, certainty);
        }
        let damaged = if others_are_whole { self.damaged_long } else { self.damaged_begun };
        if damaged >= MANY && damaged * 2 >= self.questions && self.silent * 20 <= self.questions {
            let certainty = Certainty::CannotBeToldFrom(Alike::DamagedCable);
            return found(Defect::TwoAtOneAddress, damaged, self.questions, certainty);
        }
        // What two that differ in something alone speak at once is damaged whenever it is asked.
        let stuck = self.stuck.iter().find(|stuck| stuck.damaged >= MANY && stuck.others >= MANY);
        if let Some(stuck) = stuck {
            let of = stuck.damaged.saturating_add(stuck.others);
            return found(Defect::TwoAtOneAddress, stuck.damaged, of, Certainty::Likely);
        }
        if self.whole == 0
            && let Some((code, count)) = self.exceptions.iter().max_by_key(|(_, count)| *count)
            && *count >= FEW
            && *count * 10 >= self.refused_in_all() * 9
            && self.damaged * 10 <= *count
        {
            return found(Defect::RefusesAll(*code), *count, self.questions, Certainty::Certain);
        }
        if self.doubled > FEW && self.doubled * 10 >= self.in_time() {
            let certainty = Certainty::CannotBeToldFrom(Alike::Twins);
            return found(Defect::AnswersTwice, self.doubled, self.in_time(), certainty);
        }
        if self.behind >= MANY && self.behind * 2 >= self.in_time() {
            return found(Defect::BytesBehind, self.behind, self.in_time(), Certainty::Certain);
        }
        let (silent, last) = self.silent_since?;
        let is_lost = silent >= SILENT && self.in_time() >= ANSWERED;
        let since = known.now.saturating_duration_since(last);
        if is_lost { found(Defect::FellSilent(since), silent, silent, Certainty::Certain) } else { None }
    }
}
