//! What a drive holds otherwise than it left the factory, and what cannot be judged.

use maud::{Markup, html};

use super::{
    gather::{Compared, DriveTold},
    words::{cell, table, unread},
};
use crate::commands::param::diff::{Cell, Difference};
use drived_words::output;

pub(super) fn part(drive: &DriveTold) -> Markup {
    match &drive.parameters {
        Ok(compared) => differences(compared),
        Err(why) => html! { p { (unread(why)) } },
    }
}

fn differences(compared: &Compared) -> Markup {
    let comparison = &compared.factory;
    let same = output::counted(comparison.same, "parameter is", "parameters are");
    html! {
        @if comparison.differences.is_empty() { p { "None." } }
        @else {
            (table("list parameters", &["parameter", "name", "value", "factory"], 2, comparison.differences.iter().map(differing).collect()))
        }
        p.note { (same) " as the manual prints the factory setting. Read at " (compared.held.head.date) "." }
        @if !comparison.unjudged.is_empty() {
            details open {
                summary { (output::counted(comparison.unjudged.len(), "parameter", "parameters")) " cannot be judged" }
                (table("list parameters", &["parameter", "name", "value", "why"], 9, comparison.unjudged.iter().map(unjudged).collect()))
            }
        }
    }
}

fn differing(difference: &Difference) -> Vec<Markup> {
    let [held, factory] = &difference.sides;
    vec![cell(difference.row.code), cell(difference.row.name), shown(held), shown(factory)]
}

fn unjudged(difference: &Difference) -> Vec<Markup> {
    let [held, factory] = &difference.sides;
    let why = match (held, factory) {
        (Cell::Unread(_), _) => html! { "it could not be read" },
        (Cell::Lacks, _) => html! { "the drive was not asked for it" },
        (_, Cell::Unread(rule)) => html! { (rule) },
        (_, _) => html! { "the manual prints no factory setting" },
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
