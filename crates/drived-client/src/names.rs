//! The names of a plant's drives and groups, as a person writes them.

use drived_plant::plant::views::{DriveView, StateView};
use drived_words::failure::Failure;

/// How many near names are told to somebody who has missed one.
const NEAREST: usize = 3;

/// What a name means.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    Drive(String),
    Group(String),
    /// Every drive.
    All,
}

impl Target {
    /// What a name means in a plant whose state this is; a drive comes before a group of its name.
    pub fn find(state: &StateView, name: &str) -> Result<Self, Failure> {
        if state.drives.iter().any(|drive| drive.name() == name) {
            return Ok(Self::Drive(name.to_owned()));
        }
        if state.groups.iter().any(|group| group.name == name) {
            return Ok(Self::Group(name.to_owned()));
        }
        let drives = state.drives.iter().map(DriveView::name);
        let all = drives.chain(state.groups.iter().map(|group| group.name.as_str()));
        let near = nearest(name, all.map(str::to_owned).collect());
        let near = if near.is_empty() { "the daemon has none".to_owned() } else { near.join(", ") };
        Err(Failure::Input(format!("there is no drive and no group {name:?}: the nearest are {near}")))
    }

    /// Where its commands go.
    pub fn path(&self, action: &str) -> String {
        match self {
            Self::Drive(name) => path_of(&["drives", name, action]),
            Self::Group(name) => path_of(&["groups", name, action]),
            Self::All => path_of(&[action]),
        }
    }

    /// Whether a drive of the state belongs to it.
    pub fn has(&self, state: &StateView, drive: &str) -> bool {
        match self {
            Self::All => true,
            Self::Drive(name) => name == drive,
            Self::Group(name) => {
                let group = state.groups.iter().find(|group| group.name == *name);
                group.is_some_and(|group| group.drives.iter().any(|member| member == drive))
            }
        }
    }
}

/// The drives that these names mean: drives, groups and lines; all where none is named.
///
/// # Errors
/// There is none of such a name.
pub fn wanted<'a>(state: &'a StateView, names: &[String]) -> Result<Vec<&'a DriveView>, Failure> {
    let mut wanted: Vec<bool> = vec![names.is_empty(); state.drives.len()];
    for name in names {
        let is_line = state.drives.iter().any(|drive| drive.line == *name);
        let target = match Target::find(state, name) {
            Ok(target) => Some(target),
            Err(_) if is_line => None,
            Err(failure) => return Err(failure),
        };
        for (wanted, drive) in wanted.iter_mut().zip(&state.drives) {
            *wanted |= match &target {
                Some(target) => target.has(state, drive.name()),
                None => drive.line == *name,
            };
        }
    }
    Ok(wanted.iter().zip(&state.drives).filter(|(wanted, _)| **wanted).map(|(_, drive)| drive).collect())
}

/// A path of the API; each part may be any text.
pub fn path_of(parts: &[&str]) -> String {
    let mut path = "/api/v1".to_owned();
    for part in parts {
        path.push('/');
        for byte in part.bytes() {
            match byte {
                b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' => {
                    path.push(char::from(byte));
                }
                _ => path.push_str(&format!("%{byte:02X}")),
            }
        }
    }
    path
}

/// The names that are fewest changes away from this one.
fn nearest(wanted: &str, names: Vec<String>) -> Vec<String> {
    let wanted = wanted.to_lowercase();
    let mut near: Vec<(usize, String)> =
        names.into_iter().map(|name| (distance(&wanted, &name.to_lowercase()), name)).collect();
    near.sort();
    near.into_iter().take(NEAREST).map(|(_, name)| name).collect()
}

/// How many characters have to be changed, added or taken out to make one text of another.
fn distance(one: &str, other: &str) -> usize {
    let other: Vec<char> = other.chars().collect();
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (index, character) in one.chars().enumerate() {
        let mut diagonal = index;
        let mut left = index + 1;
        for (column, against) in other.iter().enumerate() {
            let above = row.get(column + 1).copied().unwrap_or_default();
            let best = (diagonal + usize::from(character != *against)).min(above + 1).min(left + 1);
            if let Some(first) = row.get_mut(column) {
                *first = left;
            }
            (diagonal, left) = (above, best);
        }
        if let Some(last) = row.last_mut() {
            *last = left;
        }
    }
    row.last().copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use drived_plant::plant::{testing::told, views::GroupView};

    #[test]
    fn a_name_that_is_not_there_is_answered_with_the_nearest() {
        let drive = |name: &str| serde_json::from_value(told(name)).unwrap();
        let state = StateView {
            drives: ["pump 1", "pump 2", "fan 1", "stirrer"].map(drive).into(),
            groups: vec![GroupView {
                name: "fans".to_owned(),
                known_as: Default::default(),
                drives: vec!["fan 1".to_owned()],
            }],
            ..StateView::default()
        };
        assert_eq!(Target::find(&state, "pump 1"), Ok(Target::Drive("pump 1".to_owned())));
        let fans = Target::find(&state, "fans").unwrap();
        assert!(fans.has(&state, "fan 1") && !fans.has(&state, "pump 1"));
        let error = Target::find(&state, "Pmp 1").unwrap_err();
        let told = "there is no drive and no group \"Pmp 1\": the nearest are pump 1, pump 2, fan 1";
        assert_eq!(error, Failure::Input(told.to_owned()));
    }

    #[test]
    fn distances_count_changes() {
        for (one, other, changes) in [
            ("", "", 0),
            ("pump", "pump", 0),
            ("", "abc", 3),
            ("pump 1", "pump 2", 1),
            ("kitten", "sitting", 3),
        ] {
            assert_eq!(distance(one, other), changes, "{one} {other}");
            assert_eq!(distance(other, one), changes, "{other} {one}");
        }
    }

    #[test]
    fn any_name_stands_in_a_path() {
        assert_eq!(Target::Drive("pump 1".to_owned()).path("stop"), "/api/v1/drives/pump%201/stop");
        assert_eq!(
            Target::Group("Lüfter/?#".to_owned()).path("start"),
            "/api/v1/groups/L%C3%BCfter%2F%3F%23/start"
        );
        assert_eq!(Target::All.path("stop"), "/api/v1/stop");
    }
}
