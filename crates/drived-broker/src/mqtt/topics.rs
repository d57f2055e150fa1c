//! The topics: `<base>/status`, `<base>/line/<id>`, `<base>/drive/<id>/…`, `<base>/group/<id>/…`, `<base>/all/…`, `<base>/alarms`.

use drived_config::names::{Kind, Names, topic_id};

use crate::broker::config::MqttConfig;
use drived_plant::plant::alarms::Owner;

/// What asks for something: the last levels before the commander.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verb {
    /// JSON, as the API has it, with `action`.
    Command,
    /// Any payload stops; one that names a mode, by that.
    Stop,
    /// `forward`, `reverse` or `stop`.
    Run,
    /// Hertz.
    Frequency,
    /// Revolutions per minute.
    Speed,
    Reset,
    Release,
}

impl Verb {
    const ALL: [(Self, &'static str); 7] = [
        (Self::Command, "command"),
        (Self::Stop, "stop"),
        (Self::Run, "set/run"),
        (Self::Frequency, "set/frequency"),
        (Self::Speed, "set/speed"),
        (Self::Reset, "reset"),
        (Self::Release, "release"),
    ];

    const fn levels(self) -> &'static str {
        let mut at = 0;
        while at < Self::ALL.len() {
            if Self::ALL[at].0 as u8 == self as u8 {
                return Self::ALL[at].1;
            }
            at += 1;
        }
        ""
    }
}

/// Whom a topic means, by the id that stands in it.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Meant {
    Drive(String),
    Group(String),
    All,
}

/// A topic that asks for something.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Asking {
    pub(super) meant: Meant,
    pub(super) verb: Verb,
    /// The last level, where it names who asks.
    pub(super) commander: Option<String>,
}

/// What stands at the broker in the daemon's own name, where it is read back.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Standing {
    Daemon,
    /// Of the drive of this id: whether it is there.
    Drive(String),
    /// Of the line of this id.
    Line(String),
    /// For Home Assistant.
    Document,
}

/// The topics of a daemon.
#[derive(Debug, Clone)]
pub(super) struct Topics {
    base: String,
    prefix: String,
    names: Names,
}

impl Topics {
    pub(super) fn new(config: &MqttConfig, names: Names) -> Self {
        Self { base: config.base.clone(), prefix: config.discovery_prefix.clone(), names }
    }

    /// By which something is known in topics and to Home Assistant.
    pub(super) fn id(&self, kind: Kind, name: &str) -> String {
        self.names.topic(kind, name)
    }

    /// Why nobody can say for certain whom a topic means that is not the name itself; `None`: everybody has the one that he had.
    pub(super) fn problem(&self) -> Option<String> {
        self.names.problem()
    }

    /// Whether something that is configured has this id.
    pub(super) fn has(&self, kind: Kind, id: &str) -> bool {
        self.names.has(kind, id)
    }

    /// Whether the daemon is there.
    pub(super) fn status(&self) -> String {
        format!("{}/status", self.base)
    }

    /// What the daemon says to itself, so that it knows how late the broker is.
    pub(super) fn echo(&self) -> String {
        format!("{}/echo", self.base)
    }

    pub(super) fn daemon(&self) -> String {
        format!("{}/daemon", self.base)
    }

    /// How the audit log ends.
    pub(super) fn audit(&self) -> String {
        format!("{}/audit", self.base)
    }

    pub(super) fn line(&self, name: &str) -> String {
        self.line_of(&self.id(Kind::Line, name))
    }

    /// The same of the line of an id.
    pub(super) fn line_of(&self, id: &str) -> String {
        format!("{}/line/{id}", self.base)
    }

    /// Something of a drive.
    pub(super) fn drive(&self, name: &str, what: &str) -> String {
        self.drive_of(&self.id(Kind::Drive, name), what)
    }

    /// The same of the drive of an id.
    pub(super) fn drive_of(&self, id: &str, what: &str) -> String {
        format!("{}/drive/{id}/{what}", self.base)
    }

    /// All alarms of somebody.
    pub(super) fn alarms(&self, owner: &Owner) -> String {
        self.of_owner(owner, "alarms")
    }

    /// An alarm of somebody that has come, as it comes.
    pub(super) fn alarm(&self, owner: &Owner) -> String {
        self.of_owner(owner, "alarm")
    }

    fn of_owner(&self, owner: &Owner, what: &str) -> String {
        match owner {
            Owner::Program => format!("{}/{what}", self.base),
            Owner::Line(name) => format!("{}/{what}", self.line(name)),
            Owner::Drive(name) => self.drive(name, what),
        }
    }

    /// Where somebody of this name asks that something is done with alarms.
    pub(super) fn asking_of_alarms(&self, commander: Option<&str>) -> String {
        let commander = commander.map(|name| format!("/{name}")).unwrap_or_default();
        format!("{}/alarms/command{commander}", self.base)
    }

    /// Where it is told what was done with alarms.
    pub(super) fn alarms_outcome(&self) -> String {
        format!("{}/alarms/outcome", self.base)
    }

    /// Who asks by a topic that something is done with alarms; `None`: it asks for nothing of that.
    pub(super) fn asked_of_alarms(&self, topic: &str) -> Option<Option<String>> {
        match topic.strip_prefix(&self.asking_of_alarms(None))? {
            "" => Some(None),
            commander => Some(Some(commander.strip_prefix('/').filter(|name| is_name(name))?.to_owned())),
        }
    }

    /// Where it is told what became of commands.
    pub(super) fn outcome(&self, meant: &Meant) -> String {
        match meant {
            Meant::Drive(id) => format!("{}/drive/{id}/outcome", self.base),
            Meant::Group(id) => format!("{}/group/{id}/outcome", self.base),
            Meant::All => format!("{}/all/outcome", self.base),
        }
    }

    /// Where somebody of this name asks for something.
    pub(super) fn asking(&self, meant: &Meant, verb: Verb, commander: Option<&str>) -> String {
        let base = &self.base;
        let whom = match meant {
            Meant::Drive(id) => format!("drive/{id}"),
            Meant::Group(id) => format!("group/{id}"),
            Meant::All => "all".to_owned(),
        };
        let commander = commander.map(|name| format!("/{name}")).unwrap_or_default();
        format!("{base}/{whom}/{}{commander}", verb.levels())
    }

    /// What a topic asks for, and of whom; `None` where it asks for nothing.
    pub(super) fn asked(&self, topic: &str) -> Option<Asking> {
        let rest = topic.strip_prefix(&self.base)?.strip_prefix('/')?;
        let (kind, rest) = rest.split_once('/')?;
        let (meant, rest) = match kind {
            "all" => (Meant::All, rest),
            "drive" | "group" => {
                let (id, rest) = rest.split_once('/')?;
                let id = Some(id.to_owned()).filter(|id| !id.is_empty() && topic_id(id) == *id)?;
                (if kind == "drive" { Meant::Drive(id) } else { Meant::Group(id) }, rest)
            }
            _ => return None,
        };
        Verb::ALL.into_iter().find_map(|(verb, levels)| {
            let commander = match rest.strip_prefix(levels)? {
                "" => None,
                commander => Some(commander.strip_prefix('/')?.to_owned()),
            };
            let named = commander.as_deref().is_none_or(is_name);
            named.then(|| Asking { meant: meant.clone(), verb, commander })
        })
    }

    /// The filters for every topic that may ask for something.
    pub(super) fn command_filters(&self) -> Vec<String> {
        let whom = ["drive/+", "group/+", "all"];
        let what = ["command", "stop", "set", "reset", "release"];
        let filter = |whom| what.into_iter().map(move |what| format!("{}/{whom}/{what}/#", self.base));
        let alarms = format!("{}/#", self.asking_of_alarms(None));
        whom.into_iter().flat_map(filter).chain([alarms]).collect()
    }

    /// Where Home Assistant says that it has begun.
    pub(super) fn birth(&self) -> String {
        format!("{}/status", self.prefix)
    }

    /// Where Home Assistant looks for something.
    pub(super) fn discovery(&self, levels: &str) -> String {
        format!("{}/{levels}/config", self.prefix)
    }

    /// Where Home Assistant looks for a device, in both forms.
    pub(super) fn documents(&self, device: &str) -> [String; 2] {
        [self.discovery(&format!("device/{device}")), self.discovery(&format!("+/{device}/+"))]
    }

    /// What stands at a topic; `None`: nothing that is read back.
    pub(super) fn standing(&self, topic: &str) -> Option<Standing> {
        let below = |levels: &str| topic.strip_prefix(levels)?.strip_prefix('/');
        let is_id = |id: &&str| !id.is_empty() && topic_id(id) == **id;
        if let Some(rest) = below(&self.base) {
            let line = rest.strip_prefix("line/").filter(is_id);
            let drive = rest.strip_prefix("drive/").and_then(|rest| rest.strip_suffix("/availability"));
            let drive = drive.filter(is_id).map(|id| Standing::Drive(id.to_owned()));
            let daemon = (rest == "daemon").then_some(Standing::Daemon);
            return drive.or_else(|| line.map(|id| Standing::Line(id.to_owned()))).or(daemon);
        }
        below(&self.prefix)?.ends_with("/config").then_some(Standing::Document)
    }

    /// The id of this daemon at Home Assistant.
    pub(super) fn node(&self) -> String {
        topic_id(&self.base)
    }

    /// Whether an answer may go to this topic: not where it would be taken for something that this daemon tells or is
    /// asked.
    pub(super) fn is_foreign(&self, topic: &str) -> bool {
        let below = |levels: &str| topic.strip_prefix(levels).is_some_and(|rest| rest.starts_with('/'));
        let is_topic = !topic.is_empty() && topic.len() <= 1_024 && !topic.contains(['+', '#', '\0']);
        is_topic && !topic.starts_with('$') && !below(&self.base) && !below(&self.prefix) && !below("spBv1.0")
    }
}

/// Whether a level may name a commander.
fn is_name(name: &str) -> bool {
    !name.is_empty() && topic_id(name) == name
}

/// Whether a message to this topic is taken also in a flood: a stop, whatever it says, and what the daemon says to itself.
pub(super) fn is_urgent(topic: &str) -> bool {
    topic.rsplit('/').take(2).any(|level| level == "stop") || topic.ends_with("/echo")
}
