//! What the command line does not understand, on one line that says what to type.

use clap::{
    Command,
    error::{ContextKind, ContextValue, ErrorKind},
};

use drived_words::meant::{did_you_mean, nearest};

/// What people call things that are called otherwise here.
const CALLED: [(&str, &str); 8] = [
    ("read", "param get"),
    ("write", "param set"),
    ("log", "watch"),
    ("discover", "scan"),
    ("ports", "scan"),
    ("list", "families"),
    ("record", "capture"),
    ("simulate", "sim"),
];

/// How what is missing could be said, by the name of its value.
const SUCH_AS: [(&str, &str); 5] = [
    ("<LINE>", "such as --line /dev/ttyUSB0,19200,8E1"),
    ("<PORT>", "such as --line /dev/ttyUSB0,19200,8E1"),
    ("<FAMILY@ADDRESS", "such as --drive atv312@1, which drived scan finds"),
    ("<FILE|FOLDER>", "such as pump1.toml, as drived param backup writes it"),
    ("REGISTER VALUE>", "such as ACC 4.5"),
];

/// Why these arguments are refused: clap's first paragraph, and what to type instead.
pub(crate) fn one_line(error: &clap::Error, arguments: &[String], root: &Command) -> String {
    let message = error.to_string();
    let paragraph = message.split("\n\n").next().unwrap_or(&message);
    let words = paragraph.strip_prefix("error: ").unwrap_or(paragraph).split_whitespace();
    let text = words.collect::<Vec<_>>().join(" ");
    let (command, called) = subcommand(root, arguments);
    let instead = match error.kind() {
        ErrorKind::InvalidSubcommand => {
            let word = text_of(error, ContextKind::InvalidSubcommand);
            did_you_mean(&subcommands(root, command, &called, &word))
        }
        ErrorKind::UnknownArgument => {
            let word = text_of(error, ContextKind::InvalidArg);
            let suggested = did_you_mean(&texts(error, ContextKind::SuggestedArg));
            if suggested.is_empty() { argument(command, arguments, &word) } else { suggested }
        }
        ErrorKind::InvalidValue => did_you_mean(&texts(error, ContextKind::SuggestedValue)),
        ErrorKind::MissingRequiredArgument => {
            let missing = texts(error, ContextKind::InvalidArg).join(" ");
            let such = SUCH_AS.iter().filter(|(name, _)| missing.contains(name)).map(|(_, such)| *such);
            such.take(2).fold(String::new(), |told, such| format!("{told}, {such}"))
        }
        // A drive of a line of one's own, said where a drive of the daemon has its name.
        ErrorKind::ArgumentConflict => match named_drive(command, arguments) {
            Some(drive) => format!(": did you mean --drive {drive}?"),
            None => ": leave one of them out".to_owned(),
        },
        _ => String::new(),
    };
    let usage = message.lines().find_map(|line| line.strip_prefix("Usage: "));
    match usage {
        Some(usage) => format!("{text}{instead} (usage: {usage})"),
        None => format!("{text}{instead}"),
    }
}

fn text_of(error: &clap::Error, kind: ContextKind) -> String {
    texts(error, kind).pop().unwrap_or_default()
}

fn texts(error: &clap::Error, kind: ContextKind) -> Vec<String> {
    match error.get(kind) {
        Some(ContextValue::String(text)) => vec![text.clone()],
        Some(ContextValue::Strings(texts)) => texts.clone(),
        _ => Vec::new(),
    }
}

/// The subcommand that the arguments have come to, and its words.
fn subcommand<'a>(root: &'a Command, arguments: &[String]) -> (&'a Command, String) {
    let (mut command, mut called) = (root, String::new());
    for word in arguments.iter().take_while(|word| !word.starts_with('-')) {
        let Some(below) = command.find_subcommand(word) else { break };
        command = below;
        called = format!("{called}{word} ");
    }
    (command, called)
}

/// The subcommands that may have been meant by a word: those that people call so, those spelt alike, and one of that name elsewhere.
fn subcommands(root: &Command, command: &Command, called: &str, word: &str) -> Vec<String> {
    let by_name = |command: &Command| -> Vec<String> {
        let names = command.get_subcommands().map(|one| one.get_name().to_owned());
        names.filter(|name| name != "help").collect()
    };
    if let Some((_, meant)) = CALLED.iter().find(|(other, _)| other.eq_ignore_ascii_case(word)) {
        return vec![format!("drived {meant}")];
    }
    let here = by_name(command);
    let alike = nearest(word, here.iter().map(String::as_str));
    if !alike.is_empty() {
        return alike.iter().map(|name| format!("drived {called}{name}")).collect();
    }
    let with = root.get_subcommands().filter(|one| by_name(one).iter().any(|name| name == word));
    with.map(|one| format!("drived {} {word}", one.get_name())).collect()
}

/// A drive as `--drive` takes it, where `--line` was given and `--drive` was not.
fn named_drive<'a>(command: &Command, arguments: &'a [String]) -> Option<&'a String> {
    let has_drive = command.get_arguments().any(|argument| argument.get_long() == Some("drive"));
    let is_given = |long: &str| arguments.iter().any(|word| word.starts_with(long));
    let drive = arguments.iter().find(|word| word.contains('@') && !word.starts_with('-'));
    drive.filter(|_| has_drive && is_given("--line") && !is_given("--drive"))
}

/// What was meant by an argument that the subcommand does not know.
fn argument(command: &Command, arguments: &[String], word: &str) -> String {
    let has = |long: &str| command.get_arguments().any(|argument| argument.get_long() == Some(long));
    let is_given = |long: &str| {
        let option = format!("--{long}");
        arguments.iter().any(|word| *word == option || word.starts_with(&format!("{option}=")))
    };
    let before = arguments
        .iter()
        .position(|argument| argument == word)
        .and_then(|at| arguments.get(at.checked_sub(1)?));
    // A line, or addresses, with spaces: the shell has made several words of them.
    if let Some(before) = before.filter(|before| before.ends_with(',')) {
        let at = arguments.iter().position(|argument| argument == before).unwrap_or(0);
        let is_whole = |one: &String| !one.ends_with(',');
        let last = arguments.iter().skip(at).position(is_whole).map_or(arguments.len(), |more| at + more + 1);
        return format!(": write it without spaces, {}", arguments[at..last].concat());
    }
    if let Some(letter) = word.strip_prefix('-').filter(|letter| letter.chars().count() == 1) {
        let longs = command.get_arguments().filter_map(clap::Arg::get_long);
        let longs: Vec<String> =
            longs.filter(|long| long.starts_with(letter)).map(|long| format!("--{long}")).collect();
        return did_you_mean(&longs);
    }
    let is_number = !word.is_empty() && word.bytes().all(|byte| byte.is_ascii_digit());
    let is_line =
        word.starts_with('/') || word.contains("://") || word.starts_with("COM") || word.starts_with("tty");
    match word {
        _ if is_line && has("line") && !is_given("line") => format!(": did you mean --line {word}?"),
        _ if word.contains('@') && has("drive") && !is_given("drive") => {
            format!(": did you mean --drive {word}?")
        }
        _ if is_number && is_given("addresses") => {
            let numbers = arguments.iter().skip_while(|word| !word.starts_with("--addresses")).skip(1);
            let numbers =
                numbers.take_while(|word| word.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-'));
            format!(": did you mean --addresses {}?", numbers.cloned().collect::<Vec<_>>().join(","))
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory as _, Parser as _};

    use super::*;
    use crate::cli::Cli;

    #[test]
    fn what_is_refused_is_said_on_one_line_with_what_to_type() {
        let port = "/dev/ttyUSB0";
        for (arguments, reason) in [
            (&["poll", "--line", port, "--drive", "atv999@1"][..], "is not a family of drives"),
            (&["poll", "--line", port], "such as --drive atv312@1, which drived scan finds"),
            (&["fly"], "unrecognized subcommand 'fly' (usage"),
            (&["statsu"], "did you mean drived status?"),
            (&["read"], "did you mean drived param get?"),
            (&["backup", "x"], "did you mean drived param backup?"),
            (&["param", "bakup"], "did you mean drived param backup?"),
            (&["scan", port], "did you mean --line /dev/ttyUSB0?"),
            (&["scan", "-l", port], "did you mean --line?"),
            (&["scan", "--lin", port], "did you mean --line?"),
            (&["scan", "--line", "COM3,", "19200,", "8E1"], "write it without spaces, COM3,19200,8E1"),
            (&["scan", "--line", port, "--addresses", "1", "2", "3"], "did you mean --addresses 1,2,3?"),
            (&["status", "--line", port, "atv312@1"], "did you mean --drive atv312@1?"),
            (&["param", "restore"], "such as pump1.toml, as drived param backup writes it"),
            (&["completions", "bahs"], "did you mean bash?"),
            (
                &["doctor", "--line", port, "--drive", "atv312@1", "--addresses", "1-3"],
                "leave one of them out",
            ),
        ] {
            let words: Vec<String> = arguments.iter().map(|&word| word.to_owned()).collect();
            let error = Cli::try_parse_from(["drived"].iter().chain(arguments)).unwrap_err();
            let line = one_line(&error, &words, &Cli::command());
            assert!(line.contains(reason) && !line.contains('\n'), "{arguments:?}: {line}");
        }
    }
}
