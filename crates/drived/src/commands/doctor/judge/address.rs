//! What concerns one address: nobody there, or two.

use super::{Case, share};
use crate::commands::doctor::verdict::{Certainty, Defect, Verdict};

/// Drives that should be there and have never answered, where others have.
pub(super) fn absent(case: &Case<'_>) -> Option<Verdict> {
    let named = case.seen.expected.iter().map(|name| name.slave.number());
    let absent: Vec<u8> = named
        .filter(|slave| {
            case.figures(*slave).is_some_and(|figures| {
                !figures.is_there() && (case.is_shared || figures.damaged * 4 <= figures.asked)
            })
        })
        .collect();
    if absent.is_empty() {
        return None;
    }
    let names = case.seen.names(&absent);
    let others = case.there().count();
    let menu = format!("see in its menu that it has this address and {}", case.seen.config.serial);
    let around = match others {
        0 => "though somebody is heard on the line".to_owned(),
        1 => "and one other does: adapter and cable are right up to that".to_owned(),
        _ => format!("and {others} others do: adapter and cable are right up to them"),
    };
    Some(Verdict::new(
        Defect::NoAnswer,
        &absent,
        Certainty::Certain,
        format!(
            "{names} never answered, {around}. To a master no power, A and B swapped at that drive, another address and another \
             speed or format are all the same; the steps tell them apart"
        ),
        &[
            "see that its display is lit",
            &menu,
            "swap A and B at that drive alone, and see that its wires have contact",
        ],
    ))
}

/// Two drives that have one address.
pub(super) fn two(case: &Case<'_>, slave: u8) -> Option<Verdict> {
    let figures = case.figures(slave).filter(|_| !case.is_shared)?;
    let name = case.seen.name(slave);
    let next = [
        "switch one drive after the other off: if this address still answers when the drive that should have it is off, another \
         one has it too",
        "give each drive an address of its own in its menu; most take it over when their supply has been off and on",
        "if it is silent then, its cable is damaged: see its screws, its shield, and what runs beside it",
    ];
    if figures.stray >= 3 && figures.stray as usize * 10 >= figures.answered {
        let doubled = figures.stray;
        return Some(Verdict::new(
            Defect::TwoAtOneAddress,
            &[slave],
            Certainty::Likely,
            format!(
                "{name} answers twice: behind {doubled} of its {} answers came another whole one. Two drives have this address, \
                 or something between repeats what it hears",
                figures.answered
            ),
            &next,
        ));
    }
    // Two that speak at once destroy each other's answers, and never a question.
    let of_slave = case.seen.of(slave);
    let garbled: Vec<_> = of_slave.clone().filter(|asked| asked.is_garbled()).collect();
    let usual = of_slave.clone().filter(|asked| asked.is_good()).map(|asked| asked.heard.len()).max();
    let whole = garbled.iter().filter(|asked| asked.heard.len() + 1 >= usual.unwrap_or(7)).count();
    let is_two = garbled.len() >= 8
        && garbled.len() * 2 >= figures.asked
        && whole * 10 >= garbled.len() * 8
        && figures.silent * 20 <= figures.asked;
    is_two.then(|| {
        Verdict::new(
            Defect::TwoAtOneAddress,
            &[slave],
            Certainty::CannotBeToldFrom("a cable that is damaged at that drive".to_owned()),
            format!(
                "{name} answers every question, and {} of its answers are damaged, though none is lost or short: two drives that \
                 have one address and speak at once sound like that",
                share(garbled.len(), figures.asked)
            ),
            &next,
        )
    })
}
