//! What waits in a queue while one of it is chosen, and when each could be sent. Whoever says when looks at much for it, so that he
//! is asked once, and only of what could be chosen.

use tokio::time::Instant;

use super::{Entry, Readiness};

/// What waits. `F` says when an entry could be sent.
pub(super) struct Waiting<'a, T, F> {
    queued: &'a [Entry<T>],
    known: Vec<Option<Readiness>>,
    readiness: F,
}

impl<'a, T, F: FnMut(&Entry<T>) -> Readiness> Waiting<'a, T, F> {
    /// `room`: what [`end`](Self::end) gave the last time.
    pub(super) fn new(queued: &'a [Entry<T>], mut room: Vec<Option<Readiness>>, readiness: F) -> Self {
        room.clear();
        room.resize(queued.len(), None);
        Self { queued, known: room, readiness }
    }

    /// Gives the room back.
    pub(super) fn end(self) -> Vec<Option<Readiness>> {
        self.known
    }

    /// When this one could be sent, and for how long. `None`: there is none.
    pub(super) fn of(&mut self, index: usize) -> Option<Readiness> {
        let (entry, known) = (self.queued.get(index)?, self.known.get_mut(index)?);
        Some(*known.get_or_insert_with(|| (self.readiness)(entry)))
    }

    /// The first, by `order`, of those that have one and can be sent at `now`. Of what comes behind one of these nobody is asked.
    pub(super) fn first<O: Ord>(
        &mut self,
        now: Instant,
        order: impl Fn(&Entry<T>) -> Option<O>,
    ) -> Option<usize> {
        let mut first: Option<(O, usize)> = None;
        let queued = self.queued;
        for (index, entry) in queued.iter().enumerate() {
            let Some(order) = order(entry) else { continue };
            let is_before = first.as_ref().is_none_or(|(first, _)| order < *first);
            if is_before && self.of(index).is_some_and(|readiness| readiness.at <= now) {
                first = Some((order, index));
            }
        }
        first.map(|(_, index)| index)
    }

    /// When the first can be sent of those that `which` names.
    pub(super) fn soonest(
        &mut self,
        which: impl Fn(&Entry<T>) -> bool,
        and: impl Fn(Readiness) -> bool,
    ) -> Option<Instant> {
        let queued = self.queued;
        let named = queued.iter().enumerate().filter(|(_, entry)| which(entry));
        named.filter_map(|(index, _)| self.of(index)).filter(|of| and(*of)).map(|of| of.at).min()
    }
}
