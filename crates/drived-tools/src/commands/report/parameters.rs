//! What a drive holds otherwise than it left the factory, and what cannot be judged.

use maud::{Markup, html};

use super::{
    gather::{Compared, DriveTold},
    words::{cell, own, table, unread},
};
use crate::commands::param::{
    diff::{Cell, Comparison, Difference},
    file::Backup,
};

pub(super) fn part(drive: &DriveTold) -> Markup {
    match &drive.parameters {
        Ok(compared) => differences(compared),
        Err(why) => html! { p { (unread(why)) } },
    }
}

fn differences(compared: &Compared) -> Markup {
    let comparison = &compared.factory;
    html! {
        @if comparison.differences.is_empty() { p { (own("None.")) } }
        @else {
            (table("list parameters", &["parameter", "name", "value", "factory"], 2, comparison.differences.iter().map(differing).collect()))
        }
        p.note { (own("Parameters as the manual prints the factory setting: ")) (comparison.same) (own(". Read at ")) (compared.held.head.date) "." }
        @if !comparison.unjudged.is_empty() {
            details open {
                summary.counted { (own("Parameters that cannot be judged: ")) (comparison.unjudged.len()) }
                (table("list parameters", &["parameter", "name", "value", "why"], 9, comparison.unjudged.iter().map(unjudged).collect()))
            }
        }
    }
}

/// What a drive held when a backup was made of it, and holds otherwise now.
pub(super) fn since(drive: &DriveTold, before: &[Backup]) -> Markup {
    let held = match &drive.parameters {
        Ok(compared) => &compared.held,
        Err(why) => return html! { p { (unread(why)) } },
    };
    let is_it = |backup: &&Backup| backup.head.name == drive.name() && backup.head.family == held.head.family;
    let Some(before) = before.iter().find(is_it) else {
        return html! { p.note { (own("No backup from before has this drive.")) } };
    };
    let comparison = Comparison::of(before, held, true);
    html! {
        @if comparison.differences.is_empty() { p { (own("Nothing was changed.")) } }
        @else {
            (table("list parameters", &["parameter", "name", "before", "now"], 2, comparison.differences.iter().map(differing).collect()))
        }
        p.note { (before.head.date) " – " (held.head.date) }
    }
}

fn differing(difference: &Difference) -> Vec<Markup> {
    let [held, factory] = &difference.sides;
    vec![cell(difference.row.code), cell(difference.row.name), shown(held), shown(factory)]
}

fn unjudged(difference: &Difference) -> Vec<Markup> {
    let [held, factory] = &difference.sides;
    let why = match (held, factory) {
        (Cell::Unread(_), _) => own("it could not be read"),
        (Cell::Lacks, _) => own("the drive was not asked for it"),
        (_, Cell::Unread(rule)) => own(rule),
        (_, _) => own("the manual prints no factory setting"),
    };
    vec![cell(difference.row.code), cell(difference.row.name), shown(held), why]
}

fn shown(side: &Cell) -> Markup {
    match side {
        Cell::Holds(text, _) => cell(text),
        Cell::Unread(why) => unread(why),
        Cell::Lacks => cell("–"),
    }
}
