//! What holds now, as far as the first hour at the page asks.

use std::path::{Path, PathBuf};

use drive_bus::Endpoint;

use drived_config::config::{DrivePart, LinePart};
use drived_file::{Config, added::Added};
use drived_http::api::setup::{AddedView, Closed};

/// What holds now, as far as the first hour asks.
pub(super) struct Here {
    pub(super) configuration: PathBuf,
    pub(super) added: Option<Added>,
    /// Why nothing is added.
    pub(super) closed: Option<Closed>,
    /// The lines, and where they go.
    pub(super) lines: Vec<(String, Endpoint)>,
    /// The drives that were added.
    pub(super) drives: Vec<AddedView>,
}

impl Here {
    pub(super) fn of(configuration: &Path, config: &Config) -> Self {
        let added = config.added.clone();
        let is_aside = added.as_ref().is_some_and(|added| added.is_aside);
        let is_added = added.as_ref().is_some_and(|added| !added.is_aside && added.text.is_some());
        let views = |line: &LinePart| {
            let line_name = line.name.clone();
            let view = move |drive: &DrivePart| AddedView {
                name: drive.settings.name.clone(),
                line: line_name.clone(),
                drive: drive.name.to_string(),
                guessed: drive.is_guess,
                control: drive.settings.control,
            };
            line.drives.iter().map(view).collect::<Vec<_>>()
        };
        Self {
            configuration: configuration.to_owned(),
            closed: closed(added.as_ref()),
            added,
            lines: config
                .lines
                .iter()
                .map(|line| (line.name.clone(), line.config.endpoint.clone()))
                .collect(),
            drives: match is_added && !is_aside {
                true => config.lines.iter().flat_map(views).collect(),
                false => Vec::new(),
            },
        }
    }
}

/// Why nothing can be added at the page; `None`: it can.
pub(super) fn closed(added: Option<&Added>) -> Option<Closed> {
    match added {
        None => Some(Closed::NoFolder),
        Some(added) if added.is_aside => Some(Closed::OwnDrives),
        Some(_) => None,
    }
}

/// The same in words.
pub(super) fn why(closed: Closed, configuration: &Path) -> String {
    let configuration = configuration.display();
    match closed {
        Closed::NoFolder => format!(
            "nothing can be kept: expected state = \"FOLDER\" in {configuration}, or a home folder of this user"
        ),
        Closed::OwnDrives => format!(
            "{configuration} has lines and drives of its own, and then it alone holds: add what is found to it, then drived reload"
        ),
    }
}
