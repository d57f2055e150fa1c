//! Drives that should be there and are not.

use super::Case;
use crate::doctor::verdict::{Certainty, Defect, Verdict};

/// Drives that should be there and have never answered, where others have.
pub(super) fn absent(case: &Case<'_>, explained: &[u8]) -> Option<Verdict> {
    let named = case.seen.expected.iter().map(|name| name.slave.number());
    let named = named.filter(|slave| !explained.contains(slave));
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
