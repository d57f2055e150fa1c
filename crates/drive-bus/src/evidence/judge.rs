//! From the evidence to what is wrong. Pure. The bounds are chosen so that a line which loses or damages one question in a hundred
//! has no finding.

use std::time::Duration;

use tokio::time::Instant;

use super::{
    Evidence, Lately,
    findings::{Certainty, Defect, Finding},
};

/// So few are chance, whatever share they are.
const FEW: u32 = 3;

/// So many damaged answers as long as whole ones are no chance.
const MANY: u32 = 8;

/// So many questions in a row in vain, to one that has answered so often.
const SILENT: u32 = 6;
const ANSWERED: u32 = 5;

/// Those that fell silent within this have done it together.
const TOGETHER: Duration = Duration::from_secs(5);

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
            [self.faster(), self.number_zero(), self.link_timeout(known), self.second_master()]
                .into_iter()
                .flatten()
                .collect();
        if findings.is_empty()
            && let Some(silent) = self.fell_silent(known.now)
        {
            return vec![silent];
        }
        findings.extend(self.slaves.iter().filter_map(|(slave, lately)| lately.judged(*slave, known)));
        findings
    }

    fn total(&self, of: fn(&Lately) -> u32) -> u32 {
        self.slaves.values().map(|lately| of(lately)).fold(0, u32::saturating_add)
    }

    fn faster(&self) -> Option<Finding> {
        let early = self.total(|lately| lately.early);
        let in_time = self.total(Lately::in_time);
        let certainty = Certainty::CannotBeToldFrom("a speed that is set too low");
        (early >= FEW && in_time == 0).then(|| line(Defect::FarEndFaster, (early, early), certainty))
    }

    fn number_zero(&self) -> Option<Finding> {
        let zero = self.number_zero;
        let is_it = zero >= FEW && self.total(Lately::in_time) * 10 <= zero;
        is_it.then(|| line(Defect::NumberZero, (zero, zero), Certainty::Certain))
    }

    fn link_timeout(&self, known: Known) -> Option<Finding> {
        let (acknowledged, asked) = (self.acknowledged, self.total(|lately| lately.questions));
        let is_it =
            known.is_unitelway && acknowledged >= FEW && asked >= FEW && self.total(Lately::in_time) == 0;
        let certainty = Certainty::CannotBeToldFrom("slaves that acknowledge everything and never reply");
        is_it.then(|| line(Defect::LinkTimeout, (acknowledged, asked), certainty))
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

    fn judged(&self, slave: u8, known: Known) -> Option<Finding> {
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
        if self.late_with_next > FEW && self.late_with_next * 5 >= self.late * 4 && self.late > self.in_time()
        {
            return found(Defect::OneAnswerBehind, self.late_with_next, self.late, Certainty::Certain);
        }
        if self.whole == 0
            && let Some((code, count)) = self.exceptions.iter().max_by_key(|(_, count)| *count)
            && *count >= FEW
            && *count * 10 >= self.refused_in_all() * 9
        {
            return found(Defect::RefusesAll(*code), *count, self.questions, Certainty::Certain);
        }
        if self.contradicted >= FEW && self.contradicted * 20 >= self.questions {
            let certainty = Certainty::CannotBeToldFrom("something between that gives old answers once more");
            return found(Defect::TwoAtOneAddress, self.contradicted, self.questions, certainty);
        }
        if self.damaged_long >= MANY
            && self.damaged_long * 2 >= self.questions
            && self.silent * 20 <= self.questions
        {
            let certainty = Certainty::CannotBeToldFrom("a cable that is damaged at that drive");
            return found(Defect::TwoAtOneAddress, self.damaged_long, self.questions, certainty);
        }
        if self.doubled > FEW && self.doubled * 10 >= self.in_time() {
            let certainty = Certainty::CannotBeToldFrom("two drives alike that have one address");
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
