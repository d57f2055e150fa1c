//! What a drive does, in the one word with which every face begins its row: [`Shows`].

use drive_core::State;

use crate::snapshot::{Link, PendingStop, Snapshot};

/// What a drive does, in one word. Who is lost is lost, whatever it showed last; a stop that is on its way stands before
/// the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub enum Shows {
    /// It has not answered yet.
    Connecting,
    /// It has answered and does not any more.
    Lost,
    /// A stop of it is not confirmed.
    StopPending,
    /// [`State::NotReady`].
    NotReady,
    /// [`State::Disabled`].
    Disabled,
    /// [`State::Ready`].
    Ready,
    /// [`State::Running`].
    Running,
    /// [`State::Stopping`].
    Stopping,
    /// [`State::QuickStop`].
    QuickStop,
    /// [`State::FaultReaction`].
    FaultReaction,
    /// [`State::Fault`].
    Fault,
    /// Its words are none that its manual explains, or it is told in one that this program does not know.
    #[default]
    #[cfg_attr(feature = "serde", serde(other))]
    Unknown,
}

drive_core::named! { Shows {
    Connecting => "connecting",
    Lost => "lost",
    StopPending => "stop pending",
    NotReady => "not ready",
    Disabled => "disabled",
    Ready => "ready",
    Running => "running",
    Stopping => "stopping",
    QuickStop => "quick stop",
    FaultReaction => "fault reaction",
    Fault => "fault",
    Unknown => "unknown",
} }

impl Shows {
    /// Whether it is said by the drive's own words, and not by that they are missing.
    #[must_use]
    pub const fn is_of_the_drive(self) -> bool {
        !matches!(self, Self::Connecting | Self::Lost)
    }

    pub(crate) fn of(link: Link, stop: Option<&PendingStop>, state: Option<State>) -> Self {
        match (link, stop, state) {
            (Link::Connecting, ..) => Self::Connecting,
            (Link::Lost, ..) => Self::Lost,
            (Link::Connected, Some(_), _) => Self::StopPending,
            (Link::Connected, None, state) => state.map_or(Self::Unknown, Self::from),
        }
    }
}

impl From<State> for Shows {
    fn from(state: State) -> Self {
        match state {
            State::NotReady => Self::NotReady,
            State::Disabled => Self::Disabled,
            State::Ready => Self::Ready,
            State::Running => Self::Running,
            State::Stopping => Self::Stopping,
            State::QuickStop => Self::QuickStop,
            State::FaultReaction => Self::FaultReaction,
            State::Fault => Self::Fault,
            State::Unknown => Self::Unknown,
        }
    }
}

impl Snapshot {
    /// What the drive does, in one word; it may be old.
    #[must_use]
    pub fn shows(&self) -> Shows {
        Shows::of(self.link, self.stop.as_ref(), self.status.as_ref().map(|status| status.value.state))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_has_the_word_that_it_has_everywhere() {
        let states = [
            State::NotReady,
            State::Disabled,
            State::Ready,
            State::Running,
            State::Stopping,
            State::QuickStop,
            State::FaultReaction,
            State::Fault,
            State::Unknown,
        ];
        for state in states {
            assert_eq!(Shows::from(state).to_string(), state.to_string());
            assert!(Shows::ALL.contains(&Shows::from(state)));
        }
    }

    #[test]
    fn who_is_lost_is_lost_whatever_it_showed_last_and_whatever_was_asked_of_it() {
        let now = tokio::time::Instant::now();
        let stop = PendingStop {
            mode: drive_core::StopMode::Ramp,
            since: now,
            attempts: 1,
            taken: false,
            alarm: true,
            undone: 0,
        };
        let running = Some(State::Running);
        assert_eq!(Shows::of(Link::Lost, Some(&stop), running), Shows::Lost);
        assert_eq!(Shows::of(Link::Connected, Some(&stop), running), Shows::StopPending);
        assert_eq!(Shows::of(Link::Connected, None, running), Shows::Running);
        assert_eq!(Shows::of(Link::Connecting, None, None), Shows::Connecting);
        assert_eq!(Shows::of(Link::Connected, None, None), Shows::Unknown);
    }
}
