//! The protocol of a trial, as it stands in the file.

use drive_profile::{Profile, read};

/// What is signed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Protocol {
    pub person: String,
    pub drive: String,
    pub firmware: String,
    pub day: String,
    /// What was seen, in the order of the steps.
    pub seen: Vec<String>,
}

impl Protocol {
    /// The table of the file.
    pub(crate) fn table(&self) -> String {
        let text = |text: &str| toml::Value::String(text.to_owned()).to_string();
        format!(
            "[[tried]]\nperson = {}\ndrive = {}\nfirmware = {}\nday = {}\nseen = {}\n",
            text(&self.person),
            text(&self.drive),
            text(&self.firmware),
            text(&self.day),
            text(&self.seen.join("; ")),
        )
    }

    /// The text of a profile with it, and what that profile is.
    ///
    /// # Errors
    /// What keeps it from being written, for whoever writes the file.
    pub(crate) fn written_into(&self, text: &str) -> Result<(String, Profile), String> {
        let is_empty_answer = |line: &&str| {
            let answer = line.split_once('=').filter(|(key, _)| key.trim() == "tried");
            answer.is_some_and(|(_, said)| matches!(said.trim(), "\"none\"" | "\"unknown\"" | "[]"))
        };
        let mut kept: Vec<&str> = text.lines().filter(|line| !is_empty_answer(line)).collect();
        while kept.last().is_some_and(|line| line.trim().is_empty()) {
            kept.pop();
        }
        let with = format!("{}\n\n{}", kept.join("\n"), self.table());
        match read(&with) {
            Ok(profile) => Ok((with, profile)),
            Err(refusals) => Err(format!(
                "the protocol does not go into the file ({refusals}): write what was tried as tables [[tried]] at its end, \
                 and not as a list"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use drive_profile::{Level, shipped};

    use super::*;

    fn protocol() -> Protocol {
        Protocol {
            person: "A. Fitter".to_owned(),
            drive: "MS300, 0.75 kW \"on the bench\"".to_owned(),
            firmware: "1.12".to_owned(),
            day: "2026-11-24".to_owned(),
            seen: vec!["all was read".to_owned(), "a stop over the bus was seen".to_owned()],
        }
    }

    /// 2000h has other words at each maker's: the MS300 is held below motion until a person has tried it by name.
    #[test]
    fn a_named_persons_trial_stands_in_the_file_and_settles_what_only_a_trial_can() {
        let (_, text) =
            shipped::TEXTS.iter().find(|(name, _)| *name == "delta/ms300").expect("it is shipped");
        assert_eq!(read(text).expect("it is right").level(), Level::Stop);
        let (once, profile) = protocol().written_into(text).expect("it goes in");
        assert_eq!(profile.level(), Level::Motion, "{:#?}", profile.gaps());
        let (twice, profile) = protocol().written_into(&once).expect("it goes in again");
        let tried = profile.file().tried.given().expect("it was tried");
        assert_eq!(tried.len(), 2);
        assert_eq!(tried[1].get_ref().drive, "MS300, 0.75 kW \"on the bench\"");
        assert!(twice.starts_with(&once[..once.len() - 1]), "what was there stays");
    }
}
