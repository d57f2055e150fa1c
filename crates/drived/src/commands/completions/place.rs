//! Where in a command line the cursor is: in which subcommand, at which of its arguments, behind which others.

use clap::{Arg, ArgAction, Command};

/// Where the cursor is.
#[derive(Debug)]
pub(super) struct Place<'a> {
    pub(super) command: &'a Command,
    /// The subcommands on the way to it: `["param", "get"]`.
    pub(super) path: Vec<&'a str>,
    /// The options that have been given, with their values.
    options: Vec<(&'a Arg, String)>,
    /// What has been given without an option.
    pub(super) positionals: Vec<String>,
    pub(super) cursor: Cursor<'a>,
}

/// What is being typed.
#[derive(Debug)]
pub(super) enum Cursor<'a> {
    /// The value of an option; what stands before it in the same word: `--mode=`.
    Value { option: &'a Arg, before: String, typed: String },
    /// The name of an option.
    Option(String),
    /// A subcommand, or a value without an option.
    Word(String),
}

impl<'a> Place<'a> {
    /// The place at the end of these words, the first of which is the program.
    pub(super) fn find(root: &'a Command, words: &[String]) -> Self {
        let mut place = Self {
            command: root,
            path: Vec::new(),
            options: Vec::new(),
            positionals: Vec::new(),
            cursor: Cursor::Word(String::new()),
        };
        let Some((last, before)) = words.split_last() else { return place };
        let mut open: Option<&Arg> = None;
        let mut only_values = false;
        for word in before.iter().skip(1) {
            match (open.take(), word.strip_prefix("--")) {
                (Some(option), _) => place.options.push((option, word.clone())),
                (None, Some("")) if !only_values => only_values = true,
                (None, Some(option)) if !only_values => {
                    let (name, value) = split_value(option);
                    if let Some(option) = place.option(name) {
                        match value {
                            None if takes_value(option) => open = Some(option),
                            value => place.options.push((option, value.unwrap_or_default().to_owned())),
                        }
                    }
                }
                _ => place.word(word),
            }
        }
        let named = last.strip_prefix("--").filter(|_| !only_values).map(split_value);
        let valued = named.and_then(|(name, value)| Some((place.option(name)?, name, value?)));
        place.cursor = match (open, valued) {
            (Some(option), _) => Cursor::Value { option, before: String::new(), typed: last.clone() },
            (None, Some((option, name, value))) => {
                Cursor::Value { option, before: format!("--{name}="), typed: value.to_owned() }
            }
            (None, None) if last.starts_with('-') && !only_values => Cursor::Option(last.clone()),
            (None, None) => Cursor::Word(last.clone()),
        };
        place
    }

    fn word(&mut self, word: &str) {
        let subcommand = self.command.find_subcommand(word).filter(|_| self.positionals.is_empty());
        match subcommand {
            Some(command) => {
                self.command = command;
                self.path.push(command.get_name());
                self.options.clear();
            }
            None => self.positionals.push(word.to_owned()),
        }
    }

    fn option(&self, name: &str) -> Option<&'a Arg> {
        self.command.get_arguments().find(|arg| arg.get_long() == Some(name))
    }

    /// The value of an option that has been given.
    pub(super) fn given(&self, name: &str) -> Option<&str> {
        let mut given = self.options.iter().filter(|(option, _)| option.get_long() == Some(name));
        given.next_back().map(|(_, value)| value.as_str())
    }

    /// The options that can still be given.
    pub(super) fn left(&self) -> impl Iterator<Item = &'a Arg> + '_ {
        self.command.get_arguments().filter(|option| {
            let is_given = self.options.iter().any(|(given, _)| given.get_id() == option.get_id());
            let is_repeated = matches!(option.get_action(), ArgAction::Append | ArgAction::Count);
            option.get_long().is_some() && !option.is_hide_set() && (is_repeated || !is_given)
        })
    }

    /// The value without an option that the cursor is at, if another one is expected.
    pub(super) fn positional(&self) -> Option<&'a Arg> {
        let all: Vec<&Arg> = self.command.get_positionals().collect();
        let last = || all.last().copied().filter(|last| matches!(last.get_action(), ArgAction::Append));
        all.get(self.positionals.len()).copied().or_else(last)
    }
}

fn split_value(option: &str) -> (&str, Option<&str>) {
    option.split_once('=').map_or((option, None), |(name, value)| (name, Some(value)))
}

fn takes_value(option: &Arg) -> bool {
    option.get_num_args().is_none_or(|range| range.takes_values()) && option.get_action().takes_values()
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;
    use crate::cli::Cli;

    fn at(line: &str, check: impl FnOnce(Place<'_>)) {
        let mut root = Cli::command();
        root.build();
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        check(Place::find(&root, &words));
    }

    #[test]
    fn the_cursor_is_found_behind_subcommands_options_and_values() {
        at("drived par", |place| {
            assert!(place.path.is_empty() && matches!(place.cursor, Cursor::Word(typed) if typed == "par"));
        });
        at("drived param get --line /dev/x --drive atv312@1 A", |place| {
            assert_eq!((place.path, place.positionals.len()), (vec!["param", "get"], 0));
            assert!(matches!(place.cursor, Cursor::Word(typed) if typed == "A"));
        });
        at("drived status --line /dev/x --drive ", |place| {
            assert_eq!(place.given("line"), Some("/dev/x"));
            let Cursor::Value { option, before, typed } = place.cursor else { panic!("{:?}", place.cursor) };
            assert_eq!((option.get_long(), before.as_str(), typed.as_str()), (Some("drive"), "", ""));
        });
        at("drived stop --mode=fr", |place| {
            let Cursor::Value { option, before, typed } = place.cursor else { panic!("{:?}", place.cursor) };
            assert_eq!((option.get_long(), before.as_str(), typed.as_str()), (Some("mode"), "--mode=", "fr"));
        });
        at("drived status --json pu", |place| {
            assert!(matches!(place.cursor, Cursor::Word(ref typed) if typed == "pu"));
            assert_eq!(place.positional().map(|arg| arg.get_id().as_str()), Some("name"));
            assert!(place.left().all(|option| option.get_long() != Some("json")));
        });
        at("drived status -- --js", |place| assert!(matches!(place.cursor, Cursor::Word(_))));
    }
}
