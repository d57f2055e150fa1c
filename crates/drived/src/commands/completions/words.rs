//! The words of a line as a shell would split it, up to the cursor.

/// A word that is being typed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Word {
    /// What it is without its quotes.
    pub(super) text: String,
    /// The quote that is still open at its end.
    pub(super) quote: Option<char>,
}

/// The words of the last command of a line; the last of them is the one at the cursor, empty behind a space. What a shell
/// would put in their place, such as variables, stays as it is.
pub(super) fn split(line: &str) -> Vec<Word> {
    let mut words = Vec::new();
    let mut word: Option<Word> = None;
    let mut characters = line.chars();
    while let Some(character) = characters.next() {
        let quote = word.as_ref().and_then(|word| word.quote);
        match (quote, character) {
            (Some(open), character) if character == open => {
                word.get_or_insert_default().quote = None;
            }
            (Some('\''), character) => word.get_or_insert_default().text.push(character),
            (None, '\'' | '"') => word.get_or_insert_default().quote = Some(character),
            (_, '\\') => word.get_or_insert_default().text.extend(characters.next()),
            (Some(_), character) => word.get_or_insert_default().text.push(character),
            (None, ' ' | '\t') => words.extend(word.take()),
            // Another command begins.
            (None, ';' | '|' | '&' | '(' | '\n') => {
                word = None;
                words.clear();
            }
            (None, character) => word.get_or_insert_default().text.push(character),
        }
    }
    words.push(word.unwrap_or_default());
    let is_set = |word: &Word| word.text.split_once('=').is_some_and(|(name, _)| is_variable(name));
    let before = words.iter().take(words.len() - 1).take_while(|word| is_set(word)).count();
    words.split_off(before)
}

/// Whether a variable may have this name: `DRIVED_LOG=debug drived ...` begins with the program all the same.
fn is_variable(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|character| character.is_ascii_alphanumeric() || character == '_')
}

/// A text as bash reads it back as one word.
pub(super) fn quoted(text: &str) -> String {
    let is_plain = |character: char| character.is_alphanumeric() || "-_./:@=,+%".contains(character);
    let mut quoted = String::with_capacity(text.len());
    for character in text.chars() {
        if !is_plain(character) {
            quoted.push('\\');
        }
        quoted.push(character);
    }
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(line: &str) -> Vec<String> {
        split(line).into_iter().map(|word| word.text).collect()
    }

    #[test]
    fn a_line_is_split_as_a_shell_does() {
        for (line, words) in [
            ("drived", &["drived"][..]),
            ("drived ", &["drived", ""]),
            ("drived status pump\\ 1", &["drived", "status", "pump 1"]),
            ("drived status 'pump 1' \"fan \\\"2\\\"\" ", &["drived", "status", "pump 1", "fan \"2\"", ""]),
            ("drived status a'b c'd", &["drived", "status", "ab cd"]),
            ("drived status 'pump 1", &["drived", "status", "pump 1"]),
            ("cd /tmp && DRIVED_LOG=debug drived stop p", &["drived", "stop", "p"]),
            ("echo x | drived start --option a=b", &["drived", "start", "--option", "a=b"]),
            ("", &[""]),
        ] {
            assert_eq!(texts(line), words, "{line}");
        }
        assert_eq!(split("drived stop \"pu").pop().unwrap().quote, Some('"'));
        assert_eq!(split("drived stop \"pu\"").pop().unwrap().quote, None);
    }

    #[test]
    fn what_is_quoted_is_read_back_as_one_word() {
        for text in ["pump 1", "Lüfter", "a'b\"c", "$HOME", "x;y", "atv312@1-3,5", "a\\b"] {
            assert_eq!(texts(&quoted(text)), [text], "{}", quoted(text));
        }
        assert_eq!(quoted("/dev/ttyUSB0,19200,8E1"), "/dev/ttyUSB0,19200,8E1");
    }
}
