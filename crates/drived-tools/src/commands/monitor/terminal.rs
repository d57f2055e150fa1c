//! What a terminal can show, by what its environment says of it; and the picture for one that has ASCII alone.

use ratatui::buffer::Buffer;

/// What a terminal can show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shows {
    /// Lines one behind the other, and no picture.
    Nothing,
    /// A picture of ASCII.
    Ascii,
    Unicode,
}

impl Shows {
    /// By the variables of the environment with these names.
    pub(super) fn of(variable: impl Fn(&str) -> Option<String>) -> Self {
        let given = |name: &str| variable(name).filter(|value| !value.is_empty());
        if given("TERM").is_some_and(|terminal| terminal == "dumb") {
            return Self::Nothing;
        }
        // POSIX: the first of these that has a value counts. Where none has, most terminals of today know UTF-8.
        let locale = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find_map(given);
        let is_utf_8 = locale.is_none_or(|locale| {
            let locale = locale.to_ascii_lowercase();
            locale.ends_with("utf-8")
                || locale.ends_with("utf8")
                || locale.contains("utf-8@")
                || locale.contains("utf8@")
        });
        if is_utf_8 { Self::Unicode } else { Self::Ascii }
    }
}

/// A picture in ASCII.
pub(super) fn to_ascii(picture: &mut Buffer) {
    for cell in &mut picture.content {
        if cell.symbol().is_ascii() {
            continue;
        }
        let symbol = match cell.symbol().chars().next().unwrap_or(' ') {
            '─' | '━' | '═' | '—' | '–' | '╌' => "-",
            '│' | '┃' | '║' => "|",
            '┌' | '┐' | '└' | '┘' | '├' | '┤' | '┬' | '┴' | '┼' | '╭' | '╮' | '╯' | '╰' => {
                "+"
            }
            '\u{2800}' | '\u{a0}' => " ",
            '\u{2801}'..='\u{28FF}' | '•' | '●' | '■' | '█' | '▪' => "*",
            '·' => ".",
            '…' => "~",
            '▲' | '↑' => "^",
            '▼' | '↓' => "v",
            '►' | '▶' | '→' | '›' => ">",
            '◄' | '◀' | '←' | '‹' => "<",
            '’' | '‘' => "'",
            '“' | '”' => "\"",
            _ => "?",
        };
        cell.set_symbol(symbol);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shows(variables: &[(&str, &str)]) -> Shows {
        Shows::of(|name| {
            variables.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn a_terminal_shows_what_its_environment_says() {
        assert_eq!(shows(&[("TERM", "dumb"), ("LANG", "en_US.UTF-8")]), Shows::Nothing);
        assert_eq!(shows(&[("TERM", "xterm"), ("LANG", "C")]), Shows::Ascii);
        assert_eq!(shows(&[("LANG", "fr_FR.ISO-8859-1")]), Shows::Ascii);
        assert_eq!(shows(&[("LANG", "C"), ("LC_ALL", "C.UTF-8")]), Shows::Unicode);
        assert_eq!(shows(&[("LANG", "fr_FR.utf8@euro"), ("LC_ALL", "")]), Shows::Unicode);
        assert_eq!(shows(&[("TERM", "xterm")]), Shows::Unicode);
    }

    #[test]
    fn a_picture_in_ascii_has_the_same_places() {
        let mut picture = Buffer::with_lines(["┌─ é ⣿ ─┐", "│ 30·5 …│"]);
        to_ascii(&mut picture);
        assert_eq!(picture, Buffer::with_lines(["+- ? * -+", "| 30.5 ~|"]));
    }
}
