//! From what was noticed to what is wrong. Pure: no clock, no port.
//!
//! What explains most is looked for first; what is explained by it is not told again. The bounds are chosen so that a line
//! which loses or damages one question in a hundred is healthy: it is repeated, and nobody notices.

mod address;
mod cable;
mod gaps;
mod heard;
mod masters;
mod timing;
mod whole;

pub(super) use self::masters::{Habit, habits};

use super::{
    observations::{Figures, Observations},
    verdict::{Defect, Verdict},
};

/// So few failures are chance, whatever share they are.
const FEW: usize = 5;

/// What was noticed, and the figures of each slave.
struct Case<'a> {
    seen: &'a Observations,
    figures: Vec<Figures>,
    /// Whether others talk on this line.
    is_shared: bool,
}

impl Case<'_> {
    /// Slaves that have answered. Where somebody else asks too, some answers to him are taken for ours.
    fn there(&self) -> impl Iterator<Item = &Figures> {
        let least = |asked: usize| if self.is_shared { asked / 4 } else { 0 };
        self.figures.iter().filter(move |figures| figures.answered > least(figures.asked))
    }

    fn figures(&self, slave: u8) -> Option<&Figures> {
        self.figures.iter().find(|figures| figures.slave == slave)
    }
}

/// Everything that is wrong; nothing: the line is healthy.
pub(super) fn judge(seen: &Observations) -> Vec<Verdict> {
    let is_shared = seen.listened.frames().next().is_some();
    let case = Case { seen, figures: seen.figures(), is_shared };
    let mut verdicts: Vec<Verdict> =
        masters::second(&case).or_else(|| heard::second_master(&case)).into_iter().collect();
    let heard = heard::verdicts(&case);
    if heard.iter().any(heard::explains_all) || !heard.is_empty() && case.there().next().is_none() {
        verdicts.extend(heard);
        return verdicts;
    }
    if let Some(whole) = whole::verdict(&case) {
        verdicts.push(whole);
        return verdicts;
    }
    let mut explained = Vec::new();
    let mut of_one = |verdict: Option<Verdict>, explained: &mut Vec<u8>| {
        if let Some(verdict) = verdict {
            explained.extend(&verdict.slaves);
            verdicts.push(verdict);
        }
    };
    let is_late_link = heard.iter().any(|verdict| verdict.defect == Defect::LinkTimeout);
    for verdict in heard {
        of_one(Some(verdict), &mut explained);
    }
    of_one(address::absent(&case, &explained), &mut explained);
    // Two that speak for one disturb whoever is asked next.
    let is_doubled = case.figures.iter().any(|figures| heard::two(&case, figures.slave).is_some());
    // So does one that acknowledges when another is asked.
    let is_disturbed = is_doubled || is_late_link;
    let gaps = if is_disturbed || is_shared { Vec::new() } else { gaps::of_all(&case, &explained) };
    for figures in &case.figures {
        let slave = figures.slave;
        if explained.contains(&slave) {
            continue;
        }
        let found = timing::needs_pause(&case, slave)
            .or_else(|| cable::interference(&case, slave))
            .or_else(|| heard::two(&case, slave))
            .or_else(|| cable::damaged_alone(&case, slave).filter(|_| !is_disturbed || figures.silent > FEW))
            .or_else(|| gaps::one(&case, slave, &gaps).filter(|_| !is_disturbed));
        of_one(found, &mut explained);
    }
    let held = timing::adapter(&case);
    let held = held.or_else(|| timing::in_pieces(&case, &explained));
    let is_held = held.is_some();
    of_one(held, &mut Vec::new());
    // What else there is shows when the others are silent.
    if !is_shared {
        of_one(timing::late(&case, &explained), &mut Vec::new());
        of_one(timing::slow(&case, is_held), &mut Vec::new());
        if !is_disturbed {
            of_one(gaps::line(&case, &gaps), &mut Vec::new());
            of_one(cable::noise(&case, &explained, &gaps), &mut Vec::new());
        }
    }
    verdicts
}

/// A part of a whole as a person reads it.
fn share(part: usize, whole: usize) -> String {
    let percent = (part * 1_000).checked_div(whole).unwrap_or_default();
    format!("{}.{} %", percent / 10, percent % 10)
}

/// Whether the first share is at least so many times the second.
fn is_times(times: usize, (part, whole): (usize, usize), (other, of): (usize, usize)) -> bool {
    part * of >= times * other * whole
}
