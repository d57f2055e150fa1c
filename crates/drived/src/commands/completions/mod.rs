//! `drived completions`: what the tab key offers in a shell.
//!
//! Each shell has a short script that calls this program back with the words up to the cursor. The way there is a subcommand
//! and no variable of the environment: one that is left set must not keep a stop from being sent.

mod known;
mod offers;
mod place;
mod words;

use self::{
    known::Known,
    offers::{Offer, Offers},
    place::Place,
    words::{Word, quoted},
};
use drived_words::{failure::Failure, output};

// The text has brackets that a doc comment would take for links.
const ABOUT: &str = "\
Print what makes a shell complete subcommands, options, and the names of drives and parameters

bash: drived completions bash > ~/.local/share/bash-completion/completions/drived

zsh: drived completions zsh > \"${fpath[1]}/_drived\"

fish: drived completions fish > ~/.config/fish/completions/drived.fish

The names of drives, groups and lines are those of the running daemon, or of the file named by --config. No port is opened.";

/// What makes a shell complete.
#[derive(Debug, clap::Args)]
#[command(about = ABOUT.split('\n').next(), long_about = ABOUT)]
pub(crate) struct Args {
    /// Which shell
    shell: Shell,
    /// What the printed script asks: the words up to the cursor; for bash the line up to it, and what bash takes for the word
    #[arg(value_name = "WORD", last = true, allow_hyphen_values = true, hide = true)]
    words: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Shell {
    Bash,
    Zsh,
    Fish,
}

/// Offers what fits of a program.
pub(crate) async fn run(args: Args, mut program: clap::Command) -> Result<(), Failure> {
    let Args { shell, words } = args;
    if words.is_empty() {
        let script = match shell {
            Shell::Bash => include_str!("drived.bash"),
            Shell::Zsh => include_str!("_drived.zsh"),
            Shell::Fish => include_str!("drived.fish"),
        };
        return output::say_as_it_is(script.trim_end());
    }
    let typed = Typed::of(shell, words);
    program.build();
    let place = Place::find(&program, &typed.words);
    let offers = offers::at(&place, &Known::at(&place).await);
    output::say_as_it_is(if offers.files { "files" } else { "words" })?;
    typed.written(&offers).into_iter().try_for_each(output::say_as_it_is)
}

/// What has been typed, and how the shell wants to be answered.
struct Typed {
    shell: Shell,
    /// Without quotes.
    words: Vec<String>,
    /// How much of the word stands before what bash replaces.
    kept: usize,
    is_in_quotes: bool,
}

impl Typed {
    fn of(shell: Shell, words: Vec<String>) -> Self {
        let plain = |words: Vec<Word>| words.into_iter().map(|word| word.text).collect();
        match (shell, &*words) {
            (Shell::Bash, [line, rest @ ..]) => {
                let split = words::split(line);
                let is_in_quotes = split.last().is_some_and(|word| word.quote.is_some());
                let words: Vec<String> = plain(split);
                let replaced = rest.first().map(|word| words::split(word)).and_then(|mut words| words.pop());
                let replaced = replaced.unwrap_or_default().text;
                let word = words.last().map_or("", String::as_str);
                let kept = word.strip_suffix(replaced.as_str()).map_or(0, str::len);
                Self { shell, words, kept, is_in_quotes }
            }
            (Shell::Fish, [before @ .., last]) => {
                let last = words::split(last).pop().unwrap_or_default().text;
                Self { shell, words: [before, &[last]].concat(), kept: 0, is_in_quotes: false }
            }
            _ => Self { shell, words, kept: 0, is_in_quotes: false },
        }
    }

    /// The offers, a line each, as the shell's script takes them.
    fn written(&self, offers: &Offers) -> Vec<String> {
        offers.words.iter().map(|offer| self.line(offer, offers.files)).collect()
    }

    fn line(&self, Offer { word, said, is_whole }: &Offer, with_files: bool) -> String {
        match self.shell {
            Shell::Bash => {
                let rest = word.get(self.kept..).unwrap_or(word);
                match self.is_in_quotes || with_files {
                    // bash quotes it, and closes the quotes.
                    true => rest.to_owned(),
                    false => format!("{}{}", quoted(rest), if *is_whole { " " } else { "" }),
                }
            }
            Shell::Zsh => format!("{}{word}\t{said}", if *is_whole { '+' } else { '-' }),
            Shell::Fish => format!("{word}\t{said}"),
        }
    }
}
