//! `[groups]`: drives that are commanded together.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::place::{ConfigError, Source};

/// The section as it is written: the names of the drives by the name of their group.
pub type Entries = BTreeMap<Spanned<String>, Vec<Spanned<String>>>;

/// Drives that are commanded together, in the order in which they start.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Group {
    pub name: String,
    pub drives: Vec<String>,
}

/// The groups of a file whose drives are these.
pub fn groups<'a>(
    source: Source<'_>,
    entries: Option<&Entries>,
    drives: impl Iterator<Item = &'a str> + Clone,
) -> Result<Vec<Group>, ConfigError> {
    let group = |(name, members): (&Spanned<String>, &Vec<Spanned<String>>)| {
        let text = name.get_ref();
        let refuse = |span, problem: String| Err(source.error(span, problem));
        if text.trim().is_empty() || text.chars().any(char::is_control) {
            let problem = "expected a name without control characters for the group";
            return refuse(name.span(), problem.to_owned());
        }
        if drives.clone().any(|drive| drive == text) {
            return refuse(name.span(), format!("{text:?} is a drive too: expected another name"));
        }
        if members.is_empty() {
            return refuse(name.span(), format!("group {text:?} has no drive: expected the names of some"));
        }
        for (number, member) in members.iter().enumerate() {
            let drive = member.get_ref();
            if !drives.clone().any(|known| known == drive) {
                return refuse(member.span(), format!("there is no drive {drive:?}: expected a name of one"));
            }
            if members.iter().take(number).any(|other| other.get_ref() == drive) {
                return refuse(member.span(), format!("drive {drive:?} is in this group twice"));
            }
        }
        let drives = members.iter().map(|member| member.get_ref().clone()).collect();
        Ok(Group { name: text.clone(), drives })
    };
    entries.into_iter().flatten().map(group).collect()
}
