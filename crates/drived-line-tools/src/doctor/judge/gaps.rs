//! Times in which nothing comes whole: a contact that opens, a supply that goes, bursts. Bad time is asked less often than good time,
//! because a question that fails takes so much longer: it is the time that is judged here, and not the share of the questions.

use std::time::Duration;

use super::{Case, is_times};
use crate::doctor::{
    observations::{Asked, Ending},
    verdict::{Certainty, Defect, Verdict},
};
use drived_words::output;

/// So many failures that follow one upon another, and so many times what chance brings of them, come together for a reason.
const TOGETHER: usize = 3;
const NO_CHANCE: usize = 5;

/// Failures in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Gap {
    /// From the last good answer before it, or its first question, to the first question behind it that was answered.
    from: Duration,
    until: Duration,
    questions: usize,
    /// Not one byte came.
    is_silent: bool,
}

impl Gap {
    pub(super) fn holds(&self, asked: &Asked) -> bool {
        self.from <= asked.began && asked.began < self.until
    }

    fn time(&self) -> Duration {
        self.until.saturating_sub(self.from)
    }
}

/// The gaps in what was asked, where the failures come together and not by chance.
fn gaps<'a>(asked: impl Iterator<Item = &'a Asked>) -> Vec<Gap> {
    let (mut all, mut failed, mut good_until) = (0, 0, None);
    let (mut gaps, mut open): (Vec<Gap>, Option<Gap>) = (Vec::new(), None);
    for asked in asked {
        all += 1;
        if asked.is_good() {
            gaps.extend(open.take().map(|gap| Gap { until: asked.began, ..gap }));
            good_until = Some(asked.ended);
            continue;
        }
        failed += 1;
        let from = good_until.unwrap_or(asked.began);
        let gap = open.get_or_insert(Gap { from, until: asked.ended, questions: 0, is_silent: true });
        gap.questions += 1;
        gap.until = asked.ended;
        gap.is_silent &= asked.ending == Ending::Silent && asked.heard.is_empty();
    }
    gaps.extend(open);
    let following = failed - gaps.len();
    gaps.retain(|gap| gap.questions > 1);
    let is_no_chance = following >= TOGETHER && is_times(NO_CHANCE, (following, failed), (failed, all));
    if is_no_chance { gaps } else { Vec::new() }
}

/// The gaps of all that are there and are not explained otherwise.
pub(super) fn of_all(case: &Case<'_>, explained: &[u8]) -> Vec<Gap> {
    let there: Vec<u8> = case.there().map(|figures| figures.slave).collect();
    let is_one = |asked: &&Asked| there.contains(&asked.slave) && !explained.contains(&asked.slave);
    let asked = || case.seen.asked.iter().filter(is_one);
    let mut gaps = gaps(asked());
    let hits = |gap: &Gap, slave: u8| asked().any(|asked| asked.slave == slave && gap.holds(asked));
    // What takes one alone is his.
    let others = there.iter().filter(|slave| !explained.contains(slave));
    let hit = others.filter(|slave| gaps.iter().any(|gap| hits(gap, **slave))).count();
    if hit < 2 && there.len() > 1 {
        gaps.clear();
    }
    gaps
}

/// The whole line, with its gaps.
pub(super) fn line(case: &Case<'_>, gaps: &[Gap]) -> Option<Verdict> {
    let (first, last) = (case.seen.asked.first()?, case.seen.asked.last()?);
    let whole = last.ended.saturating_sub(first.began);
    let when = told(gaps, whole)?;
    let silent = gaps.iter().all(|gap| gap.is_silent);
    Some(if silent {
        interrupted(&[], format!("nobody answered {when}"))
    } else {
        Verdict::new(
            Defect::Noise,
            &[],
            Certainty::Likely,
            format!("nothing came whole {when}, whoever was asked: it comes in bursts"),
            &[
                "find what works at such times: a welder, a contactor, a lift, a radio; switch it off, and try again",
                "see that the cable is a shielded twisted pair, with its shield on earth, and lies away from the motors' cables",
                "see that the line has its termination (120 Ω) at both ends and nowhere else, and its bias once",
            ],
        )
    })
}

/// One slave outside of the gaps of all, where the others answer meanwhile.
pub(super) fn one(case: &Case<'_>, slave: u8, of_all: &[Gap]) -> Option<Verdict> {
    if case.is_shared || case.there().count() < 2 || !case.figures(slave)?.is_there() {
        return None;
    }
    let is_his = |asked: &&Asked| !of_all.iter().any(|gap| gap.holds(asked));
    let gaps = gaps(case.seen.of(slave).filter(is_his));
    let (first, last) = (case.seen.of(slave).next()?, case.seen.of(slave).last()?);
    let when = told(&gaps, last.ended.saturating_sub(first.began))?;
    let others = || case.seen.asked.iter().filter(|asked| asked.slave != slave);
    let meanwhile = others().filter(|asked| gaps.iter().any(|gap| gap.holds(asked)));
    let (bad, all) =
        meanwhile.fold((0, 0), |(bad, all), asked| (bad + usize::from(!asked.is_good()), all + 1));
    if bad * 2 > all {
        return None;
    }
    let name = case.seen.name(slave);
    Some(if gaps.iter().all(|gap| gap.is_silent) {
        interrupted(&[slave], format!("{name} did not answer {when}, and the others did"))
    } else {
        Verdict::new(
            Defect::DamagedAtOneAddress,
            &[slave],
            Certainty::CannotBeToldFrom(
                "interference, a loose wire, and two drives at this address".to_owned(),
            ),
            format!("nothing came whole from {name} {when}, and from the others it did"),
            &[
                "see its screws and plug, its shield, and that no branch of more than a metre leads to it",
                "find what works at such times near its cable, and switch it off",
            ],
        )
    })
}

/// Silence that has a beginning and an end damages nothing.
fn interrupted(slaves: &[u8], what: String) -> Verdict {
    let whose = match slaves {
        [] => {
            "see that every plug and screw holds from the adapter to the first drive: move the cable there while drived poll goes on"
        }
        _ => "see that its plug and screws hold: move its cable while drived poll goes on",
    };
    let supply = match slaves {
        [] => {
            "see the supply of the drives at that time: one that restarts is silent; and unplug the adapter, and plug it in again"
        }
        _ => "see its supply at that time: a drive that restarts is silent for some seconds",
    };
    Verdict::new(
        Defect::Interrupted,
        slaves,
        Certainty::CannotBeToldFrom(
            "a contact that opens, a cable that breaks, and a supply that goes".to_owned(),
        ),
        format!("{what}. Not one byte came in that time, and noise would have damaged some"),
        &[whose, supply],
    )
}

/// When it was, for how long, and how much of the time.
fn told(gaps: &[Gap], whole: Duration) -> Option<String> {
    let (first, longest) = (gaps.first()?, gaps.iter().map(Gap::time).max()?);
    let questions: usize = gaps.iter().map(|gap| gap.questions).sum();
    let time: Duration = gaps.iter().map(Gap::time).sum();
    let part = |time: Duration| usize::try_from(time.as_millis()).unwrap_or(usize::MAX);
    let share = super::share(part(time), part(whole));
    Some(match gaps.len() {
        1 => format!(
            "once, for {} from the {}. second on: {questions} questions in a row, {share} of the time",
            output::bound(longest),
            first.from.as_secs() + 1
        ),
        times => format!(
            "{times} times, for up to {}: {questions} questions, {share} of the time",
            output::bound(longest)
        ),
    })
}
