//! The faces that are open, and how one is exchanged while the daemon runs.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use drived_face::{Open, Opening, Surroundings};
use drived_file::Config;
use drived_plant::counts::{Samples, Source};
use drived_words::failure::Failure;
use futures_util::future::join_all;

/// The open faces, by the names of their tables. Cheap to clone.
#[derive(Clone)]
pub(super) struct Faces(Arc<Inner>);

struct Inner {
    around: Surroundings,
    open: Mutex<AreOpen>,
}

type AreOpen = Vec<(&'static str, Box<dyn Open>)>;

/// Faces for which everything has been found.
pub(super) type Openings = Vec<(&'static str, Opening)>;

/// Finds what these faces of a configuration need.
pub(super) fn prepare(config: &Config, wanted: impl Fn(&str) -> bool) -> Result<Openings, Failure> {
    let wanted = config.faces.iter().filter(|(table, _)| wanted(table));
    wanted.map(|(table, face)| Ok((*table, face.prepare()?))).collect()
}

impl Faces {
    pub(super) fn open(openings: Openings, around: Surroundings) -> Self {
        let faces = Self(Arc::new(Inner { around, open: Mutex::default() }));
        faces.open_all(openings);
        faces
    }

    fn open_all(&self, openings: Openings) {
        let mut are_open = self.are_open();
        if !self.0.around.plant.is_closing() {
            let open = |(table, opening): (_, Opening)| (table, opening(&self.0.around));
            are_open.extend(openings.into_iter().map(open));
        }
    }

    /// Closes these faces, and opens others in their places.
    pub(super) async fn exchange(&self, gone: &[&str], openings: Openings) {
        let closing: Vec<_> = self.are_open().extract_if(.., |(table, _)| gone.contains(table)).collect();
        join_all(closing.into_iter().map(|(_, face)| face.close())).await;
        self.open_all(openings);
    }

    /// Says in the log what each has counted.
    pub(super) fn tell(&self) {
        self.are_open().iter().for_each(|(_, face)| face.tell());
    }

    /// Ends them all, once the [plant is closing](drived_plant::plant::Plant::close).
    pub(super) async fn close(&self) {
        let open = std::mem::take(&mut *self.are_open());
        join_all(open.into_iter().map(|(_, face)| face.close())).await;
    }

    fn are_open(&self) -> MutexGuard<'_, AreOpen> {
        self.0.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Source for Faces {
    fn collect(&self, samples: &mut Samples) {
        self.are_open().iter().for_each(|(_, face)| face.collect(samples));
    }
}
