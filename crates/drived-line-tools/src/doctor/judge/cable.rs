//! What the cable does: interference while a motor runs, one bad place, noise.

use std::{collections::BTreeSet, time::Duration};

use drive_bus::listen::Role;

use super::{Case, FEW, gaps::Gap, is_times, share};
use crate::doctor::{
    observations::Asked,
    verdict::{Certainty, Defect, Verdict},
};

/// Noise on a line at rest is counted in pieces of so much time.
const PIECE: Duration = Duration::from_millis(10);

/// One slave's failures while another's motor runs.
pub(super) fn interference(case: &Case<'_>, slave: u8) -> Option<Verdict> {
    let of_slave = || case.seen.of(slave).filter(|asked| asked.running.is_some());
    let others: BTreeSet<u8> = of_slave().flat_map(|asked| asked.running.iter().flatten().copied()).collect();
    let blamed: Vec<u8> = others
        .into_iter()
        .filter(|&other| other != slave)
        .filter(|other| {
            let (running, standing) = (
                failed(of_slave().filter(|asked| asked.ran_beside(*other))),
                failed(of_slave().filter(|asked| !asked.ran_beside(*other))),
            );
            let is_enough = running.1 >= 10 && standing.1 >= 10 && running.0 >= FEW;
            is_enough && running.0 * 10 >= running.1 && is_times(5, running, standing)
        })
        .collect();
    let &first = blamed.first()?;
    let running = failed(of_slave().filter(|asked| asked.ran_beside(first)));
    let standing = failed(of_slave().filter(|asked| !asked.ran_beside(first)));
    let (name, motors) = (case.seen.name(slave), case.seen.names(&blamed));
    let certainty = match blamed.len() {
        1 => Certainty::Likely,
        _ => Certainty::CannotBeToldFrom(format!(
            "one of {motors} alone: they ran at the same time; start them one by one"
        )),
    };
    Some(Verdict::new(
        Defect::Interference,
        &[slave],
        certainty,
        format!(
            "{name} fails while {motors} runs: {} of its questions then, {} while that motor stands",
            share(running.0, running.1),
            share(standing.0, standing.1)
        ),
        &[
            "lay the bus cable away from that motor's cable, crossing it at right angles only",
            "see that the motor's cable is shielded, with its shield on the drive and on the motor, and the bus's shield on earth",
            "see that the line has its termination (120 Ω) at both ends and nowhere else, and its bias once",
            "or ask it at a lower switching frequency of that drive",
        ],
    ))
}

/// One slave fails where the others do not, and nothing tells why.
pub(super) fn damaged_alone(case: &Case<'_>, slave: u8) -> Option<Verdict> {
    let figures = case.figures(slave)?;
    let of_slave = (figures.bad(), figures.asked);
    let others = case.there().filter(|other| other.slave != slave);
    let rest = others.fold((0, 0), |(bad, asked), other| (bad + other.bad(), asked + other.asked));
    let is_alone =
        figures.bad() > FEW && rest.1 >= 20 && of_slave.0 * 10 >= of_slave.1 && is_times(5, of_slave, rest);
    let was_there = figures.is_there() || case.seen.expected.iter().any(|name| name.slave.number() == slave);
    if !is_alone || case.is_shared || !was_there {
        return None;
    }
    let ran: BTreeSet<u8> =
        case.seen.of(slave).flat_map(|asked| asked.running.iter().flatten().copied()).collect();
    let running: Vec<u8> = ran.into_iter().filter(|other| *other != slave).collect();
    let motors = match running.len() {
        0 => "start the other drives while this goes on: if it fails then only, their motors disturb it"
            .to_owned(),
        _ => format!(
            "stop {} and try again: if it is gone then, that motor disturbs it",
            case.seen.names(&running)
        ),
    };
    Some(Verdict::new(
        Defect::DamagedAtOneAddress,
        &[slave],
        Certainty::CannotBeToldFrom("interference, a loose wire, and two drives at this address".to_owned()),
        format!(
            "{} fails for {} of its questions ({} silent, {} damaged), the others for {}",
            case.seen.name(slave),
            share(of_slave.0, of_slave.1),
            figures.silent,
            figures.damaged,
            share(rest.0, rest.1)
        ),
        &[
            "see its screws and plug, its shield, and that no branch of more than a metre leads to it",
            &motors,
            "switch it off: if its address still answers, another drive has it too",
        ],
    ))
}

/// Failures that come to everybody, whoever runs, and outside of the gaps.
pub(super) fn noise(case: &Case<'_>, explained: &[u8], gaps: &[Gap]) -> Option<Verdict> {
    let left: Vec<u8> = case.there().map(|figures| figures.slave).collect();
    let is_left = |asked: &&Asked| {
        left.contains(&asked.slave)
            && !explained.contains(&asked.slave)
            && !gaps.iter().any(|gap| gap.holds(asked))
    };
    let lost = failed(case.seen.asked.iter().filter(is_left));
    let (noisy, pieces) = at_rest(case);
    let is_lost = lost.0 > FEW && lost.0 * 33 >= lost.1;
    let is_heard = noisy >= 8 && noisy * 100 >= pieces;
    if !is_lost && !is_heard {
        return None;
    }
    let heard = match noisy {
        0 => "while nobody asked the line was quiet".to_owned(),
        _ => format!("while nobody asked there was noise in {} of the time", share(noisy, pieces)),
    };
    let alone = case.there().count() == 1;
    let certainty = if alone && !is_heard {
        Certainty::CannotBeToldFrom(
            "a bad contact at that one drive: no other is there to compare it with".to_owned(),
        )
    } else {
        Certainty::Likely
    };
    Some(Verdict::new(
        Defect::Noise,
        &[],
        certainty,
        format!(
            "{} of the questions had no intact answer, whoever was asked; {heard}",
            share(lost.0, lost.1)
        ),
        &[
            "see that the line has its termination (120 Ω) at both ends and nowhere else, and its bias once",
            "see that the cable is a shielded twisted pair, with its shield on earth, and lies away from the motors' cables",
            "switch the motors off, and try again: if it is gone they are where it comes from",
            "a lower speed suffers less",
        ],
    ))
}

/// In how many pieces of the time in which nothing was asked there was noise, and how many there were.
fn at_rest(case: &Case<'_>) -> (usize, usize) {
    let piece = |at: Duration| at.as_nanos() / PIECE.as_nanos();
    let damaged = case.seen.listened.heard.iter().filter(|heard| heard.role == Role::Damaged);
    let noisy: BTreeSet<u128> = damaged.flat_map(|heard| piece(heard.first)..=piece(heard.last)).collect();
    (noisy.len(), usize::try_from(piece(case.seen.listened.time)).unwrap_or(usize::MAX))
}

/// How many of these failed, and how many there are.
fn failed<'a>(asked: impl Iterator<Item = &'a Asked>) -> (usize, usize) {
    asked.fold((0, 0), |(failed, all), asked| (failed + usize::from(!asked.is_good()), all + 1))
}
