//! What a word does to the drive that was written to it.

use drive_core::Direction;

use super::{FAST, Machine, RAMP};
use crate::{format::Acts, written::Written};

impl Machine {
    /// A word as it is taken: without the bits of a command that the profile does not name.
    fn heard(&self, written: Written) -> Written {
        let named = self.named.get(&(written.space, written.address)).copied().unwrap_or(u16::MAX);
        Written { value: written.value & named, ..written }
    }

    /// What a word does that was written.
    pub(super) fn obey(&mut self, written: Written) {
        let written = self.heard(written);
        let profile = self.profile.clone();
        let file = profile.file();
        let writes = |action: &crate::format::Answer<crate::format::Spanned<crate::format::Action>>| {
            action.given().map(|action| file.writes(action.get_ref())).unwrap_or_default()
        };
        // The last write of a start starts it, where what else it writes stands by now: a direction of its own.
        let ends = |start| {
            let mut all = writes(start);
            let by_setpoint = start.given().is_some_and(|start| start.get_ref().starts_by_setpoint());
            // Whatever setpoint it is, with the sign of this start.
            if let Some(last) = all.last_mut().filter(|last| by_setpoint && alike(**last, written)) {
                *last = written;
            }
            all.last() == Some(&written) && all.iter().all(|of| self.stands(&all, *of))
        };
        // Of several coils that stop together each has to stand so.
        let stops = |stop| {
            let all = writes(stop);
            all.contains(&written) && all.iter().all(|of| self.stands(&all, *of))
        };
        if ends(&file.start.forward) {
            self.order = Some(Direction::Forward);
        } else if ends(&file.start.reverse) {
            self.order = Some(Direction::Reverse);
        } else if stops(&file.stop.freewheel) {
            self.order = None;
            self.motor.freewheel();
        } else if stops(&file.stop.fast) {
            (self.order, self.ramp) = (None, FAST);
        } else if stops(&file.stop.ramp) {
            (self.order, self.ramp) = (None, RAMP);
        } else if writes(&file.reset).contains(&written) || self.has_reset_bit(written) {
            (self.order, self.fault) = (None, None);
        } else if self.order.is_some()
            && file.command.given().is_some_and(|of| of.get_ref().acts == Acts::Level)
        {
            // A direction of its own acts at once on a motor that runs by a level.
            let stands = |start| {
                let all = writes(start);
                let is_its = all.iter().any(|of| (of.space, of.address) == (written.space, written.address));
                is_its && all.iter().all(|of| self.stands(&all, *of))
            };
            if stands(&file.start.forward) {
                self.order = Some(Direction::Forward);
            } else if stands(&file.start.reverse) {
                self.order = Some(Direction::Reverse);
            } else if self.run_word_ends(written) {
                (self.order, self.ramp) = (None, RAMP);
            }
        }
        // A run command that comes to a drive that has tripped or has no supply is lost.
        if self.fault.is_some() || !self.supplied || self.local {
            self.order = None;
        }
    }

    /// Whether a word of a command of bits has the bit that rises in a reset, whatever else it has: a direction, say.
    fn has_reset_bit(&self, written: Written) -> bool {
        let rises = self.profile.file().reset_bits();
        let at_place = |of: &&Written| (of.space, of.address) == (written.space, written.address);
        rises.iter().find(at_place).is_some_and(|rise| written.value & rise.value == rise.value)
    }

    /// Whether a word takes the place of the run word that stands, and is none.
    fn run_word_ends(&self, written: Written) -> bool {
        let file = self.profile.file();
        let start = self.order.and_then(|direction| self.profile.start(direction));
        let runs = start.into_iter().flat_map(|start| file.writes(start)).filter(|of| file.runs(*of));
        let is_its = runs.into_iter().any(|of| (of.space, of.address) == (written.space, written.address));
        is_its && !file.runs(written)
    }

    /// Whether what an action leaves at a place stands there.
    fn stands(&self, action: &[Written], of: Written) -> bool {
        let place = (of.space, of.address);
        let left = action.iter().rev().find(|other| (other.space, other.address) == place);
        // What nobody has written is 0.
        let held = self.kept.get(&place).copied().unwrap_or(0);
        left.is_none_or(|left| self.heard(Written { value: held, ..of }).value == left.value)
    }
}

/// Whether two words for one place have one sign, and neither is 0.
fn alike(one: Written, other: Written) -> bool {
    let sign = |of: Written| of.value.cast_signed().signum();
    (one.space, one.address, sign(one)) == (other.space, other.address, sign(other)) && one.value != 0
}
