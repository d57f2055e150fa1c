//! How the log puts it.

use std::{fmt, sync::Arc, time::Duration};

use drive_core::{Error, Fault, Frequency, Motion, PortError, State, Status};

/// A frequency as a person says it: `30 Hz`, `29.95 Hz`.
pub(super) struct Hertz(pub(super) Frequency);

impl fmt::Display for Hertz {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let centihertz = self.0.centihertz();
        match (centihertz / 100, centihertz % 100) {
            (whole, 0) => write!(f, "{whole} Hz"),
            (whole, part) if part % 10 == 0 => write!(f, "{whole}.{} Hz", part / 10),
            (whole, part) => write!(f, "{whole}.{part:02} Hz"),
        }
    }
}

/// A time as a person says it: `3.2 s`, `21 s`, `10 min 3 s`, `2 h 5 min`.
pub(super) struct Span(pub(super) Duration);

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tenths = self.0.as_millis() / 100;
        let seconds = tenths / 10;
        match seconds {
            0..10 => write!(f, "{seconds}.{} s", tenths % 10),
            10..120 => write!(f, "{seconds} s"),
            120..7_200 if seconds.is_multiple_of(60) => write!(f, "{} min", seconds / 60),
            120..7_200 => write!(f, "{} min {} s", seconds / 60, seconds % 60),
            _ => write!(f, "{} h {} min", seconds / 3_600, seconds / 60 % 60),
        }
    }
}

/// What a motor does: `running at 30 Hz`, `at standstill`, `tripped`.
pub(super) fn doing(status: &Status) -> String {
    let backwards = match status.direction {
        Some(drive_core::Direction::Reverse) => " in reverse",
        _ => "",
    };
    let at = status.output_frequency.map(|output| format!(" at {}", Hertz(output))).unwrap_or_default();
    match status.state {
        State::Fault | State::FaultReaction => "tripped".to_owned(),
        _ if status.is_standstill() => "at standstill".to_owned(),
        state if status.motion == Motion::Coasting => format!("{state}, the shaft may coast"),
        State::Running => format!("running{backwards}{at}"),
        state => format!("{state}{at}"),
    }
}

/// The same of a motor that has been lost: `at 30 Hz`, `at standstill`.
pub(super) fn left(status: &Status) -> String {
    match status.output_frequency {
        _ if status.is_fault() => "tripped".to_owned(),
        _ if status.is_standstill() => "at standstill".to_owned(),
        _ if status.is_undriven() => "with output off".to_owned(),
        Some(output) => format!("at {}", Hertz(output)),
        None => status.state.to_string(),
    }
}

/// Why a drive is lost, and for how long it had not been heard.
pub(super) fn cause(error: Option<&Error>, silent_for: Duration) -> String {
    let time = Span(silent_for);
    match error {
        None => format!("no status in time for {time}"),
        Some(Error::Port { problem: PortError::Timeout { .. } | PortError::Offline { .. }, .. }) => {
            format!("no answer for {time}")
        }
        Some(Error::Port { problem: PortError::Damaged(check), .. }) => {
            format!("only damaged answers ({check}) for {time}")
        }
        Some(Error::Port { problem, .. }) => format!("{problem}, for {time}"),
        Some(error) => format!("{error}, for {time}"),
    }
}

/// A fault, its mnemonic first: `SLF, serial link fault (code 10)`.
pub(super) fn fault(fault: &Fault) -> String {
    match fault.entry {
        Some(entry) => format!("{}, {} (code {})", entry.mnemonic, entry.meaning, fault.code),
        None => format!("code {}, {}", fault.code, fault.meaning()),
    }
}

/// Names with what is said of each; those of which the same is said stand together, and all of a line are not named.
pub(super) fn listed(drives: &[(Arc<str>, String)], of: usize) -> String {
    let mut alike: Vec<(&str, Vec<&str>)> = Vec::new();
    for (name, said) in drives {
        match alike.iter_mut().find(|(other, _)| other == said) {
            Some((_, names)) => names.push(name),
            None => alike.push((said, vec![name])),
        }
    }
    let groups = alike.iter().map(|(said, names)| {
        let names = if names.len() == of && of > 2 { format!("all {of}") } else { names.join(", ") };
        if said.is_empty() { names } else { format!("{names} {said}") }
    });
    groups.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_frequencies_are_as_a_person_says_them() {
        for (ms, said) in [
            (3_249, "3.2 s"),
            (21_900, "21 s"),
            (603_000, "10 min 3 s"),
            (600_000, "10 min"),
            (7_500_000, "2 h 5 min"),
        ] {
            assert_eq!(Span(Duration::from_millis(ms)).to_string(), said);
        }
        for (centihertz, said) in [(3_000, "30 Hz"), (2_995, "29.95 Hz"), (1_250, "12.5 Hz"), (0, "0 Hz")] {
            assert_eq!(Hertz(Frequency::from_centihertz(centihertz)).to_string(), said);
        }
    }

    #[test]
    fn drives_of_which_the_same_is_said_stand_together() {
        let drive = |name: &str, said: &str| (Arc::from(name), said.to_owned());
        let drives =
            [drive("pump 1", "at 30 Hz"), drive("pump 2", "at standstill"), drive("fan", "at 30 Hz")];
        assert_eq!(listed(&drives, 3), "pump 1, fan at 30 Hz; pump 2 at standstill");
        let drives = ["pump 1", "pump 2", "fan"].map(|name| drive(name, "lost"));
        assert_eq!(listed(&drives, 3), "all 3 lost");
        assert_eq!(listed(&drives, 4), "pump 1, pump 2, fan lost");
    }
}
