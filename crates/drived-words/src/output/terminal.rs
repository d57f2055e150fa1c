//! What is known of the terminal that a stream goes to.

use std::io::IsTerminal;

/// How many characters a line of the terminal has, if this is one.
pub(super) fn width(stream: &impl IsTerminal) -> Option<usize> {
    let size = stream.is_terminal().then(|| crossterm::terminal::size().ok()).flatten();
    size.map(|(columns, _)| usize::from(columns)).filter(|&columns| columns > 0)
}

/// Whether a stream is shown in colours: on a terminal that has some, unless the environment forbids it by `NO_COLOR`, which
/// has to have a value (<https://no-color.org>).
pub fn is_coloured(stream: &impl IsTerminal) -> bool {
    stream.is_terminal() && may_be_coloured(|name| std::env::var(name).unwrap_or_default())
}

fn may_be_coloured(variable: impl Fn(&str) -> String) -> bool {
    variable("NO_COLOR").is_empty() && variable("TERM") != "dumb"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_left_out_where_the_environment_says_so() {
        let with = |no_color: &str, term: &str| {
            may_be_coloured(|name| if name == "NO_COLOR" { no_color.to_owned() } else { term.to_owned() })
        };
        assert!(with("", "xterm-256color") && with("", ""));
        assert!(!with("1", "xterm-256color") && !with("0", "xterm"));
        assert!(!with("", "dumb"));
    }
}
