//! `drived profile new`: a template in the order of a manual.

use std::{fs::OpenOptions, io::Write as _, path::PathBuf};

use drive_profile::{digest, shipped};
use drived_words::{failure::Failure, output};

/// What stands for the key in the template.
const KEY: &str = "NAME-OF-THE-DRIVE";

/// The template. Each question is asked, and answered by "unknown" until somebody knows.
pub(crate) const TEMPLATE: &str = include_str!("template.toml");

/// Write a template of a profile, with what each question asks, in the order of a manual
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The key by which configurations choose the drive: small letters, digits, hyphens
    #[arg(value_name = "KEY")]
    key: String,
    /// A shipped profile to begin with instead of the template, such as one of the same maker
    #[arg(long, value_name = "KEY")]
    like: Option<String>,
    /// Where it is written; one that is there is left alone. Without it the template is printed
    #[arg(long, value_name = "FILE")]
    to: Option<PathBuf>,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let text = match &args.like {
        Some(like) => copied(like, &args.key)?,
        None => template(&args.key),
    };
    // A key that cannot be is told now.
    if let Err(refusals) = drive_profile::read(&text) {
        return Err(Failure::Input(refusals.to_string()));
    }
    let Some(file) = &args.to else { return output::say_as_it_is(text.trim_end()) };
    let failed = |error: std::io::Error| Failure::Input(format!("{}: {error}", file.display()));
    if file.exists() {
        return Err(Failure::Input(format!(
            "{}: it is there already, and left alone: name another file, or check this one: drived profile check {0}",
            file.display()
        )));
    }
    let mut open = OpenOptions::new().write(true).create_new(true).open(file).map_err(failed)?;
    open.write_all(text.as_bytes()).map_err(failed)?;
    output::say(format_args!(
        "{}: fill it in from top to bottom, and after each edit: drived profile check {0}",
        file.display()
    ))
}

/// The text of a shipped profile under another key.
fn copied(like: &str, key: &str) -> Result<String, Failure> {
    let is_it = |text: &&str| shipped::find(like).is_some_and(|found| digest(text) == found.digest());
    let text = shipped::TEXTS.iter().map(|(_, text)| *text).find(is_it);
    let text = text.ok_or_else(|| {
        Failure::Input(format!("no profile {like:?} is shipped: drived profile list has those that are"))
    })?;
    Ok(text.replacen(&format!("key = {like:?}"), &format!("key = {key:?}"), 1))
}

/// The template under a key.
pub(crate) fn template(key: &str) -> String {
    TEMPLATE.replace(KEY, key)
}

#[cfg(test)]
mod tests {
    use drive_profile::{Level, read};

    use super::*;

    #[test]
    fn the_template_is_a_profile_that_only_watches_and_asks_the_next_question() {
        let profile = read(&template("new-drive")).unwrap_or_else(|refusals| panic!("{refusals}"));
        assert_eq!((profile.key(), profile.level()), ("new-drive", Level::Watch));
        let first = profile.gaps().first().expect("much is not known");
        assert_eq!(first.keeps_from, Some(Level::Stop), "{first}");
        assert!(read(&template("New Drive")).is_err(), "this is no key");
    }

    #[test]
    fn a_shipped_profile_is_copied_whole_under_another_key() {
        for profile in shipped::all() {
            let text = copied(profile.key(), "my-own").unwrap_or_else(|failure| panic!("{failure}"));
            let copy = read(&text).unwrap_or_else(|refusals| panic!("{refusals}"));
            assert_eq!((copy.key(), copy.level(), copy.name()), ("my-own", profile.level(), profile.name()));
        }
        assert!(copied("no-such-drive", "my-own").is_err());
    }
}
