//! Stops that leave a run command standing: it acts again by the next setpoint, or once whatever has stopped the motor goes away.

use std::collections::BTreeMap;

use super::Check;
use crate::{
    format::{Action, Acts, Space, Spanned},
    profile::Written,
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
}

fn standing(written: &[Written]) -> Standing {
    written.iter().map(|of| ((of.space, of.address), of.value)).collect()
}
