//! The document: its head, what needs somebody, the drives, the lines, the program, and how it is to be read.

use chrono::{DateTime, FixedOffset};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{
    drive,
    gather::Gathered,
    line, program, summary,
    words::{facts, moment, own, unread},
};
use crate::commands::param::file::Backup;

/// How it looks, on a screen and on A4.
const STYLE: &str = include_str!("report.css");

/// A report, before it is written down.
#[derive(Debug)]
pub(super) struct Page<'a> {
    pub(super) title: &'a str,
    pub(super) notes: &'a [String],
    pub(super) parties: Parties<'a>,
    /// What the drives held before, as somebody has kept it.
    pub(super) before: Option<&'a [Backup]>,
    /// Who answered.
    pub(super) source: &'a str,
    pub(super) written: DateTime<FixedOffset>,
    pub(super) gathered: &'a Gathered,
}

/// Who ordered what is reported, and who did it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Parties<'a> {
    pub(super) customer: Option<&'a str>,
    pub(super) technician: Option<&'a str>,
}

impl Page<'_> {
    /// The whole document. Whatever a drive, a file or the command line says is escaped.
    pub(super) fn html(&self) -> Markup {
        let Gathered { lines, drives, events, .. } = self.gathered;
        let names: Vec<&str> = drives.iter().map(super::gather::DriveTold::name).collect();
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light";
                    title.own[self.is_untitled()] { (self.title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    header { h1 { @if self.is_untitled() { (own(self.title)) } @else { (self.title) } } (self.head()) }
                    main {
                        section { h2 { "What needs attention" } (summary::attention(self.gathered)) }
                        section { h2 { "The drives at a glance" } (summary::overview(self.gathered)) }
                        h2.new { "Lines" }
                        @for told in lines {
                            @match told {
                                Ok(line) => (line::chapter(line, drives)),
                                Err(why) => p { (unread(why)) },
                            }
                        }
                        h2.new { "Drives" }
                        @for told in drives { (drive::chapter(told, self.before)) }
                        section { h2.new { "Alarms" } (program::alarms(events, &names)) }
                        section { h2 { "Settings of the program" } (program::settings(drives)) }
                        section { h2 { "How this report is to be read" } (reading()) }
                        (self.parties.signatures())
                    }
                }
            }
        }
    }

    /// Whether its title is the program's.
    fn is_untitled(&self) -> bool {
        self.title == super::TITLE
    }

    fn head(&self) -> Markup {
        let daemon = &self.gathered.state.daemon;
        let drives = self.gathered.drives.len();
        let silent = self.gathered.silent().len();
        let mut rows = Vec::new();
        for (label, who) in [("customer", self.parties.customer), ("technician", self.parties.technician)] {
            rows.extend(who.map(|who| (label.to_owned(), html! { (who) })));
        }
        rows.extend([
            ("written".to_owned(), html! { (self.written.format("%Y-%m-%d %H:%M:%S %:z")) }),
            (
                "told by".to_owned(),
                html! { (own(self.source)) @if daemon.demo { ", " strong { (own("whose drives are simulated")) } } },
            ),
            (
                "running since".to_owned(),
                html! { (own(&moment(daemon.started_unix_ms))) ", drived " (daemon.version) },
            ),
            ("lines".to_owned(), html! { (self.gathered.lines.len()) }),
            (
                "drives".to_owned(),
                html! { (drives) @if silent > 0 { ", " strong { (own("without an answer: ")) (silent) } } },
            ),
        ]);
        rows.extend(self.notes.iter().map(|note| ("note".to_owned(), html! { (note) })));
        facts(rows)
    }
}

impl Parties<'_> {
    /// Where they sign, if anybody is named.
    fn signatures(self) -> Markup {
        let named = [("technician", self.technician), ("customer", self.customer)];
        html! {
            @if named.iter().any(|(_, who)| who.is_some()) {
                section.signatures {
                    h2 { "Signatures" }
                    div.columns {
                        @for (label, who) in named {
                            div.block.signature {
                                p { (own(label)) @if let Some(who) = who { ": " (who) } }
                                div.line {}
                                p.note { (own("place and date")) }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn reading() -> Markup {
    html! {
        ul {
            @for sentence in READING { li { (own(sentence)) } }
        }
    }
}

const READING: [&str; 5] = [
    "Counts begin when the daemon began, or when the line was opened; hours and energy are the drive's own.",
    "“not read” says that something was asked for and did not come, with the reason; “not told by this family” that its manual has no such value; “–” that there is nothing to count yet.",
    "Factory settings are those of the manuals. A parameter for which the manual prints a rule instead of a number cannot be judged, and stands in a list of its own.",
    "A figure of the plan is the longest there can be while no commands are given. “as the line has been” is the same with the answer times that were measured.",
    "Registers and their values are called as in the manuals of the drives; the mnemonic is that of the drive's display.",
];
