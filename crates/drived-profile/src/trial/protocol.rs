//! The protocol of a trial, as it stands in the file.

use drive_profile::{
    Profile,
    format::{Reached, TriedOn},
    read,
};

/// What is signed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Protocol {
    pub person: String,
    pub drive: String,
    pub firmware: String,
    pub day: String,
    /// What was seen, in the order of the steps.
    pub seen: Vec<String>,
    /// How far it came.
    pub reached: Reached,
    /// What it was tried on, as the person has said.
    pub on: TriedOn,
}

impl Protocol {
    /// The table of the file, for a profile of this substance.
    pub(crate) fn table(&self, substance: &str) -> String {
        let reached = match self.reached {
            Reached::Read => "read",
            Reached::Stopped => "stopped",
            Reached::Started => "started",
        };
        let on = match self.on {
            TriedOn::Drive => "drive",
            TriedOn::Simulator => "simulator",
        };
        let text = |text: &str| toml::Value::String(text.to_owned()).to_string();
        format!(
            "[[tried]]\nperson = {}\ndrive = {}\nfirmware = {}\nday = {}\nseen = {}\nreached = \"{reached}\"\non = \"{on}\"\nof = \"{substance}\"\n",
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
        // What is tried is what the file says, with or without a table of what was tried.
        let substance = read(text).map_err(|refusals| refusals.to_string())?.substance().to_owned();
        let is_empty_answer = |line: &&str| {
            let answer = line.split_once('=').filter(|(key, _)| key.trim() == "tried");
            answer.is_some_and(|(_, said)| matches!(said.trim(), "\"none\"" | "\"unknown\"" | "[]"))
        };
        let mut kept: Vec<&str> = text.lines().filter(|line| !is_empty_answer(line)).collect();
        while kept.last().is_some_and(|line| line.trim().is_empty()) {
            kept.pop();
        }
        let with = format!("{}\n\n{}", kept.join("\n"), self.table(&substance));
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
            reached: Reached::Started,
            on: TriedOn::Drive,
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

    /// The MS300 again, which only a trial lifts to motion.
    #[test]
    fn a_trial_that_ended_before_the_start_or_was_on_a_simulator_or_was_of_another_file_lifts_nothing() {
        let (_, text) =
            shipped::TEXTS.iter().find(|(name, _)| *name == "delta/ms300").expect("it is shipped");
        let level = |protocol: Protocol| {
            let (_, profile) = protocol.written_into(text).expect("it goes in");
            let said = profile.gaps().iter().find(|gap| gap.what.starts_with("the trial of A. Fitter"));
            (profile.level(), said.map(|gap| gap.what.clone()).unwrap_or_default())
        };
        for (reached, said) in
            [(Reached::Read, "proves no stop"), (Reached::Stopped, "proves the stop alone")]
        {
            let (level, what) = level(Protocol { reached, ..protocol() });
            assert!(level == Level::Stop && what.contains(said), "{level}: {what}");
        }
        let (reached, what) = level(Protocol { on: TriedOn::Simulator, ..protocol() });
        assert!(reached == Level::Stop && what.contains("on a simulator"), "{reached}: {what}");
        let (with, profile) = protocol().written_into(text).expect("it goes in");
        assert_eq!(profile.level(), Level::Motion);
        // Another start word, another register, another drive; and what decides nothing.
        for (place, by, after) in [
            ("words = [0x0012]", "words = [0x0052]", Level::Stop),
            ("models = \"", "models = \"another than ", Level::Stop),
            ("name = \"", "name = \"the ", Level::Motion),
            ("words = [0x0012]", "words = [18]", Level::Motion),
        ] {
            let changed = with.replacen(place, by, 1);
            assert_ne!(changed, with, "{place}");
            let profile = read(&changed).unwrap_or_else(|refusals| panic!("{refusals}"));
            assert_eq!(profile.level(), after, "{by}");
            let told = profile.gaps().iter().any(|gap| gap.what.contains("holds no more"));
            assert_eq!(told, after == Level::Stop, "{by}");
        }
    }
}
