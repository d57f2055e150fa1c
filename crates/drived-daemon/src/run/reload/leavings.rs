//! What is left of drives that were taken out, for when they are taken up again.

use drive_fleet::{DriveHandle, Left, Place};
use drived_plant::plant::{Plant, watched::Watch};

use crate::run::kept::Kept;

/// What is left of a drive that is not in the fleet any more.
pub(super) struct Leaving {
    pub(super) place: Place,
    left: Left,
    /// Over who has started its motor, where that was left turning.
    watch: Option<Watch>,
}

impl Leaving {
    pub(super) fn of(plant: &Plant, drive: &DriveHandle) -> Self {
        let (left, place) = (drive.left(), drive.place().clone());
        let watch = plant.watched().take(&place);
        let watch = watch.filter(|_| left.run.as_ref().is_some_and(|run| run.lease.is_some()));
        Self { place, left, watch }
    }
}

/// What is left of drives that are not in the fleet any more, for when they are taken up again, by whatever name.
pub(super) type Leavings = Vec<Leaving>;

/// Takes what is left of the drive at a place, which is called so now: by this run, or by one before it, in whose configuration it was.
pub(super) fn taken(leavings: &mut Leavings, kept: &Kept, plant: &Plant, place: &Place, name: &str) -> Left {
    let at = leavings.iter().position(|leaving| leaving.place == *place);
    let Some(Leaving { left, watch, .. }) = at.map(|at| leavings.swap_remove(at)) else {
        if kept.runs(place) {
            plant.watched().put_kept(place, name);
        }
        // Whoever comes to a place has what was kept there: it is nobody's no more.
        kept.runs.call(place, name);
        return kept.of(place);
    };
    if let Some(watch) = watch {
        plant.watched().put(place, name, watch);
    }
    left
}
