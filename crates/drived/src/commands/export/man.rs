//! The man pages: one for the program and one for each subcommand, from what its help says.

use std::{fs, io, path::Path};

use clap::{Arg, Command};
use roff::{Inline, Roff, bold, italic, roman};

use drived_file as config_file;
use drived_words::{
    failure::{EXIT_CODES, Failure},
    output,
};

/// The variables of the environment that are looked at.
pub(crate) const ENVIRONMENT: [(&str, &str); 4] = [
    (
        "DRIVED_LOG",
        "how much is logged on stderr: off, error, warn, info, debug or trace; or for parts of the program, such as \
         drive_bus=trace,warn",
    ),
    ("DRIVED_PROFILES", "a folder of profiles, of drives that are not built in: every subcommand knows them"),
    ("NO_COLOR", "where it has a value nothing is coloured; colours are for terminals in any case"),
    (
        "RUNTIME_DIRECTORY, XDG_RUNTIME_DIR",
        "the folders in which the control socket of the daemon is looked for, before /run/drived",
    ),
];

/// Writes the pages into a folder, which is made where it is not there.
pub(super) fn write(program: Command, folder: &Path) -> Result<(), Failure> {
    let failed = |error: io::Error| Failure::Input(format!("{}: {error}", folder.display()));
    fs::create_dir_all(folder).map_err(failed)?;
    let pages = pages(program);
    for (name, page) in &pages {
        fs::write(folder.join(format!("{name}.1")), page).map_err(failed)?;
    }
    let number = output::counted(pages.len(), "page", "pages");
    output::say(format_args!("{}: {number}; man -l {0}/drived.1 shows the first", folder.display()))
}

/// Each page by its name.
fn pages(program: Command) -> Vec<(String, String)> {
    let mut root = program.disable_help_subcommand(true);
    root.build();
    let mut pages = Vec::new();
    of(&mut root, None, &mut pages);
    pages
}

fn of(command: &mut Command, parent: Option<&str>, pages: &mut Vec<(String, String)>) {
    let name = command.get_display_name().unwrap_or_else(|| command.get_name()).to_owned();
    let mut page = Roff::new();
    let version = format!("drived {}", env!("CARGO_PKG_VERSION"));
    let date = chrono::Local::now().format("%Y-%m-%d").to_string();
    page.control("TH", [name.to_uppercase().as_str(), "1", &date, &version, "drived"]);
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    section(&mut page, "NAME", [vec![roman(format!("{name} - {about}"))]]);
    let usage = command.render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ").trim().to_owned();
    section(&mut page, "SYNOPSIS", usage.lines().map(|line| vec![bold(line.trim())]));
    let whole = command.get_long_about().map(ToString::to_string).unwrap_or_default();
    // The first paragraph is its name already.
    let paragraphs = whole.split("\n\n").skip(1).map(|paragraph| marked(&paragraph.replace('\n', " ")));
    section(&mut page, "DESCRIPTION", paragraphs);
    let arguments: Vec<&Arg> = command.get_arguments().filter(|argument| !argument.is_hide_set()).collect();
    list(&mut page, "OPTIONS", arguments.into_iter().map(entry));
    let visible = command.get_subcommands().filter(|one| !one.is_hide_set());
    let subcommands = visible.map(|one| {
        let about = one.get_about().map(ToString::to_string).unwrap_or_default();
        (vec![bold(format!("{name}-{}", one.get_name())), roman("(1)")], about)
    });
    list(&mut page, "SUBCOMMANDS", subcommands);
    let notes = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let mut notes = notes.split("\n\n");
    let map = notes.next().unwrap_or_default().lines().filter_map(|line| line.split_once(':'));
    if name == "drived-check" {
        for (table, keys) in config_file::tables() {
            let keys = keys.iter().map(|key| (vec![bold(key.name)], plain(&key.sentence())));
            list(&mut page, &plain(&table).to_uppercase(), keys);
        }
    }
    list(&mut page, "WHAT FOR", map.map(|(what, how)| (vec![bold(what)], how.trim().to_owned())));
    let naming = notes.next().map(|naming| vec![roman(naming.replace('\n', " "))]);
    section(&mut page, "LINES AND DRIVES", naming);
    let told = |(name, meaning): (&str, &str)| (vec![bold(name)], meaning.to_owned());
    list(&mut page, "EXIT STATUS", EXIT_CODES.into_iter().map(told));
    list(&mut page, "ENVIRONMENT", ENVIRONMENT.into_iter().map(told));
    if let Some(parent) = parent {
        section(&mut page, "SEE ALSO", [vec![bold(parent), roman("(1)")]]);
    }
    pages.push((name.clone(), page.render()));
    for subcommand in command.get_subcommands_mut().filter(|one| !one.is_hide_set()) {
        of(subcommand, Some(&name), pages);
    }
}

/// A heading with paragraphs below it, where there are any.
fn section(page: &mut Roff, heading: &str, paragraphs: impl IntoIterator<Item = Vec<Inline>>) {
    for (index, paragraph) in paragraphs.into_iter().enumerate() {
        match index {
            0 => page.control("SH", [heading]),
            _ => page.control("PP", []),
        };
        page.text(paragraph);
    }
}

/// A heading with terms below it and what each means.
fn list(page: &mut Roff, heading: &str, entries: impl IntoIterator<Item = (Vec<Inline>, String)>) {
    for (index, (term, meaning)) in entries.into_iter().enumerate() {
        if index == 0 {
            page.control("SH", [heading]);
        }
        page.control("TP", []);
        page.text(term);
        page.text(marked(&meaning));
    }
}

/// A text whose parts between two asterisks on each side are bold, as its writer meant them.
fn marked(text: &str) -> Vec<Inline> {
    let parts = text.split("**").enumerate();
    parts.map(|(index, part)| if index % 2 == 1 { bold(part) } else { roman(part) }).collect()
}

/// Markdown without its marks, and without where its links lead.
fn plain(text: &str) -> String {
    let text = text.replace('`', "");
    let mut parts = text.split("](");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |mut text, rest| {
        if let Some(link) = text.rfind('[') {
            text.remove(link);
        }
        text + rest.split_once(')').map_or("", |(_, rest)| rest)
    })
}

/// An argument and what it means, with its values and what it is without being given.
fn entry(argument: &Arg) -> (Vec<Inline>, String) {
    let mut term = Vec::new();
    if let Some(short) = argument.get_short() {
        term.extend([bold(format!("-{short}")), roman(", ")]);
    }
    if let Some(long) = argument.get_long() {
        term.push(bold(format!("--{long}")));
    }
    if argument.get_action().takes_values() {
        let space = if term.is_empty() { "" } else { " " };
        let names = argument.get_value_names().unwrap_or_default();
        term.extend(names.iter().flat_map(|name| [roman(space), italic(name.as_str())]));
    }
    let help = argument.get_long_help().or_else(|| argument.get_help());
    let mut meaning = help.map(|help| help.to_string().replace('\n', " ")).unwrap_or_default();
    let possible = argument.get_possible_values();
    if argument.get_action().takes_values() && !possible.is_empty() {
        let values = possible.iter().map(|value| match value.get_help() {
            Some(help) => format!("{} ({help})", value.get_name()),
            None => value.get_name().to_owned(),
        });
        meaning.push_str(&format!(". One of: {}", values.collect::<Vec<_>>().join(", ")));
    }
    let default: Vec<_> = argument.get_default_values().iter().map(|value| value.to_string_lossy()).collect();
    if argument.get_action().takes_values() && !default.is_empty() {
        meaning.push_str(&format!(". Without it: {}", default.join(", ")));
    }
    (term, meaning)
}
