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
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    open: Vec<(&'static str, Box<dyn Open>)>,
    /// The daemon ends: nothing is opened any more.
    ending: bool,
}

/// Faces for which everything has been found.
pub(super) type Openings = Vec<(&'static str, Opening)>;

/// Finds what these faces of a configuration need.
pub(super) fn prepare(config: &Config, wanted: impl Fn(&str) -> bool) -> Result<Openings, Failure> {
    let wanted = config.faces.iter().filter(|(table, _)| wanted(table));
    wanted.map(|(table, face)| Ok((*table, face.prepare()?))).collect()
}

impl Faces {
    pub(super) fn open(openings: Openings, around: Surroundings) -> Self {
        let faces = Self(Arc::new(Inner { around, state: Mutex::default() }));
        faces.open_all(openings);
        faces
    }

    fn open_all(&self, openings: Openings) {
        let mut state = self.state();
        if !state.ending {
            let open = |(table, opening): (_, Opening)| (table, opening(&self.0.around));
            state.open.extend(openings.into_iter().map(open));
        }
    }

    /// Closes these faces, and opens others in their places.
    pub(super) async fn exchange(&self, gone: &[&str], openings: Openings) {
        let closing: Vec<_> = self.state().open.extract_if(.., |(table, _)| gone.contains(table)).collect();
        closing.iter().for_each(|(_, face)| face.closing());
        join_all(closing.into_iter().map(|(_, face)| face.close())).await;
        self.open_all(openings);
    }

    /// Says in the log what each has counted.
    pub(super) fn tell(&self) {
        self.state().open.iter().for_each(|(_, face)| face.tell());
    }

    /// The end has begun.
    pub(super) fn closing(&self) {
        let mut state = self.state();
        state.ending = true;
        state.open.iter().for_each(|(_, face)| face.closing());
    }

    /// Ends them all.
    pub(super) async fn close(&self) {
        let open = std::mem::take(&mut self.state().open);
        join_all(open.into_iter().map(|(_, face)| face.close())).await;
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Source for Faces {
    fn collect(&self, samples: &mut Samples) {
        self.state().open.iter().for_each(|(_, face)| face.collect(samples));
    }
}
