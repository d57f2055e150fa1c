//! What leaves nothing else to be judged: nobody answers.

use std::collections::{BTreeMap, BTreeSet};

use drive_bus::Endpoint;
use drive_core::serial::Parity;

use super::Case;
use crate::doctor::{
    observations::Listened,
    verdict::{Certainty, Defect, Verdict},
};

/// So many bytes that make no frame are no accident.
const TALK: usize = 12;

/// Bytes that are told again by somebody who talks.
const PIECE: usize = 6;

/// Why nobody answers, if nobody does.
pub(super) fn verdict(case: &Case<'_>) -> Option<Verdict> {
    if case.there().next().is_some() {
        return None;
    }
    if case.seen.never_quiet {
        return Some(never_quiet());
    }
    let judged = parity(case)
        .or_else(|| framing(case))
        .or_else(|| broken(case))
        .or_else(|| upside_down(case))
        .or_else(|| talk(case));
    let nothing = || if echoes(case) { only_echo(case) } else { nothing_heard(case) };
    judged.or_else(|| (!case.is_shared && is_silent(case)).then(nothing))
}

fn never_quiet() -> Verdict {
    Verdict::new(
        Defect::NeverQuiet,
        &[],
        Certainty::Certain,
        "the line is never quiet: no question could be sent",
        &[
            "unplug the drives one by one, and look when it becomes quiet: a driver that stays switched on holds the line",
            "see that the line has its bias resistors, and each end its termination",
        ],
    )
}

/// Whether questions bring nothing, but for some noise.
fn is_silent(case: &Case<'_>) -> bool {
    let garbled: usize = case.figures.iter().map(|figures| figures.damaged).sum();
    let asked: usize = case.figures.iter().map(|figures| figures.asked).sum();
    garbled * 5 <= asked
}

fn echoes(case: &Case<'_>) -> bool {
    let echoed = case.seen.asked.iter().filter(|asked| asked.echoed).count();
    echoed * 2 > case.seen.asked.len()
}

fn only_echo(case: &Case<'_>) -> Verdict {
    let asked = case.seen.asked.len();
    Verdict::new(
        Defect::OnlyOurEcho,
        &[],
        Certainty::Certain,
        format!(
            "nothing comes back but our own {asked} questions: the adapter hears itself, and no drive answers"
        ),
        &[
            "an adapter for RS-422 (four wires) on a line of two: connect TX+ with RX+ and TX- with RX-, or set it to RS-485 \
             with two wires",
            "an adapter whose receiver stays on while it sends: the echo itself does no harm; then nobody is connected behind \
             it: go on as for a line on which nothing is heard (power, A and B, address, speed and format)",
        ],
    )
}

fn nothing_heard(case: &Case<'_>) -> Verdict {
    let silent = case.seen.asked.len();
    let serial = case.seen.config.serial;
    let port = match &case.seen.config.endpoint {
        Endpoint::Serial(path) => format!(
            "see that {} is the adapter of this line: unplug it, and look whether the port goes",
            path.display()
        ),
        _ => "see that the far end's serial port is the one of this line".to_owned(),
    };
    let setting = format!(
        "see in the drives' menus that they have these addresses and {serial}; drived scan --standstill tries other speeds \
         and formats"
    );
    Verdict::new(
        Defect::NothingHeard,
        &[],
        Certainty::Certain,
        format!(
            "not one byte was heard, neither by listening nor to {silent} questions. To a master no power, A and B swapped, a \
             wrong port, other addresses and another speed or format are all the same; the steps tell them apart"
        ),
        &[
            "see that the drives' displays are lit",
            "swap A and B (D0 and D1) at the adapter, and try again: nothing breaks by it",
            &port,
            &setting,
            "measure between A and B with nobody sending: 0.2 V or more is a line with its bias, 0 V is none or a broken wire",
        ],
    )
}

/// Others are understood by a port without parity, and with one of the two parities they are whole as well.
fn parity(case: &Case<'_>) -> Option<Verdict> {
    let ours = case.seen.config.serial;
    if case.seen.listened.frames().count() < 2 || ours.format().parity() != Parity::None {
        return None;
    }
    let is_whole = |heard: &Listened| heard.frames().count() >= 2 && heard.noise().next().is_none();
    let (serial, _) = case.seen.elsewhere.iter().find(|(_, heard)| is_whole(heard))?;
    let next = format!("ask at {serial} (--line …,{},{})", serial.baud(), serial.format());
    Some(Verdict::new(
        Defect::WrongFraming,
        &[],
        Certainty::Likely,
        format!(
            "others are understood at {ours}, and nobody answers us; they are whole at {serial} too. A port without parity hears \
             those who have one, and they do not understand it"
        ),
        &[&next],
    ))
}

/// Somebody talks, and at another speed or format it makes sense.
fn framing(case: &Case<'_>) -> Option<Verdict> {
    let listened = &case.seen.listened;
    let (damaged, intact) = (listened.noise().count(), listened.frames().count());
    if damaged < TALK || intact * 8 > damaged {
        return None;
    }
    let frames = |at: &&(_, Listened)| at.1.frames().count();
    let (serial, heard) = case.seen.elsewhere.iter().max_by_key(frames).filter(|at| frames(at) >= 2)?;
    let count = heard.frames().count();
    let ours = case.seen.config.serial;
    let next = format!(
        "ask at {serial} (--line …,{},{}), or set everybody to {ours}",
        serial.baud(),
        serial.format()
    );
    Some(Verdict::new(
        Defect::WrongFraming,
        &[],
        Certainty::Certain,
        format!(
            "somebody talks on this line, and not at {ours}: {damaged} bytes made no sense there, and {count} frames were \
             intact at {serial}"
        ),
        &[&next],
    ))
}

/// A level that is the wrong way round is heard as a break, or as characters whose lowest bit is that of a stop bit.
fn broken(case: &Case<'_>) -> Option<Verdict> {
    let heard: Vec<u8> = case.seen.listened.noise().chain(garbled(case)).collect();
    let zeros = heard.iter().filter(|byte| **byte == 0).count();
    let is_break = heard.len() >= 4 && zeros * 10 >= heard.len() * 9;
    is_break.then(|| {
        Verdict::new(
            Defect::Polarity,
            &[],
            Certainty::CannotBeToldFrom("a line without its bias, or held by a driver that stays switched on".to_owned()),
            format!(
                "{} bytes were heard, {zeros} of them 00: a line whose level at rest is the wrong way round looks like that \
                 (what an adapter makes of it differs: some give 00 once, some again and again, some nothing)",
                heard.len()
            ),
            &[
                "swap A and B (D0 and D1) at the adapter, and try again: nothing breaks by it",
                "measure between A and B with nobody sending: A against B (D1 against D0) has to be positive, 0.2 V or more",
                "if swapping changes nothing, unplug the drives one by one: one may hold the line",
            ],
        )
    })
}

/// Somebody says the same again and again, and at no usual speed and format it makes sense.
fn upside_down(case: &Case<'_>) -> Option<Verdict> {
    let heard: Vec<u8> = case.seen.listened.noise().collect();
    let mut pieces: BTreeMap<&[u8], usize> = BTreeMap::new();
    for piece in heard.windows(PIECE).filter(|piece| piece.iter().collect::<BTreeSet<_>>().len() >= 4) {
        *pieces.entry(piece).or_default() += 1;
    }
    let most = pieces.into_values().max().unwrap_or_default();
    let tried = case.seen.elsewhere.len();
    (most >= 3 && tried > 0 && case.seen.listened.frames().next().is_none()).then(|| {
        Verdict::new(
            Defect::Polarity,
            &[],
            Certainty::CannotBeToldFrom("a speed, a format or a protocol that was not tried".to_owned()),
            format!(
                "somebody talks on this line: the same bytes come {most} times, so that it is no noise, and they make no frame \
                 at {} and at {tried} other speeds and formats. What is heard through swapped wires is like that",
                case.seen.config.serial
            ),
            &[
                "swap A and B (D0 and D1) at the adapter, and try again: nothing breaks by it",
                "see in the menus of those who talk which speed, format and protocol they have (Modbus ASCII and UNI-TELWAY sound \
                 like that to RTU)",
            ],
        )
    })
}

/// Something comes, and it makes sense nowhere.
fn talk(case: &Case<'_>) -> Option<Verdict> {
    let heard = case.seen.listened.noise().chain(garbled(case)).count();
    (heard > 0 && !is_silent(case)).then(|| {
        Verdict::new(
            Defect::WrongFraming,
            &[],
            Certainty::CannotBeToldFrom("noise, and from wires that are swapped".to_owned()),
            format!("{heard} bytes were heard, and none of them makes a frame, at no usual speed and format"),
            &[
                "see in the drives' menus which speed and format they have",
                "swap A and B at the adapter, and try again",
                "switch the motors off, and try again: if the bytes are gone it is noise",
            ],
        )
    })
}

/// What came to our questions and makes no answer.
fn garbled<'a>(case: &'a Case<'_>) -> impl Iterator<Item = u8> + Clone + 'a {
    let garbled = case.seen.asked.iter().filter(|asked| asked.is_garbled());
    garbled.flat_map(|asked| asked.heard.iter().copied())
}
