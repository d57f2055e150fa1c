//! Stops that leave a run command standing: it acts again by the next setpoint, or once whatever has stopped the motor goes away.

use std::collections::BTreeMap;

use super::Check;
use crate::{
    format::{Action, Acts, Space, Spanned},
    written::Written,
};

/// What stands in the registers and coils of a drive.
type Standing = BTreeMap<(Space, u16), u16>;

impl Check<'_> {
    /// Behind each start a stop leaves no run word where it was written.
    pub(super) fn leaves_nothing_running(&mut self, name: &str, stop: &Spanned<Action>) {
        let file = self.file;
        let Some(command) = file.command.given() else { return };
        let written = standing(&file.writes(stop.get_ref()));
        let setpoint = file.setpoint.given().and_then(|of| file.named(of.get_ref().register.get_ref()));
        let is_setpoint = setpoint.and_then(|of| file.place(of)).is_some_and(|of| written.contains_key(&of));
        // What runs by an edge alone may have a stop of its own beside it. A setpoint is none: the next one runs the motor.
        if command.get_ref().acts == Acts::Edge && (!is_setpoint || file.starts_by_setpoint()) {
            return;
        }
        let starts: Vec<_> = file.actions().filter(|(of, _)| of.starts_with("start.")).collect();
        let left = starts.iter().find(|(_, start)| {
            let mut all = standing(&file.writes(start.get_ref()));
            all.extend(&written);
            all.into_iter().any(|((space, address), value)| file.runs(Written { space, address, value }))
        });
        let left = match left {
            Some((start, _)) => format!("the run command of {start}"),
            None if starts.is_empty() && !file.commanded().any(|of| written.contains_key(&of)) => {
                "the run words of [command]".to_owned()
            }
            None => return,
        };
        self.refuse(
            &stop.span(),
            format!("{name} leaves {left} standing: the next setpoint, or the end of what stops it, runs the motor"),
            "the one write that takes the run bit away; \"unknown\" where the drive has none",
        );
    }

    /// A drive of a run coil for each direction, or a register, whose other one a start leaves on: both on is a stop, or nobody knows what.
    pub(super) fn leaves_the_other_start(&mut self, name: &str, start: &Spanned<Action>) {
        let file = self.file;
        let other = if name == "start.forward" { &file.start.reverse } else { &file.start.forward };
        let is_level = file.command.given().is_some_and(|command| command.get_ref().acts != Acts::Edge);
        let Some(other) = other.given().filter(|_| is_level) else { return };
        let written = standing(&file.writes(start.get_ref()));
        let runs = |((space, address), value)| file.runs(Written { space, address, value });
        let left = standing(&file.writes(other.get_ref()));
        if left.into_iter().any(|(place, value)| !written.contains_key(&place) && runs((place, value))) {
            self.refuse(
                &start.span(),
                format!(
                    "{name} leaves the run command of the other start standing, and says both directions then"
                ),
                "all of them in its last step, such as coils = [true, false]",
            );
        }
    }

    /// The one bit of a stop stands in the word of one start and not in that of the other: a bit too many. Where the run command itself
    /// has it, as below operation enabled, or both starts do, it belongs there; so do the bits of a stop that takes one away.
    pub(super) fn stands_in_no_start(&mut self, name: &str, stop: &Spanned<Action>) {
        let file = self.file;
        let (Some(forward), Some(reverse)) = (file.start.forward.given(), file.start.reverse.given()) else {
            return;
        };
        // Several coils or registers that stop together are no one bit.
        let [word] = file.writes(stop.get_ref())[..] else { return };
        let holds = |start: &Spanned<Action>| {
            let left = standing(&file.writes(start.get_ref())).get(&(word.space, word.address)).copied();
            left.map(|left| (left, word.value.is_power_of_two() && left & word.value == word.value))
        };
        let (start, spanned, (left, _)) = match (holds(forward), holds(reverse)) {
            (Some(it @ (_, true)), Some((_, false))) => ("start.forward", forward, it),
            (Some((_, false)), Some(it @ (_, true))) => ("start.reverse", reverse, it),
            _ => return,
        };
        let needed = file.needed_to_run(Written { value: left, ..word });
        if word.value & !needed != 0 {
            self.refuse(
                &spanned.span(),
                format!("{start} writes {left:04X}h, which holds the bit of {name} ({:04X}h), as the other start does not", word.value),
                "the word of the start without the bit of the stop",
            );
        }
    }
}

fn standing(written: &[Written]) -> Standing {
    written.iter().map(|of| ((of.space, of.address), of.value)).collect()
}
