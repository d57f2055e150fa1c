//! Values as a person reads them on paper: each with its unit, and what is not known said.

use std::time::Duration;

use drive_fleet::Counters;
use maud::{Markup, Render, html};

use super::gather::DriveTold;
use drived_plant::plant::views::DriveView;
use drived_words::{moment, output};

/// A sentence of the program's own, which has other words in another language.
pub(super) fn own(text: &str) -> Markup {
    html! { span.own { (text) } }
}

/// What was not read, and why.
pub(super) fn unread(why: &str) -> Markup {
    html! { span.unread { (own("not read: ")) (own(why)) } }
}

/// What a drive does not have to tell.
pub(super) fn untold() -> Markup {
    html! { span.untold { (own("not told by this family")) } }
}

/// Labels with their values.
pub(super) fn facts(rows: Vec<(String, Markup)>) -> Markup {
    html! {
        table.facts {
            tbody { @for (label, value) in rows { tr { th scope="row" { (label) } td { (value) } } } }
        }
    }
}

/// A table whose heads stand again on each page. Columns from `numbers_from` on are set to the right.
pub(super) fn table(class: &str, heads: &[&str], numbers_from: usize, rows: Vec<Vec<Markup>>) -> Markup {
    html! {
        table class=(class) {
            thead { tr { @for (column, head) in heads.iter().enumerate() {
                th scope="col" class=[(column >= numbers_from).then_some("number")] { (head) }
            } } }
            tbody { @for row in rows { tr { @for (column, cell) in row.into_iter().enumerate() {
                td class=[(column >= numbers_from).then_some("number")] { (cell) }
            } } } }
        }
    }
}

/// A text of a table.
pub(super) fn cell(text: impl Render) -> Markup {
    html! { (text) }
}

/// A time in milliseconds, as a person compares it; a dash where there is none.
pub(super) fn milliseconds(time: impl Into<Option<f64>>) -> String {
    match time.into() {
        None => "–".to_owned(),
        Some(time) if time < 10.0 => format!("{time:.2} ms"),
        Some(time) if time < 1_000.0 => format!("{time:.1} ms"),
        Some(time) => format!("{:.2} s", time / 1_000.0),
    }
}

/// A span of time: `34 s`, `5 min`, `12 h`.
pub(super) fn span(milliseconds: impl Into<Option<u64>>) -> String {
    let time = milliseconds.into().map(Duration::from_millis);
    time.map_or_else(|| "an unknown time".to_owned(), output::age)
}

/// A share of a whole, in per cent; a dash where there is no whole.
pub(super) fn share(part: u64, whole: u64) -> String {
    match whole {
        0 => "–".to_owned(),
        _ if part > 0 && part * 10_000 < whole => "< 0.01\u{a0}%".to_owned(),
        _ if part < whole && (whole - part) * 10_000 < whole => "> 99.99\u{a0}%".to_owned(),
        _ => format!("{:.2}\u{a0}%", part as f64 * 100.0 / whole as f64),
    }
}

/// A share that is told in per cent.
pub(super) fn percent(share: f64) -> String {
    format!("{share:.2}\u{a0}%")
}

/// A moment by this computer's clock.
pub(super) fn moment(unix_ms: impl Into<Option<u64>>) -> String {
    let time = unix_ms.into().and_then(|time| i64::try_from(time).ok());
    let told = time.and_then(|time| moment::told_here(time, "%Y-%m-%d %H:%M:%S"));
    told.unwrap_or_else(|| "an unknown time".to_owned())
}

impl DriveTold {
    pub(super) fn name(&self) -> &str {
        self.view.name()
    }

    /// Whether it answers, and what it says is young.
    pub(super) const fn is_there(&self) -> bool {
        self.view.snapshot.status.is_good()
    }

    /// Its statuses that came, and those that were due.
    pub(super) fn statuses(&self) -> (u64, u64) {
        let Counters { polls, answered, .. } = self.view.snapshot.counters;
        (answered.min(polls), polls)
    }

    /// The anchor of its chapter.
    pub(super) fn anchor(&self) -> String {
        let plain = self
            .name()
            .chars()
            .map(|character| if character.is_ascii_alphanumeric() { character } else { '-' });
        let DriveView { line, slave, .. } = &self.view;
        format!("drive-{}-{slave}-{}", line.len(), plain.collect::<String>())
    }

    /// Its family by its whole name.
    pub(super) fn family_name(&self) -> &str {
        self.family.as_ref().map_or_else(|_| &*self.view.family, |family| family.capabilities().name)
    }
}
