//! What the line itself has found by its evidence, with the drives' names. `run`, `poll` and `scan` show the same.

use drive_bus::evidence::{self, Finding};

use super::Case;
use crate::doctor::verdict::{Certainty, Defect, Verdict};

/// What it has found, the same defect of several told once; but for [`two`], which is told of those for whom nothing
/// else explains it.
pub(super) fn verdicts(case: &Case<'_>) -> Vec<Verdict> {
    let mut verdicts: Vec<Verdict> = Vec::new();
    for finding in &case.seen.findings {
        let Some(defect) = defect(case, finding) else { continue };
        let name = finding.slave.map(|slave| format!("{}: ", case.seen.name(slave))).unwrap_or_default();
        let told = format!("{name}{finding}");
        match verdicts.iter_mut().find(|verdict| verdict.defect == defect && finding.slave.is_some()) {
            Some(verdict) => {
                verdict.slaves.extend(finding.slave);
                verdict.finding = format!("{}; {told}", verdict.finding);
            }
            None => {
                let slaves: Vec<u8> = finding.slave.into_iter().collect();
                verdicts.push(Verdict::new(defect, &slaves, certainty(finding), told, finding.next()));
            }
        }
    }
    verdicts
}

/// Another master that was only heard while we asked.
pub(super) fn second_master(case: &Case<'_>) -> Option<Verdict> {
    let is_it = |finding: &&Finding| matches!(finding.defect, evidence::Defect::SecondMaster(_));
    let finding = case.seen.findings.iter().find(is_it)?;
    Some(Verdict::new(Defect::SecondMaster, &[], certainty(finding), finding.to_string(), finding.next()))
}

/// Two drives that have one address, or one that answers twice. Where another master asks the same slaves their answers to him are
/// no second answers to us.
pub(super) fn two(case: &Case<'_>, slave: u8) -> Option<Verdict> {
    let is_it = |finding: &&Finding| finding.slave == Some(slave) && finding.is_of_two();
    let finding = case.seen.findings.iter().find(is_it).filter(|_| !case.is_shared)?;
    let told = format!("{}: {finding}", case.seen.name(slave));
    Some(Verdict::new(Defect::TwoAtOneAddress, &[slave], certainty(finding), told, finding.next()))
}

/// Whether nothing else can be judged beside it.
pub(super) fn explains_all(verdict: &Verdict) -> bool {
    verdict.slaves.is_empty()
}

fn defect(case: &Case<'_>, finding: &Finding) -> Option<Defect> {
    use evidence::Defect as Heard;
    let is_named = || case.seen.expected.iter().any(|name| Some(name.slave.number()) == finding.slave);
    Some(match finding.defect {
        Heard::FarEndFaster => Defect::FarEndFaster,
        Heard::FirstByteCut => Defect::FirstByteCut,
        Heard::LastByteCut => Defect::LastByteCut,
        Heard::BytesBehind => Defect::BytesBehind,
        Heard::OneAnswerBehind => Defect::OneAnswerBehind,
        // Of whom nobody knows what he is, no register is known that he must have; and behind a gateway most addresses are nobody's.
        Heard::RefusesAll(0x04..=0x06) => Defect::RefusesAll,
        Heard::RefusesAll(_) if is_named() => Defect::RefusesAll,
        Heard::NumberZero => Defect::NumberZero,
        Heard::FellSilent(_) => Defect::FellSilent,
        Heard::LinkTimeout => Defect::LinkTimeout,
        _ => return None,
    })
}

fn certainty(finding: &Finding) -> Certainty {
    match finding.certainty {
        evidence::Certainty::Certain => Certainty::Certain,
        evidence::Certainty::CannotBeToldFrom(other) => Certainty::CannotBeToldFrom(other.to_string()),
        _ => Certainty::Likely,
    }
}
