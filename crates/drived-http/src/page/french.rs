//! The page's French, for whoever tells the same elsewhere: its tables are read as they are served, so that each sentence
//! stands once.

mod findings;

use std::{collections::HashMap, sync::LazyLock};

pub use self::findings::{FindingFr, finding};

/// The French of a whole sentence or phrase of the daemon or of a manual's table of faults, where the page knows one.
pub fn sentence(english: &str) -> Option<&'static str> {
    SENTENCES.get(english).copied()
}

/// The French of a word of the API, such as a state, as it stands inside a sentence.
pub fn word(english: &str) -> Option<&'static str> {
    WORDS.get(english).copied()
}

static SENTENCES: LazyLock<HashMap<String, &'static str>> = LazyLock::new(|| {
    let whole = [include_str!("web/sentences_fr.js"), include_str!("web/faults_fr.js")];
    let whole = whole.into_iter().flat_map(str::lines).filter_map(pair);
    let kinds = include_str!("web/texts.js").lines().filter_map(forms);
    let kinds = kinds.filter(|(name, _)| name.starts_with("concern_") || name.starts_with("alarm_"));
    whole.chain(kinds.map(|(_, [english, french])| (plain(english), french))).collect()
});

static WORDS: LazyLock<HashMap<String, &'static str>> = LazyLock::new(|| {
    let rows = include_str!("web/vocabulary.js").lines().filter_map(forms);
    rows.map(|(name, [_, french])| (name.trim_matches('\'').replace('_', " "), french)).collect()
});

/// `'english': 'french',`
fn pair(line: &'static str) -> Option<(String, &'static str)> {
    let (english, french) = line.trim().strip_suffix("',")?.split_once(": '")?;
    Some((plain(english.trim_matches('\'')), french))
}

/// `name: ['english', 'french'],`
fn forms(line: &'static str) -> Option<(&'static str, [&'static str; 2])> {
    let (name, forms) = line.trim().strip_suffix("'],")?.split_once(": ['")?;
    let (english, french) = forms.split_once("', '")?;
    Some((name, [english, french]))
}

fn plain(text: &str) -> String {
    text.replace("\\'", "'")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_of_the_page_are_read_as_they_stand_there() {
        assert_eq!(sentence("the drive does not answer"), Some("le variateur ne répond pas"));
        assert_eq!(
            sentence("the drive's settings forbid this direction: allow it there, or start the other way"),
            Some(
                "les réglages du variateur interdisent ce sens : l’y autoriser, ou démarrer dans l’autre sens"
            )
        );
        assert_eq!(sentence("overcurrent at constant speed"), Some("surintensité à vitesse constante"));
        assert_eq!(sentence("does not answer"), Some("ne répond pas"));
        assert_eq!((word("not ready"), word("lost")), (Some("Non prêt"), Some("Liaison perdue")));
        for (english, french) in SENTENCES.iter().chain(WORDS.iter()) {
            let is_whole = !english.contains('\\') && !french.contains('\\') && !french.is_empty();
            assert!(is_whole, "{english}: {french}");
        }
        // As many as there are lines of this form in the files.
        assert!(SENTENCES.len() > 350, "{}", SENTENCES.len());
    }
}
