//! By which profile each drive is driven: written to the audit log at each connect, and compared with its file.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use drive_families::Family;
use drive_fleet::{EventKind, Events, Received};

use drived_config::{config::LinePart, profiles};
use drived_doors::audit::{Audit, Kind, Record};
use drived_plant::plant::{Plant, views::NoticeView};

/// The profiles with which the drives were opened, by the drives' names. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub(super) struct Opened(Arc<Mutex<HashMap<String, Family>>>);

impl Opened {
    /// The drives of these lines, of which those of a family from no file are left out.
    pub(super) fn tell(&self, lines: &[LinePart]) {
        let drives = lines.iter().flat_map(|line| &line.drives);
        let drives = drives.map(|drive| (drive.settings.name.clone(), drive.name.family));
        let from_files = drives.filter(|(_, family)| family.revision().is_some()).collect();
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = from_files;
    }

    fn of(&self, drive: &str) -> Option<Family> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get(drive).copied()
    }

    /// Writes at each connect which profile a drive has, and tells where its file says something else by now.
    pub(super) async fn follow(self, plant: Plant, audit: Audit, mut events: Events) {
        loop {
            let event = match events.recv().await {
                Received::Event(event) => event,
                Received::Missed(_) => continue,
                Received::End => return,
            };
            let EventKind::Connected(_) = event.kind else { continue };
            let Some(family) = self.of(&event.drive) else { continue };
            // A disk may take its time.
            let changed = tokio::task::spawn_blocking(move || profiles::changed(family)).await;
            let changed = changed.ok().flatten();
            audit
                .record(Record::of_program(
                    Kind::Configuration,
                    said(&event.drive, family, changed.as_deref()),
                ))
                .whenever();
            if let Some(changed) = changed {
                plant.tell_notice(NoticeView::new("profile", false, format!("{}: {changed}", event.drive)));
            }
        }
    }
}

/// What the audit log says of a drive that has connected.
fn said(drive: &str, family: Family, changed: Option<&str>) -> String {
    let revision = family.revision().unwrap_or_default();
    let changed = changed.map(|changed| format!("; {changed}")).unwrap_or_default();
    format!("{drive}: connected, driven by the profile {family} {revision}{changed}")
}
