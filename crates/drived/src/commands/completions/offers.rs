//! What can stand at the cursor, by what the argument is called in the help: a table from its value name.

use clap::{Arg, Command};
use drive_core::{Row, StopMode};
use drive_families::Family;
use drived_config::profiles;

use super::{
    known::Known,
    place::{Cursor, Place},
};
use drived_words::ports;

/// What a word means is told in so many characters.
const BRIEF: usize = 60;

/// A word that can stand there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Offer {
    pub(super) word: String,
    /// What it means.
    pub(super) said: String,
    /// Whether nothing is missing behind it.
    pub(super) is_whole: bool,
}

/// What can stand there.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Offers {
    pub(super) words: Vec<Offer>,
    /// Files can stand there too, which the shell finds.
    pub(super) files: bool,
}

impl Offers {
    fn files() -> Self {
        Self { files: true, ..Self::default() }
    }

    fn of(words: impl IntoIterator<Item = Offer>) -> Self {
        Self { words: words.into_iter().collect(), files: false }
    }

    fn and(mut self, other: Self) -> Self {
        self.words.extend(other.words);
        self.files |= other.files;
        self
    }

    /// Those that begin as the word does; where none does, those that do in other letters: `acc` is ACC.
    fn beginning(mut self, typed: &str) -> Self {
        let begins = |offer: &Offer| offer.word.starts_with(typed);
        if !self.words.iter().any(begins) {
            let alike = |offer: &Offer| offer.word.to_lowercase().starts_with(&typed.to_lowercase());
            self.words.retain(alike);
        } else {
            self.words.retain(begins);
        }
        self
    }
}

fn whole(word: impl Into<String>, said: impl Into<String>) -> Offer {
    Offer { word: word.into(), said: brief(said.into()), is_whole: true }
}

fn part(word: impl Into<String>, said: impl Into<String>) -> Offer {
    Offer { is_whole: false, ..whole(word, said) }
}

/// What can stand at the cursor of a place.
pub(super) fn at(place: &Place<'_>, known: &Known) -> Offers {
    match &place.cursor {
        Cursor::Value { option, before, typed } => {
            let mut offers = values(place, known, option, typed).beginning(typed);
            for offer in &mut offers.words {
                offer.word.insert_str(0, before);
            }
            offers
        }
        Cursor::Option(typed) => options(place).beginning(typed),
        Cursor::Word(typed) => {
            let subcommands = place.command.get_subcommands().filter(|_| place.positionals.is_empty());
            let subcommands = subcommands.filter(|command| !command.is_hide_set());
            let subcommands =
                Offers::of(subcommands.map(|command| whole(command.get_name(), about(command))));
            let values = place.positional().map(|arg| values(place, known, arg, typed)).unwrap_or_default();
            let offers = subcommands.and(values);
            match offers == Offers::default() {
                true => options(place),
                false => offers,
            }
            .beginning(typed)
        }
    }
}

fn options(place: &Place<'_>) -> Offers {
    let long = |option: &Arg| Some(whole(format!("--{}", option.get_long()?), first_sentence(option)));
    Offers::of(place.left().filter_map(long))
}

fn about(command: &Command) -> String {
    command.get_about().map(ToString::to_string).unwrap_or_default()
}

fn first_sentence(option: &Arg) -> String {
    let help = option.get_help().map(ToString::to_string).unwrap_or_default();
    help.split([';', '\n']).next().unwrap_or_default().to_owned()
}

/// As much of a text as stands beside a word in a list.
fn brief(text: String) -> String {
    match text.char_indices().nth(BRIEF) {
        Some((end, _)) => format!("{}…", text.get(..end).unwrap_or_default().trim_end()),
        None => text,
    }
}

/// The values of an argument.
fn values(place: &Place<'_>, known: &Known, arg: &Arg, typed: &str) -> Offers {
    let possible = arg.get_possible_values();
    if !possible.is_empty() {
        let help = |value: &clap::builder::PossibleValue| {
            value.get_help().map(ToString::to_string).unwrap_or_default()
        };
        return Offers::of(possible.iter().map(|value| whole(value.get_name(), help(value))));
    }
    let name = arg.get_value_names().and_then(|names| names.first()).map_or("", |name| name.as_str());
    let drives = || Offers::of(known.drives.iter().map(|drive| whole(&drive.name, &drive.place)));
    let groups = || Offers::of(known.groups.iter().map(|group| whole(group, "a group")));
    let lines = || Offers::of(known.lines.iter().map(|line| whole(line, "a line")));
    let families = || {
        Offers::of(
            Family::all().into_iter().map(|family| whole(family.to_string(), family.capabilities().name)),
        )
    };
    match (&*place.path, name) {
        (_, "LINE" | "PORT") if arg.get_long() == Some("line") => {
            Offers::of(line(typed, family_of_line(place)))
        }
        (_, "LINE") => lines(),
        (["explain" | "capture"], "NAME") => lines(),
        // They are given here.
        (["init" | "scan"] | ["token", _], "NAME") => Offers::default(),
        (["accept" | "faults"] | ["names" | "param", _], "NAME") => drives(),
        (_, "NAME" | "NAME|SETPOINT") => drives().and(groups()),
        (["param", action], "[NAME] REGISTER" | "[NAME] REGISTER VALUE") => {
            words_of_param(place, known, action).unwrap_or_else(drives)
        }
        (_, "FAMILY|NAME") => families().and(drives()),
        (_, "DRIVE") => drives(),
        (_, "DRIVE|LINE") => drives().and(groups()).and(lines()),
        (_, "FILE|DRIVE|factory") => {
            drives().and(Offers::of([whole("factory", "the factory setting")])).and(Offers::files())
        }
        (_, "FILE" | "FILE|HEX" | "PATH" | "LINK" | "FOLDER" | "DIR" | "FILE|FOLDER") => Offers::files(),
        (_, "FAMILY") => families(),
        (_, "PROFILE") => {
            let all = profiles::all();
            Offers::of(all.iter().map(|(profile, _)| whole(profile.key(), profile.name())))
                .and(Offers::files())
        }
        (_, "FAMILY@ADDRESS" | "FAMILY@ADDRESSES") => Offers::of(
            Family::all().into_iter().map(|family| part(format!("{family}@"), family.capabilities().name)),
        ),
        (_, "MODE") => Offers::of(StopMode::ALL.map(|mode| whole(mode.to_string().replace(' ', "-"), ""))),
        (_, "DIRECTION") => Offers::of([whole("forward", ""), whole("reverse", "")]),
        (_, "NAME=VALUE") => {
            let family = family_of_line(place);
            let families = family.map_or_else(Family::all, |family| vec![family]);
            let own = families.into_iter().flat_map(Family::options);
            Offers::of(own.map(|option| part(format!("{}=", option.name), option.meaning)))
        }
        (_, "BAUD[,FORMAT]") => Offers::of(settings("", typed, family_of_line(place))),
        (_, "FORMAT[,PROTOCOL]") => Offers::of(formats("", family_of_line(place))),
        (_, "SPEEDS") => Offers::of(settings("", "", None)),
        (_, "FORMATS") => Offers::of(formats("", None)),
        (_, "PROTOCOLS") => Offers::of(
            of(None, |family| family.capabilities().protocols.to_vec())
                .into_iter()
                .map(|protocol| part(protocol, "")),
        ),
        // Numbers, times and texts are the person's own.
        (
            _,
            "ADDRESS" | "ADDRESSES" | "FREQUENCY" | "HEAD" | "IDENTITY" | "KEY" | "MINUTES" | "MNEMONIC"
            | "N" | "NUMBER" | "PERSON" | "SECONDS" | "SETPOINT" | "TEXT" | "TIME" | "WORD",
        ) => Offers::default(),
        _ => Offers::default(),
    }
}

/// The words of `param get` and `param set`: a drive, unless --drive names it, a register, one of its listed values. `None`:
/// a drive is meant.
fn words_of_param(place: &Place<'_>, known: &Known, action: &str) -> Option<Offers> {
    let words: Vec<&str> = place.positionals.iter().map(String::as_str).collect();
    let (family, words) = match (place.given("line"), &*words) {
        (Some(_), words) => (family_of_line(place), words),
        (None, []) => return None,
        (None, [name, words @ ..]) => (known.family(name), words),
    };
    let Some(family) = family else { return Some(Offers::default()) };
    let rows = family.capabilities().rows;
    let register = |row: &Row| whole(row.code, row.name);
    Some(match (action, words) {
        ("set", []) => Offers::of(rows.iter().filter(|row| row.access.is_writable()).map(register)),
        ("set", [register]) => {
            let choices = Row::find(rows, register).map_or(&[][..], |row| row.range.choices());
            Offers::of(choices.iter().map(|choice| whole(choice.code, choice.meaning)))
        }
        ("set", _) => Offers::default(),
        _ => Offers::of(rows.iter().filter(|row| row.access.is_readable()).map(register)),
    })
}

/// The family of the drive beside `--line`.
fn family_of_line(place: &Place<'_>) -> Option<Family> {
    place.given("drive")?.split('@').next()?.parse().ok()
}

/// A line as far as it can be known: its port, then behind a comma each of its settings.
fn line(typed: &str, family: Option<Family>) -> Vec<Offer> {
    if let Some((port, rest)) = typed.split_once(',') {
        return match port.starts_with("tcp://") {
            true => Vec::new(),
            false => settings(&format!("{port},"), rest, family),
        };
    }
    let ports = ports::all().into_iter().map(|port| part(port, "a serial port"));
    let far = [("rtu+tcp://", "a serial server: HOST:PORT"), ("tcp://", "Modbus TCP: HOST:PORT")];
    ports.chain(far.map(|(scheme, said)| part(scheme, said))).collect()
}

/// `BAUD[,FORMAT[,PROTOCOL]]` behind what stands before it, as far as it has been typed.
fn settings(before: &str, typed: &str, family: Option<Family>) -> Vec<Offer> {
    match typed.split_once(',') {
        None => {
            let mut speeds: Vec<u32> = of(family, |family| family.capabilities().speeds.to_vec());
            speeds.sort_unstable();
            speeds.into_iter().map(|speed| part(format!("{before}{speed}"), "bit/s")).collect()
        }
        Some((speed, _)) => formats(&format!("{before}{speed},"), family)
            .into_iter()
            .chain(protocols(before, typed, family))
            .collect(),
    }
}

fn formats(before: &str, family: Option<Family>) -> Vec<Offer> {
    let formats = of(family, |family| family.capabilities().formats.to_vec());
    formats
        .into_iter()
        .map(|format| whole(format!("{before}{format}"), "data bits, parity, stop bits"))
        .collect()
}

fn protocols(before: &str, typed: &str, family: Option<Family>) -> Vec<Offer> {
    let [speed, format, _] = *typed.split(',').collect::<Vec<_>>() else { return Vec::new() };
    let protocols = of(family, |family| family.capabilities().protocols.to_vec());
    protocols.into_iter().map(|protocol| whole(format!("{before}{speed},{format},{protocol}"), "")).collect()
}

/// What a family has, or any of them where none is named; each once.
fn of<T: PartialEq>(family: Option<Family>, has: impl Fn(Family) -> Vec<T>) -> Vec<T> {
    let families = Family::all().into_iter().filter(|one| family.is_none_or(|family| family == *one));
    families.flat_map(has).fold(Vec::new(), |mut all, one| {
        if !all.contains(&one) {
            all.push(one);
        }
        all
    })
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;
    use crate::cli::Cli;

    fn check(command: &Command, seen: &mut Vec<String>) {
        for argument in command.get_arguments().filter(|argument| argument.get_action().takes_values()) {
            if argument.get_possible_values().is_empty() {
                seen.extend(argument.get_value_names().unwrap_or_default().iter().map(ToString::to_string));
            }
        }
        command.get_subcommands().for_each(|one| check(one, seen));
    }

    #[test]
    fn every_value_name_of_the_help_stands_in_the_table() {
        let mut root = Cli::command();
        root.build();
        let mut names = Vec::new();
        check(&root, &mut names);
        let table = include_str!("offers.rs");
        for name in names.iter().filter(|name| *name != "COMMAND") {
            assert!(table.contains(&format!("\"{name}\"")), "{name}: what does the tab key offer for it?");
        }
    }
}
