//! Who asks, and what he may do.

use std::{fmt, future::pending, pin::Pin, sync::Arc};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::config::Group;

/// Whoever a request comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Caller {
    /// The token's name, `local` on the socket, `anonymous` without either.
    pub name: String,
    /// From where: `page 127.0.0.1`, `http 10.0.0.7`, `socket uid 1000`.
    pub origin: String,
    pub rights: Rights,
    /// Which drives he may command; all of them where it is not said.
    pub scope: Option<Scope>,
    /// For how long he is heard.
    pub heard: Heard,
}

impl Caller {
    /// Somebody who may do this with every drive.
    pub fn new(name: impl Into<String>, origin: impl Into<String>, rights: Rights) -> Self {
        Self { name: name.into(), origin: origin.into(), rights, scope: None, heard: Heard::default() }
    }

    /// Whether he may command this drive of a plant with these groups, as far as his rights go. Whoever may stop, may stop
    /// every drive: this is not asked then.
    pub fn may_command(&self, drive: &str, groups: &[Group]) -> bool {
        self.scope.as_ref().is_none_or(|scope| scope.has(drive, groups))
    }
}

/// For how long whoever asks is heard: until that by which he was let in holds no more, or the connection has gone without which nobody hears what
/// becomes of it. By default for ever.
#[derive(Clone, Default)]
pub struct Heard(Option<Arc<dyn Fn() -> End + Send + Sync>>);

type End = Pin<Box<dyn Future<Output = ()> + Send>>;

impl Heard {
    /// Until one of these futures is over, of which each who waits for the end gets his own.
    pub fn until<F: Future<Output = ()> + Send + 'static>(
        end: impl Fn() -> F + Send + Sync + 'static,
    ) -> Self {
        Self(Some(Arc::new(move || Box::pin(end()))))
    }

    /// Waits until he is not heard any more. Safe to drop.
    pub async fn ends(&self) {
        match &self.0 {
            Some(end) => end().await,
            None => pending().await,
        }
    }
}

/// Who somebody is does not depend on it.
impl PartialEq for Heard {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Eq for Heard {}

impl fmt::Debug for Heard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "for a while" } else { "for ever" })
    }
}

/// The drives that a token is for, by their names and by those of their groups. It keeps nobody from a stop.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scope {
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub drives: Vec<String>,
    /// Whoever belongs to one of these groups at the time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<String>,
}

impl Scope {
    /// These drives and groups; `None`, which is every drive, where there are none.
    pub fn of(drives: Vec<String>, groups: Vec<String>) -> Option<Self> {
        (!drives.is_empty() || !groups.is_empty()).then_some(Self { drives, groups })
    }

    fn has(&self, drive: &str, groups: &[Group]) -> bool {
        let is_in =
            |group: &Group| self.groups.contains(&group.name) && group.drives.iter().any(|one| one == drive);
        self.drives.iter().any(|one| one == drive) || groups.iter().any(is_in)
    }
}

impl fmt::Display for Scope {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let groups = self.groups.iter().map(|group| format!("group {group}"));
        f.write_str(&self.drives.iter().cloned().chain(groups).collect::<Vec<_>>().join(", "))
    }
}

/// What a caller may do. A stop is a right of its own: it can be given where nothing else is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Rights {
    /// To see everything but secrets.
    pub view: bool,
    /// To stop motors.
    pub stop: bool,
    /// To start them, to give setpoints, to reset faults, to give control back.
    pub operate: bool,
    /// To write parameters and to reload the configuration.
    pub engineer: bool,
}

impl Rights {
    pub const NONE: Self = Self { view: false, stop: false, operate: false, engineer: false };
    pub const ALL: Self = Self { view: true, stop: true, operate: true, engineer: true };
}

/// What a token is given for; each has the rights of those before it.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema, clap::ValueEnum,
)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// To see everything
    View,
    /// Also to stop motors
    Stop,
    /// Also to start them, to give setpoints and to reset faults
    Operate,
    /// Also to write parameters and to reload the configuration
    Engineer,
}

impl Role {
    pub fn rights(self) -> Rights {
        Rights {
            view: true,
            stop: self >= Self::Stop,
            operate: self >= Self::Operate,
            engineer: self >= Self::Engineer,
        }
    }

    pub const fn name(self) -> &'static str {
        match self {
            Self::View => "view",
            Self::Stop => "stop",
            Self::Operate => "operate",
            Self::Engineer => "engineer",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_role_has_the_rights_of_those_before_it() {
        let rights = [Role::View, Role::Stop, Role::Operate, Role::Engineer].map(Role::rights);
        assert_eq!(rights[0], Rights { view: true, ..Rights::NONE });
        assert_eq!(rights[1], Rights { view: true, stop: true, ..Rights::NONE });
        assert_eq!(rights[2], Rights { engineer: false, ..Rights::ALL });
        assert_eq!(rights[3], Rights::ALL);
    }

    #[test]
    fn a_scope_is_of_drives_and_of_whoever_is_in_a_group_now() {
        let group = |drives: &[&str]| Group {
            name: "hall".to_owned(),
            drives: drives.iter().map(|drive| (*drive).to_owned()).collect(),
        };
        let scope = Scope::of(vec!["fan".to_owned()], vec!["hall".to_owned()]);
        let panel = Caller { scope, ..Caller::new("panel", "test", Role::Operate.rights()) };
        let may = |drive: &str, groups: &[Group]| panel.may_command(drive, groups);
        assert!(may("fan", &[]) && may("pump 1", &[group(&["pump 1"])]));
        assert!(!may("pump 1", &[group(&["pump 2"])]) && !may("hall", &[]) && !may("pump 1", &[]));
        assert!(Caller { scope: None, ..panel.clone() }.may_command("pump 1", &[]));
        assert_eq!(panel.scope.unwrap().to_string(), "fan, group hall");
        assert_eq!(Scope::of(Vec::new(), Vec::new()), None);
    }
}
